#include "pipeline/field_file.h"

#include <jansson.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/file.h"
#include "core/memory.h"

/* Six numbers and their names: anything larger is another file. */
#define MAX_FILE_BYTES 65536
/* A correction by more than the largest image is a mistake, and its rows would leave int32. */
#define MAX_COEFFICIENT_PX SHEF_IMAGE_MAX_SIDE_PX

/* False for NaN too. */
static bool is_plausible(double coefficient_px)
{
    return fabs(coefficient_px) <= MAX_COEFFICIENT_PX;
}

enum shef_err shef_field_file_write(const char *path, const char *kind,
                                    const struct shef_smooth_field *field, struct shef_error *err)
{
    const double *c = field->c;

    for (int i = 0; i < SHEF_FIELD_TERMS; i++)
        if (!is_plausible(c[i]))
            return shef_fail(err, SHEF_ERR_INVALID,
                             "write '%s': the field's coefficient %d is %g, it must lie within "
                             "%d px; fit it again on more pairs",
                             path, i, c[i], MAX_COEFFICIENT_PX);

    json_t *root = json_pack("{s:s, s:i, s:i, s:[f, f, f, f, f, f]}", "kind", kind, "width_px",
                             field->width_px, "height_px", field->height_px, "coefficients_px",
                             c[0], c[1], c[2], c[3], c[4], c[5]);
    char *text = root ? json_dumps(root, JSON_INDENT(2) | JSON_REAL_PRECISION(17)) : NULL;
    enum shef_err code;

    json_decref(root);
    if (text)
        code = shef_file_replace(path, text, strlen(text), err);
    else
        code = shef_fail(err, SHEF_ERR_NO_MEMORY, "write '%s': out of memory", path);
    free(text);
    return code;
}

static enum shef_err parse(const char *path, const char *kind, const json_t *root,
                           struct shef_smooth_field *field, struct shef_error *err)
{
    const char *found = json_string_value(json_object_get(root, "kind"));
    const json_t *numbers = json_object_get(root, "coefficients_px");
    const json_int_t width = json_integer_value(json_object_get(root, "width_px"));
    const json_int_t height = json_integer_value(json_object_get(root, "height_px"));

    if (!found || strcmp(found, kind) != 0)
        return shef_fail(err, SHEF_ERR_FORMAT, "'%s' holds kind '%s', '%s' is needed here", path,
                         found ? found : "(none)", kind);
    if (width < 1 || width > SHEF_IMAGE_MAX_SIDE_PX || height < 1 ||
        height > SHEF_IMAGE_MAX_SIDE_PX)
        return shef_fail(err, SHEF_ERR_FORMAT,
                         "'%s': width_px and height_px must be 1 to %d, found %lld and %lld", path,
                         SHEF_IMAGE_MAX_SIDE_PX, (long long)width, (long long)height);
    if (json_array_size(numbers) != SHEF_FIELD_TERMS)
        return shef_fail(err, SHEF_ERR_FORMAT, "'%s': coefficients_px must be a list of %d numbers",
                         path, SHEF_FIELD_TERMS);
    field->width_px = (int32_t)width;
    field->height_px = (int32_t)height;
    for (size_t i = 0; i < SHEF_FIELD_TERMS; i++) {
        const json_t *number = json_array_get(numbers, i);

        field->c[i] = json_number_value(number);
        if (!json_is_number(number))
            return shef_fail(err, SHEF_ERR_FORMAT, "'%s': coefficients_px[%zu] is no number", path,
                             i);
        if (!is_plausible(field->c[i]))
            return shef_fail(err, SHEF_ERR_FORMAT,
                             "'%s': coefficients_px[%zu] is %g, it must lie within %d px", path, i,
                             field->c[i], MAX_COEFFICIENT_PX);
    }
    return SHEF_OK;
}

enum shef_err shef_field_file_read(const char *path, const char *kind,
                                   struct shef_smooth_field *out_field, struct shef_error *err)
{
    uint8_t *bytes;
    size_t n_bytes;
    json_error_t at;
    struct shef_smooth_field field;
    const enum shef_err read = shef_file_read(path, MAX_FILE_BYTES, &bytes, &n_bytes, err);

    if (read != SHEF_OK)
        return read;

    json_t *root = json_loadb((const char *)bytes, n_bytes, 0, &at);

    free(bytes);
    if (!root)
        return shef_fail(err, SHEF_ERR_FORMAT, "'%s', line %d: no JSON: %s", path, at.line,
                         at.text);

    const enum shef_err code = parse(path, kind, root, &field, err);

    json_decref(root);
    if (code == SHEF_OK)
        *out_field = field;
    return code;
}
