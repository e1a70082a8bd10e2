#include "pipeline/event_edges.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "core/memory.h"
#include "pipeline/filter.h"
#include "pipeline/kernels/edge.h"
#include "pipeline/threshold.h"

#define MARGIN          64 /* values before and after a row of magnitudes */
#define ROUND_UP(n, to) (((n) + (to)-1) / (to) * (to))

struct box {
    int32_t first_x, first_y;
    int32_t width_px, height_px;
};

struct shef_event_edges {
    /* Set by create, then read-only. */
    struct shef_event_edges_params params;
    const struct shef_warp_map *map;
    const struct shef_warp_kernel *warp;
    const struct shef_edge_kernels *kernels;
    int32_t floor;    /* in 1/256 contrast step */
    struct box shown; /* the sensor's pixels that the profile shows */
    /* Of the current map. */
    int16_t *sensor_pixels;       /* padded for the warp */
    struct shef_image_i16 sensor; /* of a pair the difference; of a graded map clipped values */
    int16_t *pixels;              /* rectified */
    struct shef_image_i16 values;
    int16_t *magnitudes; /* thin maps: three rows, with margins */
    size_t magnitude_stride;
    int32_t threshold; /* and the guess for the next map's */
};

struct shef_event_edges_params shef_event_edges_default_params(enum shef_edge_kind kind)
{
    return (struct shef_event_edges_params){
        .kind = kind,
        .quantile = kind == SHEF_EDGE_GRADED ? 0.90 : 0.75,
        .floor_c = 0.3,
    };
}

static enum shef_err check_params(const struct shef_event_edges_params *p, struct shef_error *err)
{
    if (!(p->quantile >= 0.01 && p->quantile <= 0.999))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "event edges at quantile %g: it must be 0.01 to 0.999", p->quantile);
    if (!(p->floor_c >= 0.004 && p->floor_c <= 100.0))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "event edges of at least %g contrast steps: it must be 0.004 to 100",
                         p->floor_c);
    if (p->is_thin && p->kind != SHEF_EDGE_UNSIGNED)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "thin event edges with a sign: only unsigned ones can be thin");
    return SHEF_OK;
}

static int32_t clamped(int32_t value, int32_t last)
{
    return value < 0 ? 0 : value > last ? last : value;
}

/* The sensor's pixels that the map's nodes enclose. */
static struct box shown_box(const struct shef_warp_map *map)
{
    const struct shef_rectification *r = &map->rectification;
    const size_t n_nodes = (size_t)r->height_px * (size_t)(map->n_segments + 1);
    int32_t first_x = INT32_MAX;
    int32_t first_y = INT32_MAX;
    int32_t last_x = 0;
    int32_t last_y = 0;

    for (size_t i = 0; i < n_nodes; i++) {
        const int32_t x = clamped(map->nodes[i].x_q16 >> 16, r->sensor_width_px - 1);
        const int32_t y = clamped(map->nodes[i].y_q16 >> 16, r->sensor_height_px - 1);

        first_x = x < first_x ? x : first_x;
        first_y = y < first_y ? y : first_y;
        last_x = x > last_x ? x : last_x;
        last_y = y > last_y ? y : last_y;
    }
    return (struct box){ first_x, first_y, last_x - first_x + 1, last_y - first_y + 1 };
}

enum shef_err shef_event_edges_create(struct shef_event_edges **out_edges,
                                      const struct shef_warp_map *map,
                                      const struct shef_event_edges_params *params,
                                      uint32_t cpu_features, struct shef_error *err)
{
    const enum shef_err code = check_params(params, err);

    if (code != SHEF_OK)
        return code;

    const struct shef_rectification *r = &map->rectification;
    const size_t n_sensor = (size_t)r->sensor_width_px * (size_t)r->sensor_height_px;
    const size_t stride = ROUND_UP((size_t)r->width_px, 64);
    const size_t magnitude_stride = stride + 2 * MARGIN;
    struct shef_event_edges *edges = calloc(1, sizeof *edges);

    if (edges) {
        edges->sensor_pixels =
            shef_memory_create(n_sensor * sizeof *edges->sensor_pixels + SHEF_WARP_PAD_BYTES, 1);
        edges->pixels = shef_memory_create(stride * (size_t)r->height_px, sizeof *edges->pixels);
        edges->magnitudes = shef_memory_create(3 * magnitude_stride, sizeof *edges->magnitudes);
    }
    if (!edges || !edges->sensor_pixels || !edges->pixels || !edges->magnitudes) {
        shef_event_edges_destroy(edges);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "event edges of %d x %d px: out of memory",
                         r->width_px, r->height_px);
    }
    edges->params = *params;
    edges->map = map;
    edges->warp = shef_warp_pick(cpu_features);
    edges->kernels = shef_edge_pick(cpu_features);
    edges->floor = (int32_t)lrint(params->floor_c * SHEF_FILTER_VALUE_STEP);
    edges->magnitude_stride = magnitude_stride;
    edges->shown = shown_box(map);
    edges->sensor = (struct shef_image_i16){
        .data = edges->sensor_pixels,
        .width_px = r->sensor_width_px,
        .height_px = r->sensor_height_px,
        .stride_bytes = r->sensor_width_px * (ptrdiff_t)sizeof *edges->sensor_pixels,
    };
    edges->values = (struct shef_image_i16){
        .data = edges->pixels,
        .width_px = r->width_px,
        .height_px = r->height_px,
        .stride_bytes = (ptrdiff_t)(stride * sizeof *edges->pixels),
    };
    *out_edges = edges;
    return SHEF_OK;
}

void shef_event_edges_destroy(struct shef_event_edges *edges)
{
    if (!edges)
        return;
    free(edges->sensor_pixels);
    free(edges->pixels);
    free(edges->magnitudes);
    free(edges);
}

/* The values that a threshold is looked for in. */
struct search {
    const struct shef_event_edges *edges;
    struct shef_image_i16 values;
    const struct box *box;
    double n_wanted;
};

/* Whether enough values in the box are at least that far from zero. */
static bool leaves_enough(const void *context, int32_t threshold)
{
    const struct search *search = context;
    const struct box *box = search->box;
    uint32_t n_far = 0;

    for (int32_t y = box->first_y; y < box->first_y + box->height_px; y++)
        n_far += search->edges->kernels->count(shef_row_i16(search->values, y) + box->first_x,
                                               box->width_px, threshold);
    return n_far >= search->n_wanted;
}

/* The highest threshold that leaves at least a share 1 - quantile above or at it, or the floor. */
static int32_t find_threshold(const struct shef_event_edges *edges, struct shef_image_i16 values,
                              const struct box *box)
{
    const struct search search = {
        .edges = edges,
        .values = values,
        .box = box,
        .n_wanted = (1.0 - edges->params.quantile) * (double)box->height_px * box->width_px,
    };

    return shef_threshold_highest(edges->floor, INT16_MAX + 1, edges->threshold, leaves_enough,
                                  &search);
}

/* Copies values to the sensor image, clipped. Both may be the same. */
static void clip(const struct shef_event_edges *edges, struct shef_image_i16 values, int16_t limit)
{
    for (int32_t y = 0; y < edges->sensor.height_px; y++) {
        const int16_t *from = shef_row_i16(values, y);
        int16_t *to = shef_row_i16(edges->sensor, y);

        for (int32_t x = 0; x < edges->sensor.width_px; x++) {
            const int16_t low = from[x] > -limit ? from[x] : (int16_t)-limit;

            to[x] = low < limit ? low : limit;
        }
    }
}

static void fill_graded(const struct shef_event_edges *edges, struct shef_edge_map *out_map)
{
    const struct shef_edge_scale scale = shef_edge_scale_of(edges->threshold);

    for (int32_t y = 0; y < out_map->height_px; y++)
        edges->kernels->graded(out_map->graded + y * out_map->graded_stride_bytes,
                               shef_row_i16(edges->values, y), out_map->width_px, &scale);
}

static void fill_bits(const struct shef_event_edges *edges, struct shef_edge_map *out_map)
{
    for (int32_t y = 0; y < out_map->height_px; y++) {
        const size_t at = (size_t)y * (size_t)out_map->stride_words;

        edges->kernels->bits(out_map->plus + at, out_map->minus ? out_map->minus + at : NULL,
                             shef_row_i16(edges->values, y), out_map->width_px, edges->threshold);
    }
}

/* Where row y's magnitudes are kept. Rows outside the image repeat the border. */
static int16_t *magnitudes_of(const struct shef_event_edges *edges, int32_t y)
{
    const int32_t last = edges->values.height_px - 1;
    const int32_t nearest = y < 0 ? 0 : y > last ? last : y;

    return edges->magnitudes + (size_t)(nearest % 3) * edges->magnitude_stride + MARGIN;
}

static void fill_magnitudes(const struct shef_event_edges *edges, int32_t y)
{
    const int32_t width_px = edges->values.width_px;
    int16_t *magnitudes = magnitudes_of(edges, y);
    const int16_t *values = shef_row_i16(edges->values, y);

    for (int32_t x = 0; x < width_px; x++)
        magnitudes[x] = (int16_t)abs(values[x]);
    magnitudes[-1] = magnitudes[0];
    magnitudes[width_px] = magnitudes[width_px - 1];
}

static void fill_ridges(const struct shef_event_edges *edges, struct shef_edge_map *out_map)
{
    fill_magnitudes(edges, 0);
    for (int32_t y = 0; y < out_map->height_px; y++) {
        if (y + 1 < out_map->height_px)
            fill_magnitudes(edges, y + 1);

        const int16_t *const rows[3] = { magnitudes_of(edges, y - 1), magnitudes_of(edges, y),
                                         magnitudes_of(edges, y + 1) };

        edges->kernels->ridges(out_map->plus + (size_t)y * (size_t)out_map->stride_words, rows,
                               out_map->width_px, edges->threshold);
    }
}

void shef_event_edges_of_values(struct shef_event_edges *edges, struct shef_image_i16 values,
                                const struct shef_warp_shift *shift, struct shef_edge_map *out_map)
{
    assert(out_map->kind == edges->params.kind);
    assert(out_map->width_px == edges->values.width_px);
    assert(out_map->height_px == edges->values.height_px);

    if (out_map->kind == SHEF_EDGE_GRADED) {
        edges->threshold = find_threshold(edges, values, &edges->shown);
        clip(edges, values, (int16_t)edges->threshold);
        shef_warp_run(edges->map, edges->warp, shift, edges->sensor, edges->values);
        fill_graded(edges, out_map);
        return;
    }

    const struct box all = { 0, 0, edges->values.width_px, edges->values.height_px };

    shef_warp_run(edges->map, edges->warp, shift, values, edges->values);
    edges->threshold = find_threshold(edges, edges->values, &all);
    if (edges->params.is_thin)
        fill_ridges(edges, out_map);
    else
        fill_bits(edges, out_map);
}

void shef_event_edges_of_pair(struct shef_event_edges *edges, struct shef_image_i16 earlier,
                              struct shef_image_i16 later, const struct shef_warp_shift *shift,
                              struct shef_edge_map *out_map)
{
    const struct shef_image_i16 difference = edges->sensor;

    assert(earlier.width_px == difference.width_px && earlier.height_px == difference.height_px);
    assert(later.width_px == difference.width_px && later.height_px == difference.height_px);
    for (int32_t y = 0; y < difference.height_px; y++) {
        const int16_t *before = shef_row_i16(earlier, y);
        const int16_t *after = shef_row_i16(later, y);
        int16_t *out = shef_row_i16(difference, y);

        /* Modulo 2^16, but without the one value that has no opposite. */
        for (int32_t x = 0; x < difference.width_px; x++) {
            const int16_t gained = (int16_t)(uint16_t)(after[x] - before[x]);

            out[x] = gained > -INT16_MAX ? gained : -INT16_MAX;
        }
    }
    shef_event_edges_of_values(edges, difference, shift, out_map);
}

struct shef_image_i16 shef_event_edges_values(const struct shef_event_edges *edges)
{
    return edges->values;
}

double shef_event_edges_threshold_c(const struct shef_event_edges *edges)
{
    return (double)edges->threshold / SHEF_FILTER_VALUE_STEP;
}

const char *shef_event_edges_isa(const struct shef_event_edges *edges)
{
    return edges->kernels->isa;
}
