/* Reading the filter: rows of its state as images, one table of functions per instruction set.
 *
 * Nothing is written back, so a read-out depends on the events before it and on no other read-out.
 * The arithmetic is IEEE single precision in a fixed order and 16-bit integers: every
 * implementation is bit-exact with the C reference. */
#ifndef SHEF_PIPELINE_KERNELS_DECAY_H
#define SHEF_PIPELINE_KERNELS_DECAY_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* One pixel of the filter: its level just after its newest event. */
struct shef_decay_cell {
    int32_t level; /* 2^18 a contrast step */
    uint32_t t_us; /* event time modulo 2^32 */
};

#define SHEF_DECAY_LEVEL_SHIFT 10 /* from the filter's 2^18 a step to the image's 2^8 */
#define SHEF_DECAY_MAX_VALUE   32767

/* When a row is read and how fast it decays. */
struct shef_decay {
    uint32_t at_us;     /* event time modulo 2^32; a cell newer than this has not decayed */
    int32_t horizon_us; /* from this age on a cell counts as this old; below 2^24 */
    float halvings_per_us;
};

/* 2^-g for g in 0..1 is near POLY[0] + g * (POLY[1] + g * (... POLY[4])): exactly 1 at 0, within
 * 3.5e-6 of the value elsewhere, which is 0.11 of the largest image value's last place. */
#define SHEF_DECAY_POLY                                                                            \
    {                                                                                              \
        1.0f, -0x1.62d838p-1f, 0x1.ea4d86p-3f, -0x1.b338d2p-5f, 0x1.bc31d8p-8f                     \
    }

struct shef_decay_kernels {
    const char *isa;       /* "avx512", "avx2", "neon" or "c" */
    uint32_t cpu_features; /* what it needs */

    /* The filter's value at one instant: level * 2^-(age * halvings_per_us) in 1/256 contrast
     * step, rounded to nearest (ties to even), clamped to +-SHEF_DECAY_MAX_VALUE. */
    void (*row)(int16_t *out_values, const struct shef_decay_cell *cells, int32_t n,
                const struct shef_decay *decay);

    /* Adds weight_q15 / 2^15 of what the running sums gained since they were last looked at:
     *   values[i] = saturated(values[i] + mulhrs(sums[i] - before[i], weight_q15))
     *   before[i] = sums[i]
     * where the difference is modulo 2^16 and mulhrs(a, b) = (a * b + 2^14) >> 15. */
    void (*accrue)(int16_t *values, int16_t *before, const int16_t *sums, int32_t n,
                   int16_t weight_q15);
};

/* The best of them for these features. */
const struct shef_decay_kernels *shef_decay_pick(uint32_t cpu_features);

extern const struct shef_decay_kernels shef_decay_kernels_c;
extern const struct shef_decay_kernels shef_decay_kernels_avx2;
extern const struct shef_decay_kernels shef_decay_kernels_avx512;
extern const struct shef_decay_kernels shef_decay_kernels_neon;

#ifdef __cplusplus
}
#endif

#endif
