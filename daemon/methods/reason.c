/* SPDX-License-Identifier: MIT */
#include "reason.h"

#include <math.h>
#include <stdio.h>

#include "query_context.h"

#define WHY_SIZE 200 /* what the pose leaves open fits behind it */

static double metres_down(double m)
{
    return floor(m * 100 + 1e-6) / 100;
}

static double metres_up(double m)
{
    return ceil(m * 100 - 1e-6) / 100;
}

/* The sonar that is offline, by name where it is only one. */
static void write_offline(const struct methods_env *d, uint64_t lost, char text[WHY_SIZE])
{
    for (int i = 0; i < d->conf.n_sonars; i++)
        if (lost == 1ull << i) {
            snprintf(text, WHY_SIZE, "sonar %s, which covers this direction, is offline", d->conf.sonar[i].name);
            return;
        }
    snprintf(text, WHY_SIZE, "%s", answer_reason_text(ANSWER_SILENT));
}

static void write_observed(const struct reason *r, char text[WHY_SIZE])
{
    if (r->state == ANSWER_BLOCKED && r->asked_m > 0 && r->range_m > r->asked_m)
        snprintf(text, WHY_SIZE, "echo at %.2f m, which may begin at %.2f m", r->range_m, metres_down(r->near_m));
    else if (r->state == ANSWER_BLOCKED)
        snprintf(text, WHY_SIZE, "echo at %.2f m", r->range_m);
    else if (r->free_to_m > 0)
        snprintf(text, WHY_SIZE, "free up to %.2f m", metres_down(r->free_to_m));
    else
        snprintf(text, WHY_SIZE, "free as far as asked");
}

static void write_short(const struct reason *r, char text[WHY_SIZE])
{
    const char *why = answer_reason_text(ANSWER_BEYOND);
    if (r->free_to_m > 0 && r->asked_m > 0)
        snprintf(text, WHY_SIZE, "%s; observed only to %.2f m of %.2f m", why, metres_down(r->free_to_m),
                 r->asked_m);
    else
        snprintf(text, WHY_SIZE, "%s, but not observed as far as asked", why);
}

const char *reason_cause(const struct methods_env *d, const struct answer_now *now, enum answer_reason why,
                         char text[REASON_SIZE])
{
    char missing[QUERY_REASON_SIZE];
    if (why == ANSWER_BLIND && now->pose.drift_mps > 0)
        return "water next to the vehicle: in the blind zone, or scanned too long ago";
    if (why == ANSWER_BOTTOM) {
        snprintf(text, REASON_SIZE, "%s of %.2f m", answer_reason_text(why), metres_down(now->pose.altitude_m));
        return text;
    }
    if (why != ANSWER_POSE_LOST || !query_pose_missing(d, missing)[0])
        return answer_reason_text(why);
    snprintf(text, REASON_SIZE, "%s: %.100s", answer_reason_text(why), missing);
    return text;
}

static void write_bottom(const struct methods_env *d, const struct answer_now *now, const struct reason *r,
                         char text[WHY_SIZE])
{
    char cause[REASON_SIZE];
    const char *why = reason_cause(d, now, ANSWER_BOTTOM, cause);
    if (r->free_to_m > 0 && r->asked_m > 0)
        snprintf(text, WHY_SIZE, "%.100s; free up to %.2f m of %.2f m", why, metres_down(r->free_to_m),
                 r->asked_m);
    else
        snprintf(text, WHY_SIZE, "%.100s", why);
}

static void write_why(const struct methods_env *d, const struct answer_now *now, const struct reason *r,
                      char text[WHY_SIZE])
{
    char cause[REASON_SIZE];
    if (r->why == ANSWER_HEARD)
        write_observed(r, text);
    else if (r->why == ANSWER_BEYOND)
        write_short(r, text);
    else if (r->why == ANSWER_BOTTOM)
        write_bottom(d, now, r, text);
    else if (r->why == ANSWER_SILENT)
        write_offline(d, now->lost, text);
    else if (r->why == ANSWER_BLIND && r->blind_to_m > 0 && !(now->pose.drift_mps > 0))
        snprintf(text, WHY_SIZE, "%s, which ends at %.2f m", answer_reason_text(r->why), metres_up(r->blind_to_m));
    else if (r->why == ANSWER_STALE && r->age_s > r->clear_for_s)
        snprintf(text, WHY_SIZE, "last scan of this direction is %.1f s old (limit %.1f s)", r->age_s,
                 r->clear_for_s);
    else
        snprintf(text, WHY_SIZE, "%.*s", WHY_SIZE - 1, reason_cause(d, now, r->why, cause));
}

/* Less of it is in every answer, and tells nobody anything. */
#define MOVED_LEAST_M    0.2
#define TURNED_LEAST_RAD (GEO_PI / 90)

/* What is missing of the place, and how far it may be off by now. */
static void write_drift(const struct answer_now *now, double evidence_age_s, char *text, size_t size)
{
    const struct pose *pose = &now->pose;
    const bool place = pose->has & POSE_POSITION, depth = pose->has & POSE_DEPTH;
    text[0] = '\0';
    if (!(pose->drift_mps > 0) || (evidence_age_s < 0 && !pose->heading_adrift))
        return;
    if (pose->heading_adrift)
        snprintf(text, size, "; no attitude: the vehicle may have turned");
    else
        snprintf(text, size, "; no %s: %.1f m of drift allowed for",
                 place   ? "depth"
                 : depth ? "position"
                         : "position and no depth",
                 answer_drifted_m(now, evidence_age_s));
}

/* How far an old pose may be off, while it counts. */
static void write_uncertainty(const struct answer_now *now, char *text, size_t size)
{
    const struct pose *pose = &now->pose;
    const bool moved = pose->uncertain_m >= MOVED_LEAST_M, turned = pose->uncertain_rad >= TURNED_LEAST_RAD;
    const double turned_deg = geo_deg(fmin(pose->uncertain_rad, GEO_PI));
    text[0] = '\0';
    if (!now->pose_fresh)
        return;
    if (moved && turned)
        snprintf(text, size, "; since the last pose the vehicle may have moved %.1f m and turned %.0f deg",
                 pose->uncertain_m, turned_deg);
    else if (moved)
        snprintf(text, size, "; since the last pose the vehicle may have moved %.1f m", pose->uncertain_m);
    else if (turned)
        snprintf(text, size, "; since the last pose the vehicle may have turned %.0f deg", turned_deg);
}

const char *reason_with_pose(const struct answer_now *now, const char *why, double evidence_age_s,
                             char text[REASON_SIZE])
{
    char drift[80], uncertain[100];
    write_drift(now, evidence_age_s, drift, sizeof drift);
    write_uncertainty(now, uncertain, sizeof uncertain);
    snprintf(text, REASON_SIZE, "%s%s%s", why, drift, uncertain);
    return text;
}

const char *reason_sentence(const struct methods_env *d, const struct answer_now *now, const struct reason *r,
                            char text[REASON_SIZE])
{
    char why[WHY_SIZE], whole[REASON_SIZE];
    const bool hidden = r->hidden && r->hidden[0];
    write_why(d, now, r, why);
    snprintf(whole, sizeof whole, "%s%s%s", why, hidden ? ": " : "", hidden ? r->hidden : "");
    return reason_with_pose(now, whole, r->age_s, text);
}
