#include "pipeline/outlier_authors.h"

#include <assert.h>
#include <math.h>
#include <stdalign.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "pipeline/kernels/outlier_count.h"

/* Columns are filtered strip by strip, each strip top to bottom: every sample up and left of a
 * pixel is final by then, every sample down and right is still an input, as in raster order, and
 * the samples of a strip's row are a band of 32 x (2 radius + 1) pixels that stays in the
 * first-level cache from row to row. */
#define STRIP_PX  SHEF_OUTLIER_COUNT_PX
#define MIN_VALID 4 /* fewer samples than this reject */

struct impl {
    shef_outlier_count_fn *count;
    const char *name;
    uint32_t needs;
};

static const struct impl impls[] = {
/* best first, the last needs nothing */
#if defined(__x86_64__)
    { shef_outlier_count_avx512, "avx512", SHEF_CPU_AVX512 },
    { shef_outlier_count_avx2, "avx2", SHEF_CPU_AVX2 },
#elif defined(__aarch64__)
    { shef_outlier_count_neon, "neon", SHEF_CPU_NEON },
#endif
    { shef_outlier_count_c, "c", SHEF_CPU_NONE },
};

struct shef_outlier_authors {
    /* Set by create, then read-only. */
    int32_t width_px;
    int32_t height_px;
    int32_t max_radius_px;
    const struct impl *impl;
    float *memory;
    float *samples;     /* pixel (0, 0); max_radius_px repeated rows and columns on every side */
    ptrdiff_t stride;   /* floats from row to row */
    int16_t *first_row; /* n_valid of the first row's pixels, once they are final */
    int16_t *carry;     /* n_valid of the last column before the strip, once final, by row */
    size_t bytes;
    /* Of the current run. */
    int32_t radius_px;
};

/* One row of one strip. */
struct strip {
    int32_t c_begin;
    int32_t n_px;                    /* pixels that are inside the image */
    alignas(64) float low[STRIP_PX]; /* medians low..high are survived */
    alignas(64) float high[STRIP_PX];
    alignas(64) int16_t below[STRIP_PX];         /* samples under low */
    alignas(64) int16_t above[STRIP_PX];         /* samples over high */
    alignas(64) int16_t n_valid[STRIP_PX];       /* samples that are not NaN */
    alignas(64) int16_t n_valid_final[STRIP_PX]; /* the same when the pixels are final */
};

enum shef_err shef_outlier_authors_create(struct shef_outlier_authors **out_filter,
                                          int32_t width_px, int32_t height_px,
                                          int32_t max_radius_px, uint32_t cpu_features,
                                          struct shef_error *err)
{
    if (width_px < 1 || height_px < 1 || width_px > SHEF_IMAGE_MAX_SIDE_PX ||
        height_px > SHEF_IMAGE_MAX_SIDE_PX)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "outlier filter for %d x %d px: sides must be 1 to %d", width_px,
                         height_px, SHEF_IMAGE_MAX_SIDE_PX);
    if (max_radius_px < 1 || max_radius_px > SHEF_OUTLIER_AUTHORS_MAX_RADIUS_PX)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "outlier filter of radius %d px: it must be 1 to %d", max_radius_px,
                         SHEF_OUTLIER_AUTHORS_MAX_RADIUS_PX);

    struct shef_outlier_authors *filter = calloc(1, sizeof *filter);

    if (!filter)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "outlier filter: out of memory");
    filter->width_px = width_px;
    filter->height_px = height_px;
    filter->max_radius_px = max_radius_px;
    filter->impl = impls;
    while ((filter->impl->needs & cpu_features) != filter->impl->needs)
        filter->impl++;

    const int32_t strips_px = (width_px + STRIP_PX - 1) / STRIP_PX * STRIP_PX;
    const size_t n_rows = (size_t)height_px + 2 * (size_t)max_radius_px;

    filter->stride = strips_px + 2 * (ptrdiff_t)max_radius_px;
    filter->memory = shef_memory_create(n_rows * (size_t)filter->stride, sizeof *filter->memory);
    filter->first_row = shef_memory_create((size_t)strips_px, sizeof *filter->first_row);
    filter->carry = shef_memory_create((size_t)height_px, sizeof *filter->carry);
    filter->bytes = sizeof *filter +
                    shef_memory_round_up((size_t)height_px * sizeof *filter->carry) +
                    shef_memory_round_up((size_t)strips_px * sizeof *filter->first_row) +
                    shef_memory_round_up(n_rows * (size_t)filter->stride * sizeof *filter->memory);
    if (!filter->memory || !filter->first_row || !filter->carry) {
        shef_outlier_authors_destroy(filter);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "outlier filter for %d x %d px: out of memory",
                         width_px, height_px);
    }
    filter->samples = filter->memory + max_radius_px * filter->stride + max_radius_px;
    *out_filter = filter;
    return SHEF_OK;
}

void shef_outlier_authors_destroy(struct shef_outlier_authors *filter)
{
    if (!filter)
        return;
    free(filter->memory);
    free(filter->first_row);
    free(filter->carry);
    free(filter);
}

const char *shef_outlier_authors_isa(const struct shef_outlier_authors *filter)
{
    return filter->impl->name;
}

size_t shef_outlier_authors_bytes(const struct shef_outlier_authors *filter)
{
    return filter->bytes;
}

static float *at(const struct shef_outlier_authors *filter, int32_t r, int32_t c)
{
    return filter->samples + r * filter->stride + c;
}

/* Copies row r, as far as samples reach, to the n rows from to_r on. */
static void repeat_row(const struct shef_outlier_authors *filter, int32_t r, int32_t to_r,
                       int32_t n)
{
    const size_t n_px = (size_t)filter->width_px + 2 * (size_t)filter->radius_px;

    for (int32_t i = 0; i < n; i++)
        memcpy(at(filter, to_r + i, -filter->radius_px), at(filter, r, -filter->radius_px),
               n_px * sizeof(float));
}

static void repeat_first_pixel(const struct shef_outlier_authors *filter, int32_t r)
{
    for (int32_t k = 1; k <= filter->radius_px; k++)
        *at(filter, r, -k) = *at(filter, r, 0);
}

static void take_input(const struct shef_outlier_authors *filter, struct shef_image_f32 in)
{
    const int32_t width = filter->width_px;

    for (int32_t r = 0; r < filter->height_px; r++) {
        const float *from = shef_row_f32(in, r);
        float *to = at(filter, r, 0);

        for (int32_t c = 0; c < width; c++)
            to[c] = from[c] < 1 ? NAN : from[c];
        for (int32_t k = 0; k < filter->radius_px; k++)
            to[width + k] = to[width - 1];
        repeat_first_pixel(filter, r);
    }
    repeat_row(filter, filter->height_px - 1, filter->height_px, filter->radius_px);
}

static void give_output(const struct shef_outlier_authors *filter, struct shef_image_f32 out)
{
    for (int32_t r = 0; r < filter->height_px; r++) {
        const float *from = at(filter, r, 0);
        float *to = shef_row_f32(out, r);

        for (int32_t c = 0; c < filter->width_px; c++)
            to[c] = isnan(from[c]) ? 0 : from[c];
    }
}

/* Floats seen as integers too: the next float up or down from a positive one is one away. */
union floats {
    float value[STRIP_PX];
    int32_t bits[STRIP_PX];
};

/* The medians that v = 1 or more survives: low, the least float that is at least 3/4 v and v - 10,
 * to high, the largest that is at most 3/2 v and v + 10. Of NaN both are NaN.
 *
 * That |v - med| / med <= 1/3 in double is the same as 3/4 v <= med <= 3/2 v in real numbers where
 * med is a float, because floats on the wrong side miss by far more than a double's rounding.
 * Each bound is rounded to nearest, and the differences below, which are exact where their bound
 * is the tighter one, tell whether that went the wrong way. No branches: the compiler vectorises
 * these loops. */
static void survived_medians(const float v[STRIP_PX], float out_low[STRIP_PX],
                             float out_high[STRIP_PX])
{
    union floats ratio;
    union floats shifted;

    for (int32_t i = 0; i < STRIP_PX; i++)
        ratio.value[i] = 0.75f * v[i];
    for (int32_t i = 0; i < STRIP_PX; i++)
        shifted.value[i] = v[i] - 10;
    for (int32_t i = 0; i < STRIP_PX; i++)
        ratio.bits[i] += v[i] - ratio.value[i] > 0.25f * v[i];
    for (int32_t i = 0; i < STRIP_PX; i++)
        shifted.bits[i] += v[i] - shifted.value[i] > 10;
    for (int32_t i = 0; i < STRIP_PX; i++)
        out_low[i] = shifted.value[i] > ratio.value[i] ? shifted.value[i] : ratio.value[i];

    for (int32_t i = 0; i < STRIP_PX; i++)
        ratio.value[i] = 1.5f * v[i];
    for (int32_t i = 0; i < STRIP_PX; i++)
        shifted.value[i] = v[i] + 10;
    for (int32_t i = 0; i < STRIP_PX; i++)
        ratio.bits[i] -= ratio.value[i] - v[i] > 0.5f * v[i];
    for (int32_t i = 0; i < STRIP_PX; i++)
        shifted.bits[i] -= shifted.value[i] - v[i] > 10;
    for (int32_t i = 0; i < STRIP_PX; i++)
        out_high[i] = shifted.value[i] < ratio.value[i] ? shifted.value[i] : ratio.value[i];
}

/* Step 5 by its letter, for the even number of samples that splits exactly at a bound: then the
 * middle two are the samples next to that bound.
 *   bound     low, and the upper half starts at it; or high, and the upper half starts above it */
static bool is_rejected_by_middle(const float *first, ptrdiff_t step, int32_t n_samples, float v,
                                  float bound, bool bound_is_above)
{
    float lower = -INFINITY;
    float upper = INFINITY;

    for (int32_t j = 0; j < n_samples; j++) {
        const float sample = first[j * step];
        const bool is_above = bound_is_above ? sample >= bound : sample > bound;

        if (isnan(sample))
            continue;
        if (is_above)
            upper = sample < upper ? sample : upper;
        else
            lower = sample > lower ? sample : lower;
    }

    const double med = ((double)lower + (double)upper) / 2;
    const double difference = fabs(v - med);

    return difference / med > 1.0 / 3 || difference > 10;
}

/* Steps 4 and 5 for one pixel whose samples are counted. */
static bool is_rejected(const float *first, ptrdiff_t step, int32_t n_samples, float v,
                        int32_t n_valid, int32_t below, int32_t above, float low, float high)
{
    const int32_t half = n_valid / 2;

    if (n_valid < MIN_VALID || below > half || above > half)
        return true;
    if (n_valid % 2 == 0 && below == half)
        return is_rejected_by_middle(first, step, n_samples, v, low, true);
    if (n_valid % 2 == 0 && above == half)
        return is_rejected_by_middle(first, step, n_samples, v, high, false);
    return false;
}

/* How many samples of pixel (r, c) are not NaN. */
static int16_t count_valid(const struct shef_outlier_authors *filter, int32_t r, int32_t c)
{
    const int32_t radius = filter->radius_px;
    int32_t n = 0;

    for (int32_t k = -radius; k <= radius; k++)
        n += !isnan(*at(filter, r + k, c + k));
    return (int16_t)n;
}

/* In the first row the samples up and left are the row's own pixels, so they go one by one. */
static void filter_first_row(const struct shef_outlier_authors *filter)
{
    float samples[2 * SHEF_OUTLIER_AUTHORS_MAX_RADIUS_PX + 1];
    float low[STRIP_PX];
    float high[STRIP_PX];
    const int32_t radius = filter->radius_px;
    const int32_t n_samples = 2 * radius + 1;

    for (int32_t c = 0; c < filter->width_px; c++) {
        float *pixel = at(filter, 0, c);
        const bool was_valid = !isnan(*pixel);
        const int32_t i = c % STRIP_PX;
        int32_t n_valid = 0;
        int32_t below = 0;
        int32_t above = 0;

        if (i == 0)
            survived_medians(pixel, low, high);
        for (int32_t k = -radius; k <= radius; k++)
            samples[k + radius] = *at(filter, k > 0 ? k : 0, c + k);
        for (int32_t j = 0; j < n_samples; j++) {
            n_valid += !isnan(samples[j]);
            below += samples[j] < low[i];
            above += samples[j] > high[i];
        }
        if (is_rejected(samples, 1, n_samples, *pixel, n_valid, below, above, low[i], high[i]))
            *pixel = 0;
        if (c == 0)
            repeat_first_pixel(filter, 0);
        filter->first_row[c] = (int16_t)(n_valid + (!was_valid && !isnan(*pixel)));
    }
    repeat_row(filter, 0, -radius, radius);
}

/* How many samples of the row's pixels are not NaN. One step down the diagonal a sample enters and
 * one leaves; the pixel there may have become a sample. Pixels whose diagonal begins here or ran
 * through copies of the corner are counted. */
static void count_valid_of_strip(const struct shef_outlier_authors *filter, int32_t r,
                                 int16_t n_valid_left, struct strip *strip)
{
    const int32_t radius = filter->radius_px;
    const float *enters = at(filter, r + radius, strip->c_begin + radius);
    const float *leaves = at(filter, r - 1 - radius, strip->c_begin - 1 - radius);

    for (int32_t i = 1; i < STRIP_PX; i++)
        strip->n_valid[i] = (int16_t)(strip->n_valid_final[i - 1] + (enters[i] == enters[i]) -
                                      (leaves[i] == leaves[i]));
    if (strip->c_begin > 0) {
        strip->n_valid[0] = (int16_t)(n_valid_left + !isnan(enters[0]) - !isnan(leaves[0]));
    } else {
        strip->n_valid[0] = count_valid(filter, r, 0);
        if (r == 1 && filter->width_px > 1)
            strip->n_valid[1] = count_valid(filter, 1, 1);
    }
}

static void filter_strip_row(const struct shef_outlier_authors *filter, int32_t r,
                             struct strip *strip)
{
    const int32_t n_samples = 2 * filter->radius_px + 1;
    const ptrdiff_t step = filter->stride + 1;
    const float *first = at(filter, r - filter->radius_px, strip->c_begin - filter->radius_px);
    float *pixels = at(filter, r, strip->c_begin);
    int32_t n_estimates = 0;
    int16_t n_undecided = 0;
    int16_t rejected[STRIP_PX];

    survived_medians(pixels, strip->low, strip->high);
    for (int32_t i = 0; i < STRIP_PX; i++)
        n_estimates += pixels[i] == pixels[i];
    if (n_estimates > 0) {
        filter->impl->count(first, step, n_samples, strip->low, strip->high, strip->below,
                            strip->above);
    } else {
        memset(strip->below, 0, sizeof strip->below);
        memset(strip->above, 0, sizeof strip->above);
    }

    for (int32_t i = 0; i < STRIP_PX; i++) {
        const int16_t half = strip->n_valid[i] >> 1;
        const int16_t is_even = ~strip->n_valid[i] & 1;
        const int16_t larger =
            strip->below[i] > strip->above[i] ? strip->below[i] : strip->above[i];

        rejected[i] = (strip->n_valid[i] < MIN_VALID) | (larger > half);
        n_undecided |= is_even & (larger == half);
    }
    if (n_undecided)
        for (int32_t i = 0; i < strip->n_px; i++)
            rejected[i] =
                is_rejected(first + i, step, n_samples, pixels[i], strip->n_valid[i],
                            strip->below[i], strip->above[i], strip->low[i], strip->high[i]);
    for (int32_t i = 0; i < STRIP_PX; i++)
        strip->n_valid_final[i] =
            (int16_t)(strip->n_valid[i] + (rejected[i] & (pixels[i] != pixels[i])));
    for (int32_t i = 0; i < strip->n_px; i++)
        pixels[i] = rejected[i] ? 0 : pixels[i];
}

static void filter_strip(const struct shef_outlier_authors *filter, int32_t c_begin)
{
    const int32_t n_left = filter->width_px - c_begin;
    struct strip strip = { .c_begin = c_begin, .n_px = n_left < STRIP_PX ? n_left : STRIP_PX };
    int16_t n_valid_left = c_begin > 0 ? filter->first_row[c_begin - 1] : 0;

    memcpy(strip.n_valid_final, filter->first_row + c_begin, sizeof strip.n_valid_final);
    for (int32_t r = 1; r < filter->height_px; r++) {
        count_valid_of_strip(filter, r, n_valid_left, &strip);
        filter_strip_row(filter, r, &strip);
        if (c_begin == 0)
            repeat_first_pixel(filter, r);
        n_valid_left = filter->carry[r];
        filter->carry[r] = strip.n_valid_final[STRIP_PX - 1];
    }
}

void shef_outlier_authors_run(struct shef_outlier_authors *filter, struct shef_image_f32 in,
                              int32_t radius_px, struct shef_image_f32 out)
{
    assert(in.width_px == filter->width_px && in.height_px == filter->height_px);
    assert(out.width_px == filter->width_px && out.height_px == filter->height_px);
    assert(radius_px >= 1 && radius_px <= filter->max_radius_px);

    filter->radius_px = radius_px;
    take_input(filter, in);
    filter_first_row(filter);
    for (int32_t c = 0; c < filter->width_px; c += STRIP_PX)
        filter_strip(filter, c);
    give_output(filter, out);
}
