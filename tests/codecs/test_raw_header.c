#include "codecs/raw_header.h"

#include <string.h>

#include "support/support.h"

static struct shef_raw_header header;
static struct shef_error err;

static enum shef_err parse(const char *text)
{
    err = (struct shef_error){ 0 };
    return shef_raw_header_parse((const uint8_t *)text, strlen(text), &header, &err);
}

static void expect_parsed(const char *text)
{
    TEST_ASSERT_EQUAL_MESSAGE(SHEF_OK, parse(text), err.text);
}

static void expect_refused(enum shef_err code, const char *text, const char *sentence)
{
    TEST_ASSERT_EQUAL(code, parse(text));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, sentence), err.text);
}

static void test_a_header_of_2020_gives_format_and_camera(void)
{
    const char *const text = "% Date 2020-09-14 09:03:25\n% firmware_version 2.0.2\n"
                             "% integrator_name Prophesee\n% plugin_name hal_plugin_gen3_fx3\n"
                             "% serial_number 30384338\n% system_ID 21\n% evt 2.0\npP\x01";

    expect_parsed(text);
    TEST_ASSERT_EQUAL(SHEF_EVT2, header.format);
    TEST_ASSERT_EQUAL(SHEF_RAW_SIZE_OF_SYSTEM, header.size);
    TEST_ASSERT_EQUAL_UINT32(640, header.width_px);
    TEST_ASSERT_EQUAL_UINT32(480, header.height_px);
    TEST_ASSERT_EQUAL_UINT64(strlen(text) - 3, header.n_bytes);
    TEST_ASSERT_EQUAL_INT32(21, header.system_id);
    TEST_ASSERT_FALSE(header.has_end);
    TEST_ASSERT_EQUAL_STRING("2020-09-14 09:03:25", header.date);
    TEST_ASSERT_EQUAL_STRING("30384338", header.serial);
    TEST_ASSERT_EQUAL_STRING("hal_plugin_gen3_fx3", header.plugin);
}

static void test_a_newer_header_gives_format_and_size_in_one_line(void)
{
    const char *const text = "% camera_integrator_name Prophesee\n% date 2024-01-02 03:04:05\n"
                             "% evt 3.0\n% format EVT3;height=720;width=1280\n"
                             "% geometry 1280x720\n% sensor_name IMX636\n% end\n% not a line\n";

    expect_parsed(text);
    TEST_ASSERT_EQUAL(SHEF_EVT3, header.format);
    TEST_ASSERT_EQUAL(SHEF_RAW_SIZE_GIVEN, header.size);
    TEST_ASSERT_EQUAL_UINT32(1280, header.width_px);
    TEST_ASSERT_EQUAL_UINT32(720, header.height_px);
    TEST_ASSERT_TRUE(header.has_end);
    TEST_ASSERT_EQUAL_STRING("IMX636", header.sensor);
    TEST_ASSERT_EQUAL_PTR(strstr(text, "% not"), text + header.n_bytes);
}

static void test_evt21_takes_its_word_order_from_wherever_it_is_said(void)
{
    expect_parsed("% format EVT21;endianness=legacy;height=720;width=1280\n% end\n");
    TEST_ASSERT_EQUAL(SHEF_EVT21_LEGACY, header.format);
    expect_parsed("% format EVT21;height=320;width=320;endianness=little\n% end\n");
    TEST_ASSERT_EQUAL(SHEF_EVT21, header.format);
    expect_parsed("% endianness legacy\n% evt 2.1\n% end\n");
    TEST_ASSERT_EQUAL(SHEF_EVT21_LEGACY, header.format);
    expect_parsed("% evt 2.1\n% system_ID 49\n% end\n");
    TEST_ASSERT_EQUAL(SHEF_EVT21_LEGACY, header.format);
    expect_parsed("% evt 2.1\n% system_ID 59\n% end\n");
    TEST_ASSERT_EQUAL(SHEF_EVT21, header.format);
    expect_parsed("% evt 2.1\n% end\n");
    TEST_ASSERT_EQUAL(SHEF_EVT21, header.format);
}

static void test_the_format_line_wins_over_evt_in_any_order(void)
{
    expect_parsed("% format EVT3;height=480;width=640\n% evt 2.0\n% end\n");
    TEST_ASSERT_EQUAL(SHEF_EVT3, header.format);
    expect_parsed("% evt 2.0\n% format EVT3;height=480;width=640\n% end\n");
    TEST_ASSERT_EQUAL(SHEF_EVT3, header.format);
}

static void test_a_size_that_is_missing_or_absurd_leaves_every_address_valid(void)
{
    expect_parsed("% evt 3.0\n% end\n");
    TEST_ASSERT_EQUAL(SHEF_RAW_SIZE_UNKNOWN, header.size);
    TEST_ASSERT_EQUAL_UINT32(2048, header.width_px);
    TEST_ASSERT_EQUAL_UINT32(2048, header.height_px);

    static const char *const absurd[] = {
        "% evt 3.0\n% geometry 100000x3\n% end\n",
        "% evt 3.0\n% geometry 0x480\n% end\n",
        "% evt 3.0\n% geometry 640\n% end\n",
        "% evt 3.0\n% geometry -640x480\n% end\n",
        "% evt 3.0\n% geometry 99999999999999999999x1\n% end\n",
        "% format EVT3;height=480\n% end\n",
        "% format EVT3;height=;width=640\n% end\n",
        "% format EVT3;height=2049;width=640\n% end\n",
    };

    for (size_t i = 0; i < sizeof absurd / sizeof absurd[0]; i++) {
        expect_parsed(absurd[i]);
        TEST_ASSERT_EQUAL_MESSAGE(SHEF_RAW_SIZE_ABSURD, header.size, absurd[i]);
        TEST_ASSERT_EQUAL_UINT32(2048, header.width_px);
        TEST_ASSERT_NOT_EQUAL(0, strlen(header.size_text));
    }
}

static void test_event_data_that_looks_like_a_line_is_none(void)
{
    /* An old header has no end, and the data starts with the bytes of "% ". */
    static const uint8_t bytes[] = "% evt 3.0\n% \x01\x02\x03\n";

    TEST_ASSERT_EQUAL(SHEF_OK, shef_raw_header_parse(bytes, sizeof bytes - 1, &header, &err));
    TEST_ASSERT_EQUAL_UINT64(10, header.n_bytes);
}

static void test_windows_line_ends_and_wide_spaces_are_understood(void)
{
    expect_parsed("% evt   2.0\r\n%  geometry  304x240 \r\n% end\r\n");
    TEST_ASSERT_EQUAL(SHEF_EVT2, header.format);
    TEST_ASSERT_EQUAL_UINT32(304, header.width_px);
    TEST_ASSERT_TRUE(header.has_end);
}

static void test_what_is_no_recording_gets_one_sentence(void)
{
    expect_refused(SHEF_ERR_FORMAT, "hello\n", "not a RAW recording");
    expect_refused(SHEF_ERR_FORMAT, "", "not a RAW recording");
    expect_refused(SHEF_ERR_FORMAT, "% Date 2020-01-01\n% end\n", "names no event format");
    expect_refused(SHEF_ERR_FORMAT, "% evt 2.0\n% geom", "ends inside its header");
    expect_refused(SHEF_ERR_UNSUPPORTED, "% evt 4.0\n% end\n", "'4.0' cannot be read");
    expect_refused(SHEF_ERR_UNSUPPORTED, "% format HISTO3D;height=320;width=320\n% end\n",
                   "'HISTO3D' cannot be read");
}

static void test_headers_written_are_read_back(void)
{
    for (int format = 0; format < SHEF_EVT_FORMATS; format++)
        for (int generation = 0; generation < 2; generation++) {
            const struct shef_raw_header written = {
                .format = (enum shef_evt_format)format,
                .width_px = 640,
                .height_px = 480,
                .system_id = 40,
                .date = "2021-09-27 10:00:00",
                .serial = "00001234",
            };
            char text[SHEF_RAW_HEADER_BYTES];
            const size_t n =
                shef_raw_header_write(&written, (enum shef_raw_generation)generation, text);

            TEST_ASSERT_EQUAL_UINT64(strlen(text), n);
            expect_parsed(text);
            TEST_ASSERT_EQUAL_UINT64(n, header.n_bytes);
            TEST_ASSERT_EQUAL(format, header.format);
            TEST_ASSERT_EQUAL(SHEF_RAW_SIZE_GIVEN, header.size);
            TEST_ASSERT_EQUAL_UINT32(640, header.width_px);
            TEST_ASSERT_EQUAL_UINT32(480, header.height_px);
            TEST_ASSERT_EQUAL_INT32(40, header.system_id);
            TEST_ASSERT_EQUAL_STRING(written.date, header.date);
            TEST_ASSERT_EQUAL_STRING(written.serial, header.serial);
            TEST_ASSERT_TRUE(header.has_end);
            TEST_ASSERT_EQUAL(generation == SHEF_RAW_NEW, strstr(text, "% format ") != NULL);
        }
}

static void test_texts_of_any_kind_cannot_break_the_header(void)
{
    struct shef_raw_header written = {
        .format = SHEF_EVT3, .width_px = 640, .height_px = 480, .system_id = -1
    };
    char text[SHEF_RAW_HEADER_BYTES];

    memset(written.date, 'x', sizeof written.date - 1);
    memset(written.sensor, '\n', sizeof written.sensor - 1);
    memset(written.plugin, 0xff, sizeof written.plugin - 1);
    memset(written.integrator, '%', sizeof written.integrator - 1);
    strcpy(written.serial, "1\n% end\n% evt 2.0");
    const size_t n = shef_raw_header_write(&written, SHEF_RAW_NEW, text);

    TEST_ASSERT_EQUAL_UINT64(strlen(text), n);
    expect_parsed(text);
    TEST_ASSERT_EQUAL(SHEF_EVT3, header.format);
    TEST_ASSERT_EQUAL_UINT64(strlen(text), header.n_bytes);
    TEST_ASSERT_EQUAL_UINT32(640, header.width_px);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_a_header_of_2020_gives_format_and_camera);
    RUN_TEST(test_a_newer_header_gives_format_and_size_in_one_line);
    RUN_TEST(test_evt21_takes_its_word_order_from_wherever_it_is_said);
    RUN_TEST(test_the_format_line_wins_over_evt_in_any_order);
    RUN_TEST(test_a_size_that_is_missing_or_absurd_leaves_every_address_valid);
    RUN_TEST(test_event_data_that_looks_like_a_line_is_none);
    RUN_TEST(test_windows_line_ends_and_wide_spaces_are_understood);
    RUN_TEST(test_what_is_no_recording_gets_one_sentence);
    RUN_TEST(test_headers_written_are_read_back);
    RUN_TEST(test_texts_of_any_kind_cannot_break_the_header);
    return UNITY_END();
}
