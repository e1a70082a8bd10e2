/* The arm's paths: shape, speed, continuity, and what is refused. */
#include <math.h>
#include <string.h>
#include <unity.h>

#include "shefsim/path.h"

static struct sim_path *path;

void setUp(void)
{
    path = NULL;
}

void tearDown(void)
{
    sim_path_destroy(path);
}

static struct sim_path_params params_of(const char *name, double speed_m_s)
{
    return (
        struct sim_path_params){ .name = name, .size_m = SIM_PATH_SIZE_M, .speed_m_s = speed_m_s };
}

static void follow(const char *name, double speed_m_s)
{
    const struct sim_path_params params = params_of(name, speed_m_s);
    struct shef_error err = { 0 };

    sim_path_destroy(path);
    path = NULL;
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, sim_path_create(&path, &params, &err), err.text);
}

static double length(const double v[3])
{
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static int64_t after(double share_of_round)
{
    return (int64_t)(1e9 * sim_path_round_s(path) * share_of_round);
}

static void test_every_path_moves_as_its_velocity_says(void)
{
    for (int i = 0; sim_path_names()[i]; i++) {
        follow(sim_path_names()[i], 0.35);
        for (int k = 1; k < 400; k++) {
            const int64_t t_ns = after(2.2 * k / 400);
            const struct shef_rigid before = sim_path_pose(path, t_ns - 10000);
            const struct shef_rigid later = sim_path_pose(path, t_ns + 10000);
            double velocity[3];

            sim_path_velocity(path, t_ns, velocity);
            for (int c = 0; c < 3; c++)
                TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.003, (later.t_m[c] - before.t_m[c]) / 20e-6,
                                                  velocity[c], sim_path_names()[i]);
        }
    }
}

static void test_closed_paths_keep_their_speed_to_one_in_ten_thousand(void)
{
    static const char *const closed[] = { "square", "circle", "lissajous-a", "lissajous-b",
                                          "lissajous-c" };

    for (int i = 0; i < 5; i++) {
        follow(closed[i], 0.1);
        for (int k = 0; k < 500; k++) {
            double velocity[3];

            sim_path_velocity(path, after(k / 500.0), velocity);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-5, 0.1, length(velocity), closed[i]);
        }
    }
}

static void test_a_round_ends_where_it_began(void)
{
    for (int i = 0; sim_path_names()[i]; i++) {
        follow(sim_path_names()[i], 0.35);
        const struct shef_rigid start = sim_path_pose(path, 0);
        const struct shef_rigid end = sim_path_pose(path, after(1));

        for (int c = 0; c < 3; c++)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, start.t_m[c], end.t_m[c], sim_path_names()[i]);
    }
}

static void test_paths_are_fifteen_centimetres_wide(void)
{
    for (int i = 0; sim_path_names()[i]; i++) {
        double widest = 0;

        follow(sim_path_names()[i], 0.35);
        for (int k = 0; k < 2000; k++) {
            const struct shef_rigid pose = sim_path_pose(path, after(k / 2000.0));

            widest = fmax(widest, fmax(fabs(pose.t_m[0]), fabs(pose.t_m[1])));
        }
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-4, 0.075, widest, sim_path_names()[i]);
    }
}

static void test_lines_go_first_where_their_name_says(void)
{
    static const struct {
        const char *name;
        double x, y;
    } lines[] = {
        { "line-left", -1, 0 }, { "line-right", 1, 0 }, { "line-up", 0, -1 }, { "line-down", 0, 1 }
    };

    for (int i = 0; i < 4; i++) {
        double velocity[3];

        follow(lines[i].name, 0.35);
        sim_path_velocity(path, after(0.25), velocity);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.35 * lines[i].x, velocity[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.35 * lines[i].y, velocity[1]);
        sim_path_velocity(path, after(0.75), velocity);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.35 * lines[i].x, velocity[0]);
    }
}

static void test_a_tilted_circle_moves_in_depth_and_keeps_its_length(void)
{
    struct sim_path_params params = params_of("circle", 0.35);
    struct shef_error err;
    double nearest = 0;
    double top_m[2] = { 0 };

    params.tilt_deg = 30;
    TEST_ASSERT_EQUAL(SHEF_OK, sim_path_create(&path, &params, &err));
    for (int k = 0; k < 1000; k++) {
        const struct shef_rigid pose = sim_path_pose(path, after(k / 1000.0));

        nearest = fmax(nearest, fabs(pose.t_m[2]));
        if (pose.t_m[1] < top_m[0]) {
            top_m[0] = pose.t_m[1];
            top_m[1] = pose.t_m[2];
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 0.075 * 0.5, nearest);
    TEST_ASSERT_TRUE(top_m[1] > 0.03);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 3.14159265358979 * 0.15, sim_path_round_m(path));
}

static void test_impossible_paths_are_refused_with_a_sentence(void)
{
    struct shef_error err;
    struct sim_path_params params = params_of("triangle", 0.35);

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, sim_path_create(&path, &params, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "triangle"));
    params = params_of("circle", 0);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, sim_path_create(&path, &params, &err));
    params = params_of("circle", 0.35);
    params.size_m = 5;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, sim_path_create(&path, &params, &err));
    TEST_ASSERT_NULL(path);
}

static void test_every_path_is_within_the_arms_reach(void)
{
    struct shef_error err = { 0 };

    for (int i = 0; sim_path_names()[i]; i++) {
        follow(sim_path_names()[i], 0.35);
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, sim_path_check(path, NULL, &err), err.text);
    }
}

static void test_a_path_out_of_reach_or_at_the_base_is_refused(void)
{
    struct sim_path_params params = params_of("circle", 0.35);
    struct shef_error err;

    params.centre_m[0] = 0.9;
    TEST_ASSERT_EQUAL(SHEF_OK, sim_path_create(&path, &params, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, sim_path_check(path, NULL, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "reach"));
    sim_path_destroy(path);
    params.centre_m[0] = 0;
    params.centre_m[2] = -0.4;
    TEST_ASSERT_EQUAL(SHEF_OK, sim_path_create(&path, &params, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, sim_path_check(path, NULL, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "base"));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_path_moves_as_its_velocity_says);
    RUN_TEST(test_closed_paths_keep_their_speed_to_one_in_ten_thousand);
    RUN_TEST(test_a_round_ends_where_it_began);
    RUN_TEST(test_paths_are_fifteen_centimetres_wide);
    RUN_TEST(test_lines_go_first_where_their_name_says);
    RUN_TEST(test_a_tilted_circle_moves_in_depth_and_keeps_its_length);
    RUN_TEST(test_impossible_paths_are_refused_with_a_sentence);
    RUN_TEST(test_every_path_is_within_the_arms_reach);
    RUN_TEST(test_a_path_out_of_reach_or_at_the_base_is_refused);
    return UNITY_END();
}
