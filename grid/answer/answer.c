/* SPDX-License-Identifier: MIT */
#include "answer.h"

#include <math.h>

#define CLEAR_FOR_LEAST_S 30.0
#define CLEAR_FOR_TURNS   1.5

double answer_clear_for_s(double turn_s, double forget_s)
{
    return fmin(fmax(CLEAR_FOR_LEAST_S, CLEAR_FOR_TURNS * turn_s), forget_s);
}

double answer_drifted_m(const struct answer_now *now, double age_s)
{
    const double last_s = ANSWER_DRIFTED_S;
    if (!now->drift_varies)
        return now->pose.drift_mps * age_s;
    if (!(age_s <= last_s))
        return now->drifted_m[ANSWER_DRIFTED_S - 1] + now->pose.drift_mps * (age_s - last_s);
    return now->drifted_m[(int)fmax(ceil(age_s) - 1, 0)];
}

const char *answer_state_name(enum answer_state state)
{
    static const char *const names[] = {
        [ANSWER_CLEAR] = "clear", [ANSWER_BLOCKED] = "blocked", [ANSWER_UNKNOWN] = "unknown"};
    return names[state];
}

const char *answer_reason_text(enum answer_reason reason)
{
    static const char *const texts[] = {
        [ANSWER_HEARD] = "observed",
        [ANSWER_BEYOND] = "no obstacle detected",
        [ANSWER_BOTTOM] = "the bottom may begin there, by the altitude",
        [ANSWER_BLIND] = "inside the blind zone of the sonar",
        [ANSWER_MOVED] = "data outdated: the vehicle has moved since this direction was scanned",
        [ANSWER_STALE] = "last scan of this direction is too old",
        [ANSWER_SILENT] = "the sonar that covers this direction is offline",
        [ANSWER_NEVER] = "never observed",
        [ANSWER_OUTSIDE] = "outside the grid's coverage",
        [ANSWER_NO_FRAME] = "no attitude received, so north is unknown",
        [ANSWER_POSE_LOST] = "the pose is too old",
        [ANSWER_NO_DATA] = "no data from the sonar",
    };
    return texts[reason];
}
