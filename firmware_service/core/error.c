#include "core/error.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

void shef_keep_printable(char *text)
{
    for (unsigned char *byte = (unsigned char *)text; *byte; byte++) {
        if (byte[0] == 0xc2 && byte[1] >= 0x80 && byte[1] <= 0x9f)
            byte[0] = byte[1] = '?';
        else if (*byte < ' ' || *byte == 127)
            *byte = '?';
    }
}

enum shef_err shef_fail(struct shef_error *err, enum shef_err code, const char *fmt, ...)
{
    if (err) {
        va_list args;

        err->code = code;
        va_start(args, fmt);
        vsnprintf(err->text, sizeof err->text, fmt, args);
        va_end(args);
        shef_keep_printable(err->text);
    }
    return code;
}

static enum shef_err code_of_errno(int os_errno)
{
    switch (os_errno) {
    case ENOENT:
    case ENODEV:
    case ENXIO:
        return SHEF_ERR_NOT_FOUND;
    case EACCES:
    case EPERM:
    case EROFS:
        return SHEF_ERR_PERMISSION;
    case ENOSPC:
    case EDQUOT:
        return SHEF_ERR_NO_SPACE;
    case ENOMEM:
        return SHEF_ERR_NO_MEMORY;
    default:
        return SHEF_ERR_IO;
    }
}

enum shef_err shef_fail_os(struct shef_error *err, int os_errno, const char *fmt, ...)
{
    const enum shef_err code = code_of_errno(os_errno);

    if (err) {
        char reason[128];
        va_list args;

        err->code = code;
        va_start(args, fmt);
        vsnprintf(err->text, sizeof err->text, fmt, args);
        va_end(args);
        const size_t used = strlen(err->text);
        snprintf(err->text + used, sizeof err->text - used, ": %s",
                 strerror_r(os_errno, reason, sizeof reason));
        shef_keep_printable(err->text);
    }
    return code;
}

enum shef_err shef_fail_context(struct shef_error *err, const char *fmt, ...)
{
    char inner[SHEF_ERROR_TEXT_BYTES];
    va_list args;

    if (!err)
        return SHEF_ERR_INVALID;
    memcpy(inner, err->text, sizeof inner);
    va_start(args, fmt);
    vsnprintf(err->text, sizeof err->text, fmt, args);
    va_end(args);
    const size_t used = strlen(err->text);
    snprintf(err->text + used, sizeof err->text - used, ": %s", inner);
    shef_keep_printable(err->text);
    return err->code;
}

const char *shef_err_name(enum shef_err code)
{
    static const char *const names[] = {
        [SHEF_OK] = "ok",
        [SHEF_ERR_INVALID] = "invalid",
        [SHEF_ERR_NOT_FOUND] = "not_found",
        [SHEF_ERR_FORMAT] = "format",
        [SHEF_ERR_IO] = "io",
        [SHEF_ERR_NO_SPACE] = "no_space",
        [SHEF_ERR_PERMISSION] = "permission",
        [SHEF_ERR_NO_MEMORY] = "no_memory",
        [SHEF_ERR_TIMEOUT] = "timeout",
        [SHEF_ERR_FULL] = "full",
        [SHEF_ERR_EMPTY] = "empty",
        [SHEF_ERR_GONE] = "gone",
        [SHEF_ERR_UNSUPPORTED] = "unsupported",
    };

    return (unsigned)code < sizeof names / sizeof names[0] ? names[code] : "unknown";
}

enum shef_err shef_err_of_name(const char *name)
{
    for (int code = SHEF_OK; code <= SHEF_ERR_UNSUPPORTED; code++)
        if (strcmp(shef_err_name((enum shef_err)code), name) == 0)
            return (enum shef_err)code;
    return SHEF_ERR_INVALID;
}
