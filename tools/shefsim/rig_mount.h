/* How the rig is put together: its true calibration, and wrong ones for studies.
 *
 * The cameras are those of Wang 2021 (frame camera f 1301 px, event camera f 555 px, 65.44 mm
 * apart), with lenses that distort, turned against each other by 0.3 degrees, and mounted a little
 * off the hand's axes. The same rig for every seed. Thread: any. */
#ifndef SHEFSIM_RIG_MOUNT_H
#define SHEFSIM_RIG_MOUNT_H

#include <stdint.h>

#include "calib/calibration.h"
#include "core/error.h"

/* The soonest that a pose reaches the host after it was true. */
#define SIM_RIG_POSE_DELAY_NS 1200000

/* The rig as it is.
 *   event_latency_ns  of the event sensor
 * SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_rig_calibration(int64_t event_latency_ns,
                                                  struct shef_calibration *out_calibration,
                                                  struct shef_error *err);

/* What a calibration gets wrong. */
struct sim_miscalibration {
    double vertical_px;  /* the event camera's rows, in its pixels */
    double roll_deg;     /* the event camera about its optical axis */
    double pitch_deg;    /* about its x axis */
    double yaw_deg;      /* about its y axis: shifts all disparities */
    double baseline_pct; /* its distance */
};

/* Makes a calibration wrong by this much.
 * SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_rig_miscalibrate(struct shef_calibration *calibration,
                                                   const struct sim_miscalibration *wrong,
                                                   struct shef_error *err);

#endif
