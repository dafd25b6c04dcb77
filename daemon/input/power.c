/* SPDX-License-Identifier: MIT */
#include "power.h"

#include <stdio.h>

#include "core/log.h"

static void switch_on(struct power *power, uint64_t now_ns)
{
    power->off = false;
    power->t_on_ns = now_ns;
    pin_set(&power->pin, true);
    loop_arm(power->pin.loop, &power->timer, now_ns + POWER_LOOK_NS);
}

static void switch_off(struct power *power, uint64_t now_ns)
{
    power->off = true;
    power->cycles++;
    pin_set(&power->pin, false);
    loop_arm(power->pin.loop, &power->timer, now_ns + POWER_OFF_NS);
}

static void on_timer(void *ctx, uint64_t now_ns)
{
    struct power *power = ctx;
    uint64_t life_ns = power->last_ping_ns(power->ctx);
    if (life_ns < power->t_on_ns)
        life_ns = power->t_on_ns;
    if (power->off) {
        log_line(LOG_NOTICE, "power_on", "%s: on", power->purpose);
        switch_on(power, now_ns);
    } else if (power->pin.open && power->cycle_after_ns && now_ns > life_ns &&
               now_ns - life_ns > power->cycle_after_ns) {
        log_line(LOG_WARNING, "power_cycled", "%s: no ping for %g s: power-cycling", power->purpose,
                 (double)(now_ns - life_ns) * 1e-9);
        switch_off(power, now_ns);
    } else {
        loop_arm(power->pin.loop, &power->timer, now_ns + POWER_LOOK_NS);
    }
}

static void on_level(void *ctx, bool active, uint64_t now_ns)
{
    (void)ctx;
    (void)active;
    (void)now_ns;
}

static void on_edge(void *ctx, const struct gpio_edge *edge, uint64_t now_ns)
{
    (void)ctx;
    (void)edge;
    (void)now_ns;
}

/* What the line does now nobody knows; when it is back the sonar has to boot. */
static void on_lost(void *ctx, uint64_t now_ns)
{
    struct power *power = ctx;
    power->t_on_ns = now_ns;
}

void power_start(struct power *power, const struct pin_chip *chip, const struct conf_sonar *conf,
                 uint64_t (*last_ping_ns)(void *ctx), void *ctx)
{
    *power = (struct power){
        .pin = {.loop = chip->loop,
                .ops = chip->ops,
                .want = {.output = true, .value = true, .active_low = conf->power_active == CONF_ACTIVE_LOW},
                .purpose = power->purpose,
                .on = {on_level, on_edge, on_lost, power}},
        .cycle_after_ns = (uint64_t)(conf->power_cycle_after_s * 1e9),
        .on_at_stop = conf->power_at_stop == CONF_ON,
        .timer = {.fire = on_timer, .ctx = power},
        .t_on_ns = loop_now(chip->loop),
        .last_ping_ns = last_ping_ns,
        .ctx = ctx};
    snprintf(power->purpose, sizeof power->purpose, "power of %s", conf->name);
    snprintf(power->pin.want.chip, sizeof power->pin.want.chip, "%s", chip->name);
    snprintf(power->pin.want.line, sizeof power->pin.want.line, "%s", conf->power);
    pin_start(&power->pin);
    loop_arm(chip->loop, &power->timer, loop_now(chip->loop) + POWER_LOOK_NS);
}

void power_stop(struct power *power)
{
    if (!power->pin.loop)
        return;
    loop_arm(power->pin.loop, &power->timer, LOOP_NEVER);
    pin_set(&power->pin, power->on_at_stop);
    pin_stop(&power->pin);
}
