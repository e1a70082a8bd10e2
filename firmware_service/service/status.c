/* The answers to `status` and `top`; docs/control.md describes them. */
#include <string.h>

#include "control/request.h"
#include "core/clock.h"
#include "service/publish_status.h"
#include "service/service_internal.h"

static json_int_t number(uint64_t n)
{
    return (json_int_t)n;
}

static json_int_t get(const shef_counter *counter)
{
    return number(shef_counter_get(counter));
}

static const char *state_name(const struct shef_service *service)
{
    static const char *const names[] = {
        [SHEF_PLAYBACK_PLAYING] = "playing",
        [SHEF_PLAYBACK_ENDED] = "ended",
        [SHEF_PLAYBACK_FAILED] = "failed",
    };

    return service->playback ? names[shef_playback_state(service->playback)] : "idle";
}

static json_t *source_to_json(const struct shef_service *service)
{
    static const char *const paces[] = {
        [SHEF_PACE_RECORDED] = "recorded",
        [SHEF_PACE_STEPPED] = "stepped",
        [SHEF_PACE_FAST] = "fast",
    };
    const struct shef_source *source;

    if (!service->playback)
        return json_pack("{s:s}", "kind", "none");
    source = shef_playback_source(service->playback);
    return json_pack("{s:s, s:o, s:s, s:b, s:f, s:f, s:I}", "kind", "recording", "path",
                     shef_control_string(source->path), "pace", paces[service->playing.source.pace],
                     "loop", (int)service->playing.source.loop, "position_s",
                     shef_playback_position_s(service->playback), "length_s",
                     (double)source->length_ns * 1e-9, "n_frames", number(source->n_frames));
}

/* ---- frames ----------------------------------------------------------------------------- */

static json_t *losses_to_json(const struct shef_counters *counters, uint64_t n_unpublished,
                              uint64_t *out_n_lost)
{
    static const char *const names[SHEF_LOSSES] = {
        [SHEF_LOSS_NO_BUFFER] = "no_buffer", [SHEF_LOSS_DAMAGED] = "damaged",
        [SHEF_LOSS_NO_PAIR] = "no_pair",     [SHEF_LOSS_SHED] = "shed",
        [SHEF_LOSS_NO_RESULT] = "no_result", [SHEF_LOSS_STOPPED] = "stopped",
    };
    json_t *object = json_object();

    *out_n_lost = n_unpublished;
    for (int i = 0; i < SHEF_LOSSES; i++) {
        const uint64_t n = shef_frames_lost(counters, (enum shef_frame_loss)i);

        json_object_set_new(object, names[i], json_integer(number(n)));
        *out_n_lost += n;
    }
    json_object_set_new(object, "not_sent", json_integer(number(n_unpublished)));
    return object;
}

static json_t *frames_to_json(const struct shef_playback *playback)
{
    const struct shef_counters *counters = shef_playback_counters(playback);
    struct shef_publisher_stats publisher;
    uint64_t n_lost;
    uint64_t n_in;
    json_t *losses;

    /* What came in is read last: in the meantime it can only have grown. */
    shef_publisher_stats(shef_playback_publisher(playback), &publisher);
    losses = losses_to_json(counters, publisher.n_unpublished, &n_lost);
    n_in = shef_counter_get(&counters->n_frames_in);
    return json_pack("{s:I, s:I, s:I, s:I, s:I, s:o, s:{s:I, s:I, s:I, s:I, s:I}, s:I, s:I, s:I}",
                     "n_in", number(n_in), "n_published", number(publisher.n_published), "n_lost",
                     number(n_lost), "n_under_way", number(n_in - publisher.n_published - n_lost),
                     "n_missing", get(&counters->n_frames_missing), "lost_by", losses, "shed_by",
                     "dense", get(&counters->n_shed[0]), "cloud", get(&counters->n_shed[1]),
                     "full_grid", get(&counters->n_shed[2]), "range", get(&counters->n_shed[3]),
                     "frame", get(&counters->n_lost[SHEF_LOSS_SHED]), "shed_level",
                     get(&counters->shed_level), "n_with_pose", get(&counters->n_with_velocity),
                     "n_ambiguous", get(&counters->n_ambiguous));
}

/* ---- status ----------------------------------------------------------------------------- */

static json_t *recording_to_json(const struct shef_service *service)
{
    struct shef_recorder_report report;
    json_t *object;

    shef_service_recording(service, &report);
    object = json_pack("{s:s, s:o, s:I, s:I}", "state", report.is_on ? "on" : "off", "path",
                       shef_control_string(report.path), "n_bytes", number(report.n_bytes),
                       "n_lost", number(report.n_lost));
    if (!report.is_on && *report.path) {
        json_object_set_new(object, "verdict", json_string(shef_verdict_name(report.verdict)));
        json_object_set_new(object, "reason", shef_control_string(report.reason));
    }
    return object;
}

static void warn(json_t *warnings, const char *text)
{
    if (*text)
        json_array_append_new(warnings, shef_control_string(text));
}

static json_t *warnings_to_json(const struct shef_service *service)
{
    json_t *warnings = json_array();
    struct shef_publisher_stats publisher;
    struct shef_error err = { 0 };
    char text[256];

    if (!service->playback)
        return warnings;
    warn(warnings, shef_playback_source(service->playback)->warning);
    if (shef_playback_outcome(service->playback, &err) != SHEF_OK)
        warn(warnings, err.text);
    shef_publisher_stats(shef_playback_publisher(service->playback), &publisher);
    shef_publisher_describe_trouble(&publisher, text, sizeof text);
    warn(warnings, text);
    if (service->is_running && !shef_graph_has_real_time(shef_playback_graph(service->playback)))
        warn(warnings, "real-time priorities are not granted: other programs may cause delays");
    return warnings;
}

static void fill_counters(struct shef_service *service, json_t *answer)
{
    const struct shef_counters *counters = shef_playback_counters(service->playback);

    json_object_set_new(answer, "frames", frames_to_json(service->playback));
    json_object_set_new(
        answer, "events",
        json_pack("{s:I, s:f, s:I, s:I, s:I, s:I, s:I}", "n_events", get(&counters->n_events),
                  "rate_mev_s", service->window.events_per_s * 1e-6, "n_buffers",
                  get(&counters->n_buffers), "n_lost_buffers", get(&counters->n_buffers_lost),
                  "n_missing_buffers", get(&counters->n_buffers_missing), "n_violations",
                  get(&counters->n_violations), "n_hot_pixels", get(&counters->n_hot_pixels)));
    json_object_set_new(answer, "triggers",
                        json_pack("{s:I, s:I, s:I, s:I, s:I, s:I}", "n_rising",
                                  get(&counters->n_rising), "n_falling", get(&counters->n_falling),
                                  "n_unpaired", get(&counters->n_unpaired_snapshots), "n_predicted",
                                  get(&counters->n_predicted), "n_snapshots",
                                  get(&counters->n_snapshots), "n_snapshots_lost",
                                  get(&counters->n_snapshots_lost)));
    json_object_set_new(answer, "n_poses", json_integer(get(&counters->n_poses)));
}

static double to_ms(int64_t ns)
{
    return (double)ns * 1e-6;
}

static void fill_latencies(const struct shef_service *service, json_t *answer)
{
    static const enum shef_window_stage spans[] = { SHEF_WINDOW_COMPLETE_TO_PUBLISH,
                                                    SHEF_WINDOW_MID_TO_PUBLISH };
    static struct shef_window_sample sample; /* large, and of the one control thread */
    json_t *latency = json_object();

    shef_window_read(service->playback, &sample, shef_clock_now(shef_clock_monotonic()));
    for (size_t i = 0; i < sizeof spans / sizeof spans[0]; i++) {
        const struct shef_latency_counts *counts = &sample.stages[spans[i]];

        json_object_set_new(latency, shef_window_stage_name(spans[i]),
                            json_pack("{s:f, s:f, s:f}", "p50_ms",
                                      to_ms(shef_latency_percentile_ns(counts, 0.5)), "p99_ms",
                                      to_ms(shef_latency_percentile_ns(counts, 0.99)), "max_ms",
                                      to_ms(counts->max_ns)));
    }
    json_object_set_new(answer, "latency", latency);
    json_object_set_new(answer, "cpu_s", json_real((double)sample.cpu_ns * 1e-9));
}

void shef_status_fill(struct shef_service *service, json_t *answer)
{
    const shef_host_time now = shef_clock_now(shef_clock_monotonic());
    const bool is_real_time = service->playback && service->is_running &&
                              shef_graph_has_real_time(shef_playback_graph(service->playback));

    json_object_set_new(answer, "state", json_string(state_name(service)));
    json_object_set_new(answer, "mode",
                        json_string(shef_depth_mode_name(
                            (enum shef_depth_mode)shef_live_get(&service->live.mode))));
    json_object_set_new(answer, "source", source_to_json(service));
    json_object_set_new(answer, "uptime_s",
                        json_real((double)shef_host_time_since(now, service->started) * 1e-9));
    if (service->playback) {
        fill_counters(service, answer);
        fill_latencies(service, answer);
        json_object_set_new(answer, "real_time", json_pack("{s:b}", "granted", (int)is_real_time));
    }
    json_object_set_new(answer, "recording", recording_to_json(service));
    json_object_set_new(answer, "memory_bytes", json_integer((json_int_t)shef_resident_bytes()));
    json_object_set_new(answer, "cpu_share", json_real(service->window.cpu_share));
    json_object_set_new(answer, "warnings", warnings_to_json(service));
}

/* ---- top -------------------------------------------------------------------------------- */

static json_t *stages_to_json(const struct shef_window *window)
{
    json_t *list = json_array();

    for (int i = 0; i < SHEF_WINDOW_STAGES && window->length_s > 0; i++) {
        const struct shef_latency_counts *counts = &window->stages[i];

        json_array_append_new(list,
                              json_pack("{s:s, s:f, s:f, s:f, s:f}", "name",
                                        shef_window_stage_name((enum shef_window_stage)i),
                                        "rate_hz", (double)counts->n_all / window->length_s,
                                        "p50_ms", to_ms(shef_latency_percentile_ns(counts, 0.5)),
                                        "p99_ms", to_ms(shef_latency_percentile_ns(counts, 0.99)),
                                        "max_ms", to_ms(counts->max_ns)));
    }
    return list;
}

static json_t *threads_to_json(const struct shef_window *window)
{
    json_t *list = json_array();

    for (int i = 0; i < SHEF_WINDOW_THREADS && window->length_s > 0; i++)
        json_array_append_new(list, json_pack("{s:s, s:f}", "name", shef_window_thread_name(i),
                                              "cpu_share", window->thread_cpu_share[i]));
    return list;
}

void shef_top_fill(struct shef_service *service, json_t *answer)
{
    const struct shef_window *window = &service->window;

    json_object_set_new(answer, "state", json_string(state_name(service)));
    json_object_set_new(answer, "window_s", json_real(window->length_s));
    json_object_set_new(answer, "frames_hz", json_real(window->frames_per_s));
    json_object_set_new(answer, "events_mev_s", json_real(window->events_per_s * 1e-6));
    json_object_set_new(answer, "cpu_share", json_real(window->cpu_share));
    json_object_set_new(answer, "memory_bytes", json_integer((json_int_t)shef_resident_bytes()));
    if (!service->playback)
        return;

    json_t *graph = shef_graph_to_json(shef_playback_graph(service->playback));

    json_object_set_new(answer, "frames", frames_to_json(service->playback));
    json_object_set_new(answer, "stages", stages_to_json(window));
    json_object_set(answer, "rings", json_object_get(graph, "rings"));
    json_object_set_new(answer, "threads", threads_to_json(window));
    json_decref(graph);
}
