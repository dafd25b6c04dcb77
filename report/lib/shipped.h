/* SPDX-License-Identifier: MIT */
/*
 * shipped - the detector as the daemon runs it on one sensor's pings, with the shipped configuration but for one
 * knob. What changes in the way the daemon calls it changes here alone, for all that judge it.
 */
#ifndef SONARD_REPORT_SHIPPED_H
#define SONARD_REPORT_SHIPPED_H

#include "grid/echoes.h"
#include "grid/ping.h"
#include "grid/range/extract.h"
#include "knob.h"

struct shipped;

/* The knob that moves between finding more and crying wolf less, from bold to shy; the shipped value is among
 * them. */
#define SHIPPED_KNOBS 7

extern const char *const shipped_knob_name;
extern const double shipped_knob[SHIPPED_KNOBS];
extern const unsigned shipped_knob_default;

/** shipped_make - of the heap, for beams of at most max_bins; ends the program with a sentence where that fails.
 * */
struct shipped *shipped_make(double knob, uint32_t max_bins);
/** shipped_configuration - what shipped_make runs, as knob.h has it. */
void shipped_configuration(double knob, char text[KNOB_TEXT_MAX]);
/** shipped_make_as - the same with another configuration. */
struct shipped *shipped_make_as(const struct extract_conf *conf, uint32_t max_bins);
void shipped_free(struct shipped *shipped);

/** shipped_begin - another sensor: forgets all pings. */
void shipped_begin(struct shipped *shipped);

/** shipped_run - one ping; out has room for its beams. */
void shipped_run(struct shipped *shipped, const struct ping *ping, struct echoes *out);

#endif
