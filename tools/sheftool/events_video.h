/* An MP4 file from pictures, through OpenCV's videoio. Thread: main. */
#ifndef SHEFTOOL_EVENTS_VIDEO_H
#define SHEFTOOL_EVENTS_VIDEO_H

#include <stdint.h>

#include "core/error.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_video;

/* Creates the file under a temporary name beside it, PATH.part.mp4.
 *   width_px, height_px  even
 *   fps                  pictures a second, above 0
 * SHEF_ERR_UNSUPPORTED: this OpenCV has no way to write MP4. SHEF_ERR_IO: not at this place. */
SHEF_MUST_CHECK enum shef_err shef_video_create(struct shef_video **out_video, const char *path,
                                                int32_t width_px, int32_t height_px, double fps,
                                                struct shef_error *err);

/* Appends a picture of the video's size. */
SHEF_MUST_CHECK enum shef_err shef_video_add(struct shef_video *video,
                                             struct shef_image_rgb8 picture,
                                             struct shef_error *err);

/* Completes the file and gives it its name. Frees the video; on failure nothing stays behind. */
SHEF_MUST_CHECK enum shef_err shef_video_close(struct shef_video *video, struct shef_error *err);

/* Removes what was written. NULL is allowed. */
void shef_video_abandon(struct shef_video *video);

#ifdef __cplusplus
}
#endif

#endif
