#include "codecs/event_writer.h"

#include <assert.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "codecs/dat.h"

#define BUFFER_BYTES 65536

/* A file under a temporary name. */
struct draft {
    char *path;
    char *part; /* path.part */
    FILE *file;
};

struct shef_event_writer {
    struct shef_event_writer_config config;
    char date[32];
    struct draft events;
    struct draft triggers; /* DAT only, opened with the first trigger */
    struct shef_evt_encoder encoder;
    uint64_t n_events;     /* in batches written so far */
    enum shef_err failure; /* of a write */
    struct shef_error failure_text;
    uint8_t buffer[BUFFER_BYTES];
};

_Static_assert(BUFFER_BYTES >= SHEF_RAW_HEADER_BYTES && BUFFER_BYTES >= SHEF_DAT_HEADER_BYTES,
               "headers fit the buffer");

static enum shef_err open_draft(struct draft *draft, const char *path, struct shef_error *err)
{
    draft->path = strdup(path);
    if (!draft->path || asprintf(&draft->part, "%s.part", path) < 0) {
        draft->part = NULL;
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write '%s': out of memory", path);
    }
    draft->file = fopen(draft->part, "wbe");
    if (!draft->file)
        return shef_fail_os(err, errno, "create event file '%s'", draft->part);
    return SHEF_OK;
}

static enum shef_err append(struct draft *draft, const uint8_t *bytes, size_t n_bytes,
                            struct shef_error *err)
{
    if (fwrite(bytes, 1, n_bytes, draft->file) != n_bytes)
        return shef_fail_os(err, errno, "write event file '%s'", draft->part);
    return SHEF_OK;
}

/* Gives a complete draft its name. */
static enum shef_err commit(struct draft *draft, struct shef_error *err)
{
    FILE *const file = draft->file;

    if (!file)
        return SHEF_OK;
    /* The disk has the data before they get the name: a power cut leaves no empty file. */
    if (fflush(file) != 0 || fsync(fileno(file)) != 0)
        return shef_fail_os(err, errno, "write event file '%s'", draft->part);
    draft->file = NULL;
    if (fclose(file) != 0)
        return shef_fail_os(err, errno, "write event file '%s'", draft->part);
    if (rename(draft->part, draft->path) != 0)
        return shef_fail_os(err, errno, "rename '%s' to '%s'", draft->part, draft->path);
    free(draft->part);
    draft->part = NULL;
    return SHEF_OK;
}

/* Removes what is not committed. */
static void discard(struct draft *draft)
{
    if (draft->file)
        fclose(draft->file);
    if (draft->part)
        unlink(draft->part);
    free(draft->part);
    free(draft->path);
}

static enum shef_err write_raw_header(struct shef_event_writer *writer, struct shef_error *err)
{
    const struct shef_event_writer_config *config = &writer->config;
    struct shef_raw_header header = { .system_id = -1 };
    char text[SHEF_RAW_HEADER_BYTES];

    if (config->like)
        header = *config->like;
    header.format = config->format;
    header.width_px = config->width_px;
    header.height_px = config->height_px;
    snprintf(header.date, sizeof header.date, "%s", config->date);

    const size_t n_bytes = shef_raw_header_write(&header, config->generation, text);

    return append(&writer->events, (const uint8_t *)text, n_bytes, err);
}

static enum shef_err write_dat_header(struct shef_event_writer *writer, struct draft *draft,
                                      enum shef_dat_content content, struct shef_error *err)
{
    struct shef_dat_header header = {
        .content = content,
        .width_px = writer->config.width_px,
        .height_px = writer->config.height_px,
    };

    snprintf(header.date, sizeof header.date, "%s", writer->config.date);
    return append(draft, writer->buffer, shef_dat_header_write(&header, writer->buffer), err);
}

enum shef_err shef_event_writer_open(const char *path,
                                     const struct shef_event_writer_config *config,
                                     struct shef_event_writer **out_writer, struct shef_error *err)
{
    const uint32_t max_side_px = config->is_raw ? 2048 : SHEF_DAT_MAX_SIDE_PX;

    if (config->width_px < 1 || config->width_px > max_side_px || config->height_px < 1 ||
        config->height_px > max_side_px)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "write '%s': a sensor of %u x %u px; sides must be 1 to %u", path,
                         config->width_px, config->height_px, max_side_px);

    struct shef_event_writer *writer = calloc(1, sizeof *writer);

    if (!writer)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write '%s': out of memory", path);
    writer->config = *config;
    if (config->date) {
        snprintf(writer->date, sizeof writer->date, "%s", config->date);
    } else {
        const time_t now = time(NULL);
        struct tm utc;

        strftime(writer->date, sizeof writer->date, "%Y-%m-%d %H:%M:%S", gmtime_r(&now, &utc));
    }
    writer->config.date = writer->date;

    enum shef_err code = open_draft(&writer->events, path, err);

    if (code == SHEF_OK) {
        if (config->is_raw)
            code = write_raw_header(writer, err);
        else
            code = write_dat_header(writer, &writer->events, SHEF_DAT_EVENTS, err);
    }
    if (code != SHEF_OK) {
        shef_event_writer_abandon(writer);
        return code;
    }
    if (config->is_raw)
        shef_evt_encoder_init(&writer->encoder, config->format, config->ticks, config->width_px,
                              config->height_px);
    *out_writer = writer;
    return SHEF_OK;
}

/* Says which item of the batch the encoder has stopped at. */
static enum shef_err refuse_item(const struct shef_event_writer *writer,
                                 const struct shef_event_batch *batch, struct shef_error *err)
{
    const struct shef_evt_encoder *encoder = &writer->encoder;
    const char *const name = shef_evt_format_name(writer->config.format);

    if (encoder->at_trigger < batch->n_triggers &&
        batch->triggers[encoder->at_trigger].n_before <= encoder->at_event) {
        const struct shef_trigger trigger = batch->triggers[encoder->at_trigger];

        return shef_fail(err, SHEF_ERR_INVALID,
                         "write '%s': %s cannot hold the trigger on channel %u at %lld us: the "
                         "channel is too high or time went back too far",
                         writer->events.path, name, trigger.channel, (long long)trigger.t_us);
    }

    const struct shef_event event = batch->events[encoder->at_event];

    return shef_fail(err, SHEF_ERR_INVALID,
                     "write '%s': %s cannot hold event %llu at (%u, %u) and %lld us: it lies "
                     "outside the %u x %u px sensor or time went back too far",
                     writer->events.path, name,
                     (unsigned long long)(writer->n_events + encoder->at_event), event.x_px,
                     shef_event_y_px(event),
                     (long long)shef_event_batch_time_us(batch, encoder->at_event),
                     writer->config.width_px, writer->config.height_px);
}

static enum shef_err write_raw(struct shef_event_writer *writer,
                               const struct shef_event_batch *batch, struct shef_error *err)
{
    enum shef_err code;

    do {
        size_t n_bytes;

        code = shef_evt_encode(&writer->encoder, batch, writer->buffer, BUFFER_BYTES, &n_bytes);
        if (code == SHEF_ERR_INVALID)
            return refuse_item(writer, batch, err);

        const enum shef_err write_code = append(&writer->events, writer->buffer, n_bytes, err);

        if (write_code != SHEF_OK)
            return write_code;
    } while (code == SHEF_ERR_FULL);
    return SHEF_OK;
}

/* Where the triggers of a DAT file go: NAME_td.dat and NAME_cd.dat to NAME_trigger.dat, anything
 * else to PATH_trigger.dat. */
static enum shef_err open_triggers(struct shef_event_writer *writer, struct shef_error *err)
{
    const char *const path = writer->events.path;
    size_t n_name = strlen(path);
    char *trigger_path;

    if (n_name > 4 && strcmp(path + n_name - 4, ".dat") == 0)
        n_name -= 4;
    if (n_name > 3 &&
        (strncmp(path + n_name - 3, "_td", 3) == 0 || strncmp(path + n_name - 3, "_cd", 3) == 0))
        n_name -= 3;
    if (asprintf(&trigger_path, "%.*s_trigger.dat", (int)n_name, path) < 0)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write '%s': out of memory", path);

    enum shef_err code = open_draft(&writer->triggers, trigger_path, err);

    free(trigger_path);
    if (code == SHEF_OK)
        code = write_dat_header(writer, &writer->triggers, SHEF_DAT_TRIGGERS, err);
    return code;
}

static enum shef_err write_dat(struct shef_event_writer *writer,
                               const struct shef_event_batch *batch, struct shef_error *err)
{
    struct shef_event_batch piece = *batch;

    for (uint32_t i = 0; i < batch->n_events; i += piece.n_events) {
        const uint32_t n_left = batch->n_events - i;

        piece.events = batch->events + i;
        piece.n_events = n_left < BUFFER_BYTES / 8 ? n_left : BUFFER_BYTES / 8;

        const size_t n_bytes = shef_dat_encode(SHEF_DAT_EVENTS, &piece, writer->buffer);
        const enum shef_err code = append(&writer->events, writer->buffer, n_bytes, err);

        if (code != SHEF_OK)
            return code;
    }
    if (batch->n_triggers == 0)
        return SHEF_OK;
    if (!writer->triggers.file) {
        const enum shef_err code = open_triggers(writer, err);

        if (code != SHEF_OK)
            return code;
    }
    return append(&writer->triggers, writer->buffer,
                  shef_dat_encode(SHEF_DAT_TRIGGERS, batch, writer->buffer), err);
}

enum shef_err shef_event_writer_write(struct shef_event_writer *writer,
                                      const struct shef_event_batch *batch, struct shef_error *err)
{
    assert(writer->failure == SHEF_OK);
    writer->failure = writer->config.is_raw ? write_raw(writer, batch, &writer->failure_text)
                                            : write_dat(writer, batch, &writer->failure_text);
    if (writer->failure != SHEF_OK && err)
        *err = writer->failure_text;
    writer->n_events += batch->n_events;
    return writer->failure;
}

enum shef_err shef_event_writer_close(struct shef_event_writer *writer, struct shef_error *err)
{
    const bool has_triggers = writer->triggers.file != NULL;
    enum shef_err code = writer->failure;

    if (code == SHEF_OK)
        code = commit(&writer->triggers, err);
    else if (err)
        *err = writer->failure_text;
    if (code == SHEF_OK) {
        code = commit(&writer->events, err);
        if (code != SHEF_OK && has_triggers)
            unlink(writer->triggers.path);
    }
    shef_event_writer_abandon(writer);
    return code;
}

void shef_event_writer_abandon(struct shef_event_writer *writer)
{
    if (!writer)
        return;
    discard(&writer->events);
    discard(&writer->triggers);
    free(writer);
}
