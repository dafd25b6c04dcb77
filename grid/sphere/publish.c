/* SPDX-License-Identifier: MIT */
#include "publish.h"

#include <math.h>
#include <string.h>

#include "relax.h"

#define HINT_LEAST_M 1e-3f

static bool is_locked(const struct cell *c)
{
    return c->state == CELL_LOCKED;
}

static struct picture_obstacle obstacle_of(const struct cell *c, float range_m, float near_m)
{
    return (struct picture_obstacle){.t_ref_ns = is_locked(c) ? UINT64_MAX : c->t_ref_ns,
                                     .t_echo_ns = c->t_echo_ns,
                                     .logodds = c->logodds,
                                     .near_m = near_m,
                                     .range_m = range_m,
                                     .sd_m = c->sd_m};
}

/* All fade alike: what is more now blocks for longer. */
static double lasts(const struct sphere *s, const struct cell *c, uint64_t t_ns)
{
    return is_locked(c) ? (double)INFINITY : state_logodds(s, c, t_ns);
}

/*
 * Of more than there is room for the farthest that is told stands for those behind it: it blocks for as long as any of
 * them. Otherwise these would be gone from the picture once it has faded, until a ping looks there again.
 */
static void publish_direction(struct sphere *s, uint32_t d, uint64_t t_ns)
{
    struct picture_entry e = {.t_look_ns = s->direction[d].t_look_ns};
    const struct cell *longest = NULL; /* of the last one that is told and all behind it */
    unsigned n = 0;
    for (uint32_t i = s->cells.first[d]; i != CELLS_NONE; i = s->cells.cell[i].next) {
        const struct cell *c = &s->cells.cell[i];
        double v[3];
        if (n == PICTURE_OBSTACLES) {
            if (!c->pending && state_blocks(s, c, t_ns) && lasts(s, c, t_ns) > lasts(s, longest, t_ns))
                longest = c;
            continue;
        }
        const float range_m = (float)state_vector(s, c, v);
        const float near_m = range_m > c->near_m ? range_m - c->near_m : 0;
        if (c->pending || !state_blocks(s, c, t_ns)) {
            e.hint_m = e.hint_m > 0 ? e.hint_m : fmaxf(near_m, HINT_LEAST_M);
            continue;
        }
        e.obstacle[n++] = obstacle_of(c, range_m, near_m);
        longest = c;
    }
    if (n > 0) {
        e.obstacle[n - 1].t_ref_ns = is_locked(longest) ? UINT64_MAX : longest->t_ref_ns;
        e.obstacle[n - 1].logodds = longest->logodds;
    }
    if (s->conf.relaxation > 0)
        relax_direction(s, d, t_ns, e.obstacle, n);
    picture_set(&s->picture, d, &e);
}

void publish_changes(struct sphere *s, uint64_t t_ns)
{
    if (s->conf.relaxation > 0)
        relax_reach(s);
    picture_begin(&s->picture);
    for (uint32_t i = 0; i < s->n_dirty; i++) {
        publish_direction(s, s->dirty[i], t_ns);
        s->direction[s->dirty[i]].dirty = false;
    }
    s->n_dirty = 0;
    picture_set_frame(&s->picture, &s->frame);
    picture_end(&s->picture);
}

void publish_ping(struct sphere *s, const struct echoes *e)
{
    s->frame.range_max_m = fmax(s->frame.range_max_m, e->range_max_m);
    s->frame.reach_m = s->layers.edge[s->layers.n];
    s->frame.pings++;
    if (e->t_ns > s->frame.t_ping_ns) /* or it was dated back */
        s->frame.t_ping_ns = e->t_ns;
    s->frame.path_m = e->pose.path_m;
    publish_changes(s, s->frame.t_ping_ns);
}
