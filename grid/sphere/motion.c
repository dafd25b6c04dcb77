/* SPDX-License-Identifier: MIT */
#include "motion.h"

#include <math.h>
#include <string.h>

/*
 * The place of the vehicle is known to this share of its way since an echo was heard. The whole of it is added however
 * small the steps are: an error in scale does not average out.
 */
#define WAY_ERROR 0.01

static void loosen(struct cell *c, double way_m)
{
    float d = (float)(WAY_ERROR * way_m), ball = sqrtf(c->ball_m2) + d;
    c->sd_m += d;
    c->near_m += d;
    c->ball_m2 = ball * ball;
}

/* Two cells fall together in `c`: the surer, the nearer and the larger win, counts add up. */
static void merge(const struct sphere *s, struct cell *c, const struct cell *other)
{
    double a[3], b[3], range = state_vector(s, c, a), other_range = state_vector(s, other, b);
    float near_m = (float)fmin(range - c->near_m, other_range - other->near_m), apart2 = 0;
    for (int i = 0; i < 3; i++)
        apart2 += (float)((a[i] - b[i]) * (a[i] - b[i]));
    c->ball_m2 = fmaxf(fmaxf(c->ball_m2, other->ball_m2), apart2 / 9);
    c->sd_m = fmaxf(c->sd_m, other->sd_m);
    if (other->t_ref_ns > c->t_ref_ns) {
        c->t_ref_ns = other->t_ref_ns;
        c->sensor = other->sensor;
        c->seq = other->seq;
    }
    if (other->t_echo_ns > c->t_echo_ns || (other->t_echo_ns == c->t_echo_ns && other->misses < c->misses))
        c->misses = other->misses;
    c->logodds = fmaxf(c->logodds, other->logodds);
    c->t_echo_ns = c->t_echo_ns > other->t_echo_ns ? c->t_echo_ns : other->t_echo_ns;
    c->t_first_ms = c->t_first_ms < other->t_first_ms ? c->t_first_ms : other->t_first_ms;
    c->echoes = (uint16_t)fmin(UINT16_MAX, c->echoes + other->echoes);
    c->state = c->state > other->state ? c->state : other->state;
    if (other_range < range)
        memcpy(c->point_m, other->point_m, sizeof c->point_m);
    c->near_m = (float)fmin(range, other_range) - near_m;
}

/* The cheap test for most of the cells that stay where they are; false for some of them. */
static bool surely_stays(const struct sphere *s, const struct cell *c, const double v[3], double range)
{
    const double *edge = s->layers.edge + c->layer, *u = s->axis[c->direction];
    return range >= edge[0] && range < edge[1] && v[0] * u[0] + v[1] * u[1] + v[2] * u[2] > range * s->within_cos;
}

static void place_cell(struct sphere *s, uint32_t index, double way_m)
{
    struct cell *cell = &s->cells.cell[index];
    double v[3], range = state_vector(s, cell, v);
    loosen(cell, way_m);
    const bool sure = surely_stays(s, cell, v, range);
    const int32_t layer = sure ? cell->layer : layers_index(&s->layers, range);
    const uint32_t d = sure ? cell->direction : sphere_holding(s, v);
    if (d == cell->direction && layer == cell->layer) {
        s->nearest_m = fmin(s->nearest_m, s->layers.edge[layer]);
        return;
    }
    const struct cell old = *cell;
    state_release(s, index);
    if (layer < 0 || d == RINGS_NONE)
        return;
    struct cell *c = state_take(s, d, (uint16_t)layer); /* there is room: it was just made */
    if (c->echoes) {
        merge(s, c, &old);
    } else {
        uint32_t next = c->next;
        *c = old;
        c->next = next;
        c->direction = d & CELLS_DIRECTION;
        c->layer = (uint16_t)layer;
    }
    state_mark(s, d);
}

void motion_hang_anew(struct sphere *s)
{
    cells_unhang_all(&s->cells);
    CELLS_EACH (&s->cells, i) {
        const struct cell old = s->cells.cell[i];
        double v[3];
        state_place(s, &old, v);
        const uint32_t there = cells_hang(&s->cells, i, sphere_holding(s, v));
        if (there != CELLS_NONE && there != i)
            merge(s, &s->cells.cell[there], &old);
    }
}

/* Farther in one step than this the old claims say nothing of the new place. */
#define CLAIM_STEP_MOST_M 1.0

static void move_claims(struct sphere *s, const double step_m[3])
{
    for (uint32_t d = 0; d < s->rings.n; d++)
        s->joined[d] = claim_join(&s->direction[d].claim[CLAIM_NOW], &s->direction[d].claim[CLAIM_BEFORE]);
    bool far = geo_length(step_m) > CLAIM_STEP_MOST_M;
    double step_in_grid_m[3];
    state_to_grid(s, step_m, step_in_grid_m);
    for (uint32_t d = 0; d < s->rings.n; d++) {
        struct direction *dir = &s->direction[d];
        if (!dir->claim[CLAIM_NOW].t_ping_ns && s->cells.first[d] == CELLS_NONE)
            continue;
        dir->claim[CLAIM_NOW] =
            far ? (struct claim){0} : claim_moved(&s->rings, s->picture.axis, s->joined, d, step_in_grid_m);
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
    double way_m = geo_length(step_m);
    s->nearest_m = INFINITY;
    CELLS_EACH (&s->cells, i)
        place_cell(s, i, way_m);
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
    for (uint32_t i = 0; i < s->cells.room; i++) /* those that are gone, too: they are asked about */
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
