/* SPDX-License-Identifier: MIT */
#include "mavlink_aiding.h"

#include <stdio.h>

#define FRESH_NS      3000000000u  /* stock autopilots send two to four reports a second, and five when asked */
#define PATIENCE_NS   12000000000u /* the bridge asks every ten seconds: two requests have had their time */
#define TOLD_AGAIN_NS 10000000000u

/* EKF_STATUS_FLAGS and ESTIMATOR_STATUS_FLAGS of the message definitions. */
#define VELOCITY_HORIZONTAL 0x002u
#define VELOCITY_VERTICAL   0x004u
#define POSITION_RELATIVE   0x008u
#define POSITION_ABSOLUTE   0x010u
#define POSITION_CONSTANT   0x080u

/* A constant position comes with a horizontal velocity of zero that is flagged as good. */
static unsigned allowed(uint16_t flags)
{
    const unsigned both = VELOCITY_HORIZONTAL | VELOCITY_VERTICAL;
    if (flags & POSITION_CONSTANT)
        return 0;
    return (flags & (POSITION_RELATIVE | POSITION_ABSOLUTE) ? MAVLINK_AIDED_POSITION : 0u) |
           ((flags & both) == both ? MAVLINK_AIDED_VELOCITY : 0u);
}

void mavlink_aiding_report(struct mavlink_aiding *aiding, uint16_t flags, uint64_t now_ns)
{
    const unsigned parts = allowed(flags);
    aiding->report_ns = now_ns;
    if (!(parts & MAVLINK_AIDED_POSITION))
        aiding->denied_ns[0] = now_ns;
    if (!(parts & MAVLINK_AIDED_VELOCITY))
        aiding->denied_ns[1] = now_ns;
}

void mavlink_aiding_doubt(struct mavlink_aiding *aiding, uint64_t now_ns)
{
    aiding->denied_ns[0] = aiding->denied_ns[1] = now_ns;
}

static bool denied(uint64_t denied_ns, uint64_t now_ns)
{
    return denied_ns > 0 && now_ns <= denied_ns + FRESH_NS;
}

/* A constant position does not change to the last bit, as recorded of ArduSub. */
static bool stands(struct mavlink_aiding *aiding, const double place_m[2], uint64_t now_ns)
{
    if (!aiding->moved_ns || place_m[0] != aiding->place_m[0] || place_m[1] != aiding->place_m[1])
        aiding->moved_ns = now_ns;
    aiding->place_m[0] = place_m[0];
    aiding->place_m[1] = place_m[1];
    return now_ns >= aiding->moved_ns + FRESH_NS;
}

static unsigned judge(struct mavlink_aiding *aiding, const double place_m[2], uint64_t now_ns)
{
    const bool standing = stands(aiding, place_m, now_ns);
    if (!aiding->offered_ns)
        aiding->offered_ns = now_ns;
    if (!aiding->report_ns) {
        aiding->position = now_ns < aiding->offered_ns + PATIENCE_NS ? MAVLINK_POSITION_WAITING
                           : standing                                ? MAVLINK_POSITION_STANDING
                                                                     : MAVLINK_POSITION_UNREPORTED;
        return aiding->position == MAVLINK_POSITION_UNREPORTED ? MAVLINK_AIDED_POSITION | MAVLINK_AIDED_VELOCITY
                                                               : 0;
    }
    if (now_ns > aiding->report_ns + FRESH_NS) {
        aiding->position = MAVLINK_POSITION_STOPPED;
        return 0;
    }
    const unsigned parts = (denied(aiding->denied_ns[0], now_ns) ? 0u : MAVLINK_AIDED_POSITION) |
                           (denied(aiding->denied_ns[1], now_ns) ? 0u : MAVLINK_AIDED_VELOCITY);

    aiding->position = parts & MAVLINK_AIDED_POSITION ? MAVLINK_POSITION_AIDED : MAVLINK_POSITION_UNAIDED;
    return parts;
}

unsigned mavlink_aiding_offer(struct mavlink_aiding *aiding, const double place_m[2], uint64_t now_ns)
{
    const unsigned parts = judge(aiding, place_m, now_ns);
    if (parts & MAVLINK_AIDED_POSITION)
        aiding->believed_ever = true;
    return parts;
}

bool mavlink_aiding_wanted(const struct mavlink_aiding *aiding, uint64_t now_ns)
{
    return aiding->offered_ns > 0 && (!aiding->report_ns || now_ns > aiding->report_ns + FRESH_NS);
}

bool mavlink_aiding_news(struct mavlink_aiding *aiding, uint64_t now_ns, char *text, size_t size)
{
    static const char *const lines[] = {
        [MAVLINK_POSITION_AIDED] = "position: believed, the autopilot's estimator says that it is measured",
        [MAVLINK_POSITION_UNREPORTED] =
            "warning: position: believed without a report of its source: the autopilot was asked for "
            "EKF_STATUS_REPORT and ESTIMATOR_STATUS and sends neither",
        [MAVLINK_POSITION_STANDING] =
            "warning: position: not used: it does not change at all, and no EKF_STATUS_REPORT or ESTIMATOR_STATUS "
            "says that anything measures it",
        [MAVLINK_POSITION_UNAIDED] = "position: not used: nothing measures it (EKF_STATUS_REPORT or "
                                     "ESTIMATOR_STATUS: constant or not aided, now or within 3 s)",
        [MAVLINK_POSITION_STOPPED] =
            "warning: position: not used: EKF_STATUS_REPORT or ESTIMATOR_STATUS has stopped coming",
    };
    const enum mavlink_position position = aiding->position;
    if (position == aiding->told || position == MAVLINK_POSITION_NONE || position == MAVLINK_POSITION_WAITING ||
        (aiding->told_ns && now_ns < aiding->told_ns + TOLD_AGAIN_NS))
        return false;
    aiding->told = position;
    aiding->told_ns = now_ns;
    snprintf(text, size, "%s", lines[position]);
    return true;
}
