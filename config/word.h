/* SPDX-License-Identifier: MIT */
/*
 * word - which known word somebody may have meant, by the number of letters that differ.
 */
#ifndef SONARD_WORD_H
#define SONARD_WORD_H

#include <stdbool.h>
#include <stddef.h>

#define WORD_FAR 64 /* letters: what a search begins with; words this long are near to nothing */

/**
 * word_is_nearest - is b nearer to a than any before it, and near enough to be meant: one letter, and one more for
 * every four? *best is the distance of the nearest so far.
 */
bool word_is_nearest(const char *a, const char *b, size_t *best);

#endif
