#include "sheftool/cli.h"

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { EXIT_USAGE = 2, EXIT_INTERRUPTED = 130 };

static void print_help(const struct shef_program *program, FILE *out)
{
    fprintf(out,
            "%s: %s\n\n"
            "Usage: %s COMMAND [OPTIONS]\n"
            "       %s COMMAND --help\n"
            "       %s help COMMAND\n\n"
            "Commands:\n",
            program->name, program->summary, program->name, program->name, program->name);
    for (int i = 0; i < program->n_commands; i++)
        fprintf(out, "  %-16s %s\n", program->commands[i]->name, program->commands[i]->summary);
    fprintf(out, "\nExit status: 0 done, 1 failed (one sentence on standard error says why),\n"
                 "2 the command line is wrong.\n");
}

static void print_command_help(const struct shef_program *program,
                               const struct shef_command *command, FILE *out)
{
    const int n = fprintf(out, "Usage: %s %s", program->name, command->name);

    shef_options_synopsis(command->options, n, out);
    fputc('\n', out);
    shef_options_description(command->description, out);
    fprintf(out, "\nOptions:\n");
    shef_options_help(command->options, out);
}

/* Finds the command that argv names and how many words its name has. */
static const struct shef_command *find_command(const struct shef_program *program, int argc,
                                               char **argv, int *out_n_words)
{
    for (int i = 0; i < program->n_commands; i++) {
        const char *name = program->commands[i]->name;
        const char *gap = strchr(name, ' ');

        if (!gap && argc > 1 && strcmp(name, argv[1]) == 0) {
            *out_n_words = 1;
            return program->commands[i];
        }
        if (gap && argc > 2 && strncmp(name, argv[1], (size_t)(gap - name)) == 0 &&
            argv[1][gap - name] == '\0' && strcmp(gap + 1, argv[2]) == 0) {
            *out_n_words = 2;
            return program->commands[i];
        }
    }
    return NULL;
}

static bool is_help(const char *word)
{
    return strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0 || strcmp(word, "help") == 0;
}

/* Help, once printed, counts only if it arrived. */
static int end_help(const struct shef_program *program)
{
    if (fflush(stdout) == 0 && !ferror(stdout))
        return EXIT_SUCCESS;
    fprintf(stderr, "%s: the help cannot be written to standard output: %s\n", program->name,
            strerror(errno));
    return EXIT_FAILURE;
}

/* "bench" is the first word of several commands: names the second ones. False: it is not. */
static bool print_second_words(const struct shef_program *program, const char *word)
{
    const size_t n = strlen(word);
    int n_found = 0;

    for (int i = 0; i < program->n_commands; i++) {
        const char *name = program->commands[i]->name;

        if (strncmp(name, word, n) != 0 || name[n] != ' ')
            continue;
        if (n_found++ == 0)
            fprintf(stderr, "%s: '%s' needs a second word: %s", program->name, word, name + n + 1);
        else
            fprintf(stderr, " or %s", name + n + 1);
    }
    if (n_found > 0)
        fprintf(stderr, "; see %s %s --help\n", program->name, word);
    return n_found > 0;
}

/* "bench --help": of several commands. */
static bool print_group_help(const struct shef_program *program, const char *word)
{
    const size_t n = strlen(word);
    bool found = false;

    for (int i = 0; i < program->n_commands; i++) {
        if (strncmp(program->commands[i]->name, word, n) != 0 ||
            program->commands[i]->name[n] != ' ')
            continue;
        if (found)
            putchar('\n');
        print_command_help(program, program->commands[i], stdout);
        found = true;
    }
    return found;
}

static int run_command(const struct shef_program *program, const struct shef_command *command,
                       int argc, char **argv)
{
    struct shef_error err = { 0 };
    bool help = false;
    int status = EXIT_SUCCESS;
    void *settings = calloc(1, command->settings_bytes);

    if (!settings) {
        fprintf(stderr, "%s %s: out of memory\n", program->name, command->name);
        return EXIT_FAILURE;
    }
    if (shef_options_parse(command->options, settings, argc, argv, &help, &err) != SHEF_OK)
        status = EXIT_USAGE;
    else if (help)
        print_command_help(program, command, stdout);
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
        fprintf(stderr, "%s %s: %s\n", program->name, command->name, err.text);
    return status;
}

/* "help match", "help bench", "help align fit". */
static int help_on(const struct shef_program *program, int argc, char **argv)
{
    int n_words;
    const struct shef_command *command = find_command(program, argc - 1, argv + 1, &n_words);

    if (command)
        print_command_help(program, command, stdout);
    else if (!print_group_help(program, argv[2])) {
        fprintf(stderr, "%s: '%s' is no command; see %s --help\n", program->name, argv[2],
                program->name);
        return EXIT_USAGE;
    }
    return end_help(program);
}

int shef_cli_main(const struct shef_program *program, int argc, char **argv)
{
    int n_words = 0;
    const struct shef_command *command = find_command(program, argc, argv, &n_words);

    shef_interrupt_install();
    if (command)
        return run_command(program, command, argc - n_words, argv + n_words);
    if (argc == 2 && is_help(argv[1])) {
        print_help(program, stdout);
        return end_help(program);
    }
    if (argc == 2 && strcmp(argv[1], "--version") == 0) {
        printf("%s %s\n", program->name, SHEF_VERSION);
        return end_help(program);
    }
    if (argc == 3 && is_help(argv[2]) && print_group_help(program, argv[1]))
        return end_help(program);
    if (argc > 2 && strcmp(argv[1], "help") == 0)
        return help_on(program, argc, argv);
    if (argc < 2)
        print_help(program, stderr);
    else if (!print_second_words(program, argv[1]))
        fprintf(stderr, "%s: '%s' is no command; see %s --help\n", program->name, argv[1],
                program->name);
    return EXIT_USAGE;
}
