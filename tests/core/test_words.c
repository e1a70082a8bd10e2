#include "core/words.h"

#include "support/support.h"

static void test_words_are_counted_from_0_and_end(void)
{
    char word[8];

    TEST_ASSERT_TRUE(shef_words_at("half|full", 0, word, sizeof word));
    TEST_ASSERT_EQUAL_STRING("half", word);
    TEST_ASSERT_TRUE(shef_words_at("half|full", 1, word, sizeof word));
    TEST_ASSERT_EQUAL_STRING("full", word);
    TEST_ASSERT_FALSE(shef_words_at("half|full", 2, word, sizeof word));
    TEST_ASSERT_TRUE(shef_words_at("much longer|x", 0, word, sizeof word));
    TEST_ASSERT_EQUAL_STRING("much lo", word);
}

static void test_each_slip_counts_one(void)
{
    char longer[80] = "";

    TEST_ASSERT_EQUAL_size_t(0, shef_words_distance("graded", "graded"));
    TEST_ASSERT_EQUAL_size_t(1, shef_words_distance("graded", "grade"));
    TEST_ASSERT_EQUAL_size_t(1, shef_words_distance("graded", "gradded"));
    TEST_ASSERT_EQUAL_size_t(1, shef_words_distance("graded", "grated"));
    TEST_ASSERT_EQUAL_size_t(1, shef_words_distance("depth", "detph"));
    TEST_ASSERT_EQUAL_size_t(6, shef_words_distance("", "graded"));
    TEST_ASSERT_EQUAL_size_t(3, shef_words_distance("kitten", "sitting"));
    for (int i = 0; i < 70; i++)
        longer[i] = 'a';
    TEST_ASSERT_EQUAL_size_t(SIZE_MAX, shef_words_distance("a", longer));
    TEST_ASSERT_EQUAL_size_t(SIZE_MAX, shef_words_distance(longer, longer));
}

static void expect_hint(const char *hint, const char *written)
{
    char seen[SHEF_WORDS_HINT_BYTES];

    shef_words_hint("paper-ds|ternary|graded|on|off", written, seen);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(hint, seen, written);
}

static void test_only_what_is_close_is_suggested(void)
{
    expect_hint("; is 'graded' meant?", "grade");
    expect_hint("; is 'graded' meant?", "grdaed");
    expect_hint("; is 'ternary' meant?", "trenray");
    expect_hint("; is 'paper-ds' meant?", "paper_ds");
    expect_hint("; is 'on' meant?", "oon");
    expect_hint("", "magic");
    expect_hint("", "");
    expect_hint("", "x");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_words_are_counted_from_0_and_end);
    RUN_TEST(test_each_slip_counts_one);
    RUN_TEST(test_only_what_is_close_is_suggested);
    return UNITY_END();
}
