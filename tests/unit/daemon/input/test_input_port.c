/* SPDX-License-Identifier: MIT */
/*
 * test_input_port - a wire that is missing, must be looked up, must connect, or is dead: what its owner is told and how
 * often it is tried. The wire is the test's own (linked with --wrap=port_find), the clock is virtual.
 */
#include "daemon/input/input_port.h"

#include <errno.h>
#include <poll.h>
#include <semaphore.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/lib/test.h"

#define SECOND 1000000000ull

/* ---- the wire ---- */

enum answer { YES, NO, NEVER_SAYS };

static struct {
    bool has_name, name_known; /* read by the worker */
    bool missing;
    enum answer connects;
    unsigned lookups, opens;
    int far;     /* the other end; -1: none */
    bool drains; /* closing it waits until `drained` is posted; read by the worker */
    sem_t drained;
} wire;

static bool wire_named(const char *rest)
{
    (void)rest;
    return wire.has_name;
}

static bool wire_look_up(const char *rest, struct port_far *far, struct fault *fault)
{
    wire.lookups++;
    far->n = wire.name_known;
    return wire.name_known || fault_set(fault, "%s: nobody knows this name", rest);
}

static bool wire_open(struct port *port, const char *rest, struct fault *fault)
{
    int ends[2];
    wire.opens++;
    CHECK_INT(port->far.n, wire.has_name);
    if (wire.missing || socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) < 0)
        return fault_set(fault, "%s: missing", rest);
    if (wire.far >= 0)
        close(wire.far);
    port->fd = ends[0];
    wire.far = ends[1];
    port->connecting = port->ops->connected != NULL;
    if (wire.connects == NEVER_SAYS) { /* it is never writable */
        char full[4096] = {0};
        while (write(port->fd, full, sizeof full) > 0) {
        }
    }
    return true;
}

static bool wire_connected(struct port *port, const char *rest, struct fault *fault)
{
    port->connecting = false;
    return wire.connects == YES || fault_set(fault, "%s: refused", rest);
}

static ssize_t wire_read(struct port *port, void *buf, size_t size)
{
    const ssize_t n = read(port->fd, buf, size);
    port->error = 0;
    return n > 0 ? n : n < 0 && errno == EAGAIN ? 0 : -1;
}

static ssize_t wire_write(struct port *port, const void *buf, size_t size)
{
    return send(port->fd, buf, size, MSG_NOSIGNAL);
}

static void wire_close(struct port *port)
{
    if (port->fd >= 0 && wire.drains)
        sem_wait(&wire.drained);
    if (port->fd >= 0)
        close(port->fd);
    port->fd = -1;
    port->connecting = false;
}

static struct port_ops ops = {.kind = "wire",
                              .encoding = "octet-stream",
                              .named = wire_named,
                              .look_up = wire_look_up,
                              .open = wire_open,
                              .read = wire_read,
                              .write = wire_write,
                              .close = wire_close};

const struct port_ops *__wrap_port_find(const char *address, const char **rest, struct fault *fault);
const struct port_ops *__wrap_port_find(const char *address, const char **rest, struct fault *fault)
{
    (void)fault;
    *rest = address;
    return &ops;
}

/* ---- its owner ---- */

static struct loop *loop;
static struct worker *worker;
static struct input_port *line;
static uint64_t messages;
static unsigned opened, again, closed;

static void on_opened(void *ctx, uint64_t now_ns, bool once_more)
{
    (void)ctx, (void)now_ns;
    opened += !once_more;
    again += once_more;
}

static void on_closed(void *ctx, uint64_t now_ns)
{
    (void)ctx, (void)now_ns;
    closed++;
    CHECK(closed <= opened);
}

static void on_ready(void *ctx, uint32_t epoll_events, uint64_t now_ns)
{
    char bytes[64];
    (void)ctx, (void)epoll_events, (void)now_ns;
    if (input_port_read(line, bytes, sizeof bytes) > 0)
        messages++;
}

static uint64_t count_messages(const void *ctx)
{
    (void)ctx;
    return messages;
}

static void begin(bool connects)
{
    struct fault fault;
    memset(&wire, 0, sizeof wire);
    wire.far = -1;
    ops.connected = connects ? wire_connected : NULL;
    messages = opened = again = closed = 0;
    loop = loop_new(true);
    loop_skip(loop, 1000 * SECOND);
    worker = worker_new(loop, &fault);
}

static void start(bool has_name)
{
    static const struct input_port_events events = {"open", "failed", "lost", "dead", "stranger"};
    const struct input_port_env env = {.loop = loop,
                                       .worker = worker,
                                       .whose = "test: ",
                                       .address = "wire:there",
                                       .events = &events,
                                       .opened = on_opened,
                                       .ready = on_ready,
                                       .closed = on_closed,
                                       .messages = count_messages};
    struct fault fault;
    wire.has_name = has_name;
    line = calloc(1, sizeof *line);
    line->dead.asked = true;
    CHECK(input_port_init(line, &env, &fault));
    input_port_start(line);
}

/* Time passes; names are looked up within each step. */
static void pass(double s)
{
    for (const uint64_t end_ns = loop_now(loop) + (uint64_t)(s * 1e9); loop_now(loop) < end_ns;) {
        worker_finish(worker);
        loop_turn(loop, 0);
        loop_advance(loop, loop_now(loop) + SECOND / 20);
        loop_turn(loop, 0);
    }
}

static void end(void)
{
    input_port_end(line);
    free(line);
    worker_free(worker);
    loop_free(loop);
    if (wire.far >= 0)
        close(wire.far);
}

static void say(void)
{
    CHECK_INT(write(wire.far, "ping", 4), 4);
    pass(0.1);
}

TEST(a_missing_port_is_tried_each_second)
{
    begin(false);
    wire.missing = true;
    start(false);
    pass(60);
    CHECK(wire.opens >= 55 && wire.opens <= 70);
    CHECK(strstr(line->error.text, "missing") != NULL);
    wire.missing = false;
    pass(1.1);
    CHECK_INT(opened, 1);
    CHECK_STR(line->error.text, "");
    close(wire.far);
    wire.far = -1;
    pass(0.3);
    CHECK_INT(closed, 1);
    CHECK_INT(opened, 2);
    CHECK_INT(line->reconnects, 1);
    end();
}

TEST(a_name_is_looked_up_before_each_try_and_ever_less_often_in_vain)
{
    begin(true);
    start(true);
    pass(300);
    CHECK(wire.lookups >= 12 && wire.lookups <= 24);
    CHECK_INT(wire.opens, 0);
    CHECK(strstr(line->error.text, "nobody knows this name") != NULL);
    wire.name_known = true;
    pass(31);
    CHECK_INT(opened, 1);
    CHECK(input_port_is_open(line));
    say();
    const unsigned lookups = wire.lookups;
    close(wire.far);
    wire.far = -1;
    pass(0.5);
    CHECK_INT(wire.lookups, lookups + 1); /* the host may have moved */
    CHECK_INT(opened, 2);
    end();
}

TEST(a_far_end_that_refuses_or_says_nothing_is_tried_again)
{
    begin(true);
    wire.connects = NO;
    start(false);
    pass(60);
    CHECK(wire.opens >= 12 && wire.opens <= 24);
    CHECK(strstr(line->error.text, "refused") != NULL);
    wire.connects = NEVER_SAYS;
    const unsigned opens = wire.opens;
    pass(60);
    CHECK(wire.opens - opens >= 5 && wire.opens - opens <= 7);
    CHECK(strstr(line->error.text, "no answer") != NULL);
    CHECK_INT(opened + closed, 0);
    wire.connects = YES;
    pass(10);
    CHECK_INT(opened, 1);
    end();
}

/* With a word, or without. */
TEST(a_far_end_that_hangs_up_at_once_is_left_in_peace)
{
    for (int speaks = 0; speaks < 2; speaks++) {
        begin(true);
        start(false);
        for (int i = 0; i < 600; i++) {
            if (speaks && wire.far >= 0)
                CHECK_INT(write(wire.far, "ping", 4), 4);
            pass(0.1);
            if (wire.far >= 0)
                close(wire.far);
            wire.far = -1;
        }
        CHECK(opened >= 10 && opened <= 24);
        CHECK(opened - closed <= 1);
        CHECK(speaks == (messages > 0));
        end();
    }
}

/* The owner of a dead line goes on asking: it need not know. */
TEST(a_dead_line_is_opened_again_behind_its_owners_back)
{
    for (int connects = 0; connects < 2; connects++) {
        begin(connects);
        start(false);
        pass(1);
        say();
        pass(9);
        CHECK_INT(wire.opens, 1);
        pass(3);
        CHECK_INT(wire.opens, 2);
        CHECK(opened == 1 && again == 1 && closed == 0);
        pass(21); /* it does not help: twice as long */
        CHECK_INT(wire.opens, 3);
        say();
        pass(8);
        CHECK_INT(wire.opens, 3);
        wire.missing = true;
        pass(6);
        CHECK_INT(closed, 1);
        wire.missing = false;
        pass(6);
        CHECK_INT(opened, 2);
        end();
    }
}

/* As a serial port does that still has something to send. */
TEST(the_loop_does_not_wait_for_a_dead_port_to_close)
{
    for (int ends = 0; ends < 2; ends++) {
        begin(false);
        sem_init(&wire.drained, 0, 0);
        start(false);
        wire.drains = true;
        for (int s = 0; s < 60; s++) {
            loop_advance(loop, loop_now(loop) + SECOND);
            loop_turn(loop, 0);
        }
        CHECK_INT(wire.opens, 1);
        CHECK(!input_port_is_open(line));
        if (ends)
            input_port_end(line);
        sem_post(&wire.drained);
        pass(1);
        CHECK_INT(wire.opens, ends ? 1 : 2);
        wire.drains = false;
        end();
        sem_destroy(&wire.drained);
    }
}

TEST(a_stopped_line_is_not_opened_again)
{
    begin(true);
    start(false);
    pass(1);
    input_port_stop(line);
    pass(60);
    CHECK_INT(wire.opens, 1);
    CHECK(input_port_is_open(line));
    close(wire.far);
    wire.far = -1;
    pass(10);
    CHECK_INT(wire.opens, 1);
    CHECK(!input_port_is_open(line));
    end();
}

TEST(a_line_may_end_while_its_name_is_looked_up)
{
    begin(true);
    start(true);
    input_port_end(line);
    pass(1);
    CHECK_INT(wire.opens, 0);
    end();
}

int main(void)
{
    RUN(a_missing_port_is_tried_each_second);
    RUN(a_name_is_looked_up_before_each_try_and_ever_less_often_in_vain);
    RUN(a_far_end_that_refuses_or_says_nothing_is_tried_again);
    RUN(a_far_end_that_hangs_up_at_once_is_left_in_peace);
    RUN(a_dead_line_is_opened_again_behind_its_owners_back);
    RUN(the_loop_does_not_wait_for_a_dead_port_to_close);
    RUN(a_stopped_line_is_not_opened_again);
    RUN(a_line_may_end_while_its_name_is_looked_up);
    return test_end();
}
