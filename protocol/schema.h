/* SPDX-License-Identifier: MIT */
/* schema - the tables of methods and shapes as JSON Schema (draft 2020-12). */
#ifndef SONARD_SCHEMA_H
#define SONARD_SCHEMA_H

#include <stdio.h>

/** schema_print - the whole document; a line for every definition. */
void schema_print(FILE *out);

#endif
