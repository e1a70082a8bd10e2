/* The order of the stages, and which mode is possible. */
#include "pipeline/depth_chain_internal.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "core/clock.h"

/* Both pairs of the combined mode, in the order in which the matcher gets them. */
enum { ALONG, TEMPORAL };

const char *shef_depth_stage_name(enum shef_depth_stage stage)
{
    static const char *const names[SHEF_DEPTH_N_STAGES] = {
        [SHEF_DEPTH_PICTURES] = "pictures",
        [SHEF_DEPTH_FLOW] = "flow",
        [SHEF_DEPTH_MATCH] = "match",
        [SHEF_DEPTH_CONVERT] = "convert",
    };

    return names[stage];
}

static int64_t now_ns(void)
{
    return shef_clock_now(shef_clock_monotonic()).ns;
}

struct shef_depth_geometry shef_depth_chain_geometry(const struct shef_depth_chain *chain)
{
    return chain->geometry;
}

size_t shef_depth_chain_memory_bytes(const struct shef_depth_chain *chain)
{
    return chain->memory_bytes;
}

enum shef_err shef_depth_chain_set_mode(struct shef_depth_chain *chain, enum shef_depth_mode mode)
{
    if (mode >= SHEF_DEPTH_N_MODES || !(chain->params.modes >> mode & 1))
        return SHEF_ERR_INVALID;
    chain->mode = mode;
    return SHEF_OK;
}

void shef_depth_chain_set_shed(struct shef_depth_chain *chain, uint32_t shed)
{
    const bool halves = (shed & SHEF_DEPTH_SHED_HALF_RANGE) != 0;
    const int32_t whole_px = chain->geometry.max_disparity_px;

    chain->shed = shed;
    for (int kind = 0; kind < N_KINDS; kind++)
        if (chain->robust[kind])
            shef_robust_set_max_disparity(chain->robust[kind], halves ? whole_px / 2 : whole_px);
}

void shef_depth_chain_reset(struct shef_depth_chain *chain)
{
    depth_history_clear(&chain->history);
    for (int kind = 0; kind < N_KINDS; kind++)
        if (chain->robust[kind])
            shef_robust_reset(chain->robust[kind]);
}

/* The mode, or the next best one. */
static enum shef_depth_mode possible_mode(struct shef_depth_chain *chain,
                                          struct shef_depth_report *report)
{
    enum shef_depth_mode mode = chain->mode;

    if (mode == SHEF_DEPTH_COMBINED && (chain->shed & SHEF_DEPTH_SHED_SINGLE)) {
        mode = SHEF_DEPTH_GRADED;
        report->shed |= SHEF_DEPTH_SHED_SINGLE;
    }
    if (depth_modes[mode].needs_past && !chain->earlier)
        mode = SHEF_DEPTH_GRADED;
    if (!chain->lag && chain->earlier && (mode == SHEF_DEPTH_COMBINED || mode == SHEF_DEPTH_GRADED))
        mode = SHEF_DEPTH_TEMPORAL;
    return mode;
}

static void make_left(struct shef_depth_chain *chain)
{
    const struct depth_past *now = chain->now;
    struct shef_frame_edges *edges = chain->frame_edges;

    if (!chain->is_rectified)
        shef_frame_rectify_run(chain->rectify, chain->input->frame, now->picture);
    shef_frame_edges_unsigned(edges, now->picture, &chain->edges);
    if (chain->used == SHEF_DEPTH_TERNARY)
        shef_frame_edges_along(edges, now->picture, chain->direction, &chain->ternary_left);
    if (chain->used == SHEF_DEPTH_GRADED || chain->used == SHEF_DEPTH_COMBINED)
        shef_frame_edges_along(edges, now->picture, chain->direction, &chain->graded_left[ALONG]);
    if (chain->used == SHEF_DEPTH_TEMPORAL || chain->used == SHEF_DEPTH_COMBINED)
        shef_frame_edges_temporal(edges, chain->earlier->picture, now->picture,
                                  &chain->graded_left[TEMPORAL]);
}

static void make_right(struct shef_depth_chain *chain)
{
    const enum shef_edge_kind kind = depth_modes[chain->used].kind;
    struct shef_event_edges *edges = chain->event_edges[kind];
    const struct shef_image_i16 values = chain->input->snapshot->values;

    if (kind == SHEF_EDGE_UNSIGNED)
        shef_event_edges_of_values(edges, values, chain->lag, &chain->unsigned_right);
    if (kind == SHEF_EDGE_TERNARY)
        shef_event_edges_of_values(edges, values, chain->lag, &chain->ternary_right);
    if (chain->used == SHEF_DEPTH_GRADED || chain->used == SHEF_DEPTH_COMBINED)
        shef_event_edges_of_values(edges, values, chain->lag, &chain->graded_right[ALONG]);
    if (chain->used == SHEF_DEPTH_TEMPORAL || chain->used == SHEF_DEPTH_COMBINED)
        shef_event_edges_of_pair(edges, chain->earlier->sums, chain->now->sums, chain->lag,
                                 &chain->graded_right[TEMPORAL]);
}

static void side_task(void *context, int32_t task, int32_t worker)
{
    (void)worker;
    if (task == 0)
        make_left(context);
    else
        make_right(context);
}

static void set_pairs(struct shef_depth_chain *chain)
{
    const struct shef_edge_pair along = { &chain->graded_left[ALONG], &chain->graded_right[ALONG] };
    const struct shef_edge_pair temporal = { &chain->graded_left[TEMPORAL],
                                             &chain->graded_right[TEMPORAL] };

    chain->n_pairs = 1;
    switch (chain->used) {
    case SHEF_DEPTH_TERNARY:
        chain->pairs[0] = (struct shef_edge_pair){ &chain->ternary_left, &chain->ternary_right };
        break;
    case SHEF_DEPTH_GRADED:
        chain->pairs[0] = along;
        break;
    case SHEF_DEPTH_TEMPORAL:
        chain->pairs[0] = temporal;
        break;
    case SHEF_DEPTH_COMBINED:
        chain->pairs[0] = along;
        chain->pairs[1] = temporal;
        chain->n_pairs = 2;
        break;
    default:
        chain->pairs[0] = (struct shef_edge_pair){ &chain->edges, &chain->unsigned_right };
    }
    chain->pairs[0].picture = chain->now->picture;
}

/* Estimates everywhere, into the caller's dense images or scratch ones. */
static void match(struct shef_depth_chain *chain, const struct shef_depth_output *output,
                  struct shef_depth_report *report)
{
    const bool has_dense = output->dense_disparity.data && !(chain->shed & SHEF_DEPTH_SHED_DENSE);
    const struct shef_robust_output to = {
        .dense_disparity = has_dense ? output->dense_disparity : chain->scratch[0],
        .dense_confidence = has_dense ? output->dense_confidence : chain->scratch[1],
    };

    shef_robust_match(chain->robust[depth_modes[chain->used].kind], chain->pairs, chain->n_pairs,
                      chain->input->number, &to, &report->match);
    if (report->match.is_saturated)
        report->flags |= SHEF_DEPTH_IS_SATURATED;
    if (output->dense_disparity.data)
        report->shed |= chain->shed & SHEF_DEPTH_SHED_DENSE;
    report->shed |= chain->shed & SHEF_DEPTH_SHED_HALF_RANGE;
    chain->everywhere = to.dense_disparity;
    chain->how_sure = to.dense_confidence;
}

static void match_paper(struct shef_depth_chain *chain, const struct shef_depth_output *output,
                        struct shef_depth_report *report)
{
    const enum shef_err code = shef_paper_match(chain->paper[chain->used], &chain->edges,
                                                &chain->unsigned_right, output->disparity, NULL);

    assert(code == SHEF_OK);
    (void)code;
    report->flags |= SHEF_DEPTH_NO_CONFIDENCE;
    chain->everywhere.data = NULL;
}

/* What is at the frame's edges in one row: disparity and confidence, depth and sigma. */
static int64_t finish_row(const struct shef_depth_chain *chain, int32_t y, int8_t *edge_row)
{
    const struct shef_depth_output *output = chain->output;
    const double velocity = chain->input->has_velocity ? chain->input->velocity_m_s[0] : 0;
    const struct shef_depth_terms terms = shef_depth_terms_of(&chain->model, velocity);
    const int32_t width = chain->geometry.width_px;
    float *disparity = shef_row_f32(output->disparity, y);
    float *confidence = shef_row_f32(output->confidence, y);
    int32_t n = 0;

    if (chain->everywhere.data) {
        shef_edge_map_row(&chain->edges, y, edge_row);
        chain->rows->keep_edges(edge_row, shef_row_f32(chain->everywhere, y), width, disparity);
        chain->rows->keep_edges(edge_row, shef_row_f32(chain->how_sure, y), width, confidence);
    } else {
        for (int32_t x = 0; x < width; x++)
            confidence[x] = disparity[x] > 0 ? 1 : 0;
    }
    chain->rows->depth(&terms, disparity, confidence, width, shef_row_f32(output->depth_m, y),
                       shef_row_f32(output->sigma_m, y));
    for (int32_t x = 0; x < width; x++)
        n += disparity[x] > 0;
    return n;
}

static void finish_task(void *context, int32_t band, int32_t worker)
{
    struct shef_depth_chain *chain = context;
    const int32_t height = chain->geometry.height_px;
    int8_t *edge_row = chain->edge_rows + (ptrdiff_t)band * chain->geometry.width_px;

    (void)worker;
    chain->n_depths[band] = 0;
    for (int32_t y = band * height / N_BANDS; y < (band + 1) * height / N_BANDS; y++)
        chain->n_depths[band] += finish_row(chain, y, edge_row);
}

void shef_depth_chain_process(struct shef_depth_chain *chain, const struct shef_depth_input *input,
                              const struct shef_depth_output *output,
                              struct shef_depth_report *report)
{
    struct shef_depth_report local = { .t_err_ns = input->snapshot->t_err_ns };
    const int64_t start = now_ns();

    chain->input = input;
    chain->now = depth_history_add(&chain->history, input->number, input->snapshot);
    chain->is_rectified = false;
    depth_motion_find(chain, &local);
    const int64_t found = now_ns();

    chain->used = possible_mode(chain, &local);
    if (!depth_modes[chain->used].needs_past) {
        local.span_frames = 0;
        local.span_ns = 0;
        /* The filter alone is through with the first frame. */
        if (chain->earlier)
            local.flags &= ~SHEF_DEPTH_SETTLING;
    }
    shef_workers_run(chain->workers, side_task, chain, 2);
    set_pairs(chain);
    const int64_t pictured = now_ns();

    if (depth_modes[chain->used].is_paper)
        match_paper(chain, output, &local);
    else
        match(chain, output, &local);
    const int64_t matched = now_ns();

    chain->output = output;
    shef_workers_run(chain->workers, finish_task, chain, N_BANDS);
    for (int i = 0; i < N_BANDS; i++)
        local.n_depths += chain->n_depths[i];
    local.mode = chain->used;
    memcpy(local.direction, chain->direction, sizeof local.direction);
    local.n_edges = shef_edge_map_count(&chain->edges);
    local.stage_ns[SHEF_DEPTH_FLOW] = found - start;
    local.stage_ns[SHEF_DEPTH_PICTURES] = pictured - found;
    local.stage_ns[SHEF_DEPTH_MATCH] = matched - pictured;
    local.stage_ns[SHEF_DEPTH_CONVERT] = now_ns() - matched;
    if (report)
        *report = local;
}

struct shef_image_u8 shef_depth_chain_picture(const struct shef_depth_chain *chain)
{
    return chain->now->picture;
}

const struct shef_edge_map *shef_depth_chain_frame_edges(const struct shef_depth_chain *chain)
{
    return &chain->edges;
}

struct shef_edge_pair shef_depth_chain_pair(const struct shef_depth_chain *chain, int32_t pair)
{
    assert(pair >= 0 && pair < chain->n_pairs);
    return chain->pairs[pair];
}
