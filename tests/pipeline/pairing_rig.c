#include "pairing_rig.h"

#include <string.h>

#define MS       SHEF_NS_PER_MS
#define US       SHEF_NS_PER_US
#define EXPOSURE (5 * MS)

struct pairing_played played;

const struct pairing_rig pairing_rig_plain = {
    .n = 600,
    .period_ns = 18518519,
    .skew = 40e-6,
    .offset_ns = 123456789012,
    .quantum_ns = 1,
    .least_delay_ns = 24 * MS,
    .snapshot_delay_ns = 30 * MS,
};

void pairing_rig_make(const struct pairing_rig *rig, struct shef_test_random *random)
{
    int64_t at_ns = 5000 * MS;
    uint64_t number = 0;
    int64_t last_arrived_ns = 0;

    TEST_ASSERT_LESS_OR_EQUAL_INT32(PAIRING_RIG_MAX_N, rig->n);
    memset(played.exposures, 0, sizeof played.exposures);
    for (int32_t i = 0; i < rig->n; i++) {
        struct pairing_exposure *e = &played.exposures[i];

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
        played.snapshot_of[i] = e->has_snapshot ? number : PAIRING_NO_SNAPSHOT;
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

void pairing_rig_take_all(int64_t now_ns)
{
    struct shef_pairing_result result;

    while (shef_pairing_take(&played.pairing, (shef_host_time){ now_ns }, &result) == SHEF_OK) {
        TEST_ASSERT_LESS_THAN_UINT64(PAIRING_RIG_MAX_N, result.tag);
        TEST_ASSERT_FALSE(played.has_result[result.tag]);
        played.has_result[result.tag] = true;
        played.results[result.tag] = result;
    }
}

void pairing_rig_add_snapshot(const struct pairing_exposure *e)
{
    shef_pairing_add_snapshot(&played.pairing, &e->snapshot);
    pairing_rig_take_all(e->ready_ns);
}

void pairing_rig_add_frame(const struct pairing_exposure *e)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_pairing_add_frame(&played.pairing, &e->frame));
    pairing_rig_take_all(e->frame.arrived.ns);
}

void pairing_rig_play(const struct pairing_rig *rig, const struct shef_pairing_params *params,
                      int32_t first_frame)
{
    int32_t f = first_frame;
    int32_t s = 0;

    shef_pairing_init(&played.pairing, params);
    memset(played.has_result, 0, sizeof played.has_result);
    while (f < rig->n || s < rig->n) {
        if (s < rig->n &&
            (f >= rig->n || played.exposures[s].ready_ns <= played.exposures[f].frame.arrived.ns)) {
            if (played.exposures[s].has_snapshot)
                pairing_rig_add_snapshot(&played.exposures[s]);
            s++;
        } else {
            if (played.exposures[f].has_frame)
                pairing_rig_add_frame(&played.exposures[f]);
            f++;
        }
    }
    shef_pairing_finish(&played.pairing);
    pairing_rig_take_all(0);
}

struct pairing_verdict pairing_rig_judge(const struct pairing_rig *rig, int32_t first_frame)
{
    struct pairing_verdict verdict = { 0 };

    for (int32_t i = first_frame; i < rig->n; i++) {
        if (!played.exposures[i].has_frame)
            continue;
        TEST_ASSERT_TRUE_MESSAGE(played.has_result[i], "every frame gets a result");
        verdict.n_frames++;
        verdict.n_flagged += (played.results[i].flags & SHEF_PAIRING_AMBIGUOUS) != 0;
        if (played.results[i].kind == SHEF_PAIRING_PAIR)
            *(played.results[i].snapshot == played.snapshot_of[i] ? &verdict.n_right
                                                                  : &verdict.n_wrong) += 1;
        else
            *(played.snapshot_of[i] == PAIRING_NO_SNAPSHOT ? &verdict.n_none : &verdict.n_missed) +=
                1;
    }
    return verdict;
}

struct pairing_verdict pairing_rig_run(const struct pairing_rig *rig,
                                       const struct shef_pairing_params *params)
{
    static struct shef_test_random random;

    if (random.state == 0)
        random = shef_test_random_start();
    pairing_rig_make(rig, &random);
    pairing_rig_play(rig, params, 0);
    return pairing_rig_judge(rig, 0);
}
