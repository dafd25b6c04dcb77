/* SPDX-License-Identifier: MIT */
/* capture_show - the two commands of the capture tool that read a capture for people: info and export. */
#include "capture.h"

#include <errno.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../drivers/mcap.h"
#include "../drivers/ping_frame.h"
#include "page.h"

#define SOUND_SPEED_MPS     1500.0
#define DEGREES_PER_GRADIAN 0.9
#define TICK_S              25e-9

/* ---- info ---- */

static const char *plural(uint64_t n)
{
    return page_plural((long long)n);
}

static void print_time(uint64_t t_ns)
{
    time_t seconds = (time_t)(t_ns / 1000000000u);
    struct tm utc;
    char text[32];
    if (gmtime_r(&seconds, &utc) && strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc) > 0)
        printf("%s.%03uZ", text, (unsigned)(t_ns / 1000000u % 1000u));
    else
        printf("%" PRIu64 " ns", t_ns);
}

static void print_channels(const struct mcap_reader *r)
{
    const struct mcap_channel *c;
    for (size_t i = 0; (c = mcap_channel_at(r, i)) != NULL; i++) {
        printf("channel ");
        capture_text(stdout, c->topic);
        printf(" (");
        capture_text(stdout, c->encoding);
        printf("): %" PRIu64 " message%s, %" PRIu64 " bytes\n", c->messages, plural(c->messages), c->bytes);
        for (size_t k = 0; k < c->n_metadata; k++) {
            printf("    ");
            capture_text(stdout, c->metadata[k].key);
            printf(" = ");
            capture_text(stdout, c->metadata[k].value);
            printf("\n");
        }
    }
}

static void print_attachments(const struct mcap_reader *r)
{
    struct mcap_attachment a;
    for (uint64_t at = 0; mcap_next_attachment(r, &at, &a);) {
        printf("attachment ");
        capture_text(stdout, a.name);
        printf(" (");
        capture_text(stdout, a.media_type);
        printf("): %zu bytes%s\n", a.size, a.crc_good ? "" : ", DAMAGED");
    }
}

/* True: it is complete, and nothing is damaged. */
static bool print_condition(const struct mcap_info *info)
{
    static const char repair[] = "`sonarctl capture repair` makes it whole";
    const uint64_t faults = info->problems - info->unclosed;
    const bool good = info->problems == 0 && info->complete;
    if (good)
        printf("complete, no damage\n");
    else if (faults == 0 && info->unclosed)
        printf("not closed: still being written, or cut off; bytes at its end that are no whole record: %" PRIu64 "; %s\n",
               info->left_out_bytes, repair);
    else
        printf("damaged: %" PRIu64 " fault%s, %" PRIu64 " bytes left out%s; %s\n", faults, plural(faults),
               info->left_out_bytes, info->complete ? "" : ", no good summary", repair);
    return good;
}

int capture_info(const char *path)
{
    struct mcap_message m;
    struct mcap_reader *r = capture_open(path);
    if (!r)
        return 1;
    while (mcap_next(r, &m)) {
    }
    const struct mcap_info *info = mcap_info(r);
    printf("%s: %" PRIu64 " bytes, profile \"", path, info->file_bytes);
    capture_text(stdout, info->profile);
    printf("\", written by \"");
    capture_text(stdout, info->library);
    printf("\"\n");
    if (info->messages) {
        printf("time ");
        print_time(info->start_ns);
        printf(" to ");
        print_time(info->end_ns);
        printf(", %.3f s\n", (double)(info->end_ns - info->start_ns) * 1e-9);
    }
    print_channels(r);
    print_attachments(r);
    printf("%" PRIu64 " message%s in %" PRIu64 " chunk%s\n", info->messages, plural(info->messages), info->chunks,
           plural(info->chunks));
    const bool good = print_condition(info);
    mcap_close(r);
    return !good;
}

/* ---- export ---- */

struct exporting {
    FILE *out;
    uint64_t start_ns; /* log time of the first message; t_s counts from it */
    bool started;
    const struct mcap_channel *shown; /* whose pings the lines are at the moment */
    struct ping_parser *parser[MCAP_CHANNELS_MAX];
    uint64_t pings[MCAP_CHANNELS_MAX];
};

static bool is_received(const struct mcap_channel *c)
{
    size_t n = strlen(c->topic);
    return n > 3 && strcmp(c->topic + n - 3, "/rx") == 0 && strcmp(c->encoding, "octet-stream") == 0;
}

static double seconds(const struct exporting *ex, uint64_t t_ns)
{
    return (double)(int64_t)(t_ns - ex->start_ns) * 1e-9;
}

static void write_hex(struct exporting *ex, const struct mcap_message *m)
{
    capture_text(ex->out, m->channel->topic);
    fprintf(ex->out, ",%.6f,", seconds(ex, m->log_ns));
    for (size_t i = 0; i < m->size; i++)
        fprintf(ex->out, "%02x", m->data[i]);
    fputc('\n', ex->out);
}

static void write_ping(struct exporting *ex, const struct mcap_channel *channel, const struct ping360_data *d,
                       uint64_t t_ns)
{
    if (ex->shown != channel) {
        fprintf(ex->out, "# pings of ");
        capture_text(ex->out, channel->topic);
        fputc('\n', ex->out);
        ex->shown = channel;
    }
    double range_m = d->n_data * (d->set.sample_period * TICK_S) * SOUND_SPEED_MPS / 2;
    fprintf(ex->out, "%.6f,%.3f,%.4f,%u", seconds(ex, t_ns), d->set.angle * DEGREES_PER_GRADIAN, range_m,
            d->n_data);
    for (unsigned i = 0; i < d->n_data; i++)
        fprintf(ex->out, ",%u", d->data[i]);
    fputc('\n', ex->out);
    ex->pings[channel->index]++;
}

/* False: no memory. */
static bool write_pings(struct exporting *ex, const struct mcap_message *m)
{
    struct ping_parser **parser = &ex->parser[m->channel->index];
    const uint8_t *bytes = m->data;
    size_t n = m->size;
    struct ping_frame frame;
    struct ping360_data data;
    if (!*parser) {
        if (!(*parser = malloc(sizeof **parser)))
            return false;
        ping_parser_init(*parser, PING_PAYLOAD_MAX);
    }
    while (ping_parser_next(*parser, &bytes, &n, m->log_ns, &frame))
        if (ping360_decode_data(&frame, &data))
            write_ping(ex, m->channel, &data, frame.t_last_ns);
    return true;
}

static bool write_all(struct exporting *ex, struct mcap_reader *r)
{
    struct mcap_message m;
    fprintf(ex->out,
            "# t_s,bearing_deg,range_max_m,n,v0..v(n-1): sample i covers i/n..(i+1)/n of range_max_m at %g m/s\n"
            "# or topic,t_s,hex for other messages\n",
            SOUND_SPEED_MPS);
    while (mcap_next(r, &m)) {
        if (!ex->started) {
            ex->start_ns = m.log_ns;
            ex->started = true;
            fprintf(ex->out, "# t_s 0 is log time %" PRIu64 " ns\n", m.log_ns);
        }
        if (!is_received(m.channel))
            write_hex(ex, &m);
        else if (!write_pings(ex, &m))
            return false;
    }
    return true;
}

/* A channel whose bytes are of another device would otherwise vanish without a word. */
static void tell_channels_without_pings(const struct exporting *ex, const struct mcap_reader *r)
{
    const struct mcap_channel *c;
    for (size_t i = 0; (c = mcap_channel_at(r, i)) != NULL; i++) {
        if (ex->pings[i] > 0 || c->bytes == 0 || !is_received(c))
            continue;
        fprintf(stderr, "sonarctl capture: ");
        capture_text(stderr, c->topic);
        fprintf(stderr, ": no Ping360 ping in %" PRIu64 " bytes\n", c->bytes);
    }
}

int capture_export(const char *path, const char *out_path)
{
    static struct exporting ex;
    struct mcap_reader *r = capture_open(path);
    if (!r)
        return 1;
    ex = (struct exporting){.out = out_path ? fopen(out_path, "wxe") : stdout};
    if (!ex.out) {
        fprintf(stderr, "sonarctl capture: %s: %s\n", out_path, strerror(errno));
        mcap_close(r);
        return 1;
    }
    errno = 0;
    bool ok = write_all(&ex, r);
    ok = (out_path ? fclose(ex.out) : fflush(ex.out)) == 0 && ok && !(!out_path && ferror(stdout));
    if (!ok)
        fprintf(stderr, "sonarctl capture: writing %s: %s\n", out_path ? out_path : "the values", strerror(errno));
    tell_channels_without_pings(&ex, r);
    for (size_t i = 0; i < MCAP_CHANNELS_MAX; i++)
        free(ex.parser[i]);
    mcap_close(r);
    return !ok;
}
