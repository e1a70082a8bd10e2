/* sheftool: the offline tool. */
#include "sheftool/cli.h"

int main(int argc, char **argv)
{
    const struct shef_program program = {
        .name = "sheftool",
        .summary = "disparity from the edges of one frame camera and one event camera",
        .commands = shef_commands,
        .n_commands = SHEF_N_COMMANDS,
    };

    return shef_cli_main(&program, argc, argv);
}
