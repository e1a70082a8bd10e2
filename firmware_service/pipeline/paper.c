#include "pipeline/paper.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/clock.h"
#include "core/memory.h"
#include "pipeline/kernels/bin_corr.h"
#include "pipeline/paper_shrink.h"

#define MERGE_ROWS 32 /* rows of a level that one task merges */

struct level {
    int32_t width_px;
    int32_t height_px;
    struct shef_bin_corr *corr;
    struct shef_image_i16 disparity; /* of this level alone */
    struct shef_image_i16 sum;
    /* Unused on the finest level, which has the caller's. */
    struct shef_paper_shrink *shrink;
    struct shef_edge_map left;
    struct shef_edge_map right;
    struct shef_image_f32 estimate; /* merged with all coarser levels */
    /* Unused on the coarsest level. */
    int32_t *coarse_x; /* the coarser level's column under each of this level's */
};

struct shef_paper {
    /* Set by create, then read-only. */
    struct shef_paper_params params;
    struct shef_workers *workers;
    struct level levels[SHEF_PAPER_MAX_LEVELS]; /* finest first */
    size_t bytes;
    /* Of the current match. */
    struct shef_edge_map left[SHEF_PAPER_MAX_LEVELS];
    struct shef_edge_map right[SHEF_PAPER_MAX_LEVELS];
    struct shef_image_f32 estimate[SHEF_PAPER_MAX_LEVELS];
    int32_t merging; /* level */
};

static const struct {
    const char *name;
    struct shef_paper_params params;
} presets[] = {
    { "paper-ds", { 1, 0.9, 51, 1, 80, false } },
    { "paper-dp", { 5, 0.9, 121, 1, 80, false } }, /* 5 levels of 0.9: Wang 2021, section IV */
};

enum shef_err shef_paper_preset(const char *name, struct shef_paper_params *out_params,
                                struct shef_error *err)
{
    for (size_t i = 0; i < sizeof presets / sizeof presets[0]; i++)
        if (strcmp(name, presets[i].name) == 0) {
            *out_params = presets[i].params;
            return SHEF_OK;
        }
    return shef_fail(err, SHEF_ERR_NOT_FOUND,
                     "no matcher preset '%s': there are paper-ds and paper-dp", name);
}

static enum shef_err check_params(const struct shef_paper_params *p, int32_t width_px,
                                  struct shef_error *err)
{
    if (p->n_levels < 1 || p->n_levels > SHEF_PAPER_MAX_LEVELS)
        return shef_fail(err, SHEF_ERR_INVALID, "pyramid of %d levels: there must be 1 to %d",
                         p->n_levels, SHEF_PAPER_MAX_LEVELS);
    if (p->n_levels > 1 && !(p->scale >= 0.5 && p->scale <= 0.99))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "pyramid scale %g: it must lie between 0.5 and 0.99", p->scale);
    if (p->d_min < 1)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "smallest disparity %d px: it must be at least 1, as 0 means none",
                         p->d_min);
    if (p->d_max >= width_px)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "largest disparity %d px: it must be smaller than the image, which is "
                         "%d px wide",
                         p->d_max, width_px);
    return SHEF_OK;
}

static int32_t scaled(int32_t n, double scale)
{
    const int32_t rounded = (int32_t)lround(n * scale);

    return rounded < 1 ? 1 : rounded;
}

/* The odd number next to n times scale. */
static int32_t scaled_window(int32_t n, double scale)
{
    return 2 * (int32_t)(n * scale / 2) + 1;
}

static enum shef_err create_coarse(struct shef_paper *paper, struct level *level,
                                   struct shef_error *err)
{
    const struct level *finest = &paper->levels[0];
    enum shef_err code =
        shef_paper_shrink_create(&level->shrink, finest->width_px, finest->height_px,
                                 level->width_px, level->height_px, err);

    if (code == SHEF_OK)
        code = shef_edge_map_create(&level->left, SHEF_EDGE_TERNARY, level->width_px,
                                    level->height_px, err);
    if (code == SHEF_OK)
        code = shef_edge_map_create(&level->right, SHEF_EDGE_TERNARY, level->width_px,
                                    level->height_px, err);
    if (code == SHEF_OK)
        code = shef_image_create_f32(&level->estimate, level->width_px, level->height_px, err);
    if (code != SHEF_OK)
        return code;
    paper->bytes += shef_paper_shrink_bytes(level->shrink);
    paper->bytes += 4 * (size_t)level->height_px * (size_t)level->left.stride_words * 8;
    paper->bytes += (size_t)level->height_px * (size_t)level->estimate.stride_bytes;
    return SHEF_OK;
}

static enum shef_err create_level(struct shef_paper *paper, int32_t k, uint32_t cpu_features,
                                  struct shef_error *err)
{
    const struct shef_paper_params *p = &paper->params;
    const double scale = k > 0 ? pow(p->scale, k) : 1;
    struct level *level = &paper->levels[k];

    level->width_px = k > 0 ? scaled(paper->levels[0].width_px, scale) : level->width_px;
    level->height_px = k > 0 ? scaled(paper->levels[0].height_px, scale) : level->height_px;

    const struct shef_bin_corr_params corr_params = {
        .width_px = level->width_px,
        .height_px = level->height_px,
        .window_px = k > 0 ? scaled_window(p->window_px, scale) : p->window_px,
        .d_min = scaled(p->d_min, scale),
        .d_max = scaled(p->d_max, scale),
        .everywhere = p->everywhere,
    };
    enum shef_err code = shef_bin_corr_create(&level->corr, &corr_params, cpu_features,
                                              shef_workers_count(paper->workers), err);

    if (code == SHEF_OK)
        code = shef_image_create_i16(&level->disparity, level->width_px, level->height_px, err);
    if (code == SHEF_OK)
        code = shef_image_create_i16(&level->sum, level->width_px, level->height_px, err);
    if (code != SHEF_OK)
        return code;
    paper->bytes += shef_bin_corr_bytes(level->corr);
    paper->bytes += 2 * (size_t)level->height_px * (size_t)level->sum.stride_bytes;

    if (k > 0) {
        struct level *finer = &paper->levels[k - 1];
        const size_t n = (size_t)finer->width_px;

        finer->coarse_x = shef_memory_create(n, sizeof *finer->coarse_x);
        if (!finer->coarse_x)
            return shef_fail(err, SHEF_ERR_NO_MEMORY, "pyramid level %d: out of memory", k);
        for (int32_t x = 0; x < finer->width_px; x++)
            finer->coarse_x[x] = shef_paper_source_of(x, level->width_px, finer->width_px);
        paper->bytes += shef_memory_round_up(n * sizeof *finer->coarse_x);
        return create_coarse(paper, level, err);
    }
    return SHEF_OK;
}

enum shef_err shef_paper_create(struct shef_paper **out_paper, int32_t width_px, int32_t height_px,
                                const struct shef_paper_params *params, uint32_t cpu_features,
                                struct shef_workers *workers, struct shef_error *err)
{
    enum shef_err code = check_params(params, width_px, err);

    if (code != SHEF_OK)
        return code;

    struct shef_paper *paper = calloc(1, sizeof *paper);

    if (!paper)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "paper matcher: out of memory");
    paper->params = *params;
    paper->workers = workers;
    paper->bytes = sizeof *paper;
    paper->levels[0].width_px = width_px;
    paper->levels[0].height_px = height_px;
    for (int32_t k = 0; k < params->n_levels; k++) {
        code = create_level(paper, k, cpu_features, err);
        if (code != SHEF_OK) {
            shef_paper_destroy(paper);
            return code;
        }
    }
    *out_paper = paper;
    return SHEF_OK;
}

void shef_paper_destroy(struct shef_paper *paper)
{
    if (!paper)
        return;
    for (int32_t k = 0; k < SHEF_PAPER_MAX_LEVELS; k++) {
        struct level *level = &paper->levels[k];

        shef_bin_corr_destroy(level->corr);
        shef_image_destroy_i16(&level->disparity);
        shef_image_destroy_i16(&level->sum);
        shef_paper_shrink_destroy(level->shrink);
        shef_edge_map_destroy(&level->left);
        shef_edge_map_destroy(&level->right);
        shef_image_destroy_f32(&level->estimate);
        free(level->coarse_x);
    }
    free(paper);
}

const char *shef_paper_isa(const struct shef_paper *paper)
{
    return shef_bin_corr_isa(paper->levels[0].corr);
}

const char *shef_paper_stage_name(enum shef_paper_stage stage)
{
    static const char *const names[SHEF_PAPER_N_STAGES] = { "shrink", "correlate", "merge" };

    return names[stage];
}

size_t shef_paper_bytes(const struct shef_paper *paper)
{
    return paper->bytes;
}

/* Even tasks shrink the left map, odd ones the right, to level 1 + task / 2. */
static void shrink_task(void *context, int32_t task, int32_t worker)
{
    struct shef_paper *paper = context;
    const int32_t k = 1 + task / 2;
    struct shef_edge_map *maps = task % 2 == 0 ? paper->left : paper->right;

    (void)worker;
    shef_paper_shrink_run(paper->levels[k].shrink, &maps[0], &maps[k]);
}

/* One row of eq. 5. On entry row holds the coarser level's pixels, on return the merged ones.
 *   enlarge     what the coarser level's disparities are multiplied with
 *   edges_only  drops pixels that the level did not read out itself */
static void merge_row(const int16_t *disparity, const int16_t *sum, int32_t width_px, float enlarge,
                      bool edges_only, float *row)
{
    const int32_t drops = edges_only;

    /* Without branches, so that the compiler vectorises: the edges make them unpredictable. */
    for (int32_t x = 0; x < width_px; x++) {
        const int32_t own = disparity[x] & -(sum[x] > 0);
        const int32_t n_estimates = (own > 0) + (row[x] > 0);
        const int32_t is_kept = 1 - (drops & (disparity[x] == SHEF_BIN_CORR_NONE));
        const float total = (float)own + enlarge * row[x];

        row[x] = total * (1.5f - 0.5f * (float)n_estimates) * (float)is_kept; /* of none, 0 */
    }
}

static void merge_task(void *context, int32_t task, int32_t worker)
{
    const struct shef_paper *paper = context;
    const int32_t k = paper->merging;
    const struct level *level = &paper->levels[k];
    const bool is_coarsest = k == paper->params.n_levels - 1;
    const float enlarge = (float)(1 / paper->params.scale);
    const int32_t begin = task * MERGE_ROWS;
    const int32_t end =
        begin + MERGE_ROWS < level->height_px ? begin + MERGE_ROWS : level->height_px;

    (void)worker;
    for (int32_t y = begin; y < end; y++) {
        float *row = shef_row_f32(paper->estimate[k], y);

        if (is_coarsest) {
            memset(row, 0, (size_t)level->width_px * sizeof *row);
        } else {
            const struct level *coarser = level + 1;
            const float *coarse_row =
                shef_row_f32(paper->estimate[k + 1],
                             shef_paper_source_of(y, coarser->height_px, level->height_px));

            for (int32_t x = 0; x < level->width_px; x++)
                row[x] = coarse_row[level->coarse_x[x]];
        }
        merge_row(shef_row_i16(level->disparity, y), shef_row_i16(level->sum, y), level->width_px,
                  enlarge, k == 0, row);
    }
}

/* Points the current match at the caller's maps and at the levels' own. */
static void set_maps(struct shef_paper *paper, const struct shef_edge_map *left,
                     const struct shef_edge_map *right, struct shef_image_f32 out_disparity)
{
    paper->left[0] = *left;
    paper->right[0] = *right;
    paper->estimate[0] = out_disparity;
    for (int32_t k = 1; k < paper->params.n_levels; k++) {
        paper->left[k] = paper->levels[k].left;
        paper->right[k] = paper->levels[k].right;
        paper->estimate[k] = paper->levels[k].estimate;
        if (left->kind == SHEF_EDGE_UNSIGNED) {
            paper->left[k].kind = SHEF_EDGE_UNSIGNED;
            paper->left[k].minus = NULL;
        }
        if (right->kind == SHEF_EDGE_UNSIGNED) {
            paper->right[k].kind = SHEF_EDGE_UNSIGNED;
            paper->right[k].minus = NULL;
        }
    }
}

static int64_t now_ns(void)
{
    return shef_clock_now(shef_clock_monotonic()).ns;
}

/* Adds the time since *last_ns to a stage and starts the next one. */
static void end_stage(struct shef_paper_report *report, enum shef_paper_stage stage,
                      int64_t *last_ns)
{
    const int64_t ns = now_ns();

    report->stage_ns[stage] += ns - *last_ns;
    *last_ns = ns;
}

enum shef_err shef_paper_match(struct shef_paper *paper, const struct shef_edge_map *left,
                               const struct shef_edge_map *right,
                               struct shef_image_f32 out_disparity,
                               struct shef_paper_report *report)
{
    const struct level *finest = &paper->levels[0];
    const int32_t n_levels = paper->params.n_levels;
    struct shef_paper_report times = { 0 };
    int64_t last_ns = now_ns();

    assert(left->width_px == finest->width_px && left->height_px == finest->height_px);
    assert(right->width_px == finest->width_px && right->height_px == finest->height_px);
    assert(out_disparity.width_px == finest->width_px);
    assert(out_disparity.height_px == finest->height_px);
    if (left->kind == SHEF_EDGE_GRADED || right->kind == SHEF_EDGE_GRADED)
        return SHEF_ERR_UNSUPPORTED;

    set_maps(paper, left, right, out_disparity);
    shef_workers_run(paper->workers, shrink_task, paper, 2 * (n_levels - 1));
    end_stage(&times, SHEF_PAPER_SHRINK, &last_ns);
    for (int32_t k = n_levels - 1; k >= 0; k--) {
        const struct level *level = &paper->levels[k];

        shef_bin_corr_run(level->corr, &paper->left[k], &paper->right[k], paper->workers,
                          level->disparity, level->sum);
        end_stage(&times, SHEF_PAPER_CORRELATE, &last_ns);
        paper->merging = k;
        shef_workers_run(paper->workers, merge_task, paper,
                         (level->height_px + MERGE_ROWS - 1) / MERGE_ROWS);
        end_stage(&times, SHEF_PAPER_MERGE, &last_ns);
    }
    if (report)
        *report = times;
    return SHEF_OK;
}
