/* SPDX-License-Identifier: MIT */
/*
 * The TCP port against servers of the test's own on the loopback interface.
 */
#include <arpa/inet.h>
#include <errno.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/fault.h"
#include "drivers/ports/port.h"
#include "tests/lib/patience.h"
#include "tests/lib/port_rig.h"
#include "tests/lib/test.h"

/* A server on a free port of the loopback interface; it listens, or only holds the number. */
static int server(uint16_t *number, bool listens)
{
    struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t n = sizeof a;
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd < 0 || bind(fd, (struct sockaddr *)&a, n) < 0 || getsockname(fd, (struct sockaddr *)&a, &n) < 0 ||
        (listens && listen(fd, 4) < 0)) {
        perror("tcp");
        exit(2);
    }
    *number = ntohs(a.sin_port);
    return fd;
}

/* Open, and connected or not. */
static bool connect_to(const char *host, uint16_t number)
{
    char rest[64];
    snprintf(rest, sizeof rest, "%s:%u", host, number);
    fault.text[0] = '\0';
    if (!port_tcp.open(&port, rest, &fault))
        return false;
    if (!port.connecting)
        return true;
    patience_for(port.fd, POLLOUT);
    const bool good = port_tcp.connected(&port, rest, &fault);
    CHECK(!port.connecting);
    if (!good)
        port_tcp.close(&port);
    return good;
}

TEST(addresses)
{
    static const struct {
        const char *rest;
        bool good, named;
        const char *says;
    } row[] = {
        {"192.168.2.5:4001", true, false, ""},
        {"[::1]:4001", true, false, ""},
        {"[fe80::1%lo]:4001", true, false, ""},
        {"moxa:4001", true, true, ""},
        {"moxa-1.vehicle.local:65535", true, true, ""},
        {"192.168.2.5:4001:115200", false, false, "the baud rate is set in the device server"},
        {"moxa:4001:9600", false, false, "the baud rate is set in the device server"},
        {"192.168.2.5:4001:rs485", false, false, "nothing follows the port number"},
        {"192.168.2.5:4001:listen", false, false, "nothing follows the port number"},
        {"192.168.2.5", false, false, "must be a host and a port number"},
        {"192.168.2.5:", false, false, "must be a host and a port number"},
        {"192.168.2.5:0", false, false, "must be a host and a port number"},
        {"192.168.2.5:65536", false, false, "must be a host and a port number"},
        {"192.168.2.5:123456789012345", false, false, "must be a host and a port number"},
        {"192.168.2.5:12x", false, false, "must be a host and a port number"},
        {":4001", false, false, "must be a host and a port number"},
        {"", false, false, "must be a host and a port number"},
        {"::1:4001", false, false, "must be a host and a port number"},
        {"[::1]4001", false, false, "must be a host and a port number"},
        {"[::1", false, false, "must be a host and a port number"},
        {"[moxa]:4001", false, false, "must be a host and a port number"},
        {"mo xa:4001", false, false, "must be a host and a port number"},
        {"/dev/ttyUSB0:115200", false, false, "must be a host and a port number"},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        fault.text[0] = '\0';
        const bool good = port_tcp.check(row[i].rest, &fault);
        if (good != row[i].good || !strstr(fault.text, row[i].says) ||
            port_tcp.named(row[i].rest) != row[i].named) {
            printf("%s: %s\n", row[i].rest, fault.text);
            test_case_failed = true;
        }
    }
    const char *rest;
    CHECK(port_find("tcp:192.168.2.5:4001", &rest, &fault) == &port_tcp);
    CHECK_STR(rest, "192.168.2.5:4001");
}

TEST(bytes_go_both_ways_unchanged)
{
    static const uint8_t line[] = {0xff, 0x00, 0x0d, 0x0a, 0xff, 0xfd, 0x11, 0x13};
    uint16_t number;
    uint8_t b[64];
    const int fd = server(&number, true);
    CHECK(connect_to("127.0.0.1", number));
    const int far = accept(fd, NULL, NULL);
    CHECK_INT(port.ops->read(&port, b, sizeof b), 0);
    CHECK_INT(port.ops->write(&port, line, sizeof line), sizeof line);
    CHECK_INT(recv(far, b, sizeof line, MSG_WAITALL), sizeof line);
    CHECK(memcmp(b, line, sizeof line) == 0);
    CHECK_INT(send(far, line, sizeof line, 0), sizeof line);
    CHECK_INT(read_ready(b, sizeof b), sizeof line);
    CHECK(memcmp(b, line, sizeof line) == 0);
    port.ops->hold_break(&port, true);
    port.ops->hold_break(&port, false);
    CHECK_INT(recv(far, b, sizeof b, MSG_DONTWAIT), -1);
    close(far);
    CHECK_INT(read_ready(b, sizeof b), -1);
    port.ops->close(&port);
    port.ops->close(&port);
    CHECK_INT(port.fd, -1);
    close(fd);
}

/* What finds a far end that went without a word. */
TEST(the_kernel_asks_whether_the_far_end_is_there)
{
    uint16_t number;
    int on = 0, idle = 0, each = 0, tries = 0;
    unsigned confirm_ms = 0;
    socklen_t n = sizeof on;
    const int fd = server(&number, true);
    CHECK(connect_to("127.0.0.1", number));
    getsockopt(port.fd, SOL_SOCKET, SO_KEEPALIVE, &on, &n);
    getsockopt(port.fd, IPPROTO_TCP, TCP_KEEPIDLE, &idle, &n);
    getsockopt(port.fd, IPPROTO_TCP, TCP_KEEPINTVL, &each, &n);
    getsockopt(port.fd, IPPROTO_TCP, TCP_KEEPCNT, &tries, &n);
    getsockopt(port.fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &confirm_ms, &n);
    CHECK(on && idle + each * tries <= 11);
    CHECK_INT(confirm_ms, 10000);
    port.ops->close(&port);
    close(fd);
}

TEST(nobody_there_is_said)
{
    uint16_t number;
    const int fd = server(&number, false);
    CHECK(!connect_to("127.0.0.1", number));
    CHECK(strstr(fault.text, "cannot connect: Connection refused") != NULL);
    CHECK_INT(port.fd, -1);
    close(fd);
}

/* A number that the kernel gives for our own end may be the one we want. */
TEST(a_connection_to_itself_is_none)
{
    struct sockaddr_in a = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t n = sizeof a;
    const int fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    CHECK(bind(fd, (struct sockaddr *)&a, n) == 0 && getsockname(fd, (struct sockaddr *)&a, &n) == 0);
    CHECK_INT(connect(fd, (struct sockaddr *)&a, n), 0); /* with itself */
    port = (struct port){.ops = &port_tcp, .fd = fd, .connecting = true};
    CHECK(!port_tcp.connected(&port, "127.0.0.1:1", &fault));
    CHECK_INT(port.error, ECONNREFUSED);
    port_tcp.close(&port);
}

TEST(a_name_stands_for_addresses_that_are_tried_in_turn)
{
    uint16_t number, other;
    const int fd = server(&number, true), silent = server(&other, false);
    struct port_far far = {0};
    char rest[64];
    snprintf(rest, sizeof rest, "moxa:%u", number);
    port = (struct port){.fd = -1};
    CHECK(!port_tcp.open(&port, rest, &fault)); /* not looked up */
    CHECK(strstr(fault.text, "was not looked up") != NULL);
    CHECK(port_tcp.look_up("127.0.0.1:1", &far, &fault));
    CHECK(far.n >= 1 && far.at[0].ss_family == AF_INET);
    port.far = (struct port_far){.n = 2, .at = {far.at[0], far.at[0]}};
    ((struct sockaddr_in *)&port.far.at[0])->sin_port = htons(other);
    ((struct sockaddr_in *)&port.far.at[1])->sin_port = htons(number);
    CHECK(!connect_to("moxa", number));
    CHECK(connect_to("moxa", number));
    port.ops->close(&port);
    close(fd);
    close(silent);
}

int main(void)
{
    RUN(addresses);
    RUN(bytes_go_both_ways_unchanged);
    RUN(the_kernel_asks_whether_the_far_end_is_there);
    RUN(nobody_there_is_said);
    RUN(a_connection_to_itself_is_none);
    RUN(a_name_stands_for_addresses_that_are_tried_in_turn);
    return test_end();
}
