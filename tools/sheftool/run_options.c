#include "sheftool/run_options.h"

#include <assert.h>

enum shef_err shef_run_options_check(const struct shef_run_options *options, struct shef_error *err)
{
    uint32_t features;

    if (options->robot && options->no_robot)
        return shef_fail(err, SHEF_ERR_INVALID, "--robot and --no-robot exclude each other");
    if (options->max_disparity_px > 0 && options->max_disparity_px < 16)
        return shef_fail(err, SHEF_ERR_INVALID, "--max-disparity %d: must be 16 to 256 px, or 0",
                         (int)options->max_disparity_px);
    return shef_isa_option(options->isa, &features, err);
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

    const enum shef_err code = shef_isa_option(options->isa, &settings.cpu_features, NULL);

    assert(code == SHEF_OK);
    (void)code;
    settings.depth.lag_px = options->lag_px;
    settings.depth.travel_m = options->travel_mm / 1000;
    settings.depth.max_disparity_px = (int32_t)options->max_disparity_px;
    settings.depth.align_auto = !options->no_align;
    settings.depth.smooths_in_time = options->past;
    return settings;
}
