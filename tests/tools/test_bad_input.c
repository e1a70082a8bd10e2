/* Mistakes of users end in one clear sentence and an exit status, and leave nothing behind. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/file.h"
#include "core/memory.h"
#include "core/pfm.h"
#include "core/png_io.h"
#include "support/support.h"
#include "tools/program.h"

#define MATCH "match --frame-edges %s/frame_edge --event-edges %s/event_edge --out %s"
#define EVAL  "eval --disparity %s/gt --gt %s/gt --frame-edges %s/frame_edge"

static char data[4096];
static char out[4096];
static int n_entries;

/* A fresh data folder of three pairs, and the name of a result folder that does not exist. */
void setUp(void)
{
    static int n_made;
    char name[32];

    snprintf(name, sizeof name, "data%d", ++n_made);
    snprintf(data, sizeof data, "%s", program_make_data(name, 3));
    snprintf(name, sizeof name, "out%d", n_made);
    snprintf(out, sizeof out, "%s", shef_test_temp_path(name));
    n_entries = shef_test_temp_count();
}

static const char *in_data(const char *name)
{
    static char path[4200];

    snprintf(path, sizeof path, "%s/%s", data, name);
    return path;
}

/* Writes a grey PNG of one value. */
static void write_grey(const char *path, int32_t width_px, int32_t height_px, uint8_t value)
{
    struct shef_image_u8 image;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&image, width_px, height_px, NULL));
    shef_row_u8(image, height_px - 1)[width_px - 1] = value;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_write_u8(path, image, NULL));
    shef_image_destroy_u8(&image);
}

/* Writes a map of 40 px with one other value at (7, 5). */
static void write_map(const char *path, int32_t width_px, int32_t height_px, float value)
{
    struct shef_image_f32 map;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&map, width_px, height_px, NULL));
    for (int32_t y = 0; y < height_px; y++)
        for (int32_t x = 0; x < width_px; x++)
            shef_row_f32(map, y)[x] = 40;
    shef_row_f32(map, 5)[7] = value;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pfm_write(path, map, NULL));
    shef_image_destroy_f32(&map);
}

static void match(void)
{
    program_run(MATCH " --max-disparity 64", data, data, out);
}

static void test_map_of_another_size_is_named_with_both_sizes(void)
{
    write_grey(in_data("event_edge/2.png"), 161, 120, 255);
    match();
    program_expect_failure(1, "event_edge/2.png' is 161 x 120 px", "160 x 120 px", n_entries);
}

static void test_map_that_is_not_binary_is_named_with_pixel_and_value(void)
{
    write_grey(in_data("frame_edge/3.png"), 160, 120, 128);
    match();
    program_expect_failure(1, "frame_edge/3.png'", "pixel (159, 119) is 128", n_entries);
}

static void test_missing_event_map_is_named(void)
{
    unlink(in_data("event_edge/2.png"));
    match();
    program_expect_failure(1, "event_edge/2.png' is missing, the partner of", "frame_edge/2.png'",
                           n_entries);
}

static void test_missing_frame_map_is_named(void)
{
    unlink(in_data("frame_edge/1.png"));
    match();
    program_expect_failure(1, "frame_edge/1.png' is missing", "--pairs", n_entries);
}

static void test_folder_without_maps_and_folder_that_is_not_there(void)
{
    TEST_ASSERT_EQUAL_INT(0, mkdir(in_data("bare"), 0755));
    program_run("match --frame-edges %s/bare --event-edges %s/bare --out %s", data, data, out);
    program_expect_failure(1, "bare' holds no numbered files", "1.png", n_entries);
    program_run("match --frame-edges %s/none --event-edges %s/none --out %s", data, data, out);
    program_expect_failure(1, "/none'", "No such file or directory", n_entries);
}

static void test_one_folder_for_both_cameras(void)
{
    TEST_ASSERT_EQUAL_INT(0, symlink("frame_edge", in_data("alias")));
    program_run("match --frame-edges %s/frame_edge --event-edges %s/alias --out %s", data, data,
                out);
    program_expect_failure(1, "alias' are the same folder", "event camera", n_entries);
}

static void test_file_that_is_no_png(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(in_data("frame_edge/2.png"), "hello", 5, NULL));
    match();
    program_expect_failure(1, "frame_edge/2.png", "PNG", n_entries);
}

static void test_search_range_larger_than_the_image(void)
{
    program_run(MATCH " --max-disparity 200", data, data, out);
    program_expect_failure(1, "200 px does not fit maps of 160 px width", "--max-disparity",
                           n_entries);
}

static void test_result_folder_that_holds_other_things(void)
{
    program_run(MATCH " --max-disparity 64", data, data, data);
    program_expect_failure(1, "holds '", "name a new or empty folder", n_entries);
    TEST_ASSERT_EQUAL_INT(0, access(in_data("frame_edge/1.png"), F_OK));
}

static void test_truncated_truth(void)
{
    uint8_t *bytes;
    size_t n_bytes;

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_file_read(in_data("gt/2.pfm"), 1 << 20, &bytes, &n_bytes, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(in_data("gt/2.pfm"), bytes, n_bytes - 1000, NULL));
    free(bytes);
    program_run(EVAL, data, data, data);
    program_expect_failure(1, "gt/2.pfm", "truncated", n_entries);
}

static void test_nan_infinity_and_negative_values_are_named_with_their_pixel(void)
{
    static const float bad[] = { NAN, INFINITY, -1 };
    static const char *const shown[] = { "nan", "inf", "-1" };

    for (int i = 0; i < 3; i++) {
        write_map(in_data("gt/3.pfm"), 160, 120, bad[i]);
        program_run(EVAL, data, data, data);
        program_expect_failure(1, "gt/3.pfm': pixel (7, 5) is", shown[i], n_entries);
    }
}

static void test_confidence_outside_0_to_1(void)
{
    write_map(in_data("gt/1.conf.pfm"), 160, 120, 0.5f);
    program_run(EVAL, data, data, data);
    program_expect_failure(1, "gt/1.conf.pfm': pixel (0, 0) is 40", "from 0 to 1", n_entries);
}

static void test_truth_of_another_size_and_truth_that_is_missing(void)
{
    char maps[4200];

    snprintf(maps, sizeof maps, "%s", in_data("maps"));
    TEST_ASSERT_EQUAL_INT(0, mkdir(maps, 0755));
    write_map(in_data("maps/2.pfm"), 150, 120, 40);
    program_run("eval --disparity %s --gt %s/gt", maps, data);
    program_expect_failure(1, "gt/2.pfm' is 160 x 120 px", "150 x 120 px", n_entries);
    write_map(in_data("maps/9.pfm"), 160, 120, 40);
    program_run("eval --disparity %s --gt %s/gt", maps, data);
    program_expect_failure(1, "gt/9.pfm' is missing", "map 9", n_entries);
}

static void test_maps_too_narrow_to_score(void)
{
    char maps[4200];

    snprintf(maps, sizeof maps, "%s", in_data("narrow"));
    TEST_ASSERT_EQUAL_INT(0, mkdir(maps, 0755));
    write_map(in_data("narrow/1.pfm"), 60, 40, 20);
    program_run("eval --disparity %s --gt %s", maps, maps);
    program_expect_failure(1, "60 px width cannot be scored", "at least 80", n_entries);
}

static void test_density_needs_frame_edges(void)
{
    program_run("eval --disparity %s/gt --gt %s/gt --protocol density", data, data);
    program_expect_failure(2, "density", "--frame-edges", n_entries);
}

static void test_pairs_that_the_data_do_not_have(void)
{
    program_run(MATCH " --max-disparity 64 --pairs 1-2,40", data, data, out);
    program_expect_failure(1, "40", "no pair", n_entries);
    program_run(MATCH " --pairs one", data, data, out);
    program_expect_failure(1, "'one' is no list of pairs", "1-16,50", n_entries);
}

static void test_field_file_of_the_wrong_kind_or_size(void)
{
    static const char bias[] = "{\"kind\": \"disparity_bias\", \"width_px\": 640, "
                               "\"height_px\": 480, \"coefficients_px\": [0, 0, 0, 0, 0, 0]}";

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_file_replace(in_data("bias.json"), bias, sizeof bias - 1, NULL));
    program_run(MATCH " --max-disparity 64 --align %s/bias.json", data, data, out, data);
    program_expect_failure(1, "bias.json", "vertical_residual", n_entries);
    program_run(MATCH " --max-disparity 64 --bias %s/bias.json", data, data, out, data);
    program_expect_failure(1, "640 x 480 px", "160 x 120 px", n_entries);
}

static void test_paper_modes_cannot_align_themselves(void)
{
    program_run(MATCH " --max-disparity 64 --mode paper-ds --align auto", data, data, out);
    program_expect_failure(1, "paper-ds cannot align itself", "align fit", n_entries);
}

static void test_bias_needs_truth(void)
{
    program_run("bias fit --frame-edges %s/frame_edge --event-edges %s/event_edge --pairs 1-3 "
                "--out %s",
                data, data, out);
    program_expect_failure(2, "--gt", "--data", n_entries);
}

static void test_fit_overwrites_nothing_but_its_own_kind(void)
{
    static const char *const kept[] = { "scenes.json", "frame_edge/1.png", "gt/1.pfm" };
    static const char bias[] = "{\"kind\": \"disparity_bias\", \"width_px\": 640, "
                               "\"height_px\": 480, \"coefficients_px\": [0, 0, 0, 0, 0, 0]}";
    char path[4200];

    for (int i = 0; i < 3; i++) {
        snprintf(path, sizeof path, "%s", in_data(kept[i]));
        program_run("align fit --data %s --max-disparity 32 --out %s", data, path);
        program_expect_failure(1, kept[i], "not an earlier result", n_entries);
        program_run("bias fit --data %s --max-disparity 32 --pairs 1-3 --out %s", data, path);
        program_expect_failure(1, kept[i], "not an earlier result", n_entries);
    }
    TEST_ASSERT_EQUAL_INT(0, program_run(MATCH " --max-disparity 64", data, data, out)->status);
    n_entries = shef_test_temp_count();

    snprintf(path, sizeof path, "%s", in_data("bias.json"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bias, sizeof bias - 1, NULL));
    program_run("align fit --data %s --max-disparity 32 --out %s", data, path);
    program_expect_failure(1, "bias.json", "not an earlier result", n_entries);
    TEST_ASSERT_EQUAL_INT(
        0, program_run("bias fit --data %s --max-disparity 32 --pairs 1-3 --out %s", data, path)
               ->status);
    program_run("align fit --data %s --max-disparity 32 --out %s", data, data);
    program_expect_failure(1, "is a folder", "--out", n_entries);
}

static void test_table_needs_truth(void)
{
    char gt[4200];
    char hidden[4200];

    snprintf(gt, sizeof gt, "%s", in_data("gt"));
    snprintf(hidden, sizeof hidden, "%s", in_data("hidden"));
    TEST_ASSERT_EQUAL_INT(0, rename(gt, hidden));
    program_run("table --data %s --out %s", data, out);
    program_expect_failure(1, "has no folder gt", "truth", n_entries);
}

static void test_broken_scenes_file_is_named_by_its_short_path(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(in_data("scenes.json"), "{", 1, NULL));
    match();
    program_expect_failure(1, in_data("scenes.json"), "is no JSON", n_entries);
}

static void test_wrong_command_lines_exit_with_2(void)
{
    program_run("mtach");
    program_expect_failure(2, "'mtach' is no command", "--help", n_entries);
    program_run("match");
    program_expect_failure(2, "--frame-edges DIR is missing", "--help", n_entries);
    program_run("bench");
    program_expect_failure(2, "'bench' needs a second word: correlate or frame", "--help",
                           n_entries);
    program_run("help mtach");
    program_expect_failure(2, "'mtach' is no command", "--help", n_entries);
    program_run("bench correlate --window 20");
    program_expect_failure(2, "--window 20", "odd", n_entries);
    program_run("synth --out %s --pairs 0", out);
    program_expect_failure(2, "--pairs 0", "from 1 to 9999", n_entries);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_map_of_another_size_is_named_with_both_sizes);
    RUN_TEST(test_map_that_is_not_binary_is_named_with_pixel_and_value);
    RUN_TEST(test_missing_event_map_is_named);
    RUN_TEST(test_missing_frame_map_is_named);
    RUN_TEST(test_folder_without_maps_and_folder_that_is_not_there);
    RUN_TEST(test_one_folder_for_both_cameras);
    RUN_TEST(test_file_that_is_no_png);
    RUN_TEST(test_search_range_larger_than_the_image);
    RUN_TEST(test_result_folder_that_holds_other_things);
    RUN_TEST(test_truncated_truth);
    RUN_TEST(test_nan_infinity_and_negative_values_are_named_with_their_pixel);
    RUN_TEST(test_confidence_outside_0_to_1);
    RUN_TEST(test_truth_of_another_size_and_truth_that_is_missing);
    RUN_TEST(test_maps_too_narrow_to_score);
    RUN_TEST(test_density_needs_frame_edges);
    RUN_TEST(test_pairs_that_the_data_do_not_have);
    RUN_TEST(test_field_file_of_the_wrong_kind_or_size);
    RUN_TEST(test_paper_modes_cannot_align_themselves);
    RUN_TEST(test_bias_needs_truth);
    RUN_TEST(test_fit_overwrites_nothing_but_its_own_kind);
    RUN_TEST(test_table_needs_truth);
    RUN_TEST(test_broken_scenes_file_is_named_by_its_short_path);
    RUN_TEST(test_wrong_command_lines_exit_with_2);
    return UNITY_END();
}
