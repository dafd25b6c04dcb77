/* SPDX-License-Identifier: MIT */
/* oracle - see oracle.h. */
#include "oracle.h"

#include <math.h>

/* First bin from `from` on that exceeds its cell's threshold; bins of the world: none does. */
static uint32_t first_above(const struct drawn_sound *s, unsigned beam, uint32_t from, double factor)
{
    const struct drawn_world *w = &s->world;
    const uint8_t *sample = (const uint8_t *)s->samples + (size_t)beam * w->bins;
    uint32_t i = from;
    int last = -1;
    unsigned least = 256; /* count of an echo in cell `last` */
    for (; i < w->bins; i++) {
        const int cell = (int)((i + 0.5) * HEARABLE_CELLS / w->bins);
        if (cell != last) {
            const double over = factor * (double)s->truth[beam].hearable.over[cell];
            least = isfinite(over) ? drawn_count(w, over) : 256;
            last = cell;
        }
        if (sample[i] >= least)
            break;
    }
    return i;
}

void oracle_detect(const struct drawn_sound *s, unsigned beam, double factor, struct beam_echoes *out)
{
    const struct drawn_world *w = &s->world;
    const struct hearable *h = &s->truth[beam].hearable;
    const double cell_m = w->range_m / HEARABLE_CELLS;
    int from = 0, to;
    while (from < HEARABLE_CELLS && !(h->cell[from] >> DRAWN_WALL & 1))
        from++;
    for (to = from; to < HEARABLE_CELLS && h->cell[to] >> DRAWN_WALL & 1;)
        to++;
    const uint32_t first = (uint32_t)(from * cell_m / s->insonify.bin_m);
    const uint32_t echo = first_above(s, beam, first, factor);
    const double at_m = echo * s->insonify.bin_m, near_m = at_m - w->pulse_m;
    *out = (struct beam_echoes){.az_rad = s->axis[beam].az_rad,
                                .blind_m = (float)(from * cell_m),
                                .free_to_m = (float)fmin(to * cell_m, near_m),
                                .state = echo < w->bins ? BEAM_ECHO : BEAM_SILENT,
                                .n = echo < w->bins};
    out->echo[0] = (struct echo){.range_m = (float)at_m, .near_m = (float)near_m};
}
