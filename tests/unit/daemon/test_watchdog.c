/* SPDX-License-Identifier: MIT */
/*
 * test_watchdog - the service manager's watchdog is fed while every thread of the pipeline takes turns, and no more
 * once one of them does not. Time is the test's own.
 */
#include "tests/lib/held_owner.h"
#include "tests/lib/patience.h"
#include "tests/lib/plain_ping.h"
#include "tests/lib/test.h"

#include <stdarg.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "core/fault.h"
#include "daemon/notify.h"
#include "daemon/watchdog.h"

#define WITHIN_NS 4000000000ull

/* In the place of the C library's: a timer that expires when it is told to. */
static int timer = -1;
static struct itimerspec setting;

int timerfd_create(clockid_t clock, int flags)
{
    (void)clock;
    (void)flags;
    timer = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    return timer;
}

int timerfd_settime(int fd, int flags, const struct itimerspec *to, struct itimerspec *from)
{
    (void)fd;
    (void)flags;
    (void)from;
    setting = *to;
    return 0;
}

/* In the place of the service manager. */
static int fed;

void notify_tell(const char *fmt, ...)
{
    CHECK_STR(fmt, "WATCHDOG=1");
    fed++;
}

static struct loop *loop;
static struct pipeline *pipeline;
static struct watchdog watchdog;

/* `held` does not; -1: all do. Without turns nothing of what follows can be tested. */
static void await_turns(int held)
{
    for (int i = 0; i < pipeline_threads(pipeline); i++) {
        bool turned = i == held;
        WAIT_UNTIL(turned || (turned = pipeline_turns(pipeline, i) != watchdog.turns[i]));
        if (!turned) {
            printf("FAIL thread %d takes no turn\n", i);
            exit(1);
        }
    }
}

static void begin(int threads)
{
    struct pipeline_conf c = plain_pipeline(threads);
    struct fault fault = {""};
    c.queue = 2;
    loop = loop_new(false);
    pipeline = pipeline_new(&c, &fault);
    watchdog = (struct watchdog){0};
    fed = 0;
    if (!pipeline || !watchdog_start(&watchdog, loop, pipeline, WITHIN_NS, &fault)) {
        printf("FAIL %s\n", fault.text);
        exit(1);
    }
    await_turns(-1);
}

static void end(void)
{
    watchdog_stop(&watchdog);
    pipeline_free(pipeline);
    loop_free(loop);
}

/* The timer expires; true: the watchdog was fed. After it every thread but the one that is held has taken a turn. */
static bool expires(int held)
{
    const uint64_t one = 1;
    const int before = fed;
    CHECK(write(timer, &one, sizeof one) == sizeof one);
    CHECK(patience_for(timer, POLLIN));
    loop_turn(loop, 0);
    await_turns(held);
    return fed > before;
}

TEST(it_is_fed_several_times_within_the_time_given)
{
    begin(1);
    CHECK(setting.it_interval.tv_sec * 1000000000ll + setting.it_interval.tv_nsec <= (long long)WITHIN_NS / 2);
    CHECK(setting.it_value.tv_sec * 1000000000ll + setting.it_value.tv_nsec <= (long long)WITHIN_NS / 2);
    end();
}

TEST(it_is_fed_until_a_thread_takes_no_turn)
{
    for (int threads = 1; threads <= 2; threads++) {
        static struct hold hold;
        const int owner = threads - 1;
        begin(threads);
        for (int i = 0; i < 3; i++)
            CHECK(expires(-1));
        hold_owner(&hold, pipeline);
        CHECK(expires(owner)); /* for the turn in which it was taken up */
        for (int i = 0; i < 3; i++)
            CHECK(!expires(owner));
        sem_post(&hold.go);
        await_turns(-1);
        CHECK(expires(-1));
        end();
    }
}

TEST(a_loop_without_threads_feeds_it_itself)
{
    begin(0);
    for (int i = 0; i < 3; i++)
        CHECK(expires(-1));
    end();
}

TEST(nobody_asked_for_it)
{
    struct fault fault;
    struct watchdog none = {0};
    timer = -1;
    CHECK(watchdog_start(&none, NULL, NULL, 0, &fault));
    CHECK_INT(timer, -1);
    watchdog_stop(&none);
}

int main(void)
{
    RUN(it_is_fed_several_times_within_the_time_given);
    RUN(it_is_fed_until_a_thread_takes_no_turn);
    RUN(a_loop_without_threads_feeds_it_itself);
    RUN(nobody_asked_for_it);
    return test_end();
}
