#include "shefsim/rig_robot.h"

#include <assert.h>
#include <stdlib.h>

#include "codecs/rtde_package.h"

#define RECIPE_NUMBER 1

struct sim_rig_robot {
    struct shef_pose_recorder *recorder;
    struct shef_rtde_recipe recipe;
    const struct shef_rtde_variable *timestamp;
    const struct shef_rtde_variable *pose;
    const struct shef_rtde_variable *speed;
};

enum shef_err sim_rig_robot_start(struct sim_rig_robot **out_robot,
                                  struct shef_recording_writer *recording, struct shef_error *err)
{
    struct shef_pose_recorder_config config = shef_pose_recorder_default_config();
    struct sim_rig_robot *robot = calloc(1, sizeof *robot);
    enum shef_err code;

    if (!robot)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "record poses: out of memory");
    config.controller = "shefsim";
    config.limits.sync_ns = 0;
    code = shef_rtde_recipe_parse(config.protocol_version, config.recipe, config.types,
                                  &robot->recipe, err);
    if (code == SHEF_OK)
        code = shef_pose_recorder_start(recording, &config, &robot->recorder, err);
    if (code != SHEF_OK) {
        free(robot);
        return code;
    }
    robot->timestamp = shef_rtde_find(&robot->recipe, "timestamp", SHEF_RTDE_DOUBLE);
    robot->pose = shef_rtde_find(&robot->recipe, "actual_TCP_pose", SHEF_RTDE_VECTOR6D);
    robot->speed = shef_rtde_find(&robot->recipe, "actual_TCP_speed", SHEF_RTDE_VECTOR6D);
    assert(robot->timestamp && robot->pose && robot->speed);
    *out_robot = robot;
    return SHEF_OK;
}

enum shef_err sim_rig_robot_report(struct sim_rig_robot *robot, const struct sim_rig *rig,
                                   int64_t robot_ns, int64_t t_ns, shef_host_time arrived,
                                   struct shef_error *err)
{
    const struct shef_rigid hand = sim_rig_hand(rig, t_ns);
    const double timestamp_s = (double)robot_ns / 1e9;
    double pose[6];
    double speed[6] = { 0 };
    double world_m_s[3];
    uint8_t package[SHEF_RTDE_PACKAGE_MAX_BYTES];

    for (int i = 0; i < 3; i++)
        pose[i] = hand.t_m[i];
    shef_rigid_rotation_vector(&hand, pose + 3);
    sim_path_velocity(rig->path, t_ns, world_m_s);
    shef_rigid_rotate(&rig->t_base_world, world_m_s, speed);

    shef_rtde_package_begin(&robot->recipe, RECIPE_NUMBER, package);
    shef_rtde_put_doubles(robot->timestamp, &timestamp_s, package);
    shef_rtde_put_doubles(robot->pose, pose, package);
    shef_rtde_put_doubles(robot->speed, speed, package);
    return shef_pose_recorder_write(robot->recorder, package, robot->recipe.package_bytes, arrived,
                                    0, err);
}

enum shef_err sim_rig_robot_stop(struct sim_rig_robot *robot, struct shef_error *err)
{
    const enum shef_err code = shef_pose_recorder_stop(robot->recorder, err);

    free(robot);
    return code;
}
