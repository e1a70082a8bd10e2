/* Events of textured rows that slide past the sensor, exact to the time stamp's microsecond.
 *
 * Each row has a brightness of its own: cells of random brightness, blurred by the lens and by the
 * pixel's width, in logarithm and linear between knots 1/16 px apart. So the instant at which a
 * pixel crosses its threshold is the solution of a linear equation, not a sample of a rendering.
 * Thresholds differ from pixel to pixel and from polarity to polarity. Nothing else: no noise, no
 * latency.
 *
 * Thread: the test's own. */
#ifndef SHEF_TESTS_MOVING_EDGES_H
#define SHEF_TESTS_MOVING_EDGES_H

#include "core/packets.h"
#include "support/support.h"

struct shef_test_texture {
    double contrast; /* cells are +- this much, in logarithm */
    double cell_px;  /* mean width of a cell */
    double blur_px;  /* of the lens, standard deviation */
    bool alternates; /* bars of full contrast instead of random brightness */
};

struct shef_test_scene {
    int32_t width_px; /* of the sensor */
    int32_t height_px;
    double *knots; /* by row */
    int32_t n_knots;
};

struct shef_test_scene shef_test_scene_create(const struct shef_test_texture *texture,
                                              int32_t width_px, int32_t height_px,
                                              struct shef_test_random *random);
void shef_test_scene_destroy(struct shef_test_scene *scene);

/* The logarithm of brightness that a pixel sees whose centre is there on the row's own scale. */
double shef_test_scene_at(const struct shef_test_scene *scene, int32_t y_px, double position_px);

/* One pass. At mid_us pixel x looks at position x + SHEF_TEST_SCENE_ORIGIN_PX. */
#define SHEF_TEST_SCENE_ORIGIN_PX 400
struct shef_test_pass {
    double speed_px_s; /* of the picture, + to the right */
    int64_t first_us;  /* events from here on; the scene has moved for 24 px or more before */
    int64_t mid_us;
    int64_t last_us;
    double threshold; /* in logarithm */
    double mismatch;  /* standard deviation of thresholds, as a share */
};

/* The pass's events by time, since first_us.
 *   out_events  free() it
 * Returns how many. */
uint32_t shef_test_scene_run(const struct shef_test_scene *scene, const struct shef_test_pass *pass,
                             struct shef_test_random *random, struct shef_event **out_events);

#endif
