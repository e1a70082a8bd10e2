/* A stream of random events with the triggers of eight frames, fed into snapshots.
 *
 * A test may change events and triggers between stream_make() and stream_feed(). Thread: the
 * test's own. */
#ifndef SHEF_TESTS_SNAPSHOT_STREAM_H
#define SHEF_TESTS_SNAPSHOT_STREAM_H

#include "pipeline/snapshot.h"
#include "support/support.h"

#define STREAM_WIDTH_PX     48
#define STREAM_HEIGHT_PX    32
#define STREAM_N_PIXELS     (STREAM_WIDTH_PX * STREAM_HEIGHT_PX)
#define STREAM_START_US     INT64_C(4294000000) /* the 32-bit time wraps within the stream */
#define STREAM_PERIOD_US    18519
#define STREAM_EXPOSURE_US  5001 /* the middle falls between two microseconds */
#define STREAM_N_FRAMES     8
#define STREAM_N_EVENTS     63300 /* about 190 ms: the last frame is complete, no next one expected */
#define STREAM_MAX_TRIGGERS 40

/* Every event and trigger in the order sent. */
extern struct shef_event stream_events[STREAM_N_EVENTS]; /* since STREAM_START_US */
extern uint32_t stream_n_events;
extern struct shef_trigger stream_triggers[STREAM_MAX_TRIGGERS];
extern uint32_t stream_n_triggers;

/* What they are fed into. */
extern struct shef_filter *stream_filter;
extern struct shef_hot_pixels *stream_hot; /* NULL: none are learnt */
extern struct shef_snapshots *stream_snapshots;

/* When frame i's exposure begins, in us since STREAM_START_US. */
uint32_t stream_rise_us(int i);

/* Makes all frames but the edges left out, as bits 2 * i (rise) and 2 * i + 1 (fall). */
void stream_make(uint32_t left_out);

/* Adds a trigger where the sensor puts it: before the first later event. */
void stream_add_trigger(uint32_t t_us, int channel, bool rising);

struct shef_snapshot_params stream_params(enum shef_snapshot_read read);

/* Makes a new filter and snapshots, with stream_params() or others; stop() destroys all three. */
void stream_start(enum shef_snapshot_read read);
void stream_start_with(const struct shef_snapshot_params *params);
void stream_stop(void);

/* Feeds events first..end - 1 and the triggers among them; those at the very end come with it.
 * Returns how many snapshots were published. */
uint32_t stream_feed(uint32_t first, uint32_t end);
void stream_feed_all_in(uint32_t n_at_once);

/* A snapshot's content by value. */
struct stream_copy {
    struct shef_snapshot snapshot;
    int16_t values[STREAM_N_PIXELS];
    int16_t sums[STREAM_N_PIXELS];
};

/* Valid for 3 * STREAM_N_FRAMES calls. */
struct stream_copy *stream_copy_of(uint64_t number);

void stream_expect_same(const struct stream_copy *a, const struct stream_copy *b);

/* Compares a snapshot with what the definition of its read-out gives. */
void stream_expect_defined(const struct stream_copy *copy, enum shef_snapshot_read read);

#endif
