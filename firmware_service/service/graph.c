#include "service/graph.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/log.h"
#include "core/memory.h"

struct node {
    struct shef_graph_thread_row row;
    struct shef_thread_params params;
    struct shef_thread thread;
    struct shef_workers *workers; /* in place of the thread, or NULL */
    bool real_time_given;         /* asked for and granted, to the thread or all the workers */
    struct shef_wake wake;
};

struct shef_graph {
    struct shef_link links[SHEF_GRAPH_MAX_RINGS];
    struct node nodes[SHEF_GRAPH_MAX_THREADS];
    int started[SHEF_GRAPH_MAX_THREADS]; /* indices of nodes, in the order of their start */
    int n_links;
    int n_nodes;
    int n_started;
    bool warned_of_real_time;
};

static struct node *find_node(struct shef_graph *graph, const char *name)
{
    for (int i = 0; i < graph->n_nodes; i++)
        if (strcmp(graph->nodes[i].row.name, name) == 0)
            return &graph->nodes[i];
    return NULL;
}

static struct shef_link *find_link(struct shef_graph *graph, const char *name)
{
    for (int i = 0; i < graph->n_links; i++)
        if (strcmp(graph->links[i].row.name, name) == 0)
            return &graph->links[i];
    return NULL;
}

static enum shef_err add_node(struct shef_graph *graph, const struct shef_graph_thread_row *row,
                              const struct shef_config *config, struct shef_error *err)
{
    struct node *node = &graph->nodes[graph->n_nodes];

    if (graph->n_nodes == SHEF_GRAPH_MAX_THREADS)
        return shef_fail(err, SHEF_ERR_INVALID, "wiring: more than %d threads",
                         SHEF_GRAPH_MAX_THREADS);
    if (find_node(graph, row->name))
        return shef_fail(err, SHEF_ERR_INVALID, "wiring: thread '%s' is in the table twice",
                         row->name);
    if (strlen(row->name) > 15)
        return shef_fail(err, SHEF_ERR_INVALID, "wiring: the name of thread '%s' is too long",
                         row->name);
    *node = (struct node){ .row = *row,
                           .params = shef_thread_params_of(config, row->id, row->name),
                           .wake = { .fd = -1 } };
    graph->n_nodes++;
    return shef_wake_init(&node->wake, err);
}

static enum shef_err check_ring(struct shef_graph *graph, const struct shef_graph_ring_row *row,
                                struct shef_error *err)
{
    if (graph->n_links == SHEF_GRAPH_MAX_RINGS)
        return shef_fail(err, SHEF_ERR_INVALID, "wiring: more than %d rings", SHEF_GRAPH_MAX_RINGS);
    if (find_link(graph, row->name))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "wiring: ring '%s' is in the table twice, but has one producer and one "
                         "consumer",
                         row->name);
    if (!find_node(graph, row->producer))
        return shef_fail(err, SHEF_ERR_INVALID, "wiring: ring '%s': there is no thread '%s'",
                         row->name, row->producer);
    if (!find_node(graph, row->consumer))
        return shef_fail(err, SHEF_ERR_INVALID, "wiring: ring '%s': there is no thread '%s'",
                         row->name, row->consumer);
    if (strcmp(row->producer, row->consumer) == 0)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "wiring: ring '%s' leads from thread '%s' to itself", row->name,
                         row->producer);
    if (row->capacity == 0 || (row->capacity & (row->capacity - 1)) != 0 || row->slot_bytes == 0)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "wiring: ring '%s' of %u slots of %u bytes: the number of slots must be "
                         "a power of two, their size not 0",
                         row->name, row->capacity, row->slot_bytes);
    return SHEF_OK;
}

static enum shef_err add_link(struct shef_graph *graph, const struct shef_graph_ring_row *row,
                              struct shef_error *err)
{
    struct shef_link *link = &graph->links[graph->n_links];
    enum shef_err code = check_ring(graph, row, err);

    if (code != SHEF_OK)
        return code;

    void *slots = shef_memory_create(row->capacity, row->slot_bytes);

    if (!slots)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "wiring: ring '%s': out of memory", row->name);
    link->row = *row;
    link->wake = &find_node(graph, row->consumer)->wake;
    shef_ring_init(&link->ring, slots, row->slot_bytes, row->capacity);
    graph->n_links++;
    return SHEF_OK;
}

enum shef_err shef_graph_create(const struct shef_graph_thread_row *threads, int n_threads,
                                const struct shef_graph_ring_row *rings, int n_rings,
                                const struct shef_config *config, struct shef_graph **out_graph,
                                struct shef_error *err)
{
    struct shef_graph *graph = shef_memory_create(1, sizeof *graph);
    enum shef_err code = SHEF_OK;

    if (!graph)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "wiring: out of memory");
    for (int i = 0; i < n_threads && code == SHEF_OK; i++)
        code = add_node(graph, &threads[i], config, err);
    for (int i = 0; i < n_rings && code == SHEF_OK; i++)
        code = add_link(graph, &rings[i], err);
    if (code != SHEF_OK) {
        shef_graph_destroy(graph);
        return code;
    }
    *out_graph = graph;
    return SHEF_OK;
}

void shef_graph_destroy(struct shef_graph *graph)
{
    if (!graph)
        return;
    for (int i = 0; i < graph->n_links; i++)
        free(graph->links[i].ring.slots);
    for (int i = 0; i < graph->n_nodes; i++) {
        assert(!graph->nodes[i].thread.is_running);
        shef_wake_deinit(&graph->nodes[i].wake);
    }
    free(graph);
}

struct shef_link *shef_graph_producer_end(struct shef_graph *graph, const char *ring,
                                          const char *thread)
{
    struct shef_link *link = find_link(graph, ring);

    assert(link && strcmp(link->row.producer, thread) == 0 && !link->producer_fetched);
    link->producer_fetched = true;
    return link;
}

struct shef_link *shef_graph_consumer_end(struct shef_graph *graph, const char *ring,
                                          const char *thread)
{
    struct shef_link *link = find_link(graph, ring);

    assert(link && strcmp(link->row.consumer, thread) == 0 && !link->consumer_fetched);
    link->consumer_fetched = true;
    return link;
}

struct shef_wake *shef_graph_wake(struct shef_graph *graph, const char *thread)
{
    struct node *node = find_node(graph, thread);

    assert(node);
    return &node->wake;
}

static bool is_running(const struct node *node)
{
    return node->thread.is_running || node->workers;
}

/* Whoever asked for real time and did not get it: one warning for all. */
static void note_real_time(struct shef_graph *graph, struct node *node, bool given)
{
    node->real_time_given = node->params.policy == SHEF_POLICY_FIFO && given;
    if (node->params.policy != SHEF_POLICY_FIFO || given || graph->warned_of_real_time)
        return;
    graph->warned_of_real_time = true;
    shef_log(SHEF_LOG_WARNING,
             "real-time priorities are not allowed for this user, so other programs may delay "
             "the service; start it by systemd, or raise the limit 'rtprio' (ulimit -r)");
}

enum shef_err shef_graph_start(struct shef_graph *graph, const char *thread, shef_thread_fn *fn,
                               void *context, struct shef_error *err)
{
    struct node *node = find_node(graph, thread);

    assert(node && !is_running(node));

    const enum shef_err code = shef_thread_start(&node->thread, &node->params, fn, context, err);

    if (code != SHEF_OK)
        return code;
    graph->started[graph->n_started++] = (int)(node - graph->nodes);
    note_real_time(graph, node, node->thread.real_time_given);
    return SHEF_OK;
}

enum shef_err shef_graph_adopt_workers(struct shef_graph *graph, const char *thread,
                                       struct shef_workers *workers, struct shef_error *err)
{
    struct node *node = find_node(graph, thread);
    bool all_given = true;

    assert(node && !is_running(node));
    for (int32_t i = 1; i < shef_workers_count(workers); i++) {
        bool given;
        const enum shef_err code =
            shef_thread_adopt(shef_workers_handle(workers, i), &node->params, &given, err);

        if (code != SHEF_OK)
            return code;
        all_given = all_given && given;
    }
    node->workers = workers;
    note_real_time(graph, node, all_given);
    return SHEF_OK;
}

enum shef_err shef_graph_check_complete(const struct shef_graph *graph, struct shef_error *err)
{
    for (int i = 0; i < graph->n_nodes; i++)
        if (!is_running(&graph->nodes[i]))
            return shef_fail(err, SHEF_ERR_INVALID, "wiring: thread '%s' was not started",
                             graph->nodes[i].row.name);
    for (int i = 0; i < graph->n_links; i++) {
        const struct shef_link *link = &graph->links[i];

        if (!link->producer_fetched || !link->consumer_fetched)
            return shef_fail(err, SHEF_ERR_INVALID, "wiring: ring '%s' has no %s", link->row.name,
                             link->producer_fetched ? "consumer" : "producer");
    }
    return SHEF_OK;
}

void shef_graph_stop(struct shef_graph *graph)
{
    while (graph->n_started > 0) {
        struct node *node = &graph->nodes[graph->started[--graph->n_started]];

        shef_wake_signal(&node->wake);
        shef_thread_join(&node->thread);
    }
    for (int i = 0; i < graph->n_nodes; i++)
        graph->nodes[i].workers = NULL;
}

bool shef_graph_has_real_time(const struct shef_graph *graph)
{
    for (int i = 0; i < graph->n_nodes; i++)
        if (graph->nodes[i].params.policy == SHEF_POLICY_FIFO && !graph->nodes[i].real_time_given)
            return false;
    return true;
}

static int64_t cpu_ns_of(const struct node *node)
{
    int64_t sum_ns = 0;

    if (!node->workers)
        return shef_thread_cpu_ns(&node->thread);
    for (int32_t i = 1; i < shef_workers_count(node->workers); i++) {
        const int64_t used_ns = shef_thread_handle_cpu_ns(shef_workers_handle(node->workers, i));

        sum_ns += used_ns > 0 ? used_ns : 0;
    }
    return sum_ns;
}

int64_t shef_graph_cpu_ns(const struct shef_graph *graph, const char *thread)
{
    for (int i = 0; i < graph->n_nodes; i++)
        if (strcmp(graph->nodes[i].row.name, thread) == 0)
            return cpu_ns_of(&graph->nodes[i]);
    return -1;
}

static json_t *thread_to_json(const struct node *node)
{
    const bool is_fifo = node->params.policy == SHEF_POLICY_FIFO;
    const bool has_it = is_fifo && node->real_time_given;
    json_t *object = json_pack("{s:s, s:s, s:b}", "name", node->row.name, "policy",
                               is_fifo ? "fifo" : "normal", "granted", !is_fifo || has_it);

    json_object_set_new(object, "priority",
                        is_fifo ? json_integer(node->params.priority) : json_null());
    json_object_set_new(object, "cpu",
                        node->params.cpu >= 0 ? json_integer(node->params.cpu) : json_null());
    json_object_set_new(object, "woken_by", json_string(node->row.woken_by));
    json_object_set_new(object, "deadline_ms",
                        node->row.deadline_ms > 0 ? json_integer(node->row.deadline_ms)
                                                  : json_null());
    json_object_set_new(object, "running", json_boolean(is_running(node)));
    return object;
}

/* Relaxed: counters for people; they order nothing. */
static json_int_t read_counter(const _Atomic uint64_t *counter)
{
    return (json_int_t)atomic_load_explicit(counter, memory_order_relaxed);
}

static json_t *link_to_json(const struct shef_link *link)
{
    const json_int_t high_water =
        (json_int_t)atomic_load_explicit(&link->high_water, memory_order_relaxed);

    return json_pack("{s:s, s:s, s:s, s:I, s:I, s:I, s:I, s:I, s:I}", "name", link->row.name,
                     "producer", link->row.producer, "consumer", link->row.consumer, "capacity",
                     (json_int_t)link->row.capacity, "slot_bytes", (json_int_t)link->row.slot_bytes,
                     "count", (json_int_t)shef_ring_count(&link->ring), "high_water", high_water,
                     "n_pushed", read_counter(&link->n_pushed), "n_lost",
                     read_counter(&link->n_lost));
}

json_t *shef_graph_to_json(const struct shef_graph *graph)
{
    json_t *threads = json_array();
    json_t *rings = json_array();

    for (int i = 0; i < graph->n_nodes; i++)
        json_array_append_new(threads, thread_to_json(&graph->nodes[i]));
    for (int i = 0; i < graph->n_links; i++)
        json_array_append_new(rings, link_to_json(&graph->links[i]));
    return json_pack("{s:o, s:o}", "threads", threads, "rings", rings);
}

/* The producer is the only writer: a load and a store suffice. */
static void count_one(_Atomic uint64_t *counter)
{
    atomic_store_explicit(counter, atomic_load_explicit(counter, memory_order_relaxed) + 1,
                          memory_order_relaxed);
}

enum shef_err shef_link_push(struct shef_link *link, const void *item)
{
    const enum shef_err code = shef_ring_push(&link->ring, item);

    if (code != SHEF_OK) {
        count_one(&link->n_lost);
        return code;
    }
    count_one(&link->n_pushed);

    const uint32_t n_waiting = shef_ring_count(&link->ring);

    if (n_waiting > atomic_load_explicit(&link->high_water, memory_order_relaxed))
        atomic_store_explicit(&link->high_water, n_waiting, memory_order_relaxed);
    shef_wake_signal(link->wake);
    return SHEF_OK;
}

bool shef_link_has_room(const struct shef_link *link)
{
    return shef_ring_count(&link->ring) < link->row.capacity;
}

enum shef_err shef_link_pop(struct shef_link *link, void *out_item)
{
    return shef_ring_pop(&link->ring, out_item);
}
