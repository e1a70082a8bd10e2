#include "sheftool/events_video.h"

#include <cerrno>
#include <cstdio>
#include <exception>
#include <new>
#include <string>

#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <opencv2/videoio/registry.hpp>

#include <fcntl.h>
#include <unistd.h>

#include "core/file.h"

struct shef_video {
    std::string path;
    std::string part;
    cv::VideoWriter writer;
    cv::Mat bgr;
};

static bool has_ffmpeg()
{
    for (const cv::VideoCaptureAPIs backend : cv::videoio_registry::getWriterBackends())
        if (backend == cv::CAP_FFMPEG)
            return true;
    return false;
}

/* H.264 where there is an encoder for it, else MPEG-4 part 2, which FFmpeg always has. */
static bool open_any(struct shef_video *video, double fps, cv::Size size)
{
    static const char *const codecs[] = { "avc1", "mp4v" };

    for (const char *codec : codecs)
        if (video->writer.open(video->part, cv::CAP_FFMPEG,
                               cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]), fps,
                               size))
            return true;
    return false;
}

static enum shef_err open_video(struct shef_video *video, double fps, cv::Size size,
                                struct shef_error *err)
{
    if (!has_ffmpeg())
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "write '%s': this OpenCV was built without FFmpeg and cannot write MP4; "
                         "name a folder for a sequence of PNG files instead",
                         video->path.c_str());

    /* FFmpeg does not say why it cannot write. */
    FILE *file = std::fopen(video->part.c_str(), "wb");

    if (!file)
        return shef_fail_os(err, errno, "write '%s'", video->path.c_str());
    std::fclose(file);
    cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
    if (!open_any(video, fps, size))
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "write '%s': FFmpeg has no encoder for MP4 pictures of %d x %d px; name a "
                         "folder for a sequence of PNG files instead",
                         video->path.c_str(), size.width, size.height);
    return SHEF_OK;
}

/* Turns whatever OpenCV throws into a code and a sentence. */
template <typename Work>
static enum shef_err guarded(struct shef_error *err, const char *path, Work work) noexcept
{
    try {
        return work();
    } catch (const std::bad_alloc &) {
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write '%s': out of memory", path);
    } catch (const std::exception &e) {
        return shef_fail(err, SHEF_ERR_IO, "write '%s': %s", path, e.what());
    }
}

extern "C" enum shef_err shef_video_create(struct shef_video **out_video, const char *path,
                                           int32_t width_px, int32_t height_px, double fps,
                                           struct shef_error *err)
{
    struct shef_video *video = nullptr;
    const enum shef_err code = guarded(err, path, [&] {
        video = new shef_video();
        video->path = path;
        video->part = video->path + ".part.mp4";
        return open_video(video, fps, cv::Size(width_px, height_px), err);
    });

    if (code == SHEF_OK)
        *out_video = video;
    else
        shef_video_abandon(video);
    return code;
}

extern "C" enum shef_err shef_video_add(struct shef_video *video, struct shef_image_rgb8 picture,
                                        struct shef_error *err)
{
    return guarded(err, video->path.c_str(), [&] {
        const cv::Mat rgb(picture.height_px, picture.width_px, CV_8UC3, picture.data,
                          (size_t)picture.stride_bytes);

        cv::cvtColor(rgb, video->bgr, cv::COLOR_RGB2BGR);
        video->writer.write(video->bgr);
        return SHEF_OK;
    });
}

/* OpenCV does not say whether writing succeeded; a file that cannot be opened again tells. */
static enum shef_err check_written(const struct shef_video *video, struct shef_error *err)
{
    cv::VideoCapture reader;
    cv::Mat first;

    if (!reader.open(video->part, cv::CAP_FFMPEG) || !reader.read(first))
        return shef_fail(err, SHEF_ERR_IO,
                         "write '%s': FFmpeg did not complete it; the disk may be full",
                         video->path.c_str());
    return SHEF_OK;
}

/* Waits until the disk has the data, before they get their name. Returns 0 or -1 with errno. */
static int sync_file(const char *path)
{
    const int fd = open(path, O_RDONLY | O_CLOEXEC);

    if (fd < 0)
        return -1;

    const int result = fsync(fd);
    const int failure = errno;

    close(fd);
    errno = failure;
    return result;
}

extern "C" enum shef_err shef_video_close(struct shef_video *video, struct shef_error *err)
{
    const enum shef_err code = guarded(err, video->path.c_str(), [&] {
        video->writer.release();

        const enum shef_err written = check_written(video, err);

        if (written != SHEF_OK)
            return written;
        if (sync_file(video->part.c_str()) != 0 ||
            rename(video->part.c_str(), video->path.c_str()) != 0)
            return shef_fail_os(err, errno, "write '%s'", video->path.c_str());
        shef_file_sync_name(video->path.c_str());
        return SHEF_OK;
    });

    if (code == SHEF_OK)
        delete video;
    else
        shef_video_abandon(video);
    return code;
}

extern "C" void shef_video_abandon(struct shef_video *video)
{
    if (!video)
        return;
    (void)guarded(nullptr, "", [&] {
        video->writer.release();
        return SHEF_OK;
    });
    unlink(video->part.c_str());
    delete video;
}
