/* SPDX-License-Identifier: MIT */
/* man - the tables of sonard-protocol(7): every method's parameters, and results that are told field by field. */
#ifndef SONARD_MAN_H
#define SONARD_MAN_H

#include <stdbool.h>
#include <stdio.h>

/**
 * man_fill - copy a page, with tables in place of the lines "@PARAMS method@", "@RESULT method@" and "@CHANGES@" (the
 * methods that change something), and sections in place of "@OTHERS@" for the methods that no line before it names.
 * False: a line names no method.
 */
bool man_fill(FILE *page, FILE *out);

#endif
