#include "shefsim/rig_mount.h"

#define RAD_PER_DEG 0.017453292519943296

enum shef_err sim_rig_calibration(int64_t event_latency_ns,
                                  struct shef_calibration *out_calibration, struct shef_error *err)
{
    /* 0.29 degrees together. */
    static const double turn_rad[3] = { 0.0021, -0.0037, 0.0028 };
    /* 65.44 mm, nearly along x. */
    static const double event_frame_m[3] = { -0.06542, 0.0009, 0.0013 };
    /* The camera looks along the hand's z axis, a quarter turn about it, on a bracket. */
    static const double hand_rad[3] = { 0.012, -0.008, 1.5607963 };
    static const double hand_frame_m[3] = { 0.031, -0.047, 0.058 };
    static const double tcp_offset[6] = { 0, 0, 0.07, 0, 0, 0 };
    struct shef_calibration rig = shef_calibration_paper_rig();

    rig.frame.model = (struct shef_camera_model){
        .fx_px = 1301.2,
        .fy_px = 1300.7,
        .cx_px = 1019.4,
        .cy_px = 771.8,
        .distortion = { -0.092, 0.041, 0.0004, -0.0003, 0 },
    };
    rig.event.model = (struct shef_camera_model){
        .fx_px = 555.3,
        .fy_px = 554.8,
        .cx_px = 322.1,
        .cy_px = 237.6,
        .distortion = { -0.071, 0.022, -0.0005, 0.0003, 0 },
    };
    rig.t_event_frame = shef_rigid_from_rotation_vector(turn_rad, event_frame_m);
    rig.t_hand_frame = shef_rigid_from_rotation_vector(hand_rad, hand_frame_m);
    for (int i = 0; i < 6; i++)
        rig.tcp_offset[i] = tcp_offset[i];
    rig.event_delay.ns = event_latency_ns;
    rig.robot_delay.ns = SIM_RIG_POSE_DELAY_NS;
    *out_calibration = rig;
    return shef_calibration_identify(out_calibration, err);
}

enum shef_err sim_rig_miscalibrate(struct shef_calibration *calibration,
                                   const struct sim_miscalibration *wrong, struct shef_error *err)
{
    static const double nowhere[3] = { 0, 0, 0 };
    const double turn_rad[3] = { wrong->pitch_deg * RAD_PER_DEG, wrong->yaw_deg * RAD_PER_DEG,
                                 wrong->roll_deg * RAD_PER_DEG };
    const struct shef_rigid turn = shef_rigid_from_rotation_vector(turn_rad, nowhere);
    /* The camera turns about its own centre: the frame camera's place seen from it turns too. */
    struct shef_rigid turned = shef_rigid_compose(&turn, &calibration->t_event_frame);

    for (int i = 0; i < 3; i++)
        turned.t_m[i] *= 1 + wrong->baseline_pct / 100;
    calibration->t_event_frame = turned;
    calibration->event.model.cy_px += wrong->vertical_px;
    return shef_calibration_identify(calibration, err);
}
