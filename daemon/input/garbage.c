/* SPDX-License-Identifier: MIT */
#include "garbage.h"

#include <stdio.h>
#include <string.h>

#include "core/log.h"

#define LOOK_NS      1000000000u    /* of a new line: a message that had started before tells nothing yet */
#define QUIET_NS     60000000000u   /* between two lines, whatever came between */
#define JUDGED_BYTES 64             /* at least */
#define SAME_NS      (2 * QUIET_NS) /* what comes again within this has not started again */

#define MOSTLY "mostly invalid bytes from a sonar: "

static bool has_kind(const char *port, const char *kind)
{
    const size_t n = strlen(kind);
    return strncmp(port, kind, n) == 0 && port[n] == ':';
}

const char *garbage_word(const char *port)
{
    if (has_kind(port, "serial"))
        return MOSTLY "check the baud rate";
    if (has_kind(port, "udp"))
        return MOSTLY "check the address and the port";
    if (has_kind(port, "tcp"))
        return MOSTLY "check the port and the baud rate that its device server is set to";
    return MOSTLY "check the device and its identifiers on the bus";
}

static void tell_garbage(const struct garbage *g, const struct garbage_count *now, uint64_t now_ns)
{
    const uint64_t garbage = now->garbage - g->before.garbage, bytes = now->bytes - g->before.bytes;
    const bool mostly = now->messages == g->before.messages || 2 * garbage > bytes;
    const char *rate = has_kind(g->port, "serial") ? strrchr(g->port + sizeof "serial", ':') : NULL;
    const bool goes_on = g->told_ns && now_ns - g->told_ns < SAME_NS;
    const enum log_level level = mostly ? LOG_WARNING : goes_on ? LOG_DEBUG : LOG_INFO;
    char advice[100] = "";
    if (mostly)
        snprintf(advice, sizeof advice, "; %s%s%.12s, and what is connected there",
                 garbage_word(g->port) + sizeof MOSTLY - 1, rate ? " " : "", rate ? rate + 1 : "");
    log_tell(level, LOG_ABOUT(.event = "garbage", .sonar = g->sonar),
             "%s%s: discarded %llu of %llu bytes that are not valid %s messages%s", g->whose, g->port,
             (unsigned long long)garbage, (unsigned long long)bytes, g->speech, advice);
}

static void check_garbage(void *garbage, uint64_t now_ns)
{
    struct garbage *g = garbage;
    struct garbage_count now;
    g->count(g->owner, &now);
    if (now.garbage > g->before.garbage) {
        if (g->told_ns && now_ns - g->told_ns < QUIET_NS) {
            loop_arm(g->loop, &g->timer, g->told_ns + QUIET_NS);
            return;
        }
        tell_garbage(g, &now, now_ns);
        g->told_ns = now_ns;
    }
    g->before = now;
}

/* At a wrong baud rate some messages come through: the share of the garbage tells. */
static void judge(struct garbage *g, uint64_t now_ns)
{
    struct garbage_count now;
    if (now_ns - g->judged_ns < LOOK_NS)
        return;
    g->count(g->owner, &now);
    if (now.bytes - g->judged.bytes < JUDGED_BYTES)
        return;
    g->mostly = 2 * (now.garbage - g->judged.garbage) > now.bytes - g->judged.bytes;
    g->judged = now;
    g->judged_ns = now_ns;
}

void garbage_heard(struct garbage *g)
{
    judge(g, loop_now(g->loop));
    if (g->timer.armed)
        return;
    g->timer.fire = check_garbage;
    g->timer.ctx = g;
    loop_arm(g->loop, &g->timer, loop_now(g->loop) + LOOK_NS);
}

void garbage_end(struct garbage *g)
{
    loop_arm(g->loop, &g->timer, LOOP_NEVER);
}
