/* SPDX-License-Identifier: MIT */
#include "leak.h"

#include <stdio.h>

#include "core/log.h"

static void note_state(struct leak *leak, enum leak_state state, uint64_t now_ns)
{
    loop_arm(leak->pin.loop, &leak->hold, LOOP_NEVER);
    if (state == leak->state)
        return;
    if (state == LEAK_WET)
        log_line(LOG_ERR, "leak", "LEAK: the probe on line '%s' is wet", leak->pin.want.line);
    else if (leak->state == LEAK_WET)
        log_line(LOG_NOTICE, "leak_over", "leak probe: %s", state == LEAK_DRY ? "dry again" : "state unknown");
    leak->alarms += state == LEAK_WET;
    leak->state = state;
    leak->t_change_ns = now_ns;
    leak->changed(leak->ctx);
}

static void hold(struct leak *leak, uint64_t now_ns)
{
    loop_arm(leak->pin.loop, &leak->hold, now_ns + LEAK_HOLD_NS);
}

/* The level when asked: another than believed must hold, too. At the start there is nothing to hold against. */
static void on_level(void *ctx, bool active, uint64_t now_ns)
{
    struct leak *leak = ctx;
    enum leak_state state = active ? LEAK_WET : LEAK_DRY;
    if (leak->state == LEAK_UNKNOWN)
        note_state(leak, state, now_ns);
    else if (state != leak->state && !leak->hold.armed)
        hold(leak, now_ns);
}

static void on_edge(void *ctx, const struct gpio_edge *edge, uint64_t now_ns)
{
    struct leak *leak = ctx;
    (void)edge;            /* of a burst the newest may be lost: the level tells */
    if (!leak->hold.armed) /* edge after edge must not put the look off for ever */
        hold(leak, now_ns);
}

static void on_held(void *ctx, uint64_t now_ns)
{
    struct leak *leak = ctx;
    int level = leak->pin.open ? leak->pin.ops->get(&leak->pin.line) : -1;
    if (level >= 0)
        note_state(leak, level ? LEAK_WET : LEAK_DRY, now_ns);
}

static void on_lost(void *ctx, uint64_t now_ns)
{
    note_state(ctx, LEAK_UNKNOWN, now_ns);
}

void leak_start(struct leak *leak, struct loop *loop, const struct gpio_ops *ops, const struct conf_gpio *conf,
                void (*changed)(void *ctx), void *ctx)
{
    static const enum gpio_bias bias[] = {[CONF_BIAS_AS_IS] = GPIO_AS_IS,
                                          [CONF_BIAS_PULL_UP] = GPIO_PULL_UP,
                                          [CONF_BIAS_PULL_DOWN] = GPIO_PULL_DOWN};
    *leak = (struct leak){
        .pin = {.loop = loop,
                .ops = ops,
                .want = {.active_low = conf->leak_active == CONF_ACTIVE_LOW, .bias = bias[conf->leak_bias]},
                .purpose = "leak probe",
                .on = {on_level, on_edge, on_lost, leak}},
        .hold = {.fire = on_held, .ctx = leak},
        .changed = changed,
        .ctx = ctx};
    snprintf(leak->pin.want.chip, sizeof leak->pin.want.chip, "%s", conf->chip);
    snprintf(leak->pin.want.line, sizeof leak->pin.want.line, "%s", conf->leak);
    pin_start(&leak->pin);
}

void leak_stop(struct leak *leak)
{
    if (leak->pin.loop)
        loop_arm(leak->pin.loop, &leak->hold, LOOP_NEVER);
    pin_stop(&leak->pin);
}
