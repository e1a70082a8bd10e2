#include "publish/publisher.h"

#include <assert.h>
#include <ctype.h>
#include <inttypes.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"
#include "publish/sink.h"

#define MAX_PREFIX_BYTES  50
#define CHANNEL_BYTES     64 /* LCM's most, with its end */
#define STATUS_PERIOD_NS  SHEF_NS_PER_S
#define CONNECT_PERIOD_NS SHEF_NS_PER_S
#define WARN_PERIOD_NS    (60 * SHEF_NS_PER_S)

/* The settings, in one word so that both change at once. */
#define SETTINGS(outputs, grid_step) ((outputs) << 8 | (uint32_t)(grid_step))

struct channel_counts {
    _Atomic uint64_t n_messages;
    _Atomic uint64_t n_bytes;
    _Atomic uint64_t max_bytes;
};

struct shef_publisher {
    /* Set by create, then read-only. */
    struct shef_sink *sink;
    struct shef_encoder *encoder;
    struct shef_publisher_params params; /* without its texts */
    char channels[SHEF_CHANNELS][CHANNEL_BYTES];
    /* Any thread writes, the publisher reads. */
    _Atomic uint32_t settings;
    /* The publisher's own. */
    shef_host_time next_status;
    shef_host_time next_connect;
    shef_host_time next_warning;
    uint64_t n_status;
    /* The publisher writes, any thread reads. */
    _Atomic uint64_t n_published;
    _Atomic uint64_t n_unpublished;
    _Atomic uint64_t n_failed_messages;
    _Atomic uint64_t n_connects;
    _Atomic uint64_t n_failed_connects;
    _Atomic bool is_connected;
    _Atomic bool is_failing;
    _Atomic int32_t last_errno;
    _Atomic uint64_t n_warnings;
    _Atomic uint32_t last_shed_bits;
    struct channel_counts counts[SHEF_CHANNELS];
    struct shef_publisher_latency latency;
};

/* Each counter has one writer. Release: who sees a result counted also sees what was counted on its
 * way here, so that never more seem to have been published than have come in. */
static void add(_Atomic uint64_t *counter, uint64_t by)
{
    atomic_store_explicit(counter, atomic_load_explicit(counter, memory_order_relaxed) + by,
                          memory_order_release);
}

static uint64_t read_count(const _Atomic uint64_t *counter)
{
    /* Acquire: pairs with the release in add(). */
    return atomic_load_explicit(counter, memory_order_acquire);
}

static shef_host_time now(const struct shef_publisher *publisher)
{
    return shef_clock_now(publisher->params.clock);
}

static enum shef_err check_prefix(const char *prefix, struct shef_error *err)
{
    const size_t n_bytes = strlen(prefix);
    bool is_good = n_bytes >= 1 && n_bytes <= MAX_PREFIX_BYTES;

    for (size_t i = 0; i < n_bytes; i++)
        is_good = is_good && isgraph((unsigned char)prefix[i]);
    if (is_good)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_INVALID,
                     "LCM prefix '%s': 1 to %d printable characters without blanks are possible",
                     prefix, MAX_PREFIX_BYTES);
}

enum shef_err shef_publisher_check(const char *url, const char *prefix, struct shef_error *err)
{
    struct shef_sink *sink = NULL;
    enum shef_err result = check_prefix(prefix, err);

    if (!result)
        result = shef_sink_create(url, &sink, err);
    shef_sink_destroy(sink);
    return result;
}

enum shef_err shef_publisher_create(struct shef_publisher **out_publisher,
                                    const struct shef_publisher_params *params,
                                    struct shef_error *err)
{
    enum shef_err result = check_prefix(params->prefix, err);

    if (result)
        return result;

    struct shef_publisher *publisher = shef_memory_create(1, sizeof *publisher);

    if (!publisher)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "publisher: out of memory");
    result = shef_sink_create(params->url, &publisher->sink, err);
    if (!result)
        result = shef_encoder_create(&publisher->encoder, params->width_px, params->height_px, err);
    if (result) {
        shef_publisher_destroy(publisher);
        return result;
    }
    publisher->params = *params;
    publisher->params.url = NULL;
    publisher->params.prefix = NULL;
    for (int i = 0; i < SHEF_CHANNELS; i++)
        (void)snprintf(publisher->channels[i], CHANNEL_BYTES, "%s_%s", params->prefix,
                       shef_channel_name(i));
    publisher->next_status = shef_host_time_add(now(publisher), STATUS_PERIOD_NS);
    publisher->next_connect = now(publisher);
    publisher->next_warning = now(publisher);
    shef_publisher_set(publisher, params->outputs, params->grid_step);
    *out_publisher = publisher;
    return SHEF_OK;
}

void shef_publisher_destroy(struct shef_publisher *publisher)
{
    if (!publisher)
        return;
    shef_encoder_destroy(publisher->encoder);
    shef_sink_destroy(publisher->sink);
    free(publisher);
}

/* Notes whether publishing works, and when it is time to warn that it does not. */
static void note(struct shef_publisher *publisher, bool is_failing)
{
    const shef_host_time time = now(publisher);

    atomic_store_explicit(&publisher->is_failing, is_failing, memory_order_relaxed);
    if (is_failing && !shef_host_time_before(time, publisher->next_warning)) {
        publisher->next_warning = shef_host_time_add(time, WARN_PERIOD_NS);
        add(&publisher->n_warnings, 1);
    }
}

static enum shef_err connect_sink(struct shef_publisher *publisher, struct shef_error *err)
{
    const enum shef_err result = shef_sink_connect(publisher->sink, err);

    publisher->next_connect = shef_host_time_add(now(publisher), CONNECT_PERIOD_NS);
    atomic_store_explicit(&publisher->is_connected, result == SHEF_OK, memory_order_relaxed);
    add(result ? &publisher->n_failed_connects : &publisher->n_connects, 1);
    note(publisher, result != SHEF_OK);
    return result;
}

enum shef_err shef_publisher_connect(struct shef_publisher *publisher, struct shef_error *err)
{
    return connect_sink(publisher, err);
}

void shef_publisher_set(struct shef_publisher *publisher, uint32_t outputs, int32_t grid_step)
{
    assert(grid_step == 1 || grid_step == 2);
    assert(outputs < SHEF_OUTPUT(SHEF_CHANNELS));
    atomic_store_explicit(&publisher->settings, SETTINGS(outputs, grid_step), memory_order_relaxed);
}

static enum shef_err send_message(void *context, enum shef_channel channel, const uint8_t *bytes,
                                  size_t n_bytes, int64_t utime_us)
{
    struct shef_publisher *publisher = context;
    struct channel_counts *counts = &publisher->counts[channel];
    int why = 0;
    const enum shef_err result = shef_sink_send(publisher->sink, publisher->channels[channel],
                                                bytes, n_bytes, utime_us, &why);

    if (result) {
        add(&publisher->n_failed_messages, 1);
        atomic_store_explicit(&publisher->last_errno, why, memory_order_relaxed);
        return result;
    }
    add(&counts->n_messages, 1);
    add(&counts->n_bytes, n_bytes);
    if (n_bytes > read_count(&counts->max_bytes))
        atomic_store_explicit(&counts->max_bytes, n_bytes, memory_order_relaxed);
    return SHEF_OK;
}

static void add_latencies(struct shef_publisher *publisher, const struct shef_result *result,
                          shef_host_time began)
{
    const shef_host_time end = now(publisher);

    shef_latency_add(&publisher->latency.own, shef_host_time_since(end, began));
    if (result->complete.ns != 0)
        shef_latency_add(&publisher->latency.from_complete,
                         shef_host_time_since(end, result->complete));
    if (!publisher->params.is_stepped)
        shef_latency_add(&publisher->latency.from_mid, shef_host_time_since(end, result->mid_host));
}

void shef_publisher_result(struct shef_publisher *publisher, struct shef_result *result)
{
    const uint32_t settings = atomic_load_explicit(&publisher->settings, memory_order_relaxed);
    const shef_host_time began = now(publisher);
    enum shef_err sent = SHEF_ERR_IO;

    if (shef_sink_is_connected(publisher->sink)) {
        const uint32_t outputs = settings >> 8 & ~SHEF_OUTPUT(SHEF_CHANNEL_STATUS);

        sent = shef_encoder_result(publisher->encoder, result, outputs, settings & 0xff,
                                   send_message, publisher);
    }
    if (sent == SHEF_OK)
        add_latencies(publisher, result, began);
    add(sent ? &publisher->n_unpublished : &publisher->n_published, 1);
    atomic_store_explicit(&publisher->last_shed_bits, result->shed_bits, memory_order_relaxed);
    note(publisher, sent != SHEF_OK);
    shef_result_give(result);
}

static void percentiles(const struct shef_latency *latency, int64_t *out_p50_ns,
                        int64_t *out_p99_ns)
{
    struct shef_latency_counts counts;

    shef_latency_read(latency, &counts);
    *out_p50_ns = shef_latency_percentile_ns(&counts, 0.50);
    *out_p99_ns = shef_latency_percentile_ns(&counts, 0.99);
}

static void publish_status(struct shef_publisher *publisher)
{
    struct shef_publish_status status = { 0 };

    if (!publisher->params.status(publisher->params.status_context, &status))
        return;
    status.shed_bits = atomic_load_explicit(&publisher->last_shed_bits, memory_order_relaxed);
    status.n_published = read_count(&publisher->n_published);
    status.n_unpublished = read_count(&publisher->n_unpublished);
    percentiles(&publisher->latency.from_complete, &status.complete_to_published_p50_ns,
                &status.complete_to_published_p99_ns);
    percentiles(&publisher->latency.from_mid, &status.mid_to_published_p50_ns,
                &status.mid_to_published_p99_ns);
    note(publisher, shef_encoder_status(publisher->encoder, &status, publisher->n_status++,
                                        send_message, publisher) != SHEF_OK);
}

static bool sends_status(const struct shef_publisher *publisher)
{
    const uint32_t settings = atomic_load_explicit(&publisher->settings, memory_order_relaxed);

    return publisher->params.status && !publisher->params.is_stepped &&
           (settings >> 8 & SHEF_OUTPUT(SHEF_CHANNEL_STATUS));
}

void shef_publisher_tick(struct shef_publisher *publisher)
{
    const shef_host_time time = now(publisher);

    if (!shef_sink_is_connected(publisher->sink) &&
        !shef_host_time_before(time, publisher->next_connect))
        (void)connect_sink(publisher, NULL);
    if (shef_host_time_before(time, publisher->next_status))
        return;
    /* One per period; after a pause not all that were missed. */
    publisher->next_status = shef_host_time_add(publisher->next_status, STATUS_PERIOD_NS);
    if (!shef_host_time_before(time, publisher->next_status))
        publisher->next_status = shef_host_time_add(time, STATUS_PERIOD_NS);
    if (sends_status(publisher) && shef_sink_is_connected(publisher->sink))
        publish_status(publisher);
}

bool shef_publisher_next_tick(const struct shef_publisher *publisher, shef_host_time *out_next)
{
    const bool connects = !shef_sink_is_connected(publisher->sink);
    /* Outputs may be switched on at any time, so that the period is kept in any case. */
    const bool has_status = publisher->params.status && !publisher->params.is_stepped;

    if (connects &&
        (!has_status || shef_host_time_before(publisher->next_connect, publisher->next_status)))
        *out_next = publisher->next_connect;
    else
        *out_next = publisher->next_status;
    return connects || has_status;
}

void shef_publisher_stats(const struct shef_publisher *publisher,
                          struct shef_publisher_stats *out_stats)
{
    *out_stats = (struct shef_publisher_stats){
        .n_published = read_count(&publisher->n_published),
        .n_unpublished = read_count(&publisher->n_unpublished),
        .n_failed_messages = read_count(&publisher->n_failed_messages),
        .n_connects = read_count(&publisher->n_connects),
        .n_failed_connects = read_count(&publisher->n_failed_connects),
        .is_connected = atomic_load_explicit(&publisher->is_connected, memory_order_relaxed),
        .is_failing = atomic_load_explicit(&publisher->is_failing, memory_order_relaxed),
        .last_errno = atomic_load_explicit(&publisher->last_errno, memory_order_relaxed),
        .n_warnings = read_count(&publisher->n_warnings),
        .last_shed_bits = atomic_load_explicit(&publisher->last_shed_bits, memory_order_relaxed),
    };
    for (int i = 0; i < SHEF_CHANNELS; i++)
        out_stats->channels[i] = (struct shef_publisher_channel_stats){
            .n_messages = read_count(&publisher->counts[i].n_messages),
            .n_bytes = read_count(&publisher->counts[i].n_bytes),
            .max_bytes = read_count(&publisher->counts[i].max_bytes),
        };
}

void shef_publisher_describe_trouble(const struct shef_publisher_stats *stats, char *out_text,
                                     size_t n_bytes)
{
    char why[64] = "for an unknown reason";
    char number[64];

    if (!stats->is_failing) {
        if (n_bytes > 0)
            *out_text = '\0';
        return;
    }
    if (stats->last_errno)
        (void)snprintf(why, sizeof why, "%s", strerror_r(stats->last_errno, number, sizeof number));
    if (!stats->is_connected)
        (void)snprintf(out_text, n_bytes,
                       "LCM: not connected after %" PRIu64 " tries, %" PRIu64
                       " results were not published; it tries again every second",
                       stats->n_failed_connects, stats->n_unpublished);
    else
        (void)snprintf(out_text, n_bytes,
                       "LCM: messages are not sent (%s); %" PRIu64
                       " results were not published so far; every further one is tried",
                       why, stats->n_unpublished);
}

const struct shef_publisher_latency *shef_publisher_latency(const struct shef_publisher *publisher)
{
    return &publisher->latency;
}
