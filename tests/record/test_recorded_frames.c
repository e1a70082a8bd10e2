/* Frames come back as they were recorded, in order and at any place, or are known to be missing. */
#include "record/recorded_frames.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/file.h"
#include "record/frame_recorder.h"
#include "record/verify.h"
#include "support/support.h"

#define WIDTH_PX  36
#define HEIGHT_PX 20
#define ROW_BYTES 40
#define N_BYTES   (ROW_BYTES * HEIGHT_PX)
#define N_FRAMES  30

static struct shef_recording_writer recording;
static struct shef_frame_recorder *recorder;
static struct shef_recorded_frames *frames;
static struct shef_recorded_frame frame;
static struct shef_error err;
static char folder[4200];

void tearDown(void)
{
    shef_recorded_frames_close(frames);
    frames = NULL;
}

static struct shef_frame_recorder_config small_config(void)
{
    struct shef_frame_recorder_config config = shef_frame_recorder_default_config(
        &(struct shef_frame_part){ WIDTH_PX, HEIGHT_PX, SHEF_PFNC_MONO8 });

    config.vendor = "Maker";
    config.serial = "123 \n45";
    config.limits.segment_bytes = 4 * N_BYTES;
    config.limits.sync_ns = 0;
    return config;
}

static struct shef_frame_info info_of(int i)
{
    return (struct shef_frame_info){
        .number = 1000 + (uint64_t)i,
        .time = { INT64_C(5000000000) + i * INT64_C(18518519) },
        .arrived = { 77 + i * INT64_C(18518519) },
        .exposure_us = 4000 + (uint32_t)i,
        .gain_mdb = 1500,
        .width_px = WIDTH_PX,
        .height_px = HEIGHT_PX,
        .row_bytes = ROW_BYTES,
        .pixel_format = SHEF_PFNC_MONO8,
    };
}

/* Even frames are noise, odd ones compress well. */
static void paint(uint8_t pixels[N_BYTES], int i)
{
    struct shef_test_random random = { .state = (uint64_t)i + 1 };

    for (int k = 0; k < N_BYTES; k++)
        pixels[k] = i % 2 ? (uint8_t)(i + k / 100) : (uint8_t)shef_test_random_u64(&random);
}

static void start(const struct shef_frame_recorder_config *config)
{
    static int n_made;
    char name[32];

    snprintf(name, sizeof name, "frames%d", n_made++);
    snprintf(folder, sizeof folder, "%s", shef_test_temp_path(name));
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK,
        shef_recording_writer_create(
            &recording, folder, &(struct shef_recording_writer_config){ .software = "test" }, &err),
        err.text);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_frame_recorder_start(&recording, config, &recorder, &err), err.text);
}

static void record(int i)
{
    const struct shef_frame_info info = info_of(i);
    uint8_t pixels[N_BYTES];

    paint(pixels, i);
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_frame_recorder_write(recorder, &info, pixels, 0, &err),
                              err.text);
}

static void stop(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_frame_recorder_stop(recorder, &err), err.text);
    TEST_ASSERT_EQUAL_MESSAGE(
        SHEF_OK, shef_recording_writer_close(&recording, true, NULL, NULL, &err), err.text);
}

static void make_recording(bool with_lz4)
{
    struct shef_frame_recorder_config config = small_config();

    config.with_lz4 = with_lz4;
    start(&config);
    for (int i = 0; i < N_FRAMES; i++)
        record(i);
    stop();
}

static void open_frames(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, shef_recorded_frames_open(folder, &frames, &err), err.text);
}

static void expect_frame(int i)
{
    const struct shef_frame_info info = info_of(i);
    uint8_t pixels[N_BYTES];

    paint(pixels, i);
    TEST_ASSERT_EQUAL_UINT64(info.number, frame.info.number);
    TEST_ASSERT_EQUAL_INT64(info.time.ns, frame.info.time.ns);
    TEST_ASSERT_EQUAL_INT64(info.arrived.ns, frame.info.arrived.ns);
    TEST_ASSERT_EQUAL_UINT32(info.exposure_us, frame.info.exposure_us);
    TEST_ASSERT_EQUAL_UINT32(info.gain_mdb, frame.info.gain_mdb);
    TEST_ASSERT_EQUAL_UINT32(info.width_px, frame.info.width_px);
    TEST_ASSERT_EQUAL_UINT32(info.height_px, frame.info.height_px);
    TEST_ASSERT_EQUAL_UINT32(info.row_bytes, frame.info.row_bytes);
    TEST_ASSERT_EQUAL_UINT32(info.pixel_format, frame.info.pixel_format);
    TEST_ASSERT_EQUAL_UINT32(0, frame.info.status);
    TEST_ASSERT_EQUAL_MEMORY(pixels, frame.pixels, N_BYTES);
}

static void change_file(const char *name, size_t at, size_t n_cut)
{
    char path[4300];
    uint8_t *bytes;
    size_t n_bytes;

    snprintf(path, sizeof path, "%s/%s", folder, name);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_read(path, 1 << 24, &bytes, &n_bytes, &err));
    bytes[at] ^= 1;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_file_replace(path, bytes, n_bytes - n_cut, &err));
    free(bytes);
}

static bool has_note(const char *text)
{
    for (int i = 0; shef_recorded_frames_note(frames, i); i++)
        if (strstr(shef_recorded_frames_note(frames, i), text))
            return true;
    return false;
}

static void expect_all_in_order(void)
{
    open_frames();
    TEST_ASSERT_EQUAL_UINT32(N_FRAMES, shef_recorded_frames_count(frames));
    TEST_ASSERT_EQUAL_UINT32(N_BYTES, shef_recorded_frames_max_bytes(frames));
    for (int i = 0; i < N_FRAMES; i++) {
        TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_frames_next(frames, &frame, &err));
        expect_frame(i);
        TEST_ASSERT_EQUAL_UINT32((uint32_t)i, frame.index);
        TEST_ASSERT_EQUAL(i > 0, frame.follows);
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_frames_next(frames, &frame, &err));
    TEST_ASSERT_NULL(shef_recorded_frames_note(frames, 0));
}

static void test_frames_come_back_in_order(void)
{
    make_recording(false);
    expect_all_in_order();
    TEST_ASSERT_EQUAL_UINT32(WIDTH_PX, shef_recorded_frames_format(frames)->width_px);
    TEST_ASSERT_EQUAL_STRING("Maker", shef_recorded_frames_text(frames, "vendor"));
    TEST_ASSERT_EQUAL_STRING("123 ?45", shef_recorded_frames_text(frames, "serial"));
    TEST_ASSERT_EQUAL_STRING("", shef_recorded_frames_text(frames, "model"));
}

static void test_compressed_frames_come_back_the_same(void)
{
    struct shef_manifest manifest;

    make_recording(true);
    expect_all_in_order();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
    /* Noise stays raw, the other half shrinks to next to nothing. */
    TEST_ASSERT_GREATER_THAN_UINT64(N_FRAMES / 2 * N_BYTES,
                                    manifest.parts[SHEF_PART_FRAMES].n_bytes);
    TEST_ASSERT_LESS_THAN_UINT64(N_FRAMES * 6 / 10 * N_BYTES,
                                 manifest.parts[SHEF_PART_FRAMES].n_bytes);
    shef_manifest_free(&manifest);
}

static void test_any_frame_can_be_read_at_any_time(void)
{
    struct shef_test_random random = shef_test_random_start();
    uint8_t *room;
    uint32_t index = 0;

    make_recording(true);
    open_frames();
    for (int k = 0; k < 100; k++) {
        const int i = shef_test_random_range(&random, 0, N_FRAMES - 1);

        TEST_ASSERT_EQUAL_UINT64(1000 + (uint64_t)i,
                                 shef_recorded_frames_info(frames, (uint32_t)i)->number);
        TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_frames_read(frames, (uint32_t)i, &frame, &err));
        expect_frame(i);
    }
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_frames_next(frames, &frame, &err));
    expect_frame(0);
    shef_recorded_frames_seek(frames, 17);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_frames_next(frames, &frame, &err));
    expect_frame(17);
    TEST_ASSERT_TRUE(shef_recorded_frames_find(frames, 1011, &index));
    TEST_ASSERT_EQUAL_UINT32(11, index);
    TEST_ASSERT_FALSE(shef_recorded_frames_find(frames, 1030, &index));
    room = malloc(shef_recorded_frames_max_bytes(frames));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_frames_read_into(frames, 3, room, &frame, &err));
    TEST_ASSERT_EQUAL_PTR(room, frame.pixels);
    expect_frame(3);
    free(room);
}

static void test_lost_frames_are_counted_and_judged(void)
{
    struct shef_frame_recorder_config config = small_config();
    const struct shef_frame_info sixth = info_of(6);
    uint8_t pixels[N_BYTES] = { 0 };
    struct shef_manifest manifest;

    start(&config);
    record(0);
    record(3); /* two are missing by the camera's count */
    TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_recorder_write(recorder, &sixth, pixels, 5, &err));
    record(1); /* the camera has begun anew */
    stop();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
    TEST_ASSERT_EQUAL(SHEF_VERDICT_GAPS, manifest.verdict);
    TEST_ASSERT_NOT_NULL(strstr(manifest.reason, "7 frames were lost"));
    TEST_ASSERT_EQUAL_UINT64(7, manifest.parts[SHEF_PART_FRAMES].n_lost);
    TEST_ASSERT_EQUAL_UINT64(4, manifest.parts[SHEF_PART_FRAMES].n_items);
    TEST_ASSERT_EQUAL_INT64(5000000, manifest.parts[SHEF_PART_FRAMES].first_us);
    shef_manifest_free(&manifest);
    open_frames();
    shef_recorded_frames_seek(frames, 1);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_frames_next(frames, &frame, &err));
    TEST_ASSERT_FALSE(frame.follows);
    TEST_ASSERT_EQUAL_UINT32(2, frame.n_lost_before);
    TEST_ASSERT_TRUE(has_note("7 were lost while recording"));
}

static void test_incomplete_frames_are_judged(void)
{
    struct shef_frame_recorder_config config = small_config();
    struct shef_frame_info torn = info_of(0);
    uint8_t pixels[N_BYTES] = { 0 };
    struct shef_manifest manifest;

    start(&config);
    torn.status = 3;
    TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_recorder_write(recorder, &torn, pixels, 0, &err));
    stop();
    TEST_ASSERT_EQUAL(SHEF_OK, shef_manifest_read(folder, &manifest, &err));
    TEST_ASSERT_EQUAL(SHEF_VERDICT_GAPS, manifest.verdict);
    TEST_ASSERT_NOT_NULL(strstr(manifest.reason, "1 frames are incomplete"));
    shef_manifest_free(&manifest);
    open_frames();
    TEST_ASSERT_EQUAL_UINT32(3, shef_recorded_frames_info(frames, 0)->status);
}

static void test_a_damaged_frame_is_left_out_and_the_next_one_says_so(void)
{
    make_recording(false);
    change_file("frames/000001.blk", 1000, 0); /* the sixth frame: 4 are in the first segment */
    open_frames();
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_recorded_frames_read(frames, 5, &frame, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "does not match its checksum"));
    for (int i = 0; i < N_FRAMES; i++) {
        if (i == 5)
            continue;
        TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_frames_next(frames, &frame, &err));
        expect_frame(i);
        TEST_ASSERT_EQUAL(i != 0 && i != 6, frame.follows);
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_frames_next(frames, &frame, &err));
    TEST_ASSERT_TRUE(has_note("block 5 in segment 1"));
}

static void test_a_cut_recording_keeps_what_is_whole(void)
{
    make_recording(false);
    change_file("frames/000007.blk", 0, 10);
    change_file("frames/000007.blk", 0, 0); /* the front is damaged twice, that is not */
    change_file("frames/000003.idx", 5 * 128 - 1, 1);
    open_frames();
    /* The last block of segment 3 has no record, the last one of 7 is cut. */
    TEST_ASSERT_EQUAL_UINT32(N_FRAMES - 2, shef_recorded_frames_count(frames));
    TEST_ASSERT_EQUAL_UINT64(1, shef_recorded_frames_damage(frames)->n_cut_blocks);
    TEST_ASSERT_EQUAL_UINT64(1, shef_recorded_frames_damage(frames)->n_bad_records);
    for (int i = 0; i < N_FRAMES - 1; i++) {
        if (i == 15)
            continue;
        TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_frames_next(frames, &frame, &err));
        expect_frame(i);
        TEST_ASSERT_EQUAL(i != 0 && i != 16, frame.follows);
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_frames_next(frames, &frame, &err));
}

static void test_a_recording_that_was_never_closed_is_read(void)
{
    struct shef_frame_recorder_config config = small_config();

    start(&config);
    for (int i = 0; i < 9; i++)
        record(i);
    open_frames();
    for (int i = 0; i < 9; i++) {
        TEST_ASSERT_EQUAL(SHEF_OK, shef_recorded_frames_next(frames, &frame, &err));
        expect_frame(i);
    }
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_frames_next(frames, &frame, &err));
    stop();
}

static void test_wrong_checksums_of_compressed_frames_are_not_believed(void)
{
    uint32_t n_intact = 0;

    make_recording(true);
    change_file("frames/000000.blk", 60, 0);
    open_frames();
    while (shef_recorded_frames_next(frames, &frame, &err) == SHEF_OK)
        n_intact++;
    TEST_ASSERT_EQUAL_UINT32(N_FRAMES - 1, n_intact);
}

static void test_what_is_not_there_is_said(void)
{
    struct shef_frame_recorder_config config = small_config();

    start(&config);
    stop();
    TEST_ASSERT_EQUAL(SHEF_ERR_EMPTY, shef_recorded_frames_open(folder, &frames, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "ended before anything was recorded"));
    snprintf(folder + strlen(folder), 10, "/frames");
    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND, shef_recorded_frames_open(folder, &frames, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "no frame part"));
    frames = NULL;
}

static void test_impossible_frames_are_refused_with_a_sentence(void)
{
    struct shef_frame_recorder_config config = small_config();
    struct shef_frame_info info = info_of(0);
    uint8_t pixels[N_BYTES] = { 0 };

    start(&config);
    info.row_bytes = WIDTH_PX - 1;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_frame_recorder_write(recorder, &info, pixels, 0, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "rows of 35 bytes"));
    info = info_of(0);
    info.height_px = 5000;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_frame_recorder_write(recorder, &info, pixels, 0, &err));
    record(0);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_frame_recorder_stop(recorder, &err));
    config.format.width_px = 0;
    TEST_ASSERT_EQUAL(SHEF_ERR_INVALID,
                      shef_frame_recorder_start(&recording, &config, &recorder, &err));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_writer_close(&recording, false, NULL, NULL, &err));
}

/* Rows of one bit a pixel are shorter than who goes by the part's format would read. */
static void test_frames_of_another_size_or_format_are_not_usable(void)
{
    const struct shef_frame_part part = { WIDTH_PX, HEIGHT_PX, SHEF_PFNC_MONO8 };
    const struct shef_frame_info good = { .width_px = WIDTH_PX,
                                          .height_px = HEIGHT_PX,
                                          .pixel_format = SHEF_PFNC_MONO8 };
    struct shef_frame_info info = good;

    TEST_ASSERT_TRUE(shef_frame_is_usable(&info, &part));
    info.status = 1;
    TEST_ASSERT_FALSE(shef_frame_is_usable(&info, &part));
    info = good;
    info.width_px--;
    TEST_ASSERT_FALSE(shef_frame_is_usable(&info, &part));
    info = good;
    info.height_px++;
    TEST_ASSERT_FALSE(shef_frame_is_usable(&info, &part));
    info = good;
    info.pixel_format = 0x01010037; /* Mono1p */
    TEST_ASSERT_FALSE(shef_frame_is_usable(&info, &part));
}

static void test_verify_checks_frames_too(void)
{
    static struct shef_verify_report report;

    make_recording(false);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_verify(folder, NULL, NULL, &report, &err));
    TEST_ASSERT_EQUAL_UINT64(0, report.n_problems);
    TEST_ASSERT_EQUAL_UINT64(N_FRAMES, report.n_blocks);
    change_file("frames/000001.blk", 1000, 0);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_recording_verify(folder, NULL, NULL, &report, &err));
    TEST_ASSERT_EQUAL_UINT64(3, report.n_problems); /* the block, the gap, the file */
    TEST_ASSERT_NOT_NULL(strstr(report.problems[0], "frame part: 1 blocks do not match"));
    TEST_ASSERT_EQUAL_UINT64(N_FRAMES - 1, report.n_blocks);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_frames_come_back_in_order);
    RUN_TEST(test_compressed_frames_come_back_the_same);
    RUN_TEST(test_any_frame_can_be_read_at_any_time);
    RUN_TEST(test_lost_frames_are_counted_and_judged);
    RUN_TEST(test_incomplete_frames_are_judged);
    RUN_TEST(test_a_damaged_frame_is_left_out_and_the_next_one_says_so);
    RUN_TEST(test_a_cut_recording_keeps_what_is_whole);
    RUN_TEST(test_a_recording_that_was_never_closed_is_read);
    RUN_TEST(test_wrong_checksums_of_compressed_frames_are_not_believed);
    RUN_TEST(test_what_is_not_there_is_said);
    RUN_TEST(test_impossible_frames_are_refused_with_a_sentence);
    RUN_TEST(test_frames_of_another_size_or_format_are_not_usable);
    RUN_TEST(test_verify_checks_frames_too);
    return UNITY_END();
}
