/* SPDX-License-Identifier: MIT */
#include "shares.h"

#include <stddef.h>

static int first_of_program(const struct share *share, int i)
{
    int k = 0;
    while (!peer_same_program(share[k].peer, share[i].peer))
        k++;
    return k;
}

static int first_of_user(const struct share *share, int i)
{
    int k = 0;
    while (share[k].peer->uid != share[i].peer->uid)
        k++;
    return k;
}

static void sum_up(struct share *share, int n)
{
    for (int i = 0; i < n; i++)
        share[i].of_user = share[i].of_program = 0;
    for (int i = 0; i < n; i++) {
        share[first_of_user(share, i)].of_user += share[i].amount;
        share[first_of_program(share, i)].of_program += share[i].amount;
    }
    for (int i = 0; i < n; i++) {
        share[i].of_user = share[first_of_user(share, i)].of_user;
        share[i].of_program = share[first_of_program(share, i)].of_program;
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
    return a->amount != b->amount ? a->amount > b->amount : a->since_ns < b->since_ns;
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

int shares_victim(struct share *share, int n, const struct share *wanted)
{
    sum_up(share, n);
    const struct share *user = of_most(share, n, wanted, false), *program = of_most(share, n, wanted, true);
    if (wanted->kept) {
        const struct share *most = user && program ? (user->of_user >= program->of_program ? user : program)
                                   : user          ? user
                                                   : program;
        return most ? (int)(most - share) : -1;
    }
    if (user && own(share, n, wanted, false) + wanted->amount < user->of_user)
        return (int)(user - share);
    if (program && own(share, n, wanted, true) + wanted->amount < program->of_program)
        return (int)(program - share);
    return -1;
}
