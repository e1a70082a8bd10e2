/* A rendered recording, read by the readers that everybody uses, against what was asked for. */
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/cpu.h"
#include "core/file.h"
#include "core/time.h"
#include "record/recorded_events.h"
#include "record/recorded_frames.h"
#include "record/recorded_poses.h"
#include "record/recorded_triggers.h"
#include "record/recorded_truth.h"
#include "small_rig.h"
#include "support/small_disk.h"
#include "support/support.h"

enum { MAX_TRIGGERS = 64, N_FRAMES = 5 };

/* One recording for all tests that only read. */
static char folder[4200];
static struct sim_rig_report report;
static struct shef_recorded_truth truth;

static void make_once(void)
{
    const struct sim_rig_settings settings = small_rig_settings();
    struct shef_error err;

    if (folder[0] == '\0') {
        snprintf(folder, sizeof folder, "%s", shef_test_temp_path("recording"));
        report = small_rig_render(&settings, folder, 1, shef_cpu_features());
        TEST_ASSERT_EQUAL_INT_MESSAGE(SHEF_OK, shef_recorded_truth_open(folder, &truth, &err),
                                      err.text);
    }
}

static int64_t clock_at(const char *name, int64_t true_ns)
{
    const struct shef_truth_clock *clock = shef_recorded_truth_clock(&truth, name);

    TEST_ASSERT_NOT_NULL(clock);
    return clock->offset_ns + true_ns + (int64_t)((double)true_ns * clock->drift_ppm * 1e-6);
}

/* What the event part says. */
struct event_summary {
    uint64_t n_events;
    int64_t first_us;
    int64_t last_us;
    int64_t rise_us[MAX_TRIGGERS];
    int64_t fall_us[MAX_TRIGGERS];
    uint32_t n_rises;
    uint32_t n_falls;
};

static struct event_summary read_events(const char *path)
{
    static struct shef_event room[SHEF_BATCH_EVENTS];
    struct shef_event_batch batch = { .events = room, .capacity = SHEF_BATCH_EVENTS };
    struct event_summary summary = { .first_us = INT64_MAX };
    struct shef_recorded_events *events;
    struct shef_error err;
    enum shef_err code;

    TEST_ASSERT_EQUAL_INT(SHEF_OK,
                          shef_recorded_events_open(path, shef_cpu_features(), &events, &err));
    while ((code = shef_recorded_events_next(events, &batch, &err)) == SHEF_OK) {
        for (uint32_t i = 0; i < batch.n_events; i++) {
            const int64_t t_us = shef_event_batch_time_us(&batch, i);

            summary.first_us = t_us < summary.first_us ? t_us : summary.first_us;
            TEST_ASSERT_TRUE(t_us >= summary.last_us);
            summary.last_us = t_us;
        }
        summary.n_events += batch.n_events;
        for (uint32_t i = 0; i < batch.n_triggers; i++) {
            TEST_ASSERT_EQUAL_UINT8(0, batch.triggers[i].channel);
            if (batch.triggers[i].rising)
                summary.rise_us[summary.n_rises++] = batch.triggers[i].t_us;
            else
                summary.fall_us[summary.n_falls++] = batch.triggers[i].t_us;
        }
    }
    TEST_ASSERT_EQUAL_INT(SHEF_ERR_EMPTY, code);
    shef_recorded_events_close(events);
    return summary;
}

static void test_events_go_on_for_40_ms_after_the_frames_and_none_is_lost(void)
{
    make_once();

    const struct event_summary events = read_events(folder);
    const int64_t start_us = clock_at("event", 0) / 1000;

    TEST_ASSERT_EQUAL_UINT64(report.events.n_events, events.n_events);
    TEST_ASSERT_EQUAL_UINT64(0, report.events.n_lost);
    TEST_ASSERT_GREATER_THAN_UINT64(50000, events.n_events);
    TEST_ASSERT_INT64_WITHIN(200, start_us, events.first_us);
    TEST_ASSERT_INT64_WITHIN(400, start_us + 160000, events.last_us);
}

static void test_triggers_are_the_edges_of_the_exposures(void)
{
    make_once();

    const struct event_summary events = read_events(folder);

    TEST_ASSERT_EQUAL_INT32(N_FRAMES, report.n_frames);
    TEST_ASSERT_EQUAL_UINT32(N_FRAMES, truth.n_frames);
    TEST_ASSERT_EQUAL_UINT32(N_FRAMES, events.n_rises);
    TEST_ASSERT_EQUAL_UINT32(N_FRAMES, events.n_falls);
    for (uint32_t i = 0; i < N_FRAMES; i++) {
        TEST_ASSERT_EQUAL_INT64(truth.frames[i].rise.ns / 1000, events.rise_us[i]);
        TEST_ASSERT_EQUAL_INT64(5000000, truth.frames[i].exposure_ns);
        TEST_ASSERT_INT64_WITHIN(1, events.rise_us[i] + 5000, events.fall_us[i]);
        TEST_ASSERT_EQUAL_INT64(truth.frames[i].rise.ns + 2500000, truth.frames[i].middle.ns);
    }
    /* 40 frames a second, by a clock that is off by some 30 ppm at most. */
    TEST_ASSERT_INT64_WITHIN(4, 75000, events.rise_us[3] - events.rise_us[0]);
}

static void test_frames_carry_their_cameras_time_and_arrive_after_their_exposure(void)
{
    struct shef_recorded_frames *frames;
    struct shef_recorded_frame frame;
    struct shef_error err;
    enum shef_err code;
    uint32_t n = 0;

    make_once();
    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_recorded_frames_open(folder, &frames, &err));
    while ((code = shef_recorded_frames_next(frames, &frame, &err)) == SHEF_OK) {
        const int64_t start_ns = truth.frames[n].rise.ns - clock_at("event", 0);
        double sum = 0, squares = 0;

        TEST_ASSERT_TRUE(n == 0 || frame.follows);
        TEST_ASSERT_EQUAL_UINT64(n, frame.info.number);
        TEST_ASSERT_INT64_WITHIN(2, clock_at("frame", start_ns), frame.info.time.ns);
        TEST_ASSERT_TRUE(frame.info.arrived.ns > clock_at("host", start_ns + 5000000));
        TEST_ASSERT_TRUE(frame.info.arrived.ns < clock_at("host", start_ns + 30000000));
        TEST_ASSERT_EQUAL_UINT32(5000, frame.info.exposure_us);
        TEST_ASSERT_EQUAL_UINT32(report.gain_mdb, frame.info.gain_mdb);
        TEST_ASSERT_EQUAL_UINT32(2048, frame.info.width_px);
        TEST_ASSERT_EQUAL_UINT32(1536, frame.info.height_px);
        TEST_ASSERT_EQUAL_UINT32(SHEF_PFNC_MONO8, frame.info.pixel_format);
        for (uint32_t i = 0; i < 2048u * 1536u; i++) {
            sum += frame.pixels[i];
            squares += (double)frame.pixels[i] * frame.pixels[i];
        }
        sum /= 2048 * 1536;
        TEST_ASSERT_TRUE(sum > 30 && sum < 200);
        TEST_ASSERT_TRUE(sqrt(squares / (2048 * 1536) - sum * sum) > 15);
        n++;
    }
    TEST_ASSERT_EQUAL_INT(SHEF_ERR_EMPTY, code);
    TEST_ASSERT_EQUAL_UINT32(N_FRAMES, n);
    shef_recorded_frames_close(frames);
}

static void expect_same_pose(const struct shef_rigid *expected, const struct shef_rigid *actual)
{
    for (int i = 0; i < 3; i++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected->t_m[i], actual->t_m[i]);
    for (int i = 0; i < 9; i++)
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected->r[i], actual->r[i]);
}

static void test_poses_come_every_8_ms_and_are_true(void)
{
    struct shef_recorded_poses *poses;
    struct shef_recorded_pose pose;
    struct shef_error err;
    enum shef_err code;
    int64_t last_ns = 0;
    uint32_t n = 0;

    make_once();
    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_recorded_poses_open(folder, &poses, &err));
    while ((code = shef_recorded_poses_next(poses, &pose, &err)) == SHEF_OK) {
        const int64_t true_ns = truth.poses[n].time.ns - clock_at("event", 0);
        const double *v = pose.velocity_m_s;

        TEST_ASSERT_TRUE(n == 0 || pose.time.ns - last_ns == 8000000);
        last_ns = pose.time.ns;
        TEST_ASSERT_INT64_WITHIN(1000, clock_at("robot", true_ns), pose.time.ns);
        expect_same_pose(&truth.poses[n].t_world_hand, &pose.t_world_hand);
        TEST_ASSERT_TRUE(pose.has_speed);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.1, sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
        TEST_ASSERT_TRUE(pose.arrived.ns >=
                         clock_at("host", true_ns) + truth.calibration.robot_delay.ns - 100);
        TEST_ASSERT_TRUE(pose.arrived.ns < clock_at("host", true_ns) + 5000000);
        n++;
    }
    TEST_ASSERT_EQUAL_INT(SHEF_ERR_EMPTY, code);
    TEST_ASSERT_EQUAL_UINT32((uint32_t)report.n_poses, n);
    TEST_ASSERT_UINT32_WITHIN(1, 20, n);
    shef_recorded_poses_close(poses);
}

static void test_the_host_sees_the_same_edges_a_little_later(void)
{
    struct shef_recorded_triggers *triggers;
    struct shef_edge edge;
    struct shef_error err;
    uint32_t n = 0;

    make_once();
    TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_recorded_triggers_open(folder, &triggers, &err));
    while (shef_recorded_triggers_next(triggers, &edge, NULL, &err) == SHEF_OK) {
        const struct shef_truth_frame *frame = &truth.frames[n / 2];
        const int64_t start_ns = frame->rise.ns - clock_at("event", 0);
        const int64_t edge_ns = n % 2 == 0 ? start_ns : start_ns + frame->exposure_ns;
        const int64_t late_ns = edge.time.ns - clock_at("host", edge_ns);

        TEST_ASSERT_EQUAL_INT(n % 2 == 0, edge.is_high);
        TEST_ASSERT_TRUE(late_ns >= 7000 && late_ns < 50000);
        n++;
    }
    TEST_ASSERT_EQUAL_UINT32(2 * N_FRAMES, n);
    shef_recorded_triggers_close(triggers);
}

static void test_maps_of_truth_are_there_for_every_frame(void)
{
    struct shef_truth_maps maps;
    struct shef_error err;

    make_once();
    for (uint32_t i = 0; i < N_FRAMES; i++)
        for (int view = 0; view < SHEF_TRUTH_VIEWS; view++) {
            int32_t n_valid = 0;

            TEST_ASSERT_EQUAL_INT(SHEF_OK, shef_recorded_truth_maps(
                                               &truth, (enum shef_truth_view)view, i, &maps, &err));
            for (int32_t y = 0; y < 480; y++)
                for (int32_t x = 0; x < 640; x++) {
                    const double depth_m = shef_row_f32(maps.depth_m, y)[x];
                    const double d = shef_row_f32(maps.disparity, y)[x];

                    n_valid += shef_row_u8(maps.mask, y)[x] == SHEF_TRUTH_VALID;
                    /* Depth is kept in whole millimetres. */
                    TEST_ASSERT_DOUBLE_WITHIN(0.0006, 555 * truth.baseline_m / d, depth_m);
                }
            TEST_ASSERT_GREATER_THAN_INT32(200000, n_valid);
            shef_truth_maps_free(&maps);
        }
}

static void expect_same_file(const char *a, const char *b, const char *name)
{
    char path[4300];
    struct shef_error err;
    uint8_t *bytes[2];
    size_t n[2];

    for (int i = 0; i < 2; i++) {
        snprintf(path, sizeof path, "%s/%s", i == 0 ? a : b, name);
        TEST_ASSERT_EQUAL_INT_MESSAGE(
            SHEF_OK, shef_file_read(path, 64u << 20, &bytes[i], &n[i], &err), err.text);
    }
    TEST_ASSERT_EQUAL_size_t(n[0], n[1]);
    TEST_ASSERT_EQUAL_MEMORY(bytes[0], bytes[1], n[0]);
    free(bytes[0]);
    free(bytes[1]);
}

/* The manifest holds the SHA-256 of every other file. */
static void test_threads_and_instructions_do_not_change_a_byte_of_the_folder(void)
{
    const struct sim_rig_settings settings = small_rig_settings();
    char other[4200];

    make_once();
    snprintf(other, sizeof other, "%s", shef_test_temp_path("two_threads"));
    small_rig_render(&settings, other, 2, shef_cpu_features());
    expect_same_file(folder, other, "manifest.json");
    snprintf(other, sizeof other, "%s", shef_test_temp_path("plain_c"));
    small_rig_render(&settings, other, 1, SHEF_CPU_NONE);
    expect_same_file(folder, other, "manifest.json");
    expect_same_file(folder, other, "events/000000.raw");
}

static void test_a_timing_error_moves_events_but_not_triggers(void)
{
    struct sim_rig_settings settings = small_rig_settings();

    make_once();

    const struct event_summary right = read_events(folder);

    for (int sign = -1; sign <= 1; sign += 2) {
        char late[4200];
        struct event_summary wrong;

        settings.event_shift_us = sign * 3000;
        snprintf(late, sizeof late, "%s", shef_test_temp_path(sign < 0 ? "early" : "late"));
        small_rig_render(&settings, late, 1, shef_cpu_features());
        wrong = read_events(late);
        TEST_ASSERT_EQUAL_UINT64(right.n_events, wrong.n_events);
        TEST_ASSERT_EQUAL_INT64(right.first_us + sign * 3000, wrong.first_us);
        TEST_ASSERT_EQUAL_INT64(right.last_us + sign * 3000, wrong.last_us);
        TEST_ASSERT_EQUAL_INT64_ARRAY(right.rise_us, wrong.rise_us, N_FRAMES);
        TEST_ASSERT_EQUAL_INT64_ARRAY(right.fall_us, wrong.fall_us, N_FRAMES);
    }
}

static bool stop_half_way(void *context, int64_t done_ns, int64_t total_ns)
{
    (void)context;
    return done_ns < total_ns / 2;
}

static void test_a_stopped_rendering_leaves_nothing(void)
{
    const struct sim_rig_settings settings = small_rig_settings();
    const struct sim_rig_render_config config = {
        .out = shef_test_temp_path("stopped"),
        .export_images = shef_test_temp_path("stopped_images"),
        .truth_every = 1,
        .go_on = stop_half_way,
    };
    struct sim_rig_report ignored;
    struct sim_rig *rig;
    struct shef_error err;
    int n_entries;

    make_once();
    n_entries = shef_test_temp_count();
    TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_rig_create(&rig, &settings, 0, NULL, &err));
    TEST_ASSERT_EQUAL_INT(SHEF_ERR_GONE, sim_rig_render(rig, &config, &ignored, &err));
    sim_rig_destroy(rig);
    TEST_ASSERT_EQUAL_INT(n_entries, shef_test_temp_count());
}

#define EXPECT(condition) SHEF_TEST_CHILD_EXPECT(condition, err)

static void render_until_refused(const char *out)
{
    const struct sim_rig_settings settings = small_rig_settings();
    const struct sim_rig_render_config config = { .out = out, .truth_every = 1 };
    struct sim_rig_report ignored;
    struct sim_rig *rig;
    struct shef_error err = { .text = "" };

    EXPECT(sim_rig_create(&rig, &settings, shef_cpu_features(), NULL, &err) == SHEF_OK);
    EXPECT(sim_rig_render(rig, &config, &ignored, &err) == SHEF_ERR_NO_SPACE);
    /* Only an empty folder can be removed. */
    EXPECT(mkdir(out, 0777) == 0 && rmdir(out) == 0);
    EXPECT(strstr(err.text, out) && !strstr(err.text, ".part-"));
    EXPECT(strstr(err.text, "the disk is full") && strstr(err.text, "nothing of it was kept"));
}

static void test_a_full_disk_leaves_nothing_and_says_so(void)
{
    shef_test_on_small_disk("disk", "6m", render_until_refused);
}

static void test_a_folder_that_holds_something_is_not_touched(void)
{
    const struct sim_rig_settings settings = small_rig_settings();
    const struct sim_rig_render_config config = { .out = folder, .truth_every = 1 };
    struct sim_rig_report ignored;
    struct sim_rig *rig;
    struct shef_error err;
    int n_entries;

    make_once();
    n_entries = shef_test_temp_count();
    TEST_ASSERT_EQUAL_INT(SHEF_OK, sim_rig_create(&rig, &settings, 0, NULL, &err));
    TEST_ASSERT_EQUAL_INT(SHEF_ERR_INVALID, sim_rig_render(rig, &config, &ignored, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "not empty"));
    sim_rig_destroy(rig);
    TEST_ASSERT_EQUAL_INT(n_entries, shef_test_temp_count());
    TEST_ASSERT_EQUAL_UINT64(report.events.n_events, read_events(folder).n_events);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_events_go_on_for_40_ms_after_the_frames_and_none_is_lost);
    RUN_TEST(test_triggers_are_the_edges_of_the_exposures);
    RUN_TEST(test_frames_carry_their_cameras_time_and_arrive_after_their_exposure);
    RUN_TEST(test_poses_come_every_8_ms_and_are_true);
    RUN_TEST(test_the_host_sees_the_same_edges_a_little_later);
    RUN_TEST(test_maps_of_truth_are_there_for_every_frame);
    RUN_TEST(test_threads_and_instructions_do_not_change_a_byte_of_the_folder);
    RUN_TEST(test_a_timing_error_moves_events_but_not_triggers);
    RUN_TEST(test_a_stopped_rendering_leaves_nothing);
    RUN_TEST(test_a_full_disk_leaves_nothing_and_says_so);
    RUN_TEST(test_a_folder_that_holds_something_is_not_touched);
    shef_recorded_truth_close(&truth);
    return UNITY_END();
}
