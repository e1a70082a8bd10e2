/* Who allocates: every malloc(), calloc(), realloc(), aligned allocation and free() of a test
 * program, attributed to its thread and its caller.
 *
 * A test that includes this header is linked with definitions that come before the C library's,
 * for itself and for every library it uses. Between start() and stop() each call is counted in a
 * fixed table; the calls themselves go on to the C library. Watching allocates nothing, and takes
 * no lock. start, stop and the reports: the test's main thread; the counting: any. */
#ifndef SHEF_TESTS_ALLOC_WATCH_H
#define SHEF_TESTS_ALLOC_WATCH_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/* Callers on one thread; beyond that everything counts on the last entry. */
#define SHEF_ALLOC_WATCH_ENTRIES 512

struct shef_alloc_entry {
    int32_t tid;
    char thread[16];    /* its name when it first called */
    const void *caller; /* where the call returns to */
    uint64_t n_allocations;
    uint64_t n_frees;
    uint64_t n_bytes; /* asked for */
};

/* False under the sanitizers, which have definitions of their own. */
bool shef_alloc_watch_is_available(void);

/* Ends the running test as ignored where watching is not possible. */
#define SHEF_TEST_NEEDS_ALLOC_WATCH()                                                              \
    do {                                                                                           \
        if (!shef_alloc_watch_is_available())                                                      \
            TEST_IGNORE_MESSAGE("allocations cannot be watched under a sanitizer");                \
    } while (0)

/* Forgets earlier counts and starts. Threads that run already and new ones are watched alike. */
void shef_alloc_watch_start(void);
void shef_alloc_watch_stop(void);

/* How many entries there are, and each of them. */
int shef_alloc_watch_count(void);
struct shef_alloc_entry shef_alloc_watch_entry(int i);

/* Calls on threads of that name (NULL: all threads), allocations and frees together.
 *   ours_only  only those that code of this program made itself, not a shared library */
uint64_t shef_alloc_watch_calls(const char *thread, bool ours_only);

/* Whether a caller lies in the test program itself, where all our code is linked. */
bool shef_alloc_watch_is_ours(const void *caller);

/* One line per entry: thread, calls, bytes, object and function. */
void shef_alloc_watch_print(FILE *out);

#endif
