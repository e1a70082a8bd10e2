#include "robust_cases.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/cpu.h"
#include "core/memory.h"

/* Sides of the texture's random lattices: edges a few pixels wide, as in real maps, and dense and
 * sparse regions of the size of objects. */
#define FINE_PX   3.0
#define COARSE_PX 48.0

/* |f| above these is an edge: about a quarter of all pixels, as in the authors' maps. */
#define UNSIGNED_LEVEL 0.20
#define TERNARY_LEVEL  0.36

/* SplitMix64's finaliser over a lattice point: uniform in -1..1. */
static double lattice(uint64_t seed, int64_t x, int64_t y)
{
    uint64_t z = seed * UINT64_C(0x9e3779b97f4a7c15) + (uint64_t)x * UINT64_C(0xd1b54a32d192ed03) +
                 (uint64_t)y * UINT64_C(0x8cb92ba72f3d8dd7);

    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    z ^= z >> 31;
    return (double)(z >> 11) * 0x1p-52 - 1.0;
}

static double smooth(double t)
{
    return t * t * (3.0 - 2.0 * t);
}

/* Random values on a lattice, smoothly joined. */
static double noise_at(uint64_t seed, double side_px, double x, double y)
{
    const double gx = floor(x / side_px);
    const double gy = floor(y / side_px);
    const int64_t ix = (int64_t)gx;
    const int64_t iy = (int64_t)gy;
    const double tx = smooth(x / side_px - gx);
    const double ty = smooth(y / side_px - gy);
    const double top = (1.0 - tx) * lattice(seed, ix, iy) + tx * lattice(seed, ix + 1, iy);
    const double bottom =
        (1.0 - tx) * lattice(seed, ix, iy + 1) + tx * lattice(seed, ix + 1, iy + 1);

    return (1.0 - ty) * top + ty * bottom;
}

static int32_t edge_value(const struct scene *scene, double x, double y)
{
    const double at = x - scene->pan_px;
    const double density = noise_at(scene->texture + 1000, COARSE_PX, at, y);
    const double f = noise_at(scene->texture, FINE_PX, at, y) * (1.0 + 0.5 * density);
    const double level = scene->kind == SHEF_EDGE_UNSIGNED ? UNSIGNED_LEVEL : TERNARY_LEVEL;

    if (scene->kind == SHEF_EDGE_GRADED) {
        const int32_t value = (int32_t)lrint(f * 100.0);

        return value > 127 ? 127 : value < -127 ? -127 : value;
    }
    if (scene->kind == SHEF_EDGE_TERNARY && f < -level)
        return -1;
    return f > level;
}

double scene_disparity_px(const struct scene *scene, double x)
{
    switch (scene->surface) {
    case SURFACE_SLANTED:
        return scene->far_px + (scene->near_px - scene->far_px) * x / (scene->width_px - 1);
    case SURFACE_STEPPED:
        return x < scene->width_px / 2 ? scene->far_px : scene->near_px;
    case SURFACE_CONSTANT:
        break;
    }
    return scene->near_px;
}

struct edges edges_create(enum shef_edge_kind kind, int32_t width_px, int32_t height_px)
{
    struct edges edges;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_edge_map_create(&edges.left, kind, width_px, height_px, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_edge_map_create(&edges.right, kind, width_px, height_px, &err), err.text);
    return edges;
}

/* The right view's value: of the surface, or of its own. */
static int32_t right_value(const struct scene *scene, int32_t x, int32_t y)
{
    const double residual = scene->residual ? shef_field_at(scene->residual, x, y) : 0.0;
    const uint64_t own = scene->texture + 5000 + (uint64_t)llrint(scene->pan_px * 64.0);

    if (0.5 + 0.5 * lattice(own, x, y) < scene->noise) {
        struct scene other = *scene;

        other.texture = own;
        return edge_value(&other, x, y);
    }
    return edge_value(scene, x, y + residual);
}

struct edges edges_of_scene(const struct scene *scene)
{
    struct edges edges = edges_create(scene->kind, scene->width_px, scene->height_px);

    for (int32_t y = 0; y < scene->height_px; y++)
        for (int32_t x = 0; x < scene->width_px; x++) {
            edge_set(&edges.left, x, y, edge_value(scene, x - scene_disparity_px(scene, x), y));
            edge_set(&edges.right, x, y, right_value(scene, x, y));
        }
    return edges;
}

static int32_t random_value(struct shef_test_random *random, enum shef_edge_kind kind)
{
    switch (kind) {
    case SHEF_EDGE_GRADED:
        return shef_test_random_range(random, -127, 127);
    case SHEF_EDGE_TERNARY:
        return shef_test_random_range(random, 0, 1) ? 1 : -1;
    case SHEF_EDGE_UNSIGNED:
        break;
    }
    return 1;
}

struct edges edges_random(struct shef_test_random *random, enum shef_edge_kind kind,
                          int32_t width_px, int32_t height_px, double share)
{
    struct edges edges = edges_create(kind, width_px, height_px);

    for (int32_t y = 0; y < height_px; y++)
        for (int32_t x = 0; x < width_px; x++) {
            if (shef_test_random_unit(random) < share)
                edge_set(&edges.left, x, y, random_value(random, kind));
            if (shef_test_random_unit(random) < share)
                edge_set(&edges.right, x, y, random_value(random, kind));
        }
    return edges;
}

void edges_destroy(struct edges *edges)
{
    shef_edge_map_destroy(&edges->left);
    shef_edge_map_destroy(&edges->right);
}

struct shef_edge_pair edges_pair(const struct edges *edges)
{
    return (struct shef_edge_pair){ &edges->left, &edges->right };
}

int32_t edge_at(const struct shef_edge_map *map, int32_t x, int32_t y)
{
    if (x < 0 || y < 0 || x >= map->width_px || y >= map->height_px)
        return 0;
    if (map->kind == SHEF_EDGE_GRADED)
        return map->graded[y * map->graded_stride_bytes + x];

    const size_t word = (size_t)y * (size_t)map->stride_words + (size_t)x / 64;
    const int32_t plus = map->plus[word] >> (x % 64) & 1;
    const int32_t minus = map->minus ? map->minus[word] >> (x % 64) & 1 : 0;

    return plus - minus;
}

void edge_set(struct shef_edge_map *map, int32_t x, int32_t y, int32_t value)
{
    if (map->kind == SHEF_EDGE_GRADED) {
        map->graded[y * map->graded_stride_bytes + x] = (int8_t)value;
        return;
    }

    const size_t word = (size_t)y * (size_t)map->stride_words + (size_t)x / 64;
    const uint64_t bit = UINT64_C(1) << (x % 64);

    map->plus[word] = value > 0 ? map->plus[word] | bit : map->plus[word] & ~bit;
    if (map->minus)
        map->minus[word] = value < 0 ? map->minus[word] | bit : map->minus[word] & ~bit;
}

void edges_flood(struct shef_edge_map *map, double share, uint64_t seed)
{
    const double n_pixels = (double)map->width_px * map->height_px;
    const double already = (double)shef_edge_map_count(map) / n_pixels;
    const double chance = (share - already) / (1.0 - already);

    for (int32_t y = 0; y < map->height_px; y++)
        for (int32_t x = 0; x < map->width_px; x++)
            if (0.5 + 0.5 * lattice(seed, x, y) < chance)
                edge_set(map, x, y, 1);
}

struct shef_edge_map edges_mirrored(const struct shef_edge_map *map, bool in_x, bool in_y)
{
    struct shef_edge_map copy;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_edge_map_create(&copy, map->kind, map->width_px, map->height_px, &err),
        err.text);
    for (int32_t y = 0; y < map->height_px; y++)
        for (int32_t x = 0; x < map->width_px; x++)
            edge_set(&copy, in_x ? map->width_px - 1 - x : x, in_y ? map->height_px - 1 - y : y,
                     edge_at(map, x, y));
    return copy;
}

/* The result's images as a list, for what is done to each. */
static void list_images(struct shef_robust_output *output, struct shef_image_f32 *out_list[4])
{
    out_list[0] = &output->disparity;
    out_list[1] = &output->confidence;
    out_list[2] = &output->dense_disparity;
    out_list[3] = &output->dense_confidence;
}

struct result result_create(int32_t width_px, int32_t height_px)
{
    struct result result = { 0 };
    struct shef_image_f32 *images[4];
    struct shef_error err = { 0 };

    list_images(&result.images, images);
    for (int i = 0; i < 4; i++)
        TEST_ASSERT_EQUAL_MESSAGE(
            SHEF_OK, shef_image_create_f32(images[i], width_px, height_px, &err), err.text);
    return result;
}

void result_destroy(struct result *result)
{
    struct shef_image_f32 *images[4];

    list_images(&result->images, images);
    for (int i = 0; i < 4; i++)
        shef_image_destroy_f32(images[i]);
}

struct shef_robust *matcher_create(const struct shef_robust_params *params,
                                   struct shef_workers *workers)
{
    struct shef_error err = { 0 };
    struct shef_robust *matcher = shef_robust_create(params, shef_cpu_features(), workers, &err);

    TEST_ASSERT_NOT_NULL_MESSAGE(matcher, err.text);
    return matcher;
}

struct result match(struct shef_robust *matcher, const struct edges *edges, int64_t number)
{
    struct result result = result_create(edges->left.width_px, edges->left.height_px);
    const struct shef_edge_pair pair = edges_pair(edges);

    shef_robust_match(matcher, &pair, 1, number, &result.images, &result.report);
    return result;
}

void expect_at_most(double limit, double value, const char *what)
{
    char message[160];

    snprintf(message, sizeof message, "%s is %.4f, at most %.4f was expected", what, value, limit);
    TEST_ASSERT_TRUE_MESSAGE(value <= limit, message);
}

void expect_same_result(const struct result *expected, const struct result *actual)
{
    struct shef_robust_output copies[2] = { expected->images, actual->images };
    struct shef_image_f32 *one[4];
    struct shef_image_f32 *other[4];

    list_images(&copies[0], one);
    list_images(&copies[1], other);
    for (int i = 0; i < 4; i++)
        for (int32_t y = 0; y < one[i]->height_px; y++)
            TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(*one[i], y), shef_row_f32(*other[i], y),
                                     (size_t)one[i]->width_px * sizeof(float));
}

struct scene_error error_of(const struct scene *scene, const struct result *result,
                            int32_t border_px, int32_t step_px)
{
    struct scene_error error = { 0 };
    const int32_t first_x = (int32_t)ceil(scene->near_px) + border_px;
    int64_t n = 0;

    for (int32_t y = border_px; y < scene->height_px - border_px; y++)
        for (int32_t x = first_x; x < scene->width_px - border_px; x++) {
            if (scene->surface == SURFACE_STEPPED && abs(x - scene->width_px / 2) < step_px)
                continue;

            const double away = fabs((double)shef_row_f32(result->images.dense_disparity, y)[x] -
                                     scene_disparity_px(scene, x));

            error.mean_px += away;
            error.largest_px = fmax(error.largest_px, away);
            error.share_bad += away > 3.0;
            n++;
        }
    TEST_ASSERT_GREATER_THAN_INT64(0, n);
    error.mean_px /= (double)n;
    error.share_bad /= (double)n;
    return error;
}
