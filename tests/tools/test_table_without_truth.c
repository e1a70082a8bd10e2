/* The table on data whose truth has no pixel with a value. */
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "core/memory.h"
#include "core/pfm.h"
#include "support/support.h"
#include "tools/program.h"

#define N_PAIRS 3

static void erase_truth(const char *data)
{
    struct shef_image_f32 blank;
    char path[4200];

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&blank, 160, 120, NULL));
    for (int i = 1; i <= N_PAIRS; i++) {
        snprintf(path, sizeof path, "%s/gt/%d.pfm", data, i);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_pfm_write(path, blank, NULL));
    }
    shef_image_destroy_f32(&blank);
}

static json_t *row_named(const json_t *table, const char *name)
{
    size_t i;
    json_t *row;

    json_array_foreach(json_object_get(table, "rows"), i,
                       row) if (strcmp(json_string_value(json_object_get(row, "name")), name) ==
                                0) return row;
    TEST_FAIL_MESSAGE(name);
    return NULL;
}

static void test_rows_stand_and_say_what_is_unknown(void)
{
    char data[4096];
    char out[4096];
    char path[4200];

    snprintf(data, sizeof data, "%s", program_make_data("data", N_PAIRS));
    snprintf(out, sizeof out, "%s", shef_test_temp_path("table"));
    erase_truth(data);

    const struct program_result *run =
        program_run("table --data %s --out %s --max-disparity 64", data, out);

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, run->status, run->err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(run->out, "\n| robust | - | - |"), run->out);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(run->out, "| robust | - / - / - | "), run->out);
    TEST_ASSERT_NULL_MESSAGE(strstr(run->out, "nan"), run->out);

    snprintf(path, sizeof path, "%s/table.json", out);

    json_t *table = json_load_file(path, 0, NULL);

    TEST_ASSERT_NOT_NULL(table);
    TEST_ASSERT_EQUAL_STRING(
        "needs two scenes or more, with estimates enough to fit",
        json_string_value(json_object_get(row_named(table, "robust + bias"), "missing")));
    TEST_ASSERT_NULL(json_object_get(row_named(table, "robust"), "missing"));
    json_decref(table);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_rows_stand_and_say_what_is_unknown);
    return UNITY_END();
}
