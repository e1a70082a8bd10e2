#include "service/pace.h"

#include <pthread.h>
#include <unistd.h>

#include "core/ring.h"
#include "service/push.h"
#include "support/support.h"

static struct shef_wake wakes[SHEF_PACE_SOURCES];
static struct shef_pace pace;

static void begin(enum shef_config_pace kind, const struct shef_clock *clock)
{
    struct shef_error err;

    shef_pace_init(&pace, kind, clock);
    for (int i = 0; i < SHEF_PACE_SOURCES; i++) {
        TEST_ASSERT_EQUAL(SHEF_OK, shef_wake_init(&wakes[i], &err));
        pace.wakes[i] = &wakes[i];
    }
}

static void end(void)
{
    for (int i = 0; i < SHEF_PACE_SOURCES; i++)
        shef_wake_deinit(&wakes[i]);
}

/* One item of a source, on a thread of its own. */
struct turn {
    pthread_t thread;
    enum shef_pace_source source;
    int64_t arrived_ns;
    bool went;
};

static void *wait_for_turn(void *context)
{
    struct turn *turn = context;

    turn->went = shef_pace_wait(&pace, turn->source, (shef_host_time){ turn->arrived_ns });
    return NULL;
}

static void start(struct turn *turn)
{
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&turn->thread, NULL, wait_for_turn, turn));
}

static void test_at_recorded_pace_an_item_that_is_due_goes_at_once(void)
{
    struct shef_manual_clock clock;

    shef_manual_clock_init(&clock, (shef_host_time){ 5000 });
    begin(SHEF_PACE_RECORDED, &clock.clock);
    pace.host_shift_ns = 1000;
    TEST_ASSERT_TRUE(shef_pace_wait(&pace, SHEF_PACE_FRAMES, (shef_host_time){ 4000 }));
    TEST_ASSERT_FALSE(shef_pace_is_idle(&pace, SHEF_PACE_FRAMES));
    end();
}

static void test_whoever_waits_for_the_clock_is_idle_and_leaves_when_told_to_stop(void)
{
    struct turn turn = { .source = SHEF_PACE_EVENTS, .arrived_ns = INT64_MAX / 2 };

    begin(SHEF_PACE_RECORDED, shef_clock_monotonic());
    TEST_ASSERT_FALSE(shef_pace_is_idle(&pace, SHEF_PACE_EVENTS));
    start(&turn);
    while (!shef_pace_is_idle(&pace, SHEF_PACE_EVENTS))
        usleep(100);
    shef_pace_stop(&pace);
    pthread_join(turn.thread, NULL);
    TEST_ASSERT_FALSE(turn.went);
    end();
}

static void test_stepped_sources_take_turns_in_the_order_of_arrival(void)
{
    struct turn frame = { .source = SHEF_PACE_FRAMES, .arrived_ns = 10 };
    struct turn events = { .source = SHEF_PACE_EVENTS, .arrived_ns = 10 };

    begin(SHEF_PACE_STEPPED, shef_clock_monotonic());
    shef_pace_ended(&pace, SHEF_PACE_POSES);
    TEST_ASSERT_TRUE(shef_pace_is_idle(&pace, SHEF_PACE_POSES));
    start(&events);
    start(&frame);
    /* Of two at the same time the frame goes first; the events only once it has been dealt with. */
    pthread_join(frame.thread, NULL);
    TEST_ASSERT_TRUE(frame.went);
    TEST_ASSERT_FALSE(shef_pace_is_idle(&pace, SHEF_PACE_EVENTS));
    shef_pace_begun(&pace);
    shef_pace_went(&pace, SHEF_PACE_FRAMES);
    shef_pace_ended(&pace, SHEF_PACE_FRAMES);
    TEST_ASSERT_EQUAL_INT64(10, atomic_load(&pace.next_ns[SHEF_PACE_EVENTS]));
    shef_pace_done(&pace);
    pthread_join(events.thread, NULL);
    TEST_ASSERT_TRUE(events.went);
    end();
}

/* ---- handing on ------------------------------------------------------------------------- */

static struct shef_wake consumer = { .fd = -1 };
static uint32_t slots[2];
static struct shef_link link_;

static void make_link(void)
{
    struct shef_error err;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_wake_init(&consumer, &err));
    link_ = (struct shef_link){ .row = { .capacity = 2, .slot_bytes = sizeof slots[0] },
                                .wake = &consumer };
    shef_ring_init(&link_.ring, slots, sizeof slots[0], 2);
}

static void *take_one_later(void *context)
{
    uint32_t item;

    (void)context;
    usleep(20000);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_link_pop(&link_, &item));
    return NULL;
}

static void test_with_a_clock_a_full_ring_refuses_and_nothing_is_under_way(void)
{
    begin(SHEF_PACE_RECORDED, shef_clock_monotonic());
    make_link();
    for (uint32_t i = 0; i < 2; i++)
        TEST_ASSERT_TRUE(shef_push_in_time(&link_, &i, &pace, &wakes[0]));
    TEST_ASSERT_FALSE(shef_push_in_time(&link_, &(uint32_t){ 2 }, &pace, &wakes[0]));
    TEST_ASSERT_EQUAL_INT32(2, shef_pace_under_way(&pace));
    TEST_ASSERT_EQUAL_UINT64(1, atomic_load(&link_.n_lost));
    shef_wake_deinit(&consumer);
    end();
}

static void test_without_a_clock_nothing_is_lost_at_a_full_ring(void)
{
    pthread_t taker;
    uint32_t item;

    begin(SHEF_PACE_STEPPED, shef_clock_monotonic());
    make_link();
    for (uint32_t i = 0; i < 2; i++)
        TEST_ASSERT_TRUE(shef_push_in_time(&link_, &i, &pace, &wakes[0]));
    TEST_ASSERT_EQUAL_INT(0, pthread_create(&taker, NULL, take_one_later, NULL));
    TEST_ASSERT_TRUE(shef_push_in_time(&link_, &(uint32_t){ 2 }, &pace, &wakes[0]));
    pthread_join(taker, NULL);
    for (uint32_t i = 1; i < 3; i++) {
        TEST_ASSERT_EQUAL(SHEF_OK, shef_link_pop(&link_, &item));
        TEST_ASSERT_EQUAL_UINT32(i, item);
    }
    TEST_ASSERT_EQUAL_UINT64(0, atomic_load(&link_.n_lost));
    shef_wake_deinit(&consumer);
    end();
}

static void test_whoever_waits_for_room_leaves_when_told_to_stop(void)
{
    begin(SHEF_PACE_RECORDED, shef_clock_monotonic());
    make_link();
    for (uint32_t i = 0; i < 2; i++)
        TEST_ASSERT_TRUE(shef_push_surely(&link_, &i, &pace, &wakes[0]));
    shef_pace_stop(&pace);
    TEST_ASSERT_FALSE(shef_push_surely(&link_, &(uint32_t){ 2 }, &pace, &wakes[0]));
    TEST_ASSERT_EQUAL_INT32(2, shef_pace_under_way(&pace));
    TEST_ASSERT_EQUAL_UINT64(0, atomic_load(&link_.n_lost));
    shef_wake_deinit(&consumer);
    end();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_at_recorded_pace_an_item_that_is_due_goes_at_once);
    RUN_TEST(test_whoever_waits_for_the_clock_is_idle_and_leaves_when_told_to_stop);
    RUN_TEST(test_stepped_sources_take_turns_in_the_order_of_arrival);
    RUN_TEST(test_with_a_clock_a_full_ring_refuses_and_nothing_is_under_way);
    RUN_TEST(test_without_a_clock_nothing_is_lost_at_a_full_ring);
    RUN_TEST(test_whoever_waits_for_room_leaves_when_told_to_stop);
    return UNITY_END();
}
