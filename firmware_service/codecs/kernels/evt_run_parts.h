/* Words of EVT2.1 and vectors of EVT3, as every implementation reads them. */
#ifndef SHEF_CODECS_KERNELS_EVT_RUN_PARTS_H
#define SHEF_CODECS_KERNELS_EVT_RUN_PARTS_H

#include "codecs/evt_word.h"
#include "codecs/kernels/evt_run.h"

/* Events of EVT2.1: one row, one instant, one polarity. */
struct shef_evt21_vector {
    uint32_t mask; /* bit i stands for pixel x_px + i */
    uint32_t t_us;
    uint32_t x_px;
    uint32_t y_on; /* with the polarity in bit 15 */
};

/* Takes an ordinary word's time, and its vector. False: it is not ordinary. */
static inline bool shef_evt21_take(struct shef_evt_run *run, const uint8_t *bytes,
                                   struct shef_evt21_vector *out_vector)
{
    const uint64_t word = shef_evt21_order(shef_load_u64(bytes), run->upper_first);
    const uint32_t type = (uint32_t)(word >> 60);
    const uint32_t low_us = (uint32_t)(word >> 54) & 0x3f;
    const uint32_t x_px = (uint32_t)(word >> 43) & 0x7ff;
    const uint32_t y_px = (uint32_t)(word >> 32) & 0x7ff;
    const uint32_t mask = (uint32_t)word;
    const uint32_t n_px = mask ? 32 - (uint32_t)__builtin_clz(mask) : 0;

    if (type > SHEF_EVT2_ON || y_px >= run->height_px || x_px + n_px > run->width_px)
        return false;
    run->n_back += low_us < run->low_us;
    run->low_us = low_us;
    *out_vector =
        (struct shef_evt21_vector){ mask, run->high_us + low_us, x_px, y_px | type << 15 };
    return true;
}

/* Where the next vector of EVT3 starts. */
struct shef_evt3_base {
    uint32_t x_on; /* x, with the polarity in bit 31 */
    bool is_known;
};

static inline struct shef_evt3_base shef_evt3_base_of(const struct shef_evt_run *run)
{
    return (struct shef_evt3_base){ run->base_px | (uint32_t)run->base_on << 31, run->base_known };
}

static inline void shef_evt3_base_keep(const struct shef_evt3_base *base, struct shef_evt_run *run)
{
    run->base_px = base->x_on & 0xffff;
    run->base_on = base->x_on >> 31;
    run->base_known = base->is_known;
}

/* Takes VECT_BASE_X, if there is one, and looks at the group behind it.
 *   words         four of them
 *   out_n_bases   1 if there was one, else 0
 *   out_mask      bit i stands for pixel base->x_on + i
 * False: there is no whole group, or it reaches too far. */
static inline bool shef_evt3_group(struct shef_evt3_base *base, const uint8_t *words,
                                   uint32_t width_px, size_t *out_n_bases, uint32_t *out_mask)
{
    uint64_t four = shef_load_u64(words);

    *out_n_bases = 0;
    if ((four & 0xf000) == SHEF_EVT3_BASE << 12) {
        base->x_on = ((uint32_t)four & 0x7ff) | ((uint32_t)four & 0x800) << 20;
        base->is_known = true;
        four >>= 16;
        *out_n_bases = 1;
    }
    *out_mask = (uint32_t)((four & 0xfff) | (four >> 4 & 0xfff000) | (four >> 8 & 0xff000000));
    return (four & 0xf000f000f000) == 0x500040004000 && base->is_known &&
           (base->x_on & 0xffff) + 32 <= width_px;
}

#endif
