/* SPDX-License-Identifier: MIT */
#include "dead_line.h"

#define USUAL_TIMES 3
#define LATELY      100         /* times it was heard; between this and twice as many are looked back to */
#define AGAIN_NS    2000000000u /* a cured line is heard within this and a usual interval, ... */
#define SETUP_NS    6000000000u /* ... or what it takes to set up a device that is asked */

static uint64_t greater(uint64_t a, uint64_t b)
{
    return a > b ? a : b;
}

/* How long it may be silent before it is due for the first time. */
static uint64_t patience_ns(const struct dead_line *d)
{
    const uint64_t least_ns = d->first_ns && d->first_ns < DEAD_LINE_LEAST_NS ? d->first_ns : DEAD_LINE_LEAST_NS;
    return greater(least_ns, USUAL_TIMES * d->usual_ns);
}

/* The next time it is due, counted from the last. */
static uint64_t wait_ns(const struct dead_line *d)
{
    const uint64_t first_ns = patience_ns(d), most_ns = greater(first_ns, DEAD_LINE_MOST_NS);
    const uint64_t ns = d->due < 16 ? first_ns << d->due : most_ns;
    return ns < most_ns ? ns : most_ns;
}

void dead_line_opened(struct dead_line *d, uint64_t now_ns)
{
    d->looked_ns = now_ns;
    d->silent_ns = d->since_ns = 0;
    d->heard = false;
    d->due = 0;
}

/* A silence that the new port ended says nothing of the talker. One that went on for longer after that ended by itself:
 * the talker has become slower. */
static bool ended_by_itself(const struct dead_line *d)
{
    const uint64_t cured_ns = greater(d->usual_ns, d->asked ? SETUP_NS : 0) + AGAIN_NS;
    return d->heard && (d->due == 0 || d->since_ns > cured_ns);
}

/* A device that was off for an hour, or a talker that was slow once, is soon what it was. */
static void look_back(struct dead_line *d)
{
    if (++d->times_heard == LATELY) {
        d->before_ns = d->longest_ns;
        d->longest_ns = 0;
        d->times_heard = 0;
    }
    d->usual_ns = greater(d->before_ns, d->longest_ns);
}

static void learn(struct dead_line *d)
{
    if (ended_by_itself(d)) {
        d->longest_ns = greater(d->longest_ns, d->silent_ns);
        d->heard_for_ns += d->silent_ns;
    }
    look_back(d);
    d->heard = true;
    d->silent_ns = d->since_ns = 0;
    d->due = 0;
}

static bool judged(const struct dead_line *d)
{
    return d->asked || (d->heard_for_ns > 0 && d->heard_for_ns >= patience_ns(d));
}

bool dead_line_look(struct dead_line *d, uint64_t now_ns, bool heard)
{
    const uint64_t passed_ns = now_ns - d->looked_ns;
    const uint64_t silent_ns = passed_ns <= DEAD_LINE_HELD_NS ? passed_ns : DEAD_LINE_LOOK_NS;
    d->looked_ns = now_ns;
    d->silent_ns += silent_ns;
    d->since_ns += silent_ns;
    if (heard)
        learn(d);
    if (!judged(d) || d->since_ns < wait_ns(d))
        return false;
    d->due++;
    d->since_ns = 0;
    return true;
}
