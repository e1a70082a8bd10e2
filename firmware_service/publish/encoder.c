#include "publish/encoder.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include <shef_disparity_t.h>
#include <shef_pose_t.h>
#include <shef_status_t.h>

#include "core/crc32c.h"
#include "core/memory.h"
#include "pipeline/depth_chain.h"
#include "publish/encoder_internal.h"

/* Where header.crc32c lies: after the type's fingerprint (8), seven int64, calib_id (32) and two
 * int32. */
#define CRC_OFFSET (8 + 7 * 8 + 32 + 2 * 4)

/* Of the 12-bit code. */
#define LEAST_DISPARITY_CODE 1
#define MOST_DISPARITY_CODE  4095

/* depth_chain.h, result.h and the .lcm files say the same things. */
_Static_assert(SHEF_DEPTH_PAPER_DS == SHEF_DISPARITY_T_MODE_PAPER_DS, "");
_Static_assert(SHEF_DEPTH_PAPER_DP == SHEF_DISPARITY_T_MODE_PAPER_DP, "");
_Static_assert(SHEF_DEPTH_UNSIGNED == SHEF_DISPARITY_T_MODE_UNSIGNED, "");
_Static_assert(SHEF_DEPTH_TERNARY == SHEF_DISPARITY_T_MODE_TERNARY, "");
_Static_assert(SHEF_DEPTH_GRADED == SHEF_DISPARITY_T_MODE_GRADED, "");
_Static_assert(SHEF_DEPTH_TEMPORAL == SHEF_DISPARITY_T_MODE_TEMPORAL, "");
_Static_assert(SHEF_DEPTH_COMBINED == SHEF_DISPARITY_T_MODE_COMBINED, "");
_Static_assert(SHEF_DEPTH_N_MODES == 7, "a further mode needs its MODE_... above");
_Static_assert(SHEF_RESULT_SHED_DENSE == SHEF_DISPARITY_T_SHED_DENSE, "");
_Static_assert(SHEF_RESULT_SHED_CLOUD == SHEF_DISPARITY_T_SHED_CLOUD, "");
_Static_assert(SHEF_RESULT_SHED_FULL_GRID == SHEF_DISPARITY_T_SHED_FULL_GRID, "");
_Static_assert(SHEF_RESULT_SHED_RANGE == SHEF_DISPARITY_T_SHED_RANGE, "");
_Static_assert(SHEF_RESULT_SHED_SINGLE == SHEF_DISPARITY_T_SHED_SINGLE, "");
_Static_assert(SHEF_RESULT_TIME_AMBIGUOUS == SHEF_DISPARITY_T_TIME_AMBIGUOUS, "");
_Static_assert(SHEF_RESULT_TIME_PREDICTED == SHEF_DISPARITY_T_TIME_PREDICTED, "");
_Static_assert(SHEF_RESULT_NO_MOTION == SHEF_DISPARITY_T_NO_MOTION, "");
_Static_assert(SHEF_RESULT_NO_PAST == SHEF_DISPARITY_T_NO_PAST, "");
_Static_assert(SHEF_RESULT_SATURATED == SHEF_DISPARITY_T_SATURATED, "");
_Static_assert(SHEF_RESULT_NO_CONFIDENCE == SHEF_DISPARITY_T_NO_CONFIDENCE, "");
_Static_assert(SHEF_RESULT_MODE_CHANGED == SHEF_DISPARITY_T_MODE_CHANGED, "");
_Static_assert(SHEF_RESULT_SETTLING == SHEF_DISPARITY_T_SETTLING, "");
_Static_assert(SHEF_POSE_NO_SOURCE == SHEF_POSE_T_NO_SOURCE, "");
_Static_assert(SHEF_POSE_VALID == SHEF_POSE_T_VALID, "");
_Static_assert(SHEF_POSE_NO_SAMPLE == SHEF_POSE_T_NO_SAMPLE, "");
_Static_assert(SHEF_POSE_NO_HAND_EYE == SHEF_POSE_T_NO_HAND_EYE, "");
_Static_assert(SHEF_POSE_TCP_DIFFERS == SHEF_POSE_T_TCP_DIFFERS, "");
_Static_assert(SHEF_POSE_ROBOT_FAULT == SHEF_POSE_T_ROBOT_FAULT, "");
_Static_assert(SHEF_POSE_CLOCK_UNSURE == SHEF_POSE_T_CLOCK_UNSURE, "");
_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "payloads are stored as they lie");

const char *shef_channel_name(enum shef_channel channel)
{
    static const char *const names[SHEF_CHANNELS] = {
        [SHEF_CHANNEL_POSE] = "POSE",   [SHEF_CHANNEL_DISPARITY] = "DISPARITY",
        [SHEF_CHANNEL_DEPTH] = "DEPTH", [SHEF_CHANNEL_DENSE] = "DENSE",
        [SHEF_CHANNEL_CLOUD] = "CLOUD", [SHEF_CHANNEL_STATUS] = "STATUS",
    };

    return names[channel];
}

enum shef_err shef_encoder_create(struct shef_encoder **out_encoder, int32_t width_px,
                                  int32_t height_px, struct shef_error *err)
{
    struct shef_encoder *encoder = calloc(1, sizeof *encoder);

    if (!encoder)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "publishing: out of memory");

    const enum shef_err result = shef_picks_create(&encoder->picks, width_px, height_px, err);

    if (result) {
        free(encoder);
        return result;
    }

    const size_t n_pixels = (size_t)width_px * (size_t)height_px;

    encoder->codes = shef_memory_create(n_pixels, sizeof *encoder->codes);
    encoder->sigmas = shef_memory_create(n_pixels, 1);
    encoder->depth_mask = shef_memory_create((size_t)height_px, ((size_t)width_px + 7) / 8);
    encoder->depth_start = shef_memory_create((size_t)height_px + 1, sizeof(uint32_t));
    encoder->payload = shef_memory_create(1, SHEF_MESSAGE_MAX_BYTES);
    encoder->message = shef_memory_create(1, SHEF_MESSAGE_MAX_BYTES);
    if (!encoder->codes || !encoder->sigmas || !encoder->depth_mask || !encoder->depth_start ||
        !encoder->payload || !encoder->message) {
        shef_encoder_destroy(encoder);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "publishing images of %dx%d px: out of memory",
                         width_px, height_px);
    }
    *out_encoder = encoder;
    return SHEF_OK;
}

void shef_encoder_destroy(struct shef_encoder *encoder)
{
    if (!encoder)
        return;
    shef_picks_destroy(&encoder->picks);
    free(encoder->codes);
    free(encoder->sigmas);
    free(encoder->depth_mask);
    free(encoder->depth_start);
    free(encoder->payload);
    free(encoder->message);
    free(encoder);
}

/* UTC in microseconds, rounded down also before 1970. */
static int64_t utime_of(shef_host_time host, int64_t utc_minus_mono_ns)
{
    const int64_t utc_ns = host.ns + utc_minus_mono_ns;

    return utc_ns / SHEF_NS_PER_US - (utc_ns % SHEF_NS_PER_US < 0);
}

static int64_t event_us_of(shef_event_time event)
{
    return event.ns / SHEF_NS_PER_US - (event.ns % SHEF_NS_PER_US < 0);
}

void shef_encoder_set_header(shef_header_t *header, const struct shef_result *result, int32_t chunk,
                             int32_t n_chunks)
{
    *header = (shef_header_t){
        .utime = utime_of(result->mid_host, result->utc_minus_mono_ns),
        .mono_ns = result->mid_host.ns,
        .event_us = event_us_of(result->mid),
        .utc_minus_mono_ns = result->utc_minus_mono_ns,
        .t_err_ns = result->t_err_ns,
        .seq = (int64_t)result->seq,
        .session_id = result->session_id,
        .chunk = chunk,
        .n_chunks = n_chunks,
    };
    memcpy(header->calib_id, result->calib_id, sizeof header->calib_id);
}

enum shef_err shef_encoder_emit(struct shef_encoder *encoder, enum shef_channel channel,
                                int n_bytes, int64_t utime_us)
{
    assert(n_bytes > CRC_OFFSET + 4 && n_bytes <= SHEF_MESSAGE_MAX_BYTES);

    const uint32_t crc = shef_crc32c(0, encoder->message, (size_t)n_bytes);

    for (int i = 0; i < 4; i++)
        encoder->message[CRC_OFFSET + i] = (uint8_t)(crc >> (24 - 8 * i));
    return encoder->emit(encoder->context, channel, encoder->message, (size_t)n_bytes, utime_us);
}

static enum shef_err encode_pose(struct shef_encoder *encoder)
{
    const struct shef_result_pose *pose = &encoder->result->pose;
    shef_pose_t message = { .validity = (int32_t)pose->validity };

    shef_encoder_set_header(&message.header, encoder->result, 0, 1);
    if (pose->validity == SHEF_POSE_VALID) {
        memcpy(message.pos, pose->t_world_rectified.t_m, sizeof message.pos);
        shef_rigid_quaternion(&pose->t_world_rectified, message.orientation);
        memcpy(message.covariance, pose->covariance, sizeof message.covariance);
    }
    return shef_encoder_emit(
        encoder, SHEF_CHANNEL_POSE,
        shef_pose_t_encode(encoder->message, 0, SHEF_MESSAGE_MAX_BYTES, &message),
        message.header.utime);
}

enum shef_err shef_encoder_result(struct shef_encoder *encoder, const struct shef_result *result,
                                  uint32_t outputs, int32_t grid_step, shef_message_fn *emit,
                                  void *context)
{
    enum shef_err sent = SHEF_OK;

    assert(grid_step == 1 || grid_step == 2);
    if (result->shed_bits & SHEF_RESULT_SHED_FULL_GRID)
        grid_step = 2;
    if (!result->has_dense || (result->shed_bits & SHEF_RESULT_SHED_DENSE))
        outputs &= ~SHEF_OUTPUT(SHEF_CHANNEL_DENSE);
    if (result->shed_bits & SHEF_RESULT_SHED_CLOUD)
        outputs &= ~SHEF_OUTPUT(SHEF_CHANNEL_CLOUD);
    encoder->result = result;
    encoder->emit = emit;
    encoder->context = context;

    const float unit_px = shef_disparity_unit_px(result->max_disparity_px);

    if (outputs & ~SHEF_OUTPUT(SHEF_CHANNEL_POSE))
        shef_picks_choose(&encoder->picks, result->disparity, result->confidence, grid_step,
                          unit_px * LEAST_DISPARITY_CODE, unit_px * MOST_DISPARITY_CODE);
    if (outputs & SHEF_OUTPUT(SHEF_CHANNEL_POSE))
        sent = encode_pose(encoder);
    if (!sent && (outputs & SHEF_OUTPUT(SHEF_CHANNEL_DISPARITY)))
        sent = shef_encoder_disparity(encoder);
    if (!sent && (outputs & SHEF_OUTPUT(SHEF_CHANNEL_DEPTH)))
        sent = shef_encoder_depth(encoder);
    if (!sent && (outputs & SHEF_OUTPUT(SHEF_CHANNEL_DENSE)))
        sent = shef_encoder_dense(encoder);
    if (!sent && (outputs & SHEF_OUTPUT(SHEF_CHANNEL_CLOUD)))
        sent = shef_encoder_cloud(encoder);
    return sent;
}

enum shef_err shef_encoder_status(struct shef_encoder *encoder,
                                  const struct shef_publish_status *status, uint64_t seq,
                                  shef_message_fn *emit, void *context)
{
    /* The generated type wants a writable string and does not write it. */
    char state[sizeof status->state];
    shef_status_t message = {
        .header = { .utime = utime_of(status->now, status->utc_minus_mono_ns),
                    .mono_ns = status->now.ns,
                    .event_us = event_us_of(status->event),
                    .utc_minus_mono_ns = status->utc_minus_mono_ns,
                    .seq = (int64_t)seq,
                    .session_id = status->session_id,
                    .n_chunks = 1 },
        .state = state,
        .mode = status->mode,
        .shed_bits = (int32_t)status->shed_bits,
        .n_events = (int64_t)status->n_events,
        .n_frames = (int64_t)status->n_frames,
        .n_published = (int64_t)status->n_published,
        .n_shed = (int64_t)status->n_shed,
        .n_unmatched = (int64_t)status->n_unmatched,
        .n_unpublished = (int64_t)status->n_unpublished,
        .n_damaged = (int64_t)status->n_damaged,
        .events_per_s = status->events_per_s,
        .frames_per_s = status->frames_per_s,
        .cpu_cores = status->cpu_cores,
        .memory_mib = status->memory_mib,
        .backlog = status->backlog,
        .complete_to_published_p50_ns = status->complete_to_published_p50_ns,
        .complete_to_published_p99_ns = status->complete_to_published_p99_ns,
        .mid_to_published_p50_ns = status->mid_to_published_p50_ns,
        .mid_to_published_p99_ns = status->mid_to_published_p99_ns,
    };

    memcpy(state, status->state, sizeof state);
    state[sizeof state - 1] = '\0';
    memcpy(message.header.calib_id, status->calib_id, sizeof message.header.calib_id);
    encoder->emit = emit;
    encoder->context = context;
    return shef_encoder_emit(
        encoder, SHEF_CHANNEL_STATUS,
        shef_status_t_encode(encoder->message, 0, SHEF_MESSAGE_MAX_BYTES, &message),
        message.header.utime);
}
