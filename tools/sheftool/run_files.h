/* What `sheftool run` writes for each frame. Thread: main. */
#ifndef SHEFTOOL_RUN_FILES_H
#define SHEFTOOL_RUN_FILES_H

#include <stdbool.h>

#include "pipeline/point_cloud.h"
#include "sheftool/output_folder.h"
#include "sheftool/run_chain.h"
#include "sheftool/run_score.h"

struct shef_run_files {
    struct shef_output_folder *folder; /* borrowed */
    struct shef_depth_geometry geometry;
    bool dense;    /* depth maps everywhere, not only at frame edges */
    bool pictures; /* contact sheets */
    bool cloud;
    struct shef_run_scorer *scorer; /* truth for the pictures; NULL: none */
    bool has_truth;                 /* of this frame: the scorer is loaded with it */
    /* Work space; shef_run_files_free(). */
    struct shef_image_u16 millimetres;
    struct shef_image_f32 metres;
    struct shef_point *points;
};

/* Makes the folders and the work space. */
SHEF_MUST_CHECK enum shef_err shef_run_files_prepare(struct shef_run_files *files,
                                                     struct shef_error *err);

/* Writes everything of one frame. */
SHEF_MUST_CHECK enum shef_err shef_run_files_write(struct shef_run_files *files,
                                                   const struct shef_run_frame *frame,
                                                   struct shef_error *err);

/* A zeroed one is allowed. */
void shef_run_files_free(struct shef_run_files *files);

/* Writes one sheet: frame, events, edges, disparity, and if truth is known, truth and errors.
 *   scorer  loaded with this frame; NULL: no truth */
SHEF_MUST_CHECK enum shef_err shef_run_sheet_write(const struct shef_run_frame *frame,
                                                   const struct shef_depth_geometry *geometry,
                                                   const struct shef_run_scorer *scorer,
                                                   const char *path, struct shef_error *err);

#endif
