/* Which snapshot belongs to which frame: losses, delays, and what nothing can decide. */
#include <stdlib.h>

#include "pairing_rig.h"

#define MS SHEF_NS_PER_MS
#define US SHEF_NS_PER_US

static void test_every_frame_finds_its_snapshot(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    const struct pairing_verdict verdict = pairing_rig_run(&pairing_rig_plain, &params);

    TEST_ASSERT_EQUAL_INT32(pairing_rig_plain.n, verdict.n_right);
    TEST_ASSERT_EQUAL_INT32(0, verdict.n_flagged);
    TEST_ASSERT_EQUAL_UINT64(0, shef_pairing_stats(&played.pairing).n_skipped);
}

static void test_the_rate_between_the_clocks_is_learnt(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();

    (void)pairing_rig_run(&pairing_rig_plain, &params);
    TEST_ASSERT_DOUBLE_WITHIN(2e-6, pairing_rig_plain.skew,
                              shef_pairing_stats(&played.pairing).skew);
    TEST_ASSERT_DOUBLE_WITHIN(5e3, 0, shef_pairing_stats(&played.pairing).residual_rms_ns);
}

static void test_stamps_in_steps_of_125_us_do_no_harm(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct pairing_rig rig = pairing_rig_plain;

    rig.quantum_ns = 125 * US;
    rig.skew = -60e-6;
    const struct pairing_verdict verdict = pairing_rig_run(&rig, &params);

    TEST_ASSERT_EQUAL_INT32(rig.n, verdict.n_right);
}

static void test_lost_frames_cost_only_themselves(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct pairing_rig rig = pairing_rig_plain;

    struct shef_test_random random = shef_test_random_start();

    rig.frame_loss = 0.1;
    pairing_rig_make(&rig, &random);
    played.exposures[0].has_frame = true;
    pairing_rig_play(&rig, &params, 0);
    const struct pairing_verdict verdict = pairing_rig_judge(&rig, 0);

    TEST_ASSERT_GREATER_THAN_INT32(400, verdict.n_frames);
    TEST_ASSERT_LESS_THAN_INT32(rig.n, verdict.n_frames);
    TEST_ASSERT_EQUAL_INT32(verdict.n_frames, verdict.n_right);
    TEST_ASSERT_GREATER_THAN_UINT64(30, shef_pairing_stats(&played.pairing).n_skipped);
}

static void test_a_lost_trigger_costs_one_frame_which_gets_the_predicted_time(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct pairing_rig rig = pairing_rig_plain;

    struct shef_test_random random = { 4 };

    rig.trigger_loss = 0.05;
    rig.quantum_ns = 125 * US;
    pairing_rig_make(&rig, &random);
    TEST_ASSERT_TRUE(played.exposures[0].has_snapshot);
    pairing_rig_play(&rig, &params, 0);
    const struct pairing_verdict verdict = pairing_rig_judge(&rig, 0);

    TEST_ASSERT_GREATER_THAN_INT32(10, verdict.n_none);
    TEST_ASSERT_EQUAL_INT32(verdict.n_frames, verdict.n_right + verdict.n_none);
    for (int32_t i = 30; i < rig.n; i++)
        if (played.results[i].kind == SHEF_PAIRING_NO_EDGE) {
            const int64_t error_ns = played.results[i].mid.ns - played.exposures[i].snapshot.mid.ns;

            TEST_ASSERT_LESS_OR_EQUAL_INT64(played.results[i].t_err_ns, llabs(error_ns));
            TEST_ASSERT_LESS_THAN_INT64(500 * US, played.results[i].t_err_ns);
        }
}

/* All at once, with frames up to 60 ms late: arrival says nothing about which period it was. */
static void test_losses_late_frames_and_coarse_stamps_together(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct pairing_rig rig = pairing_rig_plain;
    int32_t n_wrong = 0;
    int32_t n_missed = 0;
    int32_t n_frames = 0;

    rig.frame_loss = 0.02;
    rig.trigger_loss = 0.02;
    rig.predicted_share = 0.8;
    rig.quantum_ns = 125 * US;
    rig.late_ns = 60 * MS;
    rig.late_share = 1;
    rig.has_host = true;
    for (int turn = 0; turn < 40; turn++) {
        /* The first of each kind arrives: the two streams begin together. */
        struct shef_test_random random = { 1000 + (uint64_t)turn };

        pairing_rig_make(&rig, &random);
        played.exposures[0].has_frame = true;
        if (!played.exposures[0].has_snapshot)
            continue;
        pairing_rig_play(&rig, &params, 0);
        const struct pairing_verdict verdict = pairing_rig_judge(&rig, 0);

        n_wrong += verdict.n_wrong;
        n_missed += verdict.n_missed;
        n_frames += verdict.n_frames;
    }
    TEST_ASSERT_GREATER_THAN_INT32(15000, n_frames);
    TEST_ASSERT_EQUAL_INT32(0, n_wrong);
    TEST_ASSERT_LESS_THAN_INT32(n_frames / 1000, n_missed);
}

/* The frame camera runs already when the first frame is taken: only the delay can tell. */
static void test_a_calibrated_delay_finds_the_shift_in_a_running_train(void)
{
    struct shef_pairing_params params = shef_pairing_default_params();
    struct pairing_rig rig = pairing_rig_plain;

    params.latency_ns = rig.least_delay_ns;
    params.latency_sigma_ns = 3 * MS;
    rig.late_ns = 60 * MS;
    rig.late_share = 0.5;
    rig.has_host = true;
    params.begins_together = false;
    rig.n = 300;
    for (uint64_t turn = 0; turn < 100; turn++) {
        struct shef_test_random random = { 500 + turn };

        pairing_rig_make(&rig, &random);
        pairing_rig_play(&rig, &params, 40);
        const struct pairing_verdict verdict = pairing_rig_judge(&rig, 40);

        TEST_ASSERT_EQUAL_INT32(rig.n - 40, verdict.n_right);
        TEST_ASSERT_EQUAL_INT32(0, verdict.n_flagged);
    }
}

/* Though the streams are said to begin together: the first frames were lost. */
static void test_the_delay_of_arrival_counts_more_than_the_beginning(void)
{
    struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = { 3 };
    struct pairing_rig rig = pairing_rig_plain;

    params.latency_ns = rig.least_delay_ns;
    params.latency_sigma_ns = 3 * MS;
    rig.late_ns = 60 * MS;
    rig.late_share = 0.5;
    rig.has_host = true;
    pairing_rig_make(&rig, &random);
    pairing_rig_play(&rig, &params, 2);
    const struct pairing_verdict verdict = pairing_rig_judge(&rig, 2);

    TEST_ASSERT_EQUAL_INT32(rig.n - 2, verdict.n_right);
}

static void test_a_shift_that_nothing_decides_is_flagged(void)
{
    struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct pairing_rig rig = pairing_rig_plain;

    params.begins_together = false;
    rig.n = 200;
    pairing_rig_make(&rig, &random);
    pairing_rig_play(&rig, &params, 40);
    const struct pairing_verdict verdict = pairing_rig_judge(&rig, 40);

    TEST_ASSERT_EQUAL_INT32(verdict.n_frames, verdict.n_flagged);
}

static void test_a_train_with_gaps_needs_no_delay(void)
{
    struct shef_pairing_params params = shef_pairing_default_params();
    struct pairing_rig rig = pairing_rig_plain;
    int32_t n_flagged_turns = 0; /* few gaps, by chance */

    rig.skipped_share = 1.0 / 16;
    params.begins_together = false;
    rig.n = 400;
    for (uint64_t turn = 0; turn < 30; turn++) {
        struct shef_test_random random = { 70 + turn };

        pairing_rig_make(&rig, &random);
        pairing_rig_play(&rig, &params, 40);
        const struct pairing_verdict verdict = pairing_rig_judge(&rig, 40);

        TEST_ASSERT_EQUAL_INT32(rig.n - 40, verdict.n_right);
        n_flagged_turns += verdict.n_flagged > 0;
    }
    TEST_ASSERT_LESS_OR_EQUAL_INT32(6, n_flagged_turns);
}

static void test_frames_that_come_long_before_their_snapshots_wait(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct pairing_rig rig = pairing_rig_plain;

    rig.snapshot_delay_ns = 200 * MS;
    const struct pairing_verdict verdict = pairing_rig_run(&rig, &params);

    TEST_ASSERT_EQUAL_INT32(rig.n, verdict.n_right);
}

static void test_a_frame_without_snapshots_waits_no_longer_than_told(void)
{
    struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct shef_pairing_result result;
    struct pairing_rig rig = pairing_rig_plain;

    rig.has_host = true;
    rig.n = 60;
    params.wait_ns = 50 * MS;
    pairing_rig_make(&rig, &random);
    shef_pairing_init(&played.pairing, &params);
    for (int32_t i = 0; i < 30; i++) {
        shef_pairing_add_snapshot(&played.pairing, &played.exposures[i].snapshot);
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_pairing_add_frame(&played.pairing, &played.exposures[i].frame));
    }
    while (shef_pairing_take(&played.pairing, played.exposures[29].frame.arrived, &result) ==
           SHEF_OK)
        ;
    TEST_ASSERT_EQUAL_UINT64(30, shef_pairing_stats(&played.pairing).n_pairs);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_pairing_add_frame(&played.pairing, &played.exposures[30].frame));

    const shef_host_time arrived = played.exposures[30].frame.arrived;

    TEST_ASSERT_EQUAL(
        SHEF_ERR_EMPTY,
        shef_pairing_take(&played.pairing, shef_host_time_add(arrived, 49 * MS), &result));
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_pairing_take(&played.pairing, shef_host_time_add(arrived, 51 * MS), &result));
    TEST_ASSERT_EQUAL(SHEF_PAIRING_NO_EDGE, result.kind);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_every_frame_finds_its_snapshot);
    RUN_TEST(test_the_rate_between_the_clocks_is_learnt);
    RUN_TEST(test_stamps_in_steps_of_125_us_do_no_harm);
    RUN_TEST(test_lost_frames_cost_only_themselves);
    RUN_TEST(test_a_lost_trigger_costs_one_frame_which_gets_the_predicted_time);
    RUN_TEST(test_losses_late_frames_and_coarse_stamps_together);
    RUN_TEST(test_a_calibrated_delay_finds_the_shift_in_a_running_train);
    RUN_TEST(test_the_delay_of_arrival_counts_more_than_the_beginning);
    RUN_TEST(test_a_shift_that_nothing_decides_is_flagged);
    RUN_TEST(test_a_train_with_gaps_needs_no_delay);
    RUN_TEST(test_frames_that_come_long_before_their_snapshots_wait);
    RUN_TEST(test_a_frame_without_snapshots_waits_no_longer_than_told);
    return UNITY_END();
}
