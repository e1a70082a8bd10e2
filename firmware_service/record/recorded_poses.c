#include "record/recorded_poses.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "record/part_reader.h"
#include "record/part_table.h"
#include "record/pose_part.h"

#define MAX_POSITION_M   100.0
#define MAX_ROTATION_RAD 6.2831853071795865 /* more than a rotation vector needs */
#define MAX_TIME_S       1e9

struct shef_recorded_poses {
    struct shef_part_reader part;
    struct shef_rtde_recipe recipe;
    double frequency_hz;
    uint8_t *room;
    uint64_t n_impossible;
    bool has_skipped; /* since the last one that was delivered */
    bool has_ended;
};

bool shef_pose_decode(const struct shef_rtde_recipe *recipe, const uint8_t *package,
                      uint32_t n_bytes, struct shef_recorded_pose *out_pose)
{
    const struct shef_rtde_variable *time = shef_rtde_find(recipe, "timestamp", SHEF_RTDE_DOUBLE);
    const struct shef_rtde_variable *tool =
        shef_rtde_find(recipe, "actual_TCP_pose", SHEF_RTDE_VECTOR6D);
    const struct shef_rtde_variable *speed =
        shef_rtde_find(recipe, "actual_TCP_speed", SHEF_RTDE_VECTOR6D);
    double time_s;
    double tool_values[6];
    double speed_values[6] = { 0 };

    if (!time || !tool || !shef_rtde_package_is(recipe, package, n_bytes))
        return false;
    shef_rtde_get_doubles(time, package, &time_s);
    shef_rtde_get_doubles(tool, package, tool_values);
    if (speed)
        shef_rtde_get_doubles(speed, package, speed_values);
    if (!(fabs(time_s) <= MAX_TIME_S))
        return false;
    for (int i = 0; i < 6; i++)
        if (!(fabs(tool_values[i]) <= (i < 3 ? MAX_POSITION_M : MAX_ROTATION_RAD)))
            return false;
    out_pose->time = shef_pose_time(time_s);
    out_pose->t_world_hand = shef_rigid_from_rotation_vector(tool_values + 3, tool_values);
    out_pose->has_speed = speed != NULL;
    for (int i = 0; i < 6; i++)
        out_pose->has_speed = out_pose->has_speed && isfinite(speed_values[i]);
    memcpy(out_pose->velocity_m_s, speed_values, sizeof out_pose->velocity_m_s);
    memcpy(out_pose->turn_rad_s, speed_values + 3, sizeof out_pose->turn_rad_s);
    return true;
}

static enum shef_err read_front(struct shef_recorded_poses *poses, const char *path,
                                struct shef_error *err)
{
    const struct shef_front_text *front = &poses->part.front;
    char version[8];
    char recipe[SHEF_RTDE_LIST_BYTES];
    char types[SHEF_RTDE_LIST_BYTES];
    char frequency[40];
    enum shef_err code;

    if (!shef_front_text_get(front, "version", 0, version, sizeof version) ||
        !shef_front_text_get(front, "recipe", 0, recipe, sizeof recipe) ||
        !shef_front_text_get(front, "types", 0, types, sizeof types))
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "the pose part of '%s' does not say its version, recipe and types", path);
    code = shef_rtde_recipe_parse((uint32_t)strtoul(version, NULL, 10), recipe, types,
                                  &poses->recipe, err);
    if (code != SHEF_OK)
        return shef_fail_context(err, "the pose part of '%s'", path);
    if (shef_front_text_get(front, "frequency_hz", 0, frequency, sizeof frequency))
        poses->frequency_hz = strtod(frequency, NULL);
    if (!(poses->frequency_hz >= 0 && poses->frequency_hz <= 1e6))
        poses->frequency_hz = 0;
    if (!shef_rtde_find(&poses->recipe, "timestamp", SHEF_RTDE_DOUBLE) ||
        !shef_rtde_find(&poses->recipe, "actual_TCP_pose", SHEF_RTDE_VECTOR6D))
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "the pose part of '%s' has no timestamp or no actual_TCP_pose", path);
    return SHEF_OK;
}

enum shef_err shef_recorded_poses_open(const char *path, struct shef_recorded_poses **out_poses,
                                       struct shef_error *err)
{
    struct shef_recorded_poses *poses = calloc(1, sizeof *poses);
    enum shef_err code;

    if (!poses)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "open '%s': out of memory", path);
    code = shef_part_reader_open(&poses->part, path, SHEF_PART_POSES, SHEF_POSE_FRONT, err);
    if (code == SHEF_OK)
        code = read_front(poses, path, err);
    if (code == SHEF_OK) {
        poses->room = malloc(shef_part_kind(SHEF_PART_POSES)->max_block_bytes);
        if (!poses->room)
            code = shef_fail(err, SHEF_ERR_NO_MEMORY, "open '%s': out of memory", path);
    }
    if (code != SHEF_OK) {
        shef_recorded_poses_close(poses);
        return code;
    }
    *out_poses = poses;
    return SHEF_OK;
}

static void finish(struct shef_recorded_poses *poses)
{
    if (poses->has_ended)
        return;
    poses->has_ended = true;
    shef_part_reader_note_damage(&poses->part);
    if (poses->n_impossible > 0)
        shef_part_reader_note(&poses->part,
                              "%llu packages hold no pose that can be, or are not of the recipe: "
                              "left out",
                              (unsigned long long)poses->n_impossible);
}

enum shef_err shef_recorded_poses_next(struct shef_recorded_poses *poses,
                                       struct shef_recorded_pose *out_pose, struct shef_error *err)
{
    struct shef_block block;
    enum shef_err code;

    while ((code = shef_block_reader_next(poses->part.blocks, poses->room, &block, err)) ==
           SHEF_OK) {
        struct shef_recorded_pose pose = {
            .arrived = block.record.arrived,
            .n_lost_before = block.record.n_lost_before,
            .package = poses->room,
            .package_bytes = block.record.n_bytes,
        };

        if (!shef_pose_decode(&poses->recipe, poses->room, block.record.n_bytes, &pose)) {
            poses->n_impossible++;
            poses->has_skipped = true;
            continue;
        }
        pose.follows = block.follows && block.record.n_lost_before == 0 && !poses->has_skipped;
        poses->has_skipped = false;
        *out_pose = pose;
        return SHEF_OK;
    }
    if (code == SHEF_ERR_EMPTY)
        finish(poses);
    return code;
}

const struct shef_rtde_recipe *shef_recorded_poses_recipe(const struct shef_recorded_poses *poses)
{
    return &poses->recipe;
}

double shef_recorded_poses_frequency_hz(const struct shef_recorded_poses *poses)
{
    return poses->frequency_hz;
}

uint64_t shef_recorded_poses_count(const struct shef_recorded_poses *poses)
{
    return shef_block_reader_summary(poses->part.blocks)->n_records;
}

const struct shef_damage *shef_recorded_poses_damage(const struct shef_recorded_poses *poses)
{
    return shef_block_reader_damage(poses->part.blocks);
}

const char *shef_recorded_poses_note(const struct shef_recorded_poses *poses, int i)
{
    return shef_part_reader_get_note(&poses->part, i);
}

void shef_recorded_poses_close(struct shef_recorded_poses *poses)
{
    if (!poses)
        return;
    shef_part_reader_close(&poses->part);
    free(poses->room);
    free(poses);
}
