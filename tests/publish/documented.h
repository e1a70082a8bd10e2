/* The examples and commands that docs/lcm.md shows, as a reader copies them from there.
 * Thread: the test's main thread. */
#ifndef SHEF_TESTS_PUBLISH_DOCUMENTED_H
#define SHEF_TESTS_PUBLISH_DOCUMENTED_H

/* A folder that looks like a checkout with a release build: docs/examples/ as the page shows them,
 * lcm_types/, and this build as build/release. Made at the first call. */
const char *documented_folder(void);

/* The block of commands that has these words in it. Valid until the next call. */
const char *documented_commands(const char *words);

/* Runs commands in the folder with a shell, which must work. */
void documented_run(const char *commands);

/* The contents of a file of the folder, or of one with a path from the root. To be freed. */
char *documented_read(const char *path);

#endif
