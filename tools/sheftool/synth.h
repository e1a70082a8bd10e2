/* Synthetic edge pairs with exact truth, in the likeness of the authors' data.
 *
 * Two cameras side by side look at a world of textured walls and boxes while they move on a
 * circle. Frame edges are the strongest gradients of the left view. Event edges are the strongest
 * brightness changes that the motion causes in the right view: edges along the motion are weak,
 * some regions drop out, single pixels fire at random, and the view is off vertically by a smooth
 * residual as on the real rig. Densities are those of the authors' maps (28 % and 24 %). The same
 * settings give the same maps. Thread: one per generator. */
#ifndef SHEFTOOL_SYNTH_H
#define SHEFTOOL_SYNTH_H

#include "core/error.h"
#include "core/image.h"
#include "sheftool/scenes.h"
#include "sheftool/synth_world.h"

struct shef_synth_settings {
    int32_t width_px;  /* 96..4096 */
    int32_t height_px; /* 64..4096 */
    int32_t n_pairs;   /* 1..9999, shared out among the kinds of worlds */
    uint64_t seed;
    double vertical_residual_px; /* largest shift between the views, 0 = rectified */
    double saturated_share;      /* of the pairs, 0..1: their event maps are 55 % full */
};

/* Left camera; the right one sits baseline_m further right. Like the authors' at 640 px width. */
#define SHEF_SYNTH_FOCAL_PER_WIDTH (1301.0 / 640.0)
#define SHEF_SYNTH_BASELINE_M      0.06544

/* One pair; the images belong to the generator. */
struct shef_synth_pair {
    int64_t number;                  /* from 1 */
    struct shef_image_u8 frame_edge; /* 0 and 255 */
    struct shef_image_u8 event_edge;
    struct shef_image_f32 truth; /* px */
    bool saturated;
};

struct shef_synth;

/* NULL: out of memory. The settings must be in range. */
struct shef_synth *shef_synth_create(const struct shef_synth_settings *settings,
                                     struct shef_error *err);

void shef_synth_destroy(struct shef_synth *synth);

/* The scenes that the numbers 1..n_pairs fall into. */
struct shef_scenes shef_synth_scenes(const struct shef_synth_settings *settings);

/* Makes pair index 0..n_pairs-1; valid until the next call. */
struct shef_synth_pair shef_synth_make(struct shef_synth *synth, int32_t index);

/* The vertical residual v(x, y) of a place in the event map: its content belongs v px lower. */
double shef_synth_residual_px(const struct shef_synth_settings *settings, double x_px, double y_px);

#endif
