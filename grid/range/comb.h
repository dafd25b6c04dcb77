/* SPDX-License-Identifier: MIT */
/*
 * comb - the pulses of another sonar, known by their timing: they arrive at equal intervals of the clock, whatever we
 * do, while what a reflector returns follows our own transmissions. Knows times and ranges; no bearing, no map.
 *
 * The period is found as intervals between pulses are in electronic support: candidates from the differences between
 * arrivals (D. J. Milojevic and B. M. Popovic, "Improved algorithm for the deinterleaving of radar pulses", IEE
 * Proceedings F 139, 1992), each followed back through all of them. docs/extract.md derives what is believed.
 */
#ifndef SONARD_COMB_H
#define SONARD_COMB_H

#include <stdbool.h>
#include <stdint.h>

#define COMB_ARRIVALS 32

/* Something that only one beam shows. */
struct comb_arrival {
    double ping_s, delay_s; /* our transmission, from the first one; the echo's after it */
};

struct comb {
    double second_m; /* range of an echo after one second */
    uint64_t origin_ns, ping_ns;
    double interval_s;                          /* between our last two pings; 0: not known */
    uint32_t arrivals;                          /* so far; the last COMB_ARRIVALS are kept: */
    struct comb_arrival arrival[COMB_ARRIVALS]; /* [i % COMB_ARRIVALS] */
    bool known;
    double period_s;
    double pulse_s, half_s; /* a pulse begins within half_s of that time, */
    double length_s;        /* and has echoes for so long */
    double since_s, seen_s; /* first and last pulse that it rests on */
    double credit;          /* falls with arrivals that are none of its pulses; below 0: no longer known */
};

/** comb_init - nothing has arrived yet. sound_mps: the speed of sound that ranges are made with. */
void comb_init(struct comb *comb, double sound_mps);

/** comb_ping - before all else about a ping: its time of transmission. A time that goes back starts anew. */
void comb_ping(struct comb *comb, uint64_t t_ns);

/**
 * comb_due - of n echoes of the last ping in order of range, by their near edges: those that arrived when the other
 * sonar's pulse was due, or as pieces of that pulse, a set of bits. within_m: how far apart two beams may show the same
 * reflector. None where the interval of our pings is so near to a multiple of the period that three pings in succession
 * can show one reflector when pulses are due: nothing tells the two apart then.
 */
uint8_t comb_due(const struct comb *comb, const float *near_m, unsigned n, float within_m);

/**
 * comb_learn - the n echoes of a beam of the last ping, of which those in the set `lone` are contradicted by other
 * beams. Allocates nothing; bounded, at most one search of some 4000 steps.
 */
void comb_learn(struct comb *comb, const float *near_m, unsigned n, uint8_t lone);

#endif
