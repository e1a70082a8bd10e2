#include "tools/pairs.h"

#include <stdio.h>
#include <unistd.h>

#include "support/support.h"
#include "tools/program.h"

const char *pairs_data(void)
{
    static char data[4096];

    if (!*data)
        snprintf(data, sizeof data, "%s", program_make_data("data", PAIRS_N));
    return data;
}

const char *pairs_match(const char *name, const char *more)
{
    static char out[4096];

    snprintf(out, sizeof out, "%s", shef_test_temp_path(name));
    const struct program_result *result =
        program_run(PAIRS_MATCH " %s", pairs_data(), pairs_data(), out, more);

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    return out;
}

json_t *pairs_load_json(const char *folder, const char *name)
{
    char path[4200];
    json_error_t error;

    snprintf(path, sizeof path, "%s/%s", folder, name);
    json_t *root = json_load_file(path, 0, &error);

    TEST_ASSERT_NOT_NULL_MESSAGE(root, error.text);
    return root;
}

bool pairs_has_file(const char *folder, const char *name)
{
    char path[4200];

    snprintf(path, sizeof path, "%s/%s", folder, name);
    return access(path, F_OK) == 0;
}

double pairs_number_at(const json_t *root, const char *key)
{
    const json_t *value = json_object_get(root, key);

    TEST_ASSERT_TRUE_MESSAGE(json_is_number(value), key);
    return json_number_value(value);
}

json_t *pairs_eval_json(const char *maps, const char *more)
{
    const struct program_result *result =
        program_run("eval --disparity %s --gt %s/gt --frame-edges %s/frame_edge --json %s", maps,
                    pairs_data(), pairs_data(), more);
    json_error_t error;

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    json_t *root = json_loads(result->out, 0, &error);

    TEST_ASSERT_NOT_NULL_MESSAGE(root, error.text);
    return root;
}
