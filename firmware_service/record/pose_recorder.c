#include "record/pose_recorder.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "codecs/rtde_package.h"
#include "record/pose_part.h"

#define MISSING_PERIODS 1.5 /* a step of the controller's time beyond this is a gap */

struct shef_pose_recorder {
    struct shef_part_recorder part;
    struct shef_rtde_recipe recipe;
    const struct shef_rtde_variable *timestamp;
    double period_s;
    bool has_last;
    double last_s;
};

struct shef_pose_recorder_config shef_pose_recorder_default_config(void)
{
    return (struct shef_pose_recorder_config){
        .protocol_version = 2,
        .recipe = "timestamp,actual_TCP_pose,actual_TCP_speed",
        .types = "DOUBLE,VECTOR6D,VECTOR6D",
        .frequency_hz = 125,
        .limits = shef_segment_limits_default(),
    };
}

/* Understands the recipe and writes it to the front. */
static enum shef_err prepare(struct shef_pose_recorder *recorder,
                             const struct shef_pose_recorder_config *config, struct shef_error *err)
{
    struct shef_front_text *front = &recorder->part.front;
    char number[40];
    bool fits;

    if (shef_rtde_recipe_parse(config->protocol_version, config->recipe, config->types,
                               &recorder->recipe, err) != SHEF_OK) {
        (void)shef_fail_context(err, "record poses");
        if (err)
            err->code = SHEF_ERR_INVALID;
        return SHEF_ERR_INVALID;
    }
    recorder->timestamp = shef_rtde_find(&recorder->recipe, "timestamp", SHEF_RTDE_DOUBLE);
    if (!recorder->timestamp)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "record poses: the recipe has no DOUBLE 'timestamp', so nothing says when "
                         "they were true");
    if (!(config->frequency_hz > 0) || config->frequency_hz > 1e6)
        return shef_fail(err, SHEF_ERR_INVALID, "record poses: a frequency of %g Hz cannot be",
                         config->frequency_hz);
    recorder->period_s = 1 / config->frequency_hz;
    shef_front_text_begin(front, SHEF_POSE_FRONT);
    snprintf(number, sizeof number, "%u", config->protocol_version);
    fits = shef_front_text_add(front, "version", number) &&
           shef_front_text_add(front, "recipe", config->recipe) &&
           shef_front_text_add(front, "types", config->types);
    snprintf(number, sizeof number, "%.9g", config->frequency_hz);
    fits = fits && shef_front_text_add(front, "frequency_hz", number);
    shef_front_text_end(front);
    return fits ? SHEF_OK
                : shef_fail(err, SHEF_ERR_INVALID, "record poses: the recipe is too long");
}

enum shef_err shef_pose_recorder_start(struct shef_recording_writer *recording,
                                       const struct shef_pose_recorder_config *config,
                                       struct shef_pose_recorder **out_recorder,
                                       struct shef_error *err)
{
    static const uint8_t info[SHEF_PART_INFO_BYTES];
    struct shef_pose_recorder *recorder = calloc(1, sizeof *recorder);
    enum shef_err code;

    if (!recorder)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "record to '%s': out of memory",
                         recording->folder);
    code = prepare(recorder, config, err);
    if (code == SHEF_OK)
        code = shef_part_recorder_start(&recorder->part, recording, SHEF_PART_POSES, info,
                                        &config->limits, err);
    if (code != SHEF_OK) {
        free(recorder);
        return code;
    }
    snprintf(recorder->part.counts->source, sizeof recorder->part.counts->source,
             "%.60s, %g Hz, %.100s", config->controller ? config->controller : "a robot",
             config->frequency_hz, config->recipe);
    *out_recorder = recorder;
    return SHEF_OK;
}

/* How many packages are missing before this one: what the caller knows, or what the controller's
 * time says if that is more. Time that steps back has begun anew. */
static uint32_t count_lost(const struct shef_pose_recorder *recorder, double time_s,
                           uint32_t n_lost_before)
{
    const double periods = (time_s - recorder->last_s) / recorder->period_s;

    if (!recorder->has_last || !(periods > MISSING_PERIODS) || periods > UINT32_MAX)
        return n_lost_before;

    const uint32_t n_skipped = (uint32_t)(periods + 0.5) - 1;

    return n_skipped > n_lost_before ? n_skipped : n_lost_before;
}

enum shef_err shef_pose_recorder_write(struct shef_pose_recorder *recorder, const uint8_t *package,
                                       uint32_t n_bytes, shef_host_time arrived,
                                       uint32_t n_lost_before, struct shef_error *err)
{
    struct shef_block_record record = { .arrived = arrived, .n_items = 1 };
    double time_s;

    if (!shef_rtde_package_is(&recorder->recipe, package, n_bytes))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "record poses: %u bytes are no data package of the recipe, which takes %u",
                         n_bytes, recorder->recipe.package_bytes);
    shef_rtde_get_doubles(recorder->timestamp, package, &time_s);
    record.n_lost_before = count_lost(recorder, time_s, n_lost_before);
    record.first_us = shef_pose_time(time_s).ns / SHEF_NS_PER_US;
    record.last_us = record.first_us;
    recorder->has_last = isfinite(time_s);
    recorder->last_s = time_s;
    return shef_part_recorder_write(&recorder->part, package, n_bytes, &record, err);
}

enum shef_err shef_pose_recorder_stop(struct shef_pose_recorder *recorder, struct shef_error *err)
{
    const uint64_t n_lost = recorder->part.counts->n_lost;
    char reason[120] = "";

    if (n_lost > 0)
        snprintf(reason, sizeof reason,
                 "%llu poses are missing, lost or never sent by the controller",
                 (unsigned long long)n_lost);

    const enum shef_err code = shef_part_recorder_stop(&recorder->part, reason, err);

    free(recorder);
    return code;
}
