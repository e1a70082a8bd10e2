#include "shefsim/pattern.h"

#include <math.h>

#include "shefsim/random.h"

static double even(uint64_t bits)
{
    return (double)(int32_t)(uint32_t)(bits >> 32) * 0x1p-31;
}

static uint64_t hash(uint64_t seed, int64_t x, int64_t y, int64_t z)
{
    return sim_mix64(seed + (uint64_t)x * UINT64_C(0x9e3779b97f4a7c15) +
                     (uint64_t)y * UINT64_C(0xd1b54a32d192ed03) +
                     (uint64_t)z * UINT64_C(0x8cb92ba72f3d8dd7));
}

static double limited(double value, double low, double high)
{
    return value < low ? low : value > high ? high : value;
}

/* How much of a detail of this size is left behind a pixel of that size. */
static double kept(double footprint_m, double detail_m)
{
    return limited(1.6 - 1.6 * footprint_m / detail_m, 0, 1);
}

/* The nearest and second nearest seed of a jittered grid. */
struct nearest {
    double distance2[2];
    double offset[2][3]; /* from the place to the seeds, in cells */
    uint64_t key[2];
};

/* Where the seed of a square is along one axis, 0..1: in the middle 80 %. 21 bits a coordinate. */
static double seed_at(uint64_t key, int axis)
{
    return .1 + .8 * (double)(key >> (21 * axis) & 0x1fffff) * 0x1p-21;
}

/* Flat patterns lie in the plane z = 0, as do their seeds. */
static void fill_layer(struct sim_pattern_layer *layer, double cell_m, uint64_t seed,
                       const double corner[3], bool is_solid)
{
    layer->seed = seed;
    layer->cell_m = cell_m;
    for (int i = 0; i < 3; i++)
        layer->corner[i] = corner[i];
    for (int n = 0; n < (is_solid ? 27 : 9); n++) {
        const int step[3] = { n % 3 - 1, n / 3 % 3 - 1, is_solid ? n / 9 - 1 : 0 };
        const uint64_t key = hash(seed, (int64_t)corner[0] + step[0], (int64_t)corner[1] + step[1],
                                  (int64_t)corner[2] + step[2]);

        layer->key[n] = key;
        for (int i = 0; i < 3; i++)
            layer->at[i][n] = step[i] + seed_at(key, i);
        if (!is_solid)
            layer->at[2][n] = 0;
    }
}

/* The seeds around a place: those remembered, if it is still in the same square. */
static const struct sim_pattern_layer *layer_of(const struct sim_pattern_place *place,
                                                double cell_m, uint64_t seed,
                                                const double corner[3])
{
    struct sim_pattern_layer *layer = NULL;

    for (int i = 0; i < SIM_PATTERN_LAYERS; i++) {
        layer = &place->memory->layers[i];
        if (layer->cell_m == 0 || (layer->seed == seed && layer->cell_m == cell_m))
            break;
    }
    if (layer->seed != seed || layer->cell_m != cell_m || layer->corner[0] != corner[0] ||
        layer->corner[1] != corner[1] || layer->corner[2] != corner[2])
        fill_layer(layer, cell_m, seed, corner, place->solid);
    return layer;
}

static void find_nearest(struct nearest *out_nearest, const struct sim_pattern_place *place,
                         double cell_m, uint64_t seed)
{
    const int n_seeds = place->solid ? 27 : 9;
    const struct sim_pattern_layer *layer;
    double corner[3] = { 0 };
    double at[3] = { 0 };
    double distance2[SIM_PATTERN_SEEDS];
    int best = 0;
    int next = 1;

    for (int i = 0; i < (place->solid ? 3 : 2); i++) {
        corner[i] = floor(place->position_m[i] / cell_m);
        at[i] = place->position_m[i] / cell_m - corner[i];
    }
    layer = layer_of(place, cell_m, seed, corner);
    for (int n = 0; n < n_seeds; n++) {
        const double x = layer->at[0][n] - at[0];
        const double y = layer->at[1][n] - at[1];
        const double z = layer->at[2][n] - at[2];

        distance2[n] = x * x + y * y + z * z;
    }
    if (distance2[1] < distance2[0]) {
        best = 1;
        next = 0;
    }
    for (int n = 2; n < n_seeds; n++) {
        const bool is_best = distance2[n] < distance2[best];
        const bool is_next = distance2[n] < distance2[next];

        next = is_best ? best : is_next ? n : next;
        best = is_best ? n : best;
    }
    *out_nearest = (struct nearest){
        .distance2 = { distance2[best], distance2[next] },
        .key = { layer->key[best], layer->key[next] },
    };
    for (int i = 0; i < 3; i++) {
        out_nearest->offset[0][i] = layer->at[i][best] - at[i];
        out_nearest->offset[1][i] = layer->at[i][next] - at[i];
    }
}

/* Cells of even value within +-1, their borders as sharp as the footprint allows. */
static double cells(const struct sim_pattern_place *place, double cell_m, uint64_t seed)
{
    const double share = kept(place->largest_m, cell_m);

    if (share <= 0)
        return 0;

    struct nearest nearest;
    double normal[3];

    find_nearest(&nearest, place, cell_m, seed);
    for (int i = 0; i < 3; i++)
        normal[i] = nearest.offset[1][i] - nearest.offset[0][i];

    const double apart =
        sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]) + 1e-9;
    const double width =
        place->solid
            ? place->largest_m
            : (fabs(normal[0]) * place->footprint_m[0] + fabs(normal[1]) * place->footprint_m[1]) /
                  apart;
    /* Distance from the border, in footprints. */
    const double inside =
        (nearest.distance2[1] - nearest.distance2[0]) / (2 * apart) * cell_m / (width + 1e-9);
    const double weight = limited(.5 + inside, 0, 1);

    return share * (weight * even(sim_mix64(nearest.key[0])) +
                    (1 - weight) * even(sim_mix64(nearest.key[1])));
}

static double smooth(double t)
{
    return t * t * (3 - 2 * t);
}

/* Values of a grid, blended smoothly. */
static double noise(const struct sim_pattern_place *place, double cell_m, uint64_t seed)
{
    const double share = kept(place->largest_m, cell_m);
    double corner[3] = { 0 };
    double t[3] = { 0 };
    double sum = 0;

    if (share <= 0)
        return 0;
    for (int i = 0; i < (place->solid ? 3 : 2); i++) {
        corner[i] = floor(place->position_m[i] / cell_m);
        t[i] = smooth(place->position_m[i] / cell_m - corner[i]);
    }
    for (int n = 0; n < (place->solid ? 8 : 4); n++) {
        const double weight =
            (n & 1 ? t[0] : 1 - t[0]) * (n & 2 ? t[1] : 1 - t[1]) * (n & 4 ? t[2] : 1 - t[2]);

        sum +=
            weight * even(hash(seed, (int64_t)corner[0] + (n & 1),
                               (int64_t)corner[1] + (n >> 1 & 1), (int64_t)corner[2] + (n >> 2)));
    }
    return share * sum;
}

/* Bands across the height, each of its own value. */
static double bands(const struct sim_pattern_place *place, double band_m, uint64_t seed)
{
    const double y = place->position_m[1] / band_m;
    const double n = floor(y);
    const double t = y - n;
    const double width = place->footprint_m[1] / band_m + 1e-9;
    const double here = even(hash(seed, 0, (int64_t)n, 0));
    const double next = even(hash(seed, 0, (int64_t)n + (t < .5 ? -1 : 1), 0));
    const double weight = limited(.5 + (t < .5 ? t : 1 - t) / width, 0, 1);

    return kept(place->footprint_m[1], band_m) * (weight * here + (1 - weight) * next);
}

/* Handwriting: lines of wavy strokes, with gaps between words. 1 on a stroke, 0 beside it. */
static double strokes(const struct sim_pattern_place *place, double line_m, uint64_t seed)
{
    const double line = floor(place->position_m[1] / line_m);
    const struct sim_pattern_place along = {
        .position_m = { place->position_m[0], line * 7 * line_m },
        .largest_m = place->largest_m,
    };
    const uint64_t of_line = sim_mix64(seed ^ (uint64_t)(int64_t)line);
    const double word = noise(&along, 1.5 * line_m, of_line + 1);
    const double wave = .5 + .3 * noise(&along, .22 * line_m, of_line + 2) +
                        .12 * noise(&along, .6 * line_m, of_line + 3);
    const double from_stroke =
        fabs(place->position_m[1] / line_m - line - wave) * line_m - .07 * line_m;
    const double ink = limited(.5 - from_stroke / (place->largest_m + .02 * line_m), 0, 1);

    return ink * limited(.5 + 8 * (word + .15), 0, 1) * kept(place->largest_m, .5 * line_m);
}

/* Black and white squares with a white margin of half a square around whole squares. */
static double checker(const struct sim_pattern_place *place, double cell_m)
{
    double value = 1;

    for (int i = 0; i < 2; i++) {
        const double n_squares = floor(place->extent_m[i] / cell_m - .999);
        const double from_first =
            (place->position_m[i] - place->extent_m[i] / 2) / cell_m + n_squares / 2;
        const double n = floor(from_first);
        const double t = from_first - n;
        const double width = place->footprint_m[i] / cell_m + 1e-9;
        const double edge = limited(.5 + (t < .5 ? t : 1 - t) / width, 0, 1);

        if (from_first < 0 || from_first > n_squares)
            return 1;
        /* Over a border the sign turns. */
        value *= ((int64_t)n % 2 ? -1 : 1) * (2 * edge - 1);
    }
    return -value;
}

double sim_pattern_value(enum sim_pattern pattern, double cell_m, uint64_t seed,
                         const struct sim_pattern_place *place)
{
    const uint64_t key = sim_mix64(seed);
    const double grain =
        .5 * noise(place, cell_m / 3.1, key + 11) + .5 * noise(place, cell_m / 8.3, key + 12);

    switch (pattern) {
    case SIM_PATTERN_PLAIN:
        return .3 * noise(place, cell_m, key + 13) + .2 * grain;
    case SIM_PATTERN_CELLS:
        return .75 * cells(place, cell_m, key + 1) + .65 * cells(place, cell_m / 2.5, key + 2) +
               .5 * cells(place, cell_m / 6.1, key + 3) + .25 * grain;
    case SIM_PATTERN_BLOBS:
        return .7 * noise(place, cell_m, key + 4) + .45 * noise(place, cell_m / 2.3, key + 5) +
               .75 * cells(place, cell_m / 5, key + 6) + .5 * cells(place, cell_m / 12, key + 19) +
               .25 * grain;
    case SIM_PATTERN_CARPET:
        return .35 * noise(place, 4 * cell_m, key + 7) + .75 * cells(place, cell_m, key + 8) +
               .65 * cells(place, cell_m / 2.5, key + 9) + .25 * grain;
    case SIM_PATTERN_STRIPES:
        return .8 * bands(place, cell_m, key + 14) + .4 * cells(place, cell_m / 2.2, key + 15) +
               .25 * grain - .8 * strokes(place, cell_m, key + 16);
    case SIM_PATTERN_MARKER:
        return .15 * noise(place, 6 * cell_m, key + 17) + .1 * grain -
               strokes(place, cell_m, key + 18);
    case SIM_PATTERN_CHECKER:
        return checker(place, cell_m);
    }
    return 0;
}
