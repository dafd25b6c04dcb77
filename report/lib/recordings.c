/* SPDX-License-Identifier: MIT */
/* recordings - see recordings.h. */
#include "recordings.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "drivers/devices/ping360.h"
#include "drivers/devices/ping_frame.h"

#define SOUND_MPS 1500.0
#define LEAST     200 /* samples: what comes while settings change has two */

const struct recordings_head recordings_ping360_2m = {AMPLITUDE_SQRT, 0.0, 0.012, 2.0, 0.06, 400};
const struct recordings_head recordings_ping360_60m = {AMPLITUDE_SQRT, 0.0, 0.24, 2.0, 0.113, 400};
const struct recordings_head recordings_micron = {AMPLITUDE_LOG, 80.0 / 255.0, 0.05, 3.0, 0.045, 6400};
const struct recordings_head recordings_tritech_50m = {AMPLITUDE_LOG, 80.0 / 255.0, 0.15, 3.0, 0.078, 6400};
const struct recordings_head recordings_tritech_10m = {AMPLITUDE_LOG, 80.0 / 255.0, 0.05, 3.0, 0.094, 6400};

struct reader {
    recordings_use *use;
    void *ctx;
    struct ping ping;
    struct ping_beam beam;
    uint8_t samples[RECORDINGS_MAX_BINS];
    struct ping_parser parser;
};

static struct reader *reader_make(recordings_use *use, void *ctx)
{
    struct reader *r = calloc(1, sizeof *r);
    if (!r)
        exit(1);
    r->use = use;
    r->ctx = ctx;
    r->ping.max_beams = 1;
    r->ping.max_samples = RECORDINGS_MAX_BINS;
    r->ping.beam = &r->beam;
    r->ping.samples = r->samples;
    r->ping.pose = pose_identity;
    ping_parser_init(&r->parser, PING_PAYLOAD_MAX);
    return r;
}

static void read_line(struct reader *r, const struct recordings_head *head, char *line)
{
    struct ping *p = &r->ping;
    char *at = line;
    const double t_s = strtod(at, &at), bearing_deg = strtod(at + 1, &at), range_m = strtod(at + 1, &at);
    const unsigned long n = strtoul(at + 1, &at, 10);
    p->kind = PING_PROFILE;
    p->law = (uint8_t)head->law;
    p->db_per_count = (float)head->db_per_count;
    p->sample_bytes = 1;
    p->n_beams = 1;
    p->n_bins = n < RECORDINGS_MAX_BINS ? (uint32_t)n : RECORDINGS_MAX_BINS;
    p->dr_m = n > 0 ? (float)(range_m / (double)n) : 0.0f;
    p->pulse_m = (float)head->pulse_m;
    p->az_aperture_rad = (float)geo_rad(head->aperture_deg);
    p->el_aperture_rad = (float)geo_rad(head->aperture_deg * 12.0);
    p->head_turn = head->turn;
    const double turns = geo_wrap(geo_rad(bearing_deg)) / GEO_TURN;
    p->head_units = (uint32_t)lround(turns * head->turn) % head->turn;
    r->beam = (struct ping_beam){.az_rad = (float)geo_wrap(geo_rad(bearing_deg))};
    p->seq++;
    /* some dumps have the number of the ping for its time */
    p->t_ns = (uint64_t)(1e9 * (1.0 + (fabs(t_s - (p->seq - 1.0)) < 1e-6 ? t_s * head->ping_s : t_s)));
    p->t_in_ns = p->t_ns + (uint64_t)(0.9e9 * head->ping_s);
    for (uint32_t i = 0; i < p->n_bins; i++)
        r->samples[i] = (uint8_t)strtoul(at + 1, &at, 10);
    r->use(r->ctx, p, bearing_deg);
}

bool recordings_text(const char *path, const struct recordings_head *head, recordings_use *use, void *ctx)
{
    static char line[1 << 16];
    FILE *file = fopen(path, "r");
    if (!file)
        return false;
    struct reader *r = reader_make(use, ctx);
    while (fgets(line, sizeof line, file))
        if (line[0] >= '0' && line[0] <= '9')
            read_line(r, head, line);
    free(r);
    fclose(file);
    return true;
}

static void take_bytes(struct reader *r, uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    struct ping_frame frame;
    struct ping360_data data;
    while (ping_parser_next(&r->parser, &bytes, &n, t_ns + 1000000000u, &frame)) {
        if (!ping360_decode_data(&frame, &data) || data.n_data < LEAST)
            continue;
        r->ping.seq++;
        ping360_fill_ping(&r->ping, &frame, &data, SOUND_MPS, 115200);
        r->use(r->ctx, &r->ping, geo_deg((double)r->beam.az_rad));
    }
}

/* A length, big-endian, and as many bytes: how many, and at[] behind the length; SIZE_MAX: they are not all there. */
static size_t sized(const uint8_t **at, const uint8_t *end)
{
    const uint8_t *b = *at;
    if (end - b < 4)
        return SIZE_MAX;
    const size_t n = (size_t)b[0] << 24 | (size_t)b[1] << 16 | (size_t)b[2] << 8 | b[3];
    *at += 4;
    return n <= (size_t)(end - *at) ? n : SIZE_MAX;
}

/* "hh:mm:ss.zzz" in UTF-16, whose digits of any script follow one another: all that is asked of a whole log. */
static uint64_t clock_ns(const uint8_t *text, size_t n)
{
    static const uint64_t unit_ms[] = {36000000, 3600000, 0, 600000, 60000, 0, 10000, 1000, 0, 100, 10, 1};
    uint64_t ms = 0;
    for (size_t i = 0; i < sizeof unit_ms / sizeof unit_ms[0] && 2 * i + 1 < n; i++)
        ms += unit_ms[i] * (text[2 * i + 1] & 15u);
    return ms * 1000000u;
}

/* The records of a Ping-Viewer log behind its head: six texts, the version and two numbers. */
static bool read_log(struct reader *r, const uint8_t *at, const uint8_t *end)
{
    for (int i = 0; i < 6; i++) {
        const size_t n = sized(&at, end);
        if (n == SIZE_MAX)
            return false;
        at += n + (i == 0 ? 4 : 0);
    }
    for (at += 8; at < end;) {
        const size_t n = sized(&at, end);
        const uint8_t *text = at;
        if (n == SIZE_MAX)
            return false;
        at += n;
        const size_t n_bytes = sized(&at, end);
        if (n_bytes == SIZE_MAX)
            return false;
        take_bytes(r, clock_ns(text, n), at, n_bytes);
        at += n_bytes;
    }
    return true;
}

bool recordings_ping_viewer(const char *path, recordings_use *use, void *ctx)
{
    FILE *file = fopen(path, "rb");
    if (!file)
        return false;
    fseek(file, 0, SEEK_END);
    const size_t size = (size_t)ftell(file);
    uint8_t *data = malloc(size + 1);
    rewind(file);
    const bool whole = data && fread(data, 1, size, file) == size;
    fclose(file);
    struct reader *r = reader_make(use, ctx);
    const bool read = whole && read_log(r, data, data + size);
    free(r);
    free(data);
    return read;
}
