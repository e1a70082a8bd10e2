/* The filter on real recordings, hot pixels included, against double precision. */
#include <stdio.h>
#include <stdlib.h>

#include "codecs/event_reader.h"
#include "core/cpu.h"
#include "filter_model.h"
#include "pipeline/hot_pixels.h"

static struct shef_filter *filter;

void tearDown(void)
{
    shef_filter_destroy(filter);
    filter = NULL;
}

/* After each event its pixel is compared, in the end all pixels. */
static void expect_close_to_double(const char *name, uint64_t n_expected, double largest_c)
{
    struct shef_event_reader *reader;
    struct shef_error err = { 0 };
    struct shef_event_batch batch = { .capacity = SHEF_BATCH_EVENTS };
    char path[1024];

    snprintf(path, sizeof path, "%s/%s", shef_test_data("events"), name);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_event_reader_open(path, shef_cpu_features(), &reader, &err), err.text);

    const struct shef_event_file_info *info = shef_event_reader_info(reader);
    const struct shef_filter_params params =
        shef_filter_default_params((int32_t)info->width_px, (int32_t)info->height_px);
    struct shef_test_model model = shef_test_model_create(&params);
    int64_t newest_us = 0;

    filter = shef_test_filter(&params);
    batch.events = calloc(batch.capacity, sizeof *batch.events);
    TEST_ASSERT_NOT_NULL(batch.events);
    while (shef_event_reader_next(reader, &batch, &err) == SHEF_OK)
        for (uint32_t i = 0; i < batch.n_events; i++) {
            const struct shef_event event = batch.events[i];
            const int32_t x = event.x_px;
            const int32_t y = shef_event_y_px(event);

            newest_us = shef_event_batch_time_us(&batch, i);
            TEST_ASSERT_EQUAL_UINT32(
                1, shef_filter_apply(filter, &event, 1, batch.base_us, SHEF_TEST_FOREVER));
            shef_test_model_apply(&model, event, batch.base_us);
            shef_test_model_compare_pixel(&model, filter, x, y, newest_us);
        }
    shef_test_model_compare(&model, filter, newest_us + 3000);
    printf("%s: worst error %.2e steps, largest level %.0f\n", name, model.worst_c,
           model.largest_c);
    TEST_ASSERT_EQUAL_UINT64(n_expected, shef_filter_stats(filter).n_events);
    TEST_ASSERT_TRUE(model.worst_c <= 2e-4);
    TEST_ASSERT_TRUE(model.largest_c >= largest_c);
    free(batch.events);
    shef_event_reader_close(reader);
    shef_test_model_destroy(&model);
}

static void test_a_recording_with_hot_pixels_stays_close_to_double_precision(void)
{
    SHEF_TEST_NEEDS_DATA("events");
    expect_close_to_double("evt2_sample.raw", 539481, 500);
}

static void test_a_recording_of_a_larger_sensor_does_too(void)
{
    SHEF_TEST_NEEDS_DATA("events");
    expect_close_to_double("evt3_sample.raw", 219596, 3);
}

/* One pixel of this recording fires every 15 us, for all of its 50 ms. */
static void test_the_hot_pixel_of_a_recording_is_learnt(void)
{
    struct shef_event_reader *reader;
    struct shef_error err = { 0 };
    struct shef_event_batch batch = { .capacity = SHEF_BATCH_EVENTS };
    struct shef_hot_pixels_params params = shef_hot_pixels_default_params(640, 480);
    struct shef_hot_pixels *hot;
    const struct shef_hot_pixel *pixels;
    const uint32_t *indices;
    char path[1024];
    bool is_found = false;

    SHEF_TEST_NEEDS_DATA("events");
    snprintf(path, sizeof path, "%s/evt2_sample.raw", shef_test_data("events"));
    params.window_ms = 10;
    params.limit_per_s = 20000;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_hot_pixels_create(&hot, &params, &err));
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_event_reader_open(path, shef_cpu_features(), &reader, &err), err.text);
    batch.events = calloc(batch.capacity, sizeof *batch.events);
    TEST_ASSERT_NOT_NULL(batch.events);
    while (shef_event_reader_next(reader, &batch, &err) == SHEF_OK)
        for (uint32_t i = 0; i < batch.n_events; i++) {
            const shef_event_time at = shef_test_us(shef_event_batch_time_us(&batch, i));

            if (shef_hot_pixels_due(hot).ns == INT64_MAX)
                shef_hot_pixels_start(hot, at);
            if (shef_event_time_before(shef_hot_pixels_due(hot), at))
                shef_hot_pixels_learn(hot, shef_hot_pixels_due(hot));
            shef_hot_pixels_count(hot, batch.events + i, 1);
        }

    const uint32_t n_hot = shef_hot_pixels_list(hot, &pixels, &indices);

    for (uint32_t i = 0; i < n_hot; i++) {
        printf("hot: (%d, %d), %.0f events a second\n", pixels[i].x_px, pixels[i].y_px,
               (double)pixels[i].per_s);
        is_found |= pixels[i].per_s > 50000 && pixels[i].per_s < 80000;
    }
    TEST_ASSERT_TRUE(is_found);
    TEST_ASSERT_LESS_THAN_UINT32(20, n_hot);
    free(batch.events);
    shef_event_reader_close(reader);
    shef_hot_pixels_destroy(hot);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_recording_with_hot_pixels_stays_close_to_double_precision);
    RUN_TEST(test_a_recording_of_a_larger_sensor_does_too);
    RUN_TEST(test_the_hot_pixel_of_a_recording_is_learnt);
    return UNITY_END();
}
