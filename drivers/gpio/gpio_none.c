/* SPDX-License-Identifier: MIT */
/* gpio_none - where sonard is built without libgpiod: there is no line, and it says why. */
#include "gpio.h"

#if SONARD_GPIOD == 0

#include "core/fault.h"

static bool none_available(struct fault *fault)
{
    return fault_set(fault, "this sonard was built without libgpiod: it has no GPIO lines");
}

static bool none_open(struct gpio_line *line, const struct gpio_want *want, struct fault *fault)
{
    (void)want;
    line->fd = -1;
    return none_available(fault);
}

static int none_get(const struct gpio_line *line)
{
    (void)line;
    return -1;
}

static bool none_set(const struct gpio_line *line, bool on)
{
    (void)line;
    (void)on;
    return false;
}

static int none_edges(const struct gpio_line *line, struct gpio_edge edges[GPIO_EDGES_MAX])
{
    (void)line;
    (void)edges;
    return 0;
}

static void none_close(struct gpio_line *line)
{
    (void)line;
}

const struct gpio_ops gpio_library = {.library = "none",
                                      .available = none_available,
                                      .open = none_open,
                                      .get = none_get,
                                      .set = none_set,
                                      .edges = none_edges,
                                      .close = none_close};

#endif
