/* The robust matcher on the authors' 48 given pairs: three scenes of 16.
 *
 * Protocol: frame-edge pixels in columns 50..618 whose truth is no hole (80 px marks one), all of
 * them, no filter. RMSE is the mean of the pairs', shares are pooled. The bounds are a little
 * above what was measured: they tell a change for the worse. Where ground truth is used (a bias,
 * the calibration of the confidence) it is that of the two other scenes. */
#include "pipeline/robust.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/memory.h"
#include "pipeline/bias.h"
#include "real_pairs.h"
#include "robust_cases.h"

#define N_SCENES        3
#define PAIRS_PER_SCENE (SHEF_TEST_N_PAIRS / N_SCENES)
#define WIDTH_PX        640
#define HEIGHT_PX       480
#define FIRST_COLUMN    50
#define LAST_COLUMN     618
#define HOLE_PX         79.9f
#define N_BINS          20

static struct shef_test_pair pairs[SHEF_TEST_N_PAIRS];

static void read_pairs(void)
{
    for (int32_t i = 0; i < SHEF_TEST_N_PAIRS; i++)
        pairs[i] = shef_test_read_pair(shef_test_pair_number(i));
}

void tearDown(void)
{
    for (int32_t i = 0; i < SHEF_TEST_N_PAIRS; i++)
        if (pairs[i].truth.data)
            shef_test_free_pair(&pairs[i]);
    memset(pairs, 0, sizeof pairs);
}

/* Matches all pairs in the order of their numbers. */
static void match_all(bool use_past, struct result out_results[SHEF_TEST_N_PAIRS])
{
    struct shef_robust_params params =
        shef_robust_defaults(WIDTH_PX, HEIGHT_PX, SHEF_EDGE_UNSIGNED);

    params.use_past = use_past;

    struct shef_robust *matcher = matcher_create(&params, NULL);

    shef_robust_align_auto(matcher);
    for (int32_t i = 0; i < SHEF_TEST_N_PAIRS; i++) {
        const struct edges edges = { pairs[i].left, pairs[i].right };

        out_results[i] = match(matcher, &edges, shef_test_pair_number(i));
    }
    shef_robust_destroy(matcher);
}

static void free_results(struct result results[SHEF_TEST_N_PAIRS])
{
    for (int32_t i = 0; i < SHEF_TEST_N_PAIRS; i++)
        result_destroy(&results[i]);
}

struct tally {
    double sum_of_rmse_px;
    int64_t n_pairs;
    int64_t n_scored;
    int64_t n_bad;   /* error above 5 px */
    int64_t n_edges; /* that could have an estimate */
    /* By confidence. */
    int64_t n_in_bin[N_BINS];
    int64_t n_good_in_bin[N_BINS]; /* error up to 3 px */
    double confidence_in_bin[N_BINS];
};

/* Scores a pair's estimates less a bias (NULL: none), at frame edges or everywhere. */
static void add_pair(struct tally *tally, int32_t i, const struct result *result,
                     const struct shef_smooth_field *bias, bool is_dense)
{
    const struct shef_robust_output *images = &result->images;
    double sum_of_squares = 0.0;
    int64_t n = 0;

    for (int32_t y = 0; y < HEIGHT_PX; y++) {
        const float *disparity =
            shef_row_f32(is_dense ? images->dense_disparity : images->disparity, y);
        const float *confidence =
            shef_row_f32(is_dense ? images->dense_confidence : images->confidence, y);
        const float *truth = shef_row_f32(pairs[i].truth, y);

        for (int32_t x = FIRST_COLUMN; x <= LAST_COLUMN; x++) {
            if (!(truth[x] > 0.0f && truth[x] < HOLE_PX))
                continue;
            tally->n_edges += is_dense || edge_at(&pairs[i].left, x, y);
            if (disparity[x] == 0.0f)
                continue;

            const double error = disparity[x] - (bias ? shef_field_at(bias, x, y) : 0.0) - truth[x];
            const int32_t bin = (int32_t)(confidence[x] * N_BINS);

            TEST_ASSERT_TRUE(bin >= 0 && bin < N_BINS);
            sum_of_squares += error * error;
            n++;
            tally->n_bad += fabs(error) > 5.0;
            tally->n_in_bin[bin]++;
            tally->n_good_in_bin[bin] += fabs(error) <= 3.0;
            tally->confidence_in_bin[bin] += confidence[x];
        }
    }
    TEST_ASSERT_GREATER_THAN_INT64(0, n);
    tally->sum_of_rmse_px += sqrt(sum_of_squares / (double)n);
    tally->n_pairs++;
    tally->n_scored += n;
}

struct figures {
    double rmse_px;
    double bad_percent;
    double coverage_percent;
    double calibration_error;
};

static struct figures figures_of(const struct tally *tally, const char *what)
{
    struct figures figures = {
        .rmse_px = tally->sum_of_rmse_px / (double)tally->n_pairs,
        .bad_percent = 100.0 * (double)tally->n_bad / (double)tally->n_scored,
        .coverage_percent = 100.0 * (double)tally->n_scored / (double)tally->n_edges,
    };

    for (int32_t b = 0; b < N_BINS; b++)
        figures.calibration_error +=
            fabs(tally->confidence_in_bin[b] - (double)tally->n_good_in_bin[b]) /
            (double)tally->n_scored;
    printf("%s: RMSE %.3f px, bad-5 %.2f %%, coverage %.2f %%, calibration error %.4f\n", what,
           figures.rmse_px, figures.bad_percent, figures.coverage_percent,
           figures.calibration_error);
    return figures;
}

/* The bias fitted on the pairs of every scene but one. */
static struct shef_smooth_field fit_bias_without(int32_t scene,
                                                 const struct result results[SHEF_TEST_N_PAIRS])
{
    struct shef_bias_sample samples[SHEF_TEST_N_PAIRS];
    struct shef_smooth_field bias;
    struct shef_error err = { 0 };
    int32_t n = 0;

    for (int32_t i = 0; i < SHEF_TEST_N_PAIRS; i++)
        if (i / PAIRS_PER_SCENE != scene)
            samples[n++] = (struct shef_bias_sample){ results[i].images.disparity, pairs[i].truth };
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_bias_fit(samples, n, HOLE_PX, &bias, &err), err.text);
    return bias;
}

static void expect_figures(const struct tally *tally, const char *what, double rmse_px,
                           double bad_percent)
{
    const struct figures figures = figures_of(tally, what);

    expect_at_most(rmse_px, figures.rmse_px, "RMSE (px)");
    expect_at_most(bad_percent, figures.bad_percent, "bad-5 (%)");
    TEST_ASSERT_DOUBLE_WITHIN(0.01, 100.0, figures.coverage_percent);
}

/* Share of errors above 3 px among the most confident half (whole bins) and among all. */
static void expect_the_confident_half_is_better(const struct tally *tally)
{
    int64_t n = 0;
    int64_t n_good = 0;
    int64_t n_good_of_all = 0;

    for (int32_t b = N_BINS - 1; b >= 0; b--) {
        if (2 * n < tally->n_scored) {
            n += tally->n_in_bin[b];
            n_good += tally->n_good_in_bin[b];
        }
        n_good_of_all += tally->n_good_in_bin[b];
    }

    const double of_half = 1.0 - (double)n_good / (double)n;
    const double of_all = 1.0 - (double)n_good_of_all / (double)tally->n_scored;

    printf("errors above 3 px: %.2f %% of all, %.2f %% of the most confident %.0f %%\n",
           100.0 * of_all, 100.0 * of_half, 100.0 * (double)n / (double)tally->n_scored);
    expect_at_most(0.5 * of_all, of_half, "share of the confident half above 3 px");
}

static void test_figures_on_the_given_pairs(void)
{
    static struct result results[SHEF_TEST_N_PAIRS];
    struct shef_smooth_field biases[N_SCENES];
    struct tally plain = { 0 };
    struct tally corrected = { 0 };
    struct tally dense = { 0 };
    struct tally dense_corrected = { 0 };

    SHEF_TEST_NEEDS_DATA("shef");
    read_pairs();
    match_all(true, results);
    for (int32_t scene = 0; scene < N_SCENES; scene++)
        biases[scene] = fit_bias_without(scene, results);
    for (int32_t i = 0; i < SHEF_TEST_N_PAIRS; i++) {
        const struct shef_smooth_field *bias = &biases[i / PAIRS_PER_SCENE];

        add_pair(&plain, i, &results[i], NULL, false);
        add_pair(&corrected, i, &results[i], bias, false);
        add_pair(&dense, i, &results[i], NULL, true);
        add_pair(&dense_corrected, i, &results[i], bias, true);
        TEST_ASSERT_EQUAL(i % PAIRS_PER_SCENE > 0, results[i].report.used_past);
        TEST_ASSERT_FALSE(results[i].report.is_cut);
        TEST_ASSERT_FALSE(results[i].report.is_saturated);
    }
    free_results(results);

    expect_figures(&plain, "edges, no ground truth", 3.25, 6.4);
    expect_figures(&corrected, "edges, bias of the other scenes", 2.05, 2.3);
    expect_figures(&dense, "dense, no ground truth", 5.0, 17.0);
    expect_figures(&dense_corrected, "dense, bias of the other scenes", 5.0, 17.0);
    expect_at_most(0.05, figures_of(&corrected, "confidence").calibration_error,
                   "calibration error");
    expect_the_confident_half_is_better(&corrected);
}

/* As another program measured it on the same data, by maximising the correlation in blocks. */
static const struct shef_smooth_field known_residual = {
    .c = { 1.56, -0.63, 0.60, -0.06, -0.41, -0.21 }, .width_px = WIDTH_PX, .height_px = HEIGHT_PX
};

static double distance_px(const struct shef_smooth_field *a, const struct shef_smooth_field *b)
{
    double sum_px = 0.0;
    int32_t n = 0;

    for (int32_t y = 0; y < HEIGHT_PX; y += 8)
        for (int32_t x = 0; x < WIDTH_PX; x += 8, n++)
            sum_px += fabs(shef_field_at(a, x, y) - shef_field_at(b, x, y));
    return sum_px / n;
}

static void test_every_scene_shows_the_rigs_vertical_residual(void)
{
    SHEF_TEST_NEEDS_DATA("shef");
    read_pairs();
    for (int32_t scene = 0; scene < N_SCENES; scene++) {
        const struct shef_robust_params params =
            shef_robust_defaults(WIDTH_PX, HEIGHT_PX, SHEF_EDGE_UNSIGNED);
        struct shef_robust *matcher = matcher_create(&params, NULL);
        struct shef_robust_report last = { 0 };

        shef_robust_align_auto(matcher);
        for (int32_t i = scene * PAIRS_PER_SCENE; i < (scene + 1) * PAIRS_PER_SCENE; i++) {
            const struct edges edges = { pairs[i].left, pairs[i].right };
            struct result result = match(matcher, &edges, shef_test_pair_number(i));

            last = result.report;
            result_destroy(&result);
        }
        shef_robust_destroy(matcher);
        printf("scene %d: off by %.3f px in the mean, spread of the blocks %.3f px\n", scene,
               distance_px(&last.alignment, &known_residual), last.alignment_spread_px);
        expect_at_most(0.6, distance_px(&last.alignment, &known_residual), "distance (px)");
        expect_at_most(0.35, last.alignment_spread_px, "spread of the blocks (px)");
    }
}

/* Which pairs of a scene are saturated: one alone, and three in a row. */
static bool is_flooded(int32_t i)
{
    const int32_t at = i % PAIRS_PER_SCENE;

    return at == 5 || (at >= 10 && at <= 12);
}

/* Every edge drags a tail to the right, as long as it takes. */
static void smear(struct shef_edge_map *map, double share)
{
    while ((double)shef_edge_map_count(map) < share * WIDTH_PX * HEIGHT_PX)
        for (int32_t y = 0; y < HEIGHT_PX; y++)
            for (int32_t x = WIDTH_PX - 1; x > 0; x--)
                if (edge_at(map, x - 1, y))
                    edge_set(map, x, y, 1);
}

/* Of the saturated pairs alone. */
static struct figures figures_of_flooded(bool use_past, const char *what)
{
    static struct result results[SHEF_TEST_N_PAIRS];
    struct tally tally = { 0 };

    match_all(use_past, results);
    for (int32_t i = 0; i < SHEF_TEST_N_PAIRS; i++)
        if (is_flooded(i))
            add_pair(&tally, i, &results[i], NULL, false);
    free_results(results);
    return figures_of(&tally, what);
}

enum flood {
    FLOOD_NOISE, /* pixels at random, up to the worst that the authors' maps have: 74 % set */
    FLOOD_SMEAR, /* tails, which look like edges elsewhere */
};

static void flood(enum flood how)
{
    for (int32_t i = 0; i < SHEF_TEST_N_PAIRS; i++)
        if (is_flooded(i) && how == FLOOD_NOISE)
            edges_flood(&pairs[i].right, 0.74, (uint64_t)i);
        else if (is_flooded(i))
            smear(&pairs[i].right, 0.6);
}

static void expect_the_past_carries_over(enum flood how, double worse_without)
{
    struct figures unharmed, with, without;

    read_pairs();
    unharmed = figures_of_flooded(true, "the same pairs unharmed");
    flood(how);
    with = figures_of_flooded(true, "saturated, with the past");
    without = figures_of_flooded(false, "saturated, without");
    tearDown();
    expect_at_most(1.05 * unharmed.rmse_px, with.rmse_px, "RMSE with the past (px)");
    expect_at_most(1.1 * unharmed.bad_percent, with.bad_percent, "bad-5 with the past (%)");
    expect_at_most(without.rmse_px, worse_without * with.rmse_px, "RMSE, times what it helps (px)");
}

static void test_the_past_carries_over_pairs_saturated_by_noise(void)
{
    SHEF_TEST_NEEDS_DATA("shef");
    expect_the_past_carries_over(FLOOD_NOISE, 1.3);
}

static void test_the_past_carries_over_smeared_pairs(void)
{
    SHEF_TEST_NEEDS_DATA("shef");
    expect_the_past_carries_over(FLOOD_SMEAR, 3.0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_figures_on_the_given_pairs);
    RUN_TEST(test_every_scene_shows_the_rigs_vertical_residual);
    RUN_TEST(test_the_past_carries_over_pairs_saturated_by_noise);
    RUN_TEST(test_the_past_carries_over_smeared_pairs);
    return UNITY_END();
}
