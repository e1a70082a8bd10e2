#include <stdlib.h>
#include <string.h>

#include "codecs/raw_header.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

static void demand(int condition)
{
    if (!condition)
        abort();
}

/* A header that can be parsed can be written, and then says the same. */
static void expect_same_after_writing(const struct shef_raw_header *header,
                                      enum shef_raw_generation generation)
{
    char text[SHEF_RAW_HEADER_BYTES];
    const size_t n_bytes = shef_raw_header_write(header, generation, text);
    struct shef_raw_header again;

    demand(strlen(text) == n_bytes);
    demand(shef_raw_header_parse((const uint8_t *)text, n_bytes, &again, NULL) == SHEF_OK);
    demand(again.format == header->format);
    demand(again.width_px == header->width_px && again.height_px == header->height_px);
    demand(again.n_bytes == n_bytes && again.has_end);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_raw_header header;
    struct shef_error err = { 0 };

    if (shef_raw_header_parse(bytes, n_bytes, &header, &err) != SHEF_OK) {
        demand(err.code != SHEF_OK && err.text[0] != '\0');
        return 0;
    }
    demand(header.n_bytes <= n_bytes);
    demand(header.width_px >= 1 && header.width_px <= 2048);
    demand(header.height_px >= 1 && header.height_px <= 2048);
    expect_same_after_writing(&header, SHEF_RAW_OLD);
    expect_same_after_writing(&header, SHEF_RAW_NEW);
    return 0;
}
