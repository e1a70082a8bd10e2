/* Memory is allocated by create() alone: neither feeding events nor making maps takes any. */

#include "core/cpu.h"
#include "filter_model.h"
#include "pipeline/event_edges.h"
#include "pipeline/snapshot.h"
#include "support/alloc_watch.h"

#define WIDTH_PX  64
#define HEIGHT_PX 32

static struct shef_rectification small_wide(void)
{
    struct shef_rectification r = shef_rectification_wide();

    r.width_px = r.sensor_width_px = WIDTH_PX;
    r.height_px = r.sensor_height_px = HEIGHT_PX;
    r.cx_px = r.camera.cx_px = WIDTH_PX / 2.0;
    r.cy_px = r.camera.cy_px = HEIGHT_PX / 2.0;
    return r;
}

static void test_nothing_is_allocated_after_create(void)
{
    static const enum shef_edge_kind kinds[] = { SHEF_EDGE_UNSIGNED, SHEF_EDGE_TERNARY,
                                                 SHEF_EDGE_GRADED };
    const struct shef_filter_params filter_params = shef_filter_default_params(WIDTH_PX, HEIGHT_PX);
    const struct shef_hot_pixels_params hot_params =
        shef_hot_pixels_default_params(WIDTH_PX, HEIGHT_PX);
    const struct shef_snapshot_params params = shef_snapshot_default_params();
    const struct shef_rectification r = small_wide();
    struct shef_test_random random = shef_test_random_start();
    static struct shef_event events[1000];
    struct shef_event_batch batch = { .events = events, .n_events = 1000 };
    struct shef_filter *filter;
    struct shef_hot_pixels *hot;
    struct shef_snapshots *snapshots;
    struct shef_warp_map map;
    struct shef_warp_shift shift;
    struct shef_event_edges *edges[3];
    struct shef_edge_map maps[3];
    uint64_t n_made = 0;

    SHEF_TEST_NEEDS_ALLOC_WATCH();
    shef_alloc_watch_start();
    filter = shef_test_filter(&filter_params);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_hot_pixels_create(&hot, &hot_params, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_snapshots_create(&snapshots, filter, hot, &params, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_warp_map_create(&map, &r, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_warp_shift_create(&shift, &map, NULL));
    for (int i = 0; i < 3; i++) {
        const struct shef_event_edges_params edge_params =
            shef_event_edges_default_params(kinds[i]);

        TEST_ASSERT_EQUAL(SHEF_OK, shef_event_edges_create(&edges[i], &map, &edge_params,
                                                           shef_cpu_features(), NULL));
        TEST_ASSERT_EQUAL(SHEF_OK,
                          shef_edge_map_create(&maps[i], kinds[i], WIDTH_PX, HEIGHT_PX, NULL));
    }
    TEST_ASSERT_GREATER_THAN_UINT64(10, shef_alloc_watch_calls(NULL, false));
    shef_alloc_watch_start();

    /* A second in batches of 10 ms, with a frame in every second one. */
    for (int i = 0; i < 100; i++) {
        const struct shef_snapshot *snapshot;

        for (uint32_t k = 0; k < 1000; k++)
            events[k] = shef_event_make(k * 10, (uint32_t)shef_test_random_range(&random, 0, 63),
                                        (uint32_t)shef_test_random_range(&random, 0, 31), k % 2);
        batch.base_us = i * 10000;
        batch.reached_us = batch.base_us + 9999;
        batch.n_triggers = i % 2 ? 0 : 2;
        batch.triggers[0] = (struct shef_trigger){ batch.base_us + 1000, 101, 0, true };
        batch.triggers[1] = (struct shef_trigger){ batch.base_us + 5000, 501, 0, false };
        shef_snapshots_feed(snapshots, &batch);
        if (shef_snapshot_pool_take(shef_snapshots_pool(snapshots), n_made, &snapshot) != SHEF_OK)
            continue;
        n_made++;
        shef_warp_shift_set(&shift, (double[3]){ .1, .2, .05 }, SHEF_EVENT_EDGES_LAG_PX);
        for (int k = 0; k < 3; k++)
            shef_event_edges_of_values(edges[k], snapshot->values, &shift, &maps[k]);
        shef_event_edges_of_pair(edges[2], snapshot->sums, snapshot->sums, &shift, &maps[2]);
        shef_snapshot_pool_give(shef_snapshots_pool(snapshots), snapshot);
    }
    shef_alloc_watch_stop();
    TEST_ASSERT_EQUAL_UINT64(0, shef_alloc_watch_calls(NULL, false));
    TEST_ASSERT_GREATER_THAN_UINT64(40, n_made);
    for (int i = 0; i < 3; i++) {
        shef_edge_map_destroy(&maps[i]);
        shef_event_edges_destroy(edges[i]);
    }
    shef_warp_shift_destroy(&shift);
    shef_warp_map_destroy(&map);
    shef_snapshots_destroy(snapshots);
    shef_hot_pixels_destroy(hot);
    shef_filter_destroy(filter);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_allocated_after_create);
    return UNITY_END();
}
