/* SPDX-License-Identifier: MIT */
/*
 * find_network - where on the network a sonar may be: a Ping360 with the Ethernet option answers a broadcast, a
 * Surveyor and the bridges of BlueOS the question who they are, at the places where they are as delivered. All are
 * asked at once. For setting up only; what is there is for find_sonar to tell.
 */
#ifndef SONARD_FIND_NETWORK_H
#define SONARD_FIND_NETWORK_H

#include <netinet/in.h>
#include <stdbool.h>
#include <stddef.h>

#include "find_sonar.h"

#define FIND_NETWORK_TARGETS 32

/* Whom to ask. */
struct find_target {
    struct sockaddr_in at;
    bool discovery; /* by the broadcast of Blue Robotics; else who it is, as the Ping protocol asks */
};

/** find_network_targets - the broadcast addresses of this computer's interfaces, and the usual places; how many. */
size_t find_network_targets(struct find_target target[FIND_NETWORK_TARGETS]);

/**
 * find_network - asks them twice, and waits wait_ms for answers each time. Returns how many answered, each once, at
 * most FIND_SONAR_PORTS; address[] are ports as in sonard.conf. What answers cannot be trusted: it is only asked again.
 */
size_t find_network(const struct find_target target[], size_t n, int wait_ms,
                    char address[FIND_SONAR_PORTS][FIND_SONAR_PATH]);

#endif
