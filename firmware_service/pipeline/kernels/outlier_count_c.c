#include "pipeline/kernels/outlier_count.h"

void shef_outlier_count_c(const float *first, ptrdiff_t step, int32_t n_samples,
                          const float low[SHEF_OUTLIER_COUNT_PX],
                          const float high[SHEF_OUTLIER_COUNT_PX],
                          int16_t out_below[SHEF_OUTLIER_COUNT_PX],
                          int16_t out_above[SHEF_OUTLIER_COUNT_PX])
{
    int32_t below[SHEF_OUTLIER_COUNT_PX] = { 0 };
    int32_t above[SHEF_OUTLIER_COUNT_PX] = { 0 };

    for (int32_t j = 0; j < n_samples; j++)
        for (int32_t i = 0; i < SHEF_OUTLIER_COUNT_PX; i++) {
            const float sample = first[j * step + i];

            below[i] += sample < low[i];
            above[i] += sample > high[i];
        }
    for (int32_t i = 0; i < SHEF_OUTLIER_COUNT_PX; i++) {
        out_below[i] = (int16_t)below[i];
        out_above[i] = (int16_t)above[i];
    }
}
