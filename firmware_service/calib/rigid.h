/* Rotations with a translation, in double precision.
 *
 * A struct named t_a_b maps coordinates in b to coordinates in a: p_a = r p_b + t. Quaternions are
 * w, x, y, z; a rotation vector is the axis times the angle in radians, as the robot's controller
 * writes it. Only + - * / and sqrt are used, so that the same input gives the same bytes on every
 * machine. Pure functions. Thread: any. */
#ifndef SHEF_CALIB_RIGID_H
#define SHEF_CALIB_RIGID_H

#ifdef __cplusplus
extern "C" {
#endif

struct shef_rigid {
    double r[9]; /* a rotation, row by row */
    double t_m[3];
};

struct shef_rigid shef_rigid_identity(void);

/* t_a_c. */
struct shef_rigid shef_rigid_compose(const struct shef_rigid *t_a_b,
                                     const struct shef_rigid *t_b_c);

/* t_b_a. */
struct shef_rigid shef_rigid_invert(const struct shef_rigid *t_a_b);

/* A point; out may be p. */
void shef_rigid_apply(const struct shef_rigid *t_a_b, const double p_m[3], double out_p_m[3]);

/* A direction or velocity: the rotation alone; out may be v. */
void shef_rigid_rotate(const struct shef_rigid *t_a_b, const double v[3], double out_v[3]);

/* From a quaternion of any length but zero. */
struct shef_rigid shef_rigid_from_quaternion(const double q_wxyz[4], const double t_m[3]);

/* The quaternion of length 1 with w >= 0. */
void shef_rigid_quaternion(const struct shef_rigid *t_a_b, double out_q_wxyz[4]);

/* From a rotation vector of at most 2 pi. */
struct shef_rigid shef_rigid_from_rotation_vector(const double rotation_rad[3],
                                                  const double t_m[3]);

/* The rotation vector of at most pi. */
void shef_rigid_rotation_vector(const struct shef_rigid *t_a_b, double out_rotation_rad[3]);

/* How far r is from a rotation: the largest element of |r r^T - 1|, or of |det r - 1| if that is
 * more. NaN if any is. */
double shef_rigid_error(const struct shef_rigid *t_a_b);

#ifdef __cplusplus
}
#endif

#endif
