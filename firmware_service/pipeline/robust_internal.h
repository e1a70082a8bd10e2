/* The robust matcher's memory and the stages that share it; only robust*.c include this.
 *
 *   robust_prepare.c    edge maps -> pair rows of both views, aligned
 *   robust_correlate.c  pair rows -> cost volume, horizontal path sums
 *   robust_aggregate.c  + vertical paths -> winner, disparity and margin per cell
 *   robust_readout.c    cells -> confidence, pixels
 *   robust_jumps.c      pixels -> outlines at jumps of depth put right
 *   robust_create.c     parameters -> sizes, fixed-point scales, memory
 *   robust.c            the order of the stages, what one pair leaves to the next */
#ifndef SHEF_PIPELINE_ROBUST_INTERNAL_H
#define SHEF_PIPELINE_ROBUST_INTERNAL_H

#include "pipeline/kernels/match.h"
#include "pipeline/kernels/rows.h"
#include "pipeline/robust.h"

#define PATH_ROWS    8                     /* grid rows whose horizontal paths run in step */
#define STRIP_CELLS  SHEF_MATCH_PATH_CELLS /* cells whose vertical paths run in step */
#define THUMBNAIL_PX 16                    /* side of a thumbnail's block */

/* Sizes that follow from the parameters. */
struct robust_shape {
    int32_t grid_width; /* cells */
    int32_t grid_height;
    int32_t half_width; /* of the window, cells */
    int32_t half_height;
    int32_t n_levels;
    int32_t n_lanes;
    int32_t pairs_per_cell; /* right pairs from one cell to the next: 2 / step_px */
    int32_t right_front;    /* right pairs before the one that cell 0, level 0 reads */
    int32_t right_length;   /* right pairs in a row, padding included */
    int32_t left_length;    /* left pairs in a row: grid_width + half_width */
    int32_t amplitude;      /* edge values run from -amplitude to amplitude in the pairs */
    int32_t offset;         /* added to left values: amplitude for signed kinds, else 0 */
    int32_t window_px;      /* pixels in a whole window */
    double smallest_sigma;  /* square root of the regularisation, in value * sqrt(pixels) */
    struct shef_match_scale scale;
};

/* One edge map pair in the form the kernels read. */
struct robust_view {
    struct shef_image_i8 left;    /* edge values, grid_height * 2 rows */
    struct shef_image_i8 right;   /* not aligned */
    struct shef_image_i8 aligned; /* the same, aligned; only where outlines are put right */
    uint16_t *left_pairs;         /* 2 * grid_height rows of left_length */
    uint16_t *right_pairs;        /* 2 * grid_height rows of right_length */
};

/* Sums of the values and of their squares: over the window's rows, then over the whole window.
 * Unsigned values are their own squares: both pointers are the same. */
struct robust_sums {
    int16_t *column_sum;
    int16_t *column_square;
    int32_t *window_sum;
    int32_t *window_square;
};

/* Memory of one chunk of grid rows, used by one worker at a time. */
struct robust_chunk {
    int16_t *columns;         /* (left_length + half_width + 1) * n_lanes */
    struct robust_sums left;  /* per cell */
    struct robust_sums right; /* per right pair */
    int16_t *left_mean;
    int16_t *left_gain;
    int16_t *right_scaled; /* window sums in the kernels' scale, per right pair */
    int16_t *right_gain;
    int16_t *weight; /* prior weights of the row */
    int8_t *aligned_memory;
    int8_t *aligned; /* prepare: a right row after alignment, zeros around it */
    struct shef_cell_row cells[3];
    float *cell_memory;
    int16_t *low; /* disparity extremes of three cell rows */
    int16_t *high;
    float *side_disparity[2]; /* left and right pixels of a cell row, px */
    float *side_confidence[2];
    float *pixel_disparity; /* one pixel row, px */
    float *pixel_confidence;
    float *bias;
    uint16_t *paths[2];   /* path costs of cells in step, ping-pong */
    uint16_t *strip_sums; /* grid_height * STRIP_CELLS * n_lanes */
    struct shef_match_best best[STRIP_CELLS];
};

/* The confidence's logit is a sum of three table entries; see robust_readout.c. */
struct robust_confidence_tables {
    float margin[4096];     /* by margin / 16 */
    float texture[256];     /* by texture */
    float spread[256];      /* by disparity spread in 1/4 px, the last for anything more */
    float probability[512]; /* by (logit + 8) * 32 */
};

/* What the next pair may use of this one. Two of them, swapped after each pair. */
struct robust_grid {
    struct shef_image_i16 disparity; /* 1/32 px */
    struct shef_image_u16 margin;    /* cost */
    struct shef_image_u8 texture;    /* mean square of left values in the window, 255 = 1 */
    struct shef_image_i16 expected;  /* disparity in 1/16 px, as the kernels take it */
    struct shef_image_i16 trust;     /* margin / PRIOR_FULL_MARGIN, Q15, at most 1 */
    struct shef_image_u16 thumbnail; /* edge strength of the left view in blocks */
};

enum align_mode { ALIGN_FIXED, ALIGN_AUTO };

struct shef_robust {
    /* Set by create, then read-only. */
    struct shef_robust_params params;
    struct robust_shape shape;
    const struct shef_match_kernels *kernels;
    const struct shef_row_kernels *rows;
    struct shef_workers *workers;
    int32_t n_chunks;
    struct robust_chunk *chunks; /* n_chunks */
    uint16_t *zero_left;         /* a row of left pairs without edges: every byte is offset */
    uint16_t *zero_right;        /* the same of right pairs: zeros */
    uint16_t *costs;             /* grid_height * grid_width * n_lanes */
    uint16_t *sums;              /* the same shape */
    size_t volume_lanes;         /* of each of the two */
    bool has_lent_volumes;       /* they are another matcher's */
    struct robust_confidence_tables *tables;
    struct robust_view views[2];
    struct shef_image_f32 cell_confidence; /* 0..1 */
    size_t memory_bytes;

    /* State between pairs. */
    struct robust_grid grids[2];
    int32_t current; /* which grid this pair writes */
    bool has_past;
    int64_t past_number;
    enum align_mode align_mode;
    struct shef_align align;
    bool is_align_started;              /* a first field was measured, or could not be */
    struct shef_smooth_field alignment; /* applied to this pair */
    bool has_alignment;
    double alignment_spread_px;
    struct shef_smooth_field bias;
    bool has_bias;

    /* The pair being matched; written before its tasks start. */
    const struct shef_edge_pair *pairs;
    int32_t n_pairs;
    int32_t view; /* which of the pairs a stage works on */
    bool uses_past;
    double prior_cost_per_px;
    const struct shef_robust_output *output;
    struct shef_image_f32 raw_disparity;    /* of every pixel before outlines are put right */
    struct shef_image_f32 pixel_disparity;  /* after; data NULL: pixels go by rows of the chunks */
    struct shef_image_f32 pixel_confidence; /* likewise */
};

/* Fills shape and the table scales from checked parameters. */
void robust_shape_init(struct robust_shape *shape, const struct shef_robust_params *params);

/* Sets how many levels are searched, and the lanes that takes. */
void robust_shape_set_levels(struct robust_shape *shape, int32_t n_levels);

/* Each stage is a task function over chunks 0..n_chunks-1 (aggregate: strips). */
void robust_bytes_task(void *matcher, int32_t chunk, int32_t worker);
void robust_pairs_task(void *matcher, int32_t chunk, int32_t worker);
void robust_correlate_task(void *matcher, int32_t chunk, int32_t worker);
void robust_aggregate_task(void *matcher, int32_t strip, int32_t worker);
int32_t robust_n_strips(const struct shef_robust *matcher);
void robust_confidence_task(void *matcher, int32_t chunk, int32_t worker);
void robust_pixels_task(void *matcher, int32_t chunk, int32_t worker);

/* Decides where pixels are read out to. */
void robust_begin_read_out(struct shef_robust *matcher);

/* Outlines at jumps of depth: each row after it is read out, all columns after all rows; in the end
 * what pixels_task does itself where outlines stay. */
void robust_settle_row(struct shef_robust *matcher, int32_t y);
void robust_settle_columns_task(void *matcher, int32_t task, int32_t worker);
int32_t robust_n_column_tasks(const struct shef_robust *matcher);
void robust_finish_task(void *matcher, int32_t chunk, int32_t worker);

void robust_confidence_init(struct robust_confidence_tables *tables,
                            const struct shef_robust_params *params);

/* The grid rows of a chunk: [first, last). */
static inline void robust_chunk_rows(const struct shef_robust *matcher, int32_t chunk,
                                     int32_t *out_first, int32_t *out_last)
{
    *out_first = (int32_t)((int64_t)chunk * matcher->shape.grid_height / matcher->n_chunks);
    *out_last = (int32_t)((int64_t)(chunk + 1) * matcher->shape.grid_height / matcher->n_chunks);
}

#endif
