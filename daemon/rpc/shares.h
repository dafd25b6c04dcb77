/* SPDX-License-Identifier: MIT */
/*
 * shares - whose client makes room for another's when there is no more of something: one of the user who has most of
 * it, and among the programs of one user one of the program that has most. Pure.
 */
#ifndef SONARD_SHARES_H
#define SONARD_SHARES_H

#include <stdbool.h>
#include <stdint.h>

#include "peer.h"

/* What a client has. */
struct share {
    const struct peer *peer;
    double amount;     /* in shares of all that there is */
    bool kept;         /* it never makes room */
    uint64_t since_ns; /* it has asked nothing since then: of clients alike the one for longest makes room */
    int slot;          /* the caller's number of it, of clients alike in all else the least makes room */
    double of_user, of_program; /* worked out by shares_victim */
};

/**
 * shares_victim - who of share[0..n-1] makes room for `wanted`, which is not among them: with what it wants, its user
 * has less than the other has, or its program has, of the same user. When it is kept, nothing is compared. NULL:
 * nobody. Orders the shares anew.
 */
const struct share *shares_victim(struct share *share, int n, const struct share *wanted);

#endif
