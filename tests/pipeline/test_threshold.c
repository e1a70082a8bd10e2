#include "pipeline/threshold.h"

#include "support/support.h"

struct values {
    int32_t answer; /* the highest that leaves enough */
    int32_t n_looks;
};

static bool leaves_enough(const void *context, int32_t threshold)
{
    struct values *values = (struct values *)(uintptr_t)context;

    values->n_looks++;
    return threshold <= values->answer;
}

static int32_t look(struct values *values, int32_t floor, int32_t end, int32_t guess)
{
    values->n_looks = 0;
    return shef_threshold_highest(floor, end, guess, leaves_enough, values);
}

static void test_the_guess_never_changes_the_answer(void)
{
    for (int32_t floor = 0; floor <= 3; floor++)
        for (int32_t end = floor + 1; end <= floor + 40; end++)
            for (int32_t answer = floor; answer < end; answer++)
                for (int32_t guess = -2; guess <= end + 2; guess++) {
                    struct values values = { .answer = answer };

                    TEST_ASSERT_EQUAL_INT32(answer, look(&values, floor, end, guess));
                }
    for (int32_t answer = 77; answer < 32768; answer += 331)
        for (int32_t guess = 0; guess <= 40000; guess += 1999) {
            struct values values = { .answer = answer };

            TEST_ASSERT_EQUAL_INT32(answer, look(&values, 77, 32768, guess));
        }
}

static void test_where_no_threshold_leaves_enough_it_is_the_floor(void)
{
    for (int32_t guess = 0; guess < 1000; guess += 37) {
        struct values values = { .answer = -1 };

        TEST_ASSERT_EQUAL_INT32(5, look(&values, 5, 900, guess));
    }
}

static void test_a_good_guess_takes_few_looks(void)
{
    struct values values = { .answer = 400 };

    TEST_ASSERT_EQUAL_INT32(400, look(&values, 77, 32768, 0));
    TEST_ASSERT_GREATER_THAN_INT32(10, values.n_looks);
    for (int32_t guess = 392; guess <= 408; guess++) {
        TEST_ASSERT_EQUAL_INT32(400, look(&values, 77, 32768, guess));
        TEST_ASSERT_LESS_OR_EQUAL_INT32(7, values.n_looks);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_guess_never_changes_the_answer);
    RUN_TEST(test_where_no_threshold_leaves_enough_it_is_the_floor);
    RUN_TEST(test_a_good_guess_takes_few_looks);
    return UNITY_END();
}
