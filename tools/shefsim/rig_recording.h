/* The recording that a rendering writes: all parts, with the host's arrival times.
 *
 * Parts are written by the same code as live ones (record/). Delays on the way to the host are
 * drawn from the seed. The folder gets its name when it is complete. Thread: one. */
#ifndef SHEFSIM_RIG_RECORDING_H
#define SHEFSIM_RIG_RECORDING_H

#include "core/error.h"
#include "shefsim/event_sensor.h"
#include "shefsim/rig_parts.h"

struct sim_rig_recording;

/* Begins to write.
 *   rig     kept
 *   folder  does not exist, or is empty
 * On failure nothing stays behind. */
SHEF_MUST_CHECK enum shef_err sim_rig_recording_begin(struct sim_rig_recording **out_recording,
                                                      const struct sim_rig *rig, const char *folder,
                                                      struct shef_error *err);

/* Says that a frame's exposure is to come, before the events of its time. */
SHEF_MUST_CHECK enum shef_err sim_rig_recording_announce(struct sim_rig_recording *recording,
                                                         const struct sim_rig_frame *frame,
                                                         struct shef_error *err);

SHEF_MUST_CHECK enum shef_err sim_rig_recording_events(struct sim_rig_recording *recording,
                                                       const struct sim_events *events,
                                                       struct shef_error *err);

/* The frame that the rig has exposed. */
SHEF_MUST_CHECK enum shef_err sim_rig_recording_frame(struct sim_rig_recording *recording,
                                                      const struct sim_rig_frame *frame,
                                                      struct shef_error *err);

/* The times and the pose of a frame, as they really were. */
SHEF_MUST_CHECK enum shef_err sim_rig_recording_truth_frame(struct sim_rig_recording *recording,
                                                            const struct sim_rig_frame *frame,
                                                            struct shef_error *err);

/* The maps that the rig has seen at the middle of a frame's exposure. */
SHEF_MUST_CHECK enum shef_err sim_rig_recording_truth_maps(struct sim_rig_recording *recording,
                                                           const struct sim_rig_frame *frame,
                                                           struct shef_error *err);

/* The pose that the robot's controller reports.
 *   robot_ns  its own clock
 *   t_ns      true time */
SHEF_MUST_CHECK enum shef_err sim_rig_recording_pose(struct sim_rig_recording *recording,
                                                     int64_t robot_ns, int64_t t_ns,
                                                     struct shef_error *err);

/* Ends all parts and gives the folder its name. Frees the recording.
 * On failure nothing is left. */
SHEF_MUST_CHECK enum shef_err sim_rig_recording_commit(struct sim_rig_recording *recording,
                                                       struct shef_error *err);

/* Removes what was written and frees the recording. NULL is allowed. */
void sim_rig_recording_discard(struct sim_rig_recording *recording);

#endif
