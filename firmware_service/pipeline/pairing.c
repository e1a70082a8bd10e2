#include "pipeline/pairing.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rates are learnt from pairs this far apart. */
#define SKEW_SPAN_NS (5 * SHEF_NS_PER_S)

/* Gates stop growing here: half a period at 60 Hz is 8.3 ms. */
#define MAX_GATE_NS (4 * SHEF_NS_PER_MS)

/* Host times of snapshots are estimates: an arrival may seem this much too early. */
#define HOST_SLACK_NS (3 * SHEF_NS_PER_MS)

/* An offset is taken as the right one if it has this many misfits fewer than the next. */
#define CLEAR_MARGIN 3.0

/* How much a shift can have against it because the streams then do not begin together, and because
 * of the delay of arrival. The second counts more. */
#define MAX_START_MISFITS   4.0
#define MAX_LATENCY_MISFITS 10.0

/* A snapshot that lies off by less than this speaks against the offset; where none is that near,
 * the events have a gap, which says nothing. A burst of lost triggers has at most two or three
 * frames at either end that are as near as this: below n_lost in all. */
#define NEAR_MISS_NS (50 * SHEF_NS_PER_MS)

struct shef_pairing_params shef_pairing_default_params(void)
{
    return (struct shef_pairing_params){
        .gate_ns = 300 * SHEF_NS_PER_US,
        .max_skew = 100e-6,
        .wait_ns = 100 * SHEF_NS_PER_MS,
        .max_latency_ns = 250 * SHEF_NS_PER_MS,
        .n_start = 4,
        .n_decide = 48,
        .n_lost = 6,
        .begins_together = true,
    };
}

void shef_pairing_init(struct shef_pairing *pairing, const struct shef_pairing_params *params)
{
    assert(params->n_start >= 3 && params->n_start <= 64 && params->gate_ns > 0);
    assert(params->n_decide >= params->n_start && params->n_decide < SHEF_PAIRING_MAX_FRAMES);
    memset(pairing, 0, sizeof *pairing);
    pairing->params = *params;
    pairing->is_from_start = params->begins_together;
}

static struct shef_pairing_snapshot *snapshot_at(struct shef_pairing *pairing, uint32_t i)
{
    return &pairing->snapshots[(pairing->first_snapshot + i) % SHEF_PAIRING_MAX_SNAPSHOTS];
}

static struct shef_pairing_frame *frame_at(struct shef_pairing *pairing, uint32_t i)
{
    return &pairing->frames[(pairing->first_frame + i) % SHEF_PAIRING_MAX_FRAMES];
}

/* Forgets the offset. What was paired already is nobody else's. */
static void unlock(struct shef_pairing *pairing)
{
    while (pairing->has_skipped_from && pairing->n_snapshots > 0 &&
           snapshot_at(pairing, 0)->number <= pairing->skip_from) {
        pairing->first_snapshot = (pairing->first_snapshot + 1) % SHEF_PAIRING_MAX_SNAPSHOTS;
        pairing->n_snapshots--;
    }
    pairing->is_locked = false;
    pairing->n_misses = 0;
    pairing->n_tried = 0;
    pairing->has_skipped_from = false;
    pairing->is_from_start = false;
}

void shef_pairing_restart(struct shef_pairing *pairing)
{
    unlock(pairing);
    pairing->n_frames = 0;
}

void shef_pairing_add_snapshot(struct shef_pairing *pairing,
                               const struct shef_pairing_snapshot *snapshot)
{
    if (pairing->n_snapshots > 0 &&
        snapshot->rise.ns <= snapshot_at(pairing, pairing->n_snapshots - 1)->rise.ns) {
        unlock(pairing);
        pairing->n_snapshots = 0;
    }
    if (pairing->n_snapshots == SHEF_PAIRING_MAX_SNAPSHOTS) {
        pairing->first_snapshot = (pairing->first_snapshot + 1) % SHEF_PAIRING_MAX_SNAPSHOTS;
        pairing->n_snapshots--;
        pairing->is_from_start = false;
    }
    *snapshot_at(pairing, pairing->n_snapshots) = *snapshot;
    pairing->n_snapshots++;
}

enum shef_err shef_pairing_add_frame(struct shef_pairing *pairing,
                                     const struct shef_pairing_frame *frame)
{
    if (pairing->n_frames == SHEF_PAIRING_MAX_FRAMES)
        return SHEF_ERR_FULL;
    if (pairing->is_locked && frame->camera.ns <= pairing->last.camera.ns)
        unlock(pairing);
    if (pairing->n_frames > 0 &&
        frame->camera.ns <= frame_at(pairing, pairing->n_frames - 1)->camera.ns)
        unlock(pairing);
    *frame_at(pairing, pairing->n_frames) = *frame;
    pairing->n_frames++;
    return SHEF_OK;
}

void shef_pairing_finish(struct shef_pairing *pairing)
{
    pairing->is_complete = true;
}

void shef_pairing_lock(struct shef_pairing *pairing, const struct shef_pairing_anchor *known,
                       bool is_ambiguous)
{
    pairing->is_locked = true;
    pairing->is_ambiguous = is_ambiguous;
    pairing->n_misses = 0;
    /* A step before that pair, so that it is found like any other. */
    pairing->last = *known;
    pairing->last.camera.ns -= SHEF_NS_PER_US;
    pairing->last.event.ns -= SHEF_NS_PER_US;
    pairing->base = pairing->last;
    pairing->next_base = pairing->last;
    pairing->stats.skew = 0;
    pairing->stats.n_starts++;
}

/* The snapshot nearest to an instant of event time; n_snapshots if there is none. */
static uint32_t nearest_snapshot(struct shef_pairing *pairing, int64_t event_ns)
{
    uint32_t low = 0;
    uint32_t high = pairing->n_snapshots;

    while (low < high) {
        const uint32_t middle = (low + high) / 2;

        if (snapshot_at(pairing, middle)->rise.ns < event_ns)
            low = middle + 1;
        else
            high = middle;
    }
    if (low > 0 &&
        (low == pairing->n_snapshots || event_ns - snapshot_at(pairing, low - 1)->rise.ns <=
                                            snapshot_at(pairing, low)->rise.ns - event_ns))
        low--;
    return low;
}

static int64_t gate_after(const struct shef_pairing *pairing, int64_t gap_ns)
{
    const double gate =
        (double)pairing->params.gate_ns + pairing->params.max_skew * fabs((double)gap_ns);

    return gate < (double)MAX_GATE_NS ? (int64_t)gate : MAX_GATE_NS;
}

/* How well the waiting frames fit the snapshots at one offset. */
struct fit {
    int64_t offset_ns; /* event time minus camera time at the first frame */
    int32_t n_fitting;
    int32_t last_fitting; /* frame */
    int32_t first_fitting;
    double n_misfits;
};

static double latency_misfits(const struct shef_pairing *pairing, int64_t least_ns)
{
    const struct shef_pairing_params *params = &pairing->params;

    if (least_ns < -HOST_SLACK_NS || least_ns > params->max_latency_ns)
        return MAX_LATENCY_MISFITS;
    if (params->latency_sigma_ns == 0)
        return 0;

    const double z = (double)(least_ns - params->latency_ns) / (double)params->latency_sigma_ns;
    const double misfits = 0.5 * z * z;

    return misfits < MAX_LATENCY_MISFITS ? misfits : MAX_LATENCY_MISFITS;
}

static struct fit fit_offset(struct shef_pairing *pairing, int64_t offset_ns)
{
    const int64_t start_ns = frame_at(pairing, 0)->camera.ns;
    const int64_t oldest_ns = snapshot_at(pairing, 0)->rise.ns;
    const int64_t newest_ns = snapshot_at(pairing, pairing->n_snapshots - 1)->rise.ns;
    struct fit fit = { .offset_ns = offset_ns, .first_fitting = -1, .last_fitting = -1 };
    uint32_t first_used = 0;
    uint32_t last_used = 0;
    int64_t least_latency_ns = INT64_MAX;
    bool arrives_early = false;
    uint32_t n_before = 0; /* frames before the first snapshot */

    for (uint32_t i = 0; i < pairing->n_frames; i++) {
        const struct shef_pairing_frame *frame = frame_at(pairing, i);
        const int64_t event_ns = frame->camera.ns + offset_ns;
        const int64_t gate_ns = gate_after(pairing, frame->camera.ns - start_ns);

        if (event_ns > newest_ns + gate_ns)
            break;
        if (event_ns < oldest_ns - gate_ns) {
            n_before++;
            continue;
        }
        const uint32_t at = nearest_snapshot(pairing, event_ns);
        const struct shef_pairing_snapshot *snapshot = snapshot_at(pairing, at);

        if (llabs(snapshot->rise.ns - event_ns) > gate_ns) {
            fit.n_misfits += 1;
            continue;
        }
        if (fit.n_fitting == 0) {
            first_used = at;
            fit.first_fitting = (int32_t)i;
        }
        last_used = at;
        fit.last_fitting = (int32_t)i;
        fit.n_fitting++;
        if (snapshot->has_host && frame->has_host) {
            const int64_t latency_ns = shef_host_time_since(frame->arrived, snapshot->host);

            least_latency_ns = latency_ns < least_latency_ns ? latency_ns : least_latency_ns;
            arrives_early |= latency_ns < -HOST_SLACK_NS;
        }
    }
    if (fit.n_fitting > 0) {
        fit.n_misfits += (double)(last_used - first_used + 1) - fit.n_fitting;
        if (pairing->is_from_start) {
            const double n_alone = (double)(n_before + first_used);

            fit.n_misfits += n_alone < MAX_START_MISFITS ? n_alone : MAX_START_MISFITS;
        }
    }
    if (least_latency_ns != INT64_MAX)
        fit.n_misfits +=
            arrives_early ? MAX_LATENCY_MISFITS : latency_misfits(pairing, least_latency_ns);
    return fit;
}

static bool is_better(const struct fit *a, const struct fit *b)
{
    if (a->n_misfits != b->n_misfits)
        return a->n_misfits < b->n_misfits;
    return a->n_fitting > b->n_fitting;
}

static void lock_to(struct shef_pairing *pairing, const struct fit *fit, bool is_ambiguous)
{
    const struct shef_pairing_frame *frame = frame_at(pairing, (uint32_t)fit->first_fitting);
    const uint32_t at = nearest_snapshot(pairing, frame->camera.ns + fit->offset_ns);
    const struct shef_pairing_snapshot *snapshot = snapshot_at(pairing, at);

    const struct shef_pairing_anchor known = { frame->camera, snapshot->rise };

    shef_pairing_lock(pairing, &known, is_ambiguous);
    pairing->exposure_half_ns = shef_event_time_since(snapshot->mid, snapshot->rise);
}

/* The offsets worth trying: those that lay one of the first frames on a snapshot. The very first
 * frames' triggers may be lost. */
#define FIRST_FRAMES 3

struct search {
    int32_t n_least; /* frames that must fit */
    struct fit best;
    double rival; /* misfits of the best at another shift */
};

static void find_best(struct shef_pairing *pairing, struct search *search)
{
    const uint32_t n_first = pairing->n_frames < FIRST_FRAMES ? pairing->n_frames : FIRST_FRAMES;
    struct fit fits[FIRST_FRAMES * SHEF_PAIRING_MAX_SNAPSHOTS];
    uint32_t n_fits = 0;
    int32_t n_most = 0;

    for (uint32_t i = 0; i < n_first; i++)
        for (uint32_t j = 0; j < pairing->n_snapshots; j++) {
            struct fit *fit = &fits[n_fits++];

            *fit = fit_offset(pairing,
                              snapshot_at(pairing, j)->rise.ns - frame_at(pairing, i)->camera.ns);
            n_most = fit->n_fitting > n_most ? fit->n_fitting : n_most;
        }

    /* Shifts that leave most frames waiting for later snapshots had little to fail at. */
    if (search->n_least < n_most / 2)
        search->n_least = n_most / 2;
    for (uint32_t i = 0; i < n_fits; i++)
        if (fits[i].n_fitting >= search->n_least &&
            (search->best.n_fitting == 0 || is_better(&fits[i], &search->best)))
            search->best = fits[i];
    search->rival = HUGE_VAL;
    for (uint32_t i = 0; i < n_fits; i++)
        if (fits[i].n_fitting >= search->n_least && fits[i].n_misfits < search->rival &&
            llabs(fits[i].offset_ns - search->best.offset_ns) > MAX_GATE_NS)
            search->rival = fits[i].n_misfits;
}

/* Looks for the offset. Returns whether it was found. */
static bool try_start(struct shef_pairing *pairing)
{
    const struct shef_pairing_params *params = &pairing->params;
    const uint32_t n_seen = pairing->n_frames + pairing->n_snapshots;
    const bool is_last_chance =
        pairing->is_complete || pairing->n_frames == SHEF_PAIRING_MAX_FRAMES;
    struct search search = { .n_least = params->n_start };

    if (pairing->n_frames == 0 || pairing->n_snapshots == 0 ||
        (n_seen == pairing->n_tried && !is_last_chance))
        return false;
    pairing->n_tried = n_seen;
    if (is_last_chance)
        search.n_least = pairing->n_frames < 2 ? 1 : 2;
    find_best(pairing, &search);
    if (search.best.n_fitting == 0)
        return false;

    const double margin = search.rival - search.best.n_misfits;
    const bool began_together =
        pairing->is_from_start && search.best.n_misfits < 0.5 && margin >= 1;
    const bool is_clear = margin >= CLEAR_MARGIN;
    const bool has_delay = params->latency_sigma_ns > 0;
    const bool is_enough =
        has_delay ? search.best.n_fitting >= params->n_decide : is_clear || began_together;

    /* All is as it should be, or there is no use in waiting any longer. */
    if (!(is_enough && (is_clear || began_together)) &&
        search.best.n_fitting < 2 * params->n_decide && !is_last_chance)
        return false;
    lock_to(pairing, &search.best, !is_clear && !began_together);
    return true;
}

static void pop_frame(struct shef_pairing *pairing)
{
    pairing->first_frame = (pairing->first_frame + 1) % SHEF_PAIRING_MAX_FRAMES;
    pairing->n_frames--;
}

static enum shef_err give_unknown(struct shef_pairing *pairing,
                                  struct shef_pairing_result *out_result)
{
    *out_result = (struct shef_pairing_result){ .tag = frame_at(pairing, 0)->tag,
                                                .kind = SHEF_PAIRING_UNKNOWN };
    pop_frame(pairing);
    pairing->is_from_start = false;
    pairing->stats.n_unknown++;
    return SHEF_OK;
}

/* Rolls the anchors on and learns the rate. */
static void accept(struct shef_pairing *pairing, shef_frame_time camera, shef_event_time event)
{
    pairing->last = (struct shef_pairing_anchor){ camera, event };
    const int64_t span_ns = camera.ns - pairing->base.camera.ns;

    if (span_ns >= SKEW_SPAN_NS)
        pairing->stats.skew =
            (double)(event.ns - pairing->base.event.ns - span_ns) / (double)span_ns;
    if (camera.ns - pairing->next_base.camera.ns >= SKEW_SPAN_NS) {
        pairing->base = pairing->next_base;
        pairing->next_base = pairing->last;
    }
}

static void count_skipped(struct shef_pairing *pairing, uint64_t number)
{
    if (pairing->has_skipped_from && number > pairing->skip_from)
        pairing->stats.n_skipped += number - pairing->skip_from - 1;
    pairing->has_skipped_from = true;
    pairing->skip_from = number;
}

static enum shef_err give_pair(struct shef_pairing *pairing,
                               const struct shef_pairing_snapshot *snapshot, int64_t residual_ns,
                               struct shef_pairing_result *out_result)
{
    const struct shef_pairing_frame *frame = frame_at(pairing, 0);

    *out_result = (struct shef_pairing_result){
        .tag = frame->tag,
        .kind = SHEF_PAIRING_PAIR,
        .snapshot = snapshot->number,
        .rise = snapshot->rise,
        .mid = snapshot->mid,
        .t_err_ns = snapshot->t_err_ns,
        .residual_ns = residual_ns,
        .flags = pairing->is_ambiguous ? SHEF_PAIRING_AMBIGUOUS : 0,
    };
    pairing->exposure_half_ns = shef_event_time_since(snapshot->mid, snapshot->rise);
    count_skipped(pairing, snapshot->number);
    accept(pairing, frame->camera, snapshot->rise);
    pairing->n_misses = 0;
    pairing->stats.n_pairs++;
    pairing->sum_square_ns2 += (double)residual_ns * (double)residual_ns;
    pop_frame(pairing);
    return SHEF_OK;
}

static enum shef_err give_predicted(struct shef_pairing *pairing, int64_t event_ns, int64_t gate_ns,
                                    struct shef_pairing_result *out_result)
{
    *out_result = (struct shef_pairing_result){
        .tag = frame_at(pairing, 0)->tag,
        .kind = SHEF_PAIRING_NO_EDGE,
        .rise = { event_ns },
        .mid = { event_ns + pairing->exposure_half_ns },
        .t_err_ns = gate_ns,
        .flags = pairing->is_ambiguous ? SHEF_PAIRING_AMBIGUOUS : 0,
    };
    pairing->stats.n_no_edge++;
    pop_frame(pairing);
    return SHEF_OK;
}

static bool has_waited(const struct shef_pairing *pairing, const struct shef_pairing_frame *frame,
                       shef_host_time now)
{
    return pairing->is_complete || pairing->n_frames == SHEF_PAIRING_MAX_FRAMES ||
           (frame->has_host && shef_host_time_since(now, frame->arrived) > pairing->params.wait_ns);
}

/* How many snapshots have come since the last one that was used. */
static uint64_t n_unused(struct shef_pairing *pairing)
{
    if (pairing->n_snapshots == 0 || !pairing->has_skipped_from)
        return pairing->n_snapshots;

    const uint64_t newest = snapshot_at(pairing, pairing->n_snapshots - 1)->number;

    return newest > pairing->skip_from ? newest - pairing->skip_from : 0;
}

static enum shef_err track(struct shef_pairing *pairing, shef_host_time now,
                           struct shef_pairing_result *out_result)
{
    const struct shef_pairing_frame *frame = frame_at(pairing, 0);
    const int64_t gap_ns = frame->camera.ns - pairing->last.camera.ns;
    const int64_t event_ns =
        pairing->last.event.ns + gap_ns + llrint(pairing->stats.skew * (double)gap_ns);
    const int64_t gate_ns = gate_after(pairing, gap_ns);

    if (pairing->n_snapshots > 0) {
        const struct shef_pairing_snapshot *newest = snapshot_at(pairing, pairing->n_snapshots - 1);
        const uint32_t at = nearest_snapshot(pairing, event_ns);
        const struct shef_pairing_snapshot *snapshot = snapshot_at(pairing, at);
        const int64_t residual_ns = snapshot->rise.ns - event_ns;
        const bool is_used = pairing->has_skipped_from && snapshot->number <= pairing->skip_from;

        if (llabs(residual_ns) <= gate_ns && !is_used)
            return give_pair(pairing, snapshot, residual_ns, out_result);
        if (newest->rise.ns > event_ns + gate_ns) {
            pairing->n_misses += llabs(residual_ns) < NEAR_MISS_NS;
            return give_predicted(pairing, event_ns, gate_ns, out_result);
        }
    }
    if (has_waited(pairing, frame, now)) {
        pairing->n_misses += n_unused(pairing) > (uint64_t)pairing->params.n_lost;
        return give_predicted(pairing, event_ns, gate_ns, out_result);
    }
    return SHEF_ERR_EMPTY;
}

enum shef_err shef_pairing_take(struct shef_pairing *pairing, shef_host_time now,
                                struct shef_pairing_result *out_result)
{
    if (pairing->n_frames == 0)
        return SHEF_ERR_EMPTY;
    if (pairing->is_locked && pairing->n_misses >= pairing->params.n_lost)
        unlock(pairing);
    if (pairing->is_locked || try_start(pairing)) {
        const struct shef_pairing_frame *frame = frame_at(pairing, 0);

        /* Frames before the one that was found first: their triggers were lost. */
        if (frame->camera.ns >= pairing->last.camera.ns)
            return track(pairing, now, out_result);
        const int64_t gap_ns = frame->camera.ns - pairing->last.camera.ns;

        return give_predicted(pairing, pairing->last.event.ns + gap_ns, gate_after(pairing, gap_ns),
                              out_result);
    }
    if (pairing->is_complete || pairing->n_frames == SHEF_PAIRING_MAX_FRAMES)
        return give_unknown(pairing, out_result);
    return SHEF_ERR_EMPTY;
}

struct shef_pairing_stats shef_pairing_stats(const struct shef_pairing *pairing)
{
    struct shef_pairing_stats stats = pairing->stats;

    if (stats.n_pairs > 0)
        stats.residual_rms_ns = sqrt(pairing->sum_square_ns2 / (double)stats.n_pairs);
    return stats;
}
