/* Writes the folder truth/ of a simulated recording.
 *
 * truth/README is written last: without it the rest is not taken for whole. An error becomes the
 * recording's verdict. Blocks on disk. Thread: one. */
#ifndef SHEF_RECORD_TRUTH_WRITER_H
#define SHEF_RECORD_TRUTH_WRITER_H

#include "calib/calibration.h"
#include "core/error.h"
#include "core/image.h"
#include "record/recording_writer.h"
#include "record/truth.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_truth_writer;

/* Makes the folder.
 *   recording    kept
 *   calibration  the true one, with which views are rectified; written as truth/calibration.yaml
 *   profile      of the maps: "wide"
 *   source       one line for people: what was simulated
 * SHEF_ERR_INVALID: no rectification for that. SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_truth_writer_start(struct shef_recording_writer *recording,
                                                      const struct shef_calibration *calibration,
                                                      const char *profile, const char *source,
                                                      struct shef_truth_writer **out_writer,
                                                      struct shef_error *err);

/* Add a row each: poses and frames in the order of time. After an error, only stop() may follow. */
SHEF_MUST_CHECK enum shef_err shef_truth_writer_pose(struct shef_truth_writer *writer,
                                                     const struct shef_truth_pose *pose,
                                                     struct shef_error *err);
SHEF_MUST_CHECK enum shef_err shef_truth_writer_frame(struct shef_truth_writer *writer,
                                                      const struct shef_truth_frame *frame,
                                                      struct shef_error *err);
SHEF_MUST_CHECK enum shef_err shef_truth_writer_clock(struct shef_truth_writer *writer,
                                                      const struct shef_truth_clock *clock,
                                                      struct shef_error *err);

/* Writes the maps of one frame, all of the profile's size.
 *   number     of the frame, by the camera
 *   depth_m    along the rectified left axis; 0: none. Kept in mm, 65.535 m at most
 *   disparity  in px, x_left - x_right; 0: none
 *   mask       SHEF_TRUTH_VALID, SHEF_TRUTH_OCCLUDED */
SHEF_MUST_CHECK enum shef_err shef_truth_writer_maps(struct shef_truth_writer *writer,
                                                     enum shef_truth_view view, uint64_t number,
                                                     struct shef_image_f32 depth_m,
                                                     struct shef_image_f32 disparity,
                                                     struct shef_image_u8 mask,
                                                     struct shef_error *err);

/* Ends the folder, unless an error came before. Frees the writer. */
SHEF_MUST_CHECK enum shef_err shef_truth_writer_stop(struct shef_truth_writer *writer,
                                                     struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
