/* Depth as a subscriber gets it: against the offline chain's, and against the truth. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/cpu.h"
#include "played.h"
#include "record/recorded_truth.h"
#include "service/live.h"
#include "sheftool/run_chain.h"
#include "support/support.h"
#include "wire.h"

/* Numbers on the wire are rounded; those half way, as floats below 65536 go, to either side. */
#define ROUNDING (1.0 / 128)
#define HAIR     1e-6

/* What the service published of the recording, and its newest result. */
struct published {
    struct wire_log log;
    struct shef_service *service;
    struct shef_result *newest;
    int32_t n_compared; /* frames */
    bool saw_newest;
};

static void publish(struct published *published, const char *mode, enum shef_config_grid grid)
{
    struct shef_config config = played_config();
    char path[256];

    snprintf(path, sizeof path, "%s", shef_test_temp_path("log"));
    snprintf(config.lcm.url, sizeof config.lcm.url, "file://%s", path);
    snprintf(config.depth.mode, sizeof config.depth.mode, "%s", mode);
    config.lcm.grid = grid;
    config.lcm.dense = true;
    *published = (struct published){ .service = played_start(&config) };
    played_wait(published->service);
    published->newest = shef_playback_newest(published->service->playback);
    TEST_ASSERT_NOT_NULL(published->newest);
    wire_log_read(&published->log, path);
    unlink(path);
}

static void release(struct published *published)
{
    shef_result_give(published->newest);
    shef_service_stop(published->service);
    shef_service_destroy(published->service);
    wire_log_free(&published->log);
}

/* ---- against the offline chain ----------------------------------------------------------- */

static void expect_same_images(struct shef_image_f32 offline, struct shef_image_f32 live)
{
    TEST_ASSERT_EQUAL_INT32(offline.width_px, live.width_px);
    TEST_ASSERT_EQUAL_INT32(offline.height_px, live.height_px);
    for (int32_t y = 0; y < offline.height_px; y++)
        TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(offline, y), shef_row_f32(live, y),
                                 (size_t)offline.width_px * sizeof(float));
}

static void expect_same_bits(const struct shef_run_frame *frame, const struct shef_result *result)
{
    const struct shef_depth_output *offline = frame->output;

    TEST_ASSERT_EQUAL_INT32(frame->report->mode, result->mode);
    expect_same_images(offline->disparity, result->disparity);
    expect_same_images(offline->confidence, result->confidence);
    expect_same_images(offline->depth_m, result->depth_m);
    expect_same_images(offline->sigma_m, result->sigma_m);
    TEST_ASSERT_EQUAL(!(frame->report->flags & SHEF_DEPTH_NO_CONFIDENCE), result->has_dense);
    if (!result->has_dense)
        return;
    expect_same_images(offline->dense_disparity, result->dense_disparity);
    expect_same_images(offline->dense_confidence, result->dense_confidence);
}

/* The pixel that stands for a cell, by disparity_t: the most confident one; of several the upper,
 * then the left one. -1: none. */
static int32_t pixel_of_cell(const struct shef_depth_output *output, int32_t step, int32_t gx,
                             int32_t gy)
{
    const int32_t width_px = output->disparity.width_px;
    float most = -1;
    int32_t best = -1;

    for (int32_t y = gy * step; y < (gy + 1) * step; y++)
        for (int32_t x = gx * step; x < (gx + 1) * step; x++)
            if (shef_row_f32(output->disparity, y)[x] > 0 &&
                shef_row_f32(output->confidence, y)[x] > most) {
                most = shef_row_f32(output->confidence, y)[x];
                best = y * width_px + x;
            }
    return best;
}

/* The least number that depth_t can say and that is not below sigma; the largest if none is. */
static double sigma_on_the_wire(double sigma_m)
{
    double least_m = 0;

    for (int code = 0; code < 256 && least_m < sigma_m; code++)
        least_m = 0.00025 * (1 + (code & 15) / 16.0) * (double)(1 << (code >> 4));
    return least_m;
}

static void expect_cell(const struct wire_frame *wire, int32_t cell,
                        const struct shef_depth_output *offline, int32_t pixel)
{
    const int32_t y = pixel / wire->width_px, x = pixel % wire->width_px;
    const double depth_m = (double)shef_row_f32(offline->depth_m, y)[x];
    const double sigma_m = (double)shef_row_f32(offline->sigma_m, y)[x];

    if (wire->depths[cell] == 0) {
        TEST_ASSERT_TRUE(depth_m > 65535.5 * 0.00025 - HAIR);
        return;
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.5 + ROUNDING, depth_m * 4000, wire->depths[cell]);
    /* Within the rounding of the unit, which is a float. */
    TEST_ASSERT_TRUE(wire_sigma_m(wire, cell) >= sigma_on_the_wire(sigma_m * (1 - HAIR)) - 1e-9 &&
                     wire_sigma_m(wire, cell) <=
                         sigma_on_the_wire(sigma_m * (1 + HAIR)) * (1 + HAIR));
}

static enum shef_err compare(void *context, const struct shef_run_frame *frame,
                             struct shef_error *err)
{
    struct published *published = context;
    const int64_t seq = (int64_t)frame->frame->info.number;
    const struct wire_frame *wire = wire_log_frame(&published->log, seq);
    int32_t n_points = 0;

    (void)err;
    TEST_ASSERT_NOT_NULL_MESSAGE(wire, "a frame of the offline chain was not published");
    TEST_ASSERT_EQUAL_INT64(frame->snapshot->mid.ns / 1000, wire->event_us);
    TEST_ASSERT_EQUAL_INT32(frame->report->mode, wire->mode);
    TEST_ASSERT_EQUAL_INT32(0, wire->shed_bits);
    for (int32_t cell = 0; cell < wire->grid_w * wire->grid_h; cell++) {
        const int32_t pixel =
            pixel_of_cell(frame->output, wire->grid_step, cell % wire->grid_w, cell / wire->grid_w);

        n_points += wire->depths[cell] != 0;
        if (pixel < 0)
            TEST_ASSERT_EQUAL_UINT16(0, wire->depths[cell]);
        else
            expect_cell(wire, cell, frame->output, pixel);
    }
    TEST_ASSERT_EQUAL_INT32(wire->n_points, n_points);
    TEST_ASSERT_GREATER_THAN_INT32(5000, n_points);
    published->n_compared++;
    if ((uint64_t)seq == published->newest->seq) {
        expect_same_bits(frame, published->newest);
        published->saw_newest = true;
    }
    return SHEF_OK;
}

static void expect_mode_as_offline(enum shef_depth_mode mode, enum shef_config_grid grid)
{
    const struct shef_config config = played_config();
    struct shef_run_settings settings = {
        .recording = played_recording(),
        .modes = { mode },
        .n_modes = 1,
        .depth = shef_depth_default_params(),
        .read = SHEF_SNAPSHOT_CENTRED,
        .look_ahead = config.depth.look_ahead,
        .n_threads = 1,
        .cpu_features = shef_cpu_features(),
    };
    struct shef_error err = { 0 };
    struct published published;
    struct shef_run *run = NULL;

    publish(&published, shef_depth_mode_name(mode), grid);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_run_open(&run, &settings, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_run_all(run, compare, &published, &err), err.text);
    shef_run_close(run);
    TEST_ASSERT_EQUAL_INT32(published.log.n_frames, published.n_compared);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(PLAYED_FRAMES - 2, published.n_compared);
    TEST_ASSERT_TRUE(published.saw_newest);
    release(&published);
}

static void test_stepped_depth_is_the_offline_chains_in_the_default_mode(void)
{
    const struct shef_config config = played_config();

    expect_mode_as_offline(shef_live_mode_of(config.depth.mode), SHEF_GRID_HALF);
}

static void test_stepped_depth_is_the_offline_chains_with_two_pairs(void)
{
    expect_mode_as_offline(SHEF_DEPTH_COMBINED, SHEF_GRID_FULL);
}

static void test_stepped_depth_is_the_offline_chains_in_the_papers_modes(void)
{
    expect_mode_as_offline(SHEF_DEPTH_PAPER_DS, SHEF_GRID_HALF);
    expect_mode_as_offline(SHEF_DEPTH_PAPER_DP, SHEF_GRID_FULL);
}

/* ---- against the truth ------------------------------------------------------------------- */

#define MAX_POINTS 2000000

struct errors {
    float relative[MAX_POINTS]; /* |Z - truth| / truth */
    int32_t n;
    int32_t n_bad; /* more than 1 px of disparity off */
    int32_t n_within_sigma;
    int32_t n_bad_guesses; /* the same, had all points the depth of the nearest surface */
    int32_t n_frames;
};

static int ascending(const void *a, const void *b)
{
    const float x = *(const float *)a, y = *(const float *)b;

    return (x > y) - (x < y);
}

/* Scores a frame of full resolution: its cells are pixels. */
static void score(const struct wire_frame *wire, const struct shef_truth_maps *maps,
                  struct errors *errors)
{
    const double fb = wire->f_px * wire->baseline_m;
    double nearest_m = INFINITY;

    TEST_ASSERT_EQUAL_INT32(1, wire->grid_step);
    for (int32_t cell = 0; cell < wire->grid_w * wire->grid_h; cell++) {
        const float truth_m = shef_row_f32(maps->depth_m, cell / wire->grid_w)[cell % wire->grid_w];

        if (truth_m > 0 && (double)truth_m < nearest_m)
            nearest_m = (double)truth_m;
    }
    for (int32_t cell = 0; cell < wire->grid_w * wire->grid_h; cell++) {
        const int32_t y = cell / wire->grid_w, x = cell % wire->grid_w;
        const double truth_m = (double)shef_row_f32(maps->depth_m, y)[x];

        if (wire->depths[cell] == 0 || shef_row_u8(maps->mask, y)[x] != SHEF_TRUTH_VALID)
            continue;
        TEST_ASSERT_LESS_THAN_INT32(MAX_POINTS, errors->n);

        const double error_m = fabs(wire_depth_m(wire, cell) - truth_m);

        errors->relative[errors->n++] = (float)(error_m / truth_m);
        errors->n_bad += fabs(fb / wire_depth_m(wire, cell) - fb / truth_m) > 1;
        errors->n_within_sigma += error_m <= wire_sigma_m(wire, cell);
        errors->n_bad_guesses += fabs(fb / nearest_m - fb / truth_m) > 1;
    }
    errors->n_frames++;
}

static void expect_near_truth(const char *mode, double most_bad, double most_median,
                              double least_within)
{
    static struct errors errors;
    struct shef_recorded_truth truth;
    struct shef_error err = { 0 };
    struct published published;
    char text[160];

    memset(&errors, 0, sizeof errors);
    publish(&published, mode, SHEF_GRID_FULL);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_recorded_truth_open(played_recording(), &truth, &err),
                              err.text);
    for (int32_t i = 0; i < published.log.n_frames; i++) {
        const struct wire_frame *wire = &published.log.frames[i];
        struct shef_truth_maps maps;

        /* The first frame has no past to compare with, and is matched in another way. */
        if (wire->seq == 0 ||
            shef_recorded_truth_maps(&truth, SHEF_TRUTH_LEFT, (uint64_t)wire->seq, &maps, &err))
            continue;
        score(wire, &maps, &errors);
        shef_truth_maps_free(&maps);
    }
    shef_recorded_truth_close(&truth);
    release(&published);

    TEST_ASSERT_GREATER_OR_EQUAL_INT32(4, errors.n_frames);
    TEST_ASSERT_GREATER_THAN_INT32(100000, errors.n);
    qsort(errors.relative, (size_t)errors.n, sizeof *errors.relative, ascending);

    const double n = errors.n;
    const double median = (double)errors.relative[errors.n / 2];

    snprintf(text, sizeof text,
             "%s: %.2f %% bad-1, median %.2f %%, %.1f %% within sigma; guessing: %.0f %% bad-1",
             mode, 100 * errors.n_bad / n, 100 * median, 100 * errors.n_within_sigma / n,
             100 * errors.n_bad_guesses / n);
    TEST_ASSERT_TRUE_MESSAGE(errors.n_bad / n <= most_bad, text);
    TEST_ASSERT_TRUE_MESSAGE(median <= most_median, text);
    TEST_ASSERT_TRUE_MESSAGE(errors.n_within_sigma / n >= least_within, text);
    /* The scene is not so flat that any depth would do. */
    TEST_ASSERT_TRUE_MESSAGE(errors.n_bad_guesses / n > 0.5, text);
    TEST_MESSAGE(text);
}

static void test_published_depth_is_near_the_truth(void)
{
    expect_near_truth("temporal", 0.02, 0.009, 0.7);
    expect_near_truth("combined", 0.02, 0.009, 0.7);
    expect_near_truth("paper-dp", 0.15, 0.018, 0.3);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_stepped_depth_is_the_offline_chains_in_the_default_mode);
    RUN_TEST(test_stepped_depth_is_the_offline_chains_with_two_pairs);
    RUN_TEST(test_stepped_depth_is_the_offline_chains_in_the_papers_modes);
    RUN_TEST(test_published_depth_is_near_the_truth);
    return UNITY_END();
}
