/* Snapshots of a stream in which all goes well. */
#include "pipeline/snapshot.h"

#include <string.h>

#include "snapshot_stream.h"

void tearDown(void)
{
    stream_stop();
}

static const enum shef_snapshot_read reads[] = { SHEF_SNAPSHOT_AT_MID, SHEF_SNAPSHOT_LATE,
                                                 SHEF_SNAPSHOT_CENTRED };

static void test_a_snapshot_holds_the_events_up_to_its_instant_and_no_others(void)
{
    for (int r = 0; r < 3; r++) {
        stream_make(0);
        stream_start(reads[r]);
        /* Everything in one batch: events after each instant sit in the same packet. */
        TEST_ASSERT_EQUAL_UINT32(STREAM_N_FRAMES, stream_feed(0, stream_n_events));
        for (int i = 0; i < STREAM_N_FRAMES; i++) {
            const struct stream_copy *copy = stream_copy_of((uint64_t)i);

            TEST_ASSERT_EQUAL_INT64((STREAM_START_US + stream_rise_us(i)) * 1000,
                                    copy->snapshot.rise.ns);
            TEST_ASSERT_EQUAL_INT64((STREAM_START_US + stream_rise_us(i)) * 1000 +
                                        STREAM_EXPOSURE_US * 500,
                                    copy->snapshot.mid.ns);
            TEST_ASSERT_EQUAL_INT64(STREAM_EXPOSURE_US * 1000, copy->snapshot.exposure_ns);
            TEST_ASSERT_EQUAL_INT64(2000, copy->snapshot.t_err_ns);
            TEST_ASSERT_EQUAL_HEX32(0, copy->snapshot.flags);
            stream_expect_defined(copy, reads[r]);
        }
    }
}

static void test_slicing_the_stream_changes_no_bit(void)
{
    static const uint32_t sizes[] = { 1, 7, 1000, 16384 };

    for (int r = 0; r < 3; r++) {
        struct stream_copy whole[STREAM_N_FRAMES];

        stream_make(0);
        stream_start(reads[r]);
        stream_feed(0, stream_n_events);
        for (int i = 0; i < STREAM_N_FRAMES; i++)
            whole[i] = *stream_copy_of((uint64_t)i);
        for (int s = 0; s < 4; s++) {
            stream_start(reads[r]);
            stream_feed_all_in(sizes[s]);
            TEST_ASSERT_EQUAL_UINT64(STREAM_N_FRAMES,
                                     shef_snapshots_stats(stream_snapshots).n_published);
            for (int i = 0; i < STREAM_N_FRAMES; i++)
                stream_expect_same(&whole[i], stream_copy_of((uint64_t)i));
        }
    }
}

/* The snapshot of frame 1, asked for when a frame that comes this late arrives. */
static struct stream_copy taken_late(int64_t late_us)
{
    const int64_t frame_us = stream_rise_us(1) + STREAM_EXPOSURE_US + late_us;
    const struct shef_snapshot *snapshot;
    uint32_t at = 0;

    stream_make(0);
    stream_start(SHEF_SNAPSHOT_CENTRED);
    while (stream_events[at].t_us < frame_us)
        at++;
    stream_feed(0, at);
    /* A frame that is early waits for its snapshot. */
    while (shef_snapshot_pool_take(shef_snapshots_pool(stream_snapshots), 1, &snapshot) ==
           SHEF_ERR_EMPTY) {
        stream_feed(at, at + 100);
        at += 100;
    }
    shef_snapshot_pool_give(shef_snapshots_pool(stream_snapshots), snapshot);
    return *stream_copy_of(1);
}

static void test_frames_0_20_and_60_ms_late_get_the_same_bits(void)
{
    const struct stream_copy prompt = taken_late(0);
    const struct stream_copy late = taken_late(20000);
    const struct stream_copy very_late = taken_late(60000);

    stream_expect_same(&prompt, &late);
    stream_expect_same(&prompt, &very_late);
    stream_expect_defined(&prompt, SHEF_SNAPSHOT_CENTRED);
}

static void test_only_the_chosen_channel_and_level_count(void)
{
    struct shef_snapshot_params params = stream_params(SHEF_SNAPSHOT_AT_MID);

    stream_make(0);
    for (uint32_t i = 0; i < stream_n_triggers; i++) {
        stream_triggers[i].channel = (uint8_t)(i / 2 % 2 ? 3 : 6);
        stream_triggers[i].rising = !stream_triggers[i].rising;
    }
    params.channel = 3;
    params.is_inverted = true;
    stream_start_with(&params);
    stream_feed(0, stream_n_events);
    TEST_ASSERT_EQUAL_UINT64(STREAM_N_FRAMES, shef_snapshots_stats(stream_snapshots).n_triggers);
    TEST_ASSERT_EQUAL_UINT64(STREAM_N_FRAMES / 2,
                             shef_snapshots_stats(stream_snapshots).n_published);
    TEST_ASSERT_EQUAL_INT64((STREAM_START_US + stream_rise_us(1)) * 1000,
                            stream_copy_of(0)->snapshot.rise.ns);
    TEST_ASSERT_EQUAL_INT64((STREAM_START_US + stream_rise_us(3)) * 1000,
                            stream_copy_of(1)->snapshot.rise.ns);
}

static void test_hot_pixels_are_learnt_and_gone_from_snapshots_whatever_the_slicing(void)
{
    static const uint32_t sizes[] = { STREAM_N_EVENTS, 1, 333 };
    struct shef_hot_pixels_params hot_params =
        shef_hot_pixels_default_params(STREAM_WIDTH_PX, STREAM_HEIGHT_PX);
    const uint32_t hot_pixel = 10 * STREAM_WIDTH_PX + 20;
    struct stream_copy whole[STREAM_N_FRAMES];
    uint32_t hot_sum = 0;

    stream_make(0);
    for (uint32_t i = 0; i < stream_n_events; i += 40) {
        stream_events[i].x_px = 20;
        stream_events[i].y_on = 10 | SHEF_EVENT_ON;
    }
    hot_params.limit_per_s = 5000;
    hot_params.window_ms = 20;
    for (int s = 0; s < 3; s++) {
        struct shef_error err = { 0 };

        stream_stop();
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_hot_pixels_create(&stream_hot, &hot_params, &err),
                                  err.text);
        stream_start(SHEF_SNAPSHOT_CENTRED);
        stream_feed_all_in(sizes[s]);
        for (int i = 0; i < STREAM_N_FRAMES; i++) {
            if (s == 0)
                whole[i] = *stream_copy_of((uint64_t)i);
            else
                stream_expect_same(&whole[i], stream_copy_of((uint64_t)i));
        }
    }
    TEST_ASSERT_GREATER_THAN_INT16(50 * 256, whole[0].values[hot_pixel]);
    TEST_ASSERT_EQUAL_INT16(0, whole[4].values[hot_pixel]);
    TEST_ASSERT_EQUAL_INT16(0, whole[4].sums[hot_pixel]);
    for (int p = 0; p < STREAM_N_PIXELS; p++)
        hot_sum += whole[4].values[p] != 0;
    TEST_ASSERT_GREATER_THAN_UINT32(STREAM_N_PIXELS * 9 / 10, hot_sum);
}

static void expect_refused(struct shef_snapshot_params params, const char *reason)
{
    struct shef_snapshots *made = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_snapshots_create(&made, stream_filter, NULL, &params, &err));
    TEST_ASSERT_NULL(made);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, reason), err.text);
}

static void test_impossible_parameters_are_refused_with_a_sentence(void)
{
    struct shef_snapshot_params params = shef_snapshot_default_params();

    stream_start(SHEF_SNAPSHOT_CENTRED);
    params.channel = 32;
    expect_refused(params, "channels 0 to 31");
    params = shef_snapshot_default_params();
    params.n_steps = 5;
    expect_refused(params, "there can be 1 to 4");
    params = shef_snapshot_default_params();
    params.exposure_ns = -1;
    expect_refused(params, "must be 0 to 1 s");
    params = shef_snapshot_default_params();
    params.max_predicted = 2000;
    expect_refused(params, "0 to 1000");
    params = shef_snapshot_default_params();
    params.n_snapshots = 2;
    expect_refused(params, "4 to 64");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_snapshot_holds_the_events_up_to_its_instant_and_no_others);
    RUN_TEST(test_slicing_the_stream_changes_no_bit);
    RUN_TEST(test_frames_0_20_and_60_ms_late_get_the_same_bits);
    RUN_TEST(test_only_the_chosen_channel_and_level_count);
    RUN_TEST(test_hot_pixels_are_learnt_and_gone_from_snapshots_whatever_the_slicing);
    RUN_TEST(test_impossible_parameters_are_refused_with_a_sentence);
    return UNITY_END();
}
