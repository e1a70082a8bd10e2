#include "pipeline/warp.h"

#include <assert.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "core/memory.h"

#define NOWHERE_PX   -1024.0 /* far enough from the sensor to fetch zeros */
#define FARTHEST_PX  3071.0
#define MAX_ERROR_PX 0.05
#define MAX_SHIFT_PX 8.0

static enum shef_err check(const struct shef_rectification *r, struct shef_error *err)
{
    if (r->sensor_width_px > SHEF_WARP_MAX_SIDE_PX || r->sensor_height_px > SHEF_WARP_MAX_SIDE_PX)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "rectification map of a %d x %d px sensor: an event camera's sides are "
                         "at most %d px",
                         r->sensor_width_px, r->sensor_height_px, SHEF_WARP_MAX_SIDE_PX);
    return shef_rectification_check(r, err);
}

struct position {
    double x_px;
    double y_px;
};

static double limited(double px)
{
    return px > NOWHERE_PX ? fmin(px, FARTHEST_PX) : NOWHERE_PX;
}

static struct position position_of(const struct shef_rectification *rectification, double x_px,
                                   double y_px)
{
    struct position p = { NOWHERE_PX, NOWHERE_PX };

    if (shef_rectification_project(rectification, x_px, y_px, &p.x_px, &p.y_px))
        p = (struct position){ limited(p.x_px), limited(p.y_px) };
    return p;
}

static bool is_on_sensor(const struct shef_rectification *r, struct position p)
{
    return p.x_px > -1 && p.y_px > -1 && p.x_px < r->sensor_width_px &&
           p.y_px < r->sensor_height_px;
}

static struct shef_warp_node node_at(struct position p)
{
    return (struct shef_warp_node){ (int32_t)lrint(p.x_px * 65536),
                                    (int32_t)lrint(p.y_px * 65536) };
}

static void fill_nodes(struct shef_warp_map *map)
{
    const struct shef_rectification *r = &map->rectification;

    for (int32_t y = 0; y < r->height_px; y++) {
        struct shef_warp_node *row = map->nodes + (size_t)y * (size_t)(map->n_segments + 1);
        struct position before = { 0 };

        for (int32_t s = 0; s <= map->n_segments; s++) {
            const double x = s * SHEF_WARP_SEGMENT_PX;
            const struct position here = position_of(r, x, y);

            row[s] = node_at(here);
            if (s > 0 && is_on_sensor(r, before) && is_on_sensor(r, here)) {
                const struct position middle = position_of(r, x - SHEF_WARP_SEGMENT_PX / 2.0, y);

                map->max_error_px =
                    fmax(map->max_error_px, hypot((before.x_px + here.x_px) / 2 - middle.x_px,
                                                  (before.y_px + here.y_px) / 2 - middle.y_px));
            }
            before = here;
        }
    }
}

enum shef_err shef_warp_map_create(struct shef_warp_map *out_map,
                                   const struct shef_rectification *rectification,
                                   struct shef_error *err)
{
    const enum shef_err code = check(rectification, err);

    if (code != SHEF_OK)
        return code;

    struct shef_warp_map map = {
        .rectification = *rectification,
        .n_segments = (rectification->width_px + SHEF_WARP_SEGMENT_PX - 1) / SHEF_WARP_SEGMENT_PX,
    };

    map.nodes = shef_memory_create((size_t)rectification->height_px * (size_t)(map.n_segments + 1),
                                   sizeof *map.nodes);
    if (!map.nodes)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "rectification map of %d x %d px: out of memory",
                         rectification->width_px, rectification->height_px);
    fill_nodes(&map);
    if (!(map.max_error_px <= MAX_ERROR_PX)) {
        shef_warp_map_destroy(&map);
        return shef_fail(err, SHEF_ERR_INVALID,
                         "rectification map: the lens bends rows by %.2f px within %d px, more "
                         "than the %.2f that the map can follow; check the calibration",
                         map.max_error_px, SHEF_WARP_SEGMENT_PX, MAX_ERROR_PX);
    }
    *out_map = map;
    return SHEF_OK;
}

void shef_warp_map_destroy(struct shef_warp_map *map)
{
    free(map->nodes);
    map->nodes = NULL;
}

/* Sensor pixels per rectified pixel around one: d(x)/d(x), d(x)/d(y), d(y)/d(x), d(y)/d(y). */
static void fill_jacobian(double *out_jacobian, const struct shef_rectification *r, double x_px,
                          double y_px)
{
    const struct position left = position_of(r, x_px - .5, y_px);
    const struct position right = position_of(r, x_px + .5, y_px);
    const struct position above = position_of(r, x_px, y_px - .5);
    const struct position below = position_of(r, x_px, y_px + .5);

    out_jacobian[0] = right.x_px - left.x_px;
    out_jacobian[1] = below.x_px - above.x_px;
    out_jacobian[2] = right.y_px - left.y_px;
    out_jacobian[3] = below.y_px - above.y_px;
}

enum shef_err shef_warp_shift_create(struct shef_warp_shift *out_shift,
                                     const struct shef_warp_map *map, struct shef_error *err)
{
    const struct shef_rectification *r = &map->rectification;
    struct shef_warp_shift shift = {
        .n_columns = (r->width_px + SHEF_WARP_OFFSET_PX - 1) / SHEF_WARP_OFFSET_PX,
        .n_rows = (r->height_px + SHEF_WARP_OFFSET_PX - 1) / SHEF_WARP_OFFSET_PX,
        .f_px = r->f_px,
        .cx_px = r->cx_px,
        .cy_px = r->cy_px,
    };
    const size_t n_squares = (size_t)shift.n_columns * (size_t)shift.n_rows;

    shift.offsets = shef_memory_create(n_squares, sizeof *shift.offsets);
    shift.jacobians = shef_memory_create(n_squares, 4 * sizeof *shift.jacobians);
    if (!shift.offsets || !shift.jacobians) {
        shef_warp_shift_destroy(&shift);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "shift of a rectification map: out of memory");
    }
    for (int32_t row = 0; row < shift.n_rows; row++)
        for (int32_t column = 0; column < shift.n_columns; column++)
            fill_jacobian(shift.jacobians + 4 * (row * shift.n_columns + column), r,
                          (column + .5) * SHEF_WARP_OFFSET_PX - .5,
                          (row + .5) * SHEF_WARP_OFFSET_PX - .5);
    *out_shift = shift;
    return SHEF_OK;
}

void shef_warp_shift_destroy(struct shef_warp_shift *shift)
{
    free(shift->offsets);
    free(shift->jacobians);
    *shift = (struct shef_warp_shift){ 0 };
}

void shef_warp_shift_set(struct shef_warp_shift *shift, const double camera_velocity[3],
                         double lag_px)
{
    const double *v = camera_velocity;
    const double speed = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);

    assert(lag_px >= 0.0 && lag_px <= MAX_SHIFT_PX);
    for (int32_t row = 0; row < shift->n_rows; row++)
        for (int32_t column = 0; column < shift->n_columns; column++) {
            const int32_t square = row * shift->n_columns + column;
            const double *j = shift->jacobians + (ptrdiff_t)4 * square;
            const double x =
                ((column + .5) * SHEF_WARP_OFFSET_PX - .5 - shift->cx_px) / shift->f_px;
            const double y = ((row + .5) * SHEF_WARP_OFFSET_PX - .5 - shift->cy_px) / shift->f_px;
            /* Image flow of a scene at rest, times depth: any depth has this direction. */
            const double flow_x = x * v[2] - v[0];
            const double flow_y = y * v[2] - v[1];
            const double sensor_x = j[0] * flow_x + j[1] * flow_y;
            const double sensor_y = j[2] * flow_x + j[3] * flow_y;
            const double length = hypot(sensor_x, sensor_y);
            /* Where the scene only grows, around the point the camera moves to, nothing lags. */
            const bool is_moving = hypot(flow_x, flow_y) > 1e-3 * speed && length > 0;
            const double scale = is_moving ? -65536 * lag_px / length : 0;

            shift->offsets[square] = (struct shef_warp_node){
                (int32_t)lrint(scale * sensor_x),
                (int32_t)lrint(scale * sensor_y),
            };
        }
}

void shef_warp_run(const struct shef_warp_map *map, const struct shef_warp_kernel *kernel,
                   const struct shef_warp_shift *shift, struct shef_image_i16 source,
                   struct shef_image_i16 out)
{
    static const struct shef_warp_node no_offsets[SHEF_PROFILE_MAX_SIDE_PX / SHEF_WARP_OFFSET_PX];
    const struct shef_rectification *r = &map->rectification;
    const struct shef_warp_source from = {
        .pixels = source.data,
        .stride = source.stride_bytes / (ptrdiff_t)sizeof *source.data,
        .width_px = source.width_px,
        .height_px = source.height_px,
    };

    assert(source.width_px == r->sensor_width_px && source.height_px == r->sensor_height_px);
    assert(out.width_px == r->width_px && out.height_px == r->height_px);
    assert(source.stride_bytes % (ptrdiff_t)sizeof *source.data == 0);
    assert(out.stride_bytes >=
           map->n_segments * SHEF_WARP_SEGMENT_PX * (ptrdiff_t)sizeof *out.data);
    for (int32_t y = 0; y < r->height_px; y++)
        kernel->row(shef_row_i16(out, y), map->nodes + (size_t)y * (size_t)(map->n_segments + 1),
                    shift ? shift->offsets +
                                (size_t)(y / SHEF_WARP_OFFSET_PX) * (size_t)shift->n_columns
                          : no_offsets,
                    map->n_segments, &from);
}
