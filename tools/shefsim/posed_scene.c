#include <math.h>

#include "shefsim/view_internal.h"

/* What is nearer than this to the camera's plane has no bounds in the picture. */
#define BOUNDED_DEPTH_M 0.05
#define EVERYWHERE      1e9f

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* scale * (world vector . ray), as factors of the ray in camera axes, plus more of others. */
static void set_factors(float out[3], const struct shef_rigid *pose, const double world[3],
                        double scale, const double more[3], double more_scale)
{
    for (int i = 0; i < 3; i++) {
        const double in_camera =
            pose->r[i] * world[0] + pose->r[3 + i] * world[1] + pose->r[6 + i] * world[2];

        out[i] = (float)(scale * in_camera + (more ? more_scale * more[i] : 0));
    }
}

static bool set_flat(struct sim_trace_surface *out, const struct sim_surface *s,
                     const struct shef_rigid *pose)
{
    double normal[3];
    double from_centre[3];
    double inverse[3];
    double ahead;

    sim_surface_normal(s, (double[3]){ 0 }, normal);
    for (int i = 0; i < 3; i++)
        from_centre[i] = pose->t_m[i] - s->centre[i];
    ahead = -dot(normal, from_centre);
    /* Seen from behind, or along its plane. */
    if ((s->one_sided && ahead > 0) || fabs(ahead) < 1e-6)
        return false;
    for (int i = 0; i < 3; i++)
        inverse[i] =
            (pose->r[i] * normal[0] + pose->r[3 + i] * normal[1] + pose->r[6 + i] * normal[2]) /
            ahead;
    set_factors(out->inverse_depth, pose, normal, 1 / ahead, NULL, 0);
    for (int k = 0; k < 2; k++) {
        const double size = k == 0 ? s->texture.width : s->texture.height;
        const double scale = size / 2 / dot(s->axis[k], s->axis[k]);
        const double at_camera = size / 2 + scale * dot(s->axis[k], from_centre);

        set_factors(k == 0 ? out->u : out->v, pose, s->axis[k], scale, inverse, at_camera);
    }
    return true;
}

static void set_curved(struct sim_trace_surface *out, const struct sim_surface *s,
                       const struct shef_rigid *pose)
{
    double origin[3];

    sim_surface_local(s, pose->t_m, origin);
    for (int k = 0; k < 3; k++) {
        set_factors(out->local[k], pose, s->axis[k], 1 / dot(s->axis[k], s->axis[k]), NULL, 0);
        out->origin[k] = (float)origin[k];
    }
    out->clip[0] = (float)s->clip[0];
    out->clip[1] = (float)s->clip[1];
}

static void set_gloss(struct sim_trace_surface *out, const struct sim_surface *s,
                      const struct sim_scene *scene, const struct shef_rigid *pose)
{
    static const double unit[3][3] = { { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };

    out->gloss = (float)(s->gloss * scene->brightest.power);
    out->sharpness = s->sharpness;
    if (!(out->gloss > 0))
        return;
    for (int i = 0; i < 3; i++) {
        set_factors(out->world[i], pose, unit[i], 1, NULL, 0);
        out->lamp[i] = (float)(scene->brightest.position_m[i] - pose->t_m[i]);
    }
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            out->normal[k][i] = (float)(s->axis[k][i] / dot(s->axis[k], s->axis[k]));
    if (s->kind == SIM_SURFACE_CYLINDER)
        for (int i = 0; i < 3; i++)
            out->normal[1][i] = 0;
    if (s->kind == SIM_SURFACE_QUAD || s->kind == SIM_SURFACE_DISC) {
        /* Towards the camera, whichever side that is. */
        const double side = dot(s->axis[2], pose->t_m) < dot(s->axis[2], s->centre) ? -1 : 1;

        for (int i = 0; i < 3; i++)
            out->normal[2][i] = (float)(side * s->axis[2][i]);
    }
}

static void set_texture(struct sim_trace_surface *out, const struct sim_texture *texture,
                        bool blink_on)
{
    out->pairs = texture->inverse && !blink_on ? texture->inverse : texture->pairs;
    out->pitch = texture->width + 1;
    out->last_u = texture->width - 1;
    out->last_v = texture->height - 1;
    out->max_u = (float)texture->width;
    out->max_v = (float)texture->height;
    out->light = texture->scale * texture->scale;
}

static void widen(float range[2], double value)
{
    /* A little more, for roundings. */
    const float low = (float)(value - 1e-5);
    const float high = (float)(value + 1e-5);

    range[0] = low < range[0] ? low : range[0];
    range[1] = high > range[1] ? high : range[1];
}

/* Where the surface can be in the picture. False: behind the camera. */
static bool set_bounds(struct sim_posed_surface *out, const struct sim_surface *s,
                       const struct shef_rigid *pose)
{
    const int n_corners =
        out->trace.kind == SIM_SURFACE_QUAD || out->trace.kind == SIM_SURFACE_DISC ? 4 : 8;
    float depth[2] = { EVERYWHERE, -EVERYWHERE };
    bool is_bounded = true;

    out->x[0] = out->y[0] = EVERYWHERE;
    out->x[1] = out->y[1] = -EVERYWHERE;
    for (int n = 0; n < n_corners; n++) {
        double local[3] = { n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1 };
        double point[3];
        double in_camera[3];

        if (n_corners == 8)
            local[1] = s->clip[n & 2 ? 1 : 0];
        else
            local[2] = 0;
        sim_surface_point(s, local, point);
        for (int i = 0; i < 3; i++)
            in_camera[i] = pose->r[i] * (point[0] - pose->t_m[0]) +
                           pose->r[3 + i] * (point[1] - pose->t_m[1]) +
                           pose->r[6 + i] * (point[2] - pose->t_m[2]);
        widen(depth, in_camera[2]);
        if (in_camera[2] < BOUNDED_DEPTH_M) {
            is_bounded = false;
            continue;
        }
        widen(out->x, in_camera[0] / in_camera[2]);
        widen(out->y, in_camera[1] / in_camera[2]);
    }
    if (!is_bounded) {
        out->x[0] = out->y[0] = -EVERYWHERE;
        out->x[1] = out->y[1] = EVERYWHERE;
    }
    out->nearest_m = depth[0] > 0 ? depth[0] : 0;
    return depth[1] > SIM_TRACE_NEAREST_M;
}

void sim_posed_scene_set(struct sim_posed_scene *posed, const struct sim_scene *scene,
                         const struct shef_rigid *t_world_camera, bool blink_on)
{
    posed->n_surfaces = 0;
    for (int32_t i = 0; i < scene->n_surfaces; i++) {
        const struct sim_surface *s = &scene->surfaces[i];
        const bool is_flat = s->kind == SIM_SURFACE_QUAD || s->kind == SIM_SURFACE_DISC;
        struct sim_posed_surface now = { .is_flat = s->kind == SIM_SURFACE_QUAD };
        int32_t at = posed->n_surfaces;

        now.trace.kind = s->kind;
        now.trace.object = s->object;
        if (!set_bounds(&now, s, t_world_camera))
            continue;
        if (is_flat && !set_flat(&now.trace, s, t_world_camera))
            continue;
        if (!is_flat)
            set_curved(&now.trace, s, t_world_camera);
        set_texture(&now.trace, &s->texture, blink_on);
        set_gloss(&now.trace, s, scene, t_world_camera);
        for (; at > 0 && posed->surfaces[at - 1].nearest_m > now.nearest_m; at--)
            posed->surfaces[at] = posed->surfaces[at - 1];
        posed->surfaces[at] = now;
        posed->n_surfaces++;
    }
}
