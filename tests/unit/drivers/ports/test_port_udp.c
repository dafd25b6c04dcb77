/* SPDX-License-Identifier: MIT */
/*
 * The UDP port against sockets of the test's own on the loopback interface, IPv4 and IPv6.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "core/fault.h"
#include "drivers/ports/port.h"
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

static struct port port;
static struct fault fault;

/* A socket on a free port of the loopback interface. */
static int far_end(uint16_t *number)
{
    struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t n = sizeof a;
    int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0 || bind(fd, (struct sockaddr *)&a, n) < 0 || getsockname(fd, (struct sockaddr *)&a, &n) < 0) {
        perror("udp");
        exit(2);
    }
    *number = ntohs(a.sin_port);
    return fd;
}

static bool open_to(uint16_t number, const char *more)
{
    char rest[64];
    snprintf(rest, sizeof rest, "127.0.0.1:%u%s", number, more);
    fault.text[0] = '\0';
    return port_udp.open(&port, rest, &fault);
}

/* From here on it hears one port alone, and to all others nobody is there; its number stays its own. */
static void hear_only(int fd, uint16_t number)
{
    struct sockaddr_in a = {
        .sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK), .sin_port = htons(number)};
    CHECK(connect(fd, (struct sockaddr *)&a, sizeof a) == 0);
}

static uint16_t own_number(void)
{
    struct sockaddr_in a;
    socklen_t n = sizeof a;
    return getsockname(port.fd, (struct sockaddr *)&a, &n) == 0 ? ntohs(a.sin_port) : 0;
}

/* Wait until the port has something to say, then read. */
static ssize_t read_ready(void *buf, size_t size)
{
    patience_for(port.fd, POLLIN);
    return port.ops->read(&port, buf, size);
}

static void send_to(int fd, uint16_t number, const void *bytes, size_t n)
{
    struct sockaddr_in a = {
        .sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK), .sin_port = htons(number)};
    CHECK_INT(sendto(fd, bytes, n, 0, (struct sockaddr *)&a, sizeof a), n);
}

TEST(addresses)
{
    static const struct {
        const char *rest;
        bool good;
        const char *says;
    } row[] = {
        {"192.168.2.2:9092", true, ""},
        {"192.168.2.2:12345:12345", true, ""},
        {"[::1]:9092", true, ""},
        {"[fe80::1%lo]:9092:9093", true, ""},
        {"192.168.2.9:10110:listen", true, ""},
        {"[::]:10110:listen", true, ""},
        {"192.168.2.9:10110:listens", false, ":listen"},
        {"192.168.2.9:10110:10110:listen", false, ":listen"},
        {"", false, "192.168.2.2:9092"},
        {"192.168.2.2", false, "port number"},
        {"192.168.2.2:", false, "port number"},
        {"192.168.2.2:0", false, "port number"},
        {"192.168.2.2:65536", false, "port number"},
        {"192.168.2.2:-1", false, "port number"},
        {"192.168.2.2:9092x", false, "port number"},
        {"192.168.2.2:9092:", false, "LOCALPORT"},
        {"192.168.2.2:9092:70000", false, "LOCALPORT"},
        {"192.168.2.2:9092:1:2", false, "LOCALPORT"},
        {":9092", false, "address"},
        {"[]:9092", false, "address"},
        {"[::1]9092", false, "address"},
        {"[::1", false, "address"},
        {"::1:9092", false, "address"},
        {"[192.168.2.2]:9092", false, "numeric"},
        {"192.168.2.300:9092", false, "numeric"},
        {"blueos.local:9092", false, "numeric"},
        {"%s%n:9092", false, "numeric"},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        fault.text[0] = '\0';
        bool good = port_udp.check(row[i].rest, &fault);
        if (good != row[i].good || !strstr(fault.text, row[i].says)) {
            printf("%s: %d, \"%s\"\n", row[i].rest, good, fault.text);
            CHECK(false);
        }
    }
    char longest[600];
    memset(longest, '1', sizeof longest);
    memcpy(longest + 590, ":9092", 6);
    CHECK(!port_udp.check(longest, &fault));
    const char *rest;
    CHECK(port_find("udp:10.0.0.1:1", &rest, &fault) == &port_udp);
    CHECK(port_udp.baud == NULL);
}

TEST(bytes_go_both_ways)
{
    uint16_t number;
    uint8_t b[64];
    int fd = far_end(&number);
    CHECK(open_to(number, ""));
    CHECK_INT(port.ops->read(&port, b, sizeof b), 0);
    CHECK_INT(port.ops->write(&port, "ping", 4), 4);
    CHECK_INT(recv(fd, b, sizeof b, 0), 4);
    CHECK(memcmp(b, "ping", 4) == 0);
    send_to(fd, own_number(), "one", 3);
    send_to(fd, own_number(), "two", 3);
    CHECK_INT(read_ready(b, sizeof b), 3);
    CHECK_INT(read_ready(b + 3, sizeof b - 3), 3);
    CHECK(memcmp(b, "onetwo", 6) == 0);
    send_to(fd, own_number(), "", 0);
    CHECK_INT(read_ready(b, sizeof b), 0);
    CHECK_INT(port.ops->read(&port, b, sizeof b), 0);
    port.ops->close(&port);
    port.ops->close(&port);
    CHECK_INT(port.fd, -1);
    close(fd);
}

TEST(a_break_is_one_empty_datagram)
{
    uint16_t number;
    uint8_t b[4];
    int fd = far_end(&number);
    CHECK(open_to(number, ""));
    port.ops->hold_break(&port, true);
    port.ops->hold_break(&port, false);
    CHECK_INT(port.ops->write(&port, "U", 1), 1);
    CHECK_INT(recv(fd, b, sizeof b, 0), 0);
    CHECK_INT(recv(fd, b, sizeof b, 0), 1);
    port.ops->close(&port);
    close(fd);
}

TEST(bytes_of_others_are_not_read)
{
    uint16_t number, other_number;
    uint8_t b[64];
    int fd = far_end(&number), other = far_end(&other_number);
    CHECK(open_to(number, ""));
    send_to(other, own_number(), "stranger", 8);
    send_to(fd, own_number(), "friend", 6);
    CHECK_INT(read_ready(b, sizeof b), 6);
    CHECK(memcmp(b, "friend", 6) == 0);
    CHECK_INT(port.ops->read(&port, b, sizeof b), 0);
    port.ops->close(&port);
    close(fd);
    close(other);
}

/* The number of the port on which it listens to that host now. */
static uint16_t listen_to(const char *host)
{
    uint16_t number = 0;
    char rest[64];
    bool had = false;
    port = (struct port){.fd = -1};
    for (int i = 0; i < 100 && !had; i++) { /* somebody else may be quicker */
        close(far_end(&number));
        snprintf(rest, sizeof rest, "%s:%u:listen", host, number);
        had = port_udp.open(&port, rest, &fault);
        CHECK(had || port.error == EADDRINUSE);
    }
    CHECK(had);
    return number;
}

TEST(a_listening_port_hears_a_host_from_any_port)
{
    static const char *const hosts[] = {"127.0.0.1", "0.0.0.0"};
    for (size_t i = 0; i < sizeof hosts / sizeof hosts[0]; i++) {
        const uint16_t number = listen_to(hosts[i]);
        uint16_t unused;
        uint8_t b[64];
        int one = far_end(&unused), two = far_end(&unused);
        send_to(one, number, "one", 3);
        CHECK_INT(read_ready(b, sizeof b), 3);
        send_to(two, number, "two2", 4);
        CHECK_INT(read_ready(b, sizeof b), 4);
        CHECK_INT(port.strangers, 0);
        CHECK_INT(port.ops->write(&port, "x", 1), 1); /* to nobody */
        CHECK_INT(port.refused, 1);
        port.ops->close(&port);
        close(one);
        close(two);
    }
}

/* Of a user that sends nothing: a local port behind the far one, or the only one that is named. */
TEST(a_port_that_sends_nothing_hears_a_host_from_any_port)
{
    static const char *const before[] = {"127.0.0.1:10110", "127.0.0.1"};
    for (size_t i = 0; i < sizeof before / sizeof before[0]; i++) {
        uint16_t number = 0, unused;
        uint8_t b[64];
        bool had = false;
        int fd = far_end(&unused);
        port = (struct port){.fd = -1, .only_listens = true};
        for (int k = 0; k < 100 && !had; k++) { /* somebody else may be quicker */
            char rest[64];
            close(far_end(&number));
            snprintf(rest, sizeof rest, "%s:%u", before[i], number);
            had = port_udp.open(&port, rest, &fault);
            CHECK(had || port.error == EADDRINUSE);
        }
        CHECK(had);
        CHECK_INT(own_number(), number);
        send_to(fd, number, "any", 3);
        CHECK_INT(read_ready(b, sizeof b), 3);
        CHECK_INT(port.strangers, 0);
        port.ops->close(&port);
        close(fd);
    }
    port = (struct port){.fd = -1};
}

TEST(a_listening_port_counts_and_names_strangers)
{
    static const char *const hosts[] = {"127.0.0.2", "127.2", "0x7f000002"}; /* all the same */
    for (size_t k = 0; k < sizeof hosts / sizeof hosts[0]; k++) {
        const uint16_t number = listen_to(hosts[k]);
        uint16_t unused;
        uint8_t b[64];
        int fd = far_end(&unused);
        for (int i = 1; i <= 2; i++) {
            send_to(fd, number, "stranger", 8);
            CHECK_INT(read_ready(b, sizeof b), 0);
            CHECK_INT(port.strangers, i);
        }
        CHECK_STR(port.stranger, "127.0.0.1");
        port.ops->close(&port);
        close(fd);
    }
}

TEST(nobody_there_is_counted_and_waited_out)
{
    uint16_t number;
    uint8_t b[64];
    int fd = far_end(&number);
    hear_only(fd, number);
    uint64_t before = port.refused;
    CHECK(open_to(number, ""));
    for (int i = 0; i < 3; i++) {
        CHECK_INT(port.ops->write(&port, "ping", 4), 4);
        CHECK_INT(read_ready(b, sizeof b), 0);
    }
    for (int i = 0; i < 3; i++) /* the answer to one is told to the next */
        CHECK_INT(port.ops->write(&port, "ping", 4), 4);
    CHECK(port.refused >= before + 4);
    read_ready(b, sizeof b);

    /* somebody comes */
    hear_only(fd, own_number());
    CHECK_INT(port.ops->write(&port, "ping", 4), 4);
    CHECK_INT(recv(fd, b, sizeof b, 0), 4);
    send_to(fd, own_number(), "pong", 4);
    CHECK_INT(read_ready(b, sizeof b), 4);
    port.ops->close(&port);
    close(fd);
}

TEST(local_port_is_had_or_refused)
{
    uint16_t number, free_number, taken;
    char more[16];
    int fd = far_end(&number);
    bool had = false;
    for (int i = 0; i < 100 && !had; i++) { /* somebody else may be quicker */
        close(far_end(&free_number));
        snprintf(more, sizeof more, ":%u", free_number);
        had = open_to(number, more);
        CHECK(had || port.error == EADDRINUSE);
    }
    CHECK(had);
    CHECK_INT(own_number(), free_number);
    port.ops->close(&port);

    int other = far_end(&taken);
    snprintf(more, sizeof more, ":%u", taken);
    CHECK(!open_to(number, more));
    CHECK(strstr(fault.text, "local port") != NULL);
    CHECK_INT(port.error, EADDRINUSE);
    CHECK_INT(port.fd, -1);
    close(other);
    close(fd);
}

TEST(what_found_no_room_is_counted)
{
    static uint8_t big[60000];
    uint16_t number;
    int fd = far_end(&number), sent = 100, got = 0;
    CHECK(open_to(number, ""));
    uint64_t before = port.lost;
    for (int i = 0; i < sent; i++)
        send_to(fd, own_number(), big, sizeof big);
    while (port.ops->read(&port, big, sizeof big) > 0)
        got++;
    send_to(fd, own_number(), "last", 4); /* its datagram carries the count */
    ssize_t n;
    while ((n = read_ready(big, sizeof big)) == sizeof big)
        got++;
    CHECK_INT(n, 4);
    CHECK(got < sent);
    CHECK_INT(port.lost - before, sent - got);
    send_to(fd, own_number(), "more", 4); /* so does every one from now on: they are counted once */
    CHECK_INT(read_ready(big, sizeof big), 4);
    CHECK_INT(port.lost - before, sent - got);
    port.ops->close(&port);
    CHECK(open_to(number, ""));
    send_to(fd, own_number(), "new", 3);
    CHECK_INT(read_ready(big, sizeof big), 3);
    CHECK_INT(port.lost - before, sent - got);
    port.ops->close(&port);
    close(fd);
}

static uint64_t clock_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

/* Datagrams until one is stamped: sent after *before_ns, there by *there_ns, read later. The kernel begins to stamp a
 * moment after it was asked; until then a datagram comes when it is read. */
static void read_stamped(int fd, uint64_t *before_ns, uint64_t *there_ns)
{
    uint8_t b[8];
    int tries = 0;
    do {
        *before_ns = clock_ns();
        send_to(fd, own_number(), "early", 5);
        patience_for(port.fd, POLLIN);
        *there_ns = clock_ns();
        nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
        CHECK_INT(read_ready(b, sizeof b), 5);
    } while (port.t_ns > *there_ns && ++tries < 10000);
}

TEST(datagrams_count_from_when_they_came_however_late_they_are_read)
{
    uint16_t number;
    int fd = far_end(&number);
    uint64_t before_ns, there_ns;
    CHECK(open_to(number, ""));
    read_stamped(fd, &before_ns, &there_ns);
    CHECK(port.t_ns + 100000 >= before_ns && port.t_ns <= there_ns); /* two clocks, read as one to 0.1 ms */
    port.ops->close(&port);
    close(fd);
}

/* Stamps of before the clock was set look like any others. */
TEST(what_came_before_the_clock_was_set_has_no_time)
{
    static const int64_t set_s[] = {-3, 3};
    uint16_t number;
    uint8_t in[8];
    int fd = far_end(&number);
    uint64_t before_ns, there_ns;
    CHECK(open_to(number, ""));
    read_stamped(fd, &before_ns, &there_ns);
    for (size_t i = 0; i < sizeof set_s / sizeof set_s[0]; i++) {
        for (int k = 0; k < 3; k++)
            send_to(fd, own_number(), "late", 4);
        port.unix_offset_ns += set_s[i] * 1000000000; /* as before the clock was set, the other way */
        for (int k = 0; k < 3; k++) {
            CHECK_INT(read_ready(in, sizeof in), 4);
            CHECK(port.t_ns == 0);
        }
        read_stamped(fd, &before_ns, &there_ns);
        CHECK(port.t_ns != 0);
    }
    port.ops->close(&port);
    close(fd);
}

TEST(ipv6)
{
    struct sockaddr_in6 a = {.sin6_family = AF_INET6, .sin6_addr = IN6ADDR_LOOPBACK_INIT};
    socklen_t n = sizeof a;
    char rest[64];
    uint8_t b[8];
    int fd = socket(AF_INET6, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0 || bind(fd, (struct sockaddr *)&a, n) < 0 || getsockname(fd, (struct sockaddr *)&a, &n) < 0) {
        printf("skip ipv6: no IPv6 on this machine\n");
        if (fd >= 0)
            close(fd);
        return;
    }
    snprintf(rest, sizeof rest, "[::1]:%u", ntohs(a.sin6_port));
    CHECK(port_udp.open(&port, rest, &fault));
    CHECK_INT(port.ops->write(&port, "six", 3), 3);
    CHECK_INT(recv(fd, b, sizeof b, 0), 3);
    port.ops->close(&port);
    close(fd);
}

int main(void)
{
    RUN(addresses);
    RUN(bytes_go_both_ways);
    RUN(a_break_is_one_empty_datagram);
    RUN(bytes_of_others_are_not_read);
    RUN(a_listening_port_hears_a_host_from_any_port);
    RUN(a_port_that_sends_nothing_hears_a_host_from_any_port);
    RUN(a_listening_port_counts_and_names_strangers);
    RUN(nobody_there_is_counted_and_waited_out);
    RUN(local_port_is_had_or_refused);
    RUN(what_found_no_room_is_counted);
    RUN(datagrams_count_from_when_they_came_however_late_they_are_read);
    RUN(what_came_before_the_clock_was_set_has_no_time);
    RUN(ipv6);
    return test_end();
}
