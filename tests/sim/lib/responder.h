/* SPDX-License-Identifier: MIT */
/*
 * responder - what the programs of the virtual sonars that answer requests and send readings share: the command line,
 * the line with its faults, commands on standard input, and the loop on the monotonic clock. It has no scene: numbers
 * say what is in the water. What the sonar itself does is behind struct responder_ops.
 */
#ifndef SONARD_SIM_RESPONDER_H
#define SONARD_SIM_RESPONDER_H

#include <stdio.h>

#include "line.h"

/* A number of the sonar or its surroundings: an option at the start (--NAME X) and a command while it runs (NAME X). */
struct responder_number {
    const char *name, *what;
    double *value;
    double lo, hi;
};

struct responder_ops {
    const char *program, *about;            /* name; one line for a person */
    bool udp_only;                          /* there is no such sonar on a serial line */
    int udp_port;                           /* without --udp: LINE_NO_UDP, a pseudo-terminal */
    const struct responder_number *numbers; /* name NULL at the end */
    void (*start)(uint64_t seed, uint64_t now_ns);
    void (*feed)(struct line *line, const uint8_t *bytes, size_t n, uint64_t now_ns); /* from the host */
    uint64_t (*tick)(struct line *line, uint64_t now_ns); /* do what is due; when to call again, or LINE_NEVER */
    void (*print_status)(FILE *out);                      /* one line without newline */
};

/** responder_main - the whole program; returns the exit status. */
int responder_main(int argc, char **argv, const struct responder_ops *ops);

#endif
