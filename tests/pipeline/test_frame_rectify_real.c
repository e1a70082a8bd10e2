/* Real chessboard pairs, rectified by our calibration folder and our rectifier: corners have to
 * come out on the same rows. */
#include <math.h>
#include <stdio.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "frame_opencv.h"
#include "pipeline/frame_rectify.h"
#include "support/support.h"

#define MAX_PAIRS 14
#define MISSING   10 /* the set has no such pair */
#define WIDTH_PX  960
#define HEIGHT_PX 720
#define SQUARE_M  0.025

struct seen_pair {
    struct shef_image_u8 left;
    struct shef_image_u8 right;
};

static struct seen_pair pictures[MAX_PAIRS];
static struct shef_test_board_pair corners[MAX_PAIRS];
static int n_pairs;
static struct shef_error err;

static struct shef_image_u8 read_picture(const char *side, int number)
{
    struct shef_image_u8 image = { 0 };
    char path[1024];

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&image, 640, 480, &err));
    snprintf(path, sizeof path, "%s/opencv/%s%02d.jpg", shef_test_data("stereo"), side, number);
    if (!shef_test_opencv_read(path, image))
        shef_image_destroy_u8(&image);
    return image;
}

static void find_corners(struct shef_image_u8 image, double *out_xy_px)
{
    TEST_ASSERT_TRUE(shef_test_opencv_find_corners(image, SHEF_TEST_BOARD_COLUMNS,
                                                   SHEF_TEST_BOARD_ROWS, out_xy_px));
}

/* Reads all pairs that are there and finds their corners. */
static void load(void)
{
    if (n_pairs > 0)
        return;
    for (int number = 1; number <= MAX_PAIRS; number++) {
        if (number == MISSING)
            continue;

        const struct seen_pair pair = { read_picture("left", number),
                                        read_picture("right", number) };

        if (!pair.left.data || !pair.right.data)
            continue;
        TEST_ASSERT_TRUE(shef_test_opencv_find_corners(
            pair.left, SHEF_TEST_BOARD_COLUMNS, SHEF_TEST_BOARD_ROWS, corners[n_pairs].left_xy_px));
        TEST_ASSERT_TRUE(shef_test_opencv_find_corners(pair.right, SHEF_TEST_BOARD_COLUMNS,
                                                       SHEF_TEST_BOARD_ROWS,
                                                       corners[n_pairs].right_xy_px));
        pictures[n_pairs++] = pair;
    }
}

static struct shef_calibration calibrated(const struct shef_test_board_pair *pairs, int n)
{
    struct shef_calibration calibration;
    double rms_px;

    TEST_ASSERT_TRUE(shef_test_opencv_calibrate(pairs, n, SQUARE_M, &calibration, &rms_px));
    printf("calibrated with %d pairs: reprojection error %.3f px RMS\n", n, rms_px);
    return calibration;
}

static struct shef_frame_rectify *rectifier(const struct shef_rectification *r)
{
    struct shef_frame_rectify *rectify = NULL;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_frame_rectify_create(&rectify, r, SHEF_FRAME_MONO8, shef_cpu_features(), &err),
        err.text);
    return rectify;
}

/* Both sides in the profile `wide`, with room around it: boards are seen whole. */
static double make_rectifications(const struct shef_calibration *calibration,
                                  struct shef_rectification *out_left,
                                  struct shef_rectification *out_right)
{
    struct shef_rectification *const sides[2] = { out_left, out_right };
    double baseline_m;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_rectification_pair(calibration, "wide", out_left, out_right, &baseline_m, &err),
        err.text);
    for (int i = 0; i < 2; i++) {
        sides[i]->cx_px += (WIDTH_PX - sides[i]->width_px) / 2.0;
        sides[i]->cy_px += (HEIGHT_PX - sides[i]->height_px) / 2.0;
        sides[i]->width_px = WIDTH_PX;
        sides[i]->height_px = HEIGHT_PX;
    }
    return baseline_m;
}

struct errors {
    double sum;
    double worst_px;
    int n;
    /* Corners in the rectified picture against the raw ones, rectified by geometry. */
    double geometry_sum;
    int n_geometry;
};

static void add_geometry(struct errors *errors, const struct shef_rectification *r,
                         const double *raw_xy_px, const double *xy_px)
{
    for (int i = 0; i < SHEF_TEST_BOARD_CORNERS; i++) {
        double x_px;
        double y_px;

        TEST_ASSERT_TRUE(
            shef_rectification_unproject(r, raw_xy_px[2 * i], raw_xy_px[2 * i + 1], &x_px, &y_px));
        errors->geometry_sum += pow(hypot(x_px - xy_px[2 * i], y_px - xy_px[2 * i + 1]), 2);
        errors->n_geometry++;
    }
}

/* Rectifies pairs and compares the rows of their corners, found in the rectified pictures. */
static struct errors rectify_pairs(const struct shef_calibration *calibration, int first, int end,
                                   int step)
{
    struct shef_rectification left;
    struct shef_rectification right;
    struct shef_image_u8 out[2] = { 0 };
    struct errors errors = { 0 };
    const double baseline_m = make_rectifications(calibration, &left, &right);
    struct shef_frame_rectify *rectify_left = rectifier(&left);
    struct shef_frame_rectify *rectify_right = rectifier(&right);

    for (int side = 0; side < 2; side++)
        TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&out[side], WIDTH_PX, HEIGHT_PX, &err));
    for (int i = first; i < end; i += step) {
        struct shef_test_board_pair found;

        shef_frame_rectify_run(rectify_left, pictures[i].left, out[0]);
        shef_frame_rectify_run(rectify_right, pictures[i].right, out[1]);
        find_corners(out[0], found.left_xy_px);
        find_corners(out[1], found.right_xy_px);
        for (int k = 0; k < SHEF_TEST_BOARD_CORNERS; k++) {
            const double off_px = found.left_xy_px[2 * k + 1] - found.right_xy_px[2 * k + 1];

            errors.sum += off_px * off_px;
            errors.worst_px = fmax(errors.worst_px, fabs(off_px));
            errors.n++;
            /* The right camera is to the right: things are further left there. */
            TEST_ASSERT_TRUE(found.left_xy_px[2 * k] > found.right_xy_px[2 * k]);
        }
        add_geometry(&errors, &left, corners[i].left_xy_px, found.left_xy_px);
        add_geometry(&errors, &right, corners[i].right_xy_px, found.right_xy_px);
    }
    printf("baseline %.1f mm; %d corners: rows differ by %.3f px RMS, %.2f at most; %.3f px RMS "
           "from where geometry puts them\n",
           1000 * baseline_m, errors.n, sqrt(errors.sum / errors.n), errors.worst_px,
           sqrt(errors.geometry_sum / errors.n_geometry));
    for (int side = 0; side < 2; side++)
        shef_image_destroy_u8(&out[side]);
    shef_frame_rectify_destroy(rectify_left);
    shef_frame_rectify_destroy(rectify_right);
    return errors;
}

static void test_corners_of_all_pairs_come_out_on_the_same_rows(void)
{
    SHEF_TEST_NEEDS_DATA("stereo");
    load();
    TEST_ASSERT_GREATER_OR_EQUAL_INT(10, n_pairs);

    const struct shef_calibration calibration = calibrated(corners, n_pairs);
    const struct errors errors = rectify_pairs(&calibration, 0, n_pairs, 1);

    TEST_ASSERT_EQUAL_INT(n_pairs * SHEF_TEST_BOARD_CORNERS, errors.n);
    TEST_ASSERT_TRUE(sqrt(errors.sum / errors.n) <= 0.3);
    TEST_ASSERT_TRUE(sqrt(errors.geometry_sum / errors.n_geometry) <= 0.3);
}

static void test_so_do_those_that_the_calibration_has_not_seen(void)
{
    struct shef_test_board_pair seen[MAX_PAIRS];
    int n_seen = 0;

    SHEF_TEST_NEEDS_DATA("stereo");
    load();
    for (int i = 0; i < n_pairs; i += 2)
        seen[n_seen++] = corners[i];

    const struct shef_calibration calibration = calibrated(seen, n_seen);
    const struct errors errors = rectify_pairs(&calibration, 1, n_pairs, 2);

    TEST_ASSERT_EQUAL_INT(n_pairs / 2 * SHEF_TEST_BOARD_CORNERS, errors.n);
    TEST_ASSERT_TRUE(sqrt(errors.sum / errors.n) <= 0.3);
}

static void test_opencv_rectifies_the_same_picture(void)
{
    struct shef_rectification left;
    struct shef_rectification right;
    struct shef_image_u8 out = { 0 };
    int64_t n_apart = 0;

    SHEF_TEST_NEEDS_DATA("stereo");
    load();

    const struct shef_calibration calibration = calibrated(corners, n_pairs);

    make_rectifications(&calibration, &left, &right);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&out, WIDTH_PX, HEIGHT_PX, &err));

    struct shef_frame_rectify *rectify = rectifier(&left);
    struct shef_test_opencv *peer = shef_test_opencv_create(&left);

    TEST_ASSERT_NOT_NULL(peer);
    shef_frame_rectify_run(rectify, pictures[0].left, out);
    shef_test_opencv_remap(peer, pictures[0].left);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const int off =
                shef_row_u8(out, y)[x] - shef_row_u8(shef_test_opencv_result(peer), y)[x];

            /* OpenCV's positions are 1/32 px apart. */
            if (shef_row_u8(shef_frame_rectify_valid(rectify), y)[x])
                n_apart += off < -4 || off > 4;
        }
    TEST_ASSERT_LESS_THAN_INT64(640 * 480 / 1000, n_apart);
    shef_test_opencv_destroy(peer);
    shef_frame_rectify_destroy(rectify);
    shef_image_destroy_u8(&out);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_corners_of_all_pairs_come_out_on_the_same_rows);
    RUN_TEST(test_so_do_those_that_the_calibration_has_not_seen);
    RUN_TEST(test_opencv_rectifies_the_same_picture);
    for (int i = 0; i < n_pairs; i++) {
        shef_image_destroy_u8(&pictures[i].left);
        shef_image_destroy_u8(&pictures[i].right);
    }
    return UNITY_END();
}
