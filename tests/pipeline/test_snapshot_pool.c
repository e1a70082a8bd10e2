#include "pipeline/snapshot_pool.h"

#include <pthread.h>
#include <sched.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <string.h>

#include "support/support.h"

#define N_SLOTS 4

static struct shef_snapshot_pool *pool;

void tearDown(void)
{
    shef_snapshot_pool_destroy(pool);
    pool = NULL;
}

static void start(void)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_snapshot_pool_create(&pool, N_SLOTS, 20, 3, &err),
                              err.text);
}

static void fill(struct shef_snapshot *snapshot, uint64_t number)
{
    snapshot->number = number;
    snapshot->mid = (shef_event_time){ (int64_t)number * 1000 };
    for (int y = 0; y < 3; y++)
        for (int x = 0; x < 20; x++) {
            shef_row_i16(snapshot->values, y)[x] = (int16_t)number;
            shef_row_i16(snapshot->sums, y)[x] = (int16_t)-number;
        }
}

static bool publish(uint64_t number)
{
    struct shef_image_i16 scratch;
    struct shef_snapshot *snapshot = shef_snapshot_pool_begin(pool, &scratch);

    if (!snapshot)
        return false;
    fill(snapshot, number);
    shef_snapshot_pool_publish(pool, snapshot);
    return true;
}

static const struct shef_snapshot *take(uint64_t number)
{
    const struct shef_snapshot *snapshot = NULL;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_snapshot_pool_take(pool, number, &snapshot));
    TEST_ASSERT_EQUAL_UINT64(number, snapshot->number);
    TEST_ASSERT_EQUAL_INT16((int16_t)number, shef_row_i16(snapshot->values, 2)[19]);
    return snapshot;
}

static void expect_not_there(enum shef_err reason, uint64_t number)
{
    const struct shef_snapshot *snapshot = NULL;

    TEST_ASSERT_EQUAL(reason, shef_snapshot_pool_take(pool, number, &snapshot));
    TEST_ASSERT_NULL(snapshot);
}

static void test_the_newest_four_can_be_taken_by_number_and_older_ones_are_gone(void)
{
    start();
    TEST_ASSERT_EQUAL_UINT64(0, shef_snapshot_pool_end(pool));
    expect_not_there(SHEF_ERR_EMPTY, 0);
    for (uint64_t number = 0; number < 10; number++) {
        TEST_ASSERT_TRUE(publish(number));
        TEST_ASSERT_EQUAL_UINT64(number + 1, shef_snapshot_pool_end(pool));
        expect_not_there(SHEF_ERR_EMPTY, number + 1);
    }
    for (uint64_t number = 0; number < 6; number++)
        expect_not_there(SHEF_ERR_GONE, number);
    for (uint64_t number = 6; number < 10; number++)
        shef_snapshot_pool_give(pool, take(number));
    TEST_ASSERT_EQUAL_UINT64(0, shef_snapshot_pool_lost_count(pool));
}

static void test_a_number_that_was_never_published_is_gone(void)
{
    start();
    TEST_ASSERT_TRUE(publish(0));
    TEST_ASSERT_TRUE(publish(2));
    expect_not_there(SHEF_ERR_GONE, 1);
    expect_not_there(SHEF_ERR_EMPTY, 3);
}

static void test_a_held_snapshot_stays_as_it_is_until_its_last_holder_gives_it(void)
{
    const struct shef_snapshot *held;

    start();
    publish(0);
    held = take(0);
    TEST_ASSERT_EQUAL_PTR(held, take(0));
    for (uint64_t number = 1; number < 20; number++)
        TEST_ASSERT_TRUE(publish(number));
    TEST_ASSERT_EQUAL_INT16(0, shef_row_i16(held->values, 0)[0]);
    shef_snapshot_pool_give(pool, held);
    publish(20);
    TEST_ASSERT_EQUAL_PTR(held, take(0));
    shef_snapshot_pool_give(pool, held);
    shef_snapshot_pool_give(pool, held);
    publish(21);
    expect_not_there(SHEF_ERR_GONE, 0);
}

static void test_a_pool_without_a_free_snapshot_loses_the_new_one_and_counts_it(void)
{
    const struct shef_snapshot *held[N_SLOTS];

    start();
    for (uint64_t number = 0; number < N_SLOTS; number++) {
        publish(number);
        held[number] = take(number);
    }
    TEST_ASSERT_FALSE(publish(4));
    TEST_ASSERT_FALSE(publish(5));
    TEST_ASSERT_EQUAL_UINT64(2, shef_snapshot_pool_lost_count(pool));
    shef_snapshot_pool_give(pool, held[2]);
    TEST_ASSERT_TRUE(publish(6));
    expect_not_there(SHEF_ERR_GONE, 2);
    expect_not_there(SHEF_ERR_GONE, 5);
    shef_snapshot_pool_give(pool, take(6));
    for (int i = 0; i < N_SLOTS; i++)
        if (i != 2)
            shef_snapshot_pool_give(pool, held[i]);
}

static void test_several_can_be_filled_at_once_and_cancelled(void)
{
    struct shef_image_i16 scratches[2];
    struct shef_snapshot *first;
    struct shef_snapshot *second;

    start();
    first = shef_snapshot_pool_begin(pool, &scratches[0]);
    second = shef_snapshot_pool_begin(pool, &scratches[1]);
    TEST_ASSERT_TRUE(first && second && first != second);
    TEST_ASSERT_TRUE(scratches[0].data != scratches[1].data);
    fill(first, 0);
    fill(second, 1);
    shef_snapshot_pool_cancel(pool, first);
    shef_snapshot_pool_publish(pool, second);
    expect_not_there(SHEF_ERR_GONE, 0);
    shef_snapshot_pool_give(pool, take(1));
    for (uint64_t number = 2; number < 2 + N_SLOTS - 1; number++)
        publish(number);
    shef_snapshot_pool_give(pool, take(1)); /* the cancelled one was reused first */
}

static void test_no_more_than_declared_are_filled_at_once(void)
{
    struct shef_snapshot *filling[SHEF_SNAPSHOT_MAX_FILLING];
    struct shef_image_i16 scratch;

    TEST_ASSERT_EQUAL(SHEF_OK,
                      shef_snapshot_pool_create(&pool, SHEF_SNAPSHOT_MAX_FILLING + 2, 20, 3, NULL));
    for (int i = 0; i < SHEF_SNAPSHOT_MAX_FILLING; i++) {
        filling[i] = shef_snapshot_pool_begin(pool, &scratch);
        TEST_ASSERT_NOT_NULL(filling[i]);
        fill(filling[i], (uint64_t)i);
    }
    TEST_ASSERT_NULL(shef_snapshot_pool_begin(pool, &scratch));
    TEST_ASSERT_EQUAL_UINT64(1, shef_snapshot_pool_lost_count(pool));
    shef_snapshot_pool_publish(pool, filling[0]);
    TEST_ASSERT_TRUE(publish(SHEF_SNAPSHOT_MAX_FILLING));
    for (int i = 1; i < SHEF_SNAPSHOT_MAX_FILLING; i++)
        shef_snapshot_pool_cancel(pool, filling[i]);
}

static _Atomic bool is_over;

struct reader {
    _Atomic uint64_t n_read;
    const char *complaint;
};

/* Takes the newest ones over and over; a snapshot that changed under it has mixed content. */
static void *read_newest(void *context)
{
    struct reader *reader = context;

    while (!atomic_load(&is_over)) {
        const uint64_t end = shef_snapshot_pool_end(pool);
        const struct shef_snapshot *snapshot;

        for (uint64_t number = end > 6 ? end - 6 : 0; number < end; number++) {
            if (shef_snapshot_pool_take(pool, number, &snapshot) != SHEF_OK)
                continue;
            if (snapshot->number != number || snapshot->mid.ns != (int64_t)number * 1000)
                reader->complaint = "a snapshot under another's number";
            for (int y = 0; y < 3; y++)
                for (int x = 0; x < 20; x++)
                    if (shef_row_i16(snapshot->values, y)[x] != (int16_t)number ||
                        shef_row_i16(snapshot->sums, y)[x] != (int16_t)-number)
                        reader->complaint = "a snapshot that changed while it was held";
            shef_snapshot_pool_give(pool, snapshot);
            atomic_fetch_add(&reader->n_read, 1);
        }
    }
    return NULL;
}

static void test_readers_see_whole_snapshots_while_the_writer_goes_on(void)
{
    pthread_t threads[2];
    struct reader readers[2] = { 0 };
    uint64_t n_published = 0;
    uint64_t n_tried = 0;

    start();
    atomic_store(&is_over, false);
    for (int i = 0; i < 2; i++)
        TEST_ASSERT_EQUAL_INT(0, pthread_create(&threads[i], NULL, read_newest, &readers[i]));
    /* However the threads are scheduled, all three get something done. */
    for (; n_published < 1000 || atomic_load(&readers[0].n_read) < 2000 ||
           atomic_load(&readers[1].n_read) < 2000;
         n_tried++) {
        n_published += publish(n_tried);
        if (n_tried % 8 == 0)
            sched_yield();
    }
    atomic_store(&is_over, true);
    for (int i = 0; i < 2; i++) {
        pthread_join(threads[i], NULL);
        TEST_ASSERT_NULL_MESSAGE(readers[i].complaint, readers[i].complaint);
    }
    TEST_ASSERT_EQUAL_UINT64(n_tried, n_published + shef_snapshot_pool_lost_count(pool));
}

static void test_impossible_sizes_are_refused_with_a_sentence(void)
{
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_snapshot_pool_create(&pool, 3, 20, 3, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "must be 4 to 64"));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_snapshot_pool_create(&pool, 65, 20, 3, NULL));
    TEST_ASSERT_NULL(pool);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_newest_four_can_be_taken_by_number_and_older_ones_are_gone);
    RUN_TEST(test_a_number_that_was_never_published_is_gone);
    RUN_TEST(test_a_held_snapshot_stays_as_it_is_until_its_last_holder_gives_it);
    RUN_TEST(test_a_pool_without_a_free_snapshot_loses_the_new_one_and_counts_it);
    RUN_TEST(test_several_can_be_filled_at_once_and_cancelled);
    RUN_TEST(test_no_more_than_declared_are_filled_at_once);
    RUN_TEST(test_readers_see_whole_snapshots_while_the_writer_goes_on);
    RUN_TEST(test_impossible_sizes_are_refused_with_a_sentence);
    return UNITY_END();
}
