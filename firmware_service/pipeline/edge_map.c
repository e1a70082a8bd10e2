#include "pipeline/edge_map.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/memory.h"

enum shef_err shef_edge_map_create(struct shef_edge_map *out_map, enum shef_edge_kind kind,
                                   int32_t width_px, int32_t height_px, struct shef_error *err)
{
    if (width_px < 1 || height_px < 1 || width_px > SHEF_IMAGE_MAX_SIDE_PX ||
        height_px > SHEF_IMAGE_MAX_SIDE_PX)
        return shef_fail(err, SHEF_ERR_INVALID, "edge map of %d x %d px: sides must be 1 to %d",
                         width_px, height_px, SHEF_IMAGE_MAX_SIDE_PX);

    struct shef_edge_map map = { .kind = kind, .width_px = width_px, .height_px = height_px };
    const size_t n_rows = (size_t)height_px;

    if (kind == SHEF_EDGE_GRADED) {
        map.graded_stride_bytes = (width_px + 63) / 64 * 64;
        map.graded = calloc(n_rows, (size_t)map.graded_stride_bytes);
    } else {
        map.stride_words = (width_px + 63) / 64;
        map.plus = calloc(n_rows * (size_t)map.stride_words, sizeof *map.plus);
        if (kind == SHEF_EDGE_TERNARY)
            map.minus = calloc(n_rows * (size_t)map.stride_words, sizeof *map.minus);
    }
    if ((kind == SHEF_EDGE_GRADED && !map.graded) || (kind != SHEF_EDGE_GRADED && !map.plus) ||
        (kind == SHEF_EDGE_TERNARY && !map.minus)) {
        shef_edge_map_destroy(&map);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "edge map of %d x %d px: out of memory", width_px,
                         height_px);
    }
    *out_map = map;
    return SHEF_OK;
}

void shef_edge_map_destroy(struct shef_edge_map *map)
{
    free(map->plus);
    free(map->minus);
    free(map->graded);
    *map = (struct shef_edge_map){ 0 };
}

enum shef_err shef_edge_map_set_binary(struct shef_edge_map *map, struct shef_image_u8 image,
                                       struct shef_error *err)
{
    assert(map->kind == SHEF_EDGE_UNSIGNED);
    assert(map->width_px == image.width_px && map->height_px == image.height_px);

    for (int32_t y = 0; y < image.height_px; y++) {
        const uint8_t *pixels = shef_row_u8(image, y);
        uint64_t *words = map->plus + (size_t)y * (size_t)map->stride_words;

        memset(words, 0, (size_t)map->stride_words * sizeof *words);
        for (int32_t x = 0; x < image.width_px; x++) {
            if (pixels[x] != 0 && pixels[x] != 255)
                return shef_fail(err, SHEF_ERR_FORMAT,
                                 "not a binary edge map: pixel (%d, %d) is %d, only 0 and 255 "
                                 "are allowed",
                                 x, y, pixels[x]);
            words[x / 64] |= (uint64_t)(pixels[x] == 255) << (x % 64);
        }
    }
    return SHEF_OK;
}

/* Eight bits to eight bytes of 0 or 1, least significant bit first in memory. */
static uint64_t spread_bits(uint64_t bits)
{
    const uint64_t ones = UINT64_C(0x0101010101010101);
    /* Each byte keeps one bit of its own; adding 0x7f carries it to the top if it is set. */
    const uint64_t own = ((bits & 0xff) * ones) & UINT64_C(0x8040201008040201);

    return ((own + UINT64_C(0x7f7f7f7f7f7f7f7f)) >> 7) & ones;
}

/* Bytes of 1 where plus is set, -1 where minus is, 0 where neither or both are.
 *   minus  may be NULL */
static void spread_row(const uint64_t *plus, const uint64_t *minus, int32_t width_px,
                       int8_t *out_row)
{
    for (int32_t x = 0; x < width_px; x += 8) {
        const uint64_t up = plus[x / 64] >> (x % 64);
        const uint64_t down = minus ? minus[x / 64] >> (x % 64) : 0;
        /* 255 times a byte of 1 is a byte of -1, without a carry into the next. */
        const uint64_t bytes = spread_bits(up & ~down) + 255 * spread_bits(down & ~up);
        const size_t n = width_px - x < 8 ? (size_t)(width_px - x) : 8;

        if (n == 8)
            memcpy(out_row + x, &bytes, 8); /* of a constant size: one store */
        else
            memcpy(out_row + x, &bytes, n);
    }
}

void shef_edge_map_row(const struct shef_edge_map *map, int32_t y, int8_t *out_row)
{
    const size_t first_word = (size_t)y * (size_t)map->stride_words;

    if (map->kind == SHEF_EDGE_GRADED)
        memcpy(out_row, map->graded + y * map->graded_stride_bytes, (size_t)map->width_px);
    else
        spread_row(map->plus + first_word, map->minus ? map->minus + first_word : NULL,
                   map->width_px, out_row);
}

int64_t shef_edge_map_count(const struct shef_edge_map *map)
{
    int64_t n_edges = 0;

    for (int32_t y = 0; y < map->height_px; y++) {
        if (map->kind == SHEF_EDGE_GRADED) {
            const int8_t *row = map->graded + y * map->graded_stride_bytes;

            for (int32_t x = 0; x < map->width_px; x++)
                n_edges += row[x] != 0;
            continue;
        }
        for (int32_t i = 0; i < map->stride_words; i++) {
            const size_t at = (size_t)y * (size_t)map->stride_words + (size_t)i;

            n_edges += __builtin_popcountll(map->plus[at] ^ (map->minus ? map->minus[at] : 0));
        }
    }
    return n_edges;
}
