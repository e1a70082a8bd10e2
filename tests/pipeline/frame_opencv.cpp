#include "frame_opencv.h"

#include <cstdio>
#include <exception>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

struct shef_test_opencv {
    cv::Mat positions[2]; /* by side of a cell less one: CV_16SC2 */
    cv::Mat fractions[2]; /* CV_16UC1 */
    cv::Mat half;
    cv::Mat out;
};

/* Turns whatever OpenCV throws into false and a line. */
template <typename Work> static bool guarded(const char *what, Work work) noexcept
{
    try {
        work();
        return true;
    } catch (const std::exception &e) {
        std::fprintf(stderr, "OpenCV, %s: %s\n", what, e.what());
        return false;
    }
}

static cv::Mat view_of(shef_image_u8 image)
{
    return cv::Mat(image.height_px, image.width_px, CV_8UC1, image.data,
                   static_cast<size_t>(image.stride_bytes));
}

static void make_maps(shef_test_opencv *peer, const shef_rectification *r, int cell_px)
{
    cv::Mat x(r->height_px, r->width_px, CV_32FC1);
    cv::Mat y(r->height_px, r->width_px, CV_32FC1);

    for (int row = 0; row < r->height_px; row++)
        for (int column = 0; column < r->width_px; column++) {
            double raw_x = -1e4;
            double raw_y = -1e4;

            shef_rectification_project(r, column, row, &raw_x, &raw_y);
            x.at<float>(row, column) = static_cast<float>((raw_x - (cell_px - 1) / 2.0) / cell_px);
            y.at<float>(row, column) = static_cast<float>((raw_y - (cell_px - 1) / 2.0) / cell_px);
        }
    cv::convertMaps(x, y, peer->positions[cell_px - 1], peer->fractions[cell_px - 1], CV_16SC2);
}

extern "C" shef_test_opencv *shef_test_opencv_create(const shef_rectification *rectification)
{
    shef_test_opencv *peer = nullptr;
    const bool is_made = guarded("maps", [&] {
        cv::setNumThreads(1);
        peer = new shef_test_opencv();
        make_maps(peer, rectification, 1);
        make_maps(peer, rectification, 2);
    });

    if (is_made)
        return peer;
    delete peer;
    return nullptr;
}

extern "C" void shef_test_opencv_destroy(shef_test_opencv *peer)
{
    delete peer;
}

extern "C" void shef_test_opencv_remap(shef_test_opencv *peer, shef_image_u8 raw)
{
    guarded("remap", [&] {
        cv::remap(view_of(raw), peer->out, peer->positions[0], peer->fractions[0], cv::INTER_LINEAR,
                  cv::BORDER_CONSTANT);
    });
}

extern "C" void shef_test_opencv_halve_and_remap(shef_test_opencv *peer, shef_image_u8 raw)
{
    guarded("mean and remap", [&] {
        cv::resize(view_of(raw), peer->half, cv::Size(raw.width_px / 2, raw.height_px / 2), 0, 0,
                   cv::INTER_AREA);
        cv::remap(peer->half, peer->out, peer->positions[1], peer->fractions[1], cv::INTER_LINEAR,
                  cv::BORDER_CONSTANT);
    });
}

extern "C" shef_image_u8 shef_test_opencv_result(const shef_test_opencv *peer)
{
    return { peer->out.data, peer->out.cols, peer->out.rows,
             static_cast<ptrdiff_t>(peer->out.step[0]) };
}

extern "C" bool shef_test_opencv_read(const char *path, shef_image_u8 out)
{
    bool fits = false;
    const bool is_read = guarded("picture", [&] {
        const cv::Mat image = cv::imread(path, cv::IMREAD_GRAYSCALE);

        fits = image.cols == out.width_px && image.rows == out.height_px;
        if (fits)
            image.copyTo(view_of(out));
    });

    return is_read && fits;
}

extern "C" bool shef_test_opencv_find_corners(shef_image_u8 image, int columns, int rows,
                                              double *out_xy_px)
{
    bool is_found = false;
    const bool is_done = guarded("chessboard", [&] {
        const cv::TermCriteria criteria(cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 60, 0.001);
        std::vector<cv::Point2f> corners;

        is_found = cv::findChessboardCorners(view_of(image), cv::Size(columns, rows), corners);
        if (!is_found)
            return;
        cv::cornerSubPix(view_of(image), corners, cv::Size(5, 5), cv::Size(-1, -1), criteria);
        for (size_t i = 0; i < corners.size(); i++) {
            out_xy_px[2 * i] = corners[i].x;
            out_xy_px[2 * i + 1] = corners[i].y;
        }
    });

    return is_done && is_found;
}

static std::vector<cv::Point2f> points_of(const double *xy_px)
{
    std::vector<cv::Point2f> points;

    for (int i = 0; i < SHEF_TEST_BOARD_CORNERS; i++)
        points.emplace_back(static_cast<float>(xy_px[2 * i]), static_cast<float>(xy_px[2 * i + 1]));
    return points;
}

static shef_camera_model model_of(const cv::Mat &matrix, const cv::Mat &distortion)
{
    shef_camera_model model = {};

    model.fx_px = matrix.at<double>(0, 0);
    model.fy_px = matrix.at<double>(1, 1);
    model.cx_px = matrix.at<double>(0, 2);
    model.cy_px = matrix.at<double>(1, 2);
    for (int i = 0; i < 5; i++)
        model.distortion[i] = distortion.at<double>(i);
    return model;
}

extern "C" bool shef_test_opencv_calibrate(const shef_test_board_pair *pairs, int n_pairs,
                                           double square_m, shef_calibration *out_calibration,
                                           double *out_rms_px)
{
    return guarded("calibration", [&] {
        const cv::Size size(640, 480);
        std::vector<cv::Point3f> board;
        std::vector<std::vector<cv::Point2f>> left;
        std::vector<std::vector<cv::Point2f>> right;
        std::vector<cv::Mat> turns;
        std::vector<cv::Mat> shifts;
        cv::Mat left_matrix, left_distortion, right_matrix, right_distortion;
        cv::Mat turn, shift, essential, fundamental;

        for (int row = 0; row < SHEF_TEST_BOARD_ROWS; row++)
            for (int column = 0; column < SHEF_TEST_BOARD_COLUMNS; column++)
                board.emplace_back(static_cast<float>(column * square_m),
                                   static_cast<float>(row * square_m), 0.0f);
        for (int i = 0; i < n_pairs; i++) {
            left.push_back(points_of(pairs[i].left_xy_px));
            right.push_back(points_of(pairs[i].right_xy_px));
        }

        const std::vector<std::vector<cv::Point3f>> boards(left.size(), board);

        cv::calibrateCamera(boards, left, size, left_matrix, left_distortion, turns, shifts);
        cv::calibrateCamera(boards, right, size, right_matrix, right_distortion, turns, shifts);
        *out_rms_px = cv::stereoCalibrate(
            boards, left, right, left_matrix, left_distortion, right_matrix, right_distortion, size,
            turn, shift, essential, fundamental, cv::CALIB_USE_INTRINSIC_GUESS,
            cv::TermCriteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-9));
        *out_calibration = shef_calibration_paper_rig();
        out_calibration->frame.width_px = out_calibration->event.width_px = size.width;
        out_calibration->frame.height_px = out_calibration->event.height_px = size.height;
        out_calibration->frame.model = model_of(left_matrix, left_distortion);
        out_calibration->event.model = model_of(right_matrix, right_distortion);
        for (int i = 0; i < 9; i++)
            out_calibration->t_event_frame.r[i] = turn.at<double>(i / 3, i % 3);
        for (int i = 0; i < 3; i++)
            out_calibration->t_event_frame.t_m[i] = shift.at<double>(i);
    });
}
