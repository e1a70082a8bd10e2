/* The robust matcher behind the tool's face. */
#include <stdlib.h>

#include "core/memory.h"
#include "sheftool/matcher.h"

struct robust {
    struct shef_robust *matcher;
    bool dense;
    /* The edge maps that a dense run does not want. */
    struct shef_image_f32 sparse_disparity;
    struct shef_image_f32 sparse_confidence;
};

static void destroy(void *state)
{
    struct robust *robust = state;

    if (!robust)
        return;
    shef_robust_destroy(robust->matcher);
    shef_image_destroy_f32(&robust->sparse_disparity);
    shef_image_destroy_f32(&robust->sparse_confidence);
    free(robust);
}

static enum shef_err create_sparse(struct robust *robust, int32_t width_px, int32_t height_px,
                                   struct shef_error *err)
{
    const enum shef_err code =
        shef_image_create_f32(&robust->sparse_disparity, width_px, height_px, err);

    if (code != SHEF_OK)
        return code;
    return shef_image_create_f32(&robust->sparse_confidence, width_px, height_px, err);
}

static void *create(const struct shef_matcher_settings *settings, struct shef_error *err)
{
    struct shef_robust_params params =
        shef_robust_defaults(settings->width_px, settings->height_px, SHEF_EDGE_UNSIGNED);
    struct robust *robust;

    if (shef_matcher_check(settings, err) != SHEF_OK)
        return NULL;
    robust = calloc(1, sizeof *robust);
    if (!robust) {
        shef_fail(err, SHEF_ERR_NO_MEMORY, "robust matcher: out of memory");
        return NULL;
    }
    params.max_disparity_px = settings->max_disparity_px;
    robust->dense = settings->dense;
    robust->matcher = shef_robust_create(&params, settings->cpu_features, settings->workers, err);
    if (!robust->matcher || (robust->dense && create_sparse(robust, settings->width_px,
                                                            settings->height_px, err) != SHEF_OK)) {
        destroy(robust);
        return NULL;
    }
    if (settings->align == SHEF_ALIGN_AUTO)
        shef_robust_align_auto(robust->matcher);
    else
        shef_robust_align_fixed(robust->matcher,
                                settings->align == SHEF_ALIGN_FIXED ? &settings->alignment : NULL);
    shef_robust_set_bias(robust->matcher, settings->has_bias ? &settings->bias : NULL);
    return robust;
}

static enum shef_err match(void *state, const struct shef_edge_map *frame,
                           const struct shef_edge_map *event, int64_t number,
                           struct shef_match_output *out, struct shef_error *err)
{
    struct robust *robust = state;
    const struct shef_edge_pair pair = { frame, event };
    const struct shef_robust_output output = {
        .disparity = robust->dense ? robust->sparse_disparity : out->disparity,
        .confidence = robust->dense ? robust->sparse_confidence : out->confidence,
        .dense_disparity = robust->dense ? out->disparity : (struct shef_image_f32){ 0 },
        .dense_confidence = robust->dense ? out->confidence : (struct shef_image_f32){ 0 },
    };

    (void)err;
    shef_robust_match(robust->matcher, &pair, 1, number, &output, &out->report);
    for (int i = 0; i < SHEF_ROBUST_N_STAGES; i++)
        out->stage_ns[i] = out->report.stage_ns[i];
    return SHEF_OK;
}

static const char *stage_name(int32_t stage)
{
    return stage < SHEF_ROBUST_N_STAGES ? shef_robust_stage_name((enum shef_robust_stage)stage)
                                        : NULL;
}

static size_t memory_bytes(const void *state)
{
    const struct robust *robust = state;

    return shef_robust_memory_bytes(robust->matcher);
}

const struct shef_matcher_kind shef_matcher_robust = {
    .name = "robust",
    .describe = "normalised window correlation on the half grid, carried over from pair to pair, "
                "aggregated along 4 paths",
    .has_confidence = true,
    .corrects = true,
    .stage_name = stage_name,
    .create = create,
    .match = match,
    .destroy = destroy,
    .memory_bytes = memory_bytes,
};
