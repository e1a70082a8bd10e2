#include "sheftool/matcher_opencv.h"

#include <exception>
#include <vector>

#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "core/memory.h"

/* StereoBM and StereoSGBM give disparities in 1/16 px. */
static const float sixteenth = 1.0f / 16.0f;
static const int min_disparity_px = 1;

struct shef_opencv {
    shef_opencv_params params;
    cv::Ptr<cv::StereoMatcher> matcher;
    cv::Mat left;
    cv::Mat right;
    cv::Mat blurred;
    cv::Mat disparity; /* CV_16S */
};

/* Turns whatever OpenCV throws into a code and a sentence. */
template <typename Work>
static enum shef_err guarded(struct shef_error *err, const char *what, Work work) noexcept
{
    try {
        work();
        return SHEF_OK;
    } catch (const std::bad_alloc &) {
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "OpenCV, %s: out of memory", what);
    } catch (const std::exception &e) {
        return shef_fail(err, SHEF_ERR_INVALID, "OpenCV, %s: %s", what, e.what());
    }
}

static cv::Ptr<cv::StereoMatcher> make_matcher(const shef_opencv_params &params)
{
    const int n_disparities = (params.max_disparity_px + 15) / 16 * 16;
    const int area_px = params.block_px * params.block_px;

    if (params.semi_global)
        return cv::StereoSGBM::create(min_disparity_px, n_disparities, params.block_px,
                                      params.p1 * area_px, params.p2 * area_px);
    cv::Ptr<cv::StereoBM> matcher = cv::StereoBM::create(n_disparities, params.block_px);

    matcher->setMinDisparity(min_disparity_px);
    if (params.keep_ambiguous)
        matcher->setUniquenessRatio(0);
    return matcher;
}

extern "C" struct shef_opencv *shef_opencv_create(const struct shef_opencv_params *params,
                                                  struct shef_error *err)
{
    if (params->block_px > params->width_px || params->block_px > params->height_px) {
        shef_fail(err, SHEF_ERR_INVALID,
                  "OpenCV's block of %d x %d px does not fit maps of %d x %d px; give larger maps",
                  params->block_px, params->block_px, params->width_px, params->height_px);
        return nullptr;
    }

    struct shef_opencv *opencv = nullptr;
    const enum shef_err code = guarded(err, "set-up", [&] {
        cv::setNumThreads(1);
        opencv = new shef_opencv();
        opencv->params = *params;
        opencv->left.create(params->height_px, params->width_px, CV_8U);
        opencv->right.create(params->height_px, params->width_px, CV_8U);
        opencv->matcher = make_matcher(*params);
    });

    if (code != SHEF_OK) {
        delete opencv;
        return nullptr;
    }
    return opencv;
}

static void draw(const struct shef_edge_map *map, cv::Mat &image, std::vector<int8_t> &row)
{
    for (int32_t y = 0; y < map->height_px; y++) {
        uint8_t *pixels = image.ptr<uint8_t>(y);

        shef_edge_map_row(map, y, row.data());
        for (int32_t x = 0; x < map->width_px; x++)
            pixels[x] = row[(size_t)x] != 0 ? 255 : 0;
    }
}

extern "C" enum shef_err shef_opencv_prepare(struct shef_opencv *opencv,
                                             const struct shef_edge_map *frame,
                                             const struct shef_edge_map *event,
                                             struct shef_error *err)
{
    return guarded(err, "drawing the maps", [&] {
        std::vector<int8_t> row((size_t)opencv->params.width_px);

        draw(frame, opencv->left, row);
        draw(event, opencv->right, row);
        if (opencv->params.blur_px > 0) {
            for (cv::Mat *image : { &opencv->left, &opencv->right }) {
                cv::GaussianBlur(*image, opencv->blurred, cv::Size(), opencv->params.blur_px);
                cv::swap(*image, opencv->blurred);
            }
        }
    });
}

extern "C" enum shef_err shef_opencv_match(struct shef_opencv *opencv, struct shef_error *err)
{
    return guarded(err, opencv->params.semi_global ? "StereoSGBM" : "StereoBM", [&] {
        opencv->matcher->compute(opencv->left, opencv->right, opencv->disparity);
    });
}

extern "C" void shef_opencv_read(const struct shef_opencv *opencv,
                                 const struct shef_edge_map *edges,
                                 struct shef_image_f32 out_disparity)
{
    int8_t edge_row[SHEF_IMAGE_MAX_SIDE_PX];

    for (int32_t y = 0; y < out_disparity.height_px; y++) {
        const int16_t *found = opencv->disparity.ptr<int16_t>(y);
        float *out = shef_row_f32(out_disparity, y);

        if (edges)
            shef_edge_map_row(edges, y, edge_row);
        for (int32_t x = 0; x < out_disparity.width_px; x++) {
            const float disparity_px = (float)found[x] * sixteenth;
            const bool kept = disparity_px >= (float)min_disparity_px &&
                              disparity_px <= (float)opencv->params.max_disparity_px &&
                              (!edges || edge_row[x] != 0);

            out[x] = kept ? disparity_px : 0;
        }
    }
}

extern "C" void shef_opencv_destroy(struct shef_opencv *opencv)
{
    delete opencv;
}

extern "C" const char *shef_opencv_version(void)
{
    return CV_VERSION;
}
