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
    m->free = fmin(m->free, fabs(slack));
    if (o->half_az_rad < RIGHT_ANGLE) {
        if (b->tolerance > 0)
            m->free = fmin(m->free, fabs(x));
        if (x < 0)
            slack = fmin(slack, b->tolerance - aside);
    }
    m->slack = fmin(m->slack, slack);
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
        m.slack = fmin(m.slack, range - b->near);
    if (o->shape == CAST_CONE) {
        meet_side(&m, b, x * o->sin_az - sqrt(y * y + z * z) * o->cos_az, x, range);
    } else {
        double level = sqrt(x * x + y * y);
        double along = o->shape == CAST_WEDGE ? level : x;
        meet_side(&m, b, x * o->sin_az - y * o->cos_az, x, level);
        m.slack = fmin(m.slack, along * o->sin_el - z * o->cos_el + b->tolerance);
    }
    m.free = fmin(m.free, fabs(m.slack));
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
    int32_t first[3], last[3]; /* the box's cells, from the apex's cell */
    int32_t origin[3];         /* the apex's cell, from the box's first */
    cast_take *take;
    void *context;
    size_t n_spans;
    struct cast_span spans[CAST_BATCH];
};

/* Columns that wait for their bounds. */
struct columns {
    int n;
    int32_t i[CAST_BATCH + BOUNDS_BLOCK], j[CAST_BATCH + BOUNDS_BLOCK]; /* from the apex's cell */
    float u[CAST_BATCH + BOUNDS_BLOCK], v[CAST_BATCH + BOUNDS_BLOCK];
};

static inline void put(struct run *r, int32_t i, int32_t j, int32_t lo, int32_t hi)
{
    r->spans[r->n_spans++] =
        (struct cast_span){i + r->origin[0], j + r->origin[1], lo + r->origin[2], hi - lo + 1};
    if (r->n_spans == CAST_BATCH) {
        r->take(r->context, r->spans, r->n_spans);
        r->n_spans = 0;
    }
}

static void ask(struct run *r, int32_t i, int32_t j, int32_t lo, int32_t hi)
{
    for (int32_t k = lo; k <= hi; k++)
        if (margin_at(r->beam, i, j, k).slack >= 0)
            put(r, i, j, k, k);
}

/* Goes along a column in strides that no face can lie within. */
static void walk(struct run *r, int32_t i, int32_t j, int32_t lo, int32_t hi)
{
    int32_t inside_from = hi + 1;
    for (int32_t k = lo; k <= hi;) {
        struct margin m = margin_at(r->beam, i, j, k);
        bool inside = m.slack >= 0;
        if (inside && inside_from > hi)
            inside_from = k;
        if (!inside && inside_from <= hi) {
            put(r, i, j, inside_from, k - 1);
            inside_from = hi + 1;
        }
        double stride = floor(m.free - 1e-6);
        k += stride >= hi - k ? hi - k + 1 : stride > 0 ? 1 + (int32_t)stride : 1;
    }
    if (inside_from <= hi)
        put(r, i, j, inside_from, hi);
}

static void settle(struct run *r, int32_t i, int32_t j, int32_t lo_out, int32_t lo_in, int32_t hi_in,
                   int32_t hi_out)
{
    if (lo_out > hi_out)
        return;
    if (r->bounds.walk) {
        walk(r, i, j, lo_out, hi_out);
    } else if (lo_in > hi_in) {
        ask(r, i, j, lo_out, hi_out);
    } else {
        ask(r, i, j, lo_out, lo_in - 1);
        put(r, i, j, lo_in, hi_in);
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
    double x = i + 0.5 - offset[0], y = j + 0.5 - offset[1], middle = offset[2] - 0.5;
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

static void settle_columns(struct run *r, struct columns *c)
{
    struct bounds_block b;

    for (int first = 0; first < c->n; first += BOUNDS_BLOCK) {
        bounds_block(&r->bounds, c->u + first, c->v + first, r->first[2], r->last[2], &b);
        int n = smaller(c->n - first, BOUNDS_BLOCK);
        for (int l = 0; l < n; l++) {
            int32_t i = c->i[first + l], j = c->j[first + l];
            if (b.lo_out[l] > b.hi_out[l])
                continue;
            if (r->beam->near > 0)
                settle_beyond_near(r, i, j, b.lo_out[l], b.lo_in[l], b.hi_in[l], b.hi_out[l]);
            else
                settle(r, i, j, b.lo_out[l], b.lo_in[l], b.hi_in[l], b.hi_out[l]);
        }
    }
    c->n = 0;
}

/* Columns first..last of a row; v its place. Past its end up to a block is filled, so that blocks are always whole. */
static void add_row(struct run *r, struct columns *c, int32_t row, int32_t first, int32_t last)
{
    int inner = r->bounds.inner;
    int32_t *along = inner == 0 ? c->i : c->j, *across = inner == 0 ? c->j : c->i;
    float u0 = (float)(0.5 - r->beam->apex.offset[inner]);
    float v = (float)(row + 0.5 - r->beam->apex.offset[r->bounds.outer]);

    for (; first <= last; first += BOUNDS_BLOCK) {
        for (int l = 0; l < BOUNDS_BLOCK; l++) {
            along[c->n + l] = first + l;
            across[c->n + l] = row;
            c->u[c->n + l] = (float)(first + l) + u0;
            c->v[c->n + l] = v;
        }
        c->n += smaller(last - first + 1, BOUNDS_BLOCK);
        if (c->n >= CAST_BATCH)
            settle_columns(r, c);
    }
}

/* The columns' bounds in the plan, row by row. */
static void run_rows(struct run *r)
{
    const struct bounds *s = &r->bounds;
    struct columns c;
    double u_shift = r->beam->apex.offset[s->inner] - 0.5, v_shift = r->beam->apex.offset[s->outer] - 0.5;
    double slope[2], start[2]; /* of the lines: u = start + slope v */
    bool from[2];

    for (int l = 0; l < s->n_lines; l++) {
        double m = fabs(s->line[l][0]) < 1e-9 ? 1e-9 : s->line[l][0];
        from[l] = m > 0;
        slope[l] = -s->line[l][1] / m;
        start[l] = -s->line[l][2] / m;
    }
    int32_t row = (int32_t)ceil(fmax(s->low[s->outer] + v_shift, r->first[s->outer]));
    int32_t last_row = (int32_t)floor(fmin(s->high[s->outer] + v_shift, r->last[s->outer]));
    double box_lo = fmax(s->low[s->inner] + u_shift, r->first[s->inner]);
    double box_hi = fmin(s->high[s->inner] + u_shift, r->last[s->inner]);
    for (c.n = 0; row <= last_row; row++) {
        double v = row - v_shift, lo = box_lo, hi = box_hi;
        for (int l = 0; l < s->n_lines; l++) {
            double u = start[l] + slope[l] * v + u_shift;
            if (from[l])
                lo = lo > u ? lo : u;
            else
                hi = hi < u ? hi : u;
        }
        if (lo <= hi) {
            int32_t a = (int32_t)lo, z = (int32_t)hi;
            add_row(r, &c, row, a + (a < lo), z - (z > hi));
        }
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
    r.n_spans = 0;

    bounds_of(&r.bounds, b);
    for (int a = 0; a < 3; a++) {
        int64_t origin = b->apex.cell[a] - box->first[a], reach = (int64_t)b->far + 2;
        if (origin < -reach || origin > box->size[a] + reach)
            return false;
        r.origin[a] = (int32_t)origin;
        r.first[a] = -r.origin[a];
        r.last[a] = box->size[a] - 1 - r.origin[a];
        double shift = b->apex.offset[a] - 0.5;
        within &= r.bounds.low[a] + shift >= r.first[a] && r.bounds.high[a] + shift <= r.last[a];
    }
    run_rows(&r);
    if (r.n_spans)
        take(context, r.spans, r.n_spans);
    return within;
}
