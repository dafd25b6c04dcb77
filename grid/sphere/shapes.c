/* SPDX-License-Identifier: MIT */
#include "shapes.h"

#include <math.h>

#include "grid/geometry.h"

/* Echoes of one wall scatter by centimetres, more in range than the layers of the grid add. */
#define CONSTANT_M     0.06
#define CONSTANT_SHARE 0.02 /* of the range, beside it */
#define ABOUT_NORMAL   0.26 /* a mirror's region is centred on its normal to 15 degrees */
#define GHOST_OFF      0.21 /* ghosts appear within 12 degrees of the normal */
#define GHOST_M        0.16
#define CORNER_GAP_M   0.5
#define SPAN_RAD       0.22     /* that a point's neighbours cover: 12 degrees */
#define CORNER_GAP_RAD SPAN_RAD /* so near a corner they are of both walls, and the point may be of none */
#define REGION_RAD     0.1      /* narrower than 6 degrees, bearings at one range are chance */
#define ARC_GAP_M      0.5
#define ARC_MOST_M     100

/* The nearest obstacle of each direction in the ring at the horizon. */
static uint32_t profile(struct picture *picture, double axes_rad, uint64_t now_ns, double *range_m,
                        struct tangent_point *point)
{
    const struct rings *rings = picture->rings;
    const uint32_t ring = rings_ring(rings, rings_index(rings, 0, 0));
    const uint32_t start = rings->start[ring], n = rings->start[ring + 1] - start;
    for (uint32_t i = 0; i < n; i++) {
        struct picture_entry e;
        double az, el;
        picture_get(picture, start + i, &e);
        rings_centre(rings, start + i, &az, &el);
        az += axes_rad;
        range_m[i] = NAN;
        for (int k = PICTURE_OBSTACLES - 1; k >= 0; k--)
            if (picture_logodds(picture, &e.obstacle[k], now_ns) > (double)picture->blocked_logodds)
                range_m[i] = (double)e.obstacle[k].range_m;
        point[i] = (struct tangent_point){range_m[i] * cos(az), range_m[i] * sin(az)};
    }
    return n;
}

static double window_at(double range_m)
{
    return CONSTANT_M + CONSTANT_SHARE * range_m;
}

/* The window grows with range: on this scale it is 1 everywhere. */
static double in_windows(double range_m)
{
    return log(window_at(range_m)) / CONSTANT_SHARE;
}

/* The wall about whose normal the bearings lie, at its distance. */
static uint32_t wall_of(const struct shapes *s, const struct shapes_region *r)
{
    for (uint32_t w = 0; w < s->n; w++) {
        const double window_m = window_at(s->wall[w].distance_m);
        if (fabs(geo_wrap_pi(r->from_rad + r->width_rad / 2 - s->wall[w].normal_rad)) < ABOUT_NORMAL &&
            r->least_m < s->wall[w].distance_m + window_m && r->most_m > s->wall[w].distance_m - window_m)
            return w;
    }
    return TANGENTS_NONE;
}

static struct shapes_region region_of(const struct depth_region *found, const double *range_m, uint32_t n,
                                      double axes_rad)
{
    struct shapes_region r = {.from_rad = geo_wrap(found->first * GEO_TURN / n + axes_rad),
                              .width_rad = found->n * GEO_TURN / n,
                              .least_m = INFINITY,
                              .bearings = found->n};
    for (uint32_t k = 0; k < found->n; k++) {
        r.least_m = fmin(r.least_m, range_m[(found->first + k) % n]);
        r.most_m = fmax(r.most_m, range_m[(found->first + k) % n]);
    }
    return r;
}

static void find_regions(struct shapes *s, const double *range_m, uint32_t n, double axes_rad)
{
    struct depth_region found[SHAPES_REGIONS];
    double scaled[DEPTH_REGIONS_MAX];
    const uint32_t least = (uint32_t)fmax(3, ceil(REGION_RAD * n / GEO_TURN));
    for (uint32_t i = 0; i < n; i++)
        scaled[i] = in_windows(range_m[i]);
    const uint32_t all = depth_regions(scaled, n, 1, least, found, SHAPES_REGIONS);
    s->regions = all < SHAPES_REGIONS ? all : SHAPES_REGIONS;
    for (uint32_t k = 0; k < s->regions; k++) {
        s->region[k] = region_of(&found[k], range_m, n, axes_rad);
        s->region[k].wall = wall_of(s, &s->region[k]);
        if (s->region[k].wall != TANGENTS_NONE)
            s->constant_depth[s->region[k].wall] = true;
    }
}

static void find_arcs(struct shapes *s, const struct tangent_point *point, uint32_t n, const uint32_t *of)
{
    const struct arcs_conf conf = {.reach_m = ARC_GAP_M, .least_n = 6, .round_m = 0.06, .radius_m = ARC_MOST_M};
    const uint32_t all = arcs_find(&conf, point, n, of, s->arc, SHAPES_ARCS);
    s->arcs = all < SHAPES_ARCS ? all : SHAPES_ARCS;
}

void shapes_look(struct shapes *s, struct picture *picture, uint64_t now_ns)
{
    double range_m[DEPTH_REGIONS_MAX];
    struct tangent_point point[TANGENTS_MAX];
    uint32_t of[TANGENTS_MAX];
    struct picture_frame frame;
    picture_get_frame(picture, &frame);
    const uint32_t n = profile(picture, frame.axes_rad, now_ns, range_m, point);
    const uint32_t around = (uint32_t)fmax(3, 2 * floor(SPAN_RAD * n / GEO_TURN / 2) + 1);
    const struct tangents_conf conf = {.neighbours = around,
                                       .angle_rad = geo_rad(8),
                                       .offset_m = 0.08,
                                       .offset_share = 0.01,
                                       .reach_m = 1,
                                       .reach_share = 0.5,
                                       .least_n = around > 6 ? around : 6,
                                       .straight_m = 0.1};
    const uint32_t found = tangents_walls(&conf, point, n, s->wall, SHAPES_WALLS, of);
    s->n = found < SHAPES_WALLS ? found : SHAPES_WALLS;
    s->corners = 0;
    for (uint32_t a = 0; a < s->n; a++) {
        s->constant_depth[a] = false;
        for (uint32_t b = 0; b < a && s->corners < SHAPES_WALLS; b++) {
            struct shapes_corner *c = &s->corner[s->corners];
            *c = (struct shapes_corner){.a = b, .b = a};
            s->corners += tangents_corner(&s->wall[b], &s->wall[a], CORNER_GAP_M, CORNER_GAP_RAD, &c->place);
        }
    }
    find_arcs(s, point, n, of);
    find_regions(s, range_m, n, frame.axes_rad);
}

uint32_t shapes_ghost_of(const struct shapes *s, const struct cluster *cluster)
{
    double az, el;
    geo_angles(cluster->nearest_m, &az, &el);
    const double range_m = hypot(cluster->nearest_m[0], cluster->nearest_m[1]);
    return tangents_ghost(s->wall, s->n, az, range_m, GHOST_OFF, GHOST_M);
}
