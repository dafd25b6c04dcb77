/* SPDX-License-Identifier: MIT */
#include "state.h"

#include <math.h>
#include <string.h>

double state_logodds(const struct sphere *s, const struct cell *c, uint64_t t_ns)
{
    if (c->state == CELL_LOCKED || t_ns <= c->t_ref_ns)
        return c->logodds;
    return c->logodds * exp(-(double)(t_ns - c->t_ref_ns) * 1e-9 / s->fade_s);
}

void state_to_grid(const struct sphere *s, const double v[3], double out[3])
{
    const double north = v[0], east = v[1];
    out[0] = north;
    out[1] = east;
    out[2] = v[2];
    if (s->frame.axes_rad == 0)
        return;
    out[0] = s->axes_cos * north + s->axes_sin * east;
    out[1] = s->axes_cos * east - s->axes_sin * north;
}

uint32_t state_ms(const struct sphere *s, uint64_t t_ns)
{
    uint64_t ms = t_ns > s->t_start_ns ? (t_ns - s->t_start_ns) / 1000000 : 0;
    return ms < UINT32_MAX ? (uint32_t)ms : UINT32_MAX;
}

struct cell *state_take(struct sphere *s, uint32_t direction, uint16_t layer)
{
    uint32_t evicted, i = cells_take(&s->cells, direction, layer, &evicted);
    if (evicted != RINGS_NONE) { /* what that cell said is lost */
        state_mark(s, evicted);
        s->stats.cells_lost++;
    }
    if (i != CELLS_NONE) {
        s->nearest_m = fmin(s->nearest_m, s->layers.edge[layer]);
        return &s->cells.cell[i];
    }
    s->stats.cells_lost++;
    return NULL;
}
