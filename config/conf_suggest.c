/* SPDX-License-Identifier: MIT */
/*
 * conf_suggest - the nearest known word, by the number of letters that differ.
 */
#include "conf_suggest.h"

#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "conf_table.h"

#define WORD_MAX 64 /* longer words are near to nothing */

/* Letters that must be put in, taken out or changed to make b of a (Levenshtein), in one row of the table. */
static size_t distance(const char *a, const char *b)
{
    size_t row[WORD_MAX], n = strlen(b);
    if (n >= WORD_MAX || strlen(a) >= WORD_MAX)
        return WORD_MAX;
    for (size_t j = 0; j <= n; j++)
        row[j] = j;
    for (size_t i = 1; a[i - 1]; i++) {
        size_t diagonal = row[0];
        row[0] = i;
        for (size_t j = 1; j <= n; j++) {
            size_t best = diagonal + (a[i - 1] != b[j - 1]);
            diagonal = row[j];
            if (row[j] + 1 < best)
                best = row[j] + 1;
            if (row[j - 1] + 1 < best)
                best = row[j - 1] + 1;
            row[j] = best;
        }
    }
    return row[n];
}

/* Is b nearer to a than anything before, and near enough to be meant: one letter, and one more for every four? */
static bool is_nearest(const char *a, const char *b, size_t *best)
{
    size_t d = distance(a, b);
    if (d >= *best || d > 1 + strlen(b) / 4)
        return false;
    *best = d;
    return true;
}

/* [sonar] is written with a name. */
static const char *name_part(const char *section)
{
    return strcmp(section, "sonar") == 0 ? " NAME" : "";
}

void conf_suggest_key(const char *section, const char *name, char *text, size_t size)
{
    const char *nearest = NULL, *elsewhere = NULL;
    size_t best = WORD_MAX;
    size_t used = (size_t)snprintf(text, size, "want one of ");
    const char *separator = "";
    for (const struct conf_key *key = conf_keys; key->name; key++) {
        if (strcmp(key->section, section) == 0) {
            if (used < size)
                used += (size_t)snprintf(text + used, size - used, "%s%s", separator, key->name);
            separator = ", ";
            if (is_nearest(name, key->name, &best))
                nearest = key->name;
        } else if (strcmp(key->name, name) == 0) {
            elsewhere = key->section;
        }
    }
    if (elsewhere)
        snprintf(text, size, "it belongs in [%s%s]", elsewhere, name_part(elsewhere));
    else if (nearest)
        snprintf(text, size, "did you mean %s?", nearest);
}

void conf_suggest_section(const char *name, char *text, size_t size)
{
    const char *nearest = NULL;
    size_t best = WORD_MAX;
    size_t used = (size_t)snprintf(text, size, "want one of ");
    const char *separator = "";
    for (const struct conf_section *section = conf_sections; section->name; section++) {
        if (used < size)
            used += (size_t)snprintf(text + used, size - used, "%s[%s%s]", separator, section->name,
                                     name_part(section->name));
        separator = ", ";
        if (is_nearest(name, section->name, &best))
            nearest = section->name;
    }
    if (nearest)
        snprintf(text, size, "did you mean [%s%s]?", nearest, name_part(nearest));
}
