/* SPDX-License-Identifier: MIT */
/* stable_whole - cases E: everything at once, stiff, late; and L: what runs for a long time. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/fault.h"
#include "drivers/devices/clock_map.h"
#include "drivers/nmea/nmea0183.h"
#include "drivers/devices/ping_frame.h"
#include "drivers/devices/seanet_frame.h"
#include "daemon/input/pose_log.h"
#include "grid/range/cleanup.h"
#include "grid/range/extract.h"
#include "grid/sphere/view.h"
#include "grid/voxel/submap.h"
#include "asked.h"
#include "cost.h"
#include "tests/water/dice.h"
#include "stable.h"
#include "stable_sphere.h"

static double senseless(const struct beam_echoes *b)
{
    double n = !isfinite(b->blind_m) + !isfinite(b->free_to_m) + (b->n > ECHOES_PER_BEAM);
    for (int k = 0; k < b->n && k < ECHOES_PER_BEAM; k++)
        n += !isfinite(b->echo[k].range_m) + !isfinite(b->echo[k].sd_m) + !(b->echo[k].confidence <= 1) +
             (k > 0 && b->echo[k].range_m < b->echo[k - 1].range_m);
    return n;
}

/* Random bytes to three parsers; returns how many frames and values make no sense. */
static double feed(struct ping_parser *ping, struct seanet_parser *seanet, struct nmea_parser *nmea,
                   const uint8_t *bytes, size_t size)
{
    struct ping_frame frame;
    struct seanet_frame message;
    struct nmea_value value;
    double wrong = 0;
    const uint8_t *at = bytes;
    size_t n = size;
    while (ping_parser_next(ping, &at, &n, 1, &frame))
        wrong += frame.length > PING_PAYLOAD_MAX;
    for (at = bytes, n = size; seanet_parser_next(seanet, &at, &n, 1, &message);)
        wrong += message.length > SEANET_FRAME_MAX;
    for (at = bytes, n = size; nmea_parser_next(nmea, &at, &n, &value);)
        wrong += ((value.has & NMEA_DEPTH) && !isfinite(value.depth_m)) ||
                 ((value.has & (NMEA_TRUE | NMEA_MAGNETIC)) &&
                  !(value.heading_rad >= 0 && value.heading_rad < GEO_TURN));
    return wrong;
}

/* A ping through the clean-up, if it is an image, and the extraction: of those that come out the last one's beam.
 * False: the clean-up keeps it for later. *wrong counts what makes no sense in any. */
static bool hear(struct cleanup *cleanup, struct extract *extract, const struct ping *ping, struct echoes *out,
                 double *wrong)
{
    struct extract_aid aid;
    bool any = false;
    const bool taken = cleanup_put(cleanup, ping, NULL, NULL, NULL);
    for (const struct ping *p; (p = cleanup_next(cleanup, &aid)) != NULL; any = true) {
        extract_run(extract, p, &aid, out);
        *wrong += senseless(out->beam);
    }
    if (taken)
        return any;
    extract_run(extract, ping, NULL, out);
    *wrong += senseless(out->beam);
    return true;
}

/* Random bytes to parsers; random pings through clean-up, extraction, grid and questions. */
static void everything(bool quick, struct stable_found *f)
{
    static struct ping_parser ping_parser;
    static struct seanet_parser seanet;
    static struct nmea_parser nmea;
    static uint8_t counts[2000];
    struct dice dice = dice_of(1, 0);
    struct stable_sphere s = stable_sphere(&stable_sphere_usual);
    s.store = asked_store();
    struct asking asking = {
        sphere_picture(s.sphere), {30, 0.5}, {.pose_fresh = true, .pose = s.pose}, asked_near_m()};
    struct extract_conf conf;
    struct fault fault;
    extract_defaults(&conf);
    void *memory = stable_memory(extract_size(2000));
    struct extract *extract = extract_init(memory, &conf, 2000, &fault);
    ping_parser_init(&ping_parser, PING_PAYLOAD_MAX);
    seanet_parser_init(&seanet);
    nmea_parser_init(&nmea, false);
    const struct cleanup_conf clean = {.median = 3, .otsu = true, .clahe = true, .classes = true, .clip = 2};
    void *clean_memory = stable_memory(cleanup_size(&clean, 2000));
    struct cleanup *cleanup = cleanup_init(clean_memory, &clean, &mount_identity, 2000, &fault);
    f->derived = true;
    f->naive = f->ours = 0;
    for (int i = 0; i < (quick ? 300 : 20000); i++) {
        uint8_t bytes[512];
        for (size_t k = 0; k < sizeof bytes; k += 8) {
            const uint64_t bits = dice_bits(&dice);
            memcpy(bytes + k, &bits, 8);
        }
        f->naive += 512.0 / 65536; /* heads that a parser without checks would believe */
        f->ours += feed(&ping_parser, &seanet, &nmea, bytes, sizeof bytes);
        for (size_t k = 0; k < sizeof counts; k++)
            counts[k] = bytes[k % sizeof bytes];
        struct ping_beam axis = {.az_rad = (float)(GEO_TURN * dice_uniform(&dice)),
                                 .range_m = (float)(10 * dice_uniform(&dice) - 1),
                                 .range_sd_m = 0.1f,
                                 .confidence = (float)dice_uniform(&dice)};
        struct beam_echoes beam;
        const struct ping p = {.kind = (uint8_t)(i % 7 == 0 ? PING_RANGES : PING_PROFILE),
                               .law = (uint8_t)(i % 4),
                               .db_per_count = 0.3f,
                               .sample_bytes = 1,
                               .n_beams = 1,
                               .n_bins = (uint32_t)(dice_bits(&dice) % 2001),
                               .dr_m = i % 11 ? (float)dice_uniform(&dice) / 50 : NAN,
                               .pulse_m = (float)dice_uniform(&dice) / 10,
                               .head_units = (uint32_t)(i / 3 % 400),
                               .head_turn = 400,
                               .pose = pose_identity,
                               .beam = &axis,
                               .samples = counts};
        struct echoes out = {.max_beams = 1, .beam = &beam};
        if (!hear(cleanup, extract, &p, &out, &f->ours))
            continue;
        out.t_ns = s.t_ns += 1000000;
        out.pose = pose_identity;
        out.az_aperture_rad = 0.05f;
        out.el_aperture_rad = 0.4f;
        sphere_enter(s.sphere, &out, &mount_identity);
        store_enter(s.store, &out, &mount_identity);
        asking.now.now_ns = s.t_ns;
        const struct obstacles_query q = {
            .line = {.az_rad = 7 * dice_uniform(&dice), .distance_m = 5, .half_angle_rad = 0.1}};
        struct answer a;
        asked_of_store(&asking, s.store, &q, &a);
        f->ours += !isfinite(a.free_to_m) || !isfinite(a.confidence) || !isfinite(a.age_s);
    }
    free(clean_memory);
    free(memory);
    free(s.store);
    free(s.sphere);
}

/*
 * A day of beams a millisecond to a minute apart at rates over eighteen decades, side by side in one run: against the
 * closed form of all events in long double. Naive: explicit Euler with the step of the events.
 */
static void stiff_day(bool quick, struct stable_found *f)
{
    const long double hit = log1pl(0.9f * 4.0L), miss = logl(0.5L / 0.9L);
    enum { RATES = 7 };
    struct stable_sphere s[RATES];
    long double fade_s[RATES], want[RATES] = {0};
    double euler[RATES] = {0};
    struct dice dice = dice_of(2, 0);
    for (int r = 0; r < RATES; r++) {
        struct sphere_conf conf = stable_sphere_usual;
        fade_s[r] = powl(10, 3 * r - 9);
        conf.forget_s = (double)(fade_s[r] * logl(6 / logl(0.6L / 0.4L)));
        s[r] = stable_sphere(&conf);
    }
    f->naive = f->ours = 0;
    const uint64_t started = s[0].t_ns, long_ns = (quick ? 600 : 86400) * STABLE_SECOND;
    for (uint64_t t = started, last = started; t - started < long_ns; last = t) {
        t += (uint64_t)(1e6 * pow(6e4, dice_uniform(&dice)));
        const bool hears = dice_uniform(&dice) < 0.8;
        for (int r = 0; r < RATES; r++) {
            const long double dt = (long double)(t - last) * 1e-9L;
            s[r].t_ns = t;
            want[r] *= expl(-dt / fade_s[r]);
            euler[r] *= 1 - (double)(dt / fade_s[r]);
            stable_ping(&s[r], 1, hears ? 5 : 0, 10);
            if (hears || want[r] > 0) {
                want[r] = fminl(want[r] + (hears ? hit : miss), 6);
                euler[r] = fmin(euler[r] + (double)(hears ? hit : miss), 6);
            }
            if (want[r] < 1e-6L)
                want[r] = 0;
            const struct sphere_cell c = stable_cell(&s[r], 1);
            f->ours = stable_worse(f->ours, fabs((double)(c.logodds - want[r])));
            f->naive = stable_worse(f->naive, fabs(euler[r] - (double)want[r]));
        }
    }
    for (int r = 0; r < RATES; r++)
        free(s[r].sphere);
}

static double cpu_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec * 1e3 + (double)t.tv_nsec * 1e-6;
}

/* The worst beam: a thousand loud bins, 360 degrees wide, through extraction, grid and map: median ms of
 * the processor. Naive: the map's part by asking the definition of every voxel around. */
static void worst_beam(bool quick, struct stable_found *f)
{
    static uint8_t counts[1000];
    struct dice dice = dice_of(3, 0);
    struct stable_sphere s = stable_sphere(&stable_sphere_usual);
    struct extract_conf conf;
    struct tiles tiles;
    struct submap map;
    struct cast_opening opening;
    struct cast_beam beam;
    struct fault fault;
    const struct lattice_place origin = {{0, 0, 0}, {0.5, 0.5, 0.5}};
    extract_defaults(&conf);
    void *memory[3] = {stable_memory(extract_size(1000)), stable_memory(tiles_bytes(256, 128, 1)),
                       stable_memory(submap_bytes(16, 128))};
    struct extract *extract = extract_init(memory[0], &conf, 1000, &fault);
    tiles_init(&tiles, memory[1], 256, 128, 1);
    submap_init(&map, memory[2], 16, &tiles, &origin);
    cast_opening_init(&opening, CAST_WEDGE, GEO_PI, geo_rad(17.5), 0, &fault);
    cast_aim(
        &beam, &opening,
        &(struct cast_look){.apex = &origin, .attitude = pose_identity.attitude, .far_m = 10, .voxel_m = 0.1});
    static double took[300];
    const int n = quick ? 20 : 300;
    for (int i = 0; i < n; i++) {
        struct ping_beam axis = {0};
        struct beam_echoes found;
        for (size_t k = 0; k < sizeof counts; k++)
            counts[k] = (uint8_t)(k % 3 == 0 ? 250 : 5 + dice_bits(&dice) % 5);
        const struct ping p = {.kind = PING_PROFILE,
                               .sample_bytes = 1,
                               .n_beams = 1,
                               .n_bins = 1000,
                               .dr_m = 0.02f,
                               .pulse_m = 0.01f,
                               .az_aperture_rad = (float)GEO_TURN,
                               .el_aperture_rad = 1.0f,
                               .beam = &axis,
                               .samples = counts};
        struct echoes out = {.max_beams = 1, .beam = &found};
        const double started = cpu_ms();
        extract_run(extract, &p, NULL, &out);
        out.t_ns = s.t_ns += 1000000;
        out.pose = pose_identity;
        sphere_enter(s.sphere, &out, &mount_identity);
        submap_cast(&map, &beam, SUBMAP_VACANCY);
        took[i] = cpu_ms() - started;
    }
    cost_sort(took, (unsigned)n);
    f->ours = cost_quantile(took, (unsigned)n, 0.5);
    const double started = cpu_ms();
    int64_t cell[3];
    volatile double within = 0;
    for (cell[0] = -100; cell[0] < 100; cell[0]++)
        for (cell[1] = -100; cell[1] < 100; cell[1]++)
            for (cell[2] = -64; cell[2] < 64; cell[2]++)
                within = within + (cast_slack(&beam, cell) >= 0);
    f->naive = cpu_ms() - started;
    for (int i = 0; i < 3; i++)
        free(memory[i]);
    free(s.sphere);
}

/* ---- long ---- */

/*
 * A billion equal pings, by a fixed point: as soon as a ping leaves the cell as it was, bit for bit, every further one
 * does. Found are the pings until then; those after it are entered as far as time allows and must change nothing.
 */
static void billion_updates(bool quick, struct stable_found *f)
{
    struct stable_sphere s = stable_sphere(&stable_sphere_usual);
    struct sphere_cell before = {0};
    const int n = quick ? 100000 : 2000000;
    int moved = 0;
    float counted = 1; /* naive: counts in float; where does one that counts stand still? */
    for (int i = 0; i < n; i++) {
        s.t_ns += STABLE_SECOND / 25;
        stable_ping(&s, 0.5, 5, 0);
        const struct sphere_cell c = stable_cell(&s, 0.5);
        if (memcmp(c.point_m, before.point_m, sizeof c.point_m) != 0 || c.logodds != before.logodds ||
            c.ball_m != before.ball_m || (c.echoes != before.echoes && c.echoes != 65535 && i > 65535))
            moved = i + 1;
        before = c;
    }
    while (counted + 1 > counted)
        counted *= 2;
    f->naive = 1e9 - (double)counted;
    f->ours = moved;
    free(s.sphere);
}

/* A year of a ping every 10 s: does a turn on its last day tell the same as one on the first? */
static void a_year(bool quick, struct stable_found *f)
{
    struct stable_sphere s = stable_sphere(&stable_sphere_usual);
    const uint64_t year_ns = UINT64_C(31557600) * STABLE_SECOND, step_ns = (quick ? 1000 : 10) * STABLE_SECOND;
    struct sphere_cell first, last;
    for (int n = 0; n < 10; n++) {
        s.t_ns += STABLE_SECOND;
        stable_ping(&s, 20, 6, 0);
    }
    first = stable_cell(&s, 20);
    const uint64_t started = s.t_ns;
    while (s.t_ns - started < year_ns) {
        s.t_ns += step_ns;
        stable_ping(&s, 200, 7, 0);
    }
    const uint64_t again = s.t_ns;
    for (int n = 0; n < 10; n++) {
        s.t_ns += STABLE_SECOND;
        stable_ping(&s, 30, 6, 0);
    }
    last = stable_cell(&s, 30);
    f->ours = fabs(last.logodds - first.logodds) + fabs(last.ball_m - first.ball_m) +
              fabs((double)(int64_t)(last.t_first_ns - again) * 1e-9 - 1) + (last.echoes != first.echoes) +
              fabs((double)(int64_t)(last.t_echo_ns - s.t_ns) * 1e-9);
    f->derived = true;
    f->naive = 365.25 * 86400 - 4294967.296; /* milliseconds in 32 bits */
    free(s.sphere);
}

/* A year of a device clock 25 ppm off: ms that stamps are off on the last day. Naive: the first offset for ever. */
static void a_clock_for_a_year(bool quick, struct stable_found *f)
{
    static struct clock_map map;
    const uint64_t n = quick ? 20000 : 3155760;
    const double step_s = 31557600.0 / (double)n;
    clock_map_init(&map, UINT64_C(1) << 32, 1000000);
    f->derived = true;
    f->naive = 31557600 * 25e-6 * 1e3;
    f->ours = 0;
    for (uint64_t i = 0; i < n; i++) {
        /* Ten pings a second for a minute at a time, so that what is learnt is of the last minute. */
        const double base_s = 1000 + step_s * (double)(i / 600 * 600), true_s = base_s + 0.1 * (double)(i % 600);
        const uint64_t got = clock_map_put(&map, (uint64_t)(true_s * (1 + 25e-6) * 1e3) % (UINT64_C(1) << 32),
                                           (uint64_t)(true_s * 1e9));
        if (i % 600 > 300)
            f->ours = fmax(f->ours, fabs((double)got * 1e-9 - true_s) * 1e3);
    }
}

/* A year at anchor, a pose a second, then a dive of 5 m: steps of a depth sensor's noise are no way driven, the dive
 * is. Metres that the path is off. */
static void a_year_at_anchor(bool quick, struct stable_found *f)
{
    static struct pose_log log;
    struct dice dice = dice_of(4, 0);
    struct pose p = pose_identity;
    const int n = quick ? 20000 : 31557600;
    double depth_m = 10;
    pose_log_init(&log, 2 * STABLE_SECOND);
    f->naive = 0;
    for (int i = 0; i < n; i++) {
        const double last_m = depth_m;
        depth_m = 10 + 0.01 * round(2 * dice_uniform(&dice) - 1);
        f->naive += fabs(depth_m - last_m);
        p.t_ns = (uint64_t)(i + 1) * STABLE_SECOND;
        p.has = POSE_DEPTH;
        p.position_m[2] = depth_m;
        pose_log_put(&log, &p);
    }
    for (int i = 0; i < 50; i++) {
        p.t_ns += STABLE_SECOND / 10;
        p.position_m[2] += 0.1;
        pose_log_put(&log, &p);
    }
    f->ours = fabs(log.path_m - 5);
}

const struct stable_case stable_whole[] = {
    {"E1", "1e7 random bytes to three parsers, random pings through four stages", "senseless results",
     "two bytes of head are believed", 0, everything},
    {"E2", "a day, beams 1 ms to 60 s apart, rates 1e-9 to 1e9 per second", "log-odds off the closed form",
     "explicit Euler", 1e-6, stiff_day},
    {"E3", "the worst beam: 1000 loud bins, 360 degrees", "ms of processor time, median", "asking every voxel", 40,
     worst_beam},
    {"L1", "a billion equal pings of one cell", "pings until nothing changes any more", "counts in float", 65536,
     billion_updates},
    {"L2", "a year of uptime, then a new echo", "evidence, ball, times off those of the first day",
     "milliseconds in 32 bits", 1e-3, a_year},
    {"L3", "a device clock 25 ppm off for a year", "ms that stamps are off", "the first offset", 2,
     a_clock_for_a_year},
    {"L4", "a year at anchor, a noisy depth every second, then a dive of 5 m", "m of way off", "steps added up",
     2 * POSE_LOG_LINE_M, a_year_at_anchor},
    {0},
};
