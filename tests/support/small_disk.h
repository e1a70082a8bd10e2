/* A disk that gets full: a small file system in memory that only one child process sees. */
#ifndef SHEF_TESTS_SUPPORT_SMALL_DISK_H
#define SHEF_TESTS_SUPPORT_SMALL_DISK_H

#include <stdio.h>
#include <unistd.h>

/* Forks a child that calls run with the name of a folder to be made on such a disk, and expects it
 * to end with 0. Skips the test where this user may not mount.
 *   name  of the disk among the test's temporary files
 *   size  as tmpfs takes it, "2m" */
void shef_test_on_small_disk(const char *name, const char *size, void run(const char *folder));

/* For run, which cannot use Unity: ends the child with 1, says which line found it otherwise.
 *   err  a struct shef_error whose sentence may help */
#define SHEF_TEST_CHILD_EXPECT(condition, err)                                                     \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fprintf(stderr, "line %d: %s (%s)\n", __LINE__, #condition, (err).text);               \
            _exit(1);                                                                              \
        }                                                                                          \
    } while (0)

#endif
