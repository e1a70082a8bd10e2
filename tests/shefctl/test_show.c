#include "shefctl/show.h"

#include <stdlib.h>
#include <string.h>

#include "support/support.h"

static char *shown(const char *json, const char *columns)
{
    char *text = NULL;
    size_t n_text;
    FILE *out = open_memstream(&text, &n_text);
    json_t *answer = json_loads(json, 0, NULL);

    TEST_ASSERT_NOT_NULL_MESSAGE(answer, json);
    shef_show(answer, columns, out);
    fclose(out);
    json_decref(answer);
    return text;
}

static void expect_shown(const char *json, const char *columns, const char *expected)
{
    char *text = shown(json, columns);

    TEST_ASSERT_EQUAL_STRING(expected, text);
    free(text);
}

static void test_names_and_values_stand_in_two_columns_with_units(void)
{
    expect_shown("{\"state\": \"playing\", \"uptime_s\": 12.345, \"memory_bytes\": 123456789,"
                 " \"granted\": false, \"cpu\": null, \"cpu_share\": 0.257}",
                 NULL,
                 "state    playing\n"
                 "uptime   12.3 s\n"
                 "memory   123.5 MB\n"
                 "granted  no\n"
                 "cpu      -\n"
                 "cpu      25.7 %\n");
}

static void test_objects_inside_are_indented(void)
{
    expect_shown("{\"frames\": {\"n_in\": 5400, \"shed_by\": {\"dense\": 2}}, \"mode\": \"x\"}",
                 NULL,
                 "frames:\n"
                 "  in  5400\n"
                 "  shed by:\n"
                 "    dense  2\n"
                 "mode  x\n");
}

static void test_arrays_of_objects_are_tables_with_numbers_to_the_right(void)
{
    expect_shown("{\"stages\": [{\"name\": \"filter\", \"rate_hz\": 54.04, \"p50_ms\": 1.5},"
                 "{\"name\": \"stereo\", \"rate_hz\": 5.2, \"p50_ms\": 12.25, \"late\": true}]}",
                 NULL,
                 "stages:\n"
                 "  name    rate Hz  p50 ms  late\n"
                 "  filter     54.0    1.50  \n"
                 "  stereo      5.2   12.25  yes\n");
}

static void test_only_the_wanted_columns_are_shown(void)
{
    expect_shown("{\"settings\": [{\"key\": \"a\", \"help\": \"long\", \"value\": \"\"}]}",
                 "key,value",
                 "settings:\n"
                 "  key  value\n"
                 "  a    \"\"\n");
}

static void test_lists_stand_in_a_line_and_sentences_one_below_the_other(void)
{
    expect_shown("{\"modes\": [\"graded\", \"ternary\"], \"warnings\": [],"
                 " \"notes\": [\"one thing\", \"another thing\"]}",
                 NULL,
                 "modes     graded, ternary\n"
                 "warnings  none\n"
                 "notes:\n"
                 "  one thing\n"
                 "  another thing\n");
}

static void test_an_answer_cannot_command_the_terminal(void)
{
    char *text = shown("{\"path\": \"a\\u001b[2Jb\\n\", \"odd\\u001b\": 1,"
                       " \"rows\": [{\"x\\u001b\": \"\\u0007\"}]}",
                       NULL);

    for (const char *byte = text; *byte; byte++)
        TEST_ASSERT_TRUE(*byte == '\n' || (unsigned char)*byte >= ' ');
    free(text);
}

static void test_letters_beyond_ascii_do_not_bend_the_columns(void)
{
    expect_shown(
        "{\"rows\": [{\"name\": \"caf\\u00e9\", \"n\": 1}, {\"name\": \"tea\", \"n\": 2}]}", NULL,
        "rows:\n"
        "  name  n\n"
        "  caf\xc3\xa9  1\n"
        "  tea   2\n");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_names_and_values_stand_in_two_columns_with_units);
    RUN_TEST(test_objects_inside_are_indented);
    RUN_TEST(test_arrays_of_objects_are_tables_with_numbers_to_the_right);
    RUN_TEST(test_only_the_wanted_columns_are_shown);
    RUN_TEST(test_lists_stand_in_a_line_and_sentences_one_below_the_other);
    RUN_TEST(test_an_answer_cannot_command_the_terminal);
    RUN_TEST(test_letters_beyond_ascii_do_not_bend_the_columns);
    return UNITY_END();
}
