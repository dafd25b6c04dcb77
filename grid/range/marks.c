/* SPDX-License-Identifier: MIT */
#include "marks.h"

#include <math.h>
#include <string.h>

#define FRESH_NS        60000000000u /* a slow turn, and then some */
#define UNPLACED_NS     10000000000u /* without a position: the pass under way, before the vehicle has drifted far */
#define MOST_MOVED_M    0.2f
#define LEAST_DENIALS   2
#define LEAST_WIDTH_RAD 0.01f

void marks_init(struct marks *marks, double sound_mps)
{
    memset(marks, 0, sizeof *marks);
    comb_init(&marks->comb, sound_mps);
}

static uint32_t row_of(double az_rad)
{
    return (uint32_t)(geo_wrap(az_rad) * (MARKS_ROWS / (2.0 * GEO_PI))) % MARKS_ROWS;
}

/* How far two looks' ranges of one thing may lie apart: it need not stand square to the beams. */
static float same_within(float range_m)
{
    return 0.1f + 0.03f * range_m;
}

static uint8_t near_edges(const struct beam_echoes *b, float near_m[ECHOES_PER_BEAM])
{
    for (int i = 0; i < b->n; i++)
        near_m[i] = b->echo[i].near_m;
    return b->n;
}

static uint8_t due_of(const struct marks *m, const struct echoes *e, const struct beam_echoes *b)
{
    float near_m[ECHOES_PER_BEAM];
    const uint8_t n = near_edges(b, near_m);
    return comb_due(&m->comb, near_m, n, same_within(e->range_max_m));
}

static struct marks_look look_of(const struct marks *m, const struct echoes *e, const struct beam_echoes *b)
{
    struct marks_look look = {
        .t_ns = e->t_ns,
        .az_rad = b->az_rad,
        .el_rad = b->el_rad,
        .heard_from_m = b->heard_from_m,
        .heard_to_m = b->heard_to_m,
        .placed = e->pose.has & POSE_ATTITUDE && e->pose.has & (POSE_POSITION | POSE_VELOCITY),
        .turned = (e->pose.has & POSE_ATTITUDE) != 0,
        .n = b->n,
        .due = due_of(m, e, b),
    };
    for (int i = 0; i < 3; i++)
        look.position_m[i] = (float)(e->pose.position_m[i] - m->origin_m[i]);
    for (int i = 0; i < 4; i++)
        look.attitude[i] = (float)e->pose.attitude[i];
    for (int i = 0; i < b->n; i++)
        look.range_m[i] = b->echo[i].range_m;
    return look;
}

/* Is an older look evidence about the new one, whose beams are width_rad wide? */
static bool still_holds(const struct marks_look *old, const struct marks_look *now, float width_rad)
{
    float moved = 0.0f, cosine = 0.0f;
    if (old->t_ns == 0 || old->t_ns >= now->t_ns || old->placed != now->placed || old->turned != now->turned ||
        now->t_ns - old->t_ns > (now->placed ? FRESH_NS : UNPLACED_NS))
        return false;
    for (int i = 0; i < 3 && now->placed; i++)
        moved = fmaxf(moved, fabsf(old->position_m[i] - now->position_m[i]));
    for (int i = 0; i < 4; i++)
        cosine += old->attitude[i] * now->attitude[i];
    /* the angle between two attitudes is twice that between the quaternions: 1 - cos(angle / 2) = angle^2 / 8 */
    return moved <= MOST_MOVED_M && (!now->turned || 1.0f - fabsf(cosine) <= width_rad * width_rad / 32.0f);
}

static bool is_beside(const struct marks_look *old, float az_rad, float el_rad, float width_rad)
{
    return fabs(geo_wrap_pi((double)old->az_rad - (double)az_rad)) <= (double)width_rad &&
           fabsf(old->el_rad - el_rad) <= width_rad;
}

/* Echoes of a look at this range, a set of bits. */
static uint8_t shown_by(const struct marks_look *look, float range_m)
{
    uint8_t shown = 0;
    for (int i = 0; i < look->n; i++)
        shown |= (uint8_t)((fabsf(look->range_m[i] - range_m) <= same_within(range_m)) << i);
    return shown;
}

static bool denies(const struct marks_look *look, float range_m)
{
    return range_m > look->heard_from_m && range_m < look->heard_to_m;
}

/*
 * The echo's marks, a set of enum echo_flag, by what the beams beside it show and deny. One look confirms an echo. But
 * the next beam of the same pass hears much of the same water with the same speckle, so a faint one needs more looks
 * for it than against it: those of the last pass count, too. And two pulses of another sonar are no evidence of a
 * thing in the water: where a pulse was due in both beams, the one does not confirm the other.
 * lone: there were looks, and none confirms it.
 */
static uint8_t marks_by_neighbours(const struct marks *m, const struct marks_look *now, const struct echo *echo,
                                   bool due, float width_rad, bool *lone)
{
    const uint32_t reach =
        (uint32_t)fmin(ceil((double)width_rad * MARKS_ROWS / (2.0 * GEO_PI)), MARKS_ROWS / 2.0 - 1);
    const uint32_t begin = row_of((double)now->az_rad) + MARKS_ROWS - reach;
    const bool faint = (echo->flags & ECHO_FAINT) != 0;
    uint32_t looks = 0, confirmed = 0, denials = 0;

    for (uint32_t i = 0; i <= 2 * reach; i++) {
        const struct marks_look *old = &m->row[(begin + i) % MARKS_ROWS];
        if (!still_holds(old, now, width_rad) || !is_beside(old, now->az_rad, now->el_rad, width_rad))
            continue;
        const uint8_t shown = shown_by(old, echo->range_m);
        const bool confirms = (due ? shown & ~old->due : shown) != 0;
        if (confirms && !faint) {
            *lone = false;
            return 0;
        }
        looks++;
        confirmed += confirms;
        denials += !shown && denies(old, echo->range_m);
    }
    *lone = looks > 0 && confirmed == 0;
    if (confirmed > denials)
        return 0;
    return echo->flags |
           (denials >= LEAST_DENIALS ? ECHO_BURST
            : denials                ? ECHO_ALONE
                                     : 0) |
           (due ? ECHO_OTHER : 0);
}

/* The nearest echo on the other side of the head, in a row next to the opposite bearing; 0: not known. */
static float opposite_m(const struct marks *m, const struct marks_look *now, float width_rad)
{
    const double az = (double)now->az_rad + GEO_PI;
    const uint32_t reach =
        (uint32_t)fmin(ceil((double)width_rad * MARKS_ROWS / (2.0 * GEO_PI)), MARKS_ROWS / 2.0 - 1);
    float nearest = 0.0f;

    for (uint32_t i = 0; i <= 2 * reach; i++) {
        const struct marks_look *old = &m->row[(row_of(az) + MARKS_ROWS - reach + i) % MARKS_ROWS];
        if (still_holds(old, now, width_rad) && old->n && is_beside(old, (float)az, -now->el_rad, width_rad) &&
            (nearest == 0.0f || old->range_m[0] < nearest))
            nearest = old->range_m[0];
    }
    return nearest;
}

static bool is_ghost_at(float range_m, float ghost_m)
{
    return fabsf(range_m - ghost_m) <= 0.05f + 0.025f * ghost_m;
}

/* Returns the echoes that beams beside it do not show, a set of bits. */
static uint8_t mark_beam(const struct marks *m, struct beam_echoes *b, const struct marks_look *now,
                         float width_rad)
{
    const float opposite = b->n > 1 ? opposite_m(m, now, width_rad) : 0.0f;
    uint8_t unshown = 0;
    for (int i = 0; i < b->n; i++) {
        struct echo *echo = &b->echo[i];
        const float twice_m = 2.0f * b->echo[0].range_m;
        bool lone;
        echo->flags = marks_by_neighbours(m, now, echo, now->due >> i & 1, width_rad, &lone);
        unshown |= (uint8_t)(lone << i);
        if (i > 0 && echo->strength < b->echo[0].strength &&
            (is_ghost_at(echo->range_m, twice_m) ||
             (opposite > 0.0f && is_ghost_at(echo->range_m, twice_m + opposite))))
            echo->flags |= ECHO_GHOST;
    }
    return unshown;
}

void marks_run(struct marks *m, struct echoes *e)
{
    const float width_rad = fmaxf(e->az_aperture_rad, LEAST_WIDTH_RAD);
    float near_m[ECHOES_PER_BEAM];
    uint8_t n = 0, unshown = 0;
    if (!m->placed)
        memcpy(m->origin_m, e->pose.position_m, sizeof m->origin_m);
    m->placed = true;
    comb_ping(&m->comb, e->t_ns);
    for (uint16_t i = 0; i < e->n_beams; i++) {
        const struct marks_look now = look_of(m, e, &e->beam[i]);
        const uint8_t of_beam = mark_beam(m, &e->beam[i], &now, width_rad);
        if (unshown == 0 && of_beam != 0) { /* what other beams of this ping show is the same pulse */
            unshown = of_beam;
            n = near_edges(&e->beam[i], near_m);
        }
    }
    for (uint16_t i = 0; i < e->n_beams; i++)
        m->row[row_of((double)e->beam[i].az_rad)] = look_of(m, e, &e->beam[i]);
    comb_learn(&m->comb, near_m, n, unshown);
}
