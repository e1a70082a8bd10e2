#include "record/replay.h"

#include <assert.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/pool.h"

struct shef_replay {
    /* Set by create. */
    struct shef_block_reader *reader;
    struct shef_event_part part;
    struct shef_pool *pool;
    uint8_t start_state[SHEF_BLOCK_STATE_BYTES];
    /* The source thread's, but for the pacer's permissions. */
    struct shef_replay_pacer pacer;
    struct shef_raw_packet next;           /* read, not delivered; buffer NULL: there is none */
    uint64_t n_seen;                       /* the block number after the last one's */
    uint8_t state[SHEF_BLOCK_STATE_BYTES]; /* at the start of the last one that was read */
    uint32_t segment;                      /* its own */
    bool follows;                          /* it does */
};

static enum shef_err open_reader(struct shef_replay *replay, const char *path,
                                 struct shef_error *err)
{
    char folder[PATH_MAX];

    if (snprintf(folder, sizeof folder, "%s/" SHEF_EVENT_FOLDER, path) >= PATH_MAX)
        return shef_fail(err, SHEF_ERR_INVALID, "replay '%s': the path is too long", path);

    const enum shef_err code =
        shef_block_reader_open(folder, SHEF_PART_EVENTS, SHEF_EVENT_ENDING,
                               SHEF_EVENT_BLOCK_MAX_BYTES, &replay->reader, err);

    if (code != SHEF_OK && code != SHEF_ERR_EMPTY)
        return code;

    const struct shef_block_summary *summary =
        code == SHEF_OK ? shef_block_reader_summary(replay->reader) : NULL;

    if (!summary || !summary->has_blocks)
        return shef_fail(err, SHEF_ERR_EMPTY, "replay '%s': it holds no events", path);
    if (!shef_event_part_decode(summary->header.info, &replay->part))
        return shef_fail(err, SHEF_ERR_UNSUPPORTED,
                         "replay '%s': its events are in a form that this program does not know",
                         path);
    memcpy(replay->start_state, summary->first.state, SHEF_BLOCK_STATE_BYTES);
    return SHEF_OK;
}

enum shef_err shef_replay_create(const char *path, const struct shef_replay_config *config,
                                 struct shef_replay **out_replay, struct shef_error *err)
{
    struct shef_replay *replay = calloc(1, sizeof *replay);

    if (!replay)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "replay '%s': out of memory", path);
    shef_replay_pacer_init(&replay->pacer, config);

    enum shef_err code = open_reader(replay, path, err);

    if (code == SHEF_OK) {
        replay->pool = shef_pool_create(config->n_buffers, SHEF_EVENT_BLOCK_MAX_BYTES, err);
        if (!replay->pool)
            code = SHEF_ERR_NO_MEMORY;
    }
    if (code != SHEF_OK) {
        shef_replay_destroy(replay);
        return code;
    }
    *out_replay = replay;
    return SHEF_OK;
}

const struct shef_event_part *shef_replay_part(const struct shef_replay *replay)
{
    return &replay->part;
}

const uint8_t *shef_replay_start_state(const struct shef_replay *replay)
{
    return replay->start_state;
}

/* Reads the next block into a buffer of the pool. */
static enum shef_err read_ahead(struct shef_replay *replay, struct shef_error *err)
{
    struct shef_block block;
    struct shef_buffer *buffer = shef_pool_take(replay->pool);

    if (!buffer)
        return SHEF_ERR_FULL;

    const enum shef_err code = shef_block_reader_next(replay->reader, buffer->data, &block, err);

    if (code != SHEF_OK) {
        shef_buffer_give(buffer);
        return code;
    }

    const uint64_t n_missing = block.record.number - replay->n_seen;
    const uint64_t n_lost = n_missing + block.record.n_lost_before;

    buffer->used_bytes = block.record.n_bytes;
    replay->next = (struct shef_raw_packet){
        .buffer = buffer,
        .arrived = block.record.arrived,
        .number = replay->pacer.n_delivered,
        .n_lost_before = n_lost < UINT32_MAX ? (uint32_t)n_lost : UINT32_MAX,
    };
    replay->n_seen = block.record.number + 1;
    memcpy(replay->state, block.record.state, sizeof replay->state);
    replay->follows = block.follows && block.segment == replay->segment;
    replay->segment = block.segment;
    return SHEF_OK;
}

const uint8_t *shef_replay_state(const struct shef_replay *replay, bool *out_follows)
{
    *out_follows = replay->follows;
    return replay->state;
}

shef_host_time shef_replay_due(const struct shef_replay *replay)
{
    return shef_replay_pacer_due(&replay->pacer, replay->next.arrived);
}

enum shef_err shef_replay_take(struct shef_replay *replay, struct shef_raw_packet *out_packet,
                               struct shef_error *err)
{
    if (!replay->next.buffer) {
        const enum shef_err code = read_ahead(replay, err);

        if (code != SHEF_OK)
            return code;
    }
    if (!shef_replay_pacer_is_due(&replay->pacer, replay->next.arrived))
        return SHEF_ERR_TIMEOUT;
    *out_packet = replay->next;
    replay->next.buffer = NULL;
    replay->pacer.n_delivered++;
    return SHEF_OK;
}

void shef_replay_step(struct shef_replay *replay, uint32_t n_buffers)
{
    shef_replay_pacer_step(&replay->pacer, n_buffers);
}

int64_t shef_replay_late_ns(const struct shef_replay *replay)
{
    return replay->pacer.late_ns;
}

const struct shef_damage *shef_replay_damage(const struct shef_replay *replay)
{
    return shef_block_reader_damage(replay->reader);
}

void shef_replay_rewind(struct shef_replay *replay)
{
    assert(!replay->next.buffer);
    shef_block_reader_rewind(replay->reader);
    replay->n_seen = 0;
}

void shef_replay_destroy(struct shef_replay *replay)
{
    if (!replay)
        return;
    if (replay->next.buffer)
        shef_buffer_give(replay->next.buffer);
    shef_pool_destroy(replay->pool);
    shef_block_reader_close(replay->reader);
    free(replay);
}
