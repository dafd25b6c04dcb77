/* SPDX-License-Identifier: MIT */
/*
 * show_background - results of the daemon's `background` methods for people: a few lines of state, and the template
 * drawn around the vehicle in characters or as SVG. What is missing or of the wrong kind is left out. Knows no socket.
 */
#ifndef SONARD_SHOW_BACKGROUND_H
#define SONARD_SHOW_BACKGROUND_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

/** show_background_state - what is in force and what is being learnt, in a few lines. */
void show_background_state(FILE *out, const json_t *result);

/** show_background_progress - one line without newline: how far learning is. */
void show_background_progress(FILE *out, const json_t *result);

/** show_background_draw - the result's rows in characters: forward up, # blind, . learnt and open, blank not learnt. */
void show_background_draw(FILE *out, const json_t *result);

/** show_background_svg - the counts of the template as SVG, out to the same rim. False when writing fails (errno). */
bool show_background_svg(FILE *out, json_t *result);

#endif
