#include "core/pfm.h"

#include <assert.h>
#include <ctype.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "core/memory.h"

#define MAX_HEADER_BYTES 128
#define MAX_TOKEN_CHARS  31
#define MAX_FILE_BYTES                                                                             \
    ((size_t)SHEF_IMAGE_MAX_SIDE_PX * SHEF_IMAGE_MAX_SIDE_PX * sizeof(float) + MAX_HEADER_BYTES)

struct text {
    const uint8_t *next;
    const uint8_t *end;
};

/* Takes the next word, past any white space before it. Returns false if there is none or it is
 * longer than any number of a header. */
static bool take_token(struct text *text, char out_token[MAX_TOKEN_CHARS + 1])
{
    size_t n_chars = 0;

    while (text->next < text->end && isspace(*text->next))
        text->next++;
    while (text->next < text->end && !isspace(*text->next)) {
        if (n_chars == MAX_TOKEN_CHARS)
            return false;
        out_token[n_chars++] = (char)*text->next++;
    }
    out_token[n_chars] = '\0';
    return n_chars > 0;
}

static bool take_side(struct text *text, int32_t *out_px)
{
    char token[MAX_TOKEN_CHARS + 1];
    char *rest;

    if (!take_token(text, token) || !isdigit((unsigned char)token[0]))
        return false;

    const long long value = strtoll(token, &rest, 10);

    if (*rest != '\0' || value < 1 || value > SHEF_IMAGE_MAX_SIDE_PX)
        return false;
    *out_px = (int32_t)value;
    return true;
}

static bool take_scale(struct text *text, double *out_scale)
{
    char token[MAX_TOKEN_CHARS + 1];
    char *rest;

    if (!take_token(text, token))
        return false;
    *out_scale = strtod(token, &rest);
    return *rest == '\0' && isfinite(*out_scale) && *out_scale != 0.0;
}

struct header {
    int32_t width_px;
    int32_t height_px;
    bool little_endian;
    const uint8_t *values;
};

static enum shef_err parse_header(const uint8_t *bytes, size_t n_bytes, struct header *out_header,
                                  struct shef_error *err)
{
    struct text text = { bytes, bytes + (n_bytes < MAX_HEADER_BYTES ? n_bytes : MAX_HEADER_BYTES) };
    char magic[MAX_TOKEN_CHARS + 1];
    double scale;

    if (n_bytes < 3 || bytes[0] != 'P' || !take_token(&text, magic) ||
        (strcmp(magic, "Pf") != 0 && strcmp(magic, "PF") != 0))
        return shef_fail(err, SHEF_ERR_FORMAT, "not a PFM file (it does not begin with 'Pf')");
    if (strcmp(magic, "PF") == 0)
        return shef_fail(err, SHEF_ERR_FORMAT, "a colour PFM file ('PF'); grey ('Pf') is needed");
    if (!take_side(&text, &out_header->width_px) || !take_side(&text, &out_header->height_px))
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "the PFM header's width and height must be whole numbers from 1 to %d",
                         SHEF_IMAGE_MAX_SIDE_PX);
    /* Exactly one white-space character parts the scale from the values. */
    if (!take_scale(&text, &scale) || text.next == text.end || !isspace(*text.next))
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "the PFM header's scale must be a number other than 0 (its sign gives "
                         "the byte order) and a line end");
    out_header->little_endian = scale < 0.0;
    out_header->values = text.next + 1;
    return SHEF_OK;
}

static uint32_t load_u32(const uint8_t *bytes, bool little_endian)
{
    const uint32_t b0 = bytes[0], b1 = bytes[1], b2 = bytes[2], b3 = bytes[3];

    return little_endian ? b0 | b1 << 8 | b2 << 16 | b3 << 24 : b3 | b2 << 8 | b1 << 16 | b0 << 24;
}

enum shef_err shef_pfm_decode(const uint8_t *bytes, size_t n_bytes,
                              struct shef_image_f32 *out_image, struct shef_error *err)
{
    struct header header = { 0 };
    struct shef_image_f32 image;
    enum shef_err code = parse_header(bytes, n_bytes, &header, err);

    if (code != SHEF_OK)
        return code;

    const size_t row_bytes = (size_t)header.width_px * sizeof(float);
    const size_t n_expected = row_bytes * (size_t)header.height_px;
    const size_t n_there = n_bytes - (size_t)(header.values - bytes);

    if (n_there != n_expected)
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "%s: %d x %d px need %zu bytes of values, the file has %zu",
                         n_there < n_expected ? "truncated" : "longer than its header says",
                         header.width_px, header.height_px, n_expected, n_there);
    code = shef_image_create_f32(&image, header.width_px, header.height_px, err);
    if (code != SHEF_OK)
        return code;

    for (int32_t y = 0; y < image.height_px; y++) {
        const uint8_t *source = header.values + (size_t)(image.height_px - 1 - y) * row_bytes;
        float *row = shef_row_f32(image, y);

        for (int32_t x = 0; x < image.width_px; x++) {
            const uint32_t bits = load_u32(source + 4 * (size_t)x, header.little_endian);

            memcpy(&row[x], &bits, sizeof bits);
        }
    }
    *out_image = image;
    return SHEF_OK;
}

enum shef_err shef_pfm_read(const char *path, struct shef_image_f32 *out_image,
                            struct shef_error *err)
{
    uint8_t *bytes;
    size_t n_bytes;
    enum shef_err code = shef_file_read(path, MAX_FILE_BYTES, &bytes, &n_bytes, err);

    if (code != SHEF_OK)
        return code;
    code = shef_pfm_decode(bytes, n_bytes, out_image, err);
    free(bytes);
    return code == SHEF_OK ? code : shef_fail_context(err, "read '%s'", path);
}

static void store_u32(uint8_t *bytes, uint32_t value)
{
    bytes[0] = (uint8_t)value;
    bytes[1] = (uint8_t)(value >> 8);
    bytes[2] = (uint8_t)(value >> 16);
    bytes[3] = (uint8_t)(value >> 24);
}

enum shef_err shef_pfm_write(const char *path, struct shef_image_f32 image, struct shef_error *err)
{
    assert(image.width_px > 0 && image.height_px > 0);

    const size_t row_bytes = (size_t)image.width_px * sizeof(float);
    uint8_t *bytes = malloc(MAX_HEADER_BYTES + row_bytes * (size_t)image.height_px);

    if (!bytes)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "write '%s': out of memory", path);

    const int n_header = snprintf((char *)bytes, MAX_HEADER_BYTES, "Pf\n%d %d\n-1.0\n",
                                  image.width_px, image.height_px);
    uint8_t *next = bytes + n_header;

    for (int32_t y = image.height_px - 1; y >= 0; y--) {
        const float *row = shef_row_f32(image, y);

        for (int32_t x = 0; x < image.width_px; x++, next += 4) {
            uint32_t bits;

            memcpy(&bits, &row[x], sizeof bits);
            store_u32(next, bits);
        }
    }

    const enum shef_err code = shef_file_replace_lazily(path, bytes, (size_t)(next - bytes), err);

    free(bytes);
    return code;
}
