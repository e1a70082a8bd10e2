#include "filter_model.h"

#include <math.h>
#include <stdlib.h>

#include "core/cpu.h"

struct shef_test_model shef_test_model_create(const struct shef_filter_params *params)
{
    const size_t n_pixels = (size_t)params->width_px * (size_t)params->height_px;
    struct shef_test_model model = { .params = *params };

    model.levels = calloc(n_pixels, sizeof *model.levels);
    model.t_us = calloc(n_pixels, sizeof *model.t_us);
    model.sums = calloc(n_pixels, sizeof *model.sums);
    TEST_ASSERT_NOT_NULL(model.levels);
    TEST_ASSERT_NOT_NULL(model.t_us);
    TEST_ASSERT_NOT_NULL(model.sums);
    return model;
}

void shef_test_model_destroy(struct shef_test_model *model)
{
    free(model->levels);
    free(model->t_us);
    free(model->sums);
    *model = (struct shef_test_model){ 0 };
}

static size_t pixel_of(const struct shef_test_model *model, int32_t x_px, int32_t y_px)
{
    return (size_t)y_px * (size_t)model->params.width_px + (size_t)x_px;
}

double shef_test_model_level(const struct shef_test_model *model, int32_t x_px, int32_t y_px,
                             int64_t at_us)
{
    const size_t pixel = pixel_of(model, x_px, y_px);
    const int64_t age_us = at_us > model->t_us[pixel] ? at_us - model->t_us[pixel] : 0;

    return model->levels[pixel] * exp(-model->params.cutoff_rad_s * 1e-6 * (double)age_us);
}

void shef_test_model_apply(struct shef_test_model *model, struct shef_event event, int64_t base_us)
{
    const int32_t y_px = shef_event_y_px(event);
    const size_t pixel = pixel_of(model, event.x_px, y_px);
    const int64_t t_us = base_us + event.t_us;
    const double gain = shef_event_is_on(event) ? model->params.on_gain : -model->params.off_gain;

    model->levels[pixel] = shef_test_model_level(model, event.x_px, y_px, t_us) + gain;
    model->t_us[pixel] = t_us > model->t_us[pixel] ? t_us : model->t_us[pixel];
    model->sums[pixel] += lrint(gain * SHEF_FILTER_VALUE_STEP);
}

void shef_test_model_compare_pixel(struct shef_test_model *model, const struct shef_filter *filter,
                                   int32_t x_px, int32_t y_px, int64_t at_us)
{
    const double expected_c = shef_test_model_level(model, x_px, y_px, at_us);
    const double actual_c =
        (double)shef_filter_level(filter, x_px, y_px, shef_test_us(at_us)) / SHEF_FILTER_LEVEL_STEP;

    model->worst_c = fmax(model->worst_c, fabs(actual_c - expected_c));
    model->largest_c = fmax(model->largest_c, fabs(expected_c));
}

void shef_test_model_compare(struct shef_test_model *model, const struct shef_filter *filter,
                             int64_t at_us)
{
    for (int32_t y = 0; y < model->params.height_px; y++)
        for (int32_t x = 0; x < model->params.width_px; x++)
            shef_test_model_compare_pixel(model, filter, x, y, at_us);
}

struct shef_filter *shef_test_filter(const struct shef_filter_params *params)
{
    struct shef_filter *filter = NULL;
    struct shef_error err = { 0 };
    const enum shef_err code = shef_filter_create(&filter, params, shef_cpu_features(), &err);

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, code, err.text);
    return filter;
}

void shef_test_apply_one(struct shef_filter *filter, int64_t t_us, uint32_t x_px, uint32_t y_px,
                         bool on)
{
    const struct shef_event event = shef_event_make(0, x_px, y_px, on);

    TEST_ASSERT_EQUAL_UINT32(1, shef_filter_apply(filter, &event, 1, t_us, SHEF_TEST_FOREVER));
}

int shef_test_features(uint32_t out_features[4])
{
    static const char *const names[] = { "c", "avx2", "avx512", "neon" };
    int n = 0;

    for (int i = 0; i < 4; i++) {
        const uint32_t features = shef_cpu_features_of(names[i]);

        if ((features & shef_cpu_features()) == features)
            out_features[n++] = features;
    }
    return n;
}
