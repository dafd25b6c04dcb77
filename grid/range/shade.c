/* SPDX-License-Identifier: MIT */
#include "shade.h"

#include <math.h>

#include "grid/geometry.h"

#define BESIDE_DEG  10
#define BESIDE      (BESIDE_DEG * SHADE_ROWS / 360)
#define BESIDE_RAD  (BESIDE_DEG * GEO_PI / 180)
#define SOME_BEAMS  3 /* fewer are no part so wide */
#define TURNS       6
#define MOST_MISSES 3

/* Bearings of a head lie in the middle of rows, or rounding would move them. */
static int row_of(double az_rad)
{
    return (int)lround(geo_wrap(az_rad) / GEO_TURN * SHADE_ROWS) % SHADE_ROWS;
}

/* Did it ring in all that was looked at around the row, so that this lies within a wide part? */
static bool is_within(const struct shade *s, int row)
{
    int beams = 0;
    for (int k = row - BESIDE; k <= row + BESIDE; k++) {
        const struct shade_row *at = &s->row[(k + SHADE_ROWS) % SHADE_ROWS];
        if (at->looked && at->rang == 0)
            return false;
        beams += at->looked;
    }
    return beams >= SOME_BEAMS;
}

/* Does what rang at the row last stand, for all that the other looks say? */
static bool stands(const struct shade *s, int row)
{
    return s->row[row].rang == TURNS || (s->row[row].rang > 0 && s->rings && is_within(s, row));
}

static void miss(struct shade *s, int row, struct beam_echoes *beam)
{
    struct shade_row *at = &s->row[row];
    if (!stands(s, row) || ++at->missed == MOST_MISSES) {
        at->rang = at->missed = 0;
        return;
    }
    beam_frees_nothing(beam);
    beam->hides = BEAM_HIDES_RING;
}

void shade_run(struct shade *s, struct echoes *e)
{
    if (e->n_beams != 1 || e->beam[0].hides == BEAM_HIDES_DEAF)
        return;
    struct beam_echoes *beam = &e->beam[0];
    const double az_rad = (double)beam->az_rad;
    const int row = row_of(az_rad);
    s->rings = s->rings && fabs(geo_wrap_pi(az_rad - (double)s->ring_rad)) <= BESIDE_RAD;
    s->row[row].looked = true;
    if (beam->hides == BEAM_HIDES_RING) {
        s->row[row].rang = s->row[row].rang < TURNS ? s->row[row].rang + 1 : TURNS;
        s->row[row].missed = 0;
        s->rings = true;
        s->ring_rad = beam->az_rad;
    } else if (beam->free_to_m > beam->blind_m)
        miss(s, row, beam);
}
