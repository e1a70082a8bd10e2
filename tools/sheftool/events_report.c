/* `events info` as text. */
#include "sheftool/events_report.h"

#include <inttypes.h>

#define CHART_COLUMNS 64
#define CHART_ROWS    8
#define SHOWN_ITEMS   8 /* of gaps, hot pixels */

void shef_events_describe_kind(const struct shef_events_info *info, char *out_text, size_t n_bytes)
{
    static const char *const order[SHEF_EVT_FORMATS] = { [SHEF_EVT21_LEGACY] =
                                                             ", upper half of words first" };
    const char *tail = order[info->format] ? order[info->format] : "";

    if (info->kind == SHEF_EVENTS_DAT)
        snprintf(out_text, n_bytes, "DAT file");
    else
        snprintf(out_text, n_bytes, "%s, %s%s",
                 info->kind == SHEF_EVENTS_RAW ? "RAW file" : "recording",
                 shef_evt_format_name(info->format), tail);
}

/* The kit behind a system_ID, as its maker calls it. */
static const char *system_name(int32_t system_id)
{
    static const struct {
        uint8_t id;
        const char *name;
    } systems[] = {
        { 0x15, "EVK1 Gen3" },   { 0x1c, "EVK1 Gen3.1" }, { 0x1a, "EVK1 Gen4" },
        { 0x27, "EVK2 Gen4.1" }, { 0x28, "EVK3 Gen3.1" }, { 0x29, "EVK2 Gen3.1" },
        { 0x30, "EVK3 Gen4.1" }, { 0x31, "EVK4 IMX636" }, { 0x32, "EVK2 IMX636" },
        { 0x35, "IMX646" },      { 0x3b, "GenX320" },     { 0x40, "GenX320" },
    };

    for (size_t i = 0; i < sizeof systems / sizeof systems[0]; i++)
        if (systems[i].id == system_id)
            return systems[i].name;
    return NULL;
}

void shef_events_describe_camera(const struct shef_raw_header *camera, char *out_text,
                                 size_t n_bytes)
{
    const char *system = system_name(camera->system_id);
    const char *const parts[] = { camera->integrator, system ? system : "", camera->sensor };
    size_t n = 0;

    out_text[0] = '\0';
    for (size_t i = 0; i < sizeof parts / sizeof parts[0] && n < n_bytes; i++)
        if (*parts[i])
            n += (size_t)snprintf(out_text + n, n_bytes - n, "%s%s", n > 0 ? ", " : "", parts[i]);
    if (camera->serial[0] && n < n_bytes)
        n += (size_t)snprintf(out_text + n, n_bytes - n, "%sserial %s", n > 0 ? ", " : "",
                              camera->serial);
    if (n == 0)
        snprintf(out_text, n_bytes, "not said");
}

struct shef_rate_unit shef_rate_unit_of(double mev_per_s)
{
    static const struct shef_rate_unit units[] = { { "Mev/s", 1 }, { "kev/s", 1e3 } };

    for (size_t i = 0; i < sizeof units / sizeof units[0]; i++)
        if (mev_per_s * units[i].per_mev_s >= 1)
            return units[i];
    return (struct shef_rate_unit){ "ev/s", 1e6 };
}

/* Whether a jump in time is what a gap in the recording looks like. */
static bool is_explained(const struct shef_recorded_events *recorded,
                         const struct shef_survey_loss *loss)
{
    const struct shef_recorded_gap *gap;

    for (uint32_t i = 0; recorded && (gap = shef_recorded_events_gap(recorded, i)); i++)
        if (loss->from_us <= gap->to_us && gap->from_us <= loss->to_us)
            return true;
    return false;
}

bool shef_events_report_gap(const struct shef_events_report *report, uint32_t i,
                            struct shef_events_gap *out_gap)
{
    const struct shef_recorded_events *recorded = shef_events_source_recorded(report->source);
    const struct shef_recorded_gap *gap = recorded ? shef_recorded_events_gap(recorded, i) : NULL;
    uint32_t n = 0;

    if (gap) {
        *out_gap = (struct shef_events_gap){ gap->from_us, gap->to_us, true, gap->n_missing_blocks,
                                             gap->n_lost_buffers };
        return true;
    }
    while (recorded && shef_recorded_events_gap(recorded, n))
        n++;
    for (uint32_t k = 0; k < report->survey->n_losses; k++) {
        const struct shef_survey_loss *loss = &report->survey->losses[k];

        if (!is_explained(recorded, loss) && n++ == i) {
            *out_gap = (struct shef_events_gap){ .from_us = loss->from_us, .to_us = loss->to_us };
            return true;
        }
    }
    return false;
}

uint32_t shef_events_count_gaps(const struct shef_events_report *report)
{
    struct shef_events_gap gap;
    uint32_t n = 0;

    while (shef_events_report_gap(report, n, &gap))
        n++;
    return n;
}

/* One line: a name and what follows. */
SHEF_PRINTF(3, 4) static void line(FILE *out, const char *name, const char *fmt, ...)
{
    va_list args;

    fprintf(out, "  %-12s", name);
    va_start(args, fmt);
    vfprintf(out, fmt, args);
    va_end(args);
    fputc('\n', out);
}

static void print_head(const struct shef_events_report *report, FILE *out)
{
    const struct shef_events_info *info = shef_events_source_info(report->source);
    const struct shef_survey *survey = report->survey;
    const uint64_t n_events = survey->n_on + survey->n_off;
    const struct shef_rate_unit mean_unit = shef_rate_unit_of(shef_survey_mean_mev_per_s(survey));
    const struct shef_rate_unit peak_unit = shef_rate_unit_of(shef_survey_peak_mev_per_s(survey));
    char text[512];

    shef_events_describe_kind(info, text, sizeof text);
    fprintf(out, "%s: %s\n", report->path, text);
    shef_events_describe_camera(&info->camera, text, sizeof text);
    line(out, "camera", "%s%s%s", text, info->camera.date[0] ? ", recorded " : "",
         info->camera.date);
    if (info->size_known)
        line(out, "sensor", "%u x %u px", info->width_px, info->height_px);
    else
        line(out, "sensor", "size not said; events lie within %u x %u px", survey->used_width_px,
             survey->used_height_px);
    if (!survey->has_time) {
        line(out, "events", "none");
        return;
    }
    line(out, "duration", "%.6f s, from %.6f to %.6f s of the camera's clock",
         shef_survey_duration_s(survey), (double)survey->first_us / 1e6,
         (double)survey->last_us / 1e6);
    line(out, "events", "%" PRIu64 ", %.1f %% of them ON", n_events,
         n_events ? 100.0 * (double)survey->n_on / (double)n_events : 0.0);
    line(out, "rate", "%.3f %s in the mean, %.3f %s in the busiest millisecond (at %.3f s)",
         shef_survey_mean_mev_per_s(survey) * mean_unit.per_mev_s, mean_unit.name,
         shef_survey_peak_mev_per_s(survey) * peak_unit.per_mev_s, peak_unit.name,
         (double)survey->peak_ms / 1e3);
}

/* The rate as columns of '#'. */
static void print_chart(const struct shef_survey *survey, FILE *out)
{
    double columns[CHART_COLUMNS] = { 0 };
    double top = 0;
    const uint32_t n_bins = shef_survey_rated_bins(survey);
    const int n_columns = n_bins < CHART_COLUMNS ? (int)n_bins : (int)CHART_COLUMNS;

    /* A stream that ends within a bin has no rate to draw. */
    if (n_columns < 4)
        return;
    for (int c = 0; c < n_columns; c++) {
        const uint32_t first = (uint32_t)((uint64_t)n_bins * (uint64_t)c / n_columns);
        const uint32_t end = (uint32_t)((uint64_t)n_bins * (uint64_t)(c + 1) / n_columns);

        double length_us = 0;

        for (uint32_t i = first; i < end; i++) {
            columns[c] += (double)(survey->bins[i].n_on + survey->bins[i].n_off);
            length_us += shef_survey_bin_us(survey, i);
        }
        columns[c] /= length_us;
        top = columns[c] > top ? columns[c] : top;
    }

    const struct shef_rate_unit unit = shef_rate_unit_of(top);

    fputc('\n', out);
    for (int row = CHART_ROWS; row > 0; row--) {
        char text[CHART_COLUMNS + 1];
        int n = 0;

        for (int c = 0; c < n_columns; c++) {
            /* Half a row and more fills it; whatever is not zero shows in the lowest. */
            const bool filled =
                columns[c] * CHART_ROWS >= top * (row - 0.5) || (row == 1 && columns[c] > 0);

            text[c] = filled ? '#' : ' ';
            n = filled ? c + 1 : n;
        }
        text[n] = '\0';
        if (row == CHART_ROWS)
            fprintf(out, "  %8.3f |%s\n", top * unit.per_mev_s, text);
        else
            fprintf(out, "  %8s |%s\n", row == CHART_ROWS - 1 ? unit.name : "", text);
    }
    fprintf(out, "  %8s +", "");
    for (int c = 0; c < n_columns; c++)
        fputc('-', out);
    fprintf(out, "\n  %8s  0 s%*s%.3f s\n\n", "", n_columns - 10, "",
            shef_survey_duration_s(survey));
}

static void print_triggers(const struct shef_survey *survey, FILE *out)
{
    if (survey->n_triggers == 0)
        line(out, "triggers", "none");
    for (int i = 0; i < SHEF_SURVEY_CHANNELS; i++) {
        const struct shef_survey_channel *channel = &survey->channels[i];
        const uint64_t n_missing = shef_survey_missing_edges(survey, i);
        char interval[128] = "";
        char high[64] = "";

        if (channel->n_rising + channel->n_falling == 0)
            continue;
        if (channel->n_rising > 1)
            snprintf(interval, sizeof interval, ", every %.3f ms (%.3f to %.3f)",
                     (double)shef_survey_usual_interval_us(survey, i) / 1e3,
                     (double)channel->min_interval_us / 1e3,
                     (double)channel->max_interval_us / 1e3);
        if (channel->n_high > 0)
            snprintf(high, sizeof high, ", high for %.3f ms",
                     channel->sum_high_us / (double)channel->n_high / 1e3);
        line(out, "triggers", "channel %d: %" PRIu64 " rising, %" PRIu64 " falling%s%s", i,
             channel->n_rising, channel->n_falling, interval, high);
        if (n_missing > 0)
            line(out, "", "%" PRIu64 " rising edge%s to be missing", n_missing,
                 n_missing == 1 ? " seems" : "s seem");
    }
}

static void print_gaps(const struct shef_events_report *report, FILE *out)
{
    const struct shef_survey *survey = report->survey;
    const uint32_t n_gaps = shef_events_count_gaps(report);
    struct shef_events_gap gap;

    if (n_gaps == 0)
        line(out, "lost data", "none known");
    else
        line(out, "lost data", "%u gap%s", n_gaps, n_gaps == 1 ? "" : "s");
    for (uint32_t i = 0; i < SHOWN_ITEMS && shef_events_report_gap(report, i, &gap); i++)
        if (gap.is_recorded)
            line(out, "",
                 "between %.6f and %.6f s: %" PRIu64
                 " blocks missing, %u buffers lost while recording",
                 (double)gap.from_us / 1e6, (double)gap.to_us / 1e6, gap.n_missing_blocks,
                 gap.n_lost_buffers);
        else
            line(out, "", "between %.6f and %.6f s: time jumped", (double)gap.from_us / 1e6,
                 (double)gap.to_us / 1e6);
    if (survey->n_pauses > 0)
        line(out, "silence",
             "%" PRIu64 " pause%s of %.0f ms or more, the longest %.3f ms at %.6f s",
             survey->n_pauses, survey->n_pauses == 1 ? "" : "s", (double)survey->pause_us / 1e3,
             (double)survey->longest_us / 1e3, (double)survey->longest_at_us / 1e6);
    else
        line(out, "silence", "never %.0f ms; at most %.3f ms, at %.6f s",
             (double)survey->pause_us / 1e3, (double)survey->longest_us / 1e3,
             (double)survey->longest_at_us / 1e6);
}

static void print_violations(const struct shef_evt_stats *stats, FILE *out)
{
    int n_lines = 0;

    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        if (stats->n_violations[i] > 0)
            line(out, n_lines++ == 0 ? "violations" : "", "%" PRIu64 " x %s",
                 stats->n_violations[i], shef_evt_violation_name(i));
    if (n_lines == 0)
        line(out, "violations", "none");
    if (stats->n_resyncs > 0)
        line(out, "", "words lost their alignment %" PRIu64 " times, %" PRIu64 " bytes skipped",
             stats->n_resyncs, stats->n_bytes_skipped);
}

static void print_hot_pixels(const struct shef_events_report *report, FILE *out)
{
    if (report->n_hot == 0) {
        line(out, "hot pixels", "none above %.0f events/s", report->hot_limit_per_s);
        return;
    }
    line(out, "hot pixels", "%u above %.0f events/s", report->n_hot, report->hot_limit_per_s);
    for (uint32_t i = 0; i < report->n_hot && i < SHOWN_ITEMS; i++)
        line(out, "", "(%u, %u): %.0f events/s", report->hot[i].x_px, report->hot[i].y_px,
             report->hot[i].per_s);
    if (report->n_hot > SHOWN_ITEMS)
        line(out, "", "... (all are in --json)");
}

static void print_recording(const struct shef_events_report *report, FILE *out)
{
    const struct shef_recorded_events *recorded = shef_events_source_recorded(report->source);

    if (!recorded)
        return;

    const struct shef_recording *recording = shef_recorded_events_recording(recorded);
    const struct shef_manifest *manifest = &recording->manifest;

    if (recording->has_manifest)
        line(out, "recording", "%s, verdict %s%s%s; by %s",
             manifest->is_closed ? "closed" : "not closed", shef_verdict_name(manifest->verdict),
             *manifest->reason ? ": " : "", manifest->reason,
             *manifest->software ? manifest->software : "unknown software");
    for (int i = 0; i < recording->n_parts; i++)
        line(out, i == 0 ? "parts" : "", "%s: %" PRIu64 " files, %.3f MB", recording->parts[i].name,
             recording->parts[i].n_files, (double)recording->parts[i].n_bytes / 1e6);
    if (!report->verify)
        return;
    if (report->verify->n_problems == 0)
        line(out, "verified", "%" PRIu64 " blocks and %" PRIu64 " files are as they were recorded",
             report->verify->n_blocks, report->verify->n_files);
    else
        line(out, "verified", "%" PRIu64 " problems", report->verify->n_problems);
    for (uint64_t i = 0; i < report->verify->n_problems && i < SHEF_VERIFY_MAX_PROBLEMS; i++)
        line(out, "", "%s", report->verify->problems[i]);
}

void shef_events_report_print(const struct shef_events_report *report, FILE *out)
{
    print_head(report, out);
    if (report->survey->has_time) {
        print_chart(report->survey, out);
        print_triggers(report->survey, out);
        print_gaps(report, out);
        print_violations(&report->stats, out);
        print_hot_pixels(report, out);
    }
    print_recording(report, out);
}
