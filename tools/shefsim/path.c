#include "shefsim/path.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "shefsim/numbers.h"

#define N_KNOTS        4096
#define CORNER_SHARE   0.15 /* radius of a square's corners, of its side */
#define LINE_SLOWING_M 0.01

enum curve { CIRCLE, SQUARE, LISSAJOUS, LINE };

struct shape {
    enum curve curve;
    double x; /* of a Lissajous curve the frequencies, of a line the direction */
    double y;
};

static const char *const names[] = {
    "square",    "circle",     "lissajous-a", "lissajous-b", "lissajous-c",
    "line-left", "line-right", "line-up",     "line-down",   NULL,
};

static const struct shape shapes[] = {
    { SQUARE, 0, 0 },    { CIRCLE, 0, 0 },    { LISSAJOUS, 1, 2 },
    { LISSAJOUS, 3, 2 }, { LISSAJOUS, 3, 4 }, { LINE, -1, 0 },
    { LINE, 1, 0 },      { LINE, 0, -1 },     { LINE, 0, 1 },
};

/* A parameter as a function of the distance gone, between two knots a cubic. */
struct knot {
    double parameter; /* in rounds */
    double slope;     /* per metre */
};

struct sim_path {
    struct shape shape;
    double size_m;
    double speed_m_s;
    double sin_tilt;
    double cos_tilt;
    double start_m;
    double centre_m[3];
    double round_m;
    double round_s;
    struct knot knots[N_KNOTS + 1]; /* of Lissajous curves */
};

/* A point of a curve and what it moves per metre or per round. */
struct point {
    double at[2];
    double rate[2];
};

const char *const *sim_path_names(void)
{
    return names;
}

static struct point lissajous_at(const struct sim_path *path, double round)
{
    const double half_m = path->size_m / 2;
    double s[2];
    double c[2];

    sim_sin_cos(path->shape.x * round, &s[0], &c[0]);
    sim_sin_cos(path->shape.y * round, &s[1], &c[1]);
    return (struct point){
        .at = { half_m * s[0], half_m * s[1] },
        .rate = { half_m * 2 * SIM_PI * path->shape.x * c[0],
                  half_m * 2 * SIM_PI * path->shape.y * c[1] },
    };
}

static double rate_of(struct point point)
{
    return sqrt(point.rate[0] * point.rate[0] + point.rate[1] * point.rate[1]);
}

/* How far it is from parameter a to b, for a short piece: Simpson's rule. */
static double piece_m(const struct sim_path *path, double a, double b)
{
    return (b - a) / 6 *
           (rate_of(lissajous_at(path, a)) + 4 * rate_of(lissajous_at(path, (a + b) / 2)) +
            rate_of(lissajous_at(path, b)));
}

/* Puts knots at even distances along a Lissajous curve. */
static void measure(struct sim_path *path)
{
    double gone_m = 0;
    double parameter = 0;

    path->round_m = 0;
    for (int i = 0; i < N_KNOTS; i++)
        path->round_m += piece_m(path, (double)i / N_KNOTS, (double)(i + 1) / N_KNOTS);
    for (int i = 0; i <= N_KNOTS; i++) {
        const double target_m = path->round_m * i / N_KNOTS;

        /* The step is small, so Newton's iteration ends after three rounds. */
        for (int k = 0; k < 3; k++) {
            const double next =
                parameter + (target_m - gone_m) / rate_of(lissajous_at(path, parameter));

            gone_m += piece_m(path, parameter, next);
            parameter = next;
        }
        path->knots[i] = (struct knot){ parameter, 1 / rate_of(lissajous_at(path, parameter)) };
    }
}

static struct point on_lissajous(const struct sim_path *path, double gone_m)
{
    const double step_m = path->round_m / N_KNOTS;
    const double n = floor(gone_m / step_m);
    const int i = n < N_KNOTS ? (int)n : N_KNOTS - 1;
    const double t = gone_m / step_m - i;
    const struct knot a = path->knots[i];
    const struct knot b = path->knots[i + 1];
    const double rise = b.parameter - a.parameter;
    const double a_slope = a.slope * step_m;
    const double b_slope = b.slope * step_m;
    /* Hermite: a + a' t + (3 rise - 2 a' - b') t^2 + (a' + b' - 2 rise) t^3. */
    const double square = 3 * rise - 2 * a_slope - b_slope;
    const double cube = a_slope + b_slope - 2 * rise;
    const double parameter = a.parameter + t * (a_slope + t * (square + t * cube));
    const double slope = (a_slope + t * (2 * square + t * 3 * cube)) / step_m;
    struct point point = lissajous_at(path, parameter);

    point.rate[0] *= slope;
    point.rate[1] *= slope;
    return point;
}

static struct point on_circle(const struct sim_path *path, double gone_m)
{
    const double radius_m = path->size_m / 2;
    double s;
    double c;

    sim_sin_cos(gone_m / path->round_m, &s, &c);
    return (struct point){ .at = { radius_m * c, radius_m * s }, .rate = { -s, c } };
}

/* From the middle of the right side, down first: a quarter is half a side, a corner, half a side;
 * each further quarter is turned by 90 degrees. */
static struct point on_square(const struct sim_path *path, double gone_m)
{
    const double half_m = path->size_m / 2;
    const double radius_m = CORNER_SHARE * path->size_m;
    const double straight_m = half_m - radius_m;
    const double quarter_m = path->round_m / 4;
    const double n = floor(gone_m / quarter_m);
    const int quarter = n < 4 ? (int)n : 3;
    const double gone = gone_m - quarter * quarter_m;
    struct point p;

    if (gone < straight_m) {
        p = (struct point){ .at = { half_m, gone }, .rate = { 0, 1 } };
    } else if (gone > quarter_m - straight_m) {
        p = (struct point){ .at = { quarter_m - gone, half_m }, .rate = { -1, 0 } };
    } else {
        double s;
        double c;

        sim_sin_cos((gone - straight_m) / (quarter_m - 2 * straight_m) / 4, &s, &c);
        p = (struct point){
            .at = { straight_m + radius_m * c, straight_m + radius_m * s },
            .rate = { -s, c },
        };
    }
    for (int i = 0; i < quarter; i++) {
        const struct point before = p;

        p = (struct point){ .at = { -before.at[1], before.at[0] },
                            .rate = { -before.rate[1], before.rate[0] } };
    }
    return p;
}

/* One stroke: constant acceleration, constant speed, constant deceleration. */
static struct point on_line(const struct sim_path *path, double t_s)
{
    const double slowing_s = 2 * LINE_SLOWING_M / path->speed_m_s;
    const double stroke_s = path->round_s / 2;
    const double in_round_s = t_s - path->round_s * floor(t_s / path->round_s);
    const double side = in_round_s < stroke_s ? 1 : -1;
    const double t = in_round_s < stroke_s ? in_round_s : in_round_s - stroke_s;
    const double left_s = stroke_s - t;
    const double half_m = path->size_m / 2;
    double at_m;
    double rate;

    if (t < slowing_s) {
        rate = t / slowing_s;
        at_m = -half_m + LINE_SLOWING_M * rate * rate;
    } else if (left_s < slowing_s) {
        rate = left_s / slowing_s;
        at_m = half_m - LINE_SLOWING_M * rate * rate;
    } else {
        rate = 1;
        at_m = -half_m + LINE_SLOWING_M + path->speed_m_s * (t - slowing_s);
    }
    return (struct point){
        .at = { side * at_m * path->shape.x, side * at_m * path->shape.y },
        .rate = { side * rate * path->shape.x, side * rate * path->shape.y },
    };
}

static struct point point_at(const struct sim_path *path, int64_t t_ns)
{
    const double t_s = (double)t_ns * 1e-9;
    double gone_m = path->start_m + path->speed_m_s * t_s;

    assert(t_ns >= 0);
    gone_m -= path->round_m * floor(gone_m / path->round_m);
    switch (path->shape.curve) {
    case CIRCLE:
        return on_circle(path, gone_m);
    case SQUARE:
        return on_square(path, gone_m);
    case LISSAJOUS:
        return on_lissajous(path, gone_m);
    case LINE:
        break;
    }
    return on_line(path, t_s);
}

static enum shef_err check(const struct sim_path_params *p, struct shef_error *err)
{
    if (!(p->size_m >= 0.03 && p->size_m <= 1))
        return shef_fail(err, SHEF_ERR_INVALID, "path '%s' of %g m: the size must be 0.03 to 1 m",
                         p->name, p->size_m);
    if (!(p->speed_m_s >= 0.001 && p->speed_m_s <= 1))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "path '%s' at %g m/s: the speed must be 0.001 to 1 m/s", p->name,
                         p->speed_m_s);
    if (!(p->tilt_deg >= -85 && p->tilt_deg <= 85))
        return shef_fail(err, SHEF_ERR_INVALID,
                         "path '%s' tilted by %g degrees: the tilt must be -85 to 85", p->name,
                         p->tilt_deg);
    if (!(p->phase >= 0 && p->phase <= 1))
        return shef_fail(err, SHEF_ERR_INVALID, "path '%s' from phase %g: the phase must be 0 to 1",
                         p->name, p->phase);
    for (int i = 0; i < 3; i++)
        if (!(p->centre_m[i] >= -20 && p->centre_m[i] <= 20))
            return shef_fail(err, SHEF_ERR_INVALID,
                             "path '%s' about (%g, %g, %g) m: coordinates must be -20 to 20",
                             p->name, p->centre_m[0], p->centre_m[1], p->centre_m[2]);
    return SHEF_OK;
}

enum shef_err sim_path_create(struct sim_path **out_path, const struct sim_path_params *params,
                              struct shef_error *err)
{
    const struct shape *shape = NULL;
    enum shef_err code;
    struct sim_path *path;

    for (int i = 0; names[i]; i++)
        if (strcmp(names[i], params->name) == 0)
            shape = &shapes[i];
    if (!shape)
        return shef_fail(err, SHEF_ERR_INVALID,
                         "there is no path '%s'; there are square, circle, lissajous-a, -b and -c, "
                         "line-left, -right, -up and -down",
                         params->name);
    code = check(params, err);
    if (code != SHEF_OK)
        return code;
    path = calloc(1, sizeof *path);
    if (!path)
        return shef_fail(err, SHEF_ERR_NO_MEMORY, "path '%s': out of memory", params->name);
    path->shape = *shape;
    path->size_m = params->size_m;
    path->speed_m_s = params->speed_m_s;
    sim_sin_cos(params->tilt_deg / 360, &path->sin_tilt, &path->cos_tilt);
    memcpy(path->centre_m, params->centre_m, sizeof path->centre_m);
    if (shape->curve == LISSAJOUS)
        measure(path);
    else if (shape->curve == CIRCLE)
        path->round_m = SIM_PI * path->size_m;
    else if (shape->curve == SQUARE)
        path->round_m = (4 * (1 - 2 * CORNER_SHARE) + 2 * SIM_PI * CORNER_SHARE) * path->size_m;
    else
        path->round_m = 2 * path->size_m;
    path->round_s = path->round_m / path->speed_m_s;
    /* Slowing down and speeding up take twice as long as the way would at full speed. */
    if (shape->curve == LINE)
        path->round_s += 4 * LINE_SLOWING_M / path->speed_m_s;
    path->start_m = params->phase * path->round_m;
    *out_path = path;
    return SHEF_OK;
}

void sim_path_destroy(struct sim_path *path)
{
    free(path);
}

double sim_path_round_m(const struct sim_path *path)
{
    return path->round_m;
}

double sim_path_round_s(const struct sim_path *path)
{
    return path->round_s;
}

struct shef_rigid sim_path_pose(const struct sim_path *path, int64_t t_ns)
{
    const struct point p = point_at(path, t_ns);
    struct shef_rigid pose = shef_rigid_identity();

    pose.t_m[0] = path->centre_m[0] + p.at[0];
    pose.t_m[1] = path->centre_m[1] + path->cos_tilt * p.at[1];
    pose.t_m[2] = path->centre_m[2] - path->sin_tilt * p.at[1];
    return pose;
}

void sim_path_velocity(const struct sim_path *path, int64_t t_ns, double out_m_s[3])
{
    const struct point p = point_at(path, t_ns);

    out_m_s[0] = path->speed_m_s * p.rate[0];
    out_m_s[1] = path->speed_m_s * path->cos_tilt * p.rate[1];
    out_m_s[2] = -path->speed_m_s * path->sin_tilt * p.rate[1];
}
