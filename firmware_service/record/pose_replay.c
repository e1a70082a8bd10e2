#include "record/pose_replay.h"

#include <stdbool.h>
#include <stdlib.h>

struct shef_pose_replay {
    struct shef_recorded_poses *poses;
    struct shef_replay_pacer pacer;
    bool has_next; /* read, not delivered */
    struct shef_recorded_pose next;
};

enum shef_err shef_pose_replay_create(const char *path, const struct shef_replay_config *config,
                                      struct shef_pose_replay **out_replay, struct shef_error *err)
{
    struct shef_pose_replay *replay = calloc(1, sizeof *replay);

    if (!replay)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "replay '%s': out of memory", path);
    shef_replay_pacer_init(&replay->pacer, config);

    const enum shef_err code = shef_recorded_poses_open(path, &replay->poses, err);

    if (code != SHEF_OK) {
        free(replay);
        return code;
    }
    *out_replay = replay;
    return SHEF_OK;
}

enum shef_err shef_pose_replay_take(struct shef_pose_replay *replay,
                                    struct shef_recorded_pose *out_pose, struct shef_error *err)
{
    if (!replay->has_next) {
        const enum shef_err code = shef_recorded_poses_next(replay->poses, &replay->next, err);

        if (code != SHEF_OK)
            return code;
        replay->has_next = true;
    }
    if (!shef_replay_pacer_is_due(&replay->pacer, replay->next.arrived))
        return SHEF_ERR_TIMEOUT;
    *out_pose = replay->next;
    replay->has_next = false;
    replay->pacer.n_delivered++;
    return SHEF_OK;
}

shef_host_time shef_pose_replay_due(const struct shef_pose_replay *replay)
{
    return shef_replay_pacer_due(&replay->pacer, replay->next.arrived);
}

void shef_pose_replay_step(struct shef_pose_replay *replay, uint32_t n_poses)
{
    shef_replay_pacer_step(&replay->pacer, n_poses);
}

void shef_pose_replay_destroy(struct shef_pose_replay *replay)
{
    if (!replay)
        return;
    shef_recorded_poses_close(replay->poses);
    free(replay);
}
