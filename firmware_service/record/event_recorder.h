/* Writes the event part of a recording.
 *
 * Takes the sensor's buffers as they came and writes them unchanged, one block each. Beside that
 * it decodes them, for what a recording must know about itself: the decoder's state in front of
 * every block, so that each can be read on its own, event time, counts, violations, and the
 * verdict on whether anything was lost. Whatever ends the recording, what was written stays
 * readable. Blocks on disk; between start() and stop() nothing is allocated.
 * Thread: one, not a streaming one. */
#ifndef SHEF_RECORD_EVENT_RECORDER_H
#define SHEF_RECORD_EVENT_RECORDER_H

#include <stdint.h>

#include "codecs/evt.h"
#include "codecs/raw_header.h"
#include "core/error.h"
#include "core/time.h"
#include "record/recording_writer.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_event_recorder;

struct shef_event_recorder_config {
    struct shef_raw_header camera; /* format, size, and what is known of the camera */
    int64_t near_us;               /* see shef_evt_init() */
    uint32_t features;             /* instruction sets, usually shef_cpu_features() */
    uint64_t segment_bytes;        /* see struct shef_block_writer_config */
    int64_t segment_ns;
    int64_t sync_ns;
};

/* 512 MiB or 60 s a segment, forced to the disk every second. */
struct shef_event_recorder_config shef_event_recorder_default_config(
    const struct shef_raw_header *camera);

/* Makes the part.
 *   recording  kept; its manifest is the recorder's to write until stop()
 * SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_event_recorder_start(
    struct shef_recording_writer *recording, const struct shef_event_recorder_config *config,
    struct shef_event_recorder **out_recorder, struct shef_error *err);

/* What comes next does not continue what was recorded so far: the source has begun anew, or is
 * recorded from its middle on. The next buffer begins a segment and is decoded from here.
 *   state     as shef_evt_save() has written it in front of that buffer; if it is none, decoding
 *             goes on as it is
 *   shift_us  makes its time later: of a source that is played again from its start
 * Errors as of write(). */
SHEF_MUST_CHECK enum shef_err shef_event_recorder_restart(struct shef_event_recorder *recorder,
                                                          const uint8_t state[SHEF_EVT_STATE_BYTES],
                                                          int64_t shift_us, struct shef_error *err);

/* Records one buffer of the sensor.
 *   arrived        when it came
 *   n_lost_before  buffers that are known to be lost between the last one and this
 * After an error, which becomes the recording's verdict, only stop() may follow. */
SHEF_MUST_CHECK enum shef_err shef_event_recorder_write(struct shef_event_recorder *recorder,
                                                        const uint8_t *bytes, uint32_t n_bytes,
                                                        shef_host_time arrived,
                                                        uint32_t n_lost_before,
                                                        struct shef_error *err);

/* Closes the files and says the verdict. Frees the recorder.
 * Returns what went wrong here; an error of write() is not repeated. */
SHEF_MUST_CHECK enum shef_err shef_event_recorder_stop(struct shef_event_recorder *recorder,
                                                       struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
