/* sheftool events convert: event files of one kind into another. */
#include <inttypes.h>
#include <stdio.h>
#include <sys/stat.h>

#include "core/cpu.h"
#include "sheftool/command.h"
#include "sheftool/events_sink.h"
#include "sheftool/events_source.h"
#include "sheftool/progress.h"

enum format_choice {
    FORMAT_AUTO,
    FORMAT_EVT2,
    FORMAT_EVT21,
    FORMAT_EVT3,
};

struct settings {
    const char *in;
    const char *out;
    int32_t format;
};

static const struct shef_option options[] = {
    SHEF_OPT_WORD("SOURCE", struct settings, in, true,
                  "a RAW file, a DAT file, or the folder of a recording"),
    SHEF_OPT_WORD("RESULT", struct settings, out, true,
                  "what to write: a name that ends in .raw, .dat, .csv or .npy"),
    SHEF_OPT_CHOICE("format", struct settings, format, "auto|evt2|evt21|evt3", "auto",
                    "encoding of a .raw file; auto keeps the source's, EVT3 for a DAT file"),
    SHEF_OPT_END,
};

static enum shef_err check(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    enum shef_sink_kind kind;
    const enum shef_err code = shef_sink_kind_of(settings->out, &kind, err);

    if (code != SHEF_OK)
        return code;
    if (settings->format != FORMAT_AUTO && kind != SHEF_SINK_RAW)
        return shef_fail(err, SHEF_ERR_INVALID, "--format goes with a result that ends in .raw");
    return SHEF_OK;
}

static enum shef_err refuse_same_file(const struct settings *settings, struct shef_error *err)
{
    struct stat in;
    struct stat out;

    if (stat(settings->in, &in) == 0 && stat(settings->out, &out) == 0 && in.st_dev == out.st_dev &&
        in.st_ino == out.st_ino)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' is the source itself; give the result another name", settings->out);
    if (stat(settings->out, &out) == 0 && !S_ISREG(out.st_mode))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "'%s' exists and is no file; give the result another name", settings->out);
    return SHEF_OK;
}

static enum shef_evt_format pick_format(const struct settings *settings,
                                        const struct shef_events_info *info)
{
    static const enum shef_evt_format formats[] = {
        [FORMAT_EVT2] = SHEF_EVT2, [FORMAT_EVT21] = SHEF_EVT21, [FORMAT_EVT3] = SHEF_EVT3
    };

    if (settings->format != FORMAT_AUTO)
        return formats[settings->format];
    return info->kind == SHEF_EVENTS_DAT ? SHEF_EVT3 : info->format;
}

struct copied {
    uint64_t n_events;
    uint64_t n_triggers;
    int64_t first_us; /* of the first batch's first event, or trigger if it has none */
};

static enum shef_err copy_events(struct shef_events_source *source, struct shef_sink *sink,
                                 struct copied *copied, struct shef_error *err)
{
    static struct shef_event events[SHEF_EVENTS_BATCH];
    struct shef_event_batch batch = { .events = events, .capacity = SHEF_EVENTS_BATCH };
    struct shef_progress progress;
    enum shef_err code;

    shef_progress_begin(&progress, "converting", 1000);
    while ((code = shef_events_source_next(source, &batch, err)) == SHEF_OK) {
        code = shef_sink_write(sink, &batch, err);
        if (code != SHEF_OK)
            break;
        if (copied->n_events + copied->n_triggers == 0)
            copied->first_us =
                batch.n_events > 0 ? shef_event_batch_time_us(&batch, 0) : batch.triggers[0].t_us;
        copied->n_events += batch.n_events;
        copied->n_triggers += batch.n_triggers;
        shef_progress_step(&progress, (int64_t)(1000 * shef_events_source_progress(source)));
    }
    shef_progress_end(&progress);
    return code == SHEF_ERR_EMPTY ? SHEF_OK : code;
}

/* Says what in the source broke its format where that loses data. The reader's own notes tell of
 * the other classes. */
static void note_violations(const char *path, const struct shef_evt_stats *stats)
{
    static const enum shef_evt_violation classes[] = { SHEF_EVT_TIME_GAP, SHEF_EVT_NO_ROW,
                                                       SHEF_EVT_BAD_VECTOR, SHEF_EVT_UNKNOWN_WORD };
    int n_named = 0;

    for (size_t i = 0; i < sizeof classes / sizeof classes[0]; i++) {
        const uint64_t n = stats->n_violations[classes[i]];

        if (n == 0)
            continue;
        if (n_named++ == 0)
            fprintf(stderr, "note: '%s' breaks its format: ", path);
        else
            fputs(", ", stderr);
        fprintf(stderr, "%" PRIu64 " x %s", n, shef_evt_violation_name(classes[i]));
    }
    if (n_named > 0)
        fputs("; all else was converted\n", stderr);
}

/* Says so if readers of the result take its first event for an earlier one. */
static void note_lost_time(const char *path, enum shef_sink_kind kind, enum shef_evt_format format,
                           int64_t first_us)
{
    int n_bits;

    if (kind == SHEF_SINK_DAT)
        n_bits = 32;
    else if (kind == SHEF_SINK_RAW)
        n_bits = format == SHEF_EVT3 ? 24 : 34;
    else
        return;

    const int64_t range_us = (int64_t)1 << n_bits;
    const int64_t seen_us = first_us & (range_us - 1);

    if (seen_us != first_us)
        fprintf(stderr,
                "note: '%s': its format repeats times every %.0f s, so it begins at %.6f s instead "
                "of %.6f s\n",
                path, 1e-6 * (double)range_us, 1e-6 * (double)seen_us, 1e-6 * (double)first_us);
}

static enum shef_err convert(const struct settings *settings, struct shef_events_source *source,
                             enum shef_sink_kind kind, struct shef_event_writer_config *config,
                             struct shef_error *err)
{
    const struct shef_events_info *info = shef_events_source_info(source);
    struct shef_sink *sink;
    struct copied copied = { .n_events = 0 };

    config->is_raw = kind == SHEF_SINK_RAW;
    config->date = info->camera.date[0] ? info->camera.date : NULL;
    config->format = pick_format(settings, info);
    config->ticks = SHEF_EVT_TICKS_SENSOR;
    config->generation = SHEF_RAW_NEW;
    config->like = info->kind == SHEF_EVENTS_DAT ? NULL : &info->camera;

    enum shef_err code = shef_sink_open(settings->out, kind, config, &sink, err);

    if (code != SHEF_OK)
        return code;
    code = copy_events(source, sink, &copied, err);
    if (code == SHEF_OK)
        code = shef_sink_close(sink, err);
    else
        shef_sink_abandon(sink);
    if (code != SHEF_OK)
        return code;
    printf("%" PRIu64 " events, %" PRIu64 " triggers\n", copied.n_events, copied.n_triggers);
    shef_events_source_print_notes(source);

    const struct shef_evt_stats stats = shef_events_source_stats(source);

    note_violations(settings->in, &stats);
    note_lost_time(settings->out, kind, config->format, copied.first_us);
    return SHEF_OK;
}

static enum shef_err run(const void *opaque, struct shef_error *err)
{
    const struct settings *settings = opaque;
    struct shef_event_writer_config config = { .width_px = 0 };
    struct shef_events_source *source;
    enum shef_sink_kind kind;
    enum shef_err code = shef_sink_kind_of(settings->out, &kind, err);

    if (code == SHEF_OK)
        code = refuse_same_file(settings, err);
    if (code == SHEF_OK)
        code = shef_events_source_open(settings->in, shef_cpu_features(), &source, err);
    if (code != SHEF_OK)
        return code;
    /* Only the headers of event files say a size. */
    if (kind == SHEF_SINK_RAW || kind == SHEF_SINK_DAT)
        code =
            shef_events_source_size(source, settings->in, &config.width_px, &config.height_px, err);
    if (code == SHEF_OK)
        code = convert(settings, source, kind, &config, err);
    shef_events_source_close(source);
    return code;
}

const struct shef_command shef_command_events_convert = {
    .name = "events convert",
    .summary = "event files of one kind into another",
    .description =
        "Writes all events and triggers of the source in the form that the result's name asks for:\n"
        ".raw (EVT2, EVT2.1 or EVT3), .dat, .csv (t_us,x,y,p) or .npy (t i8 in us, x i2, y i2,\n"
        "p u1). Except in .raw, triggers go to a file of their own, NAME_trigger. What a damaged\n"
        "or cut source still holds is converted; notes on standard error say what is wrong with\n"
        "it. Other words of the sensor, such as its monitors, are not kept.",
    .options = options,
    .settings_bytes = sizeof(struct settings),
    .check = check,
    .run = run,
};
