#include "pipeline/depth.h"

#include <math.h>

/* Two thirds of the errors of up to 1 px (f 555 px) of the combined mode lie within this, in
 * rendered recordings of four scenes, by doubt 1 - c: SURE at 0, SURE + MORE from DOUBT on, and
 * SLOPE. */
#define SIGMA_SURE_PX  0.12f
#define SIGMA_MORE_PX  0.12f
#define SIGMA_DOUBT    0.025f
#define SIGMA_SLOPE_PX 0.10f

static inline float sigma_px(float confidence)
{
    const float doubt = 1.0f - confidence;
    const float share = doubt < SIGMA_DOUBT ? doubt * (1.0f / SIGMA_DOUBT) : 1.0f;

    return SIGMA_SURE_PX + SIGMA_MORE_PX * share + SIGMA_SLOPE_PX * doubt;
}

double shef_depth_sigma_px(double confidence)
{
    return (double)sigma_px((float)confidence);
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

    for (int32_t x = 0; x < n; x++) {
        const float d = disparity[x];
        const float match_px = sigma_px(confidence[x]);
        const float per_px2 = match_px * match_px + angle_px * angle_px;
        const float depth = fb / d;
        const float sigma = depth * sqrtf(per_px2 / (d * d) + shared);

        out_depth_m[x] = d > 0.0f ? depth : 0.0f;
        out_sigma_m[x] = d > 0.0f ? sigma : 0.0f;
    }
}
