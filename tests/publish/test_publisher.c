#include "publish/publisher.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include <lcm/eventlog.h>
#include <shef_lcm_decode.h>

#include "made_result.h"
#include "support/alloc_watch.h"

#define WIDTH_PX  64
#define HEIGHT_PX 48
#define N_RESULTS 8
#define FRAMES    (SHEF_OUTPUT(SHEF_CHANNEL_DISPARITY) | SHEF_OUTPUT(SHEF_CHANNEL_DEPTH))
#define STATUS    SHEF_OUTPUT(SHEF_CHANNEL_STATUS)

static struct shef_result_pool *pool;
static struct shef_publisher *publisher;
static struct shef_manual_clock manual;
static struct shef_test_random test_random;
static struct shef_error err;
static char url[600];

void setUp(void)
{
    test_random = shef_test_random_start();
    shef_manual_clock_init(&manual, (shef_host_time){ 5020 * SHEF_NS_PER_MS });
    pool = shef_result_pool_create(N_RESULTS, WIDTH_PX, HEIGHT_PX, 0, NULL);
    TEST_ASSERT_NOT_NULL(pool);
    err = (struct shef_error){ 0 };
}

void tearDown(void)
{
    shef_publisher_destroy(publisher);
    publisher = NULL;
    shef_result_pool_destroy(pool);
}

static bool say_status(void *context, struct shef_publish_status *out_status)
{
    int *n_asked = context;

    (void)snprintf(out_status->state, sizeof out_status->state, "asked %d", ++*n_asked);
    out_status->now = shef_clock_now(&manual.clock);
    return true;
}

static int n_asked;

static struct shef_publisher_params params_for(const char *to)
{
    n_asked = 0;
    return (struct shef_publisher_params){
        .url = to,
        .prefix = "TEST",
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .outputs = FRAMES | STATUS,
        .grid_step = 2,
        .clock = &manual.clock,
        .status = say_status,
        .status_context = &n_asked,
    };
}

static void start(const struct shef_publisher_params *params)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_publisher_create(&publisher, params, &err), err.text);
}

static void connect_now(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_publisher_connect(publisher, &err), err.text);
}

static const char *log_path(const char *name)
{
    const char *path = shef_test_temp_path(name);

    (void)snprintf(url, sizeof url, "file://%s", path);
    return path;
}

static struct shef_result *made(uint64_t seq)
{
    struct shef_result *result = shef_result_take(pool);

    TEST_ASSERT_NOT_NULL(result);
    made_result_fill(result, seq, 0.2, &test_random);
    return result;
}

static void publish(uint64_t seq)
{
    shef_publisher_result(publisher, made(seq));
}

static struct shef_publisher_stats stats(void)
{
    struct shef_publisher_stats now;

    shef_publisher_stats(publisher, &now);
    return now;
}

/* How many messages a log has on a channel (NULL: all). */
static int count_log(const char *path, const char *channel)
{
    lcm_eventlog_t *log = lcm_eventlog_create(path, "r");
    lcm_eventlog_event_t *event;
    int n = 0;

    TEST_ASSERT_NOT_NULL(log);
    while ((event = lcm_eventlog_read_next_event(log)) != NULL) {
        n += !channel || strcmp(channel, event->channel) == 0;
        lcm_eventlog_free_event(event);
    }
    lcm_eventlog_destroy(log);
    return n;
}

static void test_results_are_published_and_given_back(void)
{
    const char *path = log_path("log");
    const struct shef_publisher_params params = params_for(url);

    start(&params);
    connect_now();
    for (uint64_t seq = 0; seq < 20; seq++)
        publish(seq);
    TEST_ASSERT_EQUAL_UINT32(0, shef_result_pool_lent_count(pool));
    TEST_ASSERT_EQUAL_UINT64(20, stats().n_published);
    TEST_ASSERT_EQUAL_UINT64(0, stats().n_unpublished);
    TEST_ASSERT_EQUAL_UINT64(20, stats().channels[SHEF_CHANNEL_DEPTH].n_messages);
    TEST_ASSERT_FALSE(stats().is_failing);
    TEST_ASSERT_EQUAL_INT(20, count_log(path, "TEST_DISPARITY"));
    TEST_ASSERT_EQUAL_INT(20, count_log(path, "TEST_DEPTH"));
    TEST_ASSERT_EQUAL_INT(40, count_log(path, NULL));
}

static void test_what_is_published_changes_with_the_next_result(void)
{
    const char *path = log_path("log");
    const struct shef_publisher_params params = params_for(url);

    start(&params);
    connect_now();
    publish(0);
    shef_publisher_set(publisher, SHEF_OUTPUT(SHEF_CHANNEL_POSE), 1);
    publish(1);
    TEST_ASSERT_EQUAL_INT(1, count_log(path, "TEST_DISPARITY"));
    TEST_ASSERT_EQUAL_INT(1, count_log(path, "TEST_POSE"));
    TEST_ASSERT_EQUAL_INT(3, count_log(path, NULL));
}

static void test_status_comes_once_a_second_and_not_for_every_missed_one(void)
{
    const char *path = log_path("log");
    const struct shef_publisher_params params = params_for(url);

    start(&params);
    connect_now();
    for (int i = 0; i < 50; i++) { /* 5 s */
        shef_publisher_tick(publisher);
        shef_manual_clock_advance(&manual, 100 * SHEF_NS_PER_MS);
    }
    shef_publisher_tick(publisher);
    TEST_ASSERT_EQUAL_INT(5, n_asked);
    shef_manual_clock_advance(&manual, 100 * SHEF_NS_PER_S);
    shef_publisher_tick(publisher);
    shef_publisher_tick(publisher);
    TEST_ASSERT_EQUAL_INT(6, n_asked);
    TEST_ASSERT_EQUAL_INT(6, count_log(path, "TEST_STATUS"));

    shef_publisher_set(publisher, FRAMES, 2);
    shef_manual_clock_advance(&manual, 10 * SHEF_NS_PER_S);
    shef_publisher_tick(publisher);
    TEST_ASSERT_EQUAL_INT(6, n_asked);
}

static void test_a_status_carries_what_the_publisher_knows(void)
{
    const char *path = log_path("log");
    struct shef_publisher_params params = params_for(url);
    struct shef_lcm_status status;
    struct shef_result *result = made(0);

    start(&params);
    connect_now();
    result->complete = (shef_host_time){ 5013 * SHEF_NS_PER_MS };
    result->mid_host = (shef_host_time){ 5000 * SHEF_NS_PER_MS };
    result->shed_bits = SHEF_RESULT_SHED_RANGE;
    shef_publisher_result(publisher, result);
    shef_manual_clock_advance(&manual, SHEF_NS_PER_S);
    shef_publisher_tick(publisher);
    shef_publisher_destroy(publisher);
    publisher = NULL;

    lcm_eventlog_t *log = lcm_eventlog_create(path, "r");
    lcm_eventlog_event_t *event = lcm_eventlog_read_next_event(log);

    while (strcmp(event->channel, "TEST_STATUS") != 0) {
        lcm_eventlog_free_event(event);
        event = lcm_eventlog_read_next_event(log);
        TEST_ASSERT_NOT_NULL(event);
    }
    TEST_ASSERT_EQUAL(SHEF_LCM_OK,
                      shef_lcm_decode_status(event->data, (size_t)event->datalen, &status));
    TEST_ASSERT_EQUAL_STRING("asked 1", status.state);
    TEST_ASSERT_EQUAL_INT64(1, status.n_published);
    TEST_ASSERT_EQUAL_INT32(SHEF_RESULT_SHED_RANGE, status.shed_bits);
    /* Histograms round up by a sixteenth at most, and never past the largest entry. */
    TEST_ASSERT_EQUAL_INT64(7 * SHEF_NS_PER_MS, status.complete_to_published_p50_ns);
    TEST_ASSERT_EQUAL_INT64(20 * SHEF_NS_PER_MS, status.mid_to_published_p99_ns);
    lcm_eventlog_free_event(event);
    lcm_eventlog_destroy(log);
}

static void *read_whole(const char *path, size_t *out_bytes)
{
    static uint8_t bytes[1 << 20];
    FILE *file = fopen(path, "rb");

    TEST_ASSERT_NOT_NULL(file);
    *out_bytes = fread(bytes, 1, sizeof bytes, file);
    TEST_ASSERT_LESS_THAN_size_t(sizeof bytes, *out_bytes);
    (void)fclose(file);

    void *copy = malloc(*out_bytes);

    TEST_ASSERT_NOT_NULL(copy);
    memcpy(copy, bytes, *out_bytes);
    return copy;
}

static void test_stepped_twice_gives_the_same_log_to_the_byte(void)
{
    void *logs[2];
    size_t n_bytes[2];

    for (int i = 0; i < 2; i++) {
        const char *path = log_path(i ? "second" : "first");
        struct shef_publisher_params params = params_for(url);

        params.is_stepped = true;
        test_random = shef_test_random_start();
        start(&params);
        connect_now();
        for (uint64_t seq = 0; seq < 5; seq++) {
            publish(seq);
            shef_manual_clock_advance(&manual, (1 + 3 * i) * SHEF_NS_PER_S);
            shef_publisher_tick(publisher);
        }
        shef_publisher_destroy(publisher);
        publisher = NULL;
        TEST_ASSERT_EQUAL_INT(0, n_asked);
        logs[i] = read_whole(path, &n_bytes[i]);
    }
    TEST_ASSERT_GREATER_THAN_size_t(1000, n_bytes[0]);
    TEST_ASSERT_EQUAL_size_t(n_bytes[0], n_bytes[1]);
    TEST_ASSERT_EQUAL_MEMORY(logs[0], logs[1], n_bytes[0]);
    free(logs[0]);
    free(logs[1]);
}

static void test_a_failing_sink_is_counted_and_warned_of_once_a_minute(void)
{
    const struct shef_publisher_params params = params_for("file:///dev/full");
    struct shef_publisher_stats seen;
    char text[256];

    start(&params);
    connect_now();
    shef_publisher_set(publisher, FRAMES, 2);
    for (uint64_t seq = 0; seq < 10; seq++)
        publish(seq);
    seen = stats();
    TEST_ASSERT_EQUAL_UINT64(10, seen.n_unpublished);
    TEST_ASSERT_EQUAL_UINT64(10, seen.n_failed_messages);
    TEST_ASSERT_EQUAL_UINT64(0, seen.n_published);
    TEST_ASSERT_EQUAL_UINT64(1, seen.n_warnings);
    TEST_ASSERT_TRUE(seen.is_failing);
    shef_publisher_describe_trouble(&seen, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("LCM: messages are not sent (No space left on device); 10 results "
                             "were not published so far; every further one is tried",
                             text);
    TEST_ASSERT_EQUAL_UINT32(0, shef_result_pool_lent_count(pool));

    shef_manual_clock_advance(&manual, 59 * SHEF_NS_PER_S);
    publish(10);
    TEST_ASSERT_EQUAL_UINT64(1, stats().n_warnings);
    shef_manual_clock_advance(&manual, SHEF_NS_PER_S);
    publish(11);
    TEST_ASSERT_EQUAL_UINT64(2, stats().n_warnings);
}

static void test_a_connection_that_fails_is_tried_every_second_until_it_works(void)
{
    char folder[500], path[560], text[256];
    struct shef_publisher_stats seen;
    shef_host_time next;

    (void)snprintf(folder, sizeof folder, "%s", shef_test_temp_path("later"));
    (void)snprintf(path, sizeof path, "file://%s/log", folder);

    const struct shef_publisher_params params = params_for(path);

    start(&params);
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_publisher_connect(publisher, &err));
    publish(0);
    TEST_ASSERT_EQUAL_UINT64(1, stats().n_unpublished);
    TEST_ASSERT_TRUE(shef_publisher_next_tick(publisher, &next));
    TEST_ASSERT_EQUAL_INT64(SHEF_NS_PER_S,
                            shef_host_time_since(next, shef_clock_now(&manual.clock)));
    shef_publisher_tick(publisher);
    TEST_ASSERT_EQUAL_UINT64(1, stats().n_failed_connects);
    shef_manual_clock_advance(&manual, SHEF_NS_PER_S);
    shef_publisher_tick(publisher);
    seen = stats();
    TEST_ASSERT_EQUAL_UINT64(2, seen.n_failed_connects);
    TEST_ASSERT_EQUAL_UINT64(1, seen.n_warnings);
    shef_publisher_describe_trouble(&seen, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("LCM: not connected after 2 tries, 1 results were not published; it "
                             "tries again every second",
                             text);

    TEST_ASSERT_EQUAL_INT(0, mkdir(folder, 0700));
    shef_manual_clock_advance(&manual, SHEF_NS_PER_S);
    shef_publisher_tick(publisher);
    publish(1);
    seen = stats();
    TEST_ASSERT_TRUE(seen.is_connected);
    TEST_ASSERT_FALSE(seen.is_failing);
    TEST_ASSERT_EQUAL_UINT64(1, seen.n_published);
    shef_publisher_describe_trouble(&seen, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("", text);
}

static void expect_refused(const char *to, const char *prefix, const char *sentence)
{
    struct shef_publisher_params params = params_for(to);

    params.prefix = prefix;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_publisher_create(&publisher, &params, &err));
    TEST_ASSERT_EQUAL_STRING(sentence, err.text);
    TEST_ASSERT_NULL(publisher);
}

static void test_addresses_that_cannot_work_are_refused_with_a_sentence(void)
{
    expect_refused("nonsense", "A",
                   "LCM address 'nonsense': it must begin with udpm://, file:// or memq://");
    expect_refused("tcpq://localhost", "A",
                   "LCM address 'tcpq://localhost': it must begin with udpm://, file:// or "
                   "memq://");
    expect_refused("udpm://hello", "A",
                   "LCM address 'udpm://hello': 'hello' is no IPv4 address such as 239.255.76.67");
    expect_refused("udpm://10.0.0.1:7667", "A",
                   "LCM address 'udpm://10.0.0.1:7667': 10.0.0.1 is no multicast address; those "
                   "are 224.0.0.0 to 239.255.255.255");
    expect_refused("udpm://239.255.76.67:99999?ttl=0", "A",
                   "LCM address 'udpm://239.255.76.67:99999?ttl=0': '99999' is no port from 1 to "
                   "65535");
    expect_refused("udpm://239.255.76.67", "A",
                   "LCM address 'udpm://239.255.76.67': behind 239.255.76.67 the port is missing, "
                   "such as :7667");
    expect_refused("udpm://?ttl=abc", "A",
                   "LCM address 'udpm://?ttl=abc': 'ttl=abc' must be a whole number from 0 to 255");
    expect_refused("udpm://?ttl=1&", "A",
                   "LCM address 'udpm://?ttl=1&': '' is none of the options ttl=N and "
                   "recv_buf_size=N");
    expect_refused("udpm://239.255.76.67:7667?recv_buf_size=4194304&tll=0", "A",
                   "LCM address 'udpm://239.255.76.67:7667?recv_buf_size=4194304&tll=0': 'tll=0' "
                   "is none of the options ttl=N and recv_buf_size=N");
    expect_refused("file://", "A", "LCM address 'file://': the path of the log is missing");
    expect_refused("file:///tmp/a?mode=r", "A",
                   "LCM address 'file:///tmp/a?mode=r': a log has no options; it is always "
                   "written anew");
    expect_refused("memq://x", "A", "LCM address 'memq://x': nothing may follow memq://");
    expect_refused("memq://", "",
                   "LCM prefix '': 1 to 50 printable characters without blanks are possible");
    expect_refused("memq://", "A B",
                   "LCM prefix 'A B': 1 to 50 printable characters without blanks are possible");
}

#define N_THREADED 100

/* As the service's thread, with results made on the spot. */
static void *publish_many(void *context)
{
    (void)context;
    (void)pthread_setname_np(pthread_self(), "publisher");
    for (uint64_t seq = 0; seq < N_THREADED; seq++) {
        publish(seq);
        shef_publisher_tick(publisher);
    }
    return NULL;
}

static void test_counts_and_latencies_are_read_and_settings_changed_while_it_publishes(void)
{
    struct shef_publisher_params params;
    struct shef_latency_counts counts;
    pthread_t thread;
    uint64_t n_last = 0;

    (void)log_path("log");
    params = params_for(url);
    params.clock = shef_clock_monotonic();
    start(&params);
    connect_now();
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, publish_many, NULL));
    while (n_last < N_THREADED) {
        const uint64_t n = stats().n_published;

        TEST_ASSERT_TRUE(n >= n_last && n <= N_THREADED);
        n_last = n;
        shef_publisher_set(publisher, FRAMES, 1 + (int32_t)(n % 2));
        shef_latency_read(&shef_publisher_latency(publisher)->own, &counts);
        TEST_ASSERT_TRUE(counts.n_all <= N_THREADED);
    }
    TEST_ASSERT_EQUAL_INT(0, pthread_join(thread, NULL));
    shef_latency_read(&shef_publisher_latency(publisher)->own, &counts);
    TEST_ASSERT_EQUAL_UINT64(N_THREADED, counts.n_all);
    TEST_ASSERT_EQUAL_UINT64(0, stats().n_unpublished);
}

static void test_our_code_on_the_thread_allocates_nothing(void)
{
    struct shef_publisher_params params;
    pthread_t thread;

    SHEF_TEST_NEEDS_ALLOC_WATCH();
    (void)log_path("log");
    params = params_for(url);
    start(&params);
    connect_now();
    shef_alloc_watch_start();
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, publish_many, NULL));
    TEST_ASSERT_EQUAL_INT(0, pthread_join(thread, NULL));
    shef_alloc_watch_stop();
    TEST_ASSERT_EQUAL_UINT64(N_THREADED, stats().n_published);
    if (shef_alloc_watch_calls("publisher", true) != 0)
        shef_alloc_watch_print(stdout);
    TEST_ASSERT_EQUAL_UINT64(0, shef_alloc_watch_calls("publisher", true));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_results_are_published_and_given_back);
    RUN_TEST(test_what_is_published_changes_with_the_next_result);
    RUN_TEST(test_status_comes_once_a_second_and_not_for_every_missed_one);
    RUN_TEST(test_a_status_carries_what_the_publisher_knows);
    RUN_TEST(test_stepped_twice_gives_the_same_log_to_the_byte);
    RUN_TEST(test_a_failing_sink_is_counted_and_warned_of_once_a_minute);
    RUN_TEST(test_a_connection_that_fails_is_tried_every_second_until_it_works);
    RUN_TEST(test_addresses_that_cannot_work_are_refused_with_a_sentence);
    RUN_TEST(test_counts_and_latencies_are_read_and_settings_changed_while_it_publishes);
    RUN_TEST(test_our_code_on_the_thread_allocates_nothing);
    return UNITY_END();
}
