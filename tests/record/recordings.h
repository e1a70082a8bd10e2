/* Helpers of the recording tests: a sensor's stream, recorded, and what comes back. */
#ifndef SHEF_TESTS_RECORD_RECORDINGS_H
#define SHEF_TESTS_RECORD_RECORDINGS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "codecs/evt.h"
#include "record/event_recorder.h"
#include "record/recorded_events.h"
#include "support/support.h"

/* One event or trigger, in the order of the stream. */
struct seen_item {
    int64_t t_us;
    uint16_t x_px; /* triggers: the channel */
    uint16_t y_px; /* triggers: 65535 */
    bool on;       /* triggers: rising */
};

struct seen {
    struct seen_item *items;
    size_t n;
    size_t capacity;
};

void seen_add(struct seen *seen, const struct shef_event_batch *batch);
void seen_free(struct seen *seen);
bool seen_same(const struct seen_item *a, const struct seen_item *b);

/* Fails the test unless both are equal. */
void seen_expect_same(const struct seen *expected, const struct seen *actual);

/* Whether `part` is what is left of `whole` when some of it is removed. */
bool seen_is_subsequence(const struct seen *part, const struct seen *whole);

/* How many items at the front of both are equal. */
size_t seen_common_prefix(const struct seen *a, const struct seen *b);

/* The bytes a sensor would send, with all time words, and what they decode to. */
struct sensor_stream {
    struct shef_raw_header camera;
    uint8_t *bytes;
    size_t n_bytes;
    struct seen seen;
};

/* A random scene of 64 x 48 px.
 *   start_us    of event time; the stream's own counter wraps wherever it does
 *   n_events    about so many, a few triggers among them
 *   mean_gap_us between events */
struct sensor_stream sensor_stream_make(enum shef_evt_format format, int64_t start_us,
                                        int32_t n_events, int32_t mean_gap_us,
                                        struct shef_test_random *random);
void sensor_stream_free(struct sensor_stream *stream);

/* A configuration for small tests: no syncs, large segments. */
struct shef_event_recorder_config recording_config(const struct sensor_stream *stream);

/* Records the stream in buffers of 1..max_buffer_bytes, one each millisecond of host time.
 *   n_stop  stop after so many buffers as a kill would: nothing is closed; 0: all, and close */
void record_stream(const char *folder, const struct sensor_stream *stream,
                   const struct shef_event_recorder_config *config, uint32_t max_buffer_bytes,
                   uint32_t n_stop, struct shef_test_random *random);

/* What a recording gives back. */
struct replayed {
    struct seen seen;
    struct shef_evt_stats stats;
    struct shef_damage damage;
    enum shef_err code; /* of open or the last next(); SHEF_ERR_EMPTY when all went well */
    char error[512];
    char notes[8192]; /* all of them, one a line */
};

struct replayed read_recording(const char *folder);
void replayed_free(struct replayed *replayed);

#endif
