/* SPDX-License-Identifier: MIT */
/*
 * verdict_ask - what a verdict asks the records of free water: in whose axes, from where to where, how finely.
 */
#ifndef SONARD_VERDICT_ASK_H
#define SONARD_VERDICT_ASK_H

#include "verdict.h"

#define VERDICT_FARTHEST_M 600.0 /* of a question to the records */

/** verdict_ned, verdict_near_m, verdict_distance_m - of the query: is it in NED, up to where `near` holds, how far is
 * asked. */
bool verdict_ned(const struct verdict *v);
double verdict_near_m(const struct verdict *v);
double verdict_distance_m(const struct verdict *v);

/** verdict_axis - of a cone or corridor, in the axes of the records: NED, or the body's without an attitude. */
void verdict_axis(const struct verdict *v, double axis[3]);

/** verdict_middle_rad - the azimuth in the middle of a sector, in the axes asked about. */
double verdict_middle_rad(const struct answer_band *q, size_t part);

/** verdict_band - that of a part, or of all of them while v->all. */
void verdict_band(const struct verdict *v, size_t part, struct ask_band *band);

/** verdict_way - the question about a body that moves. */
struct ask_question verdict_way(const struct verdict *v);

/** verdict_question - about all parts while v->all, or that one, from from_m on. */
struct ask_question verdict_question(const struct verdict *v, size_t part, double from_m);

/** verdict_most_asked_m - the farthest that any question of it goes. */
double verdict_most_asked_m(const struct verdict *v);

/** verdict_now - when and where the records are asked, and what counts of them. */
struct store_now verdict_now(const struct verdict *v);

/** verdict_ask - begins to ask verdict_question, or verdict_way. */
void verdict_ask(struct verdict *v, size_t part, double from_m);

#endif
