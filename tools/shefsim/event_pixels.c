#include <string.h>

#include "core/time.h"
#include "shefsim/event_sensor_parts.h"
#include "shefsim/random.h"

/* No pixel's threshold is below this share of the nominal one, whatever the mismatch. */
#define MIN_THRESHOLD_SHARE 0.2

/* Logarithms beyond this are no light. */
#define MAX_LOG 100.0f

/* Events of a pixel in one step that have jitter of their own. */
#define JITTERS_A_PIXEL 64

static void draw_thresholds(const struct sim_event_sensor *sensor, enum sim_stream stream,
                            double nominal, int32_t *out_threshold)
{
    const uint64_t key = sim_key(sensor->seed, stream, 0);
    const size_t n = (size_t)sensor->width_px * (size_t)sensor->height_px;

    for (size_t i = 0; i < n; i++) {
        double share = 1 + sensor->params.mismatch * sim_normal(key, i);

        if (share < MIN_THRESHOLD_SHARE)
            share = MIN_THRESHOLD_SHARE;
        out_threshold[i] = (int32_t)(nominal * share * SIM_LEVEL_ONE + 0.5);
    }
}

void sim_event_pixels_draw(struct sim_event_sensor *sensor)
{
    const struct sim_event_sensor_params *params = &sensor->params;
    const uint64_t key = sim_key(sensor->seed, SIM_STREAM_HOT_PIXEL, 0);
    const uint64_t n_pixels = (uint64_t)sensor->width_px * (uint64_t)sensor->height_px;

    draw_thresholds(sensor, SIM_STREAM_THRESHOLD_ON, params->threshold_on, sensor->threshold_on);
    draw_thresholds(sensor, SIM_STREAM_THRESHOLD_OFF, params->threshold_off, sensor->threshold_off);
    for (size_t i = 0; i < sensor->n_hot; i++) {
        const double hz = params->hot_min_hz + (params->hot_max_hz - params->hot_min_hz) *
                                                   sim_unit(sim_random(key, 2 * i));

        sensor->hot[i] = (struct sim_hot_pixel){
            .pixel = (uint32_t)((sim_random(key, 2 * i + 1) >> 32) * n_pixels >> 32),
            .period_ns = (int64_t)((double)SHEF_NS_PER_S / hz),
        };
    }
}

/* The levels of one row. */
static void take_row(const struct sim_event_sensor *sensor, const struct sim_event_step *step,
                     int32_t y, int32_t *out_level)
{
    const float *from = shef_row_f32(step->image, y);

    if (!step->is_log) {
        sensor->scan->level(from, (float)sensor->params.dark, step->ramp, sensor->width_px,
                            out_level);
        return;
    }
    for (int32_t x = 0; x < sensor->width_px; x++) {
        const double log = from[x] > MAX_LOG ? MAX_LOG : from[x] > -MAX_LOG ? from[x] : -MAX_LOG;
        const double level = log * SIM_LEVEL_ONE;

        out_level[x] = (int32_t)(level < 0 ? level - 0.5 : level + 0.5) + step->ramp;
    }
}

static void set_reference(const struct sim_event_sensor *sensor, size_t pixel, int32_t reference)
{
    sensor->reference[pixel] = reference;
    sensor->low[pixel] = reference - sensor->threshold_off[pixel];
    sensor->high[pixel] = reference + sensor->threshold_on[pixel];
}

void sim_event_pixels_start(struct sim_event_sensor *sensor, const struct sim_event_step *step)
{
    const uint64_t key = sim_key(sensor->seed, SIM_STREAM_LEAK, 0);

    for (int32_t y = 0; y < sensor->height_px; y++) {
        const size_t first = (size_t)y * (size_t)sensor->width_px;

        take_row(sensor, step, y, sensor->next_level + first);
        for (size_t i = first; i < first + (size_t)sensor->width_px; i++) {
            /* Leaking references have been leaking before the first image. */
            const double leaked = sensor->params.leak_hz > 0 ? sim_unit(sim_random(key, i)) : 0;

            set_reference(sensor, i,
                          sensor->next_level[i] - (int32_t)(leaked * sensor->threshold_on[i]));
        }
    }
}

/* When a pixel's level, on its straight line through the step, reaches a target. A level that
 * was already past it, because the pixel had to be silent, reaches it at once. */
struct line {
    int32_t from_level;
    double ns_per_level;
};

static struct line make_line(const struct sim_event_sensor *sensor,
                             const struct sim_event_step *step, size_t pixel)
{
    const int32_t from = sensor->level[pixel];
    const int32_t to = sensor->next_level[pixel];

    return (struct line){
        .from_level = from,
        .ns_per_level =
            from == to ? 0 : (double)(step->to_ns - step->from_ns) / (double)(to - from),
    };
}

static int64_t crosses_after_ns(const struct line *line, int32_t target, bool on)
{
    const int32_t change = target - line->from_level;
    const bool is_ahead = on ? change > 0 : change < 0;

    return is_ahead ? (int64_t)((double)change * line->ns_per_level) : 0;
}

/* One event of one pixel: its time after latency, jitter and dead time.
 *   k  its number in this step
 * Returns INT64_MIN if the pixel has to be silent to the end of the step. */
static int64_t fire_ns(const struct sim_event_sensor *sensor, const struct sim_event_step *step,
                       size_t pixel, int32_t k, int64_t crossed_ns)
{
    int64_t t_ns = crossed_ns + sensor->params.latency_ns;

    if (!sensor->free_ns)
        return t_ns;
    if (sensor->free_ns[pixel] > step->to_ns + sensor->params.latency_ns)
        return INT64_MIN;
    if (sensor->params.jitter_ns > 0) {
        const uint64_t bits =
            sim_random(step->jitter_key, pixel * JITTERS_A_PIXEL + (uint32_t)(k % JITTERS_A_PIXEL));

        t_ns += (int64_t)((double)sensor->params.jitter_ns * sim_bell(bits));
    }
    if (t_ns < sensor->free_ns[pixel])
        t_ns = sensor->free_ns[pixel];
    sensor->free_ns[pixel] = t_ns + sensor->params.dead_time_ns;
    return t_ns;
}

/* All events of a pixel that has passed one of its limits. False: out of memory. */
static bool fire(struct sim_event_sensor *sensor, const struct sim_event_step *step,
                 struct sim_event_list *list, int32_t x, int32_t y)
{
    const size_t pixel = (size_t)y * (size_t)sensor->width_px + (size_t)x;
    const int32_t reference = sensor->reference[pixel];
    const int32_t change = sensor->next_level[pixel] - reference;
    const bool on = change > 0;
    const int32_t threshold = on ? sensor->threshold_on[pixel] : sensor->threshold_off[pixel];
    const int32_t n = (on ? change : -change) / threshold;
    const int32_t stride = on ? threshold : -threshold;
    const struct line line = make_line(sensor, step, pixel);
    int32_t k = 0;

    if (!sim_event_list_reserve(list, list->n + (size_t)n))
        return false;
    for (; k < n; k++) {
        const int64_t crossed_ns =
            step->from_ns + crosses_after_ns(&line, reference + (k + 1) * stride, on);
        const int64_t t_ns = fire_ns(sensor, step, pixel, k, crossed_ns);

        if (t_ns == INT64_MIN)
            break;
        list->events[list->n++] = shef_event_make((uint32_t)(t_ns / SHEF_NS_PER_US - step->base_us),
                                                  (uint32_t)x, (uint32_t)y, on);
    }
    set_reference(sensor, pixel, reference + k * stride);
    return true;
}

void sim_event_pixels_run(struct sim_event_sensor *sensor, const struct sim_event_step *step,
                          struct sim_event_band *band)
{
    uint8_t hit[SIM_EVENT_SENSOR_MAX_SIDE_PX + 8] = { 0 };

    band->list.n = 0;
    for (int32_t y = band->y_begin; y < band->y_end; y++) {
        const size_t first = (size_t)y * (size_t)sensor->width_px;

        take_row(sensor, step, y, sensor->next_level + first);
        sensor->scan->scan(sensor->next_level + first, sensor->low + first, sensor->high + first,
                           sensor->width_px, hit);
        for (int32_t x = 0; x < sensor->width_px; x += 8) {
            uint64_t eight;

            memcpy(&eight, hit + x, sizeof eight);
            for (; eight != 0; eight &= eight - 1) {
                const int32_t at = x + __builtin_ctzll(eight) / 8;

                if (!fire(sensor, step, &band->list, at, y))
                    band->has_failed = true;
            }
        }
    }
}
