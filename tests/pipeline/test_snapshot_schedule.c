#include "pipeline/snapshot_schedule.h"

#include "support/support.h"

#define MS        SHEF_NS_PER_MS
#define PERIOD    (20 * MS)
#define EXPOSURE  (6 * MS)
#define MAX_TAKEN 64

static struct shef_snapshot_schedule schedule;

/* What advance() has done, step by step, and the records as they were completed. */
static struct {
    shef_event_time at;
    int32_t step;
    struct shef_snapshot_record record;
} taken[MAX_TAKEN];
static int n_taken;
static struct shef_snapshot_record completed[MAX_TAKEN];
static int n_completed;

/* Steps at mid-exposure and 4 ms later. */
static void start(int32_t max_predicted)
{
    const struct shef_snapshot_schedule_params params = {
        .exposure_ns = EXPOSURE,
        .exposure_err_ns = 2 * MS,
        .step_offsets_ns = { 0, 4 * MS },
        .n_steps = 2,
        .max_predicted = max_predicted,
    };

    shef_snapshot_schedule_init(&schedule, &params);
    n_taken = 0;
    n_completed = 0;
}

static void advance(int64_t to_ns)
{
    struct shef_snapshot_step step;

    while (shef_snapshot_schedule_next(&schedule, &step) && step.at.ns < to_ns) {
        const struct shef_snapshot_record *record = shef_snapshot_schedule_begin(&schedule, &step);

        TEST_ASSERT_LESS_THAN_INT(MAX_TAKEN, n_taken);
        taken[n_taken].at = step.at;
        taken[n_taken].step = step.step;
        taken[n_taken++].record = *record;
        if (step.step == schedule.params.n_steps)
            completed[n_completed++] = *record;
        shef_snapshot_schedule_end(&schedule, &step);
    }
}

static void rise(int64_t at_ns)
{
    advance(at_ns);
    shef_snapshot_schedule_rise(&schedule, (shef_event_time){ at_ns });
}

static void fall(int64_t at_ns)
{
    advance(at_ns);
    shef_snapshot_schedule_fall(&schedule, (shef_event_time){ at_ns }, (shef_event_time){ at_ns });
}

/* Frames number first..last - 1 of a regular sequence. */
static void frames(int first, int last)
{
    for (int i = first; i < last; i++) {
        rise(i * PERIOD);
        fall(i * PERIOD + EXPOSURE);
    }
}

static void test_steps_fall_due_at_mid_exposure_and_after_it(void)
{
    start(0);
    rise(100 * MS);
    advance(103 * MS);
    TEST_ASSERT_EQUAL_INT(0, n_taken);
    advance(103 * MS + 1);
    TEST_ASSERT_EQUAL_INT(1, n_taken);
    TEST_ASSERT_EQUAL_INT64(103 * MS, taken[0].at.ns);
    fall(106 * MS);
    advance(1000 * MS);
    TEST_ASSERT_EQUAL_INT(3, n_taken);
    TEST_ASSERT_EQUAL_INT64(107 * MS, taken[1].at.ns);
    TEST_ASSERT_EQUAL_INT32(1, taken[1].step);
    TEST_ASSERT_EQUAL_INT64(107 * MS, taken[2].at.ns);
    TEST_ASSERT_EQUAL_INT32(2, taken[2].step);
    TEST_ASSERT_EQUAL_INT(1, n_completed);
    TEST_ASSERT_EQUAL_INT64(103 * MS, completed[0].mid.ns);
    TEST_ASSERT_EQUAL_INT64(EXPOSURE, completed[0].exposure_ns);
    TEST_ASSERT_EQUAL_INT64(2000, completed[0].t_err_ns);
    TEST_ASSERT_TRUE(completed[0].has_fall);
    TEST_ASSERT_FALSE(completed[0].is_predicted);
}

static void test_a_shorter_exposure_moves_the_middle_but_not_into_the_past(void)
{
    start(0);
    /* Exposures of 4 ms were assumed to be 6: the middle is at 2 and not at 3, but it is known
     * at 4, after the step at 3. */
    rise(0);
    fall(4 * MS);
    advance(50 * MS);
    TEST_ASSERT_EQUAL_INT64(3 * MS, completed[0].mid.ns);
    TEST_ASSERT_EQUAL_INT64(1 * MS + 2000, completed[0].t_err_ns);
    /* The next one is right at once. */
    rise(100 * MS);
    fall(104 * MS);
    advance(150 * MS);
    TEST_ASSERT_EQUAL_INT64(102 * MS, completed[1].mid.ns);
    TEST_ASSERT_EQUAL_INT64(2000, completed[1].t_err_ns);
    /* Down to 1 ms: its end comes before the step at 2 ms, which is then taken at once. */
    rise(200 * MS);
    fall(201 * MS);
    advance(250 * MS);
    TEST_ASSERT_EQUAL_INT64(201 * MS, completed[2].mid.ns);
    TEST_ASSERT_EQUAL_INT64(MS / 2 + 2000, completed[2].t_err_ns);
    /* Unless no event has come since: then the middle can still be read. */
    rise(300 * MS);
    advance(300 * MS + 800);
    shef_snapshot_schedule_fall(&schedule, (shef_event_time){ 300 * MS + 800000 },
                                (shef_event_time){ 299 * MS });
    advance(350 * MS);
    TEST_ASSERT_EQUAL_INT64(300 * MS + 400000, completed[3].mid.ns);
    TEST_ASSERT_EQUAL_INT64(2000, completed[3].t_err_ns);
}

static void test_a_longer_exposure_goes_into_the_error(void)
{
    start(0);
    rise(0);
    advance(7800 * 1000);
    TEST_ASSERT_EQUAL_INT(0, n_completed); /* it may last 8 ms */
    fall(7800 * 1000);
    advance(50 * MS);
    TEST_ASSERT_EQUAL_INT64(3 * MS, completed[0].mid.ns);
    TEST_ASSERT_EQUAL_INT64(7800 * 1000, completed[0].exposure_ns);
    TEST_ASSERT_EQUAL_INT64(900 * 1000 + 2000, completed[0].t_err_ns);
}

static void test_a_lost_falling_edge_costs_precision_and_little_time(void)
{
    start(0);
    rise(0);
    advance(100 * MS);
    /* Never seen one: half of what the exposure may be off by. It is waited for that long. */
    TEST_ASSERT_EQUAL_INT64(MS + 2000, completed[0].t_err_ns);
    TEST_ASSERT_EQUAL_INT64(8100 * 1000, taken[n_taken - 1].at.ns);
    TEST_ASSERT_FALSE(completed[0].has_fall);
    rise(100 * MS);
    fall(106 * MS);
    rise(200 * MS);
    fall(207 * MS);
    rise(300 * MS);
    advance(400 * MS);
    /* Exposures changed by 1 ms of late. */
    TEST_ASSERT_EQUAL_INT64(303500 * 1000, completed[3].mid.ns);
    TEST_ASSERT_EQUAL_INT64(MS / 2 + 2000, completed[3].t_err_ns);
}

static void test_long_exposures_are_waited_for_a_little(void)
{
    start(0);
    schedule.params.exposure_ns = schedule.exposure_ns = 30 * MS;
    rise(0);
    advance(30 * MS);
    TEST_ASSERT_EQUAL_INT(2, n_taken); /* both reads are done, at 15 and 19 ms */
    TEST_ASSERT_EQUAL_INT(0, n_completed);
    advance(32 * MS + MS / 10 + 1);
    TEST_ASSERT_EQUAL_INT(1, n_completed);
    rise(100 * MS);
    fall(130 * MS);
    advance(130 * MS);
    TEST_ASSERT_EQUAL_INT(2, n_completed);
    TEST_ASSERT_EQUAL_INT64(2000, completed[1].t_err_ns);
}

static void test_a_lost_trigger_is_predicted_and_flagged(void)
{
    start(4);
    frames(0, 5);
    /* Frame 5 has no trigger at all. */
    frames(6, 8);
    advance(8 * PERIOD - MS);
    TEST_ASSERT_EQUAL_INT(8, n_completed);
    for (int i = 0; i < 8; i++) {
        TEST_ASSERT_EQUAL_UINT64(i, completed[i].number);
        TEST_ASSERT_EQUAL_INT64(i * PERIOD + EXPOSURE / 2, completed[i].mid.ns);
        TEST_ASSERT_EQUAL(i == 5, completed[i].is_predicted);
        TEST_ASSERT_EQUAL(i != 5, completed[i].has_fall);
        TEST_ASSERT_EQUAL_INT64(2000, completed[i].t_err_ns);
    }
}

static void test_jitter_goes_into_the_error_of_a_prediction(void)
{
    start(4);
    rise(0);
    fall(EXPOSURE);
    rise(PERIOD + 40000);
    fall(PERIOD + 40000 + EXPOSURE);
    rise(2 * PERIOD);
    fall(2 * PERIOD + EXPOSURE);
    advance(4 * PERIOD);
    TEST_ASSERT_TRUE(completed[3].is_predicted);
    /* 80 us between the two intervals, once for the trigger that was lost. */
    TEST_ASSERT_EQUAL_INT64(80000 + 2000, completed[3].t_err_ns);
    TEST_ASSERT_INT64_WITHIN(80000, 3 * PERIOD + EXPOSURE / 2, completed[3].mid.ns);
}

static void test_a_lost_rising_edge_is_told_by_the_falling_one(void)
{
    start(4);
    frames(0, 5);
    fall(5 * PERIOD + EXPOSURE + 30000);
    advance(6 * PERIOD);
    TEST_ASSERT_TRUE(completed[5].is_predicted);
    TEST_ASSERT_TRUE(completed[5].has_fall);
    TEST_ASSERT_EQUAL_INT64(5 * PERIOD + EXPOSURE / 2, completed[5].mid.ns);
    TEST_ASSERT_EQUAL_INT64(30000 + 2000, completed[5].t_err_ns);
    TEST_ASSERT_EQUAL_INT64(5 * PERIOD + 30000, completed[5].rise.ns);
    /* It did not pass for an exposure. */
    TEST_ASSERT_EQUAL_INT64(EXPOSURE, schedule.exposure_ns);
}

static void test_predictions_stop_when_the_camera_does(void)
{
    start(3);
    frames(0, 5);
    advance(100 * PERIOD);
    TEST_ASSERT_EQUAL_INT(8, n_completed);
    for (int i = 5; i < 8; i++) {
        TEST_ASSERT_TRUE(completed[i].is_predicted);
        TEST_ASSERT_EQUAL_INT64(i * PERIOD + EXPOSURE / 2, completed[i].mid.ns);
    }
    /* It goes on later, with the next number. */
    rise(100 * PERIOD + 7 * MS);
    fall(100 * PERIOD + 7 * MS + EXPOSURE);
    advance(101 * PERIOD);
    TEST_ASSERT_EQUAL_INT(9, n_completed);
    TEST_ASSERT_EQUAL_UINT64(8, completed[8].number);
    TEST_ASSERT_FALSE(completed[8].is_predicted);
}

static void test_nothing_is_predicted_without_a_rhythm(void)
{
    static const int64_t rises_ms[] = { 0, 20, 75, 90, 200 };

    start(4);
    for (int i = 0; i < 5; i++) {
        rise(rises_ms[i] * MS);
        fall(rises_ms[i] * MS + EXPOSURE);
    }
    advance(1000 * MS);
    TEST_ASSERT_EQUAL_INT(5, n_completed);
    for (int i = 0; i < 5; i++)
        TEST_ASSERT_FALSE(completed[i].is_predicted);
}

static void test_a_changed_rate_is_learnt_anew(void)
{
    start(4);
    frames(0, 5);
    /* Twice as fast from frame 5 on: what was expected in between is dropped. */
    for (int i = 0; i < 6; i++) {
        rise(5 * PERIOD + i * PERIOD / 2);
        fall(5 * PERIOD + i * PERIOD / 2 + EXPOSURE);
    }
    TEST_ASSERT_EQUAL_INT64(PERIOD / 2, schedule.period_ns);
    TEST_ASSERT_EQUAL_UINT64(1, schedule.n_irregular);
    advance(8 * PERIOD - MS);
    TEST_ASSERT_EQUAL_INT(11, n_completed);
    for (int i = 0; i < 11; i++)
        TEST_ASSERT_FALSE(completed[i].is_predicted);
}

static void test_a_trigger_that_comes_after_its_prediction_was_used_clears_the_flag(void)
{
    start(4);
    frames(0, 5);
    /* The rising edge of frame 5 is 4 ms late: the first step was taken at 3 ms. */
    rise(5 * PERIOD + 4 * MS);
    fall(5 * PERIOD + 4 * MS + EXPOSURE);
    advance(6 * PERIOD);
    TEST_ASSERT_EQUAL_INT(6, n_completed);
    TEST_ASSERT_FALSE(completed[5].is_predicted);
    TEST_ASSERT_EQUAL_INT64(5 * PERIOD + EXPOSURE / 2, completed[5].mid.ns);
    TEST_ASSERT_EQUAL_INT64(4 * MS + 2000, completed[5].t_err_ns);
    TEST_ASSERT_EQUAL_INT64(5 * PERIOD + 4 * MS, completed[5].rise.ns);
}

static void test_high_rates_keep_several_records_open_in_order(void)
{
    start(0);
    schedule.params.step_offsets_ns[1] = 40 * MS;
    for (int i = 0; i < 6; i++) {
        rise(i * 10 * MS);
        fall(i * 10 * MS + EXPOSURE);
    }
    advance(1000 * MS);
    TEST_ASSERT_EQUAL_INT(6, n_completed);
    for (int i = 0; i < 6; i++)
        TEST_ASSERT_EQUAL_UINT64(i, completed[i].number);
    for (int i = 1; i < n_taken; i++)
        TEST_ASSERT_GREATER_OR_EQUAL_INT64(taken[i - 1].at.ns, taken[i].at.ns);
    TEST_ASSERT_EQUAL_UINT64(0, schedule.n_crowded);
    for (int i = 0; i < 20; i++)
        rise(2000 * MS + i * MS / 10);
    TEST_ASSERT_EQUAL_UINT64(12, schedule.n_crowded);
}

static void test_snapshots_are_completed_in_the_order_of_their_numbers(void)
{
    struct shef_test_random random = shef_test_random_start();

    for (int round = 0; round < 500; round++) {
        int64_t now_ns = 0;

        start(shef_test_random_range(&random, 0, 3));
        for (int i = 0; i < 12; i++) {
            now_ns += shef_test_random_range(&random, 1, 12) * MS;
            if (shef_test_random_range(&random, 0, 1))
                rise(now_ns);
            else
                fall(now_ns);
        }
        advance(now_ns + 1000 * MS);
        for (int i = 0; i < n_completed; i++) {
            TEST_ASSERT_EQUAL_UINT64(i, completed[i].number);
            TEST_ASSERT_GREATER_OR_EQUAL_INT64(2000, completed[i].t_err_ns);
        }
        for (int i = 1; i < n_taken; i++)
            TEST_ASSERT_TRUE(taken[i].step == 0 || taken[i].at.ns >= taken[i].record.mid.ns);
        TEST_ASSERT_EQUAL_INT32(0, schedule.n_records);
    }
}

static void test_doubled_edges_count_once(void)
{
    start(4);
    rise(10 * MS);
    rise(10 * MS);
    rise(9 * MS);
    fall(16 * MS);
    fall(16 * MS);
    advance(100 * MS);
    TEST_ASSERT_EQUAL_INT(1, n_completed);
    TEST_ASSERT_EQUAL_INT64(EXPOSURE, schedule.exposure_ns);
}

static void test_a_restart_forgets_the_open_records_and_keeps_counting(void)
{
    start(4);
    frames(0, 5);
    rise(5 * PERIOD);
    shef_snapshot_schedule_restart(&schedule);
    rise(MS);
    fall(MS + EXPOSURE);
    advance(100 * PERIOD);
    TEST_ASSERT_EQUAL_INT(6, n_completed);
    TEST_ASSERT_EQUAL_INT64(MS + EXPOSURE / 2, completed[5].mid.ns);
    TEST_ASSERT_EQUAL_UINT64(5, completed[5].number);
    TEST_ASSERT_FALSE(completed[5].is_predicted);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_steps_fall_due_at_mid_exposure_and_after_it);
    RUN_TEST(test_a_shorter_exposure_moves_the_middle_but_not_into_the_past);
    RUN_TEST(test_a_longer_exposure_goes_into_the_error);
    RUN_TEST(test_a_lost_falling_edge_costs_precision_and_little_time);
    RUN_TEST(test_long_exposures_are_waited_for_a_little);
    RUN_TEST(test_a_lost_trigger_is_predicted_and_flagged);
    RUN_TEST(test_jitter_goes_into_the_error_of_a_prediction);
    RUN_TEST(test_a_lost_rising_edge_is_told_by_the_falling_one);
    RUN_TEST(test_predictions_stop_when_the_camera_does);
    RUN_TEST(test_nothing_is_predicted_without_a_rhythm);
    RUN_TEST(test_a_changed_rate_is_learnt_anew);
    RUN_TEST(test_a_trigger_that_comes_after_its_prediction_was_used_clears_the_flag);
    RUN_TEST(test_high_rates_keep_several_records_open_in_order);
    RUN_TEST(test_snapshots_are_completed_in_the_order_of_their_numbers);
    RUN_TEST(test_doubled_edges_count_once);
    RUN_TEST(test_a_restart_forgets_the_open_records_and_keeps_counting);
    return UNITY_END();
}
