/* Which trigger belongs to a recording's first frame, found before it plays.
 *
 * A camera that has just been opened shows only with its fourth frame or so which trigger is
 * whose, and the frames before have to wait. A recording can be looked at beforehand, so that
 * nothing waits, neither at the start nor when it begins again in a loop. Reads as many of the
 * first events as it takes: with 54 frames a second usually 0.15 s of them. Thread: setup. */
#ifndef SHEF_SERVICE_FIRST_PAIR_H
#define SHEF_SERVICE_FIRST_PAIR_H

#include <stdbool.h>

#include "core/error.h"
#include "pipeline/pairing.h"
#include "record/recorded_clock.h"
#include "record/recorded_frames.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The trigger input that carries the frame camera's exposure signal. */
#define SHEF_EXPOSURE_CHANNEL 0

struct shef_first_pair {
    bool is_known;
    bool is_ambiguous; /* as SHEF_PAIRING_AMBIGUOUS */
    struct shef_pairing_anchor pair;
};

/* Looks for it.
 *   recording  the folder
 *   frames     of the same recording; only what is known of them without reading them
 *   delay_ns   as in struct shef_snapshot_params: is part of the pair's event time
 * SHEF_OK also where nothing fits: is_known then says so, and pairing has to find its own way.
 * Otherwise the errors of reading events. */
SHEF_MUST_CHECK enum shef_err shef_first_pair_find(const char *recording,
                                                   const struct shef_recorded_frames *frames,
                                                   const struct shef_recorded_clock *clock,
                                                   int64_t delay_ns,
                                                   struct shef_first_pair *out_pair,
                                                   struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
