/* SPDX-License-Identifier: MIT */
#include "shares.h"

#include <stdlib.h>

static int by_program(const void *a, const void *b)
{
    const struct share *x = a, *y = b;
    const int order = peer_order(x->peer, y->peer);
    return order != 0 ? order : x->slot - y->slot;
}

/* A user's and a program's clients come to lie side by side: there may be as many programs as clients. */
static void sum_up(struct share *share, int n)
{
    qsort(share, (size_t)n, sizeof *share, by_program);
    for (int from = 0, to; from < n; from = to) {
        double sum = 0;
        for (to = from; to < n && share[to].peer->uid == share[from].peer->uid; to++)
            sum += share[to].amount;
        for (int i = from; i < to; i++)
            share[i].of_user = sum;
    }
    for (int from = 0, to; from < n; from = to) {
        double sum = 0;
        for (to = from; to < n && peer_same_program(share[to].peer, share[from].peer); to++)
            sum += share[to].amount;
        for (int i = from; i < to; i++)
            share[i].of_program = sum;
    }
}

static bool may_yield(const struct share *s, const struct share *wanted, bool same_user)
{
    if (s->kept || s->amount <= 0 || (s->peer->uid == wanted->peer->uid) != same_user)
        return false;
    return !same_user || wanted->kept || !peer_same_program(s->peer, wanted->peer);
}

static bool is_heavier(const struct share *a, const struct share *b, bool same_user)
{
    if (!same_user && a->of_user != b->of_user)
        return a->of_user > b->of_user;
    if (a->of_program != b->of_program)
        return a->of_program > b->of_program;
    if (a->amount != b->amount)
        return a->amount > b->amount;
    return a->since_ns != b->since_ns ? a->since_ns < b->since_ns : a->slot < b->slot;
}

/* Of other users, or of other programs of the same, one client of who has most; NULL: there is none. */
static const struct share *of_most(const struct share *share, int n, const struct share *wanted, bool same_user)
{
    const struct share *most = NULL;
    for (int i = 0; i < n; i++)
        if (may_yield(&share[i], wanted, same_user) && (!most || is_heavier(&share[i], most, same_user)))
            most = &share[i];
    return most;
}

/* Of all clients of the wanted one's user, or program. */
static double own(const struct share *share, int n, const struct share *wanted, bool of_program)
{
    double sum = 0;
    for (int i = 0; i < n; i++) {
        const bool same =
            of_program ? peer_same_program(share[i].peer, wanted->peer) : share[i].peer->uid == wanted->peer->uid;
        sum += same ? share[i].amount : 0;
    }
    return sum;
}

const struct share *shares_victim(struct share *share, int n, const struct share *wanted)
{
    sum_up(share, n);
    const struct share *user = of_most(share, n, wanted, false), *program = of_most(share, n, wanted, true);
    if (wanted->kept)
        return user && (!program || user->of_user >= program->of_program) ? user : program;
    if (user && own(share, n, wanted, false) + wanted->amount < user->of_user)
        return user;
    if (program && own(share, n, wanted, true) + wanted->amount < program->of_program)
        return program;
    return NULL;
}
