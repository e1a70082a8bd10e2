/* The robot's packages come back as they were, with their poses, or are known to be missing. */
#include "record/recorded_poses.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "record/pose_recorder.h"
#include "record/verify.h"
#include "support/support.h"

#define N_POSES 60

static struct shef_recording_writer recording;
static struct shef_pose_recorder *recorder;
static struct shef_recorded_poses *poses;
static struct shef_recorded_pose pose;
static struct shef_rtde_recipe recipe;
static struct shef_manifest manifest;
static struct shef_error err;
static char folder[4200];

void tearDown(void)
{
    shef_recorded_poses_close(poses);
    poses = NULL;
    shef_manifest_free(&manifest);
}

static double time_of(int i)
{
    return 12345.008 + .008 * i;
}

/* Package i, 8 ms after the one before. */
static const uint8_t *package_of(int i)
{
    static uint8_t package[SHEF_RTDE_PACKAGE_MAX_BYTES];
    const double tool[6] = { .3 + .001 * i, -.2, .5, 2.2, -.01 * i, .1 };
    const double speed[6] = { .125, 0, -.5, .01, .02, .03 };

    shef_rtde_package_begin(&recipe, 1, package);
    shef_rtde_put_doubles(&recipe.variables[0], &(double){ time_of(i) }, package);
    shef_rtde_put_doubles(&recipe.variables[1], tool, package);
    shef_rtde_put_doubles(&recipe.variables[2], speed, package);
    return package;
}

static void start_with(const struct shef_pose_recorder_config *config)
{
    static int n_made;
    char name[32];

    snprintf(name, sizeof name, "poses%d", n_made++);
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_rtde_recipe_parse(config->protocol_version, config->recipe,
                                                      config->types, &recipe, &err));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_recording_writer_create(
                          &recording, folder,
                          &(struct shef_recording_writer_config){ .software = "test" }, &err));
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_pose_recorder_start(&recording, config, &recorder, &err), err.text);
}

static void start(void)
{
    struct shef_pose_recorder_config config = shef_pose_recorder_default_config();

    config.limits.segment_bytes = 25 * 108;
    config.limits.sync_ns = 0;
    start_with(&config);
}

static void write_bytes(const uint8_t *package, int i, uint32_t n_lost_before)
{
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_pose_recorder_write(recorder, package, recipe.package_bytes,
                                 (shef_host_time){ 1000 + i * INT64_C(8000000) }, n_lost_before,
                                 &err),
        err.text);
}

static void stop(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_pose_recorder_stop(recorder, &err), err.text);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, true, NULL, NULL, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
}

static void make_recording(void)
{
    start();
    for (int i = 0; i < N_POSES; i++)
        write_bytes(package_of(i), i, 0);
    stop();
}

static void open_poses(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_recorded_poses_open(folder, &poses, &err), err.text);
}

static void expect_next(int i, bool follows)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_recorded_poses_next(poses, &pose, &err), err.text);
    TEST_ASSERT_EQUAL_INT64(llround(time_of(i) * 1e9), pose.time.ns);
    TEST_ASSERT_EQUAL_INT64(1000 + i * INT64_C(8000000), pose.arrived.ns);
    TEST_ASSERT_EQUAL(follows, pose.follows);
    TEST_ASSERT_EQUAL_UINT32(recipe.package_bytes, pose.package_bytes);
    TEST_ASSERT_EQUAL_MEMORY(package_of(i), pose.package, recipe.package_bytes);
}

static bool has_note(const char *text)
{
    for (int i = 0; shef_recorded_poses_note(poses, i); i++)
        if (strstr(shef_recorded_poses_note(poses, i), text))
            return true;
    return false;
}

static void change_file(const char *name, size_t at, size_t n_cut)
{
    char path[4300];
    uint8_t *bytes;
    size_t n_bytes;

    snprintf(path, sizeof path, "%s/%s", folder, name);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 24, &bytes, &n_bytes, &err));
    bytes[at] ^= 1;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bytes, n_bytes - n_cut, &err));
    free(bytes);
}

static void test_packages_come_back_and_their_poses_are_decoded(void)
{
    make_recording();
    TEST_ASSERT_EQUAL(SHEF_VERDICT_CLEAN, manifest.verdict);
    TEST_ASSERT_EQUAL_UINT64(N_POSES, manifest.parts[SHEF_PART_POSES].n_items);
    TEST_ASSERT_EQUAL_INT64(12345008000, manifest.parts[SHEF_PART_POSES].first_us);
    open_poses();
    TEST_ASSERT_EQUAL_UINT64(N_POSES, shef_recorded_poses_count(poses));
    TEST_ASSERT_EQUAL_DOUBLE(125, shef_recorded_poses_frequency_hz(poses));
    for (int i = 0; i < N_POSES; i++) {
        const double rotation[3] = { 2.2, -.01 * i, .1 };
        const double position[3] = { .3 + .001 * i, -.2, .5 };
        const struct shef_rigid expected = shef_rigid_from_rotation_vector(rotation, position);

        expect_next(i, i > 0);
        TEST_ASSERT_EQUAL_MEMORY(&expected, &pose.t_world_hand, sizeof expected);
        TEST_ASSERT_TRUE(pose.has_speed);
        TEST_ASSERT_EQUAL_DOUBLE(-.5, pose.velocity_m_s[2]);
        TEST_ASSERT_EQUAL_DOUBLE(.03, pose.turn_rad_s[2]);
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_poses_next(poses, &pose, &err));
    TEST_ASSERT_NULL(shef_recorded_poses_note(poses, 0));
}

static void test_other_recipes_and_version_1_are_understood(void)
{
    struct shef_pose_recorder_config config = shef_pose_recorder_default_config();
    const double tool[6] = { 1, 2, 3, 0, 0, 0 };
    uint8_t package[200];

    config.protocol_version = 1;
    config.recipe = "robot_mode,actual_TCP_pose,timestamp";
    config.types = "INT32,VECTOR6D,DOUBLE";
    config.frequency_hz = 500;
    start_with(&config);
    shef_rtde_package_begin(&recipe, 0, package);
    shef_rtde_put_integer(&recipe.variables[0], 7, package);
    shef_rtde_put_doubles(&recipe.variables[1], tool, package);
    write_bytes(package, 0, 0);
    stop();
    open_poses();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_poses_next(poses, &pose, &err));
    TEST_ASSERT_FALSE(pose.has_speed);
    TEST_ASSERT_EQUAL_DOUBLE(3, pose.t_world_hand.t_m[2]);
    TEST_ASSERT_EQUAL_INT64(
        7, shef_rtde_get_integer(&shef_recorded_poses_recipe(poses)->variables[0], pose.package));
}

static void test_missing_packages_are_counted_and_judged(void)
{
    start();
    write_bytes(package_of(0), 0, 0);
    write_bytes(package_of(4), 4, 0); /* three periods are missing */
    write_bytes(package_of(5), 5, 2); /* the caller knows of two */
    write_bytes(package_of(1), 1, 0); /* the controller has begun anew */
    stop();
    TEST_ASSERT_EQUAL(SHEF_VERDICT_GAPS, manifest.verdict);
    TEST_ASSERT_NOT_NULL(strstr(manifest.reason, "5 poses are missing"));
    open_poses();
    expect_next(0, false);
    expect_next(4, false);
    TEST_ASSERT_EQUAL_UINT32(3, pose.n_lost_before);
    expect_next(5, false);
    expect_next(1, true);
}

static void test_poses_that_cannot_be_are_left_out(void)
{
    uint8_t package[SHEF_RTDE_PACKAGE_MAX_BYTES];
    const double wrong[][6] = { { NAN }, { 0, 0, 0, INFINITY }, { 1e6 }, { 0, 0, 0, 0, 0, 700 } };

    start();
    write_bytes(package_of(0), 0, 0);
    for (int i = 0; i < 4; i++) {
        memcpy(package, package_of(i + 1), recipe.package_bytes);
        shef_rtde_put_doubles(&recipe.variables[1], wrong[i], package);
        write_bytes(package, i + 1, 0);
    }
    write_bytes(package_of(5), 5, 0);
    stop();
    open_poses();
    expect_next(0, false);
    expect_next(5, false);
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_poses_next(poses, &pose, &err));
    TEST_ASSERT_TRUE(has_note("4 packages hold no pose that can be"));
}

static void test_damage_costs_one_package(void)
{
    make_recording();
    change_file("poses/000001.rtde", 1500, 0);
    change_file("poses/000002.rtde", 0, 5);
    open_poses();
    uint32_t n = 0;
    uint32_t n_breaks = 0;

    while (shef_recorded_poses_next(poses, &pose, &err) == SHEF_OK) {
        n++;
        n_breaks += !pose.follows;
    }
    /* One damaged, one cut; only the first one has a successor. */
    TEST_ASSERT_EQUAL_UINT32(N_POSES - 2, n);
    TEST_ASSERT_EQUAL_UINT32(2, n_breaks);
    TEST_ASSERT_EQUAL_UINT64(1, shef_recorded_poses_damage(poses)->n_bad_blocks);
    TEST_ASSERT_EQUAL_UINT64(1, shef_recorded_poses_damage(poses)->n_cut_blocks);
    TEST_ASSERT_TRUE(has_note("do not match their checksums"));
}

static void test_a_damaged_front_is_taken_from_the_next_segment(void)
{
    make_recording();
    change_file("poses/000000.rtde", 30, 0);
    open_poses();
    expect_next(0, false);
    tearDown();
    change_file("poses/000001.rtde", 30, 0);
    change_file("poses/000002.rtde", 30, 0);
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_recorded_poses_open(folder, &poses, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "intact text at its front"), err.text);
    poses = NULL;
}

static void test_a_recording_that_was_never_closed_is_read(void)
{
    start();
    for (int i = 0; i < 30; i++)
        write_bytes(package_of(i), i, 0);
    open_poses();
    for (int i = 0; i < 30; i++)
        expect_next(i, i > 0);
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_poses_next(poses, &pose, &err));
    stop();
}

static void test_what_is_no_package_or_recipe_is_refused_with_a_sentence(void)
{
    struct shef_pose_recorder_config config = shef_pose_recorder_default_config();

    start();
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_pose_recorder_write(recorder, package_of(0), recipe.package_bytes - 1,
                                               (shef_host_time){ 0 }, 0, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "are no data package"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pose_recorder_stop(recorder, &err));
    config.recipe = "actual_TCP_pose";
    config.types = "VECTOR6D";
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_pose_recorder_start(&recording, &config, &recorder, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "timestamp"));
    config.types = "VECTOR7D";
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_pose_recorder_start(&recording, &config, &recorder, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "VECTOR7D"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, false, NULL, NULL, &err));
}

static void test_verify_checks_poses_too(void)
{
    static struct shef_verify_report report;

    make_recording();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_verify(folder, NULL, NULL, &report, &err));
    TEST_ASSERT_EQUAL_UINT64(0, report.n_problems);
    TEST_ASSERT_EQUAL_UINT64(N_POSES, report.n_blocks);
    change_file("poses/000002.rtde", 0, 5);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_verify(folder, NULL, NULL, &report, &err));
    TEST_ASSERT_EQUAL_STRING("pose part: 1 blocks lie beyond the ends of their files",
                             report.problems[0]);
    TEST_ASSERT_EQUAL_STRING("pose part: 1 blocks are missing at the end", report.problems[1]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_packages_come_back_and_their_poses_are_decoded);
    RUN_TEST(test_other_recipes_and_version_1_are_understood);
    RUN_TEST(test_missing_packages_are_counted_and_judged);
    RUN_TEST(test_poses_that_cannot_be_are_left_out);
    RUN_TEST(test_damage_costs_one_package);
    RUN_TEST(test_a_damaged_front_is_taken_from_the_next_segment);
    RUN_TEST(test_a_recording_that_was_never_closed_is_read);
    RUN_TEST(test_what_is_no_package_or_recipe_is_refused_with_a_sentence);
    RUN_TEST(test_verify_checks_poses_too);
    return UNITY_END();
}
