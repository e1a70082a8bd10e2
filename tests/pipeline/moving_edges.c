#include "moving_edges.h"

#include <math.h>
#include <stdlib.h>

#define KNOTS_PER_PX 16
#define SCENE_PX     (2 * SHEF_TEST_SCENE_ORIGIN_PX + 300)
#define BLUR_PX      5 /* reach of the blur to either side */
#define WARM_UP_PX   24.0

static double gaussian(struct shef_test_random *random)
{
    const double u = 1.0 - shef_test_random_unit(random);

    return sqrt(-2.0 * log(u)) * cos(2 * M_PI * shef_test_random_unit(random));
}

/* What a pixel one px wide behind a blurring lens sees of a point that far from its centre. */
static double seen(double distance_px, double blur_px)
{
    const double scale = 1.0 / (blur_px * sqrt(2.0));

    return erf((distance_px + .5) * scale) - erf((distance_px - .5) * scale);
}

static void fill_row(double *knots, int32_t n_knots, const struct shef_test_texture *texture,
                     double *sharp, struct shef_test_random *random)
{
    const int32_t reach = BLUR_PX * KNOTS_PER_PX;
    double weights[2 * BLUR_PX * KNOTS_PER_PX + 1];
    double total = 0;
    double level = 0;
    int32_t n_left = 0;
    bool is_bright = shef_test_random_range(random, 0, 1);

    for (int32_t i = 0; i < n_knots; i++) {
        if (n_left-- <= 0) {
            is_bright = !is_bright;
            level =
                texture->contrast * (texture->alternates ? (is_bright ? 1 : -1)
                                                         : 2 * shef_test_random_unit(random) - 1);
            n_left =
                (int32_t)(KNOTS_PER_PX * texture->cell_px * (.5 + shef_test_random_unit(random)));
        }
        sharp[i] = exp(level);
    }
    for (int32_t k = -reach; k <= reach; k++) {
        weights[k + reach] = seen((double)k / KNOTS_PER_PX, texture->blur_px);
        total += weights[k + reach];
    }
    for (int32_t i = 0; i < n_knots; i++) {
        double sum = 0;

        for (int32_t k = -reach; k <= reach; k++) {
            const int32_t at = i + k < 0 ? 0 : i + k >= n_knots ? n_knots - 1 : i + k;

            sum += sharp[at] * weights[k + reach];
        }
        knots[i] = log(sum / total);
    }
}

struct shef_test_scene shef_test_scene_create(const struct shef_test_texture *texture,
                                              int32_t width_px, int32_t height_px,
                                              struct shef_test_random *random)
{
    struct shef_test_scene scene = {
        .width_px = width_px,
        .height_px = height_px,
        .n_knots = SCENE_PX * KNOTS_PER_PX,
    };
    double *sharp = malloc((size_t)scene.n_knots * sizeof *sharp);

    scene.knots = malloc((size_t)height_px * (size_t)scene.n_knots * sizeof *scene.knots);
    TEST_ASSERT_NOT_NULL(sharp);
    TEST_ASSERT_NOT_NULL(scene.knots);
    for (int32_t y = 0; y < height_px; y++)
        fill_row(scene.knots + (size_t)y * (size_t)scene.n_knots, scene.n_knots, texture, sharp,
                 random);
    free(sharp);
    return scene;
}

void shef_test_scene_destroy(struct shef_test_scene *scene)
{
    free(scene->knots);
    scene->knots = NULL;
}

double shef_test_scene_at(const struct shef_test_scene *scene, int32_t y_px, double position_px)
{
    const double *knots = scene->knots + (size_t)y_px * (size_t)scene->n_knots;
    const double at = position_px * KNOTS_PER_PX;
    const int32_t i = (int32_t)at;

    TEST_ASSERT_TRUE(at >= 0 && i + 1 < scene->n_knots);
    return knots[i] + (at - i) * (knots[i + 1] - knots[i]);
}

/* Events as they come, pixel by pixel. */
struct collection {
    struct shef_event *events;
    uint32_t n;
    uint32_t capacity;
};

static void collect(struct collection *all, struct shef_event event)
{
    if (all->n == all->capacity) {
        all->capacity = all->capacity ? 2 * all->capacity : 1 << 16;
        all->events = realloc(all->events, all->capacity * sizeof *all->events);
        TEST_ASSERT_NOT_NULL(all->events);
    }
    all->events[all->n++] = event;
}

/* Follows one pixel from knot to knot. */
static void run_pixel(const struct shef_test_scene *scene, const struct shef_test_pass *pass,
                      int32_t x, int32_t y, struct shef_test_random *random, struct collection *all)
{
    const double *knots = scene->knots + (size_t)y * (size_t)scene->n_knots;
    const double knots_per_us = -pass->speed_px_s * KNOTS_PER_PX * 1e-6;
    const int32_t step = knots_per_us > 0 ? 1 : -1;
    const double mid_knot = (x + SHEF_TEST_SCENE_ORIGIN_PX) * KNOTS_PER_PX;
    const double on_step = pass->threshold * fmax(.2, 1 + pass->mismatch * gaussian(random));
    const double off_step = pass->threshold * fmax(.2, 1 + pass->mismatch * gaussian(random));
    const double first_knot = mid_knot + (double)(pass->first_us - pass->mid_us) * knots_per_us -
                              step * WARM_UP_PX * KNOTS_PER_PX;
    const double last_knot = mid_knot + (double)(pass->last_us - pass->mid_us) * knots_per_us;
    double reference =
        knots[(int32_t)first_knot] + (shef_test_random_unit(random) - .5) * pass->threshold;

    for (int32_t i = (int32_t)first_knot; step * (i - last_knot) < 0; i += step) {
        const double here = knots[i];
        const double next = knots[i + step];

        for (;;) {
            const bool on = next > here;
            const double level = on ? reference + on_step : reference - off_step;

            if (on ? next < level : next > level || next == here)
                break;

            const double share = fmin(fmax((level - here) / (next - here), 0), 1);
            const double t_us = (double)pass->mid_us + (i + step * share - mid_knot) / knots_per_us;

            reference = level;
            if (t_us >= (double)pass->first_us && t_us < (double)pass->last_us)
                collect(all, shef_event_make((uint32_t)(t_us - (double)pass->first_us), (uint32_t)x,
                                             (uint32_t)y, on));
        }
    }
}

/* A counting sort by time keeps the order of equal times. */
static struct shef_event *sorted(const struct collection *all, uint32_t n_us)
{
    struct shef_event *events = malloc(((size_t)all->n + 1) * sizeof *events);
    uint32_t *places = calloc((size_t)n_us + 1, sizeof *places);

    TEST_ASSERT_NOT_NULL(events);
    TEST_ASSERT_NOT_NULL(places);
    for (uint32_t i = 0; i < all->n; i++)
        places[all->events[i].t_us + 1]++;
    for (uint32_t t = 0; t < n_us; t++)
        places[t + 1] += places[t];
    for (uint32_t i = 0; i < all->n; i++)
        events[places[all->events[i].t_us]++] = all->events[i];
    free(places);
    return events;
}

uint32_t shef_test_scene_run(const struct shef_test_scene *scene, const struct shef_test_pass *pass,
                             struct shef_test_random *random, struct shef_event **out_events)
{
    struct collection all = { 0 };

    for (int32_t y = 0; y < scene->height_px; y++)
        for (int32_t x = 0; x < scene->width_px; x++)
            run_pixel(scene, pass, x, y, random, &all);
    *out_events = sorted(&all, (uint32_t)(pass->last_us - pass->first_us));
    free(all.events);
    return all.n;
}
