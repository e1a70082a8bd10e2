#include <immintrin.h>
#include <string.h>

#include "pipeline/kernels/bin_corr_band.h"

#define ALWAYS_INLINE inline __attribute__((always_inline))

/* 0xff in the bytes that the group uses. */
struct lanes {
    __m256i main[2];
    __m256i rest[2];
};

/* 32 sums as words a = s0 + 256 s1 (mod 2^16) and b = s1. */
struct pairs {
    __m256i a, b;
};

struct box {
    struct pairs main[2];
    struct pairs rest[2]; /* n_rest = 64 */
    __m256i rest_words;   /* n_rest = 16 */
};

static struct lanes lanes_set(int32_t n)
{
    uint8_t bytes[SHEF_BIN_CORR_MAX_LANES] = { 0 };

    memset(bytes, 0xff, (size_t)n);
    return (struct lanes){
        .main = { _mm256_loadu_si256((const __m256i *)bytes),
                  _mm256_loadu_si256((const __m256i *)(bytes + 32)) },
        .rest = { _mm256_loadu_si256((const __m256i *)(bytes + 64)),
                  _mm256_loadu_si256((const __m256i *)(bytes + 96)) },
    };
}

static ALWAYS_INLINE void add32(uint8_t *sums, const int8_t *e, __m256i mask, const bool subtract)
{
    const __m256i old = _mm256_load_si256((const __m256i *)sums);
    const __m256i more = _mm256_and_si256(_mm256_loadu_si256((const __m256i *)e), mask);

    _mm256_store_si256((__m256i *)sums,
                       subtract ? _mm256_sub_epi8(old, more) : _mm256_add_epi8(old, more));
}

static ALWAYS_INLINE void column_add(uint8_t *main, uint8_t *rest, const int8_t *e,
                                     const struct lanes *lanes, const bool subtract,
                                     const int32_t n_rest)
{
    add32(main, e, lanes->main[0], subtract);
    add32(main + 32, e + 32, lanes->main[1], subtract);
    if (n_rest == 16) {
        const __m128i old = _mm_load_si128((const __m128i *)rest);
        const __m128i more = _mm_and_si128(_mm_loadu_si128((const __m128i *)(e + 64)),
                                           _mm256_castsi256_si128(lanes->rest[0]));

        _mm_store_si128((__m128i *)rest,
                        subtract ? _mm_sub_epi8(old, more) : _mm_add_epi8(old, more));
    } else if (n_rest == 64) {
        add32(rest, e + 64, lanes->rest[0], subtract);
        add32(rest + 32, e + 96, lanes->rest[1], subtract);
    }
}

static ALWAYS_INLINE void enter32(struct pairs *pairs, const uint8_t *column)
{
    const __m256i in = _mm256_load_si256((const __m256i *)column);

    pairs->a = _mm256_add_epi16(pairs->a, in);
    pairs->b = _mm256_add_epi16(pairs->b, _mm256_srli_epi16(in, 8));
}

static ALWAYS_INLINE void box_enter(struct box *box, const uint8_t *main, const uint8_t *rest,
                                    const int32_t n_rest)
{
    enter32(&box->main[0], main);
    enter32(&box->main[1], main + 32);
    if (n_rest == 16) {
        const __m128i in = _mm_load_si128((const __m128i *)rest);

        box->rest_words = _mm256_add_epi16(box->rest_words, _mm256_cvtepu8_epi16(in));
    } else if (n_rest == 64) {
        enter32(&box->rest[0], rest);
        enter32(&box->rest[1], rest + 32);
    }
}

/* Signed sums span twice the range, too much for a rounded byte: they take the longer way. */
static ALWAYS_INLINE void step32(struct pairs *pairs, const uint8_t *column_in,
                                 const uint8_t *column_out, const bool is_signed)
{
    const __m256i in = _mm256_load_si256((const __m256i *)column_in);
    const __m256i out = _mm256_load_si256((const __m256i *)column_out);
    const __m256i difference = _mm256_sub_epi16(in, out);
    const __m256i high = is_signed
                             ? _mm256_sub_epi16(_mm256_srli_epi16(in, 8), _mm256_srli_epi16(out, 8))
                             : _mm256_mulhrs_epi16(difference, _mm256_set1_epi16(128));

    pairs->a = _mm256_add_epi16(pairs->a, difference);
    pairs->b = _mm256_add_epi16(pairs->b, high);
}

static ALWAYS_INLINE void box_step(struct box *box, const uint8_t *main_in, const uint8_t *main_out,
                                   const uint8_t *rest_in, const uint8_t *rest_out,
                                   const int32_t n_rest, const bool is_signed)
{
    step32(&box->main[0], main_in, main_out, is_signed);
    step32(&box->main[1], main_in + 32, main_out + 32, is_signed);
    if (n_rest == 16) {
        const __m128i difference = _mm_sub_epi8(_mm_load_si128((const __m128i *)rest_in),
                                                _mm_load_si128((const __m128i *)rest_out));

        box->rest_words = _mm256_add_epi16(box->rest_words, _mm256_cvtepi8_epi16(difference));
    } else if (n_rest == 64) {
        step32(&box->rest[0], rest_in, rest_out, is_signed);
        step32(&box->rest[1], rest_in + 32, rest_out + 32, is_signed);
    }
}

static ALWAYS_INLINE void park32(uint8_t *parked, const struct pairs *pairs)
{
    _mm256_store_si256((__m256i *)parked, pairs->a);
    _mm256_store_si256((__m256i *)(parked + 32), pairs->b);
}

static ALWAYS_INLINE void box_park(const struct box *box, uint8_t *parked, const int32_t n_rest)
{
    park32(parked, &box->main[0]);
    park32(parked + 64, &box->main[1]);
    if (n_rest == 16) {
        _mm256_store_si256((__m256i *)(parked + 128), box->rest_words);
    } else if (n_rest == 64) {
        park32(parked + 128, &box->rest[0]);
        park32(parked + 192, &box->rest[1]);
    }
}

/* The larger of each pair of neighbouring sums. */
static ALWAYS_INLINE __m256i larger_of_pairs(const uint8_t *parked)
{
    const __m256i a = _mm256_load_si256((const __m256i *)parked);
    const __m256i b = _mm256_load_si256((const __m256i *)(parked + 32));

    return _mm256_max_epu16(_mm256_sub_epi16(a, _mm256_slli_epi16(b, 8)), b);
}

/* The even lane of pair i is 2 i, and it wins a tie. */
static ALWAYS_INLINE int32_t lane_of_pair(const uint8_t *parked, int32_t pair, uint16_t best)
{
    const uint8_t *block = parked + 64 * (pair / 16);
    const uint16_t *a = (const uint16_t *)block;
    const uint16_t *b = (const uint16_t *)(block + 32);
    const uint16_t even = (uint16_t)(a[pair % 16] - (b[pair % 16] << 8));

    return 2 * pair + (even != best);
}

/* Bit i: pair i of the 32 has the value. */
static ALWAYS_INLINE uint32_t find(__m256i first, __m256i second, __m256i value)
{
    const __m256i bytes =
        _mm256_packs_epi16(_mm256_cmpeq_epi16(first, value), _mm256_cmpeq_epi16(second, value));

    return (uint32_t)_mm256_movemask_epi8(_mm256_permute4x64_epi64(bytes, 0xd8));
}

static ALWAYS_INLINE int32_t box_best(const uint8_t *parked, const int32_t n_rest, int32_t *out_sum)
{
    const __m128i ones = _mm_set1_epi16(-1);
    const __m256i main0 = larger_of_pairs(parked);
    const __m256i main1 = larger_of_pairs(parked + 64);
    __m256i rest0 = _mm256_setzero_si256();
    __m256i rest1 = rest0;

    if (n_rest == 16) {
        rest0 = _mm256_load_si256((const __m256i *)(parked + 128));
    } else if (n_rest == 64) {
        rest0 = larger_of_pairs(parked + 128);
        rest1 = larger_of_pairs(parked + 192);
    }

    /* The only horizontal instruction looks for a minimum: turn the sums around. */
    const __m256i all =
        _mm256_max_epu16(_mm256_max_epu16(main0, main1), _mm256_max_epu16(rest0, rest1));
    const __m128i eighth =
        _mm_max_epu16(_mm256_castsi256_si128(all), _mm256_extracti128_si256(all, 1));
    const __m128i largest = _mm_xor_si128(_mm_minpos_epu16(_mm_xor_si128(eighth, ones)), ones);
    const __m256i everywhere = _mm256_broadcastw_epi16(largest);
    const uint16_t best = (uint16_t)_mm_cvtsi128_si32(largest);
    uint64_t hits = find(main0, main1, everywhere);

    if (n_rest != 0)
        hits |= (uint64_t)find(rest0, rest1, everywhere) << 32;
    *out_sum = best;

    const int32_t hit = __builtin_ctzll(hits);

    if (n_rest == 64)
        return lane_of_pair(parked, hit, best);

    /* Read before it is known to be a pair: the bytes are there, and no branch is needed. */
    const int32_t lane = lane_of_pair(parked, hit & 31, best);

    return hit < 32 ? lane : 32 + hit;
}

#include "pipeline/kernels/bin_corr_sweep.h"

void shef_bin_corr_band_avx2(const struct shef_bin_corr_job *job,
                             const struct shef_bin_corr_group *group, int32_t y_begin,
                             int32_t y_end, uint8_t *scratch)
{
    sweep_band_any(job, group, y_begin, y_end, scratch);
}
