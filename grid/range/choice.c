/* SPDX-License-Identifier: MIT */
#include "choice.h"

#include <math.h>

#define AS_STRONG  2    /* an echo with a count over this is as strong as one with the count */
#define LEAST      16   /* no echo is less than full scale over this: the device scales profiles up */
#define RAISED     8    /* of the water before an echo, less than a part in so many is near its counts */
#define NOISE      4    /* more echoes in one profile, the chosen one among them, are none */
#define RISE       1.5  /* a ring-down falls; what is so many times its lowest count so far is something else */
#define NEAR_SHARE 0.05 /* how far from its echo a range is chosen: this share of it, the pulse and so many bins */
#define NEAR_BINS  2    /* a gap of so many in an echo is none */

/* A beam's samples; bins from the head. */
struct beam {
    const struct ping *ping;
    const void *sample;
    uint32_t n;
    double r0, dr;
};

static uint32_t count_of(const struct beam *p, uint32_t i)
{
    return p->ping->sample_bytes == 1 ? ((const uint8_t *)p->sample)[i] : ((const uint16_t *)p->sample)[i];
}

static double edge_m(const struct beam *p, uint32_t i)
{
    return p->r0 + i * p->dr;
}

/* The first bin whose near edge is at range_m or beyond; n at most. */
static uint32_t bin_from(const struct beam *p, double range_m)
{
    const double bin = ceil(fmax(range_m - p->r0, 0.0) / p->dr - 1e-6);
    return bin < p->n ? (uint32_t)bin : p->n;
}

static uint32_t full_scale(const struct beam *p)
{
    return p->ping->sample_bytes == 1 ? UINT8_MAX : UINT16_MAX;
}

static uint32_t loudest(const struct beam *p, uint32_t begin, uint32_t end)
{
    uint32_t at = begin;
    for (uint32_t i = begin; i < end; i++)
        at = count_of(p, i) > count_of(p, at) ? i : at;
    return at;
}

/* The first bin of begin .. end - 1 with that count or more; end: there is none. */
static uint32_t next_loud(const struct beam *p, uint32_t begin, uint32_t end, uint32_t count)
{
    while (begin < end && count_of(p, begin) < count)
        begin++;
    return begin;
}

static uint32_t next_quiet(const struct beam *p, uint32_t begin, uint32_t end, uint32_t count)
{
    while (begin < end && count_of(p, begin) >= count)
        begin++;
    return begin;
}

/* Bins of the near end: while it transmits, and up to where the ring-down ends at the latest. */
struct near_end {
    uint32_t sends, most;
};

static struct near_end near_end_of(const struct beam *p, const struct choice_ring *ring)
{
    const double most =
        floor(fmax((double)p->ping->deaf_m - p->r0, 0.0) / p->dr + 0.5); /* its middle lies before */
    struct near_end e = {bin_from(p, (double)p->ping->pulse_m), most < p->n ? (uint32_t)most : p->n};

    if (ring->promised_m >= 0.0)
        e.sends = bin_from(p, ring->promised_m);
    e.most = e.most > e.sends ? e.most : e.sends;
    return e;
}

/* The bin behind those of the near end that have half of its greatest count: the same whatever the gain. */
static uint32_t loud_until(const struct beam *p, struct near_end e)
{
    const uint32_t most = e.most > 0 ? count_of(p, loudest(p, 0, e.most)) : 0;
    return most > 0 ? next_quiet(p, e.sends, p->n, (most + AS_STRONG - 1) / AS_STRONG) : 0;
}

/* The bin behind the ring-down, where counts from `loud` on matter. */
static uint32_t ring_end(const struct beam *p, struct near_end e, uint32_t loud)
{
    uint32_t at = e.sends, lowest = UINT32_MAX;
    for (; at < p->n && e.most > 0 && count_of(p, at) >= loud && count_of(p, at) <= RISE * lowest; at++)
        lowest = count_of(p, at) < lowest ? count_of(p, at) : lowest;
    return at;
}

/* How far the chosen echo may lie from its range, in bins. */
struct window {
    uint32_t begin, end;
};

static struct window window_of(const struct beam *p, double range_m, uint32_t from)
{
    if (range_m <= 0.0)
        return (struct window){from, p->n};
    const double off = NEAR_SHARE * range_m + (double)p->ping->pulse_m + NEAR_BINS * p->dr;
    struct window w = {bin_from(p, range_m - off - p->dr), bin_from(p, range_m + off)};
    w.begin = w.begin > from ? w.begin : from;
    return w;
}

/* What a profile shows under one echo's count: bins, and how far the water is free. */
struct shown {
    uint32_t most;          /* the echo's greatest count */
    uint32_t first, behind; /* of the first echo as strong: its first bin, and the one behind it */
    bool heard, rings, another;
    double from_m;
};

static bool rings_on(const struct beam *p, struct near_end e, uint32_t end, uint32_t loud, uint32_t until,
                     const struct choice_ring *ring)
{
    const uint32_t guard = 1 + (uint32_t)fmin(ceil((double)p->ping->pulse_m / p->dr), PING_MAX_BINS);
    if (end > e.sends && end > e.most)
        return true;
    return ring->learnt && until > ring->usual + guard && next_loud(p, 0, e.most, loud) < e.most;
}

/* Most of the water before the first echo is well below it, and there are few as strong. */
static bool stands_out(const struct beam *p, uint32_t begin, uint32_t first, uint32_t loud)
{
    uint32_t raised = 0, echoes = 0, gap = NEAR_BINS + 1;
    for (uint32_t i = begin; i < first; i++)
        raised += AS_STRONG * count_of(p, i) >= loud;
    for (uint32_t i = first; i < p->n; i++) {
        const bool is_loud = count_of(p, i) >= loud;
        echoes += is_loud && gap > NEAR_BINS;
        gap = is_loud ? 0 : gap + 1;
    }
    return RAISED * raised <= first - begin && echoes <= NOISE;
}

/* range_m 0: of the loudest echo. */
static struct shown look(const struct beam *p, double range_m, uint32_t until, const struct choice_ring *ring)
{
    const struct near_end e = near_end_of(p, ring);
    const struct window w = window_of(p, range_m, e.most);
    struct shown s = {.from_m = fmax(fmax(p->r0, (double)p->ping->deaf_m), ring->promised_m)};
    if (w.begin >= w.end)
        return s;
    const uint32_t chosen = loudest(p, w.begin, w.end), loud = (count_of(p, chosen) + AS_STRONG - 1) / AS_STRONG;
    s.most = count_of(p, chosen);
    if (s.most < full_scale(p) / LEAST)
        return s;
    const uint32_t begin = ring_end(p, e, loud); /* of the water */
    s.rings = rings_on(p, e, begin, loud, until, ring);
    s.from_m = fmax(s.from_m, edge_m(p, begin));
    if (begin > chosen)
        return s;
    s.first = next_loud(p, begin, chosen, loud);
    s.behind = next_quiet(p, s.first, p->n, loud);
    s.rings |= s.first == 0; /* what is loud where the scan begins may begin before */
    s.another = range_m > 0.0 && s.behind <= w.begin;
    s.heard = !s.rings && stands_out(p, begin, s.first, loud);
    return s;
}

/* Half a pulse, or half a bin: what an echo of its own may begin before its first bin. */
static double half_m(const struct beam *p)
{
    return fmax((double)p->ping->pulse_m, p->dr) / 2.0;
}

static void enter_first(const struct beam *p, const struct shown *s, uint32_t chosen_count, struct choice *out)
{
    const uint32_t at = loudest(p, s->first, s->behind);
    if (edge_m(p, s->first) < s->from_m)
        return;
    out->echo_m = edge_m(p, at) + p->dr / 2.0;
    out->echo_near_m = edge_m(p, s->first) - half_m(p);
    out->weaker = count_of(p, at) < chosen_count;
}

void choice_judge(const struct ping *ping, uint16_t b, double range_m, const struct choice_ring *ring,
                  struct choice *out)
{
    const size_t at = (size_t)b * ping->n_bins * ping->sample_bytes;
    const struct beam p = {.ping = ping,
                           .sample = (const uint8_t *)ping->samples + at,
                           .n = ping->n_bins,
                           .r0 = (double)ping->r0_m,
                           .dr = (double)ping->dr_m};
    const struct near_end e = near_end_of(&p, ring);
    const uint32_t until = loud_until(&p, e);
    const struct shown s = look(&p, range_m, until, ring);
    *out = (struct choice){
        .heard = s.heard, .rings = s.rings, .loud_until = until < e.most ? until : e.most, .from_m = s.from_m};
    if (s.heard) {
        const double first_m = edge_m(&p, s.first);
        const double bounce_m = s.another || range_m <= 0.0 ? first_m : fmin(first_m, range_m);
        if (s.another || range_m <= 0.0)
            enter_first(&p, &s, range_m > 0.0 ? s.most : UINT32_MAX, out);
        if (!choice_may_be_double((float)bounce_m, (float)s.from_m))
            out->to_m = s.another ? first_m - half_m(&p) : first_m;
    } else if (range_m > 0.0) { /* what the profile does show is not withheld */
        const struct shown own = look(&p, 0.0, until, ring);
        if (own.heard && edge_m(&p, own.behind) < range_m)
            enter_first(&p, &own, UINT32_MAX, out);
    }
}
