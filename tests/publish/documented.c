#include "documented.h"

#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "support/support.h"

#define FENCE "```"

static char folder[PATH_MAX];

char *documented_read(const char *path)
{
    char full[2 * PATH_MAX];
    char *text;
    FILE *file;
    size_t n;

    snprintf(full, sizeof full, "%s/%s", *path == '/' ? "" : documented_folder(), path);
    file = fopen(full, "r");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, full);
    text = calloc(1, 1 << 20);
    TEST_ASSERT_NOT_NULL(text);
    n = fread(text, 1, (1 << 20) - 1, file);
    TEST_ASSERT_GREATER_THAN_size_t_MESSAGE(0, n, full);
    fclose(file);
    return text;
}

/* The first block after a fence of that kind that has these words in it. */
static const char *find_block(const char *kind, const char *words)
{
    static char block[1 << 16];
    char *page = documented_read(shef_test_source("docs/lcm.md"));
    char fence[32];
    char *at = page;

    snprintf(fence, sizeof fence, "\n" FENCE "%s\n", kind);
    *block = '\0';
    while (*block == '\0' && (at = strstr(at, "\n" FENCE))) {
        char *begin = strchr(at + 1, '\n') + 1;
        char *end = strstr(begin - 1, "\n" FENCE);

        TEST_ASSERT_NOT_NULL_MESSAGE(end, "a block without an end");
        end[0] = '\0';
        if (strncmp(at, fence, strlen(fence)) == 0 && strstr(begin, words))
            snprintf(block, sizeof block, "%s\n", begin);
        at = end + 1 + strlen(FENCE);
    }
    TEST_ASSERT_TRUE_MESSAGE(*block != '\0', words);
    free(page);
    return block;
}

const char *documented_commands(const char *words)
{
    (void)documented_folder(); /* which uses the same block */
    return find_block("", words);
}

static void write_example(const char *name, const char *kind)
{
    char path[2 * PATH_MAX];
    FILE *file;

    snprintf(path, sizeof path, "%s/docs/examples/%s", folder, name);
    file = fopen(path, "w");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, fputs(find_block(kind, "lcm"), file));
    fclose(file);
}

const char *documented_folder(void)
{
    char self[PATH_MAX] = "", commands[8 * PATH_MAX];

    if (*folder)
        return folder;
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path("checkout"));
    TEST_ASSERT_GREATER_THAN_INT64(0, readlink("/proc/self/exe", self, sizeof self - 1));
    *strrchr(self, '/') = '\0'; /* its folder is tests/ of the build */
    *strrchr(self, '/') = '\0';
    snprintf(commands, sizeof commands,
             "mkdir -p '%s/docs/examples' '%s/build' && cd '%s' && ln -s '%s' build/release && "
             "ln -s '%s' lcm_types",
             folder, folder, folder, self, shef_test_source("lcm_types"));
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, system(commands), commands);
    write_example("subscriber.c", "c");
    write_example("subscriber.py", "python");
    return folder;
}

void documented_run(const char *commands)
{
    static char said[1 << 14];
    char line[1 << 15];
    FILE *pipe;
    size_t n;

    snprintf(line, sizeof line, "cd '%s' && exec 2>&1 && set -e\n%s", documented_folder(),
             commands);
    pipe = popen(line, "r");
    TEST_ASSERT_NOT_NULL(pipe);
    n = fread(said, 1, sizeof said - 1, pipe);
    said[n] = '\0';
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, pclose(pipe), said);
}
