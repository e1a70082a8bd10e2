/* What every check of a kernel against its reference starts with: the instruction sets of this
 * processor and random numbers, both fresh before each test. Defines setUp(). */
#ifndef SHEF_TESTS_KERNEL_CHECK_H
#define SHEF_TESTS_KERNEL_CHECK_H

#include "filter_model.h"

static uint32_t features[4];
static int n_features;
static struct shef_test_random random_numbers;

void setUp(void)
{
    n_features = shef_test_features(features);
    random_numbers = shef_test_random_start();
}

static inline int32_t any(int32_t first, int32_t last)
{
    return shef_test_random_range(&random_numbers, first, last);
}

#endif
