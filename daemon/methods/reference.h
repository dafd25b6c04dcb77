/* SPDX-License-Identifier: MIT */
/*
 * reference - which obstacles an answer of free water speaks of: those that return at least the reference level of the
 * sonar that saw it. sonard-protocol(7) has the shape.
 */
#ifndef SONARD_METHODS_REFERENCE_H
#define SONARD_METHODS_REFERENCE_H

#include "daemon/methods/environment.h"
#include "daemon/rpc/json_out.h"

/**
 * reference_write_target - the members `target` and `bottom_db`: what a clear answer is clear of. Sonars that report
 * ready ranges detect what they detect, and nobody has told what: with one of them no bottom is named.
 */
void reference_write_target(struct json_out *out, const struct methods_env *d);

/** reference_write - the member `detects`: of a sonar, as of its last ping; null: none was judged by its level. */
void reference_write(struct json_out *out, const struct methods_env *d, const struct extract_reference *reference);

/** reference_write_all - the member `detects`: of every sonar that has one, in an array, with its name. */
void reference_write_all(struct json_out *out, const struct methods_env *d);

#endif
