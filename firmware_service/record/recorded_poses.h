/* Reads the pose part of a recording, package by package, with the tool's pose decoded.
 *
 * Damaged packages, and such without a pose that can be, are left out and counted. What is odd
 * becomes a note, one sentence each. Blocks on reading. Thread: one per reader. */
#ifndef SHEF_RECORD_RECORDED_POSES_H
#define SHEF_RECORD_RECORDED_POSES_H

#include <stdbool.h>
#include <stdint.h>

#include "calib/rigid.h"
#include "codecs/rtde_package.h"
#include "core/error.h"
#include "core/time.h"
#include "record/block_reader.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_recorded_poses;

struct shef_recorded_pose {
    shef_robot_time time; /* the controller's timestamp */
    shef_host_time arrived;
    bool follows;                   /* no package is missing between the one before and this */
    uint32_t n_lost_before;         /* packages known to have been lost while recording */
    struct shef_rigid t_world_hand; /* actual_TCP_pose: T_W_H */
    bool has_speed;                 /* the recipe has actual_TCP_speed: */
    double velocity_m_s[3];         /* of the tool's point, base axes */
    double turn_rad_s[3];           /* its angular velocity, base axes */
    const uint8_t *package;         /* as it came; until the next call */
    uint32_t package_bytes;
};

/* Opens a recording's poses.
 * SHEF_ERR_NOT_FOUND: it has no pose part. SHEF_ERR_EMPTY: nothing was recorded. SHEF_ERR_FORMAT:
 * no readable index or recipe, or a recipe without DOUBLE timestamp and VECTOR6D actual_TCP_pose.
 * SHEF_ERR_UNSUPPORTED: of a later version. SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_recorded_poses_open(const char *path,
                                                       struct shef_recorded_poses **out_poses,
                                                       struct shef_error *err);

/* Reads the next package.
 * SHEF_ERR_EMPTY: there are no more. Errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_recorded_poses_next(struct shef_recorded_poses *poses,
                                                       struct shef_recorded_pose *out_pose,
                                                       struct shef_error *err);

/* How packages are laid out, to decode more of them. */
const struct shef_rtde_recipe *shef_recorded_poses_recipe(const struct shef_recorded_poses *poses);

/* At which packages were to come; 0 if that is not known. */
double shef_recorded_poses_frequency_hz(const struct shef_recorded_poses *poses);

/* How many packages there are, by the indexes. */
uint64_t shef_recorded_poses_count(const struct shef_recorded_poses *poses);

/* What was found so far; complete after SHEF_ERR_EMPTY. */
const struct shef_damage *shef_recorded_poses_damage(const struct shef_recorded_poses *poses);

/* The i-th note, NULL behind the last. They come with the end. */
const char *shef_recorded_poses_note(const struct shef_recorded_poses *poses, int i);

/* NULL is allowed. */
void shef_recorded_poses_close(struct shef_recorded_poses *poses);

/* Decodes a package of a recipe that has DOUBLE timestamp and VECTOR6D actual_TCP_pose; fills in
 * time, pose and speed.
 * Returns false if it is no such package, or time or pose cannot be. */
bool shef_pose_decode(const struct shef_rtde_recipe *recipe, const uint8_t *package,
                      uint32_t n_bytes, struct shef_recorded_pose *out_pose);

#ifdef __cplusplus
}
#endif

#endif
