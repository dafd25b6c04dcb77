/* SPDX-License-Identifier: MIT */
#include "course.h"

#include <math.h>
#include <string.h>

#include "motion.h"
#include "sensor.h"

#define OFF_LEAST_DEG   10.0 /* a heading that swings by less turns nothing */
#define OFF_LEAST_STEPS 2.0  /* each turn makes all free intervals anew: not for less */
#define BEGINS_MPS      0.2  /* slower, the reported velocity is mostly noise */
#define ENDS_MPS        0.1
#define EDGE            1e-9 /* of a cell: edges that meet but for rounding do meet */
#define LEVEL_LEAST     0.5  /* cosine of the bow's elevation */

/* False: it points nowhere in particular. */
static bool course_of(struct sphere *s, const struct pose *pose, double *az_rad)
{
    const double *v = pose->velocity_mps, speed = hypot(v[0], v[1]);
    double bow[3] = {1, 0, 0};
    s->under_way = (pose->has & POSE_VELOCITY) && speed >= (s->under_way ? ENDS_MPS : BEGINS_MPS);
    quat_rotate(pose->attitude, bow, bow);
    *az_rad = s->under_way ? atan2(v[1], v[0]) : atan2(bow[1], bow[0]);
    return s->under_way || hypot(bow[0], bow[1]) >= LEVEL_LEAST;
}

/* Where something stands first in every direction. */
static void find_cells(struct sphere *s)
{
    double v[3];
    for (uint32_t d = 0; d < s->rings.n; d++) {
        s->stands_m[d] = INFINITY;
        for (uint32_t i = s->cells.first[d]; i != CELLS_NONE; i = s->cells.cell[i].next)
            s->stands_m[d] =
                fminf(s->stands_m[d], (float)state_vector(s, &s->cells.cell[i], v) - s->cells.cell[i].near_m);
    }
}

/*
 * An obstacle filled its direction before the turn, and has a cell in but one of the new directions that touch that
 * one: in the others, too, free water ends where it stands.
 * Each new direction touches two old ones of its ring, or is one of them.
 */
static void cut_ring(struct sphere *s, uint32_t ring, double turn_rad)
{
    const uint32_t start = s->rings.start[ring], n = s->rings.start[ring + 1] - start;
    const double cells = geo_wrap(turn_rad) / rings_width(&s->rings, ring), whole = floor(cells + EDGE);
    const uint32_t first = (uint32_t)whole, more = cells - whole > EDGE;
    for (uint32_t i = 0; i < n; i++) {
        const float to_m =
            fminf(s->stands_m[start + (i + first) % n], s->stands_m[start + (i + first + more) % n]);
        for (int k = 0; k < FREE_INTERVALS; k++) {
            struct free_interval *f = &s->direction[start + i].free[k];
            f->to_m = fminf(f->to_m, to_m);
        }
    }
}

static void set_axes(struct sphere *s, double az_rad)
{
    s->frame.axes_rad = az_rad;
    s->axes_cos = cos(az_rad);
    s->axes_sin = sin(az_rad);
    memset(s->last, 0, sizeof s->last); /* these are in the axes that were */
    for (uint32_t d = 0; d < s->rings.n; d++) {
        const double *u = s->picture.axis[d];
        s->axis[d][0] = s->axes_cos * u[0] - s->axes_sin * u[1];
        s->axis[d][1] = s->axes_sin * u[0] + s->axes_cos * u[1];
        s->axis[d][2] = u[2];
    }
}

void course_end(struct sphere *s)
{
    s->under_way = false;
    set_axes(s, 0);
}

void course_follow(struct sphere *s, const struct pose *pose, uint64_t t_ns)
{
    const double least_rad = fmax(geo_rad(OFF_LEAST_DEG), OFF_LEAST_STEPS * s->rings.step_rad);
    double az_rad;
    if (!course_of(s, pose, &az_rad))
        return;
    const double turn_rad = geo_wrap_pi(az_rad - s->frame.axes_rad);
    if (fabs(turn_rad) <= fmin(least_rad, GEO_PI / 2))
        return;
    find_cells(s);
    set_axes(s, geo_wrap(az_rad));
    motion_reindex(s);
    for (uint32_t d = 0; d < s->rings.n; d++)
        state_mark(s, d);
    sensor_free_again(s, t_ns, pose->path_m);
    for (uint32_t ring = 0; ring < s->rings.n_rings; ring++)
        cut_ring(s, ring, turn_rad);
    s->stats.turned++;
}
