#include "control/request.h"

#include <stdlib.h>
#include <string.h>

#include "control/command.h"
#include "support/support.h"

static struct shef_control_request request;
static struct shef_error err;

static enum shef_err parse(const char *line)
{
    memset(&err, 0, sizeof err);
    request.arguments = NULL;
    return shef_control_request_parse(line, strlen(line), &request, &err);
}

static void expect_refused(const char *line, enum shef_err code, const char *words)
{
    TEST_ASSERT_EQUAL_MESSAGE(code, parse(line), line);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, words), err.text);
    TEST_ASSERT_NULL(request.arguments);
}

static void test_a_request_has_a_command_and_perhaps_arguments(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, parse("{\"command\":\"status\"}"));
    TEST_ASSERT_EQUAL_STRING("status", request.command);
    TEST_ASSERT_EQUAL_size_t(0, json_object_size(request.arguments));
    json_decref(request.arguments);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      parse(" {\"arguments\": {\"name\": \"graded\"}, \"command\": \"mode\"} "));
    TEST_ASSERT_EQUAL_STRING("mode", request.command);
    TEST_ASSERT_EQUAL_STRING("graded",
                             json_string_value(json_object_get(request.arguments, "name")));
    json_decref(request.arguments);
}

static void test_what_is_no_json_is_a_format_error(void)
{
    expect_refused("", SHEF_ERR_FORMAT, "no JSON");
    expect_refused("status", SHEF_ERR_FORMAT, "no JSON");
    expect_refused("{\"command\":\"status\"", SHEF_ERR_FORMAT, "no JSON");
    expect_refused("{\"command\":\"status\"} x", SHEF_ERR_FORMAT, "no JSON");
    expect_refused("{\"command\":\"a\",\"command\":\"b\"}", SHEF_ERR_FORMAT, "no JSON");
    expect_refused("{\"command\":\"\xff\"}", SHEF_ERR_FORMAT, "no JSON");
    expect_refused("GET / HTTP/1.1\r", SHEF_ERR_FORMAT, "no JSON");
}

static void test_json_that_is_no_request_says_what_a_request_is(void)
{
    expect_refused("[]", SHEF_ERR_INVALID, "object");
    expect_refused("{}", SHEF_ERR_INVALID, "'command'");
    expect_refused("{\"command\":7}", SHEF_ERR_INVALID, "'command'");
    expect_refused("{\"command\":\"a\",\"arguments\":[]}", SHEF_ERR_INVALID, "'arguments'");
    expect_refused("{\"command\":\"a\",\"argument\":{}}", SHEF_ERR_INVALID, "no 'argument'");
    expect_refused("{\"command\":\"a very long name that no command has at all\"}",
                   SHEF_ERR_INVALID, "there is no command");
}

static void test_deep_nesting_is_refused_without_harm(void)
{
    static char line[SHEF_CONTROL_REQUEST_BYTES];

    memset(line, '[', sizeof line - 1);
    expect_refused(line, SHEF_ERR_FORMAT, "no JSON");
}

static void test_an_answer_is_one_line_of_json(void)
{
    json_t *answer = json_pack("{s:s}", "text", "two\nlines");
    char *line = shef_control_answer(answer);

    TEST_ASSERT_EQUAL_STRING("{\"ok\":true,\"answer\":{\"text\":\"two\\nlines\"}}\n", line);
    free(line);
    json_decref(answer);
}

static void test_a_refusal_names_its_class_and_its_sentence(void)
{
    char *line;

    (void)shef_fail(&err, SHEF_ERR_NOT_FOUND, "there is no recording '%s'", "/x");
    line = shef_control_refusal(&err, false);
    TEST_ASSERT_EQUAL_STRING("{\"ok\":false,\"error\":{\"code\":\"not_found\",\"text\":\"there is "
                             "no recording '/x'\",\"closes\":false}}\n",
                             line);
    free(line);
    line = shef_control_refusal(&err, true);
    TEST_ASSERT_NOT_NULL(strstr(line, "\"closes\":true"));
    free(line);
}

static void test_names_that_are_no_utf_8_do_not_spoil_the_line(void)
{
    json_t *string = shef_control_string("caf\xe9");

    TEST_ASSERT_EQUAL_STRING("caf?", json_string_value(string));
    json_decref(string);
    string = shef_control_string("caf\xc3\xa9");
    TEST_ASSERT_EQUAL_STRING("caf\xc3\xa9", json_string_value(string));
    json_decref(string);
}

static void test_a_text_argument_is_checked(void)
{
    json_t *arguments = json_pack("{s:s, s:s, s:i}", "name", "graded", "empty", "", "number", 7);
    char text[8];

    TEST_ASSERT_EQUAL(SHEF_OK, shef_control_text(arguments, "name", text, sizeof text, &err));
    TEST_ASSERT_EQUAL_STRING("graded", text);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_control_text(arguments, "name", text, 6, &err));
    TEST_ASSERT_EQUAL_STRING("the argument 'name' is longer than 5 bytes", err.text);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_control_text(arguments, "empty", text, sizeof text, &err));
    TEST_ASSERT_EQUAL_STRING("the argument 'empty' is empty", err.text);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_control_text(arguments, "number", text, sizeof text, &err));
    TEST_ASSERT_EQUAL_STRING("the argument 'number' must be a text", err.text);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_control_text(arguments, "none", text, sizeof text, &err));
    TEST_ASSERT_EQUAL_STRING("the argument 'none' is missing", err.text);
    json_decref(arguments);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_request_has_a_command_and_perhaps_arguments);
    RUN_TEST(test_what_is_no_json_is_a_format_error);
    RUN_TEST(test_json_that_is_no_request_says_what_a_request_is);
    RUN_TEST(test_deep_nesting_is_refused_without_harm);
    RUN_TEST(test_an_answer_is_one_line_of_json);
    RUN_TEST(test_a_refusal_names_its_class_and_its_sentence);
    RUN_TEST(test_names_that_are_no_utf_8_do_not_spoil_the_line);
    RUN_TEST(test_a_text_argument_is_checked);
    return UNITY_END();
}
