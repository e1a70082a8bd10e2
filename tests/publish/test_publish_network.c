/* Multicast in a network namespace of this program's own: nothing leaves it, and nobody else's
 * messages come in. */
#include "publish/publisher.h"

#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <lcm/eventlog.h>
#include <shef_lcm_decode.h>

#include "documented.h"
#include "made_result.h"
#include "support/namespaces.h"

#define WIDTH_PX   640
#define HEIGHT_PX  480
#define URL        "udpm://239.255.76.67:7667?ttl=0"
#define PATIENCE_S 20

extern char **environ;

static bool has_namespace;
static struct shef_result_pool *pool;
static struct shef_publisher *publisher;
static struct shef_manual_clock manual;
static struct shef_test_random test_random;
static struct shef_error err;

void setUp(void)
{
    const struct shef_publisher_params params = {
        .url = URL,
        .prefix = "SHEF",
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .outputs = SHEF_OUTPUT(SHEF_CHANNEL_DEPTH) | SHEF_OUTPUT(SHEF_CHANNEL_POSE),
        .grid_step = 2,
        .clock = &manual.clock,
    };

    if (!has_namespace)
        TEST_IGNORE_MESSAGE("this user may not make a network namespace");
    shef_test_set_loopback(false);
    test_random = shef_test_random_start();
    shef_manual_clock_init(&manual, (shef_host_time){ SHEF_NS_PER_S });
    pool = shef_result_pool_create(1, WIDTH_PX, HEIGHT_PX, 0, NULL);
    TEST_ASSERT_NOT_NULL(pool);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_publisher_create(&publisher, &params, &err));
}

void tearDown(void)
{
    shef_publisher_destroy(publisher);
    publisher = NULL;
    shef_result_pool_destroy(pool);
    pool = NULL;
}

static void publish(uint64_t seq)
{
    struct shef_result *result = shef_result_take(pool);

    TEST_ASSERT_NOT_NULL(result);
    made_result_fill(result, seq, 0.03, &test_random);
    shef_publisher_result(publisher, result);
}

static struct shef_publisher_stats stats(void)
{
    struct shef_publisher_stats now;

    shef_publisher_stats(publisher, &now);
    return now;
}

static void connect_now(void)
{
    shef_test_set_loopback(true);
    shef_test_add_route("239.255.76.67");
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_publisher_connect(publisher, &err), err.text);
}

static void test_without_a_route_one_sentence_names_the_command_that_adds_it(void)
{
    const char *path = shef_test_temp_path("stderr");
    const int kept = dup(STDERR_FILENO);
    const int file = open(path, O_CREAT | O_RDWR | O_TRUNC | O_CLOEXEC, 0600);
    struct stat seen;

    TEST_ASSERT_TRUE(kept >= 0 && file >= 0);
    (void)dup2(file, STDERR_FILENO);

    const enum shef_err result = shef_publisher_connect(publisher, &err);

    (void)dup2(kept, STDERR_FILENO);
    TEST_ASSERT_EQUAL_INT(0, fstat(file, &seen));
    close(kept);
    close(file);
    TEST_ASSERT_EQUAL(SHEF_ERR_IO, result);
    TEST_ASSERT_EQUAL_STRING(
        "LCM address '" URL "': no route to 239.255.76.67, so nothing can be published; connect "
        "the network, or keep messages on this computer: 'ip link set lo up' and 'ip route add "
        "239.255.76.67/32 dev lo' as root",
        err.text);
    TEST_ASSERT_EQUAL_INT64_MESSAGE(0, seen.st_size, "LCM printed something itself");
}

static void test_a_route_that_comes_later_is_found(void)
{
    TEST_ASSERT_EQUAL(SHEF_ERR_IO, shef_publisher_connect(publisher, &err));
    publish(0);
    TEST_ASSERT_EQUAL_UINT64(1, stats().n_unpublished);
    shef_test_set_loopback(true);
    shef_test_add_route("239.255.76.67");
    shef_manual_clock_advance(&manual, SHEF_NS_PER_S);
    shef_publisher_tick(publisher);
    TEST_ASSERT_TRUE(stats().is_connected);
    publish(1);
    TEST_ASSERT_EQUAL_UINT64(1, stats().n_published);
    TEST_ASSERT_FALSE(stats().is_failing);
}

static void test_a_network_that_goes_is_counted_and_one_that_returns_is_used(void)
{
    struct shef_publisher_stats seen;
    char text[256];

    connect_now();
    publish(0);
    shef_test_set_loopback(false);
    for (uint64_t seq = 1; seq <= 5; seq++)
        publish(seq);
    seen = stats();
    TEST_ASSERT_EQUAL_UINT64(1, seen.n_published);
    TEST_ASSERT_EQUAL_UINT64(5, seen.n_unpublished);
    TEST_ASSERT_EQUAL_UINT64(1, seen.n_warnings);
    shef_publisher_describe_trouble(&seen, text, sizeof text);
    TEST_ASSERT_EQUAL_STRING("LCM: messages are not sent (Network is unreachable); 5 results were "
                             "not published so far; every further one is tried",
                             text);
    TEST_ASSERT_EQUAL_UINT32(0, shef_result_pool_lent_count(pool));
    shef_test_set_loopback(true);
    shef_test_add_route("239.255.76.67");
    publish(6);
    TEST_ASSERT_EQUAL_UINT64(2, stats().n_published);
    TEST_ASSERT_FALSE(stats().is_failing);
}

/* Starts a program found on the path; its output comes through *out_fd. 0: it is not there. */
static pid_t start_program(const char *const *words, int *out_fd)
{
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    int ends[2];
    pid_t pid = 0;

    TEST_ASSERT_EQUAL_INT(0, pipe2(ends, O_CLOEXEC));
    TEST_ASSERT_EQUAL_INT(0, posix_spawn_file_actions_init(&actions));
    TEST_ASSERT_EQUAL_INT(0, posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO));
    /* A group of its own: some are scripts that start the real program. */
    TEST_ASSERT_EQUAL_INT(0, posix_spawnattr_init(&attributes));
    TEST_ASSERT_EQUAL_INT(0, posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP));
    if (posix_spawnp(&pid, words[0], &actions, &attributes, (char *const *)(uintptr_t)words,
                     environ) != 0)
        pid = 0;
    (void)posix_spawnattr_destroy(&attributes);
    (void)posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    *out_fd = ends[0];
    return pid;
}

static void end_program(pid_t pid, int out_fd)
{
    char rest[1000];
    int status;

    TEST_ASSERT_EQUAL_INT(0, kill(-pid, SIGTERM));
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    /* A script may end before what it has started. */
    while (read(out_fd, rest, sizeof rest) > 0)
        continue;
    close(out_fd);
}

static void pause_ms(long ms)
{
    (void)nanosleep(&(struct timespec){ ms / 1000, ms % 1000 * 1000000 }, NULL);
}

/* Publishes until the program has printed a line, for it may not be listening yet. */
static void publish_until_it_prints(pid_t pid, int out_fd, char *out_line, size_t n_bytes)
{
    for (uint64_t seq = 0; seq < PATIENCE_S * 20; seq++) {
        struct pollfd readable = { .fd = out_fd, .events = POLLIN };

        publish(seq);
        if (poll(&readable, 1, 50) > 0) {
            const ssize_t n = read(out_fd, out_line, n_bytes - 1);
            TEST_ASSERT_GREATER_THAN_INT64_MESSAGE(0, n, "the subscriber ended");
            out_line[n] = '\0';
            *strchrnul(out_line, '\n') = '\0';
            return;
        }
    }
    (void)kill(-pid, SIGKILL);
    TEST_FAIL_MESSAGE("the subscriber printed nothing");
}

/* The line that both examples print for a frame. */
static void expect_line(const char *line)
{
    unsigned long seq = 0;
    double said_m, said_sigma_m;
    int n_said = 0, n_points = 0;
    float nearest_m = 1e9f, sigma_m = 0;

    TEST_ASSERT_EQUAL_INT_MESSAGE(4,
                                  sscanf(line, "SHEF_DEPTH %lu: %d points, nearest %lf m +- %lf",
                                         &seq, &n_said, &said_m, &said_sigma_m),
                                  line);

    /* The same frame again: the random numbers start anew, and each frame takes as many. */
    struct shef_result *result = shef_result_take(pool);

    test_random = shef_test_random_start();
    for (uint64_t i = 0; i <= seq; i++)
        made_result_fill(result, i, 0.03, &test_random);
    for (int32_t y = 0; y < HEIGHT_PX; y += 2)
        for (int32_t x = 0; x < WIDTH_PX; x += 2) {
            int32_t best_x = -1, best_y = -1;

            for (int32_t v = y; v < y + 2; v++)
                for (int32_t u = x; u < x + 2; u++)
                    if (shef_row_f32(result->disparity, v)[u] > 0 &&
                        (best_x < 0 || shef_row_f32(result->confidence, v)[u] >
                                           shef_row_f32(result->confidence, best_y)[best_x]))
                        best_x = u, best_y = v;
            if (best_x < 0 || shef_row_f32(result->depth_m, best_y)[best_x] > 16.38f)
                continue;
            n_points++;
            if (shef_row_f32(result->depth_m, best_y)[best_x] < nearest_m) {
                nearest_m = shef_row_f32(result->depth_m, best_y)[best_x];
                sigma_m = shef_row_f32(result->sigma_m, best_y)[best_x];
            }
        }
    TEST_ASSERT_INT_WITHIN(1, n_points, n_said); /* at 16.38 m rounding decides */
    TEST_ASSERT_DOUBLE_WITHIN(0.0002, nearest_m, said_m);
    TEST_ASSERT_DOUBLE_WITHIN(0.07 * sigma_m, sigma_m, said_sigma_m);
    shef_result_give(result);
}

static void expect_subscriber(const char *commands)
{
    char line[1000], script[8192];
    int out_fd;

    (void)snprintf(script, sizeof script, "cd '%s' && exec env %s", documented_folder(), commands);
    connect_now();

    const pid_t pid = start_program((const char *[]){ "bash", "-c", script, NULL }, &out_fd);

    TEST_ASSERT_GREATER_THAN_INT(0, pid);
    publish_until_it_prints(pid, out_fd, line, sizeof line);
    end_program(pid, out_fd);
    expect_line(line);
}

static void test_the_documented_subscriber_in_c_sees_the_depths(void)
{
#if defined __SANITIZE_ADDRESS__ || defined __SANITIZE_THREAD__
    /* The documented command does not know that the library has been made for a sanitizer. */
    expect_subscriber("build/release/bin/subscriber_example");
#else
    documented_run(documented_commands("gcc -o subscriber"));
    expect_subscriber("./subscriber");
#endif
}

static void test_the_documented_subscriber_in_python_sees_the_same_depths(void)
{
    char commands[4096];

    if (system("command -v python3 >/dev/null") != 0)
        TEST_IGNORE_MESSAGE("there is no python3");
    if (system("python3 -c 'import lcm' 2>/dev/null") != 0) {
        (void)snprintf(commands, sizeof commands, "cp '%s' docs/examples/lcm.py",
                       shef_test_source("tests/publish/lcm_stand_in.py"));
        documented_run(commands);
    }
    expect_subscriber(documented_commands("PYTHONPATH="));
}

struct logged {
    int n_depths, n_poses;
};

/* Every message of a log can be read. */
static struct logged read_log(const char *path)
{
    lcm_eventlog_t *log = lcm_eventlog_create(path, "r");
    struct logged logged = { 0 };
    lcm_eventlog_event_t *event;

    TEST_ASSERT_NOT_NULL(log);
    while ((event = lcm_eventlog_read_next_event(log)) != NULL) {
        struct shef_lcm_grid grid;
        struct shef_lcm_pose pose;

        if (strcmp(event->channel, "SHEF_DEPTH") == 0) {
            TEST_ASSERT_EQUAL(SHEF_LCM_OK,
                              shef_lcm_decode_depth(event->data, (size_t)event->datalen, &grid));
            TEST_ASSERT_GREATER_THAN_INT32(0, grid.n_points);
            logged.n_depths++;
        } else {
            TEST_ASSERT_EQUAL_STRING("SHEF_POSE", event->channel);
            TEST_ASSERT_EQUAL(SHEF_LCM_OK,
                              shef_lcm_decode_pose(event->data, (size_t)event->datalen, &pose));
            TEST_ASSERT_EQUAL_DOUBLE(0.3, pose.pos_m[2]);
            logged.n_poses++;
        }
        lcm_eventlog_free_event(event);
    }
    lcm_eventlog_destroy(log);
    return logged;
}

static void test_lcm_logger_records_what_was_published_and_lcm_logplayer_plays_it(void)
{
    char path[PATH_MAX], played_path[PATH_MAX];
    struct logged logged, played;
    struct stat seen = { 0 };
    int out_fd;

    (void)snprintf(path, sizeof path, "%s/logged", documented_folder());
    connect_now();

    const pid_t pid = start_program(
        (const char *[]){ "lcm-logger", "--quiet", "--force", "--lcm-url=" URL, path, NULL },
        &out_fd);

    TEST_ASSERT_GREATER_THAN_INT_MESSAGE(0, pid, "no lcm-logger; it is in liblcm-bin");
    for (uint64_t seq = 0; seq < PATIENCE_S * 20 && seen.st_size < 100000; seq++) {
        publish(seq);
        pause_ms(50);
        (void)stat(path, &seen);
    }
    end_program(pid, out_fd);
    logged = read_log(path);
    TEST_ASSERT_GREATER_THAN_INT(0, logged.n_depths);
    TEST_ASSERT_GREATER_THAN_INT(0, logged.n_poses);

    documented_run("lcm-logplayer --speed=1000 --lcm-url='file://played?mode=w' logged");
    (void)snprintf(played_path, sizeof played_path, "%s/played", documented_folder());
    played = read_log(played_path);
    TEST_ASSERT_EQUAL_INT(logged.n_depths, played.n_depths);
    TEST_ASSERT_EQUAL_INT(logged.n_poses, played.n_poses);
}

int main(void)
{
    has_namespace = shef_test_enter_namespaces(CLONE_NEWNET);
    UNITY_BEGIN();
    RUN_TEST(test_without_a_route_one_sentence_names_the_command_that_adds_it);
    RUN_TEST(test_a_route_that_comes_later_is_found);
    RUN_TEST(test_a_network_that_goes_is_counted_and_one_that_returns_is_used);
    RUN_TEST(test_the_documented_subscriber_in_c_sees_the_depths);
    RUN_TEST(test_the_documented_subscriber_in_python_sees_the_same_depths);
    RUN_TEST(test_lcm_logger_records_what_was_published_and_lcm_logplayer_plays_it);
    return UNITY_END();
}
