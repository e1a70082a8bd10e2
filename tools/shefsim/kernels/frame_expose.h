/* The frame sensor's inner loop: light to numbers, with the noise of photons and of the read-out.
 *
 * Every implementation is the same C loop compiled for another instruction set; only operations
 * that IEEE 754 defines to the bit. */
#ifndef SHEFSIM_KERNELS_FRAME_EXPOSE_H
#define SHEFSIM_KERNELS_FRAME_EXPOSE_H

#include <stdint.h>

/* One row of an exposure. */
struct sim_expose_row {
    const float *radiance; /* n_px, the mean over the exposure; below 0 counts as 0 */
    const float *factor;   /* n_px, what a colour filter lets through; NULL: all of it */
    int32_t n_px;
    float electrons;     /* of a white pixel */
    float read_variance; /* of the read-out's noise, electrons squared */
    float grey_per_electron;
    float black;        /* grey level of no light */
    uint32_t noise_key; /* another one for every row of every frame */
};

/*   out  n_px grey levels */
typedef void sim_expose_fn(const struct sim_expose_row *row, uint8_t *out);

struct sim_frame_expose_impl {
    sim_expose_fn *expose;
    const char *isa;
    uint32_t cpu_features;
};

/* The best that these features allow. */
const struct sim_frame_expose_impl *sim_frame_expose_pick(uint32_t cpu_features);

sim_expose_fn sim_expose_c, sim_expose_avx2, sim_expose_avx512;

#endif
