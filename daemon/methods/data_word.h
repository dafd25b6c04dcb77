/* SPDX-License-Identifier: MIT */
/*
 * data_word - whether the sonars' data and the poses are such that answers can rest on them. Knows no JSON.
 */
#ifndef SONARD_DATA_WORD_H
#define SONARD_DATA_WORD_H

#include "daemon/methods/environment.h"

/** status_data_word - in a few words whether the answers rest on living sonars, "ok" or the gravest cause why not: what
 * `status` says as `data`. Constant text. */
const char *status_data_word(const struct methods_env *d);

#endif
