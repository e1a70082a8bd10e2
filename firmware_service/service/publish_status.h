/* The service's part of the status messages. */
#ifndef SHEF_SERVICE_PUBLISH_STATUS_H
#define SHEF_SERVICE_PUBLISH_STATUS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/time.h"
#include "publish/encoder.h"

#ifdef __cplusplus
extern "C" {
#endif

/* What the last message said, for rates. Zeroed: there has been none. The publisher's thread. */
struct shef_publish_status_before {
    shef_host_time at;
    uint64_t n_events;
    uint64_t n_published;
    int64_t cpu_ns; /* of the whole process */
};

/* A shef_publisher_status_fn. Allocates nothing.                  Thread: publisher.
 *   playback  struct shef_playback * */
bool shef_playback_publish_status(void *playback, struct shef_publish_status *out_status);

/* What the process has in RAM; 0: unknown. Allocates nothing.      Thread: any. */
int64_t shef_resident_bytes(void);

#ifdef __cplusplus
}
#endif

#endif
