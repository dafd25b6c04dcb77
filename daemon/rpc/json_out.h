/* SPDX-License-Identifier: MIT */
/*
 * json_out - JSON as it goes out: a text that grows, and writers of values that put commas where they belong. Writes
 * what jansson would write with JSON_COMPACT and reals of 15 digits, byte for byte, but the numbers of answers, which
 * have few decimals, some ten times as fast.
 */
#ifndef SONARD_JSON_OUT_H
#define SONARD_JSON_OUT_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Zeroed: empty. `bytes` is malloced; whoever has it last frees it. */
struct json_out {
    char *bytes; /* [n], no end is marked; NULL as long as nothing was written */
    size_t n, size;
    bool failed; /* no memory, or a number that JSON does not have: what is there is of no use */
};

/** json_out_put - these characters as they are: no comma before them. json_out_bytes - so many. */
void json_out_put(struct json_out *t, const char *characters);
void json_out_bytes(struct json_out *t, const char *bytes, size_t n);

/** json_out_cut - back to the first n bytes, and whole again as it was then. */
void json_out_cut(struct json_out *t, size_t n);

/** json_out_part - values that another text holds, maybe none, with a comma before them where needed.
 * It failed: so has this. */
void json_out_part(struct json_out *t, const struct json_out *values);

/**
 * The parts of a value, each with a comma before it where one is wanted. json_out_open, json_out_close: one of { [ and
 * } ]. json_out_name: of an object's member, whose value is next; names and words have nothing to be escaped, text may
 * have. json_out_real refuses what is not finite, json_out_text what is not UTF-8 (failed).
 * json_out_rounded: json_out_real of round(value * per_unit) / per_unit; per_unit is a power of ten.
 * json_out_value: a whole value, not NULL.
 */
void json_out_open(struct json_out *t, char bracket);
void json_out_close(struct json_out *t, char bracket);
void json_out_name(struct json_out *t, const char *name);
void json_out_word(struct json_out *t, const char *word);
void json_out_text(struct json_out *t, const char *text);
void json_out_integer(struct json_out *t, int64_t value);
void json_out_real(struct json_out *t, double value);
void json_out_rounded(struct json_out *t, double value, double per_unit);
void json_out_null(struct json_out *t);
void json_out_flag(struct json_out *t, bool value);
void json_out_value(struct json_out *t, const json_t *value);

#endif
