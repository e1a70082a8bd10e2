/* Plays the pose part of a recording as if the robot were there: the same data packages again.
 *
 * Packages are small and are handed over decoded, by value. What is missing or damaged in the
 * recording is counted like packages that were lost. Reads the disk; after create() nothing is
 * allocated. Paces as record/replay.h; give all replays the same zero. */
#ifndef SHEF_RECORD_POSE_REPLAY_H
#define SHEF_RECORD_POSE_REPLAY_H

#include "core/error.h"
#include "record/recorded_poses.h"
#include "record/replay_pacer.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_pose_replay;

/* Opens a recording and allocates.                                Thread: setup.
 *   config  n_buffers is not used
 * As shef_recorded_poses_open(). */
SHEF_MUST_CHECK enum shef_err shef_pose_replay_create(const char *path,
                                                      const struct shef_replay_config *config,
                                                      struct shef_pose_replay **out_replay,
                                                      struct shef_error *err);

/* Gives the next pose once it is due.                             Thread: source.
 *   out_pose  times are those of the recording; its package lasts until the next call
 * SHEF_ERR_TIMEOUT: not yet; due() says when. SHEF_ERR_EMPTY: that was all. SHEF_ERR_IO: reading
 * failed. */
SHEF_MUST_CHECK enum shef_err shef_pose_replay_take(struct shef_pose_replay *replay,
                                                    struct shef_recorded_pose *out_pose,
                                                    struct shef_error *err);

/* When the next pose is due, after take() has said SHEF_ERR_TIMEOUT at recorded pace.
 *                                                                 Thread: source. */
shef_host_time shef_pose_replay_due(const struct shef_pose_replay *replay);

/* Allows n_poses more at stepped pace.                            Thread: any. */
void shef_pose_replay_step(struct shef_pose_replay *replay, uint32_t n_poses);

/* NULL is allowed.                                                Thread: setup. */
void shef_pose_replay_destroy(struct shef_pose_replay *replay);

#ifdef __cplusplus
}
#endif

#endif
