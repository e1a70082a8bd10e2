/* What shapes are made of. */
#include <math.h>

#include "shefsim/numbers.h"
#include "shefsim/scene_internal.h"

/* How far cameras may be from the middle of the path. */
#define CAMERA_RANGE_M 0.5

/* The object's own axes in the world, of length 1: x, y, z. */
struct frame {
    double axis[3][3];
    double middle[3]; /* of the body, not of its underside */
};

static struct frame frame_of(const struct sim_object *object)
{
    double sin_yaw;
    double cos_yaw;
    double sin_tilt;
    double cos_tilt;

    sim_sin_cos(object->yaw_deg / 360, &sin_yaw, &cos_yaw);
    sim_sin_cos(object->tilt_deg / 360, &sin_tilt, &cos_tilt);

    /* First about x: what is up (-y) leans back (+z). Then about y: the front (-z) turns to +x. */
    struct frame frame = {
        .axis = {
            { cos_yaw, 0, sin_yaw },
            { sin_yaw * sin_tilt, cos_tilt, -cos_yaw * sin_tilt },
            { -sin_yaw * cos_tilt, sin_tilt, cos_yaw * cos_tilt },
        },
    };

    for (int i = 0; i < 3; i++)
        frame.middle[i] = object->position_m[i] - frame.axis[1][i] * object->size_m[1] / 2;
    return frame;
}

/* One rectangle of a box: at the middle plus `along` times half the box; x and y are its texture's
 * directions, so that z = x times y points out. */
static struct sim_surface face(const struct sim_object *object, const struct frame *frame, int x,
                               double x_sign, int y, double y_sign, int z, double z_sign)
{
    struct sim_surface surface = { .kind = SIM_SURFACE_QUAD, .one_sided = true };

    for (int i = 0; i < 3; i++) {
        surface.centre[i] = frame->middle[i] + z_sign * frame->axis[z][i] * object->size_m[z] / 2;
        surface.axis[0][i] = x_sign * frame->axis[x][i] * object->size_m[x] / 2;
        surface.axis[1][i] = y_sign * frame->axis[y][i] * object->size_m[y] / 2;
        surface.axis[2][i] = z_sign * frame->axis[z][i];
    }
    return surface;
}

static int32_t box(const struct sim_object *object, const struct frame *frame,
                   struct sim_surface *out)
{
    out[0] = face(object, frame, 0, 1, 1, 1, 2, -1);  /* front */
    out[1] = face(object, frame, 2, 1, 1, 1, 0, 1);   /* right */
    out[2] = face(object, frame, 2, -1, 1, 1, 0, -1); /* left */
    out[3] = face(object, frame, 0, 1, 2, 1, 1, -1);  /* top */
    out[4] = face(object, frame, 0, -1, 1, 1, 2, 1);  /* back */
    out[5] = face(object, frame, 0, 1, 2, -1, 1, 1);  /* bottom */
    return 6;
}

static struct sim_surface round_body(const struct sim_object *object, const struct frame *frame,
                                     enum sim_surface_kind kind)
{
    struct sim_surface surface = { .kind = kind, .clip = { -1, 1 } };

    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++)
            surface.axis[k][i] = frame->axis[k][i] * object->size_m[k] / 2;
    for (int i = 0; i < 3; i++)
        surface.centre[i] = frame->middle[i];
    return surface;
}

/* A flat end at the upper (-1) or lower (1) side. */
static struct sim_surface end(const struct sim_object *object, const struct frame *frame,
                              double side, enum sim_surface_kind kind)
{
    struct sim_surface surface = face(object, frame, 0, 1, 2, 1, 1, -1);

    surface.kind = kind;
    surface.one_sided = false;
    for (int i = 0; i < 3; i++)
        surface.centre[i] = frame->middle[i] + side * frame->axis[1][i] * object->size_m[1] / 2;
    return surface;
}

static int32_t shapes(const struct sim_object *object, const struct frame *frame,
                      struct sim_surface *out)
{
    switch (object->shape) {
    case SIM_SHAPE_BOX:
        return box(object, frame, out);
    case SIM_SHAPE_ELLIPSOID:
        out[0] = round_body(object, frame, SIM_SURFACE_ELLIPSOID);
        return 1;
    case SIM_SHAPE_CYLINDER:
        out[0] = round_body(object, frame, SIM_SURFACE_CYLINDER);
        out[1] = end(object, frame, -1, SIM_SURFACE_DISC);
        return 2;
    case SIM_SHAPE_CUP:
        out[0] = round_body(object, frame, SIM_SURFACE_CYLINDER);
        out[1] = end(object, frame, 1, SIM_SURFACE_DISC);
        return 2;
    case SIM_SHAPE_BOWL:
        /* The ellipsoid's lower half: its middle is at the rim. */
        out[0] = round_body(object, frame, SIM_SURFACE_ELLIPSOID);
        for (int i = 0; i < 3; i++) {
            out[0].axis[1][i] *= 2;
            out[0].centre[i] -= out[0].axis[1][i] / 2;
        }
        out[0].clip[0] = 0;
        return 1;
    case SIM_SHAPE_DISC:
        out[0] = end(object, frame, -1, SIM_SURFACE_DISC);
        return 1;
    case SIM_SHAPE_FLOOR:
        out[0] = end(object, frame, -1, SIM_SURFACE_QUAD);
        return 1;
    case SIM_SHAPE_WALL:
        out[0] = face(object, frame, 0, 1, 1, 1, 2, -1);
        out[0].one_sided = false;
        return 1;
    }
    return 0;
}

/* Whether a flat surface turns its outside to any camera near the path. */
static bool can_be_seen(const struct sim_surface *surface)
{
    double normal[3];
    double ahead = 0;

    if (!surface->one_sided)
        return true;
    sim_surface_normal(surface, (double[3]){ 0 }, normal);
    for (int i = 0; i < 3; i++)
        ahead -= normal[i] * surface->centre[i];
    return ahead > -CAMERA_RANGE_M;
}

int32_t sim_object_surfaces(const struct sim_object *object, int32_t number,
                            const struct sim_material *material, struct sim_surface *out_surfaces)
{
    const struct frame frame = frame_of(object);
    struct sim_surface all[SIM_SURFACES_PER_OBJECT];
    const int32_t n = shapes(object, &frame, all);
    int32_t n_kept = 0;

    for (int32_t i = 0; i < n; i++) {
        all[i].object = number;
        all[i].part_size[0] = all[i].part_size[1] = 1;
        all[i].gloss = material->gloss;
        all[i].sharpness = material->sharpness;
        if (can_be_seen(&all[i]))
            out_surfaces[n_kept++] = all[i];
    }
    return n_kept;
}

double sim_object_clearance_m(const struct sim_object *object, const double point_m[3])
{
    const struct frame frame = frame_of(object);
    double squared = 0;

    for (int k = 0; k < 3; k++) {
        double along = 0;
        double outside;

        for (int i = 0; i < 3; i++)
            along += frame.axis[k][i] * (point_m[i] - frame.middle[i]);
        outside = fabs(along) - object->size_m[k] / 2;
        if (outside > 0)
            squared += outside * outside;
    }
    return sqrt(squared);
}
