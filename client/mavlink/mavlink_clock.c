/* SPDX-License-Identifier: MIT */
#include "mavlink_clock.h"

#define MS_NS         1000000
#define LEAK_PER_NS   20000u   /* 1 ns in so many: 50 ppm, more than two quartz clocks drift apart */
#define ROUND_TRIP_NS 20000000 /* a slower answer says too little */
#define PLAUSIBLE_NS  1000000000
#define LATE_NS       250000000   /* more than the ways of a link differ by ... */
#define LATE_FOR_NS   3000000000u /* ... for so long: then it is the clock that differs */
#define BACK_NS       150000000 /* more than messages of one autopilot are stamped in another order than they come */
#define SETTLE_NS     1000000000u /* after a jump */
#define TWICE_NS      10000000000u

/* Has everything been late for so long that its clock must have been set back, or started a moment ago? */
static bool is_another(struct mavlink_clock *clock, int64_t offset_ns, uint64_t now_ns)
{
    if (offset_ns <= clock->offset_ns + LATE_NS)
        clock->late_ns = 0;
    else if (clock->late_ns == 0)
        clock->late_ns = now_ns;
    return clock->late_ns > 0 && now_ns > clock->late_ns + LATE_FOR_NS;
}

/* The message before was of a later time than messages overtake each other, or this one is of a time that had not come.
 * Delays do neither. */
bool mavlink_clock_jumps(const struct mavlink_clock *clock, uint32_t boot_ms, uint64_t now_ns)
{
    const int64_t back_ns = (int64_t)(int32_t)(clock->last_ms - boot_ms) * MS_NS;
    const int64_t ahead_ms = (int32_t)(boot_ms - (uint32_t)clock->boot_ms);
    const int64_t offset_ns = (int64_t)now_ns - ((int64_t)clock->boot_ms + ahead_ms) * MS_NS;
    return clock->known && (back_ns > BACK_NS || offset_ns < clock->floor_ns - LATE_NS);
}

/* From the start, or from the jump. */
static void begin(struct mavlink_clock *clock, uint32_t boot_ms, uint64_t now_ns)
{
    const bool jump = clock->known, twice = jump && clock->jump_ns && now_ns < clock->jump_ns + TWICE_NS;
    *clock = (struct mavlink_clock){.boot_ms = boot_ms,
                                    .heard_ns = now_ns,
                                    .jump_ns = jump ? now_ns : 0,
                                    .doubt_ns = twice  ? now_ns + TWICE_NS
                                                : jump ? now_ns + SETTLE_NS
                                                       : 0,
                                    .two = twice};
}

uint64_t mavlink_clock_heard(struct mavlink_clock *clock, uint32_t boot_ms, uint64_t now_ns)
{
    int64_t offset_ns, t_ns;
    if (!clock->known || mavlink_clock_jumps(clock, boot_ms, now_ns))
        begin(clock, boot_ms, now_ns);

    const int32_t step_ms = (int32_t)(boot_ms - (uint32_t)clock->boot_ms);
    if (step_ms > 0)
        clock->boot_ms += (uint64_t)step_ms;

    const uint64_t sent_ms = clock->boot_ms - (uint32_t)((uint32_t)clock->boot_ms - boot_ms);
    offset_ns = (int64_t)now_ns - (int64_t)sent_ms * MS_NS;
    const int64_t leak_ns = (int64_t)((now_ns - clock->heard_ns) / LEAK_PER_NS);
    clock->offset_ns += leak_ns;
    clock->floor_ns =
        clock->known && clock->floor_ns + leak_ns < offset_ns ? clock->floor_ns + leak_ns : offset_ns;
    if (!clock->known || offset_ns < clock->offset_ns || is_another(clock, offset_ns, now_ns)) {
        clock->offset_ns = offset_ns;
        clock->late_ns = 0;
    }
    clock->known = true;
    clock->last_ms = boot_ms;
    clock->heard_ns = now_ns;
    t_ns = (int64_t)sent_ms * MS_NS + clock->offset_ns;
    return t_ns > 0 ? (uint64_t)t_ns : 0;
}

bool mavlink_clock_doubtful(const struct mavlink_clock *clock, uint64_t now_ns)
{
    return clock->known && now_ns < clock->doubt_ns;
}

bool mavlink_clock_two(const struct mavlink_clock *clock, uint64_t now_ns)
{
    return clock->two && mavlink_clock_doubtful(clock, now_ns);
}

void mavlink_clock_answer(struct mavlink_clock *clock, int64_t tc1_ns, int64_t asked_ns, uint64_t now_ns)
{
    int64_t round_trip_ns, offset_ns;
    if (!clock->known || asked_ns < 0 || asked_ns > (int64_t)now_ns || tc1_ns < 0)
        return;
    round_trip_ns = (int64_t)now_ns - asked_ns;
    if (round_trip_ns > ROUND_TRIP_NS)
        return;
    offset_ns = asked_ns + round_trip_ns / 2 - tc1_ns;
    /* One that differs more counts from another start than the time stamps do. */
    if (offset_ns < clock->offset_ns && offset_ns > clock->offset_ns - PLAUSIBLE_NS)
        clock->offset_ns = offset_ns;
}

uint64_t mavlink_clock_boot_ns(const struct mavlink_clock *clock, uint64_t t_ns)
{
    const int64_t boot_ns = (int64_t)t_ns - (clock->known ? clock->offset_ns : 0);
    return boot_ns > 0 ? (uint64_t)boot_ns : 0;
}
