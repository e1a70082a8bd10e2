/* A disk that is full: frames and poses end in order, and truth that is not whole is none. */
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "record/frame_recorder.h"
#include "record/pose_recorder.h"
#include "record/recorded_frames.h"
#include "record/recorded_poses.h"
#include "record/recorded_truth.h"
#include "record/truth_writer.h"
#include "support/small_disk.h"
#include "support/support.h"

#define SIDE_PX 128

static struct shef_error err;

#define EXPECT(condition) SHEF_TEST_CHILD_EXPECT(condition, err)

/* Returns how many frames were recorded before the disk was full. */
static uint32_t fill_with_frames(struct shef_recording_writer *recording)
{
    static uint8_t pixels[SIDE_PX * SIDE_PX];
    const struct shef_frame_part format = { SIDE_PX, SIDE_PX, SHEF_PFNC_MONO8 };
    struct shef_frame_recorder_config config = shef_frame_recorder_default_config(&format);
    struct shef_frame_info info = { .width_px = SIDE_PX,
                                    .height_px = SIDE_PX,
                                    .row_bytes = SIDE_PX,
                                    .pixel_format = SHEF_PFNC_MONO8 };
    struct shef_frame_recorder *recorder;
    enum shef_err code = SHEF_OK;

    config.limits.segment_bytes = 20 * sizeof pixels;
    EXPECT(shef_frame_recorder_start(recording, &config, &recorder, &err) == SHEF_OK);
    while (code == SHEF_OK) {
        EXPECT(info.number < 10000);
        code = shef_frame_recorder_write(recorder, &info, pixels, 0, &err);
        info.number++;
    }
    EXPECT(code == SHEF_ERR_NO_SPACE);
    EXPECT(strstr(err.text, "are kept") != NULL);
    EXPECT(shef_frame_recorder_stop(recorder, &err) == SHEF_OK);
    return (uint32_t)info.number - 1;
}

/* The same for poses, of which the last one never fitted. */
static uint64_t fill_with_poses(struct shef_recording_writer *recording)
{
    const struct shef_pose_recorder_config config = shef_pose_recorder_default_config();
    struct shef_pose_recorder *recorder;
    struct shef_rtde_recipe recipe;
    uint8_t package[SHEF_RTDE_PACKAGE_MAX_BYTES];
    enum shef_err code = SHEF_OK;
    uint64_t n = 0;

    EXPECT(shef_rtde_recipe_parse(2, config.recipe, config.types, &recipe, &err) == SHEF_OK);
    EXPECT(shef_pose_recorder_start(recording, &config, &recorder, &err) == SHEF_OK);
    for (; code == SHEF_OK; n++) {
        EXPECT(n < 100000);
        shef_rtde_package_begin(&recipe, 1, package);
        shef_rtde_put_doubles(&recipe.variables[0], &(double){ .008 * (double)n }, package);
        code = shef_pose_recorder_write(recorder, package, recipe.package_bytes,
                                        (shef_host_time){ 0 }, 0, &err);
    }
    EXPECT(code == SHEF_ERR_NO_SPACE);
    EXPECT(shef_pose_recorder_stop(recorder, &err) == SHEF_OK);
    return n - 1;
}

static void create(struct shef_recording_writer *recording, const char *folder)
{
    EXPECT(shef_recording_writer_create(
               recording, folder, &(struct shef_recording_writer_config){ .software = "test" },
               &err) == SHEF_OK);
}

static void close_and_expect_stopped(struct shef_recording_writer *recording, const char *folder)
{
    struct shef_manifest manifest;

    EXPECT(shef_recording_writer_close(recording, true, NULL, NULL, &err) == SHEF_OK);
    EXPECT(shef_manifest_read(folder, &manifest, &err) == SHEF_OK);
    EXPECT(manifest.is_closed);
    EXPECT(manifest.verdict == SHEF_VERDICT_STOPPED);
    EXPECT(strstr(manifest.reason, "No space left on device") != NULL);
    shef_manifest_free(&manifest);
}

static void record_frames(const char *folder)
{
    static struct shef_recording_writer recording;
    struct shef_recorded_frames *frames;
    struct shef_recorded_frame frame;
    uint32_t n_recorded;
    uint32_t n_read = 0;

    create(&recording, folder);
    n_recorded = fill_with_frames(&recording);
    close_and_expect_stopped(&recording, folder);
    EXPECT(n_recorded > 20);
    EXPECT(shef_recorded_frames_open(folder, &frames, &err) == SHEF_OK);
    while (shef_recorded_frames_next(frames, &frame, &err) == SHEF_OK)
        n_read++;
    EXPECT(n_read == n_recorded);
    EXPECT(shef_recorded_frames_note(frames, 0) == NULL);
}

static void record_poses(const char *folder)
{
    static struct shef_recording_writer recording;
    struct shef_recorded_poses *poses;
    struct shef_recorded_pose pose;
    uint64_t n_recorded;
    uint64_t n_read = 0;

    create(&recording, folder);
    n_recorded = fill_with_poses(&recording);
    close_and_expect_stopped(&recording, folder);
    EXPECT(n_recorded > 1000);
    EXPECT(shef_recorded_poses_open(folder, &poses, &err) == SHEF_OK);
    while (shef_recorded_poses_next(poses, &pose, &err) == SHEF_OK)
        n_read++;
    EXPECT(n_read == n_recorded);
    EXPECT(shef_recorded_poses_note(poses, 0) == NULL);
}

static void write_truth(const char *folder)
{
    static struct shef_recording_writer recording;
    const struct shef_calibration calibration = shef_calibration_paper_rig();
    struct shef_recorded_truth truth;
    struct shef_truth_writer *writer;
    struct shef_image_f32 map;
    struct shef_image_u8 mask;
    enum shef_err code = SHEF_OK;

    create(&recording, folder);
    EXPECT(shef_truth_writer_start(&recording, &calibration, "wide", "test", &writer, &err) ==
           SHEF_OK);
    EXPECT(shef_image_create_f32(&map, 640, 480, &err) == SHEF_OK);
    EXPECT(shef_image_create_u8(&mask, 640, 480, &err) == SHEF_OK);
    for (uint64_t i = 0; code == SHEF_OK; i++) {
        EXPECT(i < 100);
        code = shef_truth_writer_maps(writer, SHEF_TRUTH_LEFT, i, map, map, mask, &err);
    }
    EXPECT(code == SHEF_ERR_NO_SPACE);
    EXPECT(shef_truth_writer_stop(writer, &err) == SHEF_OK);
    close_and_expect_stopped(&recording, folder);
    EXPECT(shef_recorded_truth_open(folder, &truth, &err) == SHEF_ERR_NOT_FOUND);
    EXPECT(strstr(err.text, "not written to its end") != NULL);
}

/* Tables are buffered: what does not fit may show only when they are closed. */
static void write_truth_tables(const char *folder)
{
    static struct shef_recording_writer recording;
    const struct shef_calibration calibration = shef_calibration_paper_rig();
    const struct shef_truth_pose pose = { .t_world_hand = shef_rigid_identity() };
    struct shef_recorded_truth truth;
    struct shef_truth_writer *writer;
    enum shef_err code = SHEF_OK;

    create(&recording, folder);
    EXPECT(shef_truth_writer_start(&recording, &calibration, "wide", "test", &writer, &err) ==
           SHEF_OK);
    for (int i = 0; code == SHEF_OK && i < 200000; i++)
        code = shef_truth_writer_pose(writer, &pose, &err);
    EXPECT(code == SHEF_ERR_NO_SPACE);
    EXPECT(shef_truth_writer_stop(writer, &err) == SHEF_OK);
    close_and_expect_stopped(&recording, folder);
    EXPECT(shef_recorded_truth_open(folder, &truth, &err) == SHEF_ERR_NOT_FOUND);
}

static void test_frames_end_in_order(void)
{
    shef_test_on_small_disk("frames", "2m", record_frames);
}

static void test_poses_end_in_order(void)
{
    shef_test_on_small_disk("poses", "2m", record_poses);
}

static void test_maps_that_do_not_fit_leave_no_truth(void)
{
    shef_test_on_small_disk("maps", "2m", write_truth);
}

static void test_tables_that_do_not_fit_leave_no_truth(void)
{
    shef_test_on_small_disk("tables", "2m", write_truth_tables);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_frames_end_in_order);
    RUN_TEST(test_poses_end_in_order);
    RUN_TEST(test_maps_that_do_not_fit_leave_no_truth);
    RUN_TEST(test_tables_that_do_not_fit_leave_no_truth);
    return UNITY_END();
}
