/* SPDX-License-Identifier: MIT */
/* test_shares - whose client makes room: of the user that has most, and of one user's programs that which has most. */
#include "tests/lib/test.h"

#include <stdio.h>
#include <string.h>

#include "daemon/rpc/shares.h"

#define CLIENTS 12

static struct peer peer[CLIENTS];
static struct share share[CLIENTS];
static int n;

static struct peer who(uid_t uid, const char *program)
{
    struct peer p = {.uid = uid, .pid = 100 + n};
    snprintf(p.program, sizeof p.program, "%s", program);
    return p;
}

static void has(uid_t uid, const char *program, double amount)
{
    peer[n] = who(uid, program);
    share[n] = (struct share){.peer = &peer[n], .amount = amount, .since_ns = 1000 - (uint64_t)n, .slot = n};
    n++;
}

static int victim(uid_t uid, const char *program, double amount, bool kept)
{
    const struct peer p = who(uid, program);
    struct share ordered[CLIENTS];
    memcpy(ordered, share, sizeof ordered);
    const struct share *v = shares_victim(ordered, n, &(struct share){.peer = &p, .amount = amount, .kept = kept});
    return v ? v->slot : -1;
}

TEST(a_user_that_has_less_displaces_one_of_the_user_that_has_most)
{
    n = 0;
    has(1, "a", 1);
    for (int i = 0; i < 3; i++)
        has(2, "hog", 1);
    has(2, "b", 1);
    has(3, "c", 1);
    CHECK_INT(victim(4, "new", 1, false), 3); /* of the program that has most the one that asked longest ago */
    CHECK_INT(victim(1, "a", 1, false), 3);
    CHECK_INT(victim(2, "hog", 1, false), -1);
    CHECK_INT(victim(2, "b", 1, false), 3); /* another program of the same user that has less */
    share[3].kept = true;
    CHECK_INT(victim(4, "new", 1, false), 2);
}

TEST(equal_shares_displace_nobody)
{
    n = 0;
    for (int i = 0; i < 3; i++)
        has(1, "a", 1);
    for (int i = 0; i < 4; i++)
        has(2, "b", 1);
    CHECK_INT(victim(1, "a", 1, false), -1); /* and back again without end */
    CHECK_INT(victim(2, "b", 1, false), -1);
}

TEST(what_is_kept_is_compared_with_nothing_and_yields_to_nobody)
{
    n = 0;
    has(1, "bridge", 1);
    has(2, "a", 1);
    share[0].kept = true;
    CHECK_INT(victim(1, "bridge", 1, true), 1);
    share[1].kept = true;
    CHECK_INT(victim(1, "bridge", 1, true), -1);
    n = 0;
    has(1, "a", 1);
    has(1, "b", 1);
    CHECK(victim(1, "bridge", 1, true) >= 0);
}

TEST(whoever_has_nothing_of_it_has_nothing_to_yield)
{
    n = 0;
    has(1, "a", 0);
    has(2, "b", 0.3);
    has(2, "b", 0.6);
    CHECK_INT(victim(1, "a", 0.1, false), 2);
    CHECK_INT(victim(1, "a", 0.9, false), -1);
}

int main(void)
{
    RUN(a_user_that_has_less_displaces_one_of_the_user_that_has_most);
    RUN(equal_shares_displace_nobody);
    RUN(what_is_kept_is_compared_with_nothing_and_yields_to_nobody);
    RUN(whoever_has_nothing_of_it_has_nothing_to_yield);
    return test_end();
}
