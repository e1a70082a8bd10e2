#include "depth_rig.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "moving_edges.h"

#define WIDTH_PX    640
#define HEIGHT_PX   480
#define FIRST_US    100000
#define MID_US      190000 /* of the third frame */
#define PERIOD_US   18518
#define EXPOSURE_US 5000
#define LAST_US     260000
#define BAND_PX     12 /* rows of one texture */
#define GREY        70.0

/* Rows in bands of one texture, so that a lens may mix neighbouring rows. */
static void widen_rows(struct shef_test_scene *scene)
{
    const size_t n = (size_t)scene->n_knots;

    for (int32_t y = 0; y < scene->height_px; y++)
        if (y % BAND_PX != 0)
            memcpy(scene->knots + (size_t)y * n, scene->knots + (size_t)(y - y % BAND_PX) * n,
                   n * sizeof *scene->knots);
}

/* The frame camera's picture at an instant: ideal cameras, both looking straight ahead. */
static void draw_frame(const struct depth_rig *rig, const struct shef_test_scene *scene,
                       int64_t t_us, struct shef_image_u8 frame)
{
    const struct shef_camera_model *camera = &rig->calibration.frame.model;
    const struct shef_camera_model *event = &rig->calibration.event.model;
    const double moved_px = DEPTH_RIG_SPEED * (double)(t_us - MID_US) * 1e-6;

    for (int32_t v = 0; v < frame.height_px; v++) {
        const double y = (v - camera->cy_px) / camera->fy_px * event->fy_px + event->cy_px;
        const int32_t row = (int32_t)lrint(fmin(fmax(y, 0), HEIGHT_PX - 1));

        for (int32_t u = 0; u < frame.width_px; u++) {
            const double x = (u - camera->cx_px) / camera->fx_px * event->fx_px + event->cx_px -
                             DEPTH_RIG_DISPARITY;
            const double at = fmin(fmax(x - moved_px, -300), 690) + SHEF_TEST_SCENE_ORIGIN_PX;

            shef_row_u8(frame, v)[u] =
                (uint8_t)fmin(GREY * exp(shef_test_scene_at(scene, row, at)) + 0.5, 255);
        }
    }
}

static void take_snapshots(struct depth_rig *rig, struct shef_event *events, uint32_t n)
{
    static struct shef_event_batch batch;

    batch = (struct shef_event_batch){
        .events = events, .n_events = n, .base_us = FIRST_US, .reached_us = LAST_US + 100000
    };
    for (int i = 0; i < DEPTH_RIG_FRAMES; i++)
        for (int edge = 0; edge < 2; edge++) {
            const int64_t t_us = MID_US + (i - 2) * PERIOD_US + (2 * edge - 1) * EXPOSURE_US / 2;
            uint32_t n_before = 0;

            while (n_before < n && FIRST_US + events[n_before].t_us <= t_us)
                n_before++;
            batch.triggers[batch.n_triggers++] =
                (struct shef_trigger){ .t_us = t_us, .n_before = n_before, .rising = edge == 0 };
        }
    shef_snapshots_feed(rig->source, &batch);
    for (uint64_t i = 0; i < DEPTH_RIG_FRAMES; i++)
        TEST_ASSERT_EQUAL(SHEF_OK, shef_snapshot_pool_take(shef_snapshots_pool(rig->source), i,
                                                           &rig->snapshots[i]));
}

void depth_rig_make(struct depth_rig *rig)
{
    const struct shef_test_texture texture = { .contrast = 0.6, .cell_px = 7, .blur_px = 0.7 };
    const struct shef_test_pass pass = {
        .speed_px_s = DEPTH_RIG_SPEED,
        .first_us = FIRST_US,
        .mid_us = MID_US,
        .last_us = LAST_US,
        .threshold = 0.2,
        .mismatch = 0.1,
    };
    const struct shef_filter_params filter = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);
    const struct shef_snapshot_params params = shef_snapshot_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct shef_test_scene scene = shef_test_scene_create(&texture, WIDTH_PX, HEIGHT_PX, &random);
    struct shef_event *events;

    memset(rig, 0, sizeof *rig);
    rig->calibration = shef_calibration_paper_rig();
    /* Far enough for the disparity: 80 px/s there are 0.42 m/s. */
    rig->velocity_m_s[0] = -DEPTH_RIG_SPEED * 0.06544 / DEPTH_RIG_DISPARITY;
    widen_rows(&scene);
    for (int i = 0; i < DEPTH_RIG_FRAMES; i++) {
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_image_create_u8(&rig->frames[i], rig->calibration.frame.width_px,
                                               rig->calibration.frame.height_px, NULL));
        draw_frame(rig, &scene, MID_US + (i - 2) * PERIOD_US, rig->frames[i]);
    }
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_filter_create(&rig->filter, &filter, shef_cpu_features(), NULL));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_snapshots_create(&rig->source, rig->filter, NULL, &params, NULL));

    const uint32_t n = shef_test_scene_run(&scene, &pass, &random, &events);

    take_snapshots(rig, events, n);
    free(events);
    shef_test_scene_destroy(&scene);
}

void depth_rig_free(struct depth_rig *rig)
{
    for (int i = 0; i < DEPTH_RIG_FRAMES; i++) {
        shef_snapshot_pool_give(shef_snapshots_pool(rig->source), rig->snapshots[i]);
        shef_image_destroy_u8(&rig->frames[i]);
    }
    shef_snapshots_destroy(rig->source);
    shef_filter_destroy(rig->filter);
}

struct shef_depth_report depth_rig_process(const struct depth_rig *rig,
                                           struct shef_depth_chain *chain, int i, bool has_velocity,
                                           const struct shef_depth_output *output)
{
    struct shef_depth_input input = {
        .number = i,
        .frame = rig->frames[i],
        .snapshot = rig->snapshots[i],
        .has_velocity = has_velocity,
    };
    struct shef_depth_report report;

    memcpy(input.velocity_m_s, rig->velocity_m_s, sizeof input.velocity_m_s);
    shef_depth_chain_process(chain, &input, output, &report);
    return report;
}

struct shef_depth_report depth_rig_process_all(const struct depth_rig *rig,
                                               struct shef_depth_chain *chain, bool has_velocity,
                                               const struct shef_depth_output *output)
{
    struct shef_depth_report report = { 0 };

    for (int i = 0; i < DEPTH_RIG_FRAMES; i++)
        report = depth_rig_process(rig, chain, i, has_velocity, output);
    return report;
}

struct depth_rig_verdict depth_rig_judge(struct shef_image_f32 disparity)
{
    struct depth_rig_verdict verdict = { 0 };
    int64_t n_good = 0;
    double sum = 0;

    for (int32_t y = 10; y < disparity.height_px - 10; y++)
        for (int32_t x = 40; x < disparity.width_px - 20; x++) {
            const double error = shef_row_f32(disparity, y)[x] - DEPTH_RIG_DISPARITY;

            if (!(shef_row_f32(disparity, y)[x] > 0))
                continue;
            verdict.n++;
            if (fabs(error) <= 1) {
                n_good++;
                sum += error;
            }
        }
    verdict.good = (double)n_good / (double)verdict.n;
    verdict.mean_px = sum / (double)n_good;
    return verdict;
}
