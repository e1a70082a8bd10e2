/* What the service says of itself over LCM, read back from a log. */
#include <stdio.h>
#include <string.h>
#include <time.h>

#include <lcm/eventlog.h>
#include <shef_lcm_decode.h>

#include "played.h"
#include "support/support.h"

#define PATIENCE_S 60

/* How many status messages the log has; the last one's bytes go to out. */
static int read_log(const char *path, uint8_t *out, size_t *out_bytes, size_t max_bytes)
{
    lcm_eventlog_t *log = lcm_eventlog_create(path, "r");
    lcm_eventlog_event_t *event;
    int n = 0;

    while (log && (event = lcm_eventlog_read_next_event(log)) != NULL) {
        if (strcmp(event->channel, "SHEF_STATUS") == 0) {
            TEST_ASSERT_LESS_OR_EQUAL_size_t(max_bytes, (size_t)event->datalen);
            memcpy(out, event->data, (size_t)event->datalen);
            *out_bytes = (size_t)event->datalen;
            n++;
        }
        lcm_eventlog_free_event(event);
    }
    if (log)
        lcm_eventlog_destroy(log);
    return n;
}

static void test_a_status_message_tells_what_the_service_does(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    struct shef_lcm_status status;
    uint8_t bytes[2000];
    size_t n_bytes = 0;
    char path[400];
    int n = 0;

    (void)snprintf(path, sizeof path, "%s", shef_test_temp_path("status.log"));
    (void)snprintf(config.lcm.url, sizeof config.lcm.url, "file://%s", path);
    config.source.pace = SHEF_PACE_RECORDED;
    config.source.loop = true;
    service = played_start(&config);
    for (int i = 0; i < PATIENCE_S * 10 && n < 2; i++) {
        (void)nanosleep(&(struct timespec){ 0, 100000000 }, NULL);
        n = read_log(path, bytes, &n_bytes, sizeof bytes);
    }
    shef_service_stop(service);
    shef_service_destroy(service);

    TEST_ASSERT_GREATER_OR_EQUAL_INT(2, n);
    TEST_ASSERT_EQUAL(SHEF_LCM_OK, shef_lcm_decode_status(bytes, n_bytes, &status));
    TEST_ASSERT_EQUAL_STRING("playing played", status.state);
    TEST_ASSERT_GREATER_THAN_INT64(0, status.n_events);
    TEST_ASSERT_GREATER_THAN_INT64(0, status.n_frames);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(status.n_frames, status.n_published + status.n_shed);
    TEST_ASSERT_GREATER_THAN_INT64(0, status.n_published);
    TEST_ASSERT_TRUE(status.events_per_s > 0.0f && status.cpu_cores > 0.0f);
    TEST_ASSERT_GREATER_THAN_INT32(1, status.memory_mib);
    TEST_ASSERT_GREATER_THAN_INT64(0, status.complete_to_published_p50_ns);
    TEST_ASSERT_TRUE(status.complete_to_published_p99_ns >= status.complete_to_published_p50_ns);
    TEST_ASSERT_GREATER_THAN_INT64(1600000000000000, status.header.utime_us);
    TEST_ASSERT_GREATER_THAN_INT64(0, status.header.event_us);
    TEST_ASSERT_NOT_EQUAL_INT64(0, status.header.session_id);
    TEST_ASSERT_NOT_EQUAL_INT64(0, status.header.calib_id[0] | status.header.calib_id[1] |
                                       status.header.calib_id[2] | status.header.calib_id[3]);
}

static void test_stepped_there_are_no_status_messages(void)
{
    struct shef_config config = played_config();
    uint8_t bytes[2000];
    size_t n_bytes;
    char path[400];

    (void)snprintf(path, sizeof path, "%s", shef_test_temp_path("stepped.log"));
    (void)snprintf(config.lcm.url, sizeof config.lcm.url, "file://%s", path);
    played_whole(&config);
    TEST_ASSERT_EQUAL_INT(0, read_log(path, bytes, &n_bytes, sizeof bytes));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_status_message_tells_what_the_service_does);
    RUN_TEST(test_stepped_there_are_no_status_messages);
    return UNITY_END();
}
