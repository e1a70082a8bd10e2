/* The manual pages against what the programs say of themselves. */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "support/process.h"
#include "support/support.h"

static struct shef_test_process program;

static char *read_page(const char *name)
{
    char path[512];
    uint8_t *bytes;
    size_t n_bytes;

    snprintf(path, sizeof path, "docs/man/%s", name);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_file_read(shef_test_source(path), 1 << 20, &bytes, &n_bytes, NULL));
    return (char *)bytes;
}

/* Every option that the help names is in the manual, and the help fits 80 columns. */
static void expect_options(const char *page, const char *name, const char *words)
{
    char *text = read_page(page);
    int n_options = 0;

    shef_test_process_run(&program, name, NULL, "%s", words);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, program.status, program.err);
    for (const char *at = strstr(program.out, "--"); at; at = strstr(at + 2, "--")) {
        char option[64];
        int n = 0;

        if (!islower((unsigned char)at[2]))
            continue;
        for (const char *c = at; n < 60 && (*c == '-' || islower((unsigned char)*c)); c++)
            n += snprintf(option + n, sizeof option - (size_t)n, *c == '-' ? "\\-" : "%c", *c);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, option), option);
        n_options++;
    }
    TEST_ASSERT_GREATER_THAN_INT(3, n_options);
    for (const char *line = program.out; *line; line += strcspn(line, "\n"), line += *line == '\n')
        TEST_ASSERT_LESS_THAN_size_t_MESSAGE(80, strcspn(line, "\n"), line);
    free(text);
}

static void test_the_manual_of_shefsim_has_every_option(void)
{
    expect_options("shefsim.1", "shefsim", "render --help");
    expect_options("shefsim.1", "shefsim", "events --help");
    expect_options("shefsim.1", "shefsim", "export --help");
    expect_options("shefsim.1", "shefsim", "bench --help");
}

static void test_the_manual_of_shefctl_has_every_option(void)
{
    expect_options("shefctl.1", "shefctl", "--help");
}

static void test_the_manual_of_shefd_has_every_option(void)
{
    expect_options("shefd.8", "shefd", "--help");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_manual_of_shefsim_has_every_option);
    RUN_TEST(test_the_manual_of_shefctl_has_every_option);
    RUN_TEST(test_the_manual_of_shefd_has_every_option);
    return UNITY_END();
}
