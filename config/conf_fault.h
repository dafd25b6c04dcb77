/* SPDX-License-Identifier: MIT */
/*
 * conf_fault - what is wrong with one configuration: collected in any order, reported in the order of lines. Knows no
 * keys.
 */
#ifndef SONARD_CONF_FAULT_H
#define SONARD_CONF_FAULT_H

#include "conf.h"

#define CONF_FAULTS_MAX                                                                                           \
    500 /* reported one by one; a text file taken for a configuration has more, which are counted */

struct conf_faults {
    unsigned file;          /* where the next ones are: number ... */
    const char *name;       /* ... and name of the file */
    conf_fault_fn left_out; /* told of what is wrong in a line, which is then no fault; NULL: it is one */
    void *left_out_ctx;
    int n; /* faults seen */
    struct {
        unsigned file, line;
        char *message;
    } fault[CONF_FAULTS_MAX];
};

/** conf_fault_in - the next faults are in this file; `name` must stay. */
void conf_fault_in(struct conf_faults *faults, unsigned file, const char *name);

/** conf_fault_add - note a fault of line `line`; 0: of the whole file.
 * Behind "FILE:LINE: " the text is the caller's. */
void conf_fault_add(struct conf_faults *faults, unsigned line, const char *fmt, ...)
    __attribute__((format(printf, 3, 4)));

/** conf_fault_tell - hand all to `tell` in the order of files and lines, free them and return their number. */
int conf_fault_tell(struct conf_faults *faults, conf_fault_fn tell, void *ctx);

#endif
