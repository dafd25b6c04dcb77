/* SPDX-License-Identifier: MIT */
/* word - see word.h. */
#include "word.h"

#include <string.h>

/* Letters that must be put in, taken out or changed to make b of a (Levenshtein), in one row of the table. */
static size_t distance(const char *a, const char *b)
{
    size_t row[WORD_FAR], n = strlen(b);
    if (n >= WORD_FAR || strlen(a) >= WORD_FAR)
        return WORD_FAR;
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

bool word_is_nearest(const char *a, const char *b, size_t *best)
{
    size_t d = distance(a, b);
    if (d >= *best || d > 1 + strlen(b) / 4)
        return false;
    *best = d;
    return true;
}
