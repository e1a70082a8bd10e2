/* The option table: defaults, ranges, refusals, help. */
#include <stdlib.h>
#include <string.h>

#include "sheftool/option.h"
#include "support/support.h"

struct settings {
    const char *in;
    const char *name;
    int64_t n;
    double x;
    int32_t mode;
    bool loud;
};

static const struct shef_option options[] = {
    SHEF_OPT_NEEDED("in", struct settings, in, "DIR", "where to read"),
    SHEF_OPT_TEXT("name", struct settings, name, "NAME", "nobody", "a name"),
    SHEF_OPT_INT("count", struct settings, n, "80", 16, 256, "px", "how many"),
    SHEF_OPT_REAL("factor", struct settings, x, "0.5", 0, 1, NULL, "how much"),
    SHEF_OPT_CHOICE("mode", struct settings, mode, "fast|exact", "exact", "how"),
    SHEF_OPT_FLAG("loud", struct settings, loud, "say more"),
    SHEF_OPT_END,
};

static struct settings settings;
static struct shef_error err;
static bool help;

/* Parses a line of words, the command's own name in front. */
static enum shef_err parse_with(const struct shef_option *table, const char *line)
{
    static char copy[256];
    char command[] = "command";
    char *argv[16] = { command };
    int argc = 1;

    settings = (struct settings){ 0 };
    snprintf(copy, sizeof copy, "%s", line);
    for (char *word = strtok(copy, " "); word; word = strtok(NULL, " "))
        argv[argc++] = word;
    return shef_options_parse(table, &settings, argc, argv, &help, &err);
}

static enum shef_err parse(const char *line)
{
    return parse_with(options, line);
}

static void test_what_is_not_given_has_its_default(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse("--in data"));
    TEST_ASSERT_EQUAL_STRING("data", settings.in);
    TEST_ASSERT_EQUAL_STRING("nobody", settings.name);
    TEST_ASSERT_EQUAL_INT64(80, settings.n);
    TEST_ASSERT_EQUAL_DOUBLE(0.5, settings.x);
    TEST_ASSERT_EQUAL_INT32(1, settings.mode);
    TEST_ASSERT_FALSE(settings.loud);
}

static void test_every_kind_of_value_is_stored(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse("--in=d --count 16 --factor 1 --mode fast --loud --name me"));
    TEST_ASSERT_EQUAL_INT64(16, settings.n);
    TEST_ASSERT_EQUAL_DOUBLE(1, settings.x);
    TEST_ASSERT_EQUAL_INT32(0, settings.mode);
    TEST_ASSERT_TRUE(settings.loud);
    TEST_ASSERT_EQUAL_STRING("me", settings.name);
}

static void expect_refused(const char *line, const char *named, const char *remedy)
{
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, parse(line));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, named), err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, remedy), err.text);
}

static void test_values_out_of_range_are_refused_with_range_and_unit(void)
{
    expect_refused("--in d --count 15", "--count 15", "from 16 to 256 px");
    expect_refused("--in d --count 257", "--count 257", "from 16 to 256 px");
    expect_refused("--in d --factor 1.01", "--factor 1.01", "from 0 to 1");
}

static void test_words_that_are_no_numbers_are_refused(void)
{
    expect_refused("--in d --count 20x", "--count 20x", "a whole number");
    expect_refused("--in d --count 20.5", "--count 20.5", "a whole number");
    expect_refused("--in d --count 99999999999999999999", "--count", "a whole number");
    expect_refused("--in d --factor nan", "--factor nan", "a number");
    expect_refused("--in d --factor inf", "--factor inf", "a number");
}

static void test_unknown_choices_list_the_known_ones(void)
{
    expect_refused("--in d --mode slow", "--mode slow", "fast|exact");
    expect_refused("--in d --mode fas", "--mode fas", "fast|exact");
}

static void test_missing_and_unknown_things_are_named(void)
{
    expect_refused("--loud", "--in DIR is missing", "--help");
    expect_refused("--in", "--in needs a value", "--help");
    expect_refused("--in d --lout", "--lout", "--help");
    expect_refused("--in d -x", "-x", "--help");
    expect_refused("--in d extra", "'extra'", "--help");
}

static const struct shef_option word_options[] = {
    SHEF_OPT_WORD("IN", struct settings, in, true, "what to read"),
    SHEF_OPT_FLAG("loud", struct settings, loud, "say more"),
    SHEF_OPT_WORD("OUT", struct settings, name, false, "what to write"),
    SHEF_OPT_INT("count", struct settings, n, "80", 16, 256, "px", "how many"),
    SHEF_OPT_END,
};

static void test_words_stand_before_between_and_behind_options(void)
{
    static const char *const lines[] = { "a b --loud --count 20", "--loud a --count 20 b",
                                         "--count 20 --loud a b", "--loud --count=20 -- a b" };

    for (int i = 0; i < 4; i++) {
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, parse_with(word_options, lines[i]), err.text);
        TEST_ASSERT_EQUAL_STRING("a", settings.in);
        TEST_ASSERT_EQUAL_STRING("b", settings.name);
        TEST_ASSERT_EQUAL_INT64(20, settings.n);
        TEST_ASSERT_TRUE(settings.loud);
    }
    TEST_ASSERT_EQUAL(SHEF_OK, parse_with(word_options, "-- --loud"));
    TEST_ASSERT_EQUAL_STRING("--loud", settings.in);
    TEST_ASSERT_NULL(settings.name);
    TEST_ASSERT_FALSE(settings.loud);
    TEST_ASSERT_EQUAL(SHEF_OK, parse_with(word_options, "-"));
    TEST_ASSERT_EQUAL_STRING("-", settings.in);
}

static void test_missing_and_superfluous_words_are_named(void)
{
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, parse_with(word_options, "--loud"));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "IN is missing"), err.text);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, parse_with(word_options, "a b c"));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "'c' belongs to no option"), err.text);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, parse_with(word_options, "-- a b c"));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "'c' belongs to no option"), err.text);
}

static void test_words_are_in_the_help_without_dashes(void)
{
    char *text = NULL;
    size_t n_bytes;
    FILE *out = open_memstream(&text, &n_bytes);

    shef_options_synopsis(word_options, 10, out);
    fclose(out);
    TEST_ASSERT_EQUAL_STRING(" IN [--loud] [OUT] [--count N]\n", text);
    free(text);
}

static void test_help_wins_over_missing_options(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse("--help"));
    TEST_ASSERT_TRUE(help);
    TEST_ASSERT_EQUAL(SHEF_OK, parse("-h"));
    TEST_ASSERT_TRUE(help);
    TEST_ASSERT_EQUAL(SHEF_OK, parse("--in d"));
    TEST_ASSERT_FALSE(help);
}

static void test_help_tells_name_unit_range_and_default_within_80_columns(void)
{
    char *text = NULL;
    size_t n_bytes;
    FILE *out = open_memstream(&text, &n_bytes);

    shef_options_help(options, out);
    shef_options_synopsis(options, 10, out);
    fclose(out);
    TEST_ASSERT_NOT_NULL(strstr(text, "--count N"));
    TEST_ASSERT_NOT_NULL(strstr(text, "how many; 16 to 256 px (default 80)"));
    TEST_ASSERT_NOT_NULL(strstr(text, "--mode fast|exact"));
    TEST_ASSERT_NOT_NULL(strstr(text, "(required)"));
    TEST_ASSERT_NOT_NULL(strstr(text, "[--loud]"));
    for (char *line = strtok(text, "\n"); line; line = strtok(NULL, "\n")) {
        TEST_ASSERT_LESS_THAN_size_t(80, strlen(line));
        TEST_ASSERT_NOT_EQUAL(' ', line[strlen(line) - 1]);
    }
    free(text);
}

static void test_a_description_is_folded_and_its_tables_stay(void)
{
    char *text = NULL;
    size_t n_bytes;
    FILE *out = open_memstream(&text, &n_bytes);

    shef_options_description("One\nparagraph of words, long enough that it has to be folded where "
                             "the line of eighty ends:\n  table    of   two\n  lines\nAnd\nmore.\n"
                             "\nEnd.",
                             out);
    fclose(out);
    TEST_ASSERT_EQUAL_STRING(
        "One paragraph of words, long enough that it has to be folded where the "
        "line of\neighty ends:\n  table    of   two\n  lines\nAnd more.\n\n"
        "End.\n",
        text);
    free(text);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_is_not_given_has_its_default);
    RUN_TEST(test_every_kind_of_value_is_stored);
    RUN_TEST(test_values_out_of_range_are_refused_with_range_and_unit);
    RUN_TEST(test_words_that_are_no_numbers_are_refused);
    RUN_TEST(test_unknown_choices_list_the_known_ones);
    RUN_TEST(test_missing_and_unknown_things_are_named);
    RUN_TEST(test_words_stand_before_between_and_behind_options);
    RUN_TEST(test_missing_and_superfluous_words_are_named);
    RUN_TEST(test_words_are_in_the_help_without_dashes);
    RUN_TEST(test_help_wins_over_missing_options);
    RUN_TEST(test_a_description_is_folded_and_its_tables_stay);
    RUN_TEST(test_help_tells_name_unit_range_and_default_within_80_columns);
    return UNITY_END();
}
