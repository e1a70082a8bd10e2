#include "pipeline/depth.h"

#include <math.h>

/* Spread of the combined mode's errors up to 1 px, in rendered recordings of four scenes, by
 * confidence: sigma = SURE + DOUBT (1 - c). docs/accuracy.md has the measurement. */
#define SIGMA_SURE_PX  0.20
#define SIGMA_DOUBT_PX 0.35

double shef_depth_sigma_px(double confidence)
{
    return SIGMA_SURE_PX + SIGMA_DOUBT_PX * (1 - confidence);
}

void shef_depth_row(const struct shef_depth_model *model, const float *disparity,
                    const float *confidence, int32_t n, double velocity_x_m_s, float *out_depth_m,
                    float *out_sigma_m)
{
    const float fb = (float)(model->f_px * model->baseline_m);
    const float angle_px = (float)(model->f_px * model->sigma_angle_rad);
    const float base = (float)(model->sigma_baseline_m / model->baseline_m);
    const float time = (float)(velocity_x_m_s * model->sigma_time_s / model->baseline_m);
    const float shared = base * base + time * time;
    const float sure = (float)(SIGMA_SURE_PX + SIGMA_DOUBT_PX);
    const float doubt = (float)SIGMA_DOUBT_PX;

    for (int32_t x = 0; x < n; x++) {
        const float d = disparity[x];
        const float match_px = sure - doubt * confidence[x];
        const float per_px2 = match_px * match_px + angle_px * angle_px;
        const float depth = fb / d;
        const float sigma = depth * sqrtf(per_px2 / (d * d) + shared);

        out_depth_m[x] = d > 0.0f ? depth : 0.0f;
        out_sigma_m[x] = d > 0.0f ? sigma : 0.0f;
    }
}
