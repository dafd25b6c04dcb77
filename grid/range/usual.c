/* SPDX-License-Identifier: MIT */
#include "usual.h"

#include <string.h>

void usual_init(struct usual *u, uint32_t pings, uint32_t eighths)
{
    u->pings = pings;
    u->eighths = eighths;
    u->n = u->next = 0;
}

/* Where the value is or belongs in the sorted list. */
static uint32_t place_of(const struct usual *u, uint64_t value)
{
    uint32_t at = 0;
    while (at < u->n && u->sorted[at] < value)
        at++;
    return at;
}

void usual_add(struct usual *u, uint64_t value)
{
    if (u->n == u->pings) {
        const uint32_t gone = place_of(u, u->last[u->next]);
        u->n--;
        memmove(&u->sorted[gone], &u->sorted[gone + 1], (u->n - gone) * sizeof u->sorted[0]);
    }
    const uint32_t at = place_of(u, value);
    memmove(&u->sorted[at + 1], &u->sorted[at], (u->n - at) * sizeof u->sorted[0]);
    u->sorted[at] = value;
    u->last[u->next] = value;
    u->next = (u->next + 1) % u->pings;
    u->n++;
}

bool usual_get(const struct usual *u, uint64_t *value)
{
    if (u->n < USUAL_LEAST)
        return false;
    *value = u->sorted[(u->n - 1) * u->eighths / 8];
    return true;
}
