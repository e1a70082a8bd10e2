/* shefctl: asks a running shefd and shows what it says. It knows the commands' names, their words
 * and nothing of what the answers mean. */
#include <math.h>
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "core/base64.h"
#include "core/file.h"
#include "shefctl/connection.h"
#include "shefctl/options.h"
#include "shefctl/screen.h"
#include "shefctl/show.h"

static volatile sig_atomic_t interrupted;

static void on_interrupt(int number)
{
    (void)number;
    interrupted = 1;
}

static void print_answer(const struct shef_ctl_options *options, json_t *answer, FILE *out)
{
    if (options->json) {
        json_dumpf(answer, out, JSON_INDENT(2) | JSON_REAL_PRECISION(10));
        fputc('\n', out);
    } else if (json_object_size(answer) > 0) {
        shef_show(answer, options->command->columns, out);
    } else {
        fprintf(out, "done\n");
    }
}

/* The picture goes to the file, the rest of the answer to the screen. */
static enum shef_ctl_status save_picture(const struct shef_ctl_options *options, json_t *answer,
                                         struct shef_error *err)
{
    const char *text = json_string_value(json_object_get(answer, "png_base64"));
    size_t n_bytes = 0;
    uint8_t *bytes = text ? shef_base64_decode(text, &n_bytes) : NULL;
    enum shef_err code;

    if (!bytes) {
        (void)shef_fail(err, SHEF_ERR_FORMAT, "shefd's answer holds no picture");
        return SHEF_CTL_FAILED;
    }
    code = shef_file_replace(options->word, bytes, n_bytes, err);
    free(bytes);
    json_object_del(answer, "png_base64");
    json_object_set_new(answer, "file", json_string(options->word));
    return code == SHEF_OK ? SHEF_CTL_OK : SHEF_CTL_FAILED;
}

static enum shef_ctl_status ask_once(const struct shef_ctl_options *options, json_t *arguments,
                                     struct shef_error *err)
{
    json_t *answer;
    enum shef_ctl_status status =
        shef_ctl_ask(options->socket, options->command->name, arguments, &answer, err);

    if (status != SHEF_CTL_OK)
        return status;
    if (strcmp(options->command->name, "snapshot") == 0)
        status = save_picture(options, answer, err);
    if (status == SHEF_CTL_OK)
        print_answer(options, answer, stdout);
    json_decref(answer);
    return status;
}

/* A time of day for the first line of each look. */
static void print_head(const struct shef_ctl_options *options, bool is_live, FILE *out)
{
    const time_t now = time(NULL);
    struct tm local;
    char text[32];

    localtime_r(&now, &local);
    strftime(text, sizeof text, "%H:%M:%S", &local);
    fprintf(out, "shefctl top, %s, every %g s%s\n\n", text, options->interval_s,
            is_live ? "; Ctrl-C ends it" : "");
}

/* On a terminal in place of the look before. */
static void show_live(const struct shef_ctl_options *options, json_t *answer)
{
    char *text = NULL;
    size_t n_bytes;
    int n_rows, n_columns;
    FILE *memory = open_memstream(&text, &n_bytes);

    if (!memory)
        return;
    print_head(options, true, memory);
    print_answer(options, answer, memory);
    fclose(memory);
    shef_ctl_screen_size(STDOUT_FILENO, &n_rows, &n_columns);
    shef_ctl_screen_show(text, n_rows, n_columns, stdout);
    free(text);
}

static void show_look(const struct shef_ctl_options *options, json_t *answer, long n_looks)
{
    if (!options->json && isatty(STDOUT_FILENO)) {
        show_live(options, answer);
        return;
    }
    if (!options->json && n_looks > 0)
        fputc('\n', stdout);
    if (!options->json)
        print_head(options, false, stdout);
    print_answer(options, answer, stdout);
}

static enum shef_ctl_status look_again_and_again(const struct shef_ctl_options *options,
                                                 struct shef_error *err)
{
    const struct sigaction action = { .sa_handler = on_interrupt };
    struct timespec pause;

    sigaction(SIGINT, &action, NULL);
    pause.tv_sec = (time_t)options->interval_s;
    pause.tv_nsec = (long)((options->interval_s - floor(options->interval_s)) * 1e9);
    for (long n_looks = 0; !interrupted; n_looks++) {
        json_t *answer;
        enum shef_ctl_status status;

        if (options->count > 0 && n_looks == options->count)
            break;
        if (n_looks > 0 && nanosleep(&pause, NULL) != 0)
            break;
        status = shef_ctl_ask(options->socket, options->command->name, NULL, &answer, err);
        if (status != SHEF_CTL_OK)
            return interrupted ? SHEF_CTL_OK : status;
        show_look(options, answer, n_looks);
        json_decref(answer);
        /* Nobody reads it any more, or the disk is full: main() says so. */
        if (fflush(stdout) != 0)
            break;
    }
    if (!options->json && isatty(STDOUT_FILENO))
        fputc('\n', stdout);
    return SHEF_CTL_OK;
}

static enum shef_ctl_status run(const struct shef_ctl_options *options, struct shef_error *err)
{
    json_t *arguments;
    enum shef_ctl_status status;

    if (strcmp(options->command->name, "top") == 0)
        return look_again_and_again(options, err);
    if (shef_ctl_arguments(options, &arguments, err) != SHEF_OK)
        return SHEF_CTL_FAILED;
    status = ask_once(options, arguments, err);
    json_decref(arguments);
    return status;
}

/* Programs that asked for JSON read this in place of the answer. */
static void print_error_json(const struct shef_error *err)
{
    json_t *text = json_string(err->text);
    json_t *root = json_pack("{s:{s:s, s:o}}", "error", "code", shef_err_name(err->code), "text",
                             text ? text : json_string("the reason is no UTF-8"));

    json_dumpf(root, stdout, JSON_INDENT(2));
    fputc('\n', stdout);
    fflush(stdout);
    json_decref(root);
}

int main(int argc, char **argv)
{
    struct shef_ctl_options options;
    struct shef_error err = { 0 };
    enum shef_ctl_status status = SHEF_CTL_OK;

    if (shef_ctl_options_parse(argc, argv, &options, &err) != SHEF_OK)
        status = SHEF_CTL_USAGE;
    else if (options.help)
        shef_ctl_options_help(options.command, stdout);
    else if (options.version)
        printf("shefctl %s\n", SHEF_VERSION);
    else
        status = run(&options, &err);
    if (status == SHEF_CTL_OK && (fflush(stdout) != 0 || ferror(stdout))) {
        (void)shef_fail(&err, SHEF_ERR_IO, "the answer cannot be written to standard output");
        status = SHEF_CTL_FAILED;
    }
    if (status != SHEF_CTL_OK) {
        if (options.json)
            print_error_json(&err);
        fprintf(stderr, "shefctl: %s\n", err.text);
    }
    return (int)status;
}
