/* The order of the stages and what one pair leaves to the next. */
#include "pipeline/robust_internal.h"

#include <assert.h>
#include <math.h>

#include "core/clock.h"

/* On the authors' pairs, edge counts in 16x16 px blocks correlate at 0.94 or more from one pair to
 * the next, at 0.86 or more five pairs apart, and at 0.2 to 0.34 between scenes. */
#define CUT_CORRELATION 0.5

/* A residual drifts over minutes: live, every 16th row of a pair tells enough. The first pairs
 * are read four times as densely. */
#define OBSERVE_ROW_STEP       16
#define OBSERVE_FIRST_ROW_STEP 4
#define OBSERVE_FIRST_PAIRS    8

const char *shef_robust_stage_name(enum shef_robust_stage stage)
{
    static const char *const names[SHEF_ROBUST_N_STAGES] = {
        [SHEF_ROBUST_PREPARE] = "prepare",     [SHEF_ROBUST_CORRELATE] = "correlate",
        [SHEF_ROBUST_AGGREGATE] = "aggregate", [SHEF_ROBUST_READ_OUT] = "read_out",
        [SHEF_ROBUST_OBSERVE] = "observe",
    };

    return names[stage];
}

static int64_t now_ns(void)
{
    return shef_clock_now(shef_clock_monotonic()).ns;
}

void shef_robust_align_auto(struct shef_robust *matcher)
{
    matcher->align_mode = ALIGN_AUTO;
    matcher->has_alignment = false;
    matcher->is_align_started = false;
    matcher->alignment_spread_px = 0.0;
    shef_align_init(&matcher->align, matcher->params.width_px, matcher->params.height_px);
}

static bool is_for_size(const struct shef_smooth_field *field,
                        const struct shef_robust_params *params)
{
    return field->width_px == params->width_px && field->height_px == params->height_px;
}

void shef_robust_align_fixed(struct shef_robust *matcher, const struct shef_smooth_field *field)
{
    assert(!field || is_for_size(field, &matcher->params));
    matcher->align_mode = ALIGN_FIXED;
    matcher->has_alignment = field != NULL;
    matcher->alignment_spread_px = 0.0;
    if (field)
        matcher->alignment = *field;
}

void shef_robust_set_bias(struct shef_robust *matcher, const struct shef_smooth_field *bias)
{
    assert(!bias || is_for_size(bias, &matcher->params));
    matcher->has_bias = bias != NULL;
    if (bias)
        matcher->bias = *bias;
}

void shef_robust_set_max_disparity(struct shef_robust *matcher, int32_t max_disparity_px)
{
    assert(max_disparity_px >= 16 && max_disparity_px <= matcher->params.max_disparity_px);
    /* Rows are laid out for the largest range; fewer lanes leave their ends unused. */
    robust_shape_set_levels(&matcher->shape, max_disparity_px / matcher->params.step_px);
}

void shef_robust_reset(struct shef_robust *matcher)
{
    matcher->has_past = false;
}

static int32_t edge_strength(const int8_t *values)
{
    int32_t sum = 0;

    for (int32_t x = 0; x < THUMBNAIL_PX; x++)
        sum += values[x] < 0 ? -values[x] : values[x];
    return sum;
}

/* Edge strength of the left view in blocks, on every fourth row. */
static void fill_thumbnail(struct shef_robust *matcher)
{
    const struct shef_image_i8 left = matcher->views[0].left;
    const struct shef_image_u16 thumbnail = matcher->grids[matcher->current].thumbnail;

    for (int32_t y = 0; y < thumbnail.height_px; y++)
        for (int32_t x = 0; x < thumbnail.width_px; x++) {
            int32_t sum = 0;

            for (int32_t row = 0; row < THUMBNAIL_PX; row += 4)
                sum += edge_strength(shef_row_i8(left, y * THUMBNAIL_PX + row) + x * THUMBNAIL_PX);
            shef_row_u16(thumbnail, y)[x] = (uint16_t)sum;
        }
}

/* Whether the left view no longer shows what it showed: its blocks do not correlate. */
static bool is_scene_cut(const struct shef_robust *matcher)
{
    const struct shef_image_u16 now = matcher->grids[matcher->current].thumbnail;
    const struct shef_image_u16 past = matcher->grids[!matcher->current].thumbnail;
    double n = 0, a = 0, b = 0, aa = 0, bb = 0, ab = 0;

    for (int32_t y = 0; y < now.height_px; y++)
        for (int32_t x = 0; x < now.width_px; x++) {
            const double u = shef_row_u16(now, y)[x];
            const double v = shef_row_u16(past, y)[x];

            n += 1;
            a += u;
            b += v;
            aa += u * u;
            bb += v * v;
            ab += u * v;
        }
    return ab - a * b / n < CUT_CORRELATION * sqrt((aa - a * a / n) * (bb - b * b / n));
}

static void run_stage(struct shef_robust *matcher, shef_task_fn *stage, int32_t n_tasks)
{
    shef_workers_run(matcher->workers, stage, matcher, n_tasks);
}

static void correlate(struct shef_robust *matcher, int64_t *prepare_ns, int64_t *correlate_ns)
{
    for (matcher->view = 0; matcher->view < matcher->n_pairs; matcher->view++) {
        const int64_t start = now_ns();

        run_stage(matcher, robust_pairs_task, matcher->n_chunks);
        const int64_t prepared = now_ns();
        run_stage(matcher, robust_correlate_task, matcher->n_chunks);
        *prepare_ns += prepared - start;
        *correlate_ns += now_ns() - prepared;
    }
}

/* Everything from bytes to the winners of this pair. */
static void match_grid(struct shef_robust *matcher, int64_t stage_ns[])
{
    correlate(matcher, &stage_ns[SHEF_ROBUST_PREPARE], &stage_ns[SHEF_ROBUST_CORRELATE]);

    const int64_t start = now_ns();

    run_stage(matcher, robust_aggregate_task, robust_n_strips(matcher));
    stage_ns[SHEF_ROBUST_AGGREGATE] += now_ns() - start;
}

static void observe_alignment(struct shef_robust *matcher, int32_t row_step)
{
    struct shef_smooth_field field;

    shef_align_observe(&matcher->align, matcher->views[0].left, matcher->views[0].right,
                       matcher->grids[matcher->current].disparity, row_step);
    if (shef_align_solve(&matcher->align, &field, &matcher->alignment_spread_px) == SHEF_OK) {
        matcher->alignment = field;
        matcher->has_alignment = true;
    }
}

static double edge_share(const struct shef_edge_map *map)
{
    return (double)shef_edge_map_count(map) / ((double)map->width_px * map->height_px);
}

static void check_pairs(const struct shef_robust *matcher, const struct shef_edge_pair *pairs,
                        int32_t n_pairs)
{
    assert(n_pairs == 1 || n_pairs == 2);
    for (int32_t i = 0; i < n_pairs; i++) {
        const struct shef_edge_map *const maps[2] = { pairs[i].left, pairs[i].right };

        for (int j = 0; j < 2; j++) {
            assert(maps[j]->kind == matcher->params.kind);
            assert(maps[j]->width_px == matcher->params.width_px);
            assert(maps[j]->height_px == matcher->params.height_px);
        }
        assert(!pairs[i].picture.data || (pairs[i].picture.width_px == matcher->params.width_px &&
                                          pairs[i].picture.height_px == matcher->params.height_px));
    }
}

static void check_output(const struct shef_robust *matcher, const struct shef_robust_output *output)
{
    const struct shef_image_f32 images[] = { output->disparity, output->confidence,
                                             output->dense_disparity, output->dense_confidence };

    for (size_t i = 0; i < sizeof images / sizeof images[0]; i++)
        assert(!images[i].data || (images[i].width_px == matcher->params.width_px &&
                                   images[i].height_px == matcher->params.height_px));
}

void shef_robust_match(struct shef_robust *matcher, const struct shef_edge_pair *pairs,
                       int32_t n_pairs, int64_t number, const struct shef_robust_output *output,
                       struct shef_robust_report *report)
{
    check_pairs(matcher, pairs, n_pairs);
    check_output(matcher, output);

    int64_t start = now_ns();
    struct shef_robust_report local = { .right_share = edge_share(pairs[0].right) };
    int64_t *stage_ns = local.stage_ns;

    matcher->pairs = pairs;
    matcher->n_pairs = n_pairs;
    matcher->output = output;
    local.is_saturated = local.right_share > matcher->params.saturated_share;
    matcher->prior_cost_per_px = local.is_saturated ? matcher->params.saturated_cost_per_px
                                                    : matcher->params.prior_cost_per_px;

    for (matcher->view = 0; matcher->view < n_pairs; matcher->view++)
        run_stage(matcher, robust_bytes_task, matcher->n_chunks);
    fill_thumbnail(matcher);
    const bool is_next = matcher->has_past && number == matcher->past_number + 1;
    local.is_cut = is_next && is_scene_cut(matcher);
    matcher->uses_past = is_next && !local.is_cut && matcher->params.use_past;
    local.used_past = matcher->uses_past;
    stage_ns[SHEF_ROBUST_PREPARE] = now_ns() - start;

    if (matcher->align_mode == ALIGN_AUTO && !matcher->is_align_started) {
        match_grid(matcher, stage_ns);
        observe_alignment(matcher, 1);
        /* Unaligned disparities are poor witnesses: the field stays, their sums do not. */
        shef_align_init(&matcher->align, matcher->params.width_px, matcher->params.height_px);
        matcher->is_align_started = true;
    }
    match_grid(matcher, stage_ns);
    local.alignment = matcher->has_alignment
                          ? matcher->alignment
                          : (struct shef_smooth_field){ .width_px = matcher->params.width_px,
                                                        .height_px = matcher->params.height_px };
    local.alignment_spread_px = matcher->alignment_spread_px;

    start = now_ns();
    robust_begin_read_out(matcher);
    run_stage(matcher, robust_confidence_task, matcher->n_chunks);
    run_stage(matcher, robust_pixels_task, matcher->n_chunks);
    if (matcher->params.jump_reach_px > 0) {
        run_stage(matcher, robust_settle_columns_task, robust_n_column_tasks(matcher));
        run_stage(matcher, robust_finish_task, matcher->n_chunks);
    }
    stage_ns[SHEF_ROBUST_READ_OUT] = now_ns() - start;

    start = now_ns();
    if (matcher->align_mode == ALIGN_AUTO)
        observe_alignment(matcher, matcher->align.n_observed < OBSERVE_FIRST_PAIRS
                                       ? OBSERVE_FIRST_ROW_STEP
                                       : OBSERVE_ROW_STEP);
    stage_ns[SHEF_ROBUST_OBSERVE] = now_ns() - start;

    matcher->current = !matcher->current;
    matcher->has_past = true;
    matcher->past_number = number;
    if (report)
        *report = local;
}
