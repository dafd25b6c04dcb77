/* SPDX-License-Identifier: MIT */
/*
 * conf_source - where every value of one loaded configuration came from, and its text. Written by conf.c and
 * conf_parse.c, read by conf_rules.c and conf_print.c.
 */
#ifndef SONARD_CONF_SOURCE_H
#define SONARD_CONF_SOURCE_H

#include "conf.h"
#include "conf_fault.h"
#include "conf_table.h"

#define CONF_FILES_MAX 64 /* the file itself and those of its folder */

struct conf_origin {
    unsigned file;     /* in conf_source, with: */
    unsigned line;     /* 0: the default */
    const char *given; /* the option of the command line that set it instead, or NULL */
    bool bad;          /* what stood there was refused; the default is in force */
    bool unused;       /* the sonar's device has no use for the key; the default is in force */
};

struct conf_file {
    char *name;
    char *text;
    size_t size;
};

_Static_assert(CONF_MAX_GRIDS < CONF_MAX_SONARS, "conf_source.origin has room for the grids");

struct conf_source {
    struct conf_file file[CONF_FILES_MAX]; /* later ones win */
    unsigned n_files;
    char *whole; /* of several files: what they mean together, as one; NULL where there is one */
    size_t whole_size;
    /* by sonar, or by grid, and row of conf_keys; keys of other sections are under 0 */
    struct conf_origin origin[CONF_MAX_SONARS][CONF_KEYS_MAX];
};

/** conf_parse - put the texts of source into conf, one after the other, which holds the defaults;
 * note origins and faults. */
void conf_parse(struct conf *conf, struct conf_source *source, const struct conf_checks *checks,
                struct conf_faults *faults);

/** conf_rules_check - what no single key can tell: values that do not go together. */
void conf_rules_check(const struct conf *conf, const struct conf_source *source, const struct conf_checks *checks,
                      struct conf_faults *faults);

#endif
