#include "core/time.h"
#include "shefsim/event_sensor_parts.h"
#include "shefsim/random.h"

/* Two of three events of hot pixels are ON, as in recordings of Prophesee's Gen 3 sensor. */
#define HOT_ON_SHARE 0.67

/* Draws of a step's background: the count, then one for each event. */
enum { DRAW_COUNT, DRAW_EVENTS = 16 };

/* Adds an event unless its pixel has to be silent. */
static bool add(struct sim_event_sensor *sensor, const struct sim_event_step *step, uint32_t pixel,
                int64_t t_ns, bool on, uint64_t *count)
{
    const uint32_t width = (uint32_t)sensor->width_px;
    struct sim_event_list *list = &sensor->loose;

    if (sensor->free_ns) {
        if (t_ns < sensor->free_ns[pixel])
            return true;
        sensor->free_ns[pixel] = t_ns + sensor->params.dead_time_ns;
    }
    if (!sim_event_list_reserve(list, list->n + 1))
        return false;
    list->events[list->n++] = shef_event_make((uint32_t)(t_ns / SHEF_NS_PER_US - step->base_us),
                                              pixel % width, pixel / width, on);
    (*count)++;
    return true;
}

static bool add_background(struct sim_event_sensor *sensor, const struct sim_event_step *step)
{
    const uint64_t n_pixels = (uint64_t)sensor->width_px * (uint64_t)sensor->height_px;
    const int64_t step_ns = step->to_ns - step->from_ns;
    const uint64_t key = sim_key(sensor->seed, SIM_STREAM_BACKGROUND, sensor->n_steps);
    const double mean = sensor->params.background_hz * (double)n_pixels * (double)step_ns * 1e-9;
    const int64_t n = sim_poisson(key, DRAW_COUNT, mean);
    bool is_ok = true;

    for (int64_t i = 0; is_ok && i < n; i++) {
        const uint64_t bits = sim_random(key, DRAW_EVENTS + (uint64_t)i);
        const uint32_t pixel = (uint32_t)((bits >> 32) * n_pixels >> 32);
        const int64_t after_ns = (int64_t)((bits & 0x7fffffff) * (uint64_t)step_ns >> 31);

        is_ok = add(sensor, step, pixel, step->from_ns + after_ns, bits >> 31 & 1,
                    &sensor->stats.n_background);
    }
    return is_ok;
}

/* Event k of a hot pixel comes somewhere in its k-th period. */
static bool add_hot(struct sim_event_sensor *sensor, const struct sim_event_step *step, size_t i)
{
    struct sim_hot_pixel *hot = &sensor->hot[i];
    const uint64_t key = sim_key(sensor->seed, SIM_STREAM_HOT_EVENT, i);

    for (;; hot->n_fired++) {
        const uint64_t bits = sim_random(key, (uint64_t)hot->n_fired);
        const double when = (double)hot->n_fired + sim_unit(bits);
        const int64_t t_ns = sensor->start_ns + (int64_t)(when * (double)hot->period_ns);
        const bool on = sim_unit(bits << 32) < HOT_ON_SHARE;

        if (t_ns >= step->to_ns)
            return true;
        if (!add(sensor, step, hot->pixel, t_ns, on, &sensor->stats.n_hot))
            return false;
    }
}

bool sim_event_noise_run(struct sim_event_sensor *sensor, const struct sim_event_step *step)
{
    bool is_ok = sensor->params.background_hz == 0 || add_background(sensor, step);

    for (size_t i = 0; is_ok && i < sensor->n_hot; i++)
        is_ok = add_hot(sensor, step, i);
    return is_ok;
}
