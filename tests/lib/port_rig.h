/* SPDX-License-Identifier: MIT */
/* port_rig.h - the one port that a test has open, and what its calls complain of. */
#ifndef SONARD_TEST_PORT_RIG_H
#define SONARD_TEST_PORT_RIG_H

#include "core/fault.h"
#include "drivers/ports/port.h"
#include "patience.h"

static struct port port;
static struct fault fault;

/* Wait until the port has something to say, then read. */
static ssize_t read_ready(void *buf, size_t size)
{
    patience_for(port.fd, POLLIN);
    return port.ops->read(&port, buf, size);
}

#endif
