/* SPDX-License-Identifier: MIT */
#include "course.h"

#include <math.h>

#include "motion.h"

#define OFF_LEAST_DEG   10.0 /* a heading that swings by less turns nothing */
#define OFF_LEAST_STEPS 2.0  /* each turn costs claims a step at their ends: not for less */
#define BEGINS_MPS      0.2  /* slower, what is told of the velocity is mostly noise */
#define ENDS_MPS        0.1
#define LEVEL_LEAST     0.5  /* cosine of the bow's elevation */
#define EDGE            1e-9 /* of a cell: edges that meet but for rounding do meet */

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

/* A direction's claim ends where something stands, which may have no cell in the new directions that touch this one. */
static struct claim cut_at_cells(const struct sphere *s, uint32_t d, struct claim c)
{
    double v[3];
    for (uint32_t i = s->cells.first[d]; i != CELLS_NONE; i = s->cells.cell[i].next)
        c.to_m = fminf(c.to_m, (float)state_vector(s, &s->cells.cell[i], v) - s->cells.cell[i].near_m);
    return c;
}

/* One kind of claims of a ring: each new direction touches two old ones, or is one of them. */
static void turn_ring(struct sphere *s, uint32_t ring, double turn_rad, int kind)
{
    const uint32_t start = s->rings.start[ring], n = s->rings.start[ring + 1] - start;
    const double cells = geo_wrap(turn_rad) / rings_width(&s->rings, ring), whole = floor(cells + EDGE);
    const uint32_t first = (uint32_t)whole, more = cells - whole > EDGE;
    for (uint32_t i = 0; i < n; i++) {
        const struct claim *a = &s->joined[start + (i + first) % n];
        const struct claim *b = &s->joined[start + (i + first + more) % n];
        s->direction[start + i].claim[kind] = claim_meet(a, b);
    }
}

static void turn_claims(struct sphere *s, double turn_rad)
{
    for (int kind = 0; kind < CLAIMS; kind++) {
        for (uint32_t d = 0; d < s->rings.n; d++)
            s->joined[d] = cut_at_cells(s, d, s->direction[d].claim[kind]);
        for (uint32_t ring = 0; ring < s->rings.n_rings; ring++)
            turn_ring(s, ring, turn_rad, kind);
    }
    s->stats.pinged = 0;
    for (uint32_t d = 0; d < s->rings.n; d++) {
        s->stats.pinged += s->direction[d].claim[CLAIM_NOW].t_ping_ns != 0;
        state_mark(s, d);
    }
}

static void set_axes(struct sphere *s, double az_rad)
{
    s->frame.axes_rad = az_rad;
    s->axes_cos = cos(az_rad);
    s->axes_sin = sin(az_rad);
    for (uint32_t d = 0; d < s->rings.n; d++) {
        const double *u = s->picture.axis[d];
        s->axis[d][0] = s->axes_cos * u[0] - s->axes_sin * u[1];
        s->axis[d][1] = s->axes_sin * u[0] + s->axes_cos * u[1];
        s->axis[d][2] = u[2];
    }
}

void course_follow(struct sphere *s, const struct pose *pose)
{
    const double least_rad = fmax(geo_rad(OFF_LEAST_DEG), OFF_LEAST_STEPS * s->rings.step_rad);
    double az_rad;
    if (!course_of(s, pose, &az_rad))
        return;
    const double turn_rad = geo_wrap_pi(az_rad - s->frame.axes_rad);
    if (fabs(turn_rad) <= fmin(least_rad, GEO_PI / 2))
        return;
    turn_claims(s, turn_rad);
    set_axes(s, geo_wrap(az_rad));
    motion_hang_anew(s);
    s->stats.turned++;
}
