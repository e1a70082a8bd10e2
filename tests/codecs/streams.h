/* Helpers of the codec tests: streams built word by word, and all that a decoder makes of them. */
#ifndef SHEF_TESTS_CODECS_STREAMS_H
#define SHEF_TESTS_CODECS_STREAMS_H

#include "codecs/evt.h"
#include "codecs/evt_encode.h"
#include "core/packets.h"
#include "support/support.h"

/* Bytes that grow. Free with stream_free(). */
struct stream {
    uint8_t *bytes;
    size_t n_bytes;
    size_t capacity;
};

void stream_put(struct stream *stream, const void *bytes, size_t n_bytes);
void stream_free(struct stream *stream);

/* Words of EVT2. */
void evt2_high(struct stream *stream, uint32_t value);
void evt2_event(struct stream *stream, uint32_t low_us, uint32_t x_px, uint32_t y_px, bool on);
void evt2_trigger(struct stream *stream, uint32_t low_us, uint32_t channel, bool rising);
void evt2_word(struct stream *stream, uint32_t word);

/* Words of EVT2.1, little-endian. */
void evt21_high(struct stream *stream, uint32_t value);
void evt21_events(struct stream *stream, uint32_t low_us, uint32_t x_px, uint32_t y_px, bool on,
                  uint32_t valid);
void evt21_word(struct stream *stream, uint64_t word);

/* Words of EVT3: any type by its number. */
void evt3_word(struct stream *stream, uint32_t type, uint32_t value);

struct timed_event {
    int64_t t_us;
    uint16_t x_px;
    uint16_t y_px;
    bool on;
};

/* Everything that came out of a stream, in order. Free with decoded_free(). */
struct decoded {
    struct timed_event *events;
    size_t n_events;
    size_t events_capacity;
    struct shef_trigger *triggers; /* n_before counts from the stream's beginning */
    size_t n_triggers;
    size_t triggers_capacity;
    struct shef_evt_stats stats;
    int64_t reached_us;
};

void decoded_free(struct decoded *decoded);

/* Appends a batch. */
void decoded_add(struct decoded *decoded, const struct shef_event_batch *batch);

struct decoding {
    enum shef_evt_format format;
    uint32_t width_px; /* 0: 2048 */
    uint32_t height_px;
    int64_t near_us;
    const char *isa;                 /* NULL: the best of this machine */
    size_t slice_bytes;              /* 0: all at once */
    struct shef_test_random *random; /* not NULL: slices of 1..slice_bytes */
    uint32_t batch_events;           /* 0: 4096 */
};

/* Decodes all bytes, the end of the stream included. */
struct decoded decode_all(struct decoding decoding, const uint8_t *bytes, size_t n_bytes);

/* Fails the test at the first difference of events, triggers, counts and time reached. */
void expect_same(const struct decoded *expected, const struct decoded *actual);

/* The same, but for the counts. */
void expect_same_events(const struct decoded *expected, const struct decoded *actual);

/* One event of the expected values at place i. */
void expect_event(const struct decoded *decoded, size_t i, int64_t t_us, uint32_t x_px,
                  uint32_t y_px, bool on);

/* Expects that nothing breaks the rules. */
void expect_no_violations(const struct shef_evt_stats *stats);

/* A random scene: bursts along rows, pauses, triggers. Events are in order of time.
 *   start_us  of the first event
 *   pause_us  longest pause between bursts */
struct scene {
    uint32_t width_px;
    uint32_t height_px;
    int64_t start_us;
    int32_t pause_us;
    int32_t n_bursts;
    uint32_t n_channels; /* of triggers */
};
struct decoded scene_make(struct scene scene, struct shef_test_random *random);

/* Encodes events and triggers, cut into batches of n_batch events. */
struct stream encode_all(struct shef_evt_encoder *encoder, const struct decoded *source,
                         uint32_t n_batch);

#endif
