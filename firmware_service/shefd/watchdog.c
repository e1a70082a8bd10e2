#include "shefd/watchdog.h"

void shef_watchdog_init(struct shef_watchdog *watchdog, int64_t stalled_after_ns,
                        shef_host_time now)
{
    *watchdog =
        (struct shef_watchdog){ .stalled_after_ns = stalled_after_ns, .last_progress = now };
}

bool shef_watchdog_is_alive(struct shef_watchdog *watchdog, struct shef_service_progress progress,
                            shef_host_time now)
{
    /* Different, not greater: another source starts to count from 0. */
    if (!progress.is_expected || progress.n_steps != watchdog->last_steps) {
        watchdog->last_steps = progress.n_steps;
        watchdog->last_progress = now;
    }
    return shef_host_time_since(now, watchdog->last_progress) <= watchdog->stalled_after_ns;
}
