/* shefd: the daemon's program. Reads the command line, does what it says, reports failures. */
#include <stdio.h>
#include <stdlib.h>

#include "config/config_text.h"
#include "core/log.h"
#include "shefd/daemon.h"
#include "shefd/options.h"

enum { EXIT_USAGE = 2 };

static enum shef_err print_settings(const struct shef_shefd_options *options,
                                    struct shef_error *err)
{
    struct shef_config config;
    const enum shef_err code = shef_shefd_config_load(options, &config, err);

    if (code != SHEF_OK)
        return code;
    switch (options->action) {
    case SHEF_SHEFD_LIST_SETTINGS:
        shef_config_write_list(&config, stdout);
        break;
    case SHEF_SHEFD_WRITE_CONFIG:
        shef_config_write_yaml(&config, stdout);
        break;
    default:
        printf("the settings are right\n");
        break;
    }
    return SHEF_OK;
}

static enum shef_err act(const struct shef_shefd_options *options, struct shef_error *err)
{
    switch (options->action) {
    case SHEF_SHEFD_HELP:
        shef_shefd_options_help(stdout);
        return SHEF_OK;
    case SHEF_SHEFD_VERSION:
        printf("shefd %s\n", SHEF_VERSION);
        return SHEF_OK;
    case SHEF_SHEFD_CHECK_CONFIG:
    case SHEF_SHEFD_LIST_SETTINGS:
    case SHEF_SHEFD_WRITE_CONFIG:
        return print_settings(options, err);
    case SHEF_SHEFD_RUN:
        break;
    }
    return shef_daemon_run(options, err);
}

int main(int argc, char **argv)
{
    struct shef_shefd_options options;
    struct shef_error err = { 0 };

    if (shef_shefd_options_parse(argc, argv, &options, &err) != SHEF_OK) {
        fprintf(stderr, "shefd: %s\n", err.text);
        return EXIT_USAGE;
    }
    if (act(&options, &err) != SHEF_OK) {
        shef_log(SHEF_LOG_ERROR, "%s", err.text);
        return EXIT_FAILURE;
    }
    if (fflush(stdout) != 0 || ferror(stdout)) {
        fprintf(stderr, "shefd: standard output cannot be written to\n");
        return EXIT_FAILURE;
    }
    return EXIT_SUCCESS;
}
