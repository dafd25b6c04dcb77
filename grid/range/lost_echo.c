/* SPDX-License-Identifier: MIT */
#include "lost_echo.h"

#include <math.h>
#include <stddef.h>

#define HEAD_LOST 6
#define FAN_LOST  12

#define BELIEVED_NS 10000000000u /* a pass of a head is over, and the next one tells */

#define SHOWN 2

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
    if (part->shown == 0 || !standing_at(&part->pose, &e->pose)) {
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
           row->range_m > beam->heard_from_m && row->range_m < beam->heard_to_m &&
           standing_at(&part->pose, &e->pose);
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

bool lost_echo_run(struct lost_echo *l, struct echoes *e)
{
    shade_run(&l->shade, e);
    const bool came_back = came_back_run(&l->came_back, e);
    if (take_echoes(l, e))
        hear(l, e);
    else
        take_silence(l, e);
    l->doubt = l->lost >= (e->n_beams > 1 ? FAN_LOST : HEAD_LOST) || came_back;
    for (uint32_t i = 0; i < e->n_beams && l->doubt; i++)
        beam_frees_nothing(&e->beam[i]);
    return l->doubt;
}
