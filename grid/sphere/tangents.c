/* SPDX-License-Identifier: MIT */
#include "tangents.h"

#include <math.h>
#include <string.h>

#include "../geometry.h"

#define ROUND_SHARE    0.1  /* an axis whose variances differ by less than this share of their sum is none */
#define OPPOSITE_RAD   0.26 /* walls of a tank are parallel to 15 degrees, as far as a scan from afloat can tell */
#define PARALLEL_SINE  0.26 /* two lines that differ by less do not make a corner */
#define THROUGH_SELF_M 0.05 /* a line that passes the scanner so near has no normal to speak of */

/* Second moments about the mean: centred before products are formed. */
struct moments {
    double n, x, y, xx, xy, yy;
};

static bool is_there(const struct tangent_point *p)
{
    return isfinite(p->x_m) && isfinite(p->y_m);
}

static void add(struct moments *m, const struct tangent_point *p)
{
    const double dx = p->x_m - m->x, dy = p->y_m - m->y;
    m->n++;
    m->x += dx / m->n;
    m->y += dy / m->n;
    m->xx += dx * (p->x_m - m->x);
    m->xy += dx * (p->y_m - m->y);
    m->yy += dy * (p->y_m - m->y);
}

static double modulo_pi(double a)
{
    a = fmod(a, GEO_PI);
    if (a < 0)
        a += GEO_PI;
    return a < GEO_PI ? a : 0;
}

static bool axis_of(const struct moments *m, double *angle_rad)
{
    const double across = m->xx - m->yy, along = 2 * m->xy;
    if (m->n < 2 || !(hypot(across, along) > ROUND_SHARE * (m->xx + m->yy)))
        return false;
    *angle_rad = modulo_pi(atan2(along, across) / 2);
    return true;
}

/* ---- a tangent for each point ---- */

struct tangent {
    bool has;
    double angle_rad, offset_m; /* the line's angle [0, pi), its distance from the scanner along its left normal */
};

static struct tangent tangent_at(const struct tangents_conf *conf, const struct tangent_point *points, uint32_t n,
                                 uint32_t i)
{
    struct tangent t = {0};
    struct moments m = {0};
    const uint32_t half = conf->neighbours / 2;
    if (!is_there(&points[i]))
        return t;
    for (uint32_t k = 0; k < conf->neighbours; k++) {
        const struct tangent_point *p = &points[(i + n - half % n + k) % n];
        if (is_there(p) && hypot(p->x_m - points[i].x_m, p->y_m - points[i].y_m) <= conf->reach_m)
            add(&m, p);
    }
    t.has = m.n >= 3 && axis_of(&m, &t.angle_rad);
    t.offset_m = -sin(t.angle_rad) * m.x + cos(t.angle_rad) * m.y;
    return t;
}

/* At the seam of pi the angle jumps and with it the sign of the offset. */
static bool same_line(const struct tangents_conf *conf, const struct tangent *a, const struct tangent *b)
{
    const double turn = fabs(a->angle_rad - b->angle_rad);
    if (turn <= conf->angle_rad)
        return fabs(a->offset_m - b->offset_m) <= conf->offset_m;
    return GEO_PI - turn <= conf->angle_rad && fabs(a->offset_m + b->offset_m) <= conf->offset_m;
}

/* ---- walls ---- */

static uint32_t root_of(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

static bool fit(const struct tangents_conf *conf, const struct tangent_point *points, uint32_t n,
                const uint32_t *parent, uint32_t root, struct wall *w)
{
    struct moments m = {0};
    double angle;
    for (uint32_t i = 0; i < n; i++)
        if (parent[i] == root)
            add(&m, &points[i]);
    if (m.n < conf->least_n || !axis_of(&m, &angle))
        return false;
    double nx = -sin(angle), ny = cos(angle), distance = nx * m.x + ny * m.y;
    if (distance < 0) {
        nx = -nx;
        ny = -ny;
        distance = -distance;
    }
    const double off2 = nx * nx * m.xx + 2 * nx * ny * m.xy + ny * ny * m.yy;
    *w = (struct wall){.normal_rad = geo_wrap(atan2(ny, nx)),
                       .distance_m = distance,
                       .rms_m = sqrt(fmax(0, off2) / m.n),
                       .points = (uint32_t)m.n,
                       .from_m = INFINITY,
                       .to_m = -INFINITY};
    for (uint32_t i = 0; i < n; i++) {
        if (parent[i] != root)
            continue;
        const double along = -ny * points[i].x_m + nx * points[i].y_m;
        w->from_m = fmin(w->from_m, along);
        w->to_m = fmax(w->to_m, along);
    }
    return w->distance_m > THROUGH_SELF_M && w->rms_m <= conf->straight_m;
}

/* Points that hang together become one tree; those without a tangent belong to none. */
static void join_tangents(const struct tangents_conf *conf, const struct tangent *tangent, uint32_t n,
                          uint32_t *parent)
{
    for (uint32_t i = 0; i < n; i++) {
        parent[i] = tangent[i].has ? i : TANGENTS_NONE;
        for (uint32_t k = 0; tangent[i].has && k < i; k++)
            if (tangent[k].has && same_line(conf, &tangent[i], &tangent[k]))
                parent[root_of(parent, k)] = root_of(parent, i);
    }
    for (uint32_t i = 0; i < n; i++)
        if (tangent[i].has)
            parent[i] = root_of(parent, i);
}

uint32_t tangents_walls(const struct tangents_conf *conf, const struct tangent_point *points, uint32_t n,
                        struct wall *wall, uint32_t room, uint32_t *of)
{
    struct tangent tangent[TANGENTS_MAX];
    uint32_t parent[TANGENTS_MAX], root[TANGENTS_MAX], found = 0;
    for (uint32_t i = 0; i < n; i++)
        tangent[i] = tangent_at(conf, points, n, i);
    join_tangents(conf, tangent, n, parent);
    for (uint32_t i = 0; i < n; i++) {
        struct wall w;
        if (parent[i] != i || !fit(conf, points, n, parent, i, &w))
            continue;
        uint32_t at = found < room ? found : room;
        for (; at > 0 && wall[at - 1].points < w.points; at--) {
            if (at < room) {
                wall[at] = wall[at - 1];
                root[at] = root[at - 1];
            }
        }
        if (at < room) {
            wall[at] = w;
            root[at] = i;
        }
        found++;
    }
    for (uint32_t i = 0; i < n; i++) {
        of[i] = TANGENTS_NONE;
        for (uint32_t w = 0; w < found && w < room; w++)
            if (parent[i] == root[w])
                of[i] = w;
    }
    return found;
}

/* ---- corners, ghosts ---- */

static bool reaches(const struct wall *w, double along_m, double gap_m)
{
    return along_m >= w->from_m - gap_m && along_m <= w->to_m + gap_m;
}

bool tangents_corner(const struct wall *a, const struct wall *b, double gap_m, struct tangent_point *place)
{
    const double ax = cos(a->normal_rad), ay = sin(a->normal_rad), bx = cos(b->normal_rad),
                 by = sin(b->normal_rad), sine = ax * by - ay * bx;
    if (fabs(sine) < PARALLEL_SINE)
        return false;
    place->x_m = (a->distance_m * by - b->distance_m * ay) / sine;
    place->y_m = (b->distance_m * ax - a->distance_m * bx) / sine;
    return reaches(a, -ay * place->x_m + ax * place->y_m, gap_m) &&
           reaches(b, -by * place->x_m + bx * place->y_m, gap_m);
}

uint32_t tangents_ghost(const struct wall *walls, uint32_t n, double az_rad, double range_m, double off_rad,
                        double within_m)
{
    for (uint32_t w = 0; w < n; w++) {
        const double off = geo_wrap_pi(az_rad - walls[w].normal_rad);
        const double beyond_m =
            range_m * cos(off) - 2 * walls[w].distance_m; /* what the vehicle does not explain */
        if (fabs(off) > off_rad)
            continue;
        if (fabs(beyond_m) <= within_m)
            return w;
        for (uint32_t o = 0; o < n; o++)
            if (fabs(geo_wrap_pi(walls[w].normal_rad - walls[o].normal_rad)) > GEO_PI - OPPOSITE_RAD &&
                fabs(beyond_m - walls[o].distance_m) <= within_m)
                return w;
    }
    return TANGENTS_NONE;
}
