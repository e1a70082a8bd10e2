#include "pipeline/filter.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "pipeline/filter_state.h"

#define DEAD_EXPONENT 23.0 /* exp(-23) of the largest level is below half its last place */
#define DEAD_HALVINGS 64   /* the same for the read-out, whose exponents must fit a float */
#define FAR_US        (INT64_C(1) << 30)

struct shef_filter_params shef_filter_default_params(int32_t width_px, int32_t height_px)
{
    return (struct shef_filter_params){
        .width_px = width_px,
        .height_px = height_px,
        .cutoff_rad_s = 120.0, /* Wang 2021, section IV */
        .on_gain = 1.0,
        .off_gain = 1.0,
        .back_step_us = 5000,
    };
}

static enum shef_err check_params(const struct shef_filter_params *p, struct shef_error *err)
{
    if (p->width_px < 1 || p->width_px > 2048 || p->height_px < 1 || p->height_px > 2048)
        return shef_fail(err, SHEF_ERR_INVALID, "filter of %d x %d px: sides must be 1 to 2048",
                         p->width_px, p->height_px);
    if (!(p->cutoff_rad_s >= 8.0 && p->cutoff_rad_s <= 2000.0))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "filter cut-off of %g rad/s: it must be 8 to 2000; 120 is usual",
                         p->cutoff_rad_s);
    if (!(p->on_gain >= 0.01 && p->on_gain <= 16.0 && p->off_gain >= 0.01 && p->off_gain <= 16.0))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "filter gains of %g (on) and %g (off): they must be 0.01 to 16",
                         p->on_gain, p->off_gain);
    if (p->back_step_us < 0 || p->back_step_us > 1000000)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "tolerated backward step of %d us: it must be 0 to 1000000",
                         p->back_step_us);
    return SHEF_OK;
}

/* Rounded; 2^32 itself becomes 2^32 - 1, which changes no rounded level. */
static uint32_t to_u32(double value)
{
    const double rounded = nearbyint(value);

    return rounded > UINT32_MAX ? UINT32_MAX : (uint32_t)rounded;
}

/* The two tables reach at least DEAD_EXPONENT / cutoff. */
static void fill_tables(struct shef_filter *filter)
{
    const double per_us = filter->params.cutoff_rad_s * 1e-6;

    filter->low_bits = SHEF_FILTER_MIN_LOW_BITS;
    while (SHEF_FILTER_HIGH_ENTRIES * (double)(1u << filter->low_bits) * per_us < DEAD_EXPONENT)
        filter->low_bits++;
    assert(filter->low_bits <= SHEF_FILTER_MAX_LOW_BITS);

    const uint32_t n_low = 1u << filter->low_bits;

    for (uint32_t i = 0; i < n_low; i++)
        filter->low[i] = to_u32(0x1p32 * exp(-per_us * i));
    for (uint32_t i = 0; i < SHEF_FILTER_HIGH_ENTRIES; i++)
        filter->high[i] = to_u32(0x1p31 * exp(-per_us * n_low * i));
    filter->high[SHEF_FILTER_HIGH_ENTRIES] = 0;
    filter->max_age_us = SHEF_FILTER_HIGH_ENTRIES * n_low;
    filter->halvings_per_us = (float)(per_us / M_LN2);
    filter->horizon_us = (int32_t)fmin(filter->max_age_us, DEAD_HALVINGS * M_LN2 / per_us);
}

enum shef_err shef_filter_create(struct shef_filter **out_filter,
                                 const struct shef_filter_params *params, uint32_t cpu_features,
                                 struct shef_error *err)
{
    const enum shef_err code = check_params(params, err);

    if (code != SHEF_OK)
        return code;

    struct shef_filter *filter = calloc(1, sizeof *filter);
    const size_t n_pixels = (size_t)params->width_px * (size_t)params->height_px;

    if (filter) {
        filter->cells = shef_memory_create(n_pixels, sizeof *filter->cells);
        filter->sums = shef_memory_create(n_pixels, sizeof *filter->sums);
    }
    if (!filter || !filter->cells || !filter->sums) {
        shef_filter_destroy(filter);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "filter of %d x %d px: out of memory",
                         params->width_px, params->height_px);
    }
    filter->params = *params;
    filter->kernels = shef_decay_pick(cpu_features);
    filter->level_steps[0] = (int32_t)-lrint(params->off_gain * SHEF_FILTER_LEVEL_STEP);
    filter->level_steps[1] = (int32_t)lrint(params->on_gain * SHEF_FILTER_LEVEL_STEP);
    filter->sum_steps[0] = (int16_t)-lrint(params->off_gain * SHEF_FILTER_VALUE_STEP);
    filter->sum_steps[1] = (int16_t)lrint(params->on_gain * SHEF_FILTER_VALUE_STEP);
    filter->newest_us = INT64_MIN;
    fill_tables(filter);
    *out_filter = filter;
    return SHEF_OK;
}

void shef_filter_destroy(struct shef_filter *filter)
{
    if (!filter)
        return;
    free(filter->cells);
    free(filter->sums);
    free(filter->gains);
    free(filter);
}

enum shef_err shef_filter_set_gains(struct shef_filter *filter,
                                    const struct shef_filter_gain *gains, struct shef_error *err)
{
    if (!gains) {
        free(filter->gains);
        filter->gains = NULL;
        return SHEF_OK;
    }
    if (!filter->gains)
        filter->gains = shef_memory_create(shef_filter_pixel_count(filter), sizeof *filter->gains);
    if (!filter->gains)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "gain map of %d x %d px: out of memory",
                         filter->params.width_px, filter->params.height_px);
    memcpy(filter->gains, gains, shef_filter_pixel_count(filter) * sizeof *gains);
    return SHEF_OK;
}

static void zero_masked(const struct shef_filter *filter, struct shef_image_i16 image)
{
    const uint32_t width_px = (uint32_t)filter->params.width_px;

    for (uint32_t i = 0; i < filter->n_masked; i++) {
        const uint32_t pixel = filter->masked[i];

        shef_row_i16(image, (int32_t)(pixel / width_px))[pixel % width_px] = 0;
    }
}

static void check_size(const struct shef_filter *filter, struct shef_image_i16 image)
{
    assert(image.width_px == filter->params.width_px);
    assert(image.height_px == filter->params.height_px);
}

/* Ages of 2^30 us are as dead as longer ones, and do not wrap. */
static int64_t near_us(const struct shef_filter *filter, shef_event_time at)
{
    const int64_t at_us = shef_filter_whole_us(at);

    if (filter->newest_us == INT64_MIN)
        return at_us;
    if (at_us > filter->newest_us + FAR_US)
        return filter->newest_us + FAR_US;
    return at_us < filter->newest_us - FAR_US ? filter->newest_us - FAR_US : at_us;
}

void shef_filter_read(const struct shef_filter *filter, shef_event_time at,
                      struct shef_image_i16 out_values)
{
    const struct shef_decay decay = {
        .at_us = (uint32_t)near_us(filter, at),
        .horizon_us = filter->horizon_us,
        .halvings_per_us = filter->halvings_per_us,
    };
    const int32_t width_px = filter->params.width_px;

    check_size(filter, out_values);
    for (int32_t y = 0; y < filter->params.height_px; y++)
        filter->kernels->row(shef_row_i16(out_values, y),
                             filter->cells + (size_t)y * (size_t)width_px, width_px, &decay);
    zero_masked(filter, out_values);
}

void shef_filter_read_sums(const struct shef_filter *filter, struct shef_image_i16 out_sums)
{
    const size_t width_px = (size_t)filter->params.width_px;

    check_size(filter, out_sums);
    for (int32_t y = 0; y < filter->params.height_px; y++)
        memcpy(shef_row_i16(out_sums, y), filter->sums + (size_t)y * width_px,
               width_px * sizeof *filter->sums);
    zero_masked(filter, out_sums);
}

void shef_filter_accrue_sums(const struct shef_filter *filter, double weight,
                             struct shef_image_i16 values, struct shef_image_i16 before)
{
    const int32_t width_px = filter->params.width_px;
    const long weight_q15 = lrint(weight * 0x1p15);

    check_size(filter, values);
    check_size(filter, before);
    assert(weight_q15 >= 0);
    for (int32_t y = 0; y < filter->params.height_px; y++)
        filter->kernels->accrue(shef_row_i16(values, y), shef_row_i16(before, y),
                                filter->sums + (size_t)y * (size_t)width_px, width_px,
                                (int16_t)(weight_q15 < INT16_MAX ? weight_q15 : INT16_MAX));
    zero_masked(filter, values);
}

int32_t shef_filter_level(const struct shef_filter *filter, int32_t x_px, int32_t y_px,
                          shef_event_time at)
{
    const size_t pixel = (size_t)y_px * (size_t)filter->params.width_px + (size_t)x_px;
    const struct shef_decay_cell cell = filter->cells[pixel];
    const int32_t age_us = (int32_t)((uint32_t)near_us(filter, at) - cell.t_us);

    assert(shef_filter_is_on_sensor(filter, (uint32_t)x_px, (uint32_t)y_px));
    return (int32_t)shef_filter_decayed(filter, cell.level, age_us > 0 ? age_us : 0,
                                        filter->max_age_us, filter->low_bits);
}

void shef_filter_set_mask(struct shef_filter *filter, const uint32_t *pixels, uint32_t n_pixels)
{
    assert(n_pixels <= SHEF_FILTER_MAX_MASKED);
    for (uint32_t i = 0; i < n_pixels; i++) {
        assert(pixels[i] < shef_filter_pixel_count(filter));
        filter->masked[i] = pixels[i];
    }
    filter->n_masked = n_pixels;
}

struct shef_filter_stats shef_filter_stats(const struct shef_filter *filter)
{
    return filter->stats;
}

shef_event_time shef_filter_newest(const struct shef_filter *filter)
{
    if (filter->newest_us == INT64_MIN)
        return (shef_event_time){ INT64_MIN };
    return (shef_event_time){ filter->newest_us * SHEF_NS_PER_US };
}

int64_t shef_filter_lag_ns(const struct shef_filter *filter)
{
    return llrint(1e9 / filter->params.cutoff_rad_s);
}

const struct shef_filter_params *shef_filter_params(const struct shef_filter *filter)
{
    return &filter->params;
}
