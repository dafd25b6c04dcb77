/* SPDX-License-Identifier: MIT */
#include "garbage.h"

#include "log.h"

#define LOOK_NS  1000000000u    /* of a new line: a message that had begun before tells nothing yet */
#define QUIET_NS 60000000000u   /* between two lines, whatever came between */
#define SAME_NS  (2 * QUIET_NS) /* what comes again within this has not begun anew */

static void tell(const struct garbage *g, const struct garbage_count *now, uint64_t now_ns)
{
    const bool nothing_else = now->messages == g->before.messages;
    const bool goes_on = g->told_ns && now_ns - g->told_ns < SAME_NS;
    const enum log_level level = nothing_else ? LOG_WARNING : goes_on ? LOG_DEBUG : LOG_INFO;
    log_tell(level, LOG_ABOUT(.event = "garbage", .sonar = g->sonar),
             "%s%s: %llu of %llu bytes are no part of a message of %s%s", g->whose, g->port,
             (unsigned long long)(now->garbage - g->before.garbage),
             (unsigned long long)(now->bytes - g->before.bytes), g->speech,
             nothing_else ? ": check the baud rate, and what is connected there" : "");
}

static void look(void *garbage, uint64_t now_ns)
{
    struct garbage *g = garbage;
    struct garbage_count now;
    g->count(g->owner, &now);
    if (now.garbage > g->before.garbage) {
        if (g->told_ns && now_ns - g->told_ns < QUIET_NS) {
            loop_arm(g->loop, &g->timer, g->told_ns + QUIET_NS);
            return;
        }
        tell(g, &now, now_ns);
        g->told_ns = now_ns;
    }
    g->before = now;
}

void garbage_heard(struct garbage *g)
{
    if (g->timer.armed)
        return;
    g->timer.fire = look;
    g->timer.ctx = g;
    loop_arm(g->loop, &g->timer, loop_now(g->loop) + LOOK_NS);
}

void garbage_end(struct garbage *g)
{
    loop_arm(g->loop, &g->timer, LOOP_NEVER);
}
