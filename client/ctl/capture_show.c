/* SPDX-License-Identifier: MIT */
/* capture_show - the two commands of the capture tool that read a capture for people: info and export. */
#include "capture.h"
#include "capture_clock.h"
#include "capture_file.h"

#include <errno.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "drivers/capture/mcap.h"
#include "drivers/devices/micron.h"
#include "drivers/devices/ping_frame.h"
#include "drivers/devices/seanet_frame.h"
#include "out_file.h"
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
    static const char repair[] = "`sonarctl capture repair` saves what can be read";
    const uint64_t faults = info->problems - info->unclosed;
    const bool good = info->problems == 0 && info->complete;
    if (good)
        printf("complete, no damage\n");
    else if (faults == 0 && info->unclosed)
        printf("not closed: still being written, or cut off; bytes at its end that are no whole record: %" PRIu64
               "; %s\n",
               info->left_out_bytes, repair);
    else
        printf("damaged: %" PRIu64 " fault%s, %" PRIu64 " bytes left out%s; %s\n", faults, plural(faults),
               info->left_out_bytes, info->complete ? "" : ", no good summary", repair);
    return good;
}

static void print_clock(const struct capture_clock *clock)
{
    int64_t before_ns = clock->before_ns;
    if (before_ns != 0)
        printf("the computer's clock had been set by %+.3f s before\n", (double)before_ns * 1e-9);
    for (size_t i = 0; i < clock->n; before_ns = clock->step[i++].ahead_ns) {
        printf("the computer's clock was set at ");
        print_time(clock->step[i].from_ns);
        printf(" by %+.3f s, to ", (double)(clock->step[i].ahead_ns - before_ns) * 1e-9);
        print_time(clock->step[i].from_ns + (uint64_t)clock->step[i].ahead_ns);
        printf("\n");
    }
}

int capture_info(const char *path)
{
    struct capture_clock clock = {0};
    struct mcap_message m;
    struct mcap_reader *r = capture_open(path);
    if (!r)
        return 1;
    while (mcap_next(r, &m))
        capture_clock_take(&clock, &m);
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
    print_clock(&clock);
    print_channels(r);
    print_attachments(r);
    printf("%" PRIu64 " message%s in %" PRIu64 " chunk%s\n", info->messages, plural(info->messages), info->chunks,
           plural(info->chunks));
    const bool good = print_condition(info);
    mcap_close(r);
    return !good;
}

/* ---- export ---- */

/* What a channel's bytes are looked through for: which device sent them, the capture does not say. */
struct finding {
    struct ping_parser ping360;
    struct seanet_parser seanet;
    struct micron_line line;
    uint64_t pings;
};

/* A ping as a row shows it. */
struct shown_ping {
    uint64_t t_ns;
    double bearing_deg, range_m;
    unsigned n;
    const uint8_t *sample;
};

struct exporting {
    FILE *out;
    uint64_t start_ns; /* log time of the first message; t_s counts from it */
    bool started;
    uint64_t rows;
    const struct mcap_channel *shown; /* whose pings the lines are at the moment */
    struct finding *finding[MCAP_CHANNELS_MAX];
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
    ex->rows++;
}

static void write_ping(struct exporting *ex, const struct mcap_channel *channel, const struct shown_ping *ping)
{
    if (ex->shown != channel) {
        fprintf(ex->out, "# pings of ");
        capture_text(ex->out, channel->topic);
        fputc('\n', ex->out);
        ex->shown = channel;
    }
    fprintf(ex->out, "%.6f,%.3f,%.4f,%u", seconds(ex, ping->t_ns), ping->bearing_deg, ping->range_m, ping->n);
    for (unsigned i = 0; i < ping->n; i++)
        fprintf(ex->out, ",%u", ping->sample[i]);
    fputc('\n', ex->out);
    ex->finding[channel->index]->pings++;
    ex->rows++;
}

static void write_ping360(struct exporting *ex, const struct mcap_channel *channel, const struct ping_frame *frame)
{
    struct ping360_data d;
    if (!ping360_decode_data(frame, &d))
        return;
    write_ping(ex, channel,
               &(struct shown_ping){.t_ns = frame->t_last_ns,
                                    .bearing_deg = d.set.angle * DEGREES_PER_GRADIAN,
                                    .range_m = d.n_data * (d.set.sample_period * TICK_S) * SOUND_SPEED_MPS / 2,
                                    .n = d.n_data,
                                    .sample = d.data});
}

static void write_seanet(struct exporting *ex, const struct mcap_channel *channel, struct micron_line *line,
                         const struct seanet_frame *frame)
{
    uint8_t sample[MICRON_BINS_MAX];
    if (frame->id != SEANET_HEAD_DATA || micron_line_add(line, frame) != MICRON_LINE_WHOLE ||
        micron_line_bins(line) == 0)
        return;
    const unsigned n = micron_line_samples(line, sample, sizeof sample);
    const double ahead = line->head.bearing - MICRON_AHEAD;
    write_ping(ex, channel,
               &(struct shown_ping){.t_ns = frame->t_last_ns,
                                    .bearing_deg = ahead * 360.0 / MICRON_TURN,
                                    .range_m = n * micron_bin_m(line->head.interval, SOUND_SPEED_MPS),
                                    .n = n,
                                    .sample = sample});
}

/* False: no memory. */
static bool write_pings(struct exporting *ex, const struct mcap_message *m)
{
    struct finding **finding = &ex->finding[m->channel->index];
    struct ping_frame frame;
    struct seanet_frame seanet;
    if (!*finding) {
        if (!(*finding = calloc(1, sizeof **finding)))
            return false;
        ping_parser_init(&(*finding)->ping360, PING_PAYLOAD_MAX);
        seanet_parser_init(&(*finding)->seanet);
    }
    const uint8_t *bytes = m->data;
    for (size_t n = m->size; ping_parser_next(&(*finding)->ping360, &bytes, &n, m->log_ns, &frame);)
        write_ping360(ex, m->channel, &frame);
    bytes = m->data;
    for (size_t n = m->size; seanet_parser_next(&(*finding)->seanet, &bytes, &n, m->log_ns, &seanet);)
        write_seanet(ex, m->channel, &(*finding)->line, &seanet);
    return true;
}

static bool write_all(struct exporting *ex, struct mcap_reader *r)
{
    struct mcap_message m;
    fprintf(ex->out,
            "# t_s,bearing_deg,range_max_m,n,v0..v(n-1): sample i covers i/n..(i+1)/n of range_max_m at %g m/s;\n"
            "# a Ping360 counts its bearing from its own zero, a SeaNet head from ahead\n"
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

/* A channel whose bytes are of another device would otherwise vanish without a word. False: there is one. */
static bool all_shown(const struct exporting *ex, const struct mcap_reader *r)
{
    const struct mcap_channel *c;
    bool shown = true;
    for (size_t i = 0; (c = mcap_channel_at(r, i)) != NULL; i++) {
        if ((ex->finding[i] && ex->finding[i]->pings > 0) || c->bytes == 0 || !is_received(c))
            continue;
        fprintf(stderr, "sonarctl capture: ");
        capture_text(stderr, c->topic);
        fprintf(stderr, ": no ping of a Ping360 or a SeaNet head in %" PRIu64 " bytes\n", c->bytes);
        shown = false;
    }
    return shown;
}

/* All of the capture to a file, or to standard output. False with a message. */
static bool write_out(struct exporting *ex, struct mcap_reader *r, const char *out_path)
{
    errno = 0;
    bool ok = write_all(ex, r);
    ok = (out_path ? fclose(ex->out) : fflush(ex->out)) == 0 && ok && !(!out_path && ferror(stdout));
    if (!ok)
        capture_failed("writing %s: %s", out_path ? out_path : "the values", strerror(errno));
    if (!all_shown(ex, r) && ok && ex->rows == 0)
        ok = capture_failed(
                 "nothing exported: of received bytes only the pings of a Ping360 or a SeaNet head are") == 0;
    return ok;
}

static bool finish_out(const char *out_path, bool ok)
{
    struct fault fault;
    if (!out_path)
        return ok;
    if (ok)
        return out_file_keep(out_path, false, &fault) || capture_failed("%s", fault.text) == 0;
    out_file_drop(out_path);
    return false;
}

static FILE *open_out(const char *out_path)
{
    struct fault fault;
    const int fd = out_path ? out_file_create(out_path, false, &fault) : -1;
    if (out_path && fd < 0)
        capture_failed("%s", fault.text);
    return !out_path ? stdout : fd >= 0 ? fdopen(fd, "w") : NULL;
}

int capture_export(const char *path, const char *out_path)
{
    static struct exporting ex;
    struct mcap_reader *r = capture_open(path);
    int status = 1;
    if (!r)
        return 1;
    ex = (struct exporting){.out = open_out(out_path)};
    if (ex.out && finish_out(out_path, write_out(&ex, r, out_path)))
        status = capture_tell_exported(path, mcap_info(r));
    for (size_t i = 0; i < MCAP_CHANNELS_MAX; i++)
        free(ex.finding[i]);
    mcap_close(r);
    return status;
}
