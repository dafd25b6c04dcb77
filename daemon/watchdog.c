/* SPDX-License-Identifier: MIT */
#include "watchdog.h"

#include <errno.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "core/log.h"
#include "notify.h"

#define LOOKS 4 /* in the time the manager gives: a look that comes late is not the end */

/* The first thread that took no turn since the last look; -1: all did. */
static int stuck_thread(struct watchdog *w)
{
    int stuck = -1;
    for (int i = 0; i < pipeline_threads(w->pipeline); i++) {
        const uint64_t turns = pipeline_turns(w->pipeline, i);
        if (turns == w->turns[i] && stuck < 0)
            stuck = i;
        w->turns[i] = turns;
    }
    return stuck;
}

static void on_timer(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct watchdog *w = ctx;
    uint64_t expired;
    (void)events, (void)now_ns;
    if (read(w->timer.fd, &expired, sizeof expired) < 0)
        return;
    const int stuck = stuck_thread(w);
    if (stuck < 0)
        notify_tell("WATCHDOG=1");
    else if (w->stuck < 0)
        log_line(LOG_ERR, "watchdog_stuck", "watchdog: the %s thread made no progress for %.1f s",
                 pipeline_thread_name(w->pipeline, stuck), (double)w->period_ns * 1e-9);
    w->stuck = stuck;
    pipeline_poke(w->pipeline);
}

bool watchdog_start(struct watchdog *w, struct loop *loop, struct pipeline *pipeline, uint64_t within_ns,
                    struct fault *fault)
{
    if (!within_ns)
        return true;
    const uint64_t period_ns = within_ns / LOOKS;
    const struct timespec every = {.tv_sec = (time_t)(period_ns / 1000000000u),
                                   .tv_nsec = (long)(period_ns % 1000000000u)};
    const struct itimerspec setting = {.it_interval = every, .it_value = every};
    *w = (struct watchdog){.loop = loop, .pipeline = pipeline, .period_ns = period_ns, .stuck = -1};
    w->timer = (struct loop_fd){
        .fd = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK), .ready = on_timer, .ctx = w};
    pipeline_poke(pipeline);
    if (w->timer.fd >= 0 && timerfd_settime(w->timer.fd, 0, &setting, NULL) == 0 &&
        loop_add(loop, &w->timer, EPOLLIN))
        return true;
    fault_set(fault, "watchdog: %s", strerror(errno));
    watchdog_stop(w);
    return false;
}

void watchdog_stop(struct watchdog *w)
{
    if (!w->loop)
        return;
    loop_remove(w->loop, &w->timer);
    if (w->timer.fd >= 0)
        close(w->timer.fd);
    w->loop = NULL;
}
