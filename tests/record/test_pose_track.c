/* Poses follow the robot's clock, also when its controller is started again on the way. */
#include "record/pose_track.h"

#include <stdio.h>

#include "record/pose_recorder.h"
#include "support/support.h"

#define CYCLE_NS INT64_C(8000000)
#define N_POSES  40 /* before and after the restart each */

static struct shef_recording_writer recording;
static struct shef_pose_recorder *recorder;
static struct shef_rtde_recipe recipe;
static struct shef_pose_track track;
static struct shef_error err;
static char folder[4200];

void tearDown(void)
{
    shef_pose_track_free(&track);
}

static void start(const char *name)
{
    struct shef_pose_recorder_config config = shef_pose_recorder_default_config();

    config.limits.sync_ns = 0;
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_rtde_recipe_parse(config.protocol_version, config.recipe,
                                                      config.types, &recipe, &err));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_recording_writer_create(
                          &recording, folder,
                          &(struct shef_recording_writer_config){ .software = "test" }, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pose_recorder_start(&recording, &config, &recorder, &err));
}

/* A pose of which x tells the cycle. It comes up to 1 ms late, every fifth at once. */
static void say(double robot_s, int cycle)
{
    const double tool[6] = { .001 * cycle, 0, 0, 0, 0, 0 };
    const double speed[6] = { .1, 0, 0, 0, 0, 0 };
    const int64_t late_ns = cycle % 5 * INT64_C(250000);
    uint8_t package[SHEF_RTDE_PACKAGE_MAX_BYTES];

    shef_rtde_package_begin(&recipe, 1, package);
    shef_rtde_put_doubles(&recipe.variables[0], &robot_s, package);
    shef_rtde_put_doubles(&recipe.variables[1], tool, package);
    shef_rtde_put_doubles(&recipe.variables[2], speed, package);
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_pose_recorder_write(recorder, package, recipe.package_bytes,
                                          (shef_host_time){ cycle * CYCLE_NS + late_ns }, 0, &err));
}

static void stop(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pose_recorder_stop(recorder, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, true, NULL, NULL, &err));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_pose_track_read(folder, 0, &track, &err), err.text);
}

static void expect_pose(int cycle)
{
    struct shef_tracked_pose pose;

    TEST_ASSERT_TRUE(
        shef_pose_track_at(&track, (shef_host_time){ cycle * CYCLE_NS + 1000 }, &pose));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, .001 * cycle, pose.t_world_hand.t_m[0]);
}

static void test_jitter_of_arrival_is_taken_out(void)
{
    start("jitter");
    for (int i = 0; i < N_POSES; i++)
        say(500 + .008 * i, i);
    stop();
    TEST_ASSERT_EQUAL_size_t(N_POSES, track.n);
    for (int i = 0; i < N_POSES - 1; i++) {
        TEST_ASSERT_INT64_WITHIN(10, i * CYCLE_NS, track.poses[i].at.ns);
        expect_pose(i);
    }
}

static void test_a_controller_that_is_started_again_goes_on_telling_poses(void)
{
    const int again = N_POSES + 1000; /* 8 s later, its clock at 20 s */

    start("restart");
    for (int i = 0; i < N_POSES; i++)
        say(500 + .008 * i, i);
    for (int i = 0; i < N_POSES; i++)
        say(20 + .008 * i, again + i);
    stop();
    TEST_ASSERT_EQUAL_size_t(2 * N_POSES, track.n);
    expect_pose(0);
    expect_pose(N_POSES - 2);
    expect_pose(again);
    expect_pose(again + N_POSES - 2);
    TEST_ASSERT_FALSE(shef_pose_track_at(&track, (shef_host_time){ (N_POSES + 500) * CYCLE_NS },
                                         &(struct shef_tracked_pose){ 0 }));
}

static void test_what_is_said_twice_counts_once(void)
{
    start("twice");
    for (int i = 0; i < N_POSES; i++)
        say(500 + .008 * (i / 2), i / 2);
    stop();
    TEST_ASSERT_EQUAL_size_t(N_POSES / 2, track.n);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_jitter_of_arrival_is_taken_out);
    RUN_TEST(test_a_controller_that_is_started_again_goes_on_telling_poses);
    RUN_TEST(test_what_is_said_twice_counts_once);
    return UNITY_END();
}
