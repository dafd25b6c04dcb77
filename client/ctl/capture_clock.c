/* SPDX-License-Identifier: MIT */
#include "capture_clock.h"

#include <jansson.h>
#include <string.h>

/* About 146 years, so that no sum of two overflows: of a time since 1970, and of what a clock is ahead. */
#define MAX_NS (INT64_MAX / 2)

bool capture_clock_take(struct capture_clock *clock, const struct mcap_message *m)
{
    if (strcmp(m->channel->topic, "/clock") != 0 || strcmp(m->channel->encoding, "json") != 0)
        return false;
    json_t *note = json_loadb((const char *)m->data, m->size, JSON_REJECT_DUPLICATES, NULL);
    const json_t *value = json_object_get(note, "ahead_ns");
    const int64_t ahead_ns = json_integer_value(value);
    const bool good = json_is_integer(value) && ahead_ns <= MAX_NS && ahead_ns >= -MAX_NS && m->log_ns <= MAX_NS &&
                      ahead_ns != capture_clock_ahead_ns(clock);
    json_decref(note);
    if (!good)
        return false;
    clock->n += clock->n < CAPTURE_CLOCK_STEPS;
    clock->step[clock->n - 1].from_ns = m->log_ns;
    clock->step[clock->n - 1].ahead_ns = ahead_ns;
    return true;
}

int64_t capture_clock_ahead_ns(const struct capture_clock *clock)
{
    return clock->n ? clock->step[clock->n - 1].ahead_ns : 0;
}

static bool is_within(int64_t t_ns, uint64_t start_ns, uint64_t end_ns)
{
    return t_ns >= 0 && (uint64_t)t_ns >= start_ns && (uint64_t)t_ns <= end_ns;
}

int64_t capture_clock_date(const struct capture_clock *clock, int64_t unix_ns, uint64_t start_ns, uint64_t end_ns)
{
    if (unix_ns > MAX_NS)
        return unix_ns; /* no clock is that late */
    const int64_t right_ns = unix_ns - capture_clock_ahead_ns(clock);
    if (is_within(right_ns, start_ns, end_ns))
        return right_ns;
    for (size_t i = 1; i < clock->n; i++) {
        const int64_t t_ns = unix_ns - clock->step[i - 1].ahead_ns;
        if (is_within(t_ns, clock->step[i - 1].from_ns, clock->step[i].from_ns))
            return t_ns;
    }
    return is_within(unix_ns, start_ns, end_ns) ? unix_ns : right_ns;
}
