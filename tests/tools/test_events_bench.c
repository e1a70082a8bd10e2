/* `sheftool events bench` prints what it measured in the form of the other benches. */
#include <jansson.h>
#include <string.h>

#include "sheftool/events_bench.h"
#include "support/support.h"
#include "tools/event_files.h"
#include "tools/program.h"

static void expect_results(const char *json, size_t n_events)
{
    static const char *const names[] = { "decode-evt2", "decode-evt21",  "decode-evt3",
                                         "filter",      "filter-random", "evt3-to-filter" };
    bool found[6] = { false };
    json_t *root = json_loads(json, 0, NULL);
    size_t i;
    json_t *one;

    TEST_ASSERT_NOT_NULL_MESSAGE(root, json);
    TEST_ASSERT_NOT_NULL(json_object_get(json_object_get(root, "machine"), "cpu"));
    TEST_ASSERT_EQUAL_INT64(n_events, json_integer_value(json_object_get(root, "n_events")));
    json_array_foreach(json_object_get(root, "results"), i, one)
    {
        const double min_ms = json_number_value(json_object_get(one, "min_ms"));
        const double mev_per_s = json_number_value(json_object_get(one, "mev_per_s"));

        for (int k = 0; k < 6; k++)
            found[k] |= strcmp(names[k], json_string_value(json_object_get(one, "name"))) == 0;
        TEST_ASSERT_TRUE(min_ms > 0);
        TEST_ASSERT_TRUE(json_number_value(json_object_get(one, "median_ms")) >= min_ms);
        TEST_ASSERT_TRUE(json_number_value(json_object_get(one, "p95_ms")) >= min_ms);
        TEST_ASSERT_TRUE(json_is_number(json_object_get(one, "cpu_median_ms")));
        TEST_ASSERT_TRUE(json_is_string(json_object_get(one, "isa")));
        TEST_ASSERT_EQUAL_INT64(n_events, json_integer_value(json_object_get(one, "n_events")));
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * mev_per_s, (double)n_events / min_ms / 1e3, mev_per_s);
    }
    for (int k = 0; k < 6; k++)
        TEST_ASSERT_TRUE_MESSAGE(found[k], names[k]);
    json_decref(root);
}

static void test_a_synthetic_scene_and_a_file_are_measured(void)
{
    const struct event_scene plain = { .duration_ms = 200,
                                       .trigger_period_us = 1000,
                                       .exposure_us = 200 };
    struct scene_events scene = scene_events_make(&plain);
    const char *path = scene_write_raw("bench.raw", &scene);
    const struct program_result *result =
        program_run("events bench --events 20000 --rounds 2 --json");

    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    expect_results(result->out, 20000);
    result = program_run("events bench %s --rounds 2 --json", path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    expect_results(result->out, scene.n_events);
    result = program_run("events bench %s --rounds 1", path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, result->status, result->err);
    TEST_ASSERT_NOT_NULL(strstr(result->out, "Mev/s"));
    scene_events_free(&scene);
}

static void test_what_is_no_raw_file_is_refused(void)
{
    const char *path = write_bytes("no.raw", "hello", 5);
    const int n_entries = shef_test_temp_count();

    program_run("events bench %s", path);
    program_expect_failure(1, "no.raw", "RAW", n_entries);
    program_run("events bench /nowhere.raw");
    program_expect_failure(1, "/nowhere.raw", "No such file", n_entries);
}

static void test_the_streams_of_all_formats_hold_the_same_events(void)
{
    static struct shef_event decoded[30000 + SHEF_EVT_MIN_ROOM];
    struct shef_events_material material;
    struct shef_error err;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_events_material_make(&material, 30000, &err));
    for (int i = 0; i < 3; i++) {
        struct shef_event_batch batch = { .events = decoded,
                                          .capacity = 30000 + SHEF_EVT_MIN_ROOM };
        struct shef_evt_decoder decoder;

        shef_evt_init(&decoder, material.streams[i].format, material.width_px, material.height_px,
                      0, 0);
        TEST_ASSERT_EQUAL_size_t(material.streams[i].n_bytes,
                                 shef_evt_decode(&decoder, material.streams[i].bytes,
                                                 material.streams[i].n_bytes, &batch));
        TEST_ASSERT_EQUAL_UINT32(30000, batch.n_events);
        for (uint32_t k = 0; k < batch.n_events; k++) {
            TEST_ASSERT_EQUAL_INT64(material.events[k].t_us + material.base_us,
                                    shef_event_batch_time_us(&batch, k));
            TEST_ASSERT_EQUAL_UINT16(material.events[k].x_px, decoded[k].x_px);
            TEST_ASSERT_EQUAL_UINT16(material.events[k].y_on, decoded[k].y_on);
        }
    }
    shef_events_material_free(&material);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_synthetic_scene_and_a_file_are_measured);
    RUN_TEST(test_what_is_no_raw_file_is_refused);
    RUN_TEST(test_the_streams_of_all_formats_hold_the_same_events);
    return UNITY_END();
}
