/* `shefctl config`: the settings in force, over the control socket. Thread: control. */
#ifndef SHEF_SHEFD_CONFIG_COMMAND_H
#define SHEF_SHEFD_CONFIG_COMMAND_H

#include "control/server.h"
#include "core/error.h"
#include "service/service.h"

/* Registers the command "config", which shows shef_service_config(). */
SHEF_MUST_CHECK enum shef_err shef_config_command_register(struct shef_control *control,
                                                           struct shef_service *service,
                                                           struct shef_error *err);

#endif
