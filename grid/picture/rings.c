/* SPDX-License-Identifier: MIT */
#include "rings.h"

#include <math.h>

#include "grid/geometry.h"

/* Solid angle 4 pi sin(mid) sin(w/2): the difference of cosines would cancel at the poles. The tiny allowance keeps a
 * ring whose solid angle is a whole number of cells from getting one more by rounding. */
uint32_t rings_cells(uint32_t ring, uint32_t n_polar, double step_rad)
{
    double w = GEO_PI / n_polar;
    double solid = 2 * GEO_TURN * sin((ring + 0.5) * w) * sin(w / 2);
    double n = ceil(solid / (step_rad * step_rad) * (1 - 1e-13));
    return n < 1 ? 1 : (uint32_t)n;
}

static void finish(struct rings *rings)
{
    rings->n = rings->start[rings->n_rings];
    rings->tan_half = tan(rings->height_rad / 2);
    for (uint32_t j = 0; j < rings->n_rings; j++) {
        double el = rings->top_rad - (j + 0.5) * rings->height_rad;
        rings->sin_el[j] = sin(el);
        rings->cos_el[j] = cos(el);
        const double half = rings_width(rings, j) / 2;
        rings->tan_width[j] = half < GEO_PI / 4 ? tan(half) : 0;
    }
    for (uint32_t j = 0; j <= rings->n_rings; j++)
        rings->sin_edge[j] = sin(rings->top_rad - j * rings->height_rad);
}

bool rings_full(struct rings *rings, double step_rad)
{
    if (!(step_rad >= geo_rad(0.25) && step_rad <= GEO_PI / 2))
        return false;
    rings->n_rings = (uint32_t)ceil(GEO_PI / step_rad * (1 - 1e-13));
    rings->height_rad = GEO_PI / rings->n_rings;
    rings->top_rad = GEO_PI / 2;
    rings->step_rad = step_rad;
    rings->start[0] = 0;
    for (uint32_t j = 0; j < rings->n_rings; j++)
        rings->start[j + 1] = rings->start[j] + rings_cells(j, rings->n_rings, step_rad);
    finish(rings);
    return true;
}

bool rings_level(struct rings *rings, double step_rad, double half_rad)
{
    if (!(step_rad >= geo_rad(0.25) && step_rad <= GEO_PI / 2 && half_rad > 0 && half_rad <= GEO_PI / 2))
        return false;
    rings->n_rings = 1;
    rings->height_rad = 2 * half_rad;
    rings->top_rad = half_rad;
    rings->step_rad = step_rad;
    rings->start[0] = 0;
    rings->start[1] = (uint32_t)ceil(GEO_TURN / step_rad * (1 - 1e-13));
    finish(rings);
    return true;
}

static uint32_t cells_of(const struct rings *rings, uint32_t ring)
{
    return rings->start[ring + 1] - rings->start[ring];
}

/* Ring of an elevation, clamped; the bottom edge belongs to the last ring. */
static uint32_t ring_at(const struct rings *rings, double el_rad)
{
    double j = (rings->top_rad - el_rad) / rings->height_rad;
    if (!(j > 0))
        return 0;
    return j >= rings->n_rings ? rings->n_rings - 1 : (uint32_t)j;
}

static uint32_t cell_at(const struct rings *rings, uint32_t ring, double az_rad)
{
    uint32_t n = cells_of(rings, ring);
    uint32_t i = (uint32_t)(geo_wrap(az_rad) * (n / GEO_TURN));
    return i >= n ? i - n : i;
}

uint32_t rings_index(const struct rings *rings, double az_rad, double el_rad)
{
    if (el_rad > rings->top_rad || el_rad < rings->top_rad - rings->n_rings * rings->height_rad * (1 + 1e-15))
        return RINGS_NONE;
    uint32_t ring = ring_at(rings, el_rad);
    return rings->start[ring] + cell_at(rings, ring, az_rad);
}

/* The cell that x, in cells, is in; RINGS_NONE when it is not inside one of them by the margin. */
static uint32_t sure_cell(double x, uint32_t cells, double margin)
{
    if (!(x > 0 && x < cells)) /* NaN neither */
        return RINGS_NONE;
    const uint32_t i = (uint32_t)x;
    return x - i > margin && x - i < 1 - margin ? i : RINGS_NONE;
}

uint32_t rings_holding(const struct rings *rings, const double v[3])
{
    const double per_height = 1 / rings->height_rad, el = geo_rough_angle(-v[2], sqrt(v[0] * v[0] + v[1] * v[1]));
    const uint32_t ring =
        sure_cell((rings->top_rad - el) * per_height, rings->n_rings, GEO_ROUGH_RAD * per_height);
    if (ring != RINGS_NONE) {
        const uint32_t cells = cells_of(rings, ring);
        const double az = geo_rough_angle(v[1], v[0]), per_rad = cells / GEO_TURN;
        const uint32_t cell = sure_cell((az < 0 ? az + GEO_TURN : az) * per_rad, cells, GEO_ROUGH_RAD * per_rad);
        if (cell != RINGS_NONE)
            return rings->start[ring] + cell;
    }
    double az, el_rad;
    geo_angles(v, &az, &el_rad);
    return rings_index(rings, az, el_rad);
}

uint32_t rings_ring(const struct rings *rings, uint32_t direction)
{
    uint32_t lo = 0, hi = rings->n_rings;
    while (hi - lo > 1) {
        uint32_t mid = lo + (hi - lo) / 2;
        if (rings->start[mid] <= direction)
            lo = mid;
        else
            hi = mid;
    }
    return lo;
}

double rings_width(const struct rings *rings, uint32_t ring)
{
    return GEO_TURN / cells_of(rings, ring);
}

void rings_centre(const struct rings *rings, uint32_t direction, double *az_rad, double *el_rad)
{
    uint32_t ring = rings_ring(rings, direction);
    *az_rad = (direction - rings->start[ring] + 0.5) * rings_width(rings, ring);
    *el_rad = rings->top_rad - (ring + 0.5) * rings->height_rad;
}

/* All cells of a ring move by the same whole number, so no two of them come to one. */
uint32_t rings_turned(const struct rings *rings, uint32_t direction, double turn_rad)
{
    const uint32_t ring = rings_ring(rings, direction), n = cells_of(rings, ring);
    const double steps = floor(0.5 - geo_wrap(turn_rad) / rings_width(rings, ring)); /* [-n, 0] */
    return rings->start[ring] + (direction - rings->start[ring] + n - (uint32_t)-steps) % n;
}

double rings_reach(const struct rings *rings)
{
    double most = 0;
    for (uint32_t j = 0; j < rings->n_rings; j++) {
        double across = cos(rings_width(rings, j) / 2);
        for (uint32_t edge = 0; edge <= 1; edge++) {
            double corner = rings->top_rad - (j + edge) * rings->height_rad;
            most = fmax(most, acos(rings->sin_el[j] * sin(corner) + rings->cos_el[j] * cos(corner) * across));
        }
    }
    return most;
}

/* A cap is taken to be so much larger: two rough angles meet at its edge. */
#define ROUNDING_RAD (2 * GEO_ROUGH_RAD)

/* Centres at the ring's elevation e' are within r of (az, e) where cos r <= sin e sin e' + cos e cos e' cos(d az). */
static struct rings_run run_in(const struct rings_visit *v)
{
    const struct rings *rings = v->rings;
    const double all = v->cos_el * rings->cos_el[v->ring],
                 rest = v->cos_radius - v->sin_el * rings->sin_el[v->ring];
    const uint32_t cells = cells_of(rings, v->ring);
    struct rings_run run = {.start = rings->start[v->ring], .cells = cells, .n = rest <= all ? cells : 0};
    if (!(rest > -all && rest <= all))
        return run;
    const double half = geo_rough_angle(sqrt((all - rest) * (all + rest)), rest) + ROUNDING_RAD,
                 per_rad = cells / GEO_TURN;
    /* a turn added: to truncate is to round down */
    const uint64_t from = (uint64_t)((v->az_rad - half) * per_rad + 0.5 + cells);
    const uint64_t to = (uint64_t)((v->az_rad + half) * per_rad - 0.5 + cells);
    if (to - from + 1 >= cells)
        return run;
    run.at = (uint32_t)(from % cells);
    run.n = (uint32_t)(to - from + 1);
    return run;
}

struct rings_visit rings_visit(const struct rings *rings, const double axis[3], double radius_rad)
{
    const double radius = fmin(radius_rad + ROUNDING_RAD, GEO_PI);
    const double level = sqrt(axis[0] * axis[0] + axis[1] * axis[1]);
    const double el = geo_rough_angle(-axis[2], level), az = level > 0 ? geo_rough_angle(axis[1], axis[0]) : 0;
    struct rings_visit v = {.rings = rings,
                            .az_rad = az < 0 ? az + GEO_TURN : az,
                            .sin_el = -axis[2],
                            .cos_el = level,
                            .cos_radius = cos(radius)};
    v.ring = ring_at(rings, el + radius);
    v.last_ring = ring_at(rings, el - radius);
    v.run = run_in(&v);
    return v;
}

bool rings_next_ring(struct rings_visit *v)
{
    if (v->ring >= v->last_ring)
        return false;
    v->ring++;
    v->k = 0;
    v->run = run_in(v);
    return true;
}

/* Cells of ring j that touch the part [p / n, (p + 1) / n] of a turn, in integers: edges that meet do meet. */
static struct rings_run touching_in(const struct rings *rings, uint32_t j, uint32_t p, uint32_t n)
{
    const uint32_t m = cells_of(rings, j);             /* products of two such fit well */
    const uint32_t from = (p * m + n - 1) / n + m - 1; /* ceil - 1, a turn added */
    const uint32_t to = (p + 1) * m / n + m, count = to - from + 1;
    return (struct rings_run){
        .start = rings->start[j], .cells = m, .at = from < m ? from : from - m, .n = count < m ? count : m};
}

static bool ends_in_pole(const struct rings *rings, uint32_t ring)
{
    const double top = rings->top_rad - ring * rings->height_rad, pole = GEO_PI / 2 - 1e-9;
    return top > pole || top - rings->height_rad < -pole;
}

unsigned rings_touching(const struct rings *rings, uint32_t d, struct rings_run run[3])
{
    const uint32_t ring = rings_ring(rings, d), p = d - rings->start[ring], n = cells_of(rings, ring);
    unsigned runs = 0;
    if (ring > 0)
        run[runs++] = touching_in(rings, ring - 1, p, n);
    run[runs] = touching_in(rings, ring, p, n);
    if (ends_in_pole(rings, ring))
        run[runs].n = n;
    runs++;
    if (ring + 1 < rings->n_rings)
        run[runs++] = touching_in(rings, ring + 1, p, n);
    return runs;
}
