/* The wiring of the service as two tables: which threads there are, and which rings join them.
 *
 * The tables are the truth: rings are made from them, threads fetch their ends by name, and
 * `shefctl graph` prints them. Checked at start: every ring has exactly one producer and one
 * consumer, both in the table of threads, and each end was fetched by exactly that thread.
 * Thread: setup, unless noted. */
#ifndef SHEF_SERVICE_GRAPH_H
#define SHEF_SERVICE_GRAPH_H

#include <stdalign.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include <jansson.h>

#include "core/error.h"
#include "core/ring.h"
#include "core/wake.h"
#include "core/workers.h"
#include "service/thread.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_GRAPH_MAX_THREADS 16
#define SHEF_GRAPH_MAX_RINGS   32

/* A row of the table of threads. */
struct shef_graph_thread_row {
    const char *name;           /* at most 15 bytes */
    enum shef_config_thread id; /* policy, priority and processor come from the configuration */
    const char *woken_by;       /* for people: "raw_events", "the next buffer's time" */
    int32_t deadline_ms;        /* how long one piece of its work may take; 0: none */
};

/* A row of the table of rings. */
struct shef_graph_ring_row {
    const char *name;
    const char *producer; /* a thread's name */
    const char *consumer; /* another thread's name */
    uint32_t capacity;    /* slots, a power of two */
    uint32_t slot_bytes;
};

/* A ring with its counters, and who is to be woken. */
struct shef_link {
    /* Set by create, then read-only. */
    struct shef_graph_ring_row row;
    struct shef_wake *wake; /* of the consumer */
    struct shef_ring ring;
    /* Producer writes, any thread reads. Own cache line. */
    alignas(64) _Atomic uint64_t n_pushed;
    _Atomic uint64_t n_lost;     /* refused because the ring was full */
    _Atomic uint32_t high_water; /* most items that ever waited */
    /* Written while threads start. */
    bool producer_fetched;
    bool consumer_fetched;
};

struct shef_graph;

/* Checks the tables and allocates rings and wake-ups. The rows' texts are kept.
 * SHEF_ERR_INVALID: the sentence names the row that breaks the rules. SHEF_ERR_NO_MEMORY, IO. */
SHEF_MUST_CHECK enum shef_err shef_graph_create(const struct shef_graph_thread_row *threads,
                                                int n_threads,
                                                const struct shef_graph_ring_row *rings,
                                                int n_rings, const struct shef_config *config,
                                                struct shef_graph **out_graph,
                                                struct shef_error *err);

/* NULL is allowed; no thread may run any more. */
void shef_graph_destroy(struct shef_graph *graph);

/* The end of a ring, for the thread that the table names. Asking for another thread, for a ring
 * that does not exist, or twice is an assertion. */
struct shef_link *shef_graph_producer_end(struct shef_graph *graph, const char *ring,
                                          const char *thread);
struct shef_link *shef_graph_consumer_end(struct shef_graph *graph, const char *ring,
                                          const char *thread);

/* What wakes a thread: every ring that it consumes signals it. */
struct shef_wake *shef_graph_wake(struct shef_graph *graph, const char *thread);

/* Starts a thread of the table. Call in the order of the data, sinks first.
 * A refused real-time priority is logged once for the whole graph. */
SHEF_MUST_CHECK enum shef_err shef_graph_start(struct shef_graph *graph, const char *thread,
                                               shef_thread_fn *fn, void *context,
                                               struct shef_error *err);

/* Puts the helpers of a team in the place of a thread of the table: name, policy, priority and
 * processor. They stay the team's; after stop() the table no longer counts them as running. */
SHEF_MUST_CHECK enum shef_err shef_graph_adopt_workers(struct shef_graph *graph, const char *thread,
                                                       struct shef_workers *workers,
                                                       struct shef_error *err);

/* SHEF_ERR_INVALID: a thread was never started, or an end of a ring never fetched. */
SHEF_MUST_CHECK enum shef_err shef_graph_check_complete(const struct shef_graph *graph,
                                                        struct shef_error *err);

/* Wakes and joins the threads, last started first. Each must leave when woken: the caller has
 * told them to before. */
void shef_graph_stop(struct shef_graph *graph);

/* Whether every thread that asked for real time has it. */
bool shef_graph_has_real_time(const struct shef_graph *graph);

/* Both tables as `shefctl graph` shows them: {"threads": [...], "rings": [...]}; the rings with
 * what waits in them now. NULL: out of memory.                    Thread: control. */
json_t *shef_graph_to_json(const struct shef_graph *graph);

/* Processor time of a thread of the table so far, of adopted workers in all, in ns; -1: not
 * running.                                                        Thread: control. */
int64_t shef_graph_cpu_ns(const struct shef_graph *graph, const char *thread);

/* Copies one item in, wakes the consumer, counts.                 Thread: the ring's producer.
 * SHEF_ERR_FULL: nothing was written, and the loss is counted. */
SHEF_MUST_CHECK enum shef_err shef_link_push(struct shef_link *link, const void *item);

/* Whether the next push will find room.                           Thread: the ring's producer. */
bool shef_link_has_room(const struct shef_link *link);

/* Copies the oldest item out.                                     Thread: the ring's consumer.
 * SHEF_ERR_EMPTY: wait for the thread's wake-up. */
SHEF_MUST_CHECK enum shef_err shef_link_pop(struct shef_link *link, void *out_item);

#ifdef __cplusplus
}
#endif

#endif
