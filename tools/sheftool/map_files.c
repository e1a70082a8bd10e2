/* Reading single maps: format and values are checked here, once. */
#include <string.h>

#include "core/memory.h"
#include "core/pfm.h"
#include "core/png_io.h"
#include "sheftool/dataset.h"

enum shef_err shef_check_size(const char *path, int32_t width_px, int32_t height_px,
                              int32_t needed_width_px, int32_t needed_height_px,
                              struct shef_error *err)
{
    if (width_px == needed_width_px && height_px == needed_height_px)
        return SHEF_OK;
    return shef_fail(err, SHEF_ERR_INVALID,
                     "'%s' is %d x %d px, but the other maps are %d x %d px; all maps of a set "
                     "must have one size",
                     path, width_px, height_px, needed_width_px, needed_height_px);
}

enum shef_err shef_edge_map_read(const char *path, struct shef_edge_map *map,
                                 struct shef_error *err)
{
    struct shef_image_u8 image;
    enum shef_err code = shef_png_read_u8(path, &image, err);

    if (code != SHEF_OK)
        return code;
    code =
        shef_check_size(path, image.width_px, image.height_px, map->width_px, map->height_px, err);
    if (code == SHEF_OK && shef_edge_map_set_binary(map, image, err) != SHEF_OK)
        code = shef_fail_context(err, "'%s'", path);
    shef_image_destroy_u8(&image);
    return code;
}

static enum shef_err read_png16(const char *path, struct shef_image_f32 *out_map,
                                struct shef_error *err)
{
    struct shef_image_u16 png;
    struct shef_image_f32 map;
    enum shef_err code = shef_png_read_u16(path, &png, err);

    if (code != SHEF_OK)
        return code;
    code = shef_image_create_f32(&map, png.width_px, png.height_px, err);
    if (code == SHEF_OK) {
        for (int32_t y = 0; y < png.height_px; y++)
            for (int32_t x = 0; x < png.width_px; x++)
                shef_row_f32(map, y)[x] = (float)shef_row_u16(png, y)[x] / 256.0f;
        *out_map = map;
    }
    shef_image_destroy_u16(&png);
    return code;
}

/* Refuses the first value outside 0..top; NaN is outside. */
static enum shef_err check_values(const char *path, struct shef_image_f32 map, float top,
                                  const char *rule, struct shef_error *err)
{
    for (int32_t y = 0; y < map.height_px; y++)
        for (int32_t x = 0; x < map.width_px; x++) {
            const float value = shef_row_f32(map, y)[x];

            if (!(value >= 0 && value <= top))
                return shef_fail(err, SHEF_ERR_FORMAT, "'%s': pixel (%d, %d) is %g; %s", path, x, y,
                                 (double)value, rule);
        }
    return SHEF_OK;
}

enum shef_err shef_disparity_read(const char *path, struct shef_image_f32 *out_map,
                                  struct shef_error *err)
{
    const char *ending = strrchr(path, '.');
    struct shef_image_f32 map;
    enum shef_err code = ending && strcmp(ending, ".png") == 0 ? read_png16(path, &map, err)
                                                               : shef_pfm_read(path, &map, err);

    if (code != SHEF_OK)
        return code;
    code = check_values(path, map, 1e6f,
                        "disparities must be finite numbers from 0 px, and 0 where there is none",
                        err);
    if (code != SHEF_OK) {
        shef_image_destroy_f32(&map);
        return code;
    }
    *out_map = map;
    return SHEF_OK;
}

enum shef_err shef_confidence_read(const char *path, struct shef_image_f32 *out_map,
                                   struct shef_error *err)
{
    struct shef_image_f32 map;
    enum shef_err code = shef_pfm_read(path, &map, err);

    if (code != SHEF_OK)
        return code;
    code = check_values(path, map, 1.0f, "confidences must be numbers from 0 to 1", err);
    if (code != SHEF_OK) {
        shef_image_destroy_f32(&map);
        return code;
    }
    *out_map = map;
    return SHEF_OK;
}
