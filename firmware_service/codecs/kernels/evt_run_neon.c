/* Four words at a time. EVT2 only: the C versions of the others branch little already. */
#include <arm_neon.h>

#include "codecs/evt_word.h"
#include "codecs/kernels/evt_run.h"

#define N_LANES 4

size_t shef_evt2_run_neon(struct shef_evt_run *run, const uint8_t *words, size_t n_words)
{
    const uint32x4_t width = vdupq_n_u32(run->width_px);
    const uint32x4_t height = vdupq_n_u32(run->height_px);
    const uint32x4_t high_us = vdupq_n_u32(run->high_us);
    const uint32x4_t address = vdupq_n_u32(0x7ff);
    uint32x4_t last_low = vdupq_n_u32(run->low_us);
    uint32x4_t n_back = vdupq_n_u32(0);
    size_t i = 0;

    for (; i + N_LANES <= n_words && run->capacity - run->n_events >= SHEF_EVT_RUN_ROOM;
         i += N_LANES) {
        const uint32x4_t word = vreinterpretq_u32_u8(vld1q_u8(words + i * 4));
        const uint32x4_t type = vshrq_n_u32(word, 28);
        const uint32x4_t x = vandq_u32(vshrq_n_u32(word, 11), address);
        const uint32x4_t y = vandq_u32(word, address);
        const uint32x4_t low_us = vandq_u32(vshrq_n_u32(word, 22), vdupq_n_u32(0x3f));
        const uint32x4_t ordinary = vandq_u32(vcltq_u32(type, vdupq_n_u32(SHEF_EVT2_ON + 1)),
                                              vandq_u32(vcltq_u32(x, width), vcltq_u32(y, height)));
        uint32x4x2_t events;

        if (vminvq_u32(ordinary) == 0)
            break;
        n_back = vsubq_u32(n_back, vcltq_u32(low_us, vextq_u32(last_low, low_us, 3)));
        last_low = low_us;
        events.val[0] = vaddq_u32(high_us, low_us);
        events.val[1] = vorrq_u32(vorrq_u32(x, vshlq_n_u32(y, 16)), vshlq_n_u32(type, 31));
        vst2q_u32((uint32_t *)(run->events + run->n_events), events);
        run->n_events += N_LANES;
    }
    run->n_back += vaddvq_u32(n_back);
    run->low_us = vgetq_lane_u32(last_low, 3);
    return i + shef_evt2_run_c(run, words + i * 4, n_words - i);
}
