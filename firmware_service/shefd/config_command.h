/* `shefctl config`: the settings in force, over the control socket. Thread: control. */
#ifndef SHEF_SHEFD_CONFIG_COMMAND_H
#define SHEF_SHEFD_CONFIG_COMMAND_H

#include "config/config.h"
#include "control/server.h"
#include "core/error.h"

/* Registers the command "config". *config is read whenever somebody asks. */
SHEF_MUST_CHECK enum shef_err shef_config_command_register(struct shef_control *control,
                                                           struct shef_config *config,
                                                           struct shef_error *err);

#endif
