/* From events and triggers to a recording: encoded in EVT3 as a sensor sends it, a buffer a
 * millisecond, each with the time of its arrival at the host.
 *
 * Events come in the order of their times, and so do triggers; both wait here until everything up
 * to the end of a millisecond is known. Thread: one at a time. */
#ifndef SHEFSIM_EVENT_STREAM_H
#define SHEFSIM_EVENT_STREAM_H

#include <stdint.h>

#include "core/error.h"
#include "record/recording_writer.h"
#include "shefsim/event_sensor.h"
#include "shefsim/rig_clocks.h"

struct sim_event_stream;

struct sim_event_stream_config {
    int32_t width_px;
    int32_t height_px;
    struct sim_clocks clocks;
    uint64_t seed;     /* of the delays on the way to the host */
    int64_t delay_ns;  /* of every buffer, at least */
    int64_t jitter_ns; /* on top of it, at most */
    int64_t
        shift_us; /* added to the times of events, not of triggers: a wrong clock, for studies */
};

/*   recording  kept
 * SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err sim_event_stream_start(struct sim_event_stream **out_stream,
                                                     const struct sim_event_stream_config *config,
                                                     struct shef_recording_writer *recording,
                                                     struct shef_error *err);

/* Takes the edges of a trigger that is to come: later than all before, and not earlier than what
 * add() has completed.
 *   t_us  event time */
SHEF_MUST_CHECK enum shef_err sim_event_stream_trigger(struct sim_event_stream *stream,
                                                       int64_t t_us, bool rising,
                                                       struct shef_error *err);

/* Takes events, their times in event time.
 * SHEF_ERR_NO_MEMORY, errors of the system: then only stop() may follow. */
SHEF_MUST_CHECK enum shef_err sim_event_stream_add(struct sim_event_stream *stream,
                                                   const struct sim_events *events,
                                                   struct shef_error *err);

/* Writes what still waits, ends the recording's event part and frees the stream.
 * Returns what went wrong here; an error of add() is not repeated. */
SHEF_MUST_CHECK enum shef_err sim_event_stream_stop(struct sim_event_stream *stream,
                                                    struct shef_error *err);

#endif
