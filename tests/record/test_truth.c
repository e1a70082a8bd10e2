/* What the simulator wrote as truth comes back; what is not whole is not taken for truth. */
#include "record/recorded_truth.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "core/memory.h"
#include "record/truth_writer.h"
#include "record/verify.h"
#include "support/support.h"

static struct shef_recording_writer recording;
static struct shef_truth_writer *writer;
static struct shef_recorded_truth truth;
static struct shef_image_f32 depth_m;
static struct shef_image_f32 disparity;
static struct shef_image_u8 mask;
static struct shef_error err;
static char folder[4200];

void setUp(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&depth_m, 640, 480, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&disparity, 640, 480, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&mask, 640, 480, NULL));
}

void tearDown(void)
{
    shef_image_destroy_f32(&depth_m);
    shef_image_destroy_f32(&disparity);
    shef_image_destroy_u8(&mask);
    shef_recorded_truth_close(&truth);
}

static void paint(int i)
{
    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 0; x < 640; x++) {
            const bool is_valid = (x + y + i) % 7 != 0;

            shef_row_f32(depth_m, y)[x] = is_valid ? 1.5f + (float)(x + i) / 300.0f : 0.0f;
            shef_row_f32(disparity, y)[x] =
                is_valid ? 555 * .06544f / shef_row_f32(depth_m, y)[x] : 0.0f;
            shef_row_u8(mask, y)[x] =
                is_valid ? (x < 30 ? SHEF_TRUTH_VALID | SHEF_TRUTH_OCCLUDED : SHEF_TRUTH_VALID) : 0;
        }
}

static struct shef_truth_pose pose_of(int i)
{
    return (struct shef_truth_pose){
        .time = { INT64_C(-3000000001) + i * INT64_C(8000000) },
        .t_world_hand = shef_rigid_from_rotation_vector((double[3]){ 3, .1 * i, .2 },
                                                        (double[3]){ .1 * i, 1. / 3, -.5 }),
    };
}

static struct shef_truth_frame frame_of(int i)
{
    return (struct shef_truth_frame){
        .number = 70 + (uint64_t)i,
        .rise = { 1000 + i * INT64_C(18518519) },
        .middle = { 2001000 + i * INT64_C(18518519) },
        .exposure_ns = 4000001,
        .t_world_hand = pose_of(i).t_world_hand,
    };
}

static void start(void)
{
    static int n_made;
    const struct shef_calibration calibration = shef_calibration_paper_rig();
    char name[32];

    snprintf(name, sizeof name, "truth%d", n_made++);
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_recording_writer_create(
                          &recording, folder,
                          &(struct shef_recording_writer_config){ .software = "test" }, &err));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK,
                              shef_truth_writer_start(&recording, &calibration, "wide",
                                                      "boxes at\n0.35 m/s", &writer, &err),
                              err.text);
}

static void write_maps(enum shef_truth_view view, int i)
{
    paint(i);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_truth_writer_maps(writer, view, 70 + (uint64_t)i, depth_m, disparity, mask, &err),
        err.text);
}

static void write_tables(void)
{
    for (int i = 0; i < 50; i++) {
        const struct shef_truth_pose pose = pose_of(i);

        TEST_ASSERT_EQUAL(SHEF_OK, shef_truth_writer_pose(writer, &pose, &err));
    }
    for (int i = 0; i < 3; i++) {
        const struct shef_truth_frame frame = frame_of(i);

        TEST_ASSERT_EQUAL(SHEF_OK, shef_truth_writer_frame(writer, &frame, &err));
    }
    TEST_ASSERT_EQUAL(
        SHEF_OK,
        shef_truth_writer_clock(
            writer, &(struct shef_truth_clock){ "robot", 1700000000123456789, -12.5 }, &err));
}

static void stop(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_truth_writer_stop(writer, &err), err.text);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, true, NULL, NULL, &err));
}

static void open_truth(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_recorded_truth_open(folder, &truth, &err), err.text);
}

static void replace(const char *name, const char *text)
{
    char path[4300];

    snprintf(path, sizeof path, "%s/truth/%s", folder, name);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, text, strlen(text), NULL));
}

static void test_tables_come_back(void)
{
    start();
    write_tables();
    stop();
    open_truth();
    TEST_ASSERT_EQUAL_STRING("wide", truth.profile);
    TEST_ASSERT_EQUAL_STRING("boxes at 0.35 m/s", truth.source);
    TEST_ASSERT_EQUAL_DOUBLE(.06544, truth.baseline_m);
    TEST_ASSERT_EQUAL_STRING(shef_calibration_paper_rig().id, truth.calibration.id);
    TEST_ASSERT_EQUAL_UINT32(50, truth.n_poses);
    for (int i = 0; i < 50; i++) {
        const struct shef_truth_pose pose = pose_of(i);

        TEST_ASSERT_EQUAL_INT64(pose.time.ns, truth.poses[i].time.ns);
        for (int k = 0; k < 9; k++)
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, pose.t_world_hand.r[k],
                                      truth.poses[i].t_world_hand.r[k]);
        TEST_ASSERT_EQUAL_MEMORY(pose.t_world_hand.t_m, truth.poses[i].t_world_hand.t_m,
                                 sizeof pose.t_world_hand.t_m);
    }
    TEST_ASSERT_EQUAL_UINT32(3, truth.n_frames);
    TEST_ASSERT_EQUAL_INT64(frame_of(2).rise.ns, truth.frames[2].rise.ns);
    TEST_ASSERT_EQUAL_INT64(frame_of(2).middle.ns,
                            shef_recorded_truth_frame(&truth, 72)->middle.ns);
    TEST_ASSERT_EQUAL_INT64(4000001, truth.frames[0].exposure_ns);
    TEST_ASSERT_NULL(shef_recorded_truth_frame(&truth, 73));
    TEST_ASSERT_EQUAL_INT64(1700000000123456789,
                            shef_recorded_truth_clock(&truth, "robot")->offset_ns);
    TEST_ASSERT_EQUAL_DOUBLE(-12.5, truth.clocks[0].drift_ppm);
    TEST_ASSERT_NULL(shef_recorded_truth_clock(&truth, "host"));
}

static void test_maps_come_back(void)
{
    struct shef_truth_maps maps;

    start();
    write_maps(SHEF_TRUTH_LEFT, 0);
    write_maps(SHEF_TRUTH_LEFT, 1);
    write_maps(SHEF_TRUTH_RIGHT, 2);
    stop();
    open_truth();
    for (int i = 0; i < 3; i++) {
        const enum shef_truth_view view = i < 2 ? SHEF_TRUTH_LEFT : SHEF_TRUTH_RIGHT;

        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_recorded_truth_maps(&truth, view, 70 + (uint64_t)i, &maps, &err));
        paint(i);
        for (int32_t y = 0; y < 480; y++) {
            TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(disparity, y), shef_row_f32(maps.disparity, y),
                                     640 * sizeof(float));
            TEST_ASSERT_EQUAL_MEMORY(shef_row_u8(mask, y), shef_row_u8(maps.mask, y), 640);
            for (int32_t x = 0; x < 640; x++)
                TEST_ASSERT_FLOAT_WITHIN(.00051f, shef_row_f32(depth_m, y)[x],
                                         shef_row_f32(maps.depth_m, y)[x]);
        }
        shef_truth_maps_free(&maps);
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND,
                      shef_recorded_truth_maps(&truth, SHEF_TRUTH_RIGHT, 70, &maps, &err));
}

static void test_depth_that_millimetres_cannot_hold_is_none(void)
{
    struct shef_truth_maps maps;

    start();
    paint(0);
    shef_row_f32(depth_m, 0)[1] = 65.5351f;
    shef_row_f32(depth_m, 0)[2] = 66;
    shef_row_f32(depth_m, 0)[3] = NAN;
    shef_row_f32(depth_m, 0)[4] = -1;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_truth_writer_maps(writer, SHEF_TRUTH_LEFT, 0, depth_m,
                                                      disparity, mask, &err));
    stop();
    open_truth();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_truth_maps(&truth, SHEF_TRUTH_LEFT, 0, &maps, &err));
    TEST_ASSERT_EQUAL_FLOAT(65.535f, shef_row_f32(maps.depth_m, 0)[1]);
    for (int x = 2; x < 5; x++)
        TEST_ASSERT_EQUAL_FLOAT(0, shef_row_f32(maps.depth_m, 0)[x]);
    shef_truth_maps_free(&maps);
}

static void test_maps_of_another_size_are_refused(void)
{
    struct shef_image_u8 small = mask;

    start();
    small.width_px = 639;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_truth_writer_maps(writer, SHEF_TRUTH_LEFT, 0, depth_m,
                                                               disparity, small, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "640 x 480"));
    stop();
}

static void test_truth_that_was_not_finished_is_none(void)
{
    struct shef_manifest manifest;
    char path[4300];

    start();
    write_tables();
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_recorded_truth_open(folder, &truth, &err));
    /* The disk refuses: here because there is a file where a folder should be. */
    snprintf(path, sizeof path, "%s/truth/depth", folder);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, "", 0, NULL));
    paint(0);
    TEST_ASSERT_NOT_EQUAL(SHEF_OK, shef_truth_writer_maps(writer, SHEF_TRUTH_LEFT, 0, depth_m,
                                                          disparity, mask, &err));
    stop();
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_recorded_truth_open(folder, &truth, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "not written to its end"), err.text);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
    TEST_ASSERT_EQUAL(SHEF_VERDICT_STOPPED, manifest.verdict);
    shef_manifest_free(&manifest);
}

static void test_damaged_tables_are_named_with_their_line(void)
{
    start();
    write_tables();
    stop();
    replace("poses.csv", "event_us,...\n1,0,0,0,1,0,0,0\n2,0,0,0,1,0,0\n");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_recorded_truth_open(folder, &truth, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "poses.csv', line 3 is damaged"), err.text);
    replace("poses.csv", "event_us,...\n1,0,0,0,2,0,0,0\n");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_recorded_truth_open(folder, &truth, &err));
    replace("poses.csv", "event_us,...\n1,0,nan,0,1,0,0,0\n");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_recorded_truth_open(folder, &truth, &err));
    replace("poses.csv", "event_us,...\n");
    replace("frames.csv", "number,...\nx,1,2,3,0,0,0,1,0,0,0\n");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_recorded_truth_open(folder, &truth, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "frames.csv', line 2"), err.text);
    replace("README", "shef-truth 2\n");
    TEST_ASSERT_EQUAL(SHEF_ERR_UNSUPPORTED, shef_recorded_truth_open(folder, &truth, &err));
    replace("README", "hello\n");
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_recorded_truth_open(folder, &truth, &err));
}

static void test_the_same_truth_is_the_same_bytes(void)
{
    char first[4200];
    static const char *const names[] = {
        "poses.csv",        "frames.csv",      "disparity/000070.pfm",
        "depth/000070.png", "mask/000070.png", "README"
    };

    start();
    write_tables();
    write_maps(SHEF_TRUTH_LEFT, 0);
    stop();
    memcpy(first, folder, sizeof first);
    start();
    write_tables();
    write_maps(SHEF_TRUTH_LEFT, 0);
    stop();
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        char paths[2][4300];
        char sums[2][SHEF_SHA256_TEXT_BYTES];

        snprintf(paths[0], sizeof paths[0], "%s/truth/%s", first, names[i]);
        snprintf(paths[1], sizeof paths[1], "%s/truth/%s", folder, names[i]);
        for (int k = 0; k < 2; k++)
            TEST_ASSERT_EQUAL(SHEF_OK, shef_sha256_file(paths[k], NULL, NULL, sums[k], &err));
        TEST_ASSERT_EQUAL_STRING(sums[0], sums[1]);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_tables_come_back);
    RUN_TEST(test_maps_come_back);
    RUN_TEST(test_depth_that_millimetres_cannot_hold_is_none);
    RUN_TEST(test_maps_of_another_size_are_refused);
    RUN_TEST(test_truth_that_was_not_finished_is_none);
    RUN_TEST(test_damaged_tables_are_named_with_their_line);
    RUN_TEST(test_the_same_truth_is_the_same_bytes);
    return UNITY_END();
}
