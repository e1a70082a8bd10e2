#include "sheftool/command.h"

const struct shef_command *const shef_commands[SHEF_N_COMMANDS] = {
    &shef_command_run,           &shef_command_study,           &shef_command_match,
    &shef_command_eval,          &shef_command_table,           &shef_command_align_fit,
    &shef_command_bias_fit,      &shef_command_bench_correlate, &shef_command_bench_frame,
    &shef_command_synth,         &shef_command_events_info,     &shef_command_events_convert,
    &shef_command_events_render, &shef_command_events_bench,
};
