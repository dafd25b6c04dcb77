/* SPDX-License-Identifier: MIT */
#include "came_back.h"

#include <math.h>
#include <stddef.h>

#define HEAD_PARTS  6
#define HEAD_PASSES 8
#define FAN_PARTS   6 /* in one ping: who swims along the fan comes back part by part */
#define FAN_PASSES  400
#define BACK_NS     300000000000u /* of what the sensor passes no more */

/* An echo so many times (6 dB) what the weakest wall exceeds in 99 looks of 100 is not missed by two looks. */
#define STRONG 4.0f
#define LOOKS  2
#define SAME_M 0.3f

/* A bearing and those beside it are looked at within that time, and a turn takes longer. */
#define BESIDE_NS 2000000000u

/* Where bearings are as exact, a part of which half is missed is no matter of where its edges are. */
#define EXACT_RAD (1 * GEO_PI / 180)

/* How a sensor's beams lie in bearings and parts. */
struct view {
    bool fan;
    double per_rad; /* bearings */
};

static struct view view_of(const struct echoes *e)
{
    if (e->n_beams == 1)
        return (struct view){false, CAME_BACK_BEARINGS / GEO_TURN};
    const double fan_rad = fabs(geo_wrap_pi((double)e->beam[1].az_rad - (double)e->beam[0].az_rad));
    return (struct view){true, fan_rad > 0 ? 1 / fan_rad : 0};
}

/* Bearings of a head lie in the middle of rows, or rounding would move them. */
static uint32_t bearing_of(const struct view *v, const struct echoes *e, uint32_t beam)
{
    if (v->fan)
        return beam % CAME_BACK_BEARINGS;
    return (uint32_t)lround(geo_wrap((double)e->beam[0].az_rad) * v->per_rad) % CAME_BACK_BEARINGS;
}

static uint32_t part_of(const struct view *v, const struct echoes *e, uint32_t beam)
{
    if (v->fan)
        return beam * CAME_BACK_FAN / e->n_beams;
    return (uint32_t)(geo_wrap((double)e->beam[0].az_rad) / GEO_TURN * CAME_BACK_PARTS) % CAME_BACK_PARTS;
}

/* The beam's first echo, if nothing speaks against it but beams beside it that do not show it: these may be deaf. */
static const struct echo *strong_echo(const struct beam_echoes *beam)
{
    const struct echo *echo = &beam->echo[0];
    return beam->n > 0 && echo->level >= STRONG &&
                   !(echo->flags & (ECHO_FAINT | ECHO_OTHER | ECHO_OWN | ECHO_GHOST))
               ? echo
               : NULL;
}

/* The look says whether the receiver hears: a strong echo was there, and would be detected. */
static bool is_due(const struct came_back_part *part, const struct came_back_bearing *at,
                   const struct beam_echoes *beam)
{
    if (at->strong_ns == 0 || at->strong_ns < part->since_ns)
        return false;
    return beam->n > 0 ||
           (beam->state == BEAM_SILENT && at->range_m > beam->heard_from_m && at->range_m < beam->heard_to_m);
}

/* All other bearings so near had a strong echo as well, as far as they were looked at. */
static bool is_sure(const struct came_back *c, uint32_t bearing, double near)
{
    const uint32_t n = (uint32_t)fmin(near + 0.5, CAME_BACK_BEARINGS / 2);
    for (uint32_t k = CAME_BACK_BEARINGS - n; k <= CAME_BACK_BEARINGS + n; k++) {
        const struct came_back_bearing *at = &c->bearing[(bearing + k) % CAME_BACK_BEARINGS];
        if (at->looked_ns >= c->standing.since_ns && at->strong_ns < c->standing.since_ns)
            return false;
    }
    return true;
}

static void add(struct came_back_looks *looks, bool missed)
{
    looks->n++;
    looks->missed += missed;
}

/* A bearing differs by what the vehicle has turned and moved, to one side and then to the other. */
static double astray_of(const struct came_back *c, double range_m)
{
    return 2 * (c->standing.turned_rad + atan2(c->standing.moved_m, range_m));
}

/* What should be at the one is at the other, as far as bearings are known, and both were looked at in one go. */
static bool is_beside(const struct came_back_place *missed, const struct came_back_place *found,
                      const struct view *v)
{
    const uint32_t apart =
        missed->bearing > found->bearing ? missed->bearing - found->bearing : found->bearing - missed->bearing;
    const uint64_t older_ns = missed->t_ns < found->t_ns ? missed->t_ns : found->t_ns,
                   newer_ns = missed->t_ns < found->t_ns ? found->t_ns : missed->t_ns;

    return older_ns > 0 && newer_ns - older_ns <= BESIDE_NS && missed->astray_rad >= EXACT_RAD &&
           fmin(apart, CAME_BACK_BEARINGS - apart) <= missed->astray_rad * v->per_rad;
}

static void count_look(struct came_back *c, const struct view *v, uint32_t bearing, bool missed, uint64_t t_ns)
{
    struct came_back_pass *pass = &c->pass;
    const double astray_rad = astray_of(c, (double)c->bearing[bearing].range_m);
    const struct came_back_place here = {t_ns, bearing, pass->part, astray_rad};
    const bool sure = is_sure(c, bearing, astray_rad * v->per_rad);
    pass->astray_rad = fmax(pass->astray_rad, astray_rad);
    if (missed && !sure)
        c->missed = here;
    if (!missed || sure || !is_beside(&here, &c->found, v))
        add(&pass->all, missed);
    if (sure)
        add(&pass->sure, missed);
}

/* A strong echo: it may be what was missed beside it just now, also at the end of the part before. */
static void find(struct came_back *c, const struct view *v, uint32_t bearing, uint64_t t_ns)
{
    struct came_back_part *before = &c->part[c->missed.part];
    c->found = (struct came_back_place){.t_ns = t_ns, .bearing = bearing};
    if (!is_beside(&c->missed, &c->found, v))
        return;
    if (c->missed.part == c->pass.part && c->pass.sure.missed == 0)
        c->pass.all = (struct came_back_looks){0};
    else if (c->missed.part != c->pass.part && before->gone_ns > c->missed.t_ns)
        before->gone_ns = 0;
}

static bool is_gone(const struct came_back_pass *pass)
{
    const struct came_back_looks *all = &pass->all, *sure = &pass->sure;
    return (all->n >= LOOKS && all->missed == all->n) ||
           (pass->astray_rad < EXACT_RAD && sure->missed >= LOOKS && 2 * sure->missed >= sure->n);
}

/* The pass is over, and the next is one through that part. */
static void turn_to(struct came_back *c, uint32_t next, uint64_t t_ns)
{
    struct came_back_part *part = &c->part[c->pass.part];
    part->back -= part->back > 0;
    if (c->pass.sure.n > 0)
        part->heard = 4 * c->pass.sure.missed > c->pass.sure.n ? CAME_BACK_MISSED : CAME_BACK_HEARD;
    if (is_gone(&c->pass))
        part->gone_ns = t_ns;
    c->pass = (struct came_back_pass){.part = next};
}

static bool is_same(float a_m, float b_m)
{
    return fabsf(a_m - b_m) <= SAME_M;
}

/* What two looks in a row show is there. One alone may be a false echo of a receiver that is deaf: what was there
 * before stays in mind. */
static void keep(struct came_back_bearing *at, float range_m, uint64_t since_ns)
{
    if (at->strong_ns == 0 || at->strong_ns < since_ns || is_same(range_m, at->last_m))
        at->range_m = range_m;
    at->last_m = range_m;
}

static void show(struct came_back *c, const struct echoes *e, const struct view *v, uint32_t beam)
{
    const uint32_t bearing = bearing_of(v, e, beam);
    struct came_back_bearing *at = &c->bearing[bearing];
    struct came_back_part *part = &c->part[c->pass.part];
    const struct echo *echo = strong_echo(&e->beam[beam]);
    const bool due = is_due(part, at, &e->beam[beam]);
    if (due)
        count_look(c, v, bearing, e->beam[beam].n == 0, e->t_ns);
    at->looked_ns = e->t_ns;
    if (!echo) {
        at->last_m = 0;
        return;
    }
    find(c, v, bearing, e->t_ns);
    if (due && part->gone_ns > part->since_ns && is_same(echo->range_m, at->range_m)) {
        part->gone_ns = 0;
        part->again = true;
        part->heard = CAME_BACK_UNKNOWN;
    }
    part->pose = e->pose;
    keep(at, echo->range_m, part->since_ns);
    at->strong_ns = e->t_ns;
}

static void look(struct came_back *c, const struct echoes *e, const struct view *v, uint32_t beam)
{
    const uint32_t at = part_of(v, e, beam);
    struct came_back_part *part = &c->part[at];
    if (at != c->pass.part)
        turn_to(c, at, e->t_ns);
    if (part->since_ns == 0 || !standing_at(&part->pose, &e->pose)) {
        part->since_ns = e->t_ns;
        part->pose = e->pose;
    }
    show(c, e, v, beam);
}

/* What has come back in this ping counts; of a fan, if it came back in so many parts at once. */
static void count_back(struct came_back *c, const struct view *v, uint64_t t_ns)
{
    uint32_t together = 0;
    for (int k = 0; k < CAME_BACK_PARTS; k++)
        together += c->part[k].again;
    for (int k = 0; k < CAME_BACK_PARTS; k++) {
        struct came_back_part *part = &c->part[k];
        if (part->again && together >= (v->fan ? FAN_PARTS : 1)) {
            part->back_ns = t_ns;
            part->back = v->fan ? FAN_PASSES : HEAD_PASSES;
        }
        part->again = false;
    }
}

static bool is_doubt(const struct came_back *c, uint64_t now_ns, uint32_t parts)
{
    uint32_t back = 0, heard = 0;
    bool missed = false;
    for (int k = 0; k < CAME_BACK_PARTS; k++) {
        const struct came_back_part *part = &c->part[k];
        if (part->back == 0 || now_ns > part->back_ns + BACK_NS)
            continue;
        back++;
        heard += part->heard == CAME_BACK_HEARD;
        missed |= part->heard == CAME_BACK_MISSED;
    }
    return back >= parts && (missed || 2 * heard < back);
}

bool came_back_run(struct came_back *c, const struct echoes *e)
{
    if (e->n_beams == 0 || (e->n_beams == 1 && !e->turns))
        return false;
    const struct view v = view_of(e);
    standing_follow(&c->standing, e->t_ns, &e->pose);
    for (uint32_t i = 0; i < e->n_beams; i++)
        look(c, e, &v, i);
    count_back(c, &v, e->t_ns);
    if (v.fan)
        turn_to(c, 0, e->t_ns);
    return is_doubt(c, e->t_ns, v.fan ? FAN_PARTS : HEAD_PARTS);
}
