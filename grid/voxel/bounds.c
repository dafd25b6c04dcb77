/* SPDX-License-Identifier: MIT */
#include "bounds.h"

#include <string.h>

#include "wide.h"

#define EPS             0x1p-24 /* half a unit in the last place of a float */
#define LEAST           0x1p-20 /* the least slope of a plane against the vertical that is divided by */
#define LEAST_WEDGE_BOW 0.02
#define LEAST_BOW       1e-3 /* the least |a| of a root that is divided by */
#define NOWHERE         1e6f /* beyond every column */
#define STEEP           1e9f
#define MOST_LEAN       2e-3 /* voxels that an upright face may lean over all of the beam */
#define MOST_ASKED      0.3  /* ... and the end of a beam on its side, beside which columns are asked */
#define STEEPEST        0.17 /* cosine of the widest half aperture that the plan is bounded by */
#define SHARP           0.02f /* voxels: with a larger error doubts are too many for one interval to be worth a try */
#define LEAST_SHARP     0.002f /* with a smaller one more columns lie at the rim, which costs more than a doubt */

INLINE float larger(float a, float b)
{
    return a > b ? a : b;
}

INLINE float smaller(float a, float b)
{
    return a < b ? a : b;
}

static inline double greater(double a, double b)
{
    return a > b ? a : b;
}

static inline double lesser(double a, double b)
{
    return a < b ? a : b;
}

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
    double c0 = g * c, cu = g * n[s->inner], cv = g * n[s->outer];
    double error = 8 * EPS * ((fabs(cu) + fabs(cv) + 1) * reach + fabs(c0)) + slop * fabs(g);
    struct bounds_plane plane = {(float)c0, (float)cu, (float)cv, (float)error, (float)error};
    s->error = larger(s->error, plane.in);
    if (steep > 0)
        s->lo[s->n_lo++] = plane;
    else
        s->hi[s->n_hi++] = plane;
}

/* A plane of which only the inner side is known: before it, the beam may go on. */
static void add_inner_plane(struct bounds *s, const struct cast_beam *b, const double n[3])
{
    add_plane(s, b, n, 0, 0);
    s->error = 2 * NOWHERE;
    if (n[2] > 0 || (n[2] == 0 && !signbit(n[2])))
        s->lo[s->n_lo - 1].out = 2 * NOWHERE;
    else
        s->hi[s->n_hi - 1].out = 2 * NOWHERE;
}

struct cone {
    const double *w;   /* [3]: its axis, a unit vector */
    double shift, tau; /* of its tip along the axis; aside */
    double q;          /* cosine or sine of its half angle */
};

/*
 * The face where W + f t, with W = w p + shift affine in the plan, meets a cone around `w`, with vertical part f:
 *   t = -(f/a) W +- (q/|a|) sqrt(W^2 + a (u^2 + v^2 - tau^2)), a = f^2 - q^2
 */
static void add_root(struct bounds *s, const struct cast_beam *b, const struct cone *cone, bool upper_root,
                     bool bounds_above, bool misses)
{
    const double *w = cone->w, shift = cone->shift, q = cone->q, tau = cone->tau;
    double f = w[2], a = f * f - q * q, reach = b->far + 2;
    double l = -f / a, k = (upper_root ? q : -q) / fabs(a);
    double wu = w[s->inner], wv = w[s->outer];
    double w_most = fabs(shift) + (fabs(wu) + fabs(wv)) * reach;
    double under = w_most * w_most + fabs(a) * (2 * reach * reach + tau * tau);
    struct bounds_root root = {
        .l0 = (float)(l * shift),
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
    s->error = 2 * NOWHERE;
    if (bounds_above)
        s->hi_root[s->n_hi_root++] = root;
    else
        s->lo_root[s->n_lo_root++] = root;
}

/* |azimuth| <= a up to pi/2, moved outward by the tolerance. */
static void add_sides(struct bounds *s, const struct cast_beam *b)
{
    const struct cast_opening *o = b->opening;
    double n[2][3];
    for (int i = 0; i < 3; i++) {
        n[0][i] = o->sin_az * b->axis[0][i] - o->cos_az * b->axis[1][i];
        n[1][i] = o->sin_az * b->axis[0][i] + o->cos_az * b->axis[1][i];
    }
    double lean = greater(fabs(n[0][2]), fabs(n[1][2])) * (b->far + 2) + 1e-9 * (b->far + 2);
    if (b->tolerance == 0 && lean < MOST_LEAN && o->cos_az >= STEEPEST) {
        for (int l = 0; l < 2; l++)
            s->line[l] = (struct bounds_line){n[l][s->inner], n[l][s->outer], lean, 2 * lean};
        s->n_lines = 2;
        return;
    }
    for (int l = 0; l < 2; l++)
        add_plane(s, b, n[l], b->tolerance, 0);
    if (b->tolerance > 0 && o->cos_az > 0) /* behind the apex only the tolerance's own cylinder is inside */
        add_inner_plane(s, b, b->axis[0]);
}

/*
 * The flat ends of a beam on its side, as lines in the plan: within the sides and the sphere no cell lies higher or
 * lower than `high`, so far do its ends lean there. False: they lean too far, or lines are taken.
 */
static bool add_upright_ends(struct bounds *s, const struct cast_beam *b, double grow, double slop)
{
    const struct cast_opening *o = b->opening;
    const double high =
        (b->far + 2) * (fabs(b->axis[0][2]) + o->sin_az * fabs(b->axis[1][2]) + fabs(b->axis[2][2]));
    double n[2][3];

    for (int l = 0; l < 2; l++)
        for (int i = 0; i < 3; i++)
            n[l][i] = o->sin_el * grow * b->axis[0][i] + (l ? -1 : 1) * o->cos_el * b->axis[2][i];
    const double lean = greater(fabs(n[0][2]), fabs(n[1][2])) * high + slop + 1e-9 * (b->far + 2);
    if (s->n_lines > 0 || b->tolerance > 0 || lean > MOST_ASKED || o->cos_el < STEEPEST || o->cos_az < STEEPEST)
        return false;
    for (int l = 0; l < 2; l++)
        s->line[l] = (struct bounds_line){n[l][s->inner], n[l][s->outer], lean, 2 * lean};
    s->n_lines = 2;
    return true;
}

static void add_flat_ends(struct bounds *s, const struct cast_beam *b, double lean, double shift, double slop)
{
    const struct cast_opening *o = b->opening;
    if (add_upright_ends(s, b, lean, slop))
        return;
    for (int side = -1; side <= 1; side += 2) {
        double n[3];
        for (int i = 0; i < 3; i++)
            n[i] = o->sin_el * lean * b->axis[0][i] + side * o->cos_el * b->axis[2][i];
        add_plane(s, b, n, b->tolerance + shift, slop);
    }
}

/*
 * A wedge's ends without tolerance: z^2 <= q^2 (u^2 + v^2 + t^2), q = sin b. With z = W + f t this is a quadratic in t,
 * both of whose roots bound. The root changes by at most 2 per step in the plan, and what rounding does under it is in
 * proportion to it, so that no error grows towards the apex: in W, 6 roundings of `reach`, and 11 in the root.
 */
static void add_bow(struct bounds *s, const struct cast_beam *b, double a)
{
    const double *w = b->axis[2];
    double l = -w[2] / a, k = b->opening->sin_el / a;
    s->bow = (struct bounds_bow){
        .wu = (float)w[s->inner],
        .wv = (float)w[s->outer],
        .a = (float)a,
        .l = (float)l,
        .k = (float)k,
        .error = (float)(EPS * (b->far + 2) * (10 * fabs(l) + 15 * k + 4)),
    };
    s->error = larger(s->error, s->bow.error);
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
    if (b->tolerance == 0 && bow > LEAST_WEDGE_BOW) {
        add_bow(s, b, bow);
    } else if (slop > 0.01 && bow > LEAST_WEDGE_BOW && o->cos_el > 0) {
        for (int side = -1; side <= 1; side += 2) {
            bool above = side * f > 0;
            const struct cone end = {b->axis[2], -side * o->cos_el * b->tolerance, b->tolerance, o->sin_el};
            add_root(s, b, &end, above, above, false);
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
    const struct cone cone = {b->axis[0], o->sin_az * b->tolerance, b->tolerance, o->cos_az};
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
        add_root(s, b, &cone, false, false, true);
        add_root(s, b, &cone, true, true, true);
    } else {
        add_root(s, b, &cone, f > 0, f < 0, false);
    }
}

/* Does the pyramid around the axis hold the vertical, up or down? Then it may cover any side of the plan. */
static bool holds_vertical(const struct cast_beam *b, double tan_az, double tan_el)
{
    double x = fabs(b->axis[0][2]) * 1.001 + 1e-6;
    return fabs(b->axis[1][2]) <= tan_az * x && fabs(b->axis[2][2]) <= tan_el * x;
}

/* The outermost of a pyramid's edges on each side of the plan, as lines through `from`; they are less than pi apart. */
static void set_lines(struct bounds *s, const struct cast_beam *b, double tan_az, double tan_el,
                      const double from[3])
{
    double edge[4][2];
    for (int e = 0; e < 4; e++)
        for (int i = 0; i < 2; i++)
            edge[e][i] = b->axis[0][i] + (e & 1 ? tan_az : -tan_az) * b->axis[1][i] +
                         (e & 2 ? tan_el : -tan_el) * b->axis[2][i];
    const double *side[2] = {edge[0], edge[0]};
    for (int e = 1; e < 4; e++) {
        side[0] = in_plan(side[0], edge[e]) < 0 ? edge[e] : side[0];
        side[1] = in_plan(side[1], edge[e]) > 0 ? edge[e] : side[1];
    }
    for (int l = 0; l < 2; l++) { /* way * (edge x (p - from)) >= 0, with a margin of a thousandth of a voxel */
        double way = l ? -1 : 1, m[2] = {-way * side[l][1], way * side[l][0]};
        double margin = 1e-3 * (fabs(m[0]) + fabs(m[1])) + 1e-6;
        s->line[l] = (struct bounds_line){m[s->inner], m[s->outer], margin - m[0] * from[0] - m[1] * from[1], 0};
    }
    s->n_lines = 2;
}

/*
 * The plan of the beam. At x along its axis it is no wider than tan x and a pad for what the tolerance adds, to each
 * side; x is from where the ball around the apex may be left (or the pad behind the apex) to `far`. The pyramid whose
 * apex is moved back until it has the pads, too, bounds the plan by its edges.
 */
static void set_plan(struct bounds *s, const struct cast_beam *b)
{
    const struct cast_opening *o = b->opening;
    bool cone = o->shape == CAST_CONE;
    double cos_el = cone ? o->cos_az : o->cos_el, sin_el = cone ? o->sin_az : o->sin_el, most = b->far + 1e-3;
    if (s->walk || o->cos_az < STEEPEST || cos_el < STEEPEST) {
        for (int a = 0; a < 3; a++) {
            s->low[a] = -most;
            s->high[a] = most;
        }
        return;
    }
    double shrink = o->shape == CAST_WEDGE ? o->cos_az : 1; /* a wedge's ends bow outward by 1/cos a */
    double tan_az = o->sin_az / o->cos_az, tan_el = sin_el / (cos_el * shrink);
    double pad_az = b->tolerance / o->cos_az + 1e-3, pad_el = 2 * b->tolerance / (cos_el * shrink) + 1e-3;
    double back = b->tolerance > 0 ? greater(pad_az / tan_az, pad_el / tan_el) : 0, from[3];
    double first = (b->near - pad_az - pad_el) / sqrt(1 + tan_az * tan_az + tan_el * tan_el) - 1e-3;
    const double x[2] = {greater(first, -pad_az), b->far + 1e-3};
    for (int a = 0; a < 3; a++) {
        double end[2], side[2];
        for (int e = 0; e < 2; e++) {
            double wide = greater(x[e], 0);
            end[e] = x[e] * b->axis[0][a];
            side[e] =
                (tan_az * wide + pad_az) * fabs(b->axis[1][a]) + (tan_el * wide + pad_el) * fabs(b->axis[2][a]);
        }
        from[a] = -back * b->axis[0][a];
        s->high[a] = lesser(greater(end[0] + side[0], end[1] + side[1]), most);
        s->low[a] = greater(lesser(end[0] - side[0], end[1] - side[1]), -most);
    }
    if (s->n_lines == 0 && !holds_vertical(b, tan_az, tan_el))
        set_lines(s, b, tan_az, tan_el, from);
}

void bounds_of(struct bounds *s, const struct cast_beam *b, const int32_t apex[3], int32_t last)
{
    const struct cast_opening *o = b->opening;
    double reach = b->far + 2;
    s->n_lo = s->n_hi = s->n_lo_root = s->n_hi_root = s->n_lines = 0;
    s->inner = fabs(b->axis[0][0]) > fabs(b->axis[0][1]) ? 0 : 1;
    s->outer = 1 - s->inner;
    memcpy(s->apex, apex, sizeof s->apex);
    s->last = last;
    s->offset[0] = (float)(b->apex.offset[s->inner] - 0.5);
    s->offset[1] = (float)(b->apex.offset[s->outer] - 0.5);
    s->offset[2] = (float)(b->apex.offset[2] - 0.5);
    s->bow = (struct bounds_bow){.open = 2 * NOWHERE};
    s->far2 = (float)(b->far * b->far);
    s->far2_error = (float)(8 * EPS * reach * reach);
    s->near2 = b->near > 0 ? (float)((b->near + 1e-2) * (b->near + 1e-2)) : -1;
    s->t_error = (float)(8 * EPS * reach);
    s->error = larger(s->t_error, LEAST_SHARP);
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
    if (s->walk) {
        s->n_lo = s->n_hi = s->n_lo_root = s->n_hi_root = s->n_lines = 0;
        s->error = 2 * NOWHERE;
    }
    s->quick = s->error < SHARP;
    float least_root = s->far2_error / s->error;
    s->error += s->t_error;
    s->far2_least = larger(least_root * least_root, s->far2_error);
    set_plan(s, b);
}

/*
 * way: 1 bounds from below, -1 from above; ends are kept times `way`, so that the larger always wins. Where there is no
 * root, no choice is made (it would keep the compiler from vectors): what is under the root pushes the end away,
 * steeply.
 */
static inline void bound_by_root(const struct bounds_root *r, float way, const float *u, const float *v, float *in,
                                 float *out)
{
    float k = way * r->k, away = r->misses ? STEEP : -STEEP;
    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        float w = r->w0 + r->wu * u[c] + r->wv * v[c];
        float d = w * w + r->a * (u[c] * u[c] + v[c] * v[c]) - r->t2;
        float d_most = d + r->error_root, d_least = d - r->error_root;
        float t = way * (r->l0 + r->lu * u[c] + r->lv * v[c]);
        float more = k * sqrtf(larger(d_most, 0)), less = k * sqrtf(larger(d_least, 0));
        in[c] = larger(in[c], t + larger(more, less) + r->error_t + STEEP * larger(-d_least, 0));
        out[c] = larger(out[c], t + smaller(more, less) - r->error_t + away * larger(-d_most, 0));
    }
}

/* Lower ends, and upper ends times -1: so the larger always wins. */
struct ends {
    float lo_in[BOUNDS_BLOCK], lo_out[BOUNDS_BLOCK], hi_in[BOUNDS_BLOCK], hi_out[BOUNDS_BLOCK];
};

static inline void bound_by_sphere(const struct bounds *s, const float *u, const float *v, struct ends *e)
{
    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        float d = s->far2 - u[c] * u[c] - v[c] * v[c];
        float d_most = d + s->far2_error, d_least = d - s->far2_error;
        float less = sqrtf(larger(d_least, 0)) - s->t_error, more = sqrtf(larger(d_most, 0)) + s->t_error;
        e->lo_in[c] = e->hi_in[c] = -less;
        e->lo_out[c] = STEEP * larger(-d_most, 0) - more;
        e->hi_out[c] = -more;
    }
}

static inline void bound_by_bow(const struct bounds_bow *b, const float *u, const float *v, struct ends *e)
{
    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        float w = b->wu * u[c] + b->wv * v[c], middle = b->l * w;
        float root = b->k * sqrtf(w * w + b->a * (u[c] * u[c] + v[c] * v[c])) + b->open;
        e->lo_in[c] = larger(e->lo_in[c], middle - root + b->error);
        e->lo_out[c] = larger(e->lo_out[c], middle - root - b->error);
        e->hi_in[c] = larger(e->hi_in[c], -middle - root + b->error);
        e->hi_out[c] = larger(e->hi_out[c], -middle - root - b->error);
    }
}

static inline void bound_by_plane(const struct bounds_plane *p, float way, const float *u, const float *v,
                                  float *in, float *out)
{
    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        float t = way * (p->c0 + p->cu * u[c] + p->cv * v[c]);
        in[c] = larger(in[c], t + p->in);
        out[c] = larger(out[c], t - p->out);
    }
}

/* The centres of eight columns. */
INLINE void place(const struct bounds *s, const int32_t *inner, const int32_t *outer, float *u, float *v)
{
    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        u[c] = (float)(inner[c] - s->apex[s->inner]) - s->offset[0];
        v[c] = (float)(outer[c] - s->apex[s->outer]) - s->offset[1];
    }
}

/* The first whole numbers from `end + add` on, kept within least..most. */
INLINE void round_up(const float *end, float add, float least, float most, int32_t *whole)
{
    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        float x = smaller(larger(end[c] + add, least), most);
        int32_t k = (int32_t)x;
        whole[c] = k + ((float)k < x);
    }
}

void bounds_block(const struct bounds *s, const int32_t *inner, const int32_t *outer, struct bounds_block *out)
{
    float u[BOUNDS_BLOCK], v[BOUNDS_BLOCK], t0 = s->offset[2];
    float first = (float)-s->apex[2], last = (float)(s->last - s->apex[2]);
    struct ends e;
    place(s, inner, outer, u, v);
    bound_by_sphere(s, u, v, &e);
    bound_by_bow(&s->bow, u, v, &e);
    for (int p = 0; p < s->n_lo; p++)
        bound_by_plane(&s->lo[p], 1, u, v, e.lo_in, e.lo_out);
    for (int p = 0; p < s->n_hi; p++)
        bound_by_plane(&s->hi[p], -1, u, v, e.hi_in, e.hi_out);
    for (int r = 0; r < s->n_lo_root; r++)
        bound_by_root(&s->lo_root[r], 1, u, v, e.lo_in, e.lo_out);
    for (int r = 0; r < s->n_hi_root; r++)
        bound_by_root(&s->hi_root[r], -1, u, v, e.hi_in, e.hi_out);
    round_up(e.lo_out, t0, first, last + 1, out->lo_out);
    round_up(e.lo_in, t0, first, last + 1, out->lo_in);
    round_up(e.hi_in, -t0, -last, 1 - first, out->hi_in);
    round_up(e.hi_out, -t0, -last, 1 - first, out->hi_out);
    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        out->lo_out[c] += s->apex[2];
        out->lo_in[c] += s->apex[2];
        out->hi_in[c] = s->apex[2] - out->hi_in[c];
        out->hi_out[c] = s->apex[2] - out->hi_out[c];
    }
}

/* The ends, upper ones times -1, all with the same error but at the sphere's rim; beyond that the upper lies below the
 * lower. */
INLINE void find_ends(const struct bounds *s, const float *u, const float *v, float *lo, float *hi, int32_t *doubt)
{
    for (int c = 0; c < BOUNDS_BLOCK; c++) {
        float level2 = u[c] * u[c] + v[c] * v[c], d = s->far2 - level2, half = copysignf(sqrtf(fabsf(d)), d);
        float w = s->bow.wu * u[c] + s->bow.wv * v[c], middle = s->bow.l * w;
        float root = s->bow.k * sqrtf(w * w + s->bow.a * level2) + s->bow.open;
        lo[c] = larger(middle - root, -half);
        hi[c] = larger(-(middle + root), -half);
        doubt[c] = ((fabsf(d) < s->far2_least) | (level2 < s->near2)) * BOUNDS_RIM;
    }
    for (int p = 0; p < s->n_lo; p++)
        for (int c = 0; c < BOUNDS_BLOCK; c++)
            lo[c] = larger(lo[c], s->lo[p].c0 + s->lo[p].cu * u[c] + s->lo[p].cv * v[c]);
    for (int p = 0; p < s->n_hi; p++)
        for (int c = 0; c < BOUNDS_BLOCK; c++)
            hi[c] = larger(hi[c], -(s->hi[p].c0 + s->hi[p].cu * u[c] + s->hi[p].cv * v[c]));
}

/* Does a whole number lie between round_up's and the other end of the error? */
INLINE void add_doubt(const float *end, float add, float most, const int32_t *whole, int32_t which, int32_t *doubt)
{
    for (int c = 0; c < BOUNDS_BLOCK; c++)
        doubt[c] |= ((float)whole[c] < smaller(end[c] + add, most)) * which;
}

INLINE bool bounds_quick_body(const struct bounds *restrict s, const struct bounds_columns *columns,
                              int32_t *restrict k, int32_t *restrict cells, int32_t *restrict doubt)
{
    const int32_t *restrict inner = columns->inner, *restrict outer = columns->outer;
    const int n = columns->n;
    const float t0 = s->offset[2], first = (float)-s->apex[2], last = (float)(s->last - s->apex[2]);
    int32_t any[BOUNDS_BLOCK] = {0}, all = 0;

    for (int at = 0; at < n; at += BOUNDS_BLOCK) {
        float u[BOUNDS_BLOCK], v[BOUNDS_BLOCK], lo[BOUNDS_BLOCK], hi[BOUNDS_BLOCK];
        int32_t from[BOUNDS_BLOCK], to[BOUNDS_BLOCK], open[BOUNDS_BLOCK];
        place(s, inner + at, outer + at, u, v);
        find_ends(s, u, v, lo, hi, open);
        round_up(lo, t0 - s->error, first, last + 1, from);
        round_up(hi, -t0 - s->error, -last, 1 - first, to);
        add_doubt(lo, t0 + s->error, last + 1, from, BOUNDS_FIRST, open);
        add_doubt(hi, -t0 + s->error, 1 - first, to, BOUNDS_LAST, open);
        for (int c = 0; c < BOUNDS_BLOCK; c++) /* one loop for each array: compilers make vectors of these only */
            k[at + c] = from[c] + s->apex[2];
        for (int c = 0; c < BOUNDS_BLOCK; c++)
            cells[at + c] = 1 - from[c] - to[c];
        for (int c = 0; c < BOUNDS_BLOCK; c++)
            doubt[at + c] = open[c];
        for (int c = 0; c < BOUNDS_BLOCK; c++)
            any[c] |= open[c];
    }
    for (int c = 0; c < BOUNDS_BLOCK; c++)
        all |= any[c];
    return !all;
}

WIDE(bool, bounds_quick,
     (const struct bounds *restrict s, const struct bounds_columns *columns, int32_t *restrict k,
      int32_t *restrict cells, int32_t *restrict doubt),
     (s, columns, k, cells, doubt))
