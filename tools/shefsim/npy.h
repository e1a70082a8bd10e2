/* NumPy's array files, as far as stacks of images need them: numbers of one kind, row by row.
 *
 * Little-endian only, versions 1 to 3 of the format. Thread: one at a time per file. */
#ifndef SHEFSIM_NPY_H
#define SHEFSIM_NPY_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "core/error.h"
#include "core/image.h"

#define SIM_NPY_MAX_DIMENSIONS 3

enum sim_npy_type {
    SIM_NPY_F32,
    SIM_NPY_F64,
    SIM_NPY_I64,
    SIM_NPY_U64,
    SIM_NPY_I32,
    SIM_NPY_U32,
    SIM_NPY_U16,
    SIM_NPY_U8,
};

struct sim_npy {
    FILE *file;
    const char *path; /* kept, for sentences */
    enum sim_npy_type type;
    size_t item_bytes;
    int32_t n_dimensions;
    int64_t shape[SIM_NPY_MAX_DIMENSIONS]; /* each at least 1 */
};

/* Opens a file for reading; its length must be that of its shape.
 * SHEF_ERR_FORMAT: not such a file; the sentence says why. Errors of the system. */
SHEF_MUST_CHECK enum shef_err sim_npy_open(struct sim_npy *npy, const char *path,
                                           struct shef_error *err);

/* Reads the next n numbers as doubles (exact up to 2^53).
 * SHEF_ERR_IO. */
SHEF_MUST_CHECK enum shef_err sim_npy_read(struct sim_npy *npy, size_t n, double *out,
                                           struct shef_error *err);

/* Reads the next image of a stack of three dimensions. SHEF_ERR_IO. */
SHEF_MUST_CHECK enum shef_err sim_npy_read_image(struct sim_npy *npy, struct shef_image_f32 out,
                                                 struct shef_error *err);

/* Creates a file for writing.
 *   shape  n_dimensions numbers; as many items must follow */
SHEF_MUST_CHECK enum shef_err sim_npy_create(struct sim_npy *npy, const char *path,
                                             enum sim_npy_type type, int32_t n_dimensions,
                                             const int64_t *shape, struct shef_error *err);

/* Appends items of the file's type. */
SHEF_MUST_CHECK enum shef_err sim_npy_write(struct sim_npy *npy, const void *items, size_t n,
                                            struct shef_error *err);

/* Closes a file that was written and says whether all of it reached the system. */
SHEF_MUST_CHECK enum shef_err sim_npy_close(struct sim_npy *npy, struct shef_error *err);

/* Closes a file that was read, or whose writing failed. A zeroed one is allowed. */
void sim_npy_discard(struct sim_npy *npy);

#endif
