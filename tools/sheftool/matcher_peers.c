/* OpenCV's matchers behind the tool's face, with the settings that suit edge maps best. */
#include <stdlib.h>

#include "sheftool/matcher.h"
#include "sheftool/matcher_opencv.h"
#include "sheftool/stopwatch.h"

struct peer {
    struct shef_opencv *opencv;
    bool dense;
};

static void *create(const struct shef_matcher_settings *settings,
                    const struct shef_opencv_params *params, struct shef_error *err)
{
    struct shef_opencv_params sized = *params;
    struct peer *peer;

    if (shef_matcher_check(settings, err) != SHEF_OK)
        return NULL;
    peer = calloc(1, sizeof *peer);
    if (!peer) {
        shef_fail(err, SHEF_ERR_NO_MEMORY, "OpenCV matcher: out of memory");
        return NULL;
    }
    sized.width_px = settings->width_px;
    sized.height_px = settings->height_px;
    sized.max_disparity_px = settings->max_disparity_px;
    peer->dense = settings->dense;
    peer->opencv = shef_opencv_create(&sized, err);
    if (!peer->opencv) {
        free(peer);
        return NULL;
    }
    return peer;
}

/* Tuned on the given pairs for edge maps. The default uniqueness ratio keeps 12 % of the edges of
 * StereoBM, 0 keeps 73 %; without the blur one in four of those is bad. */
static void *create_bm(const struct shef_matcher_settings *settings, struct shef_error *err)
{
    const struct shef_opencv_params params = {
        .block_px = 61,
        .blur_px = 1.5,
        .keep_ambiguous = true,
    };

    return create(settings, &params, err);
}

/* Tuned the same way: the manual's penalties (8 and 32 at block 5) keep 30 % of the edges and a
 * third of those is bad; these keep 86 % and 15 %. */
static void *create_sgbm(const struct shef_matcher_settings *settings, struct shef_error *err)
{
    const struct shef_opencv_params params = {
        .block_px = 7,
        .semi_global = true,
        .p1 = 24,
        .p2 = 400,
    };

    return create(settings, &params, err);
}

static enum shef_err match(void *state, const struct shef_edge_map *frame,
                           const struct shef_edge_map *event, int64_t number,
                           struct shef_match_output *out, struct shef_error *err)
{
    struct peer *peer = state;
    const int64_t start_ns = shef_monotonic_ns();
    enum shef_err code = shef_opencv_prepare(peer->opencv, frame, event, err);
    const int64_t prepared_ns = shef_monotonic_ns();

    (void)number;
    if (code == SHEF_OK)
        code = shef_opencv_match(peer->opencv, err);
    if (code != SHEF_OK)
        return code;
    shef_opencv_read(peer->opencv, peer->dense ? NULL : frame, out->disparity);
    out->stage_ns[0] = prepared_ns - start_ns;
    out->stage_ns[1] = shef_monotonic_ns() - prepared_ns;
    return SHEF_OK;
}

static void destroy(void *state)
{
    struct peer *peer = state;

    if (peer)
        shef_opencv_destroy(peer->opencv);
    free(peer);
}

static const char *stage_name(int32_t stage)
{
    static const char *const names[] = { "prepare", "match" };

    return stage < 2 ? names[stage] : NULL;
}

const struct shef_matcher_kind shef_matcher_stereobm = {
    .name = "opencv-stereobm",
    .describe = "OpenCV StereoBM, block 61, maps blurred with sigma 1.5 px, uniqueness ratio 0",
    .stage_name = stage_name,
    .create = create_bm,
    .match = match,
    .destroy = destroy,
};

const struct shef_matcher_kind shef_matcher_stereosgbm = {
    .name = "opencv-stereosgbm",
    .describe = "OpenCV StereoSGBM, block 7, 5 paths, P1 and P2 24 and 400 times the block area",
    .stage_name = stage_name,
    .create = create_sgbm,
    .match = match,
    .destroy = destroy,
};
