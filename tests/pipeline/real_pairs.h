/* The authors' real pairs, for tests and benchmarks that read them. */
#ifndef SHEF_TESTS_PIPELINE_REAL_PAIRS_H
#define SHEF_TESTS_PIPELINE_REAL_PAIRS_H

#include <stdint.h>

#include "core/image.h"
#include "pipeline/edge_map.h"

#define SHEF_TEST_N_PAIRS 48

/* The number of the i-th given pair: 1-16, 50-65, 99-114. */
int32_t shef_test_pair_number(int32_t i);

struct shef_test_pair {
    struct shef_edge_map left;
    struct shef_edge_map right;
    struct shef_image_f32 truth;
};

/* Reads a pair; the data folder must be there. A file that cannot be read fails the test. */
struct shef_test_pair shef_test_read_pair(int32_t number);

void shef_test_free_pair(struct shef_test_pair *pair);

#endif
