/* SPDX-License-Identifier: MIT */
/* test_work - requests that wait: each goes on once, in its order, and may wait again or end meanwhile. */
#include "tests/lib/test.h"

#include "daemon/rpc/work.h"

struct request {
    struct rpc_work work;
    struct rpc_waiters *again; /* waits there again; NULL: does not */
    struct request *ends;      /* ends that one; NULL: none */
    int *count;
    int resumed_as, dropped;
};

static void on_resume(void *ctx)
{
    struct request *r = ctx;
    r->resumed_as = ++*r->count;
    if (r->again)
        rpc_work_wait(&r->work, r->again);
    if (r->ends)
        rpc_work_end(&r->ends->work);
}

static void drop(void *state)
{
    ((struct request *)state)->dropped++;
}

static void begin(struct request *r, int n, int *count)
{
    *count = 0;
    for (int i = 0; i < n; i++)
        r[i] = (struct request){.work = {.resume = on_resume, .ctx = &r[i]}, .count = count};
}

TEST(those_who_wait_go_on_in_their_order_and_no_others)
{
    struct rpc_waiters here = {0}, there = {0};
    struct request r[4];
    int count;
    begin(r, 4, &count);
    rpc_work_wait(&r[2].work, &here);
    rpc_work_wait(&r[1].work, &there);
    rpc_work_wait(&r[0].work, &here);
    rpc_work_resume_all(&here);
    CHECK(r[2].resumed_as == 1 && r[0].resumed_as == 2 && count == 2);
    CHECK(!r[0].work.waits && r[1].work.waits);
    rpc_work_resume(&r[3].work); /* does not wait */
    CHECK_INT(count, 2);
    rpc_work_wait(&r[3].work, NULL);
    rpc_work_resume(&r[3].work);
    CHECK(r[3].resumed_as == 3 && !r[3].work.waits);
    rpc_work_resume_all(&here);
    CHECK_INT(count, 3);
}

TEST(who_waits_again_goes_on_at_the_next_time)
{
    struct rpc_waiters here = {0};
    struct request r[3];
    int count;
    begin(r, 3, &count);
    for (int i = 0; i < 3; i++)
        rpc_work_wait(&r[i].work, &here);
    r[0].again = r[1].again = &here;
    rpc_work_resume_all(&here);
    CHECK(count == 3 && r[0].work.waits && r[1].work.waits && !r[2].work.waits);
    rpc_work_go_on(&r[0].work); /* of its own */
    r[1].again = NULL;
    rpc_work_resume_all(&here);
    CHECK(count == 4 && r[1].resumed_as == 4 && here.first == NULL);
}

/* Its client has gone while another was resumed: it is dropped, and not resumed. */
TEST(who_ends_meanwhile_does_not_go_on)
{
    struct rpc_waiters here = {0};
    struct request r[3];
    int count;
    begin(r, 3, &count);
    for (int i = 0; i < 3; i++) {
        rpc_work_wait(&r[i].work, &here);
        rpc_work_keep(&r[i].work, &r[i], drop);
    }
    r[0].ends = &r[1];
    rpc_work_resume_all(&here);
    CHECK(r[0].resumed_as == 1 && r[1].resumed_as == 0 && r[2].resumed_as == 2);
    CHECK(r[1].dropped == 1 && r[0].dropped == 0 && !r[1].work.state && !r[1].work.waits);
}

int main(void)
{
    RUN(those_who_wait_go_on_in_their_order_and_no_others);
    RUN(who_waits_again_goes_on_at_the_next_time);
    RUN(who_ends_meanwhile_does_not_go_on);
    return test_end();
}
