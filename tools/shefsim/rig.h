/* The rig: two cameras on an arm in front of a scene, rendered into a recording.
 *
 * One object holds everything that a rendering needs: scene, path, lenses, sensors, clocks. It
 * renders what the event camera, the frame camera and the truth see at any time, and
 * sim_rig_render() lets time pass and records it all. Same settings, same bytes: on every machine,
 * for any number of threads and every instruction set. Thread: one at a time. */
#ifndef SHEFSIM_RIG_H
#define SHEFSIM_RIG_H

#include <stdbool.h>
#include <stdint.h>

#include "calib/calibration.h"
#include "core/error.h"
#include "core/workers.h"
#include "shefsim/event_sensor.h"
#include "shefsim/frame_sensor.h"
#include "shefsim/rig_clocks.h"
#include "shefsim/rig_mount.h"

/* The longest step between two images of the event camera, and how far anything may move in it. */
#define SIM_RIG_MAX_STEP_NS   8000000
#define SIM_RIG_STEP_PX       0.5
#define SIM_RIG_TRUTH_PROFILE "wide"

struct sim_rig_settings {
    const char *scene; /* a built-in scene's name or a scene file */
    const char *light; /* "day", "night" */
    const char *path;  /* see shefsim/path.h */
    double speed_m_s;
    double path_size_m;
    double tilt_deg;
    double phase;   /* where on the path it starts, 0..1 */
    double seconds; /* of frames, 0.01..600; events go on a little longer */
    uint64_t seed;
    struct sim_event_sensor_params sensor;
    enum sim_frame_format format;
    double fps;         /* 1..200 */
    double exposure_ms; /* 0: 5 by day, 10 with any other light */
    double blink_hz;    /* of surfaces that blink, whole periods a second; 0: they do not */
    int64_t frame_tick_ns;
    struct sim_miscalibration wrong; /* of calibration.yaml, not of truth/ */
    int64_t event_shift_us;          /* added to event times, not to triggers */
    bool without_frames;             /* no frames, no truth of frames */
};

struct sim_rig;

/*   workers       may be NULL; kept
 *   cpu_features  which implementations may be picked
 * SHEF_ERR_INVALID: settings that cannot be, a path that the arm cannot reach or that leads through
 * the scene. SHEF_ERR_NOT_FOUND, FORMAT: the scene. SHEF_ERR_NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err sim_rig_create(struct sim_rig **out_rig,
                                             const struct sim_rig_settings *settings,
                                             uint32_t cpu_features, struct shef_workers *workers,
                                             struct shef_error *err);

/* NULL is allowed. */
void sim_rig_destroy(struct sim_rig *rig);

/* What a rendering did. */
struct sim_rig_report {
    double seconds; /* of the recording */
    int64_t step_ns;
    int32_t n_steps;
    int32_t n_frames;
    int32_t n_instants; /* of an exposure */
    int32_t n_poses;
    double largest_speed_px_s; /* of the event camera's image */
    int64_t exposure_ns;
    uint32_t gain_mdb;
    struct sim_event_sensor_stats events;
    /* Where the time went, wall clock: the parts, and all. */
    double events_render_s;
    double events_sensor_s;
    double events_write_s;
    double frames_render_s;
    double frames_sensor_s;
    double frames_write_s;
    double truth_s;
    double closing_s;
    double total_s;
    double cpu_s; /* of all threads, for all of it */
};

struct sim_rig_render_config {
    const char *out;           /* the recording to be; NULL: none */
    const char *export_images; /* a folder for the event camera's images; NULL: none */
    bool export_log;           /* logarithms instead of light */
    int32_t truth_every;       /* maps of truth for every n-th frame, 1 or more */
    /* Called as time passes; false ends the rendering. May be NULL. */
    bool (*go_on)(void *context, int64_t done_ns, int64_t total_ns);
    void *context;
};

/* Renders everything from the start to the end.
 * On failure, or when go_on() says stop (SHEF_ERR_GONE), nothing is left of what was written. A rig
 * renders once. */
SHEF_MUST_CHECK enum shef_err sim_rig_render(struct sim_rig *rig,
                                             const struct sim_rig_render_config *config,
                                             struct sim_rig_report *out_report,
                                             struct shef_error *err);

#endif
