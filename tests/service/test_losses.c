/* Every frame is published, or lost for a reason that is counted; what is left out of a frame is
 * said in its messages. Looked at from a subscriber's side: what is missing there. */
#include <dirent.h>
#include <fcntl.h>
#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "played.h"
#include "service/stereo_internal.h"
#include "support/support.h"
#include "wire.h"

/* The most that can be asked for, so that there is something to leave out. */
static struct shef_config config_of_everything(const char *log)
{
    struct shef_config config = played_config();

    snprintf(config.lcm.url, sizeof config.lcm.url, "file://%s", log);
    config.source.pace = SHEF_PACE_RECORDED;
    config.source.loop = true;
    config.lcm.grid = SHEF_GRID_FULL;
    config.lcm.dense = true;
    config.lcm.cloud = true;
    return config;
}

/* Waits until a number of the status is at least that. */
static void wait_for(struct shef_service *service, const char *path, int64_t n)
{
    int64_t now;

    do {
        json_t *status = played_ask(service, "status", NULL);

        now = played_number(status, path);
        json_decref(status);
        usleep(5000);
    } while (now < n);
}

/* Stops, checks the sum of everything, and gives the last status. */
static json_t *end(struct shef_service *service)
{
    json_t *status;

    shef_service_stop(service);
    played_expect_accounted(service, 0);
    status = played_ask(service, "status", NULL);
    shef_service_destroy(service);
    return status;
}

/* A message says that something was left out exactly where it was. */
static void expect_true_tags(const struct wire_frame *frame)
{
    TEST_ASSERT_EQUAL_INT32(1, frame->n_pose);
    TEST_ASSERT_GREATER_THAN_INT32(0, frame->n_disparity);
    TEST_ASSERT_EQUAL(!(frame->shed_bits & WIRE_SHED_DENSE), frame->n_dense > 0);
    TEST_ASSERT_EQUAL(!(frame->shed_bits & WIRE_SHED_CLOUD), frame->n_cloud > 0);
    TEST_ASSERT_EQUAL_INT32(frame->shed_bits & WIRE_SHED_FULL_GRID ? 2 : 1, frame->grid_step);
}

/* Half the range ends at 23.5 px: nothing nearer than 36.3 m / 23.5 px is found. */
static void expect_range(const struct wire_frame *frame)
{
    const double nearest_m = frame->f_px * frame->baseline_m / 24.5;

    for (int32_t cell = 0; cell < frame->grid_w * frame->grid_h; cell++)
        TEST_ASSERT_TRUE(frame->depths[cell] == 0 || wire_depth_m(frame, cell) > nearest_m);
}

static void expect_log_to_agree(const char *path, const json_t *status)
{
    static const struct {
        int32_t bit;
        const char *count;
    } tags[] = {
        { WIRE_SHED_DENSE, "frames.shed_by.dense" },
        { WIRE_SHED_CLOUD, "frames.shed_by.cloud" },
        { WIRE_SHED_FULL_GRID, "frames.shed_by.full_grid" },
        { WIRE_SHED_RANGE, "frames.shed_by.range" },
    };
    const int64_t n_in = played_number(status, "frames.n_in");
    int64_t n_tagged[4] = { 0 };
    struct wire_log log;
    int64_t n_gaps = 0, next = 0;

    wire_log_read(&log, path);
    for (int32_t i = 0; i < log.n_frames; i++) {
        const struct wire_frame *frame = &log.frames[i];

        TEST_ASSERT_GREATER_OR_EQUAL_INT64_MESSAGE(next, frame->seq, "seq stepped back");
        n_gaps += frame->seq - next;
        next = frame->seq + 1;
        expect_true_tags(frame);
        if (frame->shed_bits & WIRE_SHED_RANGE)
            expect_range(frame);
        for (int t = 0; t < 4; t++)
            n_tagged[t] += (frame->shed_bits & tags[t].bit) != 0;
    }
    TEST_ASSERT_LESS_OR_EQUAL_INT64(n_in, next);
    n_gaps += n_in - next; /* those after the last one that was published */
    TEST_ASSERT_EQUAL_INT64(played_number(status, "frames.n_published"), log.n_frames);
    TEST_ASSERT_EQUAL_INT64(played_number(status, "frames.n_lost"), n_gaps);
    for (int t = 0; t < 4; t++)
        TEST_ASSERT_EQUAL_INT64_MESSAGE(played_number(status, tags[t].count), n_tagged[t],
                                        tags[t].count);
    wire_log_free(&log);
}

static void test_overloaded_the_gaps_in_seq_are_the_counted_losses(void)
{
    const char *path = shef_test_temp_path("log");
    const struct shef_config config = config_of_everything(path);
    struct shef_service *service = played_start(&config);
    json_t *status;

    /* Slower than the frames come, whatever is left out of them. */
    atomic_store(&service->live.drag_us, 60000);
    wait_for(service, "frames.n_lost", 2 * PLAYED_FRAMES);
    wait_for(service, "frames.n_published", 10);
    status = end(service);
    expect_log_to_agree(path, status);
    json_decref(status);
}

/* What passes on what is written to a pipe, but not before it is told to. */
struct late_reader {
    char from[256], to[256];
    atomic_bool may_read;
};

static void *read_late(void *context)
{
    struct late_reader *reader = context;
    static uint8_t bytes[1 << 16];
    FILE *to = fopen(reader->to, "wb");
    const int from = open(reader->from, O_RDONLY | O_CLOEXEC);
    ssize_t n;

    while (!atomic_load(&reader->may_read))
        usleep(5000);
    while (to && (n = read(from, bytes, sizeof bytes)) > 0)
        (void)fwrite(bytes, (size_t)n, 1, to);
    close(from);
    if (to)
        fclose(to);
    return NULL;
}

static void test_while_sending_blocks_frames_are_left_out_and_counted_and_nothing_else_waits(void)
{
    static struct late_reader reader;
    struct shef_config config;
    struct shef_service *service;
    json_t *status;
    pthread_t thread;

    snprintf(reader.from, sizeof reader.from, "%s", shef_test_temp_path("pipe"));
    snprintf(reader.to, sizeof reader.to, "%s", shef_test_temp_path("log"));
    TEST_ASSERT_EQUAL_INT(0, mkfifo(reader.from, 0600));
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, read_late, &reader));
    config = config_of_everything(reader.from);
    service = played_start(&config);
    /* So that work is left out, too, of frames that get lost then. */
    atomic_store(&service->live.drag_us, 22000);
    wait_for(service, "frames.lost_by.no_result", 10);
    atomic_store(&reader.may_read, true);
    status = end(service);
    TEST_ASSERT_EQUAL_INT(0, pthread_join(thread, NULL));
    TEST_ASSERT_EQUAL_INT64(0, played_number(status, "events.n_lost_buffers"));
    expect_log_to_agree(reader.to, status);
    json_decref(status);
}

/* Frames that wait for the first pair count as prompt: at most as many as can be held. */
#define FIRST_FRAMES SHEF_STEREO_FRAMES

static void test_with_limits_of_0_ms_every_frame_is_published_without_what_may_be_left_out(void)
{
    const char *path = shef_test_temp_path("log");
    struct shef_config config = config_of_everything(path);
    struct shef_service *service;
    json_t *status;

    config.shed.dense_ms = config.shed.cloud_ms = config.shed.full_grid_ms = 0;
    config.shed.range_ms = 0;
    config.shed.frame_ms = 1000;
    service = played_start(&config);
    wait_for(service, "frames.n_published", 2 * FIRST_FRAMES);
    status = end(service);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(FIRST_FRAMES,
                                    played_number(status, "frames.n_published") -
                                        played_number(status, "frames.shed_by.range"));
    expect_log_to_agree(path, status);
    json_decref(status);
}

static void test_with_a_limit_of_0_ms_for_frames_hardly_any_is_published_and_all_are_counted(void)
{
    const char *path = shef_test_temp_path("log");
    struct shef_config config = config_of_everything(path);
    struct shef_service *service;
    json_t *status;

    config.shed.frame_ms = 0;
    service = played_start(&config);
    wait_for(service, "frames.lost_by.shed", 2 * PLAYED_FRAMES);
    status = end(service);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(FIRST_FRAMES, played_number(status, "frames.n_published"));
    expect_log_to_agree(path, status);
    json_decref(status);
}

/* A thread of this process gets the time that nobody else wants. */
static void starve(const char *thread)
{
    DIR *tasks = opendir("/proc/self/task");
    const struct sched_param none = { 0 };
    int n_found = 0;

    TEST_ASSERT_NOT_NULL(tasks);
    for (const struct dirent *task; (task = readdir(tasks));) {
        char path[300], name[17] = "";
        FILE *file;

        snprintf(path, sizeof path, "/proc/self/task/%s/comm", task->d_name);
        file = fopen(path, "r");
        if (file && fscanf(file, "%16s", name) == 1 && strcmp(name, thread) == 0)
            n_found += sched_setscheduler((pid_t)atoi(task->d_name), SCHED_IDLE, &none) == 0;
        if (file)
            fclose(file);
    }
    closedir(tasks);
    TEST_ASSERT_EQUAL_INT(1, n_found);
}

static void test_stepped_a_recorder_that_lags_behind_costs_no_frame(void)
{
    struct shef_config config = played_config();
    struct shef_service *service;
    json_t *status;

    config.source.loop = true;
    service = played_start(&config);
    starve("record_frames");
    json_decref(played_ask(service, "record start", "{\"name\": \"lagging\"}"));
    wait_for(service, "frames.n_in", 4 * PLAYED_FRAMES);
    status = end(service);
    TEST_ASSERT_EQUAL_INT64(0, played_number(status, "frames.n_lost") -
                                   played_number(status, "frames.lost_by.stopped"));
    json_decref(status);
}

static void test_stepped_over_several_passes_seq_has_no_gap(void)
{
    const char *path = shef_test_temp_path("log");
    struct shef_config config = config_of_everything(path);
    struct shef_service *service;
    json_t *status;

    config.source.pace = SHEF_PACE_STEPPED;
    service = played_start(&config);
    wait_for(service, "frames.n_in", 2 * PLAYED_FRAMES + 1);
    status = end(service);
    TEST_ASSERT_EQUAL_INT64(0, played_number(status, "frames.n_lost") -
                                   played_number(status, "frames.lost_by.stopped"));
    expect_log_to_agree(path, status);
    json_decref(status);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_overloaded_the_gaps_in_seq_are_the_counted_losses);
    RUN_TEST(test_while_sending_blocks_frames_are_left_out_and_counted_and_nothing_else_waits);
    RUN_TEST(test_with_limits_of_0_ms_every_frame_is_published_without_what_may_be_left_out);
    RUN_TEST(test_with_a_limit_of_0_ms_for_frames_hardly_any_is_published_and_all_are_counted);
    RUN_TEST(test_stepped_a_recorder_that_lags_behind_costs_no_frame);
    RUN_TEST(test_stepped_over_several_passes_seq_has_no_gap);
    return UNITY_END();
}
