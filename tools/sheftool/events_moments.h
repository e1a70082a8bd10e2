/* The filter's snapshots of a recorded stream, at a rate or at its triggers.
 *
 * Runs the same parts as the live pipeline: filter, hot pixels, snapshots at mid-exposure. At a
 * rate, instants take the place of the triggers. Thread: main. */
#ifndef SHEFTOOL_EVENTS_MOMENTS_H
#define SHEFTOOL_EVENTS_MOMENTS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/error.h"
#include "pipeline/snapshot.h"
#include "sheftool/events_source.h"

struct shef_moments_params {
    double rate_hz;      /* 0: at the rising edges of the channel */
    int32_t channel;     /* of the triggers */
    int64_t exposure_us; /* of the frames, where no falling edge tells; at triggers only */
    int64_t delay_ns;    /* of exposures after their triggers, as the events show them */
    double from_s;       /* the stretch of time to look at, since the first event */
    double to_s;         /* not more than 1e9 */
    double cutoff_rad_s;
    enum shef_snapshot_read read;
    int32_t n_steps;   /* of the centred read-out, 1..4; 0: 4 */
    bool mask_hot;     /* learn and mask hot pixels */
    uint32_t width_px; /* of the sensor, 1..2048 */
    uint32_t height_px;
};

/* What the consumer is told with each snapshot. */
struct shef_moment {
    const struct shef_snapshot *snapshot; /* valid during the call */
    int64_t since_first_us;               /* of mid-exposure */
    uint32_t n_hot;                       /* pixels masked */
};

typedef enum shef_err shef_moment_fn(void *context, const struct shef_moment *moment,
                                     struct shef_error *err);

/* Reads the source to its end, or to to_s, and calls `use` for every snapshot in order.
 *   out_stats  of the snapshots
 * SHEF_ERR_INVALID: impossible parameters. Also the errors of the source and of `use`. */
SHEF_MUST_CHECK enum shef_err shef_moments_run(struct shef_events_source *source,
                                               const struct shef_moments_params *params,
                                               shef_moment_fn *use, void *context,
                                               struct shef_snapshot_stats *out_stats,
                                               struct shef_error *err);

#endif
