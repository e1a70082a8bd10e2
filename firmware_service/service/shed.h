/* Which work is left out when time is short.
 *
 * Looks at how long a frame has waited though all it needs was there. The longer, the more is left
 * out, in a fixed order, cheapest loss first: dense image, point cloud, full-resolution read-out,
 * half of the disparity range, the whole frame. Work comes back only after several frames in a row
 * had waited clearly less, so that it does not flicker. A whole frame is left out for its own
 * waiting alone. Pure logic: no clock. Thread: one. */
#ifndef SHEF_SERVICE_SHED_H
#define SHEF_SERVICE_SHED_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

enum shef_shed_level {
    SHEF_SHED_DENSE,
    SHEF_SHED_CLOUD,
    SHEF_SHED_FULL_GRID,
    SHEF_SHED_RANGE,
    SHEF_SHED_FRAME,
    SHEF_SHED_LEVELS,
};

/* So many frames in a row must have waited less before one kind of work comes back. */
#define SHEF_SHED_CALM_FRAMES 16

/* Zeroed memory leaves nothing out. */
struct shef_shed {
    int32_t n_levels; /* so many kinds of work are left out, in their order */
    int32_t n_calm;   /* frames in a row that would allow one less */
};

struct shef_shed_decision {
    uint32_t bits; /* SHEF_RESULT_SHED_DENSE to _RANGE */
    bool drops_frame;
};

/* Decides about the next frame.
 *   wait_ns   0 or more
 *   after_ms  how long a frame may wait before each level; not growing means that a level never
 *             comes without the one before */
struct shef_shed_decision shef_shed_next(struct shef_shed *shed, int64_t wait_ns,
                                         const int32_t after_ms[SHEF_SHED_LEVELS]);

#ifdef __cplusplus
}
#endif

#endif
