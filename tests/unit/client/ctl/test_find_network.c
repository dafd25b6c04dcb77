/* SPDX-License-Identifier: MIT */
/* test_find_network - who answers on the network: heads of this test on the loopback, asked as others are. */
#include "client/ctl/find_network.h"

#include <arpa/inet.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <sys/socket.h>
#include <unistd.h>

#include "drivers/devices/ping_frame.h"
#include "tests/lib/test.h"

/* Answers each datagram, wherever that comes from. */
struct head {
    int fd;
    uint16_t port;
    const char *says;
    size_t n_says;
    char heard[64];
    atomic_bool ends;
    pthread_t thread;
};

static void *answer(void *ctx)
{
    struct head *h = ctx;
    while (!h->ends) {
        struct pollfd ready = {.fd = h->fd, .events = POLLIN};
        struct sockaddr_in from;
        socklen_t size = sizeof from;
        if (poll(&ready, 1, 20) <= 0)
            continue;
        memset(h->heard, 0, sizeof h->heard);
        if (recvfrom(h->fd, h->heard, sizeof h->heard - 1, 0, (struct sockaddr *)&from, &size) >= 0 && h->n_says)
            sendto(h->fd, h->says, h->n_says, 0, (const struct sockaddr *)&from, size);
    }
    return NULL;
}

static void begin(struct head *h, const char *says, size_t n_says)
{
    struct sockaddr_in here = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK)};
    socklen_t size = sizeof here;
    memset(h, 0, sizeof *h);
    h->fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    CHECK(bind(h->fd, (const struct sockaddr *)&here, sizeof here) == 0);
    getsockname(h->fd, (struct sockaddr *)&here, &size);
    h->port = ntohs(here.sin_port);
    h->says = says;
    h->n_says = n_says;
    pthread_create(&h->thread, NULL, answer, h);
}

static void end(struct head *h)
{
    h->ends = true;
    pthread_join(h->thread, NULL);
    close(h->fd);
}

static struct find_target at(const struct head *h, bool discovery)
{
    return (struct find_target){
        .at = {.sin_family = AF_INET, .sin_addr.s_addr = htonl(INADDR_LOOPBACK), .sin_port = htons(h->port)},
        .discovery = discovery};
}

static char found[FIND_SONAR_PORTS][FIND_SONAR_PATH];

/* One that answers the discovery, one that says who it is, one that is silent. */
TEST(all_that_answer_are_found_once)
{
    static const char says[] =
        "SONAR PING360  \r\nBlue Robotics\r\nMAC Address:- 00-04\r\nIP Address:- 192.168.000.111\r\n";
    static const uint8_t who[] = {7, 1, 3, 29, 2, 0};
    uint8_t frame[64];
    const size_t n = ping_frame_build(frame, sizeof frame, PING_DEVICE_INFORMATION, 1, who, sizeof who);
    struct head ping360, surveyor, silent;
    char want[64];
    begin(&ping360, says, sizeof says - 1);
    begin(&surveyor, (const char *)frame, n);
    begin(&silent, "", 0);
    const struct find_target target[] = {at(&ping360, true), at(&surveyor, false), at(&silent, false)};
    size_t got = 0;
    for (int try = 0; try < 50 && got < 2; try++) /* a machine may be busy */
        got = find_network(target, 3, 200, found);
    CHECK_INT(got, 2);
    snprintf(want, sizeof want, "udp:127.0.0.1:%u", surveyor.port);
    const bool first = strcmp(found[0], want) == 0;
    CHECK_STR(found[first ? 0 : 1], want);
    CHECK_STR(found[first ? 1 : 0], "udp:127.0.0.1:12345:12345"); /* from where it came, not what it says */
    end(&ping360);
    end(&surveyor);
    end(&silent);
    CHECK_STR(ping360.heard, "Discovery");
    CHECK(memcmp(surveyor.heard, "BR\x02\0\x06\0", 6) == 0); /* who are you, and nothing else */
}

TEST(what_is_no_sonar_is_not_found)
{
    static const struct {
        const char *says, *want; /* NULL: not found */
    } row[] = {{"SONAR PING360\r\nPort:- 4711\r\n", "udp:127.0.0.1:4711:4711"},
               {"SONAR SURVEYOR 240\r\n", "udp:127.0.0.1:62312"},
               {"SONAR PING360\r\nPort:- 70000\r\n", NULL},
               {"SONAR PING360\r\nPort:- 0\r\n", NULL},
               {"Discovery", NULL},
               {"PRINTER\r\nIP Address:- 10.0.0.1\r\n", NULL}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct head h;
        begin(&h, row[i].says, strlen(row[i].says));
        const struct find_target target = at(&h, true);
        size_t got = 0;
        for (int try = 0; try < (row[i].want ? 50 : 1) && got == 0; try++)
            got = find_network(&target, 1, 50, found);
        CHECK_INT(got, row[i].want ? 1 : 0);
        CHECK_STR(got ? found[0] : "", row[i].want ? row[i].want : "");
        end(&h);
    }
}

TEST(the_usual_places_are_asked)
{
    struct find_target target[FIND_NETWORK_TARGETS];
    const size_t n = find_network_targets(target);
    unsigned surveyors = 0, bridges = 0;
    for (size_t i = 0; i < n; i++) {
        surveyors += !target[i].discovery && ntohs(target[i].at.sin_port) == 62312;
        bridges += !target[i].discovery && ntohs(target[i].at.sin_port) == 9092;
        CHECK(!target[i].discovery || ntohs(target[i].at.sin_port) == 30303);
    }
    CHECK(surveyors == 1 && bridges == 2);
}

int main(void)
{
    RUN(all_that_answer_are_found_once);
    RUN(what_is_no_sonar_is_not_found);
    RUN(the_usual_places_are_asked);
    return test_end();
}
