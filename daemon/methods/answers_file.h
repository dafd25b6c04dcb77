/* SPDX-License-Identifier: MIT */
/* answers_file - `--answers`: what `sectors` answers, a line of JSON after every turn of a head and every so often. */
#ifndef SONARD_ANSWERS_FILE_H
#define SONARD_ANSWERS_FILE_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

struct methods_env;

struct answers_file {
    struct methods_env *d; /* that is asked */
    FILE *file;            /* NULL: none is written */
    bool bands;            /* as a line for each grid and band of elevations */
    uint64_t turns;        /* so far, of all heads */
};

/** answers_file_write - append the sectors as of now; `event` says why, `sensor` whose turn it was ("": nobody's). */
void answers_file_write(struct answers_file *a, const char *event, const char *sensor);

#endif
