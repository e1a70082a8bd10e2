/* The figures that the program gives on the authors' 48 pairs, as a user would get them. */
#include <jansson.h>
#include <string.h>

#include "support/support.h"
#include "tools/program.h"

static json_t *table;

static void need_table(void)
{
    SHEF_TEST_NEEDS_DATA("shef");
    if (table)
        return;
    char out[4096];

    snprintf(out, sizeof out, "%s", shef_test_temp_path("table"));
    const struct program_result *result =
        program_run("table --data %s --out %s", shef_test_data("shef"), out);

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    table = json_load_file(shef_test_temp_path("table/table.json"), 0, NULL);
    TEST_ASSERT_NOT_NULL(table);
}

static double figure(const char *row_name, const char *key)
{
    size_t i;
    json_t *row;

    json_array_foreach(json_object_get(table, "rows"), i, row)
    {
        if (strcmp(json_string_value(json_object_get(row, "name")), row_name) != 0)
            continue;
        const json_t *value =
            json_object_get(json_object_get(json_object_get(row, "evaluation"), "overall"), key);

        TEST_ASSERT_TRUE_MESSAGE(json_is_number(value), key);
        return json_number_value(value);
    }
    TEST_FAIL_MESSAGE(row_name);
    return 0;
}

static void test_paper_ds_is_the_known_reproduction(void)
{
    need_table();
    TEST_ASSERT_DOUBLE_WITHIN(0.1, 16.0, figure("paper-ds", "rmse_px"));
    TEST_ASSERT_DOUBLE_WITHIN(0.2, 34.7, figure("paper-ds", "bad_p_percent"));
}

static void test_paper_dp_is_the_known_reproduction(void)
{
    need_table();
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 6.0, figure("paper-dp", "rmse_px"));
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 15.4, figure("paper-dp", "bad_p_percent"));
}

static void test_robust_beats_the_paper_and_opencv_and_covers_more(void)
{
    need_table();
    TEST_ASSERT_TRUE(figure("robust", "bad_p_percent") < figure("paper-dp", "bad_p_percent") / 2);
    TEST_ASSERT_TRUE(figure("robust", "bad_p_percent") <
                     figure("OpenCV StereoBM", "bad_p_percent"));
    TEST_ASSERT_TRUE(figure("robust", "bad_p_percent") <
                     figure("OpenCV StereoSGBM", "bad_p_percent"));
    TEST_ASSERT_TRUE(figure("robust", "coverage_percent") > 97);
    TEST_ASSERT_TRUE(figure("robust", "coverage_percent") >
                     figure("OpenCV StereoSGBM", "coverage_percent"));
}

static void test_bias_from_other_scenes_improves_this_one(void)
{
    need_table();
    TEST_ASSERT_TRUE(figure("robust + bias", "rmse_px") < figure("robust", "rmse_px"));
    TEST_ASSERT_TRUE(figure("robust + bias", "bad_p_percent") <
                     figure("robust", "bad_p_percent") / 2);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_paper_ds_is_the_known_reproduction);
    RUN_TEST(test_paper_dp_is_the_known_reproduction);
    RUN_TEST(test_robust_beats_the_paper_and_opencv_and_covers_more);
    RUN_TEST(test_bias_from_other_scenes_improves_this_one);
    const int n_failed = UNITY_END();

    json_decref(table);
    return n_failed;
}
