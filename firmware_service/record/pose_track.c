#include "record/pose_track.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "record/recorded_poses.h"

#define MAX_GAP_NS (100 * SHEF_NS_PER_MS)

static enum shef_err add(struct shef_pose_track *poses, size_t *capacity,
                         const struct shef_tracked_pose *pose, struct shef_error *err)
{
    if (poses->n == *capacity) {
        const size_t n = *capacity > 0 ? 2 * *capacity : 1024;
        struct shef_tracked_pose *more = realloc(poses->poses, n * sizeof *more);

        if (!more)
            return shef_fail(err, SHEF_ERR_NO_MEMORY, "poses: no memory for %zu poses", n);
        poses->poses = more;
        *capacity = n;
    }
    poses->poses[poses->n++] = *pose;
    return SHEF_OK;
}

/* Speeds from positions, where the robot does not say them. Turning is not known then. */
static void fill_speeds(struct shef_pose_track *poses)
{
    for (size_t i = 0; i < poses->n; i++) {
        const struct shef_tracked_pose *a = &poses->poses[i > 0 ? i - 1 : 0];
        const struct shef_tracked_pose *b = &poses->poses[i + 1 < poses->n ? i + 1 : i];
        const double span_s = (double)shef_host_time_since(b->at, a->at) * 1e-9;

        for (int axis = 0; axis < 3 && span_s > 0; axis++)
            poses->poses[i].speed[axis] =
                (b->t_world_hand.t_m[axis] - a->t_world_hand.t_m[axis]) / span_s;
    }
}

/* The robot's own clock has no jitter of arrival: times follow it, held by the soonest arrivals.
 *   first  where the clock began anew; it runs on from there to the end */
static void smooth_times(struct shef_pose_track *poses, size_t first, const int64_t *robot_ns)
{
    int64_t least_ns = INT64_MAX;

    for (size_t i = first; i < poses->n; i++) {
        const int64_t delay_ns = poses->poses[i].at.ns - robot_ns[i];

        least_ns = delay_ns < least_ns ? delay_ns : least_ns;
    }
    for (size_t i = first; i < poses->n; i++)
        poses->poses[i].at.ns = robot_ns[i] + least_ns;
}

enum shef_err shef_pose_track_read(const char *recording, int64_t delay_ns,
                                   struct shef_pose_track *out_poses, struct shef_error *err)
{
    struct shef_recorded_poses *reader;
    struct shef_recorded_pose pose;
    struct shef_pose_track poses = { 0 };
    size_t capacity = 0;
    size_t first = 0; /* since the controller was started */
    bool has_speed = true;
    int64_t *robot_ns = NULL;
    enum shef_err code = shef_recorded_poses_open(recording, &reader, err);

    if (code == SHEF_ERR_EMPTY)
        return shef_fail(err, SHEF_ERR_NOT_FOUND, "'%s' has no poses", recording);
    if (code != SHEF_OK)
        return code;
    robot_ns = malloc((size_t)(shef_recorded_poses_count(reader) + 1) * sizeof *robot_ns);
    poses.recipe = *shef_recorded_poses_recipe(reader);
    poses.frequency_hz = shef_recorded_poses_frequency_hz(reader);
    poses.packages =
        malloc((size_t)(shef_recorded_poses_count(reader) + 1) * poses.recipe.package_bytes);
    if (!robot_ns || !poses.packages)
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "poses: no memory for poses");
    while (code == SHEF_OK && (code = shef_recorded_poses_next(reader, &pose, err)) == SHEF_OK) {
        struct shef_tracked_pose kept = { .at = shef_host_time_add(pose.arrived, -delay_ns),
                                          .arrived = pose.arrived,
                                          .t_world_hand = pose.t_world_hand };

        /* Said twice. */
        if (poses.n > 0 && pose.time.ns == robot_ns[poses.n - 1])
            continue;
        /* A clock that steps back: the controller was started again. */
        if (poses.n > 0 && pose.time.ns < robot_ns[poses.n - 1]) {
            smooth_times(&poses, first, robot_ns);
            first = poses.n;
        }
        memcpy(kept.speed, pose.velocity_m_s, sizeof pose.velocity_m_s);
        memcpy(kept.speed + 3, pose.turn_rad_s, sizeof pose.turn_rad_s);
        has_speed = has_speed && pose.has_speed;
        robot_ns[poses.n] = pose.time.ns;
        memcpy(poses.packages + poses.n * poses.recipe.package_bytes, pose.package,
               poses.recipe.package_bytes);
        code = add(&poses, &capacity, &kept, err);
    }
    shef_recorded_poses_close(reader);
    if (code == SHEF_ERR_EMPTY)
        code = poses.n > 1 ? SHEF_OK
                           : shef_fail(err, SHEF_ERR_NOT_FOUND, "'%s' has no poses", recording);
    if (code == SHEF_OK) {
        smooth_times(&poses, first, robot_ns);
        if (!has_speed)
            fill_speeds(&poses);
        *out_poses = poses;
    } else {
        shef_pose_track_free(&poses);
    }
    free(robot_ns);
    return code;
}

bool shef_pose_track_at(const struct shef_pose_track *poses, shef_host_time at,
                        struct shef_tracked_pose *out_pose)
{
    size_t low = 0;
    size_t high = poses->n;

    while (low < high) {
        const size_t middle = (low + high) / 2;

        if (poses->poses[middle].at.ns <= at.ns)
            low = middle + 1;
        else
            high = middle;
    }
    if (low == 0 || low == poses->n)
        return false;

    const struct shef_tracked_pose *a = &poses->poses[low - 1];
    const struct shef_tracked_pose *b = &poses->poses[low];
    const double share = (double)(at.ns - a->at.ns) / (double)(b->at.ns - a->at.ns);

    if (b->at.ns - a->at.ns > MAX_GAP_NS)
        return false;
    *out_pose = share < 0.5 ? *a : *b;
    out_pose->at = at;
    for (int i = 0; i < 6; i++)
        out_pose->speed[i] = a->speed[i] + share * (b->speed[i] - a->speed[i]);
    return true;
}

void shef_pose_track_free(struct shef_pose_track *poses)
{
    free(poses->poses);
    free(poses->packages);
    *poses = (struct shef_pose_track){ 0 };
}
