/* A run's memory; only run_chain.c includes this. */
#ifndef SHEFTOOL_RUN_INTERNAL_H
#define SHEFTOOL_RUN_INTERNAL_H

#include "sheftool/events_source.h"
#include "sheftool/paths.h"
#include "sheftool/run_chain.h"
#include "record/recorded_clock.h"
#include "record/pose_track.h"

#define N_HELD 128 /* snapshots that wait for their frames; memory as needed */

struct held_snapshot {
    bool is_set;
    struct shef_snapshot snapshot; /* images in memory */
    uint8_t *memory;
};

struct shef_run {
    struct shef_run_settings settings;
    struct shef_calibration calibration;
    struct shef_depth_geometry geometry;
    struct shef_events_source *events;
    uint32_t width_px; /* of the event sensor */
    uint32_t height_px;
    struct shef_recorded_frames *frames;
    struct shef_recorded_clock clock;
    struct shef_pose_track poses;
    struct shef_workers *workers;
    struct shef_depth_chain *chains[SHEF_DEPTH_N_MODES];
    struct shef_depth_output output;

    struct shef_pairing pairing;
    struct held_snapshot held[N_HELD];
    uint64_t n_held;     /* ever */
    uint32_t next_frame; /* to be offered */
    shef_run_frame_fn *use;
    void *context;
    struct shef_run_counts counts;
    char notes[SHEF_RUN_MAX_NOTES][SHEF_ERROR_TEXT_BYTES];
    int n_notes;
};

#endif
