/* SPDX-License-Identifier: MIT */
/*
 * find_sonar - which sonar is on a port: by listening, then by the question that every device of its protocol answers
 * and that changes nothing. For setting up only; sonard itself never guesses. Knows no configuration.
 */
#ifndef SONARD_FIND_SONAR_H
#define SONARD_FIND_SONAR_H

#include <stdbool.h>
#include <stddef.h>

#include "core/fault.h"

#define FIND_SONAR_PORTS 16
#define FIND_SONAR_PATH  200

struct found_sonar {
    const char *device;              /* as in sonard.conf */
    char port[FIND_SONAR_PATH + 32]; /* likewise, with the baud rate at which it answered */
    char how[80];                    /* for people: what it said */
    int error;                       /* errno of a port that cannot be opened; 0: it was open */
    bool refused;                    /* over the network: the far end says that nothing listens there */
};

/**
 * find_sonar_ports - serial lines that a sonar may be on: those with a lasting name, else USB adapters, each once.
 * Returns how many; path[] are device files.
 */
size_t find_sonar_ports(char path[FIND_SONAR_PORTS][FIND_SONAR_PATH]);

/**
 * find_sonar_on - what is on it: `address` is a device file, or a port as in sonard.conf. ask false: only listen. A
 * Ping360 on a device file is asked at 921600 baud, too, and found at that rate if it answers. Takes up to 6 s. False
 * with a sentence in fault: it cannot be opened, or nothing known was received.
 */
bool find_sonar_on(const char *address, bool ask, struct found_sonar *found, struct fault *fault);

#endif
