#include "service/service.h"

#include <libgen.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "control/server.h"
#include "core/clock.h"
#include "core/log.h"
#include "core/memory.h"
#include "service/service_internal.h"

static shef_host_time now(void)
{
    return shef_clock_now(shef_clock_monotonic());
}

/* ---- life ------------------------------------------------------------------------------- */

static enum shef_err create_playback(struct shef_service *service, struct shef_error *err)
{
    const struct shef_playback_params params = {
        .config = &service->playing,
        .live = &service->live,
        .end_wake = &service->end_wake,
    };
    const enum shef_err code = shef_playback_create(&params, &service->playback, err);

    if (code == SHEF_OK && *shef_playback_source(service->playback)->warning)
        shef_log(SHEF_LOG_WARNING, "'%s': %s", service->playing.source.recording,
                 shef_playback_source(service->playback)->warning);
    return code;
}

enum shef_err shef_service_create(const struct shef_config *config,
                                  struct shef_service **out_service, struct shef_error *err)
{
    struct shef_service *service = shef_memory_create(1, sizeof *service);
    enum shef_err code;

    if (!service)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "service: out of memory");
    service->config = *config;
    service->playing = *config;
    service->started = now();
    service->end_wake.fd = -1;
    shef_live_init(&service->live, config);
    code = shef_wake_init(&service->end_wake, err);
    if (code == SHEF_OK && *config->source.recording)
        code = create_playback(service, err);
    if (code != SHEF_OK) {
        shef_service_destroy(service);
        return code;
    }
    shef_window_start(&service->window, service->playback, service->started);
    *out_service = service;
    return SHEF_OK;
}

enum shef_err shef_service_start(struct shef_service *service, struct shef_error *err)
{
    enum shef_err code;

    if (!service->playback || service->is_running)
        return SHEF_OK;
    code = shef_playback_start(service->playback, err);
    service->is_running = code == SHEF_OK;
    shef_window_start(&service->window, service->playback, now());
    return code;
}

void shef_service_end_playback(struct shef_service *service)
{
    if (!service->playback)
        return;
    shef_service_stop(service);
    shef_window_start(&service->window, NULL, now());
    service->n_progress_before += shef_playback_progress(service->playback) + 1;
    service->n_publisher_warnings = 0;
    shef_playback_destroy(service->playback);
    service->playback = NULL;
    /* Should it have ended meanwhile: nobody is to take that for the end of the next one. */
    shef_wake_wait(&service->end_wake, 0);
}

enum shef_err shef_service_play(struct shef_service *service, struct shef_error *err)
{
    enum shef_err code = create_playback(service, err);

    if (code == SHEF_OK)
        code = shef_service_start(service, err);
    if (code != SHEF_OK)
        shef_service_end_playback(service);
    return code;
}

void shef_service_stop(struct shef_service *service)
{
    struct shef_recorder_report recording;

    if (!service || !service->is_running)
        return;
    shef_service_recording(service, &recording);
    shef_playback_stop(service->playback);
    shef_service_note_recording(service, recording.is_on);
    service->is_running = false;
}

void shef_service_destroy(struct shef_service *service)
{
    if (!service)
        return;
    shef_playback_destroy(service->playback);
    shef_wake_deinit(&service->end_wake);
    free(service);
}

enum shef_err shef_service_apply(struct shef_service *service, const struct shef_config *config,
                                 struct shef_error *err)
{
    (void)err;
    service->config = *config;
    shef_live_apply(&service->live, config);
    if (service->playback)
        shef_playback_apply(service->playback);
    return SHEF_OK;
}

const struct shef_config *shef_service_config(const struct shef_service *service)
{
    return &service->config;
}

/* ---- what main asks --------------------------------------------------------------------- */

static void look_after_publisher(struct shef_service *service)
{
    struct shef_publisher_stats stats;
    char trouble[256];

    shef_publisher_stats(shef_playback_publisher(service->playback), &stats);
    if (stats.n_warnings == service->n_publisher_warnings)
        return;
    service->n_publisher_warnings = stats.n_warnings;
    shef_publisher_describe_trouble(&stats, trouble, sizeof trouble);
    if (*trouble)
        shef_log(SHEF_LOG_WARNING, "%s", trouble);
}

struct shef_service_progress shef_service_progress(struct shef_service *service)
{
    struct shef_service_progress progress = { .n_steps = service->n_progress_before };

    shef_window_tick(&service->window, service->is_running ? service->playback : NULL, now());
    if (!service->is_running)
        return progress;
    shef_service_look_after_recording(service);
    look_after_publisher(service);
    progress.n_steps += shef_playback_progress(service->playback);
    progress.is_expected = shef_playback_state(service->playback) == SHEF_PLAYBACK_PLAYING;
    return progress;
}

void shef_service_describe(const struct shef_service *service, char *out_text, size_t n_bytes)
{
    static const char *const words[] = {
        [SHEF_PLAYBACK_PLAYING] = "playing",
        [SHEF_PLAYBACK_ENDED] = "at the end of",
        [SHEF_PLAYBACK_FAILED] = "failed to read",
    };
    char path[SHEF_CONFIG_PATH_BYTES];

    if (!service->playback) {
        snprintf(out_text, n_bytes, "idle, no source");
        return;
    }
    snprintf(path, sizeof path, "%s", shef_playback_source(service->playback)->path);

    const int n = snprintf(out_text, n_bytes, "%s %.100s",
                           words[shef_playback_state(service->playback)], basename(path));

    /* The first rate comes a second after the start. */
    if (service->window.frames_per_s > 0 && n > 0 && (size_t)n < n_bytes)
        snprintf(out_text + n, n_bytes - (size_t)n, " at %.1f frames/s",
                 service->window.frames_per_s);
}

int shef_service_end_fd(const struct shef_service *service)
{
    return service->end_wake.fd;
}

bool shef_service_has_ended(const struct shef_service *service)
{
    return service->playback && shef_playback_state(service->playback) != SHEF_PLAYBACK_PLAYING;
}

enum shef_err shef_service_outcome(const struct shef_service *service, struct shef_error *err)
{
    return service->playback ? shef_playback_outcome(service->playback, err) : SHEF_OK;
}

enum shef_err shef_service_register_commands(struct shef_service *service,
                                             struct shef_control *control, struct shef_error *err)
{
    return shef_control_register(control, shef_service_commands, shef_service_n_commands, service,
                                 err);
}
