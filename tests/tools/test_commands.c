/* What all commands have in common, help, manual and how they are stopped, and the benches of
 * matching. */
#include <jansson.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "sheftool/command.h"
#include "support/support.h"
#include "tools/pairs.h"
#include "tools/program.h"

static void test_bench_lists_ours_per_instruction_set_beside_opencv(void)
{
    static const char *const benches[] = { "correlate", "frame" };
    static const char *const first[] = { "correlate", "robust" };

    for (int i = 0; i < 2; i++) {
        const struct program_result *result = program_run(
            "bench %s --json --rounds 2 --width 96 --height 64 --max-disparity 32", benches[i]);
        json_t *root = json_loads(result->out, 0, NULL);
        bool has_c = false;
        bool has_peer = false;
        size_t k;
        json_t *one;

        TEST_ASSERT_NOT_NULL_MESSAGE(root, result->err);
        json_array_foreach(json_object_get(root, "results"), k, one)
        {
            const char *name = json_string_value(json_object_get(one, "name"));
            const char *isa = json_string_value(json_object_get(one, "isa"));

            has_c = has_c || (strcmp(name, first[i]) == 0 && strcmp(isa, "c") == 0);
            if (strcmp(name, "opencv-stereobm") == 0) {
                has_peer = true;
                TEST_ASSERT_DOUBLE_WITHIN(1e-5, 1, pairs_number_at(one, "ratio_to_stereobm"));
            }
            TEST_ASSERT_TRUE(pairs_number_at(one, "min_ms") > 0);
            TEST_ASSERT_TRUE(pairs_number_at(one, "median_ms") >= pairs_number_at(one, "min_ms"));
            /* 96 x 64 x 32 = 196608 disparities in the shortest time. */
            TEST_ASSERT_DOUBLE_WITHIN(1e-2 * pairs_number_at(one, "mde_per_s"),
                                      0.196608 / (pairs_number_at(one, "min_ms") / 1e3),
                                      pairs_number_at(one, "mde_per_s"));
        }
        TEST_ASSERT_TRUE(has_c && has_peer);
        json_decref(root);
    }
}

/* As the help prints it. Valid until the next call. */
static const char *description_of(const struct shef_command *command)
{
    static char text[8192];
    FILE *out = fmemopen(text, sizeof text, "w");

    shef_options_description(command->description, out);
    fclose(out);
    return text;
}

static void expect_80_columns(const char *text)
{
    for (; *text; text += strcspn(text, "\n"), text += *text == '\n')
        TEST_ASSERT_LESS_THAN_size_t_MESSAGE(80, strcspn(text, "\n"), text);
}

static void test_every_command_helps_and_every_option_is_in_the_manual(void)
{
    uint8_t *page;
    size_t n_bytes;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(shef_test_source("docs/man/sheftool.1"), 1 << 20,
                                              &page, &n_bytes, NULL));
    for (int i = 0; i < SHEF_N_COMMANDS; i++) {
        const struct shef_command *command = shef_commands[i];
        const struct program_result *result = program_run("%s --help", command->name);
        char manual[128];

        TEST_ASSERT_EQUAL_INT(0, result->status);
        TEST_ASSERT_NOT_NULL(strstr(result->out, description_of(command)));
        expect_80_columns(result->out);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr((const char *)page, command->name), command->name);
        for (const struct shef_option *option = command->options; option->name; option++) {
            const bool is_word = option->kind == SHEF_OPTION_WORD;
            int n = snprintf(manual, sizeof manual, "%s", is_word ? "" : "\\-\\-");

            TEST_ASSERT_NOT_NULL(strstr(result->out, option->name));
            for (const char *c = option->name; *c; c++)
                n += snprintf(manual + n, sizeof manual - (size_t)n, *c == '-' ? "\\-" : "%c", *c);
            TEST_ASSERT_NOT_NULL_MESSAGE(strstr((const char *)page, manual), option->name);
        }
    }
    free(page);
    TEST_ASSERT_EQUAL_INT(0, program_run("--help")->status);
    TEST_ASSERT_EQUAL_INT(0, program_run("--version")->status);
    TEST_ASSERT_EQUAL_INT(0, program_run("bench --help")->status);
    TEST_ASSERT_EQUAL_INT(0, program_run("-h")->status);
    TEST_ASSERT_NOT_NULL(strstr(program_run("help align fit")->out, "Usage: sheftool align fit"));
    TEST_ASSERT_NOT_NULL(strstr(program_run("help bench")->out, "Usage: sheftool bench frame"));
    TEST_ASSERT_NOT_NULL(strstr(program_run("match -h")->out, "Usage: sheftool match"));
}

/* Last: after this every long work in this process counts as interrupted. */
static void test_interrupted_work_leaves_nothing_behind(void)
{
    char out[4096];
    char command[] = "synth";
    char option[] = "--out";
    char *argv[] = { command, option, out };
    struct shef_error err;
    bool help;
    const int n_entries = shef_test_temp_count();
    const struct shef_command *synth = &shef_command_synth;
    void *settings = calloc(1, synth->settings_bytes);

    TEST_ASSERT_NOT_NULL(settings);
    snprintf(out, sizeof out, "%s", shef_test_temp_path("stopped/deep"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_options_parse(synth->options, settings, 3, argv, &help, &err));
    shef_interrupt_install();
    raise(SIGTERM);
    TEST_ASSERT_EQUAL(SHEF_ERR_GONE, synth->run(settings, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "nothing was written"));
    TEST_ASSERT_EQUAL_INT(n_entries, shef_test_temp_count());
    free(settings);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_bench_lists_ours_per_instruction_set_beside_opencv);
    RUN_TEST(test_every_command_helps_and_every_option_is_in_the_manual);
    RUN_TEST(test_interrupted_work_leaves_nothing_behind);
    return UNITY_END();
}
