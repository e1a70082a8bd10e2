#include "tools/event_files.h"

#include <stdlib.h>

#include "codecs/evt_encode.h"
#include "core/file.h"
#include "record/event_recorder.h"
#include "support/support.h"

#define BATCH_EVENTS 512

/* Grows with whatever comes; times may be out of order until sorted. */
static void add_event(struct scene_events *scene, int64_t t_us, int32_t x_px, int32_t y_px, bool on)
{
    if (scene->n_events % 4096 == 0) {
        scene->events = reallocarray(scene->events, scene->n_events + 4096, sizeof *scene->events);
        scene->times_us =
            reallocarray(scene->times_us, scene->n_events + 4096, sizeof *scene->times_us);
        TEST_ASSERT_TRUE(scene->events && scene->times_us);
    }
    scene->events[scene->n_events] = shef_event_make(0, (uint32_t)x_px, (uint32_t)y_px, on);
    scene->times_us[scene->n_events++] = t_us;
}

static void add_trigger(struct scene_events *scene, int64_t t_us, bool rising)
{
    scene->triggers = reallocarray(scene->triggers, scene->n_triggers + 1, sizeof *scene->triggers);
    TEST_ASSERT_NOT_NULL(scene->triggers);
    scene->triggers[scene->n_triggers++] = (struct shef_trigger){
        .t_us = t_us, .n_before = (uint32_t)scene->n_events, .rising = rising
    };
}

struct scene_events scene_events_make(const struct event_scene *scene)
{
    struct scene_events made = { .n_events = 0 };

    for (int32_t us = 0; us < 1000 * scene->duration_ms; us += 10) {
        const int64_t t_us = scene->start_us + us;
        const bool is_silent =
            us >= 1000 * scene->silence_from_ms && us < 1000 * scene->silence_to_ms;

        if (scene->trigger_period_us && us > 0 && us % scene->trigger_period_us == 0)
            add_trigger(&made, t_us, true);
        if (scene->trigger_period_us && us % scene->trigger_period_us == scene->exposure_us &&
            us > scene->trigger_period_us)
            add_trigger(&made, t_us, false);
        if (is_silent)
            continue;
        /* The bar is 12 px wide and moves 1 px a millisecond; a row fires each 20 us. */
        if (us % 20 == 0) {
            const int32_t front_px = us / 1000 % SCENE_WIDTH_PX;
            const int32_t back_px = (front_px + SCENE_WIDTH_PX - 12) % SCENE_WIDTH_PX;
            const int32_t row = us / 20 % SCENE_HEIGHT_PX;

            add_event(&made, t_us, front_px, row, true);
            add_event(&made, t_us, back_px, row, false);
        }
        if (scene->hot_period_us && us % scene->hot_period_us == 0)
            add_event(&made, t_us, 60, 40, true);
    }
    return made;
}

void scene_events_free(struct scene_events *scene)
{
    free(scene->events);
    free(scene->times_us);
    free(scene->triggers);
    *scene = (struct scene_events){ .n_events = 0 };
}

/* Fills a batch with the next events and triggers, up to a time. Returns false at the end. */
static bool next_batch(const struct scene_events *scene, size_t *at_event, size_t *at_trigger,
                       int64_t until_us, struct shef_event_batch *batch)
{
    const size_t first = *at_event;

    shef_event_batch_clear(batch);
    if (first == scene->n_events && *at_trigger == scene->n_triggers)
        return false;
    batch->base_us =
        first < scene->n_events ? scene->times_us[first] : scene->triggers[*at_trigger].t_us;
    batch->reached_us = batch->base_us;
    while (batch->n_events < BATCH_EVENTS && *at_event < scene->n_events &&
           scene->times_us[*at_event] < until_us) {
        struct shef_event *event = &batch->events[batch->n_events++];

        *event = scene->events[*at_event];
        event->t_us = (uint32_t)(scene->times_us[*at_event] - batch->base_us);
        batch->reached_us = scene->times_us[(*at_event)++];
    }
    while (batch->n_triggers < SHEF_BATCH_TRIGGERS && *at_trigger < scene->n_triggers &&
           scene->triggers[*at_trigger].n_before <= *at_event &&
           scene->triggers[*at_trigger].t_us < until_us) {
        struct shef_trigger *trigger = &batch->triggers[batch->n_triggers++];

        *trigger = scene->triggers[(*at_trigger)++];
        trigger->n_before -= (uint32_t)first;
        if (trigger->t_us > batch->reached_us)
            batch->reached_us = trigger->t_us;
    }
    return true;
}

const char *scene_write_file(const char *name, const struct scene_events *scene,
                             const struct shef_event_writer_config *config)
{
    const char *path = shef_test_temp_path(name);
    struct shef_event events[BATCH_EVENTS];
    struct shef_event_batch batch = { .events = events, .capacity = BATCH_EVENTS };
    struct shef_event_writer *writer;
    struct shef_error err = { .text = "" };
    size_t at_event = 0;
    size_t at_trigger = 0;

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_event_writer_open(path, config, &writer, &err),
                              err.text);
    while (next_batch(scene, &at_event, &at_trigger, INT64_MAX, &batch))
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_event_writer_write(writer, &batch, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_event_writer_close(writer, &err), err.text);
    return path;
}

const char *scene_write_raw(const char *name, const struct scene_events *scene)
{
    const struct shef_event_writer_config config = {
        .is_raw = true,
        .width_px = SCENE_WIDTH_PX,
        .height_px = SCENE_HEIGHT_PX,
        .format = SHEF_EVT3,
        .ticks = SHEF_EVT_TICKS_SENSOR,
        .generation = SHEF_RAW_NEW,
        .date = "2026-03-01 12:00:00",
    };

    return scene_write_file(name, scene, &config);
}

const char *scene_write_recording(const char *name, const struct scene_events *scene,
                                  uint32_t lost_from, uint32_t n_lost, bool closed)
{
    static struct shef_recording_writer recording;
    static struct shef_event events[BATCH_EVENTS];
    static uint8_t bytes[1 << 16];
    const char *path = shef_test_temp_path(name);
    const struct shef_recording_writer_config writer_config = { .software = "test" };
    const struct shef_raw_header camera = { .format = SHEF_EVT3,
                                            .width_px = SCENE_WIDTH_PX,
                                            .height_px = SCENE_HEIGHT_PX,
                                            .system_id = 40,
                                            .serial = "00001234" };
    struct shef_event_recorder_config config = shef_event_recorder_default_config(&camera);
    struct shef_event_batch batch = { .events = events, .capacity = BATCH_EVENTS };
    struct shef_event_recorder *recorder;
    struct shef_evt_encoder encoder;
    struct shef_error err = { .text = "" };
    int64_t until_us = scene->times_us[0] + 1000;
    size_t at_event = 0;
    size_t at_trigger = 0;
    uint32_t n_buffers = 0;

    config.near_us = scene->times_us[0];
    config.sync_ns = 0;
    config.segment_bytes = 20000;
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_recording_writer_create(&recording, path, &writer_config, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_event_recorder_start(&recording, &config, &recorder, &err), err.text);
    shef_evt_encoder_init(&encoder, SHEF_EVT3, SHEF_EVT_TICKS_SENSOR, SCENE_WIDTH_PX,
                          SCENE_HEIGHT_PX);
    for (; next_batch(scene, &at_event, &at_trigger, until_us, &batch); until_us += 1000) {
        const bool is_lost = n_buffers >= lost_from && n_buffers < lost_from + n_lost;
        const uint32_t n_lost_before = n_lost > 0 && n_buffers == lost_from + n_lost ? n_lost : 0;
        size_t n_bytes;

        if (batch.n_events + batch.n_triggers == 0)
            continue;
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_evt_encode(&encoder, &batch, bytes, sizeof bytes, &n_bytes));
        if (!is_lost)
            TEST_ASSERT_EQUAL_MESSAGE(
                SHEF_OK,
                shef_event_recorder_write(recorder, bytes, (uint32_t)n_bytes,
                                          (shef_host_time){ n_buffers * SHEF_NS_PER_MS },
                                          n_lost_before, &err),
                err.text);
        n_buffers++;
    }
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_event_recorder_stop(recorder, &err), err.text);
    if (closed)
        TEST_ASSERT_EQUAL_MESSAGE(
            SHEF_OK, shef_recording_writer_close(&recording, true, NULL, NULL, &err), err.text);
    else
        shef_manifest_free(&recording.manifest);
    return path;
}

const char *write_bytes(const char *name, const void *bytes, size_t n_bytes)
{
    const char *path = shef_test_temp_path(name);

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bytes, n_bytes, NULL));
    return path;
}
