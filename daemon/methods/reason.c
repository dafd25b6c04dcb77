/* SPDX-License-Identifier: MIT */
#include "reason.h"

#include <math.h>
#include <stdio.h>

#include "query_context.h"

#define WHY_SIZE (REASON_SIZE - 64) /* so that the drift fits behind it */

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
    if (r->state == ANSWER_BLOCKED)
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
        return "next to the vehicle, where the sonar is blind or the water not known any more";
    if (why != ANSWER_POSE_LOST || !query_pose_missing(d, missing)[0])
        return answer_reason_text(why);
    snprintf(text, REASON_SIZE, "%s: %.100s", answer_reason_text(why), missing);
    return text;
}

static void write_why(const struct methods_env *d, const struct answer_now *now, const struct reason *r,
                      char text[WHY_SIZE])
{
    char cause[REASON_SIZE];
    if (r->why == ANSWER_HEARD)
        write_observed(r, text);
    else if (r->why == ANSWER_BEYOND)
        write_short(r, text);
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

const char *reason_with_drift(const struct answer_now *now, const char *why, double evidence_age_s,
                              char text[REASON_SIZE])
{
    const struct pose *pose = &now->pose;
    if (!(pose->drift_mps > 0) || (evidence_age_s < 0 && !pose->heading_adrift))
        snprintf(text, REASON_SIZE, "%s", why);
    else if (pose->heading_adrift)
        snprintf(text, REASON_SIZE, "%s; no attitude: the vehicle may have turned", why);
    else
        snprintf(text, REASON_SIZE, "%s; no position: %.1f m of drift allowed for", why,
                 pose->drift_mps * evidence_age_s);
    return text;
}

const char *reason_sentence(const struct methods_env *d, const struct answer_now *now, const struct reason *r,
                            char text[REASON_SIZE])
{
    char why[WHY_SIZE];
    write_why(d, now, r, why);
    return reason_with_drift(now, why, r->age_s, text);
}
