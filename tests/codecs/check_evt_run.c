#include "codecs/kernels/evt_run.h"

#include <stdlib.h>
#include <string.h>

#include "codecs/evt_word.h"
#include "core/cpu.h"
#include "support/support.h"

#define N_ROUNDS  4000
#define MAX_WORDS 300
#define CAPACITY  (MAX_WORDS * 32 + SHEF_EVT_RUN_ROOM)

static struct shef_event expected_events[CAPACITY];
static struct shef_event actual_events[CAPACITY];

struct words {
    uint8_t bytes[MAX_WORDS * 8];
    size_t n;
};

typedef struct words make_words_fn(struct shef_test_random *random);

/* Runs both, each from the same state, and expects the same words taken, state and events. */
static void expect_same_run(shef_evt_run_fn *kernel, shef_evt_run_fn *reference,
                            const struct shef_evt_run *start, const struct words *words,
                            size_t word_bytes)
{
    struct shef_evt_run expected = *start;
    struct shef_evt_run actual = *start;
    /* Exactly as long as the words: a sanitizer sees every read beyond them. */
    uint8_t *const bytes = malloc(words->n * word_bytes + 1);

    TEST_ASSERT_NOT_NULL(bytes);
    memcpy(bytes + 1, words->bytes, words->n * word_bytes);
    expected.events = expected_events;
    actual.events = actual_events;
    memset(actual_events, 0xff, sizeof actual_events);
    TEST_ASSERT_EQUAL_UINT64(reference(&expected, bytes + 1, words->n),
                             kernel(&actual, bytes + 1, words->n));
    free(bytes);
    TEST_ASSERT_EQUAL_UINT32(expected.n_events, actual.n_events);
    TEST_ASSERT_EQUAL_UINT32(expected.n_back, actual.n_back);
    TEST_ASSERT_EQUAL_UINT32(expected.low_us, actual.low_us);
    TEST_ASSERT_EQUAL_UINT32(expected.row_px, actual.row_px);
    TEST_ASSERT_EQUAL_UINT32(expected.base_px, actual.base_px);
    TEST_ASSERT_EQUAL(expected.base_on, actual.base_on);
    TEST_ASSERT_EQUAL(expected.base_known, actual.base_known);
    if (expected.n_events > 0)
        TEST_ASSERT_EQUAL_MEMORY(expected_events, actual_events,
                                 expected.n_events * sizeof *expected_events);
}

/* Compares over random words, in sensors of random sizes; some words lie outside. */
static void expect_same_as_c(shef_evt_run_fn *kernel, shef_evt_run_fn *reference,
                             make_words_fn *make, size_t word_bytes, uint32_t low_limit_us)
{
    struct shef_test_random random = shef_test_random_start();
    uint64_t n_events = 0;

    for (int round = 0; round < N_ROUNDS; round++) {
        const bool is_whole = shef_test_random_range(&random, 0, 2) > 0;
        const struct words words = make(&random);
        const struct shef_evt_run start = {
            .width_px = is_whole ? 2048 : (uint32_t)shef_test_random_range(&random, 1, 2048),
            .height_px = is_whole ? 2048 : (uint32_t)shef_test_random_range(&random, 1, 2048),
            .high_us = (uint32_t)shef_test_random_u64(&random) / 2,
            .upper_first = shef_test_random_range(&random, 0, 9) == 0,
            .capacity = CAPACITY,
            .low_us = (uint32_t)shef_test_random_range(&random, 0, (int32_t)low_limit_us - 1),
            .base_px = (uint32_t)shef_test_random_range(&random, 0, 2047),
            .base_on = shef_test_random_u64(&random) >> 63,
            .base_known = shef_test_random_u64(&random) >> 63,
        };
        struct shef_evt_run probe = start;

        expect_same_run(kernel, reference, &start, &words, word_bytes);
        probe.events = expected_events;
        reference(&probe, words.bytes, words.n);
        n_events += probe.n_events;
    }
    TEST_ASSERT_TRUE_MESSAGE(n_events > 10 * N_ROUNDS, "hardly any word was ordinary");
}

static struct words evt2_words(struct shef_test_random *random)
{
    struct words words = { .n = (size_t)shef_test_random_range(random, 0, MAX_WORDS) };
    const int32_t one_odd_in = shef_test_random_range(random, 5, 500);

    for (size_t i = 0; i < words.n; i++) {
        const uint32_t any = (uint32_t)shef_test_random_u64(random);
        const bool is_odd = shef_test_random_range(random, 1, one_odd_in) == 1;
        const uint32_t word = is_odd ? any : any & 0x1fffffff;

        memcpy(words.bytes + i * 4, &word, sizeof word);
    }
    return words;
}

static struct words evt21_words(struct shef_test_random *random)
{
    struct words words = { .n = (size_t)shef_test_random_range(random, 0, MAX_WORDS) };
    const int32_t one_odd_in = shef_test_random_range(random, 5, 500);

    for (size_t i = 0; i < words.n; i++) {
        const uint64_t any = shef_test_random_u64(random);
        const uint64_t sparse = any & (shef_test_random_u64(random) | 0xffffffff00000000);
        const bool is_odd = shef_test_random_range(random, 1, one_odd_in) == 1;
        /* x below 2016, so that most vectors end inside the largest sensor. */
        const uint64_t word = is_odd ? any : sparse & 0x1fdff7ffffffffff;

        memcpy(words.bytes + i * 8, &word, sizeof word);
    }
    return words;
}

static size_t put_u16(struct words *words, size_t i, uint32_t type, uint32_t value)
{
    const uint16_t word = (uint16_t)(type << 12 | value);

    if (i < words->n)
        memcpy(words->bytes + i * 2, &word, sizeof word);
    return i + 1;
}

static struct words evt3_words(struct shef_test_random *random)
{
    struct words words = { .n = (size_t)shef_test_random_range(random, 0, MAX_WORDS) };
    const int32_t one_odd_in = shef_test_random_range(random, 5, 500);
    const int32_t one_vector_in = shef_test_random_range(random, 2, 40);
    size_t i = 0;

    while (i < words.n) {
        const uint64_t any = shef_test_random_u64(random);
        const uint32_t value = (uint32_t)any & 0xfff;
        static const uint8_t singles[] = { SHEF_EVT3_EVENT, SHEF_EVT3_EVENT, SHEF_EVT3_ROW,
                                           SHEF_EVT3_TIME_LOW };

        if (shef_test_random_range(random, 1, one_odd_in) == 1) {
            i = put_u16(&words, i, any >> 12 & 0xf, value);
        } else if (shef_test_random_range(random, 1, one_vector_in) == 1) {
            if (any >> 63)
                i = put_u16(&words, i, SHEF_EVT3_BASE, value);
            i = put_u16(&words, i, SHEF_EVT3_VECTOR_12, any >> 12 & any >> 30 & 0xfff);
            i = put_u16(&words, i, SHEF_EVT3_VECTOR_12, any >> 24 & any >> 40 & 0xfff);
            i = put_u16(&words, i, SHEF_EVT3_VECTOR_8, any >> 36 & any >> 50 & 0xfff);
        } else {
            i = put_u16(&words, i, singles[any >> 62], value);
        }
    }
    return words;
}

/* Every set of kernels that this processor runs, the C version against itself included. */
static void for_each_isa(void (*check)(const struct shef_evt_kernels *kernels))
{
    static const char *const isas[] = { "c", "avx2", "avx512", "neon" };

    for (size_t i = 0; i < sizeof isas / sizeof isas[0]; i++) {
        const uint32_t features = shef_cpu_features_of(isas[i]);

        if ((shef_cpu_features() & features) != features)
            continue;
        const struct shef_evt_kernels *kernels = shef_evt_kernels_for(features);

        TEST_ASSERT_EQUAL_STRING(isas[i], kernels->isa);
        TEST_MESSAGE(kernels->isa);
        check(kernels);
    }
}

static void check_evt2(const struct shef_evt_kernels *kernels)
{
    expect_same_as_c(kernels->evt2, shef_evt2_run_c, evt2_words, 4, 64);
}

static void check_evt21(const struct shef_evt_kernels *kernels)
{
    expect_same_as_c(kernels->evt21, shef_evt21_run_c, evt21_words, 8, 64);
}

static void check_evt3(const struct shef_evt_kernels *kernels)
{
    expect_same_as_c(kernels->evt3, shef_evt3_run_c, evt3_words, 2, 4096);
}

static void test_evt2_kernels_agree_with_c(void)
{
    for_each_isa(check_evt2);
}

static void test_evt21_kernels_agree_with_c(void)
{
    for_each_isa(check_evt21);
}

static void test_evt3_kernels_agree_with_c(void)
{
    for_each_isa(check_evt3);
}

/* Words of as many events as possible, over and over. */
static void expect_room_kept(shef_evt_run_fn *kernel, const void *words, size_t n_words)
{
    for (uint32_t capacity = SHEF_EVT_RUN_ROOM; capacity < 300; capacity++) {
        struct shef_evt_run run = { .width_px = 2048,
                                    .height_px = 2048,
                                    .capacity = capacity,
                                    .events = malloc(capacity * sizeof *run.events) };

        TEST_ASSERT_NOT_NULL(run.events);
        kernel(&run, words, n_words);
        TEST_ASSERT_TRUE(run.n_events > 0 && run.n_events <= capacity);
        free(run.events);
    }
}

static void check_room(const struct shef_evt_kernels *kernels)
{
    uint32_t evt2[1000] = { 0 };
    uint64_t evt21[1000];
    uint16_t evt3_singles[1000];
    uint16_t evt3_vectors[1000];
    static const uint16_t group[] = { 0x3000, 0x4fff, 0x4fff, 0x50ff };

    for (size_t i = 0; i < 1000; i++) {
        evt21[i] = 0xffffffff;
        evt3_singles[i] = 0x2000;
        evt3_vectors[i] = group[i % 4];
    }
    expect_room_kept(kernels->evt2, evt2, 1000);
    expect_room_kept(kernels->evt21, evt21, 1000);
    expect_room_kept(kernels->evt3, evt3_singles, 1000);
    expect_room_kept(kernels->evt3, evt3_vectors, 1000);
}

/* A sanitizer sees what they write beyond. */
static void test_no_kernel_writes_beyond_a_full_batch(void)
{
    for_each_isa(check_room);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_evt2_kernels_agree_with_c);
    RUN_TEST(test_evt21_kernels_agree_with_c);
    RUN_TEST(test_evt3_kernels_agree_with_c);
    RUN_TEST(test_no_kernel_writes_beyond_a_full_batch);
    return UNITY_END();
}
