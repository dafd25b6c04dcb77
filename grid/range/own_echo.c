/* SPDX-License-Identifier: MIT */
#include "own_echo.h"

#include <math.h>
#include <string.h>

#define REACH_M         3.0f          /* parts of the vehicle are no farther away */
#define PLAY_M          0.05f         /* they shake so much */
#define LOUDER          2.0f          /* 3 dB above what was learnt is more than the vehicle */
#define FRESH_NS        300000000000u /* time for a vehicle to turn round */
#define PLACE_SHARE     0.25          /* of the range: from farther off a look sees another side of the thing */
#define ASIDE_RAD       0.2526802551  /* asin(PLACE_SHARE): so far aside may the place be for an older look */
#define SPREAD_COSINE   0.87          /* of 30 degrees */
#define MOST_MISSES     3
#define LEAST_WIDTH_RAD 0.01f

void own_echo_init(struct own_echo *own)
{
    memset(own, 0, sizeof *own);
}

uint32_t own_echo_known(const struct own_echo *own)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < OWN_ECHO_ROWS; i++)
        n += own->row[i].proofs == OWN_ECHO_PROOFS;
    return n;
}

static uint32_t row_of(double az_rad)
{
    return (uint32_t)(geo_wrap(az_rad) * (OWN_ECHO_ROWS / GEO_TURN)) % OWN_ECHO_ROWS;
}

static uint32_t world_row(const struct own_echo_look *look)
{
    double az_rad, el_rad;
    geo_angles(look->axis, &az_rad, &el_rad);
    return row_of(az_rad);
}

static struct own_echo_look look_of(const struct echoes *e, const struct beam_echoes *b, const struct mount *mount)
{
    struct own_echo_look look = {.t_ns = e->t_ns,
                                 .uncertain_m =
                                     e->pose.uncertain_m + e->pose.blur_any_m + geo_length(e->pose.blur_m),
                                 .uncertain_rad = e->pose.uncertain_rad + e->pose.blur_rad,
                                 .drift_m = e->pose.drift_m[0] + e->pose.drift_m[1],
                                 .az_rad = b->az_rad,
                                 .heard_from_m = b->heard_from_m,
                                 .heard_to_m = b->heard_to_m,
                                 .n = b->n};
    geo_direction((double)b->az_rad, (double)b->el_rad, look.axis);
    quat_rotate(mount->attitude, look.axis, look.axis);
    quat_rotate(e->pose.attitude, look.axis, look.axis);
    quat_rotate(e->pose.attitude, mount->position_m, look.place_m);
    for (int i = 0; i < 3; i++)
        look.place_m[i] += e->pose.position_m[i];
    for (int i = 0; i < b->n; i++)
        look.range_m[i] = b->echo[i].range_m;
    return look;
}

/* ---- what looks by other bearings say of an echo ---- */

enum word { SAYS_NOTHING, DENIES, SHOWS };

/* The echo that a beam shows and that the older looks are asked about. */
struct question {
    const struct own_echo_look *now;
    double range_m, width_rad, heading_radps; /* the heading drifts so fast */
    uint64_t since_ns;                        /* looks that are not newer deny nothing */
};

static double apart_rad(const struct own_echo_look *a, const struct own_echo_look *b)
{
    return fabs(geo_wrap_pi((double)a->az_rad - (double)b->az_rad));
}

/* How far the heading may have drifted since the older look. */
static double adrift_rad(const struct own_echo_look *old, const struct question *q)
{
    return q->heading_radps * (double)(q->now->t_ns - old->t_ns) * 1e-9;
}

/* Was the older look made by another bearing of the head, and from where the same side of the thing is seen? */
static bool is_other(const struct own_echo_look *old, const struct question *q)
{
    const struct own_echo_look *now = q->now;
    double off_m[3];
    if (old->t_ns == 0 || old->t_ns >= now->t_ns || now->t_ns - old->t_ns > FRESH_NS ||
        apart_rad(old, now) <= 2.0 * q->width_rad || old->uncertain_rad + now->uncertain_rad > q->width_rad / 2.0)
        return false;
    for (int i = 0; i < 3; i++)
        off_m[i] = now->place_m[i] - old->place_m[i];
    return geo_length(off_m) + old->uncertain_m + now->uncertain_m + (now->drift_m - old->drift_m) <=
           PLACE_SHARE * q->range_m;
}

/* How far two looks' ranges of one thing may lie apart: as between neighbours, it need not stand square to them. */
static double same_within(double range_m)
{
    return 0.1 + 0.03 * range_m;
}

/* Places that are told a decimetre off bring a look beside a thing upon it, by a bearing that is little off. So does a
 * heading that has drifted. */
static bool is_sure(const struct own_echo_look *old, const struct question *q)
{
    return apart_rad(old, q->now) > 2.0 * (q->width_rad + ASIDE_RAD) &&
           old->uncertain_rad + q->now->uncertain_rad + adrift_rad(old, q) <= q->width_rad / 2.0;
}

static enum word says(const struct own_echo_look *old, const struct question *q)
{
    double to[3], along_m = 0.0;
    for (int i = 0; i < 3; i++) {
        to[i] = q->now->place_m[i] + q->range_m * q->now->axis[i] - old->place_m[i];
        along_m += to[i] * old->axis[i];
    }
    const double away_m = geo_length(to), within_rad = fmin(q->width_rad + adrift_rad(old, q), 1.0);
    const double aside = 1.0 - along_m / away_m; /* half the square of a small angle */
    if (!(aside <= within_rad * within_rad / 2.0))
        return SAYS_NOTHING;
    for (int i = 0; i < old->n; i++)
        if (fabs((double)old->range_m[i] - away_m) <= same_within(away_m))
            return SHOWS;
    return aside <= q->width_rad * q->width_rad / 8.0 && is_sure(old, q) && old->t_ns > q->since_ns &&
                   away_m > (double)old->heard_from_m && away_m < (double)old->heard_to_m
               ? DENIES
               : SAYS_NOTHING;
}

static enum word others_say(const struct own_echo *own, const struct question *q)
{
    const double most_rad = q->heading_radps * (double)FRESH_NS * 1e-9;
    const double reach_rad = fmin(q->width_rad + ASIDE_RAD + most_rad, GEO_PI);
    const uint32_t reach = (uint32_t)fmin(ceil(reach_rad * OWN_ECHO_ROWS / GEO_TURN), OWN_ECHO_ROWS / 2.0 - 1);
    const uint32_t begin = world_row(q->now) + OWN_ECHO_ROWS - reach;
    enum word all = SAYS_NOTHING;
    for (uint32_t i = 0; i <= 2 * reach; i++) {
        const struct own_echo_look *old = &own->look[(begin + i) % OWN_ECHO_ROWS];
        const enum word one = is_other(old, q) ? says(old, q) : SAYS_NOTHING;
        if (one == SHOWS)
            return SHOWS;
        all = one == DENIES ? DENIES : all;
    }
    return all;
}

/* ---- one row of bearing ---- */

static bool is_candidate(const struct echo *echo)
{
    return echo->near_m > 0.0f && echo->range_m <= REACH_M && echo->level > 0.0f && isfinite(echo->level);
}

/* Without a proof the beam's first echo is what may be the vehicle's own; NULL: it has none. */
static struct echo *begin_row(struct own_echo_row *row, struct beam_echoes *b)
{
    if (b->n == 0 || !is_candidate(&b->echo[0]))
        return NULL;
    *row = (struct own_echo_row){.el_rad = b->el_rad,
                                 .range_m = b->echo[0].range_m,
                                 .near_m = b->echo[0].near_m,
                                 .level = b->echo[0].level};
    return &b->echo[0];
}

static bool is_at(const struct own_echo_row *row, const struct echo *echo, float play_m)
{
    return fabsf(echo->range_m - row->range_m) <= play_m;
}

static struct echo *find_echo(const struct own_echo_row *row, struct beam_echoes *b, float play_m)
{
    for (int i = 0; i < b->n; i++)
        if (is_candidate(&b->echo[i]) && is_at(row, &b->echo[i], play_m) &&
            b->echo[i].near_m >= row->near_m - play_m && b->echo[i].level <= LOUDER * row->level)
            return &b->echo[i];
    return NULL;
}

/* Would the beam have shown the row's echo? What is there and is another echo hides it. */
static bool misses(const struct own_echo_row *row, const struct beam_echoes *b, float play_m)
{
    bool missed = row->range_m > b->heard_from_m && row->range_m < b->heard_to_m;
    for (int i = 0; i < b->n; i++)
        missed |= is_at(row, &b->echo[i], play_m);
    return missed;
}

/* A thing near the head is wide: a beam that turns a little may still be on it. */
static bool is_new_direction(const struct own_echo_row *row, const double axis[3])
{
    for (int k = 0; k < row->proofs; k++) {
        double cosine = 0.0;
        for (int i = 0; i < 3; i++)
            cosine += (double)row->axis[k][i] * axis[i];
        if (cosine > SPREAD_COSINE)
            return false;
    }
    return true;
}

static void prove(struct own_echo_row *row, const struct own_echo_look *now, const struct echo *echo)
{
    for (int i = 0; i < 3; i++)
        row->axis[row->proofs][i] = (float)now->axis[i];
    row->proof_ns = now->t_ns;
    row->level = fmaxf(row->level, echo->level);
    row->proofs++;
}

/* The vehicle's own fades in one look or another, and does not leave: such a look has not seen through it. */
static void miss(struct own_echo_row *row, struct beam_echoes *b)
{
    if (row->proofs < OWN_ECHO_PROOFS || ++row->misses == MOST_MISSES)
        *row = (struct own_echo_row){0};
    else
        beam_ends_at(b, row->near_m);
}

static void mark_beam(struct own_echo *own, struct beam_echoes *b, const struct own_echo_look *now,
                      double width_rad)
{
    struct own_echo_row *row = &own->row[row_of((double)b->az_rad)];
    const float play_m = PLAY_M + own->bin_m;
    if (row->proofs && row->el_rad != b->el_rad)
        return;
    struct echo *echo = row->proofs ? find_echo(row, b, play_m) : begin_row(row, b);
    const bool known = row->proofs == OWN_ECHO_PROOFS;
    if (!echo) {
        if (row->proofs && misses(row, b, play_m))
            miss(row, b);
        return;
    }
    row->misses = 0;
    const struct question q = {now, (double)echo->range_m, width_rad, own->heading_radps, row->proof_ns};
    const enum word word = others_say(own, &q);
    if (word == SHOWS) {
        row->proofs = known ? row->proofs : 0;
        return;
    }
    if (!known && word == DENIES && is_new_direction(row, now->axis))
        prove(row, now, echo);
    if (row->proofs == OWN_ECHO_PROOFS)
        echo->flags |= ECHO_OWN;
}

/* ---- one ping ---- */

/* What was learnt is of one setting, and looks are of poses that go together. */
static void begin_ping(struct own_echo *own, const struct echoes *e)
{
    if (own->bin_m != e->bin_m)
        own_echo_init(own);
    if (own->discontinuities != e->pose.discontinuities || own->withdrawn != e->pose.withdrawn)
        memset(own->look, 0, sizeof own->look);
    own->bin_m = e->bin_m;
    own->heading_radps = e->pose.heading_radps;
    own->discontinuities = e->pose.discontinuities;
    own->withdrawn = e->pose.withdrawn;
}

static bool shows_own(const struct beam_echoes *b)
{
    for (int i = 0; i < b->n; i++)
        if (b->echo[i].flags & ECHO_OWN)
            return true;
    return false;
}

void own_echo_run(struct own_echo *own, struct echoes *e, const struct mount *mount)
{
    const double width_rad = (double)fmaxf(e->az_aperture_rad, LEAST_WIDTH_RAD);
    begin_ping(own, e);
    if (!(e->pose.has & POSE_ATTITUDE) || !(e->pose.has & (POSE_POSITION | POSE_VELOCITY)) ||
        e->pose.heading_adrift)
        return;
    for (uint16_t i = 0; i < e->n_beams; i++) {
        const struct own_echo_look now = look_of(e, &e->beam[i], mount);
        if (e->beam[i].state != BEAM_BLIND)
            mark_beam(own, &e->beam[i], &now, width_rad);
    }
    for (uint16_t i = 0; i < e->n_beams; i++) {
        const struct own_echo_look look = look_of(e, &e->beam[i], mount);
        /* what the vehicle hides it does not see: the look before it stays */
        if (e->beam[i].state != BEAM_BLIND && !shows_own(&e->beam[i]))
            own->look[world_row(&look)] = look;
    }
}
