/* SPDX-License-Identifier: MIT */
#include "nmea.h"

#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>

#include "garbage.h"
#include "input_port.h"
#include "nmea_unused.h"
#include "core/log.h"

/* So long after the last value that was used, what came instead is reported. */
#define UNUSED_NS 5000000000u

#define LATE_READS 4096 /* a terminal has waiting what 17 of them take, a socket a datagram for each */

struct nmea {
    struct conf_nmea conf;
    struct pose_input *input;
    struct input_port line;
    struct nmea_parser parser;
    uint64_t t_ns; /* of the bytes read last */
    struct garbage garbage;
    struct nmea_status status;
    struct nmea_came before; /* when a value was used last */
    uint64_t since_ns;       /* then, or when the port was opened */
    bool unused_told;
};

/* The heading against true north; false: only a magnetic one, and nobody knows the variation. */
static bool true_heading(struct nmea *nmea, const struct nmea_value *value, double *heading_rad)
{
    *heading_rad = value->heading_rad;
    if (value->has == NMEA_TRUE)
        return true;
    if (nmea->conf.variation_rad == CONF_NO_VARIATION) {
        nmea->status.no_variation++;
        return false;
    }
    *heading_rad = geo_wrap(*heading_rad + nmea->conf.variation_rad);
    return true;
}

static struct nmea_came came(const struct nmea *nmea)
{
    return (struct nmea_came){nmea->parser.counts, nmea->status.no_variation, nmea->status.excluded};
}

/* Empty: something was used lately, or nothing came. */
static void unused(const struct nmea *nmea, struct fault *text)
{
    const struct nmea_came now = came(nmea);
    text->text[0] = '\0';
    if (loop_now(nmea->input->loop) - nmea->since_ns >= UNUSED_NS)
        nmea_unused_text(&nmea->before, &now, (enum conf_nmea_use)nmea->conf.use, nmea->parser.other, text);
}

static void tell_unused(struct nmea *nmea)
{
    struct fault text;
    if (nmea->unused_told)
        return;
    unused(nmea, &text);
    nmea->unused_told = text.text[0] != '\0';
    if (nmea->unused_told)
        log_line(LOG_WARNING, "nmea_unused", "nmea: %s: %s", nmea->conf.port, text.text);
}

/* False: it is not used, as the log or the attitudes of a client have it. 0 below is what an echosounder without a
 * bottom sends. */
static bool use(struct nmea *nmea, const struct nmea_value *value, double heading_rad)
{
    if (value->has != NMEA_DEPTH)
        return pose_input_heading(nmea->input, nmea->t_ns, heading_rad);
    if (nmea->conf.use != CONF_NMEA_ALTITUDE)
        return pose_input_depth(nmea->input, nmea->t_ns, value->depth_m);
    return value->below_m > 0 && pose_input_altitude(nmea->input, nmea->t_ns, value->below_m);
}

static bool is_wanted(const struct nmea *nmea, bool depth)
{
    static const struct {
        bool heading, depth;
    } wanted[] = {[CONF_NMEA_HEADING] = {true, false},
                  [CONF_NMEA_DEPTH] = {false, true},
                  [CONF_NMEA_BOTH] = {true, true},
                  [CONF_NMEA_ALTITUDE] = {false, true}};
    return depth ? wanted[nmea->conf.use].depth : wanted[nmea->conf.use].heading;
}

static void take_value(struct nmea *nmea, const struct nmea_value *value)
{
    const bool depth = value->has == NMEA_DEPTH;
    double heading_rad = 0;
    if (value->has == NMEA_NO_DEPTH)
        return;
    if (!is_wanted(nmea, depth)) {
        nmea->status.excluded++;
        return;
    }
    if (!depth && !true_heading(nmea, value, &heading_rad))
        return;
    /* A heading that gives way to the attitudes of a client is as good as used. */
    nmea->since_ns = nmea->t_ns;
    nmea->before = came(nmea);
    nmea->unused_told = false;
    if (use(nmea, value, heading_rad))
        nmea->status.t_value_ns = nmea->t_ns;
}

static void count_garbage(const void *owner, struct garbage_count *now)
{
    const struct nmea *nmea = owner;
    const struct nmea_counts *counts = &nmea->parser.counts;
    *now = (struct garbage_count){
        .bytes = nmea->status.bytes_in, .garbage = counts->garbage_bytes, .messages = counts->sentences};
}

/* When the bytes just read came. False: nobody knows, for they waited while the process was held up. A heading or a
 * depth of no known time is none; the next comes soon. */
static bool arrival(struct nmea *nmea)
{
    const uint64_t now_ns = loop_reread(nmea->input->loop);
    const bool noted = nmea->line.port.t_ns && nmea->line.port.t_ns < now_ns;
    nmea->t_ns = noted ? nmea->line.port.t_ns : now_ns;
    return noted || now_ns - loop_since(nmea->input->loop) <= LOOP_TIMELY_NS;
}

/* All that waits, and not only what one read gives: the loop would call the rest new. */
static void leave_out(struct nmea *nmea, uint8_t *in, size_t size, ssize_t got)
{
    nmea_parser_reset(&nmea->parser);
    nmea->status.late_bytes += (size_t)got;
    for (int i = 0; i < LATE_READS && (got = input_port_read(&nmea->line, in, size)) > 0; i++) {
        nmea->status.bytes_in += (size_t)got;
        nmea->status.late_bytes += (size_t)got;
    }
}

static void on_ready(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct nmea *nmea = ctx;
    uint8_t in[4096];
    struct nmea_value value;
    (void)events;
    (void)now_ns;
    ssize_t got = input_port_read(&nmea->line, in, sizeof in);
    if (got < 0)
        return;
    const uint8_t *bytes = in;
    size_t n = (size_t)got;
    nmea->status.bytes_in += n;
    if (!arrival(nmea)) {
        leave_out(nmea, in, sizeof in, got);
        return;
    }
    while (nmea_parser_next(&nmea->parser, &bytes, &n, &value))
        take_value(nmea, &value);
    if (got > 0) {
        garbage_heard(&nmea->garbage);
        tell_unused(nmea);
    }
}

static void on_opened(void *ctx, uint64_t now_ns, bool again)
{
    struct nmea *nmea = ctx;
    (void)again;
    nmea_parser_reset(&nmea->parser);
    nmea->since_ns = now_ns;
    nmea->before = came(nmea);
}

static void on_closed(void *ctx, uint64_t now_ns)
{
    (void)ctx;
    (void)now_ns;
}

/* What came late is no value, but shows that the line is alive. */
static uint64_t count_messages(const void *ctx)
{
    const struct nmea *nmea = ctx;
    return nmea->parser.counts.sentences + nmea->status.late_bytes;
}

struct nmea *nmea_new(const struct conf_nmea *conf, struct pose_input *input, struct worker *worker,
                      struct fault *fault)
{
    static const struct input_port_events events = {.open = "nmea_open",
                                                    .failed = "nmea_failed",
                                                    .lost = "nmea_failed",
                                                    .dead = "nmea_dead",
                                                    .stranger = "nmea_stranger"};
    struct nmea *nmea = calloc(1, sizeof *nmea);
    if (!nmea) {
        fault_set(fault, "[nmea]: out of memory");
        return NULL;
    }
    nmea->conf = *conf;
    nmea->input = input;
    nmea->line.port.only_listens = true;
    nmea->garbage = (struct garbage){.loop = input->loop,
                                     .whose = "nmea: ",
                                     .port = nmea->conf.port,
                                     .speech = "NMEA 0183",
                                     .count = count_garbage,
                                     .owner = nmea};
    nmea_parser_init(&nmea->parser, conf->checksum == CONF_CHECKSUM_REQUIRED);
    const struct input_port_env line = {.loop = input->loop,
                                        .worker = worker,
                                        .whose = "nmea: ",
                                        .address = nmea->conf.port,
                                        .events = &events,
                                        .ctx = nmea,
                                        .opened = on_opened,
                                        .ready = on_ready,
                                        .closed = on_closed,
                                        .messages = count_messages};
    const bool good = input_port_init(&nmea->line, &line, fault);
    if (good && strcmp(nmea->line.port.ops->encoding, "octet-stream") == 0)
        return nmea;
    if (good)
        fault_set(fault, "[nmea] port = %.200s: wanted a port that carries bytes, as serial, udp or tcp",
                  conf->port);
    nmea_free(nmea);
    return NULL;
}

void nmea_start(struct nmea *nmea)
{
    input_port_start(&nmea->line);
}

void nmea_free(struct nmea *nmea)
{
    if (!nmea)
        return;
    garbage_end(&nmea->garbage);
    input_port_end(&nmea->line);
    free(nmea);
}

void nmea_status(const struct nmea *nmea, struct nmea_status *out)
{
    *out = nmea->status;
    out->counts = nmea->parser.counts;
    unused(nmea, &out->unused);
    out->reconnects = nmea->line.reconnects;
    out->port_error = nmea->line.error;
    out->strangers = nmea->line.port.strangers;
    out->open = input_port_is_open(&nmea->line);
}
