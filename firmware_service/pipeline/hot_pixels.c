#include "pipeline/hot_pixels.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"

#define SAMPLE_EVERY 8u
#define GROUP        4u   /* pixels looked at together */
#define LET_GO       8u   /* times n_windows below half the limit */
#define MIN_EVENTS   64.0 /* at the limit in a window: eight samples or more */
#define FOR_GOOD     255  /* the score of a pixel given in advance */

struct shef_hot_pixels {
    /* Set by create, then read-only. */
    struct shef_hot_pixels_params params;
    uint32_t n_pixels;
    uint16_t *counts; /* of sampled events in this window */
    uint8_t *scores;  /* cold: hot windows in a row; hot: windows left until it is let go */
    uint32_t *ranks;  /* place in the list of a hot pixel plus 1; 0: cold */
    /* The stream. */
    uint32_t n_until_sample;
    bool is_started;
    shef_event_time window_start;
    /* The hot ones. */
    struct shef_hot_pixel pixels[SHEF_HOT_PIXELS_MAX];
    uint32_t indices[SHEF_HOT_PIXELS_MAX];
    uint32_t n_hot;
};

struct shef_hot_pixels_params shef_hot_pixels_default_params(int32_t width_px, int32_t height_px)
{
    return (struct shef_hot_pixels_params){
        .width_px = width_px,
        .height_px = height_px,
        .limit_per_s = 2700.0,
        .window_ms = 100,
        .n_windows = 3,
    };
}

static enum shef_err check_params(const struct shef_hot_pixels_params *p, struct shef_error *err)
{
    if (p->width_px < 1 || p->width_px > 2048 || p->height_px < 1 || p->height_px > 2048)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "hot pixels of a %d x %d px sensor: sides must be 1 to 2048", p->width_px,
                         p->height_px);
    if (!(p->limit_per_s >= 10.0 && p->limit_per_s <= 1e6))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "hot pixels above %g events a second: the limit must be 10 to 1000000",
                         p->limit_per_s);
    if (p->window_ms < 1 || p->window_ms > 10000 || p->n_windows < 1 || p->n_windows > 15)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "hot pixels over %d windows of %d ms: it must be 1 to 15 windows of 1 to "
                         "10000 ms",
                         p->n_windows, p->window_ms);
    if (p->limit_per_s * p->window_ms * 1e-3 < MIN_EVENTS)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "hot pixels above %g events a second over %d ms: a window must hold at "
                         "least %g events at the limit; take longer windows",
                         p->limit_per_s, p->window_ms, MIN_EVENTS);
    return SHEF_OK;
}

enum shef_err shef_hot_pixels_create(struct shef_hot_pixels **out_hot,
                                     const struct shef_hot_pixels_params *params,
                                     struct shef_error *err)
{
    const enum shef_err code = check_params(params, err);

    if (code != SHEF_OK)
        return code;

    struct shef_hot_pixels *hot = calloc(1, sizeof *hot);
    const size_t n_pixels = (size_t)params->width_px * (size_t)params->height_px;

    if (hot) {
        hot->counts = shef_memory_create(n_pixels, sizeof *hot->counts);
        hot->scores = shef_memory_create(n_pixels, sizeof *hot->scores);
        hot->ranks = shef_memory_create(n_pixels, sizeof *hot->ranks);
    }
    if (!hot || !hot->counts || !hot->scores || !hot->ranks) {
        shef_hot_pixels_destroy(hot);
        return shef_fail(err, SHEF_ERR_NO_MEMORY,
                         "hot pixels of a %d x %d px sensor: out of memory", params->width_px,
                         params->height_px);
    }
    hot->params = *params;
    hot->n_pixels = (uint32_t)n_pixels;
    *out_hot = hot;
    return SHEF_OK;
}

void shef_hot_pixels_destroy(struct shef_hot_pixels *hot)
{
    if (!hot)
        return;
    free(hot->counts);
    free(hot->scores);
    free(hot->ranks);
    free(hot);
}

static bool mask(struct shef_hot_pixels *hot, uint32_t pixel, uint8_t score)
{
    const uint32_t width_px = (uint32_t)hot->params.width_px;

    if (hot->n_hot == SHEF_HOT_PIXELS_MAX)
        return false;
    hot->pixels[hot->n_hot] = (struct shef_hot_pixel){ .x_px = (uint16_t)(pixel % width_px),
                                                       .y_px = (uint16_t)(pixel / width_px) };
    hot->indices[hot->n_hot] = pixel;
    hot->ranks[pixel] = ++hot->n_hot;
    hot->scores[pixel] = score;
    return true;
}

static void unmask(struct shef_hot_pixels *hot, uint32_t pixel)
{
    const uint32_t hole = hot->ranks[pixel] - 1;
    const uint32_t last = hot->n_hot - 1;

    hot->pixels[hole] = hot->pixels[last];
    hot->indices[hole] = hot->indices[last];
    hot->ranks[hot->indices[hole]] = hole + 1;
    hot->ranks[pixel] = 0;
    hot->n_hot = last;
}

enum shef_err shef_hot_pixels_add(struct shef_hot_pixels *hot, int32_t x_px, int32_t y_px,
                                  struct shef_error *err)
{
    if (x_px < 0 || y_px < 0 || x_px >= hot->params.width_px || y_px >= hot->params.height_px)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "hot pixel at (%d, %d): the sensor has only %d x %d px", x_px, y_px,
                         hot->params.width_px, hot->params.height_px);

    const uint32_t pixel = (uint32_t)(y_px * hot->params.width_px + x_px);

    if (hot->ranks[pixel])
        hot->scores[pixel] = FOR_GOOD;
    else if (!mask(hot, pixel, FOR_GOOD))
        return shef_fail(err, SHEF_ERR_FULL, "hot pixel at (%d, %d): there are %d already", x_px,
                         y_px, SHEF_HOT_PIXELS_MAX);
    return SHEF_OK;
}

void shef_hot_pixels_start(struct shef_hot_pixels *hot, shef_event_time now)
{
    memset(hot->counts, 0, hot->n_pixels * sizeof *hot->counts);
    hot->window_start = now;
    hot->is_started = true;
}

void shef_hot_pixels_count(struct shef_hot_pixels *hot, const struct shef_event *events,
                           uint32_t n_events)
{
    const uint32_t width_px = (uint32_t)hot->params.width_px;
    const uint32_t height_px = (uint32_t)hot->params.height_px;
    uint32_t i = hot->n_until_sample;

    for (; i < n_events; i += SAMPLE_EVERY) {
        const uint32_t x_px = events[i].x_px;
        const uint32_t y_px = shef_event_y_px(events[i]);

        if (x_px < width_px && y_px < height_px) {
            uint16_t *count = &hot->counts[y_px * width_px + x_px];

            *count = (uint16_t)(*count + (*count < UINT16_MAX));
        }
    }
    hot->n_until_sample = i - n_events;
}

shef_event_time shef_hot_pixels_due(const struct shef_hot_pixels *hot)
{
    if (!hot->is_started)
        return (shef_event_time){ INT64_MAX };
    return shef_event_time_add(hot->window_start, hot->params.window_ms * SHEF_NS_PER_MS);
}

/* One pixel's window. Returns whether it became hot or is let go. */
static bool judge(struct shef_hot_pixels *hot, uint32_t pixel, double rate_per_s)
{
    const uint8_t n_windows = (uint8_t)hot->params.n_windows;
    const bool is_above_half = rate_per_s >= hot->params.limit_per_s / 2;
    uint8_t *score = &hot->scores[pixel];

    if (!hot->ranks[pixel]) {
        *score = rate_per_s >= hot->params.limit_per_s ? (uint8_t)(*score + 1) : 0;
        if (*score < n_windows)
            return false;
        if (!mask(hot, pixel, (uint8_t)(LET_GO * n_windows))) {
            *score = 0;
            return false;
        }
        hot->pixels[hot->ranks[pixel] - 1].per_s = (float)rate_per_s;
        return true;
    }
    if (is_above_half)
        hot->pixels[hot->ranks[pixel] - 1].per_s = (float)rate_per_s;
    if (*score == FOR_GOOD)
        return false;
    *score = is_above_half ? (uint8_t)(LET_GO * n_windows) : (uint8_t)(*score - 1);
    if (*score > 0)
        return false;
    unmask(hot, pixel);
    return true;
}

/* Whether none of a group's pixels has a count or a score. */
static bool is_quiet(const struct shef_hot_pixels *hot, uint32_t first)
{
    uint64_t counts;
    uint32_t scores;

    memcpy(&counts, hot->counts + first, sizeof counts);
    memcpy(&scores, hot->scores + first, sizeof scores);
    return counts == 0 && scores == 0;
}

bool shef_hot_pixels_learn(struct shef_hot_pixels *hot, shef_event_time now)
{
    const double window_s = (double)shef_event_time_since(now, hot->window_start) * 1e-9;
    const double per_count = SAMPLE_EVERY / window_s;
    bool has_changed = false;

    assert(hot->is_started && window_s > 0);
    /* The arrays end with whole cache lines, so the last group may reach beyond the sensor. */
    for (uint32_t first = 0; first < hot->n_pixels; first += GROUP) {
        if (is_quiet(hot, first))
            continue;
        for (uint32_t pixel = first; pixel < first + GROUP && pixel < hot->n_pixels; pixel++)
            has_changed |= judge(hot, pixel, hot->counts[pixel] * per_count);
    }
    shef_hot_pixels_start(hot, now);
    return has_changed;
}

uint32_t shef_hot_pixels_list(const struct shef_hot_pixels *hot,
                              const struct shef_hot_pixel **out_pixels,
                              const uint32_t **out_indices)
{
    *out_pixels = hot->pixels;
    *out_indices = hot->indices;
    return hot->n_hot;
}
