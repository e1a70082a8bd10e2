/* Nearest-pixel shrinking of bit planes, 64 pixels at a time.
 *
 * Pixel i of n_to takes pixel floor((i + 0.5) n_from / n_to) of n_from. As n_to <= n_from, every
 * source pixel is taken at most once and in order, so a row is shrunk by squeezing the unwanted
 * bits out of its words. Part of paper.c. */
#ifndef SHEF_PIPELINE_PAPER_SHRINK_H
#define SHEF_PIPELINE_PAPER_SHRINK_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "pipeline/edge_map.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Which source pixel the pixel i of n_to takes. */
int32_t shef_paper_source_of(int32_t i, int32_t n_from, int32_t n_to);

struct shef_paper_shrink;

/* Prepares shrinking from one size to another, none of whose sides is larger. Thread: setup. */
SHEF_MUST_CHECK enum shef_err shef_paper_shrink_create(struct shef_paper_shrink **out_shrink,
                                                       int32_t from_width_px,
                                                       int32_t from_height_px, int32_t to_width_px,
                                                       int32_t to_height_px,
                                                       struct shef_error *err);

/* Shrinks an unsigned or ternary map.                           Thread: any, shrink is only read.
 *   to  of the same kind as from */
void shef_paper_shrink_run(const struct shef_paper_shrink *shrink, const struct shef_edge_map *from,
                           struct shef_edge_map *to);

size_t shef_paper_shrink_bytes(const struct shef_paper_shrink *shrink);

/* NULL is allowed. */
void shef_paper_shrink_destroy(struct shef_paper_shrink *shrink);

#ifdef __cplusplus
}
#endif

#endif
