#include "record/part_table.h"

#include <assert.h>

#include "record/event_part.h"
#include "record/frame_part.h"
#include "record/trigger_part.h"

#define POSE_MAX_BYTES 65535u /* the protocol's lengths have 16 bits */

static const struct shef_part_kind kinds[] = {
    [SHEF_PART_EVENTS] = { SHEF_EVENT_FOLDER, SHEF_EVENT_ENDING, "event part",
                           SHEF_EVENT_BLOCK_MAX_BYTES },
    [SHEF_PART_FRAMES] = { "frames", ".blk", "frame part", SHEF_FRAME_MAX_BYTES },
    [SHEF_PART_POSES] = { "poses", ".rtde", "pose part", POSE_MAX_BYTES },
    [SHEF_PART_TRIGGERS] = { "triggers", ".edge", "trigger part",
                             SHEF_EDGE_BLOCK_MAX *SHEF_EDGE_BYTES },
};

const struct shef_part_kind *shef_part_kind(enum shef_part part)
{
    assert(part >= SHEF_PART_EVENTS && part <= SHEF_PART_TRIGGERS);
    return &kinds[part];
}
