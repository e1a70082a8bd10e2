/* Snapshots of a stream in which edges are lost or late, time jumps, or nobody gives back. */
#include "pipeline/snapshot.h"

#include "snapshot_stream.h"

void tearDown(void)
{
    stream_stop();
}

static void test_a_lost_trigger_is_predicted_flagged_and_exact_at_its_instant(void)
{
    stream_make(3u << (2 * 4)); /* both edges of frame 4 */
    stream_start(SHEF_SNAPSHOT_CENTRED);
    stream_feed_all_in(5000);
    TEST_ASSERT_EQUAL_UINT64(1, shef_snapshots_stats(stream_snapshots).n_predicted);
    for (int i = 0; i < STREAM_N_FRAMES; i++) {
        const struct stream_copy *copy = stream_copy_of((uint64_t)i);

        TEST_ASSERT_EQUAL_HEX32(i == 4 ? SHEF_SNAPSHOT_PREDICTED | SHEF_SNAPSHOT_NO_FALL : 0,
                                copy->snapshot.flags);
        TEST_ASSERT_EQUAL_INT64((STREAM_START_US + stream_rise_us(i)) * 1000 +
                                    STREAM_EXPOSURE_US * 500,
                                copy->snapshot.mid.ns);
        stream_expect_defined(copy, SHEF_SNAPSHOT_CENTRED);
    }
}

static void test_a_lost_edge_of_one_kind_is_made_up_for_by_the_other(void)
{
    stream_make(1u << (2 * 4) | 2u << (2 * 6)); /* frame 4 does not rise, frame 6 does not fall */
    stream_start(SHEF_SNAPSHOT_CENTRED);
    stream_feed_all_in(5000);
    TEST_ASSERT_EQUAL_HEX32(SHEF_SNAPSHOT_PREDICTED, stream_copy_of(4)->snapshot.flags);
    TEST_ASSERT_EQUAL_HEX32(SHEF_SNAPSHOT_NO_FALL, stream_copy_of(6)->snapshot.flags);
    TEST_ASSERT_EQUAL_INT64(2000, stream_copy_of(4)->snapshot.t_err_ns);
    TEST_ASSERT_EQUAL_INT64(2000, stream_copy_of(6)->snapshot.t_err_ns);
}

static void test_a_falling_edge_that_differs_goes_into_the_stated_error(void)
{
    stream_make(2u << (2 * 4));
    stream_add_trigger(stream_rise_us(4) + STREAM_EXPOSURE_US + 800, 0, false);
    /* Triggers come in the order of the stream. */
    for (uint32_t i = stream_n_triggers - 1;
         i > 0 && stream_triggers[i].t_us < stream_triggers[i - 1].t_us; i--) {
        const struct shef_trigger swapped = stream_triggers[i];

        stream_triggers[i] = stream_triggers[i - 1];
        stream_triggers[i - 1] = swapped;
    }
    stream_start(SHEF_SNAPSHOT_CENTRED);
    stream_feed_all_in(5000);

    const struct stream_copy *copy = stream_copy_of(4);

    TEST_ASSERT_EQUAL_HEX32(0, copy->snapshot.flags);
    TEST_ASSERT_EQUAL_INT64((STREAM_EXPOSURE_US + 800) * 1000, copy->snapshot.exposure_ns);
    TEST_ASSERT_EQUAL_INT64(2000 + 400000, copy->snapshot.t_err_ns);
    stream_expect_defined(copy, SHEF_SNAPSHOT_CENTRED);
    /* The next one is taken where the new exposure puts it, and its own edge corrects it. */
    TEST_ASSERT_EQUAL_INT64((STREAM_START_US + stream_rise_us(5)) * 1000 +
                                (STREAM_EXPOSURE_US + 800) * 500,
                            stream_copy_of(5)->snapshot.mid.ns);
}

static void test_a_trigger_that_comes_after_its_instant_is_flagged(void)
{
    stream_make(0);
    stream_n_triggers = 0;
    stream_add_trigger(stream_rise_us(0), 0, true);
    /* Sent 4 ms late, 1.5 ms after mid-exposure. */
    while (stream_events[stream_triggers[0].n_before].t_us < stream_rise_us(0) + 4000)
        stream_triggers[0].n_before++;
    stream_start(SHEF_SNAPSHOT_AT_MID);
    stream_feed_all_in(1000);

    const struct stream_copy *copy = stream_copy_of(0);

    TEST_ASSERT_BITS(SHEF_SNAPSHOT_LATE_TRIGGER, SHEF_SNAPSHOT_LATE_TRIGGER, copy->snapshot.flags);
    TEST_ASSERT_GREATER_THAN_INT64(1400000, copy->snapshot.t_err_ns);
    TEST_ASSERT_EQUAL_UINT64(1, shef_snapshots_stats(stream_snapshots).n_late);
}

static void test_a_quiet_stream_still_gives_its_snapshot(void)
{
    struct shef_event_batch batch = { 0 };

    stream_make(0);
    stream_n_triggers = 2;
    stream_n_events = stream_triggers[0].n_before; /* nothing moves any more */
    stream_start(SHEF_SNAPSHOT_CENTRED);
    stream_feed(0, stream_n_events);
    TEST_ASSERT_EQUAL_UINT64(0, shef_snapshot_pool_end(shef_snapshots_pool(stream_snapshots)));
    batch.base_us = STREAM_START_US;
    batch.triggers[0] = stream_triggers[1];
    batch.triggers[0].n_before = 0;
    batch.n_triggers = 1;
    batch.reached_us = STREAM_START_US + stream_rise_us(0) + STREAM_EXPOSURE_US / 2 + 25000 + 5000;
    TEST_ASSERT_EQUAL_UINT32(0, shef_snapshots_feed(stream_snapshots, &batch));
    batch.n_triggers = 0;
    batch.reached_us += 2;
    TEST_ASSERT_EQUAL_UINT32(1, shef_snapshots_feed(stream_snapshots, &batch));
    TEST_ASSERT_EQUAL_HEX32(0, stream_copy_of(0)->snapshot.flags);
    stream_expect_defined(stream_copy_of(0), SHEF_SNAPSHOT_CENTRED);
}

static void test_a_jump_back_in_time_drops_what_is_open_and_goes_on(void)
{
    uint32_t jump = 0;

    stream_make(0);
    /* After frame 3's mid-exposure the camera's time starts anew, 3 s earlier. */
    while (stream_events[jump].t_us < stream_rise_us(3) + 4000)
        jump++;
    for (uint32_t i = 0; i < stream_n_events; i++)
        stream_events[i].t_us += i < jump ? 3000000 : 0;
    for (uint32_t i = 0; i < stream_n_triggers; i++)
        stream_triggers[i].t_us += stream_triggers[i].n_before <= jump ? 3000000 : 0;
    stream_start(SHEF_SNAPSHOT_CENTRED);
    stream_feed_all_in(1000);

    const struct shef_snapshot_stats stats = shef_snapshots_stats(stream_snapshots);

    TEST_ASSERT_EQUAL_UINT32(1, shef_filter_stats(stream_filter).n_epochs);
    /* Frame 2 was not complete yet either. */
    TEST_ASSERT_EQUAL_UINT64(2, stats.n_dropped);
    TEST_ASSERT_EQUAL_UINT64(STREAM_N_FRAMES - 2, stats.n_published);
    TEST_ASSERT_EQUAL_UINT32(0, stream_copy_of(1)->snapshot.epoch);
    TEST_ASSERT_EQUAL_UINT32(1, stream_copy_of(4)->snapshot.epoch);
    TEST_ASSERT_EQUAL_INT64((STREAM_START_US + stream_rise_us(4)) * 1000 + STREAM_EXPOSURE_US * 500,
                            stream_copy_of(4)->snapshot.mid.ns);
    TEST_ASSERT_EQUAL_HEX32(0, stream_copy_of(4)->snapshot.flags);
}

static void test_a_full_pool_loses_snapshots_and_recovers(void)
{
    struct shef_snapshot_params params = stream_params(SHEF_SNAPSHOT_AT_MID);
    const struct shef_snapshot *held[4];
    uint32_t at = 0;

    stream_make(0);
    params.n_snapshots = 4;
    stream_start_with(&params);
    for (int i = 0; i < 4; i++) {
        while (shef_snapshot_pool_take(shef_snapshots_pool(stream_snapshots), (uint64_t)i,
                                       &held[i]) != SHEF_OK) {
            stream_feed(at, at + 50);
            at += 50;
        }
    }
    while (stream_events[at].t_us < stream_rise_us(6) - 2000) {
        stream_feed(at, at + 50);
        at += 50;
    }
    TEST_ASSERT_EQUAL_UINT64(2, shef_snapshots_stats(stream_snapshots).n_lost);
    for (int i = 0; i < 4; i++)
        shef_snapshot_pool_give(shef_snapshots_pool(stream_snapshots), held[i]);
    stream_feed(at, stream_n_events);
    TEST_ASSERT_EQUAL_UINT64(6, shef_snapshots_stats(stream_snapshots).n_published);
    stream_expect_defined(stream_copy_of(6), SHEF_SNAPSHOT_AT_MID);
    stream_expect_defined(stream_copy_of(7), SHEF_SNAPSHOT_AT_MID);
    TEST_ASSERT_EQUAL(SHEF_ERR_GONE,
                      shef_snapshot_pool_take(shef_snapshots_pool(stream_snapshots), 4, &held[0]));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_lost_trigger_is_predicted_flagged_and_exact_at_its_instant);
    RUN_TEST(test_a_lost_edge_of_one_kind_is_made_up_for_by_the_other);
    RUN_TEST(test_a_falling_edge_that_differs_goes_into_the_stated_error);
    RUN_TEST(test_a_trigger_that_comes_after_its_instant_is_flagged);
    RUN_TEST(test_a_quiet_stream_still_gives_its_snapshot);
    RUN_TEST(test_a_jump_back_in_time_drops_what_is_open_and_goes_on);
    RUN_TEST(test_a_full_pool_loses_snapshots_and_recovers);
    return UNITY_END();
}
