/* SPDX-License-Identifier: MIT */
/*
 * readable - the one rule for text from outside (names of files, what a file says of itself), wherever people or JSON
 * get it: valid UTF-8 without control characters, cut between characters. Pure.
 */
#ifndef SONARD_READABLE_H
#define SONARD_READABLE_H

#include <stddef.h>

/** readable_length - bytes of the UTF-8 character at text, 1 to 4; 0: none is there, or a control character. */
size_t readable_length(const char *text);

/**
 * readable - put '?' in the place of every control character and every byte that is part of no character. A
 * character that the end of the text cuts off is removed. The text grows no longer.
 */
void readable(char *text);

#endif
