/* SPDX-License-Identifier: MIT */
/*
 * echolist_device - a sonar that says, in one line of text per ping, where it looked and which echoes stood above its
 * own threshold. For sonars whose receiver is sampled by a circuit of one's own; docs/devices/echolist.md is written
 * for its builder. See device.h for the rules.
 *
 *   $ECHO,SCAN,TILT,N,T1,A1,...,TN,AN*HH
 *
 * SCAN, TILT: degrees, clockwise and upward, with at most six decimals. N: echoes, 0 to ECHOES_MAX. T: microseconds
 * from transmission to the echo, rising. A: amplitude, 0 to 100 % of full scale. *HH, which may be missing: exclusive
 * or of all characters between $ and *, in hexadecimal. The line ends with LF or CR LF and is sent when the sonar has
 * listened as far as the configured range. Of the configuration it takes range and sound_speed; it asks for nothing.
 */
#include "device.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/fault.h"
#include "drivers/ports/line_time.h"
#include "poller.h"

#define NEVER      UINT64_MAX
#define SECOND     1000000000ull
#define SILENCE_NS (5 * SECOND)

#define ECHOES_MAX   16
#define LINE_BYTES   512 /* the longest good line has 400 */
#define DECIMALS_MAX 6
#define DIGITS_MAX   9
#define SCAN_MAX_DEG 360.0
#define TILT_MAX_DEG 90.0
#define HEAD_TURN    3600u /* for the picture of a turn */

/* The wide cone of a fishery sonar, which such circuits are built for; aperture in the configuration says otherwise. */
#define CONE_DEG 6.5

/* A line that was understood. */
struct report {
    double scan_deg, tilt_deg;
    unsigned n;
    double time_us[ECHOES_MAX];
    double amplitude[ECHOES_MAX]; /* 0..1 */
};

struct echolist {
    struct device_conf conf;
    bool open; /* and not stopped */
    bool silent, answered;
    uint64_t due_ns;
    double scan_deg;   /* of the last ping */
    double turned_deg; /* since the sweep began; its sign is the direction */
    char line[LINE_BYTES];
    size_t n; /* bytes held; 0: between lines */
    uint64_t t_first_ns;
    struct device_status status; /* state: filled in when asked */
};

/* ---- text ---- */

/* "-12.5", nothing else: no exponent, no blank, no name; false when it is no such number. *p is left behind it. */
static bool read_decimal(const char **p, double *out)
{
    const bool negative = **p == '-';
    double value = 0.0, unit = 1.0;
    int digits = 0, decimals = 0;
    *p += negative;
    for (; **p >= '0' && **p <= '9'; (*p)++, digits++)
        value = 10.0 * value + (**p - '0');
    if (digits > 0 && **p == '.')
        for ((*p)++; **p >= '0' && **p <= '9'; (*p)++, decimals++)
            value += (**p - '0') * (unit /= 10.0);
    *out = negative ? -value : value;
    return digits > 0 && digits <= DIGITS_MAX && decimals <= DECIMALS_MAX;
}

/* A comma and a number in lo..hi. */
static bool read_field(const char **p, double lo, double hi, double *out)
{
    if (**p != ',')
        return false;
    (*p)++;
    return read_decimal(p, out) && *out >= lo && *out <= hi;
}

static int hex_digit(char c)
{
    return c >= '0' && c <= '9'   ? c - '0'
           : c >= 'A' && c <= 'F' ? c - 'A' + 10
           : c >= 'a' && c <= 'f' ? c - 'a' + 10
                                  : -1;
}

/* Cuts "*HH" off a line that has it; false when it is wrong. */
static bool take_checksum(char *line)
{
    char *star = strchr(line, '*');
    unsigned sum = 0;
    if (!star)
        return true;
    for (const char *c = line + 1; c < star; c++)
        sum ^= (unsigned char)*c;
    const int high = hex_digit(star[1]), low = high < 0 ? -1 : hex_digit(star[2]);
    *star = '\0';
    return low >= 0 && star[3] == '\0' && (unsigned)(high << 4 | low) == sum;
}

/* What stands behind "$ECHO". */
static bool read_report(const char *p, struct report *r)
{
    double n, percent, last_us = 0.0;
    if (!read_field(&p, -SCAN_MAX_DEG, SCAN_MAX_DEG, &r->scan_deg) ||
        !read_field(&p, -TILT_MAX_DEG, TILT_MAX_DEG, &r->tilt_deg) || !read_field(&p, 0, ECHOES_MAX, &n) ||
        n != floor(n))
        return false;
    r->n = (unsigned)n;
    for (unsigned i = 0; i < r->n; i++) {
        if (!read_field(&p, 0, 1e9, &r->time_us[i]) || !(r->time_us[i] > last_us) ||
            !read_field(&p, 0, 100, &percent))
            return false;
        last_us = r->time_us[i];
        r->amplitude[i] = percent / 100.0;
    }
    return *p == '\0';
}

/* ---- pings ---- */

/* A sweep ends where the head turns back or has gone all the way round. */
static bool new_turn(struct echolist *d, double scan_deg)
{
    const double step = geo_deg(geo_wrap_pi(geo_rad(scan_deg - d->scan_deg)));
    const bool back = step * d->turned_deg < 0.0;
    const bool round = fabs(d->turned_deg + step) >= 360.0 - 1e-6;
    d->scan_deg = scan_deg;
    d->turned_deg = back || round || !d->answered ? 0.0 : d->turned_deg;
    if (d->answered && !round)
        d->turned_deg += step;
    return d->answered && (back || round);
}

/* One entry per echo within the range, or one that says that there was none. */
static void fill_beams(const struct echolist *d, const struct report *r, struct ping *ping)
{
    const struct ping_beam axis = {.az_rad = (float)geo_wrap(geo_rad(r->scan_deg)),
                                   .el_rad = (float)geo_rad(r->tilt_deg)};
    ping->n_beams = 0;
    for (unsigned i = 0; i < r->n && ping->n_beams < ping->max_beams; i++) {
        const double range_m = r->time_us[i] * 1e-6 * d->conf.sound_speed_mps / 2.0;
        if (range_m > d->conf.range_m)
            break;
        struct ping_beam *beam = &ping->beam[ping->n_beams++];
        *beam = axis;
        beam->range_m = (float)range_m;
        /* Anything that passed the circuit's threshold is as likely an echo as not; the louder, the surer. */
        beam->confidence = (float)(0.5 + 0.5 * r->amplitude[i]);
    }
    if (ping->n_beams == 0)
        ping->beam[ping->n_beams++] = axis;
}

static void make_ping(struct echolist *d, const struct report *r, uint64_t now_ns, const struct device_io *io)
{
    const bool turn = new_turn(d, r->scan_deg);
    const double clockwise = geo_deg(geo_wrap(geo_rad(r->scan_deg)));
    d->status.pings++;
    d->status.last_ping_ns = now_ns;
    d->status.range_m = d->conf.range_m;
    struct ping *ping = io->ping_begin(io->ctx);
    if (!ping)
        return;
    ping->t_ns = transmitted_ns(d->t_first_ns, now_ns, d->n, d->conf.baud,
                                (uint64_t)(2e9 * d->conf.range_m / d->conf.sound_speed_mps));
    ping->t_in_ns = now_ns;
    ping->kind = PING_RANGES;
    ping->n_bins = 1;
    ping->dr_m = (float)d->conf.range_m;
    ping->az_aperture_rad = ping->el_aperture_rad = (float)geo_rad(CONE_DEG);
    ping->head_units = (uint32_t)lround(clockwise / 360.0 * HEAD_TURN) % HEAD_TURN;
    ping->head_turn = HEAD_TURN;
    ping->flags = turn ? PING_NEW_TURN : 0;
    fill_beams(d, r, ping);
    io->ping_done(io->ctx, ping);
}

/* ---- lines ---- */

static void forget_line(struct echolist *d)
{
    d->status.garbage_bytes += d->n;
    d->n = 0;
}

static void cut_line(struct echolist *d)
{
    d->status.cut_bytes += d->n;
    d->n = 0;
}

/* Silence from now on will be reported. */
static void watch(struct echolist *d, uint64_t now_ns)
{
    d->due_ns = d->open && !d->conf.listen_only ? now_ns + SILENCE_NS : NEVER;
}

static void on_report(struct echolist *d, const struct report *r, uint64_t now_ns, const struct device_io *io)
{
    make_ping(d, r, now_ns, io);
    if (!d->answered || d->silent)
        io->note(io->ctx, NOTE_INFO, "echo lists come in");
    d->answered = true;
    d->silent = false;
    snprintf(d->status.what, sizeof d->status.what, "echo list");
    watch(d, now_ns);
}

/* A whole line is in d->line, without its end. Other talkers' sentences on the same wire, as of AIS, are passed over:
 * one with a good checksum says that the baud rate is right. The sum of nothing, "$*00", says nothing. */
static void on_line(struct echolist *d, uint64_t now_ns, const struct device_io *io)
{
    static const char name[] = "$ECHO";
    struct report report;
    d->line[d->n] = '\0';
    const bool ours = strncmp(d->line, name, sizeof name - 1) == 0;
    const char *star = strchr(d->line, '*');
    const bool summed = star && star > d->line + 1, good = take_checksum(d->line);
    if (!good || (!ours && !summed)) {
        d->status.bad_checksum += !good;
        forget_line(d);
        return;
    }
    d->status.frames++;
    if (ours && read_report(d->line + sizeof name - 1, &report))
        on_report(d, &report, now_ns, io);
    else
        d->status.bad_frame += ours;
    d->n = 0;
}

static void take_byte(struct echolist *d, char c, uint64_t now_ns, const struct device_io *io)
{
    if (c == '$' || (c == '!' && d->n == 0)) {
        forget_line(d);
        d->t_first_ns = now_ns;
    } else if (d->n == 0) {
        d->status.garbage_bytes += c != '\n' && c != '\r';
        return;
    }
    if (c == '\n' || c == '\r') {
        on_line(d, now_ns, io);
    } else if (c < ' ' || c > '~' || d->n == LINE_BYTES - 1) {
        d->n++; /* this byte, too */
        forget_line(d);
    } else {
        d->line[d->n++] = c;
    }
}

/* ---- the device ---- */

static bool echolist_init(void *state, const struct device_conf *conf, struct fault *fault)
{
    struct echolist *d = state;
    if (!device_conf_check(&device_echolist, conf, fault))
        return false;
    memset(d, 0, sizeof *d);
    d->conf = *conf;
    d->due_ns = NEVER;
    return true;
}

static void echolist_feed(void *state, const uint8_t *bytes, size_t n, uint64_t now_ns, const struct device_io *io)
{
    for (size_t i = 0; i < n; i++)
        take_byte(state, (char)bytes[i], now_ns, io);
}

static void echolist_opened(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct echolist *d = state;
    (void)io;
    cut_line(d);
    d->open = true;
    d->silent = d->answered = false;
    watch(d, now_ns);
}

static void echolist_closed(void *state, uint64_t now_ns)
{
    struct echolist *d = state;
    (void)now_ns;
    cut_line(d);
    d->open = false;
    d->due_ns = NEVER;
}

static void echolist_tick(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct echolist *d = state;
    if (d->due_ns == NEVER || now_ns < d->due_ns)
        return;
    d->status.timeouts++;
    d->silent = true;
    d->due_ns = NEVER;
    io->note(io->ctx, NOTE_WARNING, "no echo list for %llu s (%s); still listening", SILENCE_NS / SECOND,
             poller_advice(&d->conf));
}

static uint64_t echolist_deadline(const void *state)
{
    const struct echolist *d = state;
    return d->due_ns;
}

static void echolist_stop(void *state, uint64_t now_ns, const struct device_io *io)
{
    struct echolist *d = state;
    (void)now_ns;
    (void)io;
    d->open = false;
    d->due_ns = NEVER;
}

static void echolist_status(const void *state, struct device_status *out)
{
    const struct echolist *d = state;
    *out = d->status;
    out->state = !d->open      ? DEVICE_CLOSED
                 : d->silent   ? DEVICE_SILENT
                 : d->answered ? DEVICE_RUNNING
                               : DEVICE_IDENTIFY;
}

static const struct device_key keys[] = {
    {.name = "range", .lo = 0.75, .hi = 200},
    {.name = "delay", .help = "auto: none, a line comes when its ping is over"},
    {.name = NULL},
};

const struct device_ops device_echolist = {
    .name = "echolist",
    .keys = keys,
    .state_size = sizeof(struct echolist),
    .max_beams = ECHOES_MAX,
    .max_bins = 1,
    .round = true,
    .listens = true,
    .init = echolist_init,
    .opened = echolist_opened,
    .closed = echolist_closed,
    .feed = echolist_feed,
    .tick = echolist_tick,
    .deadline = echolist_deadline,
    .stop = echolist_stop,
    .status = echolist_status,
};
