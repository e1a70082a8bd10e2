#include "service/graph.h"

#include <pthread.h>
#include <string.h>

#include "support/support.h"

static const struct shef_graph_thread_row threads[] = {
    { "source", SHEF_THREAD_CONTROL, "clock", 0 },
    { "middle", SHEF_THREAD_PUBLISHER, "ring first", 5 },
    { "sink", SHEF_THREAD_RECORDER, "ring second", 0 },
};

static const struct shef_graph_ring_row rings[] = {
    { "first", "source", "middle", 4, sizeof(int) },
    { "second", "middle", "sink", 4, sizeof(int) },
};

#define N_THREADS ((int)(sizeof threads / sizeof threads[0]))
#define N_RINGS   ((int)(sizeof rings / sizeof rings[0]))

static struct shef_config config;
static struct shef_error err;
static struct shef_graph *graph;

void setUp(void)
{
    shef_config_defaults(&config);
    graph = NULL;
}

void tearDown(void)
{
    shef_graph_destroy(graph);
}

static void create(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_graph_create(threads, N_THREADS, rings, N_RINGS, &config, &graph, &err),
        err.text);
}

static void expect_refused(const struct shef_graph_ring_row *row, const char *sentence)
{
    const struct shef_graph_ring_row both[] = { rings[0], *row };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_graph_create(threads, N_THREADS, both, 2, &config, &graph, &err));
    TEST_ASSERT_EQUAL_STRING(sentence, err.text);
    TEST_ASSERT_NULL(graph);
}

static void test_tables_that_break_the_rules_are_refused(void)
{
    expect_refused(&(struct shef_graph_ring_row){ "x", "nobody", "sink", 4, 4 },
                   "wiring: ring 'x': there is no thread 'nobody'");
    expect_refused(&(struct shef_graph_ring_row){ "x", "source", "nobody", 4, 4 },
                   "wiring: ring 'x': there is no thread 'nobody'");
    expect_refused(&(struct shef_graph_ring_row){ "first", "middle", "sink", 4, 4 },
                   "wiring: ring 'first' is in the table twice, but has one producer and one "
                   "consumer");
    expect_refused(&(struct shef_graph_ring_row){ "x", "sink", "sink", 4, 4 },
                   "wiring: ring 'x' leads from thread 'sink' to itself");
    expect_refused(&(struct shef_graph_ring_row){ "x", "source", "sink", 6, 4 },
                   "wiring: ring 'x' of 6 slots of 4 bytes: the number of slots must be a power "
                   "of two, their size not 0");
}

static void test_a_thread_cannot_be_there_twice(void)
{
    const struct shef_graph_thread_row twice[] = { threads[0], threads[0] };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_graph_create(twice, 2, NULL, 0, &config, &graph, &err));
    TEST_ASSERT_EQUAL_STRING("wiring: thread 'source' is in the table twice", err.text);
}

static void test_what_a_full_ring_refuses_is_counted(void)
{
    int item = 0;

    create();

    struct shef_link *link = shef_graph_producer_end(graph, "first", "source");

    for (item = 0; item < 4; item++)
        TEST_ASSERT_EQUAL(SHEF_OK, shef_link_push(link, &item));
    TEST_ASSERT_EQUAL(SHEF_ERR_FULL, shef_link_push(link, &item));
    TEST_ASSERT_EQUAL_UINT64(4, link->n_pushed);
    TEST_ASSERT_EQUAL_UINT64(1, link->n_lost);
    TEST_ASSERT_EQUAL_UINT32(4, link->high_water);
}

static void test_a_push_wakes_the_consumer_of_that_ring_only(void)
{
    const int item = 7;

    create();
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_link_push(shef_graph_producer_end(graph, "first", "source"), &item));
    TEST_ASSERT_TRUE(shef_wake_wait(shef_graph_wake(graph, "middle"), 0));
    TEST_ASSERT_FALSE(shef_wake_wait(shef_graph_wake(graph, "sink"), 0));
}

/* Each stage forwards numbers until it reads a negative one. */
struct stage {
    struct shef_link *in;
    struct shef_link *out;
    struct shef_wake *wake;
    int sum;
};

static void forward(void *context)
{
    struct stage *stage = context;
    int item = 0;

    while (item >= 0) {
        if (shef_link_pop(stage->in, &item) != SHEF_OK) {
            shef_wake_wait(stage->wake, -1);
            continue;
        }
        stage->sum += item > 0 ? item : 0;
        while (stage->out && shef_link_push(stage->out, &item) != SHEF_OK)
            shef_wake_wait(stage->wake, 1);
    }
}

static void produce(void *context)
{
    struct stage *stage = context;

    for (int i = 1; i <= 1001; i++) {
        const int item = i <= 1000 ? i : -1;

        while (shef_link_push(stage->out, &item) != SHEF_OK)
            shef_wake_wait(stage->wake, 1);
    }
}

static void test_numbers_flow_from_the_source_to_the_sink(void)
{
    struct stage source, middle, sink;

    create();
    source = (struct stage){ .out = shef_graph_producer_end(graph, "first", "source"),
                             .wake = shef_graph_wake(graph, "source") };
    middle = (struct stage){ .in = shef_graph_consumer_end(graph, "first", "middle"),
                             .out = shef_graph_producer_end(graph, "second", "middle"),
                             .wake = shef_graph_wake(graph, "middle") };
    sink = (struct stage){ .in = shef_graph_consumer_end(graph, "second", "sink"),
                           .wake = shef_graph_wake(graph, "sink") };
    TEST_ASSERT_EQUAL(SHEF_OK, shef_graph_start(graph, "sink", forward, &sink, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_graph_start(graph, "middle", forward, &middle, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_graph_check_complete(graph, &err));
    TEST_ASSERT_EQUAL_STRING("wiring: thread 'source' was not started", err.text);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_graph_start(graph, "source", produce, &source, &err));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_graph_check_complete(graph, &err), err.text);
    shef_graph_stop(graph);
    TEST_ASSERT_EQUAL_INT(500500, middle.sum);
    TEST_ASSERT_EQUAL_INT(500500, sink.sum);
    TEST_ASSERT_EQUAL_INT64(-1, shef_graph_cpu_ns(graph, "sink"));
}

static void leave(void *context)
{
    (void)context;
}

static void test_an_end_that_nobody_fetched_is_found(void)
{
    create();
    (void)shef_graph_producer_end(graph, "first", "source");
    (void)shef_graph_consumer_end(graph, "first", "middle");
    (void)shef_graph_producer_end(graph, "second", "middle");
    /* Threads that leave at once still count as started. */
    for (int i = 0; i < N_THREADS; i++)
        TEST_ASSERT_EQUAL(SHEF_OK, shef_graph_start(graph, threads[i].name, leave, NULL, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_graph_check_complete(graph, &err));
    TEST_ASSERT_EQUAL_STRING("wiring: ring 'second' has no consumer", err.text);
    shef_graph_stop(graph);
}

static void test_workers_take_the_place_of_a_thread(void)
{
    struct shef_workers *workers = shef_workers_create_sized(3, 128 * 1024, &err);
    char name[16];
    json_t *printed;

    create();
    TEST_ASSERT_NOT_NULL(workers);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_graph_adopt_workers(graph, "middle", workers, &err),
                              err.text);
    for (int32_t i = 1; i < 3; i++) {
        pthread_getname_np(shef_workers_handle(workers, i), name, sizeof name);
        TEST_ASSERT_EQUAL_STRING("middle", name);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(0, shef_graph_cpu_ns(graph, "middle"));
    printed = shef_graph_to_json(graph);
    TEST_ASSERT_TRUE(json_is_true(
        json_object_get(json_array_get(json_object_get(printed, "threads"), 1), "running")));
    json_decref(printed);
    shef_graph_stop(graph);
    TEST_ASSERT_EQUAL_INT64(-1, shef_graph_cpu_ns(graph, "middle"));
    shef_workers_destroy(workers);
}

static void test_the_printed_graph_shows_the_live_tables(void)
{
    const int item = 7;
    json_t *printed;

    create();
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_link_push(shef_graph_producer_end(graph, "first", "source"), &item));
    printed = shef_graph_to_json(graph);
    TEST_ASSERT_NOT_NULL(printed);

    const json_t *rows = json_object_get(printed, "threads");
    const json_t *first = json_array_get(json_object_get(printed, "rings"), 0);

    TEST_ASSERT_EQUAL_size_t(N_THREADS, json_array_size(rows));
    TEST_ASSERT_EQUAL_STRING("middle",
                             json_string_value(json_object_get(json_array_get(rows, 1), "name")));
    TEST_ASSERT_EQUAL_INT(
        5, json_integer_value(json_object_get(json_array_get(rows, 1), "deadline_ms")));
    TEST_ASSERT_EQUAL_STRING("source", json_string_value(json_object_get(first, "producer")));
    TEST_ASSERT_EQUAL_INT(1, json_integer_value(json_object_get(first, "count")));
    TEST_ASSERT_EQUAL_INT(4, json_integer_value(json_object_get(first, "capacity")));
    json_decref(printed);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_tables_that_break_the_rules_are_refused);
    RUN_TEST(test_a_thread_cannot_be_there_twice);
    RUN_TEST(test_what_a_full_ring_refuses_is_counted);
    RUN_TEST(test_a_push_wakes_the_consumer_of_that_ring_only);
    RUN_TEST(test_numbers_flow_from_the_source_to_the_sink);
    RUN_TEST(test_an_end_that_nobody_fetched_is_found);
    RUN_TEST(test_workers_take_the_place_of_a_thread);
    RUN_TEST(test_the_printed_graph_shows_the_live_tables);
    return UNITY_END();
}
