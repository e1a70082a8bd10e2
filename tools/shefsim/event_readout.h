/* The way out of an event sensor: one row at a time, at a limited rate.
 *
 * A pixel that fires asks for its row. Rows are served in the order in which they first asked;
 * when a row's turn comes, all its waiting events leave together with one time stamp. Serving a
 * row takes row_ns and event_ns for each event. So with little to do every event leaves at once
 * and alone, and with much to do rows leave in bursts and late, as those of real sensors do. Of
 * more than capacity waiting events the newest are lost, and counted.
 * Thread: one at a time. */
#ifndef SHEFSIM_EVENT_READOUT_H
#define SHEFSIM_EVENT_READOUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/packets.h"

#define SIM_READOUT_MAX_EVENTS 65536

struct sim_event_readout_params {
    bool is_limited;   /* false: every event leaves at once */
    int64_t row_ns;    /* 0..100 us */
    int64_t event_ns;  /* 1..100 us */
    uint32_t capacity; /* waiting events, 1..SIM_READOUT_MAX_EVENTS */
};

struct sim_readout_event {
    uint16_t x_px;
    uint16_t y_on;
    uint16_t next; /* of the same row, SIM_READOUT_MAX_EVENTS - 1 at most */
};

struct sim_readout_row {
    uint16_t first;
    uint16_t last;
    uint32_t n; /* 0: the row is not in the queue */
};

/* All fields are the read-out's own. */
struct sim_event_readout {
    struct sim_event_readout_params params;
    int32_t height_px;
    struct sim_readout_event *slots; /* capacity of them; the free ones are linked */
    struct sim_readout_row *rows;    /* height_px */
    uint16_t *queue;                 /* ring of height_px rows */
    uint32_t queue_first;
    uint32_t n_queued;
    uint32_t n_waiting;
    uint32_t free_slot;
    int64_t free_at_ns; /* when the row being served is done */
    uint64_t n_lost;
    uint64_t n_bursts;
};

/* Where events go: room for at least all that were put in. */
struct sim_readout_out {
    struct shef_event *events;
    size_t n;
    int64_t base_us;
};

/* SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_event_readout_init(struct sim_event_readout *readout,
                                                     const struct sim_event_readout_params *params,
                                                     int32_t height_px, struct shef_error *err);

/* Takes events in the order of their times, and lets out all that leave before until_us.
 *   events, n, base_us  times are base_us + t_us
 *   until_us            no event after these comes earlier than this */
void sim_event_readout_run(struct sim_event_readout *readout, const struct shef_event *events,
                           size_t n, int64_t base_us, int64_t until_us,
                           struct sim_readout_out *out);

/* A zeroed read-out is allowed. */
void sim_event_readout_deinit(struct sim_event_readout *readout);

#endif
