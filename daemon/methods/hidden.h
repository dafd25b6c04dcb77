/* SPDX-License-Identifier: MIT */
/*
 * hidden - what hides the water that an answer about a direction does not know: the vehicle's own echo, the template,
 * or a loud ring-down. From the last beams that looked there; no answer depends on it. Knows no JSON.
 */
#ifndef SONARD_HIDDEN_H
#define SONARD_HIDDEN_H

#include "daemon/methods/environment.h"

#define HIDDEN_SIZE 80

/**
 * hidden_cause - of an answer to `query` whose water is known to a->free_to_m: "hidden by the vehicle's own echo".
 * Empty where none of these ended it, or the answer has another reason. Returns text.
 */
const char *hidden_cause(const struct methods_env *d, const struct answer_now *now,
                         const struct answer_query *query, const struct answer *a, char text[HIDDEN_SIZE]);

#endif
