/* SPDX-License-Identifier: MIT */
/*
 * rivals - what others do with a ping: a fixed threshold, the smaller-of CFAR of bruce_slam, the rule of
 * ping360_sonar. Each gives one echo at most, and takes the water for free up to it or, without one, up to the
 * range. Written from what is published of them.
 */
#ifndef SONARD_REPORT_RIVALS_H
#define SONARD_REPORT_RIVALS_H

#include "grid/echoes.h"
#include "grid/ping.h"

/** rivals_threshold - the first sample of more than `counts` beyond from_m, in one beam. With 60 counts and 0.9 m,
 * what a user writes in five minutes; with 200 counts and 0.75 m, the rule by which ping360_sonar makes its laser
 * scan. */
void rivals_threshold(const struct ping *ping, unsigned beam, double counts, double from_m,
                      struct beam_echoes *out);

/**
 * rivals_soca - bruce_slam's (Wang et al. 2022; settings of its sample configuration): the smaller-of CFAR on the
 * counts as they are, 20 training and 5 guard cells on each side, factor for a false-alarm rate of 0.1, and more
 * than `counts` (85 there). It knows no ring-down: as for the fixed threshold, what is nearer than 0.9 m is left
 * out.
 */
void rivals_soca(const struct ping *ping, unsigned beam, double counts, struct beam_echoes *out);

#endif
