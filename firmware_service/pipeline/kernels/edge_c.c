/* The reference, and the last pixels of a row for the others. */
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "pipeline/kernels/edge.h"

static uint32_t count_c(const int16_t *values, int32_t n, int32_t threshold)
{
    uint32_t n_far = 0;

    for (int32_t i = 0; i < n; i++)
        n_far += abs(values[i]) >= threshold;
    return n_far;
}

static void bits_c(uint64_t *plus, uint64_t *minus, const int16_t *values, int32_t n,
                   int32_t threshold)
{
    const size_t n_words = (size_t)(n + 63) / 64;

    memset(plus, 0, n_words * sizeof *plus);
    if (minus)
        memset(minus, 0, n_words * sizeof *minus);
    for (int32_t i = 0; i < n; i++) {
        const uint64_t bit = UINT64_C(1) << (i % 64);

        if (values[i] >= threshold || (!minus && values[i] <= -threshold))
            plus[i / 64] |= bit;
        else if (values[i] <= -threshold)
            minus[i / 64] |= bit;
    }
}

static void graded_c(int8_t *out, const int16_t *values, int32_t n,
                     const struct shef_edge_scale *scale)
{
    for (int32_t i = 0; i < n; i++) {
        const int32_t low = values[i] > -scale->limit ? values[i] : -scale->limit;
        const int32_t clamped = low < scale->limit ? low : scale->limit;
        const int32_t shifted = clamped * (1 << scale->shift);

        out[i] = (int8_t)((((shifted * scale->gain + (1 << 14)) >> 15) + 64) >> 7);
    }
}

static void ridges_c(uint64_t *out_words, const int16_t *const rows[3], int32_t n,
                     int32_t threshold)
{
    memset(out_words, 0, (size_t)(n + 63) / 64 * sizeof *out_words);
    for (int32_t i = 0; i < n; i++) {
        const int16_t value = rows[1][i];
        const int16_t left = rows[1][i - 1];
        const int16_t right = rows[1][i + 1];
        const int16_t upper = rows[0][i];
        const int16_t lower = rows[2][i];
        const int is_level = (upper + lower + 1) >> 1 < (left + right + 1) >> 1;

        if (value >= threshold && value > (is_level ? upper : left) &&
            value >= (is_level ? lower : right))
            out_words[i / 64] |= UINT64_C(1) << (i % 64);
    }
}

const struct shef_edge_kernels shef_edge_kernels_c = {
    .isa = "c",
    .cpu_features = SHEF_CPU_NONE,
    .count = count_c,
    .bits = bits_c,
    .graded = graded_c,
    .ridges = ridges_c,
};
