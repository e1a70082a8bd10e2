/* The paper's matchers, D_s and D_p, behind the tool's face. */
#include <stddef.h>

#include "pipeline/paper.h"
#include "sheftool/matcher.h"

static void *create(const char *preset, const struct shef_matcher_settings *settings,
                    struct shef_error *err)
{
    struct shef_paper_params params;
    struct shef_paper *paper;

    if (shef_matcher_check(settings, err) != SHEF_OK ||
        shef_paper_preset(preset, &params, err) != SHEF_OK)
        return NULL;
    params.d_max = settings->max_disparity_px;
    params.everywhere = settings->dense;
    if (shef_paper_create(&paper, settings->width_px, settings->height_px, &params,
                          settings->cpu_features, settings->workers, err) != SHEF_OK)
        return NULL;
    return paper;
}

static void *create_ds(const struct shef_matcher_settings *settings, struct shef_error *err)
{
    return create("paper-ds", settings, err);
}

static void *create_dp(const struct shef_matcher_settings *settings, struct shef_error *err)
{
    return create("paper-dp", settings, err);
}

static enum shef_err match(void *state, const struct shef_edge_map *frame,
                           const struct shef_edge_map *event, int64_t number,
                           struct shef_match_output *out, struct shef_error *err)
{
    struct shef_paper_report report;
    const enum shef_err code = shef_paper_match(state, frame, event, out->disparity, &report);

    (void)number;
    if (code != SHEF_OK)
        return shef_fail(err, code, "the paper's matchers take binary edge maps; these are graded");
    for (int i = 0; i < SHEF_PAPER_N_STAGES; i++)
        out->stage_ns[i] = report.stage_ns[i];
    return SHEF_OK;
}

static void destroy(void *state)
{
    shef_paper_destroy(state);
}

static const char *stage_name(int32_t stage)
{
    return stage < SHEF_PAPER_N_STAGES ? shef_paper_stage_name((enum shef_paper_stage)stage) : NULL;
}

static size_t memory_bytes(const void *state)
{
    return shef_paper_bytes(state);
}

const struct shef_matcher_kind shef_matcher_paper_ds = {
    .name = "paper-ds",
    .describe = "window correlation 51 x 51, one level (Wang 2021, eq. 3 and 4)",
    .stage_name = stage_name,
    .create = create_ds,
    .match = match,
    .destroy = destroy,
    .memory_bytes = memory_bytes,
};

const struct shef_matcher_kind shef_matcher_paper_dp = {
    .name = "paper-dp",
    .describe = "window correlation 121 x 121, 5 levels of scale 0.9 (Wang 2021, eq. 5)",
    .stage_name = stage_name,
    .create = create_dp,
    .match = match,
    .destroy = destroy,
    .memory_bytes = memory_bytes,
};
