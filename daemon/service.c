/* SPDX-License-Identifier: MIT */
#include "service.h"

#include <string.h>

#include "daemon.h"
#include "log.h"
#include "methods.h"
#include "notify.h"

#define TICK_NS 1000000000u

/* Told when it changes, not every second. */
static void on_tick(void *ctx, uint64_t now_ns)
{
    struct daemon *d = ctx;
    const char *word = status_data_word(d);
    if (!d->service.told || strcmp(word, d->service.told) != 0)
        notify_tell("STATUS=%d sonar%s, data: %s", d->conf.n_sonars, d->conf.n_sonars == 1 ? "" : "s", word);
    d->service.told = word;
    log_flush(now_ns);
    loop_arm(d->loop, &d->service.timer, now_ns + TICK_NS);
}

bool service_start(struct daemon *d, char *err, size_t err_size)
{
    struct service *s = &d->service;
    *s = (struct service){.timer = {.fire = on_tick, .ctx = d}};
    if (!watchdog_start(&s->watchdog, d->loop, d->pipeline, notify_watchdog_ns(), err, err_size))
        return false;
    notify_tell("READY=1\nSTATUS=%s", d->replay ? "plays a capture" : "waits for the sonars");
    if (!d->replay)
        loop_arm(d->loop, &s->timer, loop_now(d->loop) + TICK_NS);
    return true;
}

void service_stop(struct daemon *d)
{
    notify_tell("STOPPING=1");
    loop_arm(d->loop, &d->service.timer, LOOP_NEVER);
    watchdog_stop(&d->service.watchdog);
}
