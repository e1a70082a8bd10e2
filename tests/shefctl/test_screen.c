#include "shefctl/screen.h"

#include <fcntl.h>
#include <stdlib.h>
#include <unistd.h>

#include "support/support.h"

static void expect_shown(const char *text, int n_rows, int n_columns, const char *expected)
{
    char *shown = NULL;
    size_t n_shown;
    FILE *out = open_memstream(&shown, &n_shown);

    shef_ctl_screen_show(text, n_rows, n_columns, out);
    fclose(out);
    TEST_ASSERT_EQUAL_STRING(expected, shown);
    free(shown);
}

static void test_what_fits_is_shown_whole(void)
{
    expect_shown("ab\nc\n", 3, 2, "\033[Hab\033[K\nc\033[K\n\033[J");
}

static void test_long_lines_are_cut_at_the_window(void)
{
    expect_shown("abcdef\n", 5, 4, "\033[Habcd\033[K\n\033[J");
    expect_shown("\xc3\xa4\xc3\xb6\xc3\xbc\n", 5, 2, "\033[H\xc3\xa4\xc3\xb6\033[K\n\033[J");
}

static void test_lines_beyond_the_window_are_counted_in_its_last_row(void)
{
    expect_shown("a\nb\nc\nd\n", 3, 60,
                 "\033[Ha\033[K\nb\033[K\n... 2 more lines; they need a higher window\033[J");
    /* As many lines as rows: the line end behind the last one would scroll. */
    expect_shown("a\nb\n", 2, 8, "\033[Ha\033[K\n... 1 mo\033[J");
    expect_shown("a\nb\n", 1, 8, "\033[H... 2 mo\033[J");
}

static void test_what_is_no_terminal_has_the_usual_size(void)
{
    const int fd = open("/dev/null", O_RDONLY);
    int n_rows, n_columns;

    shef_ctl_screen_size(fd, &n_rows, &n_columns);
    TEST_ASSERT_EQUAL_INT(24, n_rows);
    TEST_ASSERT_EQUAL_INT(80, n_columns);
    close(fd);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_what_fits_is_shown_whole);
    RUN_TEST(test_long_lines_are_cut_at_the_window);
    RUN_TEST(test_lines_beyond_the_window_are_counted_in_its_last_row);
    RUN_TEST(test_what_is_no_terminal_has_the_usual_size);
    return UNITY_END();
}
