/* SPDX-License-Identifier: MIT */
#include "setting.h"

/*
 * A ring-down that stays another is the usual one soon. How loud the head itself rings does not change, and a wall may
 * stand beside it at most bearings of a turn.
 */
#define SOON_PINGS 64
#define TURN_PINGS 512

size_t settings_bytes(uint32_t max_bins)
{
    return SETTINGS * baseline_bytes(max_bins);
}

void settings_init(struct settings *s, void *memory, uint32_t max_bins)
{
    for (int i = 0; i < SETTINGS; i++)
        baseline_init(&s->setting[i].baseline, (char *)memory + (size_t)i * baseline_bytes(max_bins), max_bins);
    settings_clear(s);
}

void settings_clear(struct settings *s)
{
    s->pings = 0;
    for (int i = 0; i < SETTINGS; i++)
        s->setting[i].used = 0;
}

static bool same_axis(const struct profile_axis *a, const struct profile_axis *b)
{
    return a->n == b->n && a->r0 == b->r0 && a->dr == b->dr && a->resolution_bins == b->resolution_bins &&
           a->deaf == b->deaf;
}

static struct setting *find(struct settings *s, const struct profile_axis *axis, uint8_t gain)
{
    struct setting *oldest = s->setting;
    for (struct setting *t = s->setting; t < s->setting + SETTINGS; t++) {
        if (t->used && t->gain == gain && same_axis(&t->axis, axis))
            return t;
        oldest = t->used < oldest->used ? t : oldest;
    }
    oldest->axis = *axis;
    oldest->gain = gain;
    baseline_clear(&oldest->baseline);
    hearing_clear(&oldest->hearing);
    usual_init(&oldest->ring_down, SOON_PINGS, 4);
    usual_init(&oldest->ring_power, TURN_PINGS, 1);
    usual_init(&oldest->ring_loud, SOON_PINGS, 4);
    usual_init(&oldest->choice_ring, TURN_PINGS, 1);
    usual_init(&oldest->echo_power, TURN_PINGS, 4);
    return oldest;
}

struct setting *settings_for(struct settings *s, const struct profile_axis *axis, uint8_t gain)
{
    struct setting *t = find(s, axis, gain);
    t->used = ++s->pings;
    return t;
}
