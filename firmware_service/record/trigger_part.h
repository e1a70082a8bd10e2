/* What the writer and the readers of the trigger part agree on. Thread: any. */
#ifndef SHEF_RECORD_TRIGGER_PART_H
#define SHEF_RECORD_TRIGGER_PART_H

#include <stdbool.h>
#include <stdint.h>

#include "core/time.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_EDGE_FRONT      "shef-edges"
#define SHEF_EDGE_BYTES      16   /* in the file */
#define SHEF_EDGE_BLOCK_MAX  4096 /* edges in a block: 64 KiB */
#define SHEF_EDGE_MAX_LINES  64
#define SHEF_EDGE_NAME_BYTES 32

/* One edge on a sync line, as the host's kernel saw it. */
struct shef_edge {
    shef_host_time time;
    uint32_t number; /* counted by the kernel, over all lines */
    uint8_t line;
    bool is_high; /* after the edge */
};

/* A line that is watched. */
struct shef_edge_line {
    uint8_t number;
    char name[SHEF_EDGE_NAME_BYTES]; /* "frame exposure" */
};

void shef_edge_encode(const struct shef_edge *edge, uint8_t out_bytes[SHEF_EDGE_BYTES]);

struct shef_edge shef_edge_decode(const uint8_t bytes[SHEF_EDGE_BYTES]);

#ifdef __cplusplus
}
#endif

#endif
