#include "calib/calibration.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "support/support.h"

/* A rig whose every value is another. */
static struct shef_calibration odd_rig(void)
{
    struct shef_calibration rig = shef_calibration_paper_rig();

    snprintf(rig.profile, sizeof rig.profile, "paper");
    rig.frame.model = (struct shef_camera_model){
        1300.125, 1302.7, 1020.1, 770.3, { -.1, .2, 1e-5, -1. / 3, M_PI }
    };
    rig.frame.sigma = (struct shef_camera_model){ .5, .6, .7, .8, { .01, .02, .03, .04, .05 } };
    rig.event.model.distortion[1] = -1e-17;
    rig.event.sigma.cy_px = 3;
    rig.t_event_frame =
        shef_rigid_from_rotation_vector((double[3]){ .01, .02, -.03 }, (double[3]){ -.065, 0, .1 });
    rig.t_event_frame_sigma = (struct shef_rigid_sigma){ 1e-4, 2e-4 };
    rig.t_hand_frame =
        shef_rigid_from_rotation_vector((double[3]){ 3, .2, -.3 }, (double[3]){ .1, .2, .3 });
    rig.t_hand_frame_sigma = (struct shef_rigid_sigma){ 3e-4, 4e-4 };
    for (int i = 0; i < 6; i++) {
        rig.tcp_offset[i] = i * .1;
        rig.tcp_offset_sigma[i] = i * .001;
    }
    rig.frame_delay = (struct shef_calibrated_delay){ 1234, 5 };
    rig.event_delay = (struct shef_calibrated_delay){ 123456789, 1 };
    rig.robot_delay = (struct shef_calibrated_delay){ -4000001, 250000 };
    TEST_ASSERT_EQUAL(SHEF_OK, shef_calibration_identify(&rig, NULL));
    return rig;
}

static char text[16384];

static char *load(const char *path)
{
    uint8_t *bytes;
    size_t n_bytes;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, sizeof text - 1, &bytes, &n_bytes, NULL));
    memcpy(text, bytes, n_bytes + 1);
    free(bytes);
    return text;
}

/* The example as text, to be changed. */
static char *example(void)
{
    return load(shef_test_source("config/calibration.example.yaml"));
}

/* Replaces the first place where `old` stands; NULL as `new` cuts off everything behind it. */
static char *with(char *whole, const char *old, const char *new)
{
    char behind[sizeof text];
    char *at = strstr(whole, old);

    TEST_ASSERT_NOT_NULL_MESSAGE(at, old);
    snprintf(behind, sizeof behind, "%s", new ? at + strlen(old) : "");
    snprintf(at, (size_t)(whole + sizeof text - at), "%s%s", new ? new : "", behind);
    return whole;
}

static void expect_refused(const char *changed, const char *first, const char *second)
{
    struct shef_calibration calibration;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_ERR_FORMAT,
                              shef_calibration_parse("rig.yaml", (const uint8_t *)changed,
                                                     strlen(changed), &calibration, &err),
                              first);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, first), err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, second), err.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "'rig.yaml'"), err.text);
}

static void test_the_papers_rig_is_that_of_the_paper(void)
{
    const struct shef_calibration rig = shef_calibration_paper_rig();

    TEST_ASSERT_EQUAL_DOUBLE(1301, rig.frame.model.fx_px);
    TEST_ASSERT_EQUAL_DOUBLE(1023.5, rig.frame.model.cx_px);
    TEST_ASSERT_EQUAL_DOUBLE(555, rig.event.model.fy_px);
    TEST_ASSERT_EQUAL_INT32(1536, rig.frame.height_px);
    TEST_ASSERT_EQUAL_INT32(640, rig.event.width_px);
    TEST_ASSERT_EQUAL_DOUBLE(-.06544, rig.t_event_frame.t_m[0]);
    TEST_ASSERT_EQUAL_size_t(64, strlen(rig.id));
}

static void test_every_value_comes_back_exactly(void)
{
    const struct shef_calibration rig = odd_rig();
    struct shef_calibration same = { .profile = "" };
    const char *path = shef_test_temp_path("calibration.yaml");
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_calibration_write(path, &rig, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_calibration_read(path, &same, &err), err.text);
    TEST_ASSERT_EQUAL_STRING(rig.id, same.id);
    TEST_ASSERT_EQUAL_STRING("paper", same.profile);
    TEST_ASSERT_EQUAL_MEMORY(&rig.frame, &same.frame, sizeof rig.frame);
    TEST_ASSERT_EQUAL_MEMORY(&rig.event, &same.event, sizeof rig.event);
    TEST_ASSERT_EQUAL_MEMORY(&rig.t_event_frame, &same.t_event_frame, sizeof rig.t_event_frame);
    TEST_ASSERT_EQUAL_MEMORY(&rig.t_event_frame_sigma, &same.t_event_frame_sigma,
                             sizeof rig.t_event_frame_sigma);
    TEST_ASSERT_EQUAL_MEMORY(&rig.t_hand_frame, &same.t_hand_frame, sizeof rig.t_hand_frame);
    TEST_ASSERT_EQUAL_MEMORY(&rig.t_hand_frame_sigma, &same.t_hand_frame_sigma,
                             sizeof rig.t_hand_frame_sigma);
    TEST_ASSERT_EQUAL_MEMORY(rig.tcp_offset, same.tcp_offset, sizeof rig.tcp_offset);
    TEST_ASSERT_EQUAL_MEMORY(rig.tcp_offset_sigma, same.tcp_offset_sigma,
                             sizeof rig.tcp_offset_sigma);
    TEST_ASSERT_EQUAL_MEMORY(&rig.frame_delay, &same.frame_delay, sizeof rig.frame_delay);
    TEST_ASSERT_EQUAL_MEMORY(&rig.event_delay, &same.event_delay, sizeof rig.event_delay);
    TEST_ASSERT_EQUAL_MEMORY(&rig.robot_delay, &same.robot_delay, sizeof rig.robot_delay);
}

static void test_the_id_is_of_the_values_and_nothing_else(void)
{
    struct shef_calibration rig = odd_rig();
    struct shef_calibration other = rig;

    memset(other.id, 'x', sizeof other.id);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_calibration_identify(&other, NULL));
    TEST_ASSERT_EQUAL_STRING(rig.id, other.id);
    other.event.sigma.cy_px = 3.0000000000000004;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_calibration_identify(&other, NULL));
    TEST_ASSERT_NOT_EQUAL(0, strcmp(rig.id, other.id));
}

static void test_the_example_is_the_papers_rig(void)
{
    const struct shef_calibration rig = shef_calibration_paper_rig();
    struct shef_calibration from_file;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_calibration_read(shef_test_source("config/calibration.example.yaml"), &from_file,
                              &err),
        err.text);
    TEST_ASSERT_EQUAL_STRING(rig.id, from_file.id);
}

static void test_a_file_changed_by_hand_says_so(void)
{
    struct shef_calibration rig;
    const char *path = shef_test_temp_path("calibration.yaml");

    rig = odd_rig();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_calibration_write(path, &rig, NULL));
    expect_refused(with(load(path), "1302.7", "1302.8"), "line 2, key 'id'", "remove this line");
    with(text, "\nid: ", "\n#id: ");
    TEST_ASSERT_EQUAL(SHEF_OK, shef_calibration_parse("rig.yaml", (const uint8_t *)text,
                                                      strlen(text), &rig, NULL));
    TEST_ASSERT_EQUAL_DOUBLE(1302.8, rig.frame.model.fy_px);
}

static void test_wrong_keys_are_named_with_their_line(void)
{
    expect_refused(with(example(), "profile: wide", "profile: wide\nprophile: wide"), "line ",
                   "there is no key 'prophile'");
    expect_refused(with(example(), "  focal_px: [1301, 1301]\n", ""),
                   "the key 'focal_px' is missing in 'frame_camera'", "line 8");
    expect_refused(with(example(), "tcp_offset: ", "offset: "), "there is no key 'offset'", "line");
    expect_refused(with(example(), "robot_delay:", NULL), "the key 'robot_delay' is missing", "");
    expect_refused(with(example(), "profile: wide", "profile: wide\nprofile: wide"), "line",
                   "already seen");
}

static void test_wrong_values_are_named_with_their_line(void)
{
    expect_refused(with(example(), "[1301, 1301]", "[1301, far]"), "frame_camera.focal_px.1",
                   "far");
    expect_refused(with(example(), "[1301, 1301]", "[1301]"), "key 'frame_camera.focal_px",
                   "Insufficient entries");
    expect_refused(with(example(), "[1301, 1301]", "1301"), "key 'frame_camera.focal_px'",
                   "SEQUENCE");
    expect_refused(with(example(), "[1301, 1301]", "[1301, nan]"), "key 'frame_camera.focal_px'",
                   "not in the range");
    expect_refused(with(example(), "[1301, 1301]", "[1301, 0.5]"), "key 'frame_camera.focal_px'",
                   "0.5 is not in the range");
    expect_refused(with(example(), "[2048, 1536]", "[20480, 1536]"), "key 'frame_camera.size_px'",
                   "20480 is not in the range 1 to 4096");
    expect_refused(with(example(), "[2048, 1536]", "[2048, -1]"), "key 'frame_camera.size_px'",
                   "-1 is not in the range");
    expect_refused(with(example(), "[-0.06544, 0, 0]", "[-65.44, 0, 0]"),
                   "key 'T_event_frame.position_m'", "-65.44");
    expect_refused(with(example(), "wide", "narrow"), "key 'profile'", "'wide' and 'paper'");
    expect_refused(with(example(), "version: 1", "version: 0"), "key 'version'", "line");
    expect_refused(with(example(), "  us: ", "  us: 1e7 #"), "key 'frame_delay.us'", "1e+07");
    expect_refused(with(example(), "  us: ", "  us: inf #"), "key 'frame_delay.us'", "inf");
}

static void test_what_is_no_rotation_is_refused(void)
{
    expect_refused(with(example(), "- [1, 0, 0]", "- [0.999, 0, 0]"), "T_event_frame.rotation",
                   "off by 0.002");
    expect_refused(with(example(), "- [0, 0, 1]", "- [0, 0, -1]"), "T_event_frame.rotation",
                   "right-handed");
    expect_refused(with(example(), "- [0, 0, 1]", "- [0, nan, 1]"), "T_event_frame.rotation",
                   "nan");
}

static void test_what_is_no_calibration_is_refused(void)
{
    expect_refused("", "empty", "");
    expect_refused("# nothing\n", "empty", "");
    expect_refused("hello", "holds something else", "'key: value'");
    expect_refused("a: [1\n", "line", "this is no YAML");
    expect_refused("root:x:0:0\n", "holds something else", "'key: value'");
    expect_refused("- 1\n- 2\n", "holds something else", "'key: value'");
    expect_refused(with(with(example(), "us: 0", "us: &none 0"), "us: 0", "us: *none"), "line",
                   "alias");
    expect_refused(with(example(), "version: 1", "version: \"1\x01\""), "line", "");
}

static void test_a_later_version_is_not_guessed_at(void)
{
    struct shef_calibration calibration;
    struct shef_error err = { 0 };

    with(example(), "version: 1", "version: 2");
    TEST_ASSERT_EQUAL(SHEF_ERR_UNSUPPORTED,
                      shef_calibration_parse("rig.yaml", (const uint8_t *)text, strlen(text),
                                             &calibration, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "version 2"));
}

static void test_a_missing_file_is_named(void)
{
    struct shef_calibration calibration;
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND,
                      shef_calibration_read("no/such.yaml", &calibration, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "no/such.yaml"));
}

static void test_nothing_is_written_that_could_not_be_read(void)
{
    struct shef_calibration rig = odd_rig();
    struct shef_error err = { 0 };
    const char *path = shef_test_temp_path("refused.yaml");
    uint8_t *bytes;
    size_t n_bytes;

    rig.event.model.fx_px = NAN;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, shef_calibration_write(path, &rig, &err));
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID, err.code);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "event_camera.focal_px"), err.text);
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_file_read(path, 100, &bytes, &n_bytes, NULL));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_the_papers_rig_is_that_of_the_paper);
    RUN_TEST(test_every_value_comes_back_exactly);
    RUN_TEST(test_the_id_is_of_the_values_and_nothing_else);
    RUN_TEST(test_the_example_is_the_papers_rig);
    RUN_TEST(test_a_file_changed_by_hand_says_so);
    RUN_TEST(test_wrong_keys_are_named_with_their_line);
    RUN_TEST(test_wrong_values_are_named_with_their_line);
    RUN_TEST(test_what_is_no_rotation_is_refused);
    RUN_TEST(test_what_is_no_calibration_is_refused);
    RUN_TEST(test_a_later_version_is_not_guessed_at);
    RUN_TEST(test_a_missing_file_is_named);
    RUN_TEST(test_nothing_is_written_that_could_not_be_read);
    return UNITY_END();
}
