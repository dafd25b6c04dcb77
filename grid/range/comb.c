/* SPDX-License-Identifier: MIT */
#include "comb.h"

#include <math.h>

#define LEAST_PERIOD_S 0.02
#define MOST_PERIOD_S  1.0
#define WIDEST_S       0.004 /* half of the time in which a pulse arrives: long pulses, late hosts ... */
#define WIDEST_SHARE   0.125 /* ... but no more of a period: chance would fill the rest */
#define NARROWEST_S    0.001 /* hosts date no better */
#define LONGEST_S      0.008 /* echoes of one ping so close together are pieces of one pulse */

#define PAIRS     8  /* arrivals before the last one that a period is sought with ... */
#define MULTIPLES 16 /* ... as so many periods at most */

/* Of what only one beam shows, the share that is thought to be pulses where there are any. */
#define SHARE    0.7
#define BELIEVE  20.0 /* log of the odds against chance, after a hundred candidates */
#define HOPELESS -4.0 /* the same: a period is followed back no further */

#define GAIN        0.2 /* of a pulse that is followed */
#define LONGER      1.1 /* than the last piece that was seen, may a pulse be */
#define FADE_LENGTH 0.9
#define MISS        0.5
#define MOST_CREDIT 8.0

void comb_init(struct comb *comb, double sound_mps)
{
    *comb = (struct comb){.second_m = sound_mps / 2.0};
}

void comb_ping(struct comb *c, uint64_t t_ns)
{
    if (c->ping_ns == 0 || t_ns < c->ping_ns) {
        comb_init(c, 2.0 * c->second_m);
        c->origin_ns = c->ping_ns = t_ns;
        return;
    }
    c->interval_s = (double)(t_ns - c->ping_ns) * 1e-9;
    c->ping_ns = t_ns;
}

static double ping_s(const struct comb *c)
{
    return (double)(c->ping_ns - c->origin_ns) * 1e-9;
}

static double arrived_s(const struct comb_arrival *a)
{
    return a->ping_s + a->delay_s;
}

/* How far a time is from the nearest multiple of the period. */
static double off_by(double time_s, double period_s)
{
    return time_s - period_s * floor(time_s / period_s + 0.5);
}

/* A period is not known well enough to look ahead for longer than it has been observed. */
static bool is_stale(const struct comb *c, double t_s)
{
    return t_s - c->seen_s > c->seen_s - c->since_s;
}

/*
 * Could three pings in succession show one reflector when pulses are due? From one to the next, its echo shifts against
 * them by the interval; nothing would tell the two apart.
 */
static bool is_alias(const struct comb *c, double period_s, double width_s)
{
    return fabs(off_by(c->interval_s, period_s)) <= width_s &&
           fabs(off_by(2.0 * c->interval_s, period_s)) <= width_s;
}

/* How long, from the first to the last, an echo may arrive when a pulse is due. */
static double width_of(const struct comb *c)
{
    return 2.0 * c->half_s + c->length_s;
}

static bool begins(const struct comb *c, double arrival_s)
{
    return fabs(off_by(arrival_s - c->pulse_s, c->period_s)) <= c->half_s;
}

uint8_t comb_due(const struct comb *c, const float *near_m, unsigned n, float within_m)
{
    const double now_s = ping_s(c);
    double until_s = -INFINITY;
    uint8_t due = 0;
    if (!c->known || is_stale(c, now_s) || is_alias(c, c->period_s, width_of(c) + (double)within_m / c->second_m))
        return 0;
    for (unsigned i = 0; i < n; i++) {
        const double delay_s = (double)near_m[i] / c->second_m;
        if (delay_s > until_s && begins(c, now_s + delay_s))
            until_s = delay_s + c->length_s;
        due |= (uint8_t)((delay_s <= until_s) << i);
    }
    return due;
}

/* ---- the search ---- */

/* The i-th arrival before the last one. */
static const struct comb_arrival *ago(const struct comb *c, uint32_t i)
{
    return &c->arrival[(c->arrivals - 1 - i) % COMB_ARRIVALS];
}

/* The line through pulses: `back` seconds before the last arrival, k periods. */
struct line {
    double n, k, kk, back, kback; /* sums */
    double period_s, offset_s;
};

static void add_pulse(struct line *l, double k, double back_s)
{
    l->n += 1.0;
    l->k += k;
    l->kk += k * k;
    l->back += back_s;
    l->kback += k * back_s;
    const double spread = l->n * l->kk - l->k * l->k;
    if (spread > 0.0) {
        l->period_s = (l->n * l->kback - l->k * l->back) / spread;
        l->offset_s = (l->back - l->k * l->period_s) / l->n;
    }
}

/* A comb through the last arrivals, 0 .. n - 1. */
struct trail {
    struct line line;
    double half_s, odds; /* log of them, against chance */
    uint32_t n;
};

static double odds_of(double pulses, double others, double chance)
{
    return pulses * log(SHARE / chance) + others * log((1.0 - SHARE) / (1.0 - chance));
}

/* Follows a period, thought to be right after k periods, as far back as that makes it likelier. */
static struct trail follow_back(const struct comb *c, double period_s, double k)
{
    const uint32_t kept = c->arrivals < COMB_ARRIVALS ? c->arrivals : COMB_ARRIVALS;
    const double half_s = fmin(WIDEST_S, WIDEST_SHARE * period_s), chance = 2.0 * half_s / period_s;
    const double hit = odds_of(1.0, 0.0, chance), miss = odds_of(0.0, 1.0, chance), last_s = arrived_s(ago(c, 0));
    struct trail best = {.half_s = half_s};
    struct line line = {.period_s = period_s};
    double odds = 0.0;
    add_pulse(&line, 0.0, 0.0);
    add_pulse(&line, k, k * period_s);
    for (uint32_t i = 1; i < kept && odds > HOPELESS; i++) {
        const double back_s = last_s - arrived_s(ago(c, i));
        const double off_s = off_by(back_s - line.offset_s, line.period_s);
        if (fabs(off_s) <= half_s)
            add_pulse(&line, round((back_s - line.offset_s) / line.period_s), back_s);
        odds += fabs(off_s) <= half_s ? hit : miss;
        if (odds > best.odds)
            best = (struct trail){line, half_s, odds, i + 1};
    }
    return best;
}

static struct trail likeliest(const struct comb *c)
{
    const uint32_t kept = c->arrivals < COMB_ARRIVALS ? c->arrivals : COMB_ARRIVALS;
    struct trail best = {.odds = 0.0};
    for (uint32_t i = 1; i <= PAIRS && i < kept; i++)
        for (int k = 1; k <= MULTIPLES; k++) {
            const double period_s = (arrived_s(ago(c, 0)) - arrived_s(ago(c, i))) / k;
            if (period_s < LEAST_PERIOD_S)
                break;
            if (period_s > MOST_PERIOD_S)
                continue;
            const struct trail t = follow_back(c, period_s, k);
            best = t.odds > best.odds ? t : best;
        }
    return best;
}

static double off_line(const struct comb *c, const struct trail *t, double arrival_s)
{
    return off_by(arrived_s(ago(c, 0)) - arrival_s - t->line.offset_s, t->line.period_s);
}

/* The comb becomes as narrow as its pulses scatter. Returns how many they are. */
static double narrow(const struct comb *c, struct trail *t)
{
    double sum = 0.0, n = 0.0;
    for (uint32_t i = 0; i < t->n; i++) {
        const double off_s = off_line(c, t, arrived_s(ago(c, i)));
        if (fabs(off_s) <= t->half_s) {
            sum += off_s * off_s;
            n += 1.0;
        }
    }
    t->half_s = n > 0.0 ? fmin(t->half_s, fmax(NARROWEST_S, 3.0 * sqrt(sum / n))) : t->half_s;
    return n;
}

/*
 * Were these reflectors, their ranges would have nothing to do with when we sent: how often would any of these
 * ranges, after any of these pings, be on the comb? At most as often as pulses would: that says nothing.
 */
static double chance_of(const struct comb *c, const struct trail *t)
{
    uint32_t on = 0;
    for (uint32_t i = 0; i < t->n; i++)
        for (uint32_t j = 0; j < t->n; j++)
            on += fabs(off_line(c, t, ago(c, i)->ping_s + ago(c, j)->delay_s)) <= t->half_s;
    return fmin((double)on / ((double)t->n * t->n), SHARE);
}

static void search(struct comb *c)
{
    struct trail t = likeliest(c);
    if (t.odds < BELIEVE / 2.0)
        return;
    const double pulses = narrow(c, &t);
    if (is_alias(c, t.line.period_s, 2.0 * t.half_s) || odds_of(pulses, t.n - pulses, chance_of(c, &t)) < BELIEVE)
        return;
    c->known = true;
    c->period_s = t.line.period_s;
    c->pulse_s = arrived_s(ago(c, 0)) - t.line.offset_s;
    c->half_s = t.half_s;
    c->seen_s = arrived_s(ago(c, 0));
    c->since_s = arrived_s(ago(c, t.n - 1));
    c->credit = MOST_CREDIT;
    c->length_s = 0.0;
}

/* ---- the known one ---- */

static void doubt_period(struct comb *c)
{
    c->credit -= MISS;
    c->known = c->credit >= 0.0;
}

static void follow(struct comb *c, double arrival_s)
{
    const double off_s = off_by(arrival_s - c->pulse_s, c->period_s);
    if (!begins(c, arrival_s)) {
        doubt_period(c);
        return;
    }
    c->pulse_s = arrival_s - (1.0 - GAIN) * off_s;
    c->seen_s = arrival_s;
    c->credit = fmin(MOST_CREDIT, c->credit + 1.0);
}

/* The longest of late; one of the next pulses shows it if it is a pulse's. */
static void follow_length(struct comb *c, double length_s)
{
    c->length_s = fmax(LONGER * length_s, FADE_LENGTH * c->length_s);
}

void comb_learn(struct comb *c, const float *near_m, unsigned n, uint8_t lone)
{
    const double now_s = ping_s(c);
    bool came = false;
    if (is_stale(c, now_s))
        c->known = false;
    if (c->known && is_alias(c, c->period_s, width_of(c)))
        doubt_period(c);
    for (unsigned i = 0, next; i < n; i = next) {
        const struct comb_arrival a = {now_s, (double)near_m[i] / c->second_m};
        double length_s = 0.0;
        for (next = i + 1; next < n && (double)near_m[next] / c->second_m - a.delay_s <= LONGEST_S; next++)
            length_s = (double)near_m[next] / c->second_m - a.delay_s;
        if (!(lone >> i & 1) || !(a.delay_s >= 0.0 && a.delay_s < 1.0))
            continue;
        c->arrival[c->arrivals++ % COMB_ARRIVALS] = a;
        came = true;
        if (c->known && begins(c, arrived_s(&a)))
            follow_length(c, length_s);
        if (c->known)
            follow(c, arrived_s(&a));
    }
    if (came && !c->known)
        search(c);
}
