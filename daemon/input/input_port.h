/* SPDX-License-Identifier: MIT */
/*
 * input_port - the port of one input: opens it, tries again with a growing delay when it is not there or goes away
 * (said once, not every try), has a host's name looked up by the worker, waits until a connection stands, and opens a
 * line that has gone dead (dead_line.h) again, once the worker has closed it. Knows no device.
 */
#ifndef SONARD_INPUT_PORT_H
#define SONARD_INPUT_PORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "core/fault.h"
#include "core/loop.h"
#include "core/worker.h"
#include "dead_line.h"
#include "drivers/ports/port.h"

/* The words for its lines in the log. */
struct input_port_events {
    const char *open, *failed, *lost, *dead, *stranger;
};

/* What the owner gives; all of it outlives the line. */
struct input_port_env {
    struct loop *loop;
    struct worker *worker;
    const char *sonar; /* the port is this one's; NULL: no sonar's, ... */
    const char *whose; /* ... but this one's, as its lines in the log begin then: "nmea: " */
    const char *address;
    const struct input_port_events *events;
    void *ctx;
    /* There is a new descriptor. again: in place of a dead one, and `closed` was not called meanwhile. */
    void (*opened)(void *ctx, uint64_t now_ns, bool again);
    void (*ready)(void *ctx, uint32_t epoll_events, uint64_t now_ns);
    void (*closed)(void *ctx, uint64_t now_ns); /* after `opened` */
    void (*rests)(void *ctx); /* a dead one is closed, and will be opened `again`; NULL: that is no news */
    uint64_t (*messages)(const void *ctx); /* good ones so far: they show that it is alive */
};

struct input_port_lookup;
struct input_port_closing;

/* Embedded in its owner; zeroed before input_port_init. What port and dead say is the owner's, it sets. */
struct input_port {
    struct input_port_env env;
    const char *rest; /* of the address, behind the kind */
    struct port port;
    struct fault error; /* why it is not open; empty otherwise */
    uint64_t reconnects;
    struct dead_line dead;
    /* the rest is the line's */
    struct loop_fd fd;
    struct loop_timer retry, look; /* of a connection that is being made, retry ends the wait */
    uint64_t retry_ns, opened_ns;
    uint64_t messages; /* at the last look */
    struct input_port_lookup *lookup;
    struct input_port_closing *closing;
    bool looked_up;
    bool failure_told, back_told; /* since it last brought something */
    bool reviving;                /* closed and opened because it was dead, and nothing heard since */
    bool told_open;               /* the owner was, and not that it was closed */
    bool was_open, open, stopping, lost_in_write, stranger_told;
};

/** input_port_init - finds the port of the address, opens nothing. False with a sentence in fault. */
bool input_port_init(struct input_port *line, const struct input_port_env *env, struct fault *fault);

/** input_port_start - the first try. */
void input_port_start(struct input_port *line);

/** input_port_is_open - it may be read and written. */
bool input_port_is_open(const struct input_port *line);

/** input_port_read - as port_ops.read; -1: it was closed (env.closed was called) and will be tried again. */
ssize_t input_port_read(struct input_port *line, void *buf, size_t size);

/** input_port_write - as port_ops.write; -1: what is written from now on is lost, and the loop closes it soon. */
ssize_t input_port_write(struct input_port *line, const void *buf, size_t size);

/** input_port_wait_for_room - env.ready is called when it can be written, too, or no longer. */
void input_port_wait_for_room(struct input_port *line, bool wait);

/** input_port_stop - stays open, and is not opened again. */
void input_port_stop(struct input_port *line);

/** input_port_end - closed, without a word; also before input_port_init. */
void input_port_end(struct input_port *line);

#endif
