/* SPDX-License-Identifier: MIT */
/* table.h - reads the comma separated reference tables of tests/oracles, row by row, fields by column number. */
#ifndef SONARD_TEST_TABLE_H
#define SONARD_TEST_TABLE_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TABLE_FIELDS 32

struct table {
    FILE *file;
    char line[8192];
    char *field[TABLE_FIELDS];
    int n;
};

static inline struct table table_open(const char *path)
{
    struct table t = {.file = fopen(path, "r")};
    if (!t.file || !fgets(t.line, sizeof t.line, t.file)) {
        printf("%s: missing or empty\n", path);
        exit(1);
    }
    return t;
}

/* The next row, split in place; false (and the file closed) at the end. */
static inline int table_next(struct table *t)
{
    if (!fgets(t->line, sizeof t->line, t->file)) {
        fclose(t->file);
        return 0;
    }
    t->line[strcspn(t->line, "\r\n")] = '\0';
    t->n = 0;
    for (char *rest = t->line; rest && t->n < TABLE_FIELDS; t->n++)
        t->field[t->n] = strsep(&rest, ",");
    return 1;
}

static inline double table_real(const struct table *t, int column)
{
    return strtod(t->field[column], NULL);
}

static inline long table_int(const struct table *t, int column)
{
    return strtol(t->field[column], NULL, 10);
}

#endif
