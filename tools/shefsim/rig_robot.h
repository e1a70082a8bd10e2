/* The robot's controller as the recording sees it: RTDE data packages, and where it says its tool
 * is. Thread: one. */
#ifndef SHEFSIM_RIG_ROBOT_H
#define SHEFSIM_RIG_ROBOT_H

#include "core/error.h"
#include "record/pose_recorder.h"
#include "record/recording_writer.h"
#include "shefsim/rig_parts.h"

struct sim_rig_robot;

/* Makes the recording's part of poses.
 * SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err sim_rig_robot_start(struct sim_rig_robot **out_robot,
                                                  struct shef_recording_writer *recording,
                                                  struct shef_error *err);

/* Records one package: timestamp, actual_TCP_pose, actual_TCP_speed.
 *   robot_ns  the controller's clock
 *   t_ns      true time
 *   arrived   at the host */
SHEF_MUST_CHECK enum shef_err sim_rig_robot_report(struct sim_rig_robot *robot,
                                                   const struct sim_rig *rig, int64_t robot_ns,
                                                   int64_t t_ns, shef_host_time arrived,
                                                   struct shef_error *err);

/* Ends the part and frees the robot.
 * Returns what went wrong here; an error of report() is not repeated. */
SHEF_MUST_CHECK enum shef_err sim_rig_robot_stop(struct sim_rig_robot *robot,
                                                 struct shef_error *err);

#endif
