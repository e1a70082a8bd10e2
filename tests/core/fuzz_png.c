/* Any bytes must end in an image that can be walked or in a sentence, never in a crash. */
#include "core/png_io.h"

#include <stdlib.h>
#include <string.h>

#include "core/memory.h"

#define MAX_INPUT_BYTES 65536

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

static void expect_refusal(const void *data, const struct shef_error *err)
{
    if (data || err->code == SHEF_OK || err->text[0] == '\0')
        abort();
}

static void decode_u8(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_image_u8 image = { 0 };
    struct shef_error err = { 0 };
    volatile uint8_t last;

    if (shef_png_decode_u8(bytes, n_bytes, &image, &err) != SHEF_OK) {
        expect_refusal(image.data, &err);
        return;
    }
    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            last = shef_row_u8(image, y)[x];
    (void)last;
    shef_image_destroy_u8(&image);
}

static void decode_u16(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_image_u16 image = { 0 };
    struct shef_error err = { 0 };
    volatile uint16_t last;

    if (shef_png_decode_u16(bytes, n_bytes, &image, &err) != SHEF_OK) {
        expect_refusal(image.data, &err);
        return;
    }
    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            last = shef_row_u16(image, y)[x];
    (void)last;
    shef_image_destroy_u16(&image);
}

static uint32_t load_u32(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

/* The CRC-32 of PNG chunks (PNG specification, annex D), bit by bit. */
static uint32_t crc32_of(const uint8_t *bytes, size_t n_bytes)
{
    uint32_t crc = UINT32_MAX;

    for (size_t i = 0; i < n_bytes; i++) {
        crc ^= bytes[i];
        for (int bit = 0; bit < 8; bit++)
            crc = crc >> 1 ^ (crc & 1 ? 0xedb88320u : 0);
    }
    return ~crc;
}

/* Makes every chunk's checksum right: nearly no mutated file would get past libpng's check. */
static void repair_checksums(uint8_t *bytes, size_t n_bytes)
{
    size_t at = 8;

    while (n_bytes - at >= 12) {
        const size_t n_data = load_u32(bytes + at);

        if (n_data > n_bytes - at - 12)
            return;

        const uint32_t crc = crc32_of(bytes + at + 4, n_data + 4);

        for (int i = 0; i < 4; i++)
            bytes[at + 8 + n_data + (size_t)i] = (uint8_t)(crc >> (24 - 8 * i));
        at += n_data + 12;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    static uint8_t repaired[MAX_INPUT_BYTES];

    decode_u8(bytes, n_bytes);
    if (n_bytes < 8 || n_bytes > sizeof repaired)
        return 0;
    memcpy(repaired, bytes, n_bytes);
    repair_checksums(repaired, n_bytes);
    decode_u8(repaired, n_bytes);
    decode_u16(repaired, n_bytes);
    return 0;
}
