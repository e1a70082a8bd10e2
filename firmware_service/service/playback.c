#include "service/playback.h"

#include <stdlib.h>
#include <time.h>

#include "core/log.h"
#include "core/memory.h"
#include "service/playback_internal.h"

/* Results: one in the making, one in the publisher's hands, the newest for pictures, one that a
 * picture is made of; and RESULTS_WAITING for the publisher, which may stand still for 90 ms: three
 * times the age at which frames are left out. Dense images are there for what is in hands: a
 * publisher that lets them wait is to get fewer of these first. */
#define RESULTS_WAITING  5
#define RESULTS_IN_HANDS 4
#define N_RESULTS        (RESULTS_WAITING + RESULTS_IN_HANDS)
#define N_DENSE          RESULTS_IN_HANDS

/* Playing begins this much after the threads have started, so that none is late for it. */
#define START_DELAY_NS (20 * SHEF_NS_PER_MS)

static int64_t utc_minus_mono_ns(void)
{
    struct timespec utc;

    clock_gettime(CLOCK_REALTIME, &utc);
    return utc.tv_sec * SHEF_NS_PER_S + utc.tv_nsec - shef_clock_now(shef_clock_monotonic()).ns;
}

/* ---- the helpers of the stereo thread ---------------------------------------------------- */

struct team {
    int32_t n_threads;
    struct shef_workers *workers;
    struct shef_error err;
};

static void make_team(void *context)
{
    struct team *team = context;

    team->workers = shef_workers_create_sized(team->n_threads, SHEF_THREAD_STACK_BYTES, &team->err);
}

/* Helpers inherit name, policy, priority and processor from whoever makes them, which is a thread
 * that has those of the table. */
static enum shef_err create_workers(struct shef_playback *playback, struct shef_error *err)
{
    const struct shef_thread_params params =
        shef_thread_params_of(&playback->config, SHEF_THREAD_WORKERS, "workers");
    struct team team = { .n_threads = playback->config.depth.workers };
    struct shef_thread thread;
    enum shef_err code;

    if (team.n_threads < 2)
        return SHEF_OK;
    code = shef_thread_start(&thread, &params, make_team, &team, err);
    if (code != SHEF_OK)
        return code;
    shef_thread_join(&thread);
    playback->workers = team.workers;
    if (!team.workers)
        *err = team.err;
    return team.workers ? SHEF_OK : err->code;
}

/* ---- create ----------------------------------------------------------------------------- */

static enum shef_err create_stages(struct shef_playback *playback, struct shef_error *err)
{
    const bool is_live = shef_pace_is_live(&playback->pace);
    const struct shef_filter_stage_params filter = {
        .source = playback->source,
        .graph = playback->graph,
        .pace = &playback->pace,
        .counters = &playback->counters,
        .look_ahead = playback->config.depth.look_ahead,
    };
    struct shef_stereo_stage_params stereo = {
        .config = &playback->config,
        .source = playback->source,
        .workers = playback->workers,
        .graph = playback->graph,
        .pace = &playback->pace,
        .live = playback->live,
        .counters = &playback->counters,
        .newest = &playback->newest,
        .utc_minus_mono_ns = is_live ? utc_minus_mono_ns() : playback->source->utc_minus_host_ns,
        /* Without a clock the recording's own, so that messages are the same every time. */
        .session_id =
            is_live ? shef_clock_now(playback->pace.clock).ns : playback->source->session_id,
    };
    enum shef_err code = shef_filter_stage_create(&filter, &playback->filter, err);

    if (code != SHEF_OK)
        return code;
    stereo.snapshots = shef_filter_stage_pool(playback->filter);
    return shef_stereo_stage_create(&stereo, &playback->stereo, err);
}

static enum shef_err create_publisher(struct shef_playback *playback, struct shef_error *err)
{
    const struct shef_depth_geometry geometry = shef_stereo_stage_geometry(playback->stereo);
    const struct shef_publisher_params params = {
        .url = playback->config.lcm.url,
        .prefix = playback->config.lcm.prefix,
        .width_px = geometry.width_px,
        .height_px = geometry.height_px,
        .outputs = atomic_load(&playback->live->outputs),
        .grid_step = shef_live_get(&playback->live->grid_step),
        .is_stepped = !shef_pace_is_live(&playback->pace),
        .clock = shef_clock_monotonic(),
        .status = shef_playback_publish_status,
        .status_context = playback,
    };
    struct shef_error trouble;
    enum shef_err code;

    playback->results =
        shef_result_pool_create(N_RESULTS, geometry.width_px, geometry.height_px, N_DENSE, err);
    if (!playback->results)
        return err->code;
    shef_stereo_stage_set_results(playback->stereo, playback->results);
    code = shef_publisher_create(&playback->publisher, &params, err);
    if (code != SHEF_OK)
        return code;
    if (shef_publisher_connect(playback->publisher, &trouble) != SHEF_OK)
        shef_log(SHEF_LOG_WARNING, "nothing is published for now, and tried again every second: %s",
                 trouble.text);
    return SHEF_OK;
}

static enum shef_err create_parts(struct shef_playback *playback, struct shef_error *err)
{
    const struct shef_config *config = &playback->config;
    enum shef_err code = shef_source_open(config->source.recording, config->calibration.file,
                                          &playback->source, err);

    if (code == SHEF_OK)
        code = shef_wiring_create(config, &playback->graph, err);
    if (code == SHEF_OK)
        code = create_workers(playback, err);
    if (code == SHEF_OK)
        code = create_stages(playback, err);
    if (code == SHEF_OK)
        code = create_publisher(playback, err);
    if (code == SHEF_OK)
        code = shef_recorder_create(
            &playback->recorder, playback->graph, playback->source, &playback->pace,
            shef_pace_is_live(&playback->pace) ? utc_minus_mono_ns()
                                               : playback->source->utc_minus_host_ns,
            err);
    return code;
}

static void fetch_ends(struct shef_playback *playback)
{
    struct shef_graph *graph = playback->graph;

    playback->to_filter = shef_graph_producer_end(graph, "raw_events", "events");
    playback->frames_to_stereo = shef_graph_producer_end(graph, "frames", "frames");
    playback->poses_to_stereo = shef_graph_producer_end(graph, "poses", "poses");
    playback->results_in = shef_graph_consumer_end(graph, "results", "publisher");
    playback->pace.wakes[SHEF_PACE_EVENTS] = shef_graph_wake(graph, "events");
    playback->pace.wakes[SHEF_PACE_FRAMES] = shef_graph_wake(graph, "frames");
    playback->pace.wakes[SHEF_PACE_POSES] = shef_graph_wake(graph, "poses");
}

enum shef_err shef_playback_create(const struct shef_playback_params *params,
                                   struct shef_playback **out_playback, struct shef_error *err)
{
    struct shef_playback *playback = shef_memory_create(1, sizeof *playback);
    enum shef_err code;

    if (!playback)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "play: out of memory");
    playback->config = *params->config;
    playback->live = params->live;
    playback->end_wake = params->end_wake;
    atomic_init(&playback->state, SHEF_PLAYBACK_PLAYING);
    shef_pace_init(&playback->pace, (enum shef_config_pace)playback->config.source.pace,
                   shef_clock_monotonic());
    code = create_parts(playback, err);
    if (code != SHEF_OK) {
        shef_playback_destroy(playback);
        return code;
    }
    fetch_ends(playback);
    *out_playback = playback;
    return SHEF_OK;
}

void shef_playback_destroy(struct shef_playback *playback)
{
    if (!playback)
        return;
    shef_recorder_destroy(playback->recorder);
    shef_publisher_destroy(playback->publisher);
    shef_stereo_stage_destroy(playback->stereo);
    shef_filter_stage_destroy(playback->filter);
    shef_result_pool_destroy(playback->results);
    shef_workers_destroy(playback->workers);
    shef_graph_destroy(playback->graph);
    shef_source_close(playback->source);
    free(playback);
}

/* ---- start and stop --------------------------------------------------------------------- */

enum shef_err shef_playback_start(struct shef_playback *playback, struct shef_error *err)
{
    const struct {
        const char *name;
        shef_thread_fn *fn;
        void *context;
    } threads[] = {
        { "record_events", shef_recorder_events_thread, playback->recorder },
        { "record_frames", shef_recorder_frames_thread, playback->recorder },
        { "record_poses", shef_recorder_poses_thread, playback->recorder },
        { "record_triggers", shef_recorder_triggers_thread, playback->recorder },
        { "publisher", shef_publisher_thread, playback },
        { "stereo", shef_stereo_thread, playback->stereo },
        { "filter", shef_filter_thread, playback->filter },
        { "poses", shef_poses_thread, playback },
        { "frames", shef_frames_thread, playback },
        { "events", shef_events_thread, playback },
    };
    enum shef_err code = SHEF_OK;

    if (shef_pace_is_live(&playback->pace))
        playback->pace.host_shift_ns =
            shef_host_time_since(shef_clock_now(playback->pace.clock), playback->source->begins) +
            START_DELAY_NS;
    for (size_t i = 0; i < sizeof threads / sizeof threads[0] && code == SHEF_OK; i++)
        code = shef_graph_start(playback->graph, threads[i].name, threads[i].fn, threads[i].context,
                                err);
    if (code == SHEF_OK && playback->workers)
        code = shef_graph_adopt_workers(playback->graph, "workers", playback->workers, err);
    if (code == SHEF_OK)
        code = shef_graph_check_complete(playback->graph, err);
    if (code != SHEF_OK)
        shef_playback_stop(playback);
    return code;
}

void shef_playback_stop(struct shef_playback *playback)
{
    struct shef_result_item item;
    struct shef_result *newest;

    shef_pace_stop(&playback->pace);
    shef_recorder_stop(playback->recorder);
    shef_graph_stop(playback->graph);
    shef_recorder_finish(playback->recorder);
    shef_filter_stage_empty(playback->filter);
    shef_stereo_stage_empty(playback->stereo);
    while (shef_link_pop(playback->results_in, &item) == SHEF_OK)
        if (item.result)
            shef_playback_publish(playback, item.result);
    newest = atomic_exchange(&playback->newest, NULL);
    if (newest)
        shef_result_give(newest);
}

void shef_playback_fail(struct shef_playback *playback, const struct shef_error *err)
{
    /* Several sources may fail at once; the first one's sentence counts. */
    if (atomic_exchange(&playback->is_failing, true))
        return;
    playback->failure = *err;
    /* Release: the sentence becomes visible before the flag. */
    atomic_store_explicit(&playback->has_failed, true, memory_order_release);
}

bool shef_playback_is_failing(const struct shef_playback *playback)
{
    /* Relaxed: whoever sees it only ends; the sentence goes with has_failed. */
    return atomic_load_explicit(&playback->is_failing, memory_order_relaxed);
}

/* ---- reports ---------------------------------------------------------------------------- */

enum shef_playback_state shef_playback_state(const struct shef_playback *playback)
{
    /* Acquire: the failure's sentence is visible where the state says that there is one. */
    return (enum shef_playback_state)atomic_load_explicit(&playback->state, memory_order_acquire);
}

enum shef_err shef_playback_outcome(const struct shef_playback *playback, struct shef_error *err)
{
    if (shef_playback_state(playback) != SHEF_PLAYBACK_FAILED)
        return SHEF_OK;
    *err = playback->failure;
    return err->code;
}

const struct shef_source *shef_playback_source(const struct shef_playback *playback)
{
    return playback->source;
}

const struct shef_counters *shef_playback_counters(const struct shef_playback *playback)
{
    return &playback->counters;
}

struct shef_graph *shef_playback_graph(const struct shef_playback *playback)
{
    return playback->graph;
}

const struct shef_publisher *shef_playback_publisher(const struct shef_playback *playback)
{
    return playback->publisher;
}

struct shef_recorder *shef_playback_recorder(struct shef_playback *playback)
{
    return playback->recorder;
}

double shef_playback_position_s(const struct shef_playback *playback)
{
    const struct shef_source *source = playback->source;
    const int64_t last_ns =
        (int64_t)shef_counter_get(&playback->counters.last_event_us) * SHEF_NS_PER_US;
    const int64_t since_ns = last_ns - source->clock.event.ns;

    return since_ns > 0 ? (double)(since_ns % source->pass_ns) * 1e-9 : 0;
}

struct shef_result *shef_playback_newest(struct shef_playback *playback)
{
    /* Acquire: the result's content comes with the pointer. */
    struct shef_result *result =
        atomic_exchange_explicit(&playback->newest, NULL, memory_order_acquire);
    struct shef_result *none = NULL;

    if (!result)
        return NULL;
    /* One holder for the caller, one for the place it came from, if nothing newer is there. */
    shef_result_share(result);
    if (!atomic_compare_exchange_strong_explicit(&playback->newest, &none, result,
                                                 memory_order_release, memory_order_relaxed))
        shef_result_give(result);
    return result;
}

void shef_playback_apply(struct shef_playback *playback)
{
    shef_publisher_set(playback->publisher, atomic_load(&playback->live->outputs),
                       shef_live_get(&playback->live->grid_step));
}

/* Notes how far a stage or source has come. Returns whether that is farther than last time. */
static bool has_moved(struct shef_playback *playback, int i, uint64_t n_steps)
{
    const bool moved = n_steps != playback->last_steps[i];

    playback->last_steps[i] = n_steps;
    return moved;
}

uint64_t shef_playback_progress(struct shef_playback *playback)
{
    const struct shef_counters *counters = &playback->counters;
    const struct shef_pace *pace = &playback->pace;
    const struct {
        const struct shef_link *input; /* NULL: a source */
        enum shef_pace_source source;
        uint64_t n_steps;
    } parts[SHEF_PLAYBACK_STEPS] = {
        { .input = playback->to_filter, .n_steps = shef_counter_get(&counters->n_packets) },
        { .input = playback->frames_to_stereo,
          .n_steps = shef_counter_get(&counters->n_frames_taken) },
        { .input = playback->results_in, .n_steps = shef_counter_get(&counters->n_results_done) },
        { .source = SHEF_PACE_EVENTS, .n_steps = shef_counter_get(&counters->n_buffers) },
        { .source = SHEF_PACE_FRAMES,
          .n_steps = shef_counter_get(&counters->n_frames_in) +
                     shef_counter_get(&counters->n_frames_missing) },
        { .source = SHEF_PACE_POSES, .n_steps = shef_counter_get(&counters->n_poses) },
    };
    bool has_any_moved = false;
    bool is_any_busy = false;
    bool is_stuck = false;

    for (int i = 0; i < SHEF_PLAYBACK_STEPS; i++) {
        const bool moved = has_moved(playback, i, parts[i].n_steps);
        const bool is_busy = parts[i].input ? shef_ring_count(&parts[i].input->ring) > 0
                                            : !shef_pace_is_idle(pace, parts[i].source);

        has_any_moved = has_any_moved || moved;
        is_any_busy = is_any_busy || is_busy;
        /* Sources that take turns may wait for each other. */
        if (parts[i].input || shef_pace_is_live(pace))
            is_stuck = is_stuck || (is_busy && !moved);
    }
    is_stuck = is_stuck || (is_any_busy && !has_any_moved);
    return playback->n_progress += !is_stuck;
}
