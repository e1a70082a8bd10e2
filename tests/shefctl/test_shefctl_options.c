#include "shefctl/options.h"

#include <stdlib.h>
#include <string.h>

#include "support/support.h"

static struct shef_ctl_options options;
static struct shef_error err;

void setUp(void)
{
    unsetenv("SHEF_SOCKET");
}

static enum shef_err parse(const char *line)
{
    static char copy[1024];
    char *words[16] = { (char[]){ "shefctl" } };
    int n = 1;

    snprintf(copy, sizeof copy, "%s", line);
    for (char *word = strtok(copy, " "); word; word = strtok(NULL, " "))
        words[n++] = word;
    return shef_ctl_options_parse(n, words, &options, &err);
}

static void expect_command(const char *line, const char *name, const char *word)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, parse(line), err.text);
    TEST_ASSERT_EQUAL_STRING(name, options.command->name);
    if (word)
        TEST_ASSERT_EQUAL_STRING(word, options.word);
    else
        TEST_ASSERT_NULL(options.word);
}

static void expect_refused(const char *line, const char *sentence)
{
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, parse(line));
    TEST_ASSERT_EQUAL_STRING(sentence, err.text);
}

static char *arguments_of(const char *line)
{
    json_t *arguments;
    char *text;

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, parse(line), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_ctl_arguments(&options, &arguments, &err), err.text);
    text = json_dumps(arguments, JSON_COMPACT);
    json_decref(arguments);
    return text;
}

static void expect_arguments(const char *line, const char *expected)
{
    char *text = arguments_of(line);

    TEST_ASSERT_EQUAL_STRING(expected, text);
    free(text);
}

static void test_every_command_is_found_with_its_words(void)
{
    expect_command("status", "status", NULL);
    expect_command("mode", "mode", NULL);
    expect_command("mode graded", "mode", "graded");
    expect_command("snapshot now.png", "snapshot", "now.png");
    expect_command("record start", "record start", NULL);
    expect_command("record start walk-1", "record start", "walk-1");
    expect_command("record list", "record list", NULL);
}

static void test_options_may_stand_anywhere(void)
{
    expect_command("--json play /data --loop --pace stepped --socket /s", "play", "/data");
    TEST_ASSERT_TRUE(options.json);
    TEST_ASSERT_TRUE(options.loop);
    TEST_ASSERT_EQUAL_STRING("stepped", options.pace);
    TEST_ASSERT_EQUAL_STRING("/s", options.socket);
}

static void test_the_socket_comes_from_the_option_the_environment_or_the_default(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse("status"));
    TEST_ASSERT_EQUAL_STRING("/run/shef/shefd.sock", options.socket);
    setenv("SHEF_SOCKET", "/from/environment", 1);
    TEST_ASSERT_EQUAL(SHEF_OK, parse("status"));
    TEST_ASSERT_EQUAL_STRING("/from/environment", options.socket);
    TEST_ASSERT_EQUAL(SHEF_OK, parse("status --socket /given"));
    TEST_ASSERT_EQUAL_STRING("/given", options.socket);
}

static void test_mistakes_are_named(void)
{
    expect_refused("", "no command; see shefctl --help");
    expect_refused("dance", "'dance' is no command; see shefctl --help");
    expect_refused("statsu", "'statsu' is no command; is 'status' meant?");
    expect_refused("top --count 1.5", "--count 1.5: needs a whole number from 1 to 1000000");
    expect_refused("record", "'record' needs a second word: start, stop or list");
    expect_refused("record paint", "'record' needs a second word: start, stop or list");
    expect_refused("snapshot", "'snapshot' needs OUT.png; see shefctl --help");
    expect_refused("status now", "'now' is one word too many for 'status'; see --help");
    expect_refused("status --loop", "--loop is no option of 'status'; see --help");
    expect_refused("play x --count 3", "--count is no option of 'play'; see --help");
    expect_refused("top --interval 0", "--interval 0: needs a number from 0.1 to 3600");
    expect_refused("top --interval", "--interval needs a value; see --help");
    expect_refused("play x --pace slow", "--pace slow: needs recorded, stepped or fast");
    expect_refused("status --nonsense", "--nonsense is no option of shefctl; see --help");
}

static void test_a_mistake_is_said_in_json_where_that_was_wanted(void)
{
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, parse("--json dance"));
    TEST_ASSERT_TRUE(options.json);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, parse("dance"));
    TEST_ASSERT_FALSE(options.json);
}

static char *help_of(const char *line)
{
    char *text = NULL;
    size_t n_bytes;
    FILE *out = open_memstream(&text, &n_bytes);

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, parse(line), err.text);
    TEST_ASSERT_TRUE(options.help);
    shef_ctl_options_help(options.command, out);
    fclose(out);
    return text;
}

static void test_a_command_has_a_help_of_its_own(void)
{
    char *text = help_of("--help");

    TEST_ASSERT_NOT_NULL(strstr(text, "  snapshot OUT.png"));
    TEST_ASSERT_NOT_NULL(strstr(text, "--count N"));
    free(text);
    text = help_of("play --help");
    TEST_ASSERT_EQUAL_INT(0, strncmp(text, "Usage: shefctl [OPTIONS] play RECORDING\n", 40));
    TEST_ASSERT_NOT_NULL(strstr(text, "--pace PACE"));
    TEST_ASSERT_NOT_NULL(strstr(text, "--json"));
    TEST_ASSERT_NULL(strstr(text, "--count N"));
    TEST_ASSERT_NULL(strstr(text, "snapshot"));
    free(text);
    text = help_of("record list -h");
    TEST_ASSERT_EQUAL_INT(0, strncmp(text, "Usage: shefctl [OPTIONS] record list\n", 37));
    free(text);
    free(help_of("dance --help"));
}

static void test_what_is_sent_with_a_command(void)
{
    expect_arguments("status", "{}");
    expect_arguments("mode", "{}");
    expect_arguments("mode graded", "{\"name\":\"graded\"}");
    expect_arguments("snapshot now.png", "{}");
    expect_arguments("record start walk-1", "{\"name\":\"walk-1\"}");
    expect_arguments("play /proc/../tmp --loop --pace fast",
                     "{\"recording\":\"/tmp\",\"loop\":true,\"pace\":\"fast\"}");
}

static void test_a_recording_that_is_not_there_is_not_asked_for(void)
{
    json_t *arguments;

    TEST_ASSERT_EQUAL(SHEF_OK, parse("play /no/such/recording"));
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_ctl_arguments(&options, &arguments, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "/no/such/recording"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_command_is_found_with_its_words);
    RUN_TEST(test_options_may_stand_anywhere);
    RUN_TEST(test_the_socket_comes_from_the_option_the_environment_or_the_default);
    RUN_TEST(test_mistakes_are_named);
    RUN_TEST(test_a_mistake_is_said_in_json_where_that_was_wanted);
    RUN_TEST(test_a_command_has_a_help_of_its_own);
    RUN_TEST(test_what_is_sent_with_a_command);
    RUN_TEST(test_a_recording_that_is_not_there_is_not_asked_for);
    return UNITY_END();
}
