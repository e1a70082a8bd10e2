/* What the parts hand to each other: raw buffers, events and external triggers in batches.
 *
 * Times are event time in microseconds, as codecs and files count it; a batch carries one 64-bit
 * base and its events 32-bit offsets, so that an event is 8 bytes and a batch fits the L2 cache.
 * A batch belongs to one thread at a time. */
#ifndef SHEF_CORE_PACKETS_H
#define SHEF_CORE_PACKETS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_EVENT_ON 0x8000u /* in y_on: brightness rose */

struct shef_event {
    uint32_t t_us; /* since the batch's base_us */
    uint16_t x_px;
    uint16_t y_on; /* y in bits 14:0, SHEF_EVENT_ON or not in bit 15 */
};

static inline uint16_t shef_event_y_px(struct shef_event event)
{
    return event.y_on & (SHEF_EVENT_ON - 1);
}

static inline bool shef_event_is_on(struct shef_event event)
{
    return (event.y_on & SHEF_EVENT_ON) != 0;
}

static inline struct shef_event shef_event_make(uint32_t t_us, uint32_t x_px, uint32_t y_px,
                                                bool on)
{
    return (struct shef_event){ t_us, (uint16_t)x_px,
                                (uint16_t)(y_px | (on ? SHEF_EVENT_ON : 0u)) };
}

/* One edge on a trigger input of the event camera. */
struct shef_trigger {
    int64_t t_us;      /* event time, not relative to the batch */
    uint32_t n_before; /* how many events of the batch the stream sent before it */
    uint8_t channel;   /* 0..31 */
    bool rising;
};

#define SHEF_BATCH_EVENTS   16384 /* 128 KiB: half of the smallest L2 cache we expect */
#define SHEF_BATCH_TRIGGERS 64

/* Events and triggers in the order in which the sensor sent them. Times may step back a little. */
struct shef_event_batch {
    /* Set by the owner of the memory. */
    struct shef_event *events; /* capacity of them */
    uint32_t capacity;
    /* Set by whoever fills the batch. */
    uint32_t n_events;
    uint32_t n_triggers;
    int64_t base_us;    /* an event's time is base_us + t_us */
    int64_t reached_us; /* how far the stream's own clock had come at the batch's end */
    struct shef_trigger triggers[SHEF_BATCH_TRIGGERS];
};

static inline void shef_event_batch_clear(struct shef_event_batch *batch)
{
    batch->n_events = 0;
    batch->n_triggers = 0;
}

static inline int64_t shef_event_batch_time_us(const struct shef_event_batch *batch, uint32_t i)
{
    return batch->base_us + batch->events[i].t_us;
}

struct shef_buffer;

/* What travels on the rings between a device and its consumers: one buffer of raw bytes, as the
 * sensor sent them. Whoever pops it holds the buffer and gives it back. */
struct shef_raw_packet {
    struct shef_buffer *buffer;
    shef_host_time arrived;
    uint64_t number;        /* counted by the source from 0; without gaps */
    uint32_t n_lost_before; /* buffers that are known to be lost between the last one and this */
};

#ifdef __cplusplus
}
#endif

#endif
