/* SPDX-License-Identifier: MIT */
/*
 * knob - the rows of an experiment that turns settings one by one from the shipped configuration. A row is lines of a
 * configuration file; what it is called, whether it is the default and what it says that it ran are made from the
 * configuration that came of them, so no row can be called what it did not run. Ends the program with a sentence where
 * something cannot be.
 */
#ifndef SONARD_REPORT_KNOB_H
#define SONARD_REPORT_KNOB_H

#include "config/conf.h"

struct knob {
    const char *name; /* of the knob; with `section`, the key */
    const char
        *section; /* of `name` in conf_table; NULL: the knob is no single key, and `label` says what the row is */
    const char *value;  /* of the key, as a file has it; NULL: nothing is set, the row is the shipped value */
    const char *more;   /* lines of a configuration file beside it; NULL: none */
    const char *label;  /* without `section`: in a few words */
    const char *beside; /* what the row runs that is in no configuration, in a few words; NULL: nothing */
    double number;      /* ... as a number, for the program; the configuration has all others */
};

#define KNOB_KEY(of, key, as)                                                                                     \
    {                                                                                                             \
        .name = (key), .section = (of), .value = (as)                                                             \
    }

#define KNOB_COLUMNS  "knob,value,default,configuration"
#define KNOB_TEXT_MAX 1024

/** knob_base - sections that all rows have, none of which any row has itself; what they set counts as shipped. */
void knob_base(const char *lines);

/** knob_conf - the shipped configuration with one Ping360 of 12 m range, and what the row sets. NULL: as shipped. */
void knob_conf(const struct knob *knob, struct conf *conf);

/** knob_configuration - what the row runs: its key, every other key that is not as shipped, and `beside`. */
void knob_configuration(const struct knob *knob, char text[KNOB_TEXT_MAX]);

/** knob_is_default - is it all as shipped? */
bool knob_is_default(const struct knob *knob);

/** knob_check - no two rows of one knob run the same; ends the program where they do. */
void knob_check(const struct knob *knob, size_t n);

/** knob_print - a row's KNOB_COLUMNS, without a comma behind them. */
void knob_print(const struct knob *knob);

/** knob_value - the value of the row's key, or its label; of the configuration that the row runs. */
void knob_value(const struct knob *knob, char text[KNOB_TEXT_MAX]);

#endif
