/* Errors: a code for the program, a sentence for the person.
 *
 * Set-up and tool code fills a struct shef_error with one sentence that says what was tried, on
 * what, why it failed and what to do. Streaming code returns the bare code. Only main programs
 * print. All functions are safe from any thread; a struct shef_error belongs to one thread. */
#ifndef SHEF_CORE_ERROR_H
#define SHEF_CORE_ERROR_H

#include <stdarg.h>

#define SHEF_MUST_CHECK                   __attribute__((warn_unused_result))
#define SHEF_PRINTF(fmt_index, first_arg) __attribute__((format(printf, fmt_index, first_arg)))

#ifdef __cplusplus
extern "C" {
#endif

enum shef_err {
    SHEF_OK = 0,
    SHEF_ERR_INVALID,     /* the input breaks a rule that the sentence names */
    SHEF_ERR_NOT_FOUND,   /* a file, device or entry is not there */
    SHEF_ERR_FORMAT,      /* bytes that are not what their format promises */
    SHEF_ERR_IO,          /* the operating system refused or failed */
    SHEF_ERR_NO_SPACE,    /* disk or quota full */
    SHEF_ERR_PERMISSION,  /* not allowed for this user */
    SHEF_ERR_NO_MEMORY,   /* an allocation at set-up failed */
    SHEF_ERR_TIMEOUT,     /* nothing came in time; call again */
    SHEF_ERR_FULL,        /* no room; nothing was written */
    SHEF_ERR_EMPTY,       /* nothing there; nothing was read */
    SHEF_ERR_GONE,        /* the device or peer has left */
    SHEF_ERR_UNSUPPORTED, /* understood, but not possible here */
};

#define SHEF_ERROR_TEXT_BYTES 512

struct shef_error {
    enum shef_err code;
    char text[SHEF_ERROR_TEXT_BYTES]; /* one sentence, no newline, cut at the end if too long */
};

/* Stores code and sentence and returns the code, so that callers write `return shef_fail(...)`.
 *   err  may be NULL: then only the code is returned */
enum shef_err shef_fail(struct shef_error *err, enum shef_err code, const char *fmt, ...)
    SHEF_PRINTF(3, 4);

/* The same for a failed system call: appends strerror(os_errno) and maps it to a code
 * (ENOENT: NOT_FOUND; EACCES, EPERM: PERMISSION; ENOSPC, EDQUOT: NO_SPACE; ENOMEM: NO_MEMORY;
 * anything else: IO). */
enum shef_err shef_fail_os(struct shef_error *err, int os_errno, const char *fmt, ...)
    SHEF_PRINTF(3, 4);

/* Puts "context: " before the sentence already in err and returns its code. */
enum shef_err shef_fail_context(struct shef_error *err, const char *fmt, ...) SHEF_PRINTF(2, 3);

/* Texts of strangers may hold anything. Line ends, escape sequences and other control characters
 * become '?', those of two bytes (U+0080 to U+009F) included. */
void shef_keep_printable(char *text);

/* The code's name for logs and JSON, e.g. "not_found". Never NULL. */
const char *shef_err_name(enum shef_err code);

/* The other way round; SHEF_ERR_INVALID for a name that is none. */
enum shef_err shef_err_of_name(const char *name);

#ifdef __cplusplus
}
#endif

#endif
