#include "core/log.h"

#include <errno.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

static _Atomic int shown_level = SHEF_LOG_INFO;

static const char *level_name(enum shef_log_level level)
{
    switch (level) {
    case SHEF_LOG_ERROR:
        return "error";
    case SHEF_LOG_WARNING:
        return "warning";
    case SHEF_LOG_INFO:
        return "info";
    case SHEF_LOG_DEBUG:
        return "debug";
    }
    return "message";
}

/* Whether systemd reads standard error: it names the file that it has opened for that in the
 * environment, which programs started by the service inherit with other files (sd-daemon(3)). */
static bool is_journal(void)
{
    const char *stream = getenv("JOURNAL_STREAM");
    unsigned long long device, inode;
    struct stat info;

    return stream && sscanf(stream, "%llu:%llu", &device, &inode) == 2 &&
           fstat(STDERR_FILENO, &info) == 0 && info.st_dev == device && info.st_ino == inode;
}

void shef_log_set_level(enum shef_log_level level)
{
    /* Relaxed: the level orders nothing else. */
    atomic_store_explicit(&shown_level, (int)level, memory_order_relaxed);
}

void shef_log(enum shef_log_level level, const char *fmt, ...)
{
    /* Room for the prefix, the text, its line end and the terminating zero. */
    char line[16 + SHEF_LOG_LINE_BYTES + 2];
    const int saved_errno = errno;
    va_list args;

    if ((int)level > atomic_load_explicit(&shown_level, memory_order_relaxed))
        return;

    const int n_prefix =
        is_journal() ? sprintf(line, "<%d>", (int)level) : sprintf(line, "%s: ", level_name(level));
    char *text = line + n_prefix;

    va_start(args, fmt);
    const int n_wanted = vsnprintf(text, SHEF_LOG_LINE_BYTES + 1, fmt, args);
    va_end(args);
    if (n_wanted > SHEF_LOG_LINE_BYTES)
        memcpy(text + SHEF_LOG_LINE_BYTES - 3, "...", 3);

    const size_t n_text = strlen(text);

    for (size_t i = 0; i < n_text; i++)
        if (text[i] == '\n' || text[i] == '\r')
            text[i] = ' ';
    shef_keep_printable(text);
    text[n_text] = '\n';
    /* One write, so that lines of two threads do not mix. A lost message is nobody's to repair. */
    const ssize_t n_written = write(STDERR_FILENO, line, (size_t)n_prefix + n_text + 1);
    (void)n_written;
    errno = saved_errno;
}
