#include "core/base64.h"

#include <stdlib.h>
#include <string.h>

#include "support/support.h"

/* RFC 4648, section 10. */
static const struct {
    const char *bytes;
    const char *text;
} known[] = {
    { "", "" },
    { "f", "Zg==" },
    { "fo", "Zm8=" },
    { "foo", "Zm9v" },
    { "foob", "Zm9vYg==" },
    { "fooba", "Zm9vYmE=" },
    { "foobar", "Zm9vYmFy" },
};

static void test_the_vectors_of_the_rfc_go_both_ways(void)
{
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        size_t n_bytes = 0;
        char *text = shef_base64_encode((const uint8_t *)known[i].bytes, strlen(known[i].bytes));
        uint8_t *bytes = shef_base64_decode(known[i].text, &n_bytes);

        TEST_ASSERT_EQUAL_STRING(known[i].text, text);
        TEST_ASSERT_NOT_NULL(bytes);
        TEST_ASSERT_EQUAL_size_t(strlen(known[i].bytes), n_bytes);
        TEST_ASSERT_EQUAL_INT(0, memcmp(known[i].bytes, bytes, n_bytes));
        free(text);
        free(bytes);
    }
}

static void test_random_bytes_come_back(void)
{
    struct shef_test_random random = shef_test_random_start();
    uint8_t bytes[300];

    for (size_t n = 0; n < sizeof bytes; n++) {
        size_t n_back;
        char *text;
        uint8_t *back;

        bytes[n] = (uint8_t)shef_test_random_u64(&random);
        text = shef_base64_encode(bytes, n);
        back = shef_base64_decode(text, &n_back);
        TEST_ASSERT_EQUAL_size_t(n, n_back);
        TEST_ASSERT_EQUAL_INT(0, memcmp(bytes, back, n));
        free(text);
        free(back);
    }
}

static void test_what_is_no_base64_is_refused(void)
{
    static const char *const wrong[] = { "Z", "Zg=", "Zm9v!mFy", "====", "Zg==Zg==", "Zm 9v==" };
    size_t n_bytes;

    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        TEST_ASSERT_NULL_MESSAGE(shef_base64_decode(wrong[i], &n_bytes), wrong[i]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_vectors_of_the_rfc_go_both_ways);
    RUN_TEST(test_random_bytes_come_back);
    RUN_TEST(test_what_is_no_base64_is_refused);
    return UNITY_END();
}
