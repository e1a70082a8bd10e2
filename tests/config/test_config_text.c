#include "config/config_text.h"

#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "support/support.h"

/* SHEF_TEST_UPDATE=1 writes the two files below anew instead of comparing them. */
#define SHIPPED_CONFIG "config/shefd.yaml"
#define MANUAL         "docs/man/shefd.yaml.5"
#define MANUAL_BEGIN   ".\\\" The settings, as written by tests/config/test_config_text.c:\n"
#define MANUAL_END     ".\\\" End of the settings.\n"

static struct shef_config config;
static char *text;
static size_t n_text;
static FILE *out;

void setUp(void)
{
    shef_config_defaults(&config);
    out = open_memstream(&text, &n_text);
    TEST_ASSERT_NOT_NULL(out);
}

void tearDown(void)
{
    if (out)
        fclose(out);
    free(text);
    out = NULL;
    text = NULL;
}

static void finish(void)
{
    TEST_ASSERT_EQUAL_INT(0, fclose(out));
    out = NULL;
}

static char *read_source(const char *path)
{
    uint8_t *bytes = NULL;
    size_t n_bytes;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_file_read(shef_test_source(path), 1 << 20, &bytes, &n_bytes, &err), err.text);
    return (char *)bytes;
}

static bool is_update(void)
{
    const char *update = getenv("SHEF_TEST_UPDATE");

    return update && strcmp(update, "1") == 0;
}

static void test_a_written_file_reads_back_as_it_was(void)
{
    struct shef_config again;
    struct shef_error err = { 0 };

    strcpy(config.source.recording, "/data/with \"quotes\" and \\ in it: # no remark");
    config.depth.workers = 7;
    config.threads[SHEF_THREAD_WORKERS].cpu = 3;
    config.lcm.cloud = true;
    shef_config_write_yaml(&config, out);
    finish();
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_config_parse((const uint8_t *)text, n_text, "written", &again, &err),
        err.text);
    TEST_ASSERT_EQUAL_MEMORY(&config, &again, sizeof config);
}

static void test_every_setting_is_listed_with_its_range_unit_and_meaning(void)
{
    shef_config_write_list(&config, out);
    finish();
    for (int i = 0; i < shef_config_n_rows; i++) {
        char head[128];

        snprintf(head, sizeof head, "%s = ", shef_config_rows[i].key);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, head), head);
    }
    TEST_ASSERT_NOT_NULL(strstr(text, "depth.max_disparity_px = 0\n"));
    TEST_ASSERT_NOT_NULL(strstr(text, "(1 to 16 threads; default 2)"));
    TEST_ASSERT_NOT_NULL(strstr(text, "source.recording = \"\"\n"));
}

static void test_the_shipped_file_shows_the_defaults(void)
{
    shef_config_write_yaml(&config, out);
    finish();
    if (is_update())
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_file_replace(shef_test_source(SHIPPED_CONFIG), text, n_text, NULL));

    char *shipped = read_source(SHIPPED_CONFIG);

    TEST_ASSERT_EQUAL_STRING_MESSAGE(text, shipped,
                                     "run this test with SHEF_TEST_UPDATE=1 after a row changed");
    free(shipped);
}

static void replace_settings(const char *manual, const char *begin, const char *end)
{
    char *whole;
    size_t n_whole;
    FILE *file = open_memstream(&whole, &n_whole);

    TEST_ASSERT_NOT_NULL(file);
    fprintf(file, "%.*s%s%s", (int)(begin - manual), manual, text, end);
    fclose(file);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(shef_test_source(MANUAL), whole, n_whole, NULL));
    free(whole);
}

static void test_the_manual_page_says_what_the_rows_say(void)
{
    char *manual = read_source(MANUAL);

    shef_config_write_man(out);
    finish();
    for (int pass = 0; pass < 2; pass++) {
        char *begin = strstr(manual, MANUAL_BEGIN);
        char *end = strstr(manual, MANUAL_END);

        TEST_ASSERT_TRUE_MESSAGE(begin && end && begin < end, "the marks around the settings");
        begin += strlen(MANUAL_BEGIN);
        if (!is_update() || pass == 1) {
            TEST_ASSERT_EQUAL_INT_MESSAGE(
                0, (size_t)(end - begin) == n_text ? memcmp(begin, text, n_text) : 1,
                "run this test with SHEF_TEST_UPDATE=1 after a row changed");
            break;
        }
        replace_settings(manual, begin, end);
        free(manual);
        manual = read_source(MANUAL);
    }
    free(manual);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_written_file_reads_back_as_it_was);
    RUN_TEST(test_every_setting_is_listed_with_its_range_unit_and_meaning);
    RUN_TEST(test_the_shipped_file_shows_the_defaults);
    RUN_TEST(test_the_manual_page_says_what_the_rows_say);
    return UNITY_END();
}
