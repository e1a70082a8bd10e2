#include "sheftool/events_sink.h"

#include <errno.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sheftool/events_draft.h"

/* NumPy's format, version 1.0: magic, version, length of a text, the text padded with spaces to
 * a line's end. The number of items is written last, so its place is kept. */
#define NPY_HEAD_BYTES    192
#define NPY_EVENT_BYTES   13
#define NPY_TRIGGER_BYTES 10

struct shef_sink {
    enum shef_sink_kind kind;
    struct shef_event_writer *writer; /* RAW and DAT */
    struct shef_draft events;         /* CSV and NPY */
    struct shef_draft triggers;       /* opened with the first trigger */
    char trigger_path[SHEF_PATH_BYTES];
    uint64_t n_events;
    uint64_t n_triggers;
};

enum shef_err shef_sink_kind_of(const char *path, enum shef_sink_kind *out_kind,
                                struct shef_error *err)
{
    static const char *const endings[] = { ".raw", ".dat", ".csv", ".npy" };
    const size_t n_path = strlen(path);

    for (int i = 0; i < 4; i++)
        if (n_path > 4 && strcmp(path + n_path - 4, endings[i]) == 0) {
            *out_kind = (enum shef_sink_kind)i;
            return SHEF_OK;
        }
    return shef_fail(err, SHEF_ERR_INVALID,
                     "'%s': the output's name must end in .raw, .dat, .csv or .npy, which says "
                     "what it becomes",
                     path);
}

static enum shef_err write_npy_head(struct shef_draft *draft, const char *fields, uint64_t n_items,
                                    struct shef_error *err)
{
    char head[NPY_HEAD_BYTES + 1] = "\x93NUMPY\x01";
    const int n_text = NPY_HEAD_BYTES - 10;

    head[7] = 0;
    head[8] = (char)n_text;
    head[9] = 0;
    memset(head + 10, ' ', (size_t)n_text);

    const int n = snprintf(head + 10, (size_t)n_text,
                           "{'descr': [%s], 'fortran_order': False, 'shape': (%" PRIu64 ",), }",
                           fields, n_items);

    head[10 + n] = ' ';
    head[NPY_HEAD_BYTES - 1] = '\n';
    if (fseek(draft->file, 0, SEEK_SET) != 0 ||
        fwrite(head, 1, NPY_HEAD_BYTES, draft->file) != NPY_HEAD_BYTES)
        return shef_draft_fail(draft, err);
    return SHEF_OK;
}

#define EVENT_FIELDS   "('t', '<i8'), ('x', '<i2'), ('y', '<i2'), ('p', '|u1')"
#define TRIGGER_FIELDS "('t', '<i8'), ('channel', '|u1'), ('rising', '|u1')"

static enum shef_err write_head(const struct shef_sink *sink, struct shef_draft *draft,
                                bool is_trigger, struct shef_error *err)
{
    if (sink->kind == SHEF_SINK_NPY)
        return write_npy_head(draft, is_trigger ? TRIGGER_FIELDS : EVENT_FIELDS, 0, err);
    if (fputs(is_trigger ? "t_us,channel,rising\n" : "t_us,x,y,p\n", draft->file) == EOF)
        return shef_draft_fail(draft, err);
    return SHEF_OK;
}

enum shef_err shef_sink_open(const char *path, enum shef_sink_kind kind,
                             const struct shef_event_writer_config *config,
                             struct shef_sink **out_sink, struct shef_error *err)
{
    struct shef_sink *sink = calloc(1, sizeof *sink);
    enum shef_err code;

    if (!sink)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write '%s': out of memory", path);
    sink->kind = kind;
    if (kind == SHEF_SINK_RAW || kind == SHEF_SINK_DAT) {
        code = shef_event_writer_open(path, config, &sink->writer, err);
    } else {
        snprintf(sink->trigger_path, sizeof sink->trigger_path, "%.*s_trigger%s",
                 (int)strlen(path) - 4, path, path + strlen(path) - 4);
        code = shef_draft_open(&sink->events, path, err);
        if (code == SHEF_OK)
            code = write_head(sink, &sink->events, false, err);
    }
    if (code != SHEF_OK) {
        shef_sink_abandon(sink);
        return code;
    }
    *out_sink = sink;
    return SHEF_OK;
}

static enum shef_err write_npy_events(struct shef_sink *sink, const struct shef_event_batch *batch,
                                      struct shef_error *err)
{
    for (uint32_t i = 0; i < batch->n_events; i++) {
        const struct shef_event event = batch->events[i];
        const int64_t t_us = shef_event_batch_time_us(batch, i);
        const uint16_t y_px = shef_event_y_px(event);
        uint8_t bytes[NPY_EVENT_BYTES];

        memcpy(bytes, &t_us, 8);
        memcpy(bytes + 8, &event.x_px, 2);
        memcpy(bytes + 10, &y_px, 2);
        bytes[12] = shef_event_is_on(event);
        if (fwrite(bytes, 1, sizeof bytes, sink->events.file) != sizeof bytes)
            return shef_draft_fail(&sink->events, err);
    }
    return SHEF_OK;
}

/* Writes a decimal number, returns behind it. Faster than printf, which a file of a hundred
 * million lines would wait for. */
static char *put_number(char *at, int64_t number)
{
    char digits[20];
    int n = 0;
    uint64_t rest = number < 0 ? 0 - (uint64_t)number : (uint64_t)number;

    if (number < 0)
        *at++ = '-';
    do
        digits[n++] = (char)('0' + rest % 10);
    while (rest /= 10);
    while (n > 0)
        *at++ = digits[--n];
    return at;
}

static enum shef_err write_csv_events(struct shef_sink *sink, const struct shef_event_batch *batch,
                                      struct shef_error *err)
{
    for (uint32_t i = 0; i < batch->n_events; i++) {
        const struct shef_event event = batch->events[i];
        char line[64];
        char *at = put_number(line, shef_event_batch_time_us(batch, i));

        *at++ = ',';
        at = put_number(at, event.x_px);
        *at++ = ',';
        at = put_number(at, shef_event_y_px(event));
        *at++ = ',';
        *at++ = shef_event_is_on(event) ? '1' : '0';
        *at++ = '\n';
        if (fwrite(line, 1, (size_t)(at - line), sink->events.file) != (size_t)(at - line))
            return shef_draft_fail(&sink->events, err);
    }
    return SHEF_OK;
}

static enum shef_err write_triggers(struct shef_sink *sink, const struct shef_event_batch *batch,
                                    struct shef_error *err)
{
    struct shef_draft *draft = &sink->triggers;
    enum shef_err code = SHEF_OK;

    if (batch->n_triggers > 0 && !draft->file) {
        code = shef_draft_open(draft, sink->trigger_path, err);
        if (code == SHEF_OK)
            code = write_head(sink, draft, true, err);
    }
    for (uint32_t i = 0; code == SHEF_OK && i < batch->n_triggers; i++) {
        const struct shef_trigger *trigger = &batch->triggers[i];
        uint8_t bytes[NPY_TRIGGER_BYTES];
        bool is_written;

        memcpy(bytes, &trigger->t_us, 8);
        bytes[8] = trigger->channel;
        bytes[9] = trigger->rising;
        if (sink->kind == SHEF_SINK_NPY)
            is_written = fwrite(bytes, 1, sizeof bytes, draft->file) == sizeof bytes;
        else
            is_written = fprintf(draft->file, "%" PRId64 ",%u,%d\n", trigger->t_us,
                                 trigger->channel, trigger->rising) > 0;
        if (!is_written)
            code = shef_draft_fail(draft, err);
    }
    return code;
}

enum shef_err shef_sink_write(struct shef_sink *sink, const struct shef_event_batch *batch,
                              struct shef_error *err)
{
    enum shef_err code;

    if (sink->writer)
        return shef_event_writer_write(sink->writer, batch, err);
    code = sink->kind == SHEF_SINK_NPY ? write_npy_events(sink, batch, err)
                                       : write_csv_events(sink, batch, err);
    if (code == SHEF_OK)
        code = write_triggers(sink, batch, err);
    sink->n_events += batch->n_events;
    sink->n_triggers += batch->n_triggers;
    return code;
}

static enum shef_err finish(struct shef_sink *sink, struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    if (sink->kind == SHEF_SINK_NPY) {
        code = write_npy_head(&sink->events, EVENT_FIELDS, sink->n_events, err);
        if (code == SHEF_OK && sink->triggers.file)
            code = write_npy_head(&sink->triggers, TRIGGER_FIELDS, sink->n_triggers, err);
    }
    /* The triggers first: who sees the events finds their triggers too. */
    if (code == SHEF_OK && sink->triggers.file)
        code = shef_draft_commit(&sink->triggers, err);
    if (code == SHEF_OK)
        code = shef_draft_commit(&sink->events, err);
    return code;
}

enum shef_err shef_sink_close(struct shef_sink *sink, struct shef_error *err)
{
    enum shef_err code;

    if (sink->writer) {
        code = shef_event_writer_close(sink->writer, err);
        sink->writer = NULL;
    } else {
        code = finish(sink, err);
    }
    shef_sink_abandon(sink);
    return code;
}

void shef_sink_abandon(struct shef_sink *sink)
{
    if (!sink)
        return;
    shef_event_writer_abandon(sink->writer);
    shef_draft_discard(&sink->events);
    shef_draft_discard(&sink->triggers);
    free(sink);
}
