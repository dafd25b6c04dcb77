/* SPDX-License-Identifier: MIT */
/*
 * text - JSON as it goes out: a text that grows, and writers of values that put commas where they belong. Writes what
 * jansson would write with JSON_COMPACT and reals of 15 digits, byte for byte, but the numbers of answers, which have few
 * decimals, some ten times as fast.
 */
#ifndef SONARD_TEXT_H
#define SONARD_TEXT_H

#include <jansson.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Zeroed: empty. `bytes` is malloced; whoever has it last frees it. */
struct text {
    char *bytes; /* [n], no end is marked; NULL as long as nothing was written */
    size_t n, size;
    bool failed; /* no memory, or a number that JSON does not have: what is there is of no use */
};

/** text_put - these characters as they are: no comma before them. text_bytes - so many. */
void text_put(struct text *t, const char *characters);
void text_bytes(struct text *t, const char *bytes, size_t n);

/** text_cut - back to the first n bytes, and whole again as it was then. */
void text_cut(struct text *t, size_t n);

/** text_part - values that another text holds, maybe none, with a comma before them where needed. It failed: so has this. */
void text_part(struct text *t, const struct text *values);

/**
 * The parts of a value, each with a comma before it where one is wanted. text_open, text_close: one of { [ and } ].
 * text_name: of an object's member, whose value is next; names and words have nothing to be escaped. text_real refuses
 * what is not finite (failed). text_json: a whole value, not NULL.
 */
void text_open(struct text *t, char bracket);
void text_close(struct text *t, char bracket);
void text_name(struct text *t, const char *name);
void text_word(struct text *t, const char *word);
void text_integer(struct text *t, int64_t value);
void text_real(struct text *t, double value);
void text_null(struct text *t);
void text_flag(struct text *t, bool value);
void text_json(struct text *t, const json_t *value);

#endif
