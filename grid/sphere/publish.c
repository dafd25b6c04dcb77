/* SPDX-License-Identifier: MIT */
#include "publish.h"

#include <math.h>

#include "relax.h"

static void publish_direction(struct sphere *s, uint32_t d, uint64_t t_ns)
{
    const struct direction *dir = &s->direction[d];
    struct picture_entry e = {.claim = {dir->claim[CLAIM_NOW], dir->claim[CLAIM_BEFORE]}};
    unsigned n = 0;
    for (uint32_t i = s->cells.first[d]; i != CELLS_NONE && n < PICTURE_OBSTACLES; i = s->cells.cell[i].next) {
        const struct cell *c = &s->cells.cell[i];
        double v[3];
        float range_m = (float)state_vector(s, c, v), near_m = fmaxf(0, range_m - c->near_m);
        if (state_logodds(s, c, t_ns) <= s->picture.blocked_logodds) {
            for (int k = 0; k < CLAIMS; k++) /* too little to block, too much to call it clear */
                e.claim[k].to_m = fminf(e.claim[k].to_m, near_m);
            continue;
        }
        e.obstacle[n++] = (struct picture_obstacle){.t_ref_ns = c->state == CELL_LOCKED ? UINT64_MAX : c->t_ref_ns,
                                                    .t_echo_ns = c->t_echo_ns,
                                                    .logodds = c->logodds,
                                                    .near_m = near_m,
                                                    .range_m = range_m,
                                                    .sd_m = c->sd_m};
    }
    if (s->relax)
        relax_direction(s, d, t_ns, e.obstacle, n);
    picture_set(&s->picture, d, &e);
}

void publish_changes(struct sphere *s, uint64_t t_ns)
{
    if (s->relax)
        relax_reach(s);
    picture_begin(&s->picture);
    for (uint32_t i = 0; i < s->n_dirty; i++) {
        publish_direction(s, s->dirty[i], t_ns);
        s->direction[s->dirty[i]].dirty = 0;
    }
    s->n_dirty = 0;
    picture_set_frame(&s->picture, &s->frame);
    picture_end(&s->picture);
}

void publish_ping(struct sphere *s, const struct echoes *e)
{
    s->frame.range_max_m = fmax(s->frame.range_max_m, e->range_max_m);
    s->frame.pings++;
    s->frame.t_ping_ns = e->t_ns;
    publish_changes(s, e->t_ns);
}
