#include "shefsim/commands.h"

const struct shef_command *const sim_commands[SIM_N_COMMANDS] = {
    &sim_command_render,
    &sim_command_events,
    &sim_command_bench,
    &sim_command_export,
};
