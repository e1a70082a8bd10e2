/* Event files and recordings for the tests of `sheftool events`. Thread: main. */
#ifndef SHEF_TESTS_TOOLS_EVENT_FILES_H
#define SHEF_TESTS_TOOLS_EVENT_FILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "codecs/event_writer.h"
#include "core/packets.h"

#define SCENE_WIDTH_PX  64
#define SCENE_HEIGHT_PX 48

/* What a sensor of 64 x 48 px sees: an upright bright bar moves to the right, its front edge ON,
 * its back edge OFF; a frame camera's exposures come in on trigger channel 0. */
struct event_scene {
    int64_t start_us;
    int32_t duration_ms;
    int32_t trigger_period_us; /* 0: no triggers */
    int32_t exposure_us;
    int32_t silence_from_ms; /* no events here; 0 and 0: none */
    int32_t silence_to_ms;
    int32_t hot_period_us; /* the pixel (60, 40) fires so often; 0: it does not */
};

/* Everything that the scene sends. */
struct scene_events {
    struct shef_event *events;
    int64_t *times_us;
    size_t n_events;
    struct shef_trigger *triggers; /* n_before counts from the beginning */
    size_t n_triggers;
};

struct scene_events scene_events_make(const struct event_scene *scene);
void scene_events_free(struct scene_events *scene);

/* Writes the scene as an event file in the temporary folder. Valid until the fourth call. */
const char *scene_write_file(const char *name, const struct scene_events *scene,
                             const struct shef_event_writer_config *config);

/* The same as RAW in EVT3. */
const char *scene_write_raw(const char *name, const struct scene_events *scene);

/* Records the scene as EVT3 in buffers of a millisecond.
 *   lost_from, n_lost  buffers that are said to be lost and left out
 *   closed             false: as a recorder that was killed leaves it */
const char *scene_write_recording(const char *name, const struct scene_events *scene,
                                  uint32_t lost_from, uint32_t n_lost, bool closed);

/* A file of these bytes. */
const char *write_bytes(const char *name, const void *bytes, size_t n_bytes);

#endif
