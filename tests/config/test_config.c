#include "config/config.h"

#include <stdlib.h>
#include <string.h>

#include "config/config_text.h"
#include "support/support.h"

static struct shef_config config;
static struct shef_error err;

static enum shef_err parse(const char *text)
{
    memset(&config, 0x5a, sizeof config);
    memset(&err, 0, sizeof err);
    return shef_config_parse((const uint8_t *)text, strlen(text), "shefd.yaml", &config, &err);
}

static void expect_sentence(const char *text, const char *sentence)
{
    TEST_ASSERT_NOT_EQUAL(SHEF_OK, parse(text));
    TEST_ASSERT_EQUAL_STRING(sentence, err.text);
}

/* The sentence depends on the library's words; ours are the file and the line. */
static void expect_line(const char *text, const char *line)
{
    TEST_ASSERT_NOT_EQUAL(SHEF_OK, parse(text));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, line), err.text);
}

static void expect_defaults(void)
{
    struct shef_config defaults;
    char wanted[SHEF_CONFIG_PATH_BYTES], found[SHEF_CONFIG_PATH_BYTES];

    shef_config_defaults(&defaults);
    for (int i = 0; i < shef_config_n_rows; i++) {
        shef_config_get(&defaults, &shef_config_rows[i], wanted, sizeof wanted);
        shef_config_get(&config, &shef_config_rows[i], found, sizeof found);
        TEST_ASSERT_EQUAL_STRING_MESSAGE(wanted, found, shef_config_rows[i].key);
    }
}

static void test_an_empty_file_means_all_defaults(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse(""));
    expect_defaults();
    TEST_ASSERT_EQUAL(SHEF_OK, parse("# nothing but a remark\n"));
    expect_defaults();
}

static void test_the_defaults_are_those_of_the_conventions(void)
{
    shef_config_defaults(&config);
    TEST_ASSERT_EQUAL_STRING("udpm://239.255.76.67:7667?ttl=0", config.lcm.url);
    TEST_ASSERT_EQUAL_STRING("/run/shef/shefd.sock", config.control.socket);
    TEST_ASSERT_EQUAL_STRING("wide", config.calibration.profile);
    TEST_ASSERT_EQUAL(SHEF_GRID_HALF, config.lcm.grid);
    TEST_ASSERT_EQUAL_INT32(60, config.threads[SHEF_THREAD_EVENTS].priority);
    TEST_ASSERT_EQUAL_INT32(60, config.threads[SHEF_THREAD_FRAMES].priority);
    TEST_ASSERT_EQUAL_INT32(45, config.threads[SHEF_THREAD_FILTER].priority);
    TEST_ASSERT_EQUAL_INT32(40, config.threads[SHEF_THREAD_STEREO].priority);
    TEST_ASSERT_EQUAL_INT32(39, config.threads[SHEF_THREAD_WORKERS].priority);
    TEST_ASSERT_EQUAL(SHEF_POLICY_NORMAL, config.threads[SHEF_THREAD_PUBLISHER].policy);
    TEST_ASSERT_EQUAL(SHEF_POLICY_NORMAL, config.threads[SHEF_THREAD_CONTROL].policy);
}

static void test_what_the_file_says_is_taken_and_the_rest_stays_default(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse("source:\n"
                                     "  recording: /data/walk 1\n"
                                     "  loop: true\n"
                                     "  pace: stepped\n"
                                     "depth: { mode: paper-dp, workers: 3 }\n"
                                     "threads:\n"
                                     "  filter:\n"
                                     "    policy: normal\n"
                                     "    cpu: 1\n"));
    TEST_ASSERT_EQUAL_STRING("/data/walk 1", config.source.recording);
    TEST_ASSERT_TRUE(config.source.loop);
    TEST_ASSERT_EQUAL(SHEF_PACE_STEPPED, config.source.pace);
    TEST_ASSERT_EQUAL_STRING("paper-dp", config.depth.mode);
    TEST_ASSERT_EQUAL_INT32(3, config.depth.workers);
    TEST_ASSERT_EQUAL(SHEF_POLICY_NORMAL, config.threads[SHEF_THREAD_FILTER].policy);
    TEST_ASSERT_EQUAL_INT32(1, config.threads[SHEF_THREAD_FILTER].cpu);
    TEST_ASSERT_EQUAL_INT32(45, config.threads[SHEF_THREAD_FILTER].priority);
    TEST_ASSERT_EQUAL_INT32(0, config.depth.max_disparity_px);
    TEST_ASSERT_TRUE(config.lcm.disparity);
}

static void test_an_unknown_key_is_named_with_its_line(void)
{
    expect_sentence("# a remark\n\ndepth:\n  mode: graded\n  colour: red\n",
                    "shefd.yaml, line 5: there is no setting 'depth.colour'; "
                    "'shefd --settings' lists them all");
    expect_sentence("deep:\n  mode: graded\n", "shefd.yaml, line 1: there is no setting 'deep'; "
                                               "'shefd --settings' lists them all");
}

static void test_a_key_in_the_wrong_section_gets_a_hint(void)
{
    expect_sentence("source:\n  mode: graded\n",
                    "shefd.yaml, line 2: there is no setting 'source.mode'; is 'depth.mode' "
                    "meant?");
}

static void test_a_key_with_dots_is_explained(void)
{
    expect_sentence("lcm:\n  grid: full\n\ndepth.mode: graded\n",
                    "shefd.yaml, line 4: 'depth.mode' is written in parts: each section on a "
                    "line of its own");
}

static void test_a_wrong_type_is_named_with_its_line(void)
{
    expect_sentence("depth:\n  workers: many\n",
                    "shefd.yaml, line 2: depth.workers: 'many' must be a whole number from 1 to 16 "
                    "threads");
    expect_sentence("source:\n  recording: x\n  loop: yes\n",
                    "shefd.yaml, line 3: source.loop: 'yes' must be true or false");
    expect_sentence("depth:\n  workers: [1, 2]\n",
                    "shefd.yaml, line 2: a list begins, but no setting is a list");
    expect_sentence("depth:\n  workers:\n    n: 2\n",
                    "shefd.yaml, line 3: 'depth.workers' is one value and has no settings under "
                    "it");
    expect_sentence("depth: graded\n", "shefd.yaml, line 1: 'depth' is a section: its settings "
                                       "belong on the next lines, further to the right");
    expect_sentence("graded\n", "shefd.yaml, line 1: settings look like 'section:' and, on the "
                                "next line, '  key: value'");
}

static void test_a_section_without_settings_is_refused_with_its_line(void)
{
    expect_sentence("log:\n  # level: debug\ndepth:\n  workers: 3\n",
                    "shefd.yaml, line 1: the section 'log' is empty; remove this line as well");
}

static void test_a_number_out_of_range_is_refused_on_both_sides(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse("depth:\n  max_disparity_px: 16\n"));
    TEST_ASSERT_EQUAL(SHEF_OK, parse("depth:\n  max_disparity_px: 256\n"));
    /* It stands for the profile's own. */
    TEST_ASSERT_EQUAL(SHEF_OK, parse("depth:\n  max_disparity_px: 0\n"));
    expect_sentence("depth:\n  look_ahead: 0\n",
                    "shefd.yaml, line 2: depth.look_ahead: '0' must be a whole number from 1 to 4 "
                    "steps");
    expect_sentence("depth:\n  max_disparity_px: 15\n",
                    "shefd.yaml, line 2: depth.max_disparity_px: '15' must be a whole number from "
                    "16 to 256 px, or 0");
    expect_sentence("depth:\n  max_disparity_px: 257\n",
                    "shefd.yaml, line 2: depth.max_disparity_px: '257' must be a whole number "
                    "from 16 to 256 px, or 0");
    expect_line("depth:\n  max_disparity_px: 99999999999999999999\n", "line 2");
    expect_line("depth:\n  max_disparity_px: 64.5\n", "line 2");
    expect_line("depth:\n  max_disparity_px:\n", "line 2");
}

static void test_a_word_outside_its_list_is_refused_with_the_list(void)
{
    expect_sentence("depth:\n  mode: magic\n",
                    "shefd.yaml, line 2: depth.mode: 'magic' must be one of "
                    "paper-ds|paper-dp|unsigned|ternary|graded|temporal|combined");
    expect_line("source:\n  pace: step\n", "line 2: source.pace: 'step' must be one of");
}

static void test_a_key_given_twice_is_refused(void)
{
    expect_sentence("depth:\n  workers: 1\n  mode: graded\n  workers: 2\n",
                    "shefd.yaml, line 4: 'depth.workers' is there twice, see line 2");
    expect_sentence("depth:\n  workers: 1\nlcm:\n  grid: half\ndepth:\n  mode: graded\n",
                    "shefd.yaml, line 5: 'depth' is there twice, see line 1");
}

static void test_text_that_is_no_yaml_is_refused_with_its_line(void)
{
    expect_line("depth:\n  mode: \"graded\n", "shefd.yaml, line ");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, err.code);
    expect_line("depth:\n mode: graded\n   workers: 2\n", "line 3");
    expect_line("\tdepth:\n", "line 1");
}

static void test_what_yaml_allows_and_settings_do_not_is_refused(void)
{
    expect_line("depth: &d\n  mode: graded\nlcm: *d\n", "line 3");
    expect_line("depth:\n  mode: graded\n---\ndepth:\n  mode: ternary\n", "line 3");
    expect_line("- depth\n", "line 1");
    expect_line("{ {depth: 1}: 2 }\n", "line 1");
}

static void test_a_text_that_is_too_long_empty_or_odd_is_refused(void)
{
    char text[1024];

    snprintf(text, sizeof text, "lcm:\n  prefix: %0*d\n", SHEF_CONFIG_NAME_BYTES - 1, 0);
    TEST_ASSERT_EQUAL(SHEF_OK, parse(text));
    snprintf(text, sizeof text, "lcm:\n  prefix: %0*d\n", SHEF_CONFIG_NAME_BYTES, 0);
    expect_sentence(text, "shefd.yaml, line 2: lcm.prefix: the text is longer than 63 bytes");
    expect_sentence("lcm:\n  prefix: \"\"\n", "shefd.yaml, line 2: lcm.prefix: must not be empty");
    expect_sentence("lcm:\n  prefix: \"a\\nb\"\n",
                    "shefd.yaml, line 2: lcm.prefix: the text contains a control character");
}

static void test_settings_that_do_not_fit_together_are_refused(void)
{
    expect_sentence(
        "shed:\n  cloud_ms: 20\n",
        "shefd.yaml, line 2: shed.full_grid_ms (12 ms) is below shed.cloud_ms (20 ms), but "
        "cheaper work is left out first");
    expect_sentence("control:\n  socket: shefd.sock\n",
                    "shefd.yaml, line 2: control.socket: 'shefd.sock' must be a full path, "
                    "beginning with /");
    expect_sentence("record:\n  folder: mine\n",
                    "shefd.yaml, line 2: record.folder: 'mine' must be a full path, beginning with "
                    "/");
}

static void test_a_path_that_only_a_shell_understands_is_refused(void)
{
    expect_sentence("source:\n  recording: ~/walk-1\n",
                    "shefd.yaml, line 2: source.recording: '~/walk-1': only shells know what ~ "
                    "means; write the full path");
    expect_line("calibration:\n  file: ~/c.yaml\n", "line 2: calibration.file");
}

static void test_slips_of_the_finger_get_a_hint(void)
{
    expect_sentence("depht:\n  mode: graded\n",
                    "shefd.yaml, line 1: there is no setting 'depht'; is 'depth' meant?");
    expect_sentence("depth:\n  worker: 2\n",
                    "shefd.yaml, line 2: there is no setting 'depth.worker'; is 'depth.workers' "
                    "meant?");
    expect_sentence("threads:\n  fliter:\n    cpu: 1\n",
                    "shefd.yaml, line 2: there is no setting 'threads.fliter'; is 'threads.filter' "
                    "meant?");
    expect_sentence("depth:\n  mode: grade\n",
                    "shefd.yaml, line 2: depth.mode: 'grade' must be one of "
                    "paper-ds|paper-dp|unsigned|ternary|graded|temporal|combined; is 'graded' "
                    "meant?");
    expect_sentence("depth:\n\tmode: graded\n",
                    "shefd.yaml, line 2: this is no YAML: a tab begins the line; use spaces");
}

static void test_bytes_that_would_be_read_differently_are_refused(void)
{
    expect_sentence("lcm:\n  prefix: \"a\\0b\"\n", "shefd.yaml, line 2: a zero byte in a text");
    expect_sentence("depth:\n  \"mode\\0\": graded\n", "shefd.yaml, line 2: a zero byte in a text");
    expect_sentence("lcm:\n  prefix: \"\\u009b2J\"\n",
                    "shefd.yaml, line 2: lcm.prefix: the text contains a control character");
}

static void test_a_refused_file_changes_nothing(void)
{
    struct shef_config before;

    memset(&before, 0x5a, sizeof before);
    TEST_ASSERT_NOT_EQUAL(SHEF_OK, parse("depth:\n  workers: 3\n  mode: magic\n"));
    TEST_ASSERT_EQUAL_MEMORY(&before, &config, sizeof config);
}

static void test_a_missing_file_is_one_sentence(void)
{
    const char *path = shef_test_temp_path("none.yaml");

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_config_read(path, &config, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, path));
}

static void test_the_library_and_our_own_pass_know_the_same_keys(void)
{
    char text[256], value[SHEF_CONFIG_PATH_BYTES];

    shef_config_defaults(&config);
    for (int i = 0; i < shef_config_n_rows; i++) {
        const struct shef_config_row *row = &shef_config_rows[i];
        int indent = 0;
        size_t at = 0;

        shef_config_defaults(&config);
        shef_config_get(&config, row, value, sizeof value);
        for (const char *part = row->key; *part;) {
            const int n = (int)strcspn(part, ".");

            at += (size_t)snprintf(text + at, sizeof text - at, "%*s%.*s:%s", indent, "", n, part,
                                   part[n] ? "\n" : "");
            indent += 2;
            part += n + (part[n] == '.');
        }
        snprintf(text + at, sizeof text - at, " '%s'\n", value);
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, parse(text), err.text);
        expect_defaults();
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_empty_file_means_all_defaults);
    RUN_TEST(test_the_defaults_are_those_of_the_conventions);
    RUN_TEST(test_what_the_file_says_is_taken_and_the_rest_stays_default);
    RUN_TEST(test_an_unknown_key_is_named_with_its_line);
    RUN_TEST(test_a_key_in_the_wrong_section_gets_a_hint);
    RUN_TEST(test_a_key_with_dots_is_explained);
    RUN_TEST(test_a_wrong_type_is_named_with_its_line);
    RUN_TEST(test_a_section_without_settings_is_refused_with_its_line);
    RUN_TEST(test_a_number_out_of_range_is_refused_on_both_sides);
    RUN_TEST(test_a_word_outside_its_list_is_refused_with_the_list);
    RUN_TEST(test_a_key_given_twice_is_refused);
    RUN_TEST(test_text_that_is_no_yaml_is_refused_with_its_line);
    RUN_TEST(test_what_yaml_allows_and_settings_do_not_is_refused);
    RUN_TEST(test_a_text_that_is_too_long_empty_or_odd_is_refused);
    RUN_TEST(test_settings_that_do_not_fit_together_are_refused);
    RUN_TEST(test_a_path_that_only_a_shell_understands_is_refused);
    RUN_TEST(test_slips_of_the_finger_get_a_hint);
    RUN_TEST(test_bytes_that_would_be_read_differently_are_refused);
    RUN_TEST(test_a_refused_file_changes_nothing);
    RUN_TEST(test_a_missing_file_is_one_sentence);
    RUN_TEST(test_the_library_and_our_own_pass_know_the_same_keys);
    return UNITY_END();
}
