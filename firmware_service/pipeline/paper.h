/* The paper's own matcher: window correlation of binary edge maps, alone (D_s) or in a pyramid
 * (D_p).
 *
 * D_s (Wang 2021, eq. 3 and 4): at every left edge pixel the disparity whose window correlation is
 * largest; see kernels/bin_corr.h. Integer pixels.
 *
 * D_p (eq. 5): both maps are shrunk by scale^k, k = 0..n_levels-1. From the coarsest level to the
 * finest, the estimate of the coarser level is enlarged and averaged with the level's own.
 *
 * What the paper leaves open, and what this does:
 *   window          the paper names none. D_s: 51 px, D_p: 121 px at full size, which meets the
 *                   paper's table. At level k times scale^k, to the next odd number, so that it
 *                   spans the same part of the scene at every level.
 *   search range    the paper names none; 1..80 px at full size, after the colour range of its
 *                   figure 4. At level k both ends times scale^k, rounded, and at least 1.
 *   sizes           width and height times scale^k, rounded.
 *   shrinking       nearest pixel: the map stays binary, its density stays the same.
 *   enlarging       nearest pixel, the disparity divided by scale.
 *   I1, I2          0.5 and 0.5 where both levels have an estimate, else 1 for the one that has.
 *   no evidence     a pixel whose correlation is nowhere above 0 has no estimate.
 *   final pixels    the left map's edges; what enlarging put beside them is dropped, as the paper
 *                   evaluates edge pixels. `everywhere` estimates and keeps every pixel.
 *
 * Unsigned and ternary maps are accepted; the paper's are unsigned. No outlier filter: that is a
 * step of the evaluation (outlier_authors.h). */
#ifndef SHEF_PIPELINE_PAPER_H
#define SHEF_PIPELINE_PAPER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "core/workers.h"
#include "pipeline/edge_map.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_PAPER_MAX_LEVELS 16

struct shef_paper_params {
    int32_t n_levels;  /* 1..SHEF_PAPER_MAX_LEVELS */
    double scale;      /* of one level to the next, 0.5..0.99; of no effect on one level */
    int32_t window_px; /* side, odd, 1..127 */
    int32_t d_min;     /* px at full size, at least 1: 0 means none in the output */
    int32_t d_max;     /* px at full size, included; below the width */
    bool everywhere;   /* every pixel; else the left map's edges */
};

/* "paper-ds" or "paper-dp".
 * SHEF_ERR_NOT_FOUND: there is no such preset; out_params is untouched. */
SHEF_MUST_CHECK enum shef_err shef_paper_preset(const char *name,
                                                struct shef_paper_params *out_params,
                                                struct shef_error *err);

struct shef_paper;

/* Checks the parameters and allocates all memory that matching will need.       Thread: setup.
 *   cpu_features  which kernels may be picked: shef_cpu_features(), or fewer bits
 *   workers       may be NULL; must outlive the matcher. Its size never shows in the result.
 * SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: out_paper is untouched. */
SHEF_MUST_CHECK enum shef_err shef_paper_create(struct shef_paper **out_paper, int32_t width_px,
                                                int32_t height_px,
                                                const struct shef_paper_params *params,
                                                uint32_t cpu_features, struct shef_workers *workers,
                                                struct shef_error *err);

enum shef_paper_stage {
    SHEF_PAPER_SHRINK,    /* both maps to all levels */
    SHEF_PAPER_CORRELATE, /* all levels */
    SHEF_PAPER_MERGE,     /* enlarge, average, drop */
    SHEF_PAPER_N_STAGES,
};

/* A stage's name for reports, e.g. "correlate". */
const char *shef_paper_stage_name(enum shef_paper_stage stage);

struct shef_paper_report {
    int64_t stage_ns[SHEF_PAPER_N_STAGES];
};

/* Matches one pair. Allocates nothing.                      Thread: one at a time per matcher.
 *   left           frame edges, the reference; right: event edges; same size as at create()
 *   out_disparity  px, 0 = none
 *   report         may be NULL
 * SHEF_ERR_UNSUPPORTED: a map is graded; nothing was written. */
SHEF_MUST_CHECK enum shef_err shef_paper_match(struct shef_paper *paper,
                                               const struct shef_edge_map *left,
                                               const struct shef_edge_map *right,
                                               struct shef_image_f32 out_disparity,
                                               struct shef_paper_report *report);

/* The instruction set the kernels use, e.g. "avx512". */
const char *shef_paper_isa(const struct shef_paper *paper);

/* What create() allocated. */
size_t shef_paper_bytes(const struct shef_paper *paper);

/* NULL is allowed. */
void shef_paper_destroy(struct shef_paper *paper);

#ifdef __cplusplus
}
#endif

#endif
