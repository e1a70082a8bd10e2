/* Sync edges come back as the host saw them, or are known to be missing. */
#include "record/recorded_triggers.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "record/trigger_recorder.h"
#include "support/support.h"

#define N_EDGES 9000

static struct shef_recording_writer recording;
static struct shef_trigger_recorder *recorder;
static struct shef_recorded_triggers *triggers;
static struct shef_manifest manifest;
static struct shef_error err;
static char folder[4200];

void tearDown(void)
{
    shef_recorded_triggers_close(triggers);
    triggers = NULL;
    shef_manifest_free(&manifest);
}

/* The kernel's count wraps on the way. */
static struct shef_edge edge_of(uint32_t i)
{
    return (struct shef_edge){
        .time = { INT64_C(1) << 40 | (int64_t)i * 9259259 },
        .number = UINT32_MAX - 4000 + i,
        .line = i % 4 == 3 ? 17 : 4,
        .is_high = i % 2 == 0,
    };
}

static void start(void)
{
    static const struct shef_edge_line lines[] = { { 4, "frame exposure" }, { 17, "robot" } };
    static int n_made;
    const struct shef_trigger_recorder_config config = {
        .chip = "gpiochip0",
        .lines = lines,
        .n_lines = 2,
        .limits = shef_segment_limits_default(),
    };
    char name[32];

    snprintf(name, sizeof name, "triggers%d", n_made++);
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_recording_writer_create(
                          &recording, folder,
                          &(struct shef_recording_writer_config){ .software = "test" }, &err));
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_trigger_recorder_start(&recording, &config, &recorder, &err), err.text);
}

static void write_edges(uint32_t first, uint32_t n, uint32_t n_lost)
{
    static struct shef_edge edges[N_EDGES];

    for (uint32_t i = 0; i < n; i++)
        edges[i] = edge_of(first + i);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_trigger_recorder_write(recorder, edges, n, (shef_host_time){ 5 }, n_lost, &err),
        err.text);
}

static void stop(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_trigger_recorder_stop(recorder, &err), err.text);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, true, NULL, NULL, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
}

static void open_triggers(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_recorded_triggers_open(folder, &triggers, &err),
                              err.text);
}

static void expect_next(uint32_t i, bool follows)
{
    const struct shef_edge expected = edge_of(i);
    struct shef_edge edge = { .number = 0 };
    bool edge_follows = !follows;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_triggers_next(triggers, &edge, &edge_follows, &err));
    TEST_ASSERT_EQUAL_INT64(expected.time.ns, edge.time.ns);
    TEST_ASSERT_EQUAL_UINT32(expected.number, edge.number);
    TEST_ASSERT_EQUAL_UINT8(expected.line, edge.line);
    TEST_ASSERT_EQUAL(expected.is_high, edge.is_high);
    TEST_ASSERT_EQUAL(follows, edge_follows);
}

static void test_edges_come_back_in_runs_of_any_length(void)
{
    struct shef_edge edge;
    struct shef_edge_line line;

    start();
    write_edges(0, 1, 0);
    write_edges(1, 0, 0);
    write_edges(1, 10, 0);
    write_edges(11, N_EDGES - 11, 0);
    stop();
    TEST_ASSERT_EQUAL(SHEF_VERDICT_CLEAN, manifest.verdict);
    TEST_ASSERT_EQUAL_UINT64(N_EDGES, manifest.parts[SHEF_PART_TRIGGERS].n_items);
    TEST_ASSERT_EQUAL_UINT64(5, manifest.parts[SHEF_PART_TRIGGERS].n_blocks);
    open_triggers();
    for (uint32_t i = 0; i < N_EDGES; i++)
        expect_next(i, i > 0);
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_triggers_next(triggers, &edge, NULL, &err));
    TEST_ASSERT_NULL(shef_recorded_triggers_note(triggers, 0));
    TEST_ASSERT_TRUE(shef_recorded_triggers_line(triggers, 1, &line));
    TEST_ASSERT_EQUAL_UINT8(17, line.number);
    TEST_ASSERT_EQUAL_STRING("robot", line.name);
    TEST_ASSERT_FALSE(shef_recorded_triggers_line(triggers, 2, &line));
}

static void test_lost_edges_are_counted_and_judged(void)
{
    start();
    write_edges(0, 5, 0);
    write_edges(7, 5, 0);  /* two are missing by the kernel's count */
    write_edges(12, 1, 3); /* the caller knows of three */
    write_edges(2, 1, 0);  /* the kernel has begun anew */
    stop();
    TEST_ASSERT_EQUAL(SHEF_VERDICT_GAPS, manifest.verdict);
    TEST_ASSERT_NOT_NULL(strstr(manifest.reason, "5 sync edges were lost"));
    open_triggers();
    for (uint32_t i = 0; i < 5; i++)
        expect_next(i, i > 0);
    for (uint32_t i = 7; i < 12; i++)
        expect_next(i, i > 7);
    expect_next(12, false);
    expect_next(2, false);
}

static void test_damage_costs_one_run(void)
{
    char path[4300];
    uint8_t *bytes;
    size_t n_bytes;
    struct shef_edge edge;

    start();
    for (uint32_t i = 0; i < 10; i++)
        write_edges(i * 3, 3, 0);
    stop();
    snprintf(path, sizeof path, "%s/triggers/000000.edge", folder);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 20, &bytes, &n_bytes, &err));
    bytes[n_bytes - 2 * 48 - 1] ^= 1; /* the eighth run */
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bytes, n_bytes - 1, &err));
    free(bytes);
    open_triggers();
    for (uint32_t i = 0; i < 27; i++)
        if (i / 3 != 7)
            expect_next(i, i != 0 && i != 24);
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_triggers_next(triggers, &edge, NULL, &err));
    TEST_ASSERT_EQUAL_UINT64(1, shef_recorded_triggers_damage(triggers)->n_bad_blocks);
    TEST_ASSERT_EQUAL_UINT64(1, shef_recorded_triggers_damage(triggers)->n_cut_blocks);
}

static void test_a_recording_without_triggers_says_so(void)
{
    start();
    stop();
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_triggers_open(folder, &triggers, &err));
    snprintf(folder + strlen(folder), 12, "/triggers");
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_recorded_triggers_open(folder, &triggers, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "no trigger part"), err.text);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_edges_come_back_in_runs_of_any_length);
    RUN_TEST(test_lost_edges_are_counted_and_judged);
    RUN_TEST(test_damage_costs_one_run);
    RUN_TEST(test_a_recording_without_triggers_says_so);
    return UNITY_END();
}
