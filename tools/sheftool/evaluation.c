#include "sheftool/evaluation.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/cpu.h"

enum shef_err shef_evaluation_create(struct shef_evaluation *out_evaluation,
                                     const struct shef_evaluation_settings *settings,
                                     const struct shef_scenes *scenes, struct shef_error *err)
{
    const size_t n = (size_t)scenes->n + 1;
    struct shef_evaluation evaluation = {
        .protocol = &shef_protocols[settings->protocol],
        .rules = settings->rules,
        .filter = settings->filter,
        .has_edges = settings->has_edges,
        .scenes = scenes,
        .tallies = calloc(n, sizeof *evaluation.tallies),
        .curves = calloc(n, sizeof *evaluation.curves),
        .depths = calloc(n, sizeof *evaluation.depths),
    };

    assert(settings->has_edges || !evaluation.protocol->needs_edges);
    if (!evaluation.tallies || !evaluation.curves || !evaluation.depths) {
        shef_evaluation_destroy(&evaluation);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "evaluation: out of memory");
    }
    for (size_t i = 0; i < n; i++)
        evaluation.tallies[i].depth = &evaluation.depths[i];
    *out_evaluation = evaluation;
    return SHEF_OK;
}

void shef_evaluation_destroy(struct shef_evaluation *evaluation)
{
    free(evaluation->tallies);
    free(evaluation->curves);
    free(evaluation->depths);
    shef_outlier_authors_destroy(evaluation->outliers);
    shef_timings_free(&evaluation->filter_times);
    shef_image_destroy_f32(&evaluation->filtered);
    *evaluation = (struct shef_evaluation){ 0 };
}

static enum shef_err prepare_filter(struct shef_evaluation *evaluation, int32_t width_px,
                                    int32_t height_px, struct shef_error *err)
{
    if (evaluation->filtered.width_px == width_px && evaluation->filtered.height_px == height_px)
        return SHEF_OK;
    shef_image_destroy_f32(&evaluation->filtered);
    shef_outlier_authors_destroy(evaluation->outliers);
    evaluation->outliers = NULL;

    enum shef_err code =
        shef_outlier_authors_create(&evaluation->outliers, width_px, height_px,
                                    SHEF_OUTLIER_AUTHORS_RADIUS_FIRST_PX, shef_cpu_features(), err);

    if (code == SHEF_OK)
        code = shef_image_create_f32(&evaluation->filtered, width_px, height_px, err);
    return code;
}

/* The authors filter once when they match and once more when they evaluate. */
static enum shef_err filter_copy(struct shef_evaluation *evaluation, struct shef_image_f32 map,
                                 struct shef_error *err)
{
    enum shef_err code = prepare_filter(evaluation, map.width_px, map.height_px, err);

    if (code != SHEF_OK)
        return code;

    const int64_t start_ns = shef_monotonic_ns();

    shef_outlier_authors_run(evaluation->outliers, map, SHEF_OUTLIER_AUTHORS_RADIUS_FIRST_PX,
                             evaluation->filtered);
    code = shef_timings_add(&evaluation->filter_times, shef_monotonic_ns() - start_ns);
    shef_outlier_authors_run(evaluation->outliers, evaluation->filtered,
                             SHEF_OUTLIER_AUTHORS_RADIUS_SECOND_PX, evaluation->filtered);
    return code == SHEF_OK ? SHEF_OK : shef_fail(err, code, "timings: out of memory");
}

enum shef_err shef_evaluation_add(struct shef_evaluation *evaluation, int64_t number,
                                  const struct shef_scored_map *map,
                                  struct shef_image_f32 *out_scored, struct shef_error *err)
{
    const int32_t scene = shef_scenes_of(evaluation->scenes, number);
    struct shef_scored_map scored = *map;

    assert(!evaluation->has_edges || map->frame_edges);
    if (map->disparity.width_px < SHEF_MIN_SCORED_WIDTH)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "maps of %d px width cannot be scored: columns %d to width - %d count, "
                         "so the width must be at least %d",
                         map->disparity.width_px, SHEF_FIRST_COLUMN, SHEF_LAST_MARGIN_PX,
                         SHEF_MIN_SCORED_WIDTH);
    if (evaluation->filter) {
        const enum shef_err code = filter_copy(evaluation, map->disparity, err);

        if (code != SHEF_OK)
            return code;
        scored.disparity = evaluation->filtered;
    }
    evaluation->protocol->add(&evaluation->tallies[scene], &scored, &evaluation->rules);
    /* The curve is about the map as its maker left it. */
    if (evaluation->has_edges &&
        shef_density_curve_add(&evaluation->curves[scene], map, &evaluation->rules) != SHEF_OK)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "density curve: out of memory");
    if (out_scored)
        *out_scored = scored.disparity;
    return SHEF_OK;
}

void shef_evaluation_sum_up(struct shef_evaluation *evaluation)
{
    const int32_t all = evaluation->scenes->n;
    struct shef_tally *tally = &evaluation->tallies[all];
    struct shef_density_curve *curve = &evaluation->curves[all];

    memset(&evaluation->depths[all], 0, sizeof evaluation->depths[all]);
    *tally = (struct shef_tally){ .depth = &evaluation->depths[all] };
    *curve = (struct shef_density_curve){ .ranked = true };
    for (int32_t i = 0; i < all; i++) {
        shef_tally_merge(tally, &evaluation->tallies[i]);
        for (int level = 0; level < SHEF_N_LEVELS; level++)
            shef_tally_merge(&curve->level[level], &evaluation->curves[i].level[level]);
        curve->ranked = curve->ranked && evaluation->curves[i].ranked;
    }
}

struct shef_figures shef_evaluation_overall(struct shef_evaluation *evaluation)
{
    shef_evaluation_sum_up(evaluation);
    return shef_tally_figures(&evaluation->tallies[evaluation->scenes->n]);
}
