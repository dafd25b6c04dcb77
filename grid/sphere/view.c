/* SPDX-License-Identifier: MIT */
#include "view.h"

#include <math.h>
#include <string.h>

#include "state.h"

/* A heading is known to this much less with every second since an echo (0.5 degrees per minute). */
#define HEADING_DRIFT_RADPS 1.5e-4

static unsigned flags_of(const struct sphere *s, const struct cell *c)
{
    uint32_t turn_ms = s->turn_ms[c->sensor];
    unsigned flags = c->state == CELL_LOCKED ? SPHERE_LOCKED : c->state == CELL_GONE ? SPHERE_GONE : 0;
    if (c->t_first_ms >= turn_ms)
        flags |= SPHERE_NEW;
    else if (state_ms(s, c->t_echo_ns) >= turn_ms)
        flags |= SPHERE_UPDATED;
    else if (state_ms(s, c->t_ref_ns) >= turn_ms)
        flags |= SPHERE_MISSED;
    return flags;
}

static void describe(const struct sphere *s, const struct cell *c, uint64_t t_ns, struct sphere_cell *out)
{
    *out = (struct sphere_cell){.from_m = s->layers.edge[c->layer],
                                .to_m = s->layers.edge[c->layer + 1],
                                .logodds = state_logodds(s, c, t_ns),
                                .t_first_ns = s->t_start_ns + 1000000ull * c->t_first_ms,
                                .t_echo_ns = c->t_echo_ns,
                                .seq = c->seq,
                                .sensor = c->sensor,
                                .echoes = c->echoes,
                                .layer = c->layer,
                                .misses = c->misses & CELLS_MISSES,
                                .pending = c->pending,
                                .flags = flags_of(s, c)};
    double range_m = state_vector(s, c, out->point_m), ball_m = sqrt((double)c->ball_m2);
    out->near_m = fmax(0, range_m - (double)c->near_m);
    double since_s = s->frame.ned && t_ns > c->t_echo_ns ? (double)(t_ns - c->t_echo_ns) * 1e-9 : 0;
    out->ball_m = ball_m + fmin(HEADING_DRIFT_RADPS * since_s, 1) * range_m;
}

bool sphere_cell(const struct sphere *s, uint32_t direction, uint32_t k, uint64_t t_ns, struct sphere_cell *out)
{
    uint32_t i = direction < s->rings.n ? s->cells.first[direction] : CELLS_NONE;
    while (i != CELLS_NONE && k--)
        i = s->cells.cell[i].next;
    if (i == CELLS_NONE)
        return false;
    describe(s, &s->cells.cell[i], t_ns, out);
    return true;
}

uint64_t sphere_pinged(const struct sphere *s, uint32_t direction)
{
    return s->direction[direction].t_look_ns;
}

uint64_t sphere_passed(const struct sphere *s, uint32_t direction, double range_m)
{
    const struct direction *dir = &s->direction[direction];
    return range_m <= (double)dir->to_m ? dir->t_look_ns : 0;
}

double sphere_cluster_relaxation(const struct sphere *s)
{
    return s->conf.cluster_relaxation;
}

void sphere_centre(const struct sphere *s, double centre_m[3])
{
    memcpy(centre_m, s->frame.centre_m, sizeof s->frame.centre_m);
}

double sphere_reach(const struct sphere *s)
{
    return s->layers.edge[s->layers.n];
}

double sphere_axes(const struct sphere *s)
{
    return s->frame.axes_rad;
}

uint32_t sphere_holding(const struct sphere *s, const double v[3])
{
    double in_grid[3];
    state_to_grid(s, v, in_grid);
    return rings_holding(&s->rings, in_grid);
}

bool sphere_gone(const struct sphere *s, uint32_t *at, uint64_t t_ns, struct sphere_cell *out)
{
    const uint32_t i = *at ? s->cells.cell[*at - 1].next : s->cells.gone;
    if (i == CELLS_NONE)
        return false;
    *at = i + 1;
    describe(s, &s->cells.cell[i], t_ns, out);
    return true;
}
