/* SPDX-License-Identifier: MIT */
/*
 * contest - the shipped detector and its rivals behind one call, each with the one knob that makes it bold or shy.
 * Knows no truth.
 */
#ifndef SONARD_REPORT_CONTEST_H
#define SONARD_REPORT_CONTEST_H

#include "grid/echoes.h"
#include "grid/ping.h"

#define CONTEST_KNOBS 8

enum contestant { CONTEST_SONARD, CONTEST_THRESHOLD, CONTEST_SOCA, CONTEST_PING360_SONAR, CONTESTANTS };

extern const char *const contest_name[CONTESTANTS];

/** contest_knobs, contest_standard - how many settings the knob has, and which of them is used where it comes
 * from. */
unsigned contest_knobs(enum contestant c);
unsigned contest_standard(enum contestant c);

/** contest_knob_name, contest_knob - what the knob is, and its setting k. */
const char *contest_knob_name(enum contestant c);
double contest_knob(enum contestant c, unsigned k);

/** contest_make - of the heap, for beams of at most max_bins. */
void contest_make(uint32_t max_bins);
void contest_free(void);

/** contest_begin - another sensor: all forget their pings. */
void contest_begin(void);

/** contest_detect - one ping, each in its turn; found has room for its beams. */
void contest_detect(enum contestant c, unsigned k, const struct ping *ping, struct beam_echoes *found);

#endif
