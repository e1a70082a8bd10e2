#include "sheftool/run_options.h"

#include "core/cpu.h"

static uint32_t features_of(int32_t isa)
{
    char name[16];

    if (isa == 0)
        return shef_cpu_features();
    shef_option_choice(SHEF_RUN_ISA_CHOICES, isa, name, sizeof name);
    return shef_cpu_features_of(name);
}

enum shef_err shef_run_options_check(const struct shef_run_options *options, struct shef_error *err)
{
    const uint32_t wanted = features_of(options->isa);

    if (options->robot && options->no_robot)
        return shef_fail(err, SHEF_ERR_INVALID, "--robot and --no-robot exclude each other");
    if ((wanted & shef_cpu_features()) != wanted)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "this processor lacks that instruction set; leave --isa away to use %s",
                         shef_cpu_isa_name(shef_cpu_features()));
    if (options->max_disparity_px > 0 && options->max_disparity_px < 16)
        return shef_fail(err, SHEF_ERR_INVALID, "--max-disparity %d: must be 16 to 256 px, or 0",
                         (int)options->max_disparity_px);
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
        .cpu_features = features_of(options->isa),
    };

    settings.depth.lag_px = options->lag_px;
    settings.depth.travel_m = options->travel_mm / 1000;
    settings.depth.max_disparity_px = (int32_t)options->max_disparity_px;
    settings.depth.align_auto = !options->no_align;
    settings.depth.smooths_in_time = options->past;
    return settings;
}
