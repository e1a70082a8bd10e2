/* Handing an item on for certain: what ends a stream, and everything at a pace without a clock. */
#ifndef SHEF_SERVICE_PUSH_H
#define SHEF_SERVICE_PUSH_H

#include <stdbool.h>

#include "service/graph.h"
#include "service/pace.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Consumers make room without a signal: a thread that waits for it looks again this often. */
#define SHEF_PUSH_LOOK_AGAIN_MS 1

/* Waits for room if there is none, and tells the pace that an item more is under way.
 *                                                                 Thread: the ring's producer.
 *   own  the thread's own wake-up
 * False: the service stops; nothing was handed on, and nothing is counted as lost. */
bool shef_push_surely(struct shef_link *link, const void *item, struct shef_pace *pace,
                      struct shef_wake *own);

/* Hands it on if there is room, and waits for room only where no clock counts. The pace is told.
 *                                                                 Thread: the ring's producer.
 * False: nothing was handed on; a full ring counts the loss. */
bool shef_push_in_time(struct shef_link *link, const void *item, struct shef_pace *pace,
                       struct shef_wake *own);

#ifdef __cplusplus
}
#endif

#endif
