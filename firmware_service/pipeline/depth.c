#include "pipeline/depth.h"

struct shef_depth_terms shef_depth_terms_of(const struct shef_depth_model *model,
                                            double velocity_x_m_s)
{
    const float base = (float)(model->sigma_baseline_m / model->baseline_m);
    const float time = (float)(velocity_x_m_s * model->sigma_time_s / model->baseline_m);

    return (struct shef_depth_terms){
        .fb = (float)(model->f_px * model->baseline_m),
        .angle_px = (float)(model->f_px * model->sigma_angle_rad),
        .shared = base * base + time * time,
    };
}
