/* Where messages go: LCM's multicast, or a log file in LCM's format.
 *
 *   udpm://[ADDRESS:PORT][?ttl=N]    multicast; 239.255.76.67:7667 and ttl=0 unless said
 *   file://PATH                      a log, written anew; lcm-logplayer and lcm-spy read it. Its
 *                                    time stamps are the messages' utime, not when they were
 *                                    written: the same messages make the same file
 *   memq://                          nowhere: for measurements
 *
 * LCM allocates in connect() and may do so in send(): for the publisher's thread and set-up.
 * Thread: one at a time. */
#ifndef SHEF_PUBLISH_SINK_H
#define SHEF_PUBLISH_SINK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_sink;

/* Reads the address; connects to nothing.
 * SHEF_ERR_INVALID: the sentence says what is wrong with it. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_sink_create(const char *url, struct shef_sink **out_sink,
                                               struct shef_error *err);

/* Disconnects and frees. NULL is allowed. */
void shef_sink_destroy(struct shef_sink *sink);

/* Opens it; does nothing if it is open.
 * SHEF_ERR_IO: no multicast route; the sentence names the command that adds one.
 * SHEF_ERR_NOT_FOUND, PERMISSION, NO_SPACE: the log's folder. */
SHEF_MUST_CHECK enum shef_err shef_sink_connect(struct shef_sink *sink, struct shef_error *err);

bool shef_sink_is_connected(const struct shef_sink *sink);

/* Sends one message; may block for as long as the socket's or the disk's queue is full.
 *   out_errno  why, on failure; 0 if unknown
 * SHEF_ERR_IO: not sent; the next may succeed. Only while connected. */
SHEF_MUST_CHECK enum shef_err shef_sink_send(struct shef_sink *sink, const char *channel,
                                             const void *bytes, size_t n_bytes, int64_t utime_us,
                                             int *out_errno);

#ifdef __cplusplus
}
#endif

#endif
