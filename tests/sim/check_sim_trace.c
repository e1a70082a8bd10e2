/* Every implementation of the ray kernels against the C reference, on made-up tiles. */
#include <stdio.h>
#include <string.h>
#include <unity.h>

#include "core/cpu.h"
#include "shefsim/kernels/trace.h"
#include "support/support.h"

#define N_TILES    400
#define MAX_ROWS   16
#define MAX_SUBS   9
#define N_SURFACES 6
#define SIDE       37 /* squares of a texture */

static uint16_t pairs[(SIDE + 1) * SIDE];
static float rays[MAX_ROWS * MAX_SUBS * 2 * SIM_TRACE_LANES];
static struct sim_trace_surface surfaces[N_SURFACES];
static const struct sim_trace_surface *list[N_SURFACES];
static struct shef_test_random numbers;

static const struct sim_trace_kernels *const others[] = {
#if defined(__x86_64__)
    &sim_trace_kernels_avx2,
    &sim_trace_kernels_avx512,
#elif defined(__aarch64__)
    &sim_trace_kernels_neon,
#endif
    &sim_trace_kernels_c,
};

static float even(double low, double high)
{
    return (float)(low + (high - low) * shef_test_random_unit(&numbers));
}

static void fill(float *to, int n, double low, double high)
{
    for (int i = 0; i < n; i++)
        to[i] = even(low, high);
}

/* Surfaces within a few metres ahead, cut by the tile in any way; some are behind the camera, some
 * so oblique that coordinates overflow. */
static void make_surface(struct sim_trace_surface *s)
{
    memset(s, 0, sizeof *s);
    s->kind = (enum sim_surface_kind)shef_test_random_range(&numbers, 0, 3);
    s->object = shef_test_random_range(&numbers, 0, 900);
    fill(s->inverse_depth, 3, -.3, .6);
    fill(s->u, 3, -20, 20);
    fill(s->v, 3, -20, 20);
    fill(&s->local[0][0], 9, -1, 1);
    fill(s->origin, 3, -2.5, 1);
    s->clip[0] = shef_test_random_range(&numbers, 0, 1) ? -1 : 0;
    s->clip[1] = 1;
    s->pairs = pairs;
    s->pitch = SIDE + 1;
    s->last_u = s->last_v = SIDE - 1;
    s->max_u = s->max_v = SIDE;
    s->light = 1e-5f;
    s->gloss = shef_test_random_range(&numbers, 0, 2) ? 0 : .4f;
    s->sharpness = shef_test_random_range(&numbers, 1, 8);
    fill(&s->world[0][0], 9, -1, 1);
    fill(s->lamp, 3, -2, 2);
    fill(&s->normal[0][0], 9, -1, 1);
}

static struct sim_trace_tile make_tile(void)
{
    struct sim_trace_tile tile = {
        .rays = rays,
        .n_rows = shef_test_random_range(&numbers, 1, MAX_ROWS),
        .n_subs = shef_test_random_range(&numbers, 1, MAX_SUBS),
        .surfaces = list,
        .n_surfaces = shef_test_random_range(&numbers, 0, N_SURFACES),
        .background = .02f,
    };

    fill(rays, MAX_ROWS * MAX_SUBS * 2 * SIM_TRACE_LANES, -.8, .8);
    for (int i = 0; i < N_SURFACES; i++) {
        make_surface(&surfaces[i]);
        list[i] = &surfaces[i];
    }
    tile.is_covered = tile.n_surfaces == 1;
    return tile;
}

void setUp(void)
{
    numbers = shef_test_random_start();
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++)
        pairs[i] = (uint16_t)shef_test_random_u64(&numbers);
}

static void test_light_is_the_same_to_the_last_bit(void)
{
    static float expected[MAX_ROWS * SIM_TRACE_LANES];
    static float found[MAX_ROWS * SIM_TRACE_LANES];

    for (int n = 0; n < N_TILES; n++) {
        const struct sim_trace_tile tile = make_tile();

        memset(expected, 0, sizeof expected);
        sim_trace_kernels_c.light(&tile, expected);
        for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
            if ((others[k]->cpu_features & shef_cpu_features()) != others[k]->cpu_features)
                continue;
            memset(found, 0, sizeof found);
            others[k]->light(&tile, found);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expected, found, sizeof expected, others[k]->name);
        }
    }
}

static void test_depth_is_the_same_to_the_last_bit(void)
{
    static float expected[2][MAX_ROWS * SIM_TRACE_LANES];
    static int32_t objects[2][MAX_ROWS * SIM_TRACE_LANES];
    int64_t n_hit = 0;

    for (int n = 0; n < N_TILES; n++) {
        struct sim_trace_tile tile = make_tile();

        tile.n_subs = 1;
        memset(expected, 0, sizeof expected);
        memset(objects, 0, sizeof objects);
        sim_trace_kernels_c.depth(&tile, expected[0], objects[0]);
        for (int i = 0; i < tile.n_rows * SIM_TRACE_LANES; i++)
            n_hit += objects[0][i] != SIM_TRACE_NOTHING;
        for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
            if ((others[k]->cpu_features & shef_cpu_features()) != others[k]->cpu_features)
                continue;
            others[k]->depth(&tile, expected[1], objects[1]);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expected[0], expected[1], sizeof expected[0],
                                             others[k]->name);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(objects[0], objects[1], sizeof objects[0],
                                             others[k]->name);
        }
    }
    TEST_ASSERT_GREATER_THAN(N_TILES * 10, n_hit);
}

int main(void)
{
    for (size_t k = 0; k < sizeof others / sizeof *others; k++)
        if ((others[k]->cpu_features & shef_cpu_features()) != others[k]->cpu_features)
            printf("%s: not on this machine\n", others[k]->name);
    UNITY_BEGIN();
    RUN_TEST(test_light_is_the_same_to_the_last_bit);
    RUN_TEST(test_depth_is_the_same_to_the_last_bit);
    return UNITY_END();
}
