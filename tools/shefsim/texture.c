#include "shefsim/texture.h"

#include <math.h>
#include <stdlib.h>

#include "core/memory.h"
#include "shefsim/numbers.h"
#include "shefsim/pattern.h"
#include "shefsim/random.h"

#define SURVEY_STEPS   16
#define UNSEEN_TEXEL_M 0.02
#define N_GAINS        4096 /* of the table of exp() */
#define GAIN_RANGE     4.0  /* of the values of a pattern, to either side */
#define LOWEST_ALBEDO  0.02
#define HIGHEST_ALBEDO 0.95

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double length_of(const double axis[3])
{
    return sqrt(dot(axis, axis));
}

double sim_lighting_irradiance(const struct sim_lighting *lighting, const double point[3],
                               const double normal[3])
{
    double sum = lighting->ambient;

    for (int32_t n = 0; n < lighting->n_lamps; n++) {
        const struct sim_lamp *lamp = lighting->lamps[n];
        double to_lamp[3];

        for (int i = 0; i < 3; i++)
            to_lamp[i] = lamp->position_m[i] - point[i];

        const double distance2 = dot(to_lamp, to_lamp);
        const double facing = dot(to_lamp, normal);

        if (facing > 0)
            sum += lamp->power * facing / (distance2 * sqrt(distance2));
    }
    return sum;
}

/* What is needed to find one texel's light. */
struct bake {
    const struct sim_surface *surface;
    const struct sim_material *material;
    const struct sim_lighting *lighting;
    double cell_m;
    double contrast;
    uint64_t seed;
    double extent_m[2]; /* of the whole surface along both directions */
    double brightest;   /* light that the largest texel stands for */
    uint8_t *texels[2]; /* both phases; the second is NULL unless it blinks */
    int32_t width;      /* texels */
    int32_t height;
    double gains[N_GAINS + 2]; /* exp(contrast * value) over the range of values */
};

/* How wide a pixel is on the surface along two directions of length 1. */
static void find_footprint(struct sim_pattern_place *place, const double point[3],
                           const double normal[3], const double along[2][3])
{
    const double distance = sqrt(dot(point, point)) + 1e-9;
    const double facing = fabs(dot(point, normal)) / distance;
    const double slant = facing > .05 ? facing : .05;
    const double pixel_m = distance * SIM_TEXTURE_PIXEL_RAD;

    place->largest_m = 0;
    for (int i = 0; i < 2; i++) {
        const double view = dot(point, along[i]) / distance / slant;

        place->footprint_m[i] = pixel_m * sqrt(1 + view * view);
        if (place->footprint_m[i] > place->largest_m)
            place->largest_m = place->footprint_m[i];
    }
}

/* A place on the surface by its texture coordinates. */
static void find_place(const struct bake *bake, double u, double v,
                       struct sim_pattern_memory *memory, struct sim_pattern_place *out_place,
                       double out_point[3], double out_normal[3])
{
    const struct sim_surface *surface = bake->surface;
    struct sim_pattern_place place = {
        .extent_m = { bake->extent_m[0], bake->extent_m[1] },
        .memory = memory,
    };
    double local[3];
    double along[2][3];

    sim_surface_at(surface, u, v, local);
    sim_surface_point(surface, local, out_point);
    sim_surface_normal(surface, local, out_normal);
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < 3; i++)
            along[k][i] = surface->axis[k][i] / length_of(surface->axis[k]);
    place.position_m[0] = (surface->part_start[0] + u * surface->part_size[0]) * bake->extent_m[0];
    place.position_m[1] = (surface->part_start[1] + v * surface->part_size[1]) * bake->extent_m[1];
    if (surface->kind == SIM_SURFACE_ELLIPSOID) {
        place.solid = true;
        for (int k = 0; k < 3; k++)
            place.position_m[k] = local[k] * length_of(surface->axis[k]);
    }
    if (surface->kind == SIM_SURFACE_CYLINDER)
        /* Around it: perpendicular to the axis and to the normal. */
        for (int i = 0; i < 3; i++)
            along[0][i] = out_normal[(i + 1) % 3] * along[1][(i + 2) % 3] -
                          out_normal[(i + 2) % 3] * along[1][(i + 1) % 3];
    find_footprint(&place, out_point, out_normal, along);
    *out_place = place;
}

static void fill_gains(struct bake *bake)
{
    for (int i = 0; i < N_GAINS + 2; i++)
        bake->gains[i] = sim_exp(bake->contrast * GAIN_RANGE * (2.0 * i / N_GAINS - 1));
}

static double gain_of(const struct bake *bake, double value)
{
    const double at = (value / GAIN_RANGE + 1) * (N_GAINS / 2.0);
    const double limited = at < 0 ? 0 : at > N_GAINS ? N_GAINS : at;
    const int i = (int)limited;

    return bake->gains[i] + (limited - i) * (bake->gains[i + 1] - bake->gains[i]);
}

/* What a texel sends out in both phases; the second only if the surface blinks. */
static void find_light(const struct bake *bake, double u, double v,
                       struct sim_pattern_memory *memory, double out_light[2])
{
    struct sim_pattern_place place;
    double point[3];
    double normal[3];

    find_place(bake, u, v, memory, &place, point, normal);

    const double value =
        sim_pattern_value(bake->material->pattern, bake->cell_m, bake->seed, &place);
    const double irradiance = sim_lighting_irradiance(bake->lighting, point, normal);

    for (int phase = 0; phase < (bake->texels[1] ? 2 : 1); phase++) {
        double albedo = bake->material->albedo * gain_of(bake, phase == 0 ? value : -value);

        albedo = albedo < LOWEST_ALBEDO ? LOWEST_ALBEDO : albedo;
        albedo = albedo > HIGHEST_ALBEDO ? HIGHEST_ALBEDO : albedo;
        out_light[phase] = albedo * irradiance;
    }
}

static uint8_t encoded(double light, double brightest)
{
    const double texel = 255 * sqrt(light / brightest) + .5;

    return texel >= 255 ? 255 : (uint8_t)texel;
}

static void bake_row(void *opaque, int32_t y, int32_t worker)
{
    const struct bake *bake = opaque;
    /* An ellipsoid's texture has a texel more all around, where it wraps. */
    const int32_t margin = bake->surface->kind == SIM_SURFACE_ELLIPSOID ? 1 : 0;
    const double v = (double)(y - margin) / (bake->height - 1 - 2 * margin);
    struct sim_pattern_memory memory = { 0 };

    (void)worker;
    for (int32_t x = 0; x < bake->width; x++) {
        const double u = (double)(x - margin) / (bake->width - 1 - 2 * margin);
        const size_t at = (size_t)y * (size_t)bake->width + (size_t)x;
        double light[2];

        find_light(bake, u, v, &memory, light);
        for (int phase = 0; phase < 2 && bake->texels[phase]; phase++)
            bake->texels[phase][at] = encoded(light[phase], bake->brightest);
    }
}

static uint16_t *paired(const uint8_t *texels, int32_t width, int32_t height)
{
    uint16_t *pairs = shef_memory_create((size_t)width * (size_t)(height - 1), sizeof *pairs);

    for (ptrdiff_t i = 0; pairs && i < (ptrdiff_t)width * (height - 1); i++)
        pairs[i] = (uint16_t)(texels[i] | texels[i + width] << 8);
    return pairs;
}

static void find_extent(struct bake *bake)
{
    const struct sim_surface *s = bake->surface;
    const double side[3] = { 2 * length_of(s->axis[0]), 2 * length_of(s->axis[1]),
                             2 * length_of(s->axis[2]) };

    bake->extent_m[0] = side[0] / s->part_size[0];
    bake->extent_m[1] = side[1] / s->part_size[1];
    if (s->kind == SIM_SURFACE_CYLINDER)
        bake->extent_m[0] = SIM_PI / 2 * (side[0] + side[2]);
    if (s->kind == SIM_SURFACE_ELLIPSOID) {
        /* From the lower pole over the upper one and back. */
        bake->extent_m[0] = SIM_PI / 2 * (side[0] + side[1]);
        bake->extent_m[1] = SIM_PI / 2 * (side[2] + side[1]);
    }
}

static int32_t n_texels(double extent_m, double texel_m)
{
    const double n = ceil(extent_m / texel_m) + 1;

    return n < 6 ? 6 : n > SIM_TEXTURE_MAX_SIDE ? SIM_TEXTURE_MAX_SIDE : (int32_t)n;
}

/* Whether a camera near the middle of the path that looks about straight ahead can see a point. */
static bool is_in_view(const double point[3])
{
    return point[2] > .2 && fabs(point[0]) < point[2] + .4 && fabs(point[1]) < point[2] + .4;
}

/* Walks over the surface: its brightest light, and texels as small as its smallest footprint. What
 * is out of view gets large ones. */
static void survey(struct bake *bake)
{
    double smallest_m[2] = { 1, 1 };
    double brightest = 0;
    bool is_seen = false;

    for (int j = 0; j <= SURVEY_STEPS; j++)
        for (int i = 0; i <= SURVEY_STEPS; i++) {
            struct sim_pattern_place place;
            double point[3];
            double normal[3];

            find_place(bake, (double)i / SURVEY_STEPS, (double)j / SURVEY_STEPS, NULL, &place,
                       point, normal);

            const double light = sim_lighting_irradiance(bake->lighting, point, normal);

            if (light > brightest)
                brightest = light;
            if (is_in_view(point))
                is_seen = true;
            for (int k = 0; k < 2; k++)
                if (place.footprint_m[k] < smallest_m[k])
                    smallest_m[k] = place.footprint_m[k];
        }
    bake->brightest = brightest + 1e-6;
    for (int k = 0; k < 2; k++) {
        const double texel_m = is_seen ? smallest_m[k] : UNSEEN_TEXEL_M;
        const int32_t n = n_texels(bake->extent_m[k] * bake->surface->part_size[k], texel_m);

        *(k == 0 ? &bake->width : &bake->height) = n;
    }
}

void sim_texture_spread(const struct sim_surface *surface, double out_spread[2])
{
    for (int k = 0; k < 2; k++)
        out_spread[k] = 1;
    for (int k = 0; k < 2; k++)
        for (int line = -1; line <= 1; line++) {
            double nearest = 1e9;
            double farthest = 0;

            for (int step = -2; step <= 2; step++) {
                const double local[3] = { k == 0 ? step / 2.0 : line, k == 0 ? line : step / 2.0,
                                          0 };
                double point[3];
                double distance;

                sim_surface_point(surface, local, point);
                distance = sqrt(dot(point, point)) + .1;
                nearest = distance < nearest ? distance : nearest;
                farthest = distance > farthest ? distance : farthest;
            }
            if (farthest / nearest > out_spread[k])
                out_spread[k] = farthest / nearest;
        }
}

enum shef_err sim_texture_bake(struct sim_surface *surface, const struct sim_material *material,
                               const struct sim_description *description,
                               const struct sim_lighting *lighting, struct shef_workers *workers,
                               struct shef_error *err)
{
    struct bake bake = {
        .surface = surface,
        .material = material,
        .lighting = lighting,
        .cell_m = material->cell_mm * description->cell_scale / 1000,
        .contrast = material->contrast * description->contrast_scale,
        .seed = surface->seed,
    };
    const bool blinks = material->blink;

    fill_gains(&bake);
    find_extent(&bake);
    survey(&bake);

    const size_t n = (size_t)bake.width * (size_t)bake.height;

    bake.texels[0] = malloc(n);
    bake.texels[1] = blinks ? malloc(n) : NULL;
    if (bake.texels[0] && (bake.texels[1] || !blinks)) {
        shef_workers_run(workers, bake_row, &bake, bake.height);
        surface->texture = (struct sim_texture){
            .pairs = paired(bake.texels[0], bake.width, bake.height),
            .inverse = blinks ? paired(bake.texels[1], bake.width, bake.height) : NULL,
            .width = bake.width - 1,
            .height = bake.height - 1,
            .scale = (float)(sqrt(bake.brightest) / 255),
        };
    }
    free(bake.texels[0]);
    free(bake.texels[1]);
    if (!surface->texture.pairs || (blinks && !surface->texture.inverse))
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "texture of %zu pixels: out of memory", n);
    return SHEF_OK;
}

void sim_texture_destroy(struct sim_texture *texture)
{
    free(texture->pairs);
    free(texture->inverse);
    *texture = (struct sim_texture){ 0 };
}
