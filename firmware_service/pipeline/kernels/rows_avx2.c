#include "pipeline/kernels/rows_body.h"

const struct shef_row_kernels shef_row_kernels_avx2 = SHEF_ROW_KERNELS(SHEF_CPU_AVX2);
