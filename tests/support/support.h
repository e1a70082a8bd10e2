/* What every test may need: the data folder, a temporary folder, repeatable random numbers.
 *
 * setUp() and tearDown() have empty defaults; a test that needs them defines its own.
 * Thread: the test's main thread. */
#ifndef SHEF_TESTS_SUPPORT_H
#define SHEF_TESTS_SUPPORT_H

#include <stdint.h>

#include <unity.h>

/* The folder of real data called name ("shef", "events", ...), or NULL if it is not there.
 * Looked for in $SHEF_DATA, else in ../shared/data next to the checkout. Valid until the next
 * call with another name. */
const char *shef_test_data(const char *name);

/* Ends the running test as ignored, with the reason, where a data folder is missing. */
#define SHEF_TEST_NEEDS_DATA(name)                                                                 \
    do {                                                                                           \
        if (!shef_test_data(name))                                                                 \
            TEST_IGNORE_MESSAGE("no data folder '" name                                            \
                                "' in $SHEF_DATA or ../shared/data next to the checkout");         \
    } while (0)

/* A folder of the project's own, e.g. "tests/core/corpus"; valid until the next call. */
const char *shef_test_source(const char *path);

/* An empty folder of this program's own; it goes with everything in it when the program ends. */
const char *shef_test_temp_folder(void);

/* The path of name in the temporary folder.
 *   Valid until the fourth call after this one, so that a test can hold a few. */
const char *shef_test_temp_path(const char *name);

/* How many entries the temporary folder has, . and .. not counted. */
int shef_test_temp_count(void);

/* Random numbers that can be had again. The seed is fixed, or $SHEF_TEST_SEED if set. */
struct shef_test_random {
    uint64_t state;
};

/* Starts a sequence and prints its seed, so that a failure can be repeated. */
struct shef_test_random shef_test_random_start(void);

/* Uniform over all 64-bit values. */
uint64_t shef_test_random_u64(struct shef_test_random *random);

/* Uniform over first..last, both included. */
int32_t shef_test_random_range(struct shef_test_random *random, int32_t first, int32_t last);

/* Uniform over [0, 1). */
double shef_test_random_unit(struct shef_test_random *random);

#endif
