/* SPDX-License-Identifier: MIT */
#include "mavlink_peer.h"

#include <arpa/inet.h>
#include <inttypes.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PEER_HOLD_NS  5000000000u
#define TOLD_AGAIN_NS 60000000000u
#define SOURCE_TEXT   (INET_ADDRSTRLEN + 8)

bool mavlink_network_parse(const char *text, struct mavlink_network *network, struct fault *fault)
{
    const char *slash = strchr(text, '/');
    const size_t n = slash ? (size_t)(slash - text) : strlen(text),
                 digits = slash ? strspn(slash + 1, "0123456789") : 1;
    const unsigned long bits = slash && digits <= 2 ? strtoul(slash + 1, NULL, 10) : 32;
    char host[INET_ADDRSTRLEN] = "";
    struct in_addr address;
    if (n < sizeof host)
        memcpy(host, text, n);
    if (inet_pton(AF_INET, host, &address) != 1 || digits < 1 || digits > 2 || (slash && slash[1 + digits]) ||
        bits < 1 || bits > 32)
        return fault_set(fault, "'%.60s': expected an IPv4 address, or a network as 192.168.2.0/24", text);
    network->mask = UINT32_MAX << (32 - bits);
    network->host = ntohl(address.s_addr) & network->mask;
    return true;
}

bool mavlink_source_same(const struct mavlink_source *a, const struct mavlink_source *b)
{
    return a->size == b->size && memcmp(&a->address, &b->address, a->size) == 0;
}

/* Of family 0 where the source is no IPv4 address. */
static struct sockaddr_in v4_of(const struct mavlink_source *source)
{
    struct sockaddr_in v4 = {0};
    if (source->size >= sizeof v4 && source->address.ss_family == AF_INET)
        memcpy(&v4, &source->address, sizeof v4);
    return v4;
}

static bool within(const struct mavlink_network *network, const struct mavlink_source *from)
{
    const struct sockaddr_in v4 = v4_of(from);
    return network->mask == 0 ||
           (v4.sin_family == AF_INET && (ntohl(v4.sin_addr.s_addr) & network->mask) == network->host);
}

bool mavlink_source_same_host(const struct mavlink_source *a, const struct mavlink_source *b)
{
    const struct sockaddr_in one = v4_of(a), two = v4_of(b);
    return mavlink_source_same(a, b) ||
           (one.sin_family == AF_INET && two.sin_family == AF_INET && one.sin_addr.s_addr == two.sin_addr.s_addr);
}

enum mavlink_whose mavlink_peer_judge(struct mavlink_peer *peer, const struct mavlink_source *from,
                                      uint64_t now_ns)
{
    const bool inside = within(&peer->network, from);
    if (peer->held && mavlink_source_same(&peer->source, from))
        return MAVLINK_PEERS;
    if (inside && !(peer->held && now_ns < peer->heard_ns + PEER_HOLD_NS))
        return MAVLINK_CANDIDATES;
    peer->strangers++;
    peer->outside = !inside;
    peer->stranger = *from;
    return MAVLINK_SOMEBODYS;
}

bool mavlink_peer_hold(struct mavlink_peer *peer, const struct mavlink_source *from, uint64_t now_ns)
{
    const bool another = !peer->held || !mavlink_source_same(&peer->source, from);
    peer->held = true;
    peer->source = *from;
    peer->heard_ns = now_ns;
    return another;
}

/* Of a link with one far end: "the other end". */
static const char *source_text(const struct mavlink_source *source, char text[SOURCE_TEXT])
{
    const struct sockaddr_in v4 = v4_of(source);
    char host[INET_ADDRSTRLEN] = "";
    if (v4.sin_family == AF_INET && inet_ntop(AF_INET, &v4.sin_addr, host, sizeof host))
        snprintf(text, SOURCE_TEXT, "%s:%u", host, ntohs(v4.sin_port));
    else
        snprintf(text, SOURCE_TEXT, "the other end");
    return text;
}

const char *mavlink_peer_text(const struct mavlink_peer *peer, char *text, size_t size)
{
    char held[SOURCE_TEXT];
    snprintf(text, size, "autopilot: at %s", source_text(&peer->source, held));
    return text;
}

bool mavlink_peer_news(struct mavlink_peer *peer, uint64_t now_ns, char *text, size_t size)
{
    char whose[SOURCE_TEXT], held[SOURCE_TEXT];
    const bool known = peer->told_ns > 0 && mavlink_source_same(&peer->told, &peer->stranger);
    if (peer->strangers == 0 || known || (peer->told_ns > 0 && now_ns < peer->told_ns + TOLD_AGAIN_NS))
        return false;
    peer->told_ns = now_ns;
    peer->told = peer->stranger;
    if (peer->outside)
        snprintf(text, size,
                 "warning: dropping what %s sends: --peer does not name it (%" PRIu64
                 " datagrams of others so far)",
                 source_text(&peer->stranger, whose), peer->strangers);
    else
        snprintf(text, size,
                 "warning: dropping what %s sends: the autopilot is at %s (%" PRIu64
                 " datagrams of others so far); --peer ADDRESS says whom to believe",
                 source_text(&peer->stranger, whose), source_text(&peer->source, held), peer->strangers);
    return true;
}
