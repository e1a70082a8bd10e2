/* Recording while it plays: what comes back, over the ends of loops too, and how it is ended. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/cpu.h"
#include "core/crc32c.h"
#include "played.h"
#include "record/edge_track.h"
#include "record/manifest.h"
#include "record/pose_track.h"
#include "record/recorded_events.h"
#include "record/recorded_frames.h"
#include "record/verify.h"
#include "support/process.h"
#include "support/support.h"

static struct shef_error err;

/* ---- what a recording holds -------------------------------------------------------------- */

struct contents {
    /* Events and triggers, times included, in their order. */
    uint64_t n_events;
    uint64_t n_triggers;
    uint32_t events_crc;
    uint32_t triggers_crc;
    int64_t first_us;
    int64_t last_us;
    uint64_t n_steps_back; /* times before the one before, by more than a read-out does */
    /* Frames. */
    uint32_t n_frames;
    uint32_t frames_crc; /* pixels, numbers, camera times */
    bool frames_go_on;
    int64_t first_frame_arrived_ns;
    struct shef_pose_track poses;
    struct shef_edge_track edges;
    struct shef_manifest manifest;
};

/*   n_skip  so many events are left out at the front, and all triggers */
static void read_events(const char *path, uint64_t n_skip, struct contents *contents)
{
    static struct shef_event events[SHEF_BATCH_EVENTS];
    struct shef_event_batch batch = { .events = events, .capacity = SHEF_BATCH_EVENTS };
    struct shef_recorded_events *reader;
    int64_t reached_us = INT64_MIN / 2;

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_recorded_events_open(path, shef_cpu_features(), &reader, &err), err.text);
    while (shef_recorded_events_next(reader, &batch, &err) == SHEF_OK) {
        for (uint32_t i = 0; i < batch.n_events; i++) {
            const int64_t t_us = shef_event_batch_time_us(&batch, i);
            const uint16_t at[2] = { events[i].x_px, events[i].y_on };

            if (contents->n_events + i < n_skip)
                continue;
            if (contents->n_events + i == n_skip)
                contents->first_us = t_us;
            contents->n_steps_back += t_us < reached_us - 5000;
            reached_us = t_us > reached_us ? t_us : reached_us;
            contents->events_crc = shef_crc32c(contents->events_crc, &t_us, sizeof t_us);
            contents->events_crc = shef_crc32c(contents->events_crc, at, sizeof at);
        }
        for (uint32_t i = 0; i < batch.n_triggers && n_skip == 0; i++) {
            const int64_t what[3] = { batch.triggers[i].t_us, batch.triggers[i].channel,
                                      batch.triggers[i].rising };

            contents->triggers_crc = shef_crc32c(contents->triggers_crc, what, sizeof what);
        }
        contents->n_events += batch.n_events;
        contents->n_triggers += batch.n_triggers;
    }
    contents->last_us = reached_us;
    shef_recorded_events_close(reader);
}

static void read_frames(const char *path, struct contents *contents)
{
    struct shef_recorded_frames *reader;
    struct shef_recorded_frame frame;
    struct shef_frame_info last = { .number = 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_recorded_frames_open(path, &reader, &err), err.text);
    contents->frames_go_on = true;
    while (shef_recorded_frames_next(reader, &frame, &err) == SHEF_OK) {
        const struct shef_frame_info *info = &frame.info;
        const int64_t what[4] = { (int64_t)info->number, info->time.ns, info->exposure_us,
                                  info->pixel_format };

        if (contents->n_frames++ == 0)
            contents->first_frame_arrived_ns = info->arrived.ns;
        else
            contents->frames_go_on = contents->frames_go_on && info->number == last.number + 1 &&
                                     info->time.ns > last.time.ns &&
                                     info->arrived.ns > last.arrived.ns;
        last = *info;
        contents->frames_crc = shef_crc32c(contents->frames_crc, what, sizeof what);
        contents->frames_crc =
            shef_crc32c(contents->frames_crc, frame.pixels, shef_frame_bytes(info));
    }
    shef_recorded_frames_close(reader);
}

static struct contents read_contents(const char *path)
{
    struct contents contents = { .n_events = 0 };

    read_events(path, 0, &contents);
    read_frames(path, &contents);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_pose_track_read(path, 0, &contents.poses, &err),
                              err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_edge_track_read(path, &contents.edges, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_manifest_read(path, &contents.manifest, &err),
                              err.text);
    return contents;
}

static void free_contents(struct contents *contents)
{
    shef_pose_track_free(&contents->poses);
    shef_edge_track_free(&contents->edges);
    shef_manifest_free(&contents->manifest);
}

/* Host times may all be later by the same. */
static void expect_same(const struct contents *a, const struct contents *b)
{
    const int64_t shift_ns = b->first_frame_arrived_ns - a->first_frame_arrived_ns;

    TEST_ASSERT_GREATER_THAN_UINT64(100000, a->n_events);
    TEST_ASSERT_EQUAL_UINT64(a->n_events, b->n_events);
    TEST_ASSERT_EQUAL_UINT64(a->n_triggers, b->n_triggers);
    TEST_ASSERT_EQUAL_INT64(a->first_us, b->first_us);
    TEST_ASSERT_EQUAL_HEX32(a->events_crc, b->events_crc);
    TEST_ASSERT_EQUAL_HEX32(a->triggers_crc, b->triggers_crc);
    TEST_ASSERT_EQUAL_UINT32(PLAYED_FRAMES, a->n_frames);
    TEST_ASSERT_EQUAL_UINT32(a->n_frames, b->n_frames);
    TEST_ASSERT_EQUAL_HEX32(a->frames_crc, b->frames_crc);
    TEST_ASSERT_GREATER_THAN_size_t(10, a->poses.n);
    TEST_ASSERT_EQUAL_size_t(a->poses.n, b->poses.n);
    TEST_ASSERT_EQUAL_MEMORY(a->poses.packages, b->poses.packages,
                             a->poses.n * a->poses.recipe.package_bytes);
    for (size_t i = 0; i < a->poses.n; i++)
        TEST_ASSERT_EQUAL_INT64(a->poses.poses[i].arrived.ns + shift_ns,
                                b->poses.poses[i].arrived.ns);
    TEST_ASSERT_GREATER_THAN_size_t(PLAYED_FRAMES, a->edges.n);
    TEST_ASSERT_EQUAL_size_t(a->edges.n, b->edges.n);
    TEST_ASSERT_EQUAL_UINT32(a->edges.n_lines, b->edges.n_lines);
    TEST_ASSERT_EQUAL_STRING(a->edges.lines[0].name, b->edges.lines[0].name);
    TEST_ASSERT_EQUAL_STRING(a->edges.chip, b->edges.chip);
    for (size_t i = 0; i < a->edges.n; i++) {
        struct shef_edge edge = a->edges.edges[i];

        edge.time.ns += shift_ns;
        TEST_ASSERT_EQUAL_INT64(edge.time.ns, b->edges.edges[i].time.ns);
        TEST_ASSERT_EQUAL_UINT32(edge.number, b->edges.edges[i].number);
        TEST_ASSERT_EQUAL_UINT8(edge.line, b->edges.edges[i].line);
        TEST_ASSERT_EQUAL(edge.is_high, b->edges.edges[i].is_high);
    }
    TEST_ASSERT_EQUAL_STRING(a->manifest.events.camera.sensor, b->manifest.events.camera.sensor);
    TEST_ASSERT_EQUAL_STRING(a->manifest.parts[SHEF_PART_FRAMES].source,
                             b->manifest.parts[SHEF_PART_FRAMES].source);
}

static void remove_folder(const char *path)
{
    char command[1024];

    snprintf(command, sizeof command, "rm -r '%s'", path);
    TEST_ASSERT_EQUAL_INT(0, system(command));
}

static void expect_no_problem(const char *path)
{
    struct shef_verify_report report;

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_recording_verify(path, NULL, NULL, &report, &err),
                              err.text);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, report.n_problems, report.problems[0]);
    TEST_ASSERT_GREATER_THAN_UINT64(PLAYED_FRAMES, report.n_blocks);
}

/* Not one depth may differ. */
static void expect_same_depth(const char *a, const char *b)
{
    static struct shef_test_process sheftool;
    const char *const paths[] = { a, b };
    char command[4096];

    for (int i = 0; i < 2; i++) {
        shef_test_process_run(&sheftool, "sheftool", NULL, "run %s --out %s%d --mode graded",
                              paths[i], shef_test_temp_path("depth"), i);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, sheftool.status, sheftool.err);
    }
    snprintf(command, sizeof command,
             "cd '%s' && test $(ls depth0/disparity | wc -l) -ge %d && "
             "diff -r depth0/disparity depth1/disparity && rm -r depth0 depth1",
             shef_test_temp_folder(), PLAYED_FRAMES - 3);
    TEST_ASSERT_EQUAL_INT(0, system(command));
}

/* ---- recording --------------------------------------------------------------------------- */

/* A service that records from its source's first item on. */
static struct shef_service *start_recording(const struct shef_config *config, const char *path)
{
    struct shef_service *service;

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_service_create(config, &service, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_recorder_begin(shef_playback_recorder(service->playback), path, config, &err),
        err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_service_start(service, &err), err.text);
    return service;
}

static void end(struct shef_service *service)
{
    shef_service_stop(service);
    shef_service_destroy(service);
}

static const char *text_of(const json_t *answer, const char *key)
{
    return json_string_value(json_object_get(answer, key));
}

/* Plays to the end and records it; returns the recording's folder. */
static const char *record_whole(const struct shef_config *config, const char *name)
{
    static char path[512];
    struct shef_service *service;
    json_t *answer;

    snprintf(path, sizeof path, "%s", shef_test_temp_path(name));
    service = start_recording(config, path);
    played_wait(service);
    answer = played_ask(service, "record stop", NULL);
    TEST_ASSERT_EQUAL_STRING(path, text_of(answer, "path"));
    if (config->source.pace == SHEF_PACE_RECORDED &&
        strcmp(text_of(answer, "verdict"), "gaps") == 0) {
        end(service);
        TEST_IGNORE_MESSAGE(text_of(answer, "reason"));
    }
    TEST_ASSERT_EQUAL_STRING_MESSAGE("clean", text_of(answer, "verdict"),
                                     text_of(answer, "reason"));
    TEST_ASSERT_EQUAL_INT64(0, played_number(answer, "n_lost"));
    json_decref(answer);
    end(service);
    return path;
}

static void test_what_is_recorded_is_what_was_played(void)
{
    static const int paces[] = { SHEF_PACE_STEPPED, SHEF_PACE_RECORDED };
    struct contents source = read_contents(played_recording());

    for (int i = 0; i < 2; i++) {
        struct shef_config config = played_config();
        const char *path;
        struct contents copy;

        config.source.pace = paces[i];
        path = record_whole(&config, i == 0 ? "stepped" : "in_real_time");
        copy = read_contents(path);
        expect_no_problem(path);
        expect_same(&source, &copy);
        expect_same_depth(played_recording(), path);
        free_contents(&copy);
        remove_folder(path);
    }
    free_contents(&source);
}

static int64_t frames_in(struct shef_service *service)
{
    json_t *status = played_ask(service, "status", NULL);
    const int64_t n = played_number(status, "frames.n_in");

    json_decref(status);
    return n;
}

static void test_a_recording_begun_in_the_middle_has_all_that_came_then(void)
{
    struct shef_config config = played_config();
    struct contents copy = { .n_events = 0 };
    struct contents whole = { .n_events = 0 };
    struct contents rest = { .n_events = 0 };
    struct shef_service *service = played_start(&config);
    char path[512];
    json_t *answer;

    /* It shall not be over before the command comes. */
    atomic_store(&service->live.drag_us, 30000);
    while (frames_in(service) < 6)
        usleep(1000);
    answer = played_ask(service, "record start", NULL);
    snprintf(path, sizeof path, "%s", text_of(answer, "path"));
    json_decref(answer);
    atomic_store(&service->live.drag_us, 0);
    played_wait(service);
    answer = played_ask(service, "record stop", NULL);
    TEST_ASSERT_EQUAL_STRING_MESSAGE("clean", text_of(answer, "verdict"),
                                     text_of(answer, "reason"));
    json_decref(answer);
    end(service);

    read_events(path, 0, &copy);
    read_events(played_recording(), 0, &whole);
    TEST_ASSERT_GREATER_THAN_UINT64(100000, copy.n_events);
    TEST_ASSERT_GREATER_THAN_UINT64(copy.n_events + 1000, whole.n_events);
    read_events(played_recording(), whole.n_events - copy.n_events, &rest);
    TEST_ASSERT_EQUAL_INT64(rest.first_us, copy.first_us);
    TEST_ASSERT_EQUAL_HEX32(rest.events_crc, copy.events_crc);
    remove_folder(path);
}

static void expect_time_goes_on(const struct contents *contents)
{
    TEST_ASSERT_EQUAL_UINT64(0, contents->n_steps_back);
    TEST_ASSERT_TRUE(contents->frames_go_on);
    for (size_t i = 1; i < contents->poses.n; i++)
        TEST_ASSERT_GREATER_THAN_INT64(contents->poses.poses[i - 1].at.ns,
                                       contents->poses.poses[i].at.ns);
    for (size_t i = 1; i < contents->edges.n; i++) {
        TEST_ASSERT_GREATER_THAN_INT64(contents->edges.edges[i - 1].time.ns,
                                       contents->edges.edges[i].time.ns);
        TEST_ASSERT_EQUAL_UINT32(contents->edges.edges[i - 1].number + 1,
                                 contents->edges.edges[i].number);
    }
}

static void test_a_recording_over_the_end_of_a_loop_goes_on_in_time(void)
{
    struct contents source = read_contents(played_recording());
    struct shef_config config = played_config();
    struct shef_service *service;
    struct contents copy;
    char path[512];
    json_t *answer;

    config.source.loop = true;
    snprintf(path, sizeof path, "%s", shef_test_temp_path("looped"));
    service = start_recording(&config, path);
    while (frames_in(service) < 2 * PLAYED_FRAMES + 8)
        usleep(1000);
    answer = played_ask(service, "record stop", NULL);
    TEST_ASSERT_EQUAL_STRING_MESSAGE("clean", text_of(answer, "verdict"),
                                     text_of(answer, "reason"));
    json_decref(answer);
    end(service);

    copy = read_contents(path);
    expect_no_problem(path);
    expect_time_goes_on(&copy);
    TEST_ASSERT_GREATER_THAN_UINT64(2 * source.n_events, copy.n_events);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(2 * PLAYED_FRAMES + 7, copy.n_frames);
    TEST_ASSERT_GREATER_THAN_size_t(2 * source.poses.n, copy.poses.n);
    TEST_ASSERT_GREATER_THAN_size_t(2 * source.edges.n, copy.edges.n);
    TEST_ASSERT_GREATER_THAN_INT64(2 * (source.last_us - source.first_us),
                                   copy.last_us - copy.first_us);

    snprintf(config.source.recording, sizeof config.source.recording, "%s", path);
    config.source.loop = false;
    service = played_start(&config);
    played_wait(service);
    played_expect_accounted(service, 0);
    answer = played_ask(service, "status", NULL);
    TEST_ASSERT_EQUAL_INT64((int64_t)copy.n_frames, played_number(answer, "frames.n_in"));
    TEST_ASSERT_EQUAL_INT64((int64_t)copy.n_events, played_number(answer, "events.n_events"));
    TEST_ASSERT_EQUAL_INT64(0, played_number(answer, "events.n_violations"));
    /* The events of the last frames are not all there when a recording ends. */
    TEST_ASSERT_GREATER_OR_EQUAL_INT64((int64_t)copy.n_frames - 4,
                                       played_number(answer, "frames.n_published"));
    json_decref(answer);
    end(service);
    free_contents(&source);
    free_contents(&copy);
    remove_folder(path);
}

/* ---- how it ends ------------------------------------------------------------------------- */

static void test_whatever_ends_the_source_ends_the_recording_in_order(void)
{
    static const char *const ends[] = { "stop", "play", "shut down" };
    struct shef_config config = played_config();

    config.source.loop = true;
    for (int i = 0; i < 3; i++) {
        struct shef_service *service;
        struct shef_recorder_report report;
        struct shef_manifest manifest;
        char path[512];
        char words[700];

        snprintf(path, sizeof path, "%s", shef_test_temp_path("ended"));
        snprintf(words, sizeof words, "{\"recording\": \"%s\"}", played_recording());
        service = start_recording(&config, path);
        while (frames_in(service) < 5)
            usleep(1000);
        if (i < 2)
            json_decref(played_ask(service, ends[i], i == 0 ? NULL : words));
        else
            shef_service_stop(service);
        shef_service_recording(service, &report);
        TEST_ASSERT_FALSE(report.is_on);
        TEST_ASSERT_EQUAL_STRING(path, report.path);
        if (i < 2) {
            json_t *answer = played_ask(service, "record stop", NULL);

            TEST_ASSERT_EQUAL_STRING(path, text_of(answer, "path"));
            TEST_ASSERT_EQUAL_STRING_MESSAGE("clean", text_of(answer, "verdict"),
                                             text_of(answer, "reason"));
            json_decref(answer);
            TEST_ASSERT_EQUAL_STRING("record stop: nothing is being recorded",
                                     played_refusal(service, "record stop", NULL));
        }
        end(service);
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_manifest_read(path, &manifest, &err), err.text);
        TEST_ASSERT_TRUE(manifest.is_closed);
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_VERDICT_CLEAN, manifest.verdict, manifest.reason);
        TEST_ASSERT_EQUAL_UINT64(report.n_bytes, manifest.events.stats.n_bytes +
                                                     manifest.parts[SHEF_PART_FRAMES].n_bytes +
                                                     manifest.parts[SHEF_PART_POSES].n_bytes +
                                                     manifest.parts[SHEF_PART_TRIGGERS].n_bytes);
        shef_manifest_free(&manifest);
        remove_folder(path);
    }
}

/* Its threads do not run, as if the disk stood still. */
static void test_a_disk_that_stands_still_costs_the_live_stream_no_buffer(void)
{
    struct shef_config config = played_config();
    struct shef_pace pace;
    struct shef_source *source;
    struct shef_graph *graph;
    struct shef_recorder *recorder;
    struct shef_recorder_report report;
    struct shef_event_item item = { .follows = false };
    struct shef_manifest manifest;
    const char *path = shef_test_temp_path("still");
    uint64_t n = 0;
    enum shef_err code;

    shef_pace_init(&pace, SHEF_PACE_RECORDED, shef_clock_monotonic());
    TEST_ASSERT_EQUAL(SHEF_OK, shef_source_open(played_recording(), "", &source, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_wiring_create(&config, &graph, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recorder_create(&recorder, graph, source, &pace, 0, &err));
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_recorder_begin(recorder, path, &config, &err),
                              err.text);
    while ((code = shef_replay_take(source->events, &item.raw, &err)) == SHEF_OK) {
        memcpy(item.state, shef_replay_state(source->events, &item.follows), sizeof item.state);
        shef_recorder_offer_events(recorder, &item);
        TEST_ASSERT_GREATER_OR_EQUAL_UINT32(31, shef_pool_free_count(item.raw.buffer->pool));
        shef_buffer_give(item.raw.buffer);
        n++;
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, code);
    shef_recorder_report(recorder, &report);
    TEST_ASSERT_GREATER_THAN_UINT64(10, report.n_lost);
    shef_recorder_stop(recorder);
    shef_recorder_finish(recorder);
    shef_recorder_report(recorder, &report);
    TEST_ASSERT_EQUAL(SHEF_VERDICT_GAPS, report.verdict);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(report.reason, "the disk was too slow for"), report.reason);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_manifest_read(path, &manifest, &err), err.text);
    TEST_ASSERT_EQUAL_UINT64(n, manifest.events.n_blocks + manifest.events.n_lost_buffers);
    TEST_ASSERT_EQUAL_UINT64(report.n_lost, manifest.events.n_lost_buffers);
    TEST_ASSERT_EQUAL_STRING(report.reason, manifest.reason);
    shef_manifest_free(&manifest);
    shef_recorder_destroy(recorder);
    shef_graph_destroy(graph);
    shef_source_close(source);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_is_recorded_is_what_was_played);
    RUN_TEST(test_a_recording_begun_in_the_middle_has_all_that_came_then);
    RUN_TEST(test_a_recording_over_the_end_of_a_loop_goes_on_in_time);
    RUN_TEST(test_whatever_ends_the_source_ends_the_recording_in_order);
    RUN_TEST(test_a_disk_that_stands_still_costs_the_live_stream_no_buffer);
    return UNITY_END();
}
