/* SPDX-License-Identifier: MIT */
#include "tangents.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"

#define ROUND_SHARE    0.1  /* an axis whose variances differ by less than this share of their sum is none */
#define OPPOSITE_RAD   0.26 /* walls of a tank are parallel to 15 degrees, as far as a scan from afloat can tell */
#define PARALLEL_SINE  0.26 /* two lines that differ by less do not make a corner */
#define STRAIGHTER     0.5  /* of what both sides are off their line, one side alone must be less */
#define HOLES          3    /* points off its line that end a wall */
#define GAP_SHARE      0.5  /* of the range of a wall's end: a corner may be so far past it */
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

/* How far a point at a range may be off its line, and points all in all. */
static double offset_at(const struct tangents_conf *conf, double range_m)
{
    return conf->offset_m + conf->offset_share * range_m;
}

static double straight_at(const struct tangents_conf *conf, double range_m)
{
    return conf->straight_m + conf->offset_share * range_m;
}

/* ---- a tangent for each point ---- */

struct tangent {
    bool has;
    double range_m;
    double angle_rad, offset_m; /* the line's angle [0, pi), its distance from the scanner along its left normal */
};

/* rms off the best line: the smaller eigenvalue of the second moments. */
static double off_line(const struct moments *m)
{
    const double least = (m->xx + m->yy - hypot(m->xx - m->yy, 2 * m->xy)) / 2;
    return sqrt(fmax(0, least) / m->n);
}

/* The points from `first` on that are near enough to point i to say something about it. */
static struct moments neighbours_of(const struct tangents_conf *conf, const struct tangent_point *points,
                                    uint32_t n, uint32_t i, uint32_t first)
{
    struct moments m = {0};
    const double reach_m = fmax(conf->reach_m, conf->reach_share * hypot(points[i].x_m, points[i].y_m));
    for (uint32_t k = 0; k < conf->neighbours; k++) {
        const struct tangent_point *p = &points[(first + k) % n];
        if (is_there(p) && hypot(p->x_m - points[i].x_m, p->y_m - points[i].y_m) <= reach_m)
            add(&m, p);
    }
    return m;
}

/*
 * Neighbours on both sides of a point say best how its line runs, but beside a corner they bend it. So those behind
 * the point and those before it are tried as well: they count where they are straighter by far. On an arc they are not.
 */
static struct tangent tangent_at(const struct tangents_conf *conf, const struct tangent_point *points, uint32_t n,
                                 uint32_t i)
{
    struct tangent t = {0};
    const uint32_t span = conf->neighbours - 1, back[] = {span / 2, 0, span};
    double least_m = straight_at(conf, hypot(points[i].x_m, points[i].y_m));
    if (!is_there(&points[i]))
        return t;
    for (int w = 0; w < 3; w++) {
        const struct moments m = neighbours_of(conf, points, n, i, i + n - back[w] % n);
        double angle_rad;
        if (m.n < 3 || (w > 0 && m.n < conf->neighbours) || off_line(&m) >= least_m || !axis_of(&m, &angle_rad))
            continue;
        least_m = w == 0 ? STRAIGHTER * off_line(&m) : off_line(&m);
        t = (struct tangent){true, hypot(points[i].x_m, points[i].y_m), angle_rad,
                             -sin(angle_rad) * m.x + cos(angle_rad) * m.y};
    }
    return t;
}

/* At the seam of pi the angle jumps and with it the sign of the offset. */
static bool same_line(const struct tangents_conf *conf, const struct tangent *a, const struct tangent *b)
{
    const double turn = fabs(a->angle_rad - b->angle_rad), off_m = offset_at(conf, fmin(a->range_m, b->range_m));
    if (turn <= conf->angle_rad)
        return fabs(a->offset_m - b->offset_m) <= off_m;
    return GEO_PI - turn <= conf->angle_rad && fabs(a->offset_m + b->offset_m) <= off_m;
}

/* ---- walls ---- */

static uint32_t root_of(uint32_t *parent, uint32_t i)
{
    while (parent[i] != i)
        i = parent[i] = parent[parent[i]];
    return i;
}

/* The line through the points of wall `w`. */
static bool fit(const struct tangents_conf *conf, const struct tangent_point *points, uint32_t n,
                const uint32_t *of, uint32_t w, struct wall *wall)
{
    struct moments m = {0};
    double angle;
    for (uint32_t i = 0; i < n; i++)
        if (of[i] == w)
            add(&m, &points[i]);
    if (m.n < conf->least_n || !axis_of(&m, &angle))
        return false;
    double nx = -sin(angle), ny = cos(angle), distance = nx * m.x + ny * m.y;
    if (distance < 0) {
        nx = -nx;
        ny = -ny;
        distance = -distance;
    }
    *wall = (struct wall){.normal_rad = geo_wrap(atan2(ny, nx)), .distance_m = distance, .rms_m = off_line(&m)};
    return distance > THROUGH_SELF_M && wall->rms_m <= straight_at(conf, distance);
}

/*
 * A wall takes the points beside its own that lie on its line: at its ends and where noise bent their tangents. Those
 * that others own it leaves alone.
 */
static void grow(const struct tangents_conf *conf, const struct tangent_point *points, uint32_t n,
                 const struct wall *wall, uint32_t w, uint32_t *of)
{
    const double nx = cos(wall->normal_rad), ny = sin(wall->normal_rad);
    for (int back = 0; back < 2; back++) {
        uint32_t holes = HOLES;
        for (uint32_t k = 0; k < 2 * n; k++) {
            const uint32_t i = (back ? 2 * n - 1 - k : k) % n;
            const struct tangent_point *p = &points[i];
            if (of[i] == TANGENTS_NONE && is_there(p) && holes < HOLES &&
                fabs(nx * p->x_m + ny * p->y_m - wall->distance_m) <= offset_at(conf, hypot(p->x_m, p->y_m)))
                of[i] = w;
            holes = of[i] == w ? 0 : holes + 1;
        }
    }
}

/* How far a wall is seen, and by how many points. */
static void measure_wall(const struct tangent_point *points, uint32_t n, const uint32_t *of, uint32_t w,
                         struct wall *wall)
{
    const double nx = cos(wall->normal_rad), ny = sin(wall->normal_rad);
    wall->points = 0;
    wall->from_m = INFINITY;
    wall->to_m = -INFINITY;
    for (uint32_t i = 0; i < n; i++) {
        if (of[i] != w)
            continue;
        const double along_m = -ny * points[i].x_m + nx * points[i].y_m;
        wall->points++;
        wall->from_m = fmin(wall->from_m, along_m);
        wall->to_m = fmax(wall->to_m, along_m);
    }
}

/* Connected points become one tree; those without a tangent belong to none. */
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

/* The root of the largest tree. */
static uint32_t largest(uint32_t *size, uint32_t n)
{
    uint32_t best = 0;
    for (uint32_t i = 1; i < n; i++)
        if (size[i] > size[best])
            best = i;
    return best;
}

/* Most points first. */
static void sort_walls(struct wall *wall, uint32_t found, uint32_t *of, uint32_t n)
{
    for (uint32_t k = 1; k < found; k++)
        for (uint32_t w = k; w > 0 && wall[w - 1].points < wall[w].points; w--) {
            const struct wall more = wall[w];
            wall[w] = wall[w - 1];
            wall[w - 1] = more;
            for (uint32_t i = 0; i < n; i++)
                of[i] = of[i] == w ? w - 1 : of[i] == w - 1 ? w : of[i];
        }
}

/* The largest tree takes its points and what lies on their line before the next one may. */
uint32_t tangents_walls(const struct tangents_conf *conf, const struct tangent_point *points, uint32_t n,
                        struct wall *wall, uint32_t room, uint32_t *of)
{
    struct tangent tangent[TANGENTS_MAX];
    uint32_t parent[TANGENTS_MAX], size[TANGENTS_MAX], found = 0;
    memset(size, 0, n * sizeof *size);
    for (uint32_t i = 0; i < n; i++) {
        tangent[i] = tangent_at(conf, points, n, i);
        of[i] = TANGENTS_NONE;
    }
    join_tangents(conf, tangent, n, parent);
    for (uint32_t i = 0; i < n; i++)
        if (parent[i] != TANGENTS_NONE)
            size[parent[i]]++;
    for (uint32_t root; n > 0 && found < room && size[root = largest(size, n)] >= conf->least_n; size[root] = 0) {
        for (uint32_t i = 0; i < n; i++)
            if (of[i] == TANGENTS_NONE && parent[i] == root)
                of[i] = found;
        if (fit(conf, points, n, of, found, &wall[found])) {
            grow(conf, points, n, &wall[found], found, of);
            measure_wall(points, n, of, found, &wall[found]);
            found++;
            continue;
        }
        for (uint32_t i = 0; i < n; i++)
            of[i] = of[i] == found ? TANGENTS_NONE : of[i];
    }
    sort_walls(wall, found, of, n);
    return found;
}

/* ---- corners, ghosts ---- */

/*
 * How far past its end a wall may reach. Seen at a grazing angle its neighbouring points lie far apart, so that a gap
 * counts by its bearing, too; but a bearing there spans any length of open water, so not beyond a share of the range.
 */
static double gap_past(double end_m, double distance_m, double gap_m, double gap_rad)
{
    const double bearing_rad = atan2(end_m, distance_m) + gap_rad;
    const double most_m = GAP_SHARE * hypot(end_m, distance_m);
    const double far_m = bearing_rad < GEO_PI / 2 ? distance_m * tan(bearing_rad) - end_m : most_m;
    return fmax(gap_m, fmin(far_m, most_m));
}

static bool reaches(const struct wall *w, double along_m, double gap_m, double gap_rad)
{
    return along_m >= w->from_m - gap_past(-w->from_m, w->distance_m, gap_m, gap_rad) &&
           along_m <= w->to_m + gap_past(w->to_m, w->distance_m, gap_m, gap_rad);
}

bool tangents_corner(const struct wall *a, const struct wall *b, double gap_m, double gap_rad,
                     struct tangent_point *place)
{
    const double ax = cos(a->normal_rad), ay = sin(a->normal_rad), bx = cos(b->normal_rad),
                 by = sin(b->normal_rad), sine = ax * by - ay * bx;
    if (fabs(sine) < PARALLEL_SINE)
        return false;
    place->x_m = (a->distance_m * by - b->distance_m * ay) / sine;
    place->y_m = (b->distance_m * ax - a->distance_m * bx) / sine;
    return reaches(a, -ay * place->x_m + ax * place->y_m, gap_m, gap_rad) &&
           reaches(b, -by * place->x_m + bx * place->y_m, gap_m, gap_rad);
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
