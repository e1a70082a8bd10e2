/* Results with made-up contents, and a collector of messages. */
#ifndef SHEF_TESTS_PUBLISH_MADE_RESULT_H
#define SHEF_TESTS_PUBLISH_MADE_RESULT_H

#include "publish/encoder.h"
#include "publish/result.h"
#include "support/support.h"

/* Fills header, pose and images: each pixel has a disparity in 1..60 px with the given probability,
 * and the depth that goes with it. Dense and picture are filled where the result has them. */
void made_result_fill(struct shef_result *result, uint64_t seq, double density,
                      struct shef_test_random *random);

#define MADE_MAX_MESSAGES 128

struct made_message {
    enum shef_channel channel;
    uint8_t *bytes; /* a copy of exactly this size, so that reading past it is found */
    size_t n_bytes;
    int64_t utime_us;
};

struct made_messages {
    int n;
    struct made_message all[MADE_MAX_MESSAGES];
};

/* A shef_message_fn; context is a struct made_messages. */
enum shef_err made_messages_keep(void *context, enum shef_channel channel, const uint8_t *bytes,
                                 size_t n_bytes, int64_t utime_us);

void made_messages_free(struct made_messages *messages);

int made_messages_count(const struct made_messages *messages, enum shef_channel channel);

#endif
