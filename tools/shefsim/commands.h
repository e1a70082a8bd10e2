/* The table of shefsim's commands, in the order of the help. */
#ifndef SHEFSIM_COMMANDS_H
#define SHEFSIM_COMMANDS_H

#include "sheftool/command.h"

#define SIM_N_COMMANDS 4
extern const struct shef_command *const sim_commands[SIM_N_COMMANDS];

extern const struct shef_command sim_command_render;
extern const struct shef_command sim_command_events;
extern const struct shef_command sim_command_bench;
extern const struct shef_command sim_command_export;

#endif
