/* A smooth field in a JSON file of its own:
 *   { "kind": KIND, "width_px": W, "height_px": H, "coefficients_px": [c0, .., c5] }
 * kind says what the field corrects, so that one is never taken for the other. Thread: setup. */
#ifndef SHEF_PIPELINE_FIELD_FILE_H
#define SHEF_PIPELINE_FIELD_FILE_H

#include "core/error.h"
#include "pipeline/smooth_field.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHEF_FIELD_KIND_ALIGN "vertical_residual" /* align.h */
#define SHEF_FIELD_KIND_BIAS  "disparity_bias"    /* bias.h */

/* Writes the file whole or not at all.
 * SHEF_ERR_INVALID: a coefficient is not finite or beyond 16384 px, the largest image's side. */
SHEF_MUST_CHECK enum shef_err shef_field_file_write(const char *path, const char *kind,
                                                    const struct shef_smooth_field *field,
                                                    struct shef_error *err);

/* SHEF_ERR_FORMAT: no JSON, another kind, numbers missing or out of range; the sentence says which.
 * SHEF_ERR_NOT_FOUND, SHEF_ERR_IO, ...: as shef_file_read(). */
SHEF_MUST_CHECK enum shef_err shef_field_file_read(const char *path, const char *kind,
                                                   struct shef_smooth_field *out_field,
                                                   struct shef_error *err);

#ifdef __cplusplus
}
#endif

#endif
