/* The options that all commands have that take recordings to depth. */
#ifndef SHEFTOOL_RUN_OPTIONS_H
#define SHEFTOOL_RUN_OPTIONS_H

#include "sheftool/isa_option.h"
#include "sheftool/run_chain.h"

struct shef_run_options {
    const char *calibration;
    int32_t profile; /* 0: the calibration's */
    int32_t read;
    int64_t look_ahead;
    bool robot;
    bool no_robot;
    double lag_px;
    double travel_mm;
    double delay_ms;
    int64_t max_disparity_px; /* 0: the profile's */
    bool no_align;
    bool past;
    int64_t n_frames;
    int64_t n_threads;
    int32_t isa;
};

#define SHEF_RUN_OPTIONS(type_, how_)                                                              \
    SHEF_OPT_TEXT("calibration", type_, how_.calibration, "FILE", NULL,                            \
                  "instead of the recording's calibration.yaml"),                                  \
        SHEF_OPT_CHOICE("profile", type_, how_.profile, "calibration|wide|paper", "calibration",   \
                        "rectified views: wide f 555 px, paper f 1301 px"),                        \
        SHEF_OPT_FLAG("robot", type_, how_.robot, "fail if there are no poses"),                   \
        SHEF_OPT_FLAG("no-robot", type_, how_.no_robot,                                            \
                      "do not use recorded poses; find the motion in the pictures"),               \
        SHEF_OPT_CHOICE("read", type_, how_.read, "at-mid|late|centred", "centred",                \
                        "how the filter is read: at mid-exposure, as published, later, or with "   \
                        "what follows"),                                                           \
        SHEF_OPT_INT("look-ahead", type_, how_.look_ahead, "3", 1, 4, NULL,                        \
                     "steps of the centred read-out: events of 4, 9, 17 or 25 ms after "           \
                     "mid-exposure count; the service's depth.look_ahead"),                        \
        SHEF_OPT_REAL("lag", type_, how_.lag_px, "0.37", 0, 8, "px",                               \
                      "how far events trail behind edges, taken back"),                            \
        SHEF_OPT_REAL("travel", type_, how_.travel_mm, "10", 1, 100, "mm",                         \
                      "of the camera during a temporal pair"),                                     \
        SHEF_OPT_REAL("delay", type_, how_.delay_ms, "0", -50, 50, "ms",                           \
                      "added to the calibrated delay of exposures, for studies"),                  \
        SHEF_OPT_INT("max-disparity", type_, how_.max_disparity_px, "0", 0, 256, "px",             \
                     "largest disparity searched, 16 or more; 0: 47 for wide, 110 for paper"),     \
        SHEF_OPT_FLAG("no-align", type_, how_.no_align,                                            \
                      "do not measure and take out a vertical residual between the views"),        \
        SHEF_OPT_FLAG("past", type_, how_.past, "take the previous frame's result as a prior"),    \
        SHEF_OPT_INT("frames", type_, how_.n_frames, "0", 0, 1000000000, NULL,                     \
                     "stop after so many frames; 0: all"),                                         \
        SHEF_OPT_INT("threads", type_, how_.n_threads, "1", 1, 64, NULL,                           \
                     "worker threads; the results are the same for every number"),                 \
        SHEF_OPT_ISA(type_, how_.isa,                                                              \
                     "instruction set of the kernels; the results are the same for each")

/* Refuses what contradicts itself or is not there. */
SHEF_MUST_CHECK enum shef_err shef_run_options_check(const struct shef_run_options *options,
                                                     struct shef_error *err);

/* Modes are left to the caller. The options must have been checked. */
struct shef_run_settings shef_run_options_settings(const struct shef_run_options *options,
                                                   const char *recording);

#endif
