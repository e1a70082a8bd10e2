/* Draws one snapshot of the filter: its values as a grey image and its edges in colour, and above
 * them what they are. Thread: main. */
#ifndef SHEFTOOL_EVENTS_FRAME_H
#define SHEFTOOL_EVENTS_FRAME_H

#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "pipeline/event_edges.h"
#include "sheftool/events_moments.h"

enum shef_frame_show {
    SHEF_SHOW_BOTH, /* values left, edges right */
    SHEF_SHOW_VALUES,
    SHEF_SHOW_EDGES,
};

enum shef_frame_edges {
    SHEF_FRAME_EDGES_SIGNED,
    SHEF_FRAME_EDGES_GRADED,
    SHEF_FRAME_EDGES_THICK, /* the paper's binary map */
    SHEF_FRAME_EDGES_THIN,
};

struct shef_frame_params {
    enum shef_frame_show show;
    enum shef_frame_edges edges;
    double range_c; /* this many contrast steps are white, their negative black */
    int32_t width_px;
    int32_t height_px; /* of the sensor */
};

struct shef_frame {
    struct shef_frame_params params;
    struct shef_image_rgb8 picture; /* the last drawn; sides are even, as videos need them */
    /* The renderer's own. */
    struct shef_warp_map map; /* the sensor's own pixels: there is no calibration to rectify by */
    struct shef_event_edges *maker;
    struct shef_edge_map edges;
};

/* Allocates. A zeroed frame may be destroyed. */
SHEF_MUST_CHECK enum shef_err shef_frame_create(struct shef_frame *frame,
                                                const struct shef_frame_params *params,
                                                struct shef_error *err);

void shef_frame_destroy(struct shef_frame *frame);

/* Draws the moment into frame->picture. Returns the edges' threshold in contrast steps, 0 where
 * none are shown. */
double shef_frame_draw(struct shef_frame *frame, const struct shef_moment *moment);

#endif
