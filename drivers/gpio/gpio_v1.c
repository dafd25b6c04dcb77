/* SPDX-License-Identifier: MIT */
/* gpio_v1 - GPIO lines through libgpiod 1.6 (Debian 12). */
#include "gpio.h"

#if SONARD_GPIOD == 1

#include <errno.h>
#include <fcntl.h>
#include <gpiod.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"

static bool v1_available(struct fault *fault)
{
    (void)fault;
    return true;
}

static bool fail(struct gpio_line *line, const struct gpio_want *want, const char *why, struct fault *fault)
{
    fault_set(fault, "line '%s' of %s%s: %s", want->line, want->chip[0] ? "chip " : "any chip", want->chip, why);
    if (line->chip)
        gpiod_chip_close(line->chip);
    line->chip = line->request = NULL;
    return false;
}

/* The chip into line->chip, which must be closed, also where the line is not found. */
static struct gpiod_line *find_line(struct gpio_line *line, const struct gpio_want *want, const char **why)
{
    struct gpiod_line *found;
    if (want->chip[0]) {
        line->chip = gpiod_chip_open_lookup(want->chip);
        *why = "no such chip";
        found = line->chip ? gpiod_chip_find_line(line->chip, want->line) : NULL;
    } else {
        found = gpiod_line_find(want->line);
        line->chip = found ? gpiod_line_get_chip(found) : NULL;
    }
    if (!found && (line->chip || !want->chip[0]))
        *why = "no line of that name; gpioinfo lists the lines";
    return found;
}

static bool v1_open(struct gpio_line *line, const struct gpio_want *want, struct fault *fault)
{
    static const int bias[] = {[GPIO_AS_IS] = 0,
                               [GPIO_PULL_UP] = GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP,
                               [GPIO_PULL_DOWN] = GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN};
    struct gpiod_line_request_config conf = {.consumer = "sonard",
                                             .request_type = want->output ? GPIOD_LINE_REQUEST_DIRECTION_OUTPUT
                                                                          : GPIOD_LINE_REQUEST_EVENT_BOTH_EDGES,
                                             .flags = (want->active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0) |
                                                      (want->output ? 0 : bias[want->bias])};
    const char *why = "";
    *line = (struct gpio_line){.fd = -1};
    struct gpiod_line *found = find_line(line, want, &why);
    if (!found)
        return fail(line, want, why, fault);
    if (gpiod_line_request(found, &conf, want->value) < 0) {
        char text[96];
        const char *who = errno == EBUSY ? gpiod_line_consumer(found) : NULL;
        if (who)
            snprintf(text, sizeof text, "in use by '%.40s'", who);
        else
            snprintf(text, sizeof text, "%s", errno == EBUSY ? "in use by another program" : strerror(errno));
        return fail(line, want, text, fault);
    }
    line->request = found;
    if (!want->output) {
        line->fd = gpiod_line_event_get_fd(found);
        fcntl(line->fd, F_SETFL, fcntl(line->fd, F_GETFL) | O_NONBLOCK);
    }
    return true;
}

static int v1_get(const struct gpio_line *line)
{
    return gpiod_line_get_value(line->request);
}

static bool v1_set(const struct gpio_line *line, bool on)
{
    return gpiod_line_set_value(line->request, on) == 0;
}

static int v1_edges(const struct gpio_line *line, struct gpio_edge edges[GPIO_EDGES_MAX])
{
    struct gpiod_line_event events[GPIO_EDGES_MAX];
    int n = gpiod_line_event_read_fd_multiple(line->fd, events, GPIO_EDGES_MAX);
    for (int i = 0; i < n; i++)
        edges[i] = (struct gpio_edge){(uint64_t)events[i].ts.tv_sec * 1000000000u + (uint64_t)events[i].ts.tv_nsec,
                                      events[i].event_type == GPIOD_LINE_EVENT_RISING_EDGE};
    return n > 0 ? n : 0;
}

static void v1_close(struct gpio_line *line)
{
    if (line->chip)
        gpiod_chip_close(line->chip); /* releases the line as well */
    *line = (struct gpio_line){.fd = -1};
}

const struct gpio_ops gpio_library = {.library = "libgpiod 1",
                                      .available = v1_available,
                                      .open = v1_open,
                                      .get = v1_get,
                                      .set = v1_set,
                                      .edges = v1_edges,
                                      .close = v1_close};

#endif
