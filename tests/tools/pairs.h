/* Synthetic pairs and what the commands make of them. Thread: the test's main thread. */
#ifndef SHEF_TESTS_TOOLS_PAIRS_H
#define SHEF_TESTS_TOOLS_PAIRS_H

#include <jansson.h>
#include <stdbool.h>

#define PAIRS_N 6
#define PAIRS_MATCH                                                                                \
    "match --frame-edges %s/frame_edge --event-edges %s/event_edge --out %s "                      \
    "--max-disparity 32"

/* One data folder of PAIRS_N pairs for all tests of a program. */
const char *pairs_data(void);

/* Matches them into a folder of that name in the temporary folder. Valid until the next call.
 *   more  further options */
const char *pairs_match(const char *name, const char *more);

/* Scores maps of them with eval --json.
 *   more  further options */
json_t *pairs_eval_json(const char *maps, const char *more);

json_t *pairs_load_json(const char *folder, const char *name);
bool pairs_has_file(const char *folder, const char *name);
double pairs_number_at(const json_t *root, const char *key);

#endif
