/* The robot's poses of a recording in memory, to be asked at any host time. Thread: any. */
#ifndef SHEFTOOL_RUN_POSES_H
#define SHEFTOOL_RUN_POSES_H

#include <stdbool.h>
#include <stddef.h>

#include "calib/rigid.h"
#include "core/error.h"
#include "core/time.h"

/* What the robot said at one time, in world axes. */
struct shef_run_pose {
    shef_host_time at; /* when it was true, by the host's clock */
    struct shef_rigid t_world_hand;
    double speed[6]; /* of the tool: m/s, then rad/s */
};

struct shef_run_poses {
    struct shef_run_pose *poses; /* by time; owned */
    size_t n;
};

/* Reads all poses.
 *   delay_ns  calibrated: how much later than they were true poses arrive, at the least
 * SHEF_ERR_NOT_FOUND: the recording has none. */
SHEF_MUST_CHECK enum shef_err shef_run_poses_read(const char *recording, int64_t delay_ns,
                                                  struct shef_run_poses *out_poses,
                                                  struct shef_error *err);

/* The state at a time: speeds interpolated, the pose that of the nearer sample (8 ms apart).
 * Returns false before the first pose, after the last, or where none is within 100 ms. */
bool shef_run_poses_at(const struct shef_run_poses *poses, shef_host_time at,
                       struct shef_run_pose *out_pose);

/* A zeroed list is allowed. */
void shef_run_poses_free(struct shef_run_poses *poses);

#endif
