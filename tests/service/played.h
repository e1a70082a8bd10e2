/* A short rendered recording, and services that play it. Thread: the test's main thread. */
#ifndef SHEF_TESTS_SERVICE_PLAYED_H
#define SHEF_TESTS_SERVICE_PLAYED_H

#include <stdint.h>

#include <jansson.h>

#include "config/config.h"
#include "service/service_internal.h"

#define PLAYED_FRAMES 21 /* in the recording: 0.4 s at 54 a second, the last ones cut off */

/* The recording's folder; rendered at the first call, or what SHEF_TEST_RECORDING names:
 *   shefsim render --scene simple_boxes --speed 0.2 --seconds 0.4 --seed 3 --truth-every 4 */
const char *played_recording(void);

/* Settings for playing it: stepped, nothing published, recordings go to the temporary folder. */
struct shef_config played_config(void);

/* Creates and starts a service, which must work. */
struct shef_service *played_start(const struct shef_config *config);

/* Waits until the source has ended; a minute at most. */
void played_wait(struct shef_service *service);

/* Plays to the end and frees. */
void played_whole(const struct shef_config *config);

/* The answer to a command as JSON, to be released; the command must work.
 *   arguments  JSON text, e.g. "{\"name\": \"graded\"}"; NULL: none */
json_t *played_ask(struct shef_service *service, const char *command, const char *arguments);

/* The sentence of a command that must fail. Valid until the next call. */
const char *played_refusal(struct shef_service *service, const char *command,
                           const char *arguments);

/* A number deep in a status: "frames.lost_by.shed". */
int64_t played_number(const json_t *answer, const char *path);

/* Asserts that every frame that came in was published, was lost for a stated reason, or is under
 * way, of which there may be n at most. */
void played_expect_accounted(struct shef_service *service, int64_t n_under_way);

#endif
