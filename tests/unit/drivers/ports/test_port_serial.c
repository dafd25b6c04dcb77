/* SPDX-License-Identifier: MIT */
/*
 * The serial port against a pseudo-terminal whose other end the test holds. A pseudo-terminal keeps speed and modes
 * but has no break, no parity and no pace.
 */
#include <errno.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include "core/fault.h"
#include "drivers/ports/port.h"
#include "tests/lib/patience.h"
#include "tests/lib/port_rig.h"
#include "tests/lib/test.h"

static int master = -1;
static char slave[64];

static void pty_new(void)
{
    master = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (master < 0 || grantpt(master) < 0 || unlockpt(master) < 0 || ptsname_r(master, slave, sizeof slave) != 0) {
        perror("pty");
        exit(2);
    }
}

static void pty_gone(void)
{
    close(master);
    master = -1;
}

static bool open_at(const char *baud)
{
    char rest[128];
    snprintf(rest, sizeof rest, "%s%s", slave, baud);
    fault.text[0] = '\0';
    return port_serial.open(&port, rest, &fault);
}

TEST(addresses)
{
    static const struct {
        const char *rest;
        bool good;
        const char *says;
    } row[] = {
        {"/dev/ttyUSB0", true, ""},
        {"/dev/ttyUSB0:115200", true, ""},
        {"/dev/ttyUSB0:4000000", true, ""},
        {"/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0", true, ""},
        {"/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0:9600", true, ""},
        {"/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0:9601", false, "9601"},
        {"/dev/ttyUSB0:115200:rs485", true, ""},
        {"/dev/ttyUSB0:rs485", true, ""},
        {"/dev/ttyUSB0:9600:RS485", false, "'RS485'"},
        {"/dev/ttyUSB0:rs485:9600", true, ""}, /* such a file might be */
        {"/dev/ttyUSB0:fast:rs485", false, "'fast'"},
        {":rs485", false, "path"},
        {"/:rs485", false, "path"},
        {"", false, "path"},
        {"/", false, "path"},
        {"/:9600", false, "path"},
        {"ttyUSB0:115200", false, "/dev/ttyUSB0:115200"},
        {"/dev/ttyUSB0:", false, "115200"},
        {"/dev/ttyUSB0:fast", false, "'fast'"},
        {"/dev/ttyUSB0:115201", false, " 230400 "},
        {"/dev/ttyUSB0:-9600", false, "baud"},
        {"/dev/ttyUSB0:9600x", false, "baud"},
        {"/dev/ttyUSB0:0", false, "baud"},
        {"/dev/ttyUSB0:4294976896", false, "baud"}, /* 2^32 + 9600 */
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        fault.text[0] = '\0';
        bool good = port_serial.check(row[i].rest, &fault);
        if (good != row[i].good || !strstr(fault.text, row[i].says)) {
            printf("%s: %d, \"%s\"\n", row[i].rest, good, fault.text);
            CHECK(false);
        }
    }
    char longest[600];
    memset(longest, 'x', sizeof longest);
    longest[0] = '/';
    longest[599] = '\0';
    CHECK(!port_serial.check(longest, &fault));
    CHECK(strstr(fault.text, "longer") != NULL);
}

TEST(baud_rate_of_an_address)
{
    CHECK_INT(port_serial.baud("/dev/ttyUSB0"), 115200);
    CHECK_INT(port_serial.baud("/dev/ttyUSB0:9600"), 9600);
    CHECK_INT(port_serial.baud("/dev/ttyUSB0:9600:rs485"), 9600);
    CHECK_INT(port_serial.baud("/dev/ttyUSB0:rs485"), 115200);
}

TEST(a_port_that_cannot_turn_an_rs485_line)
{
    pty_new();
    CHECK(!open_at(":115200:rs485"));
    CHECK(strstr(fault.text, "no RS-485 direction control") != NULL && strstr(fault.text, slave) != NULL);
    CHECK_INT(port.error, ENOTTY);
    CHECK(open_at(":115200")); /* it was let go of */
    port.ops->close(&port);
    pty_gone();
}

TEST(kinds_of_port)
{
    const char *rest = NULL;
    CHECK(port_find("serial:/dev/ttyS0:9600", &rest, &fault) == &port_serial);
    CHECK_STR(rest, "/dev/ttyS0:9600");
    static const char *const bad[] = {"", ":", "serial", "seri:/dev/x", "serialx:/dev/x", "/dev/ttyS0", ":/dev/x"};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        CHECK(port_find(bad[i], &rest, &fault) == NULL);
        CHECK(strstr(fault.text, "serial") != NULL);
    }
    CHECK(port_find("serial:/dev/ttyS0:1", &rest, &fault) == NULL);
    CHECK(strstr(fault.text, "baud") != NULL);
}

TEST(line_is_raw_at_its_speed)
{
    static const struct {
        const char *baud;
        unsigned want;
        speed_t speed;
    } row[] = {{"", 115200, B115200},           {":4800", 4800, B4800},          {":9600", 9600, B9600},
               {":19200", 19200, B19200},       {":38400", 38400, B38400},       {":57600", 57600, B57600},
               {":115200", 115200, B115200},    {":230400", 230400, B230400},    {":460800", 460800, B460800},
               {":500000", 500000, B500000},    {":576000", 576000, B576000},    {":921600", 921600, B921600},
               {":1000000", 1000000, B1000000}, {":1152000", 1152000, B1152000}, {":1500000", 1500000, B1500000},
               {":2000000", 2000000, B2000000}, {":2500000", 2500000, B2500000}, {":3000000", 3000000, B3000000},
               {":3500000", 3500000, B3500000}, {":4000000", 4000000, B4000000}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct termios t;
        pty_new();
        CHECK(open_at(row[i].baud));
        CHECK_STR(fault.text, "");
        CHECK_INT(port.baud, row[i].want);
        CHECK(tcgetattr(port.fd, &t) == 0);
        CHECK_INT(cfgetospeed(&t), row[i].speed);
        CHECK_INT(t.c_lflag & (ICANON | ECHO | ISIG | IEXTEN), 0);
        CHECK_INT(t.c_iflag & (IXON | ICRNL | INLCR | ISTRIP), 0);
        CHECK_INT(t.c_oflag & OPOST, 0);
        CHECK_INT(t.c_cflag & (CSIZE | PARENB | CSTOPB | CRTSCTS), CS8);
        CHECK(t.c_cflag & CLOCAL);
        CHECK(fcntl(port.fd, F_GETFL) & O_NONBLOCK);
        CHECK(fcntl(port.fd, F_GETFD) & FD_CLOEXEC);
        port.ops->close(&port);
        CHECK_INT(port.fd, -1);
        port.ops->close(&port);
        pty_gone();
    }
}

TEST(all_bytes_pass_both_ways)
{
    uint8_t out[256], in[256];
    pty_new();
    CHECK(open_at(":115200"));
    CHECK_INT(port.ops->read(&port, in, sizeof in), 0);
    for (int i = 0; i < 256; i++)
        out[i] = (uint8_t)i;
    for (size_t at = 0; at < 256; at += 37) { /* in pieces */
        size_t n = 256 - at < 37 ? 256 - at : 37;
        CHECK_INT(write(master, out + at, n), (ssize_t)n);
        for (size_t got = 0; got < n;) {
            ssize_t r = read_ready(in + at + got, n - got);
            if (r <= 0) {
                CHECK(r > 0);
                break;
            }
            got += (size_t)r;
        }
    }
    CHECK(memcmp(in, out, 256) == 0);

    memset(in, 0, sizeof in);
    CHECK_INT(port.ops->write(&port, out, 256), 256);
    for (size_t got = 0; got < 256;) {
        ssize_t r = patience_for(master, POLLIN) ? read(master, in + got, 256 - got) : -1;
        if (r <= 0) {
            CHECK(r > 0);
            break;
        }
        got += (size_t)r;
    }
    CHECK(memcmp(in, out, 256) == 0);
    port.ops->close(&port);
    pty_gone();
}

TEST(full_line_takes_nothing)
{
    static const uint8_t out[4096];
    ssize_t n = 1;
    pty_new();
    CHECK(open_at(""));
    for (int i = 0; i < 1000 && n > 0; i++)
        n = port.ops->write(&port, out, sizeof out);
    CHECK_INT(n, 0);
    port.ops->close(&port);
    pty_gone();
}

TEST(hang_up_is_the_end)
{
    uint8_t b[16];
    pty_new();
    CHECK(open_at(""));
    pty_gone();
    CHECK_INT(read_ready(b, sizeof b), -1);
    CHECK_INT(port.error, ENODEV);
    CHECK_INT(port.ops->write(&port, b, sizeof b), -1);
    CHECK_INT(port.error, EIO);
    CHECK(!open_at("")); /* while it is away */
    CHECK_INT(port.error, ENOENT);
    CHECK(strstr(fault.text, slave) != NULL);
    port.ops->close(&port);
}

TEST(replug)
{
    char link[] = "/tmp/test_port_serial.XXXXXX";
    char rest[128];
    uint8_t b[4];
    CHECK(mkdtemp(link) != NULL);
    snprintf(rest, sizeof rest, "%s/tty", link);
    for (int i = 0; i < 3; i++) {
        pty_new();
        CHECK(symlink(slave, rest) == 0);
        CHECK(port_serial.open(&port, rest, &fault));
        CHECK_INT(write(master, "abc", 3), 3);
        CHECK_INT(read_ready(b, sizeof b), 3);
        pty_gone();
        CHECK_INT(read_ready(b, sizeof b), -1);
        port.ops->close(&port);
        CHECK(unlink(rest) == 0);
    }
    CHECK(rmdir(link) == 0);
}

TEST(what_is_no_serial_port)
{
    static const struct {
        const char *path;
        int error;
        const char *says;
    } row[] = {
        {"/dev/null", ENOTTY, "not a serial port"},
        {"/nowhere/tty", ENOENT, "cannot be opened (not plugged in, or taken by brltty? see devices/serial.md)"},
        {"/tmp", EISDIR, "cannot be opened"}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        CHECK(!port_serial.open(&port, row[i].path, &fault));
        CHECK_INT(port.error, row[i].error);
        CHECK_INT(port.fd, -1);
        CHECK(strstr(fault.text, row[i].path) != NULL && strstr(fault.text, row[i].says) != NULL);
    }
}

TEST(forbidden)
{
    char path[] = "/tmp/port-XXXXXX";
    int fd = mkstemp(path);
    CHECK(fd >= 0 && fchmod(fd, 0) == 0 && close(fd) == 0);
    bool root = geteuid() == 0;
    CHECK(!root || seteuid(65534) == 0); /* whom nothing is allowed by being root */
    CHECK(!port_serial.open(&port, path, &fault));
    CHECK(!root || seteuid(0) == 0);
    CHECK_INT(port.error, EACCES);
    CHECK(strstr(fault.text, path) && strstr(fault.text, "is this user in the port's group"));
    CHECK(unlink(path) == 0);
}

TEST(one_at_a_time)
{
    pty_new();
    int other = open(slave, O_RDWR | O_NOCTTY);
    CHECK(other >= 0 && flock(other, LOCK_EX | LOCK_NB) == 0);
    CHECK(!open_at(""));
    CHECK(strstr(fault.text, "in use by another process (ModemManager?") && strstr(fault.text, strerror(EBUSY)));
    flock(other, LOCK_UN);
    CHECK(open_at(""));
    int exclusive = 1; /* on a pseudo-terminal the mark would outlive a sonard that crashed */
    CHECK(ioctl(port.fd, TIOCGEXCL, &exclusive) == 0 && !exclusive);
    struct port second;
    CHECK(!port_serial.open(&second, slave, &fault));
    CHECK(strstr(fault.text, "in use by another process") != NULL);
    port.ops->close(&port);
    CHECK(open_at(""));
    port.ops->close(&port);
    close(other);
    pty_gone();
}

TEST(old_bytes_are_not_read)
{
    uint8_t b[16];
    pty_new();
    int other = open(slave, O_RDWR | O_NOCTTY);
    CHECK_INT(write(master, "old\n", 4), 4);
    CHECK(open_at(""));
    CHECK_INT(port.ops->read(&port, b, sizeof b), 0);
    port.ops->close(&port);
    close(other);
    pty_gone();
}

TEST(break_is_harmless_where_there_is_none)
{
    uint8_t b[4];
    pty_new();
    CHECK(open_at(""));
    port.ops->hold_break(&port, true);
    port.ops->hold_break(&port, false);
    CHECK_INT(write(master, "abc", 3), 3);
    CHECK_INT(read_ready(b, sizeof b), 3);
    port.ops->close(&port);
    pty_gone();
}

int main(void)
{
    RUN(addresses);
    RUN(baud_rate_of_an_address);
    RUN(a_port_that_cannot_turn_an_rs485_line);
    RUN(kinds_of_port);
    RUN(line_is_raw_at_its_speed);
    RUN(all_bytes_pass_both_ways);
    RUN(full_line_takes_nothing);
    RUN(hang_up_is_the_end);
    RUN(replug);
    RUN(what_is_no_serial_port);
    RUN(forbidden);
    RUN(one_at_a_time);
    RUN(old_bytes_are_not_read);
    RUN(break_is_harmless_where_there_is_none);
    return test_end();
}
