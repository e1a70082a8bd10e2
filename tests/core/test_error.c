#include "core/error.h"

#include <errno.h>
#include <string.h>

#include "support/support.h"

static void test_a_failure_carries_its_code_and_sentence(void)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_fail(&err, SHEF_ERR_INVALID, "range of %d px: too large", 700));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, err.code);
    TEST_ASSERT_EQUAL_STRING("range of 700 px: too large", err.text);
}

static void test_without_a_place_for_the_sentence_the_code_remains(void)
{
    TEST_ASSERT_EQUAL(SHEF_ERR_FULL, shef_fail(NULL, SHEF_ERR_FULL, "unseen"));
    TEST_ASSERT_EQUAL(SHEF_ERR_PERMISSION, shef_fail_os(NULL, EACCES, "unseen"));
    TEST_ASSERT_NOT_EQUAL(SHEF_OK, shef_fail_context(NULL, "unseen"));
}

static void test_system_errors_become_codes_and_end_the_sentence(void)
{
    static const struct {
        int os_errno;
        enum shef_err code;
    } cases[] = {
        { ENOENT, SHEF_ERR_NOT_FOUND },  { ENODEV, SHEF_ERR_NOT_FOUND },
        { EACCES, SHEF_ERR_PERMISSION }, { EPERM, SHEF_ERR_PERMISSION },
        { ENOSPC, SHEF_ERR_NO_SPACE },   { EDQUOT, SHEF_ERR_NO_SPACE },
        { ENOMEM, SHEF_ERR_NO_MEMORY },  { EIO, SHEF_ERR_IO },
        { EISDIR, SHEF_ERR_IO },
    };

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct shef_error err = { 0 };

        TEST_ASSERT_EQUAL(cases[i].code, shef_fail_os(&err, cases[i].os_errno, "open 'x'"));
        TEST_ASSERT_EQUAL(cases[i].code, err.code);
        TEST_ASSERT_EQUAL_INT(0, strncmp(err.text, "open 'x': ", 10));
        TEST_ASSERT_EQUAL_STRING(strerror(cases[i].os_errno), err.text + 10);
    }
}

static void test_context_goes_in_front_and_keeps_the_code(void)
{
    struct shef_error err = { 0 };

    (void)shef_fail(&err, SHEF_ERR_FORMAT, "not a PNG file");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_fail_context(&err, "read '%s'", "1.png"));
    TEST_ASSERT_EQUAL_STRING("read '1.png': not a PNG file", err.text);
}

static void test_long_sentences_are_cut_at_the_end(void)
{
    char filler[2 * SHEF_ERROR_TEXT_BYTES];
    struct shef_error err = { 0 };

    memset(filler, 'x', sizeof filler);
    filler[sizeof filler - 1] = '\0';
    (void)shef_fail(&err, SHEF_ERR_INVALID, "begin %s", filler);
    TEST_ASSERT_EQUAL_size_t(SHEF_ERROR_TEXT_BYTES - 1, strlen(err.text));
    (void)shef_fail_os(&err, EIO, "begin %s", filler);
    TEST_ASSERT_EQUAL_size_t(SHEF_ERROR_TEXT_BYTES - 1, strlen(err.text));
    (void)shef_fail_context(&err, "outer");
    TEST_ASSERT_EQUAL_size_t(SHEF_ERROR_TEXT_BYTES - 1, strlen(err.text));
    TEST_ASSERT_EQUAL_INT(0, strncmp(err.text, "outer: begin xxx", 16));
}

static void test_what_a_file_says_cannot_break_the_line(void)
{
    struct shef_error err = { 0 };

    (void)shef_fail(&err, SHEF_ERR_FORMAT, "kind '%s'", "a\nb\x1b[2J\x7f\t\xc3\xa9");
    TEST_ASSERT_EQUAL_STRING("kind 'a?b?[2J??\xc3\xa9'", err.text);
    /* A control character of two bytes begins a command for a terminal as well. */
    (void)shef_fail(&err, SHEF_ERR_INVALID, "kind '%s'",
                    "\xc2\x9b"
                    "2J\xc2\xa0");
    TEST_ASSERT_EQUAL_STRING("kind '?"
                             "?2J\xc2\xa0'",
                             err.text);
    (void)shef_fail_os(&err, ENOENT, "open 'a\nb'");
    TEST_ASSERT_NULL(strchr(err.text, '\n'));
    (void)shef_fail_context(&err, "read\r");
    TEST_ASSERT_NULL(strchr(err.text, '\r'));
}

static void test_every_code_has_a_name_of_its_own(void)
{
    for (int a = SHEF_OK; a <= SHEF_ERR_UNSUPPORTED; a++) {
        TEST_ASSERT_TRUE(strcmp("unknown", shef_err_name((enum shef_err)a)) != 0);
        for (int b = SHEF_OK; b < a; b++)
            TEST_ASSERT_TRUE(
                strcmp(shef_err_name((enum shef_err)a), shef_err_name((enum shef_err)b)) != 0);
    }
    TEST_ASSERT_EQUAL_STRING("unknown", shef_err_name((enum shef_err)999));
}

static void test_a_name_leads_back_to_its_code(void)
{
    for (int code = SHEF_OK; code <= SHEF_ERR_UNSUPPORTED; code++)
        TEST_ASSERT_EQUAL_INT(code, shef_err_of_name(shef_err_name((enum shef_err)code)));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_err_of_name("unheard of"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_failure_carries_its_code_and_sentence);
    RUN_TEST(test_without_a_place_for_the_sentence_the_code_remains);
    RUN_TEST(test_system_errors_become_codes_and_end_the_sentence);
    RUN_TEST(test_context_goes_in_front_and_keeps_the_code);
    RUN_TEST(test_long_sentences_are_cut_at_the_end);
    RUN_TEST(test_what_a_file_says_cannot_break_the_line);
    RUN_TEST(test_every_code_has_a_name_of_its_own);
    RUN_TEST(test_a_name_leads_back_to_its_code);
    return UNITY_END();
}
