/* SPDX-License-Identifier: MIT */
#include "cast.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"
#include "bounds.h"
#include "wide.h"

#define RIGHT_ANGLE (GEO_PI / 2)

static inline int32_t smaller(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static inline int32_t larger(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

INLINE double lesser(double a, double b)
{
    return a < b ? a : b;
}

INLINE double greater(double a, double b)
{
    return a > b ? a : b;
}

bool cast_opening_init(struct cast_opening *o, enum cast_shape shape, double half_az_rad, double half_el_rad,
                       double tolerance_m, struct fault *fault)
{
    static const char *const name[] = {"wedge", "pyramid", "cone"};
    double el_rad = shape == CAST_CONE ? 1 : half_el_rad;
    bool open_ended = shape != CAST_PYRAMID;
    double most_az = open_ended ? GEO_PI : RIGHT_ANGLE;
    if (!(half_az_rad > 0 && (open_ended ? half_az_rad <= most_az : half_az_rad < most_az)) ||
        !(el_rad > 0 && (open_ended ? el_rad <= RIGHT_ANGLE : el_rad < RIGHT_ANGLE)))
        return fault_set(fault,
                         "a %s's half apertures are %g and %g degrees: expected more than 0, and %s %g and 90",
                         name[shape], geo_deg(half_az_rad), geo_deg(half_el_rad),
                         open_ended ? "at most" : "less than", geo_deg(most_az));
    if (!(tolerance_m >= 0 && tolerance_m < 1e3))
        return fault_set(fault, "a beam's tolerance is %g m: expected 0 or more", tolerance_m);
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

bool cast_aim(struct cast_beam *b, const struct cast_opening *o, const struct cast_look *look)
{
    double far = look->far_m / look->voxel_m, near = look->near_m > 0 ? look->near_m / look->voxel_m : 0;
    if (!(far > 0 && far <= CAST_MAX_VOXELS && look->near_m <= look->far_m))
        return false;
    double ca = cos(look->az_rad), sa = sin(look->az_rad), ce = cos(look->el_rad), se = sin(look->el_rad);
    double sensor[3][3], finite = 0;

    quat_axes(look->attitude, sensor);
    for (int i = 0; i < 3; i++) {
        double level = ca * sensor[0][i] + sa * sensor[1][i];
        b->axis[0][i] = ce * level - se * sensor[2][i];
        b->axis[1][i] = ca * sensor[1][i] - sa * sensor[0][i];
        b->axis[2][i] = se * level + ce * sensor[2][i];
        finite += b->axis[0][i] + b->axis[1][i] + b->axis[2][i];
    }
    b->opening = o;
    b->apex = *look->apex;
    b->near = near;
    b->far = far;
    b->tolerance = o->tolerance_m / look->voxel_m;
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

/* Columns that wait for their bounds, with room for a row's last block and for what fills up the last block. */
#define ROOM    CAST_SPANS
#define COLUMNS (ROOM - 2 * BOUNDS_BLOCK)
struct columns {
    int n;
    int32_t inner[ROOM], outer[ROOM];
};

/* Runs that were found one by one. */
struct singles {
    int n;
    int32_t i[CAST_LANES], j[CAST_LANES], k[CAST_LANES], cells[CAST_LANES];
};

/* One run over the columns of a box. */
struct run {
    const struct cast_beam *beam;
    struct bounds bounds;
    int32_t last[3]; /* cells of the box, as all below */
    int32_t first_k, last_k;
    cast_take *take;
    void *context;
    struct columns columns;
    struct singles singles;
};

static void take_singles(struct run *r)
{
    struct singles *s = &r->singles;
    if (!s->n)
        return;
    for (int l = s->n; l < CAST_LANES; l++)
        s->i[l] = s->j[l] = s->k[l] = s->cells[l] = 0;
    r->take(r->context, &(struct cast_spans){s->n, s->i, s->j, s->k, s->cells, r->first_k, r->last_k});
    s->n = 0;
}

static void put_cells(struct run *r, int32_t i, int32_t j, int32_t k, int32_t n)
{
    struct singles *s = &r->singles;
    int l = s->n++;
    s->i[l] = i;
    s->j[l] = j;
    s->k[l] = k;
    s->cells[l] = n;
    if (s->n == CAST_LANES)
        take_singles(r);
}

static inline struct margin margin_of(const struct run *r, int32_t i, int32_t j, int32_t k)
{
    return margin_at(r->beam, i - r->bounds.apex[0], j - r->bounds.apex[1], k - r->bounds.apex[2]);
}

static void ask_cells(struct run *r, int32_t i, int32_t j, int32_t lo, int32_t hi)
{
    for (int32_t k = lo; k <= hi; k++)
        if (margin_of(r, i, j, k).slack >= 0)
            put_cells(r, i, j, k, 1);
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
            put_cells(r, i, j, inside_from, k - inside_from);
            inside_from = hi + 1;
        }
        double stride = floor(m.free - 1e-6);
        k += stride >= hi - k ? hi - k + 1 : stride > 0 ? 1 + (int32_t)stride : 1;
    }
    if (inside_from <= hi)
        put_cells(r, i, j, inside_from, hi - inside_from + 1);
}

/* Of one column what bounds_block says of eight. */
struct column {
    int32_t i, j;
    int32_t lo_out, lo_in, hi_in, hi_out;
};

/* A column with doubts: cells between the two intervals are asked. */
static void settle_column(struct run *r, struct column c)
{
    if (r->bounds.walk) {
        walk(r, c.i, c.j, c.lo_out, c.hi_out);
    } else if (c.lo_in > c.hi_in) {
        ask_cells(r, c.i, c.j, c.lo_out, c.hi_out);
    } else {
        ask_cells(r, c.i, c.j, c.lo_out, c.lo_in - 1);
        put_cells(r, c.i, c.j, c.lo_in, c.hi_in - c.lo_in + 1);
        ask_cells(r, c.i, c.j, c.hi_in + 1, c.hi_out);
    }
}

/*
 * The ball around the apex of which nothing is known is cut out of a column: what is left lies below it and above. In
 * double a thousandth of a voxel is far more than rounding can do to the ball's ends, even at its rim.
 */
static void settle_beyond_near(struct run *r, struct column c)
{
    const double *offset = r->beam->apex.offset, doubt = 1e-3;
    double x = c.i - r->bounds.apex[0] + 0.5 - offset[0], y = c.j - r->bounds.apex[1] + 0.5 - offset[1];
    double middle = r->bounds.apex[2] + offset[2] - 0.5;
    double d = r->beam->near * r->beam->near - x * x - y * y;
    if (d < -doubt || r->bounds.walk) {
        settle_column(r, c);
        return;
    }
    double half = sqrt(d > 0 ? d : 0);
    int32_t below_in = (int32_t)floor(middle - half - doubt), below_out = (int32_t)floor(middle - half + doubt);
    int32_t above_in = (int32_t)ceil(middle + half + doubt), above_out = (int32_t)ceil(middle + half - doubt);
    if (above_out <= below_out)
        above_out = below_out + 1;
    struct column below = c, above = c;
    below.hi_in = smaller(c.hi_in, below_in);
    below.hi_out = smaller(c.hi_out, below_out);
    above.lo_out = larger(c.lo_out, above_out);
    above.lo_in = larger(c.lo_in, above_in);
    settle_column(r, below);
    settle_column(r, above);
}

/* Of a block's first n columns those in doubt, one by one; k and cells of the others. */
static void settle_block(struct run *r, int first, int n, int32_t *k, int32_t *cells)
{
    const int32_t *inner = r->columns.inner + first, *outer = r->columns.outer + first;
    const int32_t *i = r->bounds.inner == 0 ? inner : outer, *j = r->bounds.inner == 0 ? outer : inner;
    bool plain = r->beam->near == 0 && !r->bounds.walk;
    struct bounds_block b;
    bounds_block(&r->bounds, inner, outer, &b);
    for (int l = 0; l < n; l++) {
        bool sure = plain && b.lo_out[l] == b.lo_in[l] && b.hi_in[l] == b.hi_out[l];
        k[l] = b.lo_in[l];
        cells[l] = sure ? b.hi_in[l] - b.lo_in[l] + 1 : 0;
        if (!sure)
            settle_beyond_near(r, (struct column){i[l], j[l], b.lo_out[l], b.lo_in[l], b.hi_in[l], b.hi_out[l]});
    }
}

/* What rounding left open of a column, exactly. */
static void ask_ends(const struct run *r, int32_t inner, int32_t outer, int32_t doubt, int32_t *k, int32_t *cells)
{
    int32_t i = r->bounds.inner == 0 ? inner : outer, j = r->bounds.inner == 0 ? outer : inner;
    if (*cells > 0 && (doubt & BOUNDS_LAST) && margin_of(r, i, j, *k + *cells - 1).slack < 0)
        --*cells;
    if (*cells > 0 && (doubt & BOUNDS_FIRST) && margin_of(r, i, j, *k).slack < 0) {
        ++*k;
        --*cells;
    }
}

/* The columns of n from c on that are in doubt. */
static void settle_doubts(struct run *r, int c, int n, const int32_t *doubt, int32_t *k, int32_t *cells)
{
    const int32_t *inner = r->columns.inner + c, *outer = r->columns.outer + c;
    for (int l = 0; l < n; l++)
        if (doubt[l] & BOUNDS_RIM)
            settle_block(r, c + l, 1, k + l, cells + l);
        else if (doubt[l])
            ask_ends(r, inner[l], outer[l], doubt[l], k + l, cells + l);
}

static inline bool any_doubt(const int32_t *doubt)
{
    int32_t any = 0;
    for (int l = 0; l < BOUNDS_BLOCK; l++)
        any |= doubt[l];
    return any;
}

static void settle_columns(struct run *r)
{
    int32_t *inner = r->columns.inner, *outer = r->columns.outer, k[ROOM], cells[ROOM], doubt[ROOM];
    int n = r->columns.n;
    for (int l = 0; l < BOUNDS_BLOCK; l++) {
        inner[n + l] = inner[n - 1];
        outer[n + l] = outer[n - 1];
    }
    if (!r->bounds.quick) {
        for (int c = 0; c < n; c += BOUNDS_BLOCK)
            settle_block(r, c, smaller(n - c, BOUNDS_BLOCK), k + c, cells + c);
    } else if (!bounds_quick(&r->bounds, &(struct bounds_columns){inner, outer, n}, k, cells, doubt)) {
        for (int c = 0; c < n; c += BOUNDS_BLOCK)
            if (any_doubt(doubt + c))
                settle_doubts(r, c, smaller(n - c, BOUNDS_BLOCK), doubt + c, k + c, cells + c);
    }
    for (int l = 0; l < CAST_LANES; l++)
        cells[n + l] = 0;
    bool swap = r->bounds.inner != 0;
    r->take(r->context,
            &(struct cast_spans){n, swap ? outer : inner, swap ? inner : outer, k, cells, r->first_k, r->last_k});
    r->columns.n = 0;
}

/* Columns first..last of a row. Past its end up to a block is filled, so that blocks are always whole. */
static inline void add_row(struct run *r, int32_t row, int32_t first, int32_t last)
{
    struct columns *c = &r->columns;
    for (; first <= last; first += BOUNDS_BLOCK) {
        int n = c->n;
        for (int l = 0; l < BOUNDS_BLOCK; l++)
            c->inner[n + l] = first + l;
        for (int l = 0; l < BOUNDS_BLOCK; l++)
            c->outer[n + l] = row;
        c->n = n + smaller(last - first + 1, BOUNDS_BLOCK);
        if (c->n >= COLUMNS)
            settle_columns(r);
    }
}

/* Columns that not all bounds are known of. */
static void ask_columns(struct run *r, int32_t row, int32_t first, int32_t last)
{
    for (; first <= last; first++) {
        int32_t inner[BOUNDS_BLOCK], outer[BOUNDS_BLOCK];
        struct bounds_block b;
        for (int l = 0; l < BOUNDS_BLOCK; l++) {
            inner[l] = first;
            outer[l] = row;
        }
        bounds_block(&r->bounds, inner, outer, &b);
        walk(r, r->bounds.inner == 0 ? first : row, r->bounds.inner == 0 ? row : first, b.lo_out[0], b.hi_out[0]);
    }
}

/* Rows in the plan, side by side: columns surely not beyond first_out..last_out, and no fringe within
 * first_in..last_in. */
#define ROWS 8
struct rows {
    int32_t first_out[ROWS], first_in[ROWS], last_in[ROWS], last_out[ROWS];
};

/* u = start + slope v bounds a row from below or from above; up to `fringe` from there it is a fringe. */
struct edge {
    double start, slope, fringe;
};

struct edges {
    struct edge lo[2], hi[2];
    double least, most; /* the box */
};

/* False: no column. Numbers are kept >= 0 where they are cut to whole ones. Nothing begins or ends where a whole number
 * is met exactly. */
INLINE bool bound_rows_body(const struct edges *e, int32_t row, struct rows *out)
{
    double a[ROWS], b[ROWS], y[ROWS], z[ROWS];
    int32_t any = 0;
    for (int l = 0; l < ROWS; l++) {
        double v = row + l;
        double lo0 = e->lo[0].start + e->lo[0].slope * v, lo1 = e->lo[1].start + e->lo[1].slope * v;
        double hi0 = e->hi[0].start + e->hi[0].slope * v, hi1 = e->hi[1].start + e->hi[1].slope * v;
        a[l] = lesser(greater(greater(lo0, lo1), e->least), e->most + 1);
        b[l] = lesser(greater(greater(lo0 + e->lo[0].fringe, lo1 + e->lo[1].fringe), e->least), e->most + 1);
        y[l] = greater(lesser(lesser(hi0 - e->hi[0].fringe, hi1 - e->hi[1].fringe), e->most), -1);
        z[l] = greater(lesser(lesser(hi0, hi1), e->most), -1);
    }
    for (int l = 0; l < ROWS; l++) {
        out->first_out[l] = (int32_t)(a[l] + 1);
        out->first_in[l] = (int32_t)(b[l] + 1);
        out->last_in[l] = (int32_t)(y[l] + 1) - 1;
        out->last_out[l] = (int32_t)(z[l] + 1) - 1;
        any |= out->first_out[l] <= out->last_out[l];
    }
    return any;
}

WIDE(static bool, bound_rows, (const struct edges *e, int32_t row, struct rows *out), (e, row, out))

/* The apex's column is at u0, v0. */
static void set_edges(struct edges *e, const struct bounds *s, double u0, double v0, int32_t last)
{
    e->least = greater(s->low[s->inner] + u0, 0) - 1e-6;
    e->most = greater(lesser(s->high[s->inner] + u0, last), -1) + 1e-6;
    for (int l = 0; l < 2; l++) {
        e->lo[l] = (struct edge){e->least, 0, 0};
        e->hi[l] = (struct edge){e->most, 0, 0};
    }
    for (int l = 0; l < s->n_lines; l++) {
        const struct bounds_line *line = &s->line[l];
        double steep = 1 / (fabs(line->m) < 1e-9 ? 1e-9 : line->m), slope = -line->n * steep;
        *(steep > 0 ? &e->lo[l] : &e->hi[l]) =
            (struct edge){u0 - line->c * steep - slope * v0, slope, line->fringe * fabs(steep)};
    }
}

/* The columns within the beam's bounds in the plan, row by row. */
static void run_rows(struct run *r)
{
    const struct bounds *s = &r->bounds;
    double u0 = s->apex[s->inner] + r->beam->apex.offset[s->inner] - 0.5;
    double v0 = s->apex[s->outer] + r->beam->apex.offset[s->outer] - 0.5;
    int32_t row = (int32_t)(greater(s->low[s->outer] + v0, 0));
    int32_t last = (int32_t)(greater(lesser(s->high[s->outer] + v0, r->last[s->outer]), -1) + 1) - 1;
    struct edges edges;
    set_edges(&edges, s, u0, v0, r->last[s->inner]);
    for (; row <= last; row += ROWS) {
        struct rows rows;
        if (!bound_rows(&edges, row, &rows))
            continue;
        for (int l = 0; l < ROWS && row + l <= last; l++) {
            int32_t first_out = rows.first_out[l], last_out = rows.last_out[l];
            int32_t first_in = rows.first_in[l], last_in = rows.last_in[l];
            if (first_out > last_out)
                continue;
            if (first_in > first_out || last_in < last_out) {
                ask_columns(r, row + l, first_out, smaller(first_in - 1, last_out));
                ask_columns(r, row + l, larger(last_in + 1, larger(first_in, first_out)), last_out);
            }
            add_row(r, row + l, first_in, last_in);
        }
    }
    if (r->columns.n)
        settle_columns(r);
}

bool cast_run(const struct cast_beam *b, const struct lattice_box *box, cast_take *take, void *context)
{
    struct run r;
    int32_t cell[3];
    bool within = true;
    for (int a = 0; a < 3; a++) {
        int64_t apex = b->apex.cell[a] - box->first[a], reach = (int64_t)b->far + 2;
        if (apex < -reach || apex > box->size[a] + reach)
            return false;
        cell[a] = (int32_t)apex;
        r.last[a] = box->size[a] - 1;
    }
    r.beam = b;
    r.take = take;
    r.context = context;
    r.columns.n = r.singles.n = 0;
    bounds_of(&r.bounds, b, cell, r.last[2]);
    for (int a = 0; a < 3; a++) {
        double at = cell[a] + b->apex.offset[a] - 0.5;
        within &= r.bounds.low[a] + at >= 0 && r.bounds.high[a] + at <= r.last[a];
        if (a < 2)
            continue;
        r.first_k = (int32_t)greater(lesser(r.bounds.low[a] + at, r.last[a]), 0);
        r.last_k = (int32_t)greater(lesser(r.bounds.high[a] + at + 1, r.last[a]), 0);
    }
    run_rows(&r);
    take_singles(&r);
    return within;
}
