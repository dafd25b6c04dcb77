/* SPDX-License-Identifier: MIT */
#include "candump.h"

#include <stdlib.h>
#include <string.h>

#include "file_bytes.h"

/* ---- one line ---- */

/* What is left of the line. */
struct text {
    const char *p, *end;
};

static bool take_char(struct text *t, char c)
{
    if (t->p == t->end || *t->p != c)
        return false;
    t->p++;
    return true;
}

static int hex_digit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                  : -1;
}

static int take_hex(struct text *t)
{
    int digit = t->p < t->end ? hex_digit(*t->p) : -1;
    if (digit >= 0)
        t->p++;
    return digit;
}

/* At most `most` decimal digits; their number. */
static unsigned take_decimal(struct text *t, unsigned most, uint64_t *value)
{
    unsigned n = 0;
    for (*value = 0; n < most && t->p < t->end && *t->p >= '0' && *t->p <= '9'; n++)
        *value = *value * 10 + (uint64_t)(*t->p++ - '0');
    return n;
}

/* "(seconds.fraction)", six digits of fraction or nine */
static bool take_time(struct text *t, uint64_t *t_ns)
{
    uint64_t seconds, fraction;
    if (!take_char(t, '(') || take_decimal(t, 10, &seconds) == 0 || !take_char(t, '.'))
        return false;
    unsigned digits = take_decimal(t, 9, &fraction);
    if (digits == 0)
        return false;
    for (; digits < 9; digits++)
        fraction *= 10;
    *t_ns = seconds * 1000000000u + fraction;
    return take_char(t, ')');
}

static bool take_name(struct text *t, char name[IFNAMSIZ])
{
    size_t n = 0;
    while (t->p<t->end && * t->p> ' ' && *t->p <= '~' && n < IFNAMSIZ - 1)
        name[n++] = *t->p++;
    name[n] = '\0';
    return n > 0;
}

/* Three digits are a standard identifier, eight an extended one or an error frame. */
static bool take_id(struct text *t, canid_t *id)
{
    unsigned n = 0;
    int digit;
    for (*id = 0; n < 8 && (digit = take_hex(t)) >= 0; n++)
        *id = *id << 4 | (canid_t)digit;
    if (n == 3)
        return *id <= CAN_SFF_MASK;
    if (n != 8 || *id & (CAN_EFF_FLAG | CAN_RTR_FLAG))
        return false;
    if (!(*id & CAN_ERR_FLAG))
        *id |= CAN_EFF_FLAG;
    return true;
}

/* Pairs of digits with or without dots between them, up to anything else. False: half a byte, or more than `most`. */
static bool take_data(struct text *t, struct canfd_frame *frame, unsigned most)
{
    for (int high; (high = take_hex(t)) >= 0; take_char(t, '.')) {
        int low = take_hex(t);
        if (low < 0 || frame->len == most)
            return false;
        frame->data[frame->len++] = (uint8_t)(high << 4 | low);
    }
    return true;
}

static bool is_fd_length(unsigned n)
{
    static const uint8_t lengths[] = {12, 16, 20, 24, 32, 48, 64};
    return n <= CAN_MAX_DLEN || memchr(lengths, (int)n, sizeof lengths);
}

/* What stands behind "ID#": data, 'R' for a remote request, or '#' and the flags of CAN FD. */
static bool take_content(struct text *t, struct candump_frame *out)
{
    struct canfd_frame *frame = &out->frame;
    out->n = CAN_MTU;
    if (take_char(t, '#')) {
        int flags = take_hex(t);
        out->n = CANFD_MTU;
        if (flags < 0 || !take_data(t, frame, CANFD_MAX_DLEN) || !is_fd_length(frame->len))
            return false;
        frame->flags = (uint8_t)(flags & (CANFD_BRS | CANFD_ESI)); /* newer logs add a flag that says "FD" */
        return true;
    }
    if (take_char(t, 'R')) {
        frame->can_id |= CAN_RTR_FLAG;
        int length = take_hex(t);
        return length <= (int)CAN_MAX_DLEN;
    }
    if (!take_data(t, frame, CAN_MAX_DLEN))
        return false;
    return !take_char(t, '_') || take_hex(t) > (int)CAN_MAX_DLEN; /* "_D": the length code on the wire */
}

bool candump_line(const char *text, size_t n, struct candump_frame *out)
{
    struct text t = {text, text + n};
    memset(out, 0, sizeof *out);
    if (!take_time(&t, &out->t_ns) || !take_char(&t, ' ') || !take_name(&t, out->name) || !take_char(&t, ' ') ||
        !take_id(&t, &out->frame.can_id) || !take_char(&t, '#') || !take_content(&t, out))
        return false;
    return t.p == t.end || *t.p == ' ' || *t.p == '\r'; /* a direction may follow */
}

/* ---- a file ---- */

#define LINE_BYTES ((size_t)4096) /* far more than a frame's line has */

struct candump {
    struct file_bytes *file;
    const char *data;
    size_t size, at;
    uint64_t left_out;
    bool differences; /* t_ns of a line is since the one before */
    uint64_t sum_ns;  /* of these */
};

#define JUDGED_LINES 1000u
#define HANDFUL      8u
#define TIME_MAX_NS  ((uint64_t)INT64_MAX)

bool candump_next(struct candump *log, struct candump_frame *out)
{
    while (log->at < log->size) {
        const char *line = log->data + log->at;
        const size_t left = log->size - log->at, most = left < LINE_BYTES ? left : LINE_BYTES;
        file_bytes_need(log->file, log->at, log->at + most);
        file_bytes_drop(log->file, log->at);
        const char *newline = memchr(line, '\n', most);
        size_t n = newline ? (size_t)(newline - line) : most;
        log->at += newline ? n + 1 : n;
        if (candump_line(line, n, out)) {
            if (log->differences && log->sum_ns <= TIME_MAX_NS)
                out->t_ns = log->sum_ns += out->t_ns;
            return true;
        }
        log->left_out += n > 0 && line[0] == '(';
    }
    return false;
}

/* Reads the first lines. */
static bool judge_differences(struct candump *log)
{
    struct candump_frame f;
    uint64_t last_ns = 0;
    unsigned lines = 0, not_rising = 0;
    bool from_zero = false;
    while (lines < JUDGED_LINES && candump_next(log, &f)) {
        if (f.t_ns >= CANDUMP_ABSOLUTE_S * 1000000000u)
            return false;
        from_zero |= lines == 0 && f.t_ns == 0;
        not_rising += lines++ > 0 && f.t_ns <= last_ns;
        last_ns = f.t_ns;
    }
    return (from_zero || lines >= HANDFUL) && 4 * not_rising >= lines;
}

struct candump *candump_open(const char *path, struct fault *fault)
{
    struct candump_frame first;
    struct candump *log = calloc(1, sizeof *log);
    if (!log) {
        fault_set(fault, "out of memory");
        return NULL;
    }
    log->file = file_bytes_open(path, fault);
    if (!log->file) {
        free(log);
        return NULL;
    }
    log->data = (const char *)file_bytes_data(log->file);
    log->size = file_bytes_size(log->file);
    if (!candump_next(log, &first)) {
        fault_set(fault, "%s: no line of it is a frame as candump -L writes them: (seconds.micros) can0 ID#DATA",
                  path);
        candump_close(log);
        return NULL;
    }
    log->at = 0;
    log->differences = judge_differences(log);
    log->at = 0;
    log->left_out = 0;
    return log;
}

bool candump_has_differences(const struct candump *log)
{
    return log->differences;
}

uint64_t candump_left_out(const struct candump *log)
{
    return log->left_out;
}

void candump_close(struct candump *log)
{
    if (!log)
        return;
    file_bytes_close(log->file);
    free(log);
}
