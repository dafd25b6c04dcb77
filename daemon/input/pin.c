/* SPDX-License-Identifier: MIT */
#include "pin.h"

#include <sys/epoll.h>

#include "core/log.h"

static void close_line(struct pin *pin)
{
    if (!pin->open)
        return;
    if (pin->line.fd >= 0)
        loop_remove(pin->loop, &pin->fd);
    pin->ops->close(&pin->line);
    pin->open = false;
}

static void lost(struct pin *pin, uint64_t now_ns)
{
    close_line(pin);
    fault_set(&pin->error, "line '%s' is gone", pin->want.line);
    log_line(LOG_WARNING, "gpio_lost", "%s: %s; retrying until it is back", pin->purpose, pin->error.text);
    pin->announced = true;
    pin->on.lost(pin->on.ctx, now_ns);
}

static void request_line(struct pin *pin, uint64_t now_ns)
{
    int level = pin->ops->get(&pin->line);
    if (level < 0)
        lost(pin, now_ns);
    else
        pin->on.level(pin->on.ctx, level > 0, now_ns);
}

static void on_edges(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct pin *pin = ctx;
    struct gpio_edge edges[GPIO_EDGES_MAX];
    int n = pin->ops->edges(&pin->line, edges);
    for (int i = 0; i < n; i++)
        pin->on.edge(pin->on.ctx, &edges[i], now_ns);
    if (n == 0 && (events & (EPOLLHUP | EPOLLERR)))
        lost(pin, now_ns);
}

static void try_open(struct pin *pin, uint64_t now_ns)
{
    if (!pin->ops->open(&pin->line, &pin->want, &pin->error)) {
        if (!pin->announced)
            log_line(LOG_WARNING, "gpio_failed", "%s: %s; retrying", pin->purpose, pin->error.text);
        pin->announced = true;
        return;
    }
    pin->open = true;
    pin->announced = false;
    pin->error.text[0] = '\0';
    pin->fd.fd = pin->line.fd;
    if (pin->line.fd >= 0 && !loop_add(pin->loop, &pin->fd, EPOLLIN)) {
        pin->ops->close(&pin->line);
        pin->open = false;
        return;
    }
    log_line(LOG_NOTICE, "gpio_open", "%s: line '%s' acquired", pin->purpose, pin->want.line);
    request_line(pin, now_ns);
}

static void on_timer(void *ctx, uint64_t now_ns)
{
    struct pin *pin = ctx;
    if (pin->open)
        request_line(pin, now_ns);
    else
        try_open(pin, now_ns);
    loop_arm(pin->loop, &pin->timer, now_ns + PIN_ASK_NS);
}

void pin_start(struct pin *pin)
{
    pin->line.fd = -1;
    pin->fd = (struct loop_fd){.fd = -1, .ready = on_edges, .ctx = pin};
    pin->timer = (struct loop_timer){.fire = on_timer, .ctx = pin};
    on_timer(pin, loop_now(pin->loop));
}

void pin_set(struct pin *pin, bool on)
{
    pin->want.value = on;
    if (pin->open && !pin->ops->set(&pin->line, on))
        lost(pin, loop_now(pin->loop));
}

void pin_stop(struct pin *pin)
{
    if (!pin->loop)
        return;
    close_line(pin);
    loop_arm(pin->loop, &pin->timer, LOOP_NEVER);
}
