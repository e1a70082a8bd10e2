#include "bin_corr_cases.h"

#include <stdio.h>

#include "core/cpu.h"
#include "core/memory.h"

int shef_test_isas(uint32_t out_features[4])
{
    static const char *const names[] = { "c", "avx2", "avx512", "neon" };
    static int is_printed;
    int n = 0;

    for (int i = 0; i < 4; i++) {
        const uint32_t features = shef_cpu_features_of(names[i]);

        if ((features & shef_cpu_features()) != features)
            continue;
        out_features[n++] = features;
        if (!is_printed)
            printf("instruction set: %s\n", names[i]);
    }
    is_printed = 1;
    return n;
}

void shef_test_set_edge(struct shef_edge_map *map, int32_t x, int32_t y, int value)
{
    if (x < 0 || y < 0 || x >= map->width_px || y >= map->height_px)
        return;

    const size_t at = (size_t)y * (size_t)map->stride_words + (size_t)(x / 64);
    const uint64_t bit = UINT64_C(1) << (x % 64);

    map->plus[at] = value > 0 ? map->plus[at] | bit : map->plus[at] & ~bit;
    if (map->minus)
        map->minus[at] = value < 0 ? map->minus[at] | bit : map->minus[at] & ~bit;
}

struct shef_edge_map shef_test_random_map(struct shef_test_random *random, enum shef_edge_kind kind,
                                          int32_t width_px, int32_t height_px, double share)
{
    struct shef_edge_map map;
    struct shef_error err;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_edge_map_create(&map, kind, width_px, height_px, &err));
    for (int32_t y = 0; y < height_px; y++)
        for (int32_t x = 0; x < width_px; x++)
            if (shef_test_random_unit(random) < share) {
                const int is_minus =
                    kind == SHEF_EDGE_TERNARY && shef_test_random_range(random, 0, 1);

                shef_test_set_edge(&map, x, y, is_minus ? -1 : 1);
            }
    return map;
}

int shef_test_edge_at(const struct shef_edge_map *map, int32_t x, int32_t y)
{
    if (x < 0 || y < 0 || x >= map->width_px || y >= map->height_px)
        return 0;

    const size_t at = (size_t)y * (size_t)map->stride_words + (size_t)(x / 64);
    const int plus = (int)(map->plus[at] >> (x % 64) & 1);
    const int minus = map->minus ? (int)(map->minus[at] >> (x % 64) & 1) : 0;

    return plus - minus;
}

struct shef_image_i16 shef_test_image_i16(int32_t width_px, int32_t height_px)
{
    struct shef_image_i16 image;
    struct shef_error err;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_i16(&image, width_px, height_px, &err));
    return image;
}

struct shef_image_f32 shef_test_image_f32(int32_t width_px, int32_t height_px)
{
    struct shef_image_f32 image;
    struct shef_error err;

    TEST_ASSERT_EQUAL(SHEF_OK, shef_image_create_f32(&image, width_px, height_px, &err));
    return image;
}
