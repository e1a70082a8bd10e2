/* Edges in event maps sit where they are at mid-exposure, in both directions of motion.
 *
 * Textured rows slide past the sensor to the right and to the left at speeds of 0.01 to 0.35 m/s at
 * 1.5 m (profile `wide`, f 555 px: 3.7 to 129.5 px/s). The events run through filter, snapshots
 * and edge maps. A map's position is where it correlates best with the true signed gradient (or,
 * for a temporal pair, with the true difference) at the true mid-exposure: what the matcher does.
 *
 * The dead band of the events is a constant along the flow that depends on the texture: one lag
 * must do for all speeds. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "filter_model.h"
#include "moving_edges.h"
#include "pipeline/event_edges.h"
#include "pipeline/snapshot.h"

#define WIDTH_PX    256
#define HEIGHT_PX   96
#define PERIOD_US   18519
#define EXPOSURE_US 5000
#define FIRST_US    INT64_C(10000000)
#define MID_US      (FIRST_US + 300000)
#define PX_PER_M    (555.0 / 1.5)
#define MAX_METHODS 4

/* Few events at a time where motion is slow: more passes make up for it. */
static const struct {
    double m_s;
    int n_repeats;
} speeds[] = { { 0.01, 3 }, { 0.03, 2 }, { 0.1, 1 }, { 0.2, 1 }, { 0.35, 1 } };

#define N_SPEEDS 5

static const struct shef_test_texture usual = { .contrast = .8, .cell_px = 6, .blur_px = .7 };
static const struct shef_test_texture weak = { .contrast = .5, .cell_px = 6, .blur_px = .7 };
static const struct shef_test_texture strong = { .contrast = 1.2, .cell_px = 6, .blur_px = .7 };
static const struct shef_test_texture bars = {
    .contrast = .6, .cell_px = 25, .blur_px = .8, .alternates = true
};

static struct shef_test_scene scene;

void tearDown(void)
{
    shef_test_scene_destroy(&scene);
}

/* What a map is made of and how it is read. */
struct method {
    enum shef_edge_kind kind;
    enum shef_snapshot_read read;
    bool is_pair;
    double lag_px; /* taken back */
};

/* Part of the profile, on a sensor with a slightly longer lens along the rows: as on a real rig,
 * pixels of the profile lie anywhere between those of the sensor. */
static struct shef_rectification rectification(void)
{
    struct shef_rectification r = shef_rectification_wide();

    r.width_px = r.sensor_width_px = WIDTH_PX;
    r.height_px = r.sensor_height_px = HEIGHT_PX;
    r.cx_px = (WIDTH_PX - 1) / 2.0;
    r.camera.cx_px = r.cx_px + .37;
    r.camera.fx_px = 562;
    r.cy_px = r.camera.cy_px = (HEIGHT_PX - 1) / 2.0;
    return r;
}

/* Runs the events with the exposure signal of four frames, the third at MID_US, and returns the
 * third's snapshot and the second's. */
static void take_snapshots(struct shef_snapshots *snapshots, struct shef_event *events, uint32_t n,
                           const struct shef_snapshot *out_snapshots[2])
{
    struct shef_event_batch batch = {
        .events = events, .n_events = n, .base_us = FIRST_US, .reached_us = FIRST_US + 1000000
    };

    for (int i = 0; i < 4; i++)
        for (int edge = 0; edge < 2; edge++) {
            const int64_t t_us = MID_US + (i - 2) * PERIOD_US + (2 * edge - 1) * EXPOSURE_US / 2;
            uint32_t n_before = 0;

            while (n_before < n && FIRST_US + events[n_before].t_us <= t_us)
                n_before++;
            batch.triggers[batch.n_triggers++] =
                (struct shef_trigger){ .t_us = t_us, .n_before = n_before, .rising = edge == 0 };
        }
    shef_snapshots_feed(snapshots, &batch);
    for (uint64_t i = 0; i < 2; i++)
        TEST_ASSERT_EQUAL(SHEF_OK, shef_snapshot_pool_take(shef_snapshots_pool(snapshots), 2 - i,
                                                           &out_snapshots[i]));
    TEST_ASSERT_EQUAL_INT64(MID_US * 1000, out_snapshots[0]->mid.ns);
    TEST_ASSERT_EQUAL_INT64((MID_US - PERIOD_US) * 1000, out_snapshots[1]->mid.ns);
}

/* A pass of the picture at this speed, as rows of edge values. */
static void make_map(const struct method *method, double speed_px_s, struct shef_event *events,
                     uint32_t n_events, int8_t rows[HEIGHT_PX][WIDTH_PX])
{
    const struct shef_filter_params sensor = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);
    const struct shef_event_edges_params edge_params =
        shef_event_edges_default_params(method->kind);
    const struct shef_rectification r = rectification();
    struct shef_snapshot_params params = shef_snapshot_default_params();
    struct shef_filter *filter = shef_test_filter(&sensor);
    const struct shef_snapshot *taken[2];
    struct shef_snapshots *snapshots;
    struct shef_warp_map map;
    struct shef_warp_shift shift;
    struct shef_event_edges *edges;
    struct shef_edge_map edge_map;

    params.read = method->read;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_snapshots_create(&snapshots, filter, NULL, &params, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_warp_map_create(&map, &r, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_warp_shift_create(&shift, &map, NULL));
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_event_edges_create(&edges, &map, &edge_params, shef_cpu_features(), NULL));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&edge_map, method->kind, WIDTH_PX, HEIGHT_PX, NULL));
    take_snapshots(snapshots, events, n_events, taken);
    /* The picture moves against the camera. */
    shef_warp_shift_set(&shift, (double[3]){ -speed_px_s, 0, 0 }, method->lag_px);
    if (method->is_pair)
        shef_event_edges_of_pair(edges, taken[1]->sums, taken[0]->sums, &shift, &edge_map);
    else
        shef_event_edges_of_values(edges, taken[0]->values, &shift, &edge_map);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        shef_edge_map_row(&edge_map, y, rows[y]);

    for (int i = 0; i < 2; i++)
        shef_snapshot_pool_give(shef_snapshots_pool(snapshots), taken[i]);
    shef_edge_map_destroy(&edge_map);
    shef_event_edges_destroy(edges);
    shef_warp_shift_destroy(&shift);
    shef_warp_map_destroy(&map);
    shef_snapshots_destroy(snapshots);
    shef_filter_destroy(filter);
}

/* Where the scene's rows are seen by the profile's: both are linear. */
struct view {
    double first_px; /* by the profile's pixel 0 */
    double step_px;
};

static struct view view_of_profile(void)
{
    const struct shef_rectification r = rectification();
    double first_px;
    double second_px;
    double unused;

    TEST_ASSERT_TRUE(shef_rectification_project(&r, 0, 0, &first_px, &unused));
    TEST_ASSERT_TRUE(shef_rectification_project(&r, 1, 0, &second_px, &unused));
    return (struct view){ SHEF_TEST_SCENE_ORIGIN_PX + first_px, second_px - first_px };
}

/* What the frame shows at a place of the scene. */
static double truth(const struct method *method, double speed_px_s, int32_t y, double at)
{
    if (method->is_pair)
        return shef_test_scene_at(&scene, y, at) -
               shef_test_scene_at(&scene, y, at + speed_px_s * PERIOD_US * 1e-6);

    const double gradient =
        shef_test_scene_at(&scene, y, at + .5) - shef_test_scene_at(&scene, y, at - .5);
    const double rise = speed_px_s > 0 ? -gradient : gradient;

    return method->kind == SHEF_EDGE_UNSIGNED ? fabs(rise) : rise;
}

/* Normalised correlation with the truth moved by that much, its strong values clipped. */
static double correlation(const struct method *method, double speed_px_s,
                          int8_t rows[HEIGHT_PX][WIDTH_PX], double moved_px, double clip)
{
    const struct view view = view_of_profile();
    const int32_t margin_px = 8;
    double sum = 0;
    double rows_energy = 0;
    double truth_energy = 0;

    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = margin_px; x < WIDTH_PX - margin_px; x++) {
            const double at = view.first_px + view.step_px * (x - moved_px);
            const double value = truth(method, speed_px_s, y, at);
            const double wanted = value > clip ? clip : value < -clip ? -clip : value;

            sum += rows[y][x] * wanted;
            rows_energy += rows[y][x] * rows[y][x];
            truth_energy += wanted * wanted;
        }
    TEST_ASSERT_TRUE(rows_energy > 0);
    return sum / sqrt(rows_energy * truth_energy);
}

static int compare(const void *a, const void *b)
{
    const double x = *(const double *)a;
    const double y = *(const double *)b;

    return (x > y) - (x < y);
}

/* The 0.90 quantile of the truth, as graded maps are clipped. */
static double clip_of(const struct method *method, double speed_px_s)
{
    static double sizes[WIDTH_PX * HEIGHT_PX];
    const struct view view = view_of_profile();

    for (int32_t i = 0; i < WIDTH_PX * HEIGHT_PX; i++)
        sizes[i] = fabs(
            truth(method, speed_px_s, i / WIDTH_PX, view.first_px + view.step_px * (i % WIDTH_PX)));
    qsort(sizes, WIDTH_PX * HEIGHT_PX, sizeof sizes[0], compare);
    return sizes[WIDTH_PX * HEIGHT_PX * 9 / 10];
}

struct position {
    double px; /* right of the truth */
    double score;
};

static struct position position_of(const struct method *method, double speed_px_s,
                                   int8_t rows[HEIGHT_PX][WIDTH_PX])
{
    const double clip = clip_of(method, speed_px_s);
    double best_px = 0;
    double best = -2;

    /* Quarter pixels, then a parabola over tenths. */
    for (int i = -6; i <= 6; i++) {
        const double score = correlation(method, speed_px_s, rows, i * .25, clip);

        if (score > best) {
            best = score;
            best_px = i * .25;
        }
    }
    for (int round = 0; round < 2; round++) {
        const double below = correlation(method, speed_px_s, rows, best_px - .1, clip);
        const double here = correlation(method, speed_px_s, rows, best_px, clip);
        const double above = correlation(method, speed_px_s, rows, best_px + .1, clip);

        best_px += .05 * (below - above) / (below - 2 * here + above);
    }
    return (struct position){ best_px, best };
}

/* How far maps trail behind the truth at each speed: half the distance of two opposite passes. */
struct trail {
    double px[N_SPEEDS];
    double score[N_SPEEDS];
};

static void measure_pass(const struct method *methods, int n_methods, double speed_px_s,
                         uint64_t seed, struct position *out_positions)
{
    const struct shef_test_pass course = {
        .speed_px_s = speed_px_s,
        .first_us = FIRST_US,
        .mid_us = MID_US,
        .last_us = MID_US + 2 * PERIOD_US,
        .threshold = .2,
        .mismatch = .1,
    };
    struct shef_test_random random = { seed };
    struct shef_event *events;
    const uint32_t n = shef_test_scene_run(&scene, &course, &random, &events);

    for (int m = 0; m < n_methods; m++) {
        static int8_t rows[HEIGHT_PX][WIDTH_PX];

        make_map(&methods[m], speed_px_s, events, n, rows);
        out_positions[m] = position_of(&methods[m], speed_px_s, rows);
    }
    free(events);
}

static void measure(const struct method *methods, int n_methods, struct trail *out_trails)
{
    memset(out_trails, 0, (size_t)n_methods * sizeof *out_trails);
    for (int i = 0; i < N_SPEEDS; i++)
        for (int pass = 0; pass < 2 * speeds[i].n_repeats; pass++) {
            const int direction = pass % 2 ? -1 : 1;
            const double share = .5 / speeds[i].n_repeats;
            struct position positions[MAX_METHODS];

            measure_pass(methods, n_methods, direction * speeds[i].m_s * PX_PER_M,
                         40 + (uint64_t)pass, positions);
            for (int m = 0; m < n_methods; m++) {
                out_trails[m].px[i] -= direction * share * positions[m].px;
                out_trails[m].score[i] += share * positions[m].score;
            }
        }
}

static void print(const char *what, const struct trail *trail)
{
    printf("  %-18s", what);
    for (int i = 0; i < N_SPEEDS; i++)
        printf("  %+.3f (%.2f)", 2 * trail->px[i], trail->score[i]);
    printf("\n");
}

static void make_scene(const char *name, const struct shef_test_texture *texture)
{
    struct shef_test_random random = { 4 };

    tearDown();
    scene = shef_test_scene_create(texture, WIDTH_PX, HEIGHT_PX, &random);
    printf("%s: distance of opposite passes in px (correlation) at", name);
    for (int i = 0; i < N_SPEEDS; i++)
        printf(" %.2f", speeds[i].m_s);
    printf(" m/s\n");
}

static void test_opposite_passes_agree_at_every_speed(void)
{
    static const struct method methods[] = {
        { SHEF_EDGE_GRADED, SHEF_SNAPSHOT_CENTRED, false, SHEF_EVENT_EDGES_LAG_PX },
        { SHEF_EDGE_TERNARY, SHEF_SNAPSHOT_CENTRED, false, SHEF_EVENT_EDGES_LAG_PX },
        { SHEF_EDGE_UNSIGNED, SHEF_SNAPSHOT_CENTRED, false, SHEF_EVENT_EDGES_LAG_PX },
        { SHEF_EDGE_GRADED, SHEF_SNAPSHOT_CENTRED, true, SHEF_EVENT_EDGES_LAG_PX },
    };
    static const char *const names[] = { "graded", "ternary", "unsigned", "temporal pair" };
    struct trail trails[4];

    make_scene("usual texture, lag taken back", &usual);
    measure(methods, 4, trails);
    for (int m = 0; m < 4; m++)
        print(names[m], &trails[m]);
    for (int m = 0; m < 4; m++)
        for (int i = 0; i < N_SPEEDS; i++)
            TEST_ASSERT_TRUE(fabs(2 * trails[m].px[i]) <= 0.1);
}

/* Whether one lag makes opposite passes agree that well at all speeds. */
static void expect_one_lag(const struct trail *trail, double tolerance_px)
{
    double least = trail->px[0];
    double most = trail->px[0];

    for (int i = 1; i < N_SPEEDS; i++) {
        least = fmin(least, trail->px[i]);
        most = fmax(most, trail->px[i]);
    }
    printf("    a lag of %.2f px leaves %.3f px\n", (least + most) / 2, most - least);
    TEST_ASSERT_TRUE(least > 0);
    TEST_ASSERT_TRUE(most - least <= tolerance_px);
}

static void test_other_textures_have_other_lags_but_one_for_all_speeds(void)
{
    static const struct method methods[] = {
        { SHEF_EDGE_GRADED, SHEF_SNAPSHOT_CENTRED, false, 0 },
        { SHEF_EDGE_GRADED, SHEF_SNAPSHOT_CENTRED, true, 0 },
    };
    static const struct {
        const char *name;
        const struct shef_test_texture *texture;
        double tolerance_px;
    } textures[] = {
        { "weak texture", &weak, .1 },
        { "strong texture", &strong, .1 },
        /* Nothing but single edges far apart: clipping at a quantile of mostly empty pixels. */
        { "bars", &bars, .15 },
    };
    struct trail trails[2];

    for (int i = 0; i < 3; i++) {
        make_scene(textures[i].name, textures[i].texture);
        measure(methods, 2, trails);
        print("graded", &trails[0]);
        expect_one_lag(&trails[0], textures[i].tolerance_px);
        print("temporal pair", &trails[1]);
        expect_one_lag(&trails[1], textures[i].tolerance_px);
    }
}

static void test_the_other_read_outs_do_not_agree(void)
{
    static const struct method methods[] = {
        { SHEF_EDGE_GRADED, SHEF_SNAPSHOT_AT_MID, false, SHEF_EVENT_EDGES_LAG_PX },
        { SHEF_EDGE_GRADED, SHEF_SNAPSHOT_LATE, false, SHEF_EVENT_EDGES_LAG_PX },
    };
    const int fastest = N_SPEEDS - 1;
    struct trail trails[2];

    make_scene("usual texture, lag taken back", &usual);
    measure(methods, 2, trails);
    print("at mid-exposure", &trails[0]);
    print("1 / cutoff later", &trails[1]);
    TEST_ASSERT_TRUE(2 * trails[0].px[fastest] > 1.2);
    TEST_ASSERT_TRUE(fabs(2 * trails[1].px[fastest]) < .7);
    TEST_ASSERT_TRUE(fabs(2 * trails[1].px[fastest]) > .3);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_opposite_passes_agree_at_every_speed);
    RUN_TEST(test_other_textures_have_other_lags_but_one_for_all_speeds);
    RUN_TEST(test_the_other_read_outs_do_not_agree);
    return UNITY_END();
}
