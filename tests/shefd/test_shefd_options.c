#include "shefd/options.h"

#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "support/support.h"

static struct shef_shefd_options options;
static struct shef_config config;
static struct shef_error err;

static enum shef_err parse(const char *line)
{
    static char copy[1024];
    char *words[16] = { (char[]){ "shefd" } };
    int n = 1;

    snprintf(copy, sizeof copy, "%s", line);
    for (char *word = strtok(copy, " "); word; word = strtok(NULL, " "))
        words[n++] = word;
    return shef_shefd_options_parse(n, words, &options, &err);
}

static void expect_refused(const char *line, const char *sentence)
{
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, parse(line));
    TEST_ASSERT_EQUAL_STRING(sentence, err.text);
}

static const char *write_config(const char *text)
{
    const char *path = shef_test_temp_path("shefd.yaml");

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, text, strlen(text), &err));
    return path;
}

static void test_without_options_it_runs(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse(""));
    TEST_ASSERT_EQUAL(SHEF_SHEFD_RUN, options.action);
    TEST_ASSERT_NULL(options.config_path);
    TEST_ASSERT_FALSE(options.ends_with_source);
}

static void test_every_action_has_its_option(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse("--check-config"));
    TEST_ASSERT_EQUAL(SHEF_SHEFD_CHECK_CONFIG, options.action);
    TEST_ASSERT_EQUAL(SHEF_OK, parse("--settings"));
    TEST_ASSERT_EQUAL(SHEF_SHEFD_LIST_SETTINGS, options.action);
    TEST_ASSERT_EQUAL(SHEF_OK, parse("--print-config"));
    TEST_ASSERT_EQUAL(SHEF_SHEFD_WRITE_CONFIG, options.action);
    TEST_ASSERT_EQUAL(SHEF_OK, parse("--version"));
    TEST_ASSERT_EQUAL(SHEF_SHEFD_VERSION, options.action);
    TEST_ASSERT_EQUAL(SHEF_OK, parse("-h --nonsense"));
    TEST_ASSERT_EQUAL(SHEF_SHEFD_HELP, options.action);
}

static void test_a_calibration_that_the_settings_name_is_looked_at(void)
{
    const char *const source = shef_test_source("config/calibration.example.yaml");
    uint8_t *bytes;
    size_t n_bytes;
    char *place;

    shef_config_defaults(&config);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_shefd_calibration_check(&config, &err));
    snprintf(config.calibration.file, sizeof config.calibration.file, "%s", source);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(source, 100000, &bytes, &n_bytes, &err));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_shefd_calibration_check(&config, &err), err.text);
    snprintf(config.calibration.file, sizeof config.calibration.file, "/no/such.yaml");
    TEST_ASSERT_NOT_EQUAL(SHEF_OK, shef_shefd_calibration_check(&config, &err));
    TEST_ASSERT_EQUAL_STRING("calibration.file: read '/no/such.yaml': No such file or directory",
                             err.text);

    /* The event camera on the left. */
    place = strstr((char *)bytes, "[-0.06544");
    TEST_ASSERT_NOT_NULL(place);
    place[1] = ' ';
    snprintf(config.calibration.file, sizeof config.calibration.file, "%s",
             write_config((const char *)bytes));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_shefd_calibration_check(&config, &err));
    TEST_ASSERT_EQUAL_INT(0, strncmp(err.text, "calibration.file: ", 18));
    free(bytes);
}

static void test_mistakes_on_the_command_line_are_named(void)
{
    expect_refused("--nonsense", "--nonsense is no option of shefd; see --help");
    expect_refused("--config", "--config needs a value; see --help");
    expect_refused("--set mode", "--set mode: needs KEY=VALUE; see --settings");
    expect_refused("--set depth.speed=7", "--set depth.speed=7: there is no setting 'depth.speed'; "
                                          "--settings lists them all");
    expect_refused("--set depth.worker=7", "--set depth.worker=7: there is no setting "
                                           "'depth.worker'; is 'depth.workers' meant?");
    expect_refused("-s depth.workers=70", "--set: depth.workers: '70' must be a whole number from "
                                          "1 to 16 threads");
    expect_refused("walk-1", "'walk-1' belongs to no option; see --help");
}

static void test_the_command_line_comes_before_the_file(void)
{
    char line[512];

    snprintf(line, sizeof line, "-c %s -s depth.workers=5 --play /",
             write_config("depth: { workers: 3, mode: ternary }\nsource: { recording: /data }\n"));
    TEST_ASSERT_EQUAL(SHEF_OK, parse(line));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_shefd_config_load(&options, &config, &err), err.text);
    TEST_ASSERT_EQUAL_INT32(5, config.depth.workers);
    TEST_ASSERT_EQUAL_STRING("ternary", config.depth.mode);
    TEST_ASSERT_EQUAL_STRING("/", config.source.recording);
}

static void expect_not_loaded(const char *line, const char *sentence)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse(line));
    TEST_ASSERT_NOT_EQUAL(SHEF_OK, shef_shefd_config_load(&options, &config, &err));
    TEST_ASSERT_EQUAL_STRING(sentence, err.text);
}

static void test_settings_on_the_command_line_are_checked_like_the_files(void)
{
    char line[512];

    snprintf(line, sizeof line, "-c %s -s shed.dense_ms=900", write_config(""));
    expect_not_loaded(line, "shed.cloud_ms (10 ms) is below shed.dense_ms (900 ms), but cheaper "
                            "work is left out first");
    snprintf(line, sizeof line, "-c %s -s lcm.url=udpm://239.255.76.67", write_config(""));
    expect_not_loaded(line, "LCM address 'udpm://239.255.76.67': behind 239.255.76.67 the port is "
                            "missing, such as :7667");
    snprintf(line, sizeof line, "-c %s", write_config("lcm:\n  prefix: a b\n"));
    expect_not_loaded(line, "LCM prefix 'a b': 1 to 50 printable characters without blanks are "
                            "possible");
}

static void test_an_end_that_never_comes_is_refused(void)
{
    char *words[] = { (char[]){ "shefd" }, (char[]){ "--play" }, (char[]){ "" }, NULL };
    char line[512];

    snprintf(line, sizeof line, "-c %s --once", write_config(""));
    expect_not_loaded(line, "--once leaves when the recording is over, but there is none; name one "
                            "with --play");
    snprintf(line, sizeof line, "-c %s --once --play / -s source.loop=true", write_config(""));
    expect_not_loaded(line, "--once leaves when the recording is over, which never happens with "
                            "source.loop=true");
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_shefd_options_parse(3, words, &options, &err));
    TEST_ASSERT_EQUAL_STRING("--play: the recording has no name", err.text);
}

static void test_a_named_file_must_be_there(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse("--config /no/such/shefd.yaml"));
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_shefd_config_load(&options, &config, &err));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_without_options_it_runs);
    RUN_TEST(test_every_action_has_its_option);
    RUN_TEST(test_a_calibration_that_the_settings_name_is_looked_at);
    RUN_TEST(test_mistakes_on_the_command_line_are_named);
    RUN_TEST(test_the_command_line_comes_before_the_file);
    RUN_TEST(test_settings_on_the_command_line_are_checked_like_the_files);
    RUN_TEST(test_an_end_that_never_comes_is_refused);
    RUN_TEST(test_a_named_file_must_be_there);
    return UNITY_END();
}
