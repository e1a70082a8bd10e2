#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "shefsim/event_sensor_parts.h"

#define MIN_CAPACITY 1024

bool sim_event_list_reserve(struct sim_event_list *list, size_t capacity)
{
    if (capacity <= list->capacity)
        return true;

    size_t larger =
        list->capacity < MIN_CAPACITY ? MIN_CAPACITY : list->capacity + list->capacity / 2;

    if (larger < capacity)
        larger = capacity;

    struct shef_event *events = reallocarray(list->events, larger, sizeof *events);

    if (!events)
        return false;
    list->events = events;
    list->capacity = larger;
    return true;
}

/* A counting sort keeps the order of events of the same microsecond: what was held back, noise,
 * then the bands from above. */
static void count(const struct sim_event_list *list, uint32_t n_complete_us, uint32_t *buckets)
{
    for (size_t i = 0; i < list->n; i++) {
        const uint32_t t_us = list->events[i].t_us;

        buckets[t_us < n_complete_us ? t_us : n_complete_us]++;
    }
}

static void deal(const struct sim_event_list *list, uint32_t n_complete_us, uint32_t *buckets,
                 struct shef_event *out)
{
    for (size_t i = 0; i < list->n; i++) {
        const uint32_t t_us = list->events[i].t_us;

        out[buckets[t_us < n_complete_us ? t_us : n_complete_us]++] = list->events[i];
    }
}

/* One bucket for each microsecond, one for what is held back. */
static bool make_buckets(struct sim_event_sensor *sensor, size_t n)
{
    if (n > sensor->n_buckets) {
        uint32_t *buckets = reallocarray(sensor->buckets, n, sizeof *buckets);

        if (!buckets)
            return false;
        sensor->buckets = buckets;
        sensor->n_buckets = n;
    }
    memset(sensor->buckets, 0, n * sizeof *sensor->buckets);
    return true;
}

/* Keeps events as loose ones, their times counted from the next step's base. */
static bool hold_back(struct sim_event_sensor *sensor, const struct shef_event *events, size_t n,
                      uint32_t step_us)
{
    struct sim_event_list *loose = &sensor->loose;

    if (!sim_event_list_reserve(loose, n))
        return false;
    for (size_t i = 0; i < n; i++) {
        loose->events[i] = events[i];
        loose->events[i].t_us -= step_us;
    }
    loose->n = n;
    return true;
}

size_t sim_event_order_run(struct sim_event_sensor *sensor, const struct sim_event_step *step)
{
    assert(step->complete_us >= step->base_us);

    const uint32_t step_us = (uint32_t)(step->complete_us - step->base_us);
    size_t n = sensor->loose.n;
    uint32_t sum = 0;

    for (int32_t i = 0; i < sensor->n_bands; i++)
        n += sensor->bands[i].list.n;
    if (!sim_event_list_reserve(&sensor->sorted, n) || !make_buckets(sensor, step_us + 1))
        return SIZE_MAX;

    count(&sensor->loose, step_us, sensor->buckets);
    for (int32_t i = 0; i < sensor->n_bands; i++)
        count(&sensor->bands[i].list, step_us, sensor->buckets);
    for (uint32_t i = 0; i <= step_us; i++) {
        const uint32_t here = sensor->buckets[i];

        sensor->buckets[i] = sum;
        sum += here;
    }

    const size_t n_complete = sensor->buckets[step_us];

    deal(&sensor->loose, step_us, sensor->buckets, sensor->sorted.events);
    for (int32_t i = 0; i < sensor->n_bands; i++)
        deal(&sensor->bands[i].list, step_us, sensor->buckets, sensor->sorted.events);
    sensor->sorted.n = n_complete;
    return hold_back(sensor, sensor->sorted.events + n_complete, n - n_complete, step_us)
               ? n_complete
               : SIZE_MAX;
}
