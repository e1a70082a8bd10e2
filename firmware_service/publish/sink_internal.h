/* What the kinds of sinks implement. */
#ifndef SHEF_PUBLISH_SINK_INTERNAL_H
#define SHEF_PUBLISH_SINK_INTERNAL_H

#include "publish/sink.h"

struct shef_sink_ops {
    const char *scheme; /* as in the address, before "://" */
    /* Refuses an address that can never work.
     *   rest  behind "://" */
    enum shef_err (*check)(const char *url, const char *rest, struct shef_error *err);
    enum shef_err (*open)(const char *url, const char *rest, void **out_handle,
                          struct shef_error *err);
    enum shef_err (*send)(void *handle, const char *channel, const void *bytes, size_t n_bytes,
                          int64_t utime_us, int *out_errno);
    void (*close)(void *handle);
};

extern const struct shef_sink_ops shef_sink_udpm_ops;
extern const struct shef_sink_ops shef_sink_memq_ops;
extern const struct shef_sink_ops shef_sink_file_ops;

#endif
