/* Views: exact geometry, the same bytes whoever renders, textures that stay still. */
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unity.h>

#include "core/cpu.h"
#include "core/file.h"
#include "core/memory.h"
#include "core/workers.h"
#include "shefsim/view.h"
#include "support/support.h"

#define WIDTH_PX  163 /* no whole tile */
#define HEIGHT_PX 117
#define F_PX      140.0
#define HEAD                                                                                       \
    "scene: test\n"                                                                                \
    "lights: [{name: day, ambient: 0.5}]\n"                                                        \
    "materials:\n"                                                                                 \
    "  - {name: paper, pattern: cells, albedo: 0.4, contrast: 0.8, cell_mm: 80}\n"                 \
    "  - {name: screen, pattern: checker, albedo: 0.13, contrast: 1.9, cell_mm: 200, blink: true}" \
    "\nobjects:\n"
#define WALL                                                                                       \
    "  - {name: wall, shape: wall, material: paper, position_m: [0, 2.3, 3], size_m: [5.6, 4.6, 0.01]}\n"

static struct sim_scene *scene;
static struct sim_view *view;
static struct shef_image_f32 depth;
static struct shef_image_f32 light;
static struct shef_image_i16 object;

static const struct sim_view_params params = {
    .width_px = WIDTH_PX,
    .height_px = HEIGHT_PX,
    .camera = { F_PX, F_PX, 80, 60, { -0.12, 0.03, 0.001, -0.002, 0.01 } },
    .supersample = 2,
};

void setUp(void)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&depth, WIDTH_PX, HEIGHT_PX, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&light, WIDTH_PX, HEIGHT_PX, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&object, WIDTH_PX, HEIGHT_PX, NULL));
    scene = NULL;
    view = NULL;
}

void tearDown(void)
{
    sim_view_destroy(view);
    sim_scene_destroy(scene);
    shef_image_destroy_f32(&depth);
    shef_image_destroy_f32(&light);
    shef_image_destroy_i16(&object);
}

static struct sim_scene *open_scene(const char *name, uint64_t seed, struct shef_workers *workers)
{
    const struct sim_scene_options options = { .light = "day", .seed = seed, .workers = workers };
    struct sim_scene *opened = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, sim_scene_open(&opened, name, &options, &err), err.text);
    return opened;
}

static void look_at(const char *text)
{
    const char *path = shef_test_temp_path("scene.yaml");
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, text, strlen(text), &err));
    scene = open_scene(path, 1, NULL);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, sim_view_create(&view, scene, &params, NULL, shef_cpu_features(), &err), err.text);
}

static struct shef_rigid pose_at(double x, double y, double z)
{
    struct shef_rigid pose = shef_rigid_identity();

    pose.t_m[0] = x;
    pose.t_m[1] = y;
    pose.t_m[2] = z;
    return pose;
}

/* A camera turned by about 11 degrees about an axis that is none of its own. */
static struct shef_rigid turned_pose(void)
{
    const double t_m[3] = { 0.05, -0.03, 0.1 };
    const double rotation[3] = { 0.12, -0.14, 0.05 };

    return shef_rigid_from_rotation_vector(rotation, t_m);
}

static void ray_of(int32_t x, int32_t y, const struct shef_rigid *pose, double out_ray[3])
{
    TEST_ASSERT_TRUE(shef_camera_unproject(&params.camera, x, y, out_ray));
    shef_rigid_rotate(pose, out_ray, out_ray);
}

static void test_a_walls_depth_is_that_of_its_plane(void)
{
    const struct shef_rigid poses[] = { pose_at(0, 0, 0), pose_at(0.1, -0.2, 0.4), turned_pose() };

    look_at(HEAD WALL);
    for (size_t i = 0; i < 3; i++) {
        sim_view_depth(view, &poses[i], depth, object);
        for (int32_t y = 0; y < HEIGHT_PX; y++)
            for (int32_t x = 0; x < WIDTH_PX; x++) {
                double ray[3];

                ray_of(x, y, &poses[i], ray);
                const double expected = (2.995 - poses[i].t_m[2]) / ray[2];

                TEST_ASSERT_FLOAT_WITHIN((float)(2e-6 * expected), (float)expected,
                                         shef_row_f32(depth, y)[x]);
                TEST_ASSERT_EQUAL(0, shef_row_i16(object, y)[x]);
            }
    }
}

/* The nearer root of |o + t d|^2 = r^2 in the coordinates that count; negative: none. */
static double root_of(const double o[3], const double d[3], double r, bool with_y)
{
    const double a = d[0] * d[0] + d[2] * d[2] + (with_y ? d[1] * d[1] : 0);
    const double b = o[0] * d[0] + o[2] * d[2] + (with_y ? o[1] * d[1] : 0);
    const double c = o[0] * o[0] + o[2] * o[2] + (with_y ? o[1] * o[1] : 0) - r * r;

    return b * b > a * c ? (-b - sqrt(b * b - a * c)) / a : -1;
}

static void assert_round_body(bool is_ball, double middle_y)
{
    const struct shef_rigid pose = turned_pose();
    const double r = 0.3;
    int n_hit = 0;

    sim_view_depth(view, &pose, depth, object);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const double o[3] = { pose.t_m[0], pose.t_m[1] - middle_y, pose.t_m[2] - 1.5 };
            double ray[3];
            double expected;

            ray_of(x, y, &pose, ray);
            expected = root_of(o, ray, r, is_ball);
            /* At the outline, roundings decide whether a ray hits. */
            if (fabs(root_of(o, ray, r * .999, is_ball) - expected) > 0.05 ||
                fabs(root_of(o, ray, r * 1.001, is_ball) - expected) > 0.05)
                continue;
            TEST_ASSERT_EQUAL(expected > 0, shef_row_i16(object, y)[x] == 0);
            if (expected > 0)
                TEST_ASSERT_FLOAT_WITHIN(2e-5f, (float)expected, shef_row_f32(depth, y)[x]);
            else
                TEST_ASSERT_EQUAL_FLOAT(0, shef_row_f32(depth, y)[x]);
            n_hit += expected > 0;
        }
    TEST_ASSERT_GREATER_THAN(1000, n_hit);
}

static void test_a_balls_depth_is_the_spheres(void)
{
    look_at(HEAD "  - {name: ball, shape: ellipsoid, material: paper, position_m: [0, 0.3, 1.5],\n"
                 "     size_m: [0.6, 0.6, 0.6]}\n");
    assert_round_body(true, 0);
}

static void test_a_columns_depth_is_the_cylinders(void)
{
    look_at(HEAD "  - {name: column, shape: cylinder, material: paper, yaw_deg: 30,\n"
                 "     position_m: [0, 1.5, 1.5], size_m: [0.6, 3, 0.6]}\n");
    assert_round_body(false, 0);
}

static void test_what_is_in_front_hides_what_is_behind(void)
{
    const struct shef_rigid pose = pose_at(0, 0, 0);

    look_at(HEAD WALL "  - {name: box, shape: box, material: paper, position_m: [0, 0.25, 2],\n"
                      "     size_m: [0.5, 0.5, 0.5]}\n");
    sim_view_depth(view, &pose, depth, object);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            double ray[3];

            ray_of(x, y, &pose, ray);
            const double outside_m = fmax(fabs(ray[0]), fabs(ray[1])) * 1.75 - 0.25;
            const double wall_m = 2.995;

            if (fabs(outside_m) < 1e-4)
                continue;
            TEST_ASSERT_EQUAL(outside_m < 0 ? 1 : 0, shef_row_i16(object, y)[x]);
            TEST_ASSERT_FLOAT_WITHIN(1e-5f, (float)(outside_m < 0 ? 1.75 : wall_m),
                                     shef_row_f32(depth, y)[x]);
        }
}

static void test_an_open_bowl_shows_its_inside(void)
{
    /* From above its rim one looks at the inner side of its far wall, past its middle. */
    const struct shef_rigid pose = pose_at(0, -0.5, 0);
    double pixel[2];
    float at;

    look_at(HEAD "  - {name: bowl, shape: bowl, material: paper, position_m: [0, 0.4, 1.2],\n"
                 "     size_m: [1, 0.4, 1]}\n");
    sim_view_depth(view, &pose, depth, object);
    TEST_ASSERT_TRUE(shef_camera_project(&params.camera, (const double[3]){ 0, 0.55, 1.4 },
                                         &pixel[0], &pixel[1]));
    at = shef_row_f32(depth, (int32_t)pixel[1])[(int32_t)pixel[0]];
    TEST_ASSERT_FLOAT_WITHIN(0.03f, 1.66f, at);
}

static void test_nothing_is_seen_where_nothing_is(void)
{
    const struct shef_rigid pose = pose_at(0, 0, 5);

    look_at(HEAD WALL);
    sim_view_depth(view, &pose, depth, object);
    sim_view_render(view, &pose, light);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            TEST_ASSERT_EQUAL_FLOAT(0, shef_row_f32(depth, y)[x]);
            TEST_ASSERT_EQUAL(SIM_VIEW_NO_OBJECT, shef_row_i16(object, y)[x]);
            TEST_ASSERT_FLOAT_WITHIN(0.1f, 0.05f, shef_row_f32(light, y)[x]);
        }
}

static double difference(struct shef_image_f32 a, struct shef_image_f32 b)
{
    double largest = 0;

    for (int32_t y = 0; y < a.height_px; y++)
        for (int32_t x = 0; x < a.width_px; x++)
            largest = fmax(largest, fabs((double)shef_row_f32(a, y)[x] - shef_row_f32(b, y)[x]));
    return largest;
}

/* Light, depth and objects of a scene must be those in light, depth and object. */
static void assert_same_bytes(const struct sim_scene *seen, struct shef_workers *workers,
                              uint32_t features, const struct shef_rigid *pose)
{
    struct shef_image_f32 other;
    struct shef_image_i16 other_object;
    struct sim_view *other_view = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&other, WIDTH_PX, HEIGHT_PX, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&other_object, WIDTH_PX, HEIGHT_PX, &err));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      sim_view_create(&other_view, seen, &params, workers, features, &err));
    sim_view_render(other_view, pose, other);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(light, y), shef_row_f32(other, y),
                                 WIDTH_PX * sizeof(float));
    sim_view_depth(other_view, pose, other, other_object);
    for (int32_t y = 0; y < HEIGHT_PX; y++) {
        TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(depth, y), shef_row_f32(other, y),
                                 WIDTH_PX * sizeof(float));
        TEST_ASSERT_EQUAL_MEMORY(shef_row_i16(object, y), shef_row_i16(other_object, y),
                                 WIDTH_PX * sizeof(int16_t));
    }
    sim_view_destroy(other_view);
    shef_image_destroy_f32(&other);
    shef_image_destroy_i16(&other_object);
}

/* The picnic has every kind of surface. */
static void test_threads_and_instruction_sets_do_not_change_a_byte(void)
{
    static const char *const isas[] = { "avx2", "avx512", "neon" };
    const struct shef_rigid pose = turned_pose();
    struct shef_error err = { 0 };
    struct shef_workers *workers = shef_workers_create(3, &err);
    struct sim_scene *again;

    TEST_ASSERT_NOT_NULL(workers);
    scene = open_scene("picnic", 7, NULL);
    again = open_scene("picnic", 7, workers);
    TEST_ASSERT_EQUAL(SHEF_OK, sim_view_create(&view, scene, &params, NULL, SHEF_CPU_NONE, &err));
    sim_view_render(view, &pose, light);
    sim_view_depth(view, &pose, depth, object);
    assert_same_bytes(again, workers, SHEF_CPU_NONE, &pose);
    for (int k = 0; k < 3; k++) {
        const uint32_t features = shef_cpu_features_of(isas[k]);

        if ((features & shef_cpu_features()) == features)
            assert_same_bytes(scene, NULL, features, &pose);
        else
            printf("%s: not on this machine\n", isas[k]);
    }
    sim_scene_destroy(again);
    shef_workers_destroy(workers);
}

static void test_another_seed_changes_the_textures_but_not_the_layout(void)
{
    const struct shef_rigid pose = pose_at(0, 0, 0);
    struct sim_scene *other = open_scene("low_contrast", 2, NULL);
    struct sim_view *other_view = NULL;
    struct shef_image_f32 image;
    struct shef_error err = { 0 };

    scene = open_scene("low_contrast", 1, NULL);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&image, WIDTH_PX, HEIGHT_PX, &err));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      sim_view_create(&view, scene, &params, NULL, shef_cpu_features(), &err));
    TEST_ASSERT_EQUAL(
        SHEF_OK, sim_view_create(&other_view, other, &params, NULL, shef_cpu_features(), &err));
    sim_view_render(view, &pose, light);
    sim_view_render(other_view, &pose, image);
    TEST_ASSERT_TRUE(difference(light, image) > 0.02);
    sim_view_depth(view, &pose, depth, object);
    sim_view_depth(other_view, &pose, image, object);
    TEST_ASSERT_EQUAL_DOUBLE(0, difference(depth, image));
    sim_view_destroy(other_view);
    sim_scene_destroy(other);
    shef_image_destroy_f32(&image);
}

static void test_an_exposure_is_the_mean_of_its_instants(void)
{
    const struct shef_rigid poses[] = { pose_at(0, 0, 0), pose_at(0.01, 0, 0),
                                        pose_at(0.02, 0.01, 0) };
    struct shef_image_f32 mean;

    look_at(HEAD WALL);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&mean, WIDTH_PX, HEIGHT_PX, NULL));
    for (int i = 0; i < 3; i++) {
        sim_view_render(view, &poses[i], light);
        for (int32_t y = 0; y < HEIGHT_PX; y++)
            for (int32_t x = 0; x < WIDTH_PX; x++)
                shef_row_f32(mean, y)[x] += shef_row_f32(light, y)[x] / 3;
    }
    sim_view_render_exposure(view, poses, 3, light);
    TEST_ASSERT_TRUE(difference(mean, light) < 1e-6);
    sim_view_render_exposure(view, poses, 1, light);
    sim_view_render(view, &poses[0], mean);
    TEST_ASSERT_EQUAL_DOUBLE(0, difference(mean, light));
    shef_image_destroy_f32(&mean);
}

static void test_a_blinking_board_turns_black_to_white(void)
{
    const struct shef_rigid pose = pose_at(0, 0, 0);
    const float white = 0.95f * 0.5f;

    look_at(HEAD "  - {name: board, shape: wall, material: screen, position_m: [0, 2.3, 3],\n"
                 "     size_m: [5.6, 4.6, 0.01]}\n");
    for (int phase = 0; phase < 2; phase++) {
        int n_black = 0;
        int n_white = 0;

        sim_view_set_blink(view, phase == 0);
        sim_view_render(view, &pose, phase == 0 ? light : depth);
        for (int32_t y = 0; y < HEIGHT_PX; y++)
            for (int32_t x = 0; x < WIDTH_PX; x++) {
                n_black += shef_row_f32(phase == 0 ? light : depth, y)[x] < 0.1f * white;
                n_white += shef_row_f32(phase == 0 ? light : depth, y)[x] > 0.9f * white;
            }
        TEST_ASSERT_GREATER_THAN(4000, n_black);
        TEST_ASSERT_GREATER_THAN(4000, n_white);
    }
    /* Where it was bright it is dark. */
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++)
            if (shef_row_f32(light, y)[x] > 0.9f * white)
                TEST_ASSERT_TRUE(shef_row_f32(depth, y)[x] < 0.5f * white);
}

static double mean_of(struct shef_image_f32 image)
{
    double sum = 0;

    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            sum += shef_row_f32(image, y)[x];
    return sum / image.width_px / image.height_px;
}

/* Two cameras of one pixel pitch, one of them with more rays per pixel. */
static void test_four_rays_per_pixel_see_what_sixteen_see(void)
{
    const struct shef_rigid pose = pose_at(0.031, 0.017, 0);
    struct sim_view_params event = {
        .width_px = 640,
        .height_px = 480,
        .camera = { 555, 555, 319.5, 239.5, { 0 } },
        .supersample = 2,
    };
    struct shef_image_f32 image[2];
    struct shef_error err = { 0 };
    double sum = 0;

    scene = open_scene("complex_boxes", 1, NULL);
    for (int i = 0; i < 2; i++) {
        struct sim_view *seen;

        event.supersample = i == 0 ? 2 : 4;
        TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&image[i], 640, 480, &err));
        TEST_ASSERT_EQUAL(SHEF_OK,
                          sim_view_create(&seen, scene, &event, NULL, shef_cpu_features(), &err));
        sim_view_render(seen, &pose, image[i]);
        sim_view_destroy(seen);
    }
    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 0; x < 640; x++) {
            const double off = shef_row_f32(image[0], y)[x] - shef_row_f32(image[1], y)[x];

            sum += off * off;
        }
    TEST_ASSERT_TRUE(sqrt(sum / 640 / 480) < 0.03 * mean_of(image[1]));
    for (int i = 0; i < 2; i++)
        shef_image_destroy_f32(&image[i]);
}

/* What a pixel sees on a matt surface, another camera sees with the same light. */
static void test_textures_stay_on_their_surfaces(void)
{
    const struct shef_rigid left = pose_at(0, 0, 0);
    const struct shef_rigid right = pose_at(0.06544, 0, 0.02);
    const struct sim_view_params event = {
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .camera = { 555, 555, 80, 60, { 0 } },
        .supersample = 2,
    };
    struct shef_image_f32 other;
    struct shef_error err = { 0 };
    double sum = 0;
    int n = 0;

    scene = open_scene("simple_boxes", 1, NULL);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&other, WIDTH_PX, HEIGHT_PX, &err));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      sim_view_create(&view, scene, &event, NULL, shef_cpu_features(), &err));
    sim_view_render(view, &left, light);
    sim_view_depth(view, &left, depth, object);
    sim_view_render(view, &right, other);
    for (int32_t y = 1; y < HEIGHT_PX - 1; y++)
        for (int32_t x = 1; x < WIDTH_PX - 1; x++) {
            const double z = shef_row_f32(depth, y)[x];
            const double right_z = z - right.t_m[2];
            const double at_x = ((x - 80) * z - 555 * right.t_m[0]) / right_z + 80;
            const double at_y = (y - 60) * z / right_z + 60;
            const int32_t i = (int32_t)floor(at_x);
            const int32_t j = (int32_t)floor(at_y);
            const double u = at_x - i;
            const double v = at_y - j;

            /* Away from the outlines of objects. */
            if (i < 0 || j < 0 || i + 1 >= WIDTH_PX || j + 1 >= HEIGHT_PX ||
                fabs(z - shef_row_f32(depth, y)[x - 1]) > 0.02 ||
                fabs(z - shef_row_f32(depth, y)[x + 1]) > 0.02)
                continue;
            const double expected = (1 - v) * ((1 - u) * shef_row_f32(other, j)[i] +
                                               u * shef_row_f32(other, j)[i + 1]) +
                                    v * ((1 - u) * shef_row_f32(other, j + 1)[i] +
                                         u * shef_row_f32(other, j + 1)[i + 1]);

            sum += fabs(expected - shef_row_f32(light, y)[x]);
            n++;
        }
    TEST_ASSERT_GREATER_THAN(WIDTH_PX * HEIGHT_PX / 2, n);
    /* Interpolating costs some; textures that slide by a pixel differ by a third. */
    TEST_ASSERT_TRUE(sum / n < 0.06 * mean_of(light));
    shef_image_destroy_f32(&other);
}

static void test_impossible_views_are_refused(void)
{
    struct sim_view_params wrong = params;
    struct shef_error err;

    look_at(HEAD WALL);
    sim_view_destroy(view);
    view = NULL;
    wrong.width_px = 0;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, sim_view_create(&view, scene, &wrong, NULL, 0, &err));
    wrong = params;
    wrong.supersample = 9;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, sim_view_create(&view, scene, &wrong, NULL, 0, &err));
    wrong = params;
    wrong.camera.distortion[0] = -5;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, sim_view_create(&view, scene, &wrong, NULL, 0, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "lens"));
    TEST_ASSERT_NULL(view);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_walls_depth_is_that_of_its_plane);
    RUN_TEST(test_a_balls_depth_is_the_spheres);
    RUN_TEST(test_a_columns_depth_is_the_cylinders);
    RUN_TEST(test_what_is_in_front_hides_what_is_behind);
    RUN_TEST(test_an_open_bowl_shows_its_inside);
    RUN_TEST(test_nothing_is_seen_where_nothing_is);
    RUN_TEST(test_threads_and_instruction_sets_do_not_change_a_byte);
    RUN_TEST(test_another_seed_changes_the_textures_but_not_the_layout);
    RUN_TEST(test_an_exposure_is_the_mean_of_its_instants);
    RUN_TEST(test_a_blinking_board_turns_black_to_white);
    RUN_TEST(test_four_rays_per_pixel_see_what_sixteen_see);
    RUN_TEST(test_textures_stay_on_their_surfaces);
    RUN_TEST(test_impossible_views_are_refused);
    return UNITY_END();
}
