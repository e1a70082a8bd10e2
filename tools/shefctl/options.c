#include "shefctl/options.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/words.h"

#define COMMAND(name_, words_, help_, ...)                                                         \
    {                                                                                              \
        .name = name_, .words = words_, .help = help_, __VA_ARGS__                                 \
    }

static const struct shef_ctl_command commands[] = {
    COMMAND("status", "", "what the service does and how it fares", .options = ""),
    COMMAND("top", "", "rates, drops, backlog and latency, live", .options = "in",
            .columns = "name,rate_hz,p50_ms,p99_ms,max_ms,capacity,count,high_water,n_pushed,"
                       "n_lost"),
    COMMAND("graph", "", "threads, and the rings between them", .options = "",
            .columns = "name,priority,granted,cpu,deadline_ms,woken_by,producer,consumer,capacity,"
                       "count,high_water,n_lost"),
    COMMAND("kernels", "", "which implementations were picked for this processor", .options = ""),
    COMMAND("mode", "[NAME]", "the matching mode; with a NAME, change it", .options = "",
            .max_words = 1, .argument = "name"),
    COMMAND("snapshot", "OUT.png", "save a picture of what the service sees now", .options = "",
            .min_words = 1, .max_words = 1),
    COMMAND("play", "RECORDING", "play a recording", .options = "lp", .min_words = 1,
            .max_words = 1, .argument = "recording", .word_is_path = true),
    COMMAND("stop", "", "stop what is playing", .options = ""),
    COMMAND("record start", "[NAME]", "start a recording", .options = "", .max_words = 1,
            .argument = "name"),
    COMMAND("record stop", "", "end the recording and say what was lost", .options = ""),
    COMMAND("record list", "", "list the recordings there are", .options = ""),
    COMMAND("config", "", "list the settings in force", .options = "", .columns = "key,value,live"),
};

#define N_COMMANDS ((int)(sizeof commands / sizeof commands[0]))

/* Letters of the options that only some commands know. */
#define SOME_COMMANDS_OPTIONS "inlp"

static const struct option long_options[] = {
    { "json", no_argument, NULL, 'j' },
    { "socket", required_argument, NULL, 's' },
    { "interval", required_argument, NULL, 'i' },
    { "count", required_argument, NULL, 'n' },
    { "loop", no_argument, NULL, 'l' },
    { "pace", required_argument, NULL, 'p' },
    { "help", no_argument, NULL, 'h' },
    { "version", no_argument, NULL, 'v' },
    { NULL, 0, NULL, 0 },
};

/* What the help says about options; those of some commands only have that command's letter. */
static const struct {
    char letter;
    const char *text;
} option_helps[] = {
    { 'j', "  --json                 print the answer, or the error, as JSON\n"
           "                         (docs/control.md)\n" },
    { 's', "  --socket PATH          shefd's socket (default " SHEF_CTL_DEFAULT_SOCKET ",\n"
           "                         or what SHEF_SOCKET says)\n" },
    { 'i', "  --interval SECONDS     of top: time between two looks, 0.1 to 3600 s;\n"
           "                         default 1\n" },
    { 'n', "  --count N              of top: end after N looks (default: go on)\n" },
    { 'l', "  --loop                 of play: start again at the end\n" },
    { 'p', "  --pace PACE            of play: recorded, stepped or fast\n" },
    { 'v', "  --version              print the version\n" },
    { 'h', "  -h, --help             print this help, or that of a command\n" },
};

static void print_command(const struct shef_ctl_command *command, FILE *out)
{
    char head[64];

    snprintf(head, sizeof head, "%s %s", command->name, command->words);
    fprintf(out, "  %-22s %s\n", head, command->help);
}

void shef_ctl_options_help(const struct shef_ctl_command *command, FILE *out)
{
    if (command) {
        fprintf(out, "Usage: shefctl [OPTIONS] %s%s%s\n\n", command->name,
                *command->words ? " " : "", command->words);
        print_command(command, out);
    } else {
        fprintf(out,
                "Usage: shefctl [OPTIONS] COMMAND\n\nTalks to the running shefd.\n\nCommands:\n");
        for (int i = 0; i < N_COMMANDS; i++)
            print_command(&commands[i], out);
    }
    fprintf(out, "\nOptions:\n");
    for (size_t i = 0; i < sizeof option_helps / sizeof option_helps[0]; i++)
        if (!command || !strchr(SOME_COMMANDS_OPTIONS, option_helps[i].letter) ||
            strchr(command->options, option_helps[i].letter))
            fputs(option_helps[i].text, out);
    fprintf(out, "\nExit status: 0 done, 1 the command line is wrong, 2 no service answers, 3\n"
                 "refused for this user or at this time, 4 failed. One sentence on standard\n"
                 "error says why.\n");
}

static enum shef_err take_number(const char *option, const char *text, double min, double max,
                                 double *out_number, struct shef_error *err)
{
    char *end;
    const double number = strtod(text, &end);

    if (end == text || *end || !isfinite(number) || number < min || number > max)
        return shef_fail(err, SHEF_ERR_INVALID, "--%s %s: needs a number from %g to %g", option,
                         text, min, max);
    *out_number = number;
    return SHEF_OK;
}

static enum shef_err take_pace(const char *text, struct shef_ctl_options *options,
                               struct shef_error *err)
{
    if (strcmp(text, "recorded") != 0 && strcmp(text, "stepped") != 0 && strcmp(text, "fast") != 0)
        return shef_fail(err, SHEF_ERR_INVALID, "--pace %s: needs recorded, stepped or fast", text);
    options->pace = text;
    return SHEF_OK;
}

static enum shef_err take_option(int found, char **argv, struct shef_ctl_options *options,
                                 struct shef_error *err)
{
    double count = 1;

    switch (found) {
    case 'j':
        options->json = true;
        return SHEF_OK;
    case 's':
        options->socket = optarg;
        return SHEF_OK;
    case 'i':
        return take_number("interval", optarg, 0.1, 3600, &options->interval_s, err);
    case 'n':
        if (take_number("count", optarg, 1, 1e6, &count, NULL) != SHEF_OK || count != floor(count))
            return shef_fail(err, SHEF_ERR_INVALID,
                             "--count %s: needs a whole number from 1 to 1000000", optarg);
        options->count = (long)count;
        return SHEF_OK;
    case 'l':
        options->loop = true;
        return SHEF_OK;
    case 'p':
        return take_pace(optarg, options, err);
    case 'h':
        options->help = true;
        return SHEF_OK;
    case 'v':
        options->version = true;
        return SHEF_OK;
    case ':':
        return shef_fail(err, SHEF_ERR_INVALID, "%s needs a value; see --help", argv[optind - 1]);
    default:
        return shef_fail(err, SHEF_ERR_INVALID, "%s is no option of shefctl; see --help",
                         argv[optind - 1]);
    }
}

/* How many of the words name this command: 0, or as many as its name has. */
static int match_name(const struct shef_ctl_command *command, int n_words, char **words)
{
    const char *gap = strchr(command->name, ' ');

    if (!gap)
        return strcmp(command->name, words[0]) == 0 ? 1 : 0;
    return n_words > 1 && strncmp(command->name, words[0], (size_t)(gap - command->name)) == 0 &&
                   words[0][gap - command->name] == '\0' && strcmp(gap + 1, words[1]) == 0
               ? 2
               : 0;
}

static enum shef_err fail_unknown(const char *word, struct shef_error *err)
{
    size_t least = SIZE_MAX;
    const char *nearest = NULL;

    for (int i = 0; i < N_COMMANDS; i++) {
        const size_t distance = shef_words_distance(commands[i].name, word);

        if (distance < least && shef_words_is_near(word, distance)) {
            least = distance;
            nearest = commands[i].name;
        }
    }
    if (nearest)
        return shef_fail(err, SHEF_ERR_INVALID, "'%s' is no command; is '%s' meant?", word,
                         nearest);
    return shef_fail(err, SHEF_ERR_INVALID, "'%s' is no command; see shefctl --help", word);
}

/* For `shefctl play --help`: the command, if the words name one. */
static const struct shef_ctl_command *find_command(int n_words, char **words)
{
    for (int i = 0; i < N_COMMANDS && n_words > 0; i++)
        if (match_name(&commands[i], n_words, words) > 0)
            return &commands[i];
    return NULL;
}

static enum shef_err take_words(int n_words, char **words, struct shef_ctl_options *options,
                                struct shef_error *err)
{
    int n_name = 0;

    if (n_words == 0)
        return shef_fail(err, SHEF_ERR_INVALID, "no command; see shefctl --help");
    for (int i = 0; i < N_COMMANDS && n_name == 0; i++) {
        n_name = match_name(&commands[i], n_words, words);
        if (n_name > 0)
            options->command = &commands[i];
    }
    if (n_name == 0 && strcmp(words[0], "record") == 0)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'record' needs a second word: start, stop or list");
    if (n_name == 0)
        return fail_unknown(words[0], err);
    if (n_words - n_name < options->command->min_words)
        return shef_fail(err, SHEF_ERR_INVALID, "'%s' needs %s; see shefctl --help",
                         options->command->name, options->command->words);
    if (n_words - n_name > options->command->max_words)
        return shef_fail(err, SHEF_ERR_INVALID, "'%s' is one word too many for '%s'; see --help",
                         words[n_name + options->command->max_words], options->command->name);
    options->word = n_words > n_name ? words[n_name] : NULL;
    return SHEF_OK;
}

/* Options that only some commands know, in `given` by their letters. */
static enum shef_err check_given(const struct shef_ctl_options *options, const char *given,
                                 struct shef_error *err)
{
    for (; *given; given++) {
        if (strchr(options->command->options, *given))
            continue;
        for (int i = 0; long_options[i].name; i++)
            if (long_options[i].val == *given)
                return shef_fail(err, SHEF_ERR_INVALID, "--%s is no option of '%s'; see --help",
                                 long_options[i].name, options->command->name);
    }
    return SHEF_OK;
}

enum shef_err shef_ctl_options_parse(int argc, char **argv, struct shef_ctl_options *out_options,
                                     struct shef_error *err)
{
    const char *environment = getenv("SHEF_SOCKET");
    struct shef_ctl_options options = { .socket = environment && *environment
                                                      ? environment
                                                      : SHEF_CTL_DEFAULT_SOCKET,
                                        .interval_s = 1.0 };
    char given[16] = "";
    enum shef_err code = SHEF_OK;
    int found;

    opterr = 0;
    optind = 0; /* glibc: forget an earlier scan */
    while (code == SHEF_OK && (found = getopt_long(argc, argv, ":h", long_options, NULL)) != -1) {
        code = take_option(found, argv, &options, err);
        if (code == SHEF_OK && strchr(SOME_COMMANDS_OPTIONS, found) && !strchr(given, found))
            given[strlen(given)] = (char)found;
    }
    if (options.help) {
        options.command = find_command(argc - optind, argv + optind);
    } else if (code == SHEF_OK && !options.version) {
        code = take_words(argc - optind, argv + optind, &options, err);
        if (code == SHEF_OK)
            code = check_given(&options, given, err);
    }
    if (code == SHEF_OK)
        *out_options = options;
    else
        *out_options = (struct shef_ctl_options){ .json = options.json };
    return code;
}

static enum shef_err add_word(const struct shef_ctl_options *options, json_t *arguments,
                              struct shef_error *err)
{
    const struct shef_ctl_command *command = options->command;
    char *full = command->word_is_path ? realpath(options->word, NULL) : NULL;
    json_t *text;

    if (command->word_is_path && !full)
        return shef_fail_os(err, errno, "%s '%s'", command->name, options->word);
    text = json_string(full ? full : options->word);
    free(full);
    if (!text)
        return shef_fail(err, SHEF_ERR_INVALID, "%s '%s': the name is no UTF-8", command->name,
                         options->word);
    json_object_set_new(arguments, command->argument, text);
    return SHEF_OK;
}

enum shef_err shef_ctl_arguments(const struct shef_ctl_options *options, json_t **out_arguments,
                                 struct shef_error *err)
{
    json_t *arguments = json_object();
    enum shef_err code = SHEF_OK;

    if (options->word && options->command->argument)
        code = add_word(options, arguments, err);
    if (options->loop)
        json_object_set_new(arguments, "loop", json_true());
    if (options->pace)
        json_object_set_new(arguments, "pace", json_string(options->pace));
    if (code != SHEF_OK) {
        json_decref(arguments);
        return code;
    }
    *out_arguments = arguments;
    return SHEF_OK;
}
