/* SPDX-License-Identifier: MIT */
/*
 * can_bridge - joins two ports of any kind that carry bytes, as a gateway between a serial line and CAN does:
 *
 *   can_bridge serial:/tmp/sonar:115200 isotp:vcan0:702:701
 *
 * Ends with SIGTERM, SIGINT, or when one of the two is gone.
 */
#include <poll.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"
#include "drivers/ports/port.h"

struct end {
    struct port port;
    uint8_t held[65536]; /* read from the other end and not yet taken by this one */
    size_t n;
};

static bool end_open(struct end *end, const char *address)
{
    struct fault fault;
    const char *rest;
    const struct port_ops *ops = port_find(address, &rest, &fault);
    if (ops && ops->open(&end->port, rest, &fault))
        return true;
    fprintf(stderr, "can_bridge: %s: %s\n", address, fault.text);
    return false;
}

/* From one end to the other; false when one is gone. */
static bool carry(struct end *from, struct end *to)
{
    if (to->n == 0) {
        ssize_t got = from->port.ops->read(&from->port, to->held, sizeof to->held);
        if (got < 0)
            return false;
        to->n = (size_t)got;
    }
    ssize_t taken = to->n ? to->port.ops->write(&to->port, to->held, to->n) : 0;
    if (taken < 0)
        return false;
    memmove(to->held, to->held + taken, to->n - (size_t)taken);
    to->n -= (size_t)taken;
    return true;
}

int main(int argc, char **argv)
{
    static struct end a, b;
    if (argc != 3) {
        fprintf(stderr,
                "usage: can_bridge PORT PORT, for instance serial:/tmp/sonar:115200 isotp:vcan0:702:701\n");
        return 2;
    }
    if (!end_open(&a, argv[1]) || !end_open(&b, argv[2]))
        return 1;
    printf("ready\n");
    fflush(stdout);
    do {
        struct pollfd fds[] = {{a.port.fd, (short)(b.n ? 0 : POLLIN), 0},
                               {b.port.fd, (short)(a.n ? 0 : POLLIN), 0}};
        poll(fds, 2, a.n || b.n ? 1 : -1);
    } while (carry(&a, &b) && carry(&b, &a));
    fprintf(stderr, "can_bridge: one end is gone\n");
    return 1;
}
