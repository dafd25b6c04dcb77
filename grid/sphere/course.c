/* SPDX-License-Identifier: MIT */
#include "course.h"

#include <math.h>
#include <string.h>

#include "motion.h"

#define OFF_LEAST_DEG   10.0 /* a heading that swings by less turns nothing */
#define OFF_LEAST_STEPS 2.0  /* each turn sorts all cells anew: not for less */
#define BEGINS_MPS      0.2  /* slower, the reported velocity is mostly noise */
#define ENDS_MPS        0.1
#define LEVEL_LEAST     0.5 /* cosine of the bow's elevation */

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

static void turn_looks(struct sphere *s, double turn_rad)
{
    for (uint32_t d = 0; d < s->rings.n; d++)
        s->turned[rings_turned(&s->rings, d, turn_rad)] = s->direction[d];
    memcpy(s->direction, s->turned, s->rings.n * sizeof *s->direction);
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

void course_end(struct sphere *s)
{
    s->under_way = false;
    set_axes(s, 0);
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
    for (uint32_t d = 0; d < s->rings.n; d++)
        state_mark(s, d);
    turn_looks(s, turn_rad);
    set_axes(s, geo_wrap(az_rad));
    motion_reindex(s);
    s->stats.turned++;
}
