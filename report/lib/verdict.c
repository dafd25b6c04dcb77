/* SPDX-License-Identifier: MIT */
/* verdict - see verdict.h. */
#include "verdict.h"

#include <math.h>

#define HIT_M   0.3
#define EARLY_M 0.15 /* and a pulse: so far before everything an echo is of nothing */
#define ENOUGH  0.85 /* of a world's free water */

/* A wall seen askew, that stands so far out of the water before it, or out of so many counts. */
#define RISE_M     0.3
#define RISE       100.0
#define RISE_COUNT 8

bool verdict_claims(const struct beam_echoes *b, double to_m)
{
    return b->state != BEAM_BLIND && b->free_to_m > b->blind_m && (double)b->free_to_m > to_m;
}

static bool is_moving(const struct drawn_sound *s)
{
    return hypot(s->world.velocity_mps[0], s->world.velocity_mps[1]) > 0.0;
}

static void count_free(struct verdict *v, const struct drawn_sound *s, unsigned beam, const struct beam_echoes *b)
{
    const struct drawn_truth *truth = &s->truth[beam];
    const double cell_m = s->world.range_m / HEARABLE_CELLS;
    const bool moving = is_moving(s);
    for (int k = 0; k < HEARABLE_CELLS && (k + 1) * cell_m <= truth->solid_m; k++) {
        const double middle_m = (k + 0.5) * cell_m;
        const bool said = verdict_claims(b, middle_m) && (double)b->blind_m <= middle_m;
        for (int c = 0; c < DRAWN_CLASSES; c++)
            if (truth->hearable.cell[k] >> c & 1) {
                v->free_m[moving][c] += cell_m;
                v->said_m[moving][c] += said ? cell_m : 0.0;
            }
    }
}

/* How far an echo may lie off what it is an echo of. */
static double near_enough_m(const struct drawn_sound *s, double most_m)
{
    return fmin(most_m, 0.05 * s->world.range_m) + s->world.pulse_m;
}

static bool is_of_nothing(const struct drawn_sound *s, unsigned beam, const struct echo *e)
{
    return (double)e->range_m < s->truth[beam].skirt_m - near_enough_m(s, EARLY_M);
}

static int first_unmarked(const struct beam_echoes *b)
{
    for (int k = 0; k < b->n; k++)
        if (!(b->echo[k].flags & (ECHO_UNCONFIRMED | ECHO_OWN)))
            return k;
    return -1;
}

static bool is_rising(const struct drawn_sound *s, unsigned beam, unsigned k)
{
    const struct drawn_truth *truth = &s->truth[beam];
    const double shown = drawn_power_above(&s->world, RISE_COUNT - 1);
    return s->world.target[k].class == DRAWN_WALL && truth->rise_m[k] > RISE_M &&
           truth->peak[k] > RISE * fmax(truth->before[k], shown);
}

static void count_echoes(struct verdict *v, const struct drawn_sound *s, unsigned beam,
                         const struct beam_echoes *b)
{
    const struct drawn_truth *truth = &s->truth[beam];
    const int unmarked = first_unmarked(b);
    int nearest = -1;
    if (b->n > 0 && is_of_nothing(s, beam, &b->echo[0]))
        v->nothing[drawn_sound_cause(s, beam, (double)b->echo[0].range_m)]++;
    v->nothing_unmarked += unmarked >= 0 && is_of_nothing(s, beam, &b->echo[unmarked]);
    if (b->n > 0 && !is_of_nothing(s, beam, &b->echo[0])) {
        v->something[is_moving(s)]++;
        v->something_marked[is_moving(s)] += unmarked != 0;
    }
    for (unsigned k = 0; k < s->world.targets; k++)
        if (isfinite(truth->hearable.by_m[k]) &&
            (nearest < 0 || truth->hearable.by_m[k] < truth->hearable.by_m[nearest]))
            nearest = (int)k;
    if (nearest < 0)
        return;
    const double slack_m = near_enough_m(s, HIT_M);
    bool hit = false;
    for (int k = 0; k < b->n; k++)
        hit |= (double)b->echo[k].range_m > truth->near_m[nearest] - slack_m &&
               (double)b->echo[k].near_m < fmax(truth->far_m[nearest], truth->hearable.by_m[nearest]) + slack_m;
    v->there[s->world.target[nearest].class]++;
    v->found[s->world.target[nearest].class] += hit;
    if (is_rising(s, beam, (unsigned)nearest)) {
        v->rising++;
        v->rising_found += hit;
        v->rising_past += verdict_claims(b, truth->hearable.by_m[nearest] + VERDICT_PAST_M);
    }
}

static void count_sector(struct verdict_sectors *x, const struct drawn_sound *s, unsigned beam,
                         const struct beam_echoes *b)
{
    const unsigned sector = (unsigned)(geo_wrap((double)b->az_rad) / GEO_TURN * VERDICT_SECTORS) % VERDICT_SECTORS;
    const int k = first_unmarked(b);
    x->looked[sector] = true;
    x->blocked[sector] |= k >= 0 && is_of_nothing(s, beam, &b->echo[k]) &&
                          drawn_sound_cause(s, beam, (double)b->echo[k].range_m) == CAUSE_OTHER_SONAR;
}

void verdict_beam(struct verdict *v, struct verdict_sectors *sectors, const struct drawn_sound *s, unsigned beam,
                  const struct beam_echoes *found)
{
    const struct drawn_truth *truth = &s->truth[beam];
    v->beams++;
    for (int c = 0; c < DRAWN_CLASSES; c++)
        v->past[c] += verdict_claims(found, truth->hearable.target_m[c] + VERDICT_PAST_M);
    v->past_plane += verdict_claims(found, truth->hearable.plane_m + VERDICT_PAST_M);
    if (s->turn == 0)
        return;
    v->settled_beams++;
    count_free(v, s, beam, found);
    count_echoes(v, s, beam, found);
    if (s->world.others == 1 && s->turn == DRAWN_TURNS - 1)
        count_sector(sectors, s, beam, found);
}

void verdict_world(struct verdict *v, const struct verdict_sectors *sectors, const struct verdict *before)
{
    const double free_m = v->free_m[0][DRAWN_WALL] - before->free_m[0][DRAWN_WALL];
    v->worlds += free_m > 0.0;
    v->worlds_free += free_m > 0.0 && v->said_m[0][DRAWN_WALL] - before->said_m[0][DRAWN_WALL] >= ENOUGH * free_m;
    for (int i = 0; i < VERDICT_SECTORS; i++) {
        v->sectors += sectors->looked[i];
        v->sectors_blocked += sectors->blocked[i];
    }
}

void verdict_add(struct verdict *sum, const struct verdict *v)
{
    sum->beams += v->beams;
    sum->settled_beams += v->settled_beams;
    sum->past_plane += v->past_plane;
    sum->nothing_unmarked += v->nothing_unmarked;
    sum->worlds += v->worlds;
    sum->worlds_free += v->worlds_free;
    sum->rising += v->rising;
    sum->rising_found += v->rising_found;
    sum->rising_past += v->rising_past;
    sum->sectors += v->sectors;
    sum->sectors_blocked += v->sectors_blocked;
    for (int moving = 0; moving < 2; moving++) {
        sum->something[moving] += v->something[moving];
        sum->something_marked[moving] += v->something_marked[moving];
    }
    for (int c = 0; c < CAUSES; c++)
        sum->nothing[c] += v->nothing[c];
    for (int c = 0; c < DRAWN_CLASSES; c++) {
        sum->past[c] += v->past[c];
        sum->there[c] += v->there[c];
        sum->found[c] += v->found[c];
        for (int moving = 0; moving < 2; moving++) {
            sum->free_m[moving][c] += v->free_m[moving][c];
            sum->said_m[moving][c] += v->said_m[moving][c];
        }
    }
}

static double share(double part, double whole)
{
    return whole > 0.0 ? part / whole : NAN;
}

static double nothing_at_all(const struct verdict *v)
{
    uint64_t n = 0;
    for (int c = 0; c < CAUSES; c++)
        n += c == CAUSE_OTHER_SONAR || c == CAUSE_SIDE_LOBE ? 0 : v->nothing[c];
    return (double)n;
}

static double free_standing(const struct verdict *v, int c)
{
    return share(v->said_m[0][c], v->free_m[0][c]);
}

static double free_moving(const struct verdict *v, int c)
{
    return share(v->said_m[1][c], v->free_m[1][c]);
}

static double worlds_free(const struct verdict *v, int unused)
{
    (void)unused;
    return share((double)v->worlds_free, (double)v->worlds);
}

static double past(const struct verdict *v, int c)
{
    return share((double)v->past[c], (double)v->beams);
}

static double past_plane(const struct verdict *v, int unused)
{
    (void)unused;
    return share((double)v->past_plane, (double)v->beams);
}

static double of_nothing(const struct verdict *v, int unused)
{
    (void)unused;
    return share(nothing_at_all(v), (double)v->settled_beams);
}

static double of_nothing_unmarked(const struct verdict *v, int unused)
{
    (void)unused;
    return share((double)v->nothing_unmarked, (double)v->settled_beams);
}

static double something_marked(const struct verdict *v, int moving)
{
    return share((double)v->something_marked[moving], (double)v->something[moving]);
}

static double of_cause(const struct verdict *v, int cause)
{
    return share((double)v->nothing[cause], (double)v->settled_beams);
}

static double sectors_blocked(const struct verdict *v, int unused)
{
    (void)unused;
    return share((double)v->sectors_blocked, (double)v->sectors);
}

static double found(const struct verdict *v, int c)
{
    return share((double)v->found[c], (double)v->there[c]);
}

static double rising_found(const struct verdict *v, int unused)
{
    (void)unused;
    return share((double)v->rising_found, (double)v->rising);
}

static double rising_past(const struct verdict *v, int unused)
{
    (void)unused;
    return share((double)v->rising_past, (double)v->rising);
}

const struct verdict_measure verdict_measures[] = {
    {"free", "free water said free standing: % where a wall is heard", ">= 85", false, 100, free_standing,
     DRAWN_WALL},
    {"free_pile", "  where a pile is heard", "", false, 100, free_standing, DRAWN_PILE},
    {"free_net", "  where a net is heard", "", false, 100, free_standing, DRAWN_NET},
    {"free_line", "  where a line is heard", "", false, 100, free_standing, DRAWN_LINE},
    {"worlds_free", "  % of worlds with 85 % of it said free", "", false, 100, worlds_free, 0},
    {"free_moving", "free water said free moving: % where a wall is heard", "", false, 100, free_moving,
     DRAWN_WALL},
    {"past", "free water past a target heard like a wall: of 1e4 beams", "<= 1", true, 1e4, past, DRAWN_WALL},
    {"past_pile", "  like the pile", "", true, 1e4, past, DRAWN_PILE},
    {"past_net", "  like the net", "", true, 1e4, past, DRAWN_NET},
    {"past_line", "  like the line", "", true, 1e4, past, DRAWN_LINE},
    {"past_plane", "  past a surface or bottom or slope that is heard", "", true, 1e4, past_plane, 0},
    {"nothing", "first echo of nothing: % of beams", "<= 1", true, 100, of_nothing, 0},
    {"noise", "  of noise", "", true, 100, of_cause, CAUSE_NOISE},
    {"volume", "  of the water's reverberation", "", true, 100, of_cause, CAUSE_VOLUME},
    {"ring_down", "  of the ring-down", "", true, 100, of_cause, CAUSE_RING},
    {"multipath", "  of multipath", "", true, 100, of_cause, CAUSE_MULTIPATH},
    {"side_lobe", "  of side lobes (not in the sum)", "", true, 100, of_cause, CAUSE_SIDE_LOBE},
    {"other_sonar", "  of other sonars (not in the sum)", "", true, 100, of_cause, CAUSE_OTHER_SONAR},
    {"unmarked", "blocked at once by nothing of any cause: %", "", true, 100, of_nothing_unmarked, 0},
    {"marked", "first echo of something that waits for a second beam when standing: %", "", true, 100,
     something_marked, 0},
    {"marked_moving", "  moving", "", true, 100, something_marked, 1},
    {"sectors_blocked", "sectors blocked by one other sonar in the last turn: %", "<= 3", true, 100,
     sectors_blocked, 0},
    {"walls", "walls found where heard: %", "", false, 100, found, DRAWN_WALL},
    {"rising", "  those that rise over 0.3 m and more to 20 dB", "", false, 100, rising_found, 0},
    {"rising_past", "    free water past them: of 1e4 beams with one", "", true, 1e4, rising_past, 0},
    {"piles", "piles", "", false, 100, found, DRAWN_PILE},
    {"nets", "nets", "", false, 100, found, DRAWN_NET},
    {"lines", "lines", "", false, 100, found, DRAWN_LINE},
};

const unsigned verdict_measures_n = sizeof verdict_measures / sizeof verdict_measures[0];

double verdict_free(const struct verdict *v)
{
    return free_standing(v, DRAWN_WALL);
}

double verdict_past(const struct verdict *v)
{
    return past(v, DRAWN_WALL);
}
