/* SPDX-License-Identifier: MIT */
/*
 * command_table - the command line of sonarctl, as a table: what the program, its help and the shells' completion go
 * by. Knows no daemon.
 */
#ifndef SONARD_COMMAND_TABLE_H
#define SONARD_COMMAND_TABLE_H

#include "command_options.h"

extern const struct command command_table[]; /* a name NULL ends it */

#endif
