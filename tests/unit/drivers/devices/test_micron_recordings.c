/* SPDX-License-Identifier: MIT */
/*
 * Real recordings of SeaNet heads (not part of the repository) through framing, device and extraction: every line that
 * an independent decoder listed is found with the same bearing and the same samples, and nothing else.
 */
#include <unistd.h>

#include "core/fault.h"
#include "drivers/devices/device.h"
#include "drivers/devices/micron.h"
#include "grid/range/extract.h"
#include "tests/lib/test.h"

#define DATA   "../shared/data/"
#define SEABED DATA "tritech-seanet-rov-seabed/sonar.part1"
#define TARGET DATA "tritech-v4log-target/target-first-234"
#define TANK   DATA "micron-tank-rosbag/static_sonar.csv"
#define QUAY   DATA "micron-quay-rosbag/2014-07-18-"

#define MAX_LINES 4000

static uint8_t *load(const char *path, size_t *n)
{
    FILE *f = fopen(path, "rb");
    if (!f || fseek(f, 0, SEEK_END) != 0)
        abort();
    long size = ftell(f);
    rewind(f);
    uint8_t *b = malloc((size_t)size + 1);
    if (!b || fread(b, 1, (size_t)size, f) != (size_t)size)
        abort();
    fclose(f);
    *n = (size_t)size;
    return b;
}

/* One line of the neutral form: t_s,bearing_deg,range_m,n,samples. */
struct row {
    double bearing_deg, range_m;
    unsigned n;
    uint8_t sample[MICRON_BINS_MAX];
};

static struct row rows[MAX_LINES];

static unsigned load_rows(const char *path)
{
    static char text[1 << 16];
    unsigned count = 0;
    FILE *f = fopen(path, "r");
    if (!f)
        abort();
    while (count < MAX_LINES && fgets(text, sizeof text, f)) {
        char *at = text;
        struct row *r = &rows[count];
        if (text[0] == '#')
            continue;
        strtod(at, &at);
        r->bearing_deg = strtod(at + 1, &at);
        r->range_m = strtod(at + 1, &at);
        r->n = (unsigned)strtoul(at + 1, &at, 10);
        if (r->n > MICRON_BINS_MAX)
            abort();
        for (unsigned i = 0; i < r->n; i++)
            r->sample[i] = (uint8_t)strtoul(at + 1, &at, 10);
        count++;
    }
    fclose(f);
    return count;
}

/* ---- a device that listens ---- */

static uint8_t samples[PING_MAX_BINS];
static struct ping_beam beam;
static struct ping ping;
static void (*on_ping)(void);
static unsigned pings, new_turns;
static void *state;

static struct ping *begin_ping(void *ctx)
{
    (void)ctx;
    ping = (struct ping){.beam = &beam, .samples = samples, .max_beams = 1, .max_samples = sizeof samples};
    return &ping;
}

static void done_ping(void *ctx, struct ping *p)
{
    (void)ctx;
    new_turns += p->flags & PING_NEW_TURN;
    on_ping();
    pings++;
}

static void nothing_sent(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx, (void)bytes, (void)n;
    CHECK(false);
}

static void no_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
    CHECK(false);
}

static void no_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx, (void)level, (void)fmt;
}

static const struct device_io io = {NULL, nothing_sent, no_break, begin_ping, done_ping, no_note};

static void listen(double sound_speed_mps, void (*take)(void))
{
    struct device_conf conf = {
        .range_m = 10, .sound_speed_mps = sound_speed_mps, .step_rad = 0.016, .gain = -1, .listen_only = true};
    struct fault fault;
    free(state);
    state = calloc(1, device_micron.state_size);
    CHECK(device_micron.init(state, &conf, &fault));
    device_micron.opened(state, 0, &io);
    on_ping = take;
    pings = new_turns = 0;
}

static struct device_status feed(const uint8_t *bytes, size_t n, size_t split)
{
    struct device_status s;
    for (size_t at = 0; at < n; at += split)
        device_micron.feed(state, bytes + at, n - at < split ? n - at : split, at * 1000, &io);
    device_micron.closed(state, n * 1000);
    device_micron.status(state, &s);
    return s;
}

/* ---- line by line ---- */

static unsigned wrong;

static bool is_row(const struct row *r)
{
    double az_deg = geo_deg((double)ping.beam->az_rad);
    return ping.n_bins == r->n && memcmp(samples, r->sample, r->n) == 0 &&
           fabs(geo_wrap_pi(geo_rad(az_deg - r->bearing_deg))) < geo_rad(0.002) &&
           fabs((double)ping.dr_m * r->n - r->range_m) < 1e-3 && ping.law == AMPLITUDE_LOG;
}

static void compare(void)
{
    wrong += pings >= MAX_LINES || !is_row(&rows[pings]);
}

static void check_stream(const char *name, const char *list, unsigned lines, unsigned garbage, unsigned cut,
                         unsigned sweeps)
{
    static const size_t split[] = {1, 100, 104, 4096};
    size_t n;
    uint8_t *bytes = load(name, &n);
    CHECK_INT(load_rows(list), lines);
    for (size_t i = 0; i < sizeof split / sizeof split[0]; i++) {
        wrong = 0;
        listen(1500.0, compare);
        struct device_status s = feed(bytes, n, split[i]);
        CHECK_INT(wrong, 0);
        CHECK_INT(pings, lines);
        CHECK_INT(s.frames, lines);
        CHECK_INT(s.garbage_bytes, garbage);
        CHECK_INT(s.cut_bytes, cut);
        CHECK_INT(s.bad_frame, 0);
        CHECK_INT(s.lost_frames, 0);
        CHECK_INT(new_turns, sweeps);
    }
    free(bytes);
}

/* 24 bytes of a line whose beginning was not recorded, 422 of one whose end was not; the head turns 4 times. */
TEST(seabed_line_by_line)
{
    check_stream(SEABED ".stream", SEABED ".csv", 382, 24, 422, 4);
}

TEST(target_line_by_line)
{
    check_stream(TARGET ".rebuilt.stream", TARGET ".csv", 234, 0, 0, 9);
}

/* ---- damage ---- */

static bool seen[MAX_LINES];
static unsigned invented;

static void recognise(void)
{
    for (unsigned i = 0; i < MAX_LINES; i++) {
        if (rows[i].n > 0 && is_row(&rows[i])) {
            seen[i] = true;
            return;
        }
    }
    invented++;
}

/* Bytes are lost from some lines, garbage comes before others: the whole ones are found, and nothing else. */
TEST(damaged_lines_are_skipped_and_counted)
{
    size_t n, out = 0, sound = 0;
    uint64_t rng = test_seed();
    uint8_t *bytes = load(TARGET ".rebuilt.stream", &n);
    uint8_t *damaged = malloc(2 * n + SEANET_FRAME_MAX);
    bool whole[MAX_LINES] = {false};
    memset(rows, 0, sizeof rows);
    unsigned lines = load_rows(TARGET ".csv");
    const size_t length = n / lines;

    for (unsigned i = 0; i < lines; i++) {
        const uint8_t *line = bytes + i * length;
        size_t from = test_random(&rng) % length, lost = 1 + test_random(&rng) % (length - from);
        unsigned fate = (unsigned)(test_random(&rng) % 4);
        whole[i] = fate > 0;
        sound += whole[i] ? length : 0;
        if (fate == 1)
            for (unsigned k = (unsigned)(test_random(&rng) % 300); k > 0; k--)
                damaged[out++] = (uint8_t)test_random(&rng);
        memcpy(damaged + out, line, whole[i] ? length : from);
        out += whole[i] ? length : from;
        if (!whole[i]) {
            memcpy(damaged + out, line + from + lost, length - from - lost);
            out += length - from - lost;
        }
    }
    memset(damaged + out, 0, SEANET_FRAME_MAX); /* so much may a false head wait for */
    out += SEANET_FRAME_MAX;
    memset(seen, 0, sizeof seen);
    invented = 0;
    listen(1500.0, recognise);
    struct device_status s = feed(damaged, out, 333);
    unsigned missing = 0;
    for (unsigned i = 0; i < lines; i++)
        missing += whole[i] && !seen[i];
    CHECK_INT(missing, 0);
    CHECK_INT(invented, 0);
    CHECK_INT(s.garbage_bytes, out - sound);
    CHECK(s.bad_frame > 0);
    free(damaged);
    free(bytes);
}

/* ---- recordings of decoded lines: the frames are built anew ---- */

static size_t row_as_frame(const struct row *r, unsigned ticks, uint8_t *out, size_t size)
{
    static uint8_t payload[SEANET_DATA_AT + MICRON_BINS_MAX];
    long units = (lround(r->bearing_deg * MICRON_TURN / 360.0) + MICRON_AHEAD) % MICRON_TURN;
    memset(payload, 0, SEANET_DATA_AT);
    seanet_put_u16(payload, SEANET_DATA_AT + r->n);
    seanet_put_u16(payload + 5, MICRON_COMMON | MICRON_8_BIT | MICRON_CONTINUOUS);
    seanet_put_u16(payload + 20, ticks);
    seanet_put_u16(payload + 27, (unsigned)(units < 0 ? units + MICRON_TURN : units));
    seanet_put_u16(payload + 29, r->n);
    memcpy(payload + SEANET_DATA_AT, r->sample, r->n);
    return seanet_build(out, size,
                        (struct seanet_head){MICRON_NODE, SEANET_HOST, SEANET_HEAD_DATA, SEANET_LAST_PACKET},
                        payload, SEANET_DATA_AT + r->n);
}

/* The rows of `list` as frames through a listening device, at the sound speed that gives `ticks` the rows' bins. */
static unsigned feed_rows(const char *list, unsigned ticks, void (*take)(void))
{
    static uint8_t stream[MAX_LINES * 500];
    unsigned lines = load_rows(list);
    size_t n = 0;
    for (unsigned i = 0; i < lines; i++)
        n += row_as_frame(&rows[i], ticks, stream + n, sizeof stream - n);
    listen(2.0 * rows[0].range_m / rows[0].n / (ticks * MICRON_TICK_S), take);
    feed(stream, n, 128);
    return lines;
}

static struct extract *extract;
static struct {
    double distance_m, normal_deg, half_width_deg;
    unsigned beams, found, behind;
} wall[2];

/* Is the wall among the echoes of a beam that looks at it, and is no water behind it called free? */
static void look_for_walls(void)
{
    struct beam_echoes heard;
    struct echoes out = {.max_beams = 1, .beam = &heard};
    extract_run(extract, &ping, NULL, &out);
    for (int w = 0; w < 2; w++) {
        double off_rad = geo_wrap_pi((double)ping.beam->az_rad - geo_rad(wall[w].normal_deg));
        double range_m = wall[w].distance_m / cos(off_rad);
        bool hit = false;
        if (fabs(off_rad) > geo_rad(wall[w].half_width_deg))
            continue;
        for (int k = 0; k < heard.n; k++)
            hit |= fabs((double)heard.echo[k].range_m - range_m) < 0.2;
        wall[w].beams++;
        wall[w].found += hit;
        wall[w].behind += (double)heard.free_to_m > range_m + 0.2;
    }
}

TEST(tank_walls_through_device_and_extraction)
{
    static _Alignas(16) unsigned char memory[1 << 19];
    struct extract_conf conf;
    struct fault fault = {""};

    extract_defaults(&conf);
    if (extract_size(MICRON_BINS_MAX) > sizeof memory)
        abort();
    extract = extract_init(memory, &conf, MICRON_BINS_MAX, &fault);
    wall[0].distance_m = 2.21, wall[0].normal_deg = 264, wall[0].half_width_deg = 36;
    wall[1].distance_m = 3.98, wall[1].normal_deg = 175, wall[1].half_width_deg = 14;
    CHECK_INT(feed_rows(TANK, 53, look_for_walls), 553);
    CHECK_INT(pings, 553);
    CHECK_INT(new_turns, 2); /* 200 beams each */
    for (int w = 0; w < 2; w++) {
        printf("# tank, wall at %.2f m: found in %u of %u beams, free behind it %u\n", wall[w].distance_m,
               wall[w].found, wall[w].beams, wall[w].behind);
        CHECK_INT(wall[w].behind, 0);
    }
    CHECK(wall[0].beams >= 112 && wall[0].found == wall[0].beams);
    CHECK(wall[1].found >= wall[1].beams * 40 / 44);
}

TEST(quay_line_by_line)
{
    wrong = 0;
    CHECK_INT(feed_rows(QUAY "20-59-31.csv", 104, compare), 3616);
    CHECK_INT(pings, 3616);
    CHECK_INT(new_turns, 18);
    CHECK_INT(feed_rows(QUAY "21-11-13.csv", 208, compare), 1690);
    CHECK_INT(pings, 1690);
    CHECK_INT(new_turns, 16);
    CHECK_INT(wrong, 0);
}

int main(void)
{
    RUN_WITH(SEABED ".stream", seabed_line_by_line);
    RUN_WITH(TARGET ".rebuilt.stream", target_line_by_line);
    RUN_WITH(TARGET ".rebuilt.stream", damaged_lines_are_skipped_and_counted);
    RUN_WITH(TANK, tank_walls_through_device_and_extraction);
    RUN_WITH(QUAY "21-11-13.csv", quay_line_by_line);
    free(state);
    return test_end();
}
