/* The commands from end to end on small synthetic pairs, and their help and manual. */
#include <jansson.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "core/memory.h"
#include "core/pfm.h"
#include "core/png_io.h"
#include "sheftool/command.h"
#include "sheftool/matcher.h"
#include "support/support.h"
#include "tools/program.h"

#define N_PAIRS 6
#define MATCH                                                                                      \
    "match --frame-edges %s/frame_edge --event-edges %s/event_edge --out %s "                      \
    "--max-disparity 32"

static char data[4096];

/* One data folder for all tests. */
static void make_data(void)
{
    if (!*data)
        snprintf(data, sizeof data, "%s", program_make_data("data", N_PAIRS));
}

static const char *match(const char *name, const char *more)
{
    static char out[4096];

    make_data();
    snprintf(out, sizeof out, "%s", shef_test_temp_path(name));
    const struct program_result *result = program_run(MATCH " %s", data, data, out, more);

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    return out;
}

static json_t *load_json(const char *folder, const char *name)
{
    char path[4200];
    json_error_t error;

    snprintf(path, sizeof path, "%s/%s", folder, name);
    json_t *root = json_load_file(path, 0, &error);

    TEST_ASSERT_NOT_NULL_MESSAGE(root, error.text);
    return root;
}

static bool has_file(const char *folder, const char *name)
{
    char path[4200];

    snprintf(path, sizeof path, "%s/%s", folder, name);
    return access(path, F_OK) == 0;
}

static double number_at(const json_t *root, const char *key)
{
    const json_t *value = json_object_get(root, key);

    TEST_ASSERT_TRUE_MESSAGE(json_is_number(value), key);
    return json_number_value(value);
}

static json_t *eval_json(const char *maps, const char *more)
{
    const struct program_result *result =
        program_run("eval --disparity %s --gt %s/gt --frame-edges %s/frame_edge --json %s", maps,
                    data, data, more);
    json_error_t error;

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    json_t *root = json_loads(result->out, 0, &error);

    TEST_ASSERT_NOT_NULL_MESSAGE(root, error.text);
    return root;
}

static void test_match_writes_maps_confidences_pictures_and_timing(void)
{
    const char *out = match("robust", "--pictures");

    for (int i = 1; i <= N_PAIRS; i++) {
        char name[32];

        snprintf(name, sizeof name, "%d.pfm", i);
        TEST_ASSERT_TRUE(has_file(out, name));
        snprintf(name, sizeof name, "%d.conf.pfm", i);
        TEST_ASSERT_TRUE(has_file(out, name));
        snprintf(name, sizeof name, "%d.colour.png", i);
        TEST_ASSERT_TRUE(has_file(out, name));
    }
    json_t *timing = load_json(out, "timing.json");
    const json_t *total = json_object_get(json_object_get(timing, "timing"), "total");

    TEST_ASSERT_EQUAL_STRING("robust", json_string_value(json_object_get(timing, "mode")));
    TEST_ASSERT_TRUE(number_at(total, "min_ms") > 0);
    TEST_ASSERT_TRUE(number_at(total, "median_ms") >= number_at(total, "min_ms"));
    TEST_ASSERT_TRUE(number_at(total, "p95_ms") >= number_at(total, "median_ms"));
    TEST_ASSERT_EQUAL_size_t(N_PAIRS, json_array_size(json_object_get(timing, "pairs")));
    json_decref(timing);
}

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

    TEST_ASSERT_TRUE(number_at(all, "delta_1") > 0.85);
    TEST_ASSERT_TRUE(number_at(all, "bad_p_percent") < 12);
    TEST_ASSERT_TRUE(number_at(all, "coverage_percent") > 80);
    TEST_ASSERT_EQUAL_size_t(3, json_array_size(json_object_get(root, "scenes")));
    TEST_ASSERT_EQUAL_size_t(4, json_array_size(json_object_get(root, "density_curve")));
    TEST_ASSERT_EQUAL_size_t(10, json_array_size(json_object_get(root, "confidence")));
    json_decref(root);
}

static void test_every_mode_runs_and_dense_fills_the_map(void)
{
    static const char *const modes[] = { "paper-ds", "paper-dp", "opencv-stereobm",
                                         "opencv-stereosgbm" };

    for (int i = 0; i < 4; i++) {
        char more[64];

        snprintf(more, sizeof more, "--mode %s", modes[i]);
        json_t *root = eval_json(match(modes[i], more), "--filter none");

        TEST_ASSERT_TRUE_MESSAGE(number_at(json_object_get(root, "overall"), "pixels") > 0,
                                 modes[i]);
        json_decref(root);
    }
    json_t *root = eval_json(match("dense", "--dense"), "--protocol dense");

    TEST_ASSERT_DOUBLE_WITHIN(1.0, 100,
                              number_at(json_object_get(root, "overall"), "coverage_percent"));
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
    const struct program_result *result = program_run(MATCH, folder, folder, maps);

    TEST_ASSERT_EQUAL_INT(0, result->status);
    TEST_ASSERT_NOT_NULL(strstr(result->out, "event maps empty: 0, saturated: 0; scene cuts: "));
    TEST_ASSERT_NOT_NULL(strstr(result->out, "mean confidence 0."));
    TEST_ASSERT_NULL(strstr(result->err, "empty"));

    snprintf(path, sizeof path, "%s/event_edge/2.png", folder);
    write_black(path);
    for (int i = 0; i < 3; i++) {
        result = program_run(MATCH " %s", folder, folder, maps, more[i]);
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
    for (int i = 1; i <= N_PAIRS; i++) {
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

    snprintf(reference, sizeof reference, "%s", match("one", ""));
    expect_same_maps(reference, match("three", "--threads 3"));
    expect_same_maps(reference, match("plain", "--isa c"));
}

static void test_only_picked_pairs_are_matched(void)
{
    const char *out = match("picked", "--mode paper-ds --pairs 2,5");

    TEST_ASSERT_TRUE(has_file(out, "2.pfm"));
    TEST_ASSERT_TRUE(has_file(out, "5.pfm"));
    TEST_ASSERT_FALSE(has_file(out, "1.pfm"));
}

static void test_range_of_pairs_that_is_there_in_part_is_said(void)
{
    char maps[4096];

    make_data();
    snprintf(maps, sizeof maps, "%s", shef_test_temp_path("part"));
    const struct program_result *result = program_run(MATCH " --pairs 2-99", data, data, maps);

    TEST_ASSERT_EQUAL_INT(0, result->status);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(result->err, "pairs 2-99: 5 of 98 present"), result->err);
    TEST_ASSERT_NULL(strstr(program_run(MATCH " --pairs 2-6", data, data, maps)->err, "present"));
}

static void test_fitted_fields_are_taken_by_match(void)
{
    char field[4096];

    make_data();
    snprintf(field, sizeof field, "%s", shef_test_temp_path("align.json"));
    TEST_ASSERT_EQUAL_INT(
        0, program_run("align fit --data %s --out %s --max-disparity 32", data, field)->status);
    char more[4200];

    snprintf(more, sizeof more, "--mode paper-ds --align %s", field);
    match("aligned", more);

    snprintf(field, sizeof field, "%s", shef_test_temp_path("bias.json"));
    TEST_ASSERT_EQUAL_INT(
        0, program_run("bias fit --data %s --pairs 1-4 --out %s --max-disparity 32", data, field)
               ->status);
    snprintf(more, sizeof more, "--bias %s", field);
    match("biased", more);
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
                                      program_run(MATCH " --mode %s --align %s", odd, odd, maps,
                                                  shef_matchers[i]->name, field)
                                          ->status,
                                      shef_matchers[i]->name);
    TEST_ASSERT_EQUAL_INT(
        0, program_run("eval --disparity %s --gt %s/gt --frame-edges %s/frame_edge", maps, odd, odd)
               ->status);
}

static void test_depth_is_computed_with_the_rig_of_the_data_unless_given(void)
{
    char maps[4096];

    snprintf(maps, sizeof maps, "%s", match("rig", ""));
    json_t *own = eval_json(maps, "");
    json_t *given = eval_json(maps, "--focal 1301 --baseline 65.44");
    const json_t *rig = json_object_get(own, "rig");

    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1301.0 / 4, number_at(rig, "focal_px"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.06544, number_at(rig, "baseline_m"));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 4,
                              number_at(json_object_get(given, "overall"), "depth_median_cm") /
                                  number_at(json_object_get(own, "overall"), "depth_median_cm"));
    TEST_ASSERT_NOT_NULL(strstr(program_run("eval --disparity %s --gt %s/gt", maps, data)->out,
                                "f = 325.2 px, b = 65.44 mm"));
    json_decref(own);
    json_decref(given);
}

static void test_confidence_is_said_to_hold_after_the_bias(void)
{
    char maps[4096];

    TEST_ASSERT_NOT_NULL(strstr(program_run("match --help")->out, "after the declared"));
    snprintf(maps, sizeof maps, "%s", match("promised", ""));
    TEST_ASSERT_NOT_NULL(strstr(program_run("eval --disparity %s --gt %s/gt", maps, data)->out,
                                "px after the declared bias"));
}

static void test_eval_reads_16_bit_png_as_256ths_of_a_pixel(void)
{
    struct shef_image_u16 map;
    char folder[4096];
    char path[4200];

    make_data();
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
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.5, number_at(json_object_get(root, "overall"), "rmse_px"));
    json_decref(root);
}

static void test_eval_of_the_truth_itself_is_free_of_errors(void)
{
    char maps[4200];

    make_data();
    snprintf(maps, sizeof maps, "%s/gt", data);
    for (int i = 0; i < 3; i++) {
        static const char *const protocols[] = { "--protocol authors --filter none",
                                                 "--protocol density", "--protocol dense" };
        json_t *root = eval_json(maps, protocols[i]);
        const json_t *all = json_object_get(root, "overall");

        TEST_ASSERT_EQUAL_DOUBLE(0, number_at(all, "rmse_px"));
        TEST_ASSERT_EQUAL_DOUBLE(0, number_at(all, "bad_1_percent"));
        TEST_ASSERT_EQUAL_DOUBLE(1, number_at(all, "delta_1"));
        TEST_ASSERT_EQUAL_DOUBLE(100, number_at(all, "coverage_percent"));
        json_decref(root);
    }
}

static void test_eval_pictures_go_beside_the_maps_and_not_between_them(void)
{
    char maps[4096];

    snprintf(maps, sizeof maps, "%s", match("shown", ""));
    TEST_ASSERT_EQUAL_INT(
        0, program_run("eval --disparity %s/ --gt %s/gt --pictures", maps, data)->status);
    TEST_ASSERT_TRUE(has_file(shef_test_temp_path("shown-errors"), "1.png"));
    TEST_ASSERT_FALSE(has_file(maps, "1.png"));
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

    make_data();
    snprintf(out, sizeof out, "%s", shef_test_temp_path("table"));
    const struct program_result *result =
        program_run("table --data %s --out %s --max-disparity 32", data, out);

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
    TEST_ASSERT_TRUE(has_file(out, "table.md"));
    TEST_ASSERT_TRUE(has_file(out, "table.png"));
    json_t *root = load_json(out, "table.json");

    TEST_ASSERT_EQUAL_size_t(13, json_array_size(json_object_get(root, "rows")));
    json_decref(root);
}

static void test_bench_lists_ours_per_instruction_set_beside_opencv(void)
{
    static const char *const benches[] = { "correlate", "frame" };
    static const char *const first[] = { "correlate", "robust" };

    for (int i = 0; i < 2; i++) {
        const struct program_result *result = program_run(
            "bench %s --json --rounds 2 --width 96 --height 64 --max-disparity 32", benches[i]);
        json_t *root = json_loads(result->out, 0, NULL);
        bool has_c = false;
        bool has_peer = false;
        size_t k;
        json_t *one;

        TEST_ASSERT_NOT_NULL_MESSAGE(root, result->err);
        json_array_foreach(json_object_get(root, "results"), k, one)
        {
            const char *name = json_string_value(json_object_get(one, "name"));
            const char *isa = json_string_value(json_object_get(one, "isa"));

            has_c = has_c || (strcmp(name, first[i]) == 0 && strcmp(isa, "c") == 0);
            if (strcmp(name, "opencv-stereobm") == 0) {
                has_peer = true;
                TEST_ASSERT_DOUBLE_WITHIN(1e-5, 1, number_at(one, "ratio_to_stereobm"));
            }
            TEST_ASSERT_TRUE(number_at(one, "min_ms") > 0);
            TEST_ASSERT_TRUE(number_at(one, "median_ms") >= number_at(one, "min_ms"));
            /* 96 x 64 x 32 = 196608 disparities in the shortest time. */
            TEST_ASSERT_DOUBLE_WITHIN(1e-2 * number_at(one, "mde_per_s"),
                                      0.196608 / (number_at(one, "min_ms") / 1e3),
                                      number_at(one, "mde_per_s"));
        }
        TEST_ASSERT_TRUE(has_c && has_peer);
        json_decref(root);
    }
}

static void test_every_command_helps_and_every_option_is_in_the_manual(void)
{
    uint8_t *page;
    size_t n_bytes;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(shef_test_source("docs/man/sheftool.1"), 1 << 20,
                                              &page, &n_bytes, NULL));
    for (int i = 0; i < SHEF_N_COMMANDS; i++) {
        const struct shef_command *command = shef_commands[i];
        const struct program_result *result = program_run("%s --help", command->name);
        char manual[128];

        TEST_ASSERT_EQUAL_INT(0, result->status);
        TEST_ASSERT_NOT_NULL(strstr(result->out, command->description));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr((const char *)page, command->name), command->name);
        for (const struct shef_option *option = command->options; option->name; option++) {
            const bool is_word = option->kind == SHEF_OPTION_WORD;
            int n = snprintf(manual, sizeof manual, "%s", is_word ? "" : "\\-\\-");

            TEST_ASSERT_NOT_NULL(strstr(result->out, option->name));
            for (const char *c = option->name; *c; c++)
                n += snprintf(manual + n, sizeof manual - (size_t)n, *c == '-' ? "\\-" : "%c", *c);
            TEST_ASSERT_NOT_NULL_MESSAGE(strstr((const char *)page, manual), option->name);
        }
    }
    free(page);
    TEST_ASSERT_EQUAL_INT(0, program_run("--help")->status);
    TEST_ASSERT_EQUAL_INT(0, program_run("--version")->status);
    TEST_ASSERT_EQUAL_INT(0, program_run("bench --help")->status);
    TEST_ASSERT_EQUAL_INT(0, program_run("-h")->status);
    TEST_ASSERT_NOT_NULL(strstr(program_run("help align fit")->out, "Usage: sheftool align fit"));
    TEST_ASSERT_NOT_NULL(strstr(program_run("help bench")->out, "Usage: sheftool bench frame"));
    TEST_ASSERT_NOT_NULL(strstr(program_run("match -h")->out, "Usage: sheftool match"));
}

/* Last: after this every long work in this process counts as interrupted. */
static void test_interrupted_work_leaves_nothing_behind(void)
{
    char out[4096];
    char command[] = "synth";
    char option[] = "--out";
    char *argv[] = { command, option, out };
    struct shef_error err;
    bool help;
    const int n_entries = shef_test_temp_count();
    const struct shef_command *synth = &shef_command_synth;
    void *settings = calloc(1, synth->settings_bytes);

    TEST_ASSERT_NOT_NULL(settings);
    snprintf(out, sizeof out, "%s", shef_test_temp_path("stopped/deep"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_options_parse(synth->options, settings, 3, argv, &help, &err));
    shef_interrupt_install();
    raise(SIGTERM);
    TEST_ASSERT_EQUAL(SHEF_ERR_GONE, synth->run(settings, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "nothing was written"));
    TEST_ASSERT_EQUAL_INT(n_entries, shef_test_temp_count());
    free(settings);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_match_writes_maps_confidences_pictures_and_timing);
    RUN_TEST(test_robust_finds_the_synthetic_truth_and_eval_says_so);
    RUN_TEST(test_every_mode_runs_and_dense_fills_the_map);
    RUN_TEST(test_match_sums_up_and_warns_of_an_empty_event_map);
    RUN_TEST(test_match_warns_of_low_confidence);
    RUN_TEST(test_threads_and_instruction_sets_do_not_change_the_maps);
    RUN_TEST(test_only_picked_pairs_are_matched);
    RUN_TEST(test_range_of_pairs_that_is_there_in_part_is_said);
    RUN_TEST(test_fitted_fields_are_taken_by_match);
    RUN_TEST(test_odd_sizes_are_matched_aligned_and_scored);
    RUN_TEST(test_depth_is_computed_with_the_rig_of_the_data_unless_given);
    RUN_TEST(test_confidence_is_said_to_hold_after_the_bias);
    RUN_TEST(test_eval_reads_16_bit_png_as_256ths_of_a_pixel);
    RUN_TEST(test_eval_of_the_truth_itself_is_free_of_errors);
    RUN_TEST(test_eval_pictures_go_beside_the_maps_and_not_between_them);
    RUN_TEST(test_table_has_every_row_and_a_picture);
    RUN_TEST(test_bench_lists_ours_per_instruction_set_beside_opencv);
    RUN_TEST(test_every_command_helps_and_every_option_is_in_the_manual);
    RUN_TEST(test_interrupted_work_leaves_nothing_behind);
    return UNITY_END();
}
