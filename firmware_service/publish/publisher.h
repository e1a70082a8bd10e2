/* Publishes finished results over LCM, on a thread of its own.
 *
 * Whatever happens to the network happens here only: a message that cannot be sent is counted, a
 * connection that cannot be made is tried again every second, and while a send blocks, finished
 * results wait. Nothing is logged on this thread; stats() says what
 * there is to say. LCM allocates inside lcm_create() and lcm_publish(); our own code does not after
 * create(). */
#ifndef SHEF_PUBLISH_PUBLISHER_H
#define SHEF_PUBLISH_PUBLISHER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/clock.h"
#include "core/error.h"
#include "core/latency.h"
#include "publish/encoder.h"
#include "publish/result.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Fills in the service's part of a status message, without blocking. Thread: publisher.
 * False: nothing to say now. */
typedef bool shef_publisher_status_fn(void *context, struct shef_publish_status *out_status);

struct shef_publisher_params {
    const char *url;    /* sink.h; not kept */
    const char *prefix; /* of channel names: "SHEF" gives SHEF_DISPARITY; not kept */
    int32_t width_px;   /* of results */
    int32_t height_px;
    uint32_t outputs;  /* SHEF_OUTPUT() bits */
    int32_t grid_step; /* 1 or 2 */
    bool is_stepped;   /* no status messages: they tell of clocks, and messages shall be the same
                        * every time */
    const struct shef_clock *clock;
    shef_publisher_status_fn *status; /* NULL: no status messages */
    void *status_context;
};

struct shef_publisher;

/* Refuses what create() would refuse, and connects to nothing.    Thread: setup.
 * SHEF_ERR_INVALID: the address, or a prefix that makes no channel names. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_publisher_check(const char *url, const char *prefix,
                                                   struct shef_error *err);

/* Allocates everything; connects to nothing yet.                  Thread: setup.
 * SHEF_ERR_INVALID: the address, or a prefix that makes no channel names (1 to 50 bytes, printable,
 * no blanks). SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_publisher_create(struct shef_publisher **out_publisher,
                                                    const struct shef_publisher_params *params,
                                                    struct shef_error *err);

/* Disconnects and frees; nobody may run it any more. NULL is allowed. Thread: setup. */
void shef_publisher_destroy(struct shef_publisher *publisher);

/* Connects before the thread starts, so that somebody can be told why it fails. A failure may be
 * a warning: tick() goes on trying.                                Thread: setup. */
SHEF_MUST_CHECK enum shef_err shef_publisher_connect(struct shef_publisher *publisher,
                                                     struct shef_error *err);

/* What to publish from the next result on.                        Thread: any.
 *   outputs    SHEF_OUTPUT() bits
 *   grid_step  1 or 2 */
void shef_publisher_set(struct shef_publisher *publisher, uint32_t outputs, int32_t grid_step);

/* What the thread does: results as they come, tick() in between.  Thread: publisher.
 *   result     publishes one and gives it back
 *   tick       connects again and sends status messages, if it is time
 *   next_tick  when tick() has something to do; false: never */
void shef_publisher_result(struct shef_publisher *publisher, struct shef_result *result);
void shef_publisher_tick(struct shef_publisher *publisher);
bool shef_publisher_next_tick(const struct shef_publisher *publisher, shef_host_time *out_next);

struct shef_publisher_channel_stats {
    uint64_t n_messages; /* sent; chunks count one by one */
    uint64_t n_bytes;
    uint64_t max_bytes; /* of one message */
};

struct shef_publisher_stats {
    uint64_t n_published;       /* results with all their messages */
    uint64_t n_unpublished;     /* results of which some or all were not sent */
    uint64_t n_failed_messages; /* sends that failed */
    uint64_t n_connects;        /* successful ones */
    uint64_t n_failed_connects;
    bool is_connected;
    bool is_failing;     /* not connected, or the last message was not sent */
    int32_t last_errno;  /* of the last failed send; 0: none, or unknown */
    uint64_t n_warnings; /* grows when failing begins and, while it lasts, once a minute: whoever
                          * logs writes one line for each */
    uint32_t last_shed_bits;
    struct shef_publisher_channel_stats channels[SHEF_CHANNELS];
};

/* A copy; the numbers of one moment, give or take the message in hand. Thread: any. */
void shef_publisher_stats(const struct shef_publisher *publisher,
                          struct shef_publisher_stats *out_stats);

/* One sentence on what is wrong, for a log line or a person; empty if nothing is.
 *   out_text  n_bytes bytes, terminated; 256 are always enough */
void shef_publisher_describe_trouble(const struct shef_publisher_stats *stats, char *out_text,
                                     size_t n_bytes);

/* From the publisher's start, of completely published results.    Thread: any reads. */
struct shef_publisher_latency {
    struct shef_latency from_complete; /* whole frame arrived -> last message sent */
    struct shef_latency from_mid;      /* mid-exposure -> last message sent; empty when stepped */
    struct shef_latency own;           /* what the publisher itself took for the result */
};

const struct shef_publisher_latency *shef_publisher_latency(const struct shef_publisher *publisher);

#ifdef __cplusplus
}
#endif

#endif
