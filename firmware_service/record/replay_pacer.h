/* When what was recorded is due again: the part that all replays share. */
#ifndef SHEF_RECORD_REPLAY_PACER_H
#define SHEF_RECORD_REPLAY_PACER_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "core/clock.h"

#ifdef __cplusplus
extern "C" {
#endif

enum shef_replay_pace {
    SHEF_REPLAY_RECORDED, /* with the pauses with which the items once arrived */
    SHEF_REPLAY_FAST,     /* as soon as there is a free buffer */
    SHEF_REPLAY_STEPPED,  /* as many as step() has allowed */
};

/* A common zero of replays that run side by side at recorded pace: what arrived at `recorded` is
 * due at `due`. Without one, a replay's zero is its first item, at its first take(). */
struct shef_replay_zero {
    bool is_set;
    shef_host_time recorded;
    shef_host_time due;
};

struct shef_replay_config {
    enum shef_replay_pace pace;
    const struct shef_clock *clock; /* only read at recorded pace; outlives the replay */
    uint32_t n_buffers;             /* of the pool, 1..65536 */
    struct shef_replay_zero zero;   /* only of recorded pace */
};

struct shef_replay_pacer {
    /* Set by init. */
    enum shef_replay_pace pace;
    const struct shef_clock *clock;
    /* The source thread's. */
    struct shef_replay_zero zero;
    uint64_t n_delivered;
    int64_t late_ns; /* of the last item, at recorded pace */
    /* Anyone adds, the source takes. */
    _Atomic uint64_t n_allowed;
};

void shef_replay_pacer_init(struct shef_replay_pacer *pacer,
                            const struct shef_replay_config *config);

/* When an item is due at recorded pace, once the zero is set.      Thread: source. */
shef_host_time shef_replay_pacer_due(const struct shef_replay_pacer *pacer, shef_host_time arrived);

/* Whether an item may go. The first one sets the zero.             Thread: source. */
bool shef_replay_pacer_is_due(struct shef_replay_pacer *pacer, shef_host_time arrived);

/* Allows n_items more at stepped pace.                             Thread: any. */
void shef_replay_pacer_step(struct shef_replay_pacer *pacer, uint32_t n_items);

#ifdef __cplusplus
}
#endif

#endif
