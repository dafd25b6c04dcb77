/* SPDX-License-Identifier: MIT */
/*
 * contest - see contest.h.
 */
#include "contest.h"

#define SECOND 1000000000ull

#define LOST_POLLED  4u  /* pings in a row make up for one: more than one lost of five raises the level */
#define LOST_SILENCE 10u /* a second's pings */
#define LOST_RESTART                                                                                              \
    30u /* however long it took: one that lasts says no more, a head may have been without power */
#define LEVEL_MAX     64u           /* three of these with few pings between them */
#define TOLD_AGAIN_NS (60 * SECOND) /* nothing was lost for so long: the next time is news */

void contest_forget(struct contest *c, struct device_status *status)
{
    c->level = 0;
    c->timeouts = status->timeouts;
    c->restarts = status->restarts;
    status->contested = false;
}

void contest_ping(struct contest *c, struct device_status *status, bool polled, uint64_t now_ns,
                  const struct device_io *io)
{
    const unsigned lost = (unsigned)(status->timeouts - c->timeouts);
    if (lost > 0 && status->restarts > c->restarts)
        c->level += LOST_RESTART;
    else
        c->level += lost * (polled ? LOST_POLLED : LOST_SILENCE);
    c->timeouts = status->timeouts;
    c->restarts = status->restarts;
    c->level -= c->level > 0;
    if (c->level == 0 && status->contested) {
        status->contested = false;
        c->well_ns = now_ns;
        io->note(io->ctx, NOTE_INFO, "its answers are no longer lost");
    }
    if (c->level < LEVEL_MAX)
        return;
    c->level = LEVEL_MAX;
    if (!status->contested && (!c->told || now_ns > c->well_ns + TOLD_AGAIN_NS))
        io->note(io->ctx, NOTE_WARNING,
                 "its answers get lost again and again although it answers: another program seems to speak to it, "
                 "too (a bridge answers whoever spoke last), or the line is poor");
    c->told = true;
    status->contested = true;
}

void contest_late(struct contest *c)
{
    c->level -= c->level < LOST_POLLED ? c->level : LOST_POLLED;
}
