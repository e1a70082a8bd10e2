/* The service: recording or devices in, disparity and depth out, told what to do by commands.
 *
 * create() allocates everything and starts nothing; start() starts the threads of the graph in
 * order; stop() joins them in reverse. Without a source the service is idle: it answers commands
 * and waits for `play`. Thread: setup and control, which are the same thread, unless noted. */
#ifndef SHEF_SERVICE_SERVICE_H
#define SHEF_SERVICE_SERVICE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config/config.h"
#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_control;
struct shef_service;

/* Allocates what the configuration asks for.
 *   config  copied
 * Errors are sentences about the configuration's own words: a recording that is not there or is
 * cut short, a calibration that is missing or of another size, no multicast route. */
SHEF_MUST_CHECK enum shef_err shef_service_create(const struct shef_config *config,
                                                  struct shef_service **out_service,
                                                  struct shef_error *err);

/* Starts the threads. On failure those that ran are stopped again. */
SHEF_MUST_CHECK enum shef_err shef_service_start(struct shef_service *service,
                                                 struct shef_error *err);

/* Ends the work in hand and joins every thread. Not running, and NULL, are allowed. */
void shef_service_stop(struct shef_service *service);

/* Frees a stopped service. NULL is allowed. */
void shef_service_destroy(struct shef_service *service);

/* Offers the service's commands on the control socket. */
SHEF_MUST_CHECK enum shef_err shef_service_register_commands(struct shef_service *service,
                                                             struct shef_control *control,
                                                             struct shef_error *err);

/* The settings in force: those of create(), with what apply() and commands have changed since. */
const struct shef_config *shef_service_config(const struct shef_service *service);

/* Takes over the settings of a reloaded configuration that are live; the caller has checked that
 * no other one differs. */
SHEF_MUST_CHECK enum shef_err shef_service_apply(struct shef_service *service,
                                                 const struct shef_config *config,
                                                 struct shef_error *err);

/* What the watchdog looks at; asked every second, which is also when windows of rates end. */
struct shef_service_progress {
    uint64_t n_steps; /* grows with every piece of work that any stage has finished */
    bool is_expected; /* a source is running: without new steps something hangs */
};

struct shef_service_progress shef_service_progress(struct shef_service *service);

/* One line for people, e.g. "idle, no source" or "playing walk-1 at 54.0 frames/s".
 *   out_text  n_bytes bytes, terminated */
void shef_service_describe(const struct shef_service *service, char *out_text, size_t n_bytes);

/* Readable once the source has ended by itself: the recording is over, or failed. */
int shef_service_end_fd(const struct shef_service *service);

/* Whether the source that plays now has ended by itself. */
bool shef_service_has_ended(const struct shef_service *service);

/* How the source ended, after end_fd became readable: SHEF_OK, or the sentence why not. */
enum shef_err shef_service_outcome(const struct shef_service *service, struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
