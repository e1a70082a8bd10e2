#include "shefsim/npy.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#define MAGIC_BYTES      8 /* six, and the version */
#define MAX_HEADER_BYTES 4096
#define MAX_SIDE         100000000

static const struct {
    const char *name;
    size_t bytes;
} types[] = {
    [SIM_NPY_F32] = { "<f4", 4 }, [SIM_NPY_F64] = { "<f8", 8 }, [SIM_NPY_I64] = { "<i8", 8 },
    [SIM_NPY_U64] = { "<u8", 8 }, [SIM_NPY_I32] = { "<i4", 4 }, [SIM_NPY_U32] = { "<u4", 4 },
    [SIM_NPY_U16] = { "<u2", 2 }, [SIM_NPY_U8] = { "|u1", 1 },
};

static enum shef_err refuse(const struct sim_npy *npy, struct shef_error *err, const char *why)
{
    return shef_fail(err, SHEF_ERR_FORMAT, "read array '%s': %s", npy->path, why);
}

static enum shef_err fail_read(const struct sim_npy *npy, struct shef_error *err)
{
    return ferror(npy->file) ? shef_fail_os(err, errno, "read array '%s'", npy->path)
                             : refuse(npy, err, "it ends early");
}

/* What stands behind a key of the header, spaces skipped; NULL: the key is not there. */
static const char *value_of(const char *header, const char *key)
{
    const char *at = strstr(header, key);

    if (!at)
        return NULL;
    at = strchr(at + strlen(key), ':');
    if (!at)
        return NULL;
    do
        at++;
    while (isspace((unsigned char)*at));
    return at;
}

static bool parse_type(struct sim_npy *npy, const char *value)
{
    for (size_t i = 0; value && i < sizeof types / sizeof types[0]; i++)
        if (strncmp(value + 1, types[i].name, 3) == 0) {
            npy->type = (enum sim_npy_type)i;
            npy->item_bytes = types[i].bytes;
            return true;
        }
    return false;
}

/* "(26, 480, 640)", "(26,)". */
static bool parse_shape(struct sim_npy *npy, const char *value)
{
    if (!value || *value != '(')
        return false;
    for (value++; isspace((unsigned char)*value) || isdigit((unsigned char)*value);) {
        char *end;
        const long long n = strtoll(value, &end, 10);

        if (end == value || n < 1 || n > MAX_SIDE || npy->n_dimensions == SIM_NPY_MAX_DIMENSIONS)
            return false;
        npy->shape[npy->n_dimensions++] = n;
        value = end + strspn(end, ", ");
    }
    return *value == ')' && npy->n_dimensions > 0;
}

static enum shef_err parse_header(struct sim_npy *npy, const char *header, struct shef_error *err)
{
    const char *order = value_of(header, "'fortran_order'");

    if (!parse_type(npy, value_of(header, "'descr'")))
        return refuse(npy, err, "its numbers must be little-endian floats or integers");
    if (!order || strncmp(order, "False", 5) != 0)
        return refuse(npy, err, "its order must be C's: save it with numpy.ascontiguousarray()");
    if (!parse_shape(npy, value_of(header, "'shape'")))
        return refuse(npy, err, "its shape must have one to three dimensions, none of them empty");
    return SHEF_OK;
}

static enum shef_err check_length(struct sim_npy *npy, struct shef_error *err)
{
    const long start = ftell(npy->file);
    double n_bytes = (double)npy->item_bytes;

    for (int32_t i = 0; i < npy->n_dimensions; i++)
        n_bytes *= (double)npy->shape[i];
    if (start < 0 || fseek(npy->file, 0, SEEK_END) != 0)
        return fail_read(npy, err);

    const bool is_right = (double)(ftell(npy->file) - start) == n_bytes;

    if (fseek(npy->file, start, SEEK_SET) != 0)
        return fail_read(npy, err);
    return is_right ? SHEF_OK : refuse(npy, err, "its length is not that of its shape");
}

static enum shef_err read_header(struct sim_npy *npy, struct shef_error *err)
{
    uint8_t front[MAGIC_BYTES + 4];
    char header[MAX_HEADER_BYTES + 1];
    uint32_t n_bytes;

    if (fread(front, 1, MAGIC_BYTES, npy->file) != MAGIC_BYTES ||
        memcmp(front, "\x93NUMPY", 6) != 0)
        return refuse(npy, err, "it is no .npy file");

    const size_t n_length = front[6] == 1 ? 2 : 4;

    if (front[6] < 1 || front[6] > 3)
        return refuse(npy, err, "it is of a later version than 3");
    if (fread(front + MAGIC_BYTES, 1, n_length, npy->file) != n_length)
        return fail_read(npy, err);
    n_bytes = (uint32_t)front[8] | (uint32_t)front[9] << 8;
    if (n_length == 4)
        n_bytes |= (uint32_t)front[10] << 16 | (uint32_t)front[11] << 24;
    if (n_bytes > MAX_HEADER_BYTES)
        return refuse(npy, err, "its header is too long");
    if (fread(header, 1, n_bytes, npy->file) != n_bytes)
        return fail_read(npy, err);
    header[n_bytes] = '\0';
    return parse_header(npy, header, err);
}

enum shef_err sim_npy_open(struct sim_npy *npy, const char *path, struct shef_error *err)
{
    *npy = (struct sim_npy){ .path = path, .file = fopen(path, "rbe") };
    if (!npy->file)
        return shef_fail_os(err, errno, "read array '%s'", path);

    enum shef_err code = read_header(npy, err);

    if (code == SHEF_OK)
        code = check_length(npy, err);
    if (code != SHEF_OK) {
        fclose(npy->file);
        npy->file = NULL;
    }
    return code;
}

static double number(enum sim_npy_type type, const void *item)
{
    float f32;
    double f64;
    uint64_t u64 = 0;

    switch (type) {
    case SIM_NPY_F32:
        memcpy(&f32, item, sizeof f32);
        return f32;
    case SIM_NPY_F64:
        memcpy(&f64, item, sizeof f64);
        return f64;
    case SIM_NPY_I64:
        memcpy(&u64, item, 8);
        return (double)(int64_t)u64;
    case SIM_NPY_I32:
        memcpy(&u64, item, 4);
        return (int32_t)(uint32_t)u64;
    default:
        memcpy(&u64, item, types[type].bytes);
        return (double)u64;
    }
}

enum shef_err sim_npy_read(struct sim_npy *npy, size_t n, double *out, struct shef_error *err)
{
    for (size_t i = 0; i < n; i++) {
        uint8_t item[8];

        if (fread(item, npy->item_bytes, 1, npy->file) != 1)
            return fail_read(npy, err);
        out[i] = number(npy->type, item);
    }
    return SHEF_OK;
}

enum shef_err sim_npy_read_image(struct sim_npy *npy, struct shef_image_f32 out,
                                 struct shef_error *err)
{
    for (int32_t y = 0; y < out.height_px; y++) {
        float *row = shef_row_f32(out, y);

        if (npy->type == SIM_NPY_F32) {
            if (fread(row, sizeof *row, (size_t)out.width_px, npy->file) != (size_t)out.width_px)
                return fail_read(npy, err);
            continue;
        }
        for (int32_t x = 0; x < out.width_px; x++) {
            double value = 0;
            const enum shef_err code = sim_npy_read(npy, 1, &value, err);

            if (code != SHEF_OK)
                return code;
            row[x] = (float)value;
        }
    }
    return SHEF_OK;
}

enum shef_err sim_npy_create(struct sim_npy *npy, const char *path, enum sim_npy_type type,
                             int32_t n_dimensions, const int64_t *shape, struct shef_error *err)
{
    char header[256];
    int n;

    *npy = (struct sim_npy){ .path = path,
                             .file = fopen(path, "wbxe"),
                             .type = type,
                             .item_bytes = types[type].bytes,
                             .n_dimensions = n_dimensions };
    if (!npy->file)
        return shef_fail_os(err, errno, "write array '%s'", path);
    n = snprintf(header, sizeof header, "{'descr': '%s', 'fortran_order': False, 'shape': (",
                 types[type].name);
    for (int32_t i = 0; i < n_dimensions; i++) {
        npy->shape[i] = shape[i];
        n += snprintf(header + n, sizeof header - (size_t)n, "%lld,%s", (long long)shape[i],
                      i + 1 < n_dimensions ? " " : "");
    }
    n += snprintf(header + n, sizeof header - (size_t)n, "), }");
    /* Magic, version, length and header together are a multiple of 64 bytes. */
    while ((n + 11) % 64 != 0)
        header[n++] = ' ';
    header[n++] = '\n';
    if (fprintf(npy->file, "\x93NUMPY%c%c%c%c", 1, 0, n & 0xff, n >> 8) < 0 ||
        fwrite(header, 1, (size_t)n, npy->file) != (size_t)n)
        return shef_fail_os(err, errno, "write array '%s'", path);
    return SHEF_OK;
}

enum shef_err sim_npy_write(struct sim_npy *npy, const void *items, size_t n,
                            struct shef_error *err)
{
    return fwrite(items, npy->item_bytes, n, npy->file) == n
               ? SHEF_OK
               : shef_fail_os(err, errno, "write array '%s'", npy->path);
}

enum shef_err sim_npy_close(struct sim_npy *npy, struct shef_error *err)
{
    FILE *const file = npy->file;

    npy->file = NULL;
    if (file && fclose(file) != 0)
        return shef_fail_os(err, errno, "write array '%s'", npy->path);
    return SHEF_OK;
}

void sim_npy_discard(struct sim_npy *npy)
{
    if (npy->file)
        fclose(npy->file);
    npy->file = NULL;
}
