#include "pipeline/bias.h"

#include <assert.h>

/* The columns without a partner at the left and right border, as the evaluation leaves them out:
 * a thirteenth and a thirtieth of the width. */
#define LEFT_SHARE  13
#define RIGHT_SHARE 30

#define MIN_PIXELS 1000
#define N_ROUNDS   12

/* Residuals beyond this are taken for mismatches; it narrows from gross to fine. */
static double width_of_round(int round)
{
    return round < 2 ? 6.0 : round < 5 ? 3.0 : 2.0;
}

/* Adds every second row of one sample, each residual weighted by its distance from the field. */
static int64_t add_sample(struct shef_field_fit *fit, const struct shef_bias_sample *sample,
                          const struct shef_smooth_field *field, float hole_px, double width_px)
{
    const int32_t first = fit->width_px / LEFT_SHARE;
    const int32_t last = fit->width_px - fit->width_px / RIGHT_SHARE;
    int64_t n_used = 0;

    for (int32_t y = 0; y < fit->height_px; y += 2) {
        const float *disparity = shef_row_f32(sample->disparity, y);
        const float *truth = shef_row_f32(sample->truth, y);

        for (int32_t x = first; x < last; x++) {
            if (!(disparity[x] > 0.0f && truth[x] > 0.0f && truth[x] < hole_px))
                continue;

            const double residual = (double)disparity[x] - (double)truth[x];
            const double away = (residual - shef_field_at(field, x, y)) / width_px;
            const double share = 1.0 / (1.0 + away * away);

            shef_field_fit_add(fit, x, y, residual, share * share);
            n_used++;
        }
    }
    return n_used;
}

enum shef_err shef_bias_fit(const struct shef_bias_sample *samples, int32_t n_samples,
                            float hole_px, struct shef_smooth_field *out_bias,
                            struct shef_error *err)
{
    const int32_t width_px = n_samples > 0 ? samples[0].disparity.width_px : 0;
    const int32_t height_px = n_samples > 0 ? samples[0].disparity.height_px : 0;
    struct shef_smooth_field field = { .width_px = width_px, .height_px = height_px };

    for (int32_t i = 0; i < n_samples; i++) {
        assert(samples[i].disparity.width_px == width_px && samples[i].truth.width_px == width_px);
        assert(samples[i].disparity.height_px == height_px);
        assert(samples[i].truth.height_px == height_px);
    }
    for (int round = 0; round < N_ROUNDS; round++) {
        struct shef_field_fit fit = shef_field_fit_begin(width_px, height_px);
        int64_t n_used = 0;

        for (int32_t i = 0; i < n_samples; i++)
            n_used += add_sample(&fit, &samples[i], &field, hole_px, width_of_round(round));
        if (n_used < MIN_PIXELS || shef_field_fit_solve(&fit, &field) != SHEF_OK)
            return shef_fail(err, SHEF_ERR_EMPTY,
                             "fit the disparity bias: %lld pixels with estimate and truth do not "
                             "determine six numbers, name more pairs",
                             (long long)n_used);
    }
    *out_bias = field;
    return SHEF_OK;
}
