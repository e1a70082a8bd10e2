/* Angles without libm, whose last digit differs from machine to machine. Thread: any. */
#ifndef SHEFSIM_NUMBERS_H
#define SHEFSIM_NUMBERS_H

#define SIM_PI 3.14159265358979323846

/* Sine and cosine of a part of a full turn, to within 1e-15; exact at quarters.
 *   turns  within +-1e6 */
void sim_sin_cos(double turns, double *out_sin, double *out_cos);

#endif
