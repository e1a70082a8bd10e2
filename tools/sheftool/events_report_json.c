/* `events info` as JSON. */
#include "sheftool/events_report.h"

static const char *const kind_names[] = { "raw", "dat", "recording" };

static json_t *count(uint64_t n)
{
    return json_integer((json_int_t)n);
}

/* Texts of other people's headers may be no UTF-8; then there is none. */
static json_t *text(const char *value)
{
    json_t *object = *value ? json_string(value) : NULL;

    return object ? object : json_null();
}

static json_t *camera_json(const struct shef_raw_header *camera)
{
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "integrator", text(camera->integrator),
                     "sensor", text(camera->sensor), "serial", text(camera->serial), "plugin",
                     text(camera->plugin), "system_id",
                     camera->system_id >= 0 ? json_integer(camera->system_id) : json_null(), "date",
                     text(camera->date));
}

static json_t *rate_json(const struct shef_survey *survey)
{
    json_t *on = json_array();
    json_t *off = json_array();

    for (uint32_t i = 0; i < survey->n_bins; i++) {
        json_array_append_new(on, count(survey->bins[i].n_on));
        json_array_append_new(off, count(survey->bins[i].n_off));
    }
    return json_pack("{s:I, s:I, s:o, s:o}", "from_us", (json_int_t)survey->first_us, "bin_us",
                     (json_int_t)survey->bin_us, "on", on, "off", off);
}

static json_t *triggers_json(const struct shef_survey *survey)
{
    json_t *list = json_array();

    for (int i = 0; i < SHEF_SURVEY_CHANNELS; i++) {
        const struct shef_survey_channel *channel = &survey->channels[i];
        const bool has_interval = channel->n_rising > 1;

        if (channel->n_rising + channel->n_falling == 0)
            continue;
        json_array_append_new(
            list,
            json_pack(
                "{s:i, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "channel", i, "rising",
                count(channel->n_rising), "falling", count(channel->n_falling), "usual_interval_us",
                has_interval ? json_integer(shef_survey_usual_interval_us(survey, i)) : json_null(),
                "min_interval_us",
                has_interval ? json_integer(channel->min_interval_us) : json_null(),
                "max_interval_us",
                has_interval ? json_integer(channel->max_interval_us) : json_null(), "missing",
                count(shef_survey_missing_edges(survey, i)), "mean_high_us",
                channel->n_high > 0 ? json_real(channel->sum_high_us / (double)channel->n_high)
                                    : json_null()));
    }
    return list;
}

static json_t *gaps_json(const struct shef_events_report *report)
{
    struct shef_events_gap gap;
    json_t *list = json_array();

    for (uint32_t i = 0; shef_events_report_gap(report, i, &gap); i++)
        json_array_append_new(list,
                              json_pack("{s:s, s:I, s:I, s:o, s:I}", "kind",
                                        gap.is_recorded ? "recording" : "time jumped", "from_us",
                                        (json_int_t)gap.from_us, "to_us", (json_int_t)gap.to_us,
                                        "missing_blocks", count(gap.n_missing_blocks),
                                        "lost_buffers", (json_int_t)gap.n_lost_buffers));
    return list;
}

static json_t *pauses_json(const struct shef_survey *survey)
{
    return json_pack("{s:I, s:o, s:I, s:I}", "threshold_us", (json_int_t)survey->pause_us, "n",
                     count(survey->n_pauses), "longest_us", (json_int_t)survey->longest_us,
                     "longest_at_us", (json_int_t)survey->longest_at_us);
}

static json_t *violations_json(const struct shef_evt_stats *stats)
{
    json_t *object = json_object();

    for (int i = 0; i < SHEF_EVT_VIOLATIONS; i++)
        json_object_set_new(object, shef_evt_violation_name(i), count(stats->n_violations[i]));
    return object;
}

static json_t *hot_json(const struct shef_events_report *report)
{
    json_t *list = json_array();

    for (uint32_t i = 0; i < report->n_hot && i < SHEF_SURVEY_HOT_PIXELS; i++)
        json_array_append_new(
            list, json_pack("{s:I, s:I, s:f}", "x", (json_int_t)report->hot[i].x_px, "y",
                            (json_int_t)report->hot[i].y_px, "per_s", report->hot[i].per_s));
    return json_pack("{s:f, s:I, s:o}", "limit_per_s", report->hot_limit_per_s, "n",
                     (json_int_t)report->n_hot, "pixels", list);
}

static json_t *notes_json(const struct shef_events_source *source)
{
    json_t *list = json_array();
    const char *note;

    for (int i = 0; (note = shef_events_source_note(source, i)); i++)
        json_array_append_new(list, text(note));
    return list;
}

static json_t *damage_json(const struct shef_damage *damage)
{
    return json_pack(
        "{s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o, s:o}", "missing_blocks",
        count(damage->n_missing_blocks), "bad_blocks", count(damage->n_bad_blocks), "cut_blocks",
        count(damage->n_cut_blocks), "bad_records", count(damage->n_bad_records), "loose_bytes",
        count(damage->n_loose_bytes), "bad_segments", count(damage->n_bad_segments),
        "lost_segments", count(damage->n_lost_segments), "strange_segments",
        count(damage->n_strange_segments), "lost_buffers", count(damage->n_lost_buffers));
}

static json_t *verify_json(const struct shef_verify_report *verify)
{
    if (!verify)
        return json_null();

    json_t *problems = json_array();

    for (uint64_t i = 0; i < verify->n_problems && i < SHEF_VERIFY_MAX_PROBLEMS; i++)
        json_array_append_new(problems, text(verify->problems[i]));
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:o}", "blocks", count(verify->n_blocks), "files",
                     count(verify->n_files), "files_without_sha256",
                     count(verify->n_unhashed_files), "new_files", count(verify->n_new_files),
                     "n_problems", count(verify->n_problems), "problems", problems);
}

static json_t *recording_json(const struct shef_events_report *report)
{
    const struct shef_recorded_events *recorded = shef_events_source_recorded(report->source);

    if (!recorded)
        return json_null();

    const struct shef_recording *recording = shef_recorded_events_recording(recorded);
    const struct shef_manifest *manifest = &recording->manifest;
    const struct shef_damage damage = shef_recorded_events_damage(recorded);
    json_t *parts = json_array();

    for (int i = 0; i < recording->n_parts; i++)
        json_array_append_new(parts,
                              json_pack("{s:o, s:o, s:o}", "name", text(recording->parts[i].name),
                                        "files", count(recording->parts[i].n_files), "bytes",
                                        count(recording->parts[i].n_bytes)));
    return json_pack("{s:s, s:s, s:o, s:o, s:o, s:b, s:b, s:o, s:o, s:o}", "state",
                     !recording->has_manifest ? "unknown"
                     : manifest->is_closed    ? "closed"
                                              : "recording",
                     "verdict", shef_verdict_name(manifest->verdict), "reason",
                     text(manifest->reason), "created", text(manifest->created), "software",
                     text(manifest->software), "calibration", recording->has_calibration, "config",
                     recording->has_config, "parts", parts, "damage", damage_json(&damage),
                     "verify", verify_json(report->verify));
}

json_t *shef_events_report_json(const struct shef_events_report *report)
{
    const struct shef_events_info *info = shef_events_source_info(report->source);
    const struct shef_survey *survey = report->survey;
    const bool is_dat = info->kind == SHEF_EVENTS_DAT;
    json_t *root = json_object();

    json_object_set_new(root, "path", text(report->path));
    json_object_set_new(root, "kind", json_string(kind_names[info->kind]));
    json_object_set_new(root, "format",
                        is_dat ? json_null() : json_string(shef_evt_format_name(info->format)));
    json_object_set_new(root, "size_known", json_boolean(info->size_known));
    json_object_set_new(root, "width_px",
                        json_integer(info->size_known ? info->width_px : survey->used_width_px));
    json_object_set_new(root, "height_px",
                        json_integer(info->size_known ? info->height_px : survey->used_height_px));
    json_object_set_new(root, "camera", camera_json(&info->camera));
    json_object_set_new(root, "first_us", json_integer(survey->first_us));
    json_object_set_new(root, "last_us", json_integer(survey->last_us));
    json_object_set_new(root, "duration_s", json_real(shef_survey_duration_s(survey)));
    json_object_set_new(root, "n_events", count(survey->n_on + survey->n_off));
    json_object_set_new(root, "n_on", count(survey->n_on));
    json_object_set_new(root, "n_off", count(survey->n_off));
    json_object_set_new(root, "mean_mev_per_s", json_real(shef_survey_mean_mev_per_s(survey)));
    json_object_set_new(root, "peak_mev_per_s", json_real(shef_survey_peak_mev_per_s(survey)));
    json_object_set_new(root, "peak_at_us", json_integer(survey->peak_ms * 1000));
    json_object_set_new(root, "rate", rate_json(survey));
    json_object_set_new(root, "triggers", triggers_json(survey));
    json_object_set_new(root, "gaps", gaps_json(report));
    json_object_set_new(root, "pauses", pauses_json(survey));
    json_object_set_new(root, "n_bytes", count(report->stats.n_bytes));
    json_object_set_new(root, "violations", violations_json(&report->stats));
    json_object_set_new(root, "resyncs", count(report->stats.n_resyncs));
    json_object_set_new(root, "bytes_skipped", count(report->stats.n_bytes_skipped));
    json_object_set_new(root, "wraps", count(report->stats.n_wraps));
    json_object_set_new(root, "hot_pixels", hot_json(report));
    json_object_set_new(root, "notes", notes_json(report->source));
    json_object_set_new(root, "recording", recording_json(report));
    return root;
}
