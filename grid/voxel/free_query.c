/* SPDX-License-Identifier: MIT */
#include "free_query.h"

#include <string.h>

#define HALF_DIAGONAL 0.8660254037844387 /* of a voxel */
#define FARTHEST      1e9                /* voxels that one question may span, per axis */

/* Reading the map along neighbouring cells for one step: the block last looked at, at hand. */
struct reader {
    struct voxmask *mask;
    const struct merge_block *bits;
    struct block_key key;
    int64_t left; /* voxels that may still be looked at */
};

static inline enum voxel_state read_at(struct reader *r, const int64_t cell[3])
{
    struct block_key key = merge_block_of(cell);
    if (!r->bits || !block_same(&key, &r->key)) {
        const uint64_t computed = r->mask->computed;
        r->key = key;
        r->bits = &voxmask_block(r->mask, &key)->bits;
        r->left -= (int64_t)(r->mask->computed - computed) * FREE_QUERY_BLOCK;
    }
    return merge_block_at(r->bits, cell);
}

static void centre_of(const int64_t cell[3], double voxel_m, double at_m[3])
{
    for (int a = 0; a < 3; a++)
        at_m[a] = ((double)cell[a] + 0.5) * voxel_m;
}

/* Counts a cell. True when it is not free. */
static inline bool count_cell(struct free_query *q, struct reader *r, const int64_t cell[3])
{
    struct free_answer *out = &q->answer;
    enum voxel_state state = read_at(r, cell);
    out->voxels++;
    if (state == VOXEL_FREE)
        return false;
    out->unknown += state == VOXEL_UNKNOWN;
    out->occupied += state == VOXEL_OCCUPIED;
    out->lost |= r->bits->lost;
    out->state = state > out->state ? state : out->state;
    return true;
}

/* The cell becomes the answer's first that is not free. */
static void note_first(struct free_query *q, const int64_t cell[3], enum voxel_state state)
{
    q->found = true;
    q->answer.first_state = state;
    centre_of(cell, q->voxel_m, q->answer.first_m);
}

/* ---- boxes ---- */

bool free_query_begin_box(struct free_query *q, double voxel_m, const double low_m[3], const double high_m[3])
{
    struct lattice_place low, high;
    double voxels = 1;
    *q = (struct free_query){.voxel_m = voxel_m};
    if (!lattice_place(low_m, voxel_m, &low) || !lattice_place(high_m, voxel_m, &high))
        return false;
    for (int a = 0; a < 3; a++) {
        q->low[a] = q->cell[a] = low.cell[a];
        q->high[a] = high.cell[a];
        voxels *= (double)(high.cell[a] - low.cell[a] + 1);
    }
    return low_m[0] <= high_m[0] && low_m[1] <= high_m[1] && low_m[2] <= high_m[2] &&
           voxels <= FREE_QUERY_MOST_VOXELS;
}

static bool step_box(struct free_query *q, struct reader *r)
{
    int64_t *cell = q->cell;
    for (; cell[0] <= q->high[0]; cell[0]++, cell[1] = q->low[1])
        for (; cell[1] <= q->high[1]; cell[1]++, cell[2] = q->low[2])
            for (; cell[2] <= q->high[2]; cell[2]++) {
                if (r->left-- <= 0)
                    return false;
                if (count_cell(q, r, cell) && !q->found)
                    note_first(q, cell, read_at(r, cell));
            }
    return true;
}

/* ---- corridors ---- */

/* One leg, in voxels from a whole-numbered origin near its start. */
struct leg {
    int64_t origin[3];
    double a[3], d[3], length; /* start, vector to the end */
    double radius;
    double before_m; /* length of the path before this leg */
};

/* Squared distance of a + t d from the unit cube whose lower corner is c. */
static double cube_distance2(const struct leg *l, const double c[3], double t)
{
    double sum = 0;
    for (int x = 0; x < 3; x++) {
        double at = l->a[x] + t * l->d[x] - c[x];
        double off = at < 0 ? -at : at > 1 ? at - 1 : 0;
        sum += off * off;
    }
    return sum;
}

/*
 * Does the cube touch the swept ball? The squared distance along the leg is convex and, between the places where the
 * line passes a face's plane, quadratic: its least value lies at one of them or where a piece's slope is zero. *t: a
 * place where it does.
 */
static bool touches(const struct leg *l, const double c[3], double *t)
{
    double cut[8] = {0, 1}, limit = l->radius * l->radius;
    int n = 2;
    for (int x = 0; x < 3; x++)
        for (int side = 0; side < 2 && l->d[x] != 0; side++) {
            double at = (c[x] + side - l->a[x]) / l->d[x];
            if (at > 0 && at < 1)
                cut[n++] = at;
        }
    for (int i = 1; i < n; i++)
        for (int j = i; j > 0 && cut[j] < cut[j - 1]; j--) {
            double swap = cut[j];
            cut[j] = cut[j - 1];
            cut[j - 1] = swap;
        }
    for (int i = 0; i < n; i++)
        if (cube_distance2(l, c, *t = cut[i]) <= limit)
            return true;
    for (int i = 0; i + 1 < n; i++) {
        double middle = (cut[i] + cut[i + 1]) / 2, slope = 0, bend = 0;
        for (int x = 0; x < 3; x++) {
            double at = l->a[x] + middle * l->d[x] - c[x];
            double off = at < 0 ? at : at > 1 ? at - 1 : 0;
            slope += off * l->d[x];
            bend += off != 0 ? l->d[x] * l->d[x] : 0;
        }
        *t = bend > 0 ? middle - slope / bend : middle;
        if (*t > cut[i] && *t < cut[i + 1] && cube_distance2(l, c, *t) <= limit)
            return true;
    }
    return false;
}

/* Distance of the cube's middle from the leg, and where along it that is (0 to 1). */
static double middle_distance(const struct leg *l, const double c[3], double *t)
{
    double along = 0, sum = 0, v[3];
    for (int x = 0; x < 3; x++) {
        v[x] = c[x] + 0.5 - l->a[x];
        along += v[x] * l->d[x];
    }
    *t = l->length > 0 ? along / (l->length * l->length) : 0;
    *t = *t < 0 ? 0 : *t > 1 ? 1 : *t;
    for (int x = 0; x < 3; x++)
        sum += (v[x] - *t * l->d[x]) * (v[x] - *t * l->d[x]);
    return sqrt(sum);
}

/* How far along the leg (0 to 1) the ball gets before it touches the cube, which it does at `touching`: until then the
 * distance, convex, falls. */
static double first_touch(const struct leg *l, const double c[3], double touching)
{
    double limit = l->radius * l->radius, clear = 0;
    if (cube_distance2(l, c, 0) <= limit)
        return 0;
    for (int n = 0; n < 40; n++) {
        double middle = (clear + touching) / 2;
        *(cube_distance2(l, c, middle) <= limit ? &touching : &clear) = middle;
    }
    return clear;
}

/* The same for the ball around the cube, which is touched no later: quickly had. */
static double first_touch_around(const struct leg *l, double distance, double nearest)
{
    double reach = l->radius + HALF_DIAGONAL, back = sqrt(fmax(reach * reach - distance * distance, 0));
    return l->length > 0 ? fmax(nearest - back / l->length, 0) : 0;
}

static void visit_cell(struct free_query *q, struct reader *r, const struct leg *l, const double c[3])
{
    double nearest, distance = middle_distance(l, c, &nearest), touching = nearest;
    int64_t cell[3];
    if (distance > l->radius + HALF_DIAGONAL || (distance > l->radius && !touches(l, c, &touching)))
        return;
    for (int x = 0; x < 3; x++)
        cell[x] = l->origin[x] + (int64_t)c[x];
    if (!count_cell(q, r, cell))
        return;
    double leg_m = l->length * q->voxel_m;
    if (q->found && l->before_m + first_touch_around(l, distance, nearest) * leg_m >= q->answer.clear_m)
        return;
    double clear_m = l->before_m + first_touch(l, c, touching) * leg_m;
    if (!q->found || clear_m < q->answer.clear_m) {
        q->answer.clear_m = clear_m;
        note_first(q, cell, read_at(r, cell));
    }
}

/* The part from..to of the leg (0 to 1) that passes within reach of lo..hi on one axis; false: none. */
static bool clip(const struct leg *l, int axis, double lo, double hi, double *from, double *to)
{
    double a = l->a[axis], d = l->d[axis];
    if (d == 0)
        return a >= lo && a <= hi;
    double enter = ((d > 0 ? lo : hi) - a) / d, leave = ((d > 0 ? hi : lo) - a) / d;
    *from = fmax(*from, enter - 1e-9);
    *to = fmin(*to, leave + 1e-9);
    return *from <= *to;
}

/* The first and last cell within reach of that part of the leg, along one axis. */
static void cells_near(const struct leg *l, int axis, double from, double to, double *first, double *last)
{
    double p = l->a[axis] + from * l->d[axis], q = l->a[axis] + to * l->d[axis];
    *first = floor(fmin(p, q) - l->radius - 1e-6);
    *last = floor(fmax(p, q) + l->radius + 1e-6);
}

/* The cells of a row within reach of the part from..to of the leg. False: not all of them yet. */
static bool step_row(struct free_query *q, struct reader *r, const struct leg *l, const double part[2],
                     double c[3])
{
    double first, last;
    cells_near(l, 2, part[0], part[1], &first, &last);
    for (c[2] = fmax(first, q->at[2]); c[2] <= last; c[2]++) {
        if (r->left-- <= 0) {
            memcpy(q->at, c, sizeof q->at);
            return false;
        }
        visit_cell(q, r, l, c);
    }
    q->at[2] = -INFINITY;
    return true;
}

/* All cells within reach, row by row, from q->at on; so for what follows. */
static bool step_leg(struct free_query *q, struct reader *r, const struct leg *l)
{
    double reach = l->radius + 1e-6, first[2], last[2], c[3];
    cells_near(l, 0, 0, 1, &first[0], &last[0]);
    for (c[0] = fmax(first[0], q->at[0]); c[0] <= last[0]; c[0]++, q->at[1] = -INFINITY) {
        double from = 0, to = 1;
        if (!clip(l, 0, c[0] - reach, c[0] + 1 + reach, &from, &to))
            continue;
        cells_near(l, 1, from, to, &first[1], &last[1]);
        for (c[1] = fmax(first[1], q->at[1]); c[1] <= last[1]; c[1]++) {
            double part[2] = {from, to};
            if (clip(l, 1, c[1] - reach, c[1] + 1 + reach, &part[0], &part[1]) && !step_row(q, r, l, part, c))
                return false;
        }
    }
    return true;
}

/* False when an end is no place, or the leg would touch too many voxels. */
static bool leg_of(struct leg *l, const double a_m[3], const double b_m[3], double radius_m, double voxel_m,
                   double *voxels)
{
    struct lattice_place a, b;
    double sum = 0;
    if (!lattice_place(a_m, voxel_m, &a) || !lattice_place(b_m, voxel_m, &b))
        return false;
    l->radius = radius_m / voxel_m;
    for (int x = 0; x < 3; x++) {
        l->origin[x] = a.cell[x];
        l->a[x] = a.offset[x];
        l->d[x] = (double)(b.cell[x] - a.cell[x]) + b.offset[x] - a.offset[x];
        if (!(fabs(l->d[x]) <= FARTHEST))
            return false;
        sum += l->d[x] * l->d[x];
    }
    l->length = sqrt(sum);
    double wide = 2 * l->radius + 2;
    *voxels += wide * wide * (l->length + wide);
    return *voxels <= FREE_QUERY_MOST_VOXELS;
}

/* The leg to way point w; the only point is a leg to itself. */
static bool leg_to(struct leg *l, const struct free_query *q, uint32_t w, double *voxels)
{
    return leg_of(l, q->way_m[w > 0 ? w - 1 : 0], q->way_m[w], q->radius_m, q->voxel_m, voxels);
}

static void begin_leg(struct free_query *q, uint32_t w)
{
    q->leg = w;
    for (int a = 0; a < 3; a++)
        q->at[a] = -INFINITY;
}

bool free_query_begin_corridor(struct free_query *q, double voxel_m, const double (*way_m)[3], uint32_t n,
                               double radius_m)
{
    struct leg leg;
    double voxels = 0;
    *q = (struct free_query){.voxel_m = voxel_m, .way_m = way_m, .n = n, .radius_m = radius_m};
    if (n == 0 || !(radius_m >= 0 && radius_m <= FARTHEST * voxel_m))
        return false;
    begin_leg(q, n > 1);
    for (uint32_t w = q->leg; w < n; w++)
        if (!leg_to(&leg, q, w, &voxels))
            return false;
    return true;
}

static bool step_corridor(struct free_query *q, struct reader *r)
{
    for (; q->leg < q->n; begin_leg(q, q->leg + 1)) {
        struct leg leg;
        double voxels = 0;
        leg_to(&leg, q, q->leg, &voxels);
        leg.before_m = q->before_m;
        if (!step_leg(q, r, &leg))
            return false;
        q->before_m += leg.length * q->voxel_m;
    }
    if (!q->found)
        q->answer.clear_m = q->before_m;
    return true;
}

/* ---- both ---- */

bool free_query_step(struct free_query *q, struct voxmask *v)
{
    struct reader r = {.mask = v, .left = FREE_QUERY_SLICE};
    return q->way_m ? step_corridor(q, &r) : step_box(q, &r);
}
