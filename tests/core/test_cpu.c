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

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_names_and_features_convert_both_ways);
    RUN_TEST(test_avx512_implies_avx2_and_c_needs_nothing);
    RUN_TEST(test_an_unknown_name_is_told_apart);
    RUN_TEST(test_what_is_found_fits_the_processor_family_and_stays_the_same);
    RUN_TEST(test_the_processors_name_is_one_terminated_line);
    return UNITY_END();
}
