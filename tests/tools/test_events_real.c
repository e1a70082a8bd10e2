/* `sheftool events` on real recordings. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "support/support.h"
#include "tools/event_files.h"
#include "tools/program.h"

#define N_EVT2 539481
#define N_EVT3 219596

static const char *sample(const char *name)
{
    static char path[4096];

    snprintf(path, sizeof path, "%s/%s", shef_test_data("events"), name);
    return path;
}

static json_t *info(const char *path)
{
    const struct program_result *result = program_run("events info %s --json", path);
    json_t *root;

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    root = json_loads(result->out, 0, NULL);
    TEST_ASSERT_NOT_NULL_MESSAGE(root, result->out);
    return root;
}

static json_int_t integer_at(const json_t *object, const char *key)
{
    return json_integer_value(json_object_get(object, key));
}

static void test_the_samples_are_what_others_say_of_them(void)
{
    json_t *root;

    SHEF_TEST_NEEDS_DATA("events");
    root = info(sample("evt2_sample.raw"));
    TEST_ASSERT_EQUAL_INT64(N_EVT2, integer_at(root, "n_events"));
    TEST_ASSERT_EQUAL_INT64(50000, integer_at(root, "last_us") - integer_at(root, "first_us"));
    TEST_ASSERT_EQUAL_INT64(0, json_array_size(json_object_get(root, "gaps")));
    TEST_ASSERT_EQUAL_INT64(8, integer_at(json_object_get(root, "hot_pixels"), "n"));
    json_decref(root);
    root = info(sample("evt3_sample.raw"));
    TEST_ASSERT_EQUAL_INT64(N_EVT3, integer_at(root, "n_events"));
    TEST_ASSERT_EQUAL_INT64(1280, integer_at(root, "width_px"));
    TEST_ASSERT_EQUAL_INT64(11718656, integer_at(root, "first_us"));
    TEST_ASSERT_EQUAL_INT64(11727457, integer_at(root, "last_us"));
    json_decref(root);
}

static uint64_t number_at(const uint8_t *bytes, int n_bytes)
{
    uint64_t value = 0;

    for (int i = 0; i < n_bytes; i++)
        value |= (uint64_t)bytes[i] << 8 * i;
    return value;
}

static void test_evt3_as_npy_is_the_independently_decoded_array(void)
{
    uint8_t *ours;
    uint8_t *theirs;
    size_t n_ours;
    size_t n_theirs;

    SHEF_TEST_NEEDS_DATA("events");
    TEST_ASSERT_EQUAL_INT(0, program_run("events convert %s %s", sample("evt3_sample.raw"),
                                         shef_test_temp_path("evt3.npy"))
                                 ->status);
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_file_read(shef_test_temp_path("evt3.npy"), 1 << 28, &ours, &n_ours, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_file_read(sample("evt3_sample.npy"), 1 << 28, &theirs, &n_theirs, NULL));
    TEST_ASSERT_EQUAL_size_t(192 + 13 * N_EVT3, n_ours);
    /* Theirs: t i8, x i2, y i2, p u1, padded to 16 bytes. */
    TEST_ASSERT_EQUAL_size_t(192 + 16 * N_EVT3, n_theirs);
    for (size_t i = 0; i < N_EVT3; i++) {
        const uint8_t *a = ours + 192 + 13 * i;
        const uint8_t *b = theirs + 192 + 16 * i;

        TEST_ASSERT_EQUAL_MEMORY(b + 8, a + 8, 5);
        TEST_ASSERT_EQUAL_UINT64(number_at(b, 8) % 4096, number_at(a, 8) % 4096);
    }
    free(ours);
    free(theirs);
}

static void test_conversions_of_the_samples_lose_nothing(void)
{
    static const char *const formats[] = { "evt2", "evt21", "evt3" };
    static const char *const names[] = { "evt2_sample.raw", "evt3_sample.raw" };
    uint8_t *expected;
    uint8_t *actual;
    size_t n_expected;
    size_t n_actual;

    SHEF_TEST_NEEDS_DATA("events");
    for (int k = 0; k < 2; k++) {
        TEST_ASSERT_EQUAL_INT(0, program_run("events convert %s %s", sample(names[k]),
                                             shef_test_temp_path("direct.csv"))
                                     ->status);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(shef_test_temp_path("direct.csv"), 1 << 28,
                                                  &expected, &n_expected, NULL));
        for (int i = 0; i < 3; i++) {
            TEST_ASSERT_EQUAL_INT(0,
                                  program_run("events convert %s %s --format %s", sample(names[k]),
                                              shef_test_temp_path("other.raw"), formats[i])
                                      ->status);
            TEST_ASSERT_EQUAL_INT(0, program_run("events convert %s %s",
                                                 shef_test_temp_path("other.raw"),
                                                 shef_test_temp_path("other.csv"))
                                         ->status);
            TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(shef_test_temp_path("other.csv"), 1 << 28,
                                                      &actual, &n_actual, NULL));
            TEST_ASSERT_EQUAL_size_t(n_expected, n_actual);
            TEST_ASSERT_EQUAL_INT(0, memcmp(expected, actual, n_expected));
            free(actual);
        }
        free(expected);
    }
}

static void test_the_samples_are_rendered(void)
{
    SHEF_TEST_NEEDS_DATA("events");
    TEST_ASSERT_EQUAL_INT(0, program_run("events render %s %s --rate 100",
                                         sample("evt2_sample.raw"), shef_test_temp_path("evt2"))
                                 ->status);
    TEST_ASSERT_EQUAL_INT(0, program_run("events render %s %s --rate 500 --read at-mid",
                                         sample("evt3_sample.raw"), shef_test_temp_path("evt3"))
                                 ->status);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_samples_are_what_others_say_of_them);
    RUN_TEST(test_evt3_as_npy_is_the_independently_decoded_array);
    RUN_TEST(test_conversions_of_the_samples_lose_nothing);
    RUN_TEST(test_the_samples_are_rendered);
    return UNITY_END();
}
