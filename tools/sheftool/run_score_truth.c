/* What of a frame is scored: its edges where the truth is known, how it moved, where depth jumps.
 */
#include <inttypes.h>
#include <math.h>
#include <string.h>

#include "sheftool/run_score_internal.h"

#define JUMP_PX       0.5 /* of disparity between neighbours, at FIGURE_F_PX */
#define JUMP_REACH_PX 5
#define STILL_M_S     0.002

/* True velocity of the left camera in rectified axes, from the poses around an instant. */
static void find_velocity(struct shef_run_scorer *scorer, const struct shef_truth_frame *frame)
{
    const struct shef_recorded_truth *truth = &scorer->truth;
    struct shef_depth_geometry geometry = { 0 };
    double speed[6] = { 0 };
    uint32_t after = 0;

    while (after < truth->n_poses &&
           shef_event_time_before(truth->poses[after].time, frame->middle))
        after++;
    if (after == 0)
        after = 1;
    if (after >= truth->n_poses)
        after = truth->n_poses - 1;
    memset(scorer->velocity_m_s, 0, sizeof scorer->velocity_m_s);
    if (truth->n_poses < 2)
        return;

    const struct shef_truth_pose *a = &truth->poses[after - 1];
    const struct shef_truth_pose *b = &truth->poses[after];
    const double span_s = (double)shef_event_time_since(b->time, a->time) * 1e-9;

    for (int i = 0; i < 3; i++)
        speed[i] = (b->t_world_hand.t_m[i] - a->t_world_hand.t_m[i]) / span_s;
    memcpy(geometry.r_camera_rectified, truth->left.r_camera_rectified,
           sizeof geometry.r_camera_rectified);
    shef_depth_velocity(&truth->calibration, &geometry, &frame->t_world_hand, speed,
                        scorer->velocity_m_s);
}

static enum shef_run_direction direction_of(const double v[3])
{
    if (fabs(v[0]) < STILL_M_S && fabs(v[1]) < STILL_M_S)
        return SHEF_RUN_STILL;
    if (fabs(v[0]) >= fabs(v[1]))
        return v[0] < 0 ? SHEF_RUN_LEFT : SHEF_RUN_RIGHT;
    return v[1] < 0 ? SHEF_RUN_UP : SHEF_RUN_DOWN;
}

static bool is_jump(float a, float b, float jump_px)
{
    return a > 0 && b > 0 && fabsf(a - b) > jump_px;
}

static void mark_around(uint8_t *marks, int32_t width, int32_t height, int32_t x, int32_t y)
{
    for (int32_t row = y - JUMP_REACH_PX; row <= y + JUMP_REACH_PX; row++)
        for (int32_t column = x - JUMP_REACH_PX; column <= x + JUMP_REACH_PX; column++)
            if (row >= 0 && row < height && column >= 0 && column < width)
                marks[(ptrdiff_t)row * width + column] = 1;
}

static void find_jumps(struct shef_run_scorer *scorer)
{
    const struct shef_image_f32 truth = scorer->maps.disparity;
    const float jump_px = (float)(JUMP_PX * scorer->truth.left.f_px / FIGURE_F_PX);

    memset(scorer->near_jump, 0, (size_t)truth.width_px * (size_t)truth.height_px);
    for (int32_t y = 0; y + 1 < truth.height_px; y++) {
        const float *row = shef_row_f32(truth, y);
        const float *below = shef_row_f32(truth, y + 1);

        for (int32_t x = 0; x + 1 < truth.width_px; x++)
            if (is_jump(row[x], row[x + 1], jump_px) || is_jump(row[x], below[x], jump_px))
                mark_around(scorer->near_jump, truth.width_px, truth.height_px, x, y);
    }
}

static void mark_scored(struct shef_run_scorer *scorer)
{
    int8_t edges[SHEF_PROFILE_MAX_SIDE_PX];

    for (int32_t y = 0; y < scorer->scored_truth.height_px; y++) {
        const float *disparity = shef_row_f32(scorer->maps.disparity, y);
        const uint8_t *mask = shef_row_u8(scorer->maps.mask, y);
        float *out = shef_row_f32(scorer->scored_truth, y);

        shef_edge_map_row(&scorer->map, y, edges);
        for (int32_t x = 0; x < scorer->scored_truth.width_px; x++) {
            const bool is_seen = (mask[x] & SHEF_TRUTH_VALID) && !(mask[x] & SHEF_TRUTH_OCCLUDED);

            out[x] = is_seen && edges[x] ? disparity[x] : 0;
        }
    }
}

enum shef_err shef_run_scorer_load(struct shef_run_scorer *scorer, uint64_t number,
                                   struct shef_error *err)
{
    const struct shef_truth_frame *truth = shef_recorded_truth_frame(&scorer->truth, number);
    struct shef_recorded_frame frame;
    uint32_t index;

    if (!truth || !shef_recorded_frames_find(scorer->frames, number, &index))
        return shef_fail(err, SHEF_ERR_NOT_FOUND, "there is no truth of frame %" PRIu64, number);
    shef_truth_maps_free(&scorer->maps);

    enum shef_err code =
        shef_recorded_truth_maps(&scorer->truth, SHEF_TRUTH_LEFT, number, &scorer->maps, err);

    if (code == SHEF_OK)
        code = shef_recorded_frames_read(scorer->frames, index, &frame, err);
    if (code == SHEF_OK &&
        !shef_frame_is_usable(&frame.info, shef_recorded_frames_format(scorer->frames)))
        code = shef_fail(err, SHEF_ERR_FORMAT, "frame %" PRIu64 " is incomplete", number);
    if (code != SHEF_OK)
        return code;

    union {
        const uint8_t *read;
        uint8_t *any;
    } pixels = { .read = frame.pixels };
    const struct shef_image_u8 raw = { pixels.any, (int32_t)frame.info.width_px,
                                       (int32_t)frame.info.height_px,
                                       (ptrdiff_t)frame.info.row_bytes };

    shef_frame_rectify_run(scorer->rectify, raw, scorer->picture);
    shef_frame_edges_unsigned(scorer->edges, scorer->picture, &scorer->map);
    find_velocity(scorer, truth);
    scorer->direction = direction_of(scorer->velocity_m_s);
    find_jumps(scorer);
    mark_scored(scorer);
    return SHEF_OK;
}
