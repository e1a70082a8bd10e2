/* The service's own state; service*.c and status.c share it. Thread: control. */
#ifndef SHEF_SERVICE_SERVICE_INTERNAL_H
#define SHEF_SERVICE_SERVICE_INTERNAL_H

#include <jansson.h>

#include "control/command.h"
#include "core/wake.h"
#include "service/playback.h"
#include "service/recorder.h"
#include "service/service.h"
#include "service/window.h"

struct shef_service {
    struct shef_config config;  /* in force: with what commands have changed */
    struct shef_config playing; /* the same with the source that `play` named */
    struct shef_live live;
    struct shef_wake end_wake;
    shef_host_time started;
    struct shef_playback *playback;             /* NULL: idle */
    bool is_running;                            /* its threads are */
    struct shef_recorder_report last_recording; /* that has ended; path "": none has */
    bool last_is_untold;                        /* nobody has asked for that */
    struct shef_window window;
    uint64_t n_publisher_warnings; /* that were logged */
    uint64_t n_progress_before;    /* by earlier playbacks */
};

/* Opens and starts what service->playing.source says; another source must not be running. */
SHEF_MUST_CHECK enum shef_err shef_service_play(struct shef_service *service,
                                                struct shef_error *err);

/* Stops and frees the playback, if there is one. */
void shef_service_end_playback(struct shef_service *service);

/* Begins a recording.
 *   name      NULL: by date
 *   out_path  SHEF_CONFIG_PATH_BYTES */
SHEF_MUST_CHECK enum shef_err shef_service_record(struct shef_service *service, const char *name,
                                                  char *out_path, struct shef_error *err);

/* Ends it. One that has ended by itself since it was begun is reported instead, once. */
SHEF_MUST_CHECK enum shef_err shef_service_end_recording(struct shef_service *service,
                                                         struct shef_recorder_report *out_report,
                                                         struct shef_error *err);

/* The one that runs, or the last one. */
void shef_service_recording(const struct shef_service *service,
                            struct shef_recorder_report *out_report);

/* About once a second: ends it when the disk fails or gets full. */
void shef_service_look_after_recording(struct shef_service *service);

/* After the source was stopped: what became of a recording of it.
 *   was_on  whether there was one */
void shef_service_note_recording(struct shef_service *service, bool was_on);

/* The answers to `status` and `top`, into an empty object. */
void shef_status_fill(struct shef_service *service, json_t *answer);
void shef_top_fill(struct shef_service *service, json_t *answer);

/* The commands besides those of service.c: playing, recording, pictures. */
extern const struct shef_control_command shef_service_commands[];
extern const int shef_service_n_commands;

#endif
