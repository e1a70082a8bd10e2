#include "pipeline/outlier_authors.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "bin_corr_cases.h"
#include "core/cpu.h"
#include "core/memory.h"

static struct shef_image_f32 image_of(int32_t width_px, int32_t height_px, const float *values)
{
    struct shef_image_f32 image = shef_test_image_f32(width_px, height_px);

    for (int32_t y = 0; y < height_px; y++)
        memcpy(shef_row_f32(image, y), values + y * width_px, (size_t)width_px * sizeof *values);
    return image;
}

static void run_fast(struct shef_image_f32 in, int32_t radius_px, uint32_t features,
                     struct shef_image_f32 out)
{
    struct shef_outlier_authors *filter = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_outlier_authors_create(&filter, in.width_px, in.height_px, radius_px, features, &err),
        err.text);
    TEST_ASSERT_EQUAL_STRING(shef_cpu_isa_name(features), shef_outlier_authors_isa(filter));
    TEST_ASSERT_TRUE(shef_outlier_authors_bytes(filter) > 0);
    /* Twice: a run must not leave traces in the workspace. */
    for (int i = 0; i < 2; i++)
        shef_outlier_authors_run(filter, in, radius_px, out);
    shef_outlier_authors_destroy(filter);
}

/* The plain form and every fast one give these values. */
static void expect(const float *values, int32_t width_px, int32_t height_px, int32_t radius_px,
                   const float *expected)
{
    struct shef_image_f32 in = image_of(width_px, height_px, values);
    struct shef_image_f32 out = shef_test_image_f32(width_px, height_px);
    uint32_t isas[4];
    const int n_isas = shef_test_isas(isas);

    shef_outlier_authors_plain(in, radius_px, out);
    for (int32_t y = 0; y < height_px; y++)
        TEST_ASSERT_EQUAL_FLOAT_ARRAY(expected + y * width_px, shef_row_f32(out, y), width_px);
    for (int isa = 0; isa < n_isas; isa++) {
        run_fast(in, radius_px, isas[isa], out);
        for (int32_t y = 0; y < height_px; y++)
            TEST_ASSERT_EQUAL_FLOAT_ARRAY(expected + y * width_px, shef_row_f32(out, y), width_px);
    }
    shef_image_destroy_f32(&in);
    shef_image_destroy_f32(&out);
}

static void test_values_around_the_median_survive_and_others_become_none(void)
{
    /* One row: sample k of pixel c is pixel clamp(c + k), down to k = -2 and up to k = 2.
     *   c=0  20 20 20 20 22           median 20, 20 stays
     *   c=1  20 20 20 22 60           median 20, 20 stays
     *   c=2  20 20 22 60 20           median 20, 22 stays
     *   c=3  20 22 60 20 20           median 20: 40 above it, 60 goes and leaves a 0
     *   c=4  22  0 20 20 20           median 20, 20 stays
     *   c=5   0 20 20 20 20           median 20, 20 stays */
    const float in[] = { 20, 20, 22, 60, 20, 20 };
    const float expected[] = { 20, 20, 22, 0, 20, 20 };

    expect(in, 6, 1, 2, expected);
}

static void test_both_thresholds_are_survived_at_equality(void)
{
    /* Radius 2, one row: the middle pixel sees itself and four equal ones, which are the median.
     * Where it goes, its 0 takes the place of a larger sample and changes no other median. */
    const float third_above[] = { 15, 15, 20, 15, 15 };
    const float third_below[] = { 15, 15, 10, 15, 15 };
    const float ten_above[] = { 60, 60, 70, 60, 60 };
    const float ten_below[] = { 60, 60, 50, 60, 60 };

    expect(third_above, 5, 1, 2, third_above);
    expect(third_below, 5, 1, 2, third_below);
    expect(ten_above, 5, 1, 2, ten_above);
    expect(ten_below, 5, 1, 2, ten_below);

    const float over_third[] = { 15, 15, 20.000002f, 15, 15 };
    const float under_third[] = { 15, 15, 9.999999f, 15, 15 };
    const float over_ten[] = { 60, 60, 70.00001f, 60, 60 };
    const float under_ten[] = { 60, 60, 49.999996f, 60, 60 };

    expect(over_third, 5, 1, 2, (const float[]){ 15, 15, 0, 15, 15 });
    expect(under_third, 5, 1, 2, (const float[]){ 15, 15, 0, 15, 15 });
    expect(over_ten, 5, 1, 2, (const float[]){ 60, 60, 0, 60, 60 });
    expect(under_ten, 5, 1, 2, (const float[]){ 60, 60, 0, 60, 60 });
}

static void test_an_even_number_of_samples_uses_the_mean_of_the_middle_two(void)
{
    /* Radius 2, one row, - is none. The third pixel is the one that matters.
     *   c=0  10 10 10 10 20   median 10, 10 stays
     *   c=1  10 10 10 20 -    10 10 | 10 20, median 10, 10 stays
     *   c=2  10 10 20 - 30    10 10 | 20 30, median 15: 5 of 15 is 1/3, 20 stays; against the
     *                         lower middle, 10, it would go
     *   c=3  10 20 - 30 30    four samples, stays none
     *   c=4  20 - 30 30 30    median 30, stays
     *   c=5  - 30 30 30 30    median 30, stays */
    const float stays[] = { 10, 10, 20, 0, 30, 30 };

    expect(stays, 6, 1, 2, stays);

    /*   c=2  10 10 21 - 30    median 15.5: 5.5 of 15.5 is more than 1/3, 21 goes; against the upper
     *                         middle, itself, it would stay
     *   c=3  10 0 - 30 30     four samples, stays none
     *   c=4  0 - 30 30 30     30 30 are the middle two, stays */
    const float goes[] = { 10, 10, 21, 0, 30, 30 };

    expect(goes, 6, 1, 2, (const float[]){ 10, 10, 0, 0, 30, 30 });
}

static void test_fewer_than_four_samples_reject_even_where_nothing_was(void)
{
    /* Radius 1 has three samples at most: everything goes. */
    const float all[] = { 50, 50, 50, 50, 50, 50, 50, 50, 50 };
    const float none[9] = { 0 };

    expect(all, 3, 3, 1, none);

    /* Radius 2, one row. None of the first two pixels has an estimate, but the first becomes a 0,
     * and that 0 is what keeps the third:
     *   c=0  - - - - 30       one sample: becomes 0
     *   c=1  0 0 - 30 30      four samples: stays none
     *   c=2  0 - 30 30 30     30 30 are the middle two, stays; with three samples it would go
     *   c=3  - 30 30 30 30    stays
     *   c=4  30 30 30 30 30   stays */
    const float saved[] = { 0, 0, 30, 30, 30 };

    expect(saved, 5, 1, 2, saved);
}

static void test_zeros_left_by_rejections_pull_later_medians_down(void)
{
    /* Radius 2, one row.
     *   c=0  40 40 40 40 80   median 40, 40 stays
     *   c=1  40 40 40 80 80   median 40, 40 stays
     *   c=2  40 40 80 80 40   median 40, 80 goes
     *   c=3  40  0 80 40 60   median 40, 80 goes
     *   c=4   0  0 40 60 60   median 40, 40 stays; with the 80s in their place the median were 60
     *   c=5   0 40 60 60 60   median 60, 60 stays
     *   c=6  40 60 60 60 60   median 60, 60 stays
     *   c=7  60 60 60 60 60   median 60, 60 stays */
    const float in[] = { 40, 40, 80, 80, 40, 60, 60, 60 };

    expect(in, 8, 1, 2, (const float[]){ 40, 40, 0, 0, 40, 60, 60, 60 });
}

static void test_samples_lie_on_the_main_diagonal_only(void)
{
    /* Diagonals are constant; along rows, columns and the other diagonal the values change by up
     * to 14. Only the pixel that differs from its diagonal goes. */
    float in[8 * 8];
    float out[8 * 8];

    for (int y = 0; y < 8; y++)
        for (int x = 0; x < 8; x++)
            in[y * 8 + x] = out[y * 8 + x] = 100 + (float)(x - y);
    in[3 * 8 + 4] = 112;
    out[3 * 8 + 4] = 0;
    expect(in, 8, 8, 2, out);
}

static void test_clamped_samples_slide_along_the_border(void)
{
    /* Radius 2. The top right pixel's samples up and left lie in the first row, those down and
     * right in the last column: 20 20 60 20 20, it goes. Were samples clamped to the diagonal's
     * end, all five would be 60 and it would stay. */
    float in[5 * 5];
    float out[5 * 5];

    for (int i = 0; i < 25; i++)
        in[i] = out[i] = 20;
    in[4] = 60;
    out[4] = 0;
    expect(in, 5, 5, 2, out);

    /* The two corners on the main diagonal see copies of themselves, 60 60 60 20 20, and stay. */
    for (int i = 0; i < 25; i++)
        in[i] = out[i] = 20;
    in[0] = in[24] = out[0] = out[24] = 60;
    expect(in, 5, 5, 2, out);
}

static void test_values_below_one_and_nan_count_as_none(void)
{
    const float in[] = { 30, 30, 30, -5, 30, 30, 30, 0.999f, 30, 30, NAN, 30, 30, 30 };
    const float expected[] = { 30, 30, 30, 0, 30, 30, 30, 0, 30, 30, 0, 30, 30, 30 };

    expect(in, 14, 1, 3, expected);

    const float ones[] = { 1, 1, 1, 1, 1 };

    expect(ones, 5, 1, 2, ones);
}

static float random_value(struct shef_test_random *random, int style)
{
    const int32_t whole = shef_test_random_range(random, 1, 80);

    switch (style) {
    case 0: /* integers, as paper-ds gives: exact thresholds are common */
        return (float)whole;
    case 1: /* as a coarser level gives */
        return (float)whole / 0.9f;
    case 2: /* hostile: everything a float can be */
        switch (shef_test_random_range(random, 0, 7)) {
        case 0:
            return NAN;
        case 1:
            return INFINITY;
        case 2:
            return -INFINITY;
        case 3:
            return 3e38f;
        case 4:
            return 1;
        case 5:
            return nextafterf(1, 0);
        default:
            return (float)(whole * shef_test_random_unit(random));
        }
    default: /* few values around a ratio of 4/3, a tie everywhere */
        return (float[]){ 30, 40, 45, 60 }[shef_test_random_range(random, 0, 3)];
    }
}

static struct shef_image_f32 random_image(struct shef_test_random *random)
{
    const bool is_tiny = shef_test_random_range(random, 0, 4) == 0;
    struct shef_image_f32 image =
        shef_test_image_f32(shef_test_random_range(random, 1, is_tiny ? 6 : 150),
                            shef_test_random_range(random, 1, is_tiny ? 6 : 90));
    const int style = shef_test_random_range(random, 0, 3);
    const double share = pow(shef_test_random_unit(random), 2);
    const double share_random = shef_test_random_unit(random);

    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            if (shef_test_random_unit(random) < share)
                shef_row_f32(image, y)[x] = shef_test_random_unit(random) < share_random
                                                ? random_value(random, style)
                                                : 30 + 0.1f * (float)x;
    return image;
}

static void test_fast_and_plain_agree_bit_for_bit(void)
{
    static const int32_t radii[] = { 1, 2, 3, 5, 12, 40, 50 };
    struct shef_test_random random = shef_test_random_start();
    uint32_t isas[4];
    const int n_isas = shef_test_isas(isas);
    int64_t n_kept = 0;
    int64_t n_rejected = 0;

    for (int i = 0; i < 150; i++) {
        struct shef_image_f32 in = random_image(&random);
        struct shef_image_f32 plain = shef_test_image_f32(in.width_px, in.height_px);
        struct shef_image_f32 fast = shef_test_image_f32(in.width_px, in.height_px);
        const int32_t radius = radii[shef_test_random_range(&random, 0, 6)];

        shef_outlier_authors_plain(in, radius, plain);
        for (int isa = 0; isa < n_isas; isa++) {
            run_fast(in, radius, isas[isa], fast);
            for (int32_t y = 0; y < in.height_px; y++)
                TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(plain, y), shef_row_f32(fast, y),
                                         (size_t)in.width_px * sizeof(float));
        }
        for (int32_t y = 0; y < in.height_px; y++)
            for (int32_t x = 0; x < in.width_px; x++) {
                n_kept += shef_row_f32(plain, y)[x] > 0;
                n_rejected += shef_row_f32(in, y)[x] >= 1 && shef_row_f32(plain, y)[x] == 0;
            }
        shef_image_destroy_f32(&in);
        shef_image_destroy_f32(&plain);
        shef_image_destroy_f32(&fast);
    }
    /* Both happen often, so that agreement means something. */
    TEST_ASSERT_TRUE(n_kept > 10000);
    TEST_ASSERT_TRUE(n_rejected > 10000);
}

static void test_one_workspace_serves_smaller_radii_and_filters_in_place(void)
{
    struct shef_test_random random = shef_test_random_start();
    struct shef_image_f32 in = random_image(&random);
    struct shef_image_f32 expected = shef_test_image_f32(in.width_px, in.height_px);
    struct shef_outlier_authors *filter = NULL;
    struct shef_error err;

    shef_outlier_authors_plain(in, 50, expected);
    shef_outlier_authors_plain(expected, 40, expected);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_outlier_authors_create(&filter, in.width_px, in.height_px, 64,
                                                           shef_cpu_features(), &err));
    shef_outlier_authors_run(filter, in, SHEF_OUTLIER_AUTHORS_RADIUS_FIRST_PX, in);
    shef_outlier_authors_run(filter, in, SHEF_OUTLIER_AUTHORS_RADIUS_SECOND_PX, in);
    for (int32_t y = 0; y < in.height_px; y++)
        TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(expected, y), shef_row_f32(in, y),
                                 (size_t)in.width_px * sizeof(float));
    shef_outlier_authors_destroy(filter);
    shef_image_destroy_f32(&in);
    shef_image_destroy_f32(&expected);
}

static void test_impossible_parameters_are_refused_with_a_reason(void)
{
    struct shef_outlier_authors *filter = NULL;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_outlier_authors_create(&filter, 0, 9, 5, 0, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "0 x 9 px"), err.text);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_outlier_authors_create(&filter, 9, 9, 0, 0, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "radius 0 px"), err.text);
    TEST_ASSERT_NULL(filter);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_values_around_the_median_survive_and_others_become_none);
    RUN_TEST(test_both_thresholds_are_survived_at_equality);
    RUN_TEST(test_an_even_number_of_samples_uses_the_mean_of_the_middle_two);
    RUN_TEST(test_fewer_than_four_samples_reject_even_where_nothing_was);
    RUN_TEST(test_zeros_left_by_rejections_pull_later_medians_down);
    RUN_TEST(test_samples_lie_on_the_main_diagonal_only);
    RUN_TEST(test_clamped_samples_slide_along_the_border);
    RUN_TEST(test_values_below_one_and_nan_count_as_none);
    RUN_TEST(test_fast_and_plain_agree_bit_for_bit);
    RUN_TEST(test_one_workspace_serves_smaller_radii_and_filters_in_place);
    RUN_TEST(test_impossible_parameters_are_refused_with_a_reason);
    return UNITY_END();
}
