#include "made_result.h"

#include <stdlib.h>
#include <string.h>

void made_result_fill(struct shef_result *result, uint64_t seq, double density,
                      struct shef_test_random *random)
{
    const double t_m[3] = { 0.1, -0.2, 0.3 };

    result->seq = seq;
    result->mid = (shef_event_time){ 1000000000 + (int64_t)seq * 18518519 };
    result->mid_host = (shef_host_time){ 5000000000 + (int64_t)seq * 18518519 };
    result->utc_minus_mono_ns = INT64_C(1700000000) * SHEF_NS_PER_S;
    result->t_err_ns = 12345;
    result->complete = shef_host_time_add(result->mid_host, 9 * SHEF_NS_PER_MS);
    result->session_id = 0x123456789abcdef;
    for (int i = 0; i < SHEF_CALIB_ID_BYTES; i++)
        result->calib_id[i] = (uint8_t)(i * 7 + 1);
    result->mode = 4;
    result->flags = SHEF_RESULT_SATURATED;
    result->f_px = 555.0;
    result->cx_px = 319.5;
    result->cy_px = 239.25;
    result->baseline_m = 0.06544;
    result->max_disparity_px = 64.0f;
    result->has_dense = result->dense_disparity.data != NULL;
    result->has_picture = true;
    result->pose.validity = SHEF_POSE_VALID;
    result->pose.t_world_rectified =
        shef_rigid_from_quaternion((const double[4]){ 0.5, 0.5, -0.5, 0.5 }, t_m);
    for (int i = 0; i < 36; i++)
        result->pose.covariance[i] = i * 1e-6;

    for (int32_t y = 0; y < result->disparity.height_px; y++) {
        float *disparity = shef_row_f32(result->disparity, y);
        float *confidence = shef_row_f32(result->confidence, y);
        float *depth = shef_row_f32(result->depth_m, y);
        float *sigma = shef_row_f32(result->sigma_m, y);

        for (int32_t x = 0; x < result->disparity.width_px; x++) {
            const bool is_set = shef_test_random_unit(random) < density;

            disparity[x] = is_set ? 1.0f + 59.0f * (float)shef_test_random_unit(random) : 0.0f;
            confidence[x] = is_set ? (float)shef_test_random_unit(random) : 0.0f;
            depth[x] = is_set ? (float)(555.0 * 0.06544) / disparity[x] : 0.0f;
            sigma[x] = is_set ? 0.02f * depth[x] : 0.0f;
            shef_row_u8(result->picture, y)[x] = (uint8_t)(x + y);
            if (result->has_dense) {
                shef_row_f32(result->dense_disparity, y)[x] =
                    x % 5 ? 1.0f + 59.0f * (float)shef_test_random_unit(random) : 0.0f;
                shef_row_f32(result->dense_confidence, y)[x] = (float)shef_test_random_unit(random);
            }
        }
    }
}

enum shef_err made_messages_keep(void *context, enum shef_channel channel, const uint8_t *bytes,
                                 size_t n_bytes, int64_t utime_us)
{
    struct made_messages *messages = context;

    TEST_ASSERT_LESS_THAN_INT(MADE_MAX_MESSAGES, messages->n);

    struct made_message *message = &messages->all[messages->n++];

    *message = (struct made_message){ channel, malloc(n_bytes), n_bytes, utime_us };
    TEST_ASSERT_NOT_NULL(message->bytes);
    memcpy(message->bytes, bytes, n_bytes);
    return SHEF_OK;
}

void made_messages_free(struct made_messages *messages)
{
    for (int i = 0; i < messages->n; i++)
        free(messages->all[i].bytes);
    messages->n = 0;
}

int made_messages_count(const struct made_messages *messages, enum shef_channel channel)
{
    int n = 0;

    for (int i = 0; i < messages->n; i++)
        n += messages->all[i].channel == channel;
    return n;
}
