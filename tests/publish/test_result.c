#include "publish/result.h"

#include "support/support.h"

#define WIDTH_PX  70
#define HEIGHT_PX 9

static struct shef_result_pool *pool;
static struct shef_error err;

void tearDown(void)
{
    shef_result_pool_destroy(pool);
    pool = NULL;
}

static void start(uint32_t n_results, uint32_t n_dense)
{
    pool = shef_result_pool_create(n_results, WIDTH_PX, HEIGHT_PX, n_dense, &err);
    TEST_ASSERT_NOT_NULL_MESSAGE(pool, err.text);
}

static void fill(struct shef_image_f32 image, float value)
{
    TEST_ASSERT_EQUAL_INT32(WIDTH_PX, image.width_px);
    TEST_ASSERT_EQUAL_INT32(HEIGHT_PX, image.height_px);
    TEST_ASSERT_EQUAL_UINT64(0, (uintptr_t)image.data % 64);
    TEST_ASSERT_EQUAL_INT64(0, image.stride_bytes % 64);
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++)
            shef_row_f32(image, y)[x] = value;
}

static void expect(struct shef_image_f32 image, float value)
{
    for (int32_t y = 0; y < HEIGHT_PX; y++)
        for (int32_t x = 0; x < WIDTH_PX; x++)
            TEST_ASSERT_EQUAL_FLOAT(value, shef_row_f32(image, y)[x]);
}

static void test_images_of_all_results_are_disjoint_and_aligned(void)
{
    struct shef_result *results[3];

    start(3, 3);
    for (int i = 0; i < 3; i++) {
        results[i] = shef_result_take(pool);
        TEST_ASSERT_NOT_NULL(results[i]);
        fill(results[i]->disparity, 10.0f * i + 1);
        fill(results[i]->confidence, 10.0f * i + 2);
        fill(results[i]->depth_m, 10.0f * i + 3);
        fill(results[i]->sigma_m, 10.0f * i + 4);
        fill(results[i]->dense_disparity, 10.0f * i + 5);
        fill(results[i]->dense_confidence, 10.0f * i + 6);
        for (int32_t y = 0; y < HEIGHT_PX; y++)
            for (int32_t x = 0; x < WIDTH_PX; x++)
                shef_row_u8(results[i]->picture, y)[x] = (uint8_t)(i + 1);
        results[i]->seq = (uint64_t)i;
    }
    for (int i = 0; i < 3; i++) {
        expect(results[i]->disparity, 10.0f * i + 1);
        expect(results[i]->confidence, 10.0f * i + 2);
        expect(results[i]->depth_m, 10.0f * i + 3);
        expect(results[i]->sigma_m, 10.0f * i + 4);
        expect(results[i]->dense_disparity, 10.0f * i + 5);
        expect(results[i]->dense_confidence, 10.0f * i + 6);
        for (int32_t y = 0; y < HEIGHT_PX; y++)
            TEST_ASSERT_EACH_EQUAL_UINT8(i + 1, shef_row_u8(results[i]->picture, y), WIDTH_PX);
        TEST_ASSERT_EQUAL_UINT64(i, results[i]->seq);
        shef_result_give(results[i]);
    }
}

static void test_a_result_comes_back_after_its_last_holder_and_starts_from_zero(void)
{
    start(1, 0);

    struct shef_result *result = shef_result_take(pool);

    TEST_ASSERT_NOT_NULL(result);
    TEST_ASSERT_NULL(result->dense_disparity.data);
    TEST_ASSERT_NULL(result->dense_confidence.data);
    result->seq = 7;
    result->pose.validity = SHEF_POSE_NO_SAMPLE;
    result->stage_ns[SHEF_RESULT_STAGES - 1] = 5;
    shef_result_share(result);
    shef_result_give(result);
    TEST_ASSERT_EQUAL_UINT32(1, shef_result_pool_lent_count(pool));
    TEST_ASSERT_NULL(shef_result_take(pool));
    TEST_ASSERT_EQUAL_UINT64(1, shef_result_pool_refused_count(pool));
    shef_result_give(result);
    TEST_ASSERT_EQUAL_UINT32(0, shef_result_pool_lent_count(pool));

    result = shef_result_take(pool);
    TEST_ASSERT_NOT_NULL(result);
    TEST_ASSERT_EQUAL_UINT64(0, result->seq);
    TEST_ASSERT_EQUAL(SHEF_POSE_NO_SOURCE, result->pose.validity);
    TEST_ASSERT_EQUAL_INT64(0, result->stage_ns[SHEF_RESULT_STAGES - 1]);
    TEST_ASSERT_NOT_NULL(result->disparity.data);
    shef_result_give(result);
}

static void test_dense_images_go_to_the_first_who_come_and_come_back_with_their_result(void)
{
    start(3, 1);

    struct shef_result *first = shef_result_take(pool);
    struct shef_result *second = shef_result_take(pool);

    TEST_ASSERT_NOT_NULL(first->dense_disparity.data);
    TEST_ASSERT_NOT_NULL(first->dense_confidence.data);
    TEST_ASSERT_NULL(second->dense_disparity.data);
    TEST_ASSERT_NULL(second->dense_confidence.data);
    fill(second->sigma_m, 1.0f);
    fill(first->dense_confidence, 2.0f);
    expect(second->sigma_m, 1.0f);

    shef_result_share(first);
    shef_result_give(first);
    shef_result_give(second);
    second = shef_result_take(pool);
    TEST_ASSERT_NULL(second->dense_disparity.data);
    shef_result_give(first);
    first = shef_result_take(pool);
    TEST_ASSERT_NOT_NULL(first->dense_disparity.data);
    shef_result_give(first);
    shef_result_give(second);
}

static void test_impossible_pools_are_refused_with_a_sentence(void)
{
    TEST_ASSERT_NULL(shef_result_pool_create(0, 640, 480, 0, &err));
    TEST_ASSERT_EQUAL_STRING("pool of 0 results of 640x480 px: 1 to 64 are possible, of 1 to 16384 "
                             "px a side",
                             err.text);
    TEST_ASSERT_NULL(shef_result_pool_create(65, 640, 480, 0, &err));
    TEST_ASSERT_NULL(shef_result_pool_create(1, 0, 480, 0, &err));
    TEST_ASSERT_NULL(shef_result_pool_create(1, 640, 16385, 0, &err));
    TEST_ASSERT_NULL(shef_result_pool_create(1, 16384, 16384, 1, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, err.code);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_images_of_all_results_are_disjoint_and_aligned);
    RUN_TEST(test_a_result_comes_back_after_its_last_holder_and_starts_from_zero);
    RUN_TEST(test_dense_images_go_to_the_first_who_come_and_come_back_with_their_result);
    RUN_TEST(test_impossible_pools_are_refused_with_a_sentence);
    return UNITY_END();
}
