/* A set of edge-map pairs on disk, with or without truth.
 *
 *   frame_edge/N.png   edges of the frame camera, left, the reference: values 0 and 255
 *   event_edge/N.png   edges of the event camera, the same size
 *   gt/N.pfm           true disparity in px (optional)
 *   scenes.json        names of scenes (optional, see scenes.h)
 *
 * Pairs are in numeric order. Every file is checked when it is loaded; what breaks a rule ends in
 * one sentence that names the file and the remedy. Thread: one. */
#ifndef SHEFTOOL_DATASET_H
#define SHEFTOOL_DATASET_H

#include "core/image.h"
#include "pipeline/edge_map.h"
#include "sheftool/pair_list.h"
#include "sheftool/paths.h"
#include "sheftool/scenes.h"

struct shef_dataset {
    char frame_edges[SHEF_FOLDER_BYTES];
    char event_edges[SHEF_FOLDER_BYTES]; /* empty: not needed */
    char truth[SHEF_FOLDER_BYTES];       /* empty: none */
    struct shef_numbered_list pairs;     /* the numbers to work on, as frame_edges spells them */
    struct shef_numbered_list events;
    struct shef_numbered_list truths;
    struct shef_scenes scenes;
    int32_t width_px; /* of the first frame edge map; all files must agree */
    int32_t height_px;
};

/* Where the parts of a data set lie. */
struct shef_dataset_place {
    const char *frame_edges; /* folder */
    const char *event_edges; /* folder; NULL: not needed */
    const char *truth;       /* folder; NULL: none */
    const char *pick;        /* pairs to keep, "1-16,50"; NULL: all */
};

/* Lists the folders and checks that every picked pair is complete.
 * SHEF_ERR_NOT_FOUND: a folder or a partner is missing. SHEF_ERR_INVALID: one folder is named for
 * both cameras. SHEF_ERR_INVALID, SHEF_ERR_FORMAT: see the sentence. */
SHEF_MUST_CHECK enum shef_err shef_dataset_open(struct shef_dataset *out_dataset,
                                                const struct shef_dataset_place *place,
                                                struct shef_error *err);

/* The same for one folder with the layout above; gt/ is used if it is there. */
SHEF_MUST_CHECK enum shef_err shef_dataset_open_folder(struct shef_dataset *out_dataset,
                                                       const char *folder, const char *pick,
                                                       struct shef_error *err);

void shef_dataset_close(struct shef_dataset *dataset);

/* Reads the maps of pair index 0..pairs.n-1 into unsigned maps of the data set's size.
 *   event  NULL: only the frame edges are read */
SHEF_MUST_CHECK enum shef_err shef_dataset_load_edges(const struct shef_dataset *dataset,
                                                      size_t index, struct shef_edge_map *frame,
                                                      struct shef_edge_map *event,
                                                      struct shef_error *err);

/* Reads a pair's truth; shef_image_destroy_f32() frees it. */
SHEF_MUST_CHECK enum shef_err shef_dataset_load_truth(const struct shef_dataset *dataset,
                                                      size_t index,
                                                      struct shef_image_f32 *out_truth,
                                                      struct shef_error *err);

/* Reads a binary edge map from a PNG of values 0 and 255 into an unsigned map of that size. */
SHEF_MUST_CHECK enum shef_err shef_edge_map_read(const char *path, struct shef_edge_map *map,
                                                 struct shef_error *err);

/* Reads a map of px from a PFM, or from a 16-bit PNG as value / 256.
 * SHEF_ERR_FORMAT: a value is negative, infinite or no number. */
SHEF_MUST_CHECK enum shef_err shef_disparity_read(const char *path, struct shef_image_f32 *out_map,
                                                  struct shef_error *err);

/* Reads a confidence map from a PFM. SHEF_ERR_FORMAT: a value is outside 0..1. */
SHEF_MUST_CHECK enum shef_err shef_confidence_read(const char *path, struct shef_image_f32 *out_map,
                                                   struct shef_error *err);

/* The folder above another, as short as it can be said: "data" of "data/gt/", "." of "gt".
 *   out_path  SHEF_PATH_BYTES */
void shef_folder_above(const char *folder, char *out_path);

/* SHEF_ERR_INVALID: the sizes differ; the sentence names the file. */
SHEF_MUST_CHECK enum shef_err shef_check_size(const char *path, int32_t width_px, int32_t height_px,
                                              int32_t needed_width_px, int32_t needed_height_px,
                                              struct shef_error *err);

#endif
