#include "sheftool/synth.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/memory.h"

#define FRAME_DENSITY     0.28 /* means of the authors' maps */
#define EVENT_DENSITY     0.24
#define SATURATED_DENSITY 0.55  /* their saturated maps have 40 to 74 % */
#define STEP_M            0.005 /* motion between two pairs: 0.27 m/s at 54 fps */
#define CIRCLE_M          0.10
#define FRAME_NOISE       0.02 /* brightness noise of a pixel, peak */
#define EVENT_NOISE       0.04
#define WEAKEST_EDGE      0.12 /* Sobel response that noise does not reach */
#define RANDOM_SHARE      0.02 /* event pixels that fire or fail at random */
#define DROPOUT_CELL_PX   45.0
#define DROPOUT_LEVEL     0.25 /* of the smooth noise: about a tenth of the area */
#define DROPOUT_GAIN      0.3
#define N_STRENGTH_BINS   4096

struct shef_synth {
    struct shef_synth_settings settings;
    struct shef_scenes scenes;
    struct shef_synth_world worlds[SHEF_SYNTH_N_KINDS];
    struct shef_image_u8 frame_edge;
    struct shef_image_u8 event_edge;
    struct shef_image_f32 truth;
    struct shef_image_f32 brightness; /* of the view under way */
    struct shef_image_f32 strength;   /* of its edges */
};

static const char *const kind_names[SHEF_SYNTH_N_KINDS] = { "slanted wall", "boxes", "clutter" };

struct shef_scenes shef_synth_scenes(const struct shef_synth_settings *settings)
{
    struct shef_scenes scenes = { .n = 0 };
    int64_t next = 1;

    for (int kind = 0; kind < SHEF_SYNTH_N_KINDS; kind++) {
        const int64_t end = (int64_t)settings->n_pairs * (kind + 1) / SHEF_SYNTH_N_KINDS;

        if (end < next)
            continue;
        snprintf(scenes.at[scenes.n].name, sizeof scenes.at[0].name, "%s", kind_names[kind]);
        scenes.at[scenes.n].first = next;
        scenes.at[scenes.n].last = end;
        scenes.n++;
        next = end + 1;
    }
    return scenes;
}

struct shef_synth *shef_synth_create(const struct shef_synth_settings *settings,
                                     struct shef_error *err)
{
    struct shef_synth *synth = calloc(1, sizeof *synth);
    const int32_t w = settings->width_px;
    const int32_t h = settings->height_px;

    if (!synth) {
        shef_fail(err, SHEF_ERR_NO_MEMORY, "synthetic pairs: out of memory");
        return NULL;
    }
    synth->settings = *settings;
    synth->scenes = shef_synth_scenes(settings);
    for (int kind = 0; kind < SHEF_SYNTH_N_KINDS; kind++)
        synth->worlds[kind] = shef_synth_world_make((enum shef_synth_kind)kind, settings->seed);
    if (shef_image_create_u8(&synth->frame_edge, w, h, err) != SHEF_OK ||
        shef_image_create_u8(&synth->event_edge, w, h, err) != SHEF_OK ||
        shef_image_create_f32(&synth->truth, w, h, err) != SHEF_OK ||
        shef_image_create_f32(&synth->brightness, w, h, err) != SHEF_OK ||
        shef_image_create_f32(&synth->strength, w, h, err) != SHEF_OK) {
        shef_synth_destroy(synth);
        return NULL;
    }
    return synth;
}

void shef_synth_destroy(struct shef_synth *synth)
{
    if (!synth)
        return;
    shef_image_destroy_u8(&synth->frame_edge);
    shef_image_destroy_u8(&synth->event_edge);
    shef_image_destroy_f32(&synth->truth);
    shef_image_destroy_f32(&synth->brightness);
    shef_image_destroy_f32(&synth->strength);
    free(synth);
}

double shef_synth_residual_px(const struct shef_synth_settings *settings, double x_px, double y_px)
{
    const double x = 2 * x_px / (settings->width_px - 1) - 1;
    const double y = 2 * y_px / (settings->height_px - 1) - 1;

    /* The shape found on the authors' rig, scaled to at most 1. */
    return settings->vertical_residual_px * (0.5 - 0.2 * x + 0.2 * y - 0.1 * x * x);
}

/* One view: where it stands and what it adds to the brightness. */
struct view {
    double from_m[3];
    double noise;
    uint64_t noise_seed;
    bool residual;
    struct shef_image_f32 truth; /* data NULL: not wanted */
};

/* Spreads each pixel over 3 x 3, as a lens does: lines become as thick as the real ones. */
static void blur(struct shef_synth *synth)
{
    const int32_t w = synth->settings.width_px;
    const int32_t h = synth->settings.height_px;
    struct shef_image_f32 spread = synth->strength;

    for (int32_t y = 0; y < h; y++) {
        const float *above = shef_row_f32(synth->brightness, y > 0 ? y - 1 : y);
        const float *here = shef_row_f32(synth->brightness, y);
        const float *below = shef_row_f32(synth->brightness, y < h - 1 ? y + 1 : y);

        for (int32_t x = 0; x < w; x++) {
            const int32_t l = x > 0 ? x - 1 : x;
            const int32_t r = x < w - 1 ? x + 1 : x;

            shef_row_f32(spread, y)[x] = (above[l] + above[x] + above[r] + here[l] + here[x] +
                                          here[r] + below[l] + below[x] + below[r]) /
                                         9;
        }
    }
    synth->strength = synth->brightness;
    synth->brightness = spread;
}

static void render(struct shef_synth *synth, const struct shef_synth_world *world,
                   const struct view *view)
{
    const int32_t w = synth->settings.width_px;
    const int32_t h = synth->settings.height_px;
    const double focal_px = SHEF_SYNTH_FOCAL_PER_WIDTH * w;

    for (int32_t y = 0; y < h; y++)
        for (int32_t x = 0; x < w; x++) {
            const double shift =
                view->residual ? shef_synth_residual_px(&synth->settings, x, y) : 0;
            const double direction[3] = { (x - (w - 1) / 2.0) / focal_px,
                                          (y + shift - (h - 1) / 2.0) / focal_px, 1 };
            const struct shef_synth_hit hit = shef_synth_world_look(world, view->from_m, direction);

            shef_row_f32(synth->brightness, y)[x] =
                (float)(hit.brightness +
                        view->noise * (2 * shef_synth_hash(view->noise_seed, x, y) - 1));
            if (view->truth.data)
                shef_row_f32(view->truth, y)[x] =
                    (float)(focal_px * SHEF_SYNTH_BASELINE_M / hit.depth_m);
        }
    blur(synth);
}

/* Sobel's gradient. */
static void gradient(struct shef_image_f32 image, int32_t x, int32_t y, float out[2])
{
    const float *above = shef_row_f32(image, y > 0 ? y - 1 : y);
    const float *here = shef_row_f32(image, y);
    const float *below = shef_row_f32(image, y < image.height_px - 1 ? y + 1 : y);
    const int32_t l = x > 0 ? x - 1 : x;
    const int32_t r = x < image.width_px - 1 ? x + 1 : x;

    out[0] = above[r] - above[l] + 2 * (here[r] - here[l]) + below[r] - below[l];
    out[1] = below[l] - above[l] + 2 * (below[x] - above[x]) + below[r] - above[r];
}

/* Sets the strongest pixels, `density` of all or as many as are edges at all. */
static void threshold(struct shef_image_f32 strength, double density, float weakest,
                      struct shef_image_u8 out)
{
    int64_t counts[N_STRENGTH_BINS] = { 0 };
    const double n_pixels = (double)strength.width_px * strength.height_px;
    float top = 1e-6f;
    int32_t bin = N_STRENGTH_BINS;
    int64_t n_above = 0;

    for (int32_t y = 0; y < strength.height_px; y++)
        for (int32_t x = 0; x < strength.width_px; x++)
            top = fmaxf(top, shef_row_f32(strength, y)[x]);
    for (int32_t y = 0; y < strength.height_px; y++)
        for (int32_t x = 0; x < strength.width_px; x++)
            counts[(int32_t)(shef_row_f32(strength, y)[x] / top * (N_STRENGTH_BINS - 1))]++;
    while (bin > 1 && (double)n_above < density * n_pixels &&
           (float)bin > weakest / top * (N_STRENGTH_BINS - 1))
        n_above += counts[--bin];
    for (int32_t y = 0; y < strength.height_px; y++)
        for (int32_t x = 0; x < strength.width_px; x++)
            shef_row_u8(out, y)[x] =
                (int32_t)(shef_row_f32(strength, y)[x] / top * (N_STRENGTH_BINS - 1)) >= bin ? 255
                                                                                             : 0;
}

static void make_frame_edges(struct shef_synth *synth)
{
    for (int32_t y = 0; y < synth->settings.height_px; y++)
        for (int32_t x = 0; x < synth->settings.width_px; x++) {
            float slope[2];

            gradient(synth->brightness, x, y, slope);
            shef_row_f32(synth->strength, y)[x] = hypotf(slope[0], slope[1]);
        }
    threshold(synth->strength, FRAME_DENSITY, WEAKEST_EDGE, synth->frame_edge);
}

static void make_event_edges(struct shef_synth *synth, const double motion[2], uint64_t seed,
                             double density, float weakest)
{
    for (int32_t y = 0; y < synth->settings.height_px; y++)
        for (int32_t x = 0; x < synth->settings.width_px; x++) {
            const double patch =
                shef_synth_noise(seed + 1, x / DROPOUT_CELL_PX, y / DROPOUT_CELL_PX);
            float slope[2];
            double strength;

            gradient(synth->brightness, x, y, slope);
            strength = fabs(slope[0] * motion[0] + slope[1] * motion[1]);
            if (patch < DROPOUT_LEVEL)
                strength *= DROPOUT_GAIN;
            shef_row_f32(synth->strength, y)[x] = (float)strength;
        }
    threshold(synth->strength, density, weakest, synth->event_edge);
    for (int32_t y = 0; y < synth->settings.height_px; y++)
        for (int32_t x = 0; x < synth->settings.width_px; x++)
            if (shef_synth_hash(seed + 2, x, y) < RANDOM_SHARE)
                shef_row_u8(synth->event_edge, y)[x] ^= 255;
}

struct shef_synth_pair shef_synth_make(struct shef_synth *synth, int32_t index)
{
    assert(index >= 0 && index < synth->settings.n_pairs);

    const int64_t number = index + 1;
    const int32_t scene = shef_scenes_of(&synth->scenes, number);
    const uint64_t seed = synth->settings.seed * 7919 + (uint64_t)number * 16;
    /* With few pairs a kind may have none, so the scene's own place says nothing of its kind. */
    int kind = 0;

    while ((int64_t)synth->settings.n_pairs * (kind + 1) / SHEF_SYNTH_N_KINDS < number)
        kind++;

    const double angle =
        STEP_M / CIRCLE_M * (double)(number - synth->scenes.at[scene].first) + 2.1 * kind;
    const double motion[2] = { -sin(angle), cos(angle) };
    struct view left = {
        .from_m = { CIRCLE_M * cos(angle), CIRCLE_M * sin(angle), 0 },
        .noise = FRAME_NOISE,
        .noise_seed = seed,
        .truth = synth->truth,
    };
    struct view right = left;
    /* Evenly spread: whenever the share adds up to one more. */
    const bool saturated = floor((double)number * synth->settings.saturated_share) >
                           floor((double)(number - 1) * synth->settings.saturated_share);

    render(synth, &synth->worlds[kind], &left);
    make_frame_edges(synth);
    right.from_m[0] += SHEF_SYNTH_BASELINE_M;
    right.noise = EVENT_NOISE;
    right.noise_seed = seed + 4;
    right.residual = true;
    right.truth.data = NULL;
    render(synth, &synth->worlds[kind], &right);
    /* In a saturated map noise fires like an edge. */
    make_event_edges(synth, motion, seed, saturated ? SATURATED_DENSITY : EVENT_DENSITY,
                     saturated ? 0 : WEAKEST_EDGE);
    return (struct shef_synth_pair){
        .number = number,
        .frame_edge = synth->frame_edge,
        .event_edge = synth->event_edge,
        .truth = synth->truth,
        .saturated = saturated,
    };
}
