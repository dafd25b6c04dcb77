/* SPDX-License-Identifier: MIT */
/*
 * depth - the depth that a Modbus slave tells, as pose. libmodbus blocks, so a thread of its own asks; samples come
 * to the loop through a ring of indices into a small pool, and an eventfd wakes it. Whatever the slave does, the loop
 * never waits for it. Here a raw value becomes a depth and is believed or not.
 */
#ifndef SONARD_DEPTH_H
#define SONARD_DEPTH_H

#include "config/conf.h"
#include "core/fault.h"
#include "drivers/pose/modbus_depth.h"
#include "pose_input.h"

struct depth;

enum depth_state { DEPTH_STARTING, DEPTH_NO_LINK, DEPTH_SILENT, DEPTH_REFUSED, DEPTH_RUNNING };

/* Counters only grow. */
struct depth_status {
    enum depth_state state;
    double depth_m;       /* the last that was believed */
    uint64_t t_depth_ns;  /* when; 0: none */
    uint64_t samples;     /* numbers that came */
    uint64_t implausible; /* of them, not believed */
    uint64_t timeouts, exceptions, bad_answers, out_of_step, no_number;
    uint64_t reconnects;
    uint64_t dropped;   /* samples that the loop had no time for */
    unsigned oddities;  /* bits of enum modbus_oddity that were ever seen */
    struct fault error; /* the newest trouble; empty when all is well */
};

/** depth_of_value - the sensor's depth in metres, positive down: value * scale + offset, and if that is a pressure
 * (p - surface_pressure) / (density * 9.80665 m/s2). Within 0.4 % of UNESCO 44 down to 1000 m. */
double depth_of_value(const struct conf_depth *conf, double density_kgpm3, double value);

/**
 * depth_plausible - may depth_m at t_ns follow last_m at last_ns (0: nothing was believed yet)? Within the limits of
 * the configuration, and not reached faster than speed_limit; a wrong first value is so outlived by the right ones.
 */
bool depth_plausible(const struct conf_depth *conf, double depth_m, uint64_t t_ns, double last_m,
                     uint64_t last_ns);

/** depth_oddities_text - what an RTU line does beside answering, as words; empty: nothing. */
void depth_oddities_text(unsigned oddities, struct fault *text);

/**
 * depth_dated - is it known when the sensor measured what was read took_ns after it was asked? Not beyond the time that
 * it may take: then the answer waited while the process was held up, or the question did.
 */
bool depth_dated(const struct conf_depth *conf, uint64_t took_ns);

/** depth_new - NULL with a sentence in fault. Nothing is opened. */
struct depth *depth_new(const struct conf_depth *conf, double density_kgpm3, struct pose_input *input,
                        struct fault *fault);

bool depth_start(struct depth *depth, struct fault *fault);
void depth_free(struct depth *depth); /* waits for the answer that is under way; NULL is allowed */
void depth_status(const struct depth *depth, struct depth_status *out);

#endif
