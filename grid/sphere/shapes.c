/* SPDX-License-Identifier: MIT */
#include "shapes.h"

#include <math.h>

#include "../geometry.h"

/* Echoes of one wall scatter by centimetres, more in range than the layers of the grid add. */
#define CONSTANT_M     0.06
#define CONSTANT_SHARE 0.02 /* of the range, beside it */
#define ABOUT_NORMAL   0.26 /* a mirror's region is centred on its normal to 15 degrees */
#define GHOST_OFF      0.21 /* ghosts are heard within 12 degrees of the normal */
#define GHOST_M        0.16
#define CORNER_GAP_M   0.5
#define SPAN_RAD       0.22 /* that a point's neighbours cover: 12 degrees */

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

static bool constant_about(const struct wall *w, double axes_rad, const double *range_m, uint32_t n)
{
    struct depth_region region[DEPTH_REGIONS_MAX / 4];
    const double window_m = CONSTANT_M + CONSTANT_SHARE * w->distance_m;
    const uint32_t room = DEPTH_REGIONS_MAX / 4;
    const uint32_t found = depth_regions(range_m, n, window_m, 3, region, room);
    for (uint32_t k = 0; k < found && k < room; k++) {
        const double middle = (region[k].first + region[k].n / 2.0) * GEO_TURN / n + axes_rad;
        if (fabs(geo_wrap_pi(middle - w->normal_rad)) < ABOUT_NORMAL &&
            region[k].least_m < w->distance_m + window_m && region[k].most_m > w->distance_m - window_m)
            return true;
    }
    return false;
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
                                       .reach_m = 1,
                                       .least_n = around > 6 ? around : 6,
                                       .straight_m = 0.1};
    const uint32_t found = tangents_walls(&conf, point, n, s->wall, SHAPES_WALLS, of);
    s->n = found < SHAPES_WALLS ? found : SHAPES_WALLS;
    s->corners = 0;
    for (uint32_t a = 0; a < s->n; a++) {
        s->constant_depth[a] = constant_about(&s->wall[a], frame.axes_rad, range_m, n);
        for (uint32_t b = 0; b < a && s->corners < SHAPES_WALLS; b++) {
            struct shapes_corner *c = &s->corner[s->corners];
            *c = (struct shapes_corner){.a = b, .b = a};
            s->corners += tangents_corner(&s->wall[b], &s->wall[a], CORNER_GAP_M, &c->place);
        }
    }
}

uint32_t shapes_ghost_of(const struct shapes *s, const struct cluster *cluster)
{
    double az, el;
    geo_angles(cluster->nearest_m, &az, &el);
    const double range_m = hypot(cluster->nearest_m[0], cluster->nearest_m[1]);
    return tangents_ghost(s->wall, s->n, az, range_m, GHOST_OFF, GHOST_M);
}
