/* Any bytes must end in a finite field or in a sentence, never in a crash. */
#include "pipeline/field_file.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes);

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t n_bytes)
{
    static int file = -1;
    static char path[64];
    struct shef_smooth_field field = { .width_px = -7 };
    struct shef_error err = { 0 };

    if (file < 0) {
        file = memfd_create("field", MFD_CLOEXEC);
        snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    }
    if (file < 0 || ftruncate(file, 0) != 0 || pwrite(file, bytes, n_bytes, 0) != (ssize_t)n_bytes)
        abort();
    if (shef_field_file_read(path, SHEF_FIELD_KIND_ALIGN, &field, &err) != SHEF_OK) {
        if (field.width_px != -7 || err.code == SHEF_OK || err.text[0] == '\0' ||
            strchr(err.text, '\n'))
            abort();
        return 0;
    }
    if (field.width_px < 1 || field.height_px < 1)
        abort();
    for (int i = 0; i < SHEF_FIELD_TERMS; i++)
        if (!isfinite(field.c[i]))
            abort();
    return 0;
}
