/* SPDX-License-Identifier: MIT */
/*
 * port_table - the kinds of wire there are. A new one is a new port_*.c and a line here.
 */
#include "port.h"

#include <string.h>

#include "core/fault.h"

const struct port_ops *const port_table[] = {
    &port_serial, &port_udp, &port_tcp, &port_can, &port_canstream, &port_isotp, NULL,
};

const struct port_ops *port_find(const char *address, const char **rest, struct fault *fault)
{
    const char *colon = strchr(address, ':');
    size_t n = colon ? (size_t)(colon - address) : 0;
    for (const struct port_ops *const *p = port_table; *p; p++) {
        if (n == 0 || strlen((*p)->kind) != n || strncmp((*p)->kind, address, n) != 0)
            continue;
        *rest = colon + 1;
        return (*p)->check(*rest, fault) ? *p : NULL;
    }
    fault_set(fault,
              "port '%.64s': must be a kind and an address, as serial:/dev/ttyUSB0:115200; kinds:", address);
    for (const struct port_ops *const *p = port_table; *p; p++)
        fault_add(fault, " %s", (*p)->kind);
    return NULL;
}
