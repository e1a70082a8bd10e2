#include "calib/rigid.h"

#include <math.h>

#include "support/support.h"

static struct shef_test_random randomness;

void setUp(void)
{
    randomness = shef_test_random_start();
}

static double random_in(double low, double high)
{
    return low + (high - low) * shef_test_random_unit(&randomness);
}

/* A rotation about an axis by the textbook's formula, with libm. */
static struct shef_rigid turned(const double axis[3], double angle_rad)
{
    const double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    const double n[3] = { axis[0] / length, axis[1] / length, axis[2] / length };
    const double cross[9] = { 0, -n[2], n[1], n[2], 0, -n[0], -n[1], n[0], 0 };
    struct shef_rigid t = { .t_m = { random_in(-2, 2), random_in(-2, 2), random_in(-2, 2) } };

    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            t.r[i * 3 + j] = (i == j ? cos(angle_rad) : 0) + sin(angle_rad) * cross[i * 3 + j] +
                             (1 - cos(angle_rad)) * n[i] * n[j];
    return t;
}

static struct shef_rigid any_rigid(double max_angle_rad)
{
    const double axis[3] = { random_in(-1, 1), random_in(-1, 1), random_in(-1, 1) + 1e-9 };

    return turned(axis, random_in(-max_angle_rad, max_angle_rad));
}

static void expect_same(const struct shef_rigid *expected, const struct shef_rigid *actual,
                        double tolerance)
{
    for (int i = 0; i < 9; i++)
        TEST_ASSERT_DOUBLE_WITHIN(tolerance, expected->r[i], actual->r[i]);
    for (int i = 0; i < 3; i++)
        TEST_ASSERT_DOUBLE_WITHIN(tolerance, expected->t_m[i], actual->t_m[i]);
}

static void test_a_quarter_turn_about_z_takes_x_to_y(void)
{
    const struct shef_rigid t =
        shef_rigid_from_rotation_vector((double[3]){ 0, 0, M_PI / 2 }, (double[3]){ 1, 2, 3 });
    double p[3] = { 10, 0, 0 };

    shef_rigid_apply(&t, p, p);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 1, p[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 12, p[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 3, p[2]);
}

static void test_composing_is_applying_one_after_the_other(void)
{
    for (int i = 0; i < 100; i++) {
        const struct shef_rigid t_a_b = any_rigid(3);
        const struct shef_rigid t_b_c = any_rigid(3);
        const struct shef_rigid t_a_c = shef_rigid_compose(&t_a_b, &t_b_c);
        const double p_c[3] = { random_in(-1, 1), random_in(-1, 1), random_in(-1, 1) };
        double p_b[3];
        double p_a[3];
        double at_once[3];

        shef_rigid_apply(&t_b_c, p_c, p_b);
        shef_rigid_apply(&t_a_b, p_b, p_a);
        shef_rigid_apply(&t_a_c, p_c, at_once);
        for (int j = 0; j < 3; j++)
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, p_a[j], at_once[j]);
    }
}

static void test_the_inverse_takes_everything_back(void)
{
    const struct shef_rigid identity = shef_rigid_identity();

    for (int i = 0; i < 100; i++) {
        const struct shef_rigid t = any_rigid(3);
        const struct shef_rigid back = shef_rigid_invert(&t);
        const struct shef_rigid both = shef_rigid_compose(&back, &t);

        expect_same(&identity, &both, 1e-14);
    }
}

static void test_quaternions_come_back_whatever_the_angle(void)
{
    for (int i = 0; i < 1000; i++) {
        const struct shef_rigid t = any_rigid(i % 4 ? M_PI : 1e-6);
        double q[4];

        shef_rigid_quaternion(&t, q);
        TEST_ASSERT_TRUE(q[0] >= 0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-14, 1, q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);

        const struct shef_rigid same = shef_rigid_from_quaternion(q, t.t_m);

        expect_same(&t, &same, 1e-14);
        for (int j = 0; j < 4; j++)
            q[j] *= -3;

        const struct shef_rigid of_any_length = shef_rigid_from_quaternion(q, t.t_m);

        expect_same(&t, &of_any_length, 1e-14);
    }
}

static void test_rotation_vectors_agree_with_sine_and_cosine(void)
{
    for (int i = 0; i < 1000; i++) {
        const double axis[3] = { random_in(-1, 1), random_in(-1, 1), random_in(-1, 1) + 1e-9 };
        const double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
        const double angle_rad = random_in(0, i % 4 ? 2 * M_PI : 1e-7);
        const struct shef_rigid expected = turned(axis, angle_rad);
        const double vector[3] = { axis[0] / length * angle_rad, axis[1] / length * angle_rad,
                                   axis[2] / length * angle_rad };
        const struct shef_rigid actual = shef_rigid_from_rotation_vector(vector, expected.t_m);

        expect_same(&expected, &actual, 1e-13);
    }
}

static void test_rotation_vectors_come_back(void)
{
    for (int i = 0; i < 1000; i++) {
        const double axis[3] = { random_in(-1, 1), random_in(-1, 1), random_in(-1, 1) + 1e-9 };
        const double length = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
        const double angle_rad = i % 4 ? random_in(0, M_PI - 1e-6) : random_in(0, 1e-7);
        const struct shef_rigid t = turned(axis, angle_rad);
        double vector[3];

        shef_rigid_rotation_vector(&t, vector);
        for (int j = 0; j < 3; j++)
            TEST_ASSERT_DOUBLE_WITHIN(1e-14, axis[j] / length * angle_rad, vector[j]);
    }
}

static void test_half_a_turn_has_a_rotation_vector(void)
{
    const struct shef_rigid t = { .r = { -1, 0, 0, 0, 1, 0, 0, 0, -1 } };
    double vector[3];

    shef_rigid_rotation_vector(&t, vector);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0, vector[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, M_PI, fabs(vector[1]));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0, vector[2]);
}

static void test_what_is_no_rotation_is_told(void)
{
    struct shef_rigid t = any_rigid(3);

    TEST_ASSERT_TRUE(shef_rigid_error(&t) < 1e-14);
    t.r[4] += 1e-3;
    TEST_ASSERT_TRUE(shef_rigid_error(&t) > 1e-5);
    /* A mirror is orthonormal. */
    t = shef_rigid_identity();
    t.r[8] = -1;
    TEST_ASSERT_DOUBLE_WITHIN(0, 2, shef_rigid_error(&t));
    t.r[0] = NAN;
    TEST_ASSERT_DOUBLE_IS_NAN(shef_rigid_error(&t));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_quarter_turn_about_z_takes_x_to_y);
    RUN_TEST(test_composing_is_applying_one_after_the_other);
    RUN_TEST(test_the_inverse_takes_everything_back);
    RUN_TEST(test_quaternions_come_back_whatever_the_angle);
    RUN_TEST(test_rotation_vectors_agree_with_sine_and_cosine);
    RUN_TEST(test_rotation_vectors_come_back);
    RUN_TEST(test_half_a_turn_has_a_rotation_vector);
    RUN_TEST(test_what_is_no_rotation_is_told);
    return UNITY_END();
}
