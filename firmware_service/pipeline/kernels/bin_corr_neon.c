#include <arm_neon.h>
#include <string.h>

#include "pipeline/kernels/bin_corr_band.h"

#define ALWAYS_INLINE inline __attribute__((always_inline))

#define MAX_VECTORS (SHEF_BIN_CORR_MAX_LANES / 16)

/* 0xff in the bytes that the group uses. */
struct lanes {
    uint8x16_t used[MAX_VECTORS];
};

/* Plain words in lane order: widening adds cost nothing extra here. */
struct box {
    uint16x8_t words[2 * MAX_VECTORS];
};

static struct lanes lanes_set(int32_t n)
{
    uint8_t bytes[SHEF_BIN_CORR_MAX_LANES] = { 0 };
    struct lanes lanes;

    memset(bytes, 0xff, (size_t)n);
    for (int32_t i = 0; i < MAX_VECTORS; i++)
        lanes.used[i] = vld1q_u8(bytes + 16 * i);
    return lanes;
}

static ALWAYS_INLINE void column_add(uint8_t *main, uint8_t *rest, const int8_t *e,
                                     const struct lanes *lanes, const bool subtract,
                                     const int32_t n_rest)
{
    for (int32_t i = 0; i < 4 + n_rest / 16; i++) {
        uint8_t *sums = i < 4 ? main + 16 * i : rest + 16 * (i - 4);
        const uint8x16_t old = vld1q_u8(sums);
        const uint8x16_t more = vandq_u8(vreinterpretq_u8_s8(vld1q_s8(e + 16 * i)), lanes->used[i]);

        vst1q_u8(sums, subtract ? vsubq_u8(old, more) : vaddq_u8(old, more));
    }
}

static ALWAYS_INLINE void box_enter(struct box *box, const uint8_t *main, const uint8_t *rest,
                                    const int32_t n_rest)
{
    for (int32_t i = 0; i < 4 + n_rest / 16; i++) {
        const uint8x16_t in = vld1q_u8(i < 4 ? main + 16 * i : rest + 16 * (i - 4));

        box->words[2 * i] = vaddw_u8(box->words[2 * i], vget_low_u8(in));
        box->words[2 * i + 1] = vaddw_high_u8(box->words[2 * i + 1], in);
    }
}

/* Signed sums span twice the range, so that their difference does not fit a signed byte. */
static ALWAYS_INLINE void step16(uint16x8_t *low, uint16x8_t *high, uint8x16_t in, uint8x16_t out,
                                 const bool is_signed)
{
    if (is_signed) {
        *low = vsubw_u8(vaddw_u8(*low, vget_low_u8(in)), vget_low_u8(out));
        *high = vsubw_high_u8(vaddw_high_u8(*high, in), out);
    } else {
        const int8x16_t step = vreinterpretq_s8_u8(vsubq_u8(in, out));

        *low = vreinterpretq_u16_s16(vaddw_s8(vreinterpretq_s16_u16(*low), vget_low_s8(step)));
        *high = vreinterpretq_u16_s16(vaddw_high_s8(vreinterpretq_s16_u16(*high), step));
    }
}

static ALWAYS_INLINE void box_step(struct box *box, const uint8_t *main_in, const uint8_t *main_out,
                                   const uint8_t *rest_in, const uint8_t *rest_out,
                                   const int32_t n_rest, const bool is_signed)
{
    for (int32_t i = 0; i < 4 + n_rest / 16; i++) {
        const uint8x16_t in = vld1q_u8(i < 4 ? main_in + 16 * i : rest_in + 16 * (i - 4));
        const uint8x16_t out = vld1q_u8(i < 4 ? main_out + 16 * i : rest_out + 16 * (i - 4));

        step16(&box->words[2 * i], &box->words[2 * i + 1], in, out, is_signed);
    }
}

static ALWAYS_INLINE void box_park(const struct box *box, uint8_t *parked, const int32_t n_rest)
{
    for (int32_t i = 0; i < 8 + n_rest / 8; i++)
        vst1q_u16((uint16_t *)(void *)(parked + 16 * i), box->words[i]);
}

static ALWAYS_INLINE int32_t box_best(const uint8_t *parked, const int32_t n_rest, int32_t *out_sum)
{
    static const uint16_t first_lanes[8] = { 0, 1, 2, 3, 4, 5, 6, 7 };
    const uint16_t *words = (const uint16_t *)(const void *)parked;
    const int32_t n_vectors = 8 + n_rest / 8;
    uint16x8_t largest = vld1q_u16(words);

    for (int32_t i = 1; i < n_vectors; i++)
        largest = vmaxq_u16(largest, vld1q_u16(words + 8 * i));

    const uint16_t best = vmaxvq_u16(largest);
    const uint16x8_t everywhere = vdupq_n_u16(best);
    uint16x8_t lane = vld1q_u16(first_lanes);
    uint16x8_t first = vdupq_n_u16(UINT16_MAX);

    for (int32_t i = 0; i < n_vectors; i++) {
        const uint16x8_t hit = vceqq_u16(vld1q_u16(words + 8 * i), everywhere);

        first = vminq_u16(first, vornq_u16(lane, hit));
        lane = vaddq_u16(lane, vdupq_n_u16(8));
    }
    *out_sum = best;
    return vminvq_u16(first);
}

#include "pipeline/kernels/bin_corr_sweep.h"

void shef_bin_corr_band_neon(const struct shef_bin_corr_job *job,
                             const struct shef_bin_corr_group *group, int32_t y_begin,
                             int32_t y_end, uint8_t *scratch)
{
    sweep_band_any(job, group, y_begin, y_end, scratch);
}
