#include "record/replay_pacer.h"

void shef_replay_pacer_init(struct shef_replay_pacer *pacer,
                            const struct shef_replay_config *config)
{
    pacer->pace = config->pace;
    pacer->clock = config->clock;
    pacer->zero = config->zero;
    pacer->n_delivered = 0;
    pacer->late_ns = 0;
    atomic_init(&pacer->n_allowed, 0);
}

shef_host_time shef_replay_pacer_due(const struct shef_replay_pacer *pacer, shef_host_time arrived)
{
    return shef_host_time_add(pacer->zero.due, shef_host_time_since(arrived, pacer->zero.recorded));
}

bool shef_replay_pacer_is_due(struct shef_replay_pacer *pacer, shef_host_time arrived)
{
    if (pacer->pace == SHEF_REPLAY_FAST)
        return true;
    if (pacer->pace == SHEF_REPLAY_STEPPED)
        /* Relaxed: permission orders nothing; it is only counted. */
        return pacer->n_delivered < atomic_load_explicit(&pacer->n_allowed, memory_order_relaxed);

    const shef_host_time now = shef_clock_now(pacer->clock);

    if (!pacer->zero.is_set)
        pacer->zero = (struct shef_replay_zero){ true, arrived, now };

    const shef_host_time due = shef_replay_pacer_due(pacer, arrived);

    if (shef_host_time_before(now, due))
        return false;
    pacer->late_ns = shef_host_time_since(now, due);
    return true;
}

void shef_replay_pacer_step(struct shef_replay_pacer *pacer, uint32_t n_items)
{
    atomic_fetch_add_explicit(&pacer->n_allowed, n_items, memory_order_relaxed);
}
