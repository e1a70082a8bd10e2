#include "sheftool/matcher.h"

#include <assert.h>
#include <math.h>
#include <string.h>

const struct shef_matcher_kind *const shef_matchers[SHEF_N_MATCHERS] = {
    &shef_matcher_robust,   &shef_matcher_paper_ds,   &shef_matcher_paper_dp,
    &shef_matcher_stereobm, &shef_matcher_stereosgbm,
};

void shef_edge_map_align(const struct shef_edge_map *map, const struct shef_smooth_field *field,
                         struct shef_edge_map *out)
{
    const size_t row_words = (size_t)map->stride_words;

    assert(map->kind == SHEF_EDGE_UNSIGNED && out->kind == SHEF_EDGE_UNSIGNED);
    assert(map->width_px == field->width_px && map->height_px == field->height_px);
    memset(out->plus, 0, (size_t)out->height_px * (size_t)out->stride_words * sizeof *out->plus);
    for (int32_t y = 0; y < out->height_px; y++) {
        uint64_t *to = out->plus + (size_t)y * (size_t)out->stride_words;

        for (int32_t x = 0; x < out->width_px; x++) {
            const long from_y = lrint(y - shef_field_at(field, x, y));

            if (from_y < 0 || from_y >= map->height_px)
                continue;
            const uint64_t word = map->plus[(size_t)from_y * row_words + (size_t)(x / 64)];

            to[x / 64] |= word & UINT64_C(1) << (x % 64);
        }
    }
}

void shef_subtract_bias(struct shef_image_f32 disparity, const struct shef_smooth_field *bias)
{
    assert(disparity.width_px == bias->width_px && disparity.height_px == bias->height_px);
    for (int32_t y = 0; y < disparity.height_px; y++) {
        float *row = shef_row_f32(disparity, y);

        for (int32_t x = 0; x < disparity.width_px; x++)
            if (row[x] > 0)
                row[x] = fmaxf(row[x] - (float)shef_field_at(bias, x, y), 0);
    }
}

enum shef_err shef_matcher_check(const struct shef_matcher_settings *settings,
                                 struct shef_error *err)
{
    if (settings->max_disparity_px < settings->width_px)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_INVALID,
                     "a search range of %d px does not fit maps of %d px width; give "
                     "--max-disparity a value below the width",
                     settings->max_disparity_px, settings->width_px);
}
