/* Edge maps for the tests of the correlation and of what is built on it, and the instruction sets
 * to run them on. */
#ifndef SHEF_TESTS_PIPELINE_BIN_CORR_CASES_H
#define SHEF_TESTS_PIPELINE_BIN_CORR_CASES_H

#include <stdint.h>

#include "core/image.h"
#include "pipeline/edge_map.h"
#include "support/support.h"

/* Feature sets to pass to create(): the C reference first, then every faster one that this
 * processor has. Returns how many (at most 4) and prints their names once. */
int shef_test_isas(uint32_t out_features[4]);

/* A map with this share of its pixels set, signs at random in a ternary one. */
struct shef_edge_map shef_test_random_map(struct shef_test_random *random, enum shef_edge_kind kind,
                                          int32_t width_px, int32_t height_px, double share);

/* e(x, y), 0 outside. */
int shef_test_edge_at(const struct shef_edge_map *map, int32_t x, int32_t y);

/* Sets e(x, y) of an unsigned or ternary map; outside it does nothing. */
void shef_test_set_edge(struct shef_edge_map *map, int32_t x, int32_t y, int value);

/* A zeroed image; shef_image_destroy_i16() or _f32() frees it. */
struct shef_image_i16 shef_test_image_i16(int32_t width_px, int32_t height_px);
struct shef_image_f32 shef_test_image_f32(int32_t width_px, int32_t height_px);

#endif
