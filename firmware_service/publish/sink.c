#include "publish/sink.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "publish/sink_internal.h"

struct shef_sink {
    const struct shef_sink_ops *ops;
    char *url;
    const char *rest; /* of url, behind "://" */
    void *handle;     /* NULL: not connected */
};

static const struct shef_sink_ops *const kinds[] = {
    &shef_sink_udpm_ops,
    &shef_sink_file_ops,
    &shef_sink_memq_ops,
};

enum shef_err shef_sink_create(const char *url, struct shef_sink **out_sink, struct shef_error *err)
{
    const char *separator = strstr(url, "://");
    const struct shef_sink_ops *ops = NULL;

    for (size_t i = 0; separator && i < sizeof kinds / sizeof kinds[0]; i++) {
        const size_t n_bytes = (size_t)(separator - url);

        if (strlen(kinds[i]->scheme) == n_bytes && strncmp(kinds[i]->scheme, url, n_bytes) == 0)
            ops = kinds[i];
    }
    if (!ops)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "LCM address '%s': it must begin with udpm://, file:// or memq://", url);

    const enum shef_err checked = ops->check(url, separator + 3, err);

    if (checked)
        return checked;

    struct shef_sink *sink = calloc(1, sizeof *sink);

    if (sink)
        sink->url = strdup(url);
    if (!sink || !sink->url) {
        free(sink);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "LCM address '%s': out of memory", url);
    }
    sink->ops = ops;
    sink->rest = strstr(sink->url, "://") + 3;
    *out_sink = sink;
    return SHEF_OK;
}

void shef_sink_destroy(struct shef_sink *sink)
{
    if (!sink)
        return;
    if (sink->handle)
        sink->ops->close(sink->handle);
    free(sink->url);
    free(sink);
}

enum shef_err shef_sink_connect(struct shef_sink *sink, struct shef_error *err)
{
    if (sink->handle)
        return SHEF_OK;
    return sink->ops->open(sink->url, sink->rest, &sink->handle, err);
}

bool shef_sink_is_connected(const struct shef_sink *sink)
{
    return sink->handle != NULL;
}

enum shef_err shef_sink_send(struct shef_sink *sink, const char *channel, const void *bytes,
                             size_t n_bytes, int64_t utime_us, int *out_errno)
{
    assert(sink->handle);
    return sink->ops->send(sink->handle, channel, bytes, n_bytes, utime_us, out_errno);
}
