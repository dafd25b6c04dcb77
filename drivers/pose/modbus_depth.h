/* SPDX-License-Identifier: MIT */
/*
 * modbus_depth - reads one value of one Modbus slave, RTU or TCP, over links of libmodbus. Every call may block for as
 * long as the configuration lets it: it belongs in a thread of its own. Knows no ring, no loop and no clock; what the
 * value means is the caller's matter.
 *
 * An RTU answer carries nothing that tells which question it is to. So whenever an answer was late, broken or not
 * asked for, the next question waits until the line has been quiet for the slave's longest answer time, and then
 * - with `echo`, for a number sent back by function 8, so that no answer is taken for another's however late it is;
 * - without, for an answer that is thrown away and another quiet time. That leaves one hole: a slave that breaks the
 *   promise of turnaround_ms, and answers one question sooner than the one before it.
 */
#ifndef SONARD_MODBUS_DEPTH_H
#define SONARD_MODBUS_DEPTH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/fault.h"

#define MODBUS_SOURCE_MAX 256

enum modbus_type { MODBUS_INT16, MODBUS_UINT16, MODBUS_INT32, MODBUS_FLOAT32 };

struct modbus_depth_conf {
    char source[MODBUS_SOURCE_MAX]; /* modbus-rtu:/dev/ttyUSB1:9600 or modbus-tcp:192.168.2.5:502 */
    char parity;                    /* 'N', 'E' or 'O' */
    int slave;                      /* [0, 247] */
    bool input;                     /* input registers (function 4), else holding registers (3) */
    int reg;                        /* first register, from 0 */
    enum modbus_type type;
    bool little;            /* the register with the low bits comes first */
    uint32_t timeout_ms;    /* for an answer */
    uint32_t turnaround_ms; /* quiet time after which no answer is to come any more */
    bool echo;              /* RTU: the slave knows function 8 */
    int stop_fd;            /* readable: come back from waiting as soon as possible; -1: none */
};

enum modbus_result {
    MODBUS_OK,
    MODBUS_NO_LINK,     /* cannot be opened, or was lost; try later */
    MODBUS_TIMEOUT,     /* no answer, or half of one */
    MODBUS_EXCEPTION,   /* the slave refuses */
    MODBUS_BAD_ANSWER,  /* wrong checksum, wrong slave, another length */
    MODBUS_OUT_OF_STEP, /* the line does not fall quiet, or something came without a question */
    MODBUS_NO_NUMBER,   /* NaN or infinity: the slave's own way to say that it has none */
    MODBUS_STOPPED,     /* stop_fd */
};

/* What an RTU line does beside answering, as bits. */
enum modbus_oddity {
    MODBUS_STRAY_BEFORE = 1, /* up to two bytes of 00 or FF */
    MODBUS_STRAY_BEHIND = 2,
    MODBUS_QUESTION_ECHOED = 4, /* by the adapter */
};

struct modbus_depth;

/** modbus_depth_check - is the source well formed? Opens nothing. False with what would be right in fault. */
bool modbus_depth_check(const char *source, struct fault *fault);

/** modbus_depth_number - one or two registers as a number. */
double modbus_depth_number(enum modbus_type type, bool little, const uint16_t reg[2]);

/** modbus_depth_new - nothing is opened. NULL with a sentence in fault. */
struct modbus_depth *modbus_depth_new(const struct modbus_depth_conf *conf, struct fault *fault);

/**
 * modbus_depth_prepare - open the link where it is closed, get into step where it was out of it. MODBUS_OK:
 * modbus_depth_read may ask now. Otherwise a sentence in fault.
 */
enum modbus_result modbus_depth_prepare(struct modbus_depth *m, struct fault *fault);

/** modbus_depth_read - ask once and wait for the answer. Otherwise than MODBUS_OK a sentence in fault. */
enum modbus_result modbus_depth_read(struct modbus_depth *m, double *value, struct fault *fault);

/** modbus_depth_oddities - bits of enum modbus_oddity that were seen since the link was opened. */
unsigned modbus_depth_oddities(const struct modbus_depth *m);

/** modbus_depth_disconnect - the next modbus_depth_prepare opens the link anew. */
void modbus_depth_disconnect(struct modbus_depth *m);

void modbus_depth_free(struct modbus_depth *m); /* NULL is allowed */

#endif
