/* PFM files: one float per pixel, the format of disparity and confidence maps on disk.
 *
 * Grey files only ("Pf"). On disk the bottom row comes first, in a view the top row. Reading
 * takes both byte orders, writing produces little-endian. The header's scale decides the byte
 * order by its sign; its size is not applied, as is usual. Values pass unchanged, NaN and
 * infinity included: what they mean is the caller's to say. Thread: any.
 * Source: http://www.pauldebevec.com/Research/HDR/PFM/ */
#ifndef SHEF_CORE_PFM_H
#define SHEF_CORE_PFM_H

#include <stddef.h>
#include <stdint.h>

#include "core/error.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reads a file into an image of its own memory; shef_image_destroy_f32() frees it.
 * SHEF_ERR_FORMAT: no grey PFM, sides outside 1..16384 px, or more or fewer values than the
 * header says. Also SHEF_ERR_NOT_FOUND, PERMISSION, IO, NO_MEMORY. */
SHEF_MUST_CHECK enum shef_err shef_pfm_read(const char *path, struct shef_image_f32 *out_image,
                                            struct shef_error *err);

/* The same for a file that is already in memory. */
SHEF_MUST_CHECK enum shef_err shef_pfm_decode(const uint8_t *bytes, size_t n_bytes,
                                              struct shef_image_f32 *out_image,
                                              struct shef_error *err);

/* Writes a file; see shef_file_replace_lazily() for what a failure leaves behind. */
SHEF_MUST_CHECK enum shef_err shef_pfm_write(const char *path, struct shef_image_f32 image,
                                             struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
