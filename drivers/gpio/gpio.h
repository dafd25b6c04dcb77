/* SPDX-License-Identifier: MIT */
/*
 * gpio - single lines of GPIO chips: an output, or an input with its edges. Lines are found by name, chips by label
 * or name. Knows no sonar and no leak. The two libraries called libgpiod (1.6 and 2.x) have the same names for
 * different things, so each has a file of its own behind struct gpio_ops: gpio_v1.c, gpio_v2.c; gpio_none.c where
 * sonard was built without. Opening allocates, the rest does not.
 */
#ifndef SONARD_GPIO_H
#define SONARD_GPIO_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"

#define GPIO_NAME_MAX  32
#define GPIO_EDGES_MAX 16 /* read at a time */

enum gpio_bias { GPIO_AS_IS, GPIO_PULL_UP, GPIO_PULL_DOWN };

struct gpio_want {
    char chip[GPIO_NAME_MAX]; /* label or name; empty: the first that has the line */
    char line[GPIO_NAME_MAX];
    bool output;
    bool active_low;     /* levels and edges are reported the other way round */
    bool value;          /* output: from the start */
    enum gpio_bias bias; /* input */
};

struct gpio_edge {
    uint64_t t_ns; /* monotonic, by the kernel's interrupt handler; before Linux 5.7 Unix time, which is no use */
    bool rising;   /* becomes active */
};

struct gpio_line {
    int fd;     /* input: readable means call edges; -1: closed, or an output */
    void *chip; /* the library's */
    void *request;
    unsigned offset;
    void *events;
};

struct gpio_ops {
    const char *library;

    /* Can there be any line? False with a sentence in fault. */
    bool (*available)(struct fault *fault);

    /* False with a sentence in fault: no such chip, no such line, in use by somebody. */
    bool (*open)(struct gpio_line *line, const struct gpio_want *want, struct fault *fault);

    int (*get)(const struct gpio_line *line);           /* 1 active, 0 not, -1: the chip is gone */
    bool (*set)(const struct gpio_line *line, bool on); /* false: the chip is gone */
    int (*edges)(const struct gpio_line *line, struct gpio_edge edges[GPIO_EDGES_MAX]); /* how many; 0: none */
    void (*close)(struct gpio_line *line); /* closed lines may be closed again */
};

extern const struct gpio_ops gpio_library;

#endif
