#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <lcm/eventlog.h>

#include "publish/sink_internal.h"

struct log {
    lcm_eventlog_t *events;
    int64_t last_us; /* readers search by time, so that it must not step back */
};

static enum shef_err file_check(const char *url, const char *rest, struct shef_error *err)
{
    if (!*rest)
        return shef_fail(err, SHEF_ERR_INVALID, "LCM address '%s': the path of the log is missing",
                         url);
    if (strchr(rest, '?'))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "LCM address '%s': a log has no options; it is always written anew", url);
    return SHEF_OK;
}

static enum shef_err file_open(const char *url, const char *rest, void **out_handle,
                               struct shef_error *err)
{
    struct log *log = calloc(1, sizeof *log);

    if (!log)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "LCM address '%s': out of memory", url);
    errno = 0;
    log->events = lcm_eventlog_create(rest, "w");
    log->last_us = INT64_MIN;
    if (!log->events) {
        const int why = errno;

        free(log);
        return shef_fail_os(err, why, "LCM address '%s': write the log", url);
    }
    *out_handle = log;
    return SHEF_OK;
}

static enum shef_err file_send(void *handle, const char *channel, const void *bytes, size_t n_bytes,
                               int64_t utime_us, int *out_errno)
{
    struct log *log = handle;
    /* LCM's struct has no const and is only read. */
    union {
        const void *in;
        void *out;
    } data = { bytes }, name = { channel };

    if (log->last_us < utime_us)
        log->last_us = utime_us;

    lcm_eventlog_event_t event = {
        .timestamp = log->last_us,
        .channellen = (int32_t)strlen(channel),
        .datalen = (int32_t)n_bytes,
        .channel = name.out,
        .data = data.out,
    };

    errno = 0;
    if (lcm_eventlog_write_event(log->events, &event) == 0 && fflush(log->events->f) == 0)
        return SHEF_OK;
    *out_errno = errno;
    return SHEF_ERR_IO;
}

static void file_close(void *handle)
{
    struct log *log = handle;

    lcm_eventlog_destroy(log->events);
    free(log);
}

const struct shef_sink_ops shef_sink_file_ops = { "file", file_check, file_open, file_send,
                                                  file_close };
