/* SPDX-License-Identifier: MIT */
#include "promise.h"

#include <math.h>
#include <string.h>

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

/*
 * So much of a beam, in directions, frees none, for none lies wholly in it there. It is the operator's to promise; all
 * the rest of a beam that does not turn frees its directions with each ping, so that there the beam is taken at its
 * word.
 */
#define EDGE_CELLS 1.5

/* How far the direction lies in what sonars cover that do not turn, beyond its edge. */
static double still_rad(struct promise *p, const double v[3], double near_m)
{
    if (!p->rowed || p->row_down != v[2])
        bearings_row(&p->frame->looks, &p->view, asin(fmax(-1, fmin(1, -v[2]))), near_m, p->still);
    p->rowed = true;
    p->row_down = v[2];
    return bearings_inside(p->still, atan2(v[1], v[0]), EDGE_CELLS * p->picture->rings->step_rad);
}

/* How a sonar looks in a direction. What is there it will show. */
struct looked {
    double az_rad;    /* the direction's azimuth in the body */
    double still_rad; /* how far it lies in the beam of one that does not turn, beyond its edge; 0: it does not */
    bool by_head;
};

static struct looked look_of(struct promise *p, const double v[3], double near_m)
{
    const struct bearings_looks *looks = &p->frame->looks;
    double u[3] = {v[0], v[1], v[2]};
    sight_from_grid(p->frame, p->now, false, u);
    const double az_rad = atan2(u[1], u[0]), off_rad = asin(fmin(fabs(u[2]), 1)) + p->picture->rings->step_rad;
    return (struct looked){.az_rad = az_rad,
                           .still_rad = still_rad(p, v, near_m),
                           .by_head = bearings_have(bearings_level(looks, off_rad), az_rad, 0)};
}

#define PART_RAD (GEO_TURN / PROMISE_PARTS)
#define EDGE_SD  3.0

/* Where the part's rays meet a disk around what was shown range_m away and apart_rad beside them; INFINITY: nowhere. */
static double disk_m(double range_m, double radius_m, double apart_rad)
{
    const double aside_m = range_m * sin(fmin(apart_rad, GEO_PI / 2));
    if (radius_m >= range_m)
        return 0;
    if (apart_rad >= GEO_PI / 2 || aside_m > radius_m)
        return INFINITY;
    return range_m * cos(apart_rad) - sqrt(radius_m * radius_m - aside_m * aside_m);
}

/* It may have come from there by now, in any direction. */
static void spread_shown(struct promise *p, double az_rad, double range_m, double radius_m)
{
    for (int i = 0; i < PROMISE_PARTS; i++) {
        const double off_rad = fabs(geo_wrap_pi((i + 0.5) * PART_RAD - az_rad));
        const double apart_rad = fmax(0, off_rad - PART_RAD / 2 - p->picture->rings->step_rad / 2);
        p->come_m[i] = fmin(p->come_m[i], disk_m(range_m, radius_m, apart_rad));
    }
}

#define LOOKED_TURNS 2.2 /* in so many turns a head that goes to and fro has been everywhere again */

/*
 * A mount off the middle looks elsewhere near by than far away: to the one side farther, to the other less. What was
 * shown counts where its direction is looked at far off, or at 6, 3 or 2 m: rather too much of it than too little.
 */
static const double shown_at_m[] = {100, 6};

/* How long ago the heads last heard at that bearing of theirs which they have left out the longest: one that only
 * sweeps about the vehicle's way has its turns, and looks at nothing else. */
static double left_out_s(const struct promise *p)
{
    const struct bearings_looks *looks = &p->frame->looks;
    const uint64_t bearings = bearings_level(looks, 0);
    uint16_t most_ds = 0;
    for (int i = 0; i < BEARINGS; i++) {
        uint16_t ds = BEARINGS_NEVER;
        for (int k = 0; k < BEARINGS_SENSORS; k++)
            if (looks->heard_ds[k][i] < ds)
                ds = looks->heard_ds[k][i];
        if ((bearings >> i & 1) && ds > most_ds)
            most_ds = ds;
    }
    return most_ds < BEARINGS_NEVER ? 0.1 * most_ds + sight_seconds(p->now->now_ns, looks->t_ns) : INFINITY;
}

/* For so long nobody may have looked where an echo came from, nor where that has gone since. */
static double unlooked_s(const struct promise *p)
{
    if (p->frame->looks.first_turns && p->frame->turn_s <= 0)
        return INFINITY;
    return fmax(fmax(LOOKED_TURNS * p->frame->turn_s, PROMISE_LOOKED_S), left_out_s(p));
}

static void add_shown(struct promise *p, uint32_t direction, double last_s)
{
    const double *v = p->picture->axis[direction];
    struct picture_entry e;
    picture_get(p->picture, direction, &e);
    for (int i = 0; i < PICTURE_OBSTACLES && e.obstacle[i].logodds > 0; i++) {
        const struct picture_obstacle *o = &e.obstacle[i];
        const double age_s = sight_seconds(p->now->now_ns, o->t_echo_ns);
        if (age_s <= last_s && picture_logodds(p->picture, o, p->now->now_ns) > p->picture->blocked_logodds)
            spread_shown(p, atan2(v[1], v[0]), fmax(0, (double)o->range_m - EDGE_SD * (double)o->sd_m),
                         answer_drifted_m(p->now, age_s) + p->loose_m);
    }
}

/*
 * An obstacle's own direction tells how much nearer it may have come, not that a vehicle that drifts past it has it
 * ahead. It is shown anew wherever it is when the sonars look there again; what has gone where none looks is the
 * operator's to promise, as all that comes from there.
 */
static void find_shown_at(struct promise *p, double range_m)
{
    const double level = sin(p->picture->rings->height_rad);
    const double last_s = unlooked_s(p);
    p->rowed = false;
    for (uint32_t k = 0; k < p->picture->n; k += 64)
        for (uint64_t left = picture_holding(p->picture, k / 64); left; left &= left - 1) {
            const uint32_t direction = k + (uint32_t)__builtin_ctzll(left);
            if (direction >= p->picture->n || fabs(p->picture->axis[direction][2]) > level)
                continue;
            const struct looked looked = look_of(p, p->picture->axis[direction], range_m);
            if (looked.by_head || looked.still_rad > 0)
                add_shown(p, direction, last_s);
        }
}

static void find_shown(struct promise *p)
{
    for (size_t i = 0; i < sizeof shown_at_m / sizeof shown_at_m[0]; i++)
        find_shown_at(p, shown_at_m[i]);
    p->rowed = false; /* the next one is asked for other places */
}

struct promise promise_begin(struct picture *picture, const struct answer_conf *conf,
                             const struct picture_frame *frame, const struct answer_now *now,
                             const struct sight_place *place)
{
    const struct bearings_looks *looks = &frame->looks;
    const uint64_t online = ~silent(looks, conf, now);
    struct promise p = {.picture = picture,
                        .frame = frame,
                        .now = now,
                        .loose_m = place->moved_m,
                        .shown = bearings_of(looks, online, now->now_ns, conf->clear_for_s),
                        .view = {{1, 0, 0, 0}, {0}, picture->rings->step_rad}};
    sight_attitude(frame, now, false, p.view.attitude);
    memcpy(p.view.offset_m, place->offset_m, sizeof p.view.offset_m);
    for (int i = 0; i < PROMISE_PARTS; i++)
        p.come_m[i] = INFINITY;
    if (now->pose.drift_mps > 0)
        find_shown(&p);
    return p;
}

/*
 * What is left of near_m where the water does not go on there, for a vehicle that drifts: what stood beyond it when a
 * beam showed water there last has come nearer by the drift since, at the most. Nothing of it where the last look
 * showed none, as of a sonar that is drowned in noise; nor if the vehicle may have turned since: what a beam showed at
 * another bearing may be at this one now.
 */
static double adrift_m(const struct promise *p, const struct promise_look *look, double near_m)
{
    const struct pose *pose = &p->now->pose;
    return look->showed && !pose->heading_adrift ? fmax(0, near_m - answer_drifted_m(p->now, look->age_s)) : 0;
}

/*
 * How far, in a beam that does not turn, what stood beside it at its last ping may be now, for all that is known of
 * where the vehicle was and is, or for its drift since: so far the direction is at the beam's edge. Farther in, nearer
 * to the vehicle. 0 where no ping tells.
 */
static double edge_m(const struct promise *p, const struct looked *looked, const struct promise_look *look)
{
    const double in_rad = looked->still_rad - look->loose_rad;
    const double drifted_m = look->showed ? answer_drifted_m(p->now, look->age_s) : 0;
    const double aside_m = fmax(drifted_m, look->loose_m);
    if (looked->still_rad <= 0 || aside_m <= 0 || in_rad >= GEO_PI / 2)
        return 0;
    return in_rad > 0 ? aside_m / sin(in_rad) : (double)INFINITY;
}

static void level_axis(double az_rad, double v[3])
{
    v[0] = cos(az_rad);
    v[1] = sin(az_rad);
    v[2] = 0;
}

/* A place in the body, and how far above or below its level plane a head must hear to look there. */
struct ahead {
    double m[3], off_rad;
};

static struct ahead ahead_of(const struct promise *p, const double v[3], double range_m)
{
    double u[3] = {v[0], v[1], v[2]};
    sight_from_grid(p->frame, p->now, false, u);
    return (struct ahead){{range_m * u[0], range_m * u[1], range_m * u[2]},
                          asin(fmin(fabs(u[2]), 1)) + p->picture->rings->step_rad};
}

/* Does a head look at some place on that way? */
static bool head_passes(const struct promise *p, double az_rad, double near_m)
{
    double v[3];
    level_axis(az_rad, v);
    const struct ahead from = ahead_of(p, v, PROMISE_LEAST * near_m), to = ahead_of(p, v, near_m);
    return bearings_pass(&p->frame->looks, to.off_rad, from.m, to.m);
}

/*
 * What a lost ping would have shown nobody promises, until a later turn has shown it. Of a vehicle that drifts the
 * water must be free, at this moment, where near_m ends: what a beam showed farther out may by now have come nearer,
 * and nothing tells where it is.
 */
static double unshown_m(struct promise *p, double az_rad, const struct promise_look *look, double near_m)
{
    const bool drifts = p->now->pose.drift_mps > 0;
    double v[3];
    level_axis(az_rad, v);
    const struct looked looked = look_of(p, v, near_m);
    const double looked_m = fmin(look->looked_m, near_m);
    if (!looked.by_head && looked.still_rad <= 0)
        return promise_passes(p, az_rad, near_m) ? looked_m : near_m;
    const bool shown = bearings_have(p->shown, looked.az_rad, 0);
    const double edge = head_passes(p, az_rad, near_m) ? 0 : edge_m(p, &looked, look);
    if (look->goes_on || (shown && !drifts))
        return fmin(fmax(looked_m, edge), near_m);
    const double left_m = drifts ? fmin(looked_m, adrift_m(p, look, near_m)) : near_m;
    if (!shown) /* by no head: what nobody has shown nobody promises */
        return fmin(fmax(fmin(look->sure_m, looked_m), edge), left_m);
    return left_m;
}

/* Does a still sonar look there? */
static bool still_looks(const struct promise *p, double az_rad, double range_m)
{
    struct bearings_view view = p->view;
    memset(view.offset_m, 0, sizeof view.offset_m);
    return bearings_still_look(&p->frame->looks, &view, az_rad, range_m, EDGE_CELLS * view.step_rad);
}

bool promise_looks(const struct promise *p, double az_rad, double range_m)
{
    double v[3];
    level_axis(az_rad, v);
    const struct ahead at = ahead_of(p, v, range_m);
    return bearings_look(&p->frame->looks, at.off_rad, at.m) || still_looks(p, az_rad, range_m);
}

bool promise_passes(const struct promise *p, double az_rad, double near_m)
{
    double at_m = near_m;
    if (head_passes(p, az_rad, near_m))
        return true;
    while (at_m >= PROMISE_LEAST * near_m && !still_looks(p, az_rad, at_m))
        at_m /= 2; /* the parallax of a sonar off the middle goes by one over the range */
    return at_m >= PROMISE_LEAST * near_m;
}

double promise_come_m(const struct promise *p, double az_rad, double half_rad)
{
    const double from = floor((az_rad - half_rad) / PART_RAD), to = floor((az_rad + half_rad) / PART_RAD);
    const int first = (int)from, n = (int)fmin(to - from + 1, PROMISE_PARTS);
    double come_m = INFINITY;
    for (int i = 0; i < n; i++)
        come_m = fmin(come_m, p->come_m[((first + i) % PROMISE_PARTS + PROMISE_PARTS) % PROMISE_PARTS]);
    return come_m;
}

bool promise_asks(struct promise *p, double az_rad, double near_m)
{
    double v[3];
    level_axis(az_rad, v);
    return p->now->pose.drift_mps > 0 || look_of(p, v, near_m).still_rad > 0;
}

bool promise_heeds(struct promise *p, double az_rad, double near_m)
{
    double v[3];
    level_axis(az_rad, v);
    const struct looked looked = look_of(p, v, near_m);
    return looked.by_head || looked.still_rad > 0 || p->now->pose.drift_mps > 0;
}

double promise_m(struct promise *p, double az_rad, const struct promise_look *look, double near_m)
{
    const double shown_m = unshown_m(p, az_rad, look, near_m);
    return p->now->pose.drift_mps > 0 ? fmin(shown_m, promise_come_m(p, az_rad, 0)) : shown_m;
}
