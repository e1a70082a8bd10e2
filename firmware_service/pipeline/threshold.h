/* The highest threshold that leaves enough values above it, found near where the last one was.
 *
 * Counting is a pass over an image, and thresholds change little from frame to frame: from a good
 * guess four or five passes do where halving the whole range takes fifteen. The guess never changes
 * the result. Pure logic. Thread: any. */
#ifndef SHEF_PIPELINE_THRESHOLD_H
#define SHEF_PIPELINE_THRESHOLD_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Whether enough values are left at a threshold; if so, also at every lower one. */
typedef bool shef_threshold_fn(const void *context, int32_t threshold);

/* Returns the highest of floor..end-1 that leaves enough, or floor where none does.
 *   guess  any number */
int32_t shef_threshold_highest(int32_t floor, int32_t end, int32_t guess,
                               shef_threshold_fn *leaves_enough, const void *context);

#ifdef __cplusplus
}
#endif

#endif
