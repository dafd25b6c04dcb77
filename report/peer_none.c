/* SPDX-License-Identifier: MIT */
/* peer_none - where OctoMap's library is not installed; see peer.h. */
#include "peer.h"

struct peer *peer_make(double voxel_m)
{
    (void)voxel_m;
    return NULL;
}

void peer_free(struct peer *p)
{
    (void)p;
}

void peer_enter(struct peer *p, const double from[3], const float (*to)[3], size_t n, double most_m)
{
    (void)p, (void)from, (void)to, (void)n, (void)most_m;
}

size_t peer_bytes(const struct peer *p)
{
    (void)p;
    return 0;
}

enum peer_state peer_at(const struct peer *p, const double at[3])
{
    (void)p, (void)at;
    return PEER_UNKNOWN;
}
