/* SPDX-License-Identifier: MIT */
/*
 * modbus_sim - a virtual Keller pressure transmitter: libmodbus's own server on a pseudo-terminal (RTU) or on loopback
 * (TCP), for tests and for people without one. P1 is at register 2, as float32 in bar, high word first. Faults come
 * as commands on standard input, one per line, each answered by one line on standard output.
 */
#include <errno.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "core/fault.h"
#include "tests/sim/lib/console.h"
#include "tests/sim/lib/line.h"

#define REGISTERS    16
#define P1           2
#define AIR_BAR      1.01325
#define BAR_PER_M    (1025 * 9.80665 * 1e-5)
#define IDLE_POLL_MS 20

enum sim_fault { GOOD, SILENT, EXCEPTION, BAD_CRC, WRONG_SLAVE, GARBAGE, CUT, STRAY, N_FAULTS };

static const char *const fault_names[N_FAULTS] = {"good",        "silent",  "exception", "bad_crc",
                                                  "wrong_slave", "garbage", "cut",       "stray"};

struct sim {
    bool tcp;
    int slave;
    modbus_t *modbus;
    modbus_mapping_t *map;
    struct line line;
    int listener, client; /* TCP */
    enum sim_fault fault;
    long left; /* requests that the fault is still for; -1: all */
    long late_ms;
    double depth_m, lie_m;
    long lies;
    unsigned long requests;
};

static volatile sig_atomic_t stop_wanted;

static void on_stop(int signal)
{
    (void)signal;
    stop_wanted = 1;
}

/* ---- answers ---- */

static void put_float(uint16_t *reg, double value)
{
    float f = (float)value;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    reg[0] = (uint16_t)(bits >> 16);
    reg[1] = (uint16_t)bits;
}

static uint16_t crc16(const uint8_t *p, size_t n)
{
    unsigned c = 0xffff;
    while (n--) {
        c ^= *p++;
        for (int i = 0; i < 8; i++)
            c = c & 1 ? c >> 1 ^ 0xa001 : c >> 1;
    }
    return (uint16_t)c;
}

static void send_raw(const struct sim *s, const uint8_t *bytes, size_t n)
{
    if (write(modbus_get_socket(s->modbus), bytes, n) < 0)
        fprintf(stderr, "modbus_sim: write: %s\n", strerror(errno));
}

/* The right answer in RTU's form, to be spoilt. */
static size_t rtu_answer(const struct sim *s, uint8_t a[16])
{
    const uint16_t *r = s->map->tab_registers + P1;
    const uint8_t head[7] = {(uint8_t)s->slave, 3, 4, (uint8_t)(r[0] >> 8), (uint8_t)r[0], (uint8_t)(r[1] >> 8),
                             (uint8_t)r[1]};
    memcpy(a, head, sizeof head);
    uint16_t crc = crc16(a, sizeof head);
    a[7] = (uint8_t)crc;
    a[8] = (uint8_t)(crc >> 8);
    return 9;
}

static void spoil(struct sim *s, const uint8_t *request, int n)
{
    uint8_t a[16];
    size_t size = rtu_answer(s, a);
    switch (s->fault) {
    case EXCEPTION:
        modbus_reply_exception(s->modbus, request, MODBUS_EXCEPTION_SLAVE_OR_SERVER_FAILURE);
        return;
    case BAD_CRC:
        a[8] ^= 0x55;
        break;
    case WRONG_SLAVE:
        a[0]++;
        a[7] = (uint8_t)crc16(a, 7);
        a[8] = (uint8_t)(crc16(a, 7) >> 8);
        break;
    case GARBAGE:
        send_raw(s, (const uint8_t *)"\xff\x00\x5a", 3);
        break;
    case CUT:
        size = 5;
        break;
    case STRAY: /* the right answer, and once more what nobody asked for */
        modbus_reply(s->modbus, request, n, s->map);
        break;
    default:
        return;
    }
    send_raw(s, a, size);
}

static void serve(struct sim *s, const uint8_t *request, int n)
{
    s->requests++;
    /* What is measured belongs to the time of the question, also when it is told late. */
    put_float(s->map->tab_registers + P1, AIR_BAR + BAR_PER_M * (s->lies > 0 ? s->lie_m : s->depth_m));
    s->lies -= s->lies > 0;
    if (s->late_ms > 0)
        nanosleep(&(struct timespec){s->late_ms / 1000, s->late_ms % 1000 * 1000000}, NULL);
    if (s->left != 0) {
        s->left -= s->left > 0;
        spoil(s, request, n);
    } else {
        modbus_reply(s->modbus, request, n, s->map);
    }
}

/* ---- commands ---- */

static void fault_begin(struct sim *s, enum sim_fault fault, long count)
{
    s->fault = fault;
    s->left = fault == GOOD ? 0 : count;
}

static bool command(void *ctx, const char *text)
{
    struct sim *s = ctx;
    char word[32] = "";
    struct fault fault;
    double a = 0, b = 0;
    int n = sscanf(text, "%31s %lf %lf", word, &a, &b);
    if (n < 1)
        return false;
    for (int f = 0; f < N_FAULTS; f++) {
        if (strcmp(word, fault_names[f]) == 0) {
            fault_begin(s, (enum sim_fault)f, n > 1 ? (long)a : -1);
            return true;
        }
    }
    if (strcmp(word, "depth") == 0 && n == 2)
        s->depth_m = a;
    else if (strcmp(word, "late") == 0 && n == 2)
        s->late_ms = (long)a;
    else if (strcmp(word, "lie") == 0 && n == 3)
        s->lie_m = a, s->lies = (long)b;
    else if (strcmp(word, "unplug") == 0 && !s->tcp)
        line_unplug(&s->line);
    else if (strcmp(word, "plug") == 0 && !s->tcp)
        return line_plug(&s->line, &fault) && modbus_set_socket(s->modbus, s->line.fd) == 0;
    else if (strcmp(word, "hangup") == 0 && s->tcp && s->client >= 0)
        shutdown(s->client, SHUT_RDWR);
    else
        return strcmp(word, "status") == 0 || (stop_wanted = strcmp(word, "quit") == 0);
    return true;
}

static const char *status(void *ctx)
{
    static char text[64];
    const struct sim *s = ctx;
    snprintf(text, sizeof text, "%lu requests", s->requests);
    return text;
}

/* ---- running ---- */

static void drop_client(struct sim *s)
{
    close(s->client);
    s->client = -1;
}

static void run(struct sim *s)
{
    while (!stop_wanted) {
        int wire = s->tcp ? (s->client >= 0 ? s->client : s->listener) : s->line.fd;
        struct pollfd fds[2] = {{STDIN_FILENO, POLLIN, 0}, {wire, POLLIN, 0}};
        uint8_t request[MODBUS_TCP_MAX_ADU_LENGTH];
        if (poll(fds, 2, -1) < 0)
            continue;
        if (fds[0].revents && !console_read(command, status, s))
            return;
        if (!(fds[1].revents & POLLIN)) {
            if (fds[1].revents) /* nobody has the line open */
                poll(NULL, 0, IDLE_POLL_MS);
            continue;
        }
        if (s->tcp && s->client < 0) {
            s->client = modbus_tcp_accept(s->modbus, &s->listener);
            continue;
        }
        int n = modbus_receive(s->modbus, request);
        if (n > 0)
            serve(s, request, n);
        else if (n < 0 && s->tcp)
            drop_client(s);
        else if (n < 0)
            poll(NULL, 0, IDLE_POLL_MS);
    }
}

static bool begin(struct sim *s, const char *where, struct fault *fault)
{
    s->listener = s->client = -1;
    s->map = modbus_mapping_new(0, 0, REGISTERS, REGISTERS);
    if (s->tcp) {
        s->modbus = modbus_new_tcp("127.0.0.1", atoi(where));
        s->listener = s->modbus ? modbus_tcp_listen(s->modbus, 1) : -1;
        fault_set(fault, "port %s: %s", where, modbus_strerror(errno));
        return s->map && s->listener >= 0;
    }
    s->modbus = modbus_new_rtu("/dev/null", 9600, 'N', 8, 1);
    if (!s->map || !s->modbus || !line_init(&s->line, where, 0, 1) || !line_plug(&s->line, fault))
        return false;
    modbus_set_slave(s->modbus, s->slave);
    modbus_set_socket(s->modbus, s->line.fd);
    return true;
}

static const char usage[] =
    "modbus_sim rtu LINK [SLAVE]    a pressure transmitter on a pseudo-terminal named LINK\n"
    "modbus_sim tcp PORT [SLAVE]    the same on 127.0.0.1\n\n"
    "Commands on standard input:\n"
    "  depth M            the water above it (10)\n"
    "  late MS            answers come so late; 0: at once\n"
    "  lie M N            the next N answers tell M metres\n"
    "  silent|exception|bad_crc|wrong_slave|garbage|cut|stray [N]\n"
    "                     for the next N requests, or all; all but silent and exception are of the RTU\n"
    "  good               no more of these\n"
    "  unplug, plug       the adapter (RTU)          hangup   the connection (TCP)\n"
    "  status, quit\n";

int main(int argc, char **argv)
{
    static struct sim s = {.depth_m = 10, .slave = 1};
    struct fault fault = {"out of memory"};
    if (argc < 3 || (strcmp(argv[1], "rtu") != 0 && strcmp(argv[1], "tcp") != 0)) {
        fputs(usage, stderr);
        return 2;
    }
    s.tcp = strcmp(argv[1], "tcp") == 0;
    s.slave = argc > 3 ? atoi(argv[3]) : 1;
    if (!begin(&s, argv[2], &fault)) {
        fprintf(stderr, "modbus_sim: %s\n", fault.text);
        return 1;
    }
    struct sigaction stop = {.sa_handler = on_stop};
    sigaction(SIGTERM, &stop, NULL);
    sigaction(SIGINT, &stop, NULL);
    signal(SIGPIPE, SIG_IGN);
    printf("ready %s\n", argv[2]);
    fflush(stdout);
    run(&s);
    if (s.client >= 0)
        close(s.client);
    if (s.listener >= 0)
        close(s.listener);
    if (!s.tcp)
        line_unplug(&s.line);
    modbus_mapping_free(s.map);
    modbus_free(s.modbus);
    return 0;
}
