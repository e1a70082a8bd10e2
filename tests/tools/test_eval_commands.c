/* eval and table from end to end on small synthetic pairs. */
#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "core/memory.h"
#include "core/pfm.h"
#include "core/png_io.h"
#include "support/support.h"
#include "tools/pairs.h"
#include "tools/program.h"

static void test_robust_finds_the_synthetic_truth_and_eval_says_so(void)
{
    char large[4096];
    char maps[4096];

    snprintf(large, sizeof large, "%s", shef_test_temp_path("large"));
    snprintf(maps, sizeof maps, "%s", shef_test_temp_path("large-maps"));
    program_run("synth --out %s --pairs 3 --width 320 --height 240", large);
    program_run("match --frame-edges %s/frame_edge --event-edges %s/event_edge --out %s "
                "--max-disparity 48",
                large, large, maps);
    const struct program_result *result = program_run(
        "eval --disparity %s --gt %s/gt --frame-edges %s/frame_edge --json", maps, large, large);
    json_t *root = json_loads(result->out, 0, NULL);

    TEST_ASSERT_NOT_NULL_MESSAGE(root, result->err);
    const json_t *all = json_object_get(root, "overall");

    TEST_ASSERT_TRUE(pairs_number_at(all, "delta_1") > 0.85);
    TEST_ASSERT_TRUE(pairs_number_at(all, "bad_p_percent") < 12);
    TEST_ASSERT_TRUE(pairs_number_at(all, "coverage_percent") > 80);
    TEST_ASSERT_EQUAL_size_t(3, json_array_size(json_object_get(root, "scenes")));
    TEST_ASSERT_EQUAL_size_t(4, json_array_size(json_object_get(root, "density_curve")));
    TEST_ASSERT_EQUAL_size_t(10, json_array_size(json_object_get(root, "confidence")));
    json_decref(root);
}

static void test_depth_is_computed_with_the_rig_of_the_data_unless_given(void)
{
    char maps[4096];

    snprintf(maps, sizeof maps, "%s", pairs_match("rig", ""));
    json_t *own = pairs_eval_json(maps, "");
    json_t *given = pairs_eval_json(maps, "--focal 1301 --baseline 65.44");
    const json_t *rig = json_object_get(own, "rig");

    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1301.0 / 4, pairs_number_at(rig, "focal_px"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.06544, pairs_number_at(rig, "baseline_m"));
    TEST_ASSERT_DOUBLE_WITHIN(
        1e-3, 4,
        pairs_number_at(json_object_get(given, "overall"), "depth_median_cm") /
            pairs_number_at(json_object_get(own, "overall"), "depth_median_cm"));
    TEST_ASSERT_NOT_NULL(
        strstr(program_run("eval --disparity %s --gt %s/gt", maps, pairs_data())->out,
               "f = 325.2 px, b = 65.44 mm"));
    json_decref(own);
    json_decref(given);
}

static void test_confidence_is_said_to_hold_after_the_bias(void)
{
    char maps[4096];

    TEST_ASSERT_NOT_NULL(strstr(program_run("match --help")->out, "declared bias, see"));
    snprintf(maps, sizeof maps, "%s", pairs_match("promised", ""));
    TEST_ASSERT_NOT_NULL(
        strstr(program_run("eval --disparity %s --gt %s/gt", maps, pairs_data())->out,
               "px after the declared bias"));
}

static void test_eval_reads_16_bit_png_as_256ths_of_a_pixel(void)
{
    struct shef_image_u16 map;
    char folder[4096];
    char path[4200];

    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("png"));
    program_run("synth --out %s --pairs 1 --width 160 --height 120", folder);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u16(&map, 160, 120, NULL));
    for (int32_t y = 0; y < 120; y++)
        for (int32_t x = 0; x < 160; x++)
            shef_row_u16(map, y)[x] = 10 * 256 + 128; /* 10.5 px */
    snprintf(path, sizeof path, "%s/frame_edge/1.png", folder);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_write_u16(path, map, NULL));
    shef_image_destroy_u16(&map);

    struct shef_image_f32 truth;

    snprintf(path, sizeof path, "%s/gt/1.pfm", folder);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pfm_read(path, &truth, NULL));
    for (int32_t y = 0; y < 120; y++)
        for (int32_t x = 0; x < 160; x++)
            shef_row_f32(truth, y)[x] = 12;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pfm_write(path, truth, NULL));
    shef_image_destroy_f32(&truth);

    const struct program_result *result = program_run(
        "eval --disparity %s/frame_edge --gt %s/gt --filter none --json", folder, folder);
    json_t *root = json_loads(result->out, 0, NULL);

    TEST_ASSERT_NOT_NULL_MESSAGE(root, result->err);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.5,
                              pairs_number_at(json_object_get(root, "overall"), "rmse_px"));
    json_decref(root);
}

static void test_eval_of_the_truth_itself_is_free_of_errors(void)
{
    char maps[4200];

    snprintf(maps, sizeof maps, "%s/gt", pairs_data());
    for (int i = 0; i < 3; i++) {
        static const char *const protocols[] = { "--protocol authors --filter none",
                                                 "--protocol density", "--protocol dense" };
        json_t *root = pairs_eval_json(maps, protocols[i]);
        const json_t *all = json_object_get(root, "overall");

        TEST_ASSERT_EQUAL_DOUBLE(0, pairs_number_at(all, "rmse_px"));
        TEST_ASSERT_EQUAL_DOUBLE(0, pairs_number_at(all, "bad_1_percent"));
        TEST_ASSERT_EQUAL_DOUBLE(1, pairs_number_at(all, "delta_1"));
        TEST_ASSERT_EQUAL_DOUBLE(100, pairs_number_at(all, "coverage_percent"));
        json_decref(root);
    }
}

static void test_eval_pictures_go_beside_the_maps_and_not_between_them(void)
{
    char maps[4096];

    snprintf(maps, sizeof maps, "%s", pairs_match("shown", ""));
    TEST_ASSERT_EQUAL_INT(
        0, program_run("eval --disparity %s/ --gt %s/gt --pictures", maps, pairs_data())->status);
    TEST_ASSERT_TRUE(pairs_has_file(shef_test_temp_path("shown-errors"), "1.png"));
    TEST_ASSERT_FALSE(pairs_has_file(maps, "1.png"));
}

static void test_table_has_every_row_and_a_picture(void)
{
    static const char *const rows[] = { "paper D_s (cited)",
                                        "paper D_p (cited)",
                                        "paper D_c (cited)",
                                        "paper-ds",
                                        "paper-dp",
                                        "OpenCV StereoBM",
                                        "OpenCV StereoSGBM",
                                        "robust",
                                        "OpenCV StereoBM + bias",
                                        "OpenCV StereoSGBM + bias",
                                        "robust + bias",
                                        "robust dense",
                                        "robust dense + bias" };
    char out[4096];

    snprintf(out, sizeof out, "%s", shef_test_temp_path("table"));
    const struct program_result *result =
        program_run("table --data %s --out %s --max-disparity 32", pairs_data(), out);

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        char cell[64];

        snprintf(cell, sizeof cell, "| %s |", rows[i]);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->out, cell), rows[i]);
    }
    TEST_ASSERT_NOT_NULL(strstr(result->out, "| 17.24 | 40.08 | 0.6967 | 0.7641 | 0.8530 |"));
    TEST_ASSERT_NOT_NULL(strstr(result->out, "| 28945 |"));
    TEST_ASSERT_NOT_NULL(strstr(result->out, "# Disparity on 6 synthetic edge pairs (seed 1) of "));
    TEST_ASSERT_NOT_NULL(strstr(result->out, "f = 325 px")); /* 1301 px at 640 px width */
    TEST_ASSERT_TRUE(pairs_has_file(out, "table.md"));
    TEST_ASSERT_TRUE(pairs_has_file(out, "table.png"));
    json_t *root = pairs_load_json(out, "table.json");

    TEST_ASSERT_EQUAL_size_t(13, json_array_size(json_object_get(root, "rows")));
    json_decref(root);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_robust_finds_the_synthetic_truth_and_eval_says_so);
    RUN_TEST(test_depth_is_computed_with_the_rig_of_the_data_unless_given);
    RUN_TEST(test_confidence_is_said_to_hold_after_the_bias);
    RUN_TEST(test_eval_reads_16_bit_png_as_256ths_of_a_pixel);
    RUN_TEST(test_eval_of_the_truth_itself_is_free_of_errors);
    RUN_TEST(test_eval_pictures_go_beside_the_maps_and_not_between_them);
    RUN_TEST(test_table_has_every_row_and_a_picture);
    return UNITY_END();
}
