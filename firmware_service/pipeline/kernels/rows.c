#include "pipeline/kernels/rows.h"

#include <stddef.h>

const struct shef_row_kernels *shef_rows_pick(uint32_t cpu_features)
{
    static const struct shef_row_kernels *const tables[] = {
    /* Best first, the last needs nothing; on arm64 plain C is compiled to NEON. */
#if defined(__x86_64__)
        &shef_row_kernels_avx512,
        &shef_row_kernels_avx2,
#endif
        &shef_row_kernels_c,
    };
    size_t i = 0;

    while ((tables[i]->cpu_features & cpu_features) != tables[i]->cpu_features)
        i++;
    return tables[i];
}
