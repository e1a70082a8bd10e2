/* The robot's poses of a recording in memory, to be asked at any host time. Thread: any. */
#ifndef SHEF_RECORD_POSE_TRACK_H
#define SHEF_RECORD_POSE_TRACK_H

#include <stdbool.h>
#include <stddef.h>

#include "calib/rigid.h"
#include "codecs/rtde_package.h"
#include "core/error.h"
#include "core/time.h"

/* What the robot said at one time, in world axes. */
struct shef_tracked_pose {
    shef_host_time at;      /* when it was true, by the host's clock */
    shef_host_time arrived; /* when the host got it */
    struct shef_rigid t_world_hand;
    double speed[6]; /* of the tool: m/s, then rad/s */
};

struct shef_pose_track {
    struct shef_tracked_pose *poses; /* by time; owned */
    size_t n;
    uint8_t *packages; /* as they came, n of package_bytes; owned */
    struct shef_rtde_recipe recipe;
    double frequency_hz;
};

/* Reads all poses.
 *   delay_ns  calibrated: how much later than they were true poses arrive, at the least
 * SHEF_ERR_NOT_FOUND: the recording has none. */
SHEF_MUST_CHECK enum shef_err shef_pose_track_read(const char *recording, int64_t delay_ns,
                                                   struct shef_pose_track *out_poses,
                                                   struct shef_error *err);

/* The state at a time: speeds interpolated, the pose that of the nearer sample (8 ms apart).
 * Returns false before the first pose, after the last, or where none is within 100 ms. */
bool shef_pose_track_at(const struct shef_pose_track *poses, shef_host_time at,
                        struct shef_tracked_pose *out_pose);

/* A zeroed list is allowed. */
void shef_pose_track_free(struct shef_pose_track *poses);

#endif
