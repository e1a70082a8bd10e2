/* Any bytes as any message: the decoders must say so and read nothing else. Inputs that are long
 * enough get the right type and checksum first, or hardly any would come past those. */
#include <assert.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <shef_cloud_t.h>
#include <shef_dense_t.h>
#include <shef_depth_t.h>
#include <shef_disparity_t.h>
#include <shef_lcm_decode.h>
#include <shef_pose_t.h>
#include <shef_status_t.h>

#include "core/crc32c.h"

#define CRC_OFFSET   104
#define MAX_CELLS    (1 << 22) /* larger grids are decoded, not drawn */
#define N_KINDS      6
#define HEADER_BYTES 8

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void put_be(uint8_t *to, uint64_t value, int n_bytes)
{
    for (int i = 0; i < n_bytes; i++)
        to[i] = (uint8_t)(value >> 8 * (n_bytes - 1 - i));
}

static void draw(const struct shef_lcm_grid *grid)
{
    const size_t n_cells = (size_t)grid->grid_w * (size_t)grid->grid_h;

    assert(grid->first_row >= 0 && grid->first_row + grid->n_rows <= grid->grid_h);
    if (n_cells > MAX_CELLS)
        return;

    float *first = calloc(n_cells, sizeof *first);
    float *second = calloc(n_cells, sizeof *second);
    size_t n_points = 0;

    assert(first && second);
    shef_lcm_grid_images(grid, first, second);
    for (size_t i = 0; i < n_cells; i++)
        n_points += first[i] != 0.0f;
    assert(!grid->mask || n_points <= (size_t)grid->n_points);
    free(first);
    free(second);
}

/* Returns whether it was a message. */
static int decode(int kind, const uint8_t *bytes, size_t n_bytes)
{
    struct shef_lcm_grid grid;
    struct shef_lcm_cloud cloud;
    struct shef_lcm_pose pose;
    struct shef_lcm_status status;
    enum shef_lcm_result result = SHEF_LCM_WRONG_TYPE;

    switch (kind) {
    case 0:
        result = shef_lcm_decode_disparity(bytes, n_bytes, &grid);
        break;
    case 1:
        result = shef_lcm_decode_depth(bytes, n_bytes, &grid);
        break;
    case 2:
        result = shef_lcm_decode_dense(bytes, n_bytes, &grid);
        break;
    case 3:
        result = shef_lcm_decode_cloud(bytes, n_bytes, &cloud);
        break;
    case 4:
        result = shef_lcm_decode_pose(bytes, n_bytes, &pose);
        break;
    default:
        result = shef_lcm_decode_status(bytes, n_bytes, &status);
        break;
    }
    assert(strlen(shef_lcm_result_text(result)) > 0);
    if (result)
        return 0;
    if (kind <= 2)
        draw(&grid);
    if (kind == 3)
        for (int32_t i = 0; i < cloud.n_points; i++)
            (void)shef_lcm_cloud_point(&cloud, i);
    if (kind == 5)
        assert(strlen(status.state) < n_bytes);
    return 1;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const int64_t types[N_KINDS] = {
        __shef_disparity_t_get_hash(), __shef_depth_t_get_hash(), __shef_dense_t_get_hash(),
        __shef_cloud_t_get_hash(),     __shef_pose_t_get_hash(),  __shef_status_t_get_hash(),
    };

    if (size < 1)
        return 0;

    const int kind = data[0] % N_KINDS;
    const size_t n_bytes = size - 1;
    uint8_t *bytes = malloc(n_bytes ? n_bytes : 1); /* of exactly this size */

    assert(bytes);
    memcpy(bytes, data + 1, n_bytes);
    (void)decode(kind, bytes, n_bytes);
    if (n_bytes >= CRC_OFFSET + 4) {
        put_be(bytes, (uint64_t)types[kind], HEADER_BYTES);
        put_be(bytes + CRC_OFFSET, 0, 4);
        put_be(bytes + CRC_OFFSET, shef_crc32c(0, bytes, n_bytes), 4);
        (void)decode(kind, bytes, n_bytes);
    }
    free(bytes);
    return 0;
}
