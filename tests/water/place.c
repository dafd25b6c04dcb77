/* SPDX-License-Identifier: MIT */
/* place - shapes as distances, and rays and beams through them; see place.h. */
#include "place.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"

#define CLOSE_M   0.004 /* patches of a beam are divided until they are known so well */
#define EPSILON_M 1e-6  /* a ray that starts on a surface does not hit it */

bool place_add(struct place *place, const struct place_shape *shape)
{
    for (int i = 0; i < PLACE_MAX_SHAPES; i++)
        if (place->shape[i].kind == PLACE_END) {
            place->shape[i] = *shape;
            return true;
        }
    return false;
}

bool place_moves(const struct place_shape *s)
{
    return s->v[0] != 0 || s->v[1] != 0 || s->v[2] != 0;
}

struct place place_still(const struct place *place)
{
    struct place still = *place;
    memset(still.shape, 0, sizeof still.shape);
    for (const struct place_shape *s = place->shape; s->kind != PLACE_END; s++)
        if (!place_moves(s))
            place_add(&still, s);
    return still;
}

static bool is_cut(const struct place_shape *s)
{
    return s->cut[0] != 0 || s->cut[1] != 0 || s->cut[2] != 0;
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* From where the shape then is. */
static void go_along(const struct place_shape *s, const double at[3], double t_s, double q[3])
{
    for (int a = 0; a < 3; a++)
        q[a] = at[a] - s->v[a] * t_s;
}

/* ---- distances: positive inside a shape ---- */

/* In what is both. */
static double both(double a, double b)
{
    return a < 0 && b < 0 ? -sqrt(a * a + b * b) : fmin(a, b);
}

static double in_span(const double span[2], double x)
{
    return fmin(x - span[0], span[1] - x);
}

static double in_capsule(const struct place_shape *s, const double q[3])
{
    double along[3], from[3], off[3];
    for (int a = 0; a < 3; a++) {
        along[a] = s->p[a + 3] - s->p[a];
        from[a] = q[a] - s->p[a];
    }
    const double t = fmin(fmax(dot(from, along) / dot(along, along), 0), 1);
    for (int a = 0; a < 3; a++)
        off[a] = from[a] - t * along[a];
    return s->thickness_m - sqrt(dot(off, off));
}

/* Of a shape that is so much wider and higher. */
static double in_shape(const struct place_shape *s, const double at[3], double wider, double higher, double t_s)
{
    double q[3], d = INFINITY;
    go_along(s, at, t_s, q);
    if (s->kind == PLACE_BOX)
        d = both(both(in_span(s->p, q[0]), in_span(s->p + 2, q[1])) + wider, in_span(s->p + 4, q[2]) + higher);
    else if (s->kind == PLACE_TUBE)
        d = both(s->p[2] - hypot(q[0] - s->p[0], q[1] - s->p[1]) + wider, in_span(s->p + 3, q[2]) + higher);
    else if (s->kind == PLACE_CAPSULE)
        d = in_capsule(s, q) + copysign(hypot(wider, higher), wider);
    if (is_cut(s))
        d = fmin(d, s->cut[3] - dot(s->cut, q) + wider * hypot(s->cut[0], s->cut[1]) + higher * fabs(s->cut[2]));
    return d;
}

double place_shape_clearance(const struct place_shape *s, const double at[3], const struct place_hull *hull,
                             double t_s)
{
    return -in_shape(s, at, hull ? hull->radius_m : 0, hull ? hull->half_height_m : 0, t_s);
}

double place_clearance(const struct place *place, const double at[3], const struct place_hull *hull, double t_s)
{
    const struct place_shape *s = place->shape;
    double clear = s->water ? -INFINITY : INFINITY;
    for (; s->water; s++)
        clear = fmax(clear, in_shape(s, at, hull ? -hull->radius_m : 0, hull ? -hull->half_height_m : 0, t_s));
    for (; s->kind != PLACE_END; s++)
        clear = fmin(clear, place_shape_clearance(s, at, hull, t_s));
    return clear;
}

/* ---- rays: where they are within a shape ---- */

struct span {
    double r[2]; /* enters and leaves */
    double normal[2][3];
};

static const struct span everywhere = {.r = {-INFINITY, INFINITY}};
static const struct span nowhere = {.r = {INFINITY, -INFINITY}};

/* Leaves of a span what has n p <= c: the ray goes towards the cut so fast, and begins so far below it. */
static void cut_at(struct span *s, double towards, double height, const double n[3])
{
    const double r = height / towards;
    const int end = towards > 0;
    if (towards == 0 ? height < 0 : false)
        *s = nowhere;
    else if (towards != 0 && (end ? r < s->r[1] : r > s->r[0])) {
        s->r[end] = r;
        memcpy(s->normal[end], n, sizeof s->normal[end]);
    }
}

static void cut(struct span *s, const double o[3], const double d[3], const double n[3], double c)
{
    cut_at(s, dot(n, d), c - dot(n, o), n);
}

/* Most of a place is boxes, and most rays pass most of them. */
static void cut_between(struct span *s, const double o[3], const double d[3], int axis, const double between[2])
{
    static const double normal[3][2][3] = {
        {{-1, 0, 0}, {1, 0, 0}}, {{0, -1, 0}, {0, 1, 0}}, {{0, 0, -1}, {0, 0, 1}}};
    if (s->r[0] >= s->r[1])
        return;
    cut_at(s, -d[axis], o[axis] - between[0], normal[axis][0]);
    cut_at(s, d[axis], between[1] - o[axis], normal[axis][1]);
}

/* Within radius of a point (axis 0) or of a line through it (a unit axis). */
static struct span round_span(const double middle[3], const double axis[3], double radius, const double o[3],
                              const double d[3])
{
    struct span s = everywhere;
    double m[3], e[3];
    for (int a = 0; a < 3; a++)
        m[a] = o[a] - middle[a];
    const double m_along = dot(m, axis), d_along = dot(d, axis);
    for (int a = 0; a < 3; a++) {
        m[a] -= m_along * axis[a];
        e[a] = d[a] - d_along * axis[a];
    }
    const double a2 = dot(e, e), b = dot(m, e), c = dot(m, m) - radius * radius, disc = b * b - a2 * c;
    if (a2 == 0 ? c > 0 : disc < 0)
        return nowhere;
    for (int end = 0; a2 != 0 && end < 2; end++) {
        s.r[end] = (-b + (end ? 1 : -1) * sqrt(disc)) / a2;
        for (int a = 0; a < 3; a++)
            s.normal[end][a] = (m[a] + s.r[end] * e[a]) / radius;
    }
    return s;
}

static struct span capsule_span(const struct place_shape *s, const double o[3], const double d[3])
{
    static const double none[3] = {0, 0, 0};
    double axis[3], length = 0;
    struct span all = nowhere;
    for (int a = 0; a < 3; a++)
        length = hypot(length, s->p[a + 3] - s->p[a]);
    for (int a = 0; a < 3; a++)
        axis[a] = (s->p[a] - s->p[a + 3]) / length;
    for (int part = 0; part < 3; part++) { /* between the ends, and a ball at each */
        struct span one = round_span(part == 2 ? s->p + 3 : s->p, part == 0 ? axis : none, s->thickness_m, o, d);
        if (part == 0) {
            const double back[3] = {-axis[0], -axis[1], -axis[2]};
            cut(&one, o, d, axis, dot(axis, s->p));
            cut(&one, o, d, back, dot(back, s->p + 3));
        }
        for (int end = 0; end < 2 && one.r[0] < one.r[1]; end++)
            if (end ? one.r[1] > all.r[1] : one.r[0] < all.r[0]) {
                all.r[end] = one.r[end];
                memcpy(all.normal[end], one.normal[end], sizeof all.normal[end]);
            }
    }
    return all;
}

static struct span span_of(const struct place_shape *s, const double from[3], const double d[3], double t_s)
{
    static const double upright[3] = {0, 0, 1};
    struct span span = everywhere;
    double o[3];
    go_along(s, from, t_s, o);
    if (s->kind == PLACE_BOX)
        for (int axis = 0; axis < 3; axis++)
            cut_between(&span, o, d, axis, s->p + 2 * axis);
    else if (s->kind == PLACE_CAPSULE)
        span = capsule_span(s, o, d);
    else if (s->kind == PLACE_TUBE) {
        span = round_span((const double[]){s->p[0], s->p[1], 0}, upright, s->p[2], o, d);
        cut_between(&span, o, d, 2, s->p + 3);
    }
    if (is_cut(s))
        cut(&span, o, d, s->cut, s->cut[3]);
    return span;
}

/* A room rings between opposite walls, so its ghost lies one room further. */
static double ghost_of(const struct place_shape *s, const struct span *span, int end)
{
    for (int axis = 0; axis < 3 && s->kind == PLACE_BOX && end; axis++)
        if (fabs(span->normal[1][axis]) == 1)
            return span->r[1] + s->p[2 * axis + 1] - s->p[2 * axis];
    return 2 * span->r[end];
}

static void meet(const struct place *place, int shape, const struct span *span, int end, const double d[3],
                 struct place_hit *hit)
{
    *hit = (struct place_hit){.range_m = span->r[end],
                              .cos_incidence = fmin(1, fabs(dot(span->normal[end], d))),
                              .ghost_m = ghost_of(&place->shape[shape], span, end),
                              .level = fabs(span->normal[end][2]) > 0.5,
                              .shape = shape};
}

/* Where the ray leaves the last of the waters that run into each other. */
static int leave_water(const struct place *place, const double from[3], const double d[3], double t_s,
                       struct place_hit *hit)
{
    struct span span[PLACE_MAX_SHAPES];
    int n = 0;
    for (; place->shape[n].water; n++)
        span[n] = span_of(&place->shape[n], from, d, t_s);
    *hit = (struct place_hit){.range_m = n > 0 ? 0 : INFINITY};
    for (bool on = true; on;) {
        on = false;
        for (int i = 0; i < n; i++)
            if (span[i].r[0] <= hit->range_m && span[i].r[1] > hit->range_m) {
                meet(place, i, &span[i], 1, d, hit);
                on = true;
            }
    }
    return n;
}

bool place_cast(const struct place *place, const double from[3], const double d[3], double t_s,
                struct place_hit *hit)
{
    for (int i = leave_water(place, from, d, t_s, hit); place->shape[i].kind != PLACE_END; i++) {
        const struct span span = span_of(&place->shape[i], from, d, t_s);
        const int end = span.r[0] <= EPSILON_M;
        if (span.r[0] <= span.r[1] && span.r[end] > EPSILON_M && span.r[end] < hit->range_m)
            meet(place, i, &span, end, d, hit);
    }
    return hit->range_m < INFINITY;
}

double place_ray(const struct place *place, const double from[3], const double d[3], double max_m, double t_s)
{
    struct place_hit hit;
    return place_cast(place, from, d, t_s, &hit) ? fmin(hit.range_m, max_m) : max_m;
}

static double across(double half, int i, int n)
{
    return n > 1 ? half * (2.0 * i / (n - 1) - 1) : 0;
}

double place_nearest(const struct place *place, const double from[3], const struct place_fan *fan, double t_s)
{
    double nearest_m = INFINITY;
    for (int i = 0; i < fan->n_az; i++)
        for (int k = 0; k < fan->n_el; k++) {
            double d[3];
            geo_direction(fan->az_rad + across(fan->half_az_rad, i, fan->n_az),
                          fan->el_rad + across(fan->half_el_rad, k, fan->n_el), d);
            nearest_m = place_ray(place, from, d, nearest_m, t_s);
        }
    return nearest_m;
}

/* ---- a beam's first range ---- */

struct beam_search {
    const struct place *place;
    const double *from;
    const double (*axis)[3];
    double t_s, first; /* the least range at which a patch came close, so far */
};

/* A patch of directions; all of it is known to be clear up to r. */
static void search(struct beam_search *s, double az, double el, double half_az, double half_el, double r)
{
    const double in_beam[3] = {cos(az) * cos(el), sin(az) * cos(el), -sin(el)};
    const double spread = hypot(half_az, half_el);
    double d[3];
    for (int a = 0; a < 3; a++)
        d[a] = s->axis[0][a] * in_beam[0] + s->axis[1][a] * in_beam[1] + s->axis[2][a] * in_beam[2];
    for (;;) {
        if (r >= s->first - CLOSE_M)
            return;
        const double p[3] = {s->from[0] + r * d[0], s->from[1] + r * d[1], s->from[2] + r * d[2]};
        const double clear = place_clearance(s->place, p, NULL, s->t_s) - r * spread;
        if (clear < CLOSE_M / 4)
            break;
        r += clear; /* no point of the patch is farther than r * spread from p, so all stay clear */
    }
    if (r * spread < CLOSE_M) {
        s->first = r;
        return;
    }
    if (half_az > half_el) {
        search(s, az - half_az / 2, el, half_az / 2, half_el, r);
        search(s, az + half_az / 2, el, half_az / 2, half_el, r);
    } else {
        search(s, az, el - half_el / 2, half_az, half_el / 2, r);
        search(s, az, el + half_el / 2, half_az, half_el / 2, r);
    }
}

double place_first(const struct place *place, const double from[3], const double axis[3][3], double half_az_rad,
                   double half_el_rad, double max_m, double t_s)
{
    struct beam_search s = {place, from, axis, t_s, max_m + CLOSE_M};
    search(&s, 0, 0, half_az_rad, half_el_rad, 0);
    return fmax(0, s.first - CLOSE_M);
}
