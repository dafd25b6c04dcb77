/* SPDX-License-Identifier: MIT */
#include "beside.h"

#include <math.h>

#define LAST_NS    2000000000u /* what a head did longer ago is another sweep */
#define SAME_SHARE 0.02        /* of half a beam's width: so near, an axis is the same */

static bool frees(const struct beam_echoes *h)
{
    return h->free_to_m > h->blind_m;
}

/* A beam that is so far to the right of another; negative: to the left. */
static void reach(struct beam_row *row, double gap_rad)
{
    float *side = gap_rad < 0 ? &row->left_rad : &row->right_rad;
    *side = (float)fabs(gap_rad) / 2;
}

/* The one of a head that came before. While it does not turn, those that its last beam had beside it count. */
static void reach_last(struct beam_row *row, const struct beam *b, const struct beside_last *last)
{
    const struct echoes *e = b->ping;
    if (!last->t_ns || last->t_ns > e->t_ns || e->t_ns - last->t_ns > LAST_NS)
        return;
    const double axis[3] = {(double)last->axis[0], (double)last->axis[1], (double)last->axis[2]};
    const double gap_rad = atan2(geo_dot(axis, b->side), geo_dot(axis, b->axis));
    if (fabs(gap_rad) < SAME_SHARE * (double)e->az_aperture_rad / 2) {
        row->left_rad = last->left_rad;
        row->right_rad = last->right_rad;
    } else if (last->frees) {
        reach(row, gap_rad);
    }
}

/* The next beam of the row, round the whole turn where it goes all the way round; none there: `index` itself. */
static uint16_t next_of(const struct echoes *e, uint16_t index, int step)
{
    const float el_rad = e->beam[index].el_rad;
    int at = index + step;
    if (at >= 0 && at < e->n_beams && e->beam[at].el_rad == el_rad)
        return (uint16_t)at;
    for (at = index; at - step >= 0 && at - step < e->n_beams && e->beam[at - step].el_rad == el_rad;)
        at -= step;
    return (uint16_t)at;
}

/*
 * On a side (-1 the left one, 1 the right one) the row reaches towards the nearest beam there, if that one freed water.
 * Beams of a ping are in order, so it is the next one. A row that does not go all the way round has its other end for a
 * next one at either end: on the side where a nearer one is.
 */
static void reach_side(struct beam_row *row, const struct echoes *e, uint16_t index, int side)
{
    double nearest_rad = INFINITY;
    bool free = false;
    for (int step = -1; step <= 1; step += 2) {
        const struct beam_echoes *other = &e->beam[next_of(e, index, step)];
        const double gap_rad = side * geo_wrap_pi((double)other->az_rad - (double)e->beam[index].az_rad);
        if (gap_rad <= 0 || gap_rad > nearest_rad)
            continue;
        nearest_rad = gap_rad;
        free = frees(other);
    }
    if (free)
        reach(row, side * nearest_rad);
}

struct beam_row beside_row(const struct beam *b, uint16_t index, const struct beside_last *last)
{
    const struct echoes *e = b->ping;
    struct beam_row row = {.half_az_rad = e->az_aperture_rad / 2, .half_el_rad = e->el_aperture_rad / 2};
    reach_side(&row, e, index, -1);
    reach_side(&row, e, index, 1);
    if (e->n_beams == 1)
        reach_last(&row, b, last);
    row.seam_rad = fmaxf(row.left_rad, row.right_rad);
    return row;
}

void beside_keep(struct beside_last *last, const struct beam *b)
{
    const struct beam_row row = beside_row(b, 0, last);
    *last = (struct beside_last){
        .t_ns = b->ping->t_ns, .frees = frees(b->heard), .left_rad = row.left_rad, .right_rad = row.right_rad};
    for (int i = 0; i < 3; i++)
        last->axis[i] = (float)b->axis[i];
}
