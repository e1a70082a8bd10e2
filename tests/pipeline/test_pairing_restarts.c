/* Pairing when clocks start again, when a pair is known before, and where a stream has gaps. */
#include <string.h>

#include "pairing_rig.h"

#define MS SHEF_NS_PER_MS
#define US SHEF_NS_PER_US

static void test_a_camera_clock_that_starts_again_is_found_again(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct pairing_rig rig = pairing_rig_plain;

    rig.skipped_share = 1.0 / 16;
    rig.n = 500;
    pairing_rig_make(&rig, &random);
    for (int32_t i = 250; i < rig.n; i++)
        played.exposures[i].frame.camera.ns -= 6000 * MS;
    pairing_rig_play(&rig, &params, 0);
    const struct pairing_verdict verdict = pairing_rig_judge(&rig, 0);

    TEST_ASSERT_EQUAL_INT32(0, verdict.n_wrong);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(rig.n - 10, verdict.n_right);
    TEST_ASSERT_EQUAL_UINT64(2, shef_pairing_stats(&played.pairing).n_starts);
}

/* The camera's clock goes on from another value: nothing steps back, nothing fits any more. */
static void expect_found_again(int64_t step_ns)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct pairing_rig rig = pairing_rig_plain;

    rig.skipped_share = 1.0 / 16;
    rig.n = 500;
    rig.has_host = true;
    pairing_rig_make(&rig, &random);
    for (int32_t i = 250; i < rig.n; i++)
        played.exposures[i].frame.camera.ns += step_ns;
    pairing_rig_play(&rig, &params, 0);
    const struct pairing_verdict verdict = pairing_rig_judge(&rig, 0);

    TEST_ASSERT_EQUAL_INT32(0, verdict.n_wrong);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(rig.n - 30, verdict.n_right);
    TEST_ASSERT_EQUAL_UINT64(2, shef_pairing_stats(&played.pairing).n_starts);
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
    struct pairing_rig rig = pairing_rig_plain;

    rig.n = 20;
    pairing_rig_make(&rig, &random);
    shef_pairing_init(&played.pairing, &params);
    memset(played.has_result, 0, sizeof played.has_result);
    shef_pairing_lock(&played.pairing,
                      &(struct shef_pairing_anchor){ played.exposures[0].frame.camera,
                                                     played.exposures[0].snapshot.rise },
                      false);
    /* The first frame was lost: the pair that is known need not come again. */
    for (int32_t i = 1; i < rig.n; i++) {
        pairing_rig_add_snapshot(&played.exposures[i]);
        pairing_rig_add_frame(&played.exposures[i]);
        TEST_ASSERT_TRUE(played.has_result[i]);
        TEST_ASSERT_EQUAL(SHEF_PAIRING_PAIR, played.results[i].kind);
        TEST_ASSERT_EQUAL_UINT64(played.snapshot_of[i], played.results[i].snapshot);
        TEST_ASSERT_EQUAL_HEX32(0, played.results[i].flags);
    }
}

static void expect_given_up(int64_t error_ns)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct pairing_rig rig = pairing_rig_plain;

    rig.n = 300;
    rig.skipped_share = 1.0 / 16;
    rig.has_host = true;
    pairing_rig_make(&rig, &random);
    shef_pairing_init(&played.pairing, &params);
    memset(played.has_result, 0, sizeof played.has_result);
    shef_pairing_lock(&played.pairing,
                      &(struct shef_pairing_anchor){
                          played.exposures[0].frame.camera,
                          { played.exposures[0].snapshot.rise.ns + error_ns },
                      },
                      false);
    for (int32_t i = 0; i < rig.n; i++) {
        pairing_rig_add_snapshot(&played.exposures[i]);
        pairing_rig_add_frame(&played.exposures[i]);
    }
    shef_pairing_finish(&played.pairing);
    pairing_rig_take_all(0);
    for (int32_t i = 100; i < rig.n; i++) {
        TEST_ASSERT_TRUE(played.has_result[i]);
        TEST_ASSERT_EQUAL(SHEF_PAIRING_PAIR, played.results[i].kind);
        TEST_ASSERT_EQUAL_UINT64(played.snapshot_of[i], played.results[i].snapshot);
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
    struct pairing_rig rig = pairing_rig_plain;

    rig.skipped_share = 1.0 / 16;
    rig.n = 500;
    pairing_rig_make(&rig, &random);
    for (int32_t i = 250; i < rig.n; i++) {
        played.exposures[i].snapshot.rise.ns -= 9000 * MS;
        played.exposures[i].snapshot.mid.ns -= 9000 * MS;
    }
    pairing_rig_play(&rig, &params, 0);
    const struct pairing_verdict verdict = pairing_rig_judge(&rig, 0);

    TEST_ASSERT_EQUAL_INT32(0, verdict.n_wrong);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(rig.n - 10, verdict.n_right);
}

/* A second of events is missing: what comes after it is still at its place. */
static void test_a_gap_in_the_events_is_bridged(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct pairing_rig rig = pairing_rig_plain;
    uint64_t number = 0;

    rig.quantum_ns = 125 * US;
    pairing_rig_make(&rig, &random);
    for (int32_t i = 0; i < rig.n; i++) {
        played.exposures[i].has_snapshot = i < 200 || i >= 254;
        played.snapshot_of[i] = played.exposures[i].has_snapshot ? number : PAIRING_NO_SNAPSHOT;
        played.exposures[i].snapshot.number = number;
        number += played.exposures[i].has_snapshot;
    }
    pairing_rig_play(&rig, &params, 0);
    const struct pairing_verdict verdict = pairing_rig_judge(&rig, 0);

    TEST_ASSERT_EQUAL_INT32(rig.n - 54, verdict.n_right);
    TEST_ASSERT_EQUAL_INT32(54, verdict.n_none);
    TEST_ASSERT_EQUAL_UINT64(1, shef_pairing_stats(&played.pairing).n_starts);
}

/* Frames go on for half a minute: none of them gets a snapshot that another one had. */
static void test_frames_after_the_last_events_get_none(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct pairing_rig rig = pairing_rig_plain;

    rig.n = 1700;
    pairing_rig_make(&rig, &random);
    for (int32_t i = 100; i < rig.n; i++) {
        played.exposures[i].has_snapshot = false;
        played.snapshot_of[i] = PAIRING_NO_SNAPSHOT;
    }
    pairing_rig_play(&rig, &params, 0);
    const struct pairing_verdict verdict = pairing_rig_judge(&rig, 0);

    TEST_ASSERT_EQUAL_INT32(100, verdict.n_right);
    TEST_ASSERT_EQUAL_INT32(rig.n - 100, verdict.n_none);
}

static void test_frames_without_any_trigger_are_unknown(void)
{
    const struct shef_pairing_params params = shef_pairing_default_params();
    struct pairing_rig rig = pairing_rig_plain;

    rig.trigger_loss = 1;
    rig.n = 300;
    shef_pairing_init(&played.pairing, &params);

    struct shef_test_random random = shef_test_random_start();
    struct shef_pairing_result result;
    int32_t n_unknown = 0;

    pairing_rig_make(&rig, &random);
    for (int32_t i = 0; i < rig.n; i++) {
        while (shef_pairing_add_frame(&played.pairing, &played.exposures[i].frame) ==
               SHEF_ERR_FULL) {
            TEST_ASSERT_EQUAL(SHEF_OK,
                              shef_pairing_take(&played.pairing, (shef_host_time){ 0 }, &result));
            n_unknown += result.kind == SHEF_PAIRING_UNKNOWN;
        }
    }
    shef_pairing_finish(&played.pairing);
    while (shef_pairing_take(&played.pairing, (shef_host_time){ 0 }, &result) == SHEF_OK)
        n_unknown += result.kind == SHEF_PAIRING_UNKNOWN;
    TEST_ASSERT_EQUAL_INT32(rig.n, n_unknown);
}

int main(void)
{
    UNITY_BEGIN();
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
