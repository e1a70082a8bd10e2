#include "sheftool/synth_world.h"

#include <math.h>

#define CELL_LOW_M  0.020 /* texture cells, m: 13 px at 2 m with f = 1301 px */
#define CELL_HIGH_M 0.045
#define N_TONES     3    /* a print has few tones, so its edges are lines */
#define NEAREST_M   1.25 /* below 1.07 m the authors' scale of 80 px would end */

double shef_synth_hash(uint64_t seed, int64_t x, int64_t y)
{
    uint64_t bits = seed ^ (uint64_t)x * UINT64_C(0x9e3779b97f4a7c15) ^
                    (uint64_t)y * UINT64_C(0xc2b2ae3d27d4eb4f);

    /* The finalizer of MurmurHash3 (A. Appleby, public domain): every input bit reaches all. */
    bits = (bits ^ bits >> 33) * UINT64_C(0xff51afd7ed558ccd);
    bits = (bits ^ bits >> 33) * UINT64_C(0xc4ceb9fe1a85ec53);
    bits ^= bits >> 33;
    return (double)(bits >> 11) / 9007199254740992.0; /* 2^53 */
}

static double smooth_step(double t)
{
    return t * t * (3 - 2 * t);
}

double shef_synth_noise(uint64_t seed, double x, double y)
{
    const double left = floor(x);
    const double top = floor(y);
    const int64_t ix = (int64_t)left;
    const int64_t iy = (int64_t)top;
    const double across = smooth_step(x - left);
    const double down = smooth_step(y - top);
    const double upper =
        shef_synth_hash(seed, ix, iy) * (1 - across) + shef_synth_hash(seed, ix + 1, iy) * across;
    const double lower = shef_synth_hash(seed, ix, iy + 1) * (1 - across) +
                         shef_synth_hash(seed, ix + 1, iy + 1) * across;

    return upper * (1 - down) + lower * down;
}

/* Rounds to one of few tones, with a steep but smooth step between two. */
static double print_tone(double brightness)
{
    const double tone = brightness * N_TONES;
    const double step = fmin(fmax((tone - floor(tone) - 0.5) * 6 + 0.5, 0), 1);

    return (floor(tone) + smooth_step(step)) / N_TONES;
}

/* Brightness at a place (m) on a surface: a printed pattern. Each surface has its own cell size,
 * contrast and mean brightness, so its outline is an edge too. */
static double texture(uint64_t surface_seed, double u_m, double v_m)
{
    const double mean = shef_synth_hash(surface_seed, 7, 7);
    const double contrast = 0.25 + 0.75 * shef_synth_hash(surface_seed, 7, 8);
    const double cell_m =
        CELL_LOW_M + (CELL_HIGH_M - CELL_LOW_M) * shef_synth_hash(surface_seed, 7, 9);
    const double coarse = shef_synth_noise(surface_seed + 1, u_m / cell_m, v_m / cell_m);
    const double fine = shef_synth_noise(surface_seed + 2, 2.6 * u_m / cell_m, 2.6 * v_m / cell_m);

    return 0.3 * mean + 0.7 * contrast * print_tone(0.7 * coarse + 0.3 * fine);
}

/* A number between low and high, the n-th of the world's. */
static double pick(uint64_t seed, int64_t n, double low, double high)
{
    return low + (high - low) * shef_synth_hash(seed, n, 1);
}

static void add_box(struct shef_synth_world *world, double half_low_m, double half_high_m,
                    double near_m, double far_m)
{
    const int64_t n = 100 + 10 * (int64_t)world->n_boxes;
    const double depth_m = pick(world->seed, n, near_m, far_m);
    const double yaw = pick(world->seed, n + 1, -0.6, 0.6);
    struct shef_synth_box *box = &world->boxes[world->n_boxes++];

    /* The view is half a metre wide at one metre: 640 / 1301. */
    box->centre_m[0] = pick(world->seed, n + 2, -0.22, 0.22) * depth_m;
    box->centre_m[1] = pick(world->seed, n + 3, -0.15, 0.15) * depth_m;
    box->centre_m[2] = depth_m;
    for (int i = 0; i < 3; i++)
        box->half_m[i] = pick(world->seed, n + 4 + i, half_low_m, half_high_m);
    if (depth_m - hypot(box->half_m[0], box->half_m[2]) < NEAREST_M)
        box->centre_m[2] = NEAREST_M + hypot(box->half_m[0], box->half_m[2]);
    box->cos_yaw = cos(yaw);
    box->sin_yaw = sin(yaw);
}

struct shef_synth_world shef_synth_world_make(enum shef_synth_kind kind, uint64_t seed)
{
    struct shef_synth_world world = { .seed = seed * 1000003 + (uint64_t)kind + 1 };
    const double slope =
        pick(world.seed, 3, 0.6, 1.2) * (shef_synth_hash(world.seed, 4, 1) < 0.5 ? -1 : 1);

    switch (kind) {
    case SHEF_SYNTH_WALL:
        world.wall_m[0] = pick(world.seed, 2, 2.4, 2.9);
        world.wall_m[1] = slope;
        world.wall_m[2] = pick(world.seed, 5, -0.5, 0.5);
        for (int i = 0; i < 2; i++)
            add_box(&world, 0.08, 0.16, 1.5, 2.0);
        break;
    case SHEF_SYNTH_BOXES:
        world.wall_m[0] = pick(world.seed, 2, 3.6, 4.4);
        for (int i = 0; i < 5; i++)
            add_box(&world, 0.10, 0.25, 1.7, 3.3);
        break;
    case SHEF_SYNTH_CLUTTER:
    case SHEF_SYNTH_N_KINDS:
        world.wall_m[0] = pick(world.seed, 2, 2.8, 3.4);
        world.wall_m[1] = slope / 3;
        for (int i = 0; i < 12; i++)
            add_box(&world, 0.04, 0.11, 1.5, 3.0);
        break;
    }
    return world;
}

/* Where a ray enters a box: true if it does, with the depth and the place on the face. */
static int hit_box(const struct shef_synth_box *box, const double from_m[3],
                   const double direction[3], double *out_depth_m, int *out_face,
                   double out_place_m[2])
{
    const double dx = from_m[0] - box->centre_m[0];
    const double dz = from_m[2] - box->centre_m[2];
    const double from[3] = {
        box->cos_yaw * dx - box->sin_yaw * dz,
        from_m[1] - box->centre_m[1],
        box->sin_yaw * dx + box->cos_yaw * dz,
    };
    const double along[3] = {
        box->cos_yaw * direction[0] - box->sin_yaw * direction[2],
        direction[1],
        box->sin_yaw * direction[0] + box->cos_yaw * direction[2],
    };
    double enter = -INFINITY;
    double leave = INFINITY;
    int axis = 0;

    for (int i = 0; i < 3; i++) {
        /* A ray along a face divides by zero: the infinities keep the comparisons right. */
        const double a = (-box->half_m[i] - from[i]) / along[i];
        const double b = (box->half_m[i] - from[i]) / along[i];

        if (fmin(a, b) > enter) {
            enter = fmin(a, b);
            axis = i;
        }
        leave = fmin(leave, fmax(a, b));
    }
    if (!(enter > 0 && enter <= leave))
        return 0;

    const int u = axis == 0 ? 2 : 0;
    const int v = axis == 1 ? 2 : 1;

    *out_depth_m = from_m[2] + enter * direction[2];
    *out_face = 2 * axis + (along[axis] < 0);
    out_place_m[0] = from[u] + enter * along[u];
    out_place_m[1] = from[v] + enter * along[v];
    return 1;
}

struct shef_synth_hit shef_synth_world_look(const struct shef_synth_world *world,
                                            const double from_m[3], const double direction[3])
{
    const double *wall = world->wall_m;
    const double way = (wall[0] + wall[1] * from_m[0] + wall[2] * from_m[1] - from_m[2]) /
                       (direction[2] - wall[1] * direction[0] - wall[2] * direction[1]);
    double depth_m = from_m[2] + way * direction[2];
    double place_m[2] = { from_m[0] + way * direction[0], from_m[1] + way * direction[1] };
    uint64_t surface = world->seed;

    for (int32_t i = 0; i < world->n_boxes; i++) {
        double box_depth_m;
        double box_place_m[2];
        int face;

        if (hit_box(&world->boxes[i], from_m, direction, &box_depth_m, &face, box_place_m) &&
            box_depth_m < depth_m) {
            depth_m = box_depth_m;
            place_m[0] = box_place_m[0];
            place_m[1] = box_place_m[1];
            surface = world->seed + 1000 * (uint64_t)(i + 1) + 100 * (uint64_t)face;
        }
    }
    return (struct shef_synth_hit){ depth_m - from_m[2], texture(surface, place_m[0], place_m[1]) };
}
