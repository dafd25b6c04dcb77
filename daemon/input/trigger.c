/* SPDX-License-Identifier: MIT */
#include "trigger.h"

#include <stdio.h>
#include <string.h>

/* Listening ends where the last bin ends; heads round a little. */
#define LISTENING_SHARE 0.95

static void on_level(void *ctx, bool active, uint64_t now_ns)
{
    (void)ctx;
    (void)active;
    (void)now_ns;
}

static void on_edge(void *ctx, const struct gpio_edge *edge, uint64_t now_ns)
{
    struct trigger *trigger = ctx;
    (void)now_ns; /* of the turn: the edge may have come since it began */
    if (edge->rising == trigger->falling || edge->t_ns > loop_clock())
        return;
    trigger_edge(trigger, edge->t_ns);
    trigger->taken(trigger->ctx, trigger, edge->t_ns);
}

static void on_lost(void *ctx, uint64_t now_ns)
{
    struct trigger *trigger = ctx;
    (void)now_ns;
    trigger->n = 0;
}

void trigger_init(struct trigger *trigger, const struct conf_sonar *conf, double sound_speed_mps)
{
    *trigger = (struct trigger){.falling = conf->trigger_edge == CONF_FALLING, .sound_speed_mps = sound_speed_mps};
    snprintf(trigger->purpose, sizeof trigger->purpose, "trigger of %s", conf->name);
}

void trigger_start(struct trigger *trigger, const struct pin_chip *chip, const char *line,
                   void (*taken)(void *ctx, struct trigger *trigger, uint64_t t_ns), void *ctx)
{
    trigger->taken = taken;
    trigger->ctx = ctx;
    trigger->pin = (struct pin){.loop = chip->loop,
                                .ops = chip->ops,
                                .purpose = trigger->purpose,
                                .on = {on_level, on_edge, on_lost, trigger}};
    snprintf(trigger->pin.want.chip, sizeof trigger->pin.want.chip, "%s", chip->name);
    snprintf(trigger->pin.want.line, sizeof trigger->pin.want.line, "%s", line);
    pin_start(&trigger->pin);
}

static void forget_edges(struct trigger *trigger, int n)
{
    trigger->n -= n;
    memmove(trigger->edge_ns, trigger->edge_ns + n, (size_t)trigger->n * sizeof trigger->edge_ns[0]);
}

void trigger_edge(struct trigger *trigger, uint64_t t_ns)
{
    if (trigger->n && t_ns <= trigger->edge_ns[trigger->n - 1])
        return;
    if (trigger->n == TRIGGER_EDGES)
        forget_edges(trigger, 1);
    trigger->edge_ns[trigger->n++] = t_ns;
    trigger->edges++;
}

uint64_t trigger_time(struct trigger *trigger, const struct ping *ping)
{
    double end_m = (double)ping->r0_m + (double)ping->dr_m * ping->n_bins;
    uint64_t listening_ns = (uint64_t)(LISTENING_SHARE * 2e9 * end_m / trigger->sound_speed_mps);
    int i = trigger->n - 1;
    while (i >= 0 && trigger->edge_ns[i] + listening_ns > ping->t_in_ns)
        i--;
    if (i < 0 || ping->t_in_ns - trigger->edge_ns[i] > listening_ns + TRIGGER_PATIENCE_NS) {
        trigger->not_used++;
        return ping->t_ns;
    }
    uint64_t t_ns = trigger->edge_ns[i];
    forget_edges(trigger, i + 1);
    trigger->used++;
    return t_ns;
}

void trigger_stop(struct trigger *trigger)
{
    pin_stop(&trigger->pin);
}
