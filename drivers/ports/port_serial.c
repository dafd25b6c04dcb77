/* SPDX-License-Identifier: MIT */
/*
 * port_serial - a serial line through termios: raw, 8N1, no flow control, ours alone. "/dev/ttyUSB0" or
 * "/dev/ttyUSB0:921600"; with ":rs485" at the end, the transmitter is on only while something is sent. Knows nothing
 * of what travels over it.
 */
#include "port.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include "core/fault.h"

#define BAUD_DEFAULT 115200
#define RS485        ":rs485" /* at the end of an address */

static const struct {
    unsigned baud;
    speed_t speed;
} rates[] = {
    {4800, B4800},       {9600, B9600},       {19200, B19200},     {38400, B38400},     {57600, B57600},
    {115200, B115200},   {230400, B230400},   {460800, B460800},   {500000, B500000},   {576000, B576000},
    {921600, B921600},   {1000000, B1000000}, {1152000, B1152000}, {1500000, B1500000}, {2000000, B2000000},
    {2500000, B2500000}, {3000000, B3000000}, {3500000, B3500000}, {4000000, B4000000},
};

#define N_RATES (sizeof rates / sizeof rates[0])

struct address {
    char path[PORT_ADDRESS_MAX];
    unsigned baud;
    speed_t speed;
    bool rs485; /* the port switches the direction of a two-wire line */
};

/* "115200" to its table entry; false with the list of rates in fault. */
static bool parse_baud(const char *text, struct address *a, struct fault *fault)
{
    char list[160] = "";
    size_t digits = strspn(text, "0123456789");
    unsigned long baud = digits > 0 && text[digits] == '\0' ? strtoul(text, NULL, 10) : 0;
    for (size_t i = 0; i < N_RATES; i++) {
        if (rates[i].baud == baud) {
            a->baud = rates[i].baud;
            a->speed = rates[i].speed;
            return true;
        }
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, " %u", rates[i].baud);
    }
    return fault_set(fault, "baud rate '%.32s': must be one of%s", text, list);
}

/* Names below by-path have colons of their own: there, only digits behind the last colon are a rate. */
static const char *baud_text(const char *rest)
{
    const char *colon = strrchr(rest, ':');
    if (!colon)
        return NULL;
    bool number = colon[1] != '\0' && colon[1 + strspn(colon + 1, "0123456789")] == '\0';
    return number || !strstr(rest, "/by-path/") ? colon + 1 : NULL;
}

static bool parse_address(const char *rest, struct address *a, struct fault *fault)
{
    size_t n = strlen(rest);
    a->rs485 = n > strlen(RS485) && strcmp(rest + n - strlen(RS485), RS485) == 0;
    n -= a->rs485 ? strlen(RS485) : 0;
    if (n >= sizeof a->path)
        return fault_set(fault, "serial port '%.32s...': path longer than %zu bytes", rest, sizeof a->path - 1);
    memcpy(a->path, rest, n);
    a->path[n] = '\0';
    const char *baud = baud_text(a->path);
    size_t path_n = baud ? (size_t)(baud - 1 - a->path) : n;
    if (rest[0] != '/' || path_n < 2)
        return fault_set(fault, "serial port '%.64s': must be a path and a baud rate, as /dev/ttyUSB0:115200",
                         rest);
    a->baud = BAUD_DEFAULT;
    a->speed = B115200;
    if (baud && !parse_baud(baud, a, fault))
        return false;
    a->path[path_n] = '\0';
    return true;
}

static bool serial_check(const char *rest, struct fault *fault)
{
    struct address a;
    return parse_address(rest, &a, fault);
}

static unsigned serial_baud(const char *rest)
{
    struct address a;
    struct fault fault;
    return parse_address(rest, &a, &fault) ? a.baud : 0;
}

/* The kernel's majors of the ends that programs open, as Documentation/admin-guide/devices.txt has them. */
static bool is_pseudo_terminal(int fd)
{
    struct stat st;
    return fstat(fd, &st) == 0 && major(st.st_rdev) >= 136 && major(st.st_rdev) <= 143;
}

/* One process per line: two readers would each get half of the bytes. The lock goes with the process. The mark, which
 * keeps out those who know no locks, goes with the last who has the line open, and at a pseudo-terminal that is its
 * other end: after a crash nobody but root could open it again. */
static bool claim(int fd)
{
    if (flock(fd, LOCK_EX | LOCK_NB) == 0)
        return is_pseudo_terminal(fd) || ioctl(fd, TIOCEXCL) == 0;
    if (errno == EWOULDBLOCK)
        errno = EBUSY; /* what it is, to people */
    return false;
}

/* Raw 8N1 at a->speed. tcsetattr is content when any one change was made, so the settings are read back. */
static const char *set_line(int fd, const struct address *a)
{
    struct termios want, got;
    const tcflag_t iflag = IGNBRK | BRKINT | PARMRK | ISTRIP | INLCR | IGNCR | ICRNL | IXON;
    const tcflag_t lflag = ECHO | ECHONL | ICANON | ISIG | IEXTEN;
    const tcflag_t cflag = CSIZE | PARENB | CSTOPB;
    if (tcgetattr(fd, &want) < 0)
        return "not a serial port";
    cfmakeraw(&want);
    want.c_cflag &= ~(tcflag_t)(CSTOPB | CRTSCTS);
    want.c_cflag |= CLOCAL | CREAD;
    /* With VMIN 1 "nothing there" is EAGAIN, and a read of 0 can only mean that the line is gone. */
    want.c_cc[VMIN] = 1;
    want.c_cc[VTIME] = 0;
    if (cfsetspeed(&want, a->speed) < 0 || tcsetattr(fd, TCSANOW, &want) < 0 || tcgetattr(fd, &got) < 0)
        return "cannot be set up";
    if (cfgetospeed(&got) != a->speed || cfgetispeed(&got) != a->speed) {
        errno = EINVAL;
        return "the hardware does not do this baud rate";
    }
    if ((got.c_iflag & iflag) || (got.c_oflag & OPOST) || (got.c_lflag & lflag) || (got.c_cflag & cflag) != CS8) {
        errno = EINVAL;
        return "the driver refuses raw mode with 8 bits, no parity, 1 stop bit";
    }
    return NULL;
}

/* USB adapters hold bytes back for up to 16 ms unless told not to; other drivers refuse, which does no harm. */
static void ask_low_latency(int fd)
{
    struct serial_struct s;
    if (ioctl(fd, TIOCGSERIAL, &s) == 0) {
        s.flags |= (int)ASYNC_LOW_LATENCY;
        ioctl(fd, TIOCSSERIAL, &s);
    }
}

/* Transmitter on only while sending, receiver off meanwhile, by the port's own hardware or driver. */
static const char *set_direction_control(int fd)
{
    struct serial_rs485 rs = {.flags = SER_RS485_ENABLED | SER_RS485_RTS_ON_SEND};
    if (ioctl(fd, TIOCSRS485, &rs) < 0)
        return "has no RS-485 direction control (leave out :rs485 where the adapter turns by itself)";
    if (!(rs.flags & SER_RS485_ENABLED)) {
        errno = EINVAL;
        return "the driver refuses RS-485 direction control";
    }
    return NULL;
}

/* Close, keep the errno that led here, and say it. Always false. */
static bool fail(struct port *port, int fd, const struct address *a, const char *what, struct fault *fault)
{
    port->error = errno;
    if (fd >= 0)
        close(fd);
    return fault_set(fault, "%s at %u baud: %s: %s", a->path, a->baud, what, strerror(port->error));
}

static const char in_use[] = "in use by another process (ModemManager? see devices/serial.md)";

static const char *why_not_opened(int error)
{
    switch (error) {
    case EBUSY:
        return in_use;
    case EACCES:
        return "cannot be opened (is this user in the port's group, often dialout?)";
    case ENOENT:
    case ENODEV:
    case ENXIO:
        return "cannot be opened (not plugged in, or taken by brltty? see devices/serial.md)";
    default:
        return "cannot be opened";
    }
}

static bool serial_open(struct port *port, const char *rest, struct fault *fault)
{
    struct address a;
    port->ops = &port_serial;
    port->fd = -1;
    port->error = EINVAL;
    if (!parse_address(rest, &a, fault))
        return false;

    int fd = open(a.path, O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd < 0)
        return fail(port, fd, &a, why_not_opened(errno), fault);
    if (!isatty(fd))
        return fail(port, fd, &a, "not a serial port", fault);
    if (!claim(fd))
        return fail(port, fd, &a, in_use, fault);
    const char *why = set_line(fd, &a);
    if (!why && a.rs485)
        why = set_direction_control(fd);
    if (why) {
        const int error = errno;
        ioctl(fd, TIOCNXCL); /* as in serial_close */
        errno = error;
        return fail(port, fd, &a, why, fault);
    }
    ask_low_latency(fd);
    tcflush(fd, TCIOFLUSH); /* what came before nobody can date */
    port->fd = fd;
    port->baud = a.baud;
    port->error = 0;
    return true;
}

/* -1 with the cause noted, or 0 when it only was the wrong moment. */
static ssize_t failed(struct port *port)
{
    if (errno == EAGAIN || errno == EINTR)
        return 0;
    port->error = errno;
    return -1;
}

static ssize_t serial_read(struct port *port, void *buf, size_t size)
{
    ssize_t n = read(port->fd, buf, size);
    if (n > 0)
        return n;
    if (n == 0)
        errno = ENODEV; /* hung up: the adapter was pulled */
    return failed(port);
}

static ssize_t serial_write(struct port *port, const void *buf, size_t size)
{
    ssize_t n = write(port->fd, buf, size);
    return n >= 0 ? n : failed(port);
}

/* A pseudo-terminal has no break, and refuses. */
static void serial_hold_break(struct port *port, bool on)
{
    ioctl(port->fd, on ? TIOCSBRK : TIOCCBRK);
}

static void serial_close(struct port *port)
{
    if (port->fd < 0)
        return;
    serial_hold_break(port, false);
    ioctl(port->fd, TIOCNXCL); /* or the mark would stay as long as anybody has the line open */
    close(port->fd);
    port->fd = -1;
}

const struct port_ops port_serial = {
    .kind = "serial",
    .encoding = "octet-stream",
    .check = serial_check,
    .baud = serial_baud,
    .open = serial_open,
    .read = serial_read,
    .write = serial_write,
    .hold_break = serial_hold_break,
    .close = serial_close,
};
