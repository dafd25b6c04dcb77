/* SPDX-License-Identifier: MIT */
#include "lost_echo.h"

#include <math.h>
#include <string.h>

#define HEAD_LOST 6
#define FAN_LOST  12

#define BELIEVED_NS 10000000000u /* a pass of a head is over, and the next one tells */

#define SHOWN      2
#define MOVED_M    0.3
#define TURNED_RAD (5 * GEO_PI / 180)

/* An echo of one thing in two beams: it need not stand square to them. */
#define SAME_M     0.1f
#define SAME_SHARE 0.1f

void lost_echo_init(struct lost_echo *l)
{
    memset(l, 0, sizeof *l);
}

static struct lost_echo_row *row_of(struct lost_echo *l, const struct echoes *e, uint32_t beam)
{
    if (e->n_beams > 1)
        return &l->row[beam * LOST_ECHO_FAN / e->n_beams];
    return &l->row[(uint32_t)(geo_wrap((double)e->beam[beam].az_rad) / GEO_TURN * LOST_ECHO_ROWS) %
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

static void show(struct lost_echo_row *row, const struct echoes *e, const struct echo *echo)
{
    const bool known = row->shown > 0 && row->shown_ns == e->t_ns; /* another beam of the row has it already */
    const bool same = row->shown && stands(&row->pose, &e->pose) &&
                      fabsf(row->range_m - echo->range_m) <= SAME_M + SAME_SHARE * echo->range_m;

    if (known)
        return;
    row->shown = !same ? 1 : row->shown < SHOWN ? row->shown + 1 : SHOWN;
    if (!same)
        row->pose = e->pose;
    row->shown_ns = e->t_ns;
    row->lost_ns = 0;
    row->range_m = echo->range_m;
}

/* The beam should show what its row has, and has no echo at all. */
static bool misses(const struct lost_echo_row *row, const struct echoes *e, const struct beam_echoes *beam)
{
    return row->shown >= SHOWN && beam->n == 0 && beam->state == BEAM_SILENT &&
           row->range_m > beam->heard_from_m && row->range_m < beam->heard_to_m && stands(&row->pose, &e->pose);
}

/* The receiver hears: what was lost until now has left, and so has what this ping does not show. */
static void hear(struct lost_echo *l, const struct echoes *e)
{
    for (int i = 0; i < LOST_ECHO_ROWS && l->lost > 0; i++)
        if (l->row[i].lost_ns)
            l->row[i].shown = 0;
    for (uint32_t i = 0; i < e->n_beams; i++) {
        struct lost_echo_row *row = row_of(l, e, i);
        if (row->shown_ns != e->t_ns && misses(row, e, &e->beam[i]))
            row->shown = 0;
    }
    l->lost = 0;
    l->doubt = false;
}

static bool take_echoes(struct lost_echo *l, const struct echoes *e)
{
    bool any = false;

    for (uint32_t i = 0; i < e->n_beams; i++) {
        const struct echo *echo = firm_echo(&e->beam[i]);
        if (!echo)
            continue;
        any = true;
        show(row_of(l, e, i), e, echo);
    }
    return any;
}

static void take_silence(struct lost_echo *l, struct echoes *e)
{
    for (uint32_t i = 0; i < e->n_beams; i++) {
        struct lost_echo_row *row = row_of(l, e, i);
        if (!misses(row, e, &e->beam[i]))
            continue;
        l->lost += row->lost_ns == 0;
        row->lost_ns = row->lost_ns ? row->lost_ns : e->t_ns;
        if (e->t_ns - row->lost_ns <= BELIEVED_NS)
            beam_frees_nothing(&e->beam[i]);
        else
            row->shown = 0;
    }
}

bool lost_echo_run(struct lost_echo *l, struct echoes *e)
{
    if (take_echoes(l, e))
        hear(l, e);
    else
        take_silence(l, e);
    l->doubt |= l->lost >= (e->n_beams > 1 ? FAN_LOST : HEAD_LOST);
    for (uint32_t i = 0; i < e->n_beams && l->doubt; i++)
        beam_frees_nothing(&e->beam[i]);
    return l->doubt;
}
