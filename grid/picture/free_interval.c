/* SPDX-License-Identifier: MIT */
#include "free_interval.h"

#include <math.h>
#include <string.h>

static struct free_interval interval_of(const struct stretch *s, const struct free_ping *ping)
{
    return (struct free_interval){.t_ping_ns = ping->t_ns,
                                  .path_m = ping->path_m,
                                  .from_m = (float)s->from_m,
                                  .to_m = (float)s->to_m,
                                  .sensors = 1ull << (ping->sensor % 64)};
}

static bool holds(const struct free_interval *f)
{
    return f->t_ping_ns && f->to_m > f->from_m;
}

static bool touch(const struct free_interval *a, const struct free_interval *b)
{
    return a->from_m <= b->to_m && b->from_m <= a->to_m;
}

static struct free_interval joined(const struct free_interval *a, const struct free_interval *b)
{
    return (struct free_interval){.t_ping_ns = a->t_ping_ns < b->t_ping_ns ? a->t_ping_ns : b->t_ping_ns,
                                  .path_m = fmin(a->path_m, b->path_m),
                                  .from_m = fminf(a->from_m, b->from_m),
                                  .to_m = fmaxf(a->to_m, b->to_m),
                                  .sensors = a->sensors | b->sensors};
}

void free_none(struct free_interval *list)
{
    memset(list, 0, FREE_INTERVALS * sizeof *list);
}

void free_withdraw(struct free_interval *list, const struct free_ping *ping)
{
    free_none(list);
    list[0] = interval_of(&(struct stretch){0}, ping);
}

void free_spend(struct free_interval *list, const struct free_ping *ping)
{
    free_none(list);
    list[0] = interval_of(&(struct stretch){.to_m = -1}, ping);
}

/* It was observed, though nothing of it is free. */
static void look_at_nothing(struct free_interval *list, const struct free_ping *ping)
{
    if (!list[0].t_ping_ns)
        list[0] = interval_of(&(struct stretch){0}, ping);
}

/* Intervals while they are put together: one more than there is room for, and one that may be split. */
struct parts {
    struct free_interval part[FREE_INTERVALS + 2];
    unsigned n;
};

/* Takes in what is left of f beside the new interval, which may be something on both sides. */
static void keep_beside(struct parts *o, const struct free_interval *f, const struct free_interval *fresh)
{
    struct free_interval near = *f, far = *f;
    if (!holds(f))
        return;
    near.to_m = fminf(f->to_m, fresh->from_m);
    far.from_m = fmaxf(f->from_m, fresh->to_m);
    if (holds(&near) && o->n < FREE_INTERVALS + 2)
        o->part[o->n++] = near;
    if (holds(&far) && o->n < FREE_INTERVALS + 2)
        o->part[o->n++] = far;
}

static void remove_part(struct parts *o, unsigned k)
{
    memmove(&o->part[k], &o->part[k + 1], (--o->n - k) * sizeof o->part[0]);
}

/* What joining two parts costs: so much water counts as so much older, in m s. */
static double cost_of(const struct free_interval *a, const struct free_interval *b)
{
    const struct free_interval *newer = a->t_ping_ns > b->t_ping_ns ? a : b, *older = newer == a ? b : a;
    return ((double)newer->to_m - (double)newer->from_m) * (double)(newer->t_ping_ns - older->t_ping_ns) * 1e-9;
}

/* One part less: see FREE_INTERVALS. Of parts that do not touch the first stays. */
static void lose_one(struct parts *o)
{
    unsigned first = o->n, second = o->n, shortest = 1;
    double least = INFINITY;
    for (unsigned i = 0; i < o->n; i++) {
        if (i > 0 && o->part[i].to_m - o->part[i].from_m < o->part[shortest].to_m - o->part[shortest].from_m)
            shortest = i;
        for (unsigned k = i + 1; k < o->n; k++) {
            const double cost = cost_of(&o->part[i], &o->part[k]);
            if (touch(&o->part[i], &o->part[k]) && cost < least) {
                least = cost;
                first = i;
                second = k;
            }
        }
    }
    if (first == o->n) {
        remove_part(o, shortest);
        return;
    }
    o->part[first] = joined(&o->part[first], &o->part[second]);
    remove_part(o, second);
}

void free_add(struct free_interval *list, const struct stretch *s, const struct free_ping *ping)
{
    const struct free_interval fresh = interval_of(s, ping);
    struct parts all = {.part = {fresh}, .n = 1};
    if (!s->leaves_aside && s->ends_at_echo)
        for (unsigned i = 0; i < FREE_INTERVALS; i++)
            list[i].to_m = fminf(list[i].to_m, (float)s->look_to_m);
    if (!holds(&fresh)) {
        look_at_nothing(list, ping);
        return;
    }
    for (int k = 0; k < FREE_INTERVALS; k++)
        keep_beside(&all, &list[k], &fresh);
    while (all.n > FREE_INTERVALS)
        lose_one(&all);
    memcpy(list, all.part, all.n * sizeof *list);
    memset(&list[all.n], 0, (FREE_INTERVALS - all.n) * sizeof *list);
}

static bool has_it(const struct free_interval *list, const struct free_interval *f)
{
    for (int k = 0; k < FREE_INTERVALS; k++)
        if (list[k].t_ping_ns && f->from_m >= list[k].from_m && f->to_m <= list[k].to_m)
            return true;
    return false;
}

/* What is left of f beside interval k of the list and those behind it: added to o. */
static void add_rest(struct parts *o, struct free_interval f, const struct free_interval *list, unsigned k)
{
    for (; k < FREE_INTERVALS && holds(&f); k++) {
        if (!holds(&list[k]) || !touch(&list[k], &f))
            continue;
        struct free_interval near = f;
        near.to_m = fminf(f.to_m, list[k].from_m);
        if (holds(&near))
            add_rest(o, near, list, k + 1);
        f.from_m = fmaxf(f.from_m, list[k].to_m);
    }
    if (holds(&f) && o->n < FREE_INTERVALS + 2)
        o->part[o->n++] = f;
}

void free_fill(struct free_interval *list, const struct stretch *s, const struct free_ping *ping, float *limit_m)
{
    struct free_interval f = interval_of(s, ping);
    const bool echo = !s->leaves_aside && s->ends_at_echo && (float)s->look_to_m < *limit_m;
    f.to_m = fminf(f.to_m, *limit_m);
    if (echo)
        *limit_m = (float)s->look_to_m;
    if (!holds(&f))
        look_at_nothing(list, ping);
    if (!holds(&f) || has_it(list, &f))
        return;
    struct parts all = {.n = 0};
    for (int k = 0; k < FREE_INTERVALS; k++)
        if (holds(&list[k]))
            all.part[all.n++] = list[k];
    add_rest(&all, f, list, 0);
    while (all.n > FREE_INTERVALS)
        lose_one(&all);
    memcpy(list, all.part, all.n * sizeof *list);
    memset(&list[all.n], 0, (FREE_INTERVALS - all.n) * sizeof *list);
}

struct free_interval free_longest(const struct free_interval *list, unsigned n)
{
    struct free_interval longest = {0};
    bool used[FREE_INTERVALS + 1] = {false};
    for (unsigned i = 0; i < n; i++) {
        struct free_interval run = list[i];
        if (used[i] || !holds(&run))
            continue;
        for (unsigned k = 0; k < n;) { /* from the beginning again whenever the run has grown */
            if (k != i && !used[k] && holds(&list[k]) && touch(&run, &list[k])) {
                run = joined(&run, &list[k]);
                used[k] = true;
                k = 0;
            } else {
                k++;
            }
        }
        if (!longest.t_ping_ns || run.to_m - run.from_m > longest.to_m - longest.from_m)
            longest = run;
    }
    return longest;
}

#define CLEAR_FOR_LEAST_S 30.0
#define CLEAR_FOR_TURNS   1.5

double free_clear_for_s(double turn_s, double forget_s)
{
    return fmin(fmax(CLEAR_FOR_LEAST_S, CLEAR_FOR_TURNS * turn_s), forget_s);
}
