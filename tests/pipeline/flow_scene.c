#include "flow_scene.h"

#include <math.h>
#include <stdlib.h>

#include "core/memory.h"

#define SIDE        512 /* knots of a texture */
#define KNOTS_PX    2.0 /* a pixel */
#define CELL_PX     9.0
#define BLUR_PX     0.8
#define HALF_TIME_S 0.024
#define STEP_PX     0.25
#define CUTOFF_S    120.0

static double *make_texture(double contrast, struct shef_test_random *random)
{
    enum { CELLS = 28 };
    static double cells[CELLS][CELLS];
    static double scratch[SIDE];
    const double sigma = BLUR_PX * KNOTS_PX;
    const int32_t reach = (int32_t)ceil(3 * sigma);
    double *logs = shef_memory_create((size_t)SIDE * SIDE, sizeof *logs);

    if (!logs)
        abort();
    for (int i = 0; i < CELLS; i++)
        for (int j = 0; j < CELLS; j++)
            cells[i][j] = 4.4 + contrast * 1.6 * (shef_test_random_unit(random) - 0.5);
    for (int32_t y = 0; y < SIDE; y++)
        for (int32_t x = 0; x < SIDE; x++) {
            /* Cells with wavy borders: edges run every way. */
            const double wave_x = x + 9 * sin(y * 6.283185307 * 11 / SIDE);
            const double wave_y = y + 9 * sin(x * 6.283185307 * 9 / SIDE);
            const int32_t i = (int32_t)(fmod(wave_y + SIDE, SIDE) * CELLS / SIDE);
            const int32_t j = (int32_t)(fmod(wave_x + SIDE, SIDE) * CELLS / SIDE);

            logs[y * SIDE + x] = cells[i][j];
        }
    for (int pass = 0; pass < 2; pass++)
        for (int32_t line = 0; line < SIDE; line++) {
            double *first = pass ? logs + line : logs + (size_t)line * SIDE;
            const ptrdiff_t step = pass ? SIDE : 1;

            for (int32_t i = 0; i < SIDE; i++) {
                double sum = 0;
                double weights = 0;

                for (int32_t k = -reach; k <= reach; k++) {
                    const double weight = exp(-k * k / (2 * sigma * sigma));

                    sum += weight * first[((i + k + SIDE) % SIDE) * step];
                    weights += weight;
                }
                scratch[i] = sum / weights;
            }
            for (int32_t i = 0; i < SIDE; i++)
                first[i * step] = scratch[i];
        }
    return logs;
}

static double texture_at(const double *logs, double u_px, double v_px)
{
    const double u = u_px * KNOTS_PX + 64 * SIDE;
    const double v = v_px * KNOTS_PX + 64 * SIDE;
    const int32_t iu = (int32_t)u;
    const int32_t iv = (int32_t)v;
    const double fu = u - iu;
    const double fv = v - iv;
    const double *row0 = logs + (size_t)(iv % SIDE) * SIDE;
    const double *row1 = logs + (size_t)((iv + 1) % SIDE) * SIDE;
    const int32_t u0 = iu % SIDE;
    const int32_t u1 = (iu + 1) % SIDE;

    return (1 - fv) * ((1 - fu) * row0[u0] + fu * row0[u1]) +
           fv * ((1 - fu) * row1[u0] + fu * row1[u1]);
}

static int by_disparity(const void *a, const void *b)
{
    const double x = ((const struct shef_test_flow_layer *)a)->disparity_px;
    const double y = ((const struct shef_test_flow_layer *)b)->disparity_px;

    return (x < y) - (x > y);
}

struct shef_test_flow_scene shef_test_flow_scene_create(const struct shef_rectification *profile,
                                                        double contrast,
                                                        struct shef_test_random *random)
{
    struct shef_test_flow_scene scene = { .profile = *profile };
    const double scale = profile->f_px / 555;

    for (int k = 0; k < SHEF_TEST_FLOW_LAYERS; k++) {
        struct shef_test_flow_layer *layer = &scene.layers[k];
        const double width = profile->width_px * (0.2 + 0.3 * shef_test_random_unit(random));
        const double height = profile->height_px * (0.2 + 0.4 * shef_test_random_unit(random));

        layer->left_px = profile->width_px * (shef_test_random_unit(random) - 0.1);
        layer->top_px = profile->height_px * (shef_test_random_unit(random) - 0.1);
        layer->right_px = layer->left_px + width;
        layer->bottom_px = layer->top_px + height;
        layer->disparity_px = scale * (10 + 30 * shef_test_random_unit(random));
        layer->logs = make_texture(contrast, random);
    }
    /* A wall behind everything. */
    scene.layers[0].left_px = scene.layers[0].top_px = -1e6;
    scene.layers[0].right_px = scene.layers[0].bottom_px = 1e6;
    scene.layers[0].disparity_px = scale * (6 + 6 * shef_test_random_unit(random));
    qsort(scene.layers, SHEF_TEST_FLOW_LAYERS, sizeof scene.layers[0], by_disparity);
    for (int k = 0; k < SHEF_TEST_FLOW_LAYERS; k++)
        if (scene.layers[k].left_px == -1e6)
            for (int after = k + 1; after < SHEF_TEST_FLOW_LAYERS; after++)
                scene.layers[after].right_px = -1e9; /* behind the wall */
    return scene;
}

void shef_test_flow_scene_destroy(struct shef_test_flow_scene *scene)
{
    for (int k = 0; k < SHEF_TEST_FLOW_LAYERS; k++)
        free(scene->layers[k].logs);
}

/* The logarithm that a camera sees there which is that many baselines off the left one. */
static double seen_at(const struct shef_test_flow_scene *scene, double x_px, double y_px,
                      const double baselines[3])
{
    const struct shef_rectification *p = &scene->profile;

    for (int k = 0; k < SHEF_TEST_FLOW_LAYERS; k++) {
        const struct shef_test_flow_layer *layer = &scene->layers[k];
        const double d = layer->disparity_px;
        /* Depth in baselines is f / d; it shrinks by the way made along z. */
        const double shrunk = 1 - baselines[2] * d / p->f_px;
        const double u = p->cx_px + (x_px - p->cx_px) * shrunk + d * baselines[0];
        const double v = p->cy_px + (y_px - p->cy_px) * shrunk + d * baselines[1];

        if (u >= layer->left_px && u < layer->right_px && v >= layer->top_px &&
            v < layer->bottom_px)
            return texture_at(layer->logs, u, v);
    }
    abort();
}

static double normal(struct shef_test_random *random)
{
    double sum = -6;

    for (int i = 0; i < 12; i++)
        sum += shef_test_random_unit(random);
    return sum;
}

void shef_test_flow_frame(const struct shef_test_flow_scene *scene, const double baselines_s[3],
                          struct shef_test_random *random, struct shef_image_u8 out)
{
    for (int32_t y = 0; y < out.height_px; y++)
        for (int32_t x = 0; x < out.width_px; x++) {
            double grey = 0;

            for (int k = -1; k <= 1; k++) {
                const double t = k * 0.0017;
                const double at[3] = { baselines_s[0] * t, baselines_s[1] * t, baselines_s[2] * t };

                grey += exp(seen_at(scene, x, y, at)) / 3;
            }
            grey += (0.5 + 0.05 * sqrt(grey)) * normal(random);
            shef_row_u8(out, y)[x] = (uint8_t)lrint(fmax(0, fmin(255, grey)));
        }
}

static int compare_floats(const void *a, const void *b)
{
    const float x = *(const float *)a;
    const float y = *(const float *)b;

    return (x > y) - (x < y);
}

static void fill_graded(const float *values, struct shef_edge_map *out)
{
    const size_t n = (size_t)out->width_px * (size_t)out->height_px;
    float *sorted = malloc(n * sizeof *sorted);

    if (!sorted)
        abort();
    for (size_t i = 0; i < n; i++)
        sorted[i] = fabsf(values[i]);
    qsort(sorted, n, sizeof *sorted, compare_floats);

    const float limit = fmaxf(sorted[n * 9 / 10], 0.3F);

    free(sorted);
    for (int32_t y = 0; y < out->height_px; y++)
        for (int32_t x = 0; x < out->width_px; x++)
            out->graded[y * out->graded_stride_bytes + x] = (int8_t)lrintf(
                127 *
                fmaxf(-1, fminf(1, values[(size_t)y * (size_t)out->width_px + (size_t)x] / limit)));
}

void shef_test_flow_events(const struct shef_test_flow_scene *scene, const double baselines_s[3],
                           double threshold, double noise_hz, struct shef_test_random *random,
                           struct shef_edge_map *out)
{
    const double fastest = scene->layers[0].disparity_px *
                           sqrt(baselines_s[0] * baselines_s[0] + baselines_s[1] * baselines_s[1] +
                                baselines_s[2] * baselines_s[2]);
    const int32_t n_steps = (int32_t)fmin(200, 8 + 2 * HALF_TIME_S * fastest / STEP_PX);
    float *values = calloc((size_t)out->width_px * (size_t)out->height_px, sizeof *values);

    if (!values)
        abort();
    for (int32_t y = 0; y < out->height_px; y++)
        for (int32_t x = 0; x < out->width_px; x++) {
            const double rising = threshold * fmax(0.5, 1 + 0.1 * normal(random));
            const double falling = threshold * fmax(0.5, 1 + 0.1 * normal(random));
            double reference = 0;
            double value = 0;

            for (int32_t step = 0; step <= n_steps; step++) {
                const double t = HALF_TIME_S * (2.0 * step / n_steps - 1);
                const double at[3] = { 1 + baselines_s[0] * t, baselines_s[1] * t,
                                       baselines_s[2] * t };
                const double level = seen_at(scene, x, y, at);

                if (step == 0)
                    reference = level + threshold * (2 * shef_test_random_unit(random) - 1);
                for (; level >= reference + rising; reference += rising)
                    value += exp(-CUTOFF_S * fabs(t));
                for (; level <= reference - falling; reference -= falling)
                    value -= exp(-CUTOFF_S * fabs(t));
            }
            if (shef_test_random_unit(random) < noise_hz * 2 * HALF_TIME_S)
                value += (shef_test_random_range(random, 0, 1) ? 1 : -1) *
                         exp(-CUTOFF_S * HALF_TIME_S * shef_test_random_unit(random));
            values[(size_t)y * (size_t)out->width_px + (size_t)x] = (float)value;
        }
    fill_graded(values, out);
    free(values);
}
