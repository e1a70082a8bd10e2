#include "real_pairs.h"

#include <stdio.h>

#include "core/memory.h"
#include "core/pfm.h"
#include "core/png_io.h"
#include "support/support.h"

int32_t shef_test_pair_number(int32_t i)
{
    static const int32_t firsts[] = { 1, 50, 99 };

    return firsts[i / 16] + i % 16;
}

static struct shef_edge_map read_edges(const char *folder, int32_t number)
{
    struct shef_error err = { 0 };
    struct shef_image_u8 image;
    struct shef_edge_map map;
    char path[1024];

    snprintf(path, sizeof path, "%s/%s/%d.png", shef_test_data("shef"), folder, number);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_png_read_u8(path, &image, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_edge_map_create(&map, SHEF_EDGE_UNSIGNED, image.width_px, image.height_px, &err),
        err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_edge_map_set_binary(&map, image, &err), err.text);
    shef_image_destroy_u8(&image);
    return map;
}

struct shef_test_pair shef_test_read_pair(int32_t number)
{
    struct shef_test_pair pair = {
        .left = read_edges("frame_edge", number),
        .right = read_edges("event_edge", number),
    };
    struct shef_error err = { 0 };
    char path[1024];

    snprintf(path, sizeof path, "%s/gt/%d.pfm", shef_test_data("shef"), number);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_pfm_read(path, &pair.truth, &err), err.text);
    return pair;
}

void shef_test_free_pair(struct shef_test_pair *pair)
{
    shef_edge_map_destroy(&pair->left);
    shef_edge_map_destroy(&pair->right);
    shef_image_destroy_f32(&pair->truth);
}
