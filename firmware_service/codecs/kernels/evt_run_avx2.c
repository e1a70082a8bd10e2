/* 8 words at a time, one per 32-bit lane. */
#include <immintrin.h>

#include "codecs/evt_word.h"
#include "codecs/kernels/evt_run_parts.h"

/* How far ahead words are fetched: the processor's own prefetching lags behind this loop where
 * they come from memory (130 MB of EVT2: 1.47 to 2.10 Gev/s on Zen 5). */
#define PREFETCH_BYTES 4096

#define N_LANES 8

/* Eight events from their times and their x | y_on << 16, four in each result. */
static inline void join(__m256i t_us, __m256i xy, __m256i *out_first, __m256i *out_second)
{
    const __m256i low = _mm256_unpacklo_epi32(t_us, xy);  /* events 0, 1, 4, 5 */
    const __m256i high = _mm256_unpackhi_epi32(t_us, xy); /* events 2, 3, 6, 7 */

    *out_first = _mm256_permute2x128_si256(low, high, 0x20);
    *out_second = _mm256_permute2x128_si256(low, high, 0x31);
}

static inline void store_four(struct shef_event *out, __m256i events)
{
    _mm256_storeu_si256((__m256i *)(void *)out, events);
}

/* A bit per lane whose sign bit is set. */
static inline uint32_t mask_of(__m256i lanes)
{
    return (uint32_t)_mm256_movemask_ps(_mm256_castsi256_ps(lanes));
}

/* Lanes moved up by one; the first becomes the last of before. */
static inline __m256i one_later(__m256i lanes, __m256i before)
{
    return _mm256_alignr_epi8(lanes, _mm256_permute2x128_si256(before, lanes, 0x21), 12);
}

size_t shef_evt2_run_avx2(struct shef_evt_run *run, const uint8_t *words, size_t n_words)
{
    const __m256i type_limit = _mm256_set1_epi32(SHEF_EVT2_ON + 1);
    const __m256i width = _mm256_set1_epi32((int32_t)run->width_px);
    const __m256i height = _mm256_set1_epi32((int32_t)run->height_px);
    const __m256i high_us = _mm256_set1_epi32((int32_t)run->high_us);
    const __m256i address = _mm256_set1_epi32(0x7ff);
    const __m256i low = _mm256_set1_epi32(0x3f);
    struct shef_event *const out = run->events + run->n_events;
    const size_t n_room = run->capacity - run->n_events;
    const size_t n_whole = (n_words < n_room ? n_words : n_room) & ~(size_t)(N_LANES - 1);
    __m256i last_low = _mm256_set1_epi32((int32_t)run->low_us);
    uint32_t n_back = 0;
    size_t n = 0;

    while (n < n_whole) {
        const uint8_t *const block = words + n * 4;
        const __m256i word = _mm256_loadu_si256((const __m256i *)(const void *)block);
        const __m256i type = _mm256_srli_epi32(word, 28);
        const __m256i x = _mm256_and_si256(_mm256_srli_epi32(word, 11), address);
        const __m256i y = _mm256_and_si256(word, address);
        const __m256i low_us = _mm256_and_si256(_mm256_srli_epi32(word, 22), low);
        const uint32_t ordinary = mask_of(_mm256_and_si256(
            _mm256_cmpgt_epi32(type_limit, type),
            _mm256_and_si256(_mm256_cmpgt_epi32(width, x), _mm256_cmpgt_epi32(height, y))));
        const uint32_t back = mask_of(_mm256_cmpgt_epi32(one_later(low_us, last_low), low_us));
        const __m256i y_on = _mm256_or_si256(_mm256_slli_epi32(y, 16), _mm256_slli_epi32(type, 31));
        __m256i first;
        __m256i second;

        join(_mm256_add_epi32(high_us, low_us), _mm256_or_si256(x, y_on), &first, &second);
        _mm_prefetch((const char *)((uintptr_t)block + PREFETCH_BYTES), _MM_HINT_T0);
        store_four(out + n, first);
        store_four(out + n + 4, second);
        last_low = low_us;
        if (ordinary == 0xff) {
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

/* For each mask of four events, the 32-bit lanes that move those events to the front. */
static const uint32_t front_of[16][8] = {
    { 0, 0, 0, 0, 0, 0, 0, 0 }, { 0, 1, 0, 0, 0, 0, 0, 0 }, { 2, 3, 0, 0, 0, 0, 0, 0 },
    { 0, 1, 2, 3, 0, 0, 0, 0 }, { 4, 5, 0, 0, 0, 0, 0, 0 }, { 0, 1, 4, 5, 0, 0, 0, 0 },
    { 2, 3, 4, 5, 0, 0, 0, 0 }, { 0, 1, 2, 3, 4, 5, 0, 0 }, { 6, 7, 0, 0, 0, 0, 0, 0 },
    { 0, 1, 6, 7, 0, 0, 0, 0 }, { 2, 3, 6, 7, 0, 0, 0, 0 }, { 0, 1, 2, 3, 6, 7, 0, 0 },
    { 4, 5, 6, 7, 0, 0, 0, 0 }, { 0, 1, 4, 5, 6, 7, 0, 0 }, { 2, 3, 4, 5, 6, 7, 0, 0 },
    { 0, 1, 2, 3, 4, 5, 6, 7 },
};

/* Stores those of eight events whose bit is set. Returns where the next one goes. */
static inline struct shef_event *put_eight(struct shef_event *out, uint32_t mask, __m256i t_us,
                                           __m256i xy)
{
    const uint32_t *const first_lanes = front_of[mask & 0xf];
    const uint32_t *const second_lanes = front_of[mask >> 4];
    __m256i first;
    __m256i second;

    join(t_us, xy, &first, &second);
    store_four(out, _mm256_permutevar8x32_epi32(
                        first, _mm256_loadu_si256((const __m256i *)(const void *)first_lanes)));
    store_four(out + __builtin_popcount(mask & 0xf),
               _mm256_permutevar8x32_epi32(
                   second, _mm256_loadu_si256((const __m256i *)(const void *)second_lanes)));
    return out + __builtin_popcount(mask);
}

/* One event for each set bit: bit i stands for pixel x + i of xy. */
static inline struct shef_event *put_vector(struct shef_event *out, uint32_t mask, __m256i t_us,
                                            uint32_t xy)
{
    __m256i lanes =
        _mm256_add_epi32(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), _mm256_set1_epi32((int32_t)xy));

    for (; mask != 0; mask >>= N_LANES) {
        out = put_eight(out, mask & 0xff, t_us, lanes);
        lanes = _mm256_add_epi32(lanes, _mm256_set1_epi32(N_LANES));
    }
    return out;
}

/* A run's state in registers; every lane of a vector has the same value. */
struct state {
    struct shef_event *out;
    __m256i high_us;
    __m256i low_row; /* TIME_LOW in the upper 16 bits, row in the lower */
    struct shef_evt3_base base;
    uint32_t n_back;
};

/* Moves lanes up by one or two; zeros come in. */
#define LANES_UP(lanes, n)                                                                         \
    _mm256_alignr_epi8(lanes, _mm256_permute2x128_si256(lanes, lanes, 0x08), 16 - 4 * (n))

/* For each lane the last value at or before it that is not 0, else carry's. Values have the number
 * of their lane on top, so the last is the largest; two 16-bit values share a lane. */
static inline __m256i fill_forward(__m256i values, __m256i carry)
{
    values = _mm256_max_epu16(values, LANES_UP(values, 1));
    values = _mm256_max_epu16(values, LANES_UP(values, 2));
    values = _mm256_max_epu16(values, _mm256_permute2x128_si256(values, values, 0x08));
    return _mm256_and_si256(_mm256_max_epu16(values, carry), _mm256_set1_epi16(0xfff));
}

/* Takes up to 8 words that are not part of a vector; returns how many there were. */
static inline uint32_t take_singles(struct state *state, const uint8_t *words, __m256i width,
                                    __m256i height)
{
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    const __m256i row_tag = _mm256_slli_epi32(_mm256_add_epi32(lane, _mm256_set1_epi32(1)), 12);
    const __m256i low_tag = _mm256_slli_epi32(row_tag, 16);
    const __m256i word =
        _mm256_cvtepu16_epi32(_mm_loadu_si128((const __m128i *)(const void *)words));
    const __m256i type = _mm256_srli_epi32(word, 12);
    const __m256i address = _mm256_and_si256(word, _mm256_set1_epi32(0x7ff));
    const __m256i is_row =
        _mm256_and_si256(_mm256_cmpeq_epi32(type, _mm256_set1_epi32(SHEF_EVT3_ROW)),
                         _mm256_cmpgt_epi32(height, address));
    const __m256i is_event =
        _mm256_and_si256(_mm256_cmpeq_epi32(type, _mm256_set1_epi32(SHEF_EVT3_EVENT)),
                         _mm256_cmpgt_epi32(width, address));
    const __m256i is_low = _mm256_cmpeq_epi32(type, _mm256_set1_epi32(SHEF_EVT3_TIME_LOW));
    const uint32_t ordinary = mask_of(_mm256_or_si256(_mm256_or_si256(is_row, is_event), is_low));
    uint32_t events = mask_of(is_event);
    __m256i news = _mm256_or_si256(
        _mm256_and_si256(is_row, _mm256_or_si256(address, row_tag)),
        _mm256_and_si256(
            is_low, _mm256_or_si256(_mm256_srli_epi32(_mm256_slli_epi32(word, 20), 4), low_tag)));
    uint32_t n_taken = N_LANES;

    /* A branch and not arithmetic: the next 8 words need not wait for these. */
    if (ordinary != 0xff) {
        n_taken = (uint32_t)__builtin_ctz(~ordinary);
        events &= (1u << n_taken) - 1;
        news =
            _mm256_and_si256(news, _mm256_cmpgt_epi32(_mm256_set1_epi32((int32_t)n_taken), lane));
    }

    const __m256i low_row = fill_forward(news, state->low_row);
    const __m256i low_us = _mm256_srli_epi32(low_row, 16);
    const __m256i last_low_us = _mm256_srli_epi32(one_later(low_row, state->low_row), 16);
    const __m256i on = _mm256_slli_epi32(_mm256_srli_epi32(word, 11), 31);
    const __m256i xy =
        _mm256_or_si256(_mm256_or_si256(address, _mm256_slli_epi32(low_row, 16)), on);

    state->out = put_eight(state->out, events, _mm256_add_epi32(state->high_us, low_us), xy);
    state->n_back += (uint32_t)__builtin_popcount(mask_of(_mm256_cmpgt_epi32(last_low_us, low_us)));
    /* Lanes beyond the last one taken repeat its row and time. */
    state->low_row = _mm256_permutevar8x32_epi32(low_row, _mm256_set1_epi32(7));
    return n_taken;
}

/* Takes VECT_BASE_X and whole groups; returns how many words there were. */
static inline size_t take_vectors(struct state *state, const uint8_t *words, size_t n_words,
                                  uint32_t width_px, const struct shef_event *full)
{
    const uint32_t low_row = (uint32_t)_mm256_cvtsi256_si32(state->low_row);
    const __m256i t_us =
        _mm256_add_epi32(state->high_us, _mm256_set1_epi32((int32_t)(low_row >> 16)));
    size_t i = 0;

    for (; i + 4 <= n_words; i += SHEF_EVT3_GROUP_WORDS) {
        size_t n_bases;
        uint32_t mask;
        const bool is_group =
            shef_evt3_group(&state->base, words + i * 2, width_px, &n_bases, &mask);

        i += n_bases;
        if (!is_group || state->out > full)
            break;
        state->out = put_vector(state->out, mask, t_us, state->base.x_on + (low_row << 16));
        state->base.x_on += 32;
    }
    return i;
}

size_t shef_evt3_run_avx2(struct shef_evt_run *run, const uint8_t *words, size_t n_words)
{
    const __m256i width = _mm256_set1_epi32((int32_t)run->width_px);
    const __m256i height = _mm256_set1_epi32((int32_t)run->height_px);
    struct shef_event *const full = run->events + run->capacity - SHEF_EVT_RUN_ROOM;
    struct state state = {
        .out = run->events + run->n_events,
        .high_us = _mm256_set1_epi32((int32_t)run->high_us),
        .low_row = _mm256_set1_epi32((int32_t)(run->low_us << 16 | run->row_px)),
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

    const uint32_t low_row = (uint32_t)_mm256_cvtsi256_si32(state.low_row);

    run->n_events = (uint32_t)(state.out - run->events);
    run->n_back += state.n_back;
    run->low_us = low_row >> 16;
    run->row_px = low_row & 0xffff;
    shef_evt3_base_keep(&state.base, run);
    return i + shef_evt3_run_c(run, words + i * 2, n_words - i);
}
