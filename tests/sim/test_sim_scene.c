/* Scene files: what they may say, how mistakes are reported, what scenes answer. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unity.h>

#include "core/file.h"
#include "shefsim/mesh.h"
#include "shefsim/path.h"
#include "shefsim/scene.h"
#include "support/support.h"

/* Line 1 to 7; objects follow. */
#define HEAD                                                                                       \
    "scene: test\n"                                                                                \
    "lights:\n"                                                                                    \
    "  - {name: day, ambient: 0.5}\n"                                                              \
    "materials:\n"                                                                                 \
    "  - {name: paper, pattern: cells, albedo: 0.4, contrast: 0.8, cell_mm: 50,\n"                 \
    "     colour: [0.9, 0.6, 0.3]}\n"                                                              \
    "objects:\n"
#define WALL                                                                                       \
    "  - {name: wall, shape: wall, material: paper, position_m: [0, 1, 3],\n"                      \
    "     size_m: [4, 3, 0.01]}\n"
#define BALL                                                                                       \
    "  - {name: ball, shape: ellipsoid, material: paper, position_m: [0, 0.1, 2],\n"               \
    "     size_m: [0.2, 0.2, 0.2]}\n"

static struct sim_scene *scene;

void setUp(void)
{
    scene = NULL;
}

void tearDown(void)
{
    sim_scene_destroy(scene);
}

static enum shef_err read_text(const char *text, const char *light, struct shef_error *err)
{
    const struct sim_scene_options options = { .light = light, .seed = 1 };
    const char *path = shef_test_temp_path("scene.yaml");

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, text, strlen(text), err));
    return sim_scene_read(&scene, path, &options, err);
}

static void assert_refused(const char *text, const char *line, const char *reason)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_FORMAT, read_text(text, "day", &err), text);
    TEST_ASSERT_NULL(scene);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "scene.yaml"), err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, line), err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_a_written_scene_is_read(void)
{
    struct shef_error err = { 0 };
    float tint[3];

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, read_text(HEAD WALL BALL, "day", &err), err.text);
    TEST_ASSERT_EQUAL_STRING("test", sim_scene_name(scene));
    TEST_ASSERT_EQUAL(2, sim_scene_n_objects(scene));
    TEST_ASSERT_EQUAL_STRING("ball", sim_scene_object_name(scene, 1));
    sim_scene_object_tint(scene, 0, tint);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 3, tint[0] + tint[1] + tint[2]);
    TEST_ASSERT_FLOAT_WITHIN(1e-6f, 1.5f, tint[0]);
}

static void test_mistakes_are_named_with_their_line(void)
{
    assert_refused("scene: test\nligths:\n  - {name: day, ambient: 0.5}\n", "line 2", "ligths");
    assert_refused(HEAD "  - {name: a, shape: cone, material: paper, position_m: [0, 0, 2],\n"
                        "     size_m: [1, 1, 1]}\n",
                   "line 8", "cone");
    assert_refused(HEAD WALL "  - {name: a, shape: box, material: wood, position_m: [0, 0, 2],\n"
                             "     size_m: [1, 1, 1]}\n",
                   "line 10", "wood");
    assert_refused(HEAD "  - name: a\n    shape: box\n    material: paper\n"
                        "    position_m: [0, 0, 2]\n    size_m: [1, -1, 1]\n",
                   "line 12", "size_m is -1, but must be 0.001 to 20");
    assert_refused(HEAD "  - {name: a, shape: box, material: paper, position_m: [0, 0, 2],\n"
                        "     size_m: [1, 1]}\n",
                   "line 9", "");
    assert_refused(HEAD "  - {name: a, shape: box, material: paper, position_m: [0, much, 2],\n"
                        "     size_m: [1, 1, 1]}\n",
                   "line 8", "");
    assert_refused("scene: test\nlights: [\n", "line ", "");
    assert_refused("", "line 1", "");
    assert_refused("scene: test\nlights:\n  - {name: day, ambient: 0.5}\nlamps:\n"
                   "  - {light: dusk, position_m: [0, 0, 0], power: 1}\nmaterials:\n"
                   "  - {name: paper, pattern: plain, albedo: 0.4}\nobjects:\n" WALL,
                   "line 5", "dusk");
    assert_refused("scene: test\nlights:\n  - {name: day, ambient: 0.5}\nmaterials:\n"
                   "  - {name: paper, pattern: plain, albedo: 1.4}\nobjects:\n" WALL,
                   "line 5", "albedo is 1.4");
}

static void test_an_unknown_light_names_those_there_are(void)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, read_text(HEAD WALL, "noon", &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "noon"));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "day"));
}

static void test_an_unknown_scene_names_the_built_in_ones(void)
{
    const struct sim_scene_options options = { .light = "day" };
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, sim_scene_open(&scene, "no_such", &options, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "no_such"));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "complex_boxes"));
}

static void test_every_built_in_scene_opens_in_both_lights_with_room_for_all_paths(void)
{
    static const char *const lights[] = { "day", "night" };
    int n = 0;

    for (; sim_scene_names()[n]; n++)
        for (int k = 0; k < 2; k++) {
            const struct sim_scene_options options = { .light = lights[k], .seed = 1 };
            struct shef_error err = { 0 };

            TEST_ASSERT_EQUAL_MESSAGE(
                SHEF_OK, sim_scene_open(&scene, sim_scene_names()[n], &options, &err), err.text);
            TEST_ASSERT_EQUAL_STRING(sim_scene_names()[n], sim_scene_name(scene));
            for (int p = 0; sim_path_names()[p]; p++) {
                const struct sim_path_params params = { .name = sim_path_names()[p],
                                                        .size_m = SIM_PATH_SIZE_M,
                                                        .speed_m_s = 0.35 };
                struct sim_path *path;

                TEST_ASSERT_EQUAL(SHEF_OK, sim_path_create(&path, &params, &err));
                TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, sim_path_check(path, scene, &err), err.text);
                sim_path_destroy(path);
            }
            sim_scene_destroy(scene);
            scene = NULL;
        }
    TEST_ASSERT_EQUAL(5, n);
}

static void test_a_path_through_the_scene_is_refused(void)
{
    const struct sim_path_params params = { .name = "circle", .size_m = 0.15, .speed_m_s = 0.1 };
    struct shef_error err = { 0 };
    struct sim_path *path;

    TEST_ASSERT_EQUAL(SHEF_OK,
                      read_text(HEAD "  - {name: pole, shape: cylinder, material: paper,\n"
                                     "     position_m: [0.15, 1, 0], size_m: [0.05, 2, 0.05]}\n",
                                "day", &err));
    TEST_ASSERT_EQUAL(SHEF_OK, sim_path_create(&path, &params, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, sim_path_check(path, scene, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "pole"), err.text);
    sim_path_destroy(path);
}

static void test_clearance_is_the_distance_to_the_nearest_objects_box(void)
{
    struct shef_error err = { 0 };
    int32_t object = -1;

    TEST_ASSERT_EQUAL(
        SHEF_OK, read_text(HEAD WALL "  - {name: box, shape: box, material: paper, yaw_deg: 45,\n"
                                     "     position_m: [0, 0.5, 1.5], size_m: [0.4, 1, 0.4]}\n",
                           "day", &err));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.5 - 0.2 * sqrt(2),
                              sim_scene_clearance_m(scene, (const double[3]){ 0, 0, 0 }, &object));
    TEST_ASSERT_EQUAL(1, object);
    TEST_ASSERT_DOUBLE_WITHIN(
        1e-9, 0.5 - 0.005, sim_scene_clearance_m(scene, (const double[3]){ 0.1, 0, 2.5 }, &object));
    TEST_ASSERT_EQUAL(0, object);
    TEST_ASSERT_EQUAL_DOUBLE(0, sim_scene_clearance_m(scene, (const double[3]){ 0, 0, 1.5 }, NULL));
}

static void test_a_mesh_lies_on_the_surfaces_and_faces_outwards(void)
{
    const double middle[3] = { 0, 0, 2 };
    struct shef_error err = { 0 };
    struct sim_mesh mesh;

    TEST_ASSERT_EQUAL(SHEF_OK, read_text(HEAD BALL, "day", &err));
    TEST_ASSERT_EQUAL(SHEF_OK, sim_mesh_create(&mesh, scene, 0.01, &err));
    TEST_ASSERT_GREATER_THAN(1000, mesh.n_triangles);
    for (int32_t i = 0; i < mesh.n_vertices; i++) {
        const struct sim_vertex *v = &mesh.vertices[i];
        const double x = v->x_m - middle[0];
        const double y = v->y_m - middle[1];
        const double z = v->z_m - middle[2];

        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.1, sqrt(x * x + y * y + z * z));
    }
    for (int32_t i = 0; i < mesh.n_triangles; i++) {
        double a[3];
        double b[3];
        double out[3];
        const struct sim_vertex *v[3];

        for (int k = 0; k < 3; k++)
            v[k] = &mesh.vertices[mesh.triangles[i][k]];
        const double p[3][3] = { { v[0]->x_m, v[0]->y_m, v[0]->z_m },
                                 { v[1]->x_m, v[1]->y_m, v[1]->z_m },
                                 { v[2]->x_m, v[2]->y_m, v[2]->z_m } };

        for (int k = 0; k < 3; k++) {
            a[k] = p[1][k] - p[0][k];
            b[k] = p[2][k] - p[0][k];
            out[k] = p[0][k] - middle[k];
        }
        TEST_ASSERT_TRUE((a[1] * b[2] - a[2] * b[1]) * out[0] +
                             (a[2] * b[0] - a[0] * b[2]) * out[1] +
                             (a[0] * b[1] - a[1] * b[0]) * out[2] >
                         -1e-12);
    }
    sim_mesh_destroy(&mesh);
}

static void test_a_ply_file_holds_what_its_header_says(void)
{
    const char *path = shef_test_temp_path("scene.ply");
    struct shef_error err = { 0 };
    struct sim_mesh mesh;
    uint8_t *bytes;
    size_t n_bytes;
    int n_vertices = 0;
    int n_faces = 0;

    TEST_ASSERT_EQUAL(SHEF_OK, read_text(HEAD WALL BALL, "day", &err));
    TEST_ASSERT_EQUAL(SHEF_OK, sim_mesh_create(&mesh, scene, 0.05, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, sim_ply_write(path, &mesh, true, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 100000000, &bytes, &n_bytes, &err));
    TEST_ASSERT_EQUAL(
        1, sscanf(strstr((char *)bytes, "element vertex"), "element vertex %d", &n_vertices));
    TEST_ASSERT_EQUAL(1,
                      sscanf(strstr((char *)bytes, "element face"), "element face %d", &n_faces));
    TEST_ASSERT_EQUAL(mesh.n_vertices, n_vertices);
    TEST_ASSERT_EQUAL(mesh.n_triangles, n_faces);

    const uint8_t *body = (uint8_t *)strstr((char *)bytes, "end_header\n") + 11;

    TEST_ASSERT_EQUAL(n_bytes,
                      (size_t)(body - bytes) + 15 * (size_t)n_vertices + 13 * (size_t)n_faces);
    free(bytes);
    sim_mesh_destroy(&mesh);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_written_scene_is_read);
    RUN_TEST(test_mistakes_are_named_with_their_line);
    RUN_TEST(test_an_unknown_light_names_those_there_are);
    RUN_TEST(test_an_unknown_scene_names_the_built_in_ones);
    RUN_TEST(test_every_built_in_scene_opens_in_both_lights_with_room_for_all_paths);
    RUN_TEST(test_a_path_through_the_scene_is_refused);
    RUN_TEST(test_clearance_is_the_distance_to_the_nearest_objects_box);
    RUN_TEST(test_a_mesh_lies_on_the_surfaces_and_faces_outwards);
    RUN_TEST(test_a_ply_file_holds_what_its_header_says);
    return UNITY_END();
}
