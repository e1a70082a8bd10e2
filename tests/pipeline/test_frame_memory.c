/* Memory is allocated by create() alone: rectifying, making edge maps and searching for the flow
 * take none. */
#include <string.h>

#include "core/cpu.h"
#include "core/memory.h"
#include "frame_cases.h"
#include "pipeline/flow_search.h"
#include "pipeline/frame_edges.h"
#include "pipeline/frame_rectify.h"
#include "support/alloc_watch.h"

#define WIDTH_PX  323
#define HEIGHT_PX 243

/* Makes of the frame's edges what the event camera sees of a wall. */
static void move_to_disparity(struct shef_edge_map *map, int32_t disparity_px)
{
    for (int32_t y = 0; y < map->height_px; y++) {
        int8_t *row = map->graded + y * map->graded_stride_bytes;

        memmove(row, row + disparity_px, (size_t)(map->width_px - disparity_px));
        memset(row + map->width_px - disparity_px, 0, (size_t)disparity_px);
    }
}

static void test_nothing_is_allocated_after_create(void)
{
    static const double velocity[3] = { 0.2, 0.1, 0.1 };
    struct shef_rectification r = shef_test_frame_wide();
    struct shef_frame_edges_params params = shef_frame_edges_default_params();
    struct shef_test_random random = shef_test_random_start();
    struct shef_image_u8 raw = { 0 };
    struct shef_image_u8 out = { 0 };
    struct shef_edge_map bits = { 0 };
    struct shef_edge_map graded = { 0 };
    struct shef_frame_rectify *rectify = NULL;
    struct shef_frame_edges *edges = NULL;
    struct shef_flow_search *search = NULL;
    struct shef_flow flow;

    SHEF_TEST_NEEDS_ALLOC_WATCH();
    shef_alloc_watch_start();
    /* A part of the view is past the sensor: masks and odd segments are used, too. */
    r.width_px = WIDTH_PX;
    r.height_px = HEIGHT_PX;
    r.cx_px = 120;
    r.camera.cx_px = 100;
    params.is_thin = true;

    const struct shef_flow_search_params search_params = shef_flow_search_default_params(&r);

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&raw, 2048, 1536, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&out, WIDTH_PX, HEIGHT_PX, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&bits, SHEF_EDGE_UNSIGNED, WIDTH_PX, HEIGHT_PX, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_edge_map_create(&graded, SHEF_EDGE_GRADED, WIDTH_PX, HEIGHT_PX, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_rectify_create(&rectify, &r, SHEF_FRAME_MONO8,
                                                         shef_cpu_features(), NULL));
    TEST_ASSERT_FALSE(shef_frame_rectify_is_complete(rectify));
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_frame_edges_create(&edges, &r, shef_frame_rectify_valid(rectify),
                                              &params, shef_cpu_features(), NULL));
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_flow_search_create(&search, &r, &search_params, shef_cpu_features(), NULL));
    shef_test_fill_texture(raw, 40, 2, &random);

    TEST_ASSERT_GREATER_THAN_UINT64(10, shef_alloc_watch_calls(NULL, false));
    shef_alloc_watch_start();
    for (int i = 0; i < 3; i++) {
        shef_frame_rectify_run(rectify, raw, out);
        shef_frame_edges_unsigned(edges, out, &bits);
        shef_frame_edges_along(edges, out, velocity, &graded);
        move_to_disparity(&graded, 12);
        shef_flow_search_run(search, out, &graded, &flow);
        shef_frame_edges_temporal(edges, out, out, &graded);
    }
    shef_alloc_watch_stop();
    TEST_ASSERT_EQUAL_UINT64(0, shef_alloc_watch_calls(NULL, false));
    TEST_ASSERT_GREATER_THAN_INT64(100, shef_edge_map_count(&bits));
    TEST_ASSERT_EQUAL_INT(SHEF_FLOW_FOUND, flow.state);

    shef_flow_search_destroy(search);
    shef_frame_edges_destroy(edges);
    shef_frame_rectify_destroy(rectify);
    shef_edge_map_destroy(&bits);
    shef_edge_map_destroy(&graded);
    shef_image_destroy_u8(&raw);
    shef_image_destroy_u8(&out);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_nothing_is_allocated_after_create);
    return UNITY_END();
}
