/* Figures of tallies, and what JSON keeps of them for pooling. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sheftool/run_score.h"
#include "support/support.h"

#define STEP_PERCENT 0.05 /* of the counts in JSON */

static struct shef_run_tally tally;
static struct shef_run_tally other;

void setUp(void)
{
    memset(&tally, 0, sizeof tally);
    memset(&other, 0, sizeof other);
}

/* Pixels whose depth is wrong by a share of it, all found. */
static void add_pixels(struct shef_run_part *part, double relative, uint32_t n)
{
    part->n_scored += n;
    part->n_found += n;
    part->size[(int)(fabs(relative) / SHEF_RUN_ERROR_BIN)] += n;
    part->signed_size[(int)((relative + 0.5) / SHEF_RUN_ERROR_BIN)] += n;
}

/* Where half of the counts in a JSON text lie below, as a number of steps. */
static int middle_of(json_t *part, const char *name, int64_t *out_n)
{
    const char *text = json_string_value(json_object_get(part, name));
    int64_t n_below = 0;
    int middle = -1;
    char *end;

    *out_n = 0;
    for (const char *at = text; *at; at = end)
        *out_n += strtoll(at, &end, 10);
    for (const char *at = text; *at && 2 * n_below < *out_n; at = end, middle++)
        n_below += strtoll(at, &end, 10);
    return middle;
}

static void test_the_median_is_that_of_all_pixels_pooled(void)
{
    add_pixels(&tally.all, 0.01005, 30);
    add_pixels(&other.all, -0.03005, 40);
    shef_run_tally_merge(&tally, &other);
    const struct shef_run_figures figures = shef_run_part_figures(&tally.all);

    TEST_ASSERT_DOUBLE_WITHIN(2 * SHEF_RUN_ERROR_BIN, 0.03005, figures.depth_error);
    TEST_ASSERT_DOUBLE_WITHIN(2 * SHEF_RUN_ERROR_BIN, -0.03005, figures.bias);
}

static void test_a_pixel_without_an_estimate_counts_as_infinitely_far_off(void)
{
    add_pixels(&tally.all, 0.01005, 40);
    tally.all.n_scored += 60;
    tally.all.size[SHEF_RUN_ERROR_BINS - 1] += 60;

    TEST_ASSERT_TRUE(shef_run_part_figures(&tally.all).depth_error >= 1.0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.4, shef_run_part_figures(&tally.all).coverage);
}

static void test_json_keeps_every_pixel_where_it_was(void)
{
    int64_t n;

    add_pixels(&tally.all, 0.01005, 30);
    add_pixels(&tally.all, -0.03005, 40);
    tally.all.n_scored += 5;
    tally.all.size[SHEF_RUN_ERROR_BINS - 1] += 5;
    json_t *root = shef_run_tally_json(&tally);
    json_t *all = json_object_get(root, "all");

    TEST_ASSERT_EQUAL_DOUBLE(STEP_PERCENT, json_real_value(json_object_get(all, "bin_percent")));
    TEST_ASSERT_EQUAL_INT((int)(3.005 / STEP_PERCENT), middle_of(all, "sizes", &n));
    TEST_ASSERT_EQUAL_INT64(75, n);
    TEST_ASSERT_EQUAL_INT((int)((50 - 3.005) / STEP_PERCENT), middle_of(all, "signed_sizes", &n));
    TEST_ASSERT_EQUAL_INT64(70, n);
    TEST_ASSERT_EQUAL_INT(75, json_integer_value(json_object_get(all, "pixels")));
    json_decref(root);
}

static void test_nothing_scored_has_no_figures(void)
{
    json_t *root = shef_run_tally_json(&tally);

    TEST_ASSERT_TRUE(
        json_is_null(json_object_get(json_object_get(root, "all"), "depth_error_percent")));
    json_decref(root);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_median_is_that_of_all_pixels_pooled);
    RUN_TEST(test_a_pixel_without_an_estimate_counts_as_infinitely_far_off);
    RUN_TEST(test_json_keeps_every_pixel_where_it_was);
    RUN_TEST(test_nothing_scored_has_no_figures);
    return UNITY_END();
}
