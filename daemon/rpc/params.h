/* SPDX-License-Identifier: MIT */
/*
 * params - a request's parameters against the rows of its method: what is unknown, missing, of another type or out of
 * its range is refused, and what has a default and is not there gets it.
 * Methods read them afterwards without asking again.
 */
#ifndef SONARD_PARAMS_H
#define SONARD_PARAMS_H

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>

#include "protocol/protocol.h"
#include "rpc_error.h"

/** params_take - check the object, and set the defaults in it; false with *error set (RPC_INVALID_PARAMS). */
bool params_take(const struct protocol_param *rows, json_t *params, struct rpc_error *error);

/** params_refuse_other - false with *error set when the object has a member that is none of the
 * NULL-terminated names. */
bool params_refuse_other(json_t *object, const char *const *names, struct rpc_error *error);

/** params_kind - what a value is, as messages say it: "a number". */
const char *params_kind(const json_t *value);

#define PARAMS_NUMBER_SIZE 32

/** params_number_text - a number for a message: six digits, or as many as tell it from every other. Returns text. */
const char *params_number_text(double number, char text[PARAMS_NUMBER_SIZE]);

/* Of parameters that were taken: one that is not there is 0, false or NULL. */
bool params_has(const json_t *params, const char *name);
double params_number(const json_t *params, const char *name);
int64_t params_integer(const json_t *params, const char *name);
bool params_flag(const json_t *params, const char *name);
const char *params_text(const json_t *params, const char *name);

/** params_is - is it this word? */
bool params_is(const json_t *params, const char *name, const char *word);

/** params_numbers - all numbers of an array into out; false: not there, and out is as before. */
bool params_numbers(const json_t *params, const char *name, double *out);

/** params_places - all places of an array into out; how many there are. */
unsigned params_places(const json_t *params, const char *name, double out[][3]);

#endif
