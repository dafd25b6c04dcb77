/* SPDX-License-Identifier: MIT */
/*
 * oracle - what a detector could do that knew the background of every beam of a drawn world and how strong a wall
 * is there: the bound that no detector of single beams passes. It hears only the samples.
 */
#ifndef SONARD_REPORT_ORACLE_H
#define SONARD_REPORT_ORACLE_H

#include "drawn_sound.h"
#include "grid/echoes.h"

/**
 * oracle_detect - an echo is the first sample that exceeds, by a factor of power, what the background hardly ever
 * does; the water before it is free as far as the reference wall would be heard without a gap.
 */
void oracle_detect(const struct drawn_sound *sound, unsigned beam, double factor, struct beam_echoes *out);

#endif
