/* match, align fit and bias fit from end to end on small synthetic pairs. */
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "core/memory.h"
#include "core/pfm.h"
#include "core/png_io.h"
#include "sheftool/matcher.h"
#include "support/support.h"
#include "tools/pairs.h"
#include "tools/program.h"

static void test_match_writes_maps_confidences_pictures_and_timing(void)
{
    const char *out = pairs_match("robust", "--pictures");

    for (int i = 1; i <= PAIRS_N; i++) {
        char name[32];

        snprintf(name, sizeof name, "%d.pfm", i);
        TEST_ASSERT_TRUE(pairs_has_file(out, name));
        snprintf(name, sizeof name, "%d.conf.pfm", i);
        TEST_ASSERT_TRUE(pairs_has_file(out, name));
        snprintf(name, sizeof name, "%d.colour.png", i);
        TEST_ASSERT_TRUE(pairs_has_file(out, name));
    }
    json_t *timing = pairs_load_json(out, "timing.json");
    const json_t *total = json_object_get(json_object_get(timing, "timing"), "total");

    TEST_ASSERT_EQUAL_STRING("robust", json_string_value(json_object_get(timing, "mode")));
    TEST_ASSERT_TRUE(pairs_number_at(total, "min_ms") > 0);
    TEST_ASSERT_TRUE(pairs_number_at(total, "median_ms") >= pairs_number_at(total, "min_ms"));
    TEST_ASSERT_TRUE(pairs_number_at(total, "p95_ms") >= pairs_number_at(total, "median_ms"));
    TEST_ASSERT_EQUAL_size_t(PAIRS_N, json_array_size(json_object_get(timing, "pairs")));
    json_decref(timing);
}

static void test_every_mode_runs_and_dense_fills_the_map(void)
{
    static const char *const modes[] = { "paper-ds", "paper-dp", "opencv-stereobm",
                                         "opencv-stereosgbm" };

    for (int i = 0; i < 4; i++) {
        char more[64];

        snprintf(more, sizeof more, "--mode %s", modes[i]);
        json_t *root = pairs_eval_json(pairs_match(modes[i], more), "--filter none");

        TEST_ASSERT_TRUE_MESSAGE(pairs_number_at(json_object_get(root, "overall"), "pixels") > 0,
                                 modes[i]);
        json_decref(root);
    }
    json_t *root = pairs_eval_json(pairs_match("dense", "--dense"), "--protocol dense");

    TEST_ASSERT_DOUBLE_WITHIN(
        1.0, 100, pairs_number_at(json_object_get(root, "overall"), "coverage_percent"));
    json_decref(root);
}

static void write_black(const char *path)
{
    struct shef_image_u8 image;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&image, 160, 120, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_write_u8(path, image, NULL));
    shef_image_destroy_u8(&image);
}

static bool has_estimates(const char *path)
{
    struct shef_image_f32 map;
    bool any = false;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_pfm_read(path, &map, NULL));
    for (int32_t y = 0; y < map.height_px; y++)
        for (int32_t x = 0; x < map.width_px; x++)
            any = any || shef_row_f32(map, y)[x] != 0;
    shef_image_destroy_f32(&map);
    return any;
}

static void test_match_sums_up_and_warns_of_an_empty_event_map(void)
{
    static const char *const more[] = { "", "--dense", "--mode paper-ds" };
    char folder[4096];
    char maps[4096];
    char path[4200];

    snprintf(folder, sizeof folder, "%s", program_make_data("black", 3));
    snprintf(maps, sizeof maps, "%s", shef_test_temp_path("black-maps"));
    const struct program_result *result = program_run(PAIRS_MATCH, folder, folder, maps);

    TEST_ASSERT_EQUAL_INT(0, result->status);
    TEST_ASSERT_NOT_NULL(strstr(result->out, "event maps empty: 0, saturated: 0; scene cuts: "));
    TEST_ASSERT_NOT_NULL(strstr(result->out, "mean confidence 0."));
    TEST_ASSERT_NULL(strstr(result->err, "empty"));

    snprintf(path, sizeof path, "%s/event_edge/2.png", folder);
    write_black(path);
    for (int i = 0; i < 3; i++) {
        result = program_run(PAIRS_MATCH " %s", folder, folder, maps, more[i]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
        TEST_ASSERT_NOT_NULL(strstr(result->out, "event maps empty: 1"));
        TEST_ASSERT_NOT_NULL(strstr(result->err, "1 of 3 event maps are empty (the first is pair "
                                                 "2)"));
        snprintf(path, sizeof path, "%s/2.pfm", maps);
        TEST_ASSERT_FALSE(has_estimates(path));
        snprintf(path, sizeof path, "%s/3.pfm", maps);
        TEST_ASSERT_TRUE(has_estimates(path));
    }
}

static void test_match_warns_of_low_confidence(void)
{
    char folder[4096];
    char maps[4096];

    /* The cameras swapped: no disparity is right. */
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("swapped"));
    program_run("synth --out %s --pairs 3", folder);
    snprintf(maps, sizeof maps, "%s", shef_test_temp_path("swapped-maps"));
    const struct program_result *result =
        program_run("match --frame-edges %s/event_edge --event-edges %s/frame_edge --out %s",
                    folder, folder, maps);

    TEST_ASSERT_EQUAL_INT(0, result->status);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->err, "frame camera is the left one"), result->out);
}

/* Compares every map of two result folders byte by byte. */
static void expect_same_maps(const char *a, const char *b)
{
    for (int i = 1; i <= PAIRS_N; i++) {
        uint8_t *bytes[2];
        size_t n_bytes[2];
        char path[4200];

        snprintf(path, sizeof path, "%s/%d.pfm", a, i);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 24, &bytes[0], &n_bytes[0], NULL));
        snprintf(path, sizeof path, "%s/%d.pfm", b, i);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 24, &bytes[1], &n_bytes[1], NULL));
        TEST_ASSERT_EQUAL_size_t(n_bytes[0], n_bytes[1]);
        TEST_ASSERT_EQUAL_MEMORY(bytes[0], bytes[1], n_bytes[0]);
        free(bytes[0]);
        free(bytes[1]);
    }
}

static void test_threads_and_instruction_sets_do_not_change_the_maps(void)
{
    char reference[4096];

    snprintf(reference, sizeof reference, "%s", pairs_match("one", ""));
    expect_same_maps(reference, pairs_match("three", "--threads 3"));
    expect_same_maps(reference, pairs_match("plain", "--isa c"));
}

static void test_only_picked_pairs_are_matched(void)
{
    const char *out = pairs_match("picked", "--mode paper-ds --pairs 2,5");

    TEST_ASSERT_TRUE(pairs_has_file(out, "2.pfm"));
    TEST_ASSERT_TRUE(pairs_has_file(out, "5.pfm"));
    TEST_ASSERT_FALSE(pairs_has_file(out, "1.pfm"));
}

static void test_range_of_pairs_that_is_there_in_part_is_said(void)
{
    char maps[4096];

    snprintf(maps, sizeof maps, "%s", shef_test_temp_path("part"));
    const struct program_result *result =
        program_run(PAIRS_MATCH " --pairs 2-99", pairs_data(), pairs_data(), maps);

    TEST_ASSERT_EQUAL_INT(0, result->status);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->err, "pairs 2-99: 5 of 98 present"), result->err);
    TEST_ASSERT_NULL(strstr(
        program_run(PAIRS_MATCH " --pairs 2-6", pairs_data(), pairs_data(), maps)->err, "present"));
}

static void test_fitted_fields_are_taken_by_match(void)
{
    char field[4096];

    snprintf(field, sizeof field, "%s", shef_test_temp_path("align.json"));
    TEST_ASSERT_EQUAL_INT(
        0, program_run("align fit --data %s --out %s --max-disparity 32", pairs_data(), field)
               ->status);
    char more[4200];

    snprintf(more, sizeof more, "--mode paper-ds --align %s", field);
    pairs_match("aligned", more);

    snprintf(field, sizeof field, "%s", shef_test_temp_path("bias.json"));
    TEST_ASSERT_EQUAL_INT(0,
                          program_run("bias fit --data %s --pairs 1-4 --out %s --max-disparity 32",
                                      pairs_data(), field)
                              ->status);
    snprintf(more, sizeof more, "--bias %s", field);
    pairs_match("biased", more);
}

static void test_odd_sizes_are_matched_aligned_and_scored(void)
{
    char odd[4096];
    char maps[4096];
    char field[4096];

    snprintf(odd, sizeof odd, "%s", shef_test_temp_path("odd"));
    snprintf(maps, sizeof maps, "%s", shef_test_temp_path("odd-maps"));
    snprintf(field, sizeof field, "%s", shef_test_temp_path("odd.json"));
    program_run("synth --out %s --pairs 3 --width 161 --height 121", odd);
    TEST_ASSERT_EQUAL_INT(
        0, program_run("align fit --data %s --out %s --max-disparity 32", odd, field)->status);
    for (int i = 0; i < SHEF_N_MATCHERS; i++)
        TEST_ASSERT_EQUAL_INT_MESSAGE(0,
                                      program_run(PAIRS_MATCH " --mode %s --align %s", odd, odd,
                                                  maps, shef_matchers[i]->name, field)
                                          ->status,
                                      shef_matchers[i]->name);
    TEST_ASSERT_EQUAL_INT(
        0, program_run("eval --disparity %s --gt %s/gt --frame-edges %s/frame_edge", maps, odd, odd)
               ->status);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_match_writes_maps_confidences_pictures_and_timing);
    RUN_TEST(test_every_mode_runs_and_dense_fills_the_map);
    RUN_TEST(test_match_sums_up_and_warns_of_an_empty_event_map);
    RUN_TEST(test_match_warns_of_low_confidence);
    RUN_TEST(test_threads_and_instruction_sets_do_not_change_the_maps);
    RUN_TEST(test_only_picked_pairs_are_matched);
    RUN_TEST(test_range_of_pairs_that_is_there_in_part_is_said);
    RUN_TEST(test_fitted_fields_are_taken_by_match);
    RUN_TEST(test_odd_sizes_are_matched_aligned_and_scored);
    return UNITY_END();
}
