/* Any bytes must end in an image that can be walked or in a sentence, never in a crash. */
#include "core/pfm.h"

#include <stdlib.h>

#include "core/memory.h"

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    struct shef_image_f32 image = { 0 };
    struct shef_error err = { 0 };
    volatile float last;

    if (shef_pfm_decode(bytes, n_bytes, &image, &err) != SHEF_OK) {
        if (image.data || err.code == SHEF_OK || err.text[0] == '\0')
            abort();
        return 0;
    }
    for (int32_t y = 0; y < image.height_px; y++)
        for (int32_t x = 0; x < image.width_px; x++)
            last = shef_row_f32(image, y)[x];
    (void)last;
    shef_image_destroy_f32(&image);
    return 0;
}
