#include "core/png_io.h"

#include <assert.h>
#include <png.h>
#include <setjmp.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "core/memory.h"

#define MAX_FILE_BYTES ((size_t)1 << 30)
/* Deflate cannot shrink data more than this: 258 bytes from 2 bits. RFC 1951, 3.2.5. */
#define MAX_DEFLATE_RATIO 1032
#define COMPRESSION_LEVEL 3

/* libpng leaves through longjmp. Each function that calls setjmp() below changes none of its own
 * locals after it, and no jump crosses more than one of our frames. */
struct png_session {
    png_structp png;
    png_infop info;
    char reason[128]; /* what libpng said last */
    /* Reading: what is left of the file. */
    const uint8_t *next;
    size_t n_left;
    /* Writing: the file so far. */
    uint8_t *bytes;
    size_t n_bytes;
    size_t n_capacity;
};

static void keep_error(png_structp png, png_const_charp message)
{
    struct png_session *session = png_get_error_ptr(png);

    snprintf(session->reason, sizeof session->reason, "%s", message);
    png_longjmp(png, 1);
}

static void ignore_warning(png_structp png, png_const_charp message)
{
    (void)png;
    (void)message;
}

static void read_bytes(png_structp png, png_bytep out_bytes, png_size_t n_bytes)
{
    struct png_session *session = png_get_io_ptr(png);

    if (n_bytes > session->n_left)
        png_error(png, "the file is truncated");
    memcpy(out_bytes, session->next, n_bytes);
    session->next += n_bytes;
    session->n_left -= n_bytes;
}

static bool read_header(struct png_session *session)
{
    if (setjmp(png_jmpbuf(session->png)))
        return false;
    png_set_user_limits(session->png, SHEF_IMAGE_MAX_SIDE_PX, SHEF_IMAGE_MAX_SIDE_PX);
    png_set_read_fn(session->png, session, read_bytes);
    png_read_info(session->png, session->info);
    return true;
}

static bool read_pixels(struct png_session *session, png_bytepp rows)
{
    if (setjmp(png_jmpbuf(session->png)))
        return false;
    if (png_get_bit_depth(session->png, session->info) < 8)
        png_set_expand_gray_1_2_4_to_8(session->png);
    if (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__)
        png_set_swap(session->png); /* 16-bit samples are big-endian on disk */
    png_set_interlace_handling(session->png);
    png_read_update_info(session->png, session->info);
    png_read_image(session->png, rows);
    png_read_end(session->png, NULL);
    return true;
}

static const char *color_name(int color_type)
{
    switch (color_type) {
    case PNG_COLOR_TYPE_GRAY:
        return "grey";
    case PNG_COLOR_TYPE_GRAY_ALPHA:
        return "grey with alpha";
    case PNG_COLOR_TYPE_PALETTE:
        return "palette";
    case PNG_COLOR_TYPE_RGB:
        return "RGB";
    default:
        return "RGB with alpha";
    }
}

/* Fails unless the file is grey with the wanted depth and can hold as many pixels as it says. */
static enum shef_err check_header(const struct png_session *session, bool want_16_bit,
                                  struct shef_error *err)
{
    const int color_type = png_get_color_type(session->png, session->info);
    const int n_bits = png_get_bit_depth(session->png, session->info);
    const size_t width_px = png_get_image_width(session->png, session->info);
    const size_t height_px = png_get_image_height(session->png, session->info);

    if (color_type != PNG_COLOR_TYPE_GRAY || (n_bits == 16) != want_16_bit)
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "the PNG is %d-bit %s; it must be %s grey, convert it first", n_bits,
                         color_name(color_type), want_16_bit ? "16-bit" : "1- to 8-bit");
    if (width_px * height_px / 8 * (size_t)n_bits > session->n_left * MAX_DEFLATE_RATIO)
        return shef_fail(err, SHEF_ERR_FORMAT, "damaged PNG: the file is truncated");
    return SHEF_OK;
}

static enum shef_err damaged(const struct png_session *session, struct shef_error *err)
{
    return shef_fail(err, SHEF_ERR_FORMAT, "damaged PNG: %s", session->reason);
}

/* Calls read_pixels() with a table of row addresses. */
static enum shef_err read_rows(struct png_session *session, uint8_t *pixels, int32_t height_px,
                               ptrdiff_t stride_bytes, struct shef_error *err)
{
    png_bytepp rows = malloc((size_t)height_px * sizeof *rows);

    if (!rows)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "decode a PNG: out of memory");
    for (int32_t y = 0; y < height_px; y++)
        rows[y] = pixels + y * stride_bytes;

    const bool ok = read_pixels(session, rows);

    free(rows);
    return ok ? SHEF_OK : damaged(session, err);
}

/* Starts a session on bytes and checks the header. close_reader() must follow, also on failure. */
static enum shef_err open_reader(struct png_session *session, const uint8_t *bytes, size_t n_bytes,
                                 bool want_16_bit, struct shef_error *err)
{
    *session = (struct png_session){ .next = bytes, .n_left = n_bytes };
    if (n_bytes < 8 || png_sig_cmp(bytes, 0, 8) != 0)
        return shef_fail(err, SHEF_ERR_FORMAT, "not a PNG file");
    session->png =
        png_create_read_struct(PNG_LIBPNG_VER_STRING, session, keep_error, ignore_warning);
    if (session->png)
        session->info = png_create_info_struct(session->png);
    if (!session->info)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "decode a PNG: out of memory");
    if (!read_header(session))
        return damaged(session, err);
    return check_header(session, want_16_bit, err);
}

static void close_reader(struct png_session *session)
{
    png_destroy_read_struct(&session->png, &session->info, NULL);
}

#define DEFINE_DECODE_AND_READ(name, want_16_bit)                                                  \
    static enum shef_err decode_open_##name(                                                       \
        struct png_session *session, struct shef_image_##name *out_image, struct shef_error *err)  \
    {                                                                                              \
        struct shef_image_##name image;                                                            \
        enum shef_err code = shef_image_create_##name(                                             \
            &image, (int32_t)png_get_image_width(session->png, session->info),                     \
            (int32_t)png_get_image_height(session->png, session->info), err);                      \
                                                                                                   \
        if (code != SHEF_OK)                                                                       \
            return code;                                                                           \
        code =                                                                                     \
            read_rows(session, (uint8_t *)image.data, image.height_px, image.stride_bytes, err);   \
        if (code != SHEF_OK) {                                                                     \
            shef_image_destroy_##name(&image);                                                     \
            return code;                                                                           \
        }                                                                                          \
        *out_image = image;                                                                        \
        return SHEF_OK;                                                                            \
    }                                                                                              \
                                                                                                   \
    enum shef_err shef_png_decode_##name(const uint8_t *bytes, size_t n_bytes,                     \
                                         struct shef_image_##name *out_image,                      \
                                         struct shef_error *err)                                   \
    {                                                                                              \
        struct png_session session;                                                                \
        enum shef_err code = open_reader(&session, bytes, n_bytes, want_16_bit, err);              \
                                                                                                   \
        if (code == SHEF_OK)                                                                       \
            code = decode_open_##name(&session, out_image, err);                                   \
        close_reader(&session);                                                                    \
        return code;                                                                               \
    }                                                                                              \
                                                                                                   \
    enum shef_err shef_png_read_##name(const char *path, struct shef_image_##name *out_image,      \
                                       struct shef_error *err)                                     \
    {                                                                                              \
        uint8_t *bytes;                                                                            \
        size_t n_bytes;                                                                            \
        enum shef_err code = shef_file_read(path, MAX_FILE_BYTES, &bytes, &n_bytes, err);          \
                                                                                                   \
        if (code != SHEF_OK)                                                                       \
            return code;                                                                           \
        code = shef_png_decode_##name(bytes, n_bytes, out_image, err);                             \
        free(bytes);                                                                               \
        return code == SHEF_OK ? code : shef_fail_context(err, "read '%s'", path);                 \
    }

DEFINE_DECODE_AND_READ(u8, false)
DEFINE_DECODE_AND_READ(u16, true)

static void append_bytes(png_structp png, png_bytep bytes, png_size_t n_bytes)
{
    struct png_session *session = png_get_io_ptr(png);

    if (n_bytes > session->n_capacity - session->n_bytes) {
        const size_t n_capacity = 2 * session->n_capacity + n_bytes;
        uint8_t *grown = realloc(session->bytes, n_capacity);

        if (!grown)
            png_error(png, "out of memory");
        session->bytes = grown;
        session->n_capacity = n_capacity;
    }
    memcpy(session->bytes + session->n_bytes, bytes, n_bytes);
    session->n_bytes += n_bytes;
}

static void no_flush(png_structp png)
{
    (void)png;
}

struct source {
    const uint8_t *pixels;
    int32_t width_px;
    int32_t height_px;
    ptrdiff_t stride_bytes;
    int n_bits;
    int color_type;
};

static bool write_image(struct png_session *session, const struct source *source)
{
    if (setjmp(png_jmpbuf(session->png)))
        return false;
    png_set_user_limits(session->png, SHEF_IMAGE_MAX_SIDE_PX, SHEF_IMAGE_MAX_SIDE_PX);
    png_set_write_fn(session->png, session, append_bytes, no_flush);
    /* A third of the time that libpng's own choices take; depth maps grow by half. */
    png_set_compression_level(session->png, COMPRESSION_LEVEL);
    png_set_filter(session->png, PNG_FILTER_TYPE_BASE, PNG_FILTER_UP);
    png_set_IHDR(session->png, session->info, (png_uint_32)source->width_px,
                 (png_uint_32)source->height_px, source->n_bits, source->color_type,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(session->png, session->info);
    if (__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ && source->n_bits == 16)
        png_set_swap(session->png);
    for (int32_t y = 0; y < source->height_px; y++)
        png_write_row(session->png, source->pixels + y * source->stride_bytes);
    png_write_end(session->png, NULL);
    return true;
}

/* The file in memory, to be freed. */
static enum shef_err encode_source(const struct source *source, uint8_t **out_bytes,
                                   size_t *out_n_bytes, struct shef_error *err)
{
    assert(source->width_px > 0 && source->height_px > 0);

    struct png_session session = { .reason = "out of memory" };
    bool is_written;

    session.png =
        png_create_write_struct(PNG_LIBPNG_VER_STRING, &session, keep_error, ignore_warning);
    if (session.png)
        session.info = png_create_info_struct(session.png);
    is_written = session.info && write_image(&session, source);
    png_destroy_write_struct(&session.png, &session.info);
    if (!is_written) {
        free(session.bytes);
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "encode a picture: %s", session.reason);
    }
    *out_bytes = session.bytes;
    *out_n_bytes = session.n_bytes;
    return SHEF_OK;
}

static enum shef_err write_source(const char *path, const struct source *source,
                                  struct shef_error *err)
{
    uint8_t *bytes = NULL;
    size_t n_bytes = 0;
    enum shef_err code = encode_source(source, &bytes, &n_bytes, err);

    if (code != SHEF_OK)
        return shef_fail_context(err, "write '%s'", path);
    code = shef_file_replace_lazily(path, bytes, n_bytes, err);
    free(bytes);
    return code;
}

static struct source source_of_rgb8(struct shef_image_rgb8 image)
{
    return (struct source){
        (const uint8_t *)image.data, image.width_px, image.height_px, image.stride_bytes, 8,
        PNG_COLOR_TYPE_RGB
    };
}

enum shef_err shef_png_write_u8(const char *path, struct shef_image_u8 image,
                                struct shef_error *err)
{
    return write_source(path,
                        &(struct source){ image.data, image.width_px, image.height_px,
                                          image.stride_bytes, 8, PNG_COLOR_TYPE_GRAY },
                        err);
}

enum shef_err shef_png_write_u16(const char *path, struct shef_image_u16 image,
                                 struct shef_error *err)
{
    return write_source(path,
                        &(struct source){ (const uint8_t *)image.data, image.width_px,
                                          image.height_px, image.stride_bytes, 16,
                                          PNG_COLOR_TYPE_GRAY },
                        err);
}

enum shef_err shef_png_write_rgb8(const char *path, struct shef_image_rgb8 image,
                                  struct shef_error *err)
{
    const struct source source = source_of_rgb8(image);

    return write_source(path, &source, err);
}

enum shef_err shef_png_encode_rgb8(struct shef_image_rgb8 image, uint8_t **out_bytes,
                                   size_t *out_n_bytes, struct shef_error *err)
{
    const struct source source = source_of_rgb8(image);

    return encode_source(&source, out_bytes, out_n_bytes, err);
}
