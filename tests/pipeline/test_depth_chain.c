#include "pipeline/depth_chain.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/cpu.h"
#include "core/workers.h"
#include "depth_rig.h"
#include "support/alloc_watch.h"
#include "support/support.h"

static struct depth_rig rig;
static struct shef_depth_output output;

static struct shef_depth_chain *create(enum shef_depth_mode mode, uint32_t modes,
                                       struct shef_workers *workers, uint32_t cpu_features)
{
    struct shef_depth_params params = shef_depth_default_params();
    struct shef_depth_chain *chain;
    struct shef_error err = { 0 };

    params.mode = mode;
    params.modes = modes;
    /* The threshold of this sensor, see event_edges.h. */
    params.lag_px = 0.26;
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_depth_chain_create(&chain, &rig.calibration, &params, workers, cpu_features, &err),
        err.text);
    return chain;
}

static struct shef_depth_chain *create_plain(enum shef_depth_mode mode)
{
    return create(mode, 0, NULL, shef_cpu_features());
}

static void test_every_mode_finds_the_wall(void)
{
    /* The paper's modes see whole pixels and have no smoothness. */
    static const double least_good[SHEF_DEPTH_N_MODES] = {
        0.80, 0.90, 0.97, 0.97, 0.97, 0.97, 0.97
    };

    for (int mode = 0; mode < SHEF_DEPTH_N_MODES; mode++) {
        struct shef_depth_chain *chain = create_plain((enum shef_depth_mode)mode);
        const struct shef_depth_report report = depth_rig_process_all(&rig, chain, true, &output);
        const struct depth_rig_verdict verdict = depth_rig_judge(output.disparity);

        printf("%s: %.1f %% within 1 px of %lld, mean error %+.3f px\n",
               shef_depth_mode_name((enum shef_depth_mode)mode), 100 * verdict.good,
               (long long)verdict.n, verdict.mean_px);
        TEST_ASSERT_EQUAL(mode, report.mode);
        TEST_ASSERT_GREATER_THAN_INT64(20000, verdict.n);
        TEST_ASSERT_TRUE(verdict.good >= least_good[mode]);
        TEST_ASSERT_DOUBLE_WITHIN(mode < SHEF_DEPTH_UNSIGNED ? 0.5 : 0.25, 0, verdict.mean_px);
        shef_depth_chain_destroy(chain);
    }
}

static void test_depth_follows_from_disparity_and_has_a_sigma(void)
{
    struct shef_depth_chain *chain = create_plain(SHEF_DEPTH_GRADED);
    const struct shef_depth_geometry geometry = shef_depth_chain_geometry(chain);
    const double fb = geometry.f_px * geometry.baseline_m;
    const struct shef_depth_report report = depth_rig_process_all(&rig, chain, true, &output);
    int64_t n = 0;

    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 555 * 0.06544, fb);
    for (int32_t y = 0; y < geometry.height_px; y++)
        for (int32_t x = 0; x < geometry.width_px; x++) {
            const float d = shef_row_f32(output.disparity, y)[x];
            const float z = shef_row_f32(output.depth_m, y)[x];
            const float sigma = shef_row_f32(output.sigma_m, y)[x];

            if (!(d > 0)) {
                TEST_ASSERT_EQUAL_FLOAT(0, z);
                TEST_ASSERT_EQUAL_FLOAT(0, sigma);
                continue;
            }
            n++;
            TEST_ASSERT_FLOAT_WITHIN(1e-4F * z, (float)(fb / d), z);
            /* Between 0.1 and 0.4 px of disparity. */
            TEST_ASSERT_TRUE(sigma > 0.1F * z / d && sigma < 0.4F * z / d);
        }
    TEST_ASSERT_EQUAL_INT64(n, report.n_depths);
    TEST_ASSERT_EQUAL_INT64(shef_edge_map_count(shef_depth_chain_frame_edges(chain)),
                            report.n_edges);
    shef_depth_chain_destroy(chain);
}

static void expect_same(struct shef_image_f32 a, struct shef_image_f32 b)
{
    for (int32_t y = 0; y < a.height_px; y++)
        TEST_ASSERT_EQUAL_MEMORY(shef_row_f32(a, y), shef_row_f32(b, y),
                                 (size_t)a.width_px * sizeof(float));
}

/* Runs all frames and compares the last with `output`. */
static void expect_same_run(enum shef_depth_mode mode, int32_t n_threads, uint32_t cpu_features,
                            bool has_velocity)
{
    struct shef_workers *workers = n_threads > 1 ? shef_workers_create(n_threads, NULL) : NULL;
    struct shef_depth_chain *chain = create(mode, 0, workers, cpu_features);
    const struct shef_depth_geometry geometry = shef_depth_chain_geometry(chain);
    struct shef_depth_output other;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_depth_output_create(&other, &geometry, true, NULL));
    (void)depth_rig_process_all(&rig, chain, has_velocity, &other);
    expect_same(output.disparity, other.disparity);
    expect_same(output.confidence, other.confidence);
    expect_same(output.depth_m, other.depth_m);
    expect_same(output.sigma_m, other.sigma_m);
    expect_same(output.dense_disparity, other.dense_disparity);
    shef_depth_output_destroy(&other);
    shef_depth_chain_destroy(chain);
    shef_workers_destroy(workers);
}

static void test_workers_and_instruction_sets_do_not_show(void)
{
    struct shef_depth_chain *chain = create_plain(SHEF_DEPTH_COMBINED);

    (void)depth_rig_process_all(&rig, chain, false, &output);
    expect_same_run(SHEF_DEPTH_COMBINED, 2, shef_cpu_features(), false);
    expect_same_run(SHEF_DEPTH_COMBINED, 5, shef_cpu_features(), false);
    expect_same_run(SHEF_DEPTH_COMBINED, 1, SHEF_CPU_NONE, false);
    shef_depth_chain_destroy(chain);
}

static void test_the_direction_is_found_where_nobody_tells_it(void)
{
    struct shef_depth_chain *chain = create_plain(SHEF_DEPTH_COMBINED);
    const struct shef_depth_report report = depth_rig_process_all(&rig, chain, false, &output);
    const struct depth_rig_verdict verdict = depth_rig_judge(output.disparity);

    TEST_ASSERT_EQUAL(SHEF_DEPTH_COMBINED, report.mode);
    TEST_ASSERT_BITS_HIGH(SHEF_DEPTH_SEARCHED, report.flags);
    TEST_ASSERT_TRUE(report.direction[0] < -0.98);
    TEST_ASSERT_TRUE(verdict.good >= 0.97);
    shef_depth_chain_destroy(chain);
}

static void test_what_a_mode_lacks_is_replaced_and_said(void)
{
    struct shef_depth_chain *chain = create_plain(SHEF_DEPTH_COMBINED);
    struct shef_depth_report report = depth_rig_process(&rig, chain, 0, true, &output);

    TEST_ASSERT_EQUAL(SHEF_DEPTH_GRADED, report.mode);
    TEST_ASSERT_BITS_HIGH(SHEF_DEPTH_NO_PAST, report.flags);
    TEST_ASSERT_EQUAL_INT32(0, report.span_frames);

    report = depth_rig_process(&rig, chain, 1, true, &output);
    TEST_ASSERT_EQUAL(SHEF_DEPTH_COMBINED, report.mode);
    TEST_ASSERT_EQUAL_INT32(1, report.span_frames);

    /* A robot that stands. */
    const double velocity = rig.velocity_m_s[0];

    rig.velocity_m_s[0] = 0;
    report = depth_rig_process(&rig, chain, 2, true, &output);
    rig.velocity_m_s[0] = velocity;
    TEST_ASSERT_EQUAL(SHEF_DEPTH_TEMPORAL, report.mode);
    TEST_ASSERT_BITS_HIGH(SHEF_DEPTH_NO_MOTION, report.flags);

    shef_depth_chain_reset(chain);
    report = depth_rig_process(&rig, chain, 3, true, &output);
    TEST_ASSERT_BITS_HIGH(SHEF_DEPTH_NO_PAST, report.flags);
    shef_depth_chain_destroy(chain);
}

static void test_a_mode_without_a_temporal_pair_reports_no_span(void)
{
    struct shef_depth_chain *chain = create_plain(SHEF_DEPTH_GRADED);
    const struct shef_depth_report report = depth_rig_process_all(&rig, chain, true, &output);

    TEST_ASSERT_EQUAL(SHEF_DEPTH_GRADED, report.mode);
    TEST_ASSERT_EQUAL_INT32(0, report.span_frames);
    TEST_ASSERT_EQUAL_INT64(0, report.span_ns);
    shef_depth_chain_destroy(chain);
}

static void test_slow_motion_makes_temporal_pairs_span_more_frames(void)
{
    struct shef_depth_chain *chain = create_plain(SHEF_DEPTH_TEMPORAL);
    const double velocity = rig.velocity_m_s[0];
    struct shef_depth_report report;

    report = depth_rig_process_all(&rig, chain, true, &output);
    TEST_ASSERT_EQUAL_INT32(1, report.span_frames);
    shef_depth_chain_reset(chain);
    rig.velocity_m_s[0] = velocity / 3;
    report = depth_rig_process_all(&rig, chain, true, &output);
    rig.velocity_m_s[0] = velocity;
    TEST_ASSERT_EQUAL_INT32(3, report.span_frames);
    shef_depth_chain_destroy(chain);
}

/* Whether each of the first frames says that the chain has not settled. */
static void expect_settled_from(enum shef_depth_mode mode, bool has_velocity, int32_t first)
{
    struct shef_depth_chain *chain = create_plain(mode);

    for (int32_t i = 0; i < DEPTH_RIG_FRAMES; i++) {
        const struct shef_depth_report report =
            depth_rig_process(&rig, chain, i, has_velocity, &output);

        TEST_ASSERT_EQUAL(i < first, (report.flags & SHEF_DEPTH_SETTLING) != 0);
    }
    shef_depth_chain_destroy(chain);
}

static void test_frames_before_a_full_temporal_pair_are_marked(void)
{
    const double velocity = rig.velocity_m_s[0];

    expect_settled_from(SHEF_DEPTH_TEMPORAL, true, 1);
    expect_settled_from(SHEF_DEPTH_TEMPORAL, false, 1);
    expect_settled_from(SHEF_DEPTH_GRADED, true, 1);
    rig.velocity_m_s[0] = velocity / 2;
    expect_settled_from(SHEF_DEPTH_COMBINED, true, 3);
    expect_settled_from(SHEF_DEPTH_GRADED, true, 1);
    expect_settled_from(SHEF_DEPTH_PAPER_DS, true, 1);
    rig.velocity_m_s[0] = velocity;
}

static float largest(struct shef_image_f32 image)
{
    float most = 0;

    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            most = fmaxf(most, shef_row_f32(image, y)[x]);
    return most;
}

static void test_work_is_shed_as_told_and_reported(void)
{
    struct shef_depth_chain *chain = create_plain(SHEF_DEPTH_COMBINED);
    struct shef_depth_report report = depth_rig_process_all(&rig, chain, true, &output);
    float *dense = shef_row_f32(output.dense_disparity, 100);

    TEST_ASSERT_EQUAL_HEX32(0, report.shed);
    dense[100] = -1;
    shef_depth_chain_set_shed(chain, SHEF_DEPTH_SHED_DENSE | SHEF_DEPTH_SHED_HALF_RANGE |
                                         SHEF_DEPTH_SHED_SINGLE);
    report = depth_rig_process(&rig, chain, 3, true, &output);
    TEST_ASSERT_EQUAL_HEX32(
        SHEF_DEPTH_SHED_DENSE | SHEF_DEPTH_SHED_HALF_RANGE | SHEF_DEPTH_SHED_SINGLE, report.shed);
    TEST_ASSERT_EQUAL(SHEF_DEPTH_GRADED, report.mode);
    TEST_ASSERT_EQUAL_FLOAT(-1, dense[100]);
    TEST_ASSERT_TRUE(largest(output.disparity) <= 24);
    TEST_ASSERT_TRUE(depth_rig_judge(output.disparity).good >= 0.97);

    shef_depth_chain_set_shed(chain, 0);
    report = depth_rig_process(&rig, chain, 3, true, &output);
    TEST_ASSERT_EQUAL_HEX32(0, report.shed);
    TEST_ASSERT_EQUAL(SHEF_DEPTH_COMBINED, report.mode);
    TEST_ASSERT_TRUE(dense[100] >= 0);
    shef_depth_chain_destroy(chain);
}

static void test_only_listed_modes_can_be_chosen(void)
{
    struct shef_depth_chain *chain =
        create(SHEF_DEPTH_GRADED, (1u << SHEF_DEPTH_PAPER_DS) | (1u << SHEF_DEPTH_UNSIGNED), NULL,
               shef_cpu_features());

    TEST_ASSERT_EQUAL(SHEF_OK, shef_depth_chain_set_mode(chain, SHEF_DEPTH_PAPER_DS));
    TEST_ASSERT_EQUAL(SHEF_DEPTH_PAPER_DS, depth_rig_process(&rig, chain, 0, true, &output).mode);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_depth_chain_set_mode(chain, SHEF_DEPTH_UNSIGNED));
    TEST_ASSERT_EQUAL(SHEF_DEPTH_UNSIGNED, depth_rig_process(&rig, chain, 1, true, &output).mode);
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_depth_chain_set_mode(chain, SHEF_DEPTH_TERNARY));
    TEST_ASSERT_EQUAL(SHEF_DEPTH_UNSIGNED, depth_rig_process(&rig, chain, 2, true, &output).mode);
    shef_depth_chain_destroy(chain);
}

static void test_nothing_is_allocated_after_create(void)
{
    SHEF_TEST_NEEDS_ALLOC_WATCH();

    struct shef_workers *workers = shef_workers_create(2, NULL);
    struct shef_depth_chain *chain =
        create(SHEF_DEPTH_COMBINED, SHEF_DEPTH_ALL_MODES, workers, shef_cpu_features());

    shef_alloc_watch_start();
    for (int mode = 0; mode < SHEF_DEPTH_N_MODES; mode++) {
        const enum shef_err code = shef_depth_chain_set_mode(chain, (enum shef_depth_mode)mode);

        (void)code;
        for (int i = 0; i < DEPTH_RIG_FRAMES; i++)
            (void)depth_rig_process(&rig, chain, i, i % 2 == 0, &output);
        shef_depth_chain_set_shed(chain, mode % 2 == 0 ? SHEF_DEPTH_SHED_HALF_RANGE : 0);
        shef_depth_chain_reset(chain);
    }
    shef_alloc_watch_stop();
    TEST_ASSERT_EQUAL_UINT64(0, shef_alloc_watch_calls(NULL, false));
    shef_depth_chain_destroy(chain);
    shef_workers_destroy(workers);
}

static void test_parameters_that_cannot_be_are_refused(void)
{
    const struct shef_depth_params good = shef_depth_default_params();
    struct shef_depth_params params[4] = { good, good, good, good };
    struct shef_depth_chain *chain = NULL;
    struct shef_error err = { 0 };

    params[0].lag_px = 9;
    params[1].travel_m = 0;
    params[2].profile = "narrow";
    params[3].max_disparity_px = 300;
    for (int i = 0; i < 4; i++) {
        TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                          shef_depth_chain_create(&chain, &rig.calibration, &params[i], NULL,
                                                  SHEF_CPU_NONE, &err));
        TEST_ASSERT_NULL(chain);
        TEST_ASSERT_GREATER_THAN_size_t(10, strlen(err.text));
    }
}

/* A hand that turns about the world's z axis, a camera half a metre out along its x axis. */
static void test_velocity_is_the_cameras_not_the_hands(void)
{
    struct shef_calibration calibration = shef_calibration_paper_rig();
    struct shef_depth_geometry geometry = { .r_camera_rectified = { 1, 0, 0, 0, 1, 0, 0, 0, 1 } };
    const double speed[6] = { 0.1, 0, 0, 0, 0, 2 };
    const double quarter[3] = { 0, 0, M_PI / 2 };
    const double nowhere[3] = { 0 };
    struct shef_rigid hand = shef_rigid_identity();
    double v[3];

    calibration.t_hand_frame = shef_rigid_identity();
    calibration.t_hand_frame.t_m[0] = 0.5;
    shef_depth_velocity(&calibration, &geometry, &hand, speed, v);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.1, v[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, v[1]);

    /* The hand turned by 90 degrees: its x axis is the world's y axis. */
    hand = shef_rigid_from_rotation_vector(quarter, nowhere);
    shef_depth_velocity(&calibration, &geometry, &hand, speed, v);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, v[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.9, v[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, v[2]);
}

int main(void)
{
    struct shef_depth_chain *chain;
    struct shef_depth_geometry geometry;
    int n_failed;

    UNITY_BEGIN();
    depth_rig_make(&rig);
    chain = create_plain(SHEF_DEPTH_PAPER_DS);
    geometry = shef_depth_chain_geometry(chain);
    shef_depth_chain_destroy(chain);
    if (shef_depth_output_create(&output, &geometry, true, NULL) != SHEF_OK)
        return 1;
    RUN_TEST(test_every_mode_finds_the_wall);
    RUN_TEST(test_depth_follows_from_disparity_and_has_a_sigma);
    RUN_TEST(test_workers_and_instruction_sets_do_not_show);
    RUN_TEST(test_the_direction_is_found_where_nobody_tells_it);
    RUN_TEST(test_what_a_mode_lacks_is_replaced_and_said);
    RUN_TEST(test_a_mode_without_a_temporal_pair_reports_no_span);
    RUN_TEST(test_slow_motion_makes_temporal_pairs_span_more_frames);
    RUN_TEST(test_frames_before_a_full_temporal_pair_are_marked);
    RUN_TEST(test_work_is_shed_as_told_and_reported);
    RUN_TEST(test_only_listed_modes_can_be_chosen);
    RUN_TEST(test_nothing_is_allocated_after_create);
    RUN_TEST(test_parameters_that_cannot_be_are_refused);
    RUN_TEST(test_velocity_is_the_cameras_not_the_hands);
    n_failed = UNITY_END();
    shef_depth_output_destroy(&output);
    depth_rig_free(&rig);
    return n_failed;
}
