/* sheftool run, eval --run and study on a recording that shefsim renders, whole and damaged. */
#include <jansson.h>
#include <limits.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "support/process.h"
#include "support/support.h"

#define N_FRAMES 20 /* 0.37 s at 54 Hz; the last has no events behind it */

static char recording[PATH_MAX];
static struct shef_test_process process;

static void shell(const char *fmt, ...) __attribute__((format(printf, 1, 2)));

static void shell(const char *fmt, ...)
{
    char command[4 * PATH_MAX];
    va_list args;

    va_start(args, fmt);
    vsnprintf(command, sizeof command, fmt, args);
    va_end(args);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, system(command), command);
}

/* A copy of the recording that a test may spoil. */
static const char *copy_recording(const char *name)
{
    static char path[PATH_MAX];

    snprintf(path, sizeof path, "%s", shef_test_temp_path(name));
    shell("rm -rf %s && cp -r %s %s", path, recording, path);
    return path;
}

static void succeed(const char *line)
{
    shef_test_process_run(&process, "sheftool", &(struct shef_test_process_manner){ 0 }, "%s",
                          line);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, process.status, process.err);
}

/* One sentence with both words, and no result. */
static void fail(int status, const char *word, const char *other_word, const char *line)
{
    const int n_entries = shef_test_temp_count();

    shef_test_process_run(&process, "sheftool", &(struct shef_test_process_manner){ 0 }, "%s",
                          line);
    TEST_ASSERT_EQUAL_INT_MESSAGE(status, process.status, process.err);
    TEST_ASSERT_TRUE_MESSAGE(shef_test_process_said_one_sentence(&process), process.err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(process.err, word), process.err);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(process.err, other_word), process.err);
    TEST_ASSERT_EQUAL_INT(n_entries, shef_test_temp_count());
}

static const char *line(const char *fmt, ...) __attribute__((format(printf, 1, 2)));

static const char *line(const char *fmt, ...)
{
    static char text[4 * PATH_MAX];
    va_list args;

    va_start(args, fmt);
    vsnprintf(text, sizeof text, fmt, args);
    va_end(args);
    return text;
}

static double number_at(const json_t *root, const char *part, const char *key)
{
    const json_t *value = json_object_get(json_object_get(root, part), key);

    TEST_ASSERT_TRUE_MESSAGE(json_is_number(value), key);
    return json_number_value(value);
}

static void test_a_run_is_as_good_as_eval_says(void)
{
    const char *out = shef_test_temp_path("out");
    json_t *root;
    json_t *run;
    json_error_t reason;

    succeed(line("run %s --out %s --every 5 --pictures --cloud --robot", recording, out));
    TEST_ASSERT_EQUAL_INT(0, access(line("%s/disparity/0.pfm", out), R_OK));
    TEST_ASSERT_EQUAL_INT(0, access(line("%s/disparity/15.conf.pfm", out), R_OK));
    TEST_ASSERT_EQUAL_INT(0, access(line("%s/depth/10.png", out), R_OK));
    TEST_ASSERT_EQUAL_INT(0, access(line("%s/sigma/10.png", out), R_OK));
    TEST_ASSERT_EQUAL_INT(0, access(line("%s/pictures/5.png", out), R_OK));
    TEST_ASSERT_EQUAL_INT(0, access(line("%s/cloud/5.ply", out), R_OK));
    TEST_ASSERT_NOT_EQUAL(0, access(line("%s/disparity/1.pfm", out), R_OK));

    run = json_load_file(line("%s/run.json", out), 0, &reason);
    TEST_ASSERT_NOT_NULL_MESSAGE(run, reason.text);
    TEST_ASSERT_EQUAL_STRING("run", json_string_value(json_object_get(run, "kind")));
    TEST_ASSERT_GREATER_OR_EQUAL_INT(N_FRAMES - 3, (int)number_at(run, "counts", "processed"));
    TEST_ASSERT_EQUAL_INT(0, (int)number_at(run, "counts", "damaged"));
    TEST_ASSERT_EQUAL_INT(0, (int)number_at(run, "counts", "ambiguous"));
    TEST_ASSERT_EQUAL_INT((int)number_at(run, "counts", "processed"),
                          (int)number_at(run, "counts", "with_velocity"));
    TEST_ASSERT_GREATER_OR_EQUAL_size_t(N_FRAMES - 3,
                                        json_array_size(json_object_get(run, "frames")));
    json_decref(run);

    succeed(line("eval --run %s --json", out));
    root = json_loads(process.out, 0, &reason);
    TEST_ASSERT_NOT_NULL_MESSAGE(root, reason.text);
    /* The first frame has no past: single signed maps. The bounds are those of the sheet for
     * textured scenes, with room. */
    TEST_ASSERT_EQUAL_INT(4, (int)json_integer_value(json_object_get(root, "frames")));
    TEST_ASSERT_TRUE(number_at(root, "all", "bad_1_percent") < 4);
    TEST_ASSERT_TRUE(number_at(root, "all", "depth_error_percent") < 1.5);
    TEST_ASSERT_TRUE(number_at(root, "all", "coverage_percent") > 99);
    TEST_ASSERT_TRUE(number_at(root, "all", "pixels") > 4 * 60000);
    TEST_ASSERT_TRUE(number_at(root, "confident_75", "bad_1_percent") < 1);
    TEST_ASSERT_EQUAL_size_t(4, json_array_size(json_object_get(root, "per_frame")));
    json_decref(root);
}

static void expect_same_file(const char *a, const char *b)
{
    uint8_t *bytes[2];
    size_t n[2];

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(a, 1u << 24, &bytes[0], &n[0], NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(b, 1u << 24, &bytes[1], &n[1], NULL));
    TEST_ASSERT_EQUAL_size_t(n[0], n[1]);
    TEST_ASSERT_EQUAL_MEMORY(bytes[0], bytes[1], n[0]);
    free(bytes[0]);
    free(bytes[1]);
}

static void test_threads_and_instruction_sets_give_the_same_files(void)
{
    char a[PATH_MAX];
    char b[PATH_MAX];

    snprintf(a, sizeof a, "%s", shef_test_temp_path("plain"));
    snprintf(b, sizeof b, "%s", shef_test_temp_path("other"));
    succeed(line("run %s --out %s --frames 5", recording, a));
    succeed(line("run %s --out %s --frames 5 --threads 3 --isa c", recording, b));
    for (int i = 0; i < 5; i++) {
        char path[PATH_MAX + 64];

        snprintf(path, sizeof path, "%s/disparity/%d.pfm", a, i);
        expect_same_file(path, line("%s/disparity/%d.pfm", b, i));
        snprintf(path, sizeof path, "%s/depth/%d.png", a, i);
        expect_same_file(path, line("%s/depth/%d.png", b, i));
    }
}

static void test_study_puts_all_modes_side_by_side(void)
{
    static const char *const modes[] = { "paper-ds", "paper-dp", "unsigned", "ternary",
                                         "graded",   "temporal", "combined" };
    const char *json = shef_test_temp_path("study.json");
    json_error_t reason;
    json_t *root;
    double bad[7];

    succeed(line("study %s --json %s --skip 3", recording, json));
    root = json_load_file(json, 0, &reason);
    TEST_ASSERT_NOT_NULL_MESSAGE(root, reason.text);
    for (int i = 0; i < 7; i++) {
        const json_t *mode = json_object_get(json_object_get(root, "pooled"), modes[i]);

        TEST_ASSERT_NOT_NULL_MESSAGE(mode, modes[i]);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(process.out, modes[i]), modes[i]);
        bad[i] = number_at(mode, "all", "bad_1_percent");
        TEST_ASSERT_TRUE(number_at(mode, "time", "median_ms") > 0);
    }
    json_decref(root);
    TEST_ASSERT_TRUE(bad[6] < bad[2]);
    TEST_ASSERT_TRUE(bad[2] < bad[1]);
    TEST_ASSERT_TRUE(bad[1] < bad[0]);
}

static void test_figures_that_do_not_exist_are_dashes(void)
{
    /* 0.07 s of a circle go one way only. */
    succeed(line("study %s --modes graded --frames 4", recording));
    TEST_ASSERT_NULL_MESSAGE(strstr(process.out, "nan"), process.out);
    TEST_ASSERT_TRUE_MESSAGE(strstr(process.out, " -  ") || strstr(process.out, " -\n"),
                             process.out);
}

static void test_truth_without_maps_scores_nothing_and_says_so(void)
{
    const char *path = copy_recording("no-maps");

    shell("rm %s/truth/disparity/*", path);
    fail(1, "maps", path, line("study %s --modes graded --frames 4", path));
    fail(1, "--skip", recording, line("study %s --modes graded --skip 1000", recording));
}

static void test_without_a_robot_the_motion_is_found(void)
{
    const char *path = copy_recording("no-poses");
    const char *out = shef_test_temp_path("found");

    shell("rm -r %s/poses", path);
    succeed(line("study %s --modes combined --skip 3 --no-robot", recording));
    TEST_ASSERT_EQUAL_STRING("", process.err);
    succeed(line("run %s --out %s --frames 4", path, out));
    TEST_ASSERT_NOT_NULL(strstr(process.err, "no poses were recorded"));
    fail(1, "poses", path, line("run %s --out %s-2 --robot", path, out));
}

static void test_a_damaged_frame_costs_itself(void)
{
    const char *path = copy_recording("damaged");
    const char *out = shef_test_temp_path("rest");
    json_error_t reason;
    json_t *run;

    /* In the middle of the third frame. */
    shell("printf 'damage' | dd of=%s/frames/000000.blk bs=1 seek=8000000 conv=notrunc "
          "2>/dev/null",
          path);
    succeed(line("run %s --out %s --every 7", path, out));
    run = json_load_file(line("%s/run.json", out), 0, &reason);
    TEST_ASSERT_NOT_NULL_MESSAGE(run, reason.text);
    TEST_ASSERT_EQUAL_INT(1, (int)number_at(run, "counts", "damaged"));
    TEST_ASSERT_GREATER_OR_EQUAL_INT(N_FRAMES - 4, (int)number_at(run, "counts", "processed"));
    json_decref(run);
    TEST_ASSERT_NOT_NULL(strstr(process.err, "note: "));
}

static void test_a_recording_cut_short_gives_what_is_there(void)
{
    const char *path = copy_recording("cut");
    const char *out = shef_test_temp_path("half");
    json_error_t reason;
    json_t *run;
    int n;

    shell("truncate -s $(($(stat -c %%s %s/events/000000.raw) / 2)) %s/events/000000.raw", path,
          path);
    succeed(line("run %s --out %s --every 7", path, out));
    run = json_load_file(line("%s/run.json", out), 0, &reason);
    TEST_ASSERT_NOT_NULL_MESSAGE(run, reason.text);
    n = (int)number_at(run, "counts", "processed");
    TEST_ASSERT_TRUE(n > 3 && n < N_FRAMES - 3);
    TEST_ASSERT_TRUE(number_at(run, "counts", "unpaired") >= 3);
    TEST_ASSERT_EQUAL_INT(0, (int)number_at(run, "counts", "ambiguous"));
    json_decref(run);
}

static void test_what_is_missing_gets_a_sentence(void)
{
    const char *out = shef_test_temp_path("nothing");
    const char *path = copy_recording("lacking");

    shell("mv %s/calibration.yaml %s/kept.yaml", path, path);
    fail(1, "calibration.yaml", "--calibration", line("run %s --out %s", path, out));
    shell("sed 's/2048, 1536/1600, 1200/' %s/kept.yaml | grep -v '^id:' > "
          "%s/calibration.yaml",
          path, path);
    fail(1, "2048 x 1536", "1600 x 1200", line("run %s --out %s", path, out));
    shell("mv %s/kept.yaml %s/calibration.yaml && rm -r %s/truth", path, path, path);
    fail(1, "truth", path, line("study %s --modes graded", path));
    shell("rm -r %s/frames", path);
    fail(1, "frame", path, line("run %s --out %s", path, out));
    fail(1, "no recording", "shefsim", line("study %s/events", recording));
    fail(1, "run.json", "sheftool run", line("eval --run %s", path));
}

static void test_contradictions_are_usage_mistakes(void)
{
    const char *out = shef_test_temp_path("nothing");

    fail(2, "--robot", "--no-robot", line("run %s --out %s --robot --no-robot", recording, out));
    fail(2, "--max-disparity", "16", line("run %s --out %s --max-disparity 3", recording, out));
    fail(2, "thick", "paper-ds", line("study %s --modes thick", recording));
    fail(2, "--run", "--gt", line("eval --run %s --gt %s", out, out));
    fail(2, "--recording", "--run", line("eval --recording %s", recording));
    fail(2, "--disparity", "--run", "eval");
}

int main(void)
{
    UNITY_BEGIN();
    snprintf(recording, sizeof recording, "%s", shef_test_temp_path("recording"));
    shef_test_process_run(&process, "shefsim", &(struct shef_test_process_manner){ 0 },
                          "render --scene simple_boxes --speed 0.35 --seconds 0.37 --seed 3 "
                          "--truth-every 5 --out %s",
                          recording);
    if (process.status != 0) {
        printf("shefsim: %s\n", process.err);
        return 1;
    }
    RUN_TEST(test_a_run_is_as_good_as_eval_says);
    RUN_TEST(test_threads_and_instruction_sets_give_the_same_files);
    RUN_TEST(test_study_puts_all_modes_side_by_side);
    RUN_TEST(test_figures_that_do_not_exist_are_dashes);
    RUN_TEST(test_truth_without_maps_scores_nothing_and_says_so);
    RUN_TEST(test_without_a_robot_the_motion_is_found);
    RUN_TEST(test_a_damaged_frame_costs_itself);
    RUN_TEST(test_a_recording_cut_short_gives_what_is_there);
    RUN_TEST(test_what_is_missing_gets_a_sentence);
    RUN_TEST(test_contradictions_are_usage_mistakes);
    return UNITY_END();
}
