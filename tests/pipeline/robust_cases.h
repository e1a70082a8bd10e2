/* Synthetic edge pairs with exactly known disparity, and a matcher to run on them.
 *
 * One random, smooth texture f lies on a surface d(x, y). The left map's values come from
 * f(x - d(x, y), y), the right map's from f(x, y), so that left(x, y) matches right(x - d, y)
 * with sub-pixel truth. A vertical residual v moves the right map's content up by v. Edges are
 * where f is high (unsigned), high or low (ternary), or f itself (graded). */
#ifndef SHEF_TESTS_PIPELINE_ROBUST_CASES_H
#define SHEF_TESTS_PIPELINE_ROBUST_CASES_H

#include <stdbool.h>
#include <stdint.h>

#include "core/image.h"
#include "pipeline/edge_map.h"
#include "pipeline/robust.h"
#include "pipeline/smooth_field.h"
#include "support/support.h"

enum scene_surface {
    SURFACE_CONSTANT, /* near_px everywhere */
    SURFACE_SLANTED,  /* far_px at the left border to near_px at the right one */
    SURFACE_STEPPED,  /* far_px in the left half, near_px in the right half */
};

struct scene {
    enum shef_edge_kind kind;
    int32_t width_px;
    int32_t height_px;
    enum scene_surface surface;
    double near_px;
    double far_px;
    uint64_t texture;                         /* which random texture; none has edges in common */
    double pan_px;                            /* the texture's shift to the right */
    double noise;                             /* share of right pixels with a value of their own */
    const struct shef_smooth_field *residual; /* vertical, px; NULL: none */
};

/* Truth at a pixel of the left view, px. */
double scene_disparity_px(const struct scene *scene, double x);

/* Two maps of one kind and size; free with edges_destroy(). */
struct edges {
    struct shef_edge_map left;
    struct shef_edge_map right;
};

struct edges edges_create(enum shef_edge_kind kind, int32_t width_px, int32_t height_px);
struct edges edges_of_scene(const struct scene *scene);
/* Values drawn one by one, of all amplitudes, non-zero with probability share. */
struct edges edges_random(struct shef_test_random *random, enum shef_edge_kind kind,
                          int32_t width_px, int32_t height_px, double share);
void edges_destroy(struct edges *edges);
struct shef_edge_pair edges_pair(const struct edges *edges);

/* One pixel of a map, outside it 0: -1, 0, 1, graded -127..127. Only inside for setting. */
int32_t edge_at(const struct shef_edge_map *map, int32_t x, int32_t y);
void edge_set(struct shef_edge_map *map, int32_t x, int32_t y, int32_t value);

/* Sets pixels at random until share of an unsigned map are edges, as hot pixels and noise do. */
void edges_flood(struct shef_edge_map *map, double share, uint64_t seed);

/* A copy of a map, rows or columns in reverse order. */
struct shef_edge_map edges_mirrored(const struct shef_edge_map *map, bool in_x, bool in_y);

/* The four images that match() fills; free with result_destroy(). */
struct result {
    struct shef_robust_output images;
    struct shef_robust_report report;
};

struct result result_create(int32_t width_px, int32_t height_px);
void result_destroy(struct result *result);

/* A matcher on this processor's best instruction set; ends the test where create() refuses. */
struct shef_robust *matcher_create(const struct shef_robust_params *params,
                                   struct shef_workers *workers);

/* Matches one pair into a result of its own. */
struct result match(struct shef_robust *matcher, const struct edges *edges, int64_t number);

/* value <= limit; a failure prints both and what they are. */
void expect_at_most(double limit, double value, const char *what);

/* All four images are the same, bit for bit. */
void expect_same_result(const struct result *expected, const struct result *actual);

/* Errors of the dense disparity against the truth, away from the borders: from column
 * near_px + border_px to border_px before the last one, border_px from top and bottom, and
 * step_px from the step of a stepped surface. */
struct scene_error {
    double mean_px;    /* of the absolute error */
    double largest_px; /* of the absolute error */
    double share_bad;  /* of pixels with an error above 3 px */
};

struct scene_error error_of(const struct scene *scene, const struct result *result,
                            int32_t border_px, int32_t step_px);

#endif
