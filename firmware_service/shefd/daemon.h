/* The running daemon: service, control socket, signals and watchdog on one loop.
 * Thread: main, which is the control thread. */
#ifndef SHEF_SHEFD_DAEMON_H
#define SHEF_SHEFD_DAEMON_H

#include "core/error.h"
#include "shefd/options.h"

/* Starts everything, tells systemd, and returns when SIGTERM or SIGINT came, or when the source
 * ended and the options say so; by then all is stopped and released again.
 *   options  where a reload finds the settings
 *   config   what shef_shefd_config_load() made of them
 * Errors: whatever kept it from starting, or ended the source. */
SHEF_MUST_CHECK enum shef_err shef_daemon_run(const struct shef_shefd_options *options,
                                              const struct shef_config *config,
                                              struct shef_error *err);

#endif
