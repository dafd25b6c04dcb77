/* SPDX-License-Identifier: MIT */
#include "shared.h"

#include <stdlib.h>
#include <string.h>

#define RESUMED_PER_TURN 8

static struct shared_state state_of(const struct shared *s)
{
    return (struct shared_state){.turn = loop_turns(s->loop),
                                 .now_ns = loop_now(s->loop),
                                 .changes = s->changes,
                                 .pings = s->pings ? s->pings(s->daemon) : 0};
}

static bool is_same(const struct shared_state *a, const struct shared_state *b)
{
    return a->turn == b->turn && a->now_ns == b->now_ns && a->changes == b->changes && a->pings == b->pings;
}

static bool is_idle(const struct shared_answer *a)
{
    return !a->making && !a->waiters.first;
}

static void forget_text(struct shared_answer *a)
{
    free(a->text);
    a->text = NULL;
    a->made = false;
}

/* NULL: others are all in use. */
static struct shared_answer *find(struct shared *s, const struct rpc_method *method, json_t *params)
{
    struct shared_answer *oldest = NULL;
    for (struct shared_answer *a = s->answer; a < s->answer + SHARED_MAX; a++) {
        if (a->method == method && json_equal(a->params, params))
            return a;
        if (is_idle(a) && (!oldest || a->used < oldest->used))
            oldest = a;
    }
    if (oldest) {
        forget_text(oldest);
        json_decref(oldest->params);
        *oldest =
            (struct shared_answer){.method = method, .params = json_incref(params), .number = oldest->number};
    }
    return oldest;
}

/* One turn of the loop serves some of those that wait; their answer stays meanwhile. */
static void on_resume(void *ctx, uint64_t now_ns)
{
    struct shared *s = ctx;
    int left = RESUMED_PER_TURN;
    bool more = false;
    for (struct shared_answer *a = s->answer; a < s->answer + SHARED_MAX; a++) {
        while (!a->making && a->waiters.first && left-- > 0)
            rpc_work_resume(a->waiters.first);
        more |= !a->making && a->waiters.first;
    }
    if (more)
        loop_arm(s->loop, &s->resume, now_ns);
}

static void resume_soon(struct shared *s)
{
    s->resume.fire = on_resume;
    s->resume.ctx = s;
    loop_arm(s->loop, &s->resume, loop_now(s->loop));
}

/* There will be no answer: who waits makes another. */
static void abandon(struct rpc_work *work)
{
    struct shared_answer *a = work->making;
    a->making = false;
    work->making = NULL;
    if (a->waiters.first)
        resume_soon(work->shared);
}

/* Those who wait asked before this one begins. */
static enum shared_outcome begin_making(struct shared *s, struct shared_answer *a, struct rpc_work *work)
{
    forget_text(a);
    a->state = state_of(s);
    a->number++;
    a->making = true;
    work->making = a;
    work->shared = s;
    work->abandon = abandon;
    return SHARED_MAKE;
}

static enum shared_outcome wait_for(struct shared_answer *a, struct rpc_work *work, uint64_t number)
{
    work->awaited = number;
    work->postponed = true;
    rpc_work_wait(work, &a->waiters);
    return SHARED_WAITS;
}

enum shared_outcome shared_ask(struct shared *s, struct rpc_work *work, const struct rpc_method *method,
                               json_t *params, struct json_out *out)
{
    if (work->making)
        return SHARED_MAKE; /* it was postponed */
    struct shared_answer *a = find(s, method, params);
    if (!a || a->alone)
        return SHARED_MAKE;
    const struct shared_state now = state_of(s);
    const bool fits =
        (work->awaited && a->number >= work->awaited) || (!work->awaited && is_same(&a->state, &now));
    a->used = ++s->uses;
    if (fits && a->made && now.now_ns - a->made_ns <= SHARED_KEPT_NS) {
        json_out_bytes(out, a->text, a->n);
        work->awaited = 0;
        return SHARED_TAKEN;
    }
    if (a->making)
        return wait_for(a, work, fits ? a->number : a->number + 1);
    if (a->waiters.first && !work->awaited)
        return wait_for(a, work, a->number + 1);
    work->awaited = 0;
    return begin_making(s, a, work);
}

void shared_made(struct rpc_work *work, const char *text, size_t n)
{
    struct shared_answer *a = work->making;
    if (!a)
        return;
    a->making = false;
    a->alone = n > SHARED_BYTES_MAX;
    a->text = a->alone ? NULL : malloc(n + 1);
    a->made = a->text != NULL;
    a->n = n;
    a->made_ns = loop_now(work->shared->loop);
    if (a->made)
        memcpy(a->text, text, n);
    work->making = NULL;
    if (a->waiters.first)
        resume_soon(work->shared);
}

void shared_changed(struct shared *s)
{
    s->changes++;
}

void shared_end(struct shared *s)
{
    loop_arm(s->loop, &s->resume, LOOP_NEVER);
    for (struct shared_answer *a = s->answer; a < s->answer + SHARED_MAX; a++) {
        forget_text(a);
        json_decref(a->params);
        a->params = NULL;
    }
}
