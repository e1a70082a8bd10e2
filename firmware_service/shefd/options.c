#include "shefd/options.h"

#include <getopt.h>
#include <stdlib.h>
#include <string.h>

#include "calib/calibration.h"
#include "calib/rectification.h"
#include "core/words.h"
#include "publish/publisher.h"

enum {
    OPTION_CHECK = 256,
    OPTION_SETTINGS,
    OPTION_WRITE,
    OPTION_PLAY,
    OPTION_ONCE,
    OPTION_VERSION
};

static const struct option long_options[] = {
    { "config", required_argument, NULL, 'c' },
    { "set", required_argument, NULL, 's' },
    { "play", required_argument, NULL, OPTION_PLAY },
    { "once", no_argument, NULL, OPTION_ONCE },
    { "check-config", no_argument, NULL, OPTION_CHECK },
    { "settings", no_argument, NULL, OPTION_SETTINGS },
    { "print-config", no_argument, NULL, OPTION_WRITE },
    { "version", no_argument, NULL, OPTION_VERSION },
    { "help", no_argument, NULL, 'h' },
    { NULL, 0, NULL, 0 },
};

void shef_shefd_options_help(FILE *out)
{
    fprintf(out,
            "Usage: shefd [OPTIONS]\n\n"
            "The SHEF service: events and frames in, disparity and depth out on LCM. Today\n"
            "they come from recordings. It stays in the foreground; systemd runs it as\n"
            "shefd.service, shefctl talks to it.\n\n"
            "  -c, --config FILE      settings; otherwise %s,\n"
            "                         and all defaults where that is not there\n"
            "  -s, --set KEY=VALUE    one setting for the file's, e.g. depth.mode=graded\n"
            "      --play RECORDING   the same as --set source.recording=RECORDING\n"
            "      --once             leave when the recording is over\n"
            "      --check-config     read the settings, say whether they are right, leave\n"
            "      --settings         list every setting with value, range, unit, default\n"
            "      --print-config     write a settings file with everything in it\n"
            "      --version          print the version\n"
            "  -h, --help             print this help\n\n"
            "SIGTERM and SIGINT end it, SIGHUP reads the settings again. Exit status: 0\n"
            "ended as asked, 1 failed, 2 the command line or a setting is wrong. One\n"
            "sentence on standard error says why.\n",
            SHEF_CONFIG_DEFAULT_PATH);
}

static enum shef_err apply_override(const char *text, struct shef_config *config,
                                    struct shef_error *err)
{
    char hint[SHEF_WORDS_HINT_BYTES];
    char key[96];
    const char *value = strchr(text, '=') + 1;
    const struct shef_config_row *row;

    snprintf(key, sizeof key, "%.*s", (int)(value - 1 - text), text);
    row = shef_config_find(key);
    if (!row) {
        shef_config_hint(key, hint);
        return shef_fail(err, SHEF_ERR_INVALID, "--set %s: there is no setting '%s'%s", text, key,
                         *hint ? hint : "; --settings lists them all");
    }
    if (shef_config_set(config, row, value, err) != SHEF_OK)
        return shef_fail_context(err, "--set");
    return SHEF_OK;
}

static enum shef_err add_override(struct shef_shefd_options *options, const char *text,
                                  struct shef_error *err)
{
    struct shef_config tried;

    if (options->n_overrides == SHEF_SHEFD_MAX_OVERRIDES)
        return shef_fail(err, SHEF_ERR_INVALID, "--set: at most %d times; write a file instead",
                         SHEF_SHEFD_MAX_OVERRIDES);
    if (!strchr(text, '='))
        return shef_fail(err, SHEF_ERR_INVALID, "--set %s: needs KEY=VALUE; see --settings", text);
    /* They count only after the file has been read; mistakes are found before. */
    shef_config_defaults(&tried);
    if (apply_override(text, &tried, err) != SHEF_OK)
        return SHEF_ERR_INVALID;
    options->overrides[options->n_overrides++] = text;
    return SHEF_OK;
}

static enum shef_err take(struct shef_shefd_options *options, int found, char **argv,
                          struct shef_error *err)
{
    switch (found) {
    case 'c':
        options->config_path = optarg;
        return SHEF_OK;
    case 's':
        return add_override(options, optarg, err);
    case OPTION_PLAY:
        options->recording = optarg;
        return *optarg ? SHEF_OK
                       : shef_fail(err, SHEF_ERR_INVALID, "--play: the recording has no name");
    case OPTION_ONCE:
        options->ends_with_source = true;
        return SHEF_OK;
    case OPTION_CHECK:
        options->action = SHEF_SHEFD_CHECK_CONFIG;
        return SHEF_OK;
    case OPTION_SETTINGS:
        options->action = SHEF_SHEFD_LIST_SETTINGS;
        return SHEF_OK;
    case OPTION_WRITE:
        options->action = SHEF_SHEFD_WRITE_CONFIG;
        return SHEF_OK;
    case OPTION_VERSION:
        options->action = SHEF_SHEFD_VERSION;
        return SHEF_OK;
    case 'h':
        options->action = SHEF_SHEFD_HELP;
        return SHEF_OK;
    case ':':
        return shef_fail(err, SHEF_ERR_INVALID, "%s needs a value; see --help", argv[optind - 1]);
    default:
        return shef_fail(err, SHEF_ERR_INVALID, "%s is no option of shefd; see --help",
                         argv[optind - 1]);
    }
}

enum shef_err shef_shefd_options_parse(int argc, char **argv,
                                       struct shef_shefd_options *out_options,
                                       struct shef_error *err)
{
    struct shef_shefd_options options = { .action = SHEF_SHEFD_RUN };
    enum shef_err code = SHEF_OK;
    int found;

    opterr = 0;
    optind = 0; /* glibc: forget an earlier scan */
    while (code == SHEF_OK && options.action != SHEF_SHEFD_HELP &&
           (found = getopt_long(argc, argv, "+:c:s:h", long_options, NULL)) != -1)
        code = take(&options, found, argv, err);
    if (code == SHEF_OK && options.action != SHEF_SHEFD_HELP && optind < argc)
        code =
            shef_fail(err, SHEF_ERR_INVALID, "'%s' belongs to no option; see --help", argv[optind]);
    if (code == SHEF_OK)
        *out_options = options;
    return code;
}

/* The service's own folder may change, the user's words were about his. */
static enum shef_err set_recording(const char *path, struct shef_config *config,
                                   struct shef_error *err)
{
    const struct shef_config_row *row = shef_config_find("source.recording");
    char *full = realpath(path, NULL);
    enum shef_err code;

    /* A path that leads nowhere is left for the service to complain about. */
    code = shef_config_set(config, row, full ? full : path, err);
    free(full);
    return code == SHEF_OK ? code : shef_fail_context(err, "--play");
}

/* One that is not there means all defaults; one that this user may not see does not. */
static enum shef_err read_usual(struct shef_config *config, struct shef_error *err)
{
    const enum shef_err code = shef_config_read(SHEF_CONFIG_DEFAULT_PATH, config, err);

    return code == SHEF_ERR_NOT_FOUND ? SHEF_OK : code;
}

enum shef_err shef_shefd_config_load(const struct shef_shefd_options *options,
                                     struct shef_config *out_config, struct shef_error *err)
{
    struct shef_config config;
    enum shef_err code = SHEF_OK;

    shef_config_defaults(&config);
    if (options->config_path)
        code = shef_config_read(options->config_path, &config, err);
    else
        code = read_usual(&config, err);
    for (int i = 0; i < options->n_overrides && code == SHEF_OK; i++)
        code = apply_override(options->overrides[i], &config, err);
    if (code == SHEF_OK && options->recording)
        code = set_recording(options->recording, &config, err);
    if (code == SHEF_OK)
        code = shef_config_check(&config, NULL, err);
    if (code == SHEF_OK)
        code = shef_publisher_check(config.lcm.url, config.lcm.prefix, err);
    if (code == SHEF_OK && options->ends_with_source && !*config.source.recording)
        code = shef_fail(err, SHEF_ERR_INVALID,
                         "--once leaves when the recording is over, but there is none; name one "
                         "with --play");
    if (code == SHEF_OK && options->ends_with_source && config.source.loop)
        code = shef_fail(err, SHEF_ERR_INVALID,
                         "--once leaves when the recording is over, which never happens with "
                         "source.loop=true");
    if (code == SHEF_OK)
        *out_config = config;
    return code;
}

enum shef_err shef_shefd_calibration_check(const struct shef_config *config, struct shef_error *err)
{
    struct shef_calibration calibration;
    struct shef_rectification left;
    struct shef_rectification right;
    double baseline_m;
    enum shef_err code;

    if (!*config->calibration.file)
        return SHEF_OK;
    code = shef_calibration_read(config->calibration.file, &calibration, err);
    if (code == SHEF_OK)
        code = shef_rectification_pair(&calibration, config->calibration.profile, &left, &right,
                                       &baseline_m, err);
    return code == SHEF_OK ? code : shef_fail_context(err, "calibration.file");
}
