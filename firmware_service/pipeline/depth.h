/* From disparity to depth, and how far off it may be.
 *
 *   Z = f b / d              along the left view's axis, metres (conventions: geometry)
 *   sigma_Z^2 = Z^2 [ (sigma_d / d)^2 + (f sigma_angle / d)^2
 *                     + (sigma_b / b)^2 + (v_x sigma_t / b)^2 ]
 *
 * sigma_d, what matching adds, depends on the confidence c: 0.12 px where it is 1, 0.24 px from
 * 0.975 down, a little more where it is low. The other terms are the calibration's and do not
 * average out: an angle about the vertical between the views shifts all disparities; a time offset
 * between them acts like another baseline (a camera that moves along it by v_x sigma_t). sigma is
 * one standard deviation of errors about a surface, not of mistaking one for another: the
 * confidence says how likely that is.
 *
 * Pure functions. Thread: any. */
#ifndef SHEF_PIPELINE_DEPTH_H
#define SHEF_PIPELINE_DEPTH_H

#include "pipeline/kernels/rows.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_depth_model {
    double f_px;
    double baseline_m;
    double sigma_angle_rad; /* of the views to each other, about the vertical */
    double sigma_baseline_m;
    double sigma_time_s; /* of the frames' time against the events' */
};

/* What the row kernels' depth() needs to know of all rows of a frame.
 *   velocity_x_m_s   of the camera along the baseline */
struct shef_depth_terms shef_depth_terms_of(const struct shef_depth_model *model,
                                            double velocity_x_m_s);

#ifdef __cplusplus
}
#endif

#endif
