#include "record/frame_replay.h"

#include <stdlib.h>

#include "core/pool.h"

struct shef_frame_replay {
    /* Set by create. */
    struct shef_recorded_frames *frames;
    struct shef_pool *pool;
    /* The source thread's, but for the pacer's permissions. */
    struct shef_replay_pacer pacer;
    struct shef_frame_packet next; /* read, not delivered; buffer NULL: there is none */
    uint32_t at;                   /* of the recording's frames */
    uint32_t n_lost;               /* since the last one that was read */
};

enum shef_err shef_frame_replay_create(const char *path, const struct shef_replay_config *config,
                                       struct shef_frame_replay **out_replay,
                                       struct shef_error *err)
{
    struct shef_frame_replay *replay = calloc(1, sizeof *replay);
    enum shef_err code;

    if (!replay)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "replay '%s': out of memory", path);
    shef_replay_pacer_init(&replay->pacer, config);
    code = shef_recorded_frames_open(path, &replay->frames, err);
    if (code == SHEF_OK) {
        replay->pool = shef_pool_create(config->n_buffers,
                                        shef_recorded_frames_max_bytes(replay->frames), err);
        if (!replay->pool)
            code = SHEF_ERR_NO_MEMORY;
    }
    if (code != SHEF_OK) {
        shef_frame_replay_destroy(replay);
        return code;
    }
    *out_replay = replay;
    return SHEF_OK;
}

static void add_lost(struct shef_frame_replay *replay, uint64_t n)
{
    const uint64_t n_lost = replay->n_lost + n;

    replay->n_lost = n_lost < UINT32_MAX ? (uint32_t)n_lost : UINT32_MAX;
}

/* Reads the next intact frame into a buffer of the pool. */
static enum shef_err read_ahead(struct shef_frame_replay *replay, struct shef_error *err)
{
    struct shef_buffer *buffer;

    if (replay->at == shef_recorded_frames_count(replay->frames))
        return SHEF_ERR_EMPTY;
    buffer = shef_pool_take(replay->pool);
    if (!buffer)
        return SHEF_ERR_FULL;
    while (replay->at < shef_recorded_frames_count(replay->frames)) {
        const uint32_t index = replay->at++;
        struct shef_recorded_frame frame;
        const enum shef_err code =
            shef_recorded_frames_read_into(replay->frames, index, buffer->data, &frame, err);

        add_lost(replay, shef_recorded_frames_missing_before(replay->frames, index));
        if (code == SHEF_OK) {
            buffer->used_bytes = shef_frame_bytes(&frame.info);
            replay->next = (struct shef_frame_packet){
                .buffer = buffer,
                .info = frame.info,
                .number = replay->pacer.n_delivered,
                .n_lost_before = replay->n_lost,
            };
            replay->n_lost = 0;
            return SHEF_OK;
        }
        if (code != SHEF_ERR_FORMAT) {
            shef_buffer_give(buffer);
            return code;
        }
        add_lost(replay, 1);
    }
    shef_buffer_give(buffer);
    return SHEF_ERR_EMPTY;
}

enum shef_err shef_frame_replay_take(struct shef_frame_replay *replay,
                                     struct shef_frame_packet *out_packet, struct shef_error *err)
{
    if (!replay->next.buffer) {
        const enum shef_err code = read_ahead(replay, err);

        if (code != SHEF_OK)
            return code;
    }
    if (!shef_replay_pacer_is_due(&replay->pacer, replay->next.info.arrived))
        return SHEF_ERR_TIMEOUT;
    *out_packet = replay->next;
    replay->next.buffer = NULL;
    replay->pacer.n_delivered++;
    return SHEF_OK;
}

shef_host_time shef_frame_replay_due(const struct shef_frame_replay *replay)
{
    return shef_replay_pacer_due(&replay->pacer, replay->next.info.arrived);
}

void shef_frame_replay_step(struct shef_frame_replay *replay, uint32_t n_frames)
{
    shef_replay_pacer_step(&replay->pacer, n_frames);
}

int64_t shef_frame_replay_late_ns(const struct shef_frame_replay *replay)
{
    return replay->pacer.late_ns;
}

void shef_frame_replay_destroy(struct shef_frame_replay *replay)
{
    if (!replay)
        return;
    if (replay->next.buffer)
        shef_buffer_give(replay->next.buffer);
    shef_pool_destroy(replay->pool);
    shef_recorded_frames_close(replay->frames);
    free(replay);
}
