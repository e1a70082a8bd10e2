/* Ending recordings, and what is said about how they ended. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/clock.h"
#include "service/recorder_internal.h"
#include "service/recording_place.h"

/* How long a disk may take for what waits in the rings. The watchdog allows 10 s. */
#define CLOSE_WAIT_MS 4000

static bool is_closed(const struct shef_recorder *recorder)
{
    for (int i = 0; i < SHEF_TAPS; i++)
        /* Acquire: what the thread wrote to the part's recorder is visible. */
        if (atomic_load_explicit(&recorder->taps[i].phase, memory_order_acquire) != SHEF_TAP_OFF)
            return false;
    return true;
}

static void ask_to_close(struct shef_recorder *recorder)
{
    recorder->is_closing = true;
    for (int i = 0; i < SHEF_TAPS; i++) {
        int on = SHEF_TAP_ON;

        if (atomic_compare_exchange_strong(&recorder->taps[i].phase, &on, SHEF_TAP_CLOSING))
            shef_wake_signal(recorder->taps[i].wake);
    }
}

static uint64_t bytes_of(const struct shef_tap_state *tap)
{
    return shef_counter_get(&tap->n_bytes);
}

static uint64_t without_room(const struct shef_tap_state *tap)
{
    return shef_counter_get(&tap->n_lost);
}

static uint64_t unwritten(const struct shef_tap_state *tap)
{
    return shef_counter_get(&tap->n_unwritten);
}

static uint64_t lost_by(const struct shef_tap_state *tap)
{
    return without_room(tap) + unwritten(tap);
}

static uint64_t sum(const struct shef_recorder *recorder,
                    uint64_t of(const struct shef_tap_state *tap))
{
    uint64_t n = 0;

    for (int i = 0; i < SHEF_TAPS; i++)
        n += of(&recorder->taps[i]);
    return n;
}

static void fill_counts(const struct shef_recorder *recorder, struct shef_recorder_report *report)
{
    report->n_bytes = sum(recorder, bytes_of);
    report->n_lost = sum(recorder, lost_by);
}

/* ---- the verdict ------------------------------------------------------------------------- */

static void append(char *text, const char *fmt, ...) SHEF_PRINTF(2, 3);

/* Adds to a sentence of SHEF_ERROR_TEXT_BYTES. */
static void append(char *text, const char *fmt, ...)
{
    const size_t used = strlen(text);
    va_list args;

    va_start(args, fmt);
    vsnprintf(text + used, SHEF_ERROR_TEXT_BYTES - used, fmt, args);
    va_end(args);
}

/* Adds "12 sensor buffers, 3 frames" to a sentence of SHEF_ERROR_TEXT_BYTES.
 *   of  gives the number of one part */
static void append_counts(const struct shef_recorder *recorder, char *text,
                          uint64_t of(const struct shef_tap_state *tap))
{
    static const char *const things[SHEF_TAPS] = {
        [SHEF_TAP_EVENTS] = "sensor buffers",
        [SHEF_TAP_FRAMES] = "frames",
        [SHEF_TAP_POSES] = "poses",
        [SHEF_TAP_TRIGGERS] = "sync edges",
    };
    const char *comma = "";

    for (int i = 0; i < SHEF_TAPS; i++) {
        const uint64_t n = of(&recorder->taps[i]);

        if (n == 0)
            continue;
        append(text, "%s%llu %s", comma, (unsigned long long)n, things[i]);
        comma = ", ";
    }
}

/* What to do about it. */
static const char *advise(enum shef_err code)
{
    switch (code) {
    case SHEF_ERR_NO_SPACE:
        return "make room or set record.folder to another disk";
    case SHEF_ERR_PERMISSION:
    case SHEF_ERR_NOT_FOUND:
    case SHEF_ERR_GONE:
        return "leave the folder alone while it is recorded to, and record again";
    default:
        return "check the disk or set record.folder to another one";
    }
}

/* The first thing that has gone wrong, or SHEF_OK. */
static enum shef_err first_failure(const struct shef_recorder *recorder)
{
    if (recorder->stop.code != SHEF_OK)
        return recorder->stop.code;
    for (int i = 0; i < SHEF_TAPS; i++)
        if (atomic_load_explicit(&recorder->taps[i].has_failed, memory_order_acquire))
            return recorder->taps[i].failure.code;
    return SHEF_OK;
}

/* What is in no block, because nothing of its part came after it, is counted with the part. */
static void count_last_losses(struct shef_recorder *recorder)
{
    struct shef_manifest *manifest = &recorder->writer.manifest;

    for (int i = 0; i < SHEF_TAPS; i++) {
        const struct shef_tap_state *tap = &recorder->taps[i];
        const uint64_t n = shef_counter_get(&tap->n_lost_since) + unwritten(tap);

        if (i == SHEF_TAP_EVENTS)
            manifest->events.n_lost_buffers += n;
        else
            manifest->parts[SHEF_PART_EVENTS + i].n_lost += n;
    }
}

static void describe_gaps(struct shef_recorder *recorder)
{
    char *reason = recorder->writer.manifest.reason;

    *reason = '\0';
    if (sum(recorder, without_room) > 0) {
        append(reason, "the disk was too slow for ");
        append_counts(recorder, reason, without_room);
        append(reason, ", which were not written; record to a faster one");
    }
    if (sum(recorder, unwritten) > 0) {
        append(reason, "%s", *reason ? "; " : "");
        append_counts(recorder, reason, unwritten);
        append(reason, " were not as their source has said, and were not written");
    }
}

static void judge(struct shef_recorder *recorder)
{
    struct shef_manifest *manifest = &recorder->writer.manifest;
    const bool has_losses = sum(recorder, lost_by) > 0;

    count_last_losses(recorder);
    if (recorder->stop.code != SHEF_OK)
        shef_recording_writer_judge(&recorder->writer, SHEF_VERDICT_STOPPED, recorder->stop.text);
    if (has_losses)
        shef_recording_writer_judge(&recorder->writer, SHEF_VERDICT_GAPS, "");
    if (has_losses && manifest->verdict == SHEF_VERDICT_GAPS)
        describe_gaps(recorder);
    if (manifest->verdict != SHEF_VERDICT_STOPPED)
        return;
    if (has_losses) {
        append(manifest->reason, "; not written: ");
        append_counts(recorder, manifest->reason, lost_by);
    }
    append(manifest->reason, "; %s", advise(first_failure(recorder)));
}

/* The threads no longer touch the parts' recorders. */
static void close_all(struct shef_recorder *recorder)
{
    struct shef_recorder_report *last = &recorder->last;
    struct shef_error err;

    judge(recorder);
    last->verdict = recorder->writer.manifest.verdict;
    snprintf(last->reason, sizeof last->reason, "%s", recorder->writer.manifest.reason);
    if (shef_recording_writer_close(&recorder->writer, false, NULL, NULL, &err) != SHEF_OK) {
        /* The parts are whole by their indexes; what could not be written is the summary. */
        if (last->verdict != SHEF_VERDICT_STOPPED) {
            *last->reason = '\0';
            append(last->reason,
                   "end the recording: %s; what was recorded can be read, without the verdict; %s",
                   err.text, advise(err.code));
        }
        last->verdict = SHEF_VERDICT_STOPPED;
    }
    fill_counts(recorder, last);
    last->is_on = false;
    recorder->is_on = false;
}

/* ---- ending ------------------------------------------------------------------------------ */

enum shef_err shef_recorder_end(struct shef_recorder *recorder,
                                struct shef_recorder_report *out_report, struct shef_error *err)
{
    const struct shef_clock *clock = shef_clock_monotonic();
    const shef_host_time until =
        shef_host_time_add(shef_clock_now(clock), CLOSE_WAIT_MS * SHEF_NS_PER_MS);

    if (!recorder->is_on)
        return shef_fail(err, SHEF_ERR_INVALID, "record stop: nothing is being recorded");
    ask_to_close(recorder);
    while (!is_closed(recorder)) {
        const int64_t left_ns = shef_host_time_since(until, shef_clock_now(clock));

        if (left_ns <= 0)
            return shef_fail(err, SHEF_ERR_TIMEOUT,
                             "record stop '%s': its disk has not yet taken what waits; it is ended "
                             "as soon as it has, and 'status' says how",
                             recorder->last.path);
        (void)shef_wake_wait(&recorder->closed, (int32_t)(left_ns / SHEF_NS_PER_MS) + 1);
    }
    close_all(recorder);
    *out_report = recorder->last;
    return SHEF_OK;
}

void shef_recorder_report(const struct shef_recorder *recorder,
                          struct shef_recorder_report *out_report)
{
    *out_report = recorder->last;
    if (recorder->is_on)
        fill_counts(recorder, out_report);
}

bool shef_recorder_look_after(struct shef_recorder *recorder, const struct shef_config *config,
                              struct shef_recorder_report *out_report)
{
    if (!recorder->is_on)
        return false;
    if (!recorder->is_closing &&
        shef_recording_place_check_space(recorder->last.path, config, &recorder->stop) !=
            SHEF_ERR_NO_SPACE)
        recorder->stop = (struct shef_error){ 0 };
    if (!recorder->is_closing && first_failure(recorder) != SHEF_OK)
        ask_to_close(recorder);
    if (!recorder->is_closing || !is_closed(recorder))
        return false;
    close_all(recorder);
    *out_report = recorder->last;
    return true;
}

void shef_recorder_stop(struct shef_recorder *recorder)
{
    ask_to_close(recorder);
    atomic_store(&recorder->is_stopping, true);
}

void shef_recorder_finish(struct shef_recorder *recorder)
{
    /* What a source offered while it was told to stop, and all if the threads never ran. */
    for (int i = 0; i < SHEF_TAPS; i++)
        shef_recorder_serve(recorder, (enum shef_tap)i);
    if (recorder->is_on)
        close_all(recorder);
}
