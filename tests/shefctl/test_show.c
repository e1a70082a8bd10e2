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
    expect_shown("{\"frames\": {\"n_in\": 5400, \"shed_by\": {\"dense\": 2}, \"n_lost\": 2},"
                 " \"mode\": \"x\"}",
                 NULL,
                 "frames:\n"
                 "  in 5400, lost 2\n"
                 "  shed by:  dense 2\n"
                 "mode  x\n");
}

static void test_values_of_an_object_inside_share_lines_of_80_columns(void)
{
    expect_shown("{\"lost_by\": {\"a_long_enough_name\": 1000000, \"another_long_name\": 2.5,"
                 " \"the_third_of_them_ms\": 3.25, \"x_s\": 4.0}}",
                 NULL,
                 "lost by:  a long enough name 1000000, another long name 2.5,\n"
                 "  the third of them 3.25 ms, x 4.0 s\n");
}

static void test_sentences_and_lists_inside_an_object_have_their_own_lines(void)
{
    expect_shown("{\"recording\": {\"state\": \"on\", \"reason\": \"a disk, full\", \"n_lost\": 3,"
                 " \"parts\": [\"a\", \"b\"]}}",
                 NULL,
                 "recording:\n"
                 "  state on, lost 3\n"
                 "  reason  a disk, full\n"
                 "  parts   a, b\n");
}

static void test_a_table_of_names_with_one_value_each_is_one_line(void)
{
    expect_shown("{\"threads\": [{\"name\": \"filter\", \"cpu_share\": 0.25},"
                 " {\"name\": \"stereo\", \"cpu_share\": 0.5}]}",
                 NULL, "threads:  filter 25.0 %, stereo 50.0 %\n");
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

static void test_wanted_columns_that_no_row_has_are_left_out(void)
{
    expect_shown("{\"rings\": [{\"name\": \"a\", \"count\": 1, \"capacity\": 8}],"
                 " \"threads\": [{\"name\": \"b\", \"cpu\": 2, \"policy\": \"fifo\"}]}",
                 "name,cpu,capacity,count",
                 "rings:\n"
                 "  name  capacity  count\n"
                 "  a            8      1\n"
                 "threads:\n"
                 "  name  cpu\n"
                 "  b       2\n");
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
    expect_shown("{\"rows\": [{\"name\": \"caf\\u00e9\", \"m\": 0, \"n\": 1},"
                 " {\"name\": \"tea\", \"m\": 0, \"n\": 2}]}",
                 NULL,
                 "rows:\n"
                 "  name  m  n\n"
                 "  caf\xc3\xa9  0  1\n"
                 "  tea   0  2\n");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_names_and_values_stand_in_two_columns_with_units);
    RUN_TEST(test_objects_inside_are_indented);
    RUN_TEST(test_values_of_an_object_inside_share_lines_of_80_columns);
    RUN_TEST(test_sentences_and_lists_inside_an_object_have_their_own_lines);
    RUN_TEST(test_a_table_of_names_with_one_value_each_is_one_line);
    RUN_TEST(test_arrays_of_objects_are_tables_with_numbers_to_the_right);
    RUN_TEST(test_only_the_wanted_columns_are_shown);
    RUN_TEST(test_wanted_columns_that_no_row_has_are_left_out);
    RUN_TEST(test_lists_stand_in_a_line_and_sentences_one_below_the_other);
    RUN_TEST(test_an_answer_cannot_command_the_terminal);
    RUN_TEST(test_letters_beyond_ascii_do_not_bend_the_columns);
    return UNITY_END();
}
