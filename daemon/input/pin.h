/* SPDX-License-Identifier: MIT */
/*
 * pin - one GPIO line tied to the loop: opened, tried again while it is not there or somebody else has it (said once),
 * asked for its level once a second, since a chip that is pulled out says nothing by itself. Knows not what it is for.
 */
#ifndef SONARD_PIN_H
#define SONARD_PIN_H

#include "drivers/gpio/gpio.h"
#include "core/loop.h"

#define PIN_ASK_NS 1000000000u

/* What its owner is called for. Every slot is set. */
struct pin_events {
    void (*level)(void *ctx, bool active, uint64_t now_ns);                 /* after opening, and whenever asked */
    void (*edge)(void *ctx, const struct gpio_edge *edge, uint64_t now_ns); /* input */
    void (*lost)(void *ctx, uint64_t now_ns);
    void *ctx;
};

/* Where lines are looked for, and the loop that they are tied to. */
struct pin_chip {
    struct loop *loop;
    const struct gpio_ops *ops;
    const char *name; /* empty: any chip */
};

/* Embedded in its owner. */
struct pin {
    struct loop *loop;
    const struct gpio_ops *ops;
    struct gpio_want want;
    const char *purpose; /* "leak probe": for the log */
    struct pin_events on;
    struct gpio_line line;
    struct loop_fd fd;
    struct loop_timer timer;
    bool open, announced;
    struct fault error; /* why it is not open; empty otherwise */
};

/** pin_start - try to open. The first seven fields are set, the rest is zero. */
void pin_start(struct pin *pin);

/** pin_set - an output's level, now and after opening again. */
void pin_set(struct pin *pin, bool on);

void pin_stop(struct pin *pin); /* stopped pins, and those that were never started, may be stopped again */

#endif
