#include "core/png_io.h"

#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "core/memory.h"
#include "support/support.h"

static struct shef_image_u8 image;
static struct shef_image_u16 image_16;

void tearDown(void)
{
    shef_image_destroy_u8(&image);
    shef_image_destroy_u16(&image_16);
}

/* Writes a picture of any pixel type with libpng itself. Rows are packed and n_row_bytes long. */
static void write_any(const char *path, int color_type, int n_bits, int interlace, uint32_t width,
                      uint32_t height, const uint8_t *pixels, size_t n_row_bytes)
{
    FILE *file = fopen(path, "wb");
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png_create_info_struct(png);
    png_bytep rows[16];
    uint8_t copy[16][64];
    const png_color palette[2] = { { 0, 0, 0 }, { 255, 255, 255 } };

    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_TRUE(height <= 16 && n_row_bytes <= 64);
    png_init_io(png, file);
    png_set_IHDR(png, info, width, height, n_bits, color_type, interlace,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (color_type == PNG_COLOR_TYPE_PALETTE)
        png_set_PLTE(png, info, palette, 2);
    for (uint32_t y = 0; y < height; y++) {
        memcpy(copy[y], pixels + y * n_row_bytes, n_row_bytes);
        rows[y] = copy[y];
    }
    png_write_info(png, info);
    png_write_image(png, rows);
    png_write_end(png, NULL);
    png_destroy_write_struct(&png, &info);
    fclose(file);
}

static void test_grey_8_and_16_bit_come_back_as_written(void)
{
    struct shef_test_random random = shef_test_random_start();
    struct shef_image_u8 written;
    struct shef_image_u16 written_16;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&written, 67, 9, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u16(&written_16, 67, 9, NULL));
    for (int32_t y = 0; y < 9; y++)
        for (int32_t x = 0; x < 67; x++) {
            shef_row_u8(written, y)[x] = (uint8_t)shef_test_random_u64(&random);
            shef_row_u16(written_16, y)[x] = (uint16_t)shef_test_random_u64(&random);
        }
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_write_u8(shef_test_temp_path("8.png"), written, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_read_u8(shef_test_temp_path("8.png"), &image, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_write_u16(shef_test_temp_path("16.png"), written_16, NULL));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_read_u16(shef_test_temp_path("16.png"), &image_16, NULL));
    TEST_ASSERT_EQUAL_INT32(67, image.width_px);
    TEST_ASSERT_EQUAL_INT32(9, image_16.height_px);
    for (int32_t y = 0; y < 9; y++) {
        TEST_ASSERT_EQUAL_MEMORY(shef_row_u8(written, y), shef_row_u8(image, y), 67);
        TEST_ASSERT_EQUAL_MEMORY(shef_row_u16(written_16, y), shef_row_u16(image_16, y), 67 * 2);
    }
    shef_image_destroy_u8(&written);
    shef_image_destroy_u16(&written_16);
}

static void test_16_bit_samples_are_big_endian_on_disk(void)
{
    const uint8_t pixels[] = { 0x12, 0x34, 0xff, 0x00 };

    write_any(shef_test_temp_path("be.png"), PNG_COLOR_TYPE_GRAY, 16, PNG_INTERLACE_NONE, 2, 1,
              pixels, 4);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_read_u16(shef_test_temp_path("be.png"), &image_16, NULL));
    TEST_ASSERT_EQUAL_HEX16(0x1234, image_16.data[0]);
    TEST_ASSERT_EQUAL_HEX16(0xff00, image_16.data[1]);
}

static void test_a_1_bit_map_becomes_0_and_255(void)
{
    const uint8_t pixels[] = { 0xa0, 0x80, 0x5f, 0x00 }; /* 10100000 1 / 01011111 0 */
    const uint8_t expected[2][9] = { { 255, 0, 255, 0, 0, 0, 0, 0, 255 },
                                     { 0, 255, 0, 255, 255, 255, 255, 255, 0 } };

    write_any(shef_test_temp_path("1.png"), PNG_COLOR_TYPE_GRAY, 1, PNG_INTERLACE_NONE, 9, 2,
              pixels, 2);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_read_u8(shef_test_temp_path("1.png"), &image, NULL));
    TEST_ASSERT_EQUAL_MEMORY(expected[0], shef_row_u8(image, 0), 9);
    TEST_ASSERT_EQUAL_MEMORY(expected[1], shef_row_u8(image, 1), 9);
}

static void test_interlaced_files_are_read(void)
{
    uint8_t pixels[8][10];

    for (int i = 0; i < 80; i++)
        pixels[i / 10][i % 10] = (uint8_t)(3 * i);
    write_any(shef_test_temp_path("i.png"), PNG_COLOR_TYPE_GRAY, 8, PNG_INTERLACE_ADAM7, 10, 8,
              pixels[0], 10);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_read_u8(shef_test_temp_path("i.png"), &image, NULL));
    for (int32_t y = 0; y < 8; y++)
        TEST_ASSERT_EQUAL_MEMORY(pixels[y], shef_row_u8(image, y), 10);
}

static void test_other_pixel_types_are_refused_by_name(void)
{
    static const struct {
        int color_type;
        int n_bits;
        size_t n_row_bytes;
        const char *name;
    } cases[] = {
        { PNG_COLOR_TYPE_RGB, 8, 12, "8-bit RGB;" },
        { PNG_COLOR_TYPE_RGB_ALPHA, 8, 16, "8-bit RGB with alpha;" },
        { PNG_COLOR_TYPE_GRAY_ALPHA, 8, 8, "8-bit grey with alpha;" },
        { PNG_COLOR_TYPE_PALETTE, 8, 4, "8-bit palette;" },
        { PNG_COLOR_TYPE_GRAY, 16, 8, "16-bit grey;" },
    };
    static const uint8_t pixels[64];

    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *path = shef_test_temp_path("other.png");
        struct shef_error err = { 0 };

        write_any(path, cases[i].color_type, cases[i].n_bits, PNG_INTERLACE_NONE, 4, 1, pixels,
                  cases[i].n_row_bytes);
        TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_png_read_u8(path, &image, &err));
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, cases[i].name), err.text);
        TEST_ASSERT_NOT_NULL(strstr(err.text, "must be 1- to 8-bit grey"));
        TEST_ASSERT_NOT_NULL(strstr(err.text, "other.png"));
    }
}

static void test_8_bit_files_are_no_16_bit_files(void)
{
    static const uint8_t pixels[4];
    struct shef_error err = { 0 };

    write_any(shef_test_temp_path("g.png"), PNG_COLOR_TYPE_GRAY, 8, PNG_INTERLACE_NONE, 4, 1,
              pixels, 4);
    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT,
                      shef_png_read_u16(shef_test_temp_path("g.png"), &image_16, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "must be 16-bit grey"));
}

static void test_every_shortening_and_every_flipped_byte_is_safe(void)
{
    struct shef_image_u8 written;
    uint8_t *bytes;
    size_t n_bytes;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_u8(&written, 20, 20, NULL));
    for (int32_t y = 0; y < 20; y++)
        for (int32_t x = 0; x < 20; x++)
            shef_row_u8(written, y)[x] = (uint8_t)(x * y);
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_write_u8(shef_test_temp_path("w.png"), written, NULL));
    shef_image_destroy_u8(&written);
    TEST_ASSERT_EQUAL(
        SHEF_OK, shef_file_read(shef_test_temp_path("w.png"), 1u << 20, &bytes, &n_bytes, NULL));
    for (size_t n_left = 0; n_left < n_bytes; n_left++) {
        TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_png_decode_u8(bytes, n_left, &image, NULL));
        TEST_ASSERT_NULL(image.data);
    }
    for (size_t i = 0; i < n_bytes; i++) {
        bytes[i] ^= 0x21;
        if (shef_png_decode_u8(bytes, n_bytes, &image, NULL) == SHEF_OK)
            shef_image_destroy_u8(&image); /* e.g. a damaged checksum of an optional chunk */
        bytes[i] ^= 0x21;
    }
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_decode_u8(bytes, n_bytes, &image, NULL));
    free(bytes);
}

static void test_a_tiny_file_that_promises_a_huge_image_is_refused(void)
{
    /* 16384 x 16384 px of 8-bit grey, then the first bytes of the data. */
    static const uint8_t bomb[] = { 0x89, 'P',  'N',  'G', '\r', '\n', 0x1a, '\n', 0,    0,
                                    0,    13,   'I',  'H', 'D',  'R',  0,    0,    0x40, 0,
                                    0,    0,    0x40, 0,   8,    0,    0,    0,    0,    0x8c,
                                    0xa3, 0x4f, 0x58, 0,   0,    0,    16,   'I',  'D',  'A',
                                    'T',  0x78, 0x9c, 0,   0,    0,    0,    0,    0,    0 };
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_FORMAT, shef_png_decode_u8(bomb, sizeof bomb, &image, &err));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(err.text, "truncated"), err.text);
}

static void test_colour_pictures_are_written_red_first(void)
{
    struct shef_rgb8 pixels[2] = { { 255, 128, 0 }, { 1, 2, 3 } };
    const struct shef_image_rgb8 picture = { pixels, 2, 1, sizeof pixels };
    png_image reader = { .version = PNG_IMAGE_VERSION };
    uint8_t back[6];

    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_write_rgb8(shef_test_temp_path("c.png"), picture, NULL));
    TEST_ASSERT_TRUE(png_image_begin_read_from_file(&reader, shef_test_temp_path("c.png")));
    TEST_ASSERT_EQUAL_UINT32(2, reader.width);
    reader.format = PNG_FORMAT_RGB;
    TEST_ASSERT_TRUE(png_image_finish_read(&reader, NULL, back, 0, NULL));
    TEST_ASSERT_EQUAL_MEMORY(pixels, back, 6);
}

static void test_a_failed_write_leaves_nothing_and_names_the_file(void)
{
    uint8_t pixel = 7;
    const struct shef_image_u8 tiny = { &pixel, 1, 1, 1 };
    struct shef_error err = { 0 };

    TEST_ASSERT_EQUAL(SHEF_ERR_NOT_FOUND,
                      shef_png_write_u8(shef_test_temp_path("no/x.png"), tiny, &err));
    TEST_ASSERT_NOT_NULL(strstr(err.text, "no/x.png"));
}

static void test_the_authors_edge_maps_are_read_as_two_values(void)
{
    char path[4200];
    int32_t n_edges = 0;

    SHEF_TEST_NEEDS_DATA("shef");
    snprintf(path, sizeof path, "%s/frame_edge/1.png", shef_test_data("shef"));
    TEST_ASSERT_EQUAL(SHEF_OK, shef_png_read_u8(path, &image, NULL));
    TEST_ASSERT_EQUAL_INT32(640, image.width_px);
    TEST_ASSERT_EQUAL_INT32(480, image.height_px);
    for (int32_t y = 0; y < 480; y++)
        for (int32_t x = 0; x < 640; x++) {
            const uint8_t value = shef_row_u8(image, y)[x];

            TEST_ASSERT_TRUE(value == 0 || value == 255);
            n_edges += value == 255;
        }
    /* The data's notes: 18 to 37 % of a frame map's pixels are edges. */
    TEST_ASSERT_INT32_WITHIN(640 * 480 / 10, 640 * 480 * 28 / 100, n_edges);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_grey_8_and_16_bit_come_back_as_written);
    RUN_TEST(test_16_bit_samples_are_big_endian_on_disk);
    RUN_TEST(test_a_1_bit_map_becomes_0_and_255);
    RUN_TEST(test_interlaced_files_are_read);
    RUN_TEST(test_other_pixel_types_are_refused_by_name);
    RUN_TEST(test_8_bit_files_are_no_16_bit_files);
    RUN_TEST(test_every_shortening_and_every_flipped_byte_is_safe);
    RUN_TEST(test_a_tiny_file_that_promises_a_huge_image_is_refused);
    RUN_TEST(test_colour_pictures_are_written_red_first);
    RUN_TEST(test_a_failed_write_leaves_nothing_and_names_the_file);
    RUN_TEST(test_the_authors_edge_maps_are_read_as_two_values);
    return UNITY_END();
}
