/* Ray casting, written once for every instruction set.
 *
 * The including file first defines
 *   LANES          how many rays a vector holds, 1..16, a divisor of 16
 *   real           LANES floats, with the operators + - * / and unary -
 *   whole, mask    LANES int32 and LANES truth values
 *   the r_ (real), w_ (whole) and m_ (mask) functions used here
 * r_pick(m, a, b) is a where m, else b. Comparisons with NaN are false. */

#include "shefsim/kernels/trace.h"

struct rays {
    real x;
    real y;
};

static inline real linear(const float factors[3], struct rays ray)
{
    return r_set(factors[0]) * ray.x + (r_set(factors[1]) * ray.y + r_set(factors[2]));
}

/* NaN becomes low. */
static inline real limited(real value, real low, real high)
{
    const real raised = r_pick(r_less(low, value), value, low);

    return r_pick(r_less(raised, high), raised, high);
}

static inline real absolute(real value)
{
    return r_pick(r_less(value, r_set(0)), -value, value);
}

/* Light at texture coordinates: bilinear in the square root. */
static inline real texture(const struct sim_trace_surface *surface, real u, real v)
{
    const real in_u = limited(u, r_set(0), r_set(surface->max_u));
    const real in_v = limited(v, r_set(0), r_set(surface->max_v));
    const whole column = w_least(w_truncate(in_u), w_set(surface->last_u));
    const whole row = w_least(w_truncate(in_v), w_set(surface->last_v));
    const whole square = w_gather(surface->pairs, w_at(row, surface->pitch, column));
    const real du = in_u - r_from(column);
    const real dv = in_v - r_from(row);
    const real a = r_byte0(square);
    const real b = r_byte2(square);
    const real c = r_byte1(square);
    const real d = r_byte3(square);
    const real upper = a + du * (b - a);
    const real lower = c + du * (d - c);
    const real texel = upper + dv * (lower - upper);

    return texel * texel * r_set(surface->light);
}

/* Where rays hit a surface. */
struct hit {
    mask is_hit;
    real depth;
    real u;
    real v;
    real local[3]; /* of curved surfaces; of flat ones (0, 0, 1) */
};

static inline struct hit hit_flat(const struct sim_trace_surface *s, struct rays ray)
{
    /* Neighbouring sides of a body overlap by this many texels, so that no ray slips through. */
    const real seam = r_set(.01f);
    const real inverse = linear(s->inverse_depth, ray);
    const real depth = r_set(1) / inverse;
    struct hit hit = {
        .depth = depth,
        .u = linear(s->u, ray) * depth,
        .v = linear(s->v, ray) * depth,
        .local = { r_set(0), r_set(0), r_set(1) },
    };

    hit.is_hit = m_and(r_less(r_set(1 / SIM_TRACE_FARTHEST_M), inverse),
                       r_less(inverse, r_set(1 / SIM_TRACE_NEAREST_M)));
    hit.is_hit =
        m_and(hit.is_hit, m_and(r_less(-seam, hit.u), r_less(hit.u, r_set(s->max_u) + seam)));
    hit.is_hit =
        m_and(hit.is_hit, m_and(r_less(-seam, hit.v), r_less(hit.v, r_set(s->max_v) + seam)));
    if (s->kind == SIM_SURFACE_DISC) {
        const real x = hit.u * r_set(2 / s->max_u) - r_set(1);
        const real y = hit.v * r_set(2 / s->max_v) - r_set(1);

        hit.is_hit = m_and(hit.is_hit, r_less(x * x + y * y, r_set(1)));
    }
    return hit;
}

/* Where a ray is at that depth, and whether that is within the clip. */
static inline mask find_local(const struct sim_trace_surface *s, const real direction[3],
                              real depth, real out_local[3])
{
    for (int i = 0; i < 3; i++)
        out_local[i] = r_set(s->origin[i]) + depth * direction[i];
    return m_and(
        m_and(r_less(r_set(SIM_TRACE_NEAREST_M), depth),
              r_less(depth, r_set(SIM_TRACE_FARTHEST_M))),
        m_and(r_less(r_set(s->clip[0]), out_local[1]), r_less(out_local[1], r_set(s->clip[1]))));
}

/* Octahedron, unfolded: one texel more than the square all around. */
static inline void find_ball_texel(const struct sim_trace_surface *s, struct hit *hit)
{
    const real one = r_set(1);
    const real sum = absolute(hit->local[0]) + absolute(hit->local[1]) + absolute(hit->local[2]);
    const real a = hit->local[0] / sum;
    const real b = hit->local[2] / sum;
    const mask is_lower = r_less(r_set(0), hit->local[1]);
    const real folded_a = (one - absolute(b)) * r_pick(r_less(a, r_set(0)), -one, one);
    const real folded_b = (one - absolute(a)) * r_pick(r_less(b, r_set(0)), -one, one);

    hit->u = (r_pick(is_lower, folded_a, a) + one) * r_set(s->max_u / 2 - 1) + one;
    hit->v = (r_pick(is_lower, folded_b, b) + one) * r_set(s->max_v / 2 - 1) + one;
}

static inline void find_cylinder_texel(const struct sim_trace_surface *s, struct hit *hit)
{
    const real x = hit->local[0];
    const real z = hit->local[2];
    const real a = x / (absolute(x) + absolute(z));
    const real turn = r_pick(r_less(z, r_set(0)), r_set(3) + a, r_set(1) - a);

    hit->u = turn * r_set(s->max_u / 4);
    hit->v = (hit->local[1] + r_set(1)) * r_set(s->max_v / 2);
}

static inline struct hit hit_curved(const struct sim_trace_surface *s, struct rays ray)
{
    const bool is_ball = s->kind == SIM_SURFACE_ELLIPSOID;
    const real direction[3] = { linear(s->local[0], ray), linear(s->local[1], ray),
                                linear(s->local[2], ray) };
    real squared = direction[0] * direction[0] + direction[2] * direction[2];
    real along = direction[0] * r_set(s->origin[0]) + direction[2] * r_set(s->origin[2]);

    if (is_ball) {
        squared = squared + direction[1] * direction[1];
        along = along + direction[1] * r_set(s->origin[1]);
    }

    /* The point nearest to the middle or axis, then half a chord to either side of it. */
    const real middle = -along / squared;
    real nearest[3];
    real far_local[3];
    struct hit hit;

    for (int i = 0; i < 3; i++)
        nearest[i] = r_set(s->origin[i]) + middle * direction[i];

    real from_axis = nearest[0] * nearest[0] + nearest[2] * nearest[2];

    if (is_ball)
        from_axis = from_axis + nearest[1] * nearest[1];

    const mask meets = r_less(from_axis, r_set(1));
    const real half = r_sqrt(r_pick(meets, (r_set(1) - from_axis) / squared, r_set(0)));
    const mask front = find_local(s, direction, middle - half, hit.local);
    const mask back = find_local(s, direction, middle + half, far_local);

    hit.is_hit = m_and(meets, m_or(front, back));
    hit.depth = r_pick(front, middle - half, middle + half);
    for (int i = 0; i < 3; i++)
        hit.local[i] = r_pick(front, hit.local[i], far_local[i]);
    if (is_ball)
        find_ball_texel(s, &hit);
    else
        find_cylinder_texel(s, &hit);
    return hit;
}

/* The lamp's image on a glossy surface (Blinn 1977): a power of the cosine between the normal and
 * the half angle. */
static inline real highlight(const struct sim_trace_surface *s, struct rays ray,
                             const struct hit *hit)
{
    real to_lamp[3];
    real to_eye[3];
    real normal[3];
    real lamp2 = r_set(0);
    real eye2 = r_set(0);
    real normal2 = r_set(0);
    real half2 = r_set(0);
    real cosine = r_set(0);
    real facing = r_set(0);

    for (int i = 0; i < 3; i++) {
        to_eye[i] = -(linear(s->world[i], ray) * hit->depth);
        to_lamp[i] = r_set(s->lamp[i]) + to_eye[i];
        normal[i] =
            r_set(s->normal[0][i]) * hit->local[0] +
            (r_set(s->normal[1][i]) * hit->local[1] + r_set(s->normal[2][i]) * hit->local[2]);
        lamp2 = lamp2 + to_lamp[i] * to_lamp[i];
        eye2 = eye2 + to_eye[i] * to_eye[i];
        normal2 = normal2 + normal[i] * normal[i];
    }

    const real lamp_scale = r_set(1) / r_sqrt(lamp2);
    const real eye_scale = r_set(1) / r_sqrt(eye2);

    for (int i = 0; i < 3; i++) {
        const real half = to_lamp[i] * lamp_scale + to_eye[i] * eye_scale;

        half2 = half2 + half * half;
        cosine = cosine + half * normal[i];
        facing = facing + to_lamp[i] * normal[i];
    }

    real power = cosine * cosine / (half2 * normal2 + r_set(1e-20f));

    for (int32_t k = 1; k < s->sharpness; k++)
        power = power * power;
    power = limited(power, r_set(0), r_set(1));
    return r_pick(m_and(r_less(r_set(0), cosine), r_less(r_set(0), facing)),
                  power * r_set(s->gloss) / lamp2, r_set(0));
}

static inline struct hit hit_any(const struct sim_trace_surface *surface, struct rays ray)
{
    return surface->kind == SIM_SURFACE_QUAD || surface->kind == SIM_SURFACE_DISC
               ? hit_flat(surface, ray)
               : hit_curved(surface, ray);
}

static inline struct rays load_rays(const float *from)
{
    return (struct rays){ r_load(from), r_load(from + SIM_TRACE_LANES) };
}

static inline real light_of(const struct sim_trace_tile *tile, struct rays ray)
{
    real nearest = r_set(SIM_TRACE_FARTHEST_M);
    real light = r_set(tile->background);

    for (int32_t i = 0; i < tile->n_surfaces; i++) {
        const struct sim_trace_surface *surface = tile->surfaces[i];
        const struct hit hit = hit_any(surface, ray);
        const mask is_seen = m_and(hit.is_hit, r_less(hit.depth, nearest));

        if (!m_any(is_seen))
            continue;

        real here = texture(surface, hit.u, hit.v);

        if (surface->gloss > 0)
            here = here + highlight(surface, ray, &hit);
        light = r_pick(is_seen, here, light);
        nearest = r_pick(is_seen, hit.depth, nearest);
    }
    return light;
}

static inline real light_of_covered(const struct sim_trace_surface *s, struct rays ray)
{
    const real depth = r_set(1) / linear(s->inverse_depth, ray);

    return texture(s, linear(s->u, ray) * depth, linear(s->v, ray) * depth);
}

static void add_light(const struct sim_trace_tile *tile, float *sum)
{
    const ptrdiff_t row_floats = (ptrdiff_t)tile->n_subs * 2 * SIM_TRACE_LANES;
    const float *row = tile->rays;

    for (int32_t y = 0; y < tile->n_rows; y++, row += row_floats, sum += SIM_TRACE_LANES)
        for (int32_t x = 0; x < SIM_TRACE_LANES; x += LANES) {
            real total = r_load(sum + x);

            for (int32_t k = 0; k < tile->n_subs; k++)
                total = total + light_of(tile, load_rays(row + 2 * SIM_TRACE_LANES * k + x));
            r_store(sum + x, total);
        }
}

static void add_light_covered(const struct sim_trace_tile *tile, float *sum)
{
    const struct sim_trace_surface surface = *tile->surfaces[0];
    const ptrdiff_t row_floats = (ptrdiff_t)tile->n_subs * 2 * SIM_TRACE_LANES;
    const float *row = tile->rays;

    for (int32_t y = 0; y < tile->n_rows; y++, row += row_floats, sum += SIM_TRACE_LANES)
        for (int32_t x = 0; x < SIM_TRACE_LANES; x += LANES) {
            real total = r_load(sum + x);

            for (int32_t k = 0; k < tile->n_subs; k++)
                total = total +
                        light_of_covered(&surface, load_rays(row + 2 * SIM_TRACE_LANES * k + x));
            r_store(sum + x, total);
        }
}

static void light(const struct sim_trace_tile *tile, float *sum)
{
    if (tile->is_covered)
        add_light_covered(tile, sum);
    else
        add_light(tile, sum);
}

static void depth(const struct sim_trace_tile *tile, float *out_depth_m, int32_t *out_object)
{
    for (int32_t y = 0; y < tile->n_rows; y++)
        for (int32_t x = 0; x < SIM_TRACE_LANES; x += LANES) {
            const ptrdiff_t at = (ptrdiff_t)y * SIM_TRACE_LANES + x;
            const struct rays ray = load_rays(tile->rays + (ptrdiff_t)2 * SIM_TRACE_LANES * y + x);
            real nearest = r_set(SIM_TRACE_FARTHEST_M);
            whole object = w_set(SIM_TRACE_NOTHING);

            for (int32_t i = 0; i < tile->n_surfaces; i++) {
                const struct hit hit = hit_any(tile->surfaces[i], ray);
                const mask is_seen = m_and(hit.is_hit, r_less(hit.depth, nearest));

                nearest = r_pick(is_seen, hit.depth, nearest);
                object = w_pick(is_seen, w_set(tile->surfaces[i]->object), object);
            }
            r_store(out_depth_m + at,
                    r_pick(r_less(nearest, r_set(SIM_TRACE_FARTHEST_M)), nearest, r_set(0)));
            w_store(out_object + at, object);
        }
}
