/* Frames and poses are played again as they came, beside the events. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "core/pool.h"
#include "record/frame_recorder.h"
#include "record/frame_replay.h"
#include "record/pose_recorder.h"
#include "record/pose_replay.h"
#include "support/support.h"

#define SIDE_PX  16
#define N_FRAMES 12
#define N_POSES  40
#define FRAME_NS INT64_C(18000000)
#define POSE_NS  INT64_C(8000000)
#define BEGIN_NS INT64_C(5000000000)
#define CLOCK_NS INT64_C(777)

static struct shef_manual_clock manual;
static struct shef_frame_replay *frames;
static struct shef_pose_replay *poses;
static struct shef_recorded_pose pose;
static struct shef_frame_packet frame;
static struct shef_error err;
static char folder[4200];

void tearDown(void)
{
    shef_frame_replay_destroy(frames);
    shef_pose_replay_destroy(poses);
    frames = NULL;
    poses = NULL;
}

static void record_frames(struct shef_recording_writer *recording)
{
    const struct shef_frame_part format = { SIDE_PX, SIDE_PX, SHEF_PFNC_MONO8 };
    const struct shef_frame_recorder_config config = shef_frame_recorder_default_config(&format);
    struct shef_frame_recorder *recorder;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_recorder_start(recording, &config, &recorder, &err));
    for (int i = 0; i < N_FRAMES; i++) {
        const struct shef_frame_info info = {
            .number = (uint64_t)i,
            .arrived = { BEGIN_NS + i * FRAME_NS },
            .width_px = SIDE_PX,
            .height_px = SIDE_PX,
            .row_bytes = SIDE_PX,
            .pixel_format = SHEF_PFNC_MONO8,
        };
        uint8_t pixels[SIDE_PX * SIDE_PX];

        memset(pixels, 'a' + i, sizeof pixels);
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_frame_recorder_write(recorder, &info, pixels, i == 4 ? 2 : 0, &err));
    }
    TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_recorder_stop(recorder, &err));
}

/* The first pose comes 3 ms after the first frame. */
static void record_poses(struct shef_recording_writer *recording)
{
    const struct shef_pose_recorder_config config = shef_pose_recorder_default_config();
    struct shef_pose_recorder *recorder;
    struct shef_rtde_recipe recipe;
    uint8_t package[SHEF_RTDE_PACKAGE_MAX_BYTES];

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_rtde_recipe_parse(2, config.recipe, config.types, &recipe, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pose_recorder_start(recording, &config, &recorder, &err));
    for (int i = 0; i < N_POSES; i++) {
        shef_rtde_package_begin(&recipe, 1, package);
        shef_rtde_put_doubles(&recipe.variables[0], &(double){ .008 * i }, package);
        TEST_ASSERT_EQUAL(
            SHEF_OK, shef_pose_recorder_write(
                         recorder, package, recipe.package_bytes,
                         (shef_host_time){ BEGIN_NS + 3 * SHEF_NS_PER_MS + i * POSE_NS }, 0, &err));
    }
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pose_recorder_stop(recorder, &err));
}

static void make_recording(void)
{
    static struct shef_recording_writer recording;
    static int n_made;
    const struct shef_recording_writer_config config = { .software = "test" };
    char name[32];

    snprintf(name, sizeof name, "replayed_parts%d", n_made++);
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_create(&recording, folder, &config, &err));
    record_frames(&recording);
    record_poses(&recording);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, false, NULL, NULL, &err));
}

static void create(enum shef_replay_pace pace, bool with_zero)
{
    const struct shef_replay_config config = {
        .pace = pace,
        .clock = &manual.clock,
        .n_buffers = 3,
        .zero = { with_zero, { BEGIN_NS }, { CLOCK_NS } },
    };

    shef_manual_clock_init(&manual, (shef_host_time){ CLOCK_NS });
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_frame_replay_create(folder, &config, &frames, &err),
                              err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_pose_replay_create(folder, &config, &poses, &err),
                              err.text);
}

static void test_fast_replay_gives_every_frame_and_what_was_lost(void)
{
    make_recording();
    create(SHEF_REPLAY_FAST, false);
    for (int i = 0; i < N_FRAMES; i++) {
        TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_replay_take(frames, &frame, &err));
        TEST_ASSERT_EQUAL_UINT64((uint64_t)i, frame.number);
        TEST_ASSERT_EQUAL_UINT64((uint64_t)i, frame.info.number);
        TEST_ASSERT_EQUAL_UINT32(i == 4 ? 2 : 0, frame.n_lost_before);
        TEST_ASSERT_EQUAL_UINT32(SIDE_PX * SIDE_PX, frame.buffer->used_bytes);
        TEST_ASSERT_EACH_EQUAL_UINT8('a' + i, frame.buffer->data, SIDE_PX * SIDE_PX);
        shef_buffer_give(frame.buffer);
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_frame_replay_take(frames, &frame, &err));
    for (int i = 0; i < N_POSES; i++) {
        TEST_ASSERT_EQUAL(SHEF_OK, shef_pose_replay_take(poses, &pose, &err));
        TEST_ASSERT_EQUAL_INT64(i * POSE_NS, pose.time.ns);
        TEST_ASSERT_EQUAL(i > 0, pose.follows);
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_pose_replay_take(poses, &pose, &err));
}

static void test_a_damaged_frame_is_one_that_was_lost(void)
{
    char path[4300];
    uint8_t *bytes;
    size_t n_bytes;
    int n = 0;

    make_recording();
    snprintf(path, sizeof path, "%s/frames/000000.blk", folder);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 20, &bytes, &n_bytes, &err));
    bytes[n_bytes - 4 * SIDE_PX * SIDE_PX - 1] ^= 1; /* the fifth from behind: number 7 */
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bytes, n_bytes, &err));
    free(bytes);
    create(SHEF_REPLAY_FAST, false);
    for (; shef_frame_replay_take(frames, &frame, &err) == SHEF_OK; n++) {
        TEST_ASSERT_EQUAL_UINT32(frame.info.number == 8   ? 1
                                 : frame.info.number == 4 ? 2
                                                          : 0,
                                 frame.n_lost_before);
        shef_buffer_give(frame.buffer);
    }
    TEST_ASSERT_EQUAL_INT(N_FRAMES - 1, n);
}

static void test_an_empty_pool_loses_nothing(void)
{
    struct shef_frame_packet held[3];

    make_recording();
    create(SHEF_REPLAY_FAST, false);
    for (int i = 0; i < 3; i++)
        TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_replay_take(frames, &held[i], &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_FULL, shef_frame_replay_take(frames, &frame, &err));
    shef_buffer_give(held[0].buffer);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_replay_take(frames, &frame, &err));
    TEST_ASSERT_EQUAL_UINT64(3, frame.info.number);
    TEST_ASSERT_EQUAL_UINT32(0, frame.n_lost_before);
    shef_buffer_give(frame.buffer);
    shef_buffer_give(held[1].buffer);
    shef_buffer_give(held[2].buffer);
}

static void test_replays_with_the_same_zero_keep_their_distance(void)
{
    int n_frames = 0;
    int n_poses = 0;

    make_recording();
    create(SHEF_REPLAY_RECORDED, true);
    for (int64_t now_ns = 0; now_ns < 200 * SHEF_NS_PER_MS; now_ns += SHEF_NS_PER_MS) {
        while (shef_frame_replay_take(frames, &frame, &err) == SHEF_OK) {
            TEST_ASSERT_EQUAL_INT64(n_frames++ * FRAME_NS, now_ns);
            TEST_ASSERT_EQUAL_INT64(0, shef_frame_replay_late_ns(frames));
            shef_buffer_give(frame.buffer);
        }
        while (shef_pose_replay_take(poses, &pose, &err) == SHEF_OK)
            TEST_ASSERT_EQUAL_INT64(3 * SHEF_NS_PER_MS + n_poses++ * POSE_NS, now_ns);
        if (n_frames < N_FRAMES)
            TEST_ASSERT_EQUAL_INT64(CLOCK_NS + n_frames * FRAME_NS,
                                    shef_frame_replay_due(frames).ns);
        TEST_ASSERT_EQUAL_INT64(CLOCK_NS + 3 * SHEF_NS_PER_MS + n_poses * POSE_NS,
                                shef_pose_replay_due(poses).ns);
        shef_manual_clock_advance(&manual, SHEF_NS_PER_MS);
    }
    TEST_ASSERT_EQUAL_INT(12, n_frames);
    TEST_ASSERT_EQUAL_INT(25, n_poses);
}

static void test_without_a_zero_each_replay_begins_at_once(void)
{
    make_recording();
    create(SHEF_REPLAY_RECORDED, false);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_replay_take(frames, &frame, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pose_replay_take(poses, &pose, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_pose_replay_take(poses, &pose, &err));
    TEST_ASSERT_EQUAL_INT64(CLOCK_NS + POSE_NS, shef_pose_replay_due(poses).ns);
    shef_buffer_give(frame.buffer);
}

static void test_stepped_replay_waits_to_be_allowed(void)
{
    make_recording();
    create(SHEF_REPLAY_STEPPED, false);
    TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_frame_replay_take(frames, &frame, &err));
    shef_frame_replay_step(frames, 2);
    for (int i = 0; i < 2; i++) {
        TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_replay_take(frames, &frame, &err));
        shef_buffer_give(frame.buffer);
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_frame_replay_take(frames, &frame, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_pose_replay_take(poses, &pose, &err));
    shef_pose_replay_step(poses, 1);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pose_replay_take(poses, &pose, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_TIMEOUT, shef_pose_replay_take(poses, &pose, &err));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_fast_replay_gives_every_frame_and_what_was_lost);
    RUN_TEST(test_a_damaged_frame_is_one_that_was_lost);
    RUN_TEST(test_an_empty_pool_loses_nothing);
    RUN_TEST(test_replays_with_the_same_zero_keep_their_distance);
    RUN_TEST(test_without_a_zero_each_replay_begins_at_once);
    RUN_TEST(test_stepped_replay_waits_to_be_allowed);
    return UNITY_END();
}
