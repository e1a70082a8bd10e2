/* A smooth correction over the image: a quadratic of the normalised position, six numbers.
 *
 *   f(x, y) = c0 + c1 X + c2 Y + c3 XY + c4 X^2 + c5 Y^2   in px
 *   X = (x - (width - 1) / 2) / (width / 2), Y likewise: about -1..1 over the image
 *
 * The vertical residual between the views (align.h) and the declared disparity bias (bias.h)
 * have this form. */
#ifndef SHEF_PIPELINE_SMOOTH_FIELD_H
#define SHEF_PIPELINE_SMOOTH_FIELD_H

#include <stdint.h>

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_FIELD_TERMS 6

struct shef_smooth_field {
    double c[SHEF_FIELD_TERMS];
    int32_t width_px;
    int32_t height_px;
};

/* The value at a pixel, in px. Thread: any. */
double shef_field_at(const struct shef_smooth_field *field, double x, double y);

/* Values along row y at x = first, first + step, ... (n of them), in px. Thread: any. */
void shef_field_row(const struct shef_smooth_field *field, double y, double first, double step,
                    int32_t n, float *out_values);

/* Accumulates weighted samples of a field and solves for its six numbers. */
struct shef_field_fit {
    double normal[SHEF_FIELD_TERMS][SHEF_FIELD_TERMS];
    double right[SHEF_FIELD_TERMS];
    int32_t width_px;
    int32_t height_px;
};

/* An empty fit for images of this size. */
struct shef_field_fit shef_field_fit_begin(int32_t width_px, int32_t height_px);

/* Adds one sample.   value_px at pixel (x, y), weight >= 0 */
void shef_field_fit_add(struct shef_field_fit *fit, double x, double y, double value_px,
                        double weight);

/* Least squares over all samples.
 * SHEF_ERR_EMPTY: too few or too badly placed samples to determine six numbers. */
SHEF_MUST_CHECK enum shef_err shef_field_fit_solve(const struct shef_field_fit *fit,
                                                   struct shef_smooth_field *out_field);

#ifdef __cplusplus
}
#endif

#endif
