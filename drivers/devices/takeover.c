/* SPDX-License-Identifier: MIT */
/*
 * takeover - see takeover.h.
 */
#include "takeover.h"

#include <stdio.h>
#include <stdlib.h>

#define SECOND 1000000000ull

#define OTHER_WEIGHT  2u  /* of a ping of other settings, against one of ours: two programs may take turns */
#define LEVEL_MAX     16u /* 8 pings in a row; up to 5 of the old settings follow a change of a Ping360's */
#define WAIT_FIRST_NS (5 * SECOND)
#define WAIT_MAX_NS   (40 * SECOND) /* a Ping360 may take a new sector at the end of its sweep only */
#define TOLD_AGAIN_NS (60 * SECOND) /* it was ours for so long: the next time is news */

void takeover_forget(struct takeover *t, struct device_status *status)
{
    t->level = 0;
    t->wait_ns = 0;
    status->other_settings[0] = '\0';
}

static bool is_other(const struct takeover_value *value)
{
    return labs(value->seen - value->sent) > value->slack;
}

/* "gain 0 (sent 1), step 4 (sent 1)"; as many as there is room for. */
static void describe_value(char *out, size_t size, const struct takeover_value *value, unsigned n)
{
    size_t used = 0;
    for (unsigned i = 0; i < n && used < size; i++)
        if (is_other(&value[i]))
            used += (size_t)snprintf(out + used, size - used, "%s%s %ld (sent %ld)", used ? ", " : "",
                                     value[i].name, value[i].seen, value[i].sent);
}

/* Of our settings. */
static void on_ours(struct takeover *t, struct device_status *status, uint64_t now_ns, const struct device_io *io)
{
    t->level -= t->level > 0;
    if (t->level > 0 || !status->other_settings[0])
        return;
    status->other_settings[0] = '\0';
    t->ours_ns = now_ns;
    t->wait_ns = 0;
    io->note(io->ctx, NOTE_INFO, "its settings are again the ones that were sent");
}

bool takeover_ping(struct takeover *t, struct device_status *status, const struct takeover_value *value,
                   unsigned n, uint64_t now_ns, const struct device_io *io)
{
    bool other = false;
    for (unsigned i = 0; i < n; i++)
        other |= is_other(&value[i]);
    if (!other) {
        on_ours(t, status, now_ns, io);
        return false;
    }
    t->level = t->level + OTHER_WEIGHT < LEVEL_MAX ? t->level + OTHER_WEIGHT : LEVEL_MAX;
    if (t->level < LEVEL_MAX && !status->other_settings[0])
        return false;

    const bool news = !status->other_settings[0];

    describe_value(status->other_settings, sizeof status->other_settings, value, n);
    status->taken_over += news;
    if (news && (!t->told || now_ns > t->ours_ns + TOLD_AGAIN_NS))
        io->note(io->ctx, NOTE_WARNING,
                 "its settings are not the ones that were sent (another program?); sending them again: %s",
                 status->other_settings);
    t->told = true;
    if (now_ns < t->due_ns)
        return false;
    t->wait_ns = !t->wait_ns ? WAIT_FIRST_NS : 2 * t->wait_ns < WAIT_MAX_NS ? 2 * t->wait_ns : WAIT_MAX_NS;
    t->due_ns = now_ns + t->wait_ns;
    return true;
}
