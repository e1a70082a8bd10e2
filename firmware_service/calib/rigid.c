#include "calib/rigid.h"

#include <math.h>
#include <string.h>

struct shef_rigid shef_rigid_identity(void)
{
    return (struct shef_rigid){ .r = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } };
}

struct shef_rigid shef_rigid_compose(const struct shef_rigid *t_a_b, const struct shef_rigid *t_b_c)
{
    struct shef_rigid t_a_c;

    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 3; column++)
            t_a_c.r[row * 3 + column] = t_a_b->r[row * 3] * t_b_c->r[column] +
                                        t_a_b->r[row * 3 + 1] * t_b_c->r[3 + column] +
                                        t_a_b->r[row * 3 + 2] * t_b_c->r[6 + column];
    shef_rigid_apply(t_a_b, t_b_c->t_m, t_a_c.t_m);
    return t_a_c;
}

struct shef_rigid shef_rigid_invert(const struct shef_rigid *t_a_b)
{
    const double *r = t_a_b->r;
    struct shef_rigid t_b_a = { .r = { r[0], r[3], r[6], r[1], r[4], r[7], r[2], r[5], r[8] } };
    double moved[3];

    shef_rigid_rotate(&t_b_a, t_a_b->t_m, moved);
    for (int i = 0; i < 3; i++)
        t_b_a.t_m[i] = 0.0 - moved[i]; /* no negative zeros */
    return t_b_a;
}

void shef_rigid_rotate(const struct shef_rigid *t_a_b, const double v[3], double out_v[3])
{
    const double *r = t_a_b->r;
    const double x = v[0];
    const double y = v[1];
    const double z = v[2];

    for (int row = 0; row < 3; row++)
        out_v[row] = r[row * 3] * x + r[row * 3 + 1] * y + r[row * 3 + 2] * z;
}

void shef_rigid_apply(const struct shef_rigid *t_a_b, const double p_m[3], double out_p_m[3])
{
    shef_rigid_rotate(t_a_b, p_m, out_p_m);
    for (int i = 0; i < 3; i++)
        out_p_m[i] += t_a_b->t_m[i];
}

struct shef_rigid shef_rigid_from_quaternion(const double q_wxyz[4], const double t_m[3])
{
    const double *q = q_wxyz;
    const double scale = 2 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double w = q[0] * scale;
    const double x = q[1] * scale;
    const double y = q[2] * scale;
    const double z = q[3] * scale;
    struct shef_rigid t_a_b = { .r = {
                                    1 - y * q[2] - z * q[3],
                                    x * q[2] - w * q[3],
                                    x * q[3] + w * q[2],
                                    x * q[2] + w * q[3],
                                    1 - x * q[1] - z * q[3],
                                    y * q[3] - w * q[1],
                                    x * q[3] - w * q[2],
                                    y * q[3] + w * q[1],
                                    1 - x * q[1] - y * q[2],
                                } };

    memcpy(t_a_b.t_m, t_m, sizeof t_a_b.t_m);
    return t_a_b;
}

/* Divides by the largest of the four, which never is small: Shepperd 1978. */
void shef_rigid_quaternion(const struct shef_rigid *t_a_b, double out_q_wxyz[4])
{
    const double *r = t_a_b->r;
    const double trace = r[0] + r[4] + r[8];
    double q[4];

    if (trace >= r[0] && trace >= r[4] && trace >= r[8]) {
        q[0] = 1 + trace;
        q[1] = r[7] - r[5];
        q[2] = r[2] - r[6];
        q[3] = r[3] - r[1];
    } else if (r[0] >= r[4] && r[0] >= r[8]) {
        q[0] = r[7] - r[5];
        q[1] = 1 + r[0] - r[4] - r[8];
        q[2] = r[1] + r[3];
        q[3] = r[2] + r[6];
    } else if (r[4] >= r[8]) {
        q[0] = r[2] - r[6];
        q[1] = r[1] + r[3];
        q[2] = 1 - r[0] + r[4] - r[8];
        q[3] = r[5] + r[7];
    } else {
        q[0] = r[3] - r[1];
        q[1] = r[2] + r[6];
        q[2] = r[5] + r[7];
        q[3] = 1 - r[0] - r[4] + r[8];
    }

    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    const double scale = q[0] < 0 ? -1 / length : 1 / length;

    for (int i = 0; i < 4; i++)
        out_q_wxyz[i] = q[i] * scale;
}

/* For x = angle^2: sin(angle) / angle with first 1, 2 (1 - cos(angle)) / angle^2 with first 2.
 * Both are 1 - x / (n (n + 1)) + ..., each term made from the one before, n every other number. */
static double alternating_series(double x, int first)
{
    double term = 1;
    double sum = 1;

    /* At 2 pi the terms have fallen below 2^-60 by then. */
    for (int n = first + 1; n < 50; n += 2) {
        term *= -x / (n * (n + 1.0));
        sum += term;
    }
    return sum;
}

struct shef_rigid shef_rigid_from_rotation_vector(const double rotation_rad[3], const double t_m[3])
{
    const double x = rotation_rad[0];
    const double y = rotation_rad[1];
    const double z = rotation_rad[2];
    const double angle2 = x * x + y * y + z * z;
    const double s = alternating_series(angle2, 1);     /* sin(angle) / angle */
    const double c = alternating_series(angle2, 2) / 2; /* (1 - cos(angle)) / angle^2 */
    struct shef_rigid t_a_b = { .r = {
                                    1 - c * (y * y + z * z),
                                    c * x * y - s * z,
                                    c * x * z + s * y,
                                    c * x * y + s * z,
                                    1 - c * (x * x + z * z),
                                    c * y * z - s * x,
                                    c * x * z - s * y,
                                    c * y * z + s * x,
                                    1 - c * (x * x + y * y),
                                } };

    memcpy(t_a_b.t_m, t_m, sizeof t_a_b.t_m);
    return t_a_b;
}

/* atan(x) / x for x in 0..1. */
static double arc_ratio(double x)
{
    double scale = 1;

    /* atan(x) = 2 atan(x / (1 + sqrt(1 + x^2))): three times, and x is at most 0.1. */
    for (int i = 0; i < 3; i++) {
        const double half = 1 + sqrt(1 + x * x);

        x /= half;
        scale *= 2 / half;
    }

    const double x2 = x * x;
    double sum = 0;

    for (int n = 17; n >= 0; n--)
        sum = 1.0 / (2 * n + 1) - x2 * sum;
    return scale * sum;
}

void shef_rigid_rotation_vector(const struct shef_rigid *t_a_b, double out_rotation_rad[3])
{
    const double half_pi = 1.57079632679489661923;
    double q[4];

    shef_rigid_quaternion(t_a_b, q);

    const double sine = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3]); /* of half the angle */
    /* Half the angle over its sine. */
    const double ratio = sine <= q[0] ? arc_ratio(sine / q[0]) / q[0]
                                      : (half_pi - arc_ratio(q[0] / sine) * (q[0] / sine)) / sine;

    for (int i = 0; i < 3; i++)
        out_rotation_rad[i] = 2 * ratio * q[i + 1];
}

double shef_rigid_error(const struct shef_rigid *t_a_b)
{
    const double *r = t_a_b->r;
    const double det = r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) +
                       r[2] * (r[3] * r[7] - r[4] * r[6]);
    double error = fabs(det - 1);

    for (int a = 0; a < 3; a++)
        for (int b = a; b < 3; b++) {
            const double product =
                r[a * 3] * r[b * 3] + r[a * 3 + 1] * r[b * 3 + 1] + r[a * 3 + 2] * r[b * 3 + 2];
            const double off = fabs(product - (a == b ? 1 : 0));

            if (off > error || isnan(off))
                error = off;
        }
    return error;
}
