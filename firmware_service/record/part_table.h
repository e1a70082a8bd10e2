/* The parts of a recording that consist of segments: where they lie and what they are called.
 * Thread: any. */
#ifndef SHEF_RECORD_PART_TABLE_H
#define SHEF_RECORD_PART_TABLE_H

#include <stdint.h>

#include "record/block_index.h"

#ifdef __cplusplus
extern "C" {
#endif

struct shef_part_kind {
    const char *folder;       /* in the recording, and the key in the manifest: "frames" */
    const char *ending;       /* of data files: ".blk" */
    const char *name;         /* in sentences: "frame part" */
    uint32_t max_block_bytes; /* larger ones count as damaged */
};

const struct shef_part_kind *shef_part_kind(enum shef_part part);

#ifdef __cplusplus
}
#endif

#endif
