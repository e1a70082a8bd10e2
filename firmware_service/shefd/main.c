/* shefd: the daemon's program. Reads the command line, does what it says, reports failures. */
#include <stdio.h>
#include <stdlib.h>

#include "config/config_text.h"
#include "core/log.h"
#include "shefd/daemon.h"
#include "shefd/options.h"

enum { EXIT_WRONG_WORDS = 2 }; /* on the command line or in the settings */

static int fail(int status, const struct shef_error *err)
{
    shef_log(SHEF_LOG_ERROR, "%s", err->text);
    return status;
}

static int act(const struct shef_shefd_options *options, struct shef_error *err)
{
    struct shef_config config;

    if (options->action == SHEF_SHEFD_HELP) {
        shef_shefd_options_help(stdout);
        return EXIT_SUCCESS;
    }
    if (options->action == SHEF_SHEFD_VERSION) {
        printf("shefd %s\n", SHEF_VERSION);
        return EXIT_SUCCESS;
    }
    if (shef_shefd_config_load(options, &config, err) != SHEF_OK)
        return fail(EXIT_WRONG_WORDS, err);
    switch (options->action) {
    case SHEF_SHEFD_LIST_SETTINGS:
        shef_config_write_list(&config, stdout);
        return EXIT_SUCCESS;
    case SHEF_SHEFD_WRITE_CONFIG:
        shef_config_write_yaml(&config, stdout);
        return EXIT_SUCCESS;
    case SHEF_SHEFD_CHECK_CONFIG:
        if (shef_shefd_calibration_check(&config, err) != SHEF_OK)
            return fail(EXIT_WRONG_WORDS, err);
        printf("the settings are right\n");
        return EXIT_SUCCESS;
    default:
        break;
    }
    return shef_daemon_run(options, &config, err) == SHEF_OK ? EXIT_SUCCESS
                                                             : fail(EXIT_FAILURE, err);
}

int main(int argc, char **argv)
{
    struct shef_shefd_options options;
    struct shef_error err = { 0 };
    int status;

    if (shef_shefd_options_parse(argc, argv, &options, &err) != SHEF_OK)
        return fail(EXIT_WRONG_WORDS, &err);
    status = act(&options, &err);
    if (status == EXIT_SUCCESS && (fflush(stdout) != 0 || ferror(stdout))) {
        (void)shef_fail(&err, SHEF_ERR_IO, "standard output cannot be written to");
        return fail(EXIT_FAILURE, &err);
    }
    return status;
}
