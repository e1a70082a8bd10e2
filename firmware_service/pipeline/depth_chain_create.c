/* Parameters to objects and memory. */
#include "pipeline/depth_chain_internal.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"

struct shef_depth_params shef_depth_default_params(void)
{
    return (struct shef_depth_params){
        .profile = "wide",
        .pixels = SHEF_FRAME_MONO8,
        .mode = SHEF_DEPTH_COMBINED,
        .lag_px = SHEF_DEPTH_LAG_PX,
        .travel_m = 0.010,
        .least_speed_m_s = 0.005,
        .searches_flow = true,
        .align_auto = true,
    };
}

const struct depth_mode depth_modes[SHEF_DEPTH_N_MODES] = {
    [SHEF_DEPTH_PAPER_DS] = { "paper-ds", SHEF_EDGE_UNSIGNED, .is_paper = true },
    [SHEF_DEPTH_PAPER_DP] = { "paper-dp", SHEF_EDGE_UNSIGNED, .is_paper = true },
    [SHEF_DEPTH_UNSIGNED] = { "unsigned", SHEF_EDGE_UNSIGNED },
    [SHEF_DEPTH_TERNARY] = { "ternary", SHEF_EDGE_TERNARY, .needs_direction = true },
    [SHEF_DEPTH_GRADED] = { "graded", SHEF_EDGE_GRADED, .needs_direction = true },
    [SHEF_DEPTH_TEMPORAL] = { "temporal", SHEF_EDGE_GRADED, .needs_past = true },
    [SHEF_DEPTH_COMBINED] = { "combined", SHEF_EDGE_GRADED, .needs_direction = true,
                              .needs_past = true },
};

const char *shef_depth_mode_name(enum shef_depth_mode mode)
{
    return depth_modes[mode].name;
}

static enum shef_err check(const struct shef_depth_params *params, struct shef_error *err)
{
    if (!(params->lag_px >= 0 && params->lag_px <= 8))
        return shef_fail(err, SHEF_ERR_INVALID, "depth: a lag of %g px, must be 0 to 8",
                         params->lag_px);
    if (!(params->travel_m >= 0.001 && params->travel_m <= 0.1))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "depth: temporal pairs over %g m of travel, must be 0.001 to 0.1",
                         params->travel_m);
    if (params->max_disparity_px < 0 || params->max_disparity_px > 256)
        return shef_fail(err, SHEF_ERR_INVALID, "depth: disparities up to %d px, must be 16 to 256",
                         params->max_disparity_px);
    if (!(params->least_speed_m_s >= 1e-6 && params->least_speed_m_s <= 1))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "depth: a camera stands below %g m/s, must be 1e-6 to 1",
                         params->least_speed_m_s);
    if (params->mode >= SHEF_DEPTH_N_MODES)
        return shef_fail(err, SHEF_ERR_INVALID, "depth: there is no mode %d", (int)params->mode);
    return SHEF_OK;
}

/* The kinds of maps that the listed modes need. */
static bool needs_kind(const struct shef_depth_chain *chain, enum shef_edge_kind kind)
{
    for (int mode = 0; mode < SHEF_DEPTH_N_MODES; mode++)
        if ((chain->params.modes >> mode & 1) && depth_modes[mode].kind == kind)
            return true;
    return false;
}

/* Profiles of about 1.3 px per milliradian have windows and ranges of their own. */
static bool is_fine(const struct shef_depth_chain *chain)
{
    return chain->geometry.f_px > 900;
}

static enum shef_err set_geometry(struct shef_depth_chain *chain,
                                  const struct shef_calibration *calibration,
                                  struct shef_error *err)
{
    struct shef_depth_geometry *geometry = &chain->geometry;
    enum shef_err code = shef_rectification_pair(calibration, chain->params.profile, &chain->left,
                                                 &chain->right, &geometry->baseline_m, err);

    if (code != SHEF_OK)
        return code;
    geometry->width_px = chain->left.width_px;
    geometry->height_px = chain->left.height_px;
    geometry->f_px = chain->left.f_px;
    geometry->cx_px = chain->left.cx_px;
    geometry->cy_px = chain->left.cy_px;
    memcpy(geometry->r_camera_rectified, chain->left.r_camera_rectified,
           sizeof geometry->r_camera_rectified);
    geometry->max_disparity_px = chain->params.max_disparity_px;
    /* A level less than a multiple of 16: the matcher rounds up to more. */
    if (geometry->max_disparity_px == 0)
        geometry->max_disparity_px = is_fine(chain) ? 110 : 47;

    const double frame_s = (double)calibration->frame_delay.sigma_ns * 1e-9;
    const double event_s = (double)calibration->event_delay.sigma_ns * 1e-9;

    chain->model = (struct shef_depth_model){
        .f_px = geometry->f_px,
        .baseline_m = geometry->baseline_m,
        .sigma_angle_rad = calibration->t_event_frame_sigma.rotation_rad,
        .sigma_baseline_m = calibration->t_event_frame_sigma.position_m,
        .sigma_time_s = sqrt(frame_s * frame_s + event_s * event_s),
    };
    return SHEF_OK;
}

static struct shef_robust_params robust_params(const struct shef_depth_chain *chain,
                                               enum shef_edge_kind kind)
{
    const struct shef_depth_geometry *geometry = &chain->geometry;
    struct shef_robust_params params =
        shef_robust_defaults(geometry->width_px, geometry->height_px, kind);

    params.max_disparity_px = geometry->max_disparity_px;
    params.use_past = chain->params.smooths_in_time;
    if (!is_fine(chain)) {
        /* Logistic regression of P(|error| <= 1 px) on rendered recordings of four scenes. */
        static const struct {
            double scale, offset;
        } confidence[N_KINDS] = {
            [SHEF_EDGE_UNSIGNED] = { 1.28, -0.03 },
            [SHEF_EDGE_TERNARY] = { 1.32, -0.04 },
            [SHEF_EDGE_GRADED] = { 1.16, 1.43 },
        };
        const bool is_graded = kind == SHEF_EDGE_GRADED;

        params.confidence_scale = confidence[kind].scale;
        params.confidence_offset = confidence[kind].offset;
        params.step_px = 1;
        params.window_width_cells = is_graded ? 5 : 11;
        params.window_height_cells = is_graded ? 5 : 11;
        params.p1 = 360;
        params.p2 = is_graded ? 1200 : 2000;
        params.score_weight = 16;
        params.jump_reach_px = 4;
    }
    return params;
}

static enum shef_err create_matchers(struct shef_depth_chain *chain, uint32_t cpu_features,
                                     struct shef_error *err)
{
    const struct shef_robust *lender = NULL;

    for (int kind = 0; kind < N_KINDS; kind++) {
        const struct shef_robust_params params = robust_params(chain, (enum shef_edge_kind)kind);

        if (!needs_kind(chain, (enum shef_edge_kind)kind))
            continue;
        /* One frame is matched in one mode, so one matcher's volumes do for all. */
        chain->robust[kind] =
            shef_robust_create_beside(&params, cpu_features, chain->workers, lender, err);
        if (!chain->robust[kind])
            return err ? err->code : SHEF_ERR_NO_MEMORY;
        lender = lender ? lender : chain->robust[kind];
        chain->memory_bytes += shef_robust_memory_bytes(chain->robust[kind]);
        if (chain->params.align_auto)
            shef_robust_align_auto(chain->robust[kind]);
    }
    for (int i = 0; i < N_PAPER; i++) {
        struct shef_paper_params params;
        enum shef_err code = shef_paper_preset(depth_modes[i].name, &params, err);

        if (!(chain->params.modes >> i & 1))
            continue;
        params.d_max = chain->geometry.max_disparity_px;
        if (!is_fine(chain)) /* The presets' windows are for f = 1301 px. */
            params.window_px = params.window_px > 100 ? 51 : 21;
        if (code == SHEF_OK)
            code = shef_paper_create(&chain->paper[i], chain->geometry.width_px,
                                     chain->geometry.height_px, &params, cpu_features,
                                     chain->workers, err);
        if (code != SHEF_OK)
            return code;
        chain->memory_bytes += shef_paper_bytes(chain->paper[i]);
    }
    return SHEF_OK;
}

static enum shef_err create_map(struct shef_depth_chain *chain, struct shef_edge_map *map,
                                enum shef_edge_kind kind, struct shef_error *err)
{
    const int32_t width_px = chain->geometry.width_px;
    const int32_t height_px = chain->geometry.height_px;

    chain->memory_bytes +=
        (size_t)width_px * (size_t)height_px / (kind == SHEF_EDGE_GRADED ? 1 : 8);
    return shef_edge_map_create(map, kind, width_px, height_px, err);
}

static enum shef_err create_maps(struct shef_depth_chain *chain, struct shef_error *err)
{
    enum shef_err code = create_map(chain, &chain->edges, SHEF_EDGE_UNSIGNED, err);

    if (code == SHEF_OK && needs_kind(chain, SHEF_EDGE_UNSIGNED))
        code = create_map(chain, &chain->unsigned_right, SHEF_EDGE_UNSIGNED, err);
    if (code == SHEF_OK && needs_kind(chain, SHEF_EDGE_TERNARY)) {
        code = create_map(chain, &chain->ternary_left, SHEF_EDGE_TERNARY, err);
        if (code == SHEF_OK)
            code = create_map(chain, &chain->ternary_right, SHEF_EDGE_TERNARY, err);
    }
    const bool has_graded = needs_kind(chain, SHEF_EDGE_GRADED);

    if (code == SHEF_OK && !has_graded && chain->params.searches_flow)
        code = create_map(chain, &chain->graded_right[0], SHEF_EDGE_GRADED, err);
    for (int i = 0; i < 2 && code == SHEF_OK && has_graded; i++) {
        code = create_map(chain, &chain->graded_left[i], SHEF_EDGE_GRADED, err);
        if (code == SHEF_OK)
            code = create_map(chain, &chain->graded_right[i], SHEF_EDGE_GRADED, err);
    }
    for (int i = 0; i < N_SCRATCH && code == SHEF_OK; i++) {
        code = shef_image_create_f32(&chain->scratch[i], chain->geometry.width_px,
                                     chain->geometry.height_px, err);
        chain->memory_bytes +=
            (size_t)chain->scratch[i].stride_bytes * (size_t)chain->geometry.height_px;
    }
    return code;
}

static enum shef_err create_sides(struct shef_depth_chain *chain, uint32_t cpu_features,
                                  struct shef_error *err)
{
    const struct shef_frame_edges_params frame_edges = shef_frame_edges_default_params();
    enum shef_err code = shef_frame_rectify_create(&chain->rectify, &chain->left,
                                                   chain->params.pixels, cpu_features, err);

    if (code == SHEF_OK)
        code = shef_frame_edges_create(&chain->frame_edges, &chain->left,
                                       shef_frame_rectify_valid(chain->rectify), &frame_edges,
                                       cpu_features, err);
    if (code == SHEF_OK)
        code = shef_warp_map_create(&chain->map, &chain->right, err);
    if (code == SHEF_OK)
        code = shef_warp_shift_create(&chain->shift, &chain->map, err);
    for (int kind = 0; kind < N_KINDS && code == SHEF_OK; kind++) {
        const struct shef_event_edges_params params =
            shef_event_edges_default_params((enum shef_edge_kind)kind);

        const bool is_searched = kind == SHEF_EDGE_GRADED && chain->params.searches_flow;

        if (needs_kind(chain, (enum shef_edge_kind)kind) || is_searched)
            code = shef_event_edges_create(&chain->event_edges[kind], &chain->map, &params,
                                           cpu_features, err);
    }
    if (code == SHEF_OK && chain->params.searches_flow) {
        const struct shef_flow_search_params search = shef_flow_search_default_params(&chain->left);

        code = shef_flow_search_create(&chain->search, &chain->left, &search, cpu_features, err);
    }
    if (code == SHEF_OK)
        code = depth_history_create(&chain->history, chain->geometry.width_px,
                                    chain->geometry.height_px, chain->right.sensor_width_px,
                                    chain->right.sensor_height_px, err);
    chain->memory_bytes += chain->history.memory_bytes;
    return code;
}

enum shef_err shef_depth_chain_create(struct shef_depth_chain **out_chain,
                                      const struct shef_calibration *calibration,
                                      const struct shef_depth_params *params,
                                      struct shef_workers *workers, uint32_t cpu_features,
                                      struct shef_error *err)
{
    enum shef_err code = check(params, err);

    if (code != SHEF_OK)
        return code;

    struct shef_depth_chain *chain = shef_memory_create(1, sizeof *chain);

    if (!chain)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "depth: out of memory");
    chain->params = *params;
    chain->params.modes |= 1u << params->mode;
    chain->mode = params->mode;
    chain->workers = workers;
    code = set_geometry(chain, calibration, err);
    if (code == SHEF_OK)
        code = create_sides(chain, cpu_features, err);
    if (code == SHEF_OK)
        code = create_maps(chain, err);
    if (code == SHEF_OK)
        code = create_matchers(chain, cpu_features, err);
    if (code == SHEF_OK) {
        chain->rows = shef_rows_pick(cpu_features);
        chain->edge_rows = shef_memory_create((size_t)chain->geometry.width_px, N_BANDS);
        if (!chain->edge_rows)
            code = shef_fail(err, SHEF_ERR_NO_MEMORY, "depth: out of memory");
    }
    chain->params.profile = NULL;
    if (code != SHEF_OK) {
        shef_depth_chain_destroy(chain);
        return code;
    }
    *out_chain = chain;
    return SHEF_OK;
}

void shef_depth_chain_destroy(struct shef_depth_chain *chain)
{
    if (!chain)
        return;
    for (int i = 0; i < N_PAPER; i++)
        shef_paper_destroy(chain->paper[i]);
    /* The first lends its volumes, so it goes last. */
    for (int kind = N_KINDS - 1; kind >= 0; kind--) {
        shef_robust_destroy(chain->robust[kind]);
        shef_event_edges_destroy(chain->event_edges[kind]);
    }
    shef_edge_map_destroy(&chain->edges);
    shef_edge_map_destroy(&chain->unsigned_right);
    shef_edge_map_destroy(&chain->ternary_left);
    shef_edge_map_destroy(&chain->ternary_right);
    for (int i = 0; i < 2; i++) {
        shef_edge_map_destroy(&chain->graded_left[i]);
        shef_edge_map_destroy(&chain->graded_right[i]);
    }
    for (int i = 0; i < N_SCRATCH; i++)
        shef_image_destroy_f32(&chain->scratch[i]);
    depth_history_destroy(&chain->history);
    shef_flow_search_destroy(chain->search);
    shef_warp_shift_destroy(&chain->shift);
    shef_warp_map_destroy(&chain->map);
    shef_frame_edges_destroy(chain->frame_edges);
    shef_frame_rectify_destroy(chain->rectify);
    free(chain->edge_rows);
    free(chain);
}

enum shef_err shef_depth_output_create(struct shef_depth_output *out_output,
                                       const struct shef_depth_geometry *geometry, bool has_dense,
                                       struct shef_error *err)
{
    struct shef_depth_output output = { { 0 } };
    struct shef_image_f32 *const images[] = {
        &output.disparity, &output.confidence,      &output.depth_m,
        &output.sigma_m,   &output.dense_disparity, &output.dense_confidence,
    };
    const size_t n = has_dense ? 6 : 4;

    for (size_t i = 0; i < n; i++) {
        const enum shef_err code =
            shef_image_create_f32(images[i], geometry->width_px, geometry->height_px, err);

        if (code != SHEF_OK) {
            shef_depth_output_destroy(&output);
            return code;
        }
    }
    *out_output = output;
    return SHEF_OK;
}

void shef_depth_output_destroy(struct shef_depth_output *output)
{
    shef_image_destroy_f32(&output->disparity);
    shef_image_destroy_f32(&output->confidence);
    shef_image_destroy_f32(&output->depth_m);
    shef_image_destroy_f32(&output->sigma_m);
    shef_image_destroy_f32(&output->dense_disparity);
    shef_image_destroy_f32(&output->dense_confidence);
}
