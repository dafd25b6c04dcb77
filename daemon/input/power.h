/* SPDX-License-Identifier: MIT */
/*
 * power - the switch of one sonar: on at the start, off for three seconds and on again when the sonar has been silent
 * for too long, and as configured at the end. Knows of the sonar only when it last pinged.
 */
#ifndef SONARD_POWER_H
#define SONARD_POWER_H

#include "config/conf.h"
#include "pin.h"

#define POWER_OFF_NS  3000000000u
#define POWER_LOOK_NS 250000000u

struct power {
    struct pin pin;
    char purpose[CONF_NAME_MAX + 16];
    uint64_t cycle_after_ns; /* 0: never */
    bool on_at_stop;
    struct loop_timer timer;
    bool off;         /* for a moment */
    uint64_t t_on_ns; /* when it was last switched on */
    uint64_t cycles;
    uint64_t (*last_ping_ns)(void *ctx); /* 0: none yet */
    void *ctx;
};

void power_start(struct power *power, const struct pin_chip *chip, const struct conf_sonar *conf,
                 uint64_t (*last_ping_ns)(void *ctx), void *ctx);
void power_stop(struct power *power);

#endif
