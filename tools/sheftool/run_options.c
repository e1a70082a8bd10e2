#include "sheftool/run_options.h"

#include <assert.h>

#include "core/cpu.h"
#include "core/words.h"

static enum shef_err features_of(int32_t isa, uint32_t *out_features, struct shef_error *err)
{
    char name[16];

    shef_words_at(SHEF_CPU_CHOICES, isa, name, sizeof name);
    return shef_cpu_features_among(name, out_features, err);
}

enum shef_err shef_run_options_check(const struct shef_run_options *options, struct shef_error *err)
{
    uint32_t features;

    if (options->robot && options->no_robot)
        return shef_fail(err, SHEF_ERR_INVALID, "--robot and --no-robot exclude each other");
    if (options->max_disparity_px > 0 && options->max_disparity_px < 16)
        return shef_fail(err, SHEF_ERR_INVALID, "--max-disparity %d: must be 16 to 256 px, or 0",
                         (int)options->max_disparity_px);
    if (features_of(options->isa, &features, err) != SHEF_OK)
        return shef_fail_context(err, "--isa");
    return SHEF_OK;
}

struct shef_run_settings shef_run_options_settings(const struct shef_run_options *options,
                                                   const char *recording)
{
    static const char *const profiles[] = { NULL, "wide", "paper" };
    struct shef_run_settings settings = {
        .recording = recording,
        .calibration = options->calibration,
        .profile = profiles[options->profile],
        .ignores_robot = options->no_robot,
        .needs_robot = options->robot,
        .depth = shef_depth_default_params(),
        .read = (enum shef_snapshot_read)options->read,
        .look_ahead = (int32_t)options->look_ahead,
        .extra_delay_ns = (int64_t)(options->delay_ms * 1e6),
        .max_frames = options->n_frames,
        .n_threads = (int32_t)options->n_threads,
    };

    const enum shef_err code = features_of(options->isa, &settings.cpu_features, NULL);

    assert(code == SHEF_OK);
    (void)code;
    settings.depth.lag_px = options->lag_px;
    settings.depth.travel_m = options->travel_mm / 1000;
    settings.depth.max_disparity_px = (int32_t)options->max_disparity_px;
    settings.depth.align_auto = !options->no_align;
    settings.depth.smooths_in_time = options->past;
    return settings;
}
