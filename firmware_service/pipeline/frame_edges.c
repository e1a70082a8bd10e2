#include "pipeline/frame_edges.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>

#include "core/memory.h"
#include "pipeline/kernels/edge.h"
#include "pipeline/kernels/gradient.h"
#include "pipeline/threshold.h"

#define MARGIN          64 /* values before and after each row */
#define ROUND_UP(n, to) (((n) + (to)-1) / (to) * (to))
#define LOG_SCALE       2048.0 /* steps per unit of ln */
#define LOG_OFFSET      6.0
#define PER_GREY        (8.0 * SHEF_GRADIENT_LENGTH_SCALE) /* values per grey level a pixel */
#define PER_LN_SLOPE    (8.0 * LOG_SCALE / 2)              /* values per ln a pixel */
#define ALMOST_PARALLEL 0.02 /* directions that differ by less, in rad, are taken as one */
#define HIGHEST         (INT16_MAX + 1)

/* Lengths of gradients, gradients along a direction, changes in time. */
enum values_kind { LENGTHS, ALONG, CHANGES, N_VALUES_KINDS };

struct shef_frame_edges {
    /* Set by create, then read-only. */
    struct shef_frame_edges_params params;
    int32_t width_px, height_px;
    double f_px, cx_px, cy_px;
    double reach; /* from the middle to a corner, in focal lengths */
    const struct shef_gradient_kernels *gradient;
    const struct shef_edge_kernels *cut;
    int16_t logs[256];
    int16_t *keep; /* -1, or 0 where a pixel or a neighbour of it is not valid; NULL: all are */
    int64_t n_kept;
    /* Of the current map. */
    int16_t *pixels; /* rows with margins */
    struct shef_image_i16 values;
    int16_t *levels; /* three rows of brightness or its logarithm, with margins */
    int16_t *gx, *gy;
    size_t level_stride;
    int32_t threshold;
    double threshold_in_units;
    int32_t guesses[N_VALUES_KINDS]; /* the last thresholds */
};

/* Where a map's values come from. */
struct source {
    struct shef_image_u8 image;
    bool is_log;
};

struct shef_frame_edges_params shef_frame_edges_default_params(void)
{
    return (struct shef_frame_edges_params){
        .unsigned_quantile = 0.75,
        .ternary_quantile = 0.75,
        .graded_quantile = 0.90,
        .floor_grey_per_px = 0.5,
        .floor_ln_per_px = 0.005,
        .floor_ln = 0.02,
    };
}

static enum shef_err check_params(const struct shef_frame_edges_params *p, struct shef_error *err)
{
    const double quantiles[3] = { p->unsigned_quantile, p->ternary_quantile, p->graded_quantile };
    const double floors[3] = { p->floor_grey_per_px, p->floor_ln_per_px, p->floor_ln };

    for (int i = 0; i < 3; i++) {
        if (!(quantiles[i] >= 0.01 && quantiles[i] <= 0.999))
            return shef_fail(err, SHEF_ERR_INVALID,
                             "frame edges at quantile %g: it must be 0.01 to 0.999", quantiles[i]);
        if (!(floors[i] >= 0.001 && floors[i] <= 100.0))
            return shef_fail(err, SHEF_ERR_INVALID,
                             "frame edges with a floor of %g: it must be 0.001 to 100", floors[i]);
    }
    return SHEF_OK;
}

static enum shef_err check_profile(const struct shef_rectification *profile,
                                   struct shef_image_u8 valid, struct shef_error *err)
{
    if (profile->width_px < 2 || profile->width_px > SHEF_IMAGE_MAX_SIDE_PX ||
        profile->height_px < 1 || profile->height_px > SHEF_IMAGE_MAX_SIDE_PX ||
        !(profile->f_px >= 1.0))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "frame edges of %d x %d px with f %g px: sides must be up to %d, the "
                         "width at least 2, f at least 1",
                         profile->width_px, profile->height_px, profile->f_px,
                         SHEF_IMAGE_MAX_SIDE_PX);
    if (valid.data &&
        (valid.width_px != profile->width_px || valid.height_px != profile->height_px))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "frame edges of %d x %d px with a mask of %d x %d: the sizes must agree",
                         profile->width_px, profile->height_px, valid.width_px, valid.height_px);
    return SHEF_OK;
}

static int32_t clamped(int32_t value, int32_t last)
{
    return value < 0 ? 0 : value > last ? last : value;
}

static bool is_kept(struct shef_image_u8 valid, int32_t x, int32_t y)
{
    for (int32_t dy = -1; dy <= 1; dy++)
        for (int32_t dx = -1; dx <= 1; dx++)
            if (shef_row_u8(
                    valid,
                    clamped(y + dy, valid.height_px - 1))[clamped(x + dx, valid.width_px - 1)] == 0)
                return false;
    return true;
}

static void fill_kept(struct shef_frame_edges *edges, struct shef_image_u8 valid)
{
    edges->n_kept = 0;
    for (int32_t y = 0; y < edges->height_px; y++)
        for (int32_t x = 0; x < edges->width_px; x++) {
            const bool keeps = is_kept(valid, x, y);

            edges->keep[(size_t)y * (size_t)edges->width_px + (size_t)x] = keeps ? -1 : 0;
            edges->n_kept += keeps;
        }
}

static bool allocate(struct shef_frame_edges *edges, bool has_mask)
{
    const size_t n_pixels = (size_t)edges->width_px * (size_t)edges->height_px;
    const size_t stride = edges->level_stride;

    edges->pixels = shef_memory_create(stride * (size_t)edges->height_px, sizeof *edges->pixels);
    edges->levels = shef_memory_create(3 * stride, sizeof *edges->levels);
    edges->gx = shef_memory_create(stride, sizeof *edges->gx);
    edges->gy = shef_memory_create(stride, sizeof *edges->gy);
    if (has_mask)
        edges->keep = shef_memory_create(n_pixels, sizeof *edges->keep);
    return edges->pixels && edges->levels && edges->gx && edges->gy && (edges->keep || !has_mask);
}

enum shef_err shef_frame_edges_create(struct shef_frame_edges **out_edges,
                                      const struct shef_rectification *profile,
                                      struct shef_image_u8 valid,
                                      const struct shef_frame_edges_params *params,
                                      uint32_t cpu_features, struct shef_error *err)
{
    enum shef_err code = check_params(params, err);

    if (code == SHEF_OK)
        code = check_profile(profile, valid, err);
    if (code != SHEF_OK)
        return code;

    struct shef_frame_edges *edges = calloc(1, sizeof *edges);

    if (edges) {
        edges->width_px = profile->width_px;
        edges->height_px = profile->height_px;
        edges->level_stride = ROUND_UP((size_t)profile->width_px, 64) + 2 * MARGIN;
    }
    if (!edges || !allocate(edges, valid.data != NULL)) {
        shef_frame_edges_destroy(edges);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "frame edges of %d x %d px: out of memory",
                         profile->width_px, profile->height_px);
    }
    edges->params = *params;
    edges->f_px = profile->f_px;
    edges->cx_px = profile->cx_px;
    edges->cy_px = profile->cy_px;
    edges->reach =
        hypot(fmax(fabs(profile->cx_px), fabs(profile->width_px - 1 - profile->cx_px)),
              fmax(fabs(profile->cy_px), fabs(profile->height_px - 1 - profile->cy_px))) /
        profile->f_px;
    edges->gradient = shef_gradient_pick(cpu_features);
    edges->cut = shef_edge_pick(cpu_features);
    for (int i = 0; i < 256; i++)
        edges->logs[i] = (int16_t)lrint(LOG_SCALE * log((i + LOG_OFFSET) / LOG_OFFSET));
    edges->n_kept = (int64_t)edges->width_px * edges->height_px;
    if (valid.data)
        fill_kept(edges, valid);
    edges->values = (struct shef_image_i16){
        .data = edges->pixels + MARGIN,
        .width_px = edges->width_px,
        .height_px = edges->height_px,
        .stride_bytes = (ptrdiff_t)(edges->level_stride * sizeof *edges->pixels),
    };
    *out_edges = edges;
    return SHEF_OK;
}

void shef_frame_edges_destroy(struct shef_frame_edges *edges)
{
    if (!edges)
        return;
    free(edges->keep);
    free(edges->pixels);
    free(edges->levels);
    free(edges->gx);
    free(edges->gy);
    free(edges);
}

/* Where row y's levels are kept. Rows outside the picture repeat the border. */
static int16_t *levels_of(const struct shef_frame_edges *edges, int32_t y)
{
    return edges->levels + (size_t)(clamped(y, edges->height_px - 1) % 3) * edges->level_stride +
           MARGIN;
}

static void fill_levels(const struct shef_frame_edges *edges, const struct source *source,
                        int32_t y)
{
    const uint8_t *pixels = shef_row_u8(source->image, y);
    int16_t *levels = levels_of(edges, y);

    if (source->is_log)
        edges->gradient->look_up(levels, pixels, edges->width_px, edges->logs);
    else
        edges->gradient->widen(levels, pixels, edges->width_px);
    levels[-1] = levels[0];
    levels[edges->width_px] = levels[edges->width_px - 1];
}

/* The gradients of row y into gx and gy. Rows have to be asked for in order, from 0 on. */
static void next_gradients(const struct shef_frame_edges *edges, const struct source *source,
                           int32_t y)
{
    if (y == 0)
        fill_levels(edges, source, 0);
    if (y + 1 < edges->height_px)
        fill_levels(edges, source, y + 1);

    const int16_t *const rows[3] = { levels_of(edges, y - 1), levels_of(edges, y),
                                     levels_of(edges, y + 1) };

    edges->gradient->sobel(edges->gx, edges->gy, rows, edges->width_px);
}

/* Takes values out whose neighbourhood is not valid. */
static void mask_row(const struct shef_frame_edges *edges, int32_t y)
{
    const int16_t *keep = edges->keep + (size_t)y * (size_t)edges->width_px;
    int16_t *values = shef_row_i16(edges->values, y);

    for (int32_t x = 0; x < edges->width_px; x++)
        values[x] &= keep[x];
}

struct search {
    const struct shef_frame_edges *edges;
    double n_wanted;
};

static bool leaves_enough(const void *context, int32_t threshold)
{
    const struct search *search = context;
    const struct shef_frame_edges *edges = search->edges;
    int64_t n_far = 0;

    for (int32_t y = 0; y < edges->height_px; y++)
        n_far += edges->cut->count(shef_row_i16(edges->values, y), edges->width_px, threshold);
    return (double)n_far >= search->n_wanted;
}

/* The highest threshold that leaves at least a share 1 - quantile of the kept values above or at
 * it, or the floor. */
static int32_t find_threshold(const struct shef_frame_edges *edges, double quantile, int32_t floor,
                              int32_t guess)
{
    const struct search search = { edges, (1.0 - quantile) * (double)edges->n_kept };

    return shef_threshold_highest(floor, HIGHEST, guess, leaves_enough, &search);
}

/* Cuts the map out of the values.
 *   kind    of the values: each has thresholds of its own
 *   floor, per_unit  the lowest threshold, and how many values make its unit */
static void cut(struct shef_frame_edges *edges, enum values_kind kind, double quantile,
                double floor, double per_unit, struct shef_edge_map *out_map)
{
    const int32_t lowest = clamped((int32_t)lrint(floor * per_unit), INT16_MAX);

    if (edges->keep)
        for (int32_t y = 0; y < edges->height_px; y++)
            mask_row(edges, y);
    edges->threshold =
        find_threshold(edges, quantile, lowest > 0 ? lowest : 1, edges->guesses[kind]);
    edges->guesses[kind] = edges->threshold;
    edges->threshold_in_units = edges->threshold / per_unit;

    const struct shef_edge_scale scale = shef_edge_scale_of(edges->threshold);

    for (int32_t y = 0; y < edges->height_px; y++) {
        const int16_t *values = shef_row_i16(edges->values, y);
        const size_t word = (size_t)y * (size_t)out_map->stride_words;

        if (out_map->kind == SHEF_EDGE_GRADED)
            edges->cut->graded(out_map->graded + y * out_map->graded_stride_bytes, values,
                               edges->width_px, &scale);
        else
            edges->cut->bits(out_map->plus + word, out_map->minus ? out_map->minus + word : NULL,
                             values, edges->width_px, edges->threshold);
    }
}

static double signed_quantile(const struct shef_frame_edges *edges, enum shef_edge_kind kind)
{
    return kind == SHEF_EDGE_GRADED ? edges->params.graded_quantile
                                    : edges->params.ternary_quantile;
}

/* Replaces the bits of a thick map by those of its thin one. */
static void thin(struct shef_frame_edges *edges, const struct source *source,
                 struct shef_edge_map *out_map)
{
    for (int32_t y = 0; y < edges->height_px; y++) {
        int16_t *values = shef_row_i16(edges->values, y);

        values[-1] = values[0];
        values[edges->width_px] = values[edges->width_px - 1];
    }
    for (int32_t y = 0; y < edges->height_px; y++) {
        const int32_t last = edges->height_px - 1;
        const int16_t *const rows[3] = {
            shef_row_i16(edges->values, clamped(y - 1, last)),
            shef_row_i16(edges->values, y),
            shef_row_i16(edges->values, clamped(y + 1, last)),
        };

        next_gradients(edges, source, y);
        edges->gradient->thin(out_map->plus + (size_t)y * (size_t)out_map->stride_words, rows,
                              edges->gx, edges->gy, edges->width_px, edges->threshold);
    }
}

static void check_sizes(const struct shef_frame_edges *edges, struct shef_image_u8 image,
                        const struct shef_edge_map *map)
{
    assert(image.width_px == edges->width_px && image.height_px == edges->height_px);
    assert(map->width_px == edges->width_px && map->height_px == edges->height_px);
    (void)edges;
    (void)image;
    (void)map;
}

void shef_frame_edges_unsigned(struct shef_frame_edges *edges, struct shef_image_u8 image,
                               struct shef_edge_map *out_map)
{
    const struct source source = { image, false };

    check_sizes(edges, image, out_map);
    assert(out_map->kind == SHEF_EDGE_UNSIGNED);
    for (int32_t y = 0; y < edges->height_px; y++) {
        next_gradients(edges, &source, y);
        edges->gradient->length(shef_row_i16(edges->values, y), edges->gx, edges->gy,
                                edges->width_px);
    }
    cut(edges, LENGTHS, edges->params.unsigned_quantile, edges->params.floor_grey_per_px, PER_GREY,
        out_map);
    if (edges->params.is_thin)
        thin(edges, &source, out_map);
}

void shef_frame_edges_along(struct shef_frame_edges *edges, struct shef_image_u8 image,
                            const double camera_velocity[3], struct shef_edge_map *out_map)
{
    const struct source source = { image, true };
    const double *v = camera_velocity;
    const double speed = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    const double scale = speed > 0 ? 1 / speed : 0;
    const double across = hypot(v[0], v[1]) * scale;
    const bool is_parallel = fabs(v[2]) * scale * edges->reach <= ALMOST_PARALLEL * across;
    const double to_one =
        is_parallel && across > 0 ? SHEF_GRADIENT_DIRECTION_ONE * scale / across : 0;

    check_sizes(edges, image, out_map);
    assert(out_map->kind != SHEF_EDGE_UNSIGNED);
    for (int32_t y = 0; y < edges->height_px; y++) {
        int16_t *values = shef_row_i16(edges->values, y);

        next_gradients(edges, &source, y);
        if (is_parallel) {
            edges->gradient->along(values, edges->gx, edges->gy, edges->width_px,
                                   (int16_t)lrint(v[0] * to_one), (int16_t)lrint(v[1] * to_one));
            continue;
        }

        const struct shef_gradient_rays rays = {
            .first_x = (float)(scale * (v[0] + edges->cx_px / edges->f_px * v[2])),
            .step_x = (float)(scale * -v[2] / edges->f_px),
            .y = (float)(scale * (v[1] - (y - edges->cy_px) / edges->f_px * v[2])),
        };

        edges->gradient->along_rays(values, edges->gx, edges->gy, edges->width_px, &rays);
    }
    cut(edges, ALONG, signed_quantile(edges, out_map->kind), edges->params.floor_ln_per_px,
        PER_LN_SLOPE, out_map);
}

void shef_frame_edges_temporal(struct shef_frame_edges *edges, struct shef_image_u8 earlier,
                               struct shef_image_u8 later, struct shef_edge_map *out_map)
{
    int16_t *before = levels_of(edges, 0);
    int16_t *after = edges->levels + edges->level_stride + MARGIN;

    check_sizes(edges, earlier, out_map);
    check_sizes(edges, later, out_map);
    assert(out_map->kind != SHEF_EDGE_UNSIGNED);
    for (int32_t y = 0; y < edges->height_px; y++) {
        edges->gradient->look_up(before, shef_row_u8(earlier, y), edges->width_px, edges->logs);
        edges->gradient->look_up(after, shef_row_u8(later, y), edges->width_px, edges->logs);
        edges->gradient->difference(shef_row_i16(edges->values, y), after, before, edges->width_px);
    }
    cut(edges, CHANGES, signed_quantile(edges, out_map->kind), edges->params.floor_ln, LOG_SCALE,
        out_map);
}

double shef_frame_edges_threshold(const struct shef_frame_edges *edges)
{
    return edges->threshold_in_units;
}
