/* SPDX-License-Identifier: MIT */
/* test_shared - what many ask alike is worked out once per state, and no answer is older than its question. */
#include "tests/lib/test.h"

#include <stdlib.h>
#include <string.h>

#include "daemon/rpc/rpc.h"

#define ASKERS 4

static struct loop *loop;
static struct shared shared;
static uint64_t pings;
static unsigned made; /* answers worked out so far */
static bool finished; /* what is made in parts */
static size_t padding;

struct asker {
    struct rpc_work work;
    struct json_out out;
    struct rpc_error error;
    json_t *params;
    const char *method;
    enum rpc_outcome outcome;
};
static struct asker asker[ASKERS];

static uint64_t count_pings(void *daemon)
{
    (void)daemon;
    return pings;
}

static void write_answer(struct json_out *out)
{
    json_out_open(out, '{');
    json_out_name(out, "made");
    json_out_integer(out, ++made);
    for (size_t i = 0; i < padding; i++)
        json_out_bytes(out, " ", 1);
    json_out_close(out, '}');
}

static bool count(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)call, (void)params, (void)error;
    write_answer(out);
    return true;
}

static bool fail(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)call, (void)params, (void)out;
    made++;
    return rpc_refuse(error, RPC_LIMIT, "no");
}

static bool second_part(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    (void)error;
    if (!finished)
        return rpc_continue(call, second_part);
    write_answer(out);
    return true;
}

static bool in_parts(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    (void)params, (void)out, (void)error;
    return rpc_continue(call, second_part);
}

static const struct rpc_method methods[] = {{"count", count, RPC_ASKS, &protocol_methods[PROTOCOL_clusters]},
                                            {"parts", in_parts, RPC_ASKS, &protocol_methods[PROTOCOL_clusters]},
                                            {"fail", fail, RPC_ASKS, &protocol_methods[PROTOCOL_clusters]},
                                            {"change", count, RPC_CHANGES, &protocol_methods[PROTOCOL_map_new]},
                                            {"own", count, RPC_OWN, &protocol_methods[PROTOCOL_clusters]},
                                            {.name = NULL}};

static void go_on(struct asker *a)
{
    const struct rpc_call call = {.work = &a->work, .shared = &shared};
    a->outcome = rpc_answer(methods, &call, a->method, a->params, &a->out, &a->error);
    if (a->outcome != RPC_MORE)
        rpc_work_end(&a->work);
}

static bool reads; /* who is resumed goes on at once */

static void resumed(void *ctx)
{
    if (reads)
        go_on(ctx);
}

/* The number of the answer that it has; 0: none yet, or a failure. */
static unsigned told(const struct asker *a)
{
    return a->outcome == RPC_ANSWERED ? (unsigned)strtoul(a->out.bytes + strlen("{\"made\":"), NULL, 10) : 0;
}

static unsigned ask(int i, const char *method, const char *params)
{
    struct asker *a = &asker[i];
    json_decref(a->params);
    json_out_cut(&a->out, 0);
    a->params = json_loads(params, 0, NULL);
    a->method = method;
    a->work = (struct rpc_work){.resume = resumed, .ctx = a};
    go_on(a);
    return told(a);
}

static void turn(void)
{
    loop_turn(loop, 0);
}

static void start(void)
{
    loop = loop_new(true);
    shared = (struct shared){.loop = loop, .pings = count_pings};
    memset(asker, 0, sizeof asker);
    made = 0;
    finished = false;
    reads = true;
    padding = 0;
}

static void end(void)
{
    for (int i = 0; i < ASKERS; i++) {
        rpc_work_end(&asker[i].work);
        json_decref(asker[i].params);
        free(asker[i].out.bytes);
    }
    shared_end(&shared);
    loop_free(loop);
}

TEST(what_is_asked_alike_in_one_state_is_worked_out_once)
{
    start();
    CHECK_INT(ask(0, "count", "{}"), 1);
    CHECK_INT(ask(1, "count", "{}"), 1);
    CHECK_INT(ask(2, "count", "{\"count\":64}"), 1); /* what holds without it */
    CHECK_INT(ask(3, "count", "{\"count\":65}"), 2);
    CHECK_INT(ask(0, "own", "{}"), 3);
    CHECK_INT(ask(1, "own", "{}"), 4);
    turn();
    CHECK_INT(ask(0, "count", "{}"), 5);
    end();
}

TEST(after_a_ping_or_a_change_it_is_another_state)
{
    start();
    CHECK_INT(ask(0, "count", "{}"), 1);
    pings++;
    CHECK_INT(ask(0, "count", "{}"), 2);
    ask(1, "change", "{}");
    CHECK_INT(ask(0, "count", "{}"), 4);
    CHECK_INT(ask(1, "count", "{}"), 4);
    end();
}

TEST(who_asks_later_than_an_answer_begins_has_the_next_with_all_others)
{
    start();
    CHECK_INT(ask(0, "parts", "{}"), 0); /* makes it */
    CHECK_INT(ask(1, "parts", "{}"), 0); /* in the same state */
    turn();
    CHECK_INT(ask(2, "parts", "{}"), 0); /* later, ... */
    turn();
    CHECK_INT(ask(3, "parts", "{}"), 0); /* ... and still later */
    finished = true;
    go_on(&asker[0]);
    CHECK_INT(told(&asker[0]), 1);
    turn();
    CHECK_INT(told(&asker[1]), 1);
    CHECK_INT(told(&asker[2]), 0); /* makes the next, in parts */
    go_on(&asker[2]);
    CHECK_INT(told(&asker[2]), 2);
    turn();
    CHECK_INT(told(&asker[3]), 2);
    CHECK_INT(made, 2);
    end();
}

TEST(when_whoever_makes_it_goes_another_does)
{
    start();
    ask(0, "parts", "{}");
    ask(1, "parts", "{}");
    ask(2, "parts", "{}");
    finished = true;
    rpc_work_end(&asker[1].work); /* waits no more */
    rpc_work_end(&asker[0].work);
    turn();
    go_on(&asker[2]);
    CHECK_INT(told(&asker[2]), 1);
    end();
}

/* A client that leaves replies unread is served late: not with what was the state then. */
TEST(who_cannot_be_served_in_time_has_a_newer_answer)
{
    start();
    ask(0, "parts", "{}");
    ask(1, "parts", "{}");
    reads = false;
    finished = true;
    go_on(&asker[0]);
    turn();
    loop_skip(loop, loop_now(loop) + SHARED_KEPT_NS + 1);
    go_on(&asker[1]);
    CHECK_INT(told(&asker[1]), 0); /* it is being made */
    go_on(&asker[1]);
    CHECK_INT(told(&asker[1]), 2);
    end();
}

TEST(failures_and_long_answers_are_each_askers_own)
{
    start();
    ask(0, "fail", "{}");
    ask(1, "fail", "{}");
    CHECK_INT(made, 2);
    CHECK_INT(asker[1].outcome, RPC_FAILED);
    padding = SHARED_BYTES_MAX;
    CHECK_INT(ask(0, "count", "{}"), 3);
    CHECK_INT(ask(1, "count", "{}"), 4);
    end();
}

TEST(more_questions_than_there_is_room_for_are_answered_all_the_same)
{
    char params[32];
    start();
    for (unsigned i = 1; i <= 3 * SHARED_MAX; i++) {
        snprintf(params, sizeof params, "{\"count\":%u}", i);
        CHECK_INT(ask(0, "count", params), i);
        CHECK_INT(ask(1, "count", params), i);
    }
    CHECK_INT(ask(0, "count", "{\"count\":1}"), 3 * SHARED_MAX + 1);
    end();
}

int main(void)
{
    RUN(what_is_asked_alike_in_one_state_is_worked_out_once);
    RUN(after_a_ping_or_a_change_it_is_another_state);
    RUN(who_asks_later_than_an_answer_begins_has_the_next_with_all_others);
    RUN(when_whoever_makes_it_goes_another_does);
    RUN(who_cannot_be_served_in_time_has_a_newer_answer);
    RUN(failures_and_long_answers_are_each_askers_own);
    RUN(more_questions_than_there_is_room_for_are_answered_all_the_same);
    return test_end();
}
