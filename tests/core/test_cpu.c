#include "core/cpu.h"

#include <string.h>

#include "support/support.h"

static void test_names_and_features_convert_both_ways(void)
{
    static const char *const names[] = { "c", "avx2", "avx512", "neon" };

    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++)
        TEST_ASSERT_EQUAL_STRING(names[i], shef_cpu_isa_name(shef_cpu_features_of(names[i])));
}

static void test_avx512_implies_avx2_and_c_needs_nothing(void)
{
    TEST_ASSERT_BITS_HIGH(SHEF_CPU_AVX2, shef_cpu_features_of("avx512"));
    TEST_ASSERT_EQUAL_UINT32(SHEF_CPU_NONE, shef_cpu_features_of("c"));
}

static void test_an_unknown_name_is_told_apart(void)
{
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, shef_cpu_features_of("sse9"));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, shef_cpu_features_of(""));
}

static void test_what_is_found_fits_the_processor_family_and_stays_the_same(void)
{
    const uint32_t features = shef_cpu_features();

#if defined(__aarch64__)
    TEST_ASSERT_EQUAL_UINT32(SHEF_CPU_NEON, features);
#else
    TEST_ASSERT_BITS_LOW(SHEF_CPU_NEON, features);
#endif
    TEST_ASSERT_EQUAL_UINT32(features, shef_cpu_features());
    if (features & SHEF_CPU_AVX512)
        TEST_ASSERT_BITS_HIGH(SHEF_CPU_AVX2, features);
}

static void test_the_processors_name_is_one_terminated_line(void)
{
    char name[64], shortened[4];

    memset(name, '#', sizeof name);
    shef_cpu_model(name, sizeof name);
    TEST_ASSERT_NOT_NULL(memchr(name, '\0', sizeof name));
    TEST_ASSERT_GREATER_THAN_size_t(0, strlen(name));
    TEST_ASSERT_NULL(strchr(name, '\n'));
    shef_cpu_model(shortened, sizeof shortened);
    TEST_ASSERT_EQUAL_size_t(3, strlen(shortened));
    TEST_ASSERT_EQUAL_INT(0, strncmp(name, shortened, 3));
}

static void test_best_is_what_there_is_and_a_lesser_set_can_be_asked_for(void)
{
    uint32_t features = 77;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_cpu_features_among("best", &features, NULL));
    TEST_ASSERT_EQUAL_UINT32(shef_cpu_features(), features);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_cpu_features_among("c", &features, NULL));
    TEST_ASSERT_EQUAL_UINT32(SHEF_CPU_NONE, features);
}

static void test_what_is_not_there_is_refused_in_a_sentence(void)
{
    struct shef_error err = { 0 };
    uint32_t features = 77;

#if defined(__aarch64__)
    TEST_ASSERT_EQUAL(SHEF_ERR_UNSUPPORTED, shef_cpu_features_among("avx2", &features, &err));
    TEST_ASSERT_EQUAL_STRING("this processor has no avx2; the best it has is neon", err.text);
#else
    TEST_ASSERT_EQUAL(SHEF_ERR_UNSUPPORTED, shef_cpu_features_among("neon", &features, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "this processor has no neon; the best it has is "));
#endif
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_cpu_features_among("sse9", &features, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "'sse9'"));
    TEST_ASSERT_EQUAL_UINT32(77, features);
}

static void test_a_restricted_process_finds_no_more_than_it_was_left(void)
{
    const uint32_t found = shef_cpu_features();
    uint32_t features;

    shef_cpu_restrict(SHEF_CPU_NONE);
    TEST_ASSERT_EQUAL_UINT32(SHEF_CPU_NONE, shef_cpu_features());
    TEST_ASSERT_EQUAL(SHEF_OK, shef_cpu_features_among("best", &features, NULL));
    TEST_ASSERT_EQUAL_UINT32(SHEF_CPU_NONE, features);
    shef_cpu_restrict(found);
    TEST_ASSERT_EQUAL_UINT32(found, shef_cpu_features());
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_names_and_features_convert_both_ways);
    RUN_TEST(test_avx512_implies_avx2_and_c_needs_nothing);
    RUN_TEST(test_an_unknown_name_is_told_apart);
    RUN_TEST(test_what_is_found_fits_the_processor_family_and_stays_the_same);
    RUN_TEST(test_best_is_what_there_is_and_a_lesser_set_can_be_asked_for);
    RUN_TEST(test_what_is_not_there_is_refused_in_a_sentence);
    RUN_TEST(test_a_restricted_process_finds_no_more_than_it_was_left);
    RUN_TEST(test_the_processors_name_is_one_terminated_line);
    return UNITY_END();
}
