#include "core/ring.h"

#include <pthread.h>
#include <sched.h>
#include <string.h>

#include "support/support.h"

#define CAPACITY 8u

static uint32_t slots[CAPACITY];
static struct shef_ring ring;

void setUp(void)
{
    shef_ring_init(&ring, slots, sizeof slots[0], CAPACITY);
}

static void push(uint32_t item)
{
    TEST_ASSERT_EQUAL(SHEF_OK, shef_ring_push(&ring, &item));
}

static void expect_pop(uint32_t expected)
{
    uint32_t seen = ~expected;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_ring_pop(&ring, &seen));
    TEST_ASSERT_EQUAL_UINT32(expected, seen);
}

static void test_an_empty_ring_gives_nothing_and_leaves_the_target_alone(void)
{
    uint32_t seen = 77;

    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_ring_pop(&ring, &seen));
    TEST_ASSERT_EQUAL_UINT32(77, seen);
    TEST_ASSERT_EQUAL_UINT32(0, shef_ring_count(&ring));
}

static void test_items_come_out_in_the_order_they_went_in(void)
{
    for (uint32_t i = 0; i < 3; i++)
        push(i);
    TEST_ASSERT_EQUAL_UINT32(3, shef_ring_count(&ring));
    for (uint32_t i = 0; i < 3; i++)
        expect_pop(i);
    TEST_ASSERT_EQUAL_UINT32(0, shef_ring_count(&ring));
}

static void test_full_ring_refuses_and_keeps_what_it_has(void)
{
    for (uint32_t i = 0; i < CAPACITY; i++)
        push(i);
    TEST_ASSERT_EQUAL(SHEF_ERR_FULL, shef_ring_push(&ring, &(uint32_t){ 99 }));
    TEST_ASSERT_EQUAL_UINT32(CAPACITY, shef_ring_count(&ring));
    for (uint32_t i = 0; i < CAPACITY; i++)
        expect_pop(i);
}

static void test_the_indices_wrap_at_the_end_of_their_range(void)
{
    atomic_store(&ring.head, UINT32_MAX - 2);
    atomic_store(&ring.tail, UINT32_MAX - 2);
    for (uint32_t i = 0; i < CAPACITY; i++)
        push(i);
    TEST_ASSERT_EQUAL(SHEF_ERR_FULL, shef_ring_push(&ring, &(uint32_t){ 99 }));
    TEST_ASSERT_EQUAL_UINT32(CAPACITY, shef_ring_count(&ring));
    for (uint32_t i = 0; i < CAPACITY; i++)
        expect_pop(i);
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_ring_pop(&ring, &(uint32_t){ 0 }));
}

static void test_a_ring_of_one_slot_alternates(void)
{
    shef_ring_init(&ring, slots, sizeof slots[0], 1);
    for (uint32_t i = 0; i < 5; i++) {
        push(i);
        TEST_ASSERT_EQUAL(SHEF_ERR_FULL, shef_ring_push(&ring, &i));
        expect_pop(i);
    }
}

static void test_a_slot_may_have_any_size(void)
{
    uint8_t bytes[4 * 13];
    uint8_t item[13], seen[13];

    shef_ring_init(&ring, bytes, 13, 4);
    for (uint8_t i = 0; i < 11; i++) {
        memset(item, i, sizeof item);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_ring_push(&ring, item));
        TEST_ASSERT_EQUAL(SHEF_OK, shef_ring_pop(&ring, seen));
        TEST_ASSERT_EQUAL_MEMORY(item, seen, sizeof item);
    }
}

/* Three equal words: an item seen half-written would differ from itself. */
struct item {
    uint32_t words[3];
};

#define N_ITEMS 20000u

struct producer {
    struct shef_ring ring;
    struct item slots[CAPACITY];
    uint32_t n_lost;
};

static void *produce(void *argument)
{
    struct producer *producer = argument;

    for (uint32_t i = 1; i <= N_ITEMS; i++) {
        const struct item item = { { i, i, i } };

        if (shef_ring_push(&producer->ring, &item) != SHEF_OK) {
            producer->n_lost++;
            sched_yield();
        }
    }
    /* The end must not get lost. */
    while (shef_ring_push(&producer->ring, &(struct item){ { 0 } }) != SHEF_OK)
        sched_yield();
    return NULL;
}

static void test_between_two_threads_nothing_is_torn_reordered_or_lost_uncounted(void)
{
    static struct producer producer;
    pthread_t thread;
    uint32_t n_seen = 0, last = 0;

    shef_ring_init(&producer.ring, producer.slots, sizeof producer.slots[0], CAPACITY);
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&thread, NULL, produce, &producer));
    for (;;) {
        struct item item;

        if (shef_ring_pop(&producer.ring, &item) != SHEF_OK) {
            sched_yield();
            continue;
        }
        TEST_ASSERT_EQUAL_UINT32(item.words[0], item.words[1]);
        TEST_ASSERT_EQUAL_UINT32(item.words[0], item.words[2]);
        TEST_ASSERT_TRUE(shef_ring_count(&producer.ring) <= CAPACITY);
        if (item.words[0] == 0)
            break;
        TEST_ASSERT_GREATER_THAN_UINT32(last, item.words[0]);
        last = item.words[0];
        n_seen++;
    }
    pthread_join(thread, NULL);
    TEST_ASSERT_EQUAL_UINT32(N_ITEMS, n_seen + producer.n_lost);
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(CAPACITY, n_seen);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_an_empty_ring_gives_nothing_and_leaves_the_target_alone);
    RUN_TEST(test_items_come_out_in_the_order_they_went_in);
    RUN_TEST(test_full_ring_refuses_and_keeps_what_it_has);
    RUN_TEST(test_the_indices_wrap_at_the_end_of_their_range);
    RUN_TEST(test_a_ring_of_one_slot_alternates);
    RUN_TEST(test_a_slot_may_have_any_size);
    RUN_TEST(test_between_two_threads_nothing_is_torn_reordered_or_lost_uncounted);
    return UNITY_END();
}
