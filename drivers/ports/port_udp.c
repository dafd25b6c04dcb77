/* SPDX-License-Identifier: MIT */
/*
 * port_udp - a socket connected to one far end: "192.168.2.2:9092", "[fe80::1%eth0]:12345", with a local port where
 * the far end answers to a fixed one only: "192.168.2.2:12345:12345". What comes from others the kernel drops. A
 * datagram is no frame: its bytes are handed on as they are, and what they mean is not known here.
 *
 * "192.168.2.9:10110:listen" only listens: on the local port 10110, to that host with any port of its own.
 * "0.0.0.0:10110:listen" and "[::]:10110:listen" hear everybody. Datagrams of other hosts are dropped and counted.
 * For a user that sends nothing the other forms listen too, on the local port or else on the only one named: a sender
 * whose own port is another one, as most have, would be dropped by the kernel, and nobody would know.
 *
 * That nobody is there (an ICMP error) is said by the network long after a datagram was taken: it is counted, and the
 * port stays open for the moment when somebody is. Names are refused, since looking one up may take seconds.
 */
#include "port.h"

#include <arpa/inet.h>
#include <errno.h>
#include <netdb.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "arrival.h"
#include "core/fault.h"

#define RECEIVE_BUFFER (1 << 20) /* some hundred pings of a multibeam; the kernel gives what it allows */

struct address {
    char host[PORT_ADDRESS_MAX];
    char port[8], local[8]; /* local: empty, any */
    bool v6;
    bool listens; /* on `port`, which is a local one then; `host` is whom it hears */
};

/* The port number that `text` is, up to the next colon; what follows in *after. */
static bool take_port(const char *text, char out[8], const char **after)
{
    size_t n = strspn(text, "0123456789");
    if (n < 1 || n > 5 || (text[n] != '\0' && text[n] != ':'))
        return false;
    memcpy(out, text, n);
    out[n] = '\0';
    *after = text + n;
    unsigned long number = strtoul(out, NULL, 10);
    return number >= 1 && number <= 65535;
}

static struct addrinfo *resolve(const struct address *a, const char *host, const char *port, int flags)
{
    const struct addrinfo want = {.ai_family = a->v6 ? AF_INET6 : AF_INET,
                                  .ai_socktype = SOCK_DGRAM,
                                  .ai_flags = AI_NUMERICHOST | AI_NUMERICSERV | flags};
    struct addrinfo *found = NULL;
    return getaddrinfo(host, port, &want, &found) == 0 ? found : NULL;
}

static bool parse_address(const char *rest, struct address *a, struct fault *fault)
{
    const char *end, *after = NULL;
    *a = (struct address){.v6 = rest[0] == '['};
    const char *host = rest + a->v6;
    end = strchr(host, a->v6 ? ']' : ':');
    const char *colon = end ? end + a->v6 : NULL;
    size_t n = end ? (size_t)(end - host) : 0;
    bool good = n >= 1 && n < sizeof a->host && *colon == ':' && take_port(colon + 1, a->port, &after);
    a->listens = good && strcmp(after, ":listen") == 0;
    if (!good || (!a->listens && *after == ':' && (!take_port(after + 1, a->local, &after) || *after != '\0'))) {
        fault_set(
            fault,
            "udp port '%.64s': must be an address and a port number, as 192.168.2.2:9092 or [fe80::1%%eth0]:9092;"
            " :LOCALPORT or :listen may follow",
            rest);
        return false;
    }
    memcpy(a->host, host, n);
    struct addrinfo *numeric = resolve(a, a->host, a->port, 0);
    if (!numeric)
        return fault_set(fault, "udp host '%.64s': must be a numeric address, as 192.168.2.2 or [fe80::1%%eth0]",
                         a->host);
    freeaddrinfo(numeric);
    return true;
}

static bool udp_check(const char *rest, struct fault *fault)
{
    struct address a;
    return parse_address(rest, &a, fault);
}

static const void *host_of(const struct sockaddr *address)
{
    return address->sa_family == AF_INET ? (const void *)&((const struct sockaddr_in *)address)->sin_addr
                                         : (const void *)&((const struct sockaddr_in6 *)address)->sin6_addr;
}

/* Whom a listening port hears. Of a scoped address the scope is not compared. */
static void hear(struct port *port, const struct address *a, const struct sockaddr *whom)
{
    static const uint8_t nobody[sizeof port->hears];
    port->listens = a->listens;
    port->hears_bytes = a->v6 ? 16 : 4;
    memcpy(port->hears, host_of(whom), port->hears_bytes);
    if (memcmp(port->hears, nobody, port->hears_bytes) == 0)
        port->hears_bytes = 0;
}

/* All that is done to a new socket; what it was that failed, or NULL. */
static const char *set_up(struct port *port, int fd, const struct address *a)
{
    const int room = RECEIVE_BUFFER;
    struct addrinfo *far = resolve(a, a->host, a->port, 0);
    const char *local = a->listens ? a->port : a->local;
    struct addrinfo *near = local[0] ? resolve(a, NULL, local, AI_PASSIVE) : NULL;
    const char *why = NULL;
    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &room, sizeof room); /* less room only loses more, and that is counted */
    arrival_ask(port, fd);
    if (!far || (local[0] && !near))
        why = "out of memory";
    else if (near && bind(fd, near->ai_addr, near->ai_addrlen) < 0)
        why = "the local port cannot be had";
    else if (!a->listens && connect(fd, far->ai_addr, far->ai_addrlen) < 0)
        why = "no way there";
    int error = errno;
    if (far) {
        hear(port, a, far->ai_addr);
        freeaddrinfo(far);
    }
    if (near)
        freeaddrinfo(near);
    errno = error;
    return why;
}

/* Is a datagram for us? One that is not is counted, and the first sender of such is remembered. */
static bool welcome(struct port *port, const struct sockaddr_storage *from)
{
    const void *host = host_of((const struct sockaddr *)from);
    if (!port->listens || memcmp(host, port->hears, port->hears_bytes) == 0)
        return true;
    if (port->strangers++ == 0)
        inet_ntop(from->ss_family, host, port->stranger, sizeof port->stranger);
    return false;
}

static void only_listen(struct address *a)
{
    if (a->local[0])
        memcpy(a->port, a->local, sizeof a->port);
    a->listens = true;
}

static bool udp_open(struct port *port, const char *rest, struct fault *fault)
{
    struct address a;
    port->ops = &port_udp;
    port->fd = -1;
    port->error = EINVAL;
    if (!parse_address(rest, &a, fault))
        return false;
    if (port->only_listens)
        only_listen(&a);
    int fd = socket(a.v6 ? AF_INET6 : AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    const char *why = fd >= 0 ? set_up(port, fd, &a)
                      : errno == EAFNOSUPPORT
                          ? "network access is not permitted; install network.conf (sonard(8), RUNNING)"
                          : "no socket";
    if (why) {
        port->error = errno;
        if (fd >= 0)
            close(fd);
        return fault_set(fault, "udp %s: %s: %s", rest, why, strerror(port->error));
    }
    port->fd = fd;
    port->error = 0;
    return true;
}

/* Errors that tell of the way and its far end; the socket is as good as before. */
static bool not_there(int error)
{
    return error == ECONNREFUSED || error == EHOSTUNREACH || error == ENETUNREACH || error == EHOSTDOWN ||
           error == ENOPROTOOPT || error == EPROTO || error == EACCES || error == EPERM;
}

static ssize_t udp_read(struct port *port, void *buf, size_t size)
{
    _Alignas(struct cmsghdr) char control[ARRIVAL_CONTROL_BYTES];
    struct iovec bytes = {buf, size};
    struct sockaddr_storage from = {0};
    struct msghdr message = {.msg_name = &from,
                             .msg_namelen = sizeof from,
                             .msg_iov = &bytes,
                             .msg_iovlen = 1,
                             .msg_control = control,
                             .msg_controllen = sizeof control};

    ssize_t n = recvmsg(port->fd, &message, 0);
    if (n >= 0) {
        arrival_take(port, &message);
        return welcome(port, &from) ? n : 0;
    }
    if (errno == EAGAIN || errno == EINTR)
        return 0;
    if (not_there(errno)) {
        port->refused++;
        return 0;
    }
    port->error = errno;
    return -1;
}

static ssize_t udp_write(struct port *port, const void *buf, size_t size)
{
    if (port->listens) {
        port->refused++;
        return (ssize_t)size;
    }
    ssize_t n = send(port->fd, buf, size, 0);
    if (n >= 0)
        return n;
    if (errno == EAGAIN || errno == EINTR)
        return 0;
    if (not_there(errno) || errno == ENOBUFS) {
        port->refused++;
        return (ssize_t)size; /* lost, as any datagram may be */
    }
    port->error = errno;
    return -1;
}

/* An empty datagram asks a bridge to a serial line for a break there. That nobody is there shows with the next. */
static void udp_hold_break(struct port *port, bool on)
{
    if (on)
        udp_write(port, "", 0);
}

static void udp_close(struct port *port)
{
    if (port->fd < 0)
        return;
    close(port->fd);
    port->fd = -1;
}

const struct port_ops port_udp = {
    .kind = "udp",
    .encoding = "octet-stream",
    .check = udp_check,
    .open = udp_open,
    .read = udp_read,
    .write = udp_write,
    .hold_break = udp_hold_break,
    .close = udp_close,
};
