/* Where converted events go: RAW, DAT, CSV or NPY, by the name's ending.
 *
 *   .raw  events and triggers in EVT2, EVT2.1 or EVT3
 *   .dat  events; triggers in NAME_trigger.dat
 *   .csv  t_us,x,y,p; triggers in NAME_trigger.csv as t_us,channel,rising
 *   .npy  a structured array t i8 (us), x i2, y i2, p u1; triggers in NAME_trigger.npy as
 *         t i8 (us), channel u1, rising u1
 * Files have their names only when they are complete. Thread: main. */
#ifndef SHEFTOOL_EVENTS_SINK_H
#define SHEFTOOL_EVENTS_SINK_H

#include "codecs/event_writer.h"
#include "core/error.h"
#include "core/packets.h"

enum shef_sink_kind {
    SHEF_SINK_RAW,
    SHEF_SINK_DAT,
    SHEF_SINK_CSV,
    SHEF_SINK_NPY,
};

/* SHEF_ERR_INVALID: the name ends in none of the four; the sentence lists them. */
SHEF_MUST_CHECK enum shef_err shef_sink_kind_of(const char *path, enum shef_sink_kind *out_kind,
                                                struct shef_error *err);

struct shef_sink;

/* Begins to write.
 *   config  size, format and camera, for RAW and DAT */
SHEF_MUST_CHECK enum shef_err shef_sink_open(const char *path, enum shef_sink_kind kind,
                                             const struct shef_event_writer_config *config,
                                             struct shef_sink **out_sink, struct shef_error *err);

SHEF_MUST_CHECK enum shef_err shef_sink_write(struct shef_sink *sink,
                                              const struct shef_event_batch *batch,
                                              struct shef_error *err);

/* Completes the files; what failed, here or in write(), leaves none. Frees the sink. */
SHEF_MUST_CHECK enum shef_err shef_sink_close(struct shef_sink *sink, struct shef_error *err);

/* Removes what was written and frees the sink. NULL is allowed. */
void shef_sink_abandon(struct shef_sink *sink);

#endif
