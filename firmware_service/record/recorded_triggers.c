#include "record/recorded_triggers.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "record/part_reader.h"
#include "record/part_table.h"

struct shef_recorded_triggers {
    struct shef_part_reader part;
    uint32_t n_edges; /* of the block */
    uint32_t at;
    bool follows; /* the block's first edge */
    bool has_last;
    uint32_t last_number;
    bool has_ended;
    char chip[SHEF_EDGE_NAME_BYTES];
    uint8_t room[SHEF_EDGE_BLOCK_MAX * SHEF_EDGE_BYTES];
};

enum shef_err shef_recorded_triggers_open(const char *path,
                                          struct shef_recorded_triggers **out_triggers,
                                          struct shef_error *err)
{
    struct shef_recorded_triggers *triggers = calloc(1, sizeof *triggers);

    if (!triggers)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "open '%s': out of memory", path);

    const enum shef_err code =
        shef_part_reader_open(&triggers->part, path, SHEF_PART_TRIGGERS, SHEF_EDGE_FRONT, err);

    if (code != SHEF_OK) {
        free(triggers);
        return code;
    }
    (void)shef_front_text_get(&triggers->part.front, "chip", 0, triggers->chip,
                              sizeof triggers->chip);
    *out_triggers = triggers;
    return SHEF_OK;
}

const char *shef_recorded_triggers_chip(const struct shef_recorded_triggers *triggers)
{
    return triggers->chip;
}

static enum shef_err take_block(struct shef_recorded_triggers *triggers, struct shef_error *err)
{
    struct shef_block block;
    const enum shef_err code =
        shef_block_reader_next(triggers->part.blocks, triggers->room, &block, err);

    if (code == SHEF_ERR_EMPTY && !triggers->has_ended) {
        triggers->has_ended = true;
        shef_part_reader_note_damage(&triggers->part);
    }
    if (code != SHEF_OK)
        return code;
    triggers->n_edges = block.record.n_bytes / SHEF_EDGE_BYTES;
    triggers->at = 0;
    triggers->follows = block.follows && block.record.n_lost_before == 0;
    return SHEF_OK;
}

enum shef_err shef_recorded_triggers_next(struct shef_recorded_triggers *triggers,
                                          struct shef_edge *out_edge, bool *out_follows,
                                          struct shef_error *err)
{
    while (triggers->at == triggers->n_edges) {
        const enum shef_err code = take_block(triggers, err);

        if (code != SHEF_OK)
            return code;
    }

    const struct shef_edge edge =
        shef_edge_decode(triggers->room + (size_t)triggers->at * SHEF_EDGE_BYTES);

    if (out_follows)
        *out_follows = triggers->has_last && edge.number == triggers->last_number + 1 &&
                       (triggers->at > 0 || triggers->follows);
    triggers->at++;
    triggers->has_last = true;
    triggers->last_number = edge.number;
    *out_edge = edge;
    return SHEF_OK;
}

bool shef_recorded_triggers_line(const struct shef_recorded_triggers *triggers, int i,
                                 struct shef_edge_line *out_line)
{
    char text[SHEF_EDGE_NAME_BYTES + 8];
    struct shef_edge_line line;
    char *end;

    if (!shef_front_text_get(&triggers->part.front, "line", i, text, sizeof text))
        return false;
    line.number = (uint8_t)strtoul(text, &end, 10);
    snprintf(line.name, sizeof line.name, "%.31s", *end == ' ' ? end + 1 : end);
    *out_line = line;
    return true;
}

const struct shef_damage *shef_recorded_triggers_damage(
    const struct shef_recorded_triggers *triggers)
{
    return shef_block_reader_damage(triggers->part.blocks);
}

const char *shef_recorded_triggers_note(const struct shef_recorded_triggers *triggers, int i)
{
    return shef_part_reader_get_note(&triggers->part, i);
}

void shef_recorded_triggers_close(struct shef_recorded_triggers *triggers)
{
    if (!triggers)
        return;
    shef_part_reader_close(&triggers->part);
    free(triggers);
}
