/* Reads the folder truth/ of a simulated recording. Blocks on reading. Thread: one per reader. */
#ifndef SHEF_RECORD_RECORDED_TRUTH_H
#define SHEF_RECORD_RECORDED_TRUTH_H

#include <stdbool.h>
#include <stdint.h>

#include "calib/calibration.h"
#include "calib/rectification.h"
#include "core/error.h"
#include "core/image.h"
#include "record/truth.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_recorded_truth {
    char profile[SHEF_CALIBRATION_NAME_BYTES]; /* of the maps */
    char source[256];                          /* what was simulated */
    struct shef_calibration calibration;       /* the true one */
    struct shef_rectification left;            /* of the profile */
    struct shef_rectification right;
    double baseline_m;
    struct shef_truth_pose *poses; /* by rising time */
    uint32_t n_poses;
    struct shef_truth_frame *frames; /* by rising time */
    uint32_t n_frames;
    struct shef_truth_clock clocks[SHEF_TRUTH_MAX_CLOCKS];
    uint32_t n_clocks;
    char folder[4096];
};

/* Opens the truth of a recording; shef_recorded_truth_close() afterwards.
 * SHEF_ERR_NOT_FOUND: there is none, or it was not written to its end. SHEF_ERR_FORMAT: a table is
 * damaged; the sentence names file and line. SHEF_ERR_UNSUPPORTED: of a later version. Errors of
 * the system. */
SHEF_MUST_CHECK enum shef_err shef_recorded_truth_open(const char *path,
                                                       struct shef_recorded_truth *out_truth,
                                                       struct shef_error *err);

/* The frame of a number, or NULL. */
const struct shef_truth_frame *shef_recorded_truth_frame(const struct shef_recorded_truth *truth,
                                                         uint64_t number);

/* The clock of a name, or NULL. */
const struct shef_truth_clock *shef_recorded_truth_clock(const struct shef_recorded_truth *truth,
                                                         const char *name);

/* The maps of one frame in one view, all of the profile's size. */
struct shef_truth_maps {
    struct shef_image_f32 depth_m;   /* 0: none; rounded to mm */
    struct shef_image_f32 disparity; /* px; 0: none */
    struct shef_image_u8 mask;       /* SHEF_TRUTH_VALID, SHEF_TRUTH_OCCLUDED */
};

/* Reads the maps; shef_truth_maps_free() afterwards.
 * SHEF_ERR_NOT_FOUND: there are none of this frame. SHEF_ERR_FORMAT: damaged, or of another size.
 * SHEF_ERR_NO_MEMORY, errors of the system. */
SHEF_MUST_CHECK enum shef_err shef_recorded_truth_maps(const struct shef_recorded_truth *truth,
                                                       enum shef_truth_view view, uint64_t number,
                                                       struct shef_truth_maps *out_maps,
                                                       struct shef_error *err);

/* Zeroed maps are allowed. */
void shef_truth_maps_free(struct shef_truth_maps *maps);

/* A zeroed truth is allowed. */
void shef_recorded_truth_close(struct shef_recorded_truth *truth);

#ifdef __cplusplus
}
#endif

#endif
