/* SPDX-License-Identifier: MIT */
#include "polar.h"

#include <string.h>

#define ODD_STEPS      2 /* in a row, that are not whole steps, are a new step */
#define MULTIPLE_STEPS 8 /* in a row, of the same several steps */

/* What a ping would do to the image. */
struct verdict {
    bool anew;     /* it begins another image ... */
    bool dropped;  /* ... in place of one that holds more than the first ping of a turning head */
    uint32_t step; /* of the image then */
    uint32_t odd_step, odd_steps;
};

void polar_init(struct polar *p)
{
    memset(p, 0, sizeof *p);
}

static uint32_t turn_of(const struct ping *ping)
{
    return ping->head_turn ? ping->head_turn : 1;
}

/* The shorter way round from the last ping to this one, in head units. */
static uint32_t way(const struct polar *p, const struct ping *ping)
{
    const uint32_t units = ping->head_units % p->turn;
    const uint32_t there = units >= p->units ? units - p->units : p->units - units;
    return there <= p->turn - there ? there : p->turn - there;
}

static struct verdict judge(const struct polar *p, const struct ping *ping)
{
    struct verdict v = {.step = p->step};
    if (p->turn != turn_of(ping) || p->n_bins != ping->n_bins || p->r0_m != ping->r0_m || p->dr_m != ping->dr_m ||
        (ping->t_ns > p->t_ns && ping->t_ns - p->t_ns > POLAR_MAX_AGE_NS))
        return (struct verdict){.anew = true, .dropped = p->n_bins > 0};
    const uint32_t by = way(p, ping);
    if (by == 0 || by == p->step)
        return v;
    if (p->step == 0)
        return (struct verdict){.anew = true, .step = by};
    v.odd_step = by;
    v.odd_steps = by == p->odd_step ? p->odd_steps + 1 : 1;
    if (v.odd_steps >= (by % p->step ? ODD_STEPS : MULTIPLE_STEPS))
        return (struct verdict){.anew = true, .dropped = true, .step = by};
    return v;
}

bool polar_fits(const struct polar *p, const struct ping *ping)
{
    return !judge(p, ping).anew;
}

static void begin_ping(struct polar *p, const struct ping *ping, const struct verdict *v)
{
    p->turn = turn_of(ping);
    p->step = v->step;
    const uint32_t rows = v->step ? p->turn / v->step : 1;
    p->rows = rows < POLAR_MAX_ROWS ? rows : POLAR_MAX_ROWS;
    p->n_bins = ping->n_bins;
    p->r0_m = ping->r0_m;
    p->dr_m = ping->dr_m;
    p->pings = 0;
    p->restarts += v->dropped;
    memset(p->row, 0, sizeof p->row);
}

uint32_t polar_place(struct polar *p, const struct ping *ping)
{
    const struct verdict v = judge(p, ping);
    if (v.anew)
        begin_ping(p, ping, &v);
    p->odd_step = v.odd_step;
    p->odd_steps = v.odd_steps;
    p->units = ping->head_units % p->turn;
    p->t_ns = ping->t_ns;
    const uint32_t row = (uint32_t)((uint64_t)p->units * p->rows / p->turn);
    p->row[row] = (struct polar_row){.ping = ++p->pings, .t_ns = ping->t_ns, .pose = ping->pose};
    return row;
}

const struct polar_row *polar_neighbour(const struct polar *p, uint32_t row, int offset)
{
    const uint32_t by = (uint32_t)(offset < 0 ? -offset : offset);
    if (p->rows <= 2 * by)
        return NULL;
    const struct polar_row *r = &p->row[(offset < 0 ? row + p->rows - by : row + by) % p->rows];
    if (r->ping == 0 || p->pings - r->ping > p->rows + p->rows / 2)
        return NULL;
    return p->t_ns > r->t_ns && p->t_ns - r->t_ns > POLAR_MAX_AGE_NS ? NULL : r;
}
