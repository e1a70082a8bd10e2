#include <immintrin.h>
#include <string.h>

#include "pipeline/kernels/bin_corr_band.h"

#define ALWAYS_INLINE inline __attribute__((always_inline))

struct lanes {
    __mmask64 main;
    __mmask64 rest;
};

/* 64 sums as words a = s0 + 256 s1 (mod 2^16) and b = s1, twice; 16 more as plain words. */
struct box {
    __m512i a, b;
    __m512i rest_a, rest_b; /* n_rest = 64 */
    __m256i rest_words;     /* n_rest = 16 */
};

static struct lanes lanes_set(int32_t n)
{
    const int32_t n_rest = n - 64;

    return (struct lanes){
        .main = n >= 64 ? UINT64_MAX : (UINT64_C(1) << n) - 1,
        .rest = n_rest >= 64 ? UINT64_MAX
                : n_rest > 0 ? (UINT64_C(1) << n_rest) - 1
                             : 0,
    };
}

static ALWAYS_INLINE void add64(uint8_t *sums, __m512i e, const bool subtract)
{
    const __m512i old = _mm512_load_si512(sums);

    _mm512_store_si512(sums, subtract ? _mm512_sub_epi8(old, e) : _mm512_add_epi8(old, e));
}

static ALWAYS_INLINE void column_add(uint8_t *main, uint8_t *rest, const int8_t *e,
                                     const struct lanes *lanes, const bool subtract,
                                     const int32_t n_rest)
{
    if (n_rest == 0) {
        add64(main, _mm512_maskz_loadu_epi8(lanes->main, e), subtract);
        return;
    }
    add64(main, _mm512_loadu_si512(e), subtract);
    if (n_rest == 16) {
        const __m128i old = _mm_load_si128((const __m128i *)rest);
        const __m128i more = _mm_maskz_loadu_epi8((__mmask16)lanes->rest, e + 64);

        _mm_store_si128((__m128i *)rest,
                        subtract ? _mm_sub_epi8(old, more) : _mm_add_epi8(old, more));
    } else {
        add64(rest, _mm512_maskz_loadu_epi8(lanes->rest, e + 64), subtract);
    }
}

static ALWAYS_INLINE void enter64(__m512i *a, __m512i *b, __m512i in)
{
    *a = _mm512_add_epi16(*a, in);
    *b = _mm512_add_epi16(*b, _mm512_srli_epi16(in, 8));
}

static ALWAYS_INLINE void box_enter(struct box *box, const uint8_t *main, const uint8_t *rest,
                                    const int32_t n_rest)
{
    enter64(&box->a, &box->b, _mm512_load_si512(main));
    if (n_rest == 16)
        box->rest_words = _mm256_add_epi16(
            box->rest_words, _mm256_cvtepu8_epi16(_mm_load_si128((const __m128i *)rest)));
    else if (n_rest == 64)
        enter64(&box->rest_a, &box->rest_b, _mm512_load_si512(rest));
}

/* Signed sums span twice the range, too much for a rounded byte: they take the longer way. */
static ALWAYS_INLINE void step64(__m512i *a, __m512i *b, __m512i in, __m512i out,
                                 const bool is_signed)
{
    const __m512i difference = _mm512_sub_epi16(in, out);
    const __m512i high = is_signed
                             ? _mm512_sub_epi16(_mm512_srli_epi16(in, 8), _mm512_srli_epi16(out, 8))
                             : _mm512_mulhrs_epi16(difference, _mm512_set1_epi16(128));

    *a = _mm512_add_epi16(*a, difference);
    *b = _mm512_add_epi16(*b, high);
}

static ALWAYS_INLINE void box_step(struct box *box, const uint8_t *main_in, const uint8_t *main_out,
                                   const uint8_t *rest_in, const uint8_t *rest_out,
                                   const int32_t n_rest, const bool is_signed)
{
    step64(&box->a, &box->b, _mm512_load_si512(main_in), _mm512_load_si512(main_out), is_signed);
    if (n_rest == 16) {
        const __m128i difference = _mm_sub_epi8(_mm_load_si128((const __m128i *)rest_in),
                                                _mm_load_si128((const __m128i *)rest_out));

        box->rest_words = _mm256_add_epi16(box->rest_words, _mm256_cvtepi8_epi16(difference));
    } else if (n_rest == 64) {
        step64(&box->rest_a, &box->rest_b, _mm512_load_si512(rest_in), _mm512_load_si512(rest_out),
               is_signed);
    }
}

static ALWAYS_INLINE void box_park(const struct box *box, uint8_t *parked, const int32_t n_rest)
{
    _mm512_store_si512(parked, box->a);
    _mm512_store_si512(parked + 64, box->b);
    if (n_rest == 16) {
        _mm256_store_si256((__m256i *)(parked + 128), box->rest_words);
    } else if (n_rest == 64) {
        _mm512_store_si512(parked + 128, box->rest_a);
        _mm512_store_si512(parked + 192, box->rest_b);
    }
}

/* The larger of each pair of neighbouring sums. */
static ALWAYS_INLINE __m512i larger_of_pairs(const uint8_t *parked)
{
    const __m512i b = _mm512_load_si512(parked + 64);
    const __m512i even = _mm512_sub_epi16(_mm512_load_si512(parked), _mm512_slli_epi16(b, 8));

    return _mm512_max_epu16(even, b);
}

/* The even lane of pair i is 2 i, and it wins a tie. */
static ALWAYS_INLINE int32_t lane_of_pair(const uint8_t *parked, int32_t pair, uint16_t best)
{
    const uint16_t *a = (const uint16_t *)parked;
    const uint16_t *b = (const uint16_t *)(parked + 64);
    const uint16_t even = (uint16_t)(a[pair] - (b[pair] << 8));

    return 2 * pair + (even != best);
}

static ALWAYS_INLINE int32_t box_best(const uint8_t *parked, const int32_t n_rest, int32_t *out_sum)
{
    const __m512i ones = _mm512_set1_epi16(-1);
    const __m512i pairs = larger_of_pairs(parked);
    __m512i more = _mm512_setzero_si512();
    __m512i all = pairs;

    if (n_rest == 64) {
        more = larger_of_pairs(parked + 128);
        all = _mm512_max_epu16(all, more);
    }

    __m256i half = _mm256_max_epu16(_mm512_castsi512_si256(all), _mm512_extracti64x4_epi64(all, 1));

    if (n_rest == 16) {
        const __m256i words = _mm256_load_si256((const __m256i *)(parked + 128));

        more = _mm512_castsi256_si512(words);
        half = _mm256_max_epu16(half, words);
    }

    /* The only horizontal instruction looks for a minimum: turn the sums around. */
    const __m128i eighth =
        _mm_max_epu16(_mm256_castsi256_si128(half), _mm256_extracti128_si256(half, 1));
    const __m128i turned = _mm_xor_si128(eighth, _mm512_castsi512_si128(ones));
    const __m128i largest = _mm_xor_si128(_mm_minpos_epu16(turned), _mm512_castsi512_si128(ones));
    const __m512i everywhere = _mm512_broadcastw_epi16(largest);
    const uint16_t best = (uint16_t)_mm_cvtsi128_si32(largest);
    uint64_t hits = _cvtmask32_u32(_mm512_cmpeq_epi16_mask(pairs, everywhere));

    *out_sum = best;
    if (n_rest == 16)
        hits |= (uint64_t)_cvtmask16_u32(_mm256_cmpeq_epi16_mask(
                    _mm512_castsi512_si256(more), _mm512_castsi512_si256(everywhere)))
                << 32;
    else if (n_rest == 64)
        hits |= (uint64_t)_cvtmask32_u32(_mm512_cmpeq_epi16_mask(more, everywhere)) << 32;

    const int32_t hit = __builtin_ctzll(hits);

    if (n_rest == 64)
        return hit < 32 ? lane_of_pair(parked, hit, best)
                        : 64 + lane_of_pair(parked + 128, hit - 32, best);

    /* Read before it is known to be a pair: the bytes are there, and no branch is needed. */
    const int32_t lane = lane_of_pair(parked, hit & 31, best);

    return hit < 32 ? lane : 32 + hit;
}

#include "pipeline/kernels/bin_corr_sweep.h"

void shef_bin_corr_band_avx512(const struct shef_bin_corr_job *job,
                               const struct shef_bin_corr_group *group, int32_t y_begin,
                               int32_t y_end, uint8_t *scratch)
{
    sweep_band_any(job, group, y_begin, y_end, scratch);
}
