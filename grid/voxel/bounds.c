/* SPDX-License-Identifier: MIT */
#include "bounds.h"

#include <string.h>

#define EPS       0x1p-24 /* half a unit in the last place of a float */
#define LEAST     0x1p-20 /* the least slope of a plane against the vertical that is divided by */
#define LEAST_BOW 1e-3    /* the least |a| of a root that is divided by */
#define NOWHERE   1e6f    /* beyond every column */
#define STEEPEST  0.17    /* cosine of the widest half aperture that the plan is bounded by */

static double in_plan(const double a[3], const double b[3])
{
    return a[0] * b[1] - a[1] * b[0];
}

/* n p + c >= 0, known to within `slop`. */
static void add_plane(struct bounds *s, const struct cast_beam *b, const double n[3], double c, double slop)
{
    double reach = b->far + 2, steep = n[2];
    if (fabs(steep) < LEAST) {
        steep = copysign(LEAST, steep);
        slop += 2 * LEAST * reach;
    }
    double g = -1 / steep;
    double c0 = g * c + s->t0, cu = g * n[s->inner], cv = g * n[s->outer];
    double error = 8 * EPS * ((fabs(cu) + fabs(cv) + 1) * reach + fabs(c0)) + slop * fabs(g);
    struct bounds_plane plane = {(float)c0, (float)cu, (float)cv, (float)error, (float)error};
    if (steep > 0)
        s->lo[s->n_lo++] = plane;
    else
        s->hi[s->n_hi++] = plane;
}

/* A plane of which only the inner side is known: before it, the beam may go on. */
static void add_inner_plane(struct bounds *s, const struct cast_beam *b, const double n[3])
{
    add_plane(s, b, n, 0, 0);
    if (n[2] > 0 || (n[2] == 0 && !signbit(n[2])))
        s->lo[s->n_lo - 1].out = 2 * NOWHERE;
    else
        s->hi[s->n_hi - 1].out = 2 * NOWHERE;
}

/*
 * The face where W + f t, with W = w p + shift affine in the plan, meets a cone around `w` (a unit vector with vertical part f)
 * whose half angle has the cosine or sine q: t = -(f/a) W +- (q/|a|) sqrt(W^2 + a (u^2 + v^2 - tau^2)), a = f^2 - q^2.
 */
static void add_root(struct bounds *s, const struct cast_beam *b, const double w[3], double shift, double q,
                     double tau, bool upper_root, bool bounds_above, bool misses)
{
    double f = w[2], a = f * f - q * q, reach = b->far + 2;
    double l = -f / a, k = (upper_root ? q : -q) / fabs(a);
    double wu = w[s->inner], wv = w[s->outer];
    double w_most = fabs(shift) + (fabs(wu) + fabs(wv)) * reach;
    double under = w_most * w_most + fabs(a) * (2 * reach * reach + tau * tau);
    struct bounds_root root = {
        .l0 = (float)(l * shift + s->t0),
        .lu = (float)(l * wu),
        .lv = (float)(l * wv),
        .w0 = (float)shift,
        .wu = (float)wu,
        .wv = (float)wv,
        .a = (float)a,
        .t2 = (float)(a * tau * tau),
        .k = (float)k,
        .error_root = (float)(16 * EPS * under),
        .error_t = (float)(8 * EPS * (fabs(l) * w_most + 1 + fabs(k) * sqrt(under))),
        .misses = misses,
    };
    if (bounds_above)
        s->hi_root[s->n_hi_root++] = root;
    else
        s->lo_root[s->n_lo_root++] = root;
}

/* |azimuth| <= a up to pi/2, moved outward by the tolerance. */
static void add_sides(struct bounds *s, const struct cast_beam *b)
{
    const struct cast_opening *o = b->opening;
    for (int side = -1; side <= 1; side += 2) {
        double n[3];
        for (int i = 0; i < 3; i++)
            n[i] = o->sin_az * b->axis[0][i] + side * o->cos_az * b->axis[1][i];
        add_plane(s, b, n, b->tolerance, 0);
    }
    if (b->tolerance > 0 && o->cos_az > 0) /* behind the apex only the tolerance's own cylinder is inside */
        add_inner_plane(s, b, b->axis[0]);
}

static void add_flat_ends(struct bounds *s, const struct cast_beam *b, double lean, double shift, double slop)
{
    const struct cast_opening *o = b->opening;
    for (int side = -1; side <= 1; side += 2) {
        double n[3];
        for (int i = 0; i < 3; i++)
            n[i] = o->sin_el * lean * b->axis[0][i] + side * o->cos_el * b->axis[2][i];
        add_plane(s, b, n, b->tolerance + shift, slop);
    }
}

/*
 * A wedge's ends: |z| cos b <= sin b sqrt(x^2 + y^2) + tolerance. Within the sides, the root is between x and
 * x / cos a plus what the tolerance adds; the plane half way errs by half the difference.
 */
static void add_wedge_ends(struct bounds *s, const struct cast_beam *b)
{
    const struct cast_opening *o = b->opening;
    double least_x = o->cos_az > STEEPEST ? 1 / o->cos_az - 1 : INFINITY;
    double wider = least_x < INFINITY ? o->sin_el * b->tolerance / o->cos_az : 0;
    double slop = o->sin_el * least_x * b->far / 2 + wider;
    double f = b->axis[2][2], bow = f * f - o->sin_el * o->sin_el;

    if (slop > 0.05 && bow > 0.02 && o->cos_el > 0) {
        for (int side = -1; side <= 1; side += 2) {
            bool above = side * f > 0;
            add_root(s, b, b->axis[2], -side * o->cos_el * b->tolerance, o->sin_el, b->tolerance, above, above,
                     false);
        }
    } else if (slop < 4) {
        add_flat_ends(s, b, 1 + least_x / 2, wider, slop);
    } else {
        s->walk = true;
    }
}

/* At most a off the axis, a <= pi/2: one nappe, between both roots or beyond one. */
static void add_cone(struct bounds *s, const struct cast_beam *b)
{
    const struct cast_opening *o = b->opening;
    double f = b->axis[0][2], bow = f * f - o->cos_az * o->cos_az, n[3];
    double shift = o->sin_az * b->tolerance;

    if (fabs(bow) < LEAST_BOW || o->cos_az <= 0) {
        s->walk = true;
        return;
    }
    for (int i = 0; i < 3; i++)
        n[i] = o->sin_az * b->axis[0][i];
    add_plane(s, b, n, b->tolerance, 0);
    if (b->tolerance > 0)
        add_inner_plane(s, b, b->axis[0]);
    if (bow < 0) {
        add_root(s, b, b->axis[0], shift, o->cos_az, b->tolerance, false, false, true);
        add_root(s, b, b->axis[0], shift, o->cos_az, b->tolerance, true, true, true);
    } else {
        add_root(s, b, b->axis[0], shift, o->cos_az, b->tolerance, f > 0, f < 0, false);
    }
}

/* Does the pyramid around the axis hold the vertical, up or down? Then it may cover any side of the plan. */
static bool holds_vertical(const struct cast_beam *b, double tan_az, double tan_el)
{
    double x = fabs(b->axis[0][2]) * 1.001 + 1e-6;
    return fabs(b->axis[1][2]) <= tan_az * x && fabs(b->axis[2][2]) <= tan_el * x;
}

/* The two of a pyramid's edges between which all four lie in the plan, as lines through `from`. */
static void set_lines(struct bounds *s, const double edge[4][3], const double from[3])
{
    for (int way = -1; way <= 1; way += 2)
        for (int e = 0; e < 4; e++) {
            double least = 0;
            for (int other = 0; other < 4; other++)
                least = fmin(least, way * in_plan(edge[e], edge[other]));
            if (least < -1e-9)
                continue;
            /* way * (edge x (p - from)) >= 0, in u and v, with a margin of a thousandth of a voxel */
            double *line = s->line[s->n_lines++], m[2] = {-way * edge[e][1], way * edge[e][0]};
            line[0] = m[s->inner];
            line[1] = m[s->outer];
            line[2] = 1e-3 * (fabs(m[0]) + fabs(m[1])) - m[0] * from[0] - m[1] * from[1] + 1e-6;
            break;
        }
}

/*
 * The plan of the beam. All of it lies in a pyramid whose apex is moved back so far that the faces are moved outward by
 * the tolerance, in a slice of that pyramid, and in the sphere.
 */
static void set_plan(struct bounds *s, const struct cast_beam *b)
{
    const struct cast_opening *o = b->opening;
    bool cone = o->shape == CAST_CONE;
    double cos_el = cone ? o->cos_az : o->cos_el, sin_el = cone ? o->sin_az : o->sin_el;

    for (int a = 0; a < 3; a++) {
        s->high[a] = b->far + 1e-3;
        s->low[a] = -s->high[a];
    }
    if (s->walk || o->cos_az < STEEPEST || cos_el < STEEPEST)
        return;
    double shrink = o->shape == CAST_WEDGE ? o->cos_az : 1; /* a wedge's ends bow outward by 1/cos a */
    double tan_az = o->sin_az / o->cos_az, tan_el = sin_el / (cos_el * shrink);
    double pad = 3 * b->tolerance / (cos_el * shrink * o->cos_az) + 1e-3;
    double back = pad / fmin(tan_az, tan_el) * (b->tolerance > 0), from[3], edge[4][3];
    for (int i = 0; i < 3; i++)
        from[i] = -back * b->axis[0][i];
    for (int e = 0; e < 4; e++)
        for (int i = 0; i < 3; i++)
            edge[e][i] = b->axis[0][i] + (e & 1 ? tan_az : -tan_az) * b->axis[1][i] +
                         (e & 2 ? tan_el : -tan_el) * b->axis[2][i];
    for (int a = 0; a < 3; a++) {
        double low = -pad, high = pad;
        for (int e = 0; e < 4; e++) {
            double corner = from[a] + (back + b->far) * edge[e][a];
            low = fmin(low, corner - 1e-3);
            high = fmax(high, corner + 1e-3);
        }
        s->low[a] = fmax(s->low[a], low);
        s->high[a] = fmin(s->high[a], high);
    }
    if (!holds_vertical(b, tan_az, tan_el))
        set_lines(s, edge, from);
}

void bounds_of(struct bounds *s, const struct cast_beam *b)
{
    const struct cast_opening *o = b->opening;
    double reach = b->far + 2;

    s->n_lo = s->n_hi = s->n_lo_root = s->n_hi_root = s->n_lines = 0;
    s->inner = fabs(b->axis[0][0]) > fabs(b->axis[0][1]) ? 0 : 1;
    s->outer = 1 - s->inner;
    s->t0 = (float)(b->apex.offset[2] - 0.5);
    s->far2 = (float)(b->far * b->far);
    s->far2_error = (float)(12 * EPS * reach * reach);
    s->t_error = (float)(8 * EPS * reach);
    s->walk = o->half_az_rad > 1.5708;
    if (!s->walk && o->shape == CAST_CONE) {
        add_cone(s, b);
    } else if (!s->walk) {
        add_sides(s, b);
        if (o->shape == CAST_PYRAMID)
            add_flat_ends(s, b, 1, 0, 0);
        else
            add_wedge_ends(s, b);
    }
    if (s->walk)
        s->n_lo = s->n_hi = s->n_lo_root = s->n_hi_root = 0;
    set_plan(s, b);
}

static inline float larger(float a, float b)
{
    return a > b ? a : b;
}

static inline float smaller(float a, float b)
{
    return a < b ? a : b;
}

/* way: 1 bounds from below, -1 from above; ends are kept times `way`, so that the larger always wins. */
static inline void bound_by_root(const struct bounds_root *r, float way, const float *u, const float *v, float *in,
                                 float *out)
{
    float none = r->misses ? NOWHERE : -NOWHERE;
    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        float w = r->w0 + r->wu * u[c] + r->wv * v[c];
        float d = w * w + r->a * (u[c] * u[c] + v[c] * v[c]) - r->t2;
        float t = way * (r->l0 + r->lu * u[c] + r->lv * v[c]), k = way * r->k;
        float more = k * sqrtf(larger(d + r->error_root, 0)), less = k * sqrtf(larger(d - r->error_root, 0));
        float sure = d < r->error_root ? NOWHERE : t + larger(more, less) + r->error_t;
        float most = d + r->error_root < 0 ? none : t + smaller(more, less) - r->error_t;
        in[c] = larger(in[c], sure);
        out[c] = larger(out[c], most);
    }
}

void bounds_block(const struct bounds *s, const float *u, const float *v, int32_t first, int32_t last,
                  struct bounds_block *out)
{
    /* lower ends, and upper ends times -1 */
    float lo_in[BOUNDS_BLOCK], lo_out[BOUNDS_BLOCK], hi_in[BOUNDS_BLOCK], hi_out[BOUNDS_BLOCK];

    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        float d = s->far2 - u[c] * u[c] - v[c] * v[c];
        float less = sqrtf(larger(d - s->far2_error, 0)) - s->t_error;
        float more = sqrtf(larger(d + s->far2_error, 0)) + s->t_error;
        lo_in[c] = d < s->far2_error ? NOWHERE : s->t0 - less;
        lo_out[c] = d + s->far2_error < 0 ? NOWHERE : s->t0 - more;
        hi_in[c] = -s->t0 - less;
        hi_out[c] = -s->t0 - more;
    }
    for (int p = 0; p < s->n_lo; p++)
        for (int c = 0; c < BOUNDS_BLOCK; c++) {
            float t = s->lo[p].c0 + s->lo[p].cu * u[c] + s->lo[p].cv * v[c];
            lo_in[c] = larger(lo_in[c], t + s->lo[p].in);
            lo_out[c] = larger(lo_out[c], t - s->lo[p].out);
        }
    for (int p = 0; p < s->n_hi; p++)
        for (int c = 0; c < BOUNDS_BLOCK; c++) {
            float t = s->hi[p].c0 + s->hi[p].cu * u[c] + s->hi[p].cv * v[c];
            hi_in[c] = larger(hi_in[c], s->hi[p].in - t);
            hi_out[c] = larger(hi_out[c], -s->hi[p].out - t);
        }
    for (int r = 0; r < s->n_lo_root; r++)
        bound_by_root(&s->lo_root[r], 1, u, v, lo_in, lo_out);
    for (int r = 0; r < s->n_hi_root; r++)
        bound_by_root(&s->hi_root[r], -1, u, v, hi_in, hi_out);

    float before = (float)first - 1, beyond = (float)last + 1;
    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        float a = smaller(larger(lo_out[c], (float)first), beyond),
              b = smaller(larger(lo_in[c], (float)first), beyond);
        float y = larger(smaller(-hi_in[c], (float)last), before),
              z = larger(smaller(-hi_out[c], (float)last), before);
        int32_t ka = (int32_t)a, kb = (int32_t)b, ky = (int32_t)y, kz = (int32_t)z;
        out->lo_out[c] = ka + ((float)ka < a);
        out->lo_in[c] = kb + ((float)kb < b);
        out->hi_in[c] = ky - ((float)ky > y);
        out->hi_out[c] = kz - ((float)kz > z);
    }
}
