#include <math.h>

#include "shefsim/rig_parts.h"

/* Depths that differ by less belong to the same surface. */
#define SAME_DEPTH 0.02

/* Whether a view sees this depth at a place between two of its pixels. */
static bool sees(struct shef_image_f32 depth_m, int32_t y, double x, double wanted_m)
{
    const float *row = shef_row_f32(depth_m, y);
    const int32_t first = (int32_t)x;

    for (int32_t i = first; i <= first + 1 && i < depth_m.width_px; i++)
        if (row[i] > 0 && fabs(row[i] - wanted_m) <= SAME_DEPTH * wanted_m)
            return true;
    return false;
}

void sim_rig_find_sensors(struct sim_rig *rig)
{
    for (int32_t view = 0; view < SHEF_TRUTH_VIEWS; view++) {
        const struct shef_rectification *side = view == SHEF_TRUTH_LEFT ? &rig->left : &rig->right;

        for (int32_t y = 0; y < side->height_px; y++) {
            uint8_t *row = shef_row_u8(rig->on_sensor[view], y);

            for (int32_t x = 0; x < side->width_px; x++) {
                double sensor_x;
                double sensor_y;

                row[x] = shef_rectification_project(side, x, y, &sensor_x, &sensor_y) &&
                         sensor_x >= 0 && sensor_y >= 0 && sensor_x <= side->sensor_width_px - 1 &&
                         sensor_y <= side->sensor_height_px - 1;
            }
        }
    }
}

/* One row of one view, against the other. */
static void compare_row(const struct sim_rig *rig, enum shef_truth_view view, int32_t y)
{
    const bool is_left = view == SHEF_TRUTH_LEFT;
    const enum shef_truth_view other = is_left ? SHEF_TRUTH_RIGHT : SHEF_TRUTH_LEFT;
    const uint8_t *own_sensor = shef_row_u8(rig->on_sensor[view], y);
    const uint8_t *other_sensor = shef_row_u8(rig->on_sensor[other], y);
    const double bf = rig->baseline_m * rig->left.f_px;
    const int32_t width = rig->left.width_px;
    const float *depth = shef_row_f32(rig->truth[view].depth_m, y);
    float *disparity = shef_row_f32(rig->truth[view].disparity_px, y);
    uint8_t *mask = shef_row_u8(rig->truth[view].mask, y);

    for (int32_t x = 0; x < width; x++) {
        const double d = depth[x] > 0 ? bf / depth[x] : 0;
        const double other_x = is_left ? x - d : x + d;
        const bool is_in_view =
            other_x >= 0 && other_x <= width - 1 && other_sensor[(int32_t)(other_x + 0.5)];

        disparity[x] = (float)d;
        mask[x] = 0;
        if (d == 0 || !own_sensor[x])
            continue;
        mask[x] = SHEF_TRUTH_VALID;
        if (!is_in_view || !sees(rig->truth[other].depth_m, y, other_x, depth[x]))
            mask[x] |= SHEF_TRUTH_OCCLUDED;
    }
}

static void compare(void *context, int32_t y, int32_t worker)
{
    (void)worker;
    compare_row(context, SHEF_TRUTH_LEFT, y);
    compare_row(context, SHEF_TRUTH_RIGHT, y);
}

void sim_rig_see_truth(struct sim_rig *rig, int64_t t_ns)
{
    const struct shef_rigid frame = sim_rig_pose(rig, t_ns);
    const struct shef_rigid left = shef_rigid_compose(&frame, &rig->t_frame_left);
    const struct shef_rigid right = shef_rigid_compose(&left, &rig->t_left_right);
    const struct shef_image_i16 no_objects = { .data = NULL };

    sim_view_depth(rig->truth_view, &left, rig->truth[SHEF_TRUTH_LEFT].depth_m, no_objects);
    sim_view_depth(rig->truth_view, &right, rig->truth[SHEF_TRUTH_RIGHT].depth_m, no_objects);
    shef_workers_run(rig->workers, compare, rig, rig->left.height_px);
}

double sim_rig_speed_px_s(struct sim_rig *rig, int64_t t_ns)
{
    const struct shef_image_i16 no_objects = { .data = NULL };
    const struct shef_rigid frame = sim_rig_pose(rig, t_ns);
    const struct shef_rigid left = shef_rigid_compose(&frame, &rig->t_frame_left);
    const struct shef_rigid back = shef_rigid_invert(&left);
    double world_m_s[3];
    double v[3];
    double fastest = 0;

    sim_path_velocity(rig->path, t_ns, world_m_s);
    shef_rigid_rotate(&back, world_m_s, v);
    sim_view_depth(rig->truth_view, &left, rig->truth[SHEF_TRUTH_LEFT].depth_m, no_objects);
    for (int32_t y = 0; y < rig->left.height_px; y += 2) {
        const float *depth = shef_row_f32(rig->truth[SHEF_TRUTH_LEFT].depth_m, y);

        for (int32_t x = 0; x < rig->left.width_px; x += 2) {
            const double u = (x - rig->left.cx_px) * v[2] - rig->left.f_px * v[0];
            const double w = (y - rig->left.cy_px) * v[2] - rig->left.f_px * v[1];

            if (depth[x] > 0)
                fastest = fmax(fastest, (u * u + w * w) / ((double)depth[x] * depth[x]));
        }
    }
    return sqrt(fastest);
}
