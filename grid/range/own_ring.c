/* SPDX-License-Identifier: MIT */
#include "own_ring.h"

uint64_t own_ring_cell(const struct profile *p, uint32_t i)
{
    const uint32_t n = p->axis->n, half = p->axis->half;
    const uint32_t begin = i > half ? i - half : 0, end = i + half < n ? i + half + 1 : n;
    uint64_t power = 0;
    for (uint32_t k = begin; p->own && k < end; k++)
        power += amplitude_of(p->amplitude, p->own[k]);
    return power >> p->shift;
}

double own_ring_usual(const struct profile *p, const struct baseline *b, uint32_t i)
{
    const double usual = baseline_usual(b, p, i), own = (double)own_ring_cell(p, i);
    return own > usual ? own : usual;
}

uint64_t own_ring_power(const struct profile *p)
{
    uint64_t loudest = 0;
    for (uint32_t i = 0; p->own && i < p->first; i++) {
        const uint64_t cell = own_ring_cell(p, i);
        loudest = cell > loudest ? cell : loudest;
    }
    return loudest;
}

uint32_t own_ring_loud_until(const struct profile *p, uint64_t power)
{
    uint32_t until = p->own ? p->first : 0;
    while (until > 0 && own_ring_cell(p, until - 1) < power / 2)
        until--;
    return until;
}
