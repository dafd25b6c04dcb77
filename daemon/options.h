/* SPDX-License-Identifier: MIT */
/*
 * options - the command line of sonard(8). Answers by itself what needs no configuration: --help, --version, --sample.
 */
#ifndef SONARD_OPTIONS_H
#define SONARD_OPTIONS_H

#include <stdbool.h>

#define OPTIONS_CONF "/etc/sonard/sonard.conf"

/* Exit statuses. */
enum { OK = 0, FAILED = 1, USAGE = 2, MISCONFIGURED = 3 };

enum options_explain { EXPLAIN_NOT, EXPLAIN_TABLE, EXPLAIN_JSON };

struct options {
    const char *conf, *replay, *record, *answers, *socket;
    bool check, print, stay, measure;
    bool bands; /* of --answers: every grid and elevation, not only about the horizon */
    enum options_explain explain;
    double every_s; /* of --answers; 0: after turns and at the end only */
    double speed;   /* 0: as fast as it goes */
    int threads;    /* -1: as configured */
};

/** options_parse - over *o, which holds the defaults. -1: go on; otherwise all is said and it is the exit status. */
int options_parse(int argc, char **argv, struct options *o);

#endif
