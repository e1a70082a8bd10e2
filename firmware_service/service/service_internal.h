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
    struct shef_recorder_report last_recording; /* of playbacks that are gone */
    struct shef_window window;
    uint64_t n_publisher_warnings; /* that were logged */
    uint64_t n_progress_before;    /* by earlier playbacks */
};

/* Opens and starts what service->playing.source says; another source must not be running. */
SHEF_MUST_CHECK enum shef_err shef_service_play(struct shef_service *service,
                                                struct shef_error *err);

/* Stops and frees the playback, if there is one. */
void shef_service_end_playback(struct shef_service *service);

/* The answers to `status` and `top`, into an empty object. */
void shef_status_fill(struct shef_service *service, json_t *answer);
void shef_top_fill(struct shef_service *service, json_t *answer);

/* The commands besides those of service.c: playing, recording, pictures. */
extern const struct shef_control_command shef_service_commands[];
extern const int shef_service_n_commands;

#endif
