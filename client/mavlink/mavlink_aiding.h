/* SPDX-License-Identifier: MIT */
/*
 * mavlink_aiding - does the autopilot's position rest on a measurement? Its estimator goes on giving a position when
 * nothing measures one: the last it had, or one that stands still whatever the vehicle does. Only its report of itself
 * tells them apart: EKF_STATUS_REPORT (ArduPilot) or ESTIMATOR_STATUS (PX4), whose flags have the same meaning. Pure.
 * Times are CLOCK_MONOTONIC nanoseconds.
 *
 * A report counts for three seconds: one that has stopped confirms nothing. What one report disowns the next does not
 * confirm: an estimator that wavers, or two that speak under one id, have no position. An autopilot that was asked for
 * reports and has never sent one may have none to give; its positions are taken after twelve seconds while they change,
 * and the log says so: what is measured is never the same to the last bit for three seconds. Once a report has come,
 * every position needs one.
 */
#ifndef SONARD_MAVLINK_AIDING_H
#define SONARD_MAVLINK_AIDING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum mavlink_aided { MAVLINK_AIDED_POSITION = 1, MAVLINK_AIDED_VELOCITY = 2 };

/* What became of the newest position. */
enum mavlink_position {
    MAVLINK_POSITION_NONE,       /* none has come */
    MAVLINK_POSITION_AIDED,      /* believed */
    MAVLINK_POSITION_UNREPORTED, /* believed for want of any report */
    MAVLINK_POSITION_STANDING,   /* not believed: no report, and it never changes */
    MAVLINK_POSITION_WAITING,    /* not believed: no report yet, and still time for one */
    MAVLINK_POSITION_UNAIDED,    /* not believed: the report says that nothing measures it */
    MAVLINK_POSITION_STOPPED,    /* not believed: the reports have stopped */
};

/* All zeros: an autopilot that has said nothing. */
struct mavlink_aiding {
    uint64_t report_ns, offered_ns; /* of the newest report, of the first position; 0: none */
    uint64_t denied_ns[2];          /* when a report disowned the position, the velocity; 0: none did */
    double place_m[2];              /* of the newest position: north, east, ... */
    uint64_t moved_ns;              /* ... and when it was another */
    enum mavlink_position position, told;
    bool believed_ever; /* has any position been believed? */
    uint64_t told_ns;
};

/** mavlink_aiding_report - the flags of a report that came at now_ns. */
void mavlink_aiding_report(struct mavlink_aiding *aiding, uint16_t flags, uint64_t now_ns);

/** mavlink_aiding_doubt - who reported may be another from now on: what it said before confirms nothing. */
void mavlink_aiding_doubt(struct mavlink_aiding *aiding, uint64_t now_ns);

/** mavlink_aiding_offer - a position (north, east) came: may it and its velocity be believed (enum mavlink_aided)? */
unsigned mavlink_aiding_offer(struct mavlink_aiding *aiding, const double place_m[2], uint64_t now_ns);

/** mavlink_aiding_wanted - do positions come, and no reports with them? */
bool mavlink_aiding_wanted(const struct mavlink_aiding *aiding, uint64_t now_ns);

/** mavlink_aiding_news - a line when positions begin or cease to be believed, at most every ten seconds. */
bool mavlink_aiding_news(struct mavlink_aiding *aiding, uint64_t now_ns, char *text, size_t size);

#endif
