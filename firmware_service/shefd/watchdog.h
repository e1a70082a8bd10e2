/* Whether the service makes progress, for systemd's watchdog.
 *
 * A timer alone would only prove that timers work. Here the notification is sent while the
 * service's step counter grows, or while nothing is expected of it. Thread: control. */
#ifndef SHEF_SHEFD_WATCHDOG_H
#define SHEF_SHEFD_WATCHDOG_H

#include <stdbool.h>
#include <stdint.h>

#include "core/time.h"
#include "service/service.h"

struct shef_watchdog {
    int64_t stalled_after_ns;
    uint64_t last_steps;
    shef_host_time last_progress;
};

void shef_watchdog_init(struct shef_watchdog *watchdog, int64_t stalled_after_ns,
                        shef_host_time now);

/* Looks at the counter. False: it stands still although work is expected, and has for longer
 * than stalled_after_ns. */
bool shef_watchdog_is_alive(struct shef_watchdog *watchdog, struct shef_service_progress progress,
                            shef_host_time now);

#endif
