/* What matching adds to a disparity's error, by its confidence; see depth.h. */
#ifndef SHEF_PIPELINE_KERNELS_DEPTH_SIGMA_H
#define SHEF_PIPELINE_KERNELS_DEPTH_SIGMA_H

/* Two thirds of the errors of up to 1 px (f 555 px) of the combined mode lie within this, in
 * rendered recordings of four scenes, by doubt 1 - c: SURE at 0, SURE + MORE from DOUBT on, and
 * SLOPE. */
#define SHEF_SIGMA_SURE_PX  0.12f
#define SHEF_SIGMA_MORE_PX  0.12f
#define SHEF_SIGMA_DOUBT    0.025f
#define SHEF_SIGMA_SLOPE_PX 0.10f

static inline float shef_depth_sigma(float confidence)
{
    const float doubt = 1.0f - confidence;
    const float share = doubt < SHEF_SIGMA_DOUBT ? doubt * (1.0f / SHEF_SIGMA_DOUBT) : 1.0f;

    return SHEF_SIGMA_SURE_PX + SHEF_SIGMA_MORE_PX * share + SHEF_SIGMA_SLOPE_PX * doubt;
}

#endif
