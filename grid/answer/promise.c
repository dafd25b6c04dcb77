/* SPDX-License-Identifier: MIT */
#include "promise.h"

#include <math.h>

/* The sensors that are offline, and those that have been silent for so long that nothing they cleared is clear. */
static uint64_t silent(const struct bearings_looks *looks, const struct answer_conf *conf,
                       const struct answer_now *now)
{
    uint64_t sensors = now->lost;
    for (int k = 0; k < BEARINGS_SENSORS; k++)
        if (sight_seconds(now->now_ns, looks->last_ns[k]) > conf->clear_for_s)
            sensors |= UINT64_C(1) << k;
    return sensors;
}

struct promise promise_begin(struct picture *picture, const struct answer_conf *conf,
                             const struct picture_frame *frame, const struct answer_now *now, double loose_m)
{
    const struct bearings_looks *looks = &frame->looks;
    const uint64_t online = ~silent(looks, conf, now);
    return (struct promise){.picture = picture,
                            .frame = frame,
                            .now = now,
                            .loose_m = loose_m,
                            .shown = bearings_of(looks, online, now->now_ns, conf->clear_for_s)};
}

/*
 * So much of a beam, in directions, frees none, for none lies wholly in it there. It is the operator's to promise; all
 * the rest of a beam that does not turn frees its directions with each ping, so that there the beam is taken at its
 * word.
 */
#define EDGE_CELLS 1.5

/* Is it a level direction in which a sonar looks, whatever the body's tilt? What is there the sonar will show. */
static bool is_looked_at(const struct promise *p, uint32_t direction, double slack, double *az_rad)
{
    const struct bearings_looks *looks = &p->frame->looks;
    const double *v = p->picture->axis[direction], step_rad = p->picture->rings->step_rad;
    double u[3] = {v[0], v[1], v[2]};
    if (fabs(v[2]) > slack)
        return false;
    sight_from_grid(p->frame, p->now, false, u);
    *az_rad = atan2(u[1], u[0]);
    return fabs(u[2]) <= sin(looks->level_rad - step_rad) &&
           (bearings_have(looks->bearings, *az_rad, 0) || bearings_still(looks, *az_rad, EDGE_CELLS * step_rad));
}

/* Do the looks leave out no more than lies between two of a sonar's beams? What stands there no beam shows. */
static bool is_between_looks(const struct promise *p, uint32_t direction)
{
    const struct rings *rings = p->picture->rings;
    const uint32_t ring = rings_ring(rings, direction), first = rings->start[ring];
    const uint32_t n = rings->start[ring + 1] - first, at = direction - first;
    const uint32_t most = (uint32_t)fmin(ceil(p->frame->looks.gap_rad / rings_width(rings, ring)), n / 2);
    for (uint32_t k = 1; k <= most; k++)
        if (!picture_blank(p->picture, first + (at + k) % n) ||
            !picture_blank(p->picture, first + (at + n - k) % n))
            return true;
    return false;
}

/*
 * Is the water free, at this moment, where near_m ends? Of a vehicle that drifts it must be: what a beam showed farther
 * out may by now have come nearer than near_m, and nothing tells where it is.
 */
static bool goes_on(const struct promise *p, const struct sight *s, double near_m)
{
    return s->reason == ANSWER_HEARD && s->blind_m - p->loose_m <= near_m && s->clear_m > near_m;
}

/*
 * What is left of near_m where it does not: what stood beyond it when a beam showed water there last has come nearer by
 * the drift since, at the most. Nothing of it where the last look showed none, as of a sonar that is drowned in noise;
 * nor if the vehicle may have turned since: what a beam showed at another bearing may be at this one now.
 */
static double adrift_m(const struct promise *p, const struct sight *s, double near_m)
{
    const struct pose *pose = &p->now->pose;
    return s->showed && !pose->heading_adrift ? fmax(0, near_m - answer_drifted_m(p->now, s->age_s)) : 0;
}

/*
 * Until every head has been everywhere twice, water that ends before near_m may be the gap of a lost ping; from then on
 * a direction has what an earlier turn showed of it.
 */
double promise_m(const struct promise *p, uint32_t direction, double slack, const struct sight *s, double near_m)
{
    const bool blank = !s;
    s = blank ? &sight_never : s;
    const double sure_m = s->reason == ANSWER_HEARD ? fmin(s->clear_m, near_m) : 0;
    const bool drifts = p->now->pose.drift_mps > 0;
    double az_rad;
    if ((drifts ? goes_on(p, s, near_m) : sure_m >= near_m) || !is_looked_at(p, direction, slack, &az_rad))
        return near_m;
    const double left_m = drifts ? adrift_m(p, s, near_m) : near_m;
    /* By no head: what nobody has shown nobody promises. Of a beam that does not turn, drift takes the water at its
     * edge away, near the vehicle first, though what stood beyond near_m then has come no nearer than left_m. */
    const double edge_rad = EDGE_CELLS * p->picture->rings->step_rad;
    const bool still = drifts && s->reason == ANSWER_HEARD && bearings_still(&p->frame->looks, az_rad, edge_rad);
    if (!bearings_have(p->shown, az_rad, 0) && !still)
        return fmin(sure_m, left_m);
    if (drifts)
        return left_m;
    return (blank || p->frame->looks.first_turns) && !is_between_looks(p, direction) ? sure_m : near_m;
}
