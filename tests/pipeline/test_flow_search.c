#include "pipeline/flow_search.h"

#include <math.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "flow_scene.h"
#include "pipeline/frame_edges.h"

#define PI            3.14159265358979323846
#define MM_PER_SECOND (1 / 65.44) /* in baselines */
#define THRESHOLD     0.2
#define NOISE_HZ      1.0

static struct shef_test_random random_numbers;
static struct shef_error err;
static struct shef_rectification profile;
static struct shef_flow_search_params params;
static struct shef_flow_search *search;
static struct shef_image_u8 image;
static struct shef_edge_map events;

static struct shef_flow_search *create(uint32_t features)
{
    struct shef_flow_search *made = NULL;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_flow_search_create(&made, &profile, &params, features, &err), err.text);
    return made;
}

void setUp(void)
{
    random_numbers = shef_test_random_start();
    /* Half of `wide` along each side: the same directions, a quarter of the work. */
    profile = shef_rectification_wide();
    profile.width_px = 320;
    profile.height_px = 240;
    profile.f_px = 277.5;
    profile.cx_px = 159.5;
    profile.cy_px = 119.5;
    params = shef_flow_search_default_params(&profile);
    search = create(shef_cpu_features());
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&image, 320, 240, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_edge_map_create(&events, SHEF_EDGE_GRADED, 320, 240, &err));
}

void tearDown(void)
{
    shef_flow_search_destroy(search);
    shef_image_destroy_u8(&image);
    shef_edge_map_destroy(&events);
}

/* A scene that the camera passes so that its picture flows there. */
static struct shef_flow look(double direction_rad, double speed_mm_s, double along_z,
                             double contrast)
{
    struct shef_test_flow_scene scene =
        shef_test_flow_scene_create(&profile, contrast, &random_numbers);
    const double speed = speed_mm_s * MM_PER_SECOND;
    const double velocity[3] = { -speed * cos(direction_rad), -speed * sin(direction_rad),
                                 speed * along_z };
    struct shef_flow flow;

    shef_test_flow_frame(&scene, velocity, &random_numbers, image);
    shef_test_flow_events(&scene, velocity, THRESHOLD, NOISE_HZ, &random_numbers, &events);
    shef_flow_search_run(search, image, &events, &flow);
    shef_test_flow_scene_destroy(&scene);
    return flow;
}

static double degrees_off(double a_rad, double b_rad)
{
    return fabs(remainder(a_rad - b_rad, 2 * PI)) * 180 / PI;
}

/* Looks at scenes in evenly spread directions. Returns how many of them are found to 10 degrees. */
static int count_found(int n, double speed_mm_s, double along_z, double contrast)
{
    int n_good = 0;
    double sum = 0;

    for (int i = 0; i < n; i++) {
        const double direction = 2 * PI * (i + shef_test_random_unit(&random_numbers)) / n;
        const struct shef_flow flow =
            look(direction, speed_mm_s, i % 2 ? along_z : -along_z, contrast);
        const double off = degrees_off(flow.direction_rad, direction);

        n_good += flow.state == SHEF_FLOW_FOUND && off <= 10;
        sum += off;
    }
    printf("%3.0f mm/s, contrast %.1f, along z %.2f: %d of %d, mean %.1f degrees off\n", speed_mm_s,
           contrast, along_z, n_good, n, sum / n);
    return n_good;
}

static void test_the_direction_is_found_at_all_speeds(void)
{
    TEST_ASSERT_EQUAL_INT(8, count_found(8, 350, 0, 1));
    TEST_ASSERT_EQUAL_INT(8, count_found(8, 100, 0, 1));
    TEST_ASSERT_EQUAL_INT(8, count_found(8, 30, 0, 1));
}

static void test_weak_contrast_and_motion_along_z_do_not_hide_it(void)
{
    TEST_ASSERT_EQUAL_INT(6, count_found(6, 350, 0, 0.3));
    TEST_ASSERT_EQUAL_INT(6, count_found(6, 100, 0, 0.3));
    TEST_ASSERT_EQUAL_INT(6, count_found(6, 200, 0.35, 1));
}

static void test_a_camera_at_rest_sees_no_motion(void)
{
    for (int i = 0; i < 4; i++) {
        const struct shef_flow flow = look(0, 0, 0, 1);

        TEST_ASSERT_EQUAL_INT(SHEF_FLOW_NONE, flow.state);
    }
}

static void test_without_edges_or_without_events_there_is_no_motion(void)
{
    struct shef_flow flow = look(1, 200, 0, 1);

    TEST_ASSERT_EQUAL_INT(SHEF_FLOW_FOUND, flow.state);
    memset(events.graded, 0, (size_t)events.graded_stride_bytes * 240);
    shef_flow_search_run(search, image, &events, &flow);
    TEST_ASSERT_EQUAL_INT(SHEF_FLOW_NONE, flow.state);
    TEST_ASSERT_TRUE(flow.score == 0);

    look(1, 200, 0, 1);
    for (int32_t y = 0; y < 240; y++)
        memset(shef_row_u8(image, y), 90, 320);
    shef_flow_search_run(search, image, &events, &flow);
    TEST_ASSERT_EQUAL_INT(SHEF_FLOW_NONE, flow.state);
    TEST_ASSERT_TRUE(flow.score == 0);
}

static void test_events_of_the_other_sign_turn_the_direction_round(void)
{
    const struct shef_flow forth = look(0.6, 200, 0, 1);
    struct shef_flow back;

    for (int32_t i = 0; i < events.graded_stride_bytes * 240; i++)
        events.graded[i] = (int8_t)-events.graded[i];
    shef_flow_search_run(search, image, &events, &back);
    TEST_ASSERT_EQUAL_INT(SHEF_FLOW_FOUND, back.state);
    TEST_ASSERT_TRUE(degrees_off(back.direction_rad, forth.direction_rad + PI) < 10);
}

static void test_the_velocity_found_predicts_the_frames_edges(void)
{
    /* Events exactly as the frame predicts them, 24 px of disparity away. */
    const struct shef_image_u8 no_mask = { 0 };
    const struct shef_frame_edges_params edge_params = shef_frame_edges_default_params();
    const double velocity[3] = { 0.6, -0.8, 0 };
    struct shef_frame_edges *edges = NULL;
    struct shef_flow flow = look(0, 100, 0, 1);

    TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_edges_create(&edges, &profile, no_mask, &edge_params,
                                                       shef_cpu_features(), &err));
    shef_frame_edges_along(edges, image, velocity, &events);
    for (int32_t y = 0; y < 240; y++) {
        int8_t *row = events.graded + y * events.graded_stride_bytes;

        memmove(row, row + 24, 320 - 24);
        memset(row + 320 - 24, 0, 24);
    }
    shef_flow_search_run(search, image, &events, &flow);
    TEST_ASSERT_EQUAL_INT(SHEF_FLOW_FOUND, flow.state);
    TEST_ASSERT_TRUE(flow.score > 0.8);
    TEST_ASSERT_TRUE(fabs(flow.camera_velocity[0] - 0.6) < 0.05);
    TEST_ASSERT_TRUE(fabs(flow.camera_velocity[1] + 0.8) < 0.05);
    TEST_ASSERT_TRUE(flow.camera_velocity[2] == 0);
    shef_frame_edges_destroy(edges);
}

static void test_edges_along_one_line_tell_the_motion_across_it(void)
{
    for (int32_t y = 0; y < 240; y++)
        for (int32_t x = 0; x < 320; x++) {
            const double wave = sin(x * 2 * PI / 23) + sin(x * 2 * PI / 37);

            shef_row_u8(image, y)[x] = (uint8_t)lrint(120 + 40 * wave);
            /* Flowing left: brightness rises where it grows to the right. */
            events.graded[y * events.graded_stride_bytes + x] = (int8_t)lrint(
                60 * (cos((x + 20) * 2 * PI / 23) + cos((x + 20) * 2 * PI / 37) * 23 / 37));
        }

    struct shef_flow flow;

    shef_flow_search_run(search, image, &events, &flow);
    TEST_ASSERT_TRUE(degrees_off(flow.direction_rad, PI) < 10);
}

static void test_all_instruction_sets_find_the_same(void)
{
    static const char *const names[] = { "c", "avx2", "avx512", "neon" };
    const struct shef_flow expected = look(2, 200, 0.1, 1);
    int n_compared = 0;

    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        const uint32_t features = shef_cpu_features_of(names[i]);
        struct shef_flow flow;

        if ((features & shef_cpu_features()) != features)
            continue;

        struct shef_flow_search *other = create(features);

        TEST_ASSERT_EQUAL_STRING(names[i], shef_flow_search_isa(other));
        memset(&flow, 0, sizeof flow);
        shef_flow_search_run(other, image, &events, &flow);
        TEST_ASSERT_TRUE(flow.direction_rad == expected.direction_rad);
        TEST_ASSERT_TRUE(flow.margin == expected.margin);
        for (int k = 0; k < SHEF_FLOW_DIRECTIONS; k++)
            TEST_ASSERT_TRUE(flow.direction_scores[k] == expected.direction_scores[k]);
        shef_flow_search_destroy(other);
        n_compared++;
    }
    TEST_ASSERT_GREATER_OR_EQUAL_INT(1, n_compared);
}

static void refused(const char *reason)
{
    struct shef_flow_search *made = NULL;

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_flow_search_create(&made, &profile, &params, 0, &err));
    TEST_ASSERT_NULL(made);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_settings_out_of_range_are_refused_with_a_reason(void)
{
    profile.width_px = 63;
    refused("sides must be 64");
    profile.width_px = 321;
    params.last_disparity_px = 200;
    refused("disparities 2 to 200");
    params = shef_flow_search_default_params(&profile);
    params.sure_margin = 1.01;
    refused("the margin at most 1");
    params = shef_flow_search_default_params(&profile);
    params.min_significance = NAN;
    refused("significance of nan");
}

static void test_odd_sizes_and_the_smallest_one_work(void)
{
    static const int32_t sizes[][2] = { { 64, 64 }, { 65, 97 }, { 131, 71 } };

    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        profile.width_px = sizes[i][0];
        profile.height_px = sizes[i][1];

        struct shef_flow_search *small = create(shef_cpu_features());
        struct shef_edge_map part = { 0 };
        struct shef_flow flow;
        const struct shef_image_u8 corner = { image.data, sizes[i][0], sizes[i][1],
                                              image.stride_bytes };

        TEST_ASSERT_EQUAL(
            SHEF_OK, shef_edge_map_create(&part, SHEF_EDGE_GRADED, sizes[i][0], sizes[i][1], &err));
        shef_flow_search_run(small, corner, &part, &flow);
        TEST_ASSERT_EQUAL_INT(SHEF_FLOW_NONE, flow.state);
        shef_edge_map_destroy(&part);
        shef_flow_search_destroy(small);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_direction_is_found_at_all_speeds);
    RUN_TEST(test_weak_contrast_and_motion_along_z_do_not_hide_it);
    RUN_TEST(test_a_camera_at_rest_sees_no_motion);
    RUN_TEST(test_without_edges_or_without_events_there_is_no_motion);
    RUN_TEST(test_events_of_the_other_sign_turn_the_direction_round);
    RUN_TEST(test_the_velocity_found_predicts_the_frames_edges);
    RUN_TEST(test_edges_along_one_line_tell_the_motion_across_it);
    RUN_TEST(test_all_instruction_sets_find_the_same);
    RUN_TEST(test_settings_out_of_range_are_refused_with_a_reason);
    RUN_TEST(test_odd_sizes_and_the_smallest_one_work);
    return UNITY_END();
}
