/* One line per message on standard error.
 *
 * "warning: text"; where systemd's journal reads it with the prefix that it takes for the priority,
 * "<4>text" (sd-daemon(3)). Only main programs and control code log; streaming threads
 * count instead. Thread: any but those; lines of two threads never mix. */
#ifndef SHEF_CORE_LOG_H
#define SHEF_CORE_LOG_H

#include "core/error.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The values are syslog's. */
enum shef_log_level {
    SHEF_LOG_ERROR = 3,   /* something the user asked for did not happen */
    SHEF_LOG_WARNING = 4, /* it went on, but the user should know */
    SHEF_LOG_INFO = 6,    /* what a user expects to see in normal service */
    SHEF_LOG_DEBUG = 7,   /* for whoever looks for a fault; off by default */
};

/* Longer messages are cut here and end in "...". */
#define SHEF_LOG_LINE_BYTES 1024

/* Shows messages up to this level; INFO at first. */
void shef_log_set_level(enum shef_log_level level);

/* Writes the message if its level is shown. Line ends inside become spaces, other control
 * characters
 * '?'. */
void shef_log(enum shef_log_level level, const char *fmt, ...) SHEF_PRINTF(2, 3);

#ifdef __cplusplus
}
#endif

#endif
