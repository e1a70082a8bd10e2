#include "shefsim/kernels/frame_expose_loops.h"

void sim_expose_avx2(const struct sim_expose_row *row, uint8_t *out)
{
    expose_row(row, out);
}
