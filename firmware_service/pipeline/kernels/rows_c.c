#include "pipeline/kernels/rows_body.h"

const struct shef_row_kernels shef_row_kernels_c = SHEF_ROW_KERNELS(SHEF_CPU_NONE);
