/* SPDX-License-Identifier: MIT */
#include "motion.h"

#include <math.h>
#include <string.h>

#include "view.h"

static void loosen(struct cell *c, double by_m)
{
    float d = (float)by_m, ball = sqrtf(c->ball_m2) + d;
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
    c->pending &= other->pending;
    c->state = c->state > other->state ? c->state : other->state;
    if (other_range < range)
        memcpy(c->point_m, other->point_m, sizeof c->point_m);
    c->near_m = (float)fmin(range, other_range) - near_m;
}

/* A layer, or below or beyond all; a direction, or none. */
static void move_cell(struct sphere *s, uint32_t index, uint32_t d, int32_t layer)
{
    const struct cell old = s->cells.cell[index];
    state_mark(s, old.direction);
    const uint32_t there = cells_move(&s->cells, index, d, layer);
    if (there == CELLS_NONE)
        return;
    state_mark(s, d);
    if (there != index)
        merge(s, &s->cells.cell[there], &old);
}

static void place_cell(struct sphere *s, uint32_t index, double way_m, uint64_t t_ns)
{
    struct cell *cell = &s->cells.cell[index];
    double v[3], range = state_vector(s, cell, v);
    loosen(cell, state_way_error_m(s, way_m, cell->t_echo_ns, t_ns));
    const int32_t layer = layers_from(&s->layers, range, cell->layer);
    const bool stays =
        rings_keeps(&s->rings, s->direction[cell->direction].ring, s->axis[cell->direction], v, range);
    const uint32_t d = stays ? cell->direction : sphere_holding(s, v);
    if (d != cell->direction || layer != cell->layer)
        move_cell(s, index, d, layer);
    if (layer >= 0 && s->layers.edge[layer] < s->nearest_m)
        s->nearest_m = s->layers.edge[layer];
}

void motion_reindex(struct sphere *s)
{
    cells_unlink_all(&s->cells);
    CELLS_EACH (&s->cells, i) {
        const struct cell old = s->cells.cell[i];
        double v[3];
        state_place(s, &old, v);
        const uint32_t there = cells_insert(&s->cells, i, sphere_holding(s, v));
        if (there != CELLS_NONE && there != i)
            merge(s, &s->cells.cell[there], &old);
    }
}

/* Obstacles are nearer, but no nearer than half their range: then nobody knows in which direction they are, and
 * blocking says less than that the water is unknown. */
static void bring_nearer(struct sphere *s, double by_m)
{
    CELLS_EACH (&s->cells, i) {
        struct cell *c = &s->cells.cell[i];
        double v[3];
        const double half_m = state_vector(s, c, v) / 2;
        c->near_m = (float)fmax(c->near_m, fmin(c->near_m + by_m, half_m));
        state_mark(s, c->direction);
    }
}

/* Obstacles are nearer by what the drift is more than before. */
static void count_drift(struct sphere *s, const double drift_m[2])
{
    double more_m[2];
    for (int k = 0; k < 2; k++) {
        more_m[k] = fmax(drift_m[k] - s->frame.drift_m[k], 0);
        s->frame.drift_m[k] = drift_m[k];
    }
    bring_nearer(s, hypot(more_m[0], more_m[1]));
}

/*
 * The picture counts a drift that the vehicle has not made yet, so that it holds for some pings; once poses have a
 * position, what it was in the end. Of all pings the greatest counts: one that was dated back brings less.
 */
void motion_drifted(struct sphere *s, const struct pose *pose)
{
    double counts_m[2];
    bool changed = false;
    s->drifts = pose->drift_mps > 0;
    for (int k = 0; k < 2; k++) {
        s->drifted_m[k] = fmax(s->drifted_m[k], pose->drift_m[k]);
        counts_m[k] = s->drifted_m[k] + (s->drifts ? s->conf.recentre_m : 0);
        changed |= s->drifts ? s->drifted_m[k] >= s->frame.drift_m[k] : s->drifted_m[k] != s->frame.drift_m[k];
    }
    if (changed)
        count_drift(s, counts_m);
    s->ahead_m = 0;
    if (s->drifts)
        s->ahead_m = hypot(s->frame.drift_m[0] - pose->drift_m[0], s->frame.drift_m[1] - pose->drift_m[1]);
}

static void recentre(struct sphere *s, const double position_m[3], uint64_t t_ns)
{
    double step_m[3];
    for (int i = 0; i < 3; i++) {
        step_m[i] = position_m[i] - s->frame.centre_m[i];
        s->frame.centre_m[i] = position_m[i];
    }
    double way_m = geo_length(step_m);
    s->nearest_m = INFINITY;
    CELLS_EACH (&s->cells, i)
        place_cell(s, i, way_m, t_ns);
    CELLS_DIRECTIONS(&s->cells, d)
    state_mark(s, d); /* they are seen at another range */
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

void motion_follow(struct sphere *s, const struct pose *pose, uint64_t t_ns)
{
    if (t_ns < s->t_centre_ns) /* it was dated back: the centre has gone on since */
        return;
    s->t_centre_ns = t_ns;
    if (!s->placed) {
        memcpy(s->frame.centre_m, pose->position_m, sizeof s->frame.centre_m);
        memcpy(s->anchor_m, pose->position_m, sizeof s->anchor_m);
        s->placed = true;
        return;
    }
    if (distance(pose->position_m, s->frame.centre_m) > s->conf.recentre_m)
        recentre(s, pose->position_m, t_ns);
    if (distance(s->frame.centre_m, s->anchor_m) > ANCHOR_REACH_M)
        reanchor(s);
}
