/* SPDX-License-Identifier: MIT */
#include "arcs.h"

#include <math.h>
#include <stddef.h>

/* Points of a scan; `first` may run past the end of the turn. */
struct run {
    const struct tangent_point *points;
    uint32_t turn, first, n;
};

static const struct tangent_point *point_of(const struct run *r, uint32_t k)
{
    return &r->points[(r->first + k) % r->turn];
}

static struct tangent_point mean_of(const struct run *r)
{
    struct tangent_point mean = {0, 0};
    for (uint32_t k = 0; k < r->n; k++) {
        mean.x_m += point_of(r, k)->x_m / r->n;
        mean.y_m += point_of(r, k)->y_m / r->n;
    }
    return mean;
}

/* Moments about the mean, of second and third order. */
struct moments {
    double uu, uv, vv, u3, v3;
};

static struct moments moments_of(const struct run *r, const struct tangent_point *mean)
{
    struct moments m = {0};
    for (uint32_t k = 0; k < r->n; k++) {
        const double u = point_of(r, k)->x_m - mean->x_m, v = point_of(r, k)->y_m - mean->y_m;
        m.uu += u * u;
        m.uv += u * v;
        m.vv += v * v;
        m.u3 += u * (u * u + v * v);
        m.v3 += v * (u * u + v * v);
    }
    return m;
}

/* rms off the best line: the smaller eigenvalue of the second moments. */
static double off_line(const struct moments *m, uint32_t n)
{
    const double least = (m->uu + m->vv - hypot(m->uu - m->vv, 2 * m->uv)) / 2;
    return sqrt(fmax(0, least) / n);
}

/* The circle with the least sum of squared powers of points (Kasa), if it is one. */
static bool fit(const struct arcs_conf *conf, const struct run *r, struct arc *out)
{
    const struct tangent_point mean = mean_of(r);
    const struct moments m = moments_of(r, &mean);
    const double det = m.uu * m.vv - m.uv * m.uv;
    double sum = 0;
    if (!(det > 0))
        return false;
    const double a = (m.u3 * m.vv - m.v3 * m.uv) / (2 * det), b = (m.v3 * m.uu - m.u3 * m.uv) / (2 * det);
    *out = (struct arc){.centre = {mean.x_m + a, mean.y_m + b},
                        .radius_m = sqrt(a * a + b * b + (m.uu + m.vv) / r->n),
                        .first = r->first % r->turn,
                        .points = r->n};
    for (uint32_t k = 0; k < r->n; k++) {
        const struct tangent_point *p = point_of(r, k);
        const double off = hypot(p->x_m - out->centre.x_m, p->y_m - out->centre.y_m) - out->radius_m;
        sum += off * off;
    }
    out->rms_m = sqrt(sum / r->n);
    return out->radius_m <= conf->radius_m && out->rms_m <= conf->round_m && 2 * out->rms_m < off_line(&m, r->n);
}

static bool is_loose(const struct tangent_point *points, const uint32_t *of, uint32_t i)
{
    return of[i] == TANGENTS_NONE && isfinite(points[i].x_m) && isfinite(points[i].y_m);
}

/* Do the points i and the one after it belong together? */
static bool linked(const struct arcs_conf *conf, const struct tangent_point *points, uint32_t n,
                   const uint32_t *of, uint32_t i)
{
    const uint32_t next = (i + 1) % n;
    return is_loose(points, of, i) && is_loose(points, of, next) &&
           hypot(points[next].x_m - points[i].x_m, points[next].y_m - points[i].y_m) <= conf->reach_m;
}

uint32_t arcs_find(const struct arcs_conf *conf, const struct tangent_point *points, uint32_t n,
                   const uint32_t *of, struct arc *arc, uint32_t room)
{
    uint32_t found = 0, begin = 0;
    while (begin < n && linked(conf, points, n, of, (begin + n - 1) % n))
        begin++; /* the first run begins here; at n there is none that ends */
    begin %= n ? n : 1;
    for (uint32_t k = 0, length; k < n; k += length) {
        struct arc a;
        length = 1;
        while (k + length < n && linked(conf, points, n, of, (begin + k + length - 1) % n))
            length++;
        const struct run run = {.points = points, .turn = n, .first = begin + k, .n = length};
        if (length < conf->least_n || !fit(conf, &run, &a))
            continue;
        if (found < room)
            arc[found] = a;
        found++;
    }
    return found;
}
