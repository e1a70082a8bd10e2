#include "core/kernels/crc32c.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/crc32c.h"
#include "support/support.h"

static void test_known_checksums(void)
{
    static const uint8_t zeros[32];
    uint8_t ones[32];
    uint8_t rising[32];

    memset(ones, 0xff, sizeof ones);
    for (uint8_t i = 0; i < sizeof rising; i++)
        rising[i] = i;
    /* The examples of RFC 3720, B.4, and of the catalogue of parametrised CRC algorithms. */
    TEST_ASSERT_EQUAL_HEX32(0xe3069283, shef_crc32c(0, "123456789", 9));
    TEST_ASSERT_EQUAL_HEX32(0x8a9136aa, shef_crc32c(0, zeros, sizeof zeros));
    TEST_ASSERT_EQUAL_HEX32(0x62a8ab43, shef_crc32c(0, ones, sizeof ones));
    TEST_ASSERT_EQUAL_HEX32(0x46dd794e, shef_crc32c(0, rising, sizeof rising));
    TEST_ASSERT_EQUAL_HEX32(0, shef_crc32c(0, "", 0));
}

static void test_pieces_give_the_checksum_of_the_whole(void)
{
    static const char text[] = "The quick brown fox jumps over the lazy dog";
    const size_t n = sizeof text - 1;
    const uint32_t whole = shef_crc32c(0, text, n);

    for (size_t i = 0; i <= n; i++)
        TEST_ASSERT_EQUAL_HEX32(whole, shef_crc32c(shef_crc32c(0, text, i), text + i, n - i));
}

static void expect_same_as_c(int n_rounds, int32_t least_bytes, int32_t most_bytes)
{
    struct shef_test_random random = shef_test_random_start();
    const struct shef_crc32c_impl *impl = shef_crc32c_pick(shef_cpu_features());

    TEST_ASSERT_EQUAL_PTR(shef_crc32c_c, shef_crc32c_pick(SHEF_CPU_NONE)->update);
    printf("picked: %s\n", impl->isa);
    for (int round = 0; round < n_rounds; round++) {
        const size_t n = (size_t)shef_test_random_range(&random, least_bytes, most_bytes);
        const size_t at = (size_t)shef_test_random_range(&random, 0, 15);
        const uint32_t state = (uint32_t)shef_test_random_u64(&random);
        /* Exactly as long as needed: a sanitizer sees every read beyond it. */
        uint8_t *bytes = malloc(at + n + 1);

        TEST_ASSERT_NOT_NULL(bytes);
        for (size_t i = 0; i < at + n; i++)
            bytes[i] = (uint8_t)shef_test_random_u64(&random);
        TEST_ASSERT_EQUAL_HEX32(shef_crc32c_c(state, bytes + at, n),
                                impl->update(state, bytes + at, n));
        free(bytes);
    }
}

static void test_every_instruction_set_computes_what_c_computes(void)
{
    expect_same_as_c(3000, 0, 300);
}

/* Long messages are summed in pieces at the same time. */
static void test_long_messages_are_summed_as_short_ones_are(void)
{
    expect_same_as_c(100, 12000, 40000);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_known_checksums);
    RUN_TEST(test_pieces_give_the_checksum_of_the_whole);
    RUN_TEST(test_every_instruction_set_computes_what_c_computes);
    RUN_TEST(test_long_messages_are_summed_as_short_ones_are);
    return UNITY_END();
}
