#include "control/request.h"

#include <stdlib.h>
#include <string.h>

#include "control/command.h"

static enum shef_err check_members(json_t *root, struct shef_error *err)
{
    json_t *arguments = json_object_get(root, "arguments");
    const char *key;
    json_t *value;

    if (!json_is_object(root))
        return shef_fail(err, SHEF_ERR_INVALID, "a request must be a JSON object");
    json_object_foreach(root, key, value)
    {
        (void)value;
        if (strcmp(key, "command") != 0 && strcmp(key, "arguments") != 0)
            return shef_fail(err, SHEF_ERR_INVALID,
                             "a request has 'command' and 'arguments', but no '%.40s'", key);
    }
    if (!json_is_string(json_object_get(root, "command")))
        return shef_fail(err, SHEF_ERR_INVALID, "a request must name its 'command'");
    if (arguments && !json_is_object(arguments))
        return shef_fail(err, SHEF_ERR_INVALID, "the 'arguments' of a request must be an object");
    return SHEF_OK;
}

static enum shef_err take_members(json_t *root, struct shef_control_request *out_request,
                                  struct shef_error *err)
{
    enum shef_err code = check_members(root, err);
    const char *name;

    if (code != SHEF_OK)
        return code;
    name = json_string_value(json_object_get(root, "command"));
    if (strlen(name) >= sizeof out_request->command)
        return shef_fail(err, SHEF_ERR_INVALID, "there is no command '%.40s...'", name);

    json_t *arguments = json_object_get(root, "arguments");

    arguments = arguments ? json_incref(arguments) : json_object();
    if (!arguments)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "read a request: out of memory");
    strcpy(out_request->command, name);
    out_request->arguments = arguments;
    return SHEF_OK;
}

enum shef_err shef_control_request_parse(const char *line, size_t n_bytes,
                                         struct shef_control_request *out_request,
                                         struct shef_error *err)
{
    json_error_t problem;
    json_t *root = json_loadb(line, n_bytes, JSON_REJECT_DUPLICATES, &problem);

    if (!root)
        return shef_fail(err, SHEF_ERR_FORMAT, "the request is no JSON: %s, at byte %d",
                         problem.text, problem.position);

    const enum shef_err code = take_members(root, out_request, err);

    json_decref(root);
    return code;
}

json_t *shef_control_string(const char *text)
{
    json_t *string = json_string(text);
    char *ascii;

    if (string)
        return string;
    ascii = strdup(text);
    if (!ascii)
        return NULL;
    for (char *byte = ascii; *byte; byte++)
        if ((unsigned char)*byte > 126)
            *byte = '?';
    string = json_string(ascii);
    free(ascii);
    return string;
}

/* Takes root over. */
static char *write_line(json_t *root)
{
    char *text = root ? json_dumps(root, JSON_COMPACT | JSON_REAL_PRECISION(10)) : NULL;
    const size_t n = text ? strlen(text) : 0;
    char *line = text ? realloc(text, n + 2) : NULL;

    json_decref(root);
    if (!line) {
        free(text);
        return NULL;
    }
    memcpy(line + n, "\n", 2);
    return line;
}

char *shef_control_answer(const json_t *answer)
{
    return write_line(json_pack("{s:b, s:O}", "ok", 1, "answer", answer));
}

char *shef_control_refusal(const struct shef_error *err, bool closes)
{
    return write_line(json_pack("{s:b, s:{s:s, s:o, s:b}}", "ok", 0, "error", "code",
                                shef_err_name(err->code), "text", shef_control_string(err->text),
                                "closes", (int)closes));
}

enum shef_err shef_control_text(const json_t *arguments, const char *name, char *out_text,
                                size_t n_bytes, struct shef_error *err)
{
    const json_t *argument = json_object_get(arguments, name);
    const char *text = json_string_value(argument);

    if (!argument)
        return shef_fail(err, SHEF_ERR_INVALID, "the argument '%s' is missing", name);
    if (!text)
        return shef_fail(err, SHEF_ERR_INVALID, "the argument '%s' must be a text", name);
    if (!*text)
        return shef_fail(err, SHEF_ERR_INVALID, "the argument '%s' is empty", name);
    if (strlen(text) >= n_bytes)
        return shef_fail(err, SHEF_ERR_INVALID, "the argument '%s' is longer than %zu bytes", name,
                         n_bytes - 1);
    strcpy(out_text, text);
    return SHEF_OK;
}
