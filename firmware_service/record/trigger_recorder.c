#include "record/trigger_recorder.h"

#include <stdio.h>
#include <stdlib.h>

struct shef_trigger_recorder {
    struct shef_part_recorder part;
    bool has_last;
    uint32_t last_number;
    uint8_t room[SHEF_EDGE_BLOCK_MAX * SHEF_EDGE_BYTES];
};

static enum shef_err write_front(struct shef_trigger_recorder *recorder,
                                 const struct shef_trigger_recorder_config *config,
                                 struct shef_error *err)
{
    struct shef_front_text *front = &recorder->part.front;
    bool fits = config->n_lines <= SHEF_EDGE_MAX_LINES;

    shef_front_text_begin(front, SHEF_EDGE_FRONT);
    fits = fits && shef_front_text_add(front, "chip", config->chip);
    for (uint32_t i = 0; fits && i < config->n_lines; i++) {
        char line[SHEF_EDGE_NAME_BYTES + 8];

        snprintf(line, sizeof line, "%u %s", config->lines[i].number, config->lines[i].name);
        fits = shef_front_text_add(front, "line", line);
    }
    shef_front_text_end(front);
    return fits ? SHEF_OK
                : shef_fail(err, SHEF_ERR_INVALID, "record triggers: %u lines, at most %d can be",
                            config->n_lines, SHEF_EDGE_MAX_LINES);
}

enum shef_err shef_trigger_recorder_start(struct shef_recording_writer *recording,
                                          const struct shef_trigger_recorder_config *config,
                                          struct shef_trigger_recorder **out_recorder,
                                          struct shef_error *err)
{
    static const uint8_t info[SHEF_PART_INFO_BYTES];
    struct shef_trigger_recorder *recorder = calloc(1, sizeof *recorder);
    enum shef_err code;

    if (!recorder)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "record to '%s': out of memory",
                         recording->folder);
    code = write_front(recorder, config, err);
    if (code == SHEF_OK)
        code = shef_part_recorder_start(&recorder->part, recording, SHEF_PART_TRIGGERS, info,
                                        &config->limits, err);
    if (code != SHEF_OK) {
        free(recorder);
        return code;
    }
    snprintf(recorder->part.counts->source, sizeof recorder->part.counts->source,
             "%.100s, %u lines", config->chip, config->n_lines);
    *out_recorder = recorder;
    return SHEF_OK;
}

/* How many edges are missing before this one, by the kernel's count, which wraps. A step of more
 * than half its range is one back: it has begun anew. */
static uint32_t count_skipped(const struct shef_trigger_recorder *recorder,
                              const struct shef_edge *edge)
{
    const uint32_t n = edge->number - recorder->last_number - 1;

    return recorder->has_last && n < UINT32_MAX / 2 ? n : 0;
}

/* Puts edges into the room. Returns how many are known to be missing between them or before. */
static uint64_t encode(struct shef_trigger_recorder *recorder, const struct shef_edge *edges,
                       uint32_t n_edges)
{
    uint64_t n_skipped = 0;

    for (uint32_t i = 0; i < n_edges; i++) {
        n_skipped += count_skipped(recorder, &edges[i]);
        recorder->has_last = true;
        recorder->last_number = edges[i].number;
        shef_edge_encode(&edges[i], recorder->room + i * SHEF_EDGE_BYTES);
    }
    return n_skipped;
}

enum shef_err shef_trigger_recorder_write(struct shef_trigger_recorder *recorder,
                                          const struct shef_edge *edges, uint32_t n_edges,
                                          shef_host_time arrived, uint32_t n_lost_before,
                                          struct shef_error *err)
{
    enum shef_err code = SHEF_OK;

    for (uint32_t at = 0; code == SHEF_OK && at < n_edges; at += SHEF_EDGE_BLOCK_MAX) {
        const uint32_t n_left = n_edges - at;
        const uint32_t n = n_left < SHEF_EDGE_BLOCK_MAX ? n_left : SHEF_EDGE_BLOCK_MAX;
        const uint64_t n_known = at == 0 ? n_lost_before : 0;
        const uint64_t n_skipped = encode(recorder, edges + at, n);
        const uint64_t n_lost = n_skipped > n_known ? n_skipped : n_known;
        const struct shef_block_record record = {
            .arrived = arrived,
            .first_us = edges[at].time.ns / SHEF_NS_PER_US,
            .last_us = edges[at + n - 1].time.ns / SHEF_NS_PER_US,
            .n_items = n,
            .n_lost_before = n_lost < UINT32_MAX ? (uint32_t)n_lost : UINT32_MAX,
        };

        code = shef_part_recorder_write(&recorder->part, recorder->room, n * SHEF_EDGE_BYTES,
                                        &record, err);
    }
    return code;
}

enum shef_err shef_trigger_recorder_stop(struct shef_trigger_recorder *recorder,
                                         struct shef_error *err)
{
    const uint64_t n_lost = recorder->part.counts->n_lost;
    char reason[120] = "";

    if (n_lost > 0)
        snprintf(reason, sizeof reason, "%llu sync edges were lost before they were recorded",
                 (unsigned long long)n_lost);

    const enum shef_err code = shef_part_recorder_stop(&recorder->part, reason, err);

    free(recorder);
    return code;
}
