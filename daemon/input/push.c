/* SPDX-License-Identifier: MIT */
#include "push.h"

#include <math.h>
#include <string.h>

void push_put(struct push *push, uint64_t t_ns, const double n[2])
{
    const double gap_s = (double)(t_ns - push->t_ns) * 1e-9;
    if (push->t_ns && t_ns <= push->t_ns)
        return;
    const double share = push->t_ns && gap_s < PUSH_MEAN_S ? 1 - exp(-gap_s / PUSH_MEAN_S) : 1;
    for (int i = 0; i < 2; i++)
        push->mean_n[i] += (n[i] - push->mean_n[i]) * share;
    push->t_ns = t_ns;
    if (hypot(push->mean_n[0], push->mean_n[1]) < PUSH_LEAST_N)
        return;
    push->drives_ns = t_ns;
    memcpy(push->way_n, push->mean_n, sizeof push->way_n);
}

bool push_way(const struct push *push, uint64_t now_ns, double way[3])
{
    if (!push->drives_ns || now_ns > push->drives_ns + PUSH_HOLD_NS)
        return false;
    memcpy(way, push->way_n, sizeof push->way_n);
    way[2] = 0;
    return true;
}
