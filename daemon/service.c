/* SPDX-License-Identifier: MIT */
#include "service.h"

#include <string.h>

#include "core/log.h"
#include "notify.h"

#define TICK_NS 1000000000u

/* Told when it changes, not every second. */
static void on_tick(void *ctx, uint64_t now_ns)
{
    struct service *s = ctx;
    const char *word = s->env.data_word(s->env.ctx);
    if (!s->told || strcmp(word, s->told) != 0)
        notify_tell("STATUS=%d sonar%s, data: %s", s->env.n_sonars, s->env.n_sonars == 1 ? "" : "s", word);
    s->told = word;
    log_flush(now_ns);
    loop_arm(s->env.loop, &s->timer, now_ns + TICK_NS);
}

bool service_start(struct service *s, const struct service_env *env, struct fault *fault)
{
    *s = (struct service){.env = *env, .timer = {.fire = on_tick, .ctx = s}};
    if (!watchdog_start(&s->watchdog, env->loop, env->pipeline, notify_watchdog_ns(), fault))
        return false;
    notify_tell("READY=1\nSTATUS=%s", env->replay ? "plays a capture" : "waiting for the sonars");
    if (!env->replay)
        loop_arm(env->loop, &s->timer, loop_now(env->loop) + TICK_NS);
    return true;
}

void service_stop(struct service *s, bool comes_back)
{
    if (!comes_back)
        notify_tell("STOPPING=1");
    if (s->timer.fire)
        loop_arm(s->env.loop, &s->timer, LOOP_NEVER);
    watchdog_stop(&s->watchdog);
}
