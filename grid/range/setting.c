/* SPDX-License-Identifier: MIT */
#include "setting.h"

/*
 * A floor or a ring-down that stays another is the usual one soon. How loud the head itself rings does not change, and a
 * wall may stand beside it at most bearings of a turn.
 */
#define SOON_PINGS 64
#define TURN_PINGS 512

void settings_clear(struct settings *s)
{
    s->pings = 0;
    for (int i = 0; i < SETTINGS; i++)
        s->setting[i].used = 0;
}

static bool same_axis(const struct profile_axis *a, const struct profile_axis *b)
{
    return a->n == b->n && a->r0 == b->r0 && a->dr == b->dr && a->resolution_bins == b->resolution_bins;
}

static struct setting *find(struct settings *s, const struct profile_axis *axis)
{
    struct setting *oldest = s->setting;

    for (struct setting *t = s->setting; t < s->setting + SETTINGS; t++) {
        if (t->used && same_axis(&t->axis, axis))
            return t;
        oldest = t->used < oldest->used ? t : oldest;
    }
    oldest->axis = *axis;
    usual_init(&oldest->floor, SOON_PINGS, 4);
    usual_init(&oldest->ring_down, SOON_PINGS, 4);
    usual_init(&oldest->ring_power, TURN_PINGS, 1);
    usual_init(&oldest->ring_loud, SOON_PINGS, 4);
    return oldest;
}

struct setting *settings_for(struct settings *s, const struct profile_axis *axis)
{
    struct setting *t = find(s, axis);

    t->used = ++s->pings;
    return t;
}
