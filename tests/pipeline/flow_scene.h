/* What both cameras see of textured layers while the rig moves past them: a frame of the left one
 * and the graded event map of the right one, as read out around mid-exposure.
 *
 * Layers are flat, parallel to the picture and of any depth, so perspective is a shift by
 * disparity times the rig's displacement in baselines; with motion along z it is a scale, too.
 * Events come from thresholds that differ from pixel to pixel, and from noise.
 *
 * Thread: the test's own. */
#ifndef SHEF_TESTS_FLOW_SCENE_H
#define SHEF_TESTS_FLOW_SCENE_H

#include "calib/rectification.h"
#include "core/image.h"
#include "pipeline/edge_map.h"
#include "support/support.h"

#define SHEF_TEST_FLOW_LAYERS 5

struct shef_test_flow_layer {
    double left_px, top_px, right_px, bottom_px; /* in the left picture at mid-exposure */
    double disparity_px;
    double *logs; /* texture: logarithm of grey, periodic, side x side, 2 knots a pixel */
};

struct shef_test_flow_scene {
    struct shef_rectification profile;
    struct shef_test_flow_layer layers[SHEF_TEST_FLOW_LAYERS]; /* the nearest first */
};

/* Layers of random depth (disparities 6..40 px at f 555, less for smaller profiles) and place.
 *   contrast  1: rich; 0.3: weak */
struct shef_test_flow_scene shef_test_flow_scene_create(const struct shef_rectification *profile,
                                                        double contrast,
                                                        struct shef_test_random *random);
void shef_test_flow_scene_destroy(struct shef_test_flow_scene *scene);

/* The left camera's frame: 5 ms exposure while the rig moves, sensor noise.
 *   baselines_s  velocity in baselines a second, x y z */
void shef_test_flow_frame(const struct shef_test_flow_scene *scene, const double baselines_s[3],
                          struct shef_test_random *random, struct shef_image_u8 out);

/* The right camera's events around mid-exposure, weighted by exp(-120 |t|), divided by their 0.90
 * quantile (3/10 of a step at least) and clipped.
 *   threshold  in ln; noise_hz  events of each pixel that nothing caused */
void shef_test_flow_events(const struct shef_test_flow_scene *scene, const double baselines_s[3],
                           double threshold, double noise_hz, struct shef_test_random *random,
                           struct shef_edge_map *out);

#endif
