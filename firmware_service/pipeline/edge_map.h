/* Edge maps: what the matcher correlates.
 *
 * Three kinds with one meaning: e(x, y) in [-1, 1] says how strong the edge at a pixel is and, in
 * the signed kinds, whether brightness rises (+) or falls (-) there.
 *
 *   unsigned  one bit plane, e = 0 or 1          the authors' binary maps
 *   ternary   two bit planes, e = -1, 0 or 1     agreeing edges add, opposing edges subtract
 *   graded    one int8 image, e = value / 127    live data
 *
 * Bit planes are uint64 words, least significant bit leftmost, padding bits zero. A pixel that is
 * set in both planes of a ternary map has e = 0: no edge. */
#ifndef SHEF_PIPELINE_EDGE_MAP_H
#define SHEF_PIPELINE_EDGE_MAP_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error                                                                                             \
    "edge maps are spread to bytes through little-endian words; port edge_map.c and kernels/ first"
#endif

#ifdef __cplusplus
extern "C" {
#endif

enum shef_edge_kind {
    SHEF_EDGE_UNSIGNED,
    SHEF_EDGE_TERNARY,
    SHEF_EDGE_GRADED,
};

struct shef_edge_map {
    enum shef_edge_kind kind;
    int32_t width_px;
    int32_t height_px;
    int32_t stride_words;          /* of a bit plane's row, at least (width_px + 63) / 64 */
    uint64_t *plus;                /* unsigned: the edges; ternary: rising ones; else NULL */
    uint64_t *minus;               /* ternary: falling edges; else NULL */
    int8_t *graded;                /* graded: -127..127; else NULL */
    ptrdiff_t graded_stride_bytes; /* of a graded row, at least width_px */
};

/* Allocates a map of one kind with no edges in it. width and height 1..16384 px.
 * SHEF_ERR_INVALID, SHEF_ERR_NO_MEMORY: nothing was allocated. */
SHEF_MUST_CHECK enum shef_err shef_edge_map_create(struct shef_edge_map *out_map,
                                                   enum shef_edge_kind kind, int32_t width_px,
                                                   int32_t height_px, struct shef_error *err);

/* Frees what create() allocated; a zeroed map is allowed. */
void shef_edge_map_destroy(struct shef_edge_map *map);

/* Fills an unsigned map of the same size from an image of two values, 0 and 255.
 * SHEF_ERR_FORMAT: a pixel has another value; the sentence says where, and the map is undefined. */
SHEF_MUST_CHECK enum shef_err shef_edge_map_set_binary(struct shef_edge_map *map,
                                                       struct shef_image_u8 image,
                                                       struct shef_error *err);

/* Copies row y as signed bytes: -1, 0, 1 for the bit kinds, the values for graded.
 *   out_row  width_px values */
void shef_edge_map_row(const struct shef_edge_map *map, int32_t y, int8_t *out_row);

/* How many pixels carry an edge (graded: a value other than 0). */
int64_t shef_edge_map_count(const struct shef_edge_map *map);

#ifdef __cplusplus
}
#endif

#endif
