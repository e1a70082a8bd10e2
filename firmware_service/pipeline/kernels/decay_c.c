/* The reference, and the last pixels of a row for the others. */
#include <math.h>
#include <string.h>

#include "core/cpu.h"
#include "pipeline/kernels/decay.h"

static const float poly[] = SHEF_DECAY_POLY;

/* 2^-(whole + SHEF_DECAY_LEVEL_SHIFT), put together from its exponent. */
static float scale_of(int32_t whole)
{
    const uint32_t bits = (uint32_t)(127 - SHEF_DECAY_LEVEL_SHIFT - whole) << 23;
    float scale;

    memcpy(&scale, &bits, sizeof scale);
    return scale;
}

static int32_t age_us(const struct shef_decay *decay, uint32_t t_us)
{
    const int32_t age = (int32_t)(decay->at_us - t_us);

    if (age < 0)
        return 0;
    return age < decay->horizon_us ? age : decay->horizon_us;
}

static int16_t clamped(int32_t value)
{
    if (value > SHEF_DECAY_MAX_VALUE)
        return SHEF_DECAY_MAX_VALUE;
    return (int16_t)(value < -SHEF_DECAY_MAX_VALUE ? -SHEF_DECAY_MAX_VALUE : value);
}

static void row_c(int16_t *out_values, const struct shef_decay_cell *cells, int32_t n,
                  const struct shef_decay *decay)
{
    for (int32_t i = 0; i < n; i++) {
        const float halvings = (float)age_us(decay, cells[i].t_us) * decay->halvings_per_us;
        const int32_t whole = (int32_t)halvings;
        const float rest = halvings - (float)whole;
        float factor = poly[4];

        for (int k = 3; k >= 0; k--)
            factor = factor * rest + poly[k];
        out_values[i] =
            clamped((int32_t)lrintf((float)cells[i].level * (factor * scale_of(whole))));
    }
}

static void accrue_c(int16_t *values, int16_t *before, const int16_t *sums, int32_t n,
                     int16_t weight_q15)
{
    for (int32_t i = 0; i < n; i++) {
        const int16_t gained = (int16_t)(uint16_t)(sums[i] - before[i]);
        const int32_t value = values[i] + ((gained * weight_q15 + (1 << 14)) >> 15);

        values[i] = (int16_t)(value > INT16_MAX   ? INT16_MAX
                              : value < INT16_MIN ? INT16_MIN
                                                  : value);
        before[i] = sums[i];
    }
}

const struct shef_decay_kernels shef_decay_kernels_c = {
    .isa = "c",
    .cpu_features = SHEF_CPU_NONE,
    .row = row_c,
    .accrue = accrue_c,
};
