#include "pipeline/pairing.h"

#include <stdlib.h>
#include <string.h>

#include "support/support.h"

#define MS       SHEF_NS_PER_MS
#define US       SHEF_NS_PER_US
#define EXPOSURE (5 * MS)
#define MAX_N    4096
#define NO_FRAME UINT64_MAX

/* A frame camera that drives the event camera's trigger input, and what gets lost on the way. */
struct rig {
    int32_t n;
    int64_t period_ns;
    double skew; /* of the event clock over the camera's */
    int64_t offset_ns;
    int64_t quantum_ns; /* of the camera's stamps; 1: none */
    double frame_loss;
    double trigger_loss;
    double predicted_share; /* of lost triggers that the schedule makes up for */
    double skipped_share;   /* of exposures that the trigger source leaves out: a code */
    int64_t least_delay_ns; /* of a frame's arrival after its exposure began */
    int64_t late_ns;        /* uniform, more, */
    double late_share;      /* of the frames */
    int64_t snapshot_delay_ns;
    bool has_host;
};

static const struct rig plain = {
    .n = 600,
    .period_ns = 18518519,
    .skew = 40e-6,
    .offset_ns = 123456789012,
    .quantum_ns = 1,
    .least_delay_ns = 24 * MS,
    .snapshot_delay_ns = 30 * MS,
};

/* One exposure: what came of it. */
static struct exposure {
    int64_t true_ns; /* host time of its start */
    bool has_frame;
    bool has_snapshot;
    bool is_predicted;
    struct shef_pairing_frame frame;
    struct shef_pairing_snapshot snapshot;
    int64_t ready_ns; /* the snapshot */
} exposures[MAX_N];

/* What came out, by tag. */
static struct shef_pairing_result results[MAX_N];
static bool has_result[MAX_N];
static uint64_t snapshot_of[MAX_N]; /* number, or NO_FRAME */
static struct shef_pairing pairing;

static void make(const struct rig *rig, struct shef_test_random *random)
{
    int64_t at_ns = 5000 * MS;
    uint64_t number = 0;
    int64_t last_arrived_ns = 0;

    TEST_ASSERT_LESS_OR_EQUAL_INT32(MAX_N, rig->n);
    memset(exposures, 0, sizeof exposures);
    for (int32_t i = 0; i < rig->n; i++) {
        struct exposure *e = &exposures[i];

        at_ns += rig->period_ns;
        if (i > 0 && shef_test_random_unit(random) < rig->skipped_share)
            at_ns += rig->period_ns;

        const bool lost = shef_test_random_unit(random) < rig->trigger_loss;
        const int64_t camera_ns = at_ns + 777 * MS;
        const int64_t event_ns = at_ns - rig->offset_ns + (int64_t)(rig->skew * (double)at_ns);
        const int64_t arrived_ns =
            at_ns + rig->least_delay_ns +
            (int64_t)(shef_test_random_unit(random) *
                      (shef_test_random_unit(random) < rig->late_share ? (double)rig->late_ns
                                                                       : 2e6));

        e->true_ns = at_ns;
        e->has_frame = shef_test_random_unit(random) >= rig->frame_loss;
        e->is_predicted = lost && shef_test_random_unit(random) < rig->predicted_share;
        e->has_snapshot = !lost || e->is_predicted;
        /* Frames come one after the other. */
        last_arrived_ns = arrived_ns > last_arrived_ns ? arrived_ns : last_arrived_ns + 1;
        e->frame = (struct shef_pairing_frame){
            .tag = (uint64_t)i,
            .camera = { camera_ns / rig->quantum_ns * rig->quantum_ns },
            .has_host = rig->has_host,
            .arrived = { last_arrived_ns },
        };
        e->ready_ns = at_ns + rig->snapshot_delay_ns;
        snapshot_of[i] = e->has_snapshot ? number : NO_FRAME;
        e->snapshot = (struct shef_pairing_snapshot){
            .number = number,
            .rise = { event_ns / US * US },
            .mid = { event_ns / US * US + EXPOSURE / 2 },
            .t_err_ns = 2 * US,
            .has_host = rig->has_host,
            .host = { at_ns + (int64_t)(shef_test_random_unit(random) * 1e6) },
        };
        number += e->has_snapshot;
    }
}

static void take_all(int64_t now_ns)
{
    struct shef_pairing_result result;

    while (shef_pairing_take(&pairing, (shef_host_time){ now_ns }, &result) == SHEF_OK) {
        TEST_ASSERT_LESS_THAN_UINT64(MAX_N, result.tag);
        TEST_ASSERT_FALSE(has_result[result.tag]);
        has_result[result.tag] = true;
        results[result.tag] = result;
    }
}

static void add_snapshot(const struct exposure *e)
{
    shef_pairing_add_snapshot(&pairing, &e->snapshot);
    take_all(e->ready_ns);
}

static void add_frame(const struct exposure *e)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pairing_add_frame(&pairing, &e->frame));
    take_all(e->frame.arrived.ns);
}

/* Everything in the order in which it happens, from exposure `first` of the frames on. */
static void play(const struct rig *rig, const struct shef_pairing_params *params,
                 int32_t first_frame)
{
    int32_t f = first_frame;
    int32_t s = 0;

    shef_pairing_init(&pairing, params);
    memset(has_result, 0, sizeof has_result);
    while (f < rig->n || s < rig->n) {
        if (s < rig->n && (f >= rig->n || exposures[s].ready_ns <= exposures[f].frame.arrived.ns)) {
            if (exposures[s].has_snapshot)
                add_snapshot(&exposures[s]);
            s++;
        } else {
            if (exposures[f].has_frame)
                add_frame(&exposures[f]);
            f++;
        }
    }
    shef_pairing_finish(&pairing);
    take_all(0);
}

struct verdict {
    int32_t n_frames;
    int32_t n_right;   /* with their snapshot */
    int32_t n_none;    /* rightly without one */
    int32_t n_missed;  /* without one, but it was there */
    int32_t n_wrong;   /* with another's */
    int32_t n_flagged; /* as ambiguous */
};

static struct verdict judge(const struct rig *rig, int32_t first_frame)
{
    struct verdict verdict = { 0 };

    for (int32_t i = first_frame; i < rig->n; i++) {
        if (!exposures[i].has_frame)
            continue;
        TEST_ASSERT_TRUE_MESSAGE(has_result[i], "every frame gets a result");
        verdict.n_frames++;
        verdict.n_flagged += (results[i].flags & SHEF_PAIRING_AMBIGUOUS) != 0;
        if (results[i].kind == SHEF_PAIRING_PAIR)
            *(results[i].snapshot == snapshot_of[i] ? &verdict.n_right : &verdict.n_wrong) += 1;
        else
            *(snapshot_of[i] == NO_FRAME ? &verdict.n_none : &verdict.n_missed) += 1;
    }
    return verdict;
}

static struct verdict run(const struct rig *rig, const struct shef_pairing_params *params)
{
    static struct shef_test_random random;

    if (random.state == 0)
        random = shef_test_random_start();
    make(rig, &random);
    play(rig, params, 0);
    return judge(rig, 0);
}

static void test_every_frame_finds_its_snapshot(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    const struct verdict verdict = run(&plain, &params);

    TEST_ASSERT_EQUAL_INT32(plain.n, verdict.n_right);
    TEST_ASSERT_EQUAL_INT32(0, verdict.n_flagged);
    TEST_ASSERT_EQUAL_UINT64(0, shef_pairing_stats(&pairing).n_skipped);
}

static void test_the_rate_between_the_clocks_is_learnt(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();

    (void)run(&plain, &params);
    TEST_ASSERT_DOUBLE_WITHIN(2e-6, plain.skew, shef_pairing_stats(&pairing).skew);
    TEST_ASSERT_DOUBLE_WITHIN(5e3, 0, shef_pairing_stats(&pairing).residual_rms_ns);
}

static void test_stamps_in_steps_of_125_us_do_no_harm(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct rig rig = plain;

    rig.quantum_ns = 125 * US;
    rig.skew = -60e-6;
    const struct verdict verdict = run(&rig, &params);

    TEST_ASSERT_EQUAL_INT32(rig.n, verdict.n_right);
}

static void test_lost_frames_cost_only_themselves(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct rig rig = plain;

    struct shef_test_random random = shef_test_random_start();

    rig.frame_loss = 0.1;
    make(&rig, &random);
    exposures[0].has_frame = true;
    play(&rig, &params, 0);
    const struct verdict verdict = judge(&rig, 0);

    TEST_ASSERT_GREATER_THAN_INT32(400, verdict.n_frames);
    TEST_ASSERT_LESS_THAN_INT32(rig.n, verdict.n_frames);
    TEST_ASSERT_EQUAL_INT32(verdict.n_frames, verdict.n_right);
    TEST_ASSERT_GREATER_THAN_UINT64(30, shef_pairing_stats(&pairing).n_skipped);
}

static void test_a_lost_trigger_costs_one_frame_which_gets_the_predicted_time(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct rig rig = plain;

    struct shef_test_random random = { 4 };

    rig.trigger_loss = 0.05;
    rig.quantum_ns = 125 * US;
    make(&rig, &random);
    TEST_ASSERT_TRUE(exposures[0].has_snapshot);
    play(&rig, &params, 0);
    const struct verdict verdict = judge(&rig, 0);

    TEST_ASSERT_GREATER_THAN_INT32(10, verdict.n_none);
    TEST_ASSERT_EQUAL_INT32(verdict.n_frames, verdict.n_right + verdict.n_none);
    for (int32_t i = 30; i < rig.n; i++)
        if (results[i].kind == SHEF_PAIRING_NO_EDGE) {
            const int64_t error_ns = results[i].mid.ns - exposures[i].snapshot.mid.ns;

            TEST_ASSERT_LESS_OR_EQUAL_INT64(results[i].t_err_ns, llabs(error_ns));
            TEST_ASSERT_LESS_THAN_INT64(500 * US, results[i].t_err_ns);
        }
}

/* All at once, with frames up to 60 ms late: arrival says nothing about which period it was. */
static void test_losses_late_frames_and_coarse_stamps_together(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct rig rig = plain;
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

        make(&rig, &random);
        exposures[0].has_frame = true;
        if (!exposures[0].has_snapshot)
            continue;
        play(&rig, &params, 0);
        const struct verdict verdict = judge(&rig, 0);

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
    struct rig rig = plain;

    params.latency_ns = rig.least_delay_ns;
    params.latency_sigma_ns = 3 * MS;
    rig.late_ns = 60 * MS;
    rig.late_share = 0.5;
    rig.has_host = true;
    params.begins_together = false;
    rig.n = 300;
    for (uint64_t turn = 0; turn < 100; turn++) {
        struct shef_test_random random = { 500 + turn };

        make(&rig, &random);
        play(&rig, &params, 40);
        const struct verdict verdict = judge(&rig, 40);

        TEST_ASSERT_EQUAL_INT32(rig.n - 40, verdict.n_right);
        TEST_ASSERT_EQUAL_INT32(0, verdict.n_flagged);
    }
}

/* Though the streams are said to begin together: the first frames were lost. */
static void test_the_delay_of_arrival_counts_more_than_the_beginning(void)
{
    struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = { 3 };
    struct rig rig = plain;

    params.latency_ns = rig.least_delay_ns;
    params.latency_sigma_ns = 3 * MS;
    rig.late_ns = 60 * MS;
    rig.late_share = 0.5;
    rig.has_host = true;
    make(&rig, &random);
    play(&rig, &params, 2);
    const struct verdict verdict = judge(&rig, 2);

    TEST_ASSERT_EQUAL_INT32(rig.n - 2, verdict.n_right);
}

static void test_a_shift_that_nothing_decides_is_flagged(void)
{
    struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct rig rig = plain;

    params.begins_together = false;
    rig.n = 200;
    make(&rig, &random);
    play(&rig, &params, 40);
    const struct verdict verdict = judge(&rig, 40);

    TEST_ASSERT_EQUAL_INT32(verdict.n_frames, verdict.n_flagged);
}

static void test_a_train_with_gaps_needs_no_delay(void)
{
    struct shef_pairing_params params = shef_pairing_default_params();
    struct rig rig = plain;
    int32_t n_flagged_turns = 0; /* few gaps, by chance */

    rig.skipped_share = 1.0 / 16;
    params.begins_together = false;
    rig.n = 400;
    for (uint64_t turn = 0; turn < 30; turn++) {
        struct shef_test_random random = { 70 + turn };

        make(&rig, &random);
        play(&rig, &params, 40);
        const struct verdict verdict = judge(&rig, 40);

        TEST_ASSERT_EQUAL_INT32(rig.n - 40, verdict.n_right);
        n_flagged_turns += verdict.n_flagged > 0;
    }
    TEST_ASSERT_LESS_OR_EQUAL_INT32(6, n_flagged_turns);
}

static void test_frames_that_come_long_before_their_snapshots_wait(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct rig rig = plain;

    rig.snapshot_delay_ns = 200 * MS;
    const struct verdict verdict = run(&rig, &params);

    TEST_ASSERT_EQUAL_INT32(rig.n, verdict.n_right);
}

static void test_a_frame_without_snapshots_waits_no_longer_than_told(void)
{
    struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct shef_pairing_result result;
    struct rig rig = plain;

    rig.has_host = true;
    rig.n = 60;
    params.wait_ns = 50 * MS;
    make(&rig, &random);
    shef_pairing_init(&pairing, &params);
    for (int32_t i = 0; i < 30; i++) {
        shef_pairing_add_snapshot(&pairing, &exposures[i].snapshot);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_pairing_add_frame(&pairing, &exposures[i].frame));
    }
    while (shef_pairing_take(&pairing, exposures[29].frame.arrived, &result) == SHEF_OK)
        ;
    TEST_ASSERT_EQUAL_UINT64(30, shef_pairing_stats(&pairing).n_pairs);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pairing_add_frame(&pairing, &exposures[30].frame));

    const shef_host_time arrived = exposures[30].frame.arrived;

    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY,
                      shef_pairing_take(&pairing, shef_host_time_add(arrived, 49 * MS), &result));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_pairing_take(&pairing, shef_host_time_add(arrived, 51 * MS), &result));
    TEST_ASSERT_EQUAL(SHEF_PAIRING_NO_EDGE, result.kind);
}

static void test_a_camera_clock_that_starts_again_is_found_again(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct rig rig = plain;

    rig.skipped_share = 1.0 / 16;
    rig.n = 500;
    make(&rig, &random);
    for (int32_t i = 250; i < rig.n; i++)
        exposures[i].frame.camera.ns -= 6000 * MS;
    play(&rig, &params, 0);
    const struct verdict verdict = judge(&rig, 0);

    TEST_ASSERT_EQUAL_INT32(0, verdict.n_wrong);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(rig.n - 10, verdict.n_right);
    TEST_ASSERT_EQUAL_UINT64(2, shef_pairing_stats(&pairing).n_starts);
}

/* The camera's clock goes on from another value: nothing steps back, nothing fits any more. */
static void expect_found_again(int64_t step_ns)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct rig rig = plain;

    rig.skipped_share = 1.0 / 16;
    rig.n = 500;
    rig.has_host = true;
    make(&rig, &random);
    for (int32_t i = 250; i < rig.n; i++)
        exposures[i].frame.camera.ns += step_ns;
    play(&rig, &params, 0);
    const struct verdict verdict = judge(&rig, 0);

    TEST_ASSERT_EQUAL_INT32(0, verdict.n_wrong);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(rig.n - 30, verdict.n_right);
    TEST_ASSERT_EQUAL_UINT64(2, shef_pairing_stats(&pairing).n_starts);
}

static void test_a_camera_clock_that_jumps_ahead_is_found_again(void)
{
    expect_found_again(5 * MS);
    expect_found_again(6000 * MS);
}

static void test_a_known_pair_lets_every_frame_go_at_once(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct rig rig = plain;

    rig.n = 20;
    make(&rig, &random);
    shef_pairing_init(&pairing, &params);
    memset(has_result, 0, sizeof has_result);
    shef_pairing_lock(
        &pairing,
        &(struct shef_pairing_anchor){ exposures[0].frame.camera, exposures[0].snapshot.rise },
        false);
    /* The first frame was lost: the pair that is known need not come again. */
    for (int32_t i = 1; i < rig.n; i++) {
        add_snapshot(&exposures[i]);
        add_frame(&exposures[i]);
        TEST_ASSERT_TRUE(has_result[i]);
        TEST_ASSERT_EQUAL(SHEF_PAIRING_PAIR, results[i].kind);
        TEST_ASSERT_EQUAL_UINT64(snapshot_of[i], results[i].snapshot);
        TEST_ASSERT_EQUAL_HEX32(0, results[i].flags);
    }
}

static void expect_given_up(int64_t error_ns)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct rig rig = plain;

    rig.n = 300;
    rig.skipped_share = 1.0 / 16;
    rig.has_host = true;
    make(&rig, &random);
    shef_pairing_init(&pairing, &params);
    memset(has_result, 0, sizeof has_result);
    shef_pairing_lock(&pairing,
                      &(struct shef_pairing_anchor){
                          exposures[0].frame.camera,
                          { exposures[0].snapshot.rise.ns + error_ns },
                      },
                      false);
    for (int32_t i = 0; i < rig.n; i++) {
        add_snapshot(&exposures[i]);
        add_frame(&exposures[i]);
    }
    shef_pairing_finish(&pairing);
    take_all(0);
    for (int32_t i = 100; i < rig.n; i++) {
        TEST_ASSERT_TRUE(has_result[i]);
        TEST_ASSERT_EQUAL(SHEF_PAIRING_PAIR, results[i].kind);
        TEST_ASSERT_EQUAL_UINT64(snapshot_of[i], results[i].snapshot);
    }
}

static void test_a_known_pair_that_is_wrong_is_given_up(void)
{
    expect_given_up(7 * MS);
    expect_given_up(-7 * MS);
    expect_given_up(60000 * MS);
}

static void test_event_time_that_jumps_back_is_found_again(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct rig rig = plain;

    rig.skipped_share = 1.0 / 16;
    rig.n = 500;
    make(&rig, &random);
    for (int32_t i = 250; i < rig.n; i++) {
        exposures[i].snapshot.rise.ns -= 9000 * MS;
        exposures[i].snapshot.mid.ns -= 9000 * MS;
    }
    play(&rig, &params, 0);
    const struct verdict verdict = judge(&rig, 0);

    TEST_ASSERT_EQUAL_INT32(0, verdict.n_wrong);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(rig.n - 10, verdict.n_right);
}

/* A second of events is missing: what comes after it is still at its place. */
static void test_a_gap_in_the_events_is_bridged(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct rig rig = plain;
    uint64_t number = 0;

    rig.quantum_ns = 125 * US;
    make(&rig, &random);
    for (int32_t i = 0; i < rig.n; i++) {
        exposures[i].has_snapshot = i < 200 || i >= 254;
        snapshot_of[i] = exposures[i].has_snapshot ? number : NO_FRAME;
        exposures[i].snapshot.number = number;
        number += exposures[i].has_snapshot;
    }
    play(&rig, &params, 0);
    const struct verdict verdict = judge(&rig, 0);

    TEST_ASSERT_EQUAL_INT32(rig.n - 54, verdict.n_right);
    TEST_ASSERT_EQUAL_INT32(54, verdict.n_none);
    TEST_ASSERT_EQUAL_UINT64(1, shef_pairing_stats(&pairing).n_starts);
}

/* Frames go on for half a minute: none of them gets a snapshot that another one had. */
static void test_frames_after_the_last_events_get_none(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct rig rig = plain;

    rig.n = 1700;
    make(&rig, &random);
    for (int32_t i = 100; i < rig.n; i++) {
        exposures[i].has_snapshot = false;
        snapshot_of[i] = NO_FRAME;
    }
    play(&rig, &params, 0);
    const struct verdict verdict = judge(&rig, 0);

    TEST_ASSERT_EQUAL_INT32(100, verdict.n_right);
    TEST_ASSERT_EQUAL_INT32(rig.n - 100, verdict.n_none);
}

static void test_frames_without_any_trigger_are_unknown(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct rig rig = plain;

    rig.trigger_loss = 1;
    rig.n = 300;
    shef_pairing_init(&pairing, &params);

    struct shef_test_random random = shef_test_random_start();
    struct shef_pairing_result result;
    int32_t n_unknown = 0;

    make(&rig, &random);
    for (int32_t i = 0; i < rig.n; i++) {
        while (shef_pairing_add_frame(&pairing, &exposures[i].frame) == SHEF_ERR_FULL) {
            TEST_ASSERT_EQUAL(SHEF_OK, shef_pairing_take(&pairing, (shef_host_time){ 0 }, &result));
            n_unknown += result.kind == SHEF_PAIRING_UNKNOWN;
        }
    }
    shef_pairing_finish(&pairing);
    while (shef_pairing_take(&pairing, (shef_host_time){ 0 }, &result) == SHEF_OK)
        n_unknown += result.kind == SHEF_PAIRING_UNKNOWN;
    TEST_ASSERT_EQUAL_INT32(rig.n, n_unknown);
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
    RUN_TEST(test_a_camera_clock_that_starts_again_is_found_again);
    RUN_TEST(test_a_camera_clock_that_jumps_ahead_is_found_again);
    RUN_TEST(test_a_known_pair_lets_every_frame_go_at_once);
    RUN_TEST(test_a_known_pair_that_is_wrong_is_given_up);
    RUN_TEST(test_event_time_that_jumps_back_is_found_again);
    RUN_TEST(test_a_gap_in_the_events_is_bridged);
    RUN_TEST(test_frames_after_the_last_events_get_none);
    RUN_TEST(test_frames_without_any_trigger_are_unknown);
    return UNITY_END();
}
