#include "shefsim/event_readout.h"

#include <assert.h>
#include <stdlib.h>

#include "core/memory.h"
#include "core/time.h"

enum shef_err sim_event_readout_init(struct sim_event_readout *readout,
                                     const struct sim_event_readout_params *params,
                                     int32_t height_px, struct shef_error *err)
{
    *readout = (struct sim_event_readout){ .params = *params, .height_px = height_px };
    if (!params->is_limited)
        return SHEF_OK;
    assert(params->capacity >= 1 && params->capacity <= SIM_READOUT_MAX_EVENTS);
    readout->slots = shef_memory_create(params->capacity, sizeof *readout->slots);
    readout->rows = shef_memory_create((size_t)height_px, sizeof *readout->rows);
    readout->queue = shef_memory_create((size_t)height_px, sizeof *readout->queue);
    if (!readout->slots || !readout->rows || !readout->queue) {
        sim_event_readout_deinit(readout);
        return shef_fail(err, SHEF_ERR_NO_MEMORY,
                         "make the event sensor's read-out: out of memory");
    }
    for (uint32_t i = 0; i < params->capacity; i++)
        readout->slots[i].next = (uint16_t)(i + 1);
    return SHEF_OK;
}

void sim_event_readout_deinit(struct sim_event_readout *readout)
{
    free(readout->slots);
    free(readout->rows);
    free(readout->queue);
    *readout = (struct sim_event_readout){ .n_lost = 0 };
}

/* Puts an event behind the others of its row, and the row into the queue if it was not there. */
static void ask(struct sim_event_readout *readout, struct shef_event event)
{
    const uint16_t y_px = shef_event_y_px(event);
    struct sim_readout_row *row = &readout->rows[y_px];

    if (readout->n_waiting == readout->params.capacity) {
        readout->n_lost++;
        return;
    }

    const uint16_t slot = (uint16_t)readout->free_slot;

    readout->free_slot = readout->slots[slot].next;
    readout->slots[slot] = (struct sim_readout_event){ event.x_px, event.y_on, 0 };
    readout->n_waiting++;
    if (row->n++ == 0) {
        const uint32_t height = (uint32_t)readout->height_px;

        row->first = slot;
        readout->queue[(readout->queue_first + readout->n_queued++) % height] = y_px;
    } else {
        readout->slots[row->last].next = slot;
    }
    row->last = slot;
}

/* Lets the row at the head of the queue out. */
static void serve(struct sim_event_readout *readout, struct sim_readout_out *out)
{
    const struct sim_event_readout_params *params = &readout->params;
    struct sim_readout_row *row = &readout->rows[readout->queue[readout->queue_first]];
    const uint32_t t_us = (uint32_t)(readout->free_at_ns / SHEF_NS_PER_US - out->base_us);

    readout->queue_first = (readout->queue_first + 1) % (uint32_t)readout->height_px;
    readout->n_queued--;
    for (uint32_t i = 0, slot = row->first; i < row->n; i++) {
        const struct sim_readout_event event = readout->slots[slot];

        out->events[out->n++] = (struct shef_event){ t_us, event.x_px, event.y_on };
        readout->slots[slot].next = (uint16_t)readout->free_slot;
        readout->free_slot = slot;
        slot = event.next;
    }
    readout->free_at_ns += params->row_ns + row->n * params->event_ns;
    readout->n_bursts += row->n > 1;
    readout->n_waiting -= row->n;
    row->n = 0;
}

void sim_event_readout_run(struct sim_event_readout *readout, const struct shef_event *events,
                           size_t n, int64_t base_us, int64_t until_us, struct sim_readout_out *out)
{
    for (size_t i = 0; i < n; i++) {
        const int64_t now_ns = (base_us + events[i].t_us) * SHEF_NS_PER_US;

        while (readout->n_queued > 0 && readout->free_at_ns < now_ns)
            serve(readout, out);
        if (readout->free_at_ns < now_ns)
            readout->free_at_ns = now_ns;
        ask(readout, events[i]);
    }
    while (readout->n_queued > 0 && readout->free_at_ns < until_us * SHEF_NS_PER_US)
        serve(readout, out);
}
