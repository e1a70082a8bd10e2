/* What sheftool can match with: one table of names, ours and OpenCV's behind one face.
 *
 * A matcher maps an edge pair to a disparity map and, if it has one, a confidence map. Pairs are
 * given in the order of their numbers; a matcher may remember earlier ones, never later ones.
 * Thread: one at a time per matcher. */
#ifndef SHEFTOOL_MATCHER_H
#define SHEFTOOL_MATCHER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"
#include "core/workers.h"
#include "pipeline/edge_map.h"
#include "pipeline/robust.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_MATCHER_MAX_STAGES 8

/* How the vertical residual between the maps is corrected before they are matched. */
enum shef_align_mode {
    SHEF_ALIGN_NONE,
    SHEF_ALIGN_AUTO,  /* measured from past pairs; only by kinds that correct */
    SHEF_ALIGN_FIXED, /* the given field */
};

struct shef_matcher_settings {
    int32_t width_px;
    int32_t height_px;
    int32_t max_disparity_px;     /* 1..max is searched, by robust 2..max */
    uint32_t cpu_features;        /* see core/cpu.h; OpenCV picks for itself */
    struct shef_workers *workers; /* NULL: one thread; must outlive the matcher */
    bool dense;                   /* estimates at every pixel, else at frame edges */
    enum shef_align_mode align;
    struct shef_smooth_field alignment; /* for SHEF_ALIGN_FIXED, px */
    bool has_bias;
    struct shef_smooth_field bias; /* subtracted from every estimate, px */
};

/* Where a result goes. Images of the matcher's size. */
struct shef_match_output {
    struct shef_image_f32 disparity;  /* px, 0 = none */
    struct shef_image_f32 confidence; /* P(|error| <= 3 px after the bias); data NULL: not wanted */
    int64_t stage_ns[SHEF_MATCHER_MAX_STAGES];
    struct shef_robust_report report; /* of kinds that correct */
};

struct shef_matcher_kind {
    const char *name;     /* "robust" */
    const char *describe; /* with its parameters, for reports */
    bool has_confidence;
    bool corrects; /* applies alignment and bias itself; else they are applied around it */
    const char *(*stage_name)(int32_t stage); /* NULL past the last one */
    /* Checks the settings and allocates. NULL: err says why. */
    void *(*create)(const struct shef_matcher_settings *settings, struct shef_error *err);
    /* Matches one pair. */
    enum shef_err (*match)(void *state, const struct shef_edge_map *frame,
                           const struct shef_edge_map *event, int64_t number,
                           struct shef_match_output *out, struct shef_error *err);
    /* NULL is allowed. */
    void (*destroy)(void *state);
    /* What create() allocated, bytes; NULL: unknown. */
    size_t (*memory_bytes)(const void *state);
};

/* In the order of SHEF_MATCHER_CHOICES. */
#define SHEF_MATCHER_CHOICES "robust|paper-ds|paper-dp|opencv-stereobm|opencv-stereosgbm"
#define SHEF_N_MATCHERS      5
extern const struct shef_matcher_kind *const shef_matchers[SHEF_N_MATCHERS];

extern const struct shef_matcher_kind shef_matcher_robust;
extern const struct shef_matcher_kind shef_matcher_paper_ds;
extern const struct shef_matcher_kind shef_matcher_paper_dp;
extern const struct shef_matcher_kind shef_matcher_stereobm;
extern const struct shef_matcher_kind shef_matcher_stereosgbm;

/* Moves a map's content down by the field, nearest pixel: out(x, y) = map(x, y - v(x, y)), no edge
 * where that lies outside. Both maps unsigned and of the field's size. */
void shef_edge_map_align(const struct shef_edge_map *map, const struct shef_smooth_field *field,
                         struct shef_edge_map *out);

/* Subtracts a bias field from every estimate; what falls to 0 or below is no estimate. */
void shef_subtract_bias(struct shef_image_f32 disparity, const struct shef_smooth_field *bias);

/* Refuses a search range that the image has no room for. */
SHEF_MUST_CHECK enum shef_err shef_matcher_check(const struct shef_matcher_settings *settings,
                                                 struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
