/* SPDX-License-Identifier: MIT */
#include "capture_clock.h"

#include <jansson.h>
#include <string.h>

/* About 146 years, so that no sum of two overflows: of a time since 1970, and of what a clock is ahead. */
#define MAX_NS (INT64_MAX / 2)

static bool take_count(const json_t *note, const char *name, int64_t *value)
{
    const json_t *member = json_object_get(note, name);
    *value = json_integer_value(member);
    return json_is_integer(member) && *value <= MAX_NS && *value >= -MAX_NS;
}

/* No clock shows a time before 1970. */
static bool read_note(const struct mcap_message *m, int64_t *ahead_ns, int64_t *was_ahead_ns)
{
    if (strcmp(m->channel->topic, "/clock") != 0 || strcmp(m->channel->encoding, "json") != 0)
        return false;
    json_t *note = json_loadb((const char *)m->data, m->size, JSON_REJECT_DUPLICATES, NULL);
    const bool good = take_count(note, "ahead_ns", ahead_ns) && take_count(note, "was_ahead_ns", was_ahead_ns) &&
                      m->log_ns <= MAX_NS && (int64_t)m->log_ns + *ahead_ns >= 0;
    json_decref(note);
    return good;
}

static void add_step(struct capture_clock *clock, uint64_t from_ns, int64_t ahead_ns)
{
    if (clock->n == CAPTURE_CLOCK_STEPS) {
        clock->before_ns = clock->step[0].ahead_ns;
        memmove(clock->step, clock->step + 1, --clock->n * sizeof *clock->step);
    }
    clock->step[clock->n].from_ns = from_ns;
    clock->step[clock->n++].ahead_ns = ahead_ns;
}

bool capture_clock_take(struct capture_clock *clock, const struct mcap_message *m)
{
    int64_t ahead_ns, was_ahead_ns;
    if (!read_note(m, &ahead_ns, &was_ahead_ns))
        return false;
    const bool first = !clock->noted;
    if (first)
        clock->before_ns = was_ahead_ns;
    clock->noted = true;
    if (ahead_ns == capture_clock_ahead_ns(clock))
        return first;
    add_step(clock, m->log_ns, ahead_ns);
    return true;
}

int64_t capture_clock_ahead_ns(const struct capture_clock *clock)
{
    return clock->n ? clock->step[clock->n - 1].ahead_ns : clock->before_ns;
}

/* By the newest step before it, or the clock as it was before all of them. What this computer has dated between a step
 * and its note, half a second later, is in neither. */
static bool date_by_own(const struct capture_clock *clock, int64_t unix_ns, int64_t *t_ns)
{
    for (size_t i = clock->n + 1; i-- > 0;) {
        *t_ns = unix_ns - (i > 0 ? clock->step[i - 1].ahead_ns : clock->before_ns);
        if ((i == 0 || *t_ns >= (int64_t)clock->step[i - 1].from_ns) &&
            (i == clock->n || *t_ns < (int64_t)clock->step[i].from_ns))
            return true;
    }
    return false; /* the clock was set past it */
}

bool capture_clock_date(const struct capture_clock *clock, enum capture_clock_of of, int64_t unix_ns,
                        uint64_t *t_ns)
{
    int64_t at_ns = unix_ns;
    if (unix_ns > MAX_NS || (of == CAPTURE_CLOCK_OWN && !date_by_own(clock, unix_ns, &at_ns)))
        return false;
    if (of == CAPTURE_CLOCK_RIGHT)
        at_ns -= capture_clock_ahead_ns(clock);
    *t_ns = (uint64_t)at_ns;
    return at_ns >= 0;
}
