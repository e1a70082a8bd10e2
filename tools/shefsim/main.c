/* shefsim: the rig rendered, with the truth of everything. */
#include "sheftool/cli.h"
#include "shefsim/commands.h"

int main(int argc, char **argv)
{
    const struct shef_program program = {
        .name = "shefsim",
        .summary = "recordings of a rig that does not exist, with the truth of everything",
        .commands = sim_commands,
        .n_commands = SIM_N_COMMANDS,
    };

    return shef_cli_main(&program, argc, argv);
}
