/* SPDX-License-Identifier: MIT */
#include "cast.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "../geometry.h"
#include "bounds.h"

#define RIGHT_ANGLE (GEO_PI / 2)

static inline int32_t smaller(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static inline int32_t larger(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

static inline double lesser(double a, double b)
{
    return a < b ? a : b;
}

static inline double greater(double a, double b)
{
    return a > b ? a : b;
}

bool cast_opening_init(struct cast_opening *o, enum cast_shape shape, double half_az_rad, double half_el_rad,
                       double tolerance_m, char *err, size_t err_size)
{
    static const char *const name[] = {"wedge", "pyramid", "cone"};
    double el_rad = shape == CAST_CONE ? 1 : half_el_rad;
    bool open_ended = shape != CAST_PYRAMID;
    double most_az = open_ended ? GEO_PI : RIGHT_ANGLE;

    if (!(half_az_rad > 0 && (open_ended ? half_az_rad <= most_az : half_az_rad < most_az)) ||
        !(el_rad > 0 && (open_ended ? el_rad <= RIGHT_ANGLE : el_rad < RIGHT_ANGLE))) {
        snprintf(err, err_size, "a %s's half apertures are %g and %g degrees: want more than 0, and %s %g and 90",
                 name[shape], geo_deg(half_az_rad), geo_deg(half_el_rad), open_ended ? "at most" : "less than",
                 geo_deg(most_az));
        return false;
    }
    if (!(tolerance_m >= 0 && tolerance_m < 1e3)) {
        snprintf(err, err_size, "a beam's tolerance is %g m: want 0 or more", tolerance_m);
        return false;
    }
    *o = (struct cast_opening){
        .shape = shape,
        .half_az_rad = half_az_rad,
        .half_el_rad = half_el_rad,
        .tolerance_m = tolerance_m,
        .sin_az = sin(half_az_rad),
        .cos_az = half_az_rad == RIGHT_ANGLE ? 0 : cos(half_az_rad),
        .sin_el = sin(el_rad),
        .cos_el = el_rad == RIGHT_ANGLE ? 0 : cos(el_rad),
    };
    return true;
}

bool cast_aim(struct cast_beam *b, const struct cast_opening *o, const struct lattice_place *apex,
              const double attitude[4], double az_rad, double el_rad, double near_m, double far_m, double voxel_m)
{
    double far = far_m / voxel_m, near = near_m > 0 ? near_m / voxel_m : 0;
    if (!(far > 0 && far <= CAST_MAX_VOXELS && near_m <= far_m))
        return false;
    double ca = cos(az_rad), sa = sin(az_rad), ce = cos(el_rad), se = sin(el_rad);
    const double sensor[3][3] = {{ca * ce, sa * ce, -se}, {-sa, ca, 0}, {ca * se, sa * se, ce}};
    double finite = 0;

    for (int a = 0; a < 3; a++) {
        quat_rotate(attitude, sensor[a], b->axis[a]);
        finite += b->axis[a][0] + b->axis[a][1] + b->axis[a][2];
    }
    b->opening = o;
    b->apex = *apex;
    b->near = near;
    b->far = far;
    b->tolerance = o->tolerance_m / voxel_m;
    return isfinite(finite);
}

/* How far inside, and how far one may go from there without crossing a face. */
struct margin {
    double slack, free;
};

/* The face |angle| <= a around the axis: d is its distance from its planes (or cone), aside that from the apex (or its
 * line). Opened less than half round, nothing behind the apex is inside but what the tolerance adds. */
static inline void meet_side(struct margin *m, const struct cast_beam *b, double d, double x, double aside)
{
    const struct cast_opening *o = b->opening;
    double slack = d + b->tolerance;
    if (o->half_az_rad >= GEO_PI)
        return;
    m->free = lesser(m->free, fabs(slack));
    if (o->half_az_rad < RIGHT_ANGLE) {
        if (b->tolerance > 0)
            m->free = lesser(m->free, fabs(x));
        if (x < 0)
            slack = lesser(slack, b->tolerance - aside);
    }
    m->slack = lesser(m->slack, slack);
}

/* At the centre of a cell that many cells from the apex's. */
static inline struct margin margin_at(const struct cast_beam *b, int64_t i, int64_t j, int64_t k)
{
    const struct cast_opening *o = b->opening;
    const double *offset = b->apex.offset;
    double p[3] = {(double)i + 0.5 - offset[0], (double)j + 0.5 - offset[1], (double)k + 0.5 - offset[2]}, q[3];

    for (int a = 0; a < 3; a++)
        q[a] = b->axis[a][0] * p[0] + b->axis[a][1] * p[1] + b->axis[a][2] * p[2];
    double x = q[0], y = fabs(q[1]), z = fabs(q[2]);
    double range = sqrt(x * x + y * y + z * z);
    struct margin m = {.slack = b->far - range, .free = INFINITY};
    if (b->near > 0)
        m.slack = lesser(m.slack, range - b->near);
    if (o->shape == CAST_CONE) {
        meet_side(&m, b, x * o->sin_az - sqrt(y * y + z * z) * o->cos_az, x, range);
    } else {
        double level = sqrt(x * x + y * y);
        double along = o->shape == CAST_WEDGE ? level : x;
        meet_side(&m, b, x * o->sin_az - y * o->cos_az, x, level);
        m.slack = lesser(m.slack, along * o->sin_el - z * o->cos_el + b->tolerance);
    }
    m.free = lesser(m.free, fabs(m.slack));
    return m;
}

double cast_slack(const struct cast_beam *b, const int64_t cell[3])
{
    return margin_at(b, cell[0] - b->apex.cell[0], cell[1] - b->apex.cell[1], cell[2] - b->apex.cell[2]).slack;
}

/* One run over the columns of a box. */
struct run {
    const struct cast_beam *beam;
    struct bounds bounds;
    int32_t apex[3]; /* its cell, from the box's first; as all cells below */
    int32_t last[3];
    cast_take *take;
    void *context;
    struct cast_spans single; /* runs that were found one by one */
    int n_single;
};

/* Columns that wait for their bounds. */
#define COLUMNS 64
struct columns {
    int n;
    int32_t i[COLUMNS + BOUNDS_BLOCK], j[COLUMNS + BOUNDS_BLOCK];
    float u[COLUMNS + BOUNDS_BLOCK], v[COLUMNS + BOUNDS_BLOCK]; /* of the centres, from the apex */
};

static void take_singles(struct run *r)
{
    for (int l = r->n_single; l < CAST_LANES; l++)
        r->single.i[l] = r->single.j[l] = r->single.k[l] = r->single.n[l] = 0;
    if (r->n_single)
        r->take(r->context, &r->single);
    r->n_single = 0;
}

static void put(struct run *r, int32_t i, int32_t j, int32_t k, int32_t n)
{
    int l = r->n_single++;
    r->single.i[l] = i;
    r->single.j[l] = j;
    r->single.k[l] = k;
    r->single.n[l] = n;
    if (r->n_single == CAST_LANES)
        take_singles(r);
}

static inline struct margin margin_of(const struct run *r, int32_t i, int32_t j, int32_t k)
{
    return margin_at(r->beam, i - r->apex[0], j - r->apex[1], k - r->apex[2]);
}

static void ask(struct run *r, int32_t i, int32_t j, int32_t lo, int32_t hi)
{
    for (int32_t k = lo; k <= hi; k++)
        if (margin_of(r, i, j, k).slack >= 0)
            put(r, i, j, k, 1);
}

/* Goes along a column in strides that no face can lie within. */
static void walk(struct run *r, int32_t i, int32_t j, int32_t lo, int32_t hi)
{
    int32_t inside_from = hi + 1;
    for (int32_t k = lo; k <= hi;) {
        struct margin m = margin_of(r, i, j, k);
        bool inside = m.slack >= 0;
        if (inside && inside_from > hi)
            inside_from = k;
        if (!inside && inside_from <= hi) {
            put(r, i, j, inside_from, k - inside_from);
            inside_from = hi + 1;
        }
        double stride = floor(m.free - 1e-6);
        k += stride >= hi - k ? hi - k + 1 : stride > 0 ? 1 + (int32_t)stride : 1;
    }
    if (inside_from <= hi)
        put(r, i, j, inside_from, hi - inside_from + 1);
}

/* A column with doubts: cells between the two intervals are asked. */
static void settle(struct run *r, int32_t i, int32_t j, int32_t lo_out, int32_t lo_in, int32_t hi_in,
                   int32_t hi_out)
{
    if (r->bounds.walk) {
        walk(r, i, j, lo_out, hi_out);
    } else if (lo_in > hi_in) {
        ask(r, i, j, lo_out, hi_out);
    } else {
        ask(r, i, j, lo_out, lo_in - 1);
        put(r, i, j, lo_in, hi_in - lo_in + 1);
        ask(r, i, j, hi_in + 1, hi_out);
    }
}

/*
 * The ball around the apex of which nothing is known is cut out of a column: what is left lies below it and above. In
 * double a thousandth of a voxel is far more than rounding can do to the ball's ends, even at its rim.
 */
static void settle_beyond_near(struct run *r, int32_t i, int32_t j, int32_t lo_out, int32_t lo_in, int32_t hi_in,
                               int32_t hi_out)
{
    const double *offset = r->beam->apex.offset, doubt = 1e-3;
    double x = i - r->apex[0] + 0.5 - offset[0], y = j - r->apex[1] + 0.5 - offset[1];
    double middle = r->apex[2] + offset[2] - 0.5;
    double d = r->beam->near * r->beam->near - x * x - y * y;

    if (d < -doubt || r->bounds.walk) {
        settle(r, i, j, lo_out, lo_in, hi_in, hi_out);
        return;
    }
    double half = sqrt(d > 0 ? d : 0);
    int32_t below_in = (int32_t)floor(middle - half - doubt), below_out = (int32_t)floor(middle - half + doubt);
    int32_t above_in = (int32_t)ceil(middle + half + doubt), above_out = (int32_t)ceil(middle + half - doubt);
    if (above_out <= below_out)
        above_out = below_out + 1;
    settle(r, i, j, lo_out, lo_in, smaller(hi_in, below_in), smaller(hi_out, below_out));
    settle(r, i, j, larger(lo_out, above_out), larger(lo_in, above_in), hi_in, hi_out);
}

/* A block with doubts, n columns of it: what is settled at once, and the rest one by one. */
static void settle_block(struct run *r, const struct bounds_block *b, struct cast_spans *spans, int n)
{
    bool plain = r->beam->near == 0 && !r->bounds.walk;
    for (int l = 0; l < n; l++) {
        if (plain && b->lo_out[l] == b->lo_in[l] && b->hi_in[l] == b->hi_out[l])
            continue;
        settle_beyond_near(r, spans->i[l], spans->j[l], b->lo_out[l], b->lo_in[l], b->hi_in[l], b->hi_out[l]);
        spans->n[l] = 0;
    }
}

static void settle_columns(struct run *r, struct columns *c)
{
    bool plain = r->beam->near == 0 && !r->bounds.walk;
    struct bounds_block b;
    struct cast_spans spans;

    for (int first = 0; first < c->n; first += BOUNDS_BLOCK) {
        bounds_block(&r->bounds, c->u + first, c->v + first, -r->apex[2], r->last[2] - r->apex[2], r->apex[2], &b);
        memcpy(spans.i, c->i + first, sizeof spans.i);
        memcpy(spans.j, c->j + first, sizeof spans.j);
        memcpy(spans.k, b.lo_in, sizeof spans.k);
        for (int l = 0; l < CAST_LANES; l++)
            spans.n[l] = l < c->n - first ? b.hi_in[l] - b.lo_in[l] + 1 : 0;
        if (b.doubt || !plain)
            settle_block(r, &b, &spans, smaller(c->n - first, BOUNDS_BLOCK));
        r->take(r->context, &spans);
    }
    c->n = 0;
}

/* Columns first..last of a row, the first at u, v. Past its end up to a block is filled, so that blocks are always whole. */
static inline void add_row(struct run *r, struct columns *c, int32_t row, int32_t first, int32_t last, float u,
                           float v)
{
    int32_t *along = r->bounds.inner == 0 ? c->i : c->j, *across = r->bounds.inner == 0 ? c->j : c->i;

    for (; first <= last; first += BOUNDS_BLOCK, u += BOUNDS_BLOCK) {
        int n = c->n;
        for (int l = 0; l < BOUNDS_BLOCK; l++)
            along[n + l] = first + l;
        for (int l = 0; l < BOUNDS_BLOCK; l++)
            across[n + l] = row;
        for (int l = 0; l < BOUNDS_BLOCK; l++)
            c->u[n + l] = u + (float)l;
        for (int l = 0; l < BOUNDS_BLOCK; l++)
            c->v[n + l] = v;
        c->n = n + smaller(last - first + 1, BOUNDS_BLOCK);
        if (c->n >= COLUMNS)
            settle_columns(r, c);
    }
}

/* The first and the last whole number between two numbers. */
static inline int32_t whole_from(double x)
{
    int32_t w = (int32_t)x;
    return w + (w < x);
}

static inline int32_t whole_to(double x)
{
    int32_t w = (int32_t)x;
    return w - (w > x);
}

/* The columns within the beam's bounds in the plan, row by row. */
static void run_rows(struct run *r)
{
    const struct bounds *s = &r->bounds;
    double u0 = r->apex[s->inner] + r->beam->apex.offset[s->inner] - 0.5; /* the apex, as a column's number */
    double v0 = r->apex[s->outer] + r->beam->apex.offset[s->outer] - 0.5;
    double lo = greater(s->low[s->inner] + u0, 0), hi = lesser(s->high[s->inner] + u0, r->last[s->inner]);
    int32_t row = whole_from(greater(s->low[s->outer] + v0, 0));
    int32_t last_row = whole_to(lesser(s->high[s->outer] + v0, r->last[s->outer]));
    /* u = start + slope v bounds from below and from above */
    double lo_start[2] = {lo, lo}, lo_slope[2] = {0}, hi_start[2] = {hi, hi}, hi_slope[2] = {0};
    struct columns c;

    for (int l = 0; l < s->n_lines; l++) {
        double m = fabs(s->line[l][0]) < 1e-9 ? 1e-9 : s->line[l][0];
        double slope = -s->line[l][1] / m, start = -s->line[l][2] / m + u0 - slope * v0;
        *(m > 0 ? &lo_start[l] : &hi_start[l]) = start;
        *(m > 0 ? &lo_slope[l] : &hi_slope[l]) = slope;
    }
    for (c.n = 0; row <= last_row; row++) {
        double from = greater(greater(lo_start[0] + lo_slope[0] * row, lo_start[1] + lo_slope[1] * row), lo);
        double to = lesser(lesser(hi_start[0] + hi_slope[0] * row, hi_start[1] + hi_slope[1] * row), hi);
        int32_t first = whole_from(from), last = whole_to(to);
        if (first <= last)
            add_row(r, &c, row, first, last, (float)(first - u0), (float)(row - v0));
    }
    settle_columns(r, &c);
}

bool cast_run(const struct cast_beam *b, const struct lattice_box *box, cast_take *take, void *context)
{
    struct run r;
    bool within = true;

    r.beam = b;
    r.take = take;
    r.context = context;
    r.n_single = 0;
    bounds_of(&r.bounds, b);
    for (int a = 0; a < 3; a++) {
        int64_t apex = b->apex.cell[a] - box->first[a], reach = (int64_t)b->far + 2;
        if (apex < -reach || apex > box->size[a] + reach)
            return false;
        r.apex[a] = (int32_t)apex;
        r.last[a] = box->size[a] - 1;
        double at = r.apex[a] + b->apex.offset[a] - 0.5;
        within &= r.bounds.low[a] + at >= 0 && r.bounds.high[a] + at <= r.last[a];
    }
    run_rows(&r);
    take_singles(&r);
    return within;
}
