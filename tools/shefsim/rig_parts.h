/* What the parts of the rig share: its state, and what they do for each other.
 *
 * Private to rig*.c. Times are true time in ns from the start, see rig_clocks.h. */
#ifndef SHEFSIM_RIG_PARTS_H
#define SHEFSIM_RIG_PARTS_H

#include "calib/rectification.h"
#include "core/image.h"
#include "record/truth.h"
#include "shefsim/kernels/event_scan.h"
#include "shefsim/path.h"
#include "shefsim/rig.h"
#include "shefsim/scene.h"
#include "shefsim/view.h"

/* What is true of one rectified view. */
struct sim_rig_maps {
    struct shef_image_f32 depth_m;      /* 0: none */
    struct shef_image_f32 disparity_px; /* 0: none */
    struct shef_image_u8 mask;          /* SHEF_TRUTH_VALID, SHEF_TRUTH_OCCLUDED */
};

struct sim_rig {
    struct sim_rig_settings settings;
    int64_t frames_ns; /* the last exposure ends before it */
    int64_t total_ns;  /* events go on for longer than frames */
    struct sim_scene *scene;
    struct sim_path *path;
    struct shef_workers *workers;
    const struct sim_event_scan_impl *scan;
    struct shef_calibration calibration; /* the true one */
    struct shef_rectification left;      /* of the true one, in the profile of truth */
    struct shef_rectification right;
    double baseline_m;
    struct shef_rigid t_frame_event; /* T_C_E */
    struct shef_rigid t_frame_left;  /* T_C_R */
    struct shef_rigid t_left_right;  /* from the right rectified view to the left */
    struct shef_rigid t_base_world;
    struct sim_clocks clocks;
    /* Views and what they see. */
    struct sim_view *event_view;
    struct sim_view *frame_view;
    struct sim_view *truth_view; /* both rectified views have the same camera */
    struct shef_image_f32 event_light;
    struct shef_image_f32 frame_light;
    struct shef_image_f32 frame_depth; /* only for colour */
    struct shef_image_i16 frame_object;
    struct shef_image_u8 frame;
    struct sim_rig_maps truth[SHEF_TRUTH_VIEWS];
    struct shef_image_u8 on_sensor[SHEF_TRUTH_VIEWS]; /* 1 where a sensor sees the pixel */
    float (*tints)[3];
    /* Sensors. */
    struct sim_event_sensor *event_sensor;
    struct sim_frame_sensor_params frame_params;
    struct sim_frame_sensor *frame_sensor;
    double largest_speed_px_s; /* of the rectified image */
    int64_t step_ns;
    int32_t n_instants;
};

/* A frame's times. */
struct sim_rig_frame {
    uint64_t number;
    int64_t start_ns; /* of the exposure, true time */
    int64_t end_ns;
    int64_t rise_us; /* as the event camera stamps the edges */
    int64_t fall_us;
    shef_frame_time time; /* the frame camera's stamp: the start of the exposure */
};

/* The n-th frame. */
struct sim_rig_frame sim_rig_frame_at(const struct sim_rig *rig, uint64_t number);

/* T_world_C. */
struct shef_rigid sim_rig_pose(const struct sim_rig *rig, int64_t t_ns);

/* T_base_H: what the robot's controller reports. */
struct shef_rigid sim_rig_hand(const struct sim_rig *rig, int64_t t_ns);

/* The light on the event camera, into event_light. */
void sim_rig_see_events(struct sim_rig *rig, int64_t t_ns);

/* A frame's exposure: the light into frame_light, and with colour the objects. */
void sim_rig_see_frame(struct sim_rig *rig, const struct sim_rig_frame *frame);

/* The frame itself, from what see_frame() saw. */
void sim_rig_expose(struct sim_rig *rig, const struct sim_rig_frame *frame);

/* Finds which pixels of the rectified views lie on their sensors, once. */
void sim_rig_find_sensors(struct sim_rig *rig);

/* The truth of both rectified views at a time. */
void sim_rig_see_truth(struct sim_rig *rig, int64_t t_ns);

/* The fastest motion in the rectified left view at a time, px/s. */
double sim_rig_speed_px_s(struct sim_rig *rig, int64_t t_ns);

#endif
