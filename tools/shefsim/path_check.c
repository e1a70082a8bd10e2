/* What the arm can reach, and what is in its way. */
#include <math.h>

#include "shefsim/path.h"

#define REACH_M     0.85   /* Universal Robots: the UR5's working radius */
#define SHOULDER_M  0.0892 /* above the base, from its kinematic table */
#define COLUMN_M    0.15   /* around the base's axis, where the arm cannot bend to */
#define CLEARANCE_M 0.10
#define N_PLACES    256

struct shef_rigid sim_path_base(void)
{
    /* The columns are the base's axes in the world. */
    return (struct shef_rigid){
        .r = { 0, -1, 0, 0, 0, -1, 1, 0, 0 },
        .t_m = { 0, 0.35, -0.45 },
    };
}

static enum shef_err check_reach(const double point_m[3], struct shef_error *err)
{
    const struct shef_rigid t_world_base = sim_path_base();
    const struct shef_rigid t_base_world = shef_rigid_invert(&t_world_base);
    double p[3];
    double sideways_m;
    double reach_m;

    shef_rigid_apply(&t_base_world, point_m, p);
    sideways_m = sqrt(p[0] * p[0] + p[1] * p[1]);
    reach_m = sqrt(sideways_m * sideways_m + (p[2] - SHOULDER_M) * (p[2] - SHOULDER_M));
    if (reach_m > REACH_M)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "the path is out of the arm's reach: at (%.2f, %.2f, %.2f) m it is %.2f m "
                         "from the shoulder, and the UR5 reaches %.2f m; make it smaller or move "
                         "its centre",
                         point_m[0], point_m[1], point_m[2], reach_m, REACH_M);
    if (sideways_m < COLUMN_M)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "the path comes too near to the arm's own base: at (%.2f, %.2f, %.2f) m "
                         "it is %.2f m from its axis, less than %.2f m; move its centre",
                         point_m[0], point_m[1], point_m[2], sideways_m, COLUMN_M);
    return SHEF_OK;
}

enum shef_err sim_path_check(const struct sim_path *path, const struct sim_scene *scene,
                             struct shef_error *err)
{
    for (int i = 0; i < N_PLACES; i++) {
        const struct shef_rigid pose =
            sim_path_pose(path, (int64_t)(1e9 * sim_path_round_s(path) * i / N_PLACES));
        const enum shef_err code = check_reach(pose.t_m, err);
        int32_t object;
        double clearance_m;

        if (code != SHEF_OK)
            return code;
        if (!scene)
            continue;
        clearance_m = sim_scene_clearance_m(scene, pose.t_m, &object);
        if (clearance_m < CLEARANCE_M)
            return shef_fail(err, SHEF_ERR_INVALID,
                             "the path goes through the scene: at (%.2f, %.2f, %.2f) m it is %.2f "
                             "m from '%s' of scene '%s', less than %.2f m; move its centre",
                             pose.t_m[0], pose.t_m[1], pose.t_m[2], clearance_m,
                             sim_scene_object_name(scene, object), sim_scene_name(scene),
                             CLEARANCE_M);
    }
    return SHEF_OK;
}
