/* SPDX-License-Identifier: MIT */
/*
 * reason - why an answer is what it is, as a sentence for a person that names the thing and its figure. Programs go by
 * the state and the numbers of an answer, not by its sentence. Knows no JSON.
 */
#ifndef SONARD_REASON_H
#define SONARD_REASON_H

#include "daemon/methods/environment.h"

#define REASON_SIZE 320

/* What the sentence is about. */
struct reason {
    enum answer_state state;
    enum answer_reason why;
    double range_m;     /* blocked: of the obstacle */
    double near_m;      /* blocked: it may begin as near as this */
    double free_to_m;   /* how far it is known to be free; <= 0: not given */
    double asked_m;     /* how far was asked; <= 0: not given */
    double blind_to_m;  /* nothing is known nearer, by blindness or drift; <= 0: not given */
    double age_s;       /* of the evidence; negative: none */
    double clear_for_s; /* age limit of clear */
    const char *hidden; /* what hides the water, as hidden_cause has it; NULL or empty: not known */
};

/** reason_sentence - for example "echo at 4.20 m". Ranges of free space are rounded down to centimetres, those of blind
 * zones up. An echo beyond what was asked about blocks because it may be nearer: that is said. With what the pose
 * leaves open. Returns text. */
const char *reason_sentence(const struct methods_env *d, const struct answer_now *now, const struct reason *r,
                            char text[REASON_SIZE]);

/** reason_cause - why nothing is known, without figures but those of a pose that is missing: "the pose is too old: the
 * attitude from a client is 4.2 s old (limit 1 s)". Where the pose has no position the blind zone is not named alone:
 * nearest to the vehicle, drift takes water away too. Returns text, or constant text. */
const char *reason_cause(const struct methods_env *d, const struct answer_now *now, enum answer_reason why,
                         char text[REASON_SIZE]);

/** reason_with_pose - the sentence `why` with what the pose leaves open: the drift that was allowed for evidence of
 * that age (negative: none) where it has no position, depth or attitude, and how far the vehicle may have moved and
 * turned since an old one. Returns text. */
const char *reason_with_pose(const struct answer_now *now, const char *why, double evidence_age_s,
                             char text[REASON_SIZE]);

#endif
