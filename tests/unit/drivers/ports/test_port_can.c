/* SPDX-License-Identifier: MIT */
/*
 * The CAN ports: addresses, and frames from a local socket in place of the bus. What needs a kernel with CAN is in
 * tests/vm/.
 */
#include <errno.h>
#include <linux/can/error.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "core/fault.h"
#include "drivers/ports/arrival.h"
#include "drivers/ports/can_socket.h"
#include "tests/lib/test.h"

static struct port port;
static int bus; /* the other end */
static struct fault fault;

/* SOCK_SEQPACKET keeps records apart as a CAN socket does. */
static void plug(const struct port_ops *ops)
{
    int ends[2];
    memset(&port, 0, sizeof port);
    CHECK(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends) == 0);
    port.ops = ops;
    port.fd = ends[0];
    bus = ends[1];
    port.bus.state = BUS_UP;
}

static void unplug(void)
{
    port.ops->close(&port);
    CHECK_INT(port.fd, -1);
    port.ops->close(&port);
    close(bus);
}

static void say(canid_t id, const char *bytes, size_t n, size_t record)
{
    struct canfd_frame frame = {.can_id = id, .len = (uint8_t)n};
    memcpy(frame.data, bytes, n);
    CHECK_INT(send(bus, &frame, record, 0), record);
}

static ssize_t hear(void *buf, size_t size)
{
    return port.ops->read(&port, buf, size);
}

TEST(addresses)
{
    static const struct {
        const char *address;
        bool good;
        const char *says;
    } cases[] = {
        {"can:can0", true, NULL},
        {"can:", false, "as can0"},
        {"can:can0:1", false, "as can0"},
        {"can:abcdefghijklmno", true, NULL},
        {"can:abcdefghijklmnop", false, "1 to 15"},
        {"can:a/b", false, "as can0"},
        {"can:a b", false, "as can0"},
        {"isotp:can0:701:702", true, NULL},
        {"isotp:can0:701:702:fd", true, NULL},
        {"isotp:can0:18DA01F1:18daf101", true, NULL},
        {"isotp:can0:701", false, "can0:701:702"},
        {"isotp:can0:701:701", false, "can0:701:702"},
        {"isotp:can0:800:702", false, "hexadecimal"},
        {"isotp:can0:7012:702", false, "hexadecimal"},
        {"isotp:can0:FFFFFFFF:702", false, "hexadecimal"},
        {"isotp:can0:xyz:702", false, "hexadecimal"},
        {"isotp:can0::702", false, "hexadecimal"},
        {"isotp:can0:701:702:", false, ":fd"},
        {"isotp:can0:701:702:fdx", false, ":fd"},
        {"isotp:can0:701:702:pad", true, NULL},
        {"isotp:can0:701:702:fd:pad", true, NULL},
        {"isotp:can0:701:702:pad:fd", false, ":fd, :pad or :fd:pad"},
        {"isotp:can0:701:702:padx", false, ":fd, :pad or :fd:pad"},
        {"canstream:can0:321:322", true, NULL},
        {"canstream:can0:321:322:fd", false, "second identifier"},
        {"canstream:can0", false, "can0:701:702"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char *rest;
        fault.text[0] = '\0';
        bool good = port_find(cases[i].address, &rest, &fault) != NULL;
        if (good != cases[i].good || (!good && !strstr(fault.text, cases[i].says)))
            printf("%s: %s\n", cases[i].address, fault.text);
        CHECK(good == cases[i].good && (good || strstr(fault.text, cases[i].says)));
    }
}

TEST(a_read_is_one_frame)
{
    uint8_t record[256];
    struct canfd_frame f;
    plug(&port_can);
    CHECK_INT(hear(record, sizeof record), 0);
    say(0x123, "abc", 3, CAN_MTU);
    say(0x90041A2A, "0123456789ab", 12, CANFD_MTU);
    CHECK_INT(hear(record, sizeof record), CAN_MTU);
    CHECK(can_frame_read(record, CAN_MTU, &f) && f.can_id == 0x123 && f.len == 3 && memcmp(f.data, "abc", 4) == 0);
    CHECK_INT(hear(record, sizeof record), CANFD_MTU);
    CHECK(can_frame_read(record, CANFD_MTU, &f) && f.len == 12 && f.data[11] == 'b');
    CHECK_INT(hear(record, sizeof record), 0);
    CHECK_INT(hear(record, 71), -1);
    unplug();
}

TEST(records_that_are_no_frames)
{
    uint8_t record[CANFD_MTU] = {0};
    struct canfd_frame f;
    for (size_t n = 0; n <= sizeof record; n++)
        CHECK_INT(can_frame_read(record, n, &f), n == CAN_MTU || n == CANFD_MTU);
    record[4] = 9;
    CHECK(!can_frame_read(record, CAN_MTU, &f));
    CHECK(can_frame_read(record, CANFD_MTU, &f));
    record[4] = 65;
    CHECK(!can_frame_read(record, CANFD_MTU, &f));
}

TEST(error_frames_change_the_state)
{
    static const struct {
        canid_t bits;
        uint8_t controller;
        enum bus_state state;
    } cases[] = {{CAN_ERR_CRTL, CAN_ERR_CRTL_RX_WARNING, BUS_WARNING},
                 {CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE, BUS_PASSIVE},
                 {CAN_ERR_ACK, CAN_ERR_CRTL_ACTIVE, BUS_PASSIVE}, /* the byte means something else there */
                 {CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE, BUS_UP},
                 {CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW, BUS_UP},
                 {CAN_ERR_CRTL | CAN_ERR_CNT, CAN_ERR_CRTL_TX_WARNING, BUS_WARNING}};
    uint8_t record[CANFD_MTU];
    plug(&port_can);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const char bytes[8] = {0, (char)cases[i].controller, 0, 0, 0, 0, 99, 7};
        say(CAN_ERR_FLAG | cases[i].bits, bytes, 8, CAN_MTU);
        CHECK_INT(hear(record, sizeof record), CAN_MTU);
        CHECK_INT(port.bus.state, cases[i].state);
        CHECK_INT(port.bus.error_frames, i + 1);
    }
    CHECK_INT(port.bus.controller_overflows, 1);
    CHECK(port.bus.tx_errors == 99 && port.bus.rx_errors == 7);
    unplug();
}

TEST(bus_off_and_restart_give_the_port_up)
{
    uint8_t record[CANFD_MTU];
    plug(&port_can);
    say(CAN_ERR_FLAG | CAN_ERR_BUSOFF, "\0\0\0\0\0\0\0", 8, CAN_MTU);
    CHECK_INT(hear(record, sizeof record), -1);
    CHECK(port.bus.state == BUS_OFF && port.bus.bus_offs == 1 && port.error == ENETDOWN);
    say(CAN_ERR_FLAG | CAN_ERR_RESTARTED, "\0\0\0\0\0\0\0", 8, CAN_MTU);
    CHECK_INT(hear(record, sizeof record), -1);
    CHECK(port.bus.state == BUS_UP && port.bus.restarts == 1);
    unplug();
}

TEST(the_end_of_the_wire)
{
    uint8_t record[CANFD_MTU];
    plug(&port_can);
    close(bus);
    CHECK_INT(hear(record, sizeof record), -1);
    CHECK_INT(port.error, ENODEV);
    port.ops->close(&port);
}

TEST(stream_takes_the_bytes_out_of_frames)
{
    uint8_t bytes[256];
    plug(&port_canstream);
    say(0x322, "hello, ", 7, CAN_MTU);
    say(0x322, "sea", 3, CAN_MTU);
    say(CAN_ERR_FLAG | CAN_ERR_ACK, "xxxxxxxx", 8, CAN_MTU);
    say(0x40000322, "xx", 2, CAN_MTU); /* a remote request has no data */
    say(0x322, "!", 1, CAN_MTU);
    CHECK(hear(bytes, sizeof bytes) == 7 && memcmp(bytes, "hello, ", 7) == 0);
    CHECK(hear(bytes, sizeof bytes) == 3 && memcmp(bytes, "sea", 3) == 0);
    CHECK(hear(bytes, sizeof bytes) == 1 && bytes[0] == '!');
    CHECK_INT(hear(bytes, sizeof bytes), 0);
    say(0x322, "", 0, CAN_MTU); /* is not the end of what waits */
    say(0x322, "12345678", 8, CAN_MTU);
    CHECK_INT(hear(bytes, sizeof bytes), 8);
    unplug();
}

static uint64_t clock_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

/* However late they are read. */
TEST(frames_of_a_stream_count_from_when_they_came)
{
    uint8_t bytes[64];
    uint64_t said_ns[4];
    plug(&port_canstream);
    CHECK(arrival_ask(&port, port.fd));
    for (int i = 0; i < 3; i++) {
        said_ns[i] = clock_ns();
        say(0x322, "12345678", 8, CAN_MTU);
        said_ns[i + 1] = clock_ns();
        nanosleep(&(struct timespec){.tv_nsec = 2000000}, NULL);
    }
    for (int i = 0; i < 3; i++) {
        CHECK_INT(hear(bytes, sizeof bytes), 8);
        CHECK(port.t_ns + 100000 >= said_ns[i] && port.t_ns <= said_ns[i + 1] + 100000);
    }
    unplug();
}

TEST(stream_gives_what_came_before_the_bus_was_lost)
{
    uint8_t bytes[256];
    plug(&port_canstream);
    say(0x322, "abc", 3, CAN_MTU);
    say(CAN_ERR_FLAG | CAN_ERR_BUSOFF, "", 0, CAN_MTU);
    CHECK_INT(hear(bytes, sizeof bytes), 3);
    CHECK_INT(hear(bytes, sizeof bytes), -1);
    unplug();
}

TEST(stream_writes_frames_of_eight)
{
    struct can_frame f[4];
    plug(&port_canstream);
    port.can_send_id = 0x321;
    CHECK_INT(port.ops->write(&port, "0123456789abcdefXYZ", 19), 19);
    for (int i = 0; i < 3; i++)
        CHECK_INT(recv(bus, &f[i], sizeof f[i], 0), CAN_MTU);
    CHECK(f[0].can_id == 0x321 && f[0].len == 8 && memcmp(f[0].data, "01234567", 8) == 0);
    CHECK(f[2].len == 3 && memcmp(f[2].data, "XYZ", 3) == 0);
    CHECK(recv(bus, &f[3], sizeof f[3], 0) < 0);
    unplug();
}

TEST(stream_stops_where_the_line_is_full)
{
    static uint8_t much[1 << 20];
    plug(&port_canstream);
    ssize_t n = port.ops->write(&port, much, sizeof much);
    CHECK(n > 0 && (size_t)n < sizeof much);
    CHECK_INT(port.ops->write(&port, much, 8), 0);
    unplug();
}

TEST(isotp_message_is_bytes)
{
    static uint8_t much[5000];
    uint8_t bytes[8192];
    plug(&port_isotp);
    CHECK_INT(hear(bytes, sizeof bytes), 0);
    CHECK_INT(send(bus, much, 1224, 0), 1224);
    CHECK_INT(hear(bytes, sizeof bytes), 1224);
    CHECK_INT(port.ops->write(&port, much, sizeof much), 4095);
    CHECK_INT(recv(bus, bytes, sizeof bytes, 0), 4095);
    close(bus);
    CHECK_INT(hear(bytes, sizeof bytes), -1);
    CHECK_INT(port.bus.state, BUS_DOWN);
    port.ops->close(&port);
}

TEST(an_address_that_is_none_is_not_opened)
{
    const struct port_ops *const kinds[] = {&port_can, &port_canstream, &port_isotp};
    for (int i = 0; i < 3; i++) {
        memset(&port, 0, sizeof port);
        CHECK(!kinds[i]->open(&port, "a b", &fault));
        CHECK(port.fd == -1 && port.error == EINVAL);
    }
}

TEST(an_interface_that_is_not_there)
{
    const struct port_ops *const kinds[] = {&port_can, &port_canstream, &port_isotp};
    const char *const rests[] = {"nocan9", "nocan9:1:2", "nocan9:1:2"};
    for (int i = 0; i < 3; i++) {
        memset(&port, 0, sizeof port);
        CHECK(!kinds[i]->open(&port, rests[i], &fault));
        CHECK(port.fd == -1 && port.bus.state == BUS_DOWN && strstr(fault.text, "nocan9"));
        CHECK(port.error == ENODEV || port.error == EAFNOSUPPORT);
    }
    if (port.error == EAFNOSUPPORT)
        printf("skip an_interface_of_another_kind: this kernel has no CAN\n");
    else
        CHECK(!port_can.open(&port, "lo", &fault) && strstr(fault.text, "not a CAN interface"));
}

int main(void)
{
    RUN(addresses);
    RUN(a_read_is_one_frame);
    RUN(records_that_are_no_frames);
    RUN(error_frames_change_the_state);
    RUN(bus_off_and_restart_give_the_port_up);
    RUN(the_end_of_the_wire);
    RUN(stream_takes_the_bytes_out_of_frames);
    RUN(frames_of_a_stream_count_from_when_they_came);
    RUN(stream_gives_what_came_before_the_bus_was_lost);
    RUN(stream_writes_frames_of_eight);
    RUN(stream_stops_where_the_line_is_full);
    RUN(isotp_message_is_bytes);
    RUN(an_address_that_is_none_is_not_opened);
    RUN(an_interface_that_is_not_there);
    return test_end();
}
