/* SPDX-License-Identifier: MIT */
/*
 * page - what the forms of results have in common: values of an answer as a person reads them, words in colour. What is
 * missing or of the wrong kind is NAN, or shown as "-"; text of the daemon cannot move the cursor. Knows no method.
 */
#ifndef SONARD_PAGE_H
#define SONARD_PAGE_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

#define PAGE_CELL 256 /* bytes of one formatted value */

enum page_colour { PAGE_PLAIN, PAGE_RED, PAGE_GREEN, PAGE_YELLOW };

struct page {
    FILE *out;
    bool colour;
};

double page_number(const json_t *object, const char *key);
long long page_count(const json_t *object, const char *key); /* 0 without */

/* Each into the cell, or constant text. */
const char *page_text(char cell[PAGE_CELL], const json_t *object, const char *key);
const char *page_metres(char cell[PAGE_CELL], double m);
const char *page_duration(char cell[PAGE_CELL], double s);
const char *page_utc(char cell[PAGE_CELL], double t_unix);

/** page_plural - what a noun has behind it after this number: "s", or nothing after 1. */
const char *page_plural(long long n);

/** page_target - a line that says what free water is free of; nothing where the answer does not say it. */
void page_target(const struct page *page, const json_t *result);

/** page_word - at least width wide, from the left. */
void page_word(const struct page *page, enum page_colour colour, int width, const char *word);

/** page_state_colour - of blocked, clear and all else. */
enum page_colour page_state_colour(const char *state);

#endif
