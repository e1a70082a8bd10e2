/* sheftool: the offline tool. Finds the command in one table, parses its options, runs it. */
#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sheftool/command.h"

enum { EXIT_USAGE = 2, EXIT_INTERRUPTED = 130 };

static void print_help(FILE *out)
{
    fprintf(out, "sheftool: disparity from the edges of one frame camera and one event camera\n\n"
                 "Usage: sheftool COMMAND [OPTIONS]\n"
                 "       sheftool COMMAND --help\n"
                 "       sheftool help COMMAND\n\n"
                 "Commands:\n");
    for (int i = 0; i < SHEF_N_COMMANDS; i++)
        fprintf(out, "  %-16s %s\n", shef_commands[i]->name, shef_commands[i]->summary);
    fprintf(out, "\nExit status: 0 done, 1 failed (one sentence on standard error says why),\n"
                 "2 the command line is wrong.\n");
}

static void print_command_help(const struct shef_command *command, FILE *out)
{
    const int n = fprintf(out, "Usage: sheftool %s", command->name);

    shef_options_synopsis(command->options, n, out);
    fprintf(out, "\n%s\n\nOptions:\n", command->description);
    shef_options_help(command->options, out);
}

/* Finds the command that argv names and how many words its name has. */
static const struct shef_command *find_command(int argc, char **argv, int *out_n_words)
{
    for (int i = 0; i < SHEF_N_COMMANDS; i++) {
        const char *name = shef_commands[i]->name;
        const char *gap = strchr(name, ' ');

        if (!gap && argc > 1 && strcmp(name, argv[1]) == 0) {
            *out_n_words = 1;
            return shef_commands[i];
        }
        if (gap && argc > 2 && strncmp(name, argv[1], (size_t)(gap - name)) == 0 &&
            argv[1][gap - name] == '\0' && strcmp(gap + 1, argv[2]) == 0) {
            *out_n_words = 2;
            return shef_commands[i];
        }
    }
    return NULL;
}

static bool is_help(const char *word)
{
    return strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0 || strcmp(word, "help") == 0;
}

/* Help, once printed, counts only if it arrived. */
static int end_help(void)
{
    if (fflush(stdout) == 0 && !ferror(stdout))
        return EXIT_SUCCESS;
    fprintf(stderr, "sheftool: the help cannot be written to standard output: %s\n",
            strerror(errno));
    return EXIT_FAILURE;
}

/* "bench" is the first word of several commands: names the second ones. False: it is not. */
static bool print_second_words(const char *word)
{
    const size_t n = strlen(word);
    int n_found = 0;

    for (int i = 0; i < SHEF_N_COMMANDS; i++) {
        const char *name = shef_commands[i]->name;

        if (strncmp(name, word, n) != 0 || name[n] != ' ')
            continue;
        if (n_found++ == 0)
            fprintf(stderr, "sheftool: '%s' needs a second word: %s", word, name + n + 1);
        else
            fprintf(stderr, " or %s", name + n + 1);
    }
    if (n_found > 0)
        fprintf(stderr, "; see sheftool %s --help\n", word);
    return n_found > 0;
}

/* "bench --help": of several commands. */
static bool print_group_help(const char *word)
{
    const size_t n = strlen(word);
    bool found = false;

    for (int i = 0; i < SHEF_N_COMMANDS; i++) {
        if (strncmp(shef_commands[i]->name, word, n) != 0 || shef_commands[i]->name[n] != ' ')
            continue;
        if (found)
            putchar('\n');
        print_command_help(shef_commands[i], stdout);
        found = true;
    }
    return found;
}

static int run_command(const struct shef_command *command, int argc, char **argv)
{
    struct shef_error err = { 0 };
    bool help = false;
    int status = EXIT_SUCCESS;
    void *settings = calloc(1, command->settings_bytes);

    if (!settings) {
        fprintf(stderr, "sheftool %s: out of memory\n", command->name);
        return EXIT_FAILURE;
    }
    if (shef_options_parse(command->options, settings, argc, argv, &help, &err) != SHEF_OK)
        status = EXIT_USAGE;
    else if (help)
        print_command_help(command, stdout);
    else if (command->check && command->check(settings, &err) != SHEF_OK)
        status = EXIT_USAGE;
    else if (command->run(settings, &err) != SHEF_OK)
        status = shef_interrupted() ? EXIT_INTERRUPTED : EXIT_FAILURE;
    free(settings);

    if (status == EXIT_SUCCESS && (fflush(stdout) != 0 || ferror(stdout))) {
        shef_fail_os(&err, errno, "write the results to standard output");
        status = EXIT_FAILURE;
    }
    if (status != EXIT_SUCCESS)
        fprintf(stderr, "sheftool %s: %s\n", command->name, err.text);
    return status;
}

/* "help match", "help bench", "help align fit". */
static int help_on(int argc, char **argv)
{
    int n_words;
    const struct shef_command *command = find_command(argc - 1, argv + 1, &n_words);

    if (command)
        print_command_help(command, stdout);
    else if (!print_group_help(argv[2])) {
        fprintf(stderr, "sheftool: '%s' is no command; see sheftool --help\n", argv[2]);
        return EXIT_USAGE;
    }
    return end_help();
}

int main(int argc, char **argv)
{
    int n_words = 0;
    const struct shef_command *command = find_command(argc, argv, &n_words);

    shef_interrupt_install();
    if (command)
        return run_command(command, argc - n_words, argv + n_words);
    if (argc == 2 && is_help(argv[1])) {
        print_help(stdout);
        return end_help();
    }
    if (argc == 2 && strcmp(argv[1], "--version") == 0) {
        printf("sheftool %s\n", SHEF_VERSION);
        return end_help();
    }
    if (argc == 3 && is_help(argv[2]) && print_group_help(argv[1]))
        return end_help();
    if (argc > 2 && strcmp(argv[1], "help") == 0)
        return help_on(argc, argv);
    if (argc < 2)
        print_help(stderr);
    else if (!print_second_words(argv[1]))
        fprintf(stderr, "sheftool: '%s' is no command; see sheftool --help\n", argv[1]);
    return EXIT_USAGE;
}
