/* SPDX-License-Identifier: MIT */
/*
 * find_network - see the header. Sources: the maker's description of the Ping360's discovery, which is that of
 * Microchip's TCP/IP stack; docs/devices/udp.md for the places.
 */
#include "find_network.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <poll.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "drivers/devices/ping_frame.h"

#define DISCOVERY_PORT 30303
#define PING360_PORT   12345
#define SURVEYOR_PORT  62312
#define ROUNDS         2
#define DATAGRAM_MAX   2048

static struct find_target target_of(const char *host, uint16_t port, bool discovery)
{
    struct find_target t = {.at = {.sin_family = AF_INET, .sin_port = htons(port)}, .discovery = discovery};
    inet_pton(AF_INET, host, &t.at.sin_addr);
    return t;
}

size_t find_network_targets(struct find_target target[FIND_NETWORK_TARGETS])
{
    static const struct {
        const char *host;
        uint16_t port;
    } usual[] = {{"192.168.2.86", SURVEYOR_PORT},
                 {"192.168.2.2", 9092},
                 {"192.168.2.2", 9093},
                 {"192.168.2.2", 9090},
                 {"192.168.2.2", 9089},
                 {"127.0.0.1", 9092},
                 {"127.0.0.1", 9093},
                 {"127.0.0.1", 9090},
                 {"127.0.0.1", 9089}};
    struct ifaddrs *all = NULL;
    size_t n = 0;

    for (; n < sizeof usual / sizeof usual[0]; n++)
        target[n] = target_of(usual[n].host, usual[n].port, false);
    if (getifaddrs(&all) != 0)
        return n;
    for (const struct ifaddrs *i = all; i && n < FIND_NETWORK_TARGETS; i = i->ifa_next) {
        if (!i->ifa_addr || i->ifa_addr->sa_family != AF_INET || !(i->ifa_flags & IFF_UP) ||
            !(i->ifa_flags & IFF_BROADCAST) || !i->ifa_broadaddr)
            continue;
        target[n] = (struct find_target){.discovery = true};
        memcpy(&target[n].at, i->ifa_broadaddr, sizeof target[n].at);
        target[n++].at.sin_port = htons(DISCOVERY_PORT);
    }
    freeifaddrs(all);
    return n;
}

/* Bound to the port of the discovery where it is free: some answer there, others where the question came from. */
static int open_socket(void)
{
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0), on = 1;
    const struct sockaddr_in here = {.sin_family = AF_INET, .sin_port = htons(DISCOVERY_PORT)};
    if (fd >= 0) {
        setsockopt(fd, SOL_SOCKET, SO_BROADCAST, &on, sizeof on);
        (void)!bind(fd, (const struct sockaddr *)&here, sizeof here);
    }
    return fd;
}

/* What nobody takes is no fault: there is nothing. */
static void ask(int fd, const struct find_target *t)
{
    static const uint8_t wanted[] = {PING_DEVICE_INFORMATION, 0};
    uint8_t out[32];
    size_t n = ping_frame_build(out, sizeof out, PING_GENERAL_REQUEST, 0, wanted, sizeof wanted);
    if (t->discovery) {
        n = strlen("Discovery");
        memcpy(out, "Discovery", n);
    }
    (void)!sendto(fd, out, n, 0, (const struct sockaddr *)&t->at, sizeof t->at);
}

/* The port for sonard.conf of whoever answers the discovery with this text; false: no sonar. */
static bool is_discovered(const char *text, const char *host, char address[FIND_SONAR_PATH])
{
    const char *port = strstr(text, "Port:- ");
    const bool ping360 = strncmp(text, "SONAR PING360", 13) == 0, surveyor = strcasestr(text, "surveyor") != NULL;
    const unsigned long number = port ? strtoul(port + 7, NULL, 10) : ping360 ? PING360_PORT : SURVEYOR_PORT;
    if ((!ping360 && !surveyor) || number < 1 || number > UINT16_MAX)
        return false;
    if (ping360) /* it may answer to its own port number only */
        snprintf(address, FIND_SONAR_PATH, "udp:%s:%lu:%lu", host, number, number);
    else
        snprintf(address, FIND_SONAR_PATH, "udp:%s:%lu", host, number);
    return true;
}

/* The same of a datagram; what did not answer one of the questions is nobody's. */
static bool is_answer(const struct find_target target[], size_t n, const struct sockaddr_in *from,
                      const char *text, char address[FIND_SONAR_PATH])
{
    char host[INET_ADDRSTRLEN];
    inet_ntop(AF_INET, &from->sin_addr, host, sizeof host);
    if (is_discovered(text, host, address))
        return true;
    for (size_t i = 0; i < n; i++)
        if (!target[i].discovery && target[i].at.sin_addr.s_addr == from->sin_addr.s_addr &&
            target[i].at.sin_port == from->sin_port) {
            snprintf(address, FIND_SONAR_PATH, "udp:%s:%u", host, ntohs(from->sin_port));
            return true;
        }
    return false;
}

static bool is_known(const char *address, char known[][FIND_SONAR_PATH], size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (strcmp(known[i], address) == 0)
            return true;
    return false;
}

static int64_t now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000 + t.tv_nsec / 1000000;
}

size_t find_network(const struct find_target target[], size_t n, int wait_ms,
                    char address[FIND_SONAR_PORTS][FIND_SONAR_PATH])
{
    const int fd = open_socket();
    size_t found = 0;
    for (int round = 0; fd >= 0 && round < ROUNDS; round++) {
        for (size_t i = 0; i < n; i++)
            ask(fd, &target[i]);
        const int64_t until = now_ms() + wait_ms;
        for (int64_t left; found < FIND_SONAR_PORTS && (left = until - now_ms()) > 0;) {
            struct pollfd ready = {.fd = fd, .events = POLLIN};
            struct sockaddr_in from = {0};
            socklen_t size = sizeof from;
            char text[DATAGRAM_MAX + 1];
            if (poll(&ready, 1, (int)left) <= 0)
                continue;
            const ssize_t got = recvfrom(fd, text, DATAGRAM_MAX, 0, (struct sockaddr *)&from, &size);
            if (got < 0)
                continue;
            text[got] = '\0';
            if (is_answer(target, n, &from, text, address[found]) && !is_known(address[found], address, found))
                found++;
        }
    }
    if (fd >= 0)
        close(fd);
    return found;
}
