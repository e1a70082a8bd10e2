#include "shefsim/numbers.h"

#include <assert.h>
#include <math.h>

void sim_sin_cos(double turns, double *out_sin, double *out_cos)
{
    assert(turns >= -1e6 && turns <= 1e6);

    /* Within an eighth of a turn of the nearest quarter, Taylor's series end below 1e-16. */
    const double quarter = floor(4 * turns + .5);
    const double x = 2 * SIM_PI * (turns - quarter / 4);
    const double x2 = x * x;
    const double s =
        x *
        (1 + x2 / -6 *
                 (1 + x2 / -20 *
                          (1 + x2 / -42 *
                                   (1 + x2 / -72 *
                                            (1 + x2 / -110 * (1 + x2 / -156 * (1 + x2 / -210)))))));
    const double c =
        1 +
        x2 / -2 *
            (1 + x2 / -12 *
                     (1 + x2 / -30 *
                              (1 + x2 / -56 * (1 + x2 / -90 * (1 + x2 / -132 * (1 + x2 / -182))))));

    switch ((int)(quarter - 4 * floor(quarter / 4))) {
    case 0:
        *out_sin = s;
        *out_cos = c;
        return;
    case 1:
        *out_sin = c;
        *out_cos = -s;
        return;
    case 2:
        *out_sin = -s;
        *out_cos = -c;
        return;
    default:
        *out_sin = -c;
        *out_cos = s;
        return;
    }
}
