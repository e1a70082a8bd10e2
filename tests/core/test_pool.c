#include "core/pool.h"

#include <pthread.h>
#include <sched.h>
#include <string.h>

#include "core/ring.h"
#include "support/support.h"

static struct shef_pool *pool;

void tearDown(void)
{
    shef_pool_destroy(pool);
    pool = NULL;
}

static void start(uint32_t n_buffers, uint32_t buffer_bytes)
{
    struct shef_error err = { 0 };

    pool = shef_pool_create(n_buffers, buffer_bytes, &err);
    TEST_ASSERT_NOT_NULL_MESSAGE(pool, err.text);
}

static void test_buffers_are_aligned_disjoint_and_as_large_as_asked(void)
{
    struct shef_buffer *buffers[3];

    start(3, 100);
    for (int i = 0; i < 3; i++) {
        buffers[i] = shef_pool_take(pool);
        TEST_ASSERT_NOT_NULL(buffers[i]);
        TEST_ASSERT_EQUAL_UINT32(100, buffers[i]->capacity_bytes);
        TEST_ASSERT_EQUAL_UINT32(0, buffers[i]->used_bytes);
        TEST_ASSERT_EQUAL_UINT64(0, (uintptr_t)buffers[i]->data % 64);
        memset(buffers[i]->data, i + 1, 100);
    }
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_EACH_EQUAL_UINT8(i + 1, buffers[i]->data, 100);
        shef_buffer_give(buffers[i]);
    }
}

static void test_an_exhausted_pool_refuses_and_counts(void)
{
    struct shef_buffer *first, *second;

    start(2, 8);
    first = shef_pool_take(pool);
    second = shef_pool_take(pool);
    TEST_ASSERT_EQUAL_UINT32(2, shef_pool_lent_count(pool));
    TEST_ASSERT_NULL(shef_pool_take(pool));
    TEST_ASSERT_NULL(shef_pool_take(pool));
    TEST_ASSERT_EQUAL_UINT64(2, shef_pool_refused_count(pool));
    shef_buffer_give(first);
    TEST_ASSERT_EQUAL_PTR(first, shef_pool_take(pool));
    TEST_ASSERT_EQUAL_UINT64(2, shef_pool_refused_count(pool));
    shef_buffer_give(second);
    shef_buffer_give(first);
    TEST_ASSERT_EQUAL_UINT32(0, shef_pool_lent_count(pool));
}

static void test_a_shared_buffer_returns_with_its_last_holder(void)
{
    struct shef_buffer *buffer;

    start(1, 8);
    buffer = shef_pool_take(pool);
    buffer->used_bytes = 5;
    shef_buffer_share(buffer);
    shef_buffer_share(buffer);
    shef_buffer_give(buffer);
    shef_buffer_give(buffer);
    TEST_ASSERT_NULL(shef_pool_take(pool));
    TEST_ASSERT_EQUAL_UINT32(5, buffer->used_bytes);
    shef_buffer_give(buffer);
    TEST_ASSERT_EQUAL_PTR(buffer, shef_pool_take(pool));
    TEST_ASSERT_EQUAL_UINT32(0, buffer->used_bytes);
    shef_buffer_give(buffer);
}

static void test_impossible_pools_are_refused_with_a_sentence(void)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_NULL(shef_pool_create(0, 8, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, err.code);
    TEST_ASSERT_NOT_NULL(strstr(err.text, "pool of 0 buffers"));
    TEST_ASSERT_NULL(shef_pool_create(8, 0, NULL));
    TEST_ASSERT_NULL(shef_pool_create(65537, 8, NULL));
    shef_pool_destroy(NULL);
}

#define N_RECEIVERS  3
#define N_BUFFERS    2u /* so few that each is soon taken again; also the rings' capacity */
#define N_ROUNDS     5000u
#define BUFFER_WORDS 16u

struct receiver {
    struct shef_ring ring;
    struct shef_buffer *slots[N_BUFFERS];
    uint32_t n_received;
    uint32_t n_wrong;
};

static void *receive(void *argument)
{
    struct receiver *receiver = argument;
    struct shef_buffer *buffer;
    uint32_t last = 0;

    for (;;) {
        uint32_t words[BUFFER_WORDS];

        if (shef_ring_pop(&receiver->ring, &buffer) != SHEF_OK) {
            sched_yield();
            continue;
        }
        if (!buffer)
            return NULL;
        memcpy(words, buffer->data, sizeof words);
        for (uint32_t i = 1; i < BUFFER_WORDS; i++)
            receiver->n_wrong += words[i] != words[0];
        receiver->n_wrong += words[0] <= last;
        last = words[0];
        receiver->n_received++;
        shef_buffer_give(buffer);
    }
}

static void send(struct receiver *receiver, struct shef_buffer *buffer)
{
    while (shef_ring_push(&receiver->ring, &buffer) != SHEF_OK)
        sched_yield();
}

/* The taker fills a buffer, lends it to three threads and gives up its own hold, over and over. */
static uint32_t send_rounds(struct receiver *receivers)
{
    uint32_t n_sent = 0;

    for (uint32_t round = 1; round <= N_ROUNDS; round++) {
        struct shef_buffer *buffer = shef_pool_take(pool);

        if (!buffer) {
            sched_yield();
            continue;
        }
        for (uint32_t i = 0; i < BUFFER_WORDS; i++)
            memcpy(buffer->data + 4 * i, &round, 4);
        for (int i = 0; i < N_RECEIVERS; i++) {
            shef_buffer_share(buffer);
            send(&receivers[i], buffer);
        }
        shef_buffer_give(buffer);
        n_sent++;
    }
    return n_sent;
}

static void test_buffers_shared_by_threads_stay_whole_and_all_come_back(void)
{
    static struct receiver receivers[N_RECEIVERS];
    pthread_t threads[N_RECEIVERS];

    start(N_BUFFERS, BUFFER_WORDS * 4);
    for (int i = 0; i < N_RECEIVERS; i++) {
        shef_ring_init(&receivers[i].ring, receivers[i].slots, sizeof(struct shef_buffer *),
                       N_BUFFERS);
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&threads[i], NULL, receive, &receivers[i]));
    }

    const uint32_t n_sent = send_rounds(receivers);

    for (int i = 0; i < N_RECEIVERS; i++) {
        send(&receivers[i], NULL);
        pthread_join(threads[i], NULL);
        TEST_ASSERT_EQUAL_UINT32(n_sent, receivers[i].n_received);
        TEST_ASSERT_EQUAL_UINT32(0, receivers[i].n_wrong);
    }
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(N_BUFFERS, n_sent);
    TEST_ASSERT_EQUAL_UINT64(N_ROUNDS - n_sent, shef_pool_refused_count(pool));
    TEST_ASSERT_EQUAL_UINT32(0, shef_pool_lent_count(pool));

    struct shef_buffer *all[N_BUFFERS];

    for (uint32_t i = 0; i < N_BUFFERS; i++) {
        all[i] = shef_pool_take(pool);
        TEST_ASSERT_NOT_NULL(all[i]);
        for (uint32_t j = 0; j < i; j++)
            TEST_ASSERT_TRUE(all[j] != all[i]);
    }
    TEST_ASSERT_NULL(shef_pool_take(pool));
    for (uint32_t i = 0; i < N_BUFFERS; i++)
        shef_buffer_give(all[i]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_buffers_are_aligned_disjoint_and_as_large_as_asked);
    RUN_TEST(test_an_exhausted_pool_refuses_and_counts);
    RUN_TEST(test_a_shared_buffer_returns_with_its_last_holder);
    RUN_TEST(test_impossible_pools_are_refused_with_a_sentence);
    RUN_TEST(test_buffers_shared_by_threads_stay_whole_and_all_come_back);
    return UNITY_END();
}
