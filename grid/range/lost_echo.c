/* SPDX-License-Identifier: MIT */
#include "lost_echo.h"

#include <math.h>
#include <stddef.h>

#define HEAD_LOST 6
#define FAN_LOST  12

#define BELIEVED_NS 10000000000u /* a pass of a head is over, and the next one tells */

/* An echo so many times (6 dB) what the weakest wall exceeds in 99 looks of 100 is not missed by a pass of two. */
#define STRONG      4.0f
#define PASS_LOOKS  2
#define SAME_M      0.3f
#define BACK_PASSES 8
#define BACK_NS     300000000000u /* of what the head passes no more */

#define SHOWN      2
#define MOVED_M    0.3
#define TURNED_RAD (5 * GEO_PI / 180)

static uint32_t share_of(const struct echoes *e, uint32_t beam, uint32_t of_turn, uint32_t of_fan)
{
    if (e->n_beams > 1)
        return beam * of_fan / e->n_beams;
    return (uint32_t)(geo_wrap((double)e->beam[beam].az_rad) / GEO_TURN * of_turn) % of_turn;
}

static struct lost_echo_part *part_of(struct lost_echo *l, const struct echoes *e, uint32_t beam)
{
    return &l->part[share_of(e, beam, LOST_ECHO_PARTS, LOST_ECHO_FAN)];
}

/* Bearings of a head lie in the middle of rows, or rounding would move them. */
static struct lost_echo_row *row_of(struct lost_echo *l, const struct echoes *e, uint32_t beam)
{
    if (e->n_beams > 1)
        return &l->row[beam % LOST_ECHO_ROWS];
    return &l->row[(uint32_t)lround(geo_wrap((double)e->beam[beam].az_rad) / GEO_TURN * LOST_ECHO_ROWS) %
                   LOST_ECHO_ROWS];
}

/* The vehicle is where it was, as surely as poses and the promise to keep station can tell. */
static bool stands(const struct pose *then, const struct pose *now)
{
    double way_m = fmax(now->drift_m[0] - then->drift_m[0], now->drift_m[1] - then->drift_m[1]), cosine = 0.0;

    if (then->has != now->has || then->discontinuities != now->discontinuities ||
        then->withdrawn != now->withdrawn || now->heading_adrift)
        return false;
    for (int k = 0; k < 3; k++)
        way_m += fabs(now->position_m[k] - then->position_m[k]);
    for (int k = 0; k < 4; k++)
        cosine += then->attitude[k] * now->attitude[k];
    return way_m <= MOVED_M && fabs(cosine) >= cos(TURNED_RAD / 2.0);
}

/* The beam's first echo that nothing speaks against; NULL: none. */
static const struct echo *firm_echo(const struct beam_echoes *beam)
{
    for (int i = 0; i < beam->n; i++)
        if (!(beam->echo[i].flags & (ECHO_UNCONFIRMED | ECHO_OWN | ECHO_GHOST)))
            return &beam->echo[i];
    return NULL;
}

static void show(struct lost_echo *l, const struct echoes *e, uint32_t beam, const struct echo *echo)
{
    struct lost_echo_part *part = part_of(l, e, beam);
    struct lost_echo_row *row = row_of(l, e, beam);

    if (part->shown == 0 || !stands(&part->pose, &e->pose)) {
        part->shown = 0;
        part->since_ns = e->t_ns;
        part->pose = e->pose;
    }
    if (part->shown_ns != e->t_ns) /* beams of one ping are one look */
        part->shown = part->shown < SHOWN ? part->shown + 1 : SHOWN;
    part->shown_ns = e->t_ns;
    part->lost_ns = 0;
    *row = (struct lost_echo_row){e->t_ns, echo->range_m};
}

/* The beam should show what its row has, and has no echo at all. */
static bool misses(struct lost_echo *l, const struct echoes *e, uint32_t i)
{
    const struct beam_echoes *beam = &e->beam[i];
    const struct lost_echo_part *part = part_of(l, e, i);
    const struct lost_echo_row *row = row_of(l, e, i);

    return part->shown >= SHOWN && row->t_ns >= part->since_ns && beam->n == 0 && beam->state == BEAM_SILENT &&
           row->range_m > beam->heard_from_m && row->range_m < beam->heard_to_m && stands(&part->pose, &e->pose);
}

static bool take_echoes(struct lost_echo *l, const struct echoes *e)
{
    bool any = false;

    for (uint32_t i = 0; i < e->n_beams; i++) {
        const struct echo *echo = firm_echo(&e->beam[i]);
        if (!echo)
            continue;
        any = true;
        show(l, e, i, echo);
    }
    return any;
}

/* The receiver hears: what was lost until now has left, and so has what this ping does not show. */
static void hear(struct lost_echo *l, const struct echoes *e)
{
    for (int k = 0; k < LOST_ECHO_PARTS; k++)
        if (l->part[k].lost_ns)
            l->part[k] = (struct lost_echo_part){0};
    for (uint32_t i = 0; i < e->n_beams; i++)
        if (misses(l, e, i))
            row_of(l, e, i)->t_ns = 0;
    l->lost = 0;
}

static void take_silence(struct lost_echo *l, struct echoes *e)
{
    for (uint32_t i = 0; i < e->n_beams; i++) {
        struct lost_echo_part *part = part_of(l, e, i);
        if (!misses(l, e, i))
            continue;
        l->lost += part->lost_ns == 0;
        part->lost_ns = part->lost_ns ? part->lost_ns : e->t_ns;
        if (e->t_ns - part->lost_ns <= BELIEVED_NS)
            beam_frees_nothing(&e->beam[i]);
        else
            row_of(l, e, i)->t_ns = 0;
    }
}

/* Of a head that turns: marks do not matter, for looks that missed it speak against what is there again. */
static const struct echo *strong_echo(const struct beam_echoes *beam)
{
    const struct echo *echo = &beam->echo[0];

    return beam->n > 0 && echo->level >= STRONG &&
                   !(echo->flags & (ECHO_FAINT | ECHO_OTHER | ECHO_OWN | ECHO_GHOST))
               ? echo
               : NULL;
}

static void end_pass(struct lost_echo *l)
{
    struct lost_echo_return *r = &l->again[l->pass.part];

    if (l->pass.looks < PASS_LOOKS)
        return;
    r->back = l->pass.silent > 0 && r->back > 0 ? r->back - 1 : 0; /* heard by every look: it hears */
    r->gone |= l->pass.silent == l->pass.looks && r->range_m > 0.0f;
}

static void pass_on(struct lost_echo *l, const struct echoes *e)
{
    const struct beam_echoes *beam = &e->beam[0];
    const struct echo *echo = strong_echo(beam);
    const uint32_t part = share_of(e, 0, LOST_ECHO_PARTS, LOST_ECHO_FAN);
    struct lost_echo_return *r = &l->again[part];

    if (part != l->pass.part) {
        end_pass(l);
        l->pass = (struct lost_echo_pass){.part = part};
    }
    l->pass.looks++;
    l->pass.silent += beam->n == 0 && beam->state == BEAM_SILENT && r->range_m > beam->heard_from_m &&
                      r->range_m < beam->heard_to_m;
    if (!echo)
        return;
    const bool again = r->gone && stands(&r->pose, &e->pose) && fabsf(echo->range_m - r->range_m) <= SAME_M;
    *r = (struct lost_echo_return){.pose = e->pose,
                                   .range_m = echo->range_m,
                                   .back_ns = again ? e->t_ns : r->back_ns,
                                   .back = again ? BACK_PASSES : r->back};
}

/* Parts of which the echo came back lately. */
static uint32_t came_back(const struct lost_echo *l, uint64_t now_ns)
{
    uint32_t n = 0;

    for (int k = 0; k < LOST_ECHO_PARTS; k++)
        n += l->again[k].back > 0 && now_ns <= l->again[k].back_ns + BACK_NS;
    return n;
}

bool lost_echo_run(struct lost_echo *l, struct echoes *e)
{
    if (take_echoes(l, e))
        hear(l, e);
    else
        take_silence(l, e);
    if (e->turns && e->n_beams == 1)
        pass_on(l, e);
    l->doubt = l->lost >= (e->n_beams > 1 ? FAN_LOST : HEAD_LOST) || came_back(l, e->t_ns) >= HEAD_LOST;
    for (uint32_t i = 0; i < e->n_beams && l->doubt; i++)
        beam_frees_nothing(&e->beam[i]);
    return l->doubt;
}
