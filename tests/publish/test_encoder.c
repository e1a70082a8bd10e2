#include "publish/encoder.h"

#include <math.h>
#include <string.h>

#include <shef_cloud_t.h>
#include <shef_dense_t.h>
#include <shef_depth_t.h>
#include <shef_disparity_t.h>
#include <shef_lcm_decode.h>
#include <shef_pose_t.h>
#include <shef_status_t.h>

#include "core/crc32c.h"
#include "made_result.h"

#define WIDTH_PX  640
#define HEIGHT_PX 480
#define ALL       (SHEF_OUTPUT(SHEF_CHANNELS) - 1)

static struct shef_result_pool *pool;
static struct shef_result *result;
static struct shef_encoder *encoder;
static struct made_messages messages;
static struct shef_test_random test_random;
static float first[WIDTH_PX * HEIGHT_PX], second[WIDTH_PX * HEIGHT_PX];

void setUp(void)
{
    test_random = shef_test_random_start();
    pool = shef_result_pool_create(1, WIDTH_PX, HEIGHT_PX, 1, NULL);
    TEST_ASSERT_NOT_NULL(pool);
    result = shef_result_take(pool);
    TEST_ASSERT_NOT_NULL(result);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_encoder_create(&encoder, WIDTH_PX, HEIGHT_PX, NULL));
}

void tearDown(void)
{
    made_messages_free(&messages);
    shef_encoder_destroy(encoder);
    shef_result_give(result);
    shef_result_pool_destroy(pool);
}

static void encode(uint32_t outputs, int32_t grid_step)
{
    made_messages_free(&messages);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_encoder_result(encoder, result, outputs, grid_step,
                                                   made_messages_keep, &messages));
}

static void expect_header(const struct shef_lcm_header *header)
{
    TEST_ASSERT_EQUAL_INT64((result->mid_host.ns + result->utc_minus_mono_ns) / 1000,
                            header->utime_us);
    TEST_ASSERT_EQUAL_INT64(result->mid_host.ns, header->mono_ns);
    TEST_ASSERT_EQUAL_INT64(result->mid.ns / 1000, header->event_us);
    TEST_ASSERT_EQUAL_INT64(result->utc_minus_mono_ns, header->utc_minus_mono_ns);
    TEST_ASSERT_EQUAL_INT64(12345, header->t_err_ns);
    TEST_ASSERT_EQUAL_INT64(result->seq, header->seq);
    TEST_ASSERT_EQUAL_INT64(0x123456789abcdef, header->session_id);
    TEST_ASSERT_EQUAL_UINT8_ARRAY(result->calib_id, header->calib_id, SHEF_CALIB_ID_BYTES);
}

typedef enum shef_lcm_result decode_grid_fn(const void *message, size_t n_bytes,
                                            struct shef_lcm_grid *out_grid);

/* Decodes all chunks of a channel into first and second, checking what they say of themselves. */
static struct shef_lcm_grid decode_chunks(enum shef_channel channel, decode_grid_fn *decode)
{
    struct shef_lcm_grid grid = { 0 };
    const int n_chunks = made_messages_count(&messages, channel);
    int32_t chunk = 0, next_row = 0;

    for (size_t i = 0; i < WIDTH_PX * HEIGHT_PX; i++)
        first[i] = second[i] = -1.0f;
    for (int i = 0; i < messages.n; i++) {
        const struct made_message *message = &messages.all[i];

        if (message->channel != channel)
            continue;
        TEST_ASSERT_LESS_OR_EQUAL_size_t(SHEF_MESSAGE_MAX_BYTES, message->n_bytes);
        TEST_ASSERT_EQUAL(SHEF_LCM_OK, decode(message->bytes, message->n_bytes, &grid));
        expect_header(&grid.header);
        TEST_ASSERT_EQUAL_INT64(grid.header.utime_us, message->utime_us);
        TEST_ASSERT_EQUAL_INT32(chunk++, grid.header.chunk);
        TEST_ASSERT_EQUAL_INT32(n_chunks, grid.header.n_chunks);
        TEST_ASSERT_EQUAL_INT32(next_row, grid.first_row);
        next_row += grid.n_rows;
        TEST_ASSERT_EQUAL_INT32(WIDTH_PX, grid.width_px);
        TEST_ASSERT_EQUAL_INT32(HEIGHT_PX, grid.height_px);
        TEST_ASSERT_EQUAL_DOUBLE(555.0, grid.f_px);
        TEST_ASSERT_EQUAL_DOUBLE(319.5, grid.cx_px);
        TEST_ASSERT_EQUAL_DOUBLE(239.25, grid.cy_px);
        TEST_ASSERT_EQUAL_DOUBLE(0.06544, grid.baseline_m);
        TEST_ASSERT_EQUAL_INT32(4, grid.mode);
        TEST_ASSERT_EQUAL_INT32(result->shed_bits, grid.shed_bits);
        TEST_ASSERT_EQUAL_INT32(SHEF_RESULT_SATURATED, grid.validity);
        shef_lcm_grid_images(&grid, first, second);
    }
    TEST_ASSERT_EQUAL_INT32(grid.grid_h, next_row);
    return grid;
}

/* The pixel that stands for a cell; -1: none. */
static int32_t best_pixel(int32_t gx, int32_t gy, int32_t step)
{
    int32_t best = -1;
    float best_confidence = -1.0f;

    for (int32_t y = gy * step; y < (gy + 1) * step; y++)
        for (int32_t x = gx * step; x < (gx + 1) * step; x++)
            if (shef_row_f32(result->disparity, y)[x] > 0.0f &&
                shef_row_f32(result->confidence, y)[x] > best_confidence) {
                best_confidence = shef_row_f32(result->confidence, y)[x];
                best = y * WIDTH_PX + x;
            }
    return best;
}

static float at(struct shef_image_f32 image, int32_t pixel)
{
    return shef_row_f32(image, pixel / WIDTH_PX)[pixel % WIDTH_PX];
}

static void expect_disparities_and_depths(int32_t step)
{
    int32_t n_set = 0;

    (void)decode_chunks(SHEF_CHANNEL_DISPARITY, shef_lcm_decode_disparity);
    for (int32_t cell = 0; cell < WIDTH_PX / step * (HEIGHT_PX / step); cell++) {
        const int32_t pixel = best_pixel(cell % (WIDTH_PX / step), cell / (WIDTH_PX / step), step);

        if (pixel < 0) {
            TEST_ASSERT_EQUAL_FLOAT(0.0f, first[cell]);
            continue;
        }
        n_set++;
        TEST_ASSERT_FLOAT_WITHIN(1.0f / 64 + 1e-5f, at(result->disparity, pixel), first[cell]);
        TEST_ASSERT_FLOAT_WITHIN(1.0f / 30 + 1e-5f, at(result->confidence, pixel), second[cell]);
    }
    TEST_ASSERT_GREATER_THAN_INT32(0, n_set);

    (void)decode_chunks(SHEF_CHANNEL_DEPTH, shef_lcm_decode_depth);
    for (int32_t cell = 0; cell < WIDTH_PX / step * (HEIGHT_PX / step); cell++) {
        const int32_t pixel = best_pixel(cell % (WIDTH_PX / step), cell / (WIDTH_PX / step), step);
        const float depth_m = pixel < 0 ? 0.0f : at(result->depth_m, pixel);

        if (depth_m == 0.0f || depth_m * 4000.0f + 0.5f >= 65536.0f) {
            TEST_ASSERT_EQUAL_FLOAT(0.0f, first[cell]);
            continue;
        }
        TEST_ASSERT_FLOAT_WITHIN(0.000126f, depth_m, first[cell]);
        TEST_ASSERT_TRUE(second[cell] >= at(result->sigma_m, pixel) * 0.9999f);
        TEST_ASSERT_TRUE(second[cell] <= at(result->sigma_m, pixel) * 1.0626f ||
                         second[cell] <= 0.000251f);
    }
}

static void test_the_half_grid_comes_back_as_it_was_to_half_a_unit(void)
{
    made_result_fill(result, 9, 0.04, &test_random);
    encode(ALL & ~SHEF_OUTPUT(SHEF_CHANNEL_DENSE), 2);
    TEST_ASSERT_EQUAL_INT(1, made_messages_count(&messages, SHEF_CHANNEL_DISPARITY));
    TEST_ASSERT_EQUAL_INT(1, made_messages_count(&messages, SHEF_CHANNEL_DEPTH));
    expect_disparities_and_depths(2);
}

static void test_full_resolution_comes_in_chunks_that_add_up(void)
{
    made_result_fill(result, 9, 0.3, &test_random);
    encode(ALL, 1);
    TEST_ASSERT_GREATER_THAN_INT(2, made_messages_count(&messages, SHEF_CHANNEL_DISPARITY));
    TEST_ASSERT_GREATER_THAN_INT(2, made_messages_count(&messages, SHEF_CHANNEL_DEPTH));
    expect_disparities_and_depths(1);
}

static void test_a_chunk_is_read_without_the_others(void)
{
    struct shef_lcm_grid grid;
    int n_seen = 0;

    made_result_fill(result, 9, 0.3, &test_random);
    encode(SHEF_OUTPUT(SHEF_CHANNEL_DISPARITY), 1);
    (void)decode_chunks(SHEF_CHANNEL_DISPARITY, shef_lcm_decode_disparity);

    static float alone[WIDTH_PX * HEIGHT_PX];

    TEST_ASSERT_EQUAL(SHEF_LCM_OK, shef_lcm_decode_disparity(messages.all[1].bytes,
                                                             messages.all[1].n_bytes, &grid));
    memset(alone, 0, sizeof alone);
    shef_lcm_grid_images(&grid, alone, NULL);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++) {
            const bool is_ours = y >= grid.first_row && y < grid.first_row + grid.n_rows;

            n_seen += alone[y * WIDTH_PX + x] > 0.0f;
            TEST_ASSERT_EQUAL_FLOAT(is_ours ? first[y * WIDTH_PX + x] : 0.0f,
                                    alone[y * WIDTH_PX + x]);
        }
    TEST_ASSERT_EQUAL_INT(grid.n_points, n_seen);
    TEST_ASSERT_GREATER_THAN_INT(0, n_seen);
}

/* Sets exactly so many cells of the half grid, one pixel each. */
static void set_cells(int32_t n_cells)
{
    made_result_fill(result, 1, 0.0, &test_random);
    for (int32_t i = 0; i < n_cells; i++) {
        const int32_t cell = (int32_t)((int64_t)i * (320 * 240) / n_cells);
        const int32_t x = cell % 320 * 2, y = cell / 320 * 2;

        shef_row_f32(result->disparity, y)[x] = 10.0f;
        shef_row_f32(result->confidence, y)[x] = 0.5f;
        shef_row_f32(result->depth_m, y)[x] = 3.6f;
        shef_row_f32(result->sigma_m, y)[x] = 0.1f;
    }
}

static void test_the_half_grid_fits_one_datagram_up_to_36_percent(void)
{
    set_cells(320 * 240 * 36 / 100);
    encode(SHEF_OUTPUT(SHEF_CHANNEL_DISPARITY), 2);
    TEST_ASSERT_EQUAL_INT(1, messages.n);
    TEST_ASSERT_LESS_OR_EQUAL_size_t(SHEF_MESSAGE_MAX_BYTES, messages.all[0].n_bytes);

    set_cells(320 * 240 * 37 / 100);
    encode(SHEF_OUTPUT(SHEF_CHANNEL_DISPARITY), 2);
    TEST_ASSERT_EQUAL_INT(2, messages.n);
    TEST_ASSERT_EQUAL_INT32(
        240, decode_chunks(SHEF_CHANNEL_DISPARITY, shef_lcm_decode_disparity).grid_h);

    set_cells(320 * 240 * 24 / 100);
    encode(SHEF_OUTPUT(SHEF_CHANNEL_DEPTH), 2);
    TEST_ASSERT_EQUAL_INT(1, messages.n);
}

static void test_a_full_image_fits_the_chunks_too(void)
{
    made_result_fill(result, 1, 1.0, &test_random);
    encode(ALL, 1);
    expect_disparities_and_depths(1);
}

static void test_a_frame_without_any_depth_is_still_published(void)
{
    struct shef_lcm_cloud cloud;

    made_result_fill(result, 1, 0.0, &test_random);
    encode(ALL & ~SHEF_OUTPUT(SHEF_CHANNEL_DENSE), 2);
    TEST_ASSERT_EQUAL_INT(4, messages.n);
    TEST_ASSERT_EQUAL_INT32(
        0, decode_chunks(SHEF_CHANNEL_DISPARITY, shef_lcm_decode_disparity).n_points);
    TEST_ASSERT_EQUAL_INT32(0, decode_chunks(SHEF_CHANNEL_DEPTH, shef_lcm_decode_depth).n_points);
    TEST_ASSERT_EQUAL(
        SHEF_LCM_OK, shef_lcm_decode_cloud(messages.all[3].bytes, messages.all[3].n_bytes, &cloud));
    TEST_ASSERT_EQUAL_INT32(0, cloud.n_points);
}

static void test_dense_images_come_back(void)
{
    for (int32_t step = 1; step <= 2; step++) {
        int32_t n_set = 0;

        made_result_fill(result, 1, 0.1, &test_random);
        encode(SHEF_OUTPUT(SHEF_CHANNEL_DENSE), step);
        (void)decode_chunks(SHEF_CHANNEL_DENSE, shef_lcm_decode_dense);
        for (int32_t y = 0; y < HEIGHT_PX; y += step)
            for (int32_t x = 0; x < WIDTH_PX; x += step) {
                const int32_t cell = y / step * (WIDTH_PX / step) + x / step;
                const float disparity = shef_row_f32(result->dense_disparity, y)[x];

                n_set += disparity > 0.0f;
                TEST_ASSERT_FLOAT_WITHIN(1.0f / 64 + 1e-5f, disparity, first[cell]);
                if (disparity > 0.0f)
                    TEST_ASSERT_FLOAT_WITHIN(1.0f / 30 + 1e-5f,
                                             shef_row_f32(result->dense_confidence, y)[x],
                                             second[cell]);
            }
        TEST_ASSERT_GREATER_THAN_INT32(0, n_set);
    }
}

static void test_cloud_points_lie_where_the_pinhole_puts_them(void)
{
    int32_t n_points = 0;

    made_result_fill(result, 1, 0.2, &test_random);
    encode(SHEF_OUTPUT(SHEF_CHANNEL_CLOUD), 2);
    TEST_ASSERT_GREATER_THAN_INT(1, messages.n);
    for (int i = 0; i < messages.n; i++) {
        struct shef_lcm_cloud cloud;

        TEST_ASSERT_EQUAL(SHEF_LCM_OK, shef_lcm_decode_cloud(messages.all[i].bytes,
                                                             messages.all[i].n_bytes, &cloud));
        expect_header(&cloud.header);
        TEST_ASSERT_EQUAL_INT32(n_points, cloud.first_point);
        n_points += cloud.n_points;
        for (int32_t k = 0; k < cloud.n_points; k++) {
            const struct shef_lcm_point point = shef_lcm_cloud_point(&cloud, k);
            const double x = point.x_m / point.z_m * 555.0 + 319.5;
            const double y = point.y_m / point.z_m * 555.0 + 239.25;
            const int32_t px = (int32_t)lround(x), py = (int32_t)lround(y);

            TEST_ASSERT_DOUBLE_WITHIN(1e-3, px, x);
            TEST_ASSERT_DOUBLE_WITHIN(1e-3, py, y);
            TEST_ASSERT_EQUAL_FLOAT(shef_row_f32(result->depth_m, py)[px], point.z_m);
            TEST_ASSERT_FLOAT_WITHIN(1.0f / 509, shef_row_f32(result->confidence, py)[px],
                                     point.confidence);
            TEST_ASSERT_FLOAT_WITHIN(0.0011f, shef_row_f32(result->sigma_m, py)[px], point.sigma_m);
            TEST_ASSERT_EQUAL_UINT8((uint8_t)(px + py), point.grey);
        }
    }
    for (int32_t cell = 0; cell < 320 * 240; cell++)
        n_points -= best_pixel(cell % 320, cell / 320, 2) >= 0;
    TEST_ASSERT_EQUAL_INT32(0, n_points);
}

static void test_a_pose_is_published_only_if_it_is_valid(void)
{
    struct shef_lcm_pose pose;

    made_result_fill(result, 1, 0.0, &test_random);
    encode(SHEF_OUTPUT(SHEF_CHANNEL_POSE), 2);
    TEST_ASSERT_EQUAL(SHEF_LCM_OK,
                      shef_lcm_decode_pose(messages.all[0].bytes, messages.all[0].n_bytes, &pose));
    expect_header(&pose.header);
    TEST_ASSERT_EQUAL_INT32(1, pose.validity);
    TEST_ASSERT_EQUAL_DOUBLE(-0.2, pose.pos_m[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.5, pose.orientation_wxyz[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, -0.5, pose.orientation_wxyz[2]);
    TEST_ASSERT_EQUAL_DOUBLE(35e-6, pose.covariance[35]);

    result->pose.validity = SHEF_POSE_NO_SAMPLE;
    encode(SHEF_OUTPUT(SHEF_CHANNEL_POSE), 2);
    TEST_ASSERT_EQUAL(SHEF_LCM_OK,
                      shef_lcm_decode_pose(messages.all[0].bytes, messages.all[0].n_bytes, &pose));
    TEST_ASSERT_EQUAL_INT32(SHEF_POSE_NO_SAMPLE, pose.validity);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, pose.pos_m[1]);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, pose.orientation_wxyz[0]);
}

static void test_shed_work_is_left_out_and_tagged(void)
{
    made_result_fill(result, 1, 0.1, &test_random);
    result->shed_bits =
        SHEF_RESULT_SHED_DENSE | SHEF_RESULT_SHED_CLOUD | SHEF_RESULT_SHED_FULL_GRID;
    encode(ALL, 1);
    TEST_ASSERT_EQUAL_INT(0, made_messages_count(&messages, SHEF_CHANNEL_DENSE));
    TEST_ASSERT_EQUAL_INT(0, made_messages_count(&messages, SHEF_CHANNEL_CLOUD));
    TEST_ASSERT_EQUAL_INT32(
        2, decode_chunks(SHEF_CHANNEL_DISPARITY, shef_lcm_decode_disparity).grid_step);
}

static void test_a_status_comes_back(void)
{
    struct shef_publish_status status = {
        .state = "playing walk-1",
        .now = { 7000000123 },
        .utc_minus_mono_ns = 1000000000000000000,
        .event = { 4000 },
        .session_id = 77,
        .mode = 6,
        .n_events = UINT64_C(1) << 40,
        .n_frames = 5,
        .n_shed = 1,
        .n_unmatched = 2,
        .n_damaged = 3,
        .events_per_s = 1e7f,
        .frames_per_s = 54.0f,
        .cpu_cores = 0.5f,
        .memory_mib = 250,
        .shed_bits = SHEF_RESULT_SHED_CLOUD,
        .n_published = 4,
        .n_unpublished = 9,
        .backlog = 2,
        .complete_to_published_p50_ns = 6000000,
        .complete_to_published_p99_ns = 10000000,
        .mid_to_published_p50_ns = 11,
        .mid_to_published_p99_ns = 12,
    };
    struct shef_lcm_status read;

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_encoder_status(encoder, &status, 8, made_messages_keep, &messages));
    TEST_ASSERT_EQUAL(
        SHEF_LCM_OK, shef_lcm_decode_status(messages.all[0].bytes, messages.all[0].n_bytes, &read));
    TEST_ASSERT_EQUAL_STRING("playing walk-1", read.state);
    TEST_ASSERT_EQUAL_INT64(1000000007000000, read.header.utime_us);
    TEST_ASSERT_EQUAL_INT64(4, read.header.event_us);
    TEST_ASSERT_EQUAL_INT64(8, read.header.seq);
    TEST_ASSERT_EQUAL_INT64(INT64_C(1) << 40, read.n_events);
    TEST_ASSERT_EQUAL_INT64(5, read.n_frames);
    TEST_ASSERT_EQUAL_INT64(4, read.n_published);
    TEST_ASSERT_EQUAL_INT64(1, read.n_shed);
    TEST_ASSERT_EQUAL_INT64(2, read.n_unmatched);
    TEST_ASSERT_EQUAL_INT64(9, read.n_unpublished);
    TEST_ASSERT_EQUAL_INT64(3, read.n_damaged);
    TEST_ASSERT_EQUAL_FLOAT(54.0f, read.frames_per_s);
    TEST_ASSERT_EQUAL_INT32(250, read.memory_mib);
    TEST_ASSERT_EQUAL_INT32(2, read.backlog);
    TEST_ASSERT_EQUAL_INT64(12, read.mid_to_published_p99_ns);
}

/* LCM's fingerprint of a type comes from the names and types of its fields, not from its name. */
static void test_no_two_types_have_the_same_fingerprint(void)
{
    const int64_t types[] = {
        __shef_cloud_t_get_hash(),     __shef_dense_t_get_hash(),  __shef_depth_t_get_hash(),
        __shef_disparity_t_get_hash(), __shef_header_t_get_hash(), __shef_pose_t_get_hash(),
        __shef_status_t_get_hash(),
    };

    for (size_t i = 0; i < sizeof types / sizeof types[0]; i++)
        for (size_t k = 0; k < i; k++)
            TEST_ASSERT_NOT_EQUAL_INT64(types[i], types[k]);
}

static void test_the_generated_types_read_the_same(void)
{
    shef_disparity_t message;
    uint8_t crc_input[SHEF_MESSAGE_MAX_BYTES];

    made_result_fill(result, 3, 0.05, &test_random);
    encode(SHEF_OUTPUT(SHEF_CHANNEL_DISPARITY), 2);

    const struct made_message *sent = &messages.all[0];

    TEST_ASSERT_EQUAL_INT(sent->n_bytes,
                          shef_disparity_t_decode(sent->bytes, 0, (int)sent->n_bytes, &message));
    TEST_ASSERT_EQUAL_INT64(3, message.header.seq);
    TEST_ASSERT_EQUAL_INT32(2, message.grid_step);
    TEST_ASSERT_EQUAL_INT32(9600 + 2 * message.n_points, message.n);
    memcpy(crc_input, sent->bytes, sent->n_bytes);
    memset(crc_input + 104, 0, 4);
    TEST_ASSERT_EQUAL_HEX32(shef_crc32c(0, crc_input, sent->n_bytes),
                            (uint32_t)message.header.crc32c);
    TEST_ASSERT_EQUAL_INT(0, shef_disparity_t_decode_cleanup(&message));
}

static void test_the_same_result_gives_the_same_bytes(void)
{
    struct made_messages again = { 0 };

    made_result_fill(result, 3, 0.2, &test_random);
    encode(ALL, 1);
    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_encoder_result(encoder, result, ALL, 1, made_messages_keep, &again));
    TEST_ASSERT_EQUAL_INT(messages.n, again.n);
    for (int i = 0; i < messages.n; i++) {
        TEST_ASSERT_EQUAL_size_t(messages.all[i].n_bytes, again.all[i].n_bytes);
        TEST_ASSERT_EQUAL_MEMORY(messages.all[i].bytes, again.all[i].bytes,
                                 messages.all[i].n_bytes);
    }
    made_messages_free(&again);
}

static enum shef_err refuse_the_second(void *context, enum shef_channel channel,
                                       const uint8_t *bytes, size_t n_bytes, int64_t utime_us)
{
    int *n = context;

    (void)channel, (void)bytes, (void)n_bytes, (void)utime_us;
    return ++*n == 2 ? SHEF_ERR_IO : SHEF_OK;
}

static void test_a_message_that_is_not_taken_ends_the_rest(void)
{
    int n = 0;

    made_result_fill(result, 3, 0.2, &test_random);
    TEST_ASSERT_EQUAL(SHEF_ERR_IO,
                      shef_encoder_result(encoder, result, ALL, 1, refuse_the_second, &n));
    TEST_ASSERT_EQUAL_INT(2, n);
}

static void test_damaged_messages_are_refused(void)
{
    struct shef_lcm_grid grid = { 0 };
    struct shef_lcm_cloud cloud;

    made_result_fill(result, 3, 0.001, &test_random);
    encode(SHEF_OUTPUT(SHEF_CHANNEL_DEPTH), 2);

    uint8_t *bytes = messages.all[0].bytes;
    const size_t n_bytes = messages.all[0].n_bytes;

    for (size_t at_byte = 0; at_byte < n_bytes; at_byte += at_byte < 300 ? 1 : 97) {
        bytes[at_byte] ^= 0x10;
        TEST_ASSERT_EQUAL(at_byte < 8 ? SHEF_LCM_WRONG_TYPE : SHEF_LCM_WRONG_CRC,
                          shef_lcm_decode_depth(bytes, n_bytes, &grid));
        bytes[at_byte] ^= 0x10;
    }
    for (size_t n_left = 0; n_left < n_bytes; n_left += n_left < 300 ? 1 : 97)
        TEST_ASSERT_NOT_EQUAL(SHEF_LCM_OK, shef_lcm_decode_depth(bytes, n_left, &grid));
    TEST_ASSERT_EQUAL(SHEF_LCM_WRONG_TYPE, shef_lcm_decode_disparity(bytes, n_bytes, &grid));
    TEST_ASSERT_EQUAL(SHEF_LCM_WRONG_TYPE, shef_lcm_decode_cloud(bytes, n_bytes, &cloud));
    TEST_ASSERT_NULL(grid.values);
    TEST_ASSERT_EQUAL(SHEF_LCM_OK, shef_lcm_decode_depth(bytes, n_bytes, &grid));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_half_grid_comes_back_as_it_was_to_half_a_unit);
    RUN_TEST(test_full_resolution_comes_in_chunks_that_add_up);
    RUN_TEST(test_a_chunk_is_read_without_the_others);
    RUN_TEST(test_the_half_grid_fits_one_datagram_up_to_36_percent);
    RUN_TEST(test_a_full_image_fits_the_chunks_too);
    RUN_TEST(test_a_frame_without_any_depth_is_still_published);
    RUN_TEST(test_dense_images_come_back);
    RUN_TEST(test_cloud_points_lie_where_the_pinhole_puts_them);
    RUN_TEST(test_a_pose_is_published_only_if_it_is_valid);
    RUN_TEST(test_shed_work_is_left_out_and_tagged);
    RUN_TEST(test_a_status_comes_back);
    RUN_TEST(test_no_two_types_have_the_same_fingerprint);
    RUN_TEST(test_the_generated_types_read_the_same);
    RUN_TEST(test_the_same_result_gives_the_same_bytes);
    RUN_TEST(test_a_message_that_is_not_taken_ends_the_rest);
    RUN_TEST(test_damaged_messages_are_refused);
    return UNITY_END();
}
