/* SPDX-License-Identifier: MIT */
/*
 * leak - the leak probe: an edge counts when the level has held for a tenth of a second, because neither a wet contact
 * nor the kernel's queue can be trusted with a burst. Tells its owner when the water comes and goes.
 */
#ifndef SONARD_LEAK_H
#define SONARD_LEAK_H

#include "config/conf.h"
#include "pin.h"

#define LEAK_HOLD_NS 100000000u

enum leak_state { LEAK_UNKNOWN, LEAK_DRY, LEAK_WET };

struct leak {
    struct pin pin;
    struct loop_timer hold;
    enum leak_state state;
    uint64_t t_change_ns; /* 0: never */
    uint64_t alarms;      /* times that it became wet */
    void (*changed)(void *ctx);
    void *ctx;
};

void leak_start(struct leak *leak, struct loop *loop, const struct gpio_ops *ops, const struct conf_gpio *conf,
                void (*changed)(void *ctx), void *ctx);
void leak_stop(struct leak *leak);

#endif
