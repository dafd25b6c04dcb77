/* SPDX-License-Identifier: MIT */
/* test_loop - descriptors and timers on the real clock and on a virtual one. */
#include "tests/lib/test.h"

#include <sys/epoll.h>
#include <time.h>
#include <unistd.h>

#include "core/loop.h"

struct fired {
    struct loop_timer timer;
    struct loop *loop;
    uint64_t at[64], every_ns;
    int n;
};

static void on_timer(void *ctx, uint64_t now_ns)
{
    struct fired *f = ctx;
    f->at[f->n++ % 64] = now_ns;
    if (f->every_ns)
        loop_arm(f->loop, &f->timer, now_ns + f->every_ns);
}

static struct fired timer_of(struct loop *loop)
{
    return (struct fired){.loop = loop, .timer = {.fire = on_timer}};
}

TEST(virtual_timers_fire_at_their_own_time_and_in_order)
{
    struct loop *loop = loop_new(true);
    struct fired a = timer_of(loop), b = timer_of(loop);
    a.timer.ctx = &a;
    b.timer.ctx = &b;
    a.every_ns = 10;
    loop_arm(loop, &a.timer, 10);
    loop_arm(loop, &b.timer, 35);
    loop_advance(loop, 40);
    CHECK_INT(a.n, 4);
    CHECK_INT(a.at[3], 40);
    CHECK_INT(b.n, 1);
    CHECK_INT(b.at[0], 35);
    CHECK_INT(loop_now(loop), 40);
    loop_advance(loop, 5); /* never back */
    CHECK_INT(loop_now(loop), 40);
    loop_arm(loop, &a.timer, LOOP_NEVER);
    loop_advance(loop, 1000);
    CHECK_INT(a.n, 4);
    loop_free(loop);
}

TEST(arming_again_moves_a_timer)
{
    struct loop *loop = loop_new(true);
    struct fired a = timer_of(loop);
    a.timer.ctx = &a;
    loop_arm(loop, &a.timer, 10);
    loop_arm(loop, &a.timer, 50);
    loop_advance(loop, 20);
    CHECK_INT(a.n, 0);
    loop_advance(loop, 50);
    CHECK_INT(a.n, 1);
    loop_free(loop);
}

TEST(a_timer_armed_for_the_past_does_not_hold_the_loop)
{
    struct loop *loop = loop_new(false);
    struct fired a = timer_of(loop);
    a.timer.ctx = &a;
    a.every_ns = 0;
    loop_arm(loop, &a.timer, 1);
    CHECK(loop_turn(loop, 1000000000));
    CHECK_INT(a.n, 1);
    a.every_ns = 1;
    loop_arm(loop, &a.timer, 1);
    for (int i = 0; i < 5; i++)
        loop_turn(loop, 0);
    CHECK_INT(a.n, 6);
    loop_free(loop);
}

struct pair {
    struct fired *other; /* disarmed and freed by the first that fires */
    struct loop_timer timer;
    struct loop *loop;
    int *n;
};

static void on_pair(void *ctx, uint64_t now_ns)
{
    struct pair *p = ctx;
    if (++*p->n > 1000)
        return;
    if (p->other) {
        loop_arm(p->loop, &p->other->timer, LOOP_NEVER);
        free(p->other);
        p->other = NULL;
    }
    loop_arm(p->loop, &p->timer, now_ns);
}

TEST(a_timer_may_disarm_and_free_another_that_is_due)
{
    struct loop *loop = loop_new(false);
    int n = 0;
    struct fired *last = malloc(sizeof *last);
    struct pair first = {.other = last, .timer = {.fire = on_pair, .ctx = &first}, .loop = loop, .n = &n};
    *last = timer_of(loop);
    last->timer.ctx = last;
    loop_arm(loop, &first.timer, 1);
    loop_arm(loop, &last->timer, 1);
    loop_turn(loop, 0); /* two were due: the first may come twice, but not for ever */
    CHECK(n >= 1 && n <= 2);
    loop_free(loop);
}

static void on_again(void *ctx, uint64_t now_ns)
{
    struct fired *f = ctx;
    (void)now_ns;
    if (f->n++ < 1000)
        loop_arm(f->loop, &f->timer, 1);
}

TEST(a_timer_armed_for_the_past_again_and_again_does_not_keep_others_from_theirs)
{
    struct loop *loop = loop_new(false);
    struct fired again = timer_of(loop), b = timer_of(loop);
    again.timer = (struct loop_timer){.fire = on_again, .ctx = &again};
    b.timer.ctx = &b;
    loop_arm(loop, &again.timer, 1);
    loop_arm(loop, &b.timer, loop_now(loop));
    loop_turn(loop, 0);
    CHECK_INT(again.n, 1);
    CHECK_INT(b.n, 1);
    loop_free(loop);
}

TEST(in_a_skipped_time_a_timer_fires_once_at_its_end)
{
    struct loop *loop = loop_new(true);
    struct fired a = timer_of(loop), b = timer_of(loop), c = timer_of(loop);
    a.timer.ctx = &a;
    b.timer.ctx = &b;
    c.timer.ctx = &c;
    a.every_ns = 10;
    loop_arm(loop, &a.timer, 10);
    loop_arm(loop, &b.timer, 500);
    loop_arm(loop, &c.timer, 1001);
    loop_skip(loop, 1000);
    CHECK_INT(loop_now(loop), 1000);
    CHECK_INT(a.n, 1);
    CHECK_INT(a.at[0], 1000);
    CHECK_INT(b.n, 1);
    CHECK_INT(b.at[0], 1000);
    CHECK_INT(c.n, 0);
    loop_skip(loop, 5); /* never back */
    CHECK_INT(loop_now(loop), 1000);
    loop_advance(loop, 1010);
    CHECK_INT(a.n, 2);
    CHECK_INT(c.n, 1);
    loop_free(loop);
}

#define MANY 60000

static struct {
    struct loop_timer timer;
    uint64_t due_ns;
    int armed_as; /* count of arming */
    bool fired;
} many[MANY];

static struct {
    uint64_t due_ns;
    int armed_as, n, wrong;
} last_fired;

static void on_many(void *ctx, uint64_t now_ns)
{
    const int i = (int)(intptr_t)ctx;
    last_fired.wrong += many[i].fired || now_ns != many[i].due_ns || many[i].due_ns < last_fired.due_ns ||
                        (many[i].due_ns == last_fired.due_ns && many[i].armed_as < last_fired.armed_as);
    last_fired.due_ns = many[i].due_ns;
    last_fired.armed_as = many[i].armed_as;
    last_fired.n++;
    many[i].fired = true;
}

static double cpu_s(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Clients make as many timers as they have watches. */
TEST(many_timers_fire_in_order_and_soon)
{
    struct loop *loop = loop_new(true);
    uint64_t random = test_seed();
    int armings = 0, disarmed = 0;
    const double started_s = cpu_s();
    for (int i = 0; i < MANY; i++)
        many[i].timer = (struct loop_timer){.fire = on_many, .ctx = (void *)(intptr_t)i};
    for (int n = 0; n < 3 * MANY; n++) {
        const int i = (int)(test_random(&random) % MANY);
        const bool moves = !many[i].timer.armed || n % 2;
        many[i].due_ns = moves ? 1 + test_random(&random) % 20000 : many[i].due_ns;
        if (moves && !(many[i].timer.armed && many[i].timer.due_ns == many[i].due_ns))
            many[i].armed_as = armings++;
        loop_arm(loop, &many[i].timer, many[i].due_ns);
    }
    for (int i = 0; i < MANY; i += 3) {
        disarmed += many[i].timer.armed;
        loop_arm(loop, &many[i].timer, LOOP_NEVER);
    }
    int left = 0;
    for (int i = 0; i < MANY; i++)
        left += many[i].timer.armed;
    loop_advance(loop, 30000);
    CHECK(disarmed > 0 && left > MANY / 2);
    CHECK_INT(last_fired.n, left);
    CHECK_INT(last_fired.wrong, 0);
    CHECK(cpu_s() - started_s < 60); /* some 0.1 s; a sorted list needs minutes */
    loop_free(loop);
}

struct reader {
    struct loop_fd fd;
    struct loop *loop;
    struct loop_fd *remove; /* in the handler */
    int n;
};

static void on_readable(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct reader *r = ctx;
    (void)events;
    (void)now_ns;
    r->n++;
    if (r->remove)
        loop_remove(r->loop, r->remove);
}

TEST(a_handler_removed_by_another_in_the_same_turn_is_not_called)
{
    struct loop *loop = loop_new(false);
    int p[2][2];
    struct reader r[2];
    for (int i = 0; i < 2; i++) {
        CHECK_INT(pipe(p[i]), 0);
        CHECK_INT(write(p[i][1], "x", 1), 1);
        r[i] = (struct reader){.fd = {.fd = p[i][0], .ready = on_readable}, .loop = loop};
    }
    for (int i = 0; i < 2; i++) {
        r[i].fd.ctx = &r[i];
        r[i].remove = &r[1 - i].fd;
        CHECK(loop_add(loop, &r[i].fd, EPOLLIN));
    }
    loop_turn(loop, 0);
    CHECK_INT(r[0].n + r[1].n, 1);
    for (int i = 0; i < 2; i++) {
        close(p[i][0]);
        close(p[i][1]);
    }
    loop_free(loop);
}

static struct loop *again_loop;
static int again_left;

static void arm_again(void *ctx, uint64_t now_ns)
{
    if (--again_left > 0)
        loop_arm(again_loop, ctx, now_ns);
}

/* A replay that stays has a clock that stands: what a handler leaves for later in this moment is done all the same. */
TEST(where_the_clock_stands_a_timer_for_now_is_not_waited_with)
{
    struct loop *loop = loop_new(true);
    struct loop_timer timer = {.fire = arm_again, .ctx = &timer};
    again_loop = loop;
    again_left = 3;
    loop_arm(loop, &timer, 0);
    const uint64_t began_ns = loop_clock();
    for (int i = 0; i < 3; i++)
        loop_turn(loop, 60000000000u);
    CHECK_INT(again_left, 0);
    CHECK(loop_clock() - began_ns < 60000000000u);
    loop_free(loop);
}

TEST(quit_ends_the_turns)
{
    struct loop *loop = loop_new(false);
    CHECK(loop_turn(loop, 0));
    loop_quit(loop);
    CHECK(!loop_turn(loop, 0));
    loop_free(loop);
}

int main(void)
{
    RUN(virtual_timers_fire_at_their_own_time_and_in_order);
    RUN(arming_again_moves_a_timer);
    RUN(a_timer_armed_for_the_past_does_not_hold_the_loop);
    RUN(a_timer_may_disarm_and_free_another_that_is_due);
    RUN(a_timer_armed_for_the_past_again_and_again_does_not_keep_others_from_theirs);
    RUN(in_a_skipped_time_a_timer_fires_once_at_its_end);
    RUN(many_timers_fire_in_order_and_soon);
    RUN(a_handler_removed_by_another_in_the_same_turn_is_not_called);
    RUN(where_the_clock_stands_a_timer_for_now_is_not_waited_with);
    RUN(quit_ends_the_turns);
    return test_end();
}
