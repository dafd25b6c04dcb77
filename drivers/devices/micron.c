/* SPDX-License-Identifier: MIT */
/*
 * micron - see micron.h.
 */
#include "micron.h"

#include <math.h>
#include <string.h>

#include "drivers/ports/line_time.h"

#define CARRIER_HZ   32e6   /* clock of the transmitter's and receiver's synthesisers */
#define MIXER_HZ     455e3  /* between them */
#define SECOND_HZ    850000 /* of the channel that is never used */
#define SPAN         81     /* counts of 80 dB / 255: 25 dB ... */
#define LOW          8      /* ... from 2.5 dB up: the window of 4-bit replies, and of displays */
#define SLOPE        125
#define MOTOR_TIME   25
#define BUFFER_MAX   500
#define LOCKOUT_US   100
#define MINOR_AXIS   1600
#define HEAD_IMAGING 2
#define HEAD_DST     0x11
#define PLAIN        0x01 /* form of the command: ends behind the common part ... */
#define WITH_DST     0x1d /* ... or with the DST's own */
#define COMMON_BYTES 52   /* payload of the plain form */
#define DST_BYTES    16
#define USER_KIND_AT 6 /* in the payload of mtBBUserData */
#define USER_DST     15

/* ---- arithmetic ---- */

double micron_bin_m(unsigned interval, double sound_speed_mps)
{
    return interval * MICRON_TICK_S * sound_speed_mps / 2.0;
}

double micron_pulse_us(double range_m)
{
    return fmin(fmax(round((range_m + 10.0) * 2.5), 50.0), 350.0);
}

void micron_set_range(struct micron_settings *set, double range_m, double sound_speed_mps)
{
    double ticks = 2.0 * range_m / (sound_speed_mps * MICRON_TICK_S);
    unsigned n = MICRON_BINS;
    if (ticks / n < MICRON_INTERVAL_MIN)
        n = (unsigned)(ticks / MICRON_INTERVAL_MIN);
    set->n_bins = (uint16_t)n;
    set->interval = (uint16_t)lround(ticks / n);
    set->pulse_us = (uint16_t)micron_pulse_us(range_m);
    set->range_dm = (uint16_t)lround(10.0 * range_m);
}

/* The azimuth as a bearing, 0 .. 6399. */
static uint16_t bearing_of(double az_rad)
{
    long units = (lround(az_rad * (MICRON_TURN / GEO_TURN)) + MICRON_AHEAD) % MICRON_TURN;
    return (uint16_t)(units < 0 ? units + MICRON_TURN : units);
}

void micron_set_scan(struct micron_settings *set, double start_rad, double end_rad, double step_rad)
{
    long step = lround(step_rad * (MICRON_TURN / GEO_TURN));
    uint16_t left = bearing_of(start_rad), right = bearing_of(end_rad);
    set->step = (uint8_t)(step < 1 ? 1 : step > UINT8_MAX ? UINT8_MAX : step);
    set->control = MICRON_COMMON | MICRON_8_BIT | MICRON_SCAN_RIGHT;
    if (left == right) {
        set->control |= MICRON_CONTINUOUS;
        left = 0;
        right = MICRON_TURN - 1;
    }
    set->left = left;
    set->right = right;
}

uint64_t micron_listening_ns(unsigned interval, unsigned n_bins)
{
    return (uint64_t)interval * n_bins * 640u;
}

int micron_angle_to(unsigned from, unsigned to)
{
    int clockwise = (int)((to + MICRON_TURN - from) % MICRON_TURN);
    return clockwise > MICRON_TURN / 2 ? clockwise - MICRON_TURN : clockwise;
}

/* ---- to the head ---- */

static size_t command(uint8_t *out, size_t size, uint8_t id, const void *payload, size_t length)
{
    return seanet_build(out, size, (struct seanet_head){SEANET_HOST, MICRON_NODE, id, SEANET_LAST_PACKET}, payload,
                        length);
}

size_t micron_encode_short(uint8_t *out, size_t size, uint8_t id)
{
    return command(out, size, id, NULL, 0);
}

size_t micron_encode_send_data(uint8_t *out, size_t size, uint32_t time_ms)
{
    uint8_t payload[4];
    seanet_put_u32(payload, time_ms);
    return command(out, size, SEANET_SEND_DATA, payload, sizeof payload);
}

/* The word that makes a synthesiser run at hz: cut, as the worked frames have it. */
static uint32_t tuning(double hz)
{
    return (uint32_t)(hz / CARRIER_HZ * 4294967296.0);
}

size_t micron_encode_head_command(uint8_t *out, size_t size, const struct micron_settings *set)
{
    uint8_t b[COMMON_BYTES + DST_BYTES] = {0}, *dst = b + COMMON_BYTES;
    b[0] = set->dst ? WITH_DST : PLAIN;
    seanet_put_u16(b + 1, set->control);
    b[3] = set->dst ? HEAD_DST : HEAD_IMAGING;
    seanet_put_u32(b + 4, tuning(set->frequency_hz));
    seanet_put_u32(b + 8, tuning(SECOND_HZ));
    seanet_put_u32(b + 12, tuning(set->frequency_hz + MIXER_HZ));
    seanet_put_u32(b + 16, tuning(SECOND_HZ + MIXER_HZ));
    seanet_put_u16(b + 20, set->pulse_us);
    seanet_put_u16(b + 22, set->range_dm);
    seanet_put_u16(b + 24, set->left);
    seanet_put_u16(b + 26, set->right);
    b[28] = SPAN;
    b[29] = LOW;
    b[30] = b[31] = set->gain;
    seanet_put_u16(b + 32, SLOPE);
    seanet_put_u16(b + 34, SLOPE);
    b[36] = MOTOR_TIME;
    b[37] = set->step;
    seanet_put_u16(b + 38, set->interval);
    seanet_put_u16(b + 40, set->n_bins);
    seanet_put_u16(b + 42, BUFFER_MAX);
    seanet_put_u16(b + 44, LOCKOUT_US);
    seanet_put_u16(b + 46, MINOR_AXIS);
    b[48] = 1; /* major axis */
    dst[0] = dst[1] = SPAN;
    dst[2] = dst[3] = LOW;
    dst[4] = dst[5] = set->gain;
    seanet_put_u16(dst + 8, SLOPE);
    seanet_put_u16(dst + 10, SLOPE);
    return command(out, size, SEANET_HEAD_COMMAND, b, set->dst ? sizeof b : COMMON_BYTES);
}

/* ---- from the head ---- */

bool micron_decode_alive(const struct seanet_frame *f, uint8_t *info)
{
    if (f->id != SEANET_ALIVE || f->length < 8)
        return false;
    *info = f->payload[7];
    return true;
}

bool micron_decode_version(const struct seanet_frame *f, uint8_t *software, uint16_t *serial)
{
    if (f->id != SEANET_VERSION_DATA || f->length < 4)
        return false;
    *software = f->payload[0];
    *serial = seanet_u16(f->payload + 2);
    return true;
}

bool micron_decode_user_data(const struct seanet_frame *f, bool *is_dst)
{
    if (f->id != SEANET_USER_DATA || f->length <= USER_KIND_AT)
        return false;
    *is_dst = f->payload[USER_KIND_AT] == USER_DST;
    return true;
}

static void decode_data_head(const uint8_t *b, struct micron_data_head *out)
{
    *out = (struct micron_data_head){
        .status = b[3],
        .control = seanet_u16(b + 5),
        .gain = b[13],
        .span = b[16],
        .low = b[17],
        .interval = seanet_u16(b + 20),
        .left = seanet_u16(b + 22),
        .right = seanet_u16(b + 24),
        .step = b[26],
        .bearing = seanet_u16(b + 27),
        .n_data = seanet_u16(b + 29),
    };
}

enum micron_join micron_line_add(struct micron_line *line, const struct seanet_frame *f)
{
    size_t skip = 0;
    if (f->packet == 0) {
        line->open = false;
        if (f->length < SEANET_DATA_AT)
            return MICRON_LINE_BROKEN;
        decode_data_head(f->payload, &line->head);
        skip = SEANET_DATA_AT;
        line->n = line->wire_bytes = 0;
        line->t_first_ns = f->t_first_ns;
    } else if (!line->open || f->packet != line->next_packet) {
        line->open = false;
        return MICRON_LINE_BROKEN;
    }
    size_t more = f->length - skip;
    if (line->head.n_data > sizeof line->data || more > line->head.n_data - line->n) {
        line->open = false;
        return MICRON_LINE_BROKEN;
    }
    memcpy(line->data + line->n, f->payload + skip, more);
    line->n += more;
    line->wire_bytes += (size_t)SEANET_OVERHEAD + f->length;
    line->t_last_ns = f->t_last_ns;
    line->next_packet = (uint8_t)(f->packet + 1);
    line->open = !f->last;
    if (line->open)
        return MICRON_LINE_OPEN;
    return line->n == line->head.n_data ? MICRON_LINE_WHOLE : MICRON_LINE_BROKEN;
}

unsigned micron_line_bins(const struct micron_line *line)
{
    const struct micron_data_head *h = &line->head;
    unsigned bins = h->control & MICRON_8_BIT ? h->n_data : 2u * h->n_data;
    return bins > MICRON_BINS_MAX || h->interval == 0 || h->bearing >= MICRON_TURN ? 0 : bins;
}

/*
 * The high nibble is the nearer bin; 1 to 14 are steps of the window above its lower end. 15 is all from the window's
 * top up, where the scale has ended: full scale, so that nobody takes its plateau for a level.
 */
static void unpack_nibbles(uint8_t *out, const struct micron_line *line, uint32_t n)
{
    uint8_t count[16] = {[15] = UINT8_MAX};
    for (unsigned v = 1; v < 15; v++) {
        unsigned level = line->head.low + (line->head.span * v + 7) / 15;
        count[v] = (uint8_t)(level < UINT8_MAX ? level : UINT8_MAX);
    }
    for (uint32_t i = 0; i < n; i++)
        out[i] = count[i & 1 ? line->data[i / 2] & 15 : line->data[i / 2] >> 4];
}

unsigned micron_line_samples(const struct micron_line *line, uint8_t *out, size_t room)
{
    const unsigned bins = micron_line_bins(line);
    const unsigned n = bins < room ? bins : (unsigned)room;
    if (line->head.control & MICRON_8_BIT)
        memcpy(out, line->data, n);
    else
        unpack_nibbles(out, line, n);
    return n;
}

void micron_fill_ping(struct ping *ping, const struct micron_line *line, double sound_speed_mps, unsigned baud)
{
    const struct micron_data_head *h = &line->head;
    unsigned bins = micron_line_bins(line);
    double bin_m = micron_bin_m(h->interval, sound_speed_mps);
    int clockwise = (h->bearing + MICRON_TURN - MICRON_AHEAD) % MICRON_TURN;
    ping->t_ns = transmitted_ns(line->t_first_ns, line->t_last_ns, line->wire_bytes, baud,
                                micron_listening_ns(h->interval, bins));
    ping->t_in_ns = line->t_last_ns;
    ping->kind = PING_PROFILE;
    ping->law = AMPLITUDE_LOG;
    ping->db_per_count = (float)MICRON_DB_PER_COUNT;
    ping->gain = h->gain;
    ping->sample_bytes = 1;
    ping->n_beams = 1;
    ping->n_bins = micron_line_samples(line, ping->samples, ping->max_samples);
    ping->r0_m = 0.0f;
    ping->dr_m = (float)bin_m;
    ping->pulse_m = (float)(sound_speed_mps * micron_pulse_us(bins * bin_m) * 1e-6 / 2.0);
    ping->deaf_m = (float)(sound_speed_mps * LOCKOUT_US * 1e-6 / 2.0);
    ping->az_aperture_rad = (float)geo_rad(MICRON_WIDE_DEG);
    ping->el_aperture_rad = (float)geo_rad(MICRON_HIGH_DEG);
    ping->head_units = h->bearing;
    ping->head_turn = MICRON_TURN;
    ping->beam[0] = (struct ping_beam){.az_rad = (float)(clockwise * GEO_TURN / MICRON_TURN)};
}
