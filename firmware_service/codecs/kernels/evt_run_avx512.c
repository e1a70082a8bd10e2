/* 16 words at a time, one per 32-bit lane. */
#include <immintrin.h>

#include "codecs/evt_word.h"
#include "codecs/kernels/evt_run_parts.h"

/* How far ahead words are fetched: the processor's own prefetching lags behind this loop where
 * they come from memory (130 MB of EVT2: 1.47 to 2.10 Gev/s on Zen 5). */
#define PREFETCH_BYTES 4096

#define N_LANES 16

/* Writes 16 events from their times and their x | y_on << 16. */
static inline void store_events(struct shef_event *out, __m512i t_us, __m512i xy)
{
    const __m512i first = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
    const __m512i second = _mm512_add_epi32(first, _mm512_set1_epi32(8));

    _mm512_storeu_si512(out, _mm512_permutex2var_epi32(t_us, first, xy));
    _mm512_storeu_si512(out + 8, _mm512_permutex2var_epi32(t_us, second, xy));
}

size_t shef_evt2_run_avx512(struct shef_evt_run *run, const uint8_t *words, size_t n_words)
{
    const __m512i type_limit = _mm512_set1_epi32((SHEF_EVT2_ON + 1) << 28);
    const __m512i width = _mm512_set1_epi32((int32_t)run->width_px);
    const __m512i height = _mm512_set1_epi32((int32_t)run->height_px);
    const __m512i high_us = _mm512_set1_epi32((int32_t)run->high_us);
    const __m512i address = _mm512_set1_epi32(0x7ff);
    const __m512i low = _mm512_set1_epi32(0x3f);
    struct shef_event *const out = run->events + run->n_events;
    const size_t n_room = run->capacity - run->n_events;
    const size_t n_whole = (n_words < n_room ? n_words : n_room) & ~(size_t)(N_LANES - 1);
    __m512i last_low = _mm512_set1_epi32((int32_t)run->low_us);
    uint32_t n_back = 0;
    size_t n = 0;

    while (n < n_whole) {
        const uint8_t *const block = words + n * 4;
        const __m512i word = _mm512_loadu_si512(block);
        const __m512i x = _mm512_and_si512(_mm512_srli_epi32(word, 11), address);
        const __m512i y = _mm512_and_si512(word, address);
        const __m512i low_us = _mm512_and_si512(_mm512_srli_epi32(word, 22), low);
        const uint32_t ordinary =
            (uint32_t)(_mm512_cmplt_epu32_mask(word, type_limit) &
                       _mm512_cmplt_epu32_mask(x, width) & _mm512_cmplt_epu32_mask(y, height));
        const uint32_t back =
            _mm512_cmplt_epu32_mask(low_us, _mm512_alignr_epi32(low_us, last_low, 15));
        /* Polarity is bit 28 of the word and bit 31 of the event: types are 0 and 1. */
        const __m512i y_on = _mm512_or_si512(
            _mm512_slli_epi32(y, 16),
            _mm512_and_si512(_mm512_slli_epi32(word, 3), _mm512_set1_epi32(INT32_MIN)));

        _mm_prefetch((const char *)((uintptr_t)block + PREFETCH_BYTES), _MM_HINT_T0);
        store_events(out + n, _mm512_add_epi32(high_us, low_us), _mm512_or_si512(x, y_on));
        last_low = low_us;
        if (ordinary == 0xffff) {
            n_back += (uint32_t)__builtin_popcount(back);
            n += N_LANES;
        } else {
            const uint32_t n_taken = (uint32_t)__builtin_ctz(~ordinary);

            n_back += (uint32_t)__builtin_popcount(back & ((1u << n_taken) - 1));
            n += n_taken;
            break;
        }
    }
    run->n_events += (uint32_t)n;
    run->n_back += n_back;
    if (n > 0)
        run->low_us = shef_load_u32(words + (n - 1) * 4) >> 22 & 0x3f;
    return n < n_whole ? n : n + shef_evt2_run_c(run, words + n * 4, n_words - n);
}

/* One event for each set bit: bit i is pixel x + i of xy. Returns where the next one goes. */
static inline struct shef_event *put_vector(struct shef_event *out, uint32_t mask, __m512i t_us,
                                            uint32_t xy)
{
    const __m512i lanes = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const __m512i first = _mm512_add_epi32(lanes, _mm512_set1_epi32((int32_t)xy));
    const __m512i second = _mm512_add_epi32(first, _mm512_set1_epi32(N_LANES));

    store_events(out, t_us, _mm512_maskz_compress_epi32((__mmask16)mask, first));
    store_events(out + __builtin_popcount(mask & 0xffff), t_us,
                 _mm512_maskz_compress_epi32((__mmask16)(mask >> N_LANES), second));
    return out + __builtin_popcount(mask);
}

size_t shef_evt21_run_avx512(struct shef_evt_run *run, const uint8_t *words, size_t n_words)
{
    struct shef_event *const full = run->events + run->capacity - SHEF_EVT_RUN_ROOM;
    struct shef_event *out = run->events + run->n_events;
    struct shef_evt21_vector vector;
    size_t i = 0;

    for (; i < n_words && out <= full && shef_evt21_take(run, words + i * 8, &vector); i++)
        out = put_vector(out, vector.mask, _mm512_set1_epi32((int32_t)vector.t_us),
                         vector.x_px | vector.y_on << 16);
    run->n_events = (uint32_t)(out - run->events);
    return i;
}

/* For each lane the value of the last lane at or before it that is set in mask; lanes before the
 * first one keep what carry has. */
static inline __m512i fill_forward(__m512i value, __mmask16 mask, __m512i carry)
{
    const __m512i up_to_lane =
        _mm512_setr_epi32(0x1, 0x3, 0x7, 0xf, 0x1f, 0x3f, 0x7f, 0xff, 0x1ff, 0x3ff, 0x7ff, 0xfff,
                          0x1fff, 0x3fff, 0x7fff, 0xffff);
    const __m512i set = _mm512_and_si512(_mm512_set1_epi32(mask), up_to_lane);
    /* The exponent of a float is the number of its highest set bit, plus 127. */
    const __m512i exponent = _mm512_srli_epi32(_mm512_castps_si512(_mm512_cvtepi32_ps(set)), 23);
    const __m512i source = _mm512_sub_epi32(exponent, _mm512_set1_epi32(127));

    return _mm512_mask_permutexvar_epi32(carry, _mm512_test_epi32_mask(set, set), source, value);
}

/* A run's state in registers; every lane of a vector has the same value. */
struct state {
    struct shef_event *out;
    __m512i high_us;
    __m512i low_us;
    __m512i row_px;
    struct shef_evt3_base base;
    uint32_t n_back;
};

/* Takes up to 16 words that are not part of a vector; returns how many there were. */
static inline uint32_t take_singles(struct state *state, const uint8_t *words, __m512i width,
                                    __m512i height)
{
    const __m512i word = _mm512_cvtepu16_epi32(_mm256_loadu_si256((const __m256i *)words));
    const __m512i type = _mm512_srli_epi32(word, 12);
    const __m512i address = _mm512_and_si512(word, _mm512_set1_epi32(0x7ff));
    __mmask16 is_row = _mm512_mask_cmplt_epu32_mask(
        _mm512_cmpeq_epi32_mask(type, _mm512_set1_epi32(SHEF_EVT3_ROW)), address, height);
    __mmask16 is_event = _mm512_mask_cmplt_epu32_mask(
        _mm512_cmpeq_epi32_mask(type, _mm512_set1_epi32(SHEF_EVT3_EVENT)), address, width);
    __mmask16 is_low = _mm512_cmpeq_epi32_mask(type, _mm512_set1_epi32(SHEF_EVT3_TIME_LOW));
    const uint32_t ordinary = (uint32_t)(is_row | is_event | is_low);
    uint32_t n_taken = N_LANES;

    /* A branch and not arithmetic: the next 16 words need not wait for these. */
    if (ordinary != 0xffff) {
        n_taken = (uint32_t)__builtin_ctz(~ordinary);
        is_row &= (__mmask16)((1u << n_taken) - 1);
        is_event &= (__mmask16)((1u << n_taken) - 1);
        is_low &= (__mmask16)((1u << n_taken) - 1);
    }

    const __m512i row = fill_forward(address, is_row, state->row_px);
    const __m512i low_us =
        fill_forward(_mm512_and_si512(word, _mm512_set1_epi32(0xfff)), is_low, state->low_us);
    const __m512i on = _mm512_slli_epi32(_mm512_and_si512(word, _mm512_set1_epi32(0x800)), 20);
    const __m512i xy = _mm512_or_si512(_mm512_or_si512(address, _mm512_slli_epi32(row, 16)), on);
    const __m512i t_us = _mm512_add_epi32(state->high_us, low_us);
    const __m512i last_low_us = _mm512_alignr_epi32(low_us, state->low_us, 15);

    store_events(state->out, _mm512_maskz_compress_epi32(is_event, t_us),
                 _mm512_maskz_compress_epi32(is_event, xy));
    state->out += __builtin_popcount(is_event);
    state->n_back += (uint32_t)__builtin_popcount(_mm512_cmplt_epu32_mask(low_us, last_low_us));
    /* Lanes beyond the last one taken repeat its row and time. */
    state->row_px = _mm512_permutexvar_epi32(_mm512_set1_epi32(15), row);
    state->low_us = _mm512_permutexvar_epi32(_mm512_set1_epi32(15), low_us);
    return n_taken;
}

/* Takes VECT_BASE_X and whole groups; returns how many words there were. */
static inline size_t take_vectors(struct state *state, const uint8_t *words, size_t n_words,
                                  uint32_t width_px, const struct shef_event *full)
{
    const uint32_t row_px = (uint32_t)_mm512_cvtsi512_si32(state->row_px);
    const __m512i t_us = _mm512_add_epi32(state->high_us, state->low_us);
    size_t i = 0;

    for (; i + 4 <= n_words; i += SHEF_EVT3_GROUP_WORDS) {
        size_t n_bases;
        uint32_t mask;
        const bool is_group =
            shef_evt3_group(&state->base, words + i * 2, width_px, &n_bases, &mask);

        i += n_bases;
        if (!is_group || state->out > full)
            break;
        state->out = put_vector(state->out, mask, t_us, state->base.x_on + (row_px << 16));
        state->base.x_on += 32;
    }
    return i;
}

size_t shef_evt3_run_avx512(struct shef_evt_run *run, const uint8_t *words, size_t n_words)
{
    const __m512i width = _mm512_set1_epi32((int32_t)run->width_px);
    const __m512i height = _mm512_set1_epi32((int32_t)run->height_px);
    struct shef_event *const full = run->events + run->capacity - SHEF_EVT_RUN_ROOM;
    struct state state = {
        .out = run->events + run->n_events,
        .high_us = _mm512_set1_epi32((int32_t)run->high_us),
        .low_us = _mm512_set1_epi32((int32_t)run->low_us),
        .row_px = _mm512_set1_epi32((int32_t)run->row_px),
        .base = shef_evt3_base_of(run),
    };
    size_t i = 0;
    size_t start = SIZE_MAX;

    while (i != start && i + N_LANES <= n_words && state.out <= full) {
        start = i;
        i += take_singles(&state, words + i * 2, width, height);
        if (i < start + N_LANES)
            i += take_vectors(&state, words + i * 2, n_words - i, run->width_px, full);
    }
    run->n_events = (uint32_t)(state.out - run->events);
    run->n_back += state.n_back;
    run->low_us = (uint32_t)_mm512_cvtsi512_si32(state.low_us);
    run->row_px = (uint32_t)_mm512_cvtsi512_si32(state.row_px);
    shef_evt3_base_keep(&state.base, run);
    return i + shef_evt3_run_c(run, words + i * 2, n_words - i);
}
