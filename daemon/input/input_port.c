/* SPDX-License-Identifier: MIT */
#include "input_port.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>

#include "core/log.h"

/* Running again within 2 s of a plug: the longest delay plus the handshake must stay below that. */
#define RETRY_FIRST_NS 100000000u
#define RETRY_MOST_NS  1000000000u

#define REVIVE_NS 200000000u /* a dead line is closed for so long: the other side should see it */

/* Over a network nobody plugs, and each try is somebody's traffic. */
#define CONNECT_NS       5000000000u  /* a far end that has not answered by then is tried anew */
#define RETRY_NETWORK_NS 5000000000u  /* the longest delay there, ... */
#define RETRY_NAME_NS    30000000000u /* ... and after a name that was not found */

/* A name that is looked up; it may outlive its line. */
struct input_port_lookup {
    struct worker_job job;
    struct input_port *line; /* NULL: gone */
    const struct port_ops *ops;
    char rest[PORT_ADDRESS_MAX];
    struct port_far far;
    bool busy, good;
    struct fault fault;
};

/* A dead port that is closed; it may outlive its line, too. */
struct input_port_closing {
    struct worker_job job;
    struct input_port *line; /* NULL: gone */
    struct port port;
    bool busy;
};

__attribute__((format(printf, 4, 5))) static void say(const struct input_port *line, enum log_level level,
                                                      const char *event, const char *fmt, ...)
{
    char text[sizeof(struct fault) + 64];
    va_list ap;
    va_start(ap, fmt);
    vsnprintf(text, sizeof text, fmt, ap);
    va_end(ap);
    log_tell(level, LOG_ABOUT(.event = event, .sonar = line->env.sonar), "%s%s",
             line->env.sonar ? "" : line->env.whose, text);
}

/* ---- it is not there ---- */

static void retry_later(struct input_port *line, uint64_t most_ns)
{
    if (line->stopping)
        return;
    loop_arm(line->env.loop, &line->retry, loop_now(line->env.loop) + line->retry_ns);
    line->retry_ns = line->retry_ns * 2 < most_ns ? line->retry_ns * 2 : most_ns;
}

static void not_there(struct input_port *line, const char *event, const struct fault *why, uint64_t most_ns)
{
    line->error = *why;
    if (!line->failure_told)
        say(line, LOG_WARNING, event, "%s; retrying until it opens", why->text);
    line->failure_told = true;
    retry_later(line, most_ns);
}

static uint64_t longest_delay(const struct input_port *line)
{
    return line->port.ops->connected ? RETRY_NETWORK_NS : RETRY_MOST_NS;
}

static void tell_closed(struct input_port *line)
{
    line->open = false;
    if (line->told_open)
        line->env.closed(line->env.ctx, loop_now(line->env.loop));
    line->told_open = false;
}

static void failed(struct input_port *line, const struct fault *why)
{
    tell_closed(line);
    not_there(line, line->env.events->failed, why, longest_delay(line));
}

static void leave_port(struct input_port *line)
{
    loop_arm(line->env.loop, &line->look, LOOP_NEVER);
    loop_arm(line->env.loop, &line->retry, LOOP_NEVER);
    if (line->fd.fd >= 0)
        loop_remove(line->env.loop, &line->fd);
    line->fd.fd = -1;
    line->lost_in_write = false;
}

static void close_port(struct input_port *line)
{
    leave_port(line);
    line->port.ops->close(&line->port);
}

static void lost(struct input_port *line)
{
    struct fault why;
    fault_set(&why, "%.200s: lost: %s", line->env.address,
              line->port.bus.state == BUS_OFF ? "the CAN bus is off"
              : line->port.error              ? strerror(line->port.error)
                                              : "hung up");
    close_port(line);
    tell_closed(line);
    line->reviving = false;
    line->retry_ns = line->failure_told ? line->retry_ns : RETRY_FIRST_NS;
    not_there(line, line->env.events->lost, &why, longest_delay(line));
}

/* ---- it is ---- */

/* What happens to it next is news. A far end that takes connections and ends them is told once. */
static void settled(struct input_port *line)
{
    line->failure_told = line->back_told = false;
}

static void opened(struct input_port *line)
{
    const bool again = line->told_open;
    const uint64_t now_ns = loop_now(line->env.loop);
    line->opened_ns = now_ns;
    if (line->was_open)
        line->reconnects++;
    if (!again && !line->back_told)
        say(line, LOG_NOTICE, line->env.events->open, "%s %s", line->env.address,
            line->was_open ? "is back" : "open");
    line->back_told = line->was_open = line->open = line->told_open = true;
    if (!line->port.ops->connected)
        settled(line);
    line->error.text[0] = '\0';
    line->messages = line->env.messages(line->env.ctx);
    if (!line->reviving)
        dead_line_opened(&line->dead, now_ns);
    loop_arm(line->env.loop, &line->look, now_ns + DEAD_LINE_LOOK_NS);
    line->env.opened(line->env.ctx, now_ns, again);
}

static bool await(struct input_port *line, uint32_t epoll_events, struct fault *fault)
{
    line->fd.fd = line->port.fd;
    if (loop_add(line->env.loop, &line->fd, epoll_events))
        return true;
    line->fd.fd = -1;
    fault_set(fault, "%.200s: cannot wait for input: %s", line->env.address, strerror(errno));
    line->port.ops->close(&line->port);
    return false;
}

/* False with a sentence in fault. */
static bool open_port(struct input_port *line, struct fault *fault)
{
    line->port.connecting = false;
    line->looked_up = false;
    return line->port.ops->open(&line->port, line->rest, fault) &&
           await(line, line->port.connecting ? EPOLLOUT : EPOLLIN, fault);
}

static void look_up(struct input_port *line);

static void try_open(struct input_port *line)
{
    struct fault fault = {""};
    if (!line->looked_up && line->port.ops->named && line->port.ops->named(line->rest))
        look_up(line);
    else if (!open_port(line, &fault))
        failed(line, &fault);
    else if (line->port.connecting)
        loop_arm(line->env.loop, &line->retry, loop_now(line->env.loop) + CONNECT_NS);
    else
        opened(line);
}

static void on_connection(struct input_port *line)
{
    struct fault fault = {""};
    loop_arm(line->env.loop, &line->retry, LOOP_NEVER);
    if (!line->port.ops->connected(&line->port, line->rest, &fault)) {
        close_port(line);
        failed(line, &fault);
        return;
    }
    loop_change(line->env.loop, &line->fd, EPOLLIN);
    opened(line);
}

/* ---- names ---- */

static void ask_name_service(void *ctx)
{
    struct input_port_lookup *l = ctx;
    l->good = l->ops->look_up(l->rest, &l->far, &l->fault);
}

static void on_looked_up(void *ctx)
{
    struct input_port_lookup *l = ctx;
    struct input_port *line = l->line;
    l->busy = false;
    if (!line) {
        free(l);
        return;
    }
    if (line->stopping)
        return;
    if (!l->good) {
        not_there(line, line->env.events->failed, &l->fault, RETRY_NAME_NS);
        return;
    }
    line->port.far = l->far;
    line->looked_up = true;
    try_open(line);
}

static void look_up(struct input_port *line)
{
    struct input_port_lookup *l = line->lookup;
    l->busy = true;
    worker_run(line->env.worker, &l->job, ask_name_service, on_looked_up, l);
}

static bool make_jobs(struct input_port *line, struct fault *fault)
{
    line->closing = calloc(1, sizeof *line->closing);
    if (!line->closing)
        return fault_set(fault, "out of memory");
    line->closing->line = line;
    if (!line->port.ops->named || !line->port.ops->named(line->rest))
        return true;
    line->lookup = calloc(1, sizeof *line->lookup);
    if (!line->lookup)
        return fault_set(fault, "out of memory");
    line->lookup->line = line;
    line->lookup->ops = line->port.ops;
    snprintf(line->lookup->rest, sizeof line->lookup->rest, "%s", line->rest);
    return true;
}

/* ---- it is open, and dead ---- */

static void close_dead(void *ctx)
{
    struct input_port_closing *c = ctx;
    c->port.ops->close(&c->port);
}

static void on_dead_closed(void *ctx)
{
    struct input_port_closing *c = ctx;
    struct input_port *line = c->line;
    c->busy = false;
    if (!line)
        free(c);
    else if (!line->stopping)
        loop_arm(line->env.loop, &line->retry, loop_now(line->env.loop) + REVIVE_NS);
}

/* The kernel waits up to 30 s for a serial port to send what was written, which a dead one never does. Until then it
 * cannot be opened again. */
static void close_elsewhere(struct input_port *line)
{
    struct input_port_closing *c = line->closing;
    leave_port(line);
    c->port = line->port;
    line->port.fd = -1;
    c->busy = true;
    worker_run(line->env.worker, &c->job, close_dead, on_dead_closed, c);
}

/* The device goes on asking meanwhile, and need not know. */
static void open_again(struct input_port *line)
{
    line->reviving = true;
    if (line->dead.due == 1)
        say(line, LOG_WARNING, line->env.events->dead, "%s: no message for %.0f s; closing and opening the port",
            line->env.address, (double)line->dead.silent_ns * 1e-9);
    line->open = false;
    if (line->env.rests)
        line->env.rests(line->env.ctx);
    close_elsewhere(line);
}

static void on_look(void *ctx, uint64_t now_ns)
{
    struct input_port *line = ctx;
    const uint64_t messages = line->env.messages(line->env.ctx);
    const bool heard = messages != line->messages, was_dead = line->dead.due > 0;
    line->messages = messages;
    line->reviving = line->reviving && !heard;
    loop_arm(line->env.loop, &line->look, now_ns + DEAD_LINE_LOOK_NS);
    if (dead_line_look(&line->dead, now_ns, heard))
        open_again(line);
    else if (heard && was_dead)
        say(line, LOG_NOTICE, line->env.events->open, "%s: messages come in again", line->env.address);
}

/* ---- events ---- */

static void tell_stranger(struct input_port *line)
{
    if (line->stranger_told || line->port.strangers == 0)
        return;
    line->stranger_told = true;
    say(line, LOG_WARNING, line->env.events->stranger,
        "%.200s: dropping datagrams of %s, which the port does not listen to", line->env.address,
        line->port.stranger);
}

static void on_ready(void *ctx, uint32_t epoll_events, uint64_t now_ns)
{
    struct input_port *line = ctx;
    if (line->port.connecting)
        on_connection(line);
    else
        line->env.ready(line->env.ctx, epoll_events, now_ns);
}

static void on_retry(void *ctx, uint64_t now_ns)
{
    struct input_port *line = ctx;
    struct fault fault;
    (void)now_ns;
    if (line->lost_in_write) {
        lost(line);
    } else if (line->port.connecting) {
        fault_set(&fault, "%.200s: cannot connect: no answer", line->env.address);
        close_port(line);
        failed(line, &fault);
    } else {
        try_open(line);
    }
}

/* Whoever takes connections, says a word and ends them would be told and tried ten times a second. */
static bool stands(const struct input_port *line)
{
    return !line->port.ops->connected || loop_now(line->env.loop) - line->opened_ns >= RETRY_NETWORK_NS;
}

ssize_t input_port_read(struct input_port *line, void *buf, size_t size)
{
    const ssize_t n = line->port.ops->read(&line->port, buf, size);
    if (n > 0 && stands(line)) { /* it speaks: the next loss starts over */
        line->retry_ns = RETRY_FIRST_NS;
        settled(line);
    }
    if (n < 0)
        lost(line);
    else
        tell_stranger(line);
    return n;
}

ssize_t input_port_write(struct input_port *line, const void *buf, size_t size)
{
    const ssize_t n = line->port.ops->write(&line->port, buf, size);
    if (n < 0) { /* not in the middle of the device's doing: it is reported from the loop */
        line->lost_in_write = true;
        loop_arm(line->env.loop, &line->retry, loop_now(line->env.loop));
    }
    return n;
}

void input_port_wait_for_room(struct input_port *line, bool wait)
{
    loop_change(line->env.loop, &line->fd, wait ? EPOLLIN | EPOLLOUT : EPOLLIN);
}

/* ---- life ---- */

bool input_port_init(struct input_port *line, const struct input_port_env *env, struct fault *fault)
{
    line->env = *env;
    line->port.fd = line->fd.fd = -1;
    line->retry_ns = RETRY_FIRST_NS;
    line->fd.ready = on_ready;
    line->retry.fire = on_retry;
    line->look.fire = on_look;
    line->fd.ctx = line->retry.ctx = line->look.ctx = line;
    line->port.ops = port_find(env->address, &line->rest, fault);
    return line->port.ops && make_jobs(line, fault);
}

void input_port_start(struct input_port *line)
{
    try_open(line);
}

bool input_port_is_open(const struct input_port *line)
{
    return line->open;
}

void input_port_stop(struct input_port *line)
{
    line->stopping = true;
    loop_arm(line->env.loop, &line->retry, LOOP_NEVER);
    loop_arm(line->env.loop, &line->look, LOOP_NEVER);
}

void input_port_end(struct input_port *line)
{
    if (!line->port.ops)
        return;
    line->stopping = true;
    if (line->env.loop)
        close_port(line);
    line->open = false;
    if (line->lookup && line->lookup->busy)
        line->lookup->line = NULL;
    else
        free(line->lookup);
    if (line->closing && line->closing->busy)
        line->closing->line = NULL;
    else
        free(line->closing);
    line->lookup = NULL;
    line->closing = NULL;
}
