/* SPDX-License-Identifier: MIT */
#include "modbus_depth.h"

#include <arpa/inet.h>
#include <errno.h>
#include <math.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <time.h>
#include <unistd.h>

/* Function 8, sub-function 0: the slave sends the question back. */
#define ECHO_FUNCTION   8
#define ECHO_BYTES      8
#define EXCEPTION_BYTES 5
#define FRAME_GAP_BITS  38.5 /* between two frames: 3.5 characters */

#define QUESTION_BYTES   8
#define ANSWER_BYTES_MAX 9
#define HEADER_BYTES     3 /* slave, function, length */

/* Adapters that switch direction make so many bytes of 00 or FF around an answer. */
#define STRAYS_MAX 2
#define HEARD_MAX  (STRAYS_MAX + QUESTION_BYTES + STRAYS_MAX + ANSWER_BYTES_MAX)

/* A line that babbles for so many turn-arounds is closed and opened again. */
#define QUIET_PATIENCE 10

/* So many time-outs in a row on TCP, and the connection is made anew: the peer may have rebooted without a word. */
#define TCP_TIMEOUTS 3

struct address {
    bool tcp;
    char device[MODBUS_SOURCE_MAX]; /* or host */
    char baud[16];                  /* or port */
};

struct modbus_depth {
    struct modbus_depth_conf conf;
    struct address address;
    modbus_t *link;
    bool open, out_of_step;
    int timeouts;         /* in a row */
    uint16_t echo_number; /* of the newest echo that was asked for: no two that may be under way are alike */
    unsigned oddities;    /* since the link was opened */
};

/* ---- addresses ---- */

static bool number_between(const char *text, long least, long most)
{
    size_t digits = strspn(text, "0123456789");
    long n = digits > 0 && digits < 9 && !text[digits] ? strtol(text, NULL, 10) : -1;
    return n >= least && n <= most;
}

static bool is_host(const char *host)
{
    struct in6_addr any;
    return inet_pton(AF_INET, host, &any) == 1 || inet_pton(AF_INET6, host, &any) == 1;
}

static bool parse_tcp(struct address *a, struct fault *fault)
{
    size_t n = strlen(a->device);
    if (n > 2 && a->device[0] == '[' && a->device[n - 1] == ']') {
        memmove(a->device, a->device + 1, n - 2);
        a->device[n - 2] = '\0';
    }
    if (is_host(a->device) && number_between(a->baud, 1, 65535))
        return true;
    return fault_set(
        fault, "'%.64s' and port '%.15s': must be a numeric address and a port, as modbus-tcp:192.168.2.5:502",
        a->device, a->baud);
}

static bool parse(const char *source, struct address *a, struct fault *fault)
{
    const char *rest = strchr(source, ':'), *last = strrchr(source, ':');
    size_t kind = rest ? (size_t)(rest - source) : 0;
    bool rtu = kind == 10 && strncmp(source, "modbus-rtu", kind) == 0;
    a->tcp = kind == 10 && strncmp(source, "modbus-tcp", kind) == 0;
    if (!rtu && !a->tcp)
        return fault_set(fault, "'%.64s': must be modbus-rtu:DEVICE:BAUD or modbus-tcp:ADDRESS:PORT", source);
    size_t n = last > rest ? (size_t)(last - rest - 1) : 0;
    if (n == 0 || n >= sizeof a->device || strlen(last + 1) >= sizeof a->baud)
        return fault_set(fault, "'%.64s': must have two parts behind %.10s, as %s", source, source,
                         a->tcp ? "modbus-tcp:192.168.2.5:502" : "modbus-rtu:/dev/ttyUSB1:9600");
    memcpy(a->device, rest + 1, n);
    a->device[n] = '\0';
    strcpy(a->baud, last + 1);
    if (a->tcp)
        return parse_tcp(a, fault);
    if (a->device[0] == '/' && number_between(a->baud, 300, 4000000))
        return true;
    return fault_set(fault, "'%.64s' at '%.15s': must be a device file and a baud rate, as /dev/ttyUSB1:9600",
                     a->device, a->baud);
}

bool modbus_depth_check(const char *source, struct fault *fault)
{
    struct address a;
    return parse(source, &a, fault);
}

/* ---- numbers ---- */

/* libmodbus has functions for this, which changed their meaning between its releases. */
double modbus_depth_number(enum modbus_type type, bool little, const uint16_t reg[2])
{
    uint32_t bits = (uint32_t)reg[little] << 16 | reg[!little];
    float f;
    switch (type) {
    case MODBUS_INT16:
        return (int16_t)reg[0];
    case MODBUS_UINT16:
        return reg[0];
    case MODBUS_INT32:
        return (int32_t)bits;
    case MODBUS_FLOAT32:
        break;
    }
    memcpy(&f, &bits, sizeof f);
    return (double)f;
}

static int registers(enum modbus_type type)
{
    return type == MODBUS_INT32 || type == MODBUS_FLOAT32 ? 2 : 1;
}

/* ---- the link ---- */

struct modbus_depth *modbus_depth_new(const struct modbus_depth_conf *conf, struct fault *fault)
{
    struct modbus_depth *m = calloc(1, sizeof *m);
    struct timespec now;
    if (!m) {
        fault_set(fault, "out of memory");
        return NULL;
    }
    m->conf = *conf;
    clock_gettime(CLOCK_MONOTONIC, &now);
    m->echo_number = (uint16_t)(now.tv_nsec >> 4); /* not that of a process before this one */
    if (!parse(conf->source, &m->address, fault)) {
        free(m);
        return NULL;
    }
    m->link = m->address.tcp ? modbus_new_tcp_pi(m->address.device, m->address.baud)
                             : modbus_new_rtu(m->address.device, atoi(m->address.baud), conf->parity, 8, 1);
    if (!m->link || modbus_set_slave(m->link, conf->slave) < 0 ||
        modbus_set_response_timeout(m->link, conf->timeout_ms / 1000, conf->timeout_ms % 1000 * 1000) < 0 ||
        modbus_set_byte_timeout(m->link, 0, 0) < 0 || /* the time-out is for the whole answer */
        modbus_set_error_recovery(m->link, MODBUS_ERROR_RECOVERY_NONE) < 0) {
        fault_set(fault, "%s: %s", conf->source, modbus_strerror(errno));
        modbus_depth_free(m);
        return NULL;
    }
    return m;
}

void modbus_depth_disconnect(struct modbus_depth *m)
{
    if (m->open)
        modbus_close(m->link);
    m->open = false;
}

void modbus_depth_free(struct modbus_depth *m)
{
    if (!m)
        return;
    modbus_depth_disconnect(m);
    if (m->link)
        modbus_free(m->link);
    free(m);
}

static bool connect_link(struct modbus_depth *m, struct fault *fault)
{
    m->open = modbus_connect(m->link) == 0;
    int fd = m->open ? modbus_get_socket(m->link) : -1;
    if (!m->open) {
        fault_set(fault, "%s: cannot be opened: %s", m->conf.source, modbus_strerror(errno));
    } else if (!m->address.tcp && flock(fd, LOCK_EX | LOCK_NB) < 0) {
        fault_set(fault, "%s: in use by another process", m->conf.source);
        modbus_depth_disconnect(m);
    } else {
        m->out_of_step = !m->address.tcp; /* somebody may have asked before us */
        m->timeouts = 0;
        m->oddities = 0;
    }
    return m->open;
}

/* Milliseconds that have passed since `start`. */
static uint32_t passed_ms(const struct timespec *start)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (uint32_t)((now.tv_sec - start->tv_sec) * 1000 + (now.tv_nsec - start->tv_nsec) / 1000000);
}

static enum modbus_result lost(struct modbus_depth *m, struct fault *fault)
{
    fault_set(fault, "%s: lost", m->conf.source);
    modbus_depth_disconnect(m);
    return MODBUS_NO_LINK;
}

/* How many of the first bytes are stray, as far as strays are forgiven. */
static size_t strays(const uint8_t *bytes, size_t n)
{
    size_t found = 0;
    while (found < n && found < STRAYS_MAX && (bytes[found] == 0x00 || bytes[found] == 0xff))
        found++;
    return found;
}

/* ---- into step again ---- */

/* Throws away what comes until nothing has come for a turn-around; *heard: did anything but a stray byte? */
static enum modbus_result wait_for_quiet(struct modbus_depth *m, bool *heard, struct fault *fault)
{
    struct pollfd fds[2] = {{.fd = modbus_get_socket(m->link), .events = POLLIN},
                            {.fd = m->conf.stop_fd, .events = POLLIN}};
    struct timespec start;
    size_t forgiven = 0;
    *heard = false;
    clock_gettime(CLOCK_MONOTONIC, &start);
    for (;;) {
        uint8_t waste[512];
        int ready = poll(fds, 2, (int)m->conf.turnaround_ms);
        if (ready == 0)
            return MODBUS_OK;
        if (ready < 0 && errno == EINTR)
            continue;
        if (fds[1].revents)
            return MODBUS_STOPPED;
        ssize_t n = ready < 0 ? -1 : read(fds[0].fd, waste, sizeof waste);
        if (n <= 0)
            return lost(m, fault);
        forgiven += (size_t)n;
        *heard |= strays(waste, (size_t)n) < (size_t)n || forgiven > STRAYS_MAX;
        if (passed_ms(&start) > QUIET_PATIENCE * m->conf.turnaround_ms) {
            fault_set(fault, "%s: the line does not fall quiet", m->conf.source);
            modbus_depth_disconnect(m);
            return MODBUS_OUT_OF_STEP;
        }
    }
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

static void put_crc(uint8_t *frame, size_t n)
{
    uint16_t crc = crc16(frame, n - 2);
    frame[n - 2] = (uint8_t)crc;
    frame[n - 1] = (uint8_t)(crc >> 8);
}

/* What the last ECHO_BYTES heard are: the echo, the slave's refusal, or neither (MODBUS_TIMEOUT, unless more comes). */
static enum modbus_result judge_echo(const uint8_t heard[ECHO_BYTES], const uint8_t question[ECHO_BYTES])
{
    const uint8_t *tail = heard + ECHO_BYTES - EXCEPTION_BYTES;
    if (memcmp(heard, question, ECHO_BYTES) == 0)
        return MODBUS_OK;
    bool refused =
        tail[0] == question[0] && tail[1] == (ECHO_FUNCTION | 0x80) && crc16(tail, EXCEPTION_BYTES) == 0;
    return refused ? MODBUS_EXCEPTION : MODBUS_TIMEOUT;
}

/* Reads until the slave's echo is there, whatever else comes before it. An adapter that echoes puts its own first. */
static enum modbus_result read_echo(struct modbus_depth *m, const uint8_t question[ECHO_BYTES],
                                    struct fault *fault)
{
    struct pollfd fds[2] = {{.fd = modbus_get_socket(m->link), .events = POLLIN},
                            {.fd = m->conf.stop_fd, .events = POLLIN}};
    enum modbus_result result = MODBUS_TIMEOUT;
    uint8_t heard[ECHO_BYTES] = {0};
    bool adapter = m->oddities & MODBUS_QUESTION_ECHOED;
    struct timespec start;
    uint32_t gone_ms;
    clock_gettime(CLOCK_MONOTONIC, &start);
    while (result == MODBUS_TIMEOUT && (gone_ms = passed_ms(&start)) < m->conf.timeout_ms) {
        if (poll(fds, 2, (int)(m->conf.timeout_ms - gone_ms)) <= 0)
            continue;
        if (fds[1].revents)
            return MODBUS_STOPPED;
        memmove(heard, heard + 1, sizeof heard - 1);
        if (read(fds[0].fd, heard + sizeof heard - 1, 1) != 1)
            return lost(m, fault);
        result = judge_echo(heard, question);
        if (result == MODBUS_OK && adapter) {
            adapter = false;
            memset(heard, 0, sizeof heard);
            result = MODBUS_TIMEOUT;
        }
    }
    if (result != MODBUS_OK)
        fault_set(fault, "%s, slave %d: %s", m->conf.source, m->conf.slave,
                  result == MODBUS_EXCEPTION ? "does not know function 8: set resync = silence" : "no echo");
    return result;
}

static void echo_question(const struct modbus_depth *m, uint8_t question[ECHO_BYTES])
{
    const uint8_t start[ECHO_BYTES] = {(uint8_t)m->conf.slave,         ECHO_FUNCTION,          0, 0,
                                       (uint8_t)(m->echo_number >> 8), (uint8_t)m->echo_number};
    memcpy(question, start, ECHO_BYTES);
    put_crc(question, ECHO_BYTES);
}

/*
 * Has the slave send a number back that no question had before. A slave answers in the order in which it was asked:
 * once the number is there, no answer to an older question can follow, however late they are.
 */
static enum modbus_result wait_for_echo(struct modbus_depth *m, struct fault *fault)
{
    uint8_t question[ECHO_BYTES];
    m->echo_number++;
    echo_question(m, question);
    if (write(modbus_get_socket(m->link), question, sizeof question) != sizeof question)
        return lost(m, fault);
    enum modbus_result result = read_echo(m, question, fault);
    m->out_of_step = result != MODBUS_OK;
    if (result == MODBUS_OK)
        poll(NULL, 0, 1 + (int)(1000 * FRAME_GAP_BITS / atoi(m->address.baud)));
    return result;
}

/*
 * Asks once for nothing: the answer is thrown away, and nothing else may follow it. A slave that is later than it may
 * be gives itself away here, or by the time-out of the question after it, as long as its lateness does not vary by more
 * than a time-out.
 */
static enum modbus_result wait_for_trial(struct modbus_depth *m, struct fault *fault)
{
    double thrown_away;
    bool heard = false;
    enum modbus_result result = modbus_depth_read(m, &thrown_away, fault);
    if (result != MODBUS_OK && result != MODBUS_EXCEPTION && result != MODBUS_NO_NUMBER)
        return result;
    result = wait_for_quiet(m, &heard, fault);
    m->out_of_step = result != MODBUS_OK || heard;
    if (result != MODBUS_OK || !heard)
        return result;
    fault_set(fault, "%s, slave %d: answers later than turnaround", m->conf.source, m->conf.slave);
    return MODBUS_OUT_OF_STEP;
}

static enum modbus_result get_into_step(struct modbus_depth *m, struct fault *fault)
{
    bool heard;
    enum modbus_result result = wait_for_quiet(m, &heard, fault);
    if (result != MODBUS_OK)
        return result;
    if (!m->address.tcp)
        return m->conf.echo ? wait_for_echo(m, fault) : wait_for_trial(m, fault);
    m->out_of_step = false; /* its answers say which question they are to */
    return MODBUS_OK;
}

/*
 * Bytes that came since the last answer. A stray one behind it is forgiven. The newest echo once more means that the
 * first was the adapter's and this is the slave's.
 */
static enum modbus_result take_unasked(struct modbus_depth *m, int waiting, struct fault *fault)
{
    uint8_t bytes[ECHO_BYTES + STRAYS_MAX], question[ECHO_BYTES];
    ssize_t n = read(modbus_get_socket(m->link), bytes, sizeof bytes);
    if (n <= 0)
        return lost(m, fault);
    if (n == waiting && strays(bytes, (size_t)n) == (size_t)n) {
        m->oddities |= MODBUS_STRAY_BEHIND;
        return MODBUS_OK;
    }
    m->out_of_step = true;
    echo_question(m, question);
    if (m->conf.echo && n >= ECHO_BYTES && memcmp(bytes, question, ECHO_BYTES) == 0)
        m->oddities |= MODBUS_QUESTION_ECHOED;
    fault_set(fault, "%s: %d bytes came that nobody asked for", m->conf.source, waiting);
    return MODBUS_OUT_OF_STEP;
}

enum modbus_result modbus_depth_prepare(struct modbus_depth *m, struct fault *fault)
{
    int waiting = 0;
    if (!m->open && !connect_link(m, fault))
        return MODBUS_NO_LINK;
    enum modbus_result result = m->out_of_step ? get_into_step(m, fault) : MODBUS_OK;
    if (result != MODBUS_OK)
        return result;
    if (ioctl(modbus_get_socket(m->link), FIONREAD, &waiting) == 0 && waiting > 0) {
        if (!m->address.tcp)
            return take_unasked(m, waiting, fault);
        fault_set(fault, "%s: %d bytes came that nobody asked for", m->conf.source, waiting);
        m->out_of_step = true;
        return MODBUS_OUT_OF_STEP;
    }
    return MODBUS_OK;
}

/* ---- asking ---- */

static enum modbus_result failed(struct modbus_depth *m, int cause, struct fault *fault)
{
    fault_set(fault, "%s, slave %d: %s", m->conf.source, m->conf.slave, modbus_strerror(cause));
    if (cause >= EMBXILFUN && cause <= EMBXGTAR)
        return MODBUS_EXCEPTION; /* an answer like any other: in step */
    m->out_of_step = true;
    if (cause == ETIMEDOUT && (!m->address.tcp || ++m->timeouts < TCP_TIMEOUTS))
        return MODBUS_TIMEOUT;
    if (cause > MODBUS_ENOBASE)
        return MODBUS_BAD_ANSWER;
    modbus_depth_disconnect(m);
    return cause == ETIMEDOUT ? MODBUS_TIMEOUT : MODBUS_NO_LINK;
}

/* What an RTU slave has said since a question; behind `lead` bytes, which are forgiven, the answer begins. */
struct heard {
    uint8_t question[QUESTION_BYTES];
    uint8_t bytes[HEARD_MAX];
    size_t n, lead;
    unsigned oddities; /* of the lead */
};

/* Strays, the question itself where the adapter echoes it, and strays again. */
static void find_answer(struct heard *h)
{
    h->lead = strays(h->bytes, h->n);
    h->oddities = h->lead > 0 ? MODBUS_STRAY_BEFORE : 0;
    if (h->n - h->lead < QUESTION_BYTES || memcmp(h->bytes + h->lead, h->question, QUESTION_BYTES) != 0)
        return;
    h->lead += QUESTION_BYTES;
    size_t more = strays(h->bytes + h->lead, h->n - h->lead);
    h->oddities |= MODBUS_QUESTION_ECHOED | (more > 0 ? MODBUS_STRAY_BEFORE : 0);
    h->lead += more;
}

/*
 * Is it our answer, damaged? It has the answer's length, two of the three bytes of its header and a wrong checksum.
 * Nothing else was under way, so it was the answer, and the next question may follow.
 */
static bool damaged(const uint8_t *a, const uint8_t header[HEADER_BYTES], size_t whole)
{
    int same = 0;
    for (int i = 0; i < HEADER_BYTES; i++)
        same += a[i] == header[i];
    return same >= 2 && crc16(a, whole) != 0;
}

/* MODBUS_TIMEOUT: it may still become an answer. */
static enum modbus_result judge_answer(struct modbus_depth *m, const struct heard *h, struct fault *fault)
{
    const uint8_t *a = h->bytes + h->lead;
    const size_t n = h->n - h->lead, whole = HEADER_BYTES + 2 * (size_t)registers(m->conf.type) + 2;
    const uint8_t header[HEADER_BYTES] = {h->question[0], h->question[1], (uint8_t)(whole - HEADER_BYTES - 2)};
    if (n == EXCEPTION_BYTES && a[0] == header[0] && a[1] == (header[1] | 0x80) && crc16(a, n) == 0)
        return failed(m, MODBUS_ENOBASE + a[2], fault);
    if (n < whole)
        return MODBUS_TIMEOUT;
    if (memcmp(a, header, HEADER_BYTES) == 0 && crc16(a, whole) == 0)
        return MODBUS_OK;
    m->out_of_step = !damaged(a, header, whole);
    fault_set(fault, "%s, slave %d: %s", m->conf.source, m->conf.slave,
              m->out_of_step ? "what came is not its answer" : "an answer with a wrong checksum");
    return MODBUS_BAD_ANSWER;
}

/* Reads one byte at a time, so that what comes behind the answer stays where it is for modbus_depth_prepare. */
static enum modbus_result read_answer(struct modbus_depth *m, struct heard *h, struct fault *fault)
{
    struct pollfd fds[2] = {{.fd = modbus_get_socket(m->link), .events = POLLIN},
                            {.fd = m->conf.stop_fd, .events = POLLIN}};
    enum modbus_result result = MODBUS_TIMEOUT;
    struct timespec start;
    uint32_t gone_ms;
    clock_gettime(CLOCK_MONOTONIC, &start);
    while (result == MODBUS_TIMEOUT && h->n < HEARD_MAX && (gone_ms = passed_ms(&start)) < m->conf.timeout_ms) {
        if (poll(fds, 2, (int)(m->conf.timeout_ms - gone_ms)) <= 0)
            continue;
        if (fds[1].revents)
            return MODBUS_STOPPED;
        if (read(fds[0].fd, h->bytes + h->n, 1) != 1)
            return lost(m, fault);
        h->n++;
        find_answer(h);
        result = judge_answer(m, h, fault);
    }
    return result == MODBUS_TIMEOUT ? failed(m, ETIMEDOUT, fault) : result;
}

static enum modbus_result ask_rtu(struct modbus_depth *m, int n, uint16_t *reg, struct fault *fault)
{
    struct heard h = {.question = {(uint8_t)m->conf.slave, m->conf.input ? 4 : 3, (uint8_t)(m->conf.reg >> 8),
                                   (uint8_t)m->conf.reg, 0, (uint8_t)n}};
    put_crc(h.question, QUESTION_BYTES);
    if (write(modbus_get_socket(m->link), h.question, QUESTION_BYTES) != QUESTION_BYTES)
        return lost(m, fault);
    enum modbus_result result = read_answer(m, &h, fault);
    const unsigned news = h.oddities & ~m->oddities;
    m->oddities |= h.oddities;
    if (m->conf.echo && (news & MODBUS_QUESTION_ECHOED)) {
        m->out_of_step = true; /* the echo that brought us into step was the adapter's */
        fault_set(fault, "%s: the adapter echoes", m->conf.source);
        return MODBUS_OUT_OF_STEP;
    }
    for (int i = 0; result == MODBUS_OK && i < n; i++) {
        const uint8_t *b = h.bytes + h.lead + HEADER_BYTES + 2 * i;
        reg[i] = (uint16_t)(b[0] << 8 | b[1]);
    }
    return result;
}

static enum modbus_result ask_tcp(struct modbus_depth *m, int n, uint16_t *reg, struct fault *fault)
{
    int got = m->conf.input ? modbus_read_input_registers(m->link, m->conf.reg, n, reg)
                            : modbus_read_registers(m->link, m->conf.reg, n, reg);
    return got == n ? MODBUS_OK : failed(m, got < 0 ? errno : EMBBADDATA, fault);
}

enum modbus_result modbus_depth_read(struct modbus_depth *m, double *value, struct fault *fault)
{
    uint16_t reg[2] = {0};
    int n = registers(m->conf.type);
    enum modbus_result result = m->address.tcp ? ask_tcp(m, n, reg, fault) : ask_rtu(m, n, reg, fault);
    if (result != MODBUS_OK)
        return result;
    m->timeouts = 0;
    *value = modbus_depth_number(m->conf.type, m->conf.little, reg);
    if (isfinite(*value))
        return MODBUS_OK;
    fault_set(fault, "%s, slave %d: the slave has no number to give", m->conf.source, m->conf.slave);
    return MODBUS_NO_NUMBER;
}

unsigned modbus_depth_oddities(const struct modbus_depth *m)
{
    return m->oddities;
}
