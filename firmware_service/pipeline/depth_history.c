#include "pipeline/depth_history.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "pipeline/warp.h"

/* Sums are exact while a pixel gains less than 127 steps. */
#define MAX_SPAN_NS (500 * SHEF_NS_PER_MS)

enum shef_err depth_history_create(struct shef_depth_history *out_history, int32_t width_px,
                                   int32_t height_px, int32_t sensor_width_px,
                                   int32_t sensor_height_px, struct shef_error *err)
{
    const size_t pad = SHEF_WARP_PAD_BYTES / sizeof(int16_t);
    const size_t stride = ((size_t)sensor_width_px + pad - 1) / pad * pad;
    const size_t n_sums = stride * (size_t)sensor_height_px + pad;
    struct shef_depth_history history = { 0 };

    for (int i = 0; i < SHEF_DEPTH_HISTORY; i++) {
        struct depth_past *past = &history.at[i];
        const enum shef_err code = shef_image_create_u8(&past->picture, width_px, height_px, err);

        if (code == SHEF_OK)
            past->sums = (struct shef_image_i16){
                .data = shef_memory_create(n_sums, sizeof(int16_t)),
                .width_px = sensor_width_px,
                .height_px = sensor_height_px,
                .stride_bytes = (ptrdiff_t)(stride * sizeof(int16_t)),
            };
        if (!past->sums.data) {
            depth_history_destroy(&history);
            return shef_fail(err, SHEF_ERR_NO_MEMORY, "depth: no memory for earlier frames");
        }
        history.memory_bytes +=
            (size_t)past->picture.stride_bytes * (size_t)height_px + n_sums * sizeof(int16_t);
    }
    *out_history = history;
    return SHEF_OK;
}

void depth_history_destroy(struct shef_depth_history *history)
{
    for (int i = 0; i < SHEF_DEPTH_HISTORY; i++) {
        shef_image_destroy_u8(&history->at[i].picture);
        free(history->at[i].sums.data);
    }
    memset(history, 0, sizeof *history);
}

void depth_history_clear(struct shef_depth_history *history)
{
    for (int i = 0; i < SHEF_DEPTH_HISTORY; i++)
        history->at[i].is_set = false;
}

struct depth_past *depth_history_add(struct shef_depth_history *history, int64_t number,
                                     const struct shef_snapshot *snapshot)
{
    history->newest = (history->newest + 1) % SHEF_DEPTH_HISTORY;

    struct depth_past *past = &history->at[history->newest];

    assert(snapshot->sums.width_px == past->sums.width_px);
    assert(snapshot->sums.height_px == past->sums.height_px);
    past->is_set = true;
    past->number = number;
    past->mid = snapshot->mid;
    past->epoch = snapshot->epoch;
    past->n_events = snapshot->n_events;
    for (int32_t y = 0; y < past->sums.height_px; y++)
        memcpy(shef_row_i16(past->sums, y), shef_row_i16(snapshot->sums, y),
               (size_t)past->sums.width_px * sizeof(int16_t));
    return past;
}

const struct depth_past *depth_history_before(const struct shef_depth_history *history)
{
    const int32_t before = (history->newest + SHEF_DEPTH_HISTORY - 1) % SHEF_DEPTH_HISTORY;

    return history->at[before].is_set ? &history->at[before] : NULL;
}

/* How far back a frame is; 0: it cannot be compared with the newest. */
static int64_t time_ago_ns(const struct shef_depth_history *history, const struct depth_past *past)
{
    const struct depth_past *now = &history->at[history->newest];
    const int64_t ago_ns = shef_event_time_since(now->mid, past->mid);

    if (past == now || !past->is_set || past->epoch != now->epoch || ago_ns > MAX_SPAN_NS)
        return 0;
    return ago_ns > 0 ? ago_ns : 0;
}

bool depth_history_grows(const struct shef_depth_history *history)
{
    int n = 1; /* the newest */

    for (int i = 0; i < SHEF_DEPTH_HISTORY; i++)
        n += time_ago_ns(history, &history->at[i]) > 0;
    return n < SHEF_DEPTH_HISTORY;
}

const struct depth_past *depth_history_find(const struct shef_depth_history *history,
                                            int64_t span_ns)
{
    const struct depth_past *best = NULL;
    int64_t best_off_ns = INT64_MAX;

    for (int i = 0; i < SHEF_DEPTH_HISTORY; i++) {
        const int64_t ago_ns = time_ago_ns(history, &history->at[i]);
        const int64_t off_ns = llabs(ago_ns - span_ns);

        if (ago_ns > 0 && off_ns < best_off_ns) {
            best = &history->at[i];
            best_off_ns = off_ns;
        }
    }
    return best;
}

const struct depth_past *depth_history_find_events(const struct shef_depth_history *history,
                                                   uint64_t n_events)
{
    const struct depth_past *best = NULL;
    int64_t best_off = INT64_MAX;

    for (int i = 0; i < SHEF_DEPTH_HISTORY; i++) {
        const uint64_t n_between = history->at[history->newest].n_events - history->at[i].n_events;
        const int64_t off = llabs((int64_t)(n_between - n_events));

        if (time_ago_ns(history, &history->at[i]) > 0 && off < best_off) {
            best = &history->at[i];
            best_off = off;
        }
    }
    return best;
}
