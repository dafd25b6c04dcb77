/* SPDX-License-Identifier: MIT */
/*
 * out_file - a file that a command writes: under its name with .part behind it until it is complete, so what has the
 * name is whole. A command that fails, or that a signal ends, leaves none of it.
 */
#ifndef SONARD_OUT_FILE_H
#define SONARD_OUT_FILE_H

#include <stdbool.h>

#include "core/fault.h"

/**
 * out_file_create - to write PATH.part. replace: a regular file that is there already is replaced in the end, and
 * anything else there (a pipe, a terminal) is written itself; else one that is there is a fault. What a killed command
 * left as PATH.part is replaced; one that another command is writing is a fault. -1 with a sentence in fault.
 */
int out_file_create(const char *path, bool replace, struct fault *fault);

/** out_file_keep - it is written and closed: give it its name. False with a sentence in fault, and it is removed. */
bool out_file_keep(const char *path, bool replace, struct fault *fault);

/** out_file_drop - remove it. */
void out_file_drop(const char *path);

#endif
