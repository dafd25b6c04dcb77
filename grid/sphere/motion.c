/* SPDX-License-Identifier: MIT */
#include "motion.h"

#include <math.h>
#include <string.h>

static void place_cell(struct sphere *s, uint32_t index)
{
    struct cell old = s->cells.cell[index];
    double v[3], az, el;
    for (int i = 0; i < 3; i++)
        v[i] = old.point_m[i] + s->anchor_m[i] - s->frame.centre_m[i];
    double range = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    int32_t layer = layers_index(&s->layers, range);
    geo_angles(v, &az, &el);
    uint32_t d = rings_index(&s->rings, az, el);
    if (layer < 0 || d == RINGS_NONE) {
        state_release(s, index);
        return;
    }
    s->cells.cell[index].range_m = (float)range;
    if (d == old.direction && layer == old.layer)
        return;
    state_release(s, index);
    struct cell *c = state_take(s, d, (uint16_t)layer);
    if (c->echoes) { /* two fall together: the stronger and the nearer wins, counts add up */
        c->logodds = fmaxf(c->logodds, old.logodds);
        c->t_ref_ns = c->t_ref_ns > old.t_ref_ns ? c->t_ref_ns : old.t_ref_ns;
        c->t_echo_ns = c->t_echo_ns > old.t_echo_ns ? c->t_echo_ns : old.t_echo_ns;
        c->t_first_ns = c->t_first_ns < old.t_first_ns ? c->t_first_ns : old.t_first_ns;
        c->echoes = (uint16_t)fmin(UINT16_MAX, c->echoes + old.echoes);
        if (range < c->range_m) {
            memcpy(c->point_m, old.point_m, sizeof c->point_m);
            c->range_m = (float)range;
            c->near_m = old.near_m;
        }
        c->sd_m = fmaxf(c->sd_m, old.sd_m);
    } else {
        uint32_t next = c->next;
        *c = old;
        c->next = next;
        c->direction = d;
        c->layer = (uint16_t)layer;
        c->range_m = (float)range;
    }
    state_mark(s, d);
}

/* Farther in one step than this the old claims say nothing of the new place. */
#define CLAIM_STEP_MOST_M 1.0

static void move_claims(struct sphere *s, const double step_m[3])
{
    for (uint32_t d = 0; d < s->rings.n; d++)
        s->joined[d] = claim_join(&s->direction[d].claim[CLAIM_NOW], &s->direction[d].claim[CLAIM_BEFORE]);
    bool far = step_m[0] * step_m[0] + step_m[1] * step_m[1] + step_m[2] * step_m[2] >
               CLAIM_STEP_MOST_M * CLAIM_STEP_MOST_M;
    for (uint32_t d = 0; d < s->rings.n; d++) {
        struct direction *dir = &s->direction[d];
        if (!dir->claim[CLAIM_NOW].t_ping_ns && s->cells.first[d] == CELLS_NONE)
            continue;
        dir->claim[CLAIM_NOW] =
            far ? (struct claim){0} : claim_moved(&s->rings, (const double(*)[3])s->axis, s->joined, d, step_m);
        dir->claim[CLAIM_BEFORE] = (struct claim){0};
        state_mark(s, d);
    }
}

static void recentre(struct sphere *s, const double position_m[3])
{
    double step_m[3];
    for (int i = 0; i < 3; i++) {
        step_m[i] = position_m[i] - s->frame.centre_m[i];
        s->frame.centre_m[i] = position_m[i];
    }
    CELLS_EACH(&s->cells, i)
    place_cell(s, i);
    move_claims(s, step_m);
    s->stats.recentred++;
}

/* Far from the anchor a float point loses its digits: points are moved to a new anchor in double. */
#define ANCHOR_REACH_M 100.0

static void reanchor(struct sphere *s)
{
    double shift[3];
    for (int i = 0; i < 3; i++) {
        shift[i] = s->frame.centre_m[i] - s->anchor_m[i];
        s->anchor_m[i] = s->frame.centre_m[i];
    }
    CELLS_EACH(&s->cells, i)
    for (int k = 0; k < 3; k++)
        s->cells.cell[i].point_m[k] = (float)(s->cells.cell[i].point_m[k] - shift[k]);
}

static double distance(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

void motion_follow(struct sphere *s, const struct pose *pose)
{
    if (!s->placed) {
        memcpy(s->frame.centre_m, pose->position_m, sizeof s->frame.centre_m);
        memcpy(s->anchor_m, pose->position_m, sizeof s->anchor_m);
        s->placed = true;
        return;
    }
    if (distance(pose->position_m, s->frame.centre_m) > s->conf.recentre_m)
        recentre(s, pose->position_m);
    if (distance(s->frame.centre_m, s->anchor_m) > ANCHOR_REACH_M)
        reanchor(s);
}
