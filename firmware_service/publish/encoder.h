/* Results and states as the bytes of LCM messages.
 *
 * The only place, with sink.c, that knows the generated types. Large messages are cut into chunks
 * of whole rows of the grid (points, for clouds), each a datagram of its own that can be read
 * without the others: LCM loses a message of many fragments with any one of them. The same result
 * gives the same bytes, always. Nothing allocates after create(). Thread: one at a time. */
#ifndef SHEF_PUBLISH_ENCODER_H
#define SHEF_PUBLISH_ENCODER_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "publish/result.h"

#ifdef __cplusplus
extern "C" {
#endif

/* LCM 1.3.1 sends channel name, its end and message as one datagram up to 65,499 bytes; a name has
 * at most 63. */
#define SHEF_MESSAGE_MAX_BYTES (65499 - 64)

enum shef_channel {
    SHEF_CHANNEL_POSE, /* in the order in which a frame's messages are sent */
    SHEF_CHANNEL_DISPARITY,
    SHEF_CHANNEL_DEPTH,
    SHEF_CHANNEL_DENSE,
    SHEF_CHANNEL_CLOUD,
    SHEF_CHANNEL_STATUS,
    SHEF_CHANNELS,
};

/* What follows the prefix, e.g. "DISPARITY"; the channel is then SHEF_DISPARITY. */
const char *shef_channel_name(enum shef_channel channel);

/* Bits of outputs: 1 << enum shef_channel. */
#define SHEF_OUTPUT(channel) (1u << (channel))

/* The service's state for status_t. */
struct shef_publish_status {
    char state[96];     /* for people, terminated */
    shef_host_time now; /* when the rest was true */
    int64_t utc_minus_mono_ns;
    shef_event_time event; /* time of the last event */
    int64_t session_id;
    uint8_t calib_id[SHEF_CALIB_ID_BYTES];
    int32_t mode;
    uint64_t n_events;
    uint64_t n_frames;
    uint64_t n_shed;
    uint64_t n_unmatched;
    uint64_t n_damaged;
    float events_per_s;
    float frames_per_s;
    float cpu_cores;
    int32_t memory_mib;
    int32_t backlog; /* results that wait for the publisher */
    /* The publisher fills in what it knows itself. */
    uint32_t shed_bits;
    uint64_t n_published;
    uint64_t n_unpublished;
    int64_t complete_to_published_p50_ns, complete_to_published_p99_ns;
    int64_t mid_to_published_p50_ns, mid_to_published_p99_ns;
};

/* Takes one message; the bytes are valid until it returns.
 *   utime_us  the message's header.utime
 * Other than SHEF_OK ends the encoding, which returns that. */
typedef enum shef_err shef_message_fn(void *context, enum shef_channel channel,
                                      const uint8_t *bytes, size_t n_bytes, int64_t utime_us);

struct shef_encoder;

/* Allocates for results of one size.                              Thread: setup. */
SHEF_MUST_CHECK enum shef_err shef_encoder_create(struct shef_encoder **out_encoder,
                                                  int32_t width_px, int32_t height_px,
                                                  struct shef_error *err);

/* NULL is allowed. */
void shef_encoder_destroy(struct shef_encoder *encoder);

/* Hands the messages of a result to emit(), in the order of enum shef_channel.
 *   outputs    SHEF_OUTPUT() bits; what the result was shed of, or has not, is left out
 *   grid_step  1 or 2; 2 if the result was shed of the full grid */
enum shef_err shef_encoder_result(struct shef_encoder *encoder, const struct shef_result *result,
                                  uint32_t outputs, int32_t grid_step, shef_message_fn *emit,
                                  void *context);

/* Hands a status_t to emit().
 *   seq  of the status messages */
enum shef_err shef_encoder_status(struct shef_encoder *encoder,
                                  const struct shef_publish_status *status, uint64_t seq,
                                  shef_message_fn *emit, void *context);

#ifdef __cplusplus
}
#endif

#endif
