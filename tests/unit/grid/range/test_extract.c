/* SPDX-License-Identifier: MIT */
/*
 * test_extract - the extractor on made-up beams whose truth is known, and on beams that no sonar should send.
 */
#include "tests/lib/fresh.h"
#include "tests/lib/test.h"

#include "core/fault.h"
#include "grid/range/extract.h"
#include "tests/sound/sound.h"

#define MAX_BINS  2000
#define MAX_BEAMS 8

static _Alignas(16) unsigned char memory[1 << 19];
static struct extract *extract;
static struct extract_conf conf;

static uint8_t bytes[MAX_BEAMS * MAX_BINS];
static uint16_t words[MAX_BINS];
static struct ping_beam axis[MAX_BEAMS];
static struct ping ping;
static struct beam_echoes found[MAX_BEAMS];
static struct echoes out;

static void set_up(void)
{
    struct fault fault = {""};
    extract = extract_size(MAX_BINS) <= sizeof memory ? extract_init(memory, &conf, MAX_BINS, &fault) : NULL;
    if (!extract) {
        printf("extract_init: %s\n", fault.text);
        exit(1);
    }
}

/* Defaults, and a ping of one beam: 1000 bins of 1 cm, pulse 3 cm, square-root counts. */
static void begin(void)
{
    extract_defaults(&conf);
    memset(bytes, 0, sizeof bytes);
    memset(axis, 0, sizeof axis);
    ping = (struct ping){.kind = PING_PROFILE,
                         .law = AMPLITUDE_SQRT,
                         .sample_bytes = 1,
                         .n_beams = 1,
                         .n_bins = 1000,
                         .dr_m = 0.01f,
                         .pulse_m = 0.03f,
                         .max_beams = MAX_BEAMS,
                         .beam = axis,
                         .samples = bytes};
    set_up();
}

static const struct beam_echoes *run(void)
{
    memset(found, 0xee, sizeof found);
    out = (struct echoes){.max_beams = MAX_BEAMS, .beam = found};
    fresh_samples(&ping);
    extract_run(extract, &ping, NULL, &out);
    return &found[0];
}

/* What the water and the device do: a ring-down, a noise floor, walls with a tail of 10 cm. Levels in counts. */
struct scene {
    double floor, ring_down_m;
    double wall_m[6], wall_counts;
    int walls;
};

static const struct scene open_water = {.floor = 20, .ring_down_m = 0.3};

/* Mean power of a bin, in counts to the fourth. */
static double scene_power(const struct scene *s, double r_m)
{
    double power = pow(s->floor, 4);
    if (s->ring_down_m > 0.0)
        power += pow(255.0, 4) * fmin(1.0, pow(10.0, -6.0 * (r_m / s->ring_down_m - 0.4)));
    for (int w = 0; w < s->walls; w++)
        if (r_m >= s->wall_m[w])
            power += pow(s->wall_counts, 4) * exp(-(r_m - s->wall_m[w]) / 0.02);
    return power;
}

/* Render into bytes (square-root counts), with speckle when seed is given. */
static void render(const struct scene *s, uint64_t *seed)
{
    for (uint32_t i = 0; i < ping.n_bins; i++) {
        const double r_m = (double)ping.r0_m + (i + 0.5) * (double)ping.dr_m;
        /* a receiver's counts vary even where nothing else does */
        const double speckle = seed ? -log(1.0 - test_uniform(seed)) : pow(1.0 + 0.05 * (i * 7 % 5 - 2.0), 4);
        bytes[i] = (uint8_t)fmin(255.0, pow(scene_power(s, r_m) * speckle, 0.25));
    }
}

/* Lets the extractor know what this water usually returns. */
static void know(const struct scene *s)
{
    render(s, NULL);
    for (int k = 0; k < BASELINE_LEAST; k++)
        run();
}

/* ---- what is found ---- */

TEST(a_wall_is_found_where_it_is)
{
    begin();
    know(&open_water);
    for (double wall_m = 0.7; wall_m < 9.5; wall_m += 0.37) {
        const struct scene scene = {20, 0.3, {wall_m}, 150, 1};
        render(&scene, NULL);
        const struct beam_echoes *b = run();
        CHECK_INT(b->state, BEAM_ECHO);
        CHECK_INT(b->n, 1);
        CHECK_NEAR(b->echo[0].range_m, wall_m, 0, 0.03);
        CHECK((double)b->echo[0].near_m <= wall_m + 0.005 && (double)b->echo[0].near_m > wall_m - 0.06);
        CHECK(b->free_to_m <= b->echo[0].near_m && b->free_to_m > b->echo[0].near_m - 0.04f);
        CHECK(b->echo[0].strength > 1.0f && b->echo[0].confidence > 0.5f && b->echo[0].confidence <= 1.0f);
        CHECK(b->echo[0].sd_m > 0.0f && b->echo[0].sd_m < 0.05f);
    }
}

TEST(a_wall_is_found_through_speckle)
{
    uint64_t seed = test_seed();
    int good = 0, short_of_wall = 0, past_wall = 0;
    begin();
    for (int k = 0; k < 400; k++) {
        const double wall_m = 0.8 + 8.0 * test_uniform(&seed);
        const struct scene scene = {20, 0.3, {wall_m}, 150, 1};
        render(&scene, &seed);
        const struct beam_echoes *b = run();
        good += b->n > 0 && fabs((double)b->echo[0].range_m - wall_m) < 0.06;
        short_of_wall += b->n > 0 && (double)b->echo[0].range_m < wall_m - 0.1;
        past_wall += (double)b->free_to_m > wall_m + 0.05;
    }
    printf("# speckle: %d of 400 within 6 cm, %d short of the wall, %d past it\n", good, short_of_wall, past_wall);
    CHECK(good >= 390);
    CHECK(short_of_wall <= 4);
    CHECK(past_wall <= 4);
}

TEST(empty_water_is_silent)
{
    uint64_t seed = test_seed();
    int echoes = 0;
    begin();
    for (int k = 0; k < 400; k++) {
        render(&open_water, &seed);
        echoes += run()->n > 0;
    }
    printf("# empty water: %d of 400 beams with an echo\n", echoes);
    CHECK(echoes <= 4);
}

TEST(every_detector_finds_the_wall)
{
    const struct scene scene = {20, 0.3, {5.0}, 150, 1};
    for (int d = CFAR_CA; d <= CFAR_OS; d++) {
        begin();
        conf.detector = (enum cfar_detector)d;
        set_up();
        render(&scene, NULL);
        CHECK_INT(run()->n, 1);
        CHECK_NEAR(found[0].echo[0].range_m, 5.0, 0, 0.03);
    }
}

TEST(echoes_come_in_order_of_range_and_at_most_four)
{
    const struct scene scene = {20, 0.3, {1.5, 2.5, 4.0, 5.5, 7.0, 8.5}, 150, 6};
    begin();
    render(&scene, NULL);
    const struct beam_echoes *b = run();
    CHECK_INT(b->n, ECHOES_PER_BEAM);
    for (int k = 0; k < b->n; k++)
        CHECK_NEAR(b->echo[k].range_m, scene.wall_m[k], 0, 0.03);
}

/* The same beam as every law writes it, in 8 and in 16 bit: the same wall. */
TEST(every_law_and_sample_size_finds_the_same_wall)
{
    const struct scene scene = {20, 0.3, {5.0}, 200, 1};
    for (int law = AMPLITUDE_LINEAR; law <= AMPLITUDE_LOG; law++)
        for (uint8_t size = 1; size <= 2; size++) {
            begin();
            conf.floor_counts = 1;
            set_up();
            const double full = size == 1 ? 255 : 65535;
            const double db_span = 100.0;
            ping.law = (uint8_t)law;
            ping.sample_bytes = size;
            ping.db_per_count = (float)(db_span / full);
            ping.samples = size == 1 ? (void *)bytes : (void *)words;
            for (uint32_t i = 0; i < ping.n_bins; i++) {
                const double power = fmin(1.0, scene_power(&scene, (i + 0.5) * 0.01) / pow(255.0, 4));
                const double exact = sound_count((enum amplitude_law)law, power, full, db_span / full);
                const uint16_t count = (uint16_t)(exact + 0.5);
                bytes[i] = (uint8_t)count;
                words[i] = count;
            }
            if (size == 2)
                memset(bytes, 0, sizeof bytes);
            const struct beam_echoes *b = run();
            CHECK_INT(b->state, BEAM_ECHO);
            CHECK_NEAR(b->echo[0].range_m, 5.0, 0, 0.03);
        }
}

TEST(a_saturated_wall_is_an_echo)
{
    begin();
    know(&open_water);
    memset(bytes + 400, 255, 200); /* longer than any window: no reference is left below it */
    const struct beam_echoes *b = run();
    CHECK_INT(b->state, BEAM_ECHO);
    CHECK_NEAR(b->free_to_m, 4.0, 0, 0.03);
}

/* Noise 13 dB above the usual one, with a peak of 25 dB: no echo, and nothing that hides one. */
TEST(a_peak_of_raised_noise_is_no_echo)
{
    for (int wall = 0; wall < 2; wall++) {
        begin();
        know(&open_water);
        for (int i = 0; i < 1000; i++)
            bytes[i] = bytes[i] > 42 ? bytes[i] : 42;
        memset(bytes + 500, 85, 3);
        if (wall)
            memset(bytes + 700, 200, 20);
        CHECK_INT(run()->n, wall);
        CHECK(!wall || fabs((double)found[0].echo[0].range_m - 7.0) < 0.25);
        CHECK(found[0].free_to_m <= 5.0f);
    }
}

/* Noise so loud that its peaks saturate the receiver: they are no echo, yet nothing is free there. A wall is one. */
TEST(noise_that_saturates_is_no_wall)
{
    const struct scene loud_water = {.floor = 170, .ring_down_m = 0.3};
    begin();
    know(&loud_water);
    memset(bytes + 400, 255, 3);
    CHECK_INT(run()->n, 0);
    CHECK(found[0].free_to_m <= found[0].blind_m);
    begin();
    know(&open_water);
    bytes[400] = 255;
    CHECK_INT(run()->n, 1); /* where it usually is quiet */
}

/* A wall all around, which the baseline holds: an echo in every beam, and no free water from its near edge on. */
TEST(a_wall_all_around_that_saturates_stays_an_echo)
{
    for (double wall_m = 0.6; wall_m < 8.0; wall_m += 0.3) {
        begin();
        render(&open_water, NULL);
        memset(bytes + (int)(100.0 * wall_m), 255, 12);
        for (int k = 0; k < 40; k++)
            run();
        CHECK(found[0].n > 0 && fabs((double)found[0].echo[0].range_m - wall_m) < 0.15);
        CHECK(found[0].free_to_m <= (float)wall_m + 0.03f);
    }
}

/* Usual reverberation that rises and falls over metres explains what is as loud, but not what saturates within it: no
 * water behind that is free. */
TEST(no_water_is_free_behind_what_saturates)
{
    for (int saturates = 0; saturates < 2; saturates++) {
        begin();
        render(&open_water, NULL);
        for (int i = 0; i < 400; i++)
            bytes[i] = (uint8_t)fmax(bytes[i], 38.0 + 140.0 * fmax(0.0, 1.0 - fabs(i - 215.0) / 175.0));
        for (int k = 0; k < 40; k++)
            run();
        for (int i = 20; i < 400; i++)
            bytes[i] = (uint8_t)fmin(250.0, 1.45 * bytes[i]);
        bytes[215] = saturates ? 255 : 250;
        run();
        CHECK_INT(found[0].n, 0);
        CHECK((found[0].free_to_m > 9.0f) == !saturates);
    }
}

TEST(stray_counts_over_zeros_are_no_walls)
{
    begin();
    bytes[0] = 255;
    bytes[300] = 8;
    bytes[500] = 12;
    bytes[700] = 17;
    CHECK_INT(run()->state, BEAM_SILENT);
    conf.floor_counts = 0;
    set_up();
    CHECK_INT(run()->state, BEAM_ECHO);
    CHECK_NEAR(found[0].echo[0].range_m, 3.005, 0, 1e-3);
}

TEST(a_step_of_the_floor_below_the_contrast_is_no_wall)
{
    begin();
    know(&open_water);
    for (uint32_t i = 500; i < 1000; i++)
        bytes[i] = 40; /* 12 dB */
    CHECK_INT(run()->state, BEAM_SILENT);
    for (uint32_t i = 500; i < 1000; i++)
        bytes[i] = 60; /* 19 dB */
    CHECK_INT(run()->state, BEAM_ECHO);
    CHECK_NEAR(found[0].free_to_m, 5.0, 0, 0.06);
}

/* Nearly full scale in 16 bit and a pulse of 200 bins: the largest sums there are. */
TEST(large_sums_do_not_wrap)
{
    begin();
    ping.sample_bytes = 2;
    ping.samples = words;
    ping.n_bins = MAX_BINS;
    ping.pulse_m = 2.0f;
    conf.min_contrast_db = 0.0;
    set_up();
    for (uint32_t level = 40000; level < 65535; level += 100) {
        for (uint32_t i = 0; i < MAX_BINS; i++)
            words[i] = (uint16_t)(level - i * 7 % 5 * (level / 30));
        if (run()->n > 0) {
            CHECK_INT(level, 0);
            break;
        }
    }
}

/* ---- near the head ---- */

TEST(the_ring_down_is_blanked)
{
    begin();
    render(&open_water, NULL);
    const struct beam_echoes *b = run();
    CHECK_INT(b->state, BEAM_SILENT);
    /* the tail of 255 * 10^-1.5 r/0.3 meets the floor near 0.3 m */
    CHECK((double)b->blind_m > 0.2 && (double)b->blind_m < 0.5);
    memset(bytes, 0, 10); /* zeros at the head are not free water */
    const float blind_m = b->blind_m;
    CHECK(run()->blind_m == blind_m);
}

/* A head whose receiver is limited below full scale: where its ringing ends is no wall,
 * and before that nothing is known. */
TEST(ringing_at_a_limit_below_full_scale_is_blanked)
{
    const struct scene silent = {.floor = 20};
    begin();
    render(&silent, NULL);
    for (uint32_t i = 0; i < 60; i++) {
        const double ringing = 180.0 * fmin(1.0, pow(10.0, -0.08 * ((double)i - 35.0)));
        bytes[i] = (uint8_t)fmax(bytes[i], ringing);
    }
    CHECK_INT(run()->state, BEAM_SILENT);
    CHECK((double)found[0].blind_m > 0.35 && (double)found[0].blind_m < 0.6);
}

/* An echo is louder than that: it is no limit, and the water before the echo is heard. */
TEST(even_water_is_no_ringing)
{
    begin();
    ping.deaf_m = 0.15f;
    for (int i = 0; i < 1000; i++)
        bytes[i] = (uint8_t)(28 + 2 * (i % 3)); /* every resolution cell, of three bins, has the same */
    for (int k = 0; k < BASELINE_LEAST; k++)
        run();
    memset(bytes + 500, 200, 4);
    CHECK_INT(run()->state, BEAM_ECHO);
    CHECK((double)found[0].blind_m < 0.3 && (double)found[0].free_to_m > 4.5);
}

/*
 * A quick head whose receiver stands at a limit; in the last ping there is a near wall that drives it there,
 * too.
 */
static void hear_near_wall_at_limit(int limit, int first, int bins, uint64_t *seed)
{
    const struct scene quick = {.floor = 20, .ring_down_m = 0.1};
    begin();
    conf.no_echo = EXTRACT_RANGE;
    set_up();
    for (int n = 0; n < 40; n++) {
        render(&quick, seed);
        for (uint32_t i = 0; i < ping.n_bins; i++)
            bytes[i] = bytes[i] < limit ? bytes[i] : (uint8_t)limit;
        if (n == 39)
            memset(bytes + first, limit, (size_t)bins);
        run();
    }
}

/* It counts as ringing, for it is no louder; but it lasts longer than that does usually,
 * and nothing behind it is free. */
TEST(a_near_wall_at_the_limit_frees_nothing_behind_it)
{
    uint64_t seed = test_seed();
    for (int limit = 150; limit <= 255; limit += 35)
        for (int first = 8; first <= 20; first += 4)
            for (int bins = 10; bins <= 80; bins *= 2) {
                hear_near_wall_at_limit(limit, first, bins, &seed);
                const double wall_m = first * 0.01;
                CHECK((double)found[0].free_to_m <= wall_m + 0.02 || found[0].free_to_m <= found[0].blind_m);
                if (test_case_failed) {
                    printf("(limit %d, %d bins from %.2f m: free from %.2f to %.2f m)\n", limit, bins, wall_m,
                           (double)found[0].blind_m, (double)found[0].free_to_m);
                    return;
                }
            }
    hear_near_wall_at_limit(150, 8, 0, &seed); /* without one, all is */
    CHECK(found[0].free_to_m > 9.9f);
}

/* What is found of a flat echo over the water of a quick head; levels in counts. */
static void hear_flat_echo(enum cfar_detector detector, double wall_m, double long_m, int level, uint64_t *seed)
{
    const struct scene quick = {.floor = 20, .ring_down_m = 0.2};
    begin();
    conf.detector = detector;
    set_up();
    know(&quick);
    render(&quick, seed);
    memset(bytes + lround(wall_m * 100.0), level, (size_t)lround(long_m * 100.0));
    run();
}

/*
 * A flat echo that is longer than the guard fills the windows behind its own first cells, and next to the
 * ring-down there is no other: its near edge is where it rises out of the water before it all the same.
 */
TEST(a_long_flat_echo_begins_where_it_rises)
{
    static const double wall_m[] = {0.45, 0.6, 0.7, 0.95, 3.0}, long_m[] = {0.1, 0.24, 0.36, 0.7};
    uint64_t seed = test_seed();
    for (enum cfar_detector detector = CFAR_CA; detector <= CFAR_OS; detector++)
        for (int speckled = 0; speckled < 2; speckled++)
            for (int level = 90; level <= 240; level += 50)
                for (size_t w = 0; w < sizeof wall_m / sizeof wall_m[0]; w++)
                    for (size_t l = 0; l < sizeof long_m / sizeof long_m[0]; l++) {
                        hear_flat_echo(detector, wall_m[w], long_m[l], level, speckled ? &seed : NULL);
                        CHECK((double)found[0].free_to_m <= wall_m[w] + 0.0151); /* half a pulse */
                        /* soca finds it, and without noise that joins it the water is free up to a pulse before */
                        CHECK(detector != CFAR_SOCA || found[0].state == BEAM_ECHO);
                        CHECK(detector != CFAR_SOCA || speckled || (double)found[0].free_to_m > wall_m[w] - 0.031);
                        if (test_case_failed) {
                            printf("(detector %d, %d counts at %.2f m, %.2f m long: free to %.2f m)\n", detector,
                                   level, wall_m[w], long_m[l], (double)found[0].free_to_m);
                            return;
                        }
                    }
}

/* A window is 2 m long here: none is complete before a bottom 2.5 m from the head, and none behind it is quiet. */
TEST(an_edge_near_the_head_is_found_at_long_range)
{
    uint64_t seed = test_seed();
    begin();
    ping.dr_m = 0.05f;
    ping.pulse_m = 0.25f;
    const struct scene water = {15, 0.5, {0}, 0, 0};
    know(&water);
    for (int k = 0; k < 200; k++) {
        const double edge_m = 2.4 + 0.5 * test_uniform(&seed);
        render(&water, NULL);
        for (uint32_t first = (uint32_t)(edge_m / 0.05), i = first; i < ping.n_bins; i++)
            bytes[i] = (uint8_t)(80 - (i - first) / 20);
        const struct beam_echoes *b = run();
        CHECK_INT(b->state, BEAM_ECHO);
        CHECK_NEAR(b->echo[0].near_m, edge_m, 0, 0.3);
        CHECK((double)b->free_to_m <= edge_m);
        CHECK(b->blind_m < b->free_to_m);
    }
}

/*
 * Three resolution cells behind the ring-down an edge is an echo. Nearer it is too near for one: but sound that is so
 * much louder than what came before it frees nothing behind.
 */
TEST(an_edge_right_behind_the_ring_down_is_doubted)
{
    const uint32_t near = 29, far = 32;
    begin();
    conf.no_echo = EXTRACT_RANGE;
    set_up();
    ping.dr_m = 0.05f;
    ping.pulse_m = 0.25f;
    const struct scene water = {15, 0.5, {0}, 0, 0};
    render(&water, NULL);
    CHECK(run()->free_to_m > 49.0f);
    for (uint32_t i = far; i < ping.n_bins; i++)
        bytes[i] = (uint8_t)(55 + i * 7 % 5 * 2);
    const struct beam_echoes *b = run();
    CHECK_INT(b->n, 1);
    CHECK_NEAR(b->echo[0].near_m, far * 0.05, 0, 0.13);
    CHECK(b->free_to_m <= b->echo[0].near_m);
    memset(bytes + near, 60, far - near);
    b = run();
    CHECK_INT(b->n, 0);
    CHECK_NEAR(b->free_to_m, near * 0.05, 0, 0.06);
}

TEST(a_configured_ring_down_is_kept)
{
    begin();
    conf.ring_down_m = 0.8;
    set_up();
    const struct scene scene = {20, 0.3, {0.6}, 150, 1};
    render(&scene, NULL);
    CHECK_INT(run()->n, 0);
    CHECK_NEAR(found[0].blind_m, 0.8, 0, 0.03);
    CHECK(found[0].free_to_m <= found[0].blind_m); /* the baseline is not known yet */
    memset(bytes + 70, 255, 30);                   /* still deaf at its end */
    run();
    CHECK_NEAR(found[0].blind_m, 1.0, 0, 0.03);
}

TEST(a_wall_under_the_ring_down_is_not_called_free)
{
    for (double wall_m = 0.05; wall_m < 0.6; wall_m += 0.01) {
        const struct scene scene = {20, 0.3, {wall_m}, 150, 1};
        begin();
        conf.no_echo = EXTRACT_RANGE;
        set_up();
        render(&scene, NULL);
        const struct beam_echoes *b = run();
        const double known_from_m = (double)b->blind_m;
        CHECK(known_from_m >= wall_m - 0.015 || (double)b->free_to_m <= wall_m + 0.02);
    }
}

/* ---- where nothing was found ---- */

TEST(silence_claims_what_the_rule_allows)
{
    static const struct {
        enum extract_no_echo rule;
        double want_m;
    } row[] = {{EXTRACT_MINIMUM, 0.75}, {EXTRACT_HEARD, 10.0}, {EXTRACT_RANGE, 10.0}};

    for (int k = 0; k < 3; k++) {
        begin();
        conf.no_echo = row[k].rule;
        set_up();
        const struct scene quiet = {.floor = 12, .ring_down_m = 0.3};
        know(&quiet);
        memset(bytes + 600, 0, 400); /* a wall would be heard there, too */
        CHECK_INT(run()->state, BEAM_SILENT);
        CHECK_NEAR(found[0].free_to_m, row[k].want_m, 0, 1e-5);
    }
    conf.minimum_range_m = 50.0;
    conf.no_echo = EXTRACT_MINIMUM;
    set_up();
    const struct scene heard = {.floor = 12, .ring_down_m = 0.3};
    know(&heard);
    CHECK_NEAR(run()->free_to_m, 10.0, 0, 1e-5); /* never beyond the last bin */
}

TEST(nothing_is_free_before_the_baseline_is_known)
{
    begin();
    render(&open_water, NULL);
    for (int k = 1; k < 2 * BASELINE_LEAST; k++)
        CHECK((run()->free_to_m > 9.9f) == (k >= BASELINE_LEAST));
    ping.gain = 1; /* another receiver: what was usual, and how loud echoes are, is not so any more */
    CHECK(run()->free_to_m <= found[0].blind_m);
    ping.gain = 0;
    CHECK(run()->free_to_m > 9.9f);
    ping.dr_m = 0.02f; /* another axis */
    CHECK(run()->free_to_m <= found[0].blind_m);
}

/* Counts of 254 * 10^(-27/40) = 53 are what a weak wall exceeds in 99 beams of 100. */
TEST(water_is_free_as_far_as_the_target_would_be_detected)
{
    static const struct {
        double target_db;
        float gain_db;
        int level;
        bool free;
    } row[] = {{0, 0, 45, true},  {0, 0, 56, false},  {6, 0, 45, false},  {6, 0, 35, true}, {12, 0, 35, false},
               {12, 0, 24, true}, {18, 0, 24, false}, {0, -6, 45, false}, {0, -6, 35, true}};

    for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
        begin();
        conf.target_db = row[k].target_db;
        conf.bottom_db = -1;
        set_up();
        ping.gain_db = row[k].gain_db;
        const struct scene quiet = {.floor = 12, .ring_down_m = 0.3};
        render(&quiet, NULL);
        for (int i = 500; i < 1000; i++) /* too slowly for an echo, and so in all beams */
            bytes[i] = (uint8_t)(12 + (row[k].level - 12) * (i < 900 ? i - 500 : 400) / 400);
        for (int n = 0; n < 20; n++)
            run();
        CHECK_INT(found[0].n, 0);
        CHECK(row[k].free ? found[0].free_to_m > 9.9f : found[0].free_to_m > 7.0f && found[0].free_to_m < 9.1f);
    }
}

/*
 * Of full scale the weakest wall returns -21 dB, a bottom 12 dB less: 38 counts, where it lasts for longer than a
 * window of 40 bins. 20 dB less are 24 counts. None of it is as loud as the target, and all beams have it.
 */
TEST(water_is_free_as_far_as_a_bottom_would_be_detected)
{
    static const struct {
        double bottom_db;
        float gain_db;
        int level, bins;
        bool free;
    } row[] = {{12, 0, 36, 400, true}, {12, 0, 40, 400, false}, {12, 0, 40, 20, true},
               {-1, 0, 40, 400, true}, {20, 0, 22, 400, true},  {20, 0, 26, 400, false},
               {20, 0, 26, 20, true},  {12, -6, 26, 400, true}, {12, -6, 29, 400, false}};

    for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
        begin();
        conf.bottom_db = row[k].bottom_db;
        set_up();
        ping.gain_db = row[k].gain_db;
        const struct scene quiet = {.floor = 12, .ring_down_m = 0.3};
        render(&quiet, NULL);
        memset(bytes + 500, row[k].level, (size_t)row[k].bins);
        for (int n = 0; n < 200; n++)
            run();
        CHECK_INT(found[0].n, 0);
        CHECK(row[k].free ? found[0].free_to_m > 9.9f : found[0].free_to_m > 4.5f && found[0].free_to_m < 5.1f);
        if (test_case_failed)
            printf("(row %zu: free to %g)\n", k, (double)found[0].free_to_m);
    }
}

/* Where noise is as loud as the bottom at every range, nothing is free, and it is told why. 36 dB less: 32 counts. */
TEST(noise_as_loud_as_the_bottom_is_told)
{
    static const struct {
        double bottom_db;
        int noise, quiet_bins;
        bool noisy;
    } row[] = {
        {15, 29, 0, false}, {15, 35, 0, true}, {15, 35, 100, false}, {10, 35, 0, false}, {-1, 35, 0, false}};

    for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
        struct extract_reference reference;
        begin();
        conf.bottom_db = row[k].bottom_db;
        set_up();
        render(&(struct scene){.floor = 12, .ring_down_m = 0.3}, NULL);
        for (int i = 30; i < (int)ping.n_bins; i++)
            bytes[i] = (uint8_t)(row[k].noise + i % 7 - 3);
        memset(bytes + 400, 12, (size_t)row[k].quiet_bins);
        for (int n = 0; n < 200; n++)
            run();
        CHECK(extract_reference(extract, &reference));
        CHECK_INT(reference.noisy, row[k].noisy);
        CHECK(!row[k].noisy || found[0].free_to_m <= found[0].blind_m);
        if (test_case_failed)
            printf("(row %zu)\n", k);
    }
}

/* A bottom that begins at the head leaves nothing free; what is free before an echo keeps its end. */
TEST(a_bottom_next_to_the_head_leaves_nothing_free)
{
    begin();
    know(&(struct scene){.floor = 12, .ring_down_m = 0.3});
    memset(bytes + 30, 42, 300);
    for (int n = 0; n < 200; n++)
        run();
    CHECK(found[0].free_to_m <= found[0].blind_m);
    begin();
    const struct scene wall = {12, 0.3, {0.7}, 150, 1}; /* nearer than a window behind the ring-down */
    know(&(struct scene){.floor = 12, .ring_down_m = 0.3});
    render(&wall, NULL);
    run();
    CHECK(found[0].free_to_m > 0.6f && found[0].free_to_m <= 0.7f && found[0].blind_m < 0.4f);
}

/* A weaker target makes the ring-down last longer, and must not make it last through a wall that all beams show. */
TEST(a_weaker_target_does_not_hide_a_wall_next_to_the_head)
{
    for (double target_db = 0; target_db <= 18; target_db += 3)
        for (double wall_m = 0.32; wall_m < 0.5; wall_m += 0.01) {
            const struct scene scene = {12, 0.3, {wall_m}, 150, 1};
            begin();
            conf.target_db = target_db;
            set_up();
            know(&scene);
            for (int n = 0; n < 40; n++)
                run();
            CHECK(found[0].free_to_m <= found[0].blind_m || (double)found[0].free_to_m <= wall_m);
            if (test_case_failed) {
                printf("(%g dB, %g m: free %g to %g)\n", target_db, wall_m, (double)found[0].blind_m,
                       (double)found[0].free_to_m);
                return;
            }
        }
}

/* The counts of some level over a stretch, in water of 12 counts, as all beams have it. */
static enum extract_no_echo rule = EXTRACT_HEARD;

static const struct beam_echoes *hear_level(int from_bin, int end_bin, double level)
{
    begin();
    conf.no_echo = rule;
    conf.bottom_db = -1;
    set_up();
    know(&(struct scene){.floor = 12, .ring_down_m = 0.3});
    memset(bytes + from_bin, (int)level, (size_t)(end_bin - from_bin));
    for (int n = 0; n < 200; n++)
        run();
    return &found[0];
}

/* Of 53 counts (see above) 3, 6 and 16 dB less are 45, 38 and 21: what ends the side, the edge, and the edge when it is
 * as long as a reference window of 40 bins. */
TEST(off_the_axis_water_is_free_as_far_as_less_would_be_heard)
{
    static const struct {
        int from_bin, end_bin;
        double level, side_m, edge_m, surface_m;
    } row[] = {{500, 600, 20, 10, 10, 10}, {500, 600, 25, 10, 10, 5}, {500, 510, 25, 10, 10, 10},
               {500, 510, 41, 10, 5, 5},   {500, 600, 41, 10, 5, 5},  {500, 510, 49, 5, 5, 5}};

    for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
        hear_level(row[k].from_bin, row[k].end_bin, row[k].level);
        CHECK_INT(found[0].n, 0);
        CHECK(found[0].off_axis);
        CHECK_NEAR(found[0].free_to_m, 10, 0, 1e-5);
        CHECK_NEAR(found[0].side_to_m, row[k].side_m, 0, 0.05);
        CHECK_NEAR(found[0].edge_to_m, row[k].edge_m, 0, 0.05);
        CHECK(found[0].edge_from_m >= found[0].blind_m && found[0].edge_from_m < 1);
        CHECK(found[0].surface_to_m <= (float)row[k].surface_m + 0.05f &&
              found[0].surface_to_m >= (float)row[k].surface_m - 0.3f);
        CHECK(found[0].surface_from_m >= found[0].blind_m && found[0].surface_from_m < 1);
        if (test_case_failed)
            printf("(row %zu: side %g, edge %g, surface %g to %g)\n", k, (double)found[0].side_to_m,
                   (double)found[0].edge_to_m, (double)found[0].surface_from_m, (double)found[0].surface_to_m);
    }
}

/* What the end of the ring-down raises is passed. What goes on for longer may be a bottom that the edge meets. */
TEST(at_the_edge_nothing_is_free_behind_what_begins_at_the_head)
{
    hear_level(30, 50, 26);
    CHECK(found[0].surface_from_m > found[0].blind_m && found[0].surface_from_m < 0.8f);
    CHECK_NEAR(found[0].surface_to_m, 10, 0, 1e-5);
    hear_level(30, 200, 26);
    CHECK_NEAR(found[0].side_to_m, 10, 0, 1e-5);
    CHECK(found[0].surface_from_m >= found[0].surface_to_m);
}

/* The full range of a silent beam is asked for on its axis alone: off it the target ends it all the same. */
TEST(off_the_axis_the_full_range_is_not_taken_on_trust)
{
    rule = EXTRACT_RANGE;
    hear_level(500, 510, 49);
    rule = EXTRACT_HEARD;
    CHECK_INT(found[0].state, BEAM_SILENT);
    CHECK_NEAR(found[0].free_to_m, 10, 0, 1e-5);
    CHECK_NEAR(found[0].side_to_m, 5, 0, 0.05);
    CHECK_NEAR(found[0].edge_to_m, 5, 0, 0.05);
}

/* Where the sonar gives ranges alone nothing is known of it. */
TEST(off_the_axis_is_known_of_profiles)
{
    begin();
    know(&open_water);
    CHECK(run()->off_axis);
    begin();
    set_up();
    ping.kind = PING_RANGES;
    axis[0].range_m = 4;
    axis[0].confidence = 1;
    CHECK(!run()->off_axis);
    CHECK(found[0].free_to_m > 3);
}

/* What is weaker than the target needs a second beam to block, and ends the free water all the same. */
TEST(an_echo_weaker_than_the_target_is_faint)
{
    static const struct {
        double target_db;
        double level;
        uint8_t flags;
    } row[] = {{0, 40, ECHO_FAINT}, {0, 120, 0}, {18, 40, 0}};

    for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
        begin();
        conf.target_db = row[k].target_db;
        set_up();
        const struct scene quiet = {.floor = 12, .ring_down_m = 0.3}, wall = {12, 0.3, {5.0}, row[k].level, 1};
        know(&quiet);
        render(&wall, NULL);
        CHECK_INT(run()->n, 1);
        CHECK_INT(found[0].echo[0].flags, row[k].flags);
        CHECK(found[0].free_to_m <= found[0].echo[0].near_m);
    }
}

/* A wall that rises over metres is its own reference, and no spatial detector finds it. */
TEST(what_is_loud_and_unusual_is_an_echo)
{
    begin();
    know(&open_water);
    for (int i = 400; i < 800; i++)
        bytes[i] = (uint8_t)fmin(20.0 + 0.4 * (i - 400), 110.0);
    CHECK_INT(run()->state, BEAM_ECHO);
    CHECK(found[0].echo[0].near_m > 4.3f && found[0].echo[0].near_m < 5.2f);
    CHECK(found[0].free_to_m <= found[0].echo[0].near_m);
    render(&open_water, NULL);
    for (int i = 0; i < 1000; i++) /* a raised noise all along the beam is none, but hides all */
        bytes[i] = bytes[i] > 70 ? bytes[i] : 70;
    CHECK_INT(run()->n, 0);
    CHECK(found[0].free_to_m <= 0.4f);
}

/* A ripple of the ring-down that every beam shows is no echo; a wall in the ring-down frees nothing behind. */
TEST(a_usual_ripple_is_no_echo_and_an_unusual_one_hides)
{
    begin();
    render(&open_water, NULL);
    memset(bytes + 60, 42, 4);
    for (int k = 0; k < 40; k++)
        run();
    CHECK_INT(found[0].n, 0);
    CHECK(found[0].free_to_m > 9.9f);
    for (int i = 8; i < 14; i++)
        bytes[i] = 255;
    memset(bytes + 14, 230, 8); /* in the ring-down, 6 dB above it */
    run();
    CHECK(found[0].free_to_m <= 0.25f || found[0].free_to_m <= found[0].blind_m);
}

/* Something at 3 m that lacks 1 dB of an echo's contrast, and a wall at 7 m. */
TEST(a_doubtful_group_ends_the_free_water)
{
    begin();
    conf.no_echo = EXTRACT_RANGE;
    set_up();
    const struct scene scene = {.floor = 12, .ring_down_m = 0.3};
    render(&scene, NULL);
    const double rise = pow(10.0, (conf.min_contrast_db - 1.0) / 10.0); /* in power, whatever the law */
    for (int i = 300; i < 304; i++)
        bytes[i] = (uint8_t)(12.0 * pow(rise, 0.25) + 0.5);
    CHECK_INT(run()->n, 0);
    CHECK(found[0].free_to_m > 2.5f && found[0].free_to_m < 3.05f);
    for (int i = 700; i < 704; i++)
        bytes[i] = 200;
    CHECK_INT(run()->n, 1);
    CHECK_NEAR(found[0].echo[0].range_m, 7.02, 0, 0.05);
    CHECK(found[0].free_to_m < 3.05f);
}

/* C1 and C2 of the catalogue among them: all zero, all saturated */
TEST(what_is_not_heard_is_blind)
{
    static const char *const name[] = {"all zero",      "all saturated",  "no bins",     "two bins",
                                       "dr 0",          "dr negative",    "dr NaN",      "pulse NaN",
                                       "r0 infinite",   "3 sample bytes", "law unknown", "log without dB",
                                       "too many bins", "dr absurd"};
    for (int k = 0; k < 14; k++) {
        const struct scene scene = {20, 0.3, {5.0}, 150, 1};
        begin();
        render(&scene, NULL);
        switch (k) {
        case 0:
            memset(bytes, 0, 1000);
            break;
        case 1:
            memset(bytes, 255, 1000);
            break;
        case 2:
            ping.n_bins = 0;
            break;
        case 3:
            ping.n_bins = 2;
            break;
        case 4:
            ping.dr_m = 0.0f;
            break;
        case 5:
            ping.dr_m = -0.01f;
            break;
        case 6:
            ping.dr_m = NAN;
            break;
        case 7:
            ping.pulse_m = NAN;
            break;
        case 8:
            ping.r0_m = INFINITY;
            break;
        case 9:
            ping.sample_bytes = 3;
            break;
        case 10:
            ping.law = 9;
            break;
        case 11:
            ping.law = AMPLITUDE_LOG;
            break;
        case 12:
            ping.n_bins = MAX_BINS + 1;
            break;
        default:
            ping.dr_m = 1e9f;
        }
        const struct beam_echoes *b = run();
        if (b->state != BEAM_BLIND || b->n != 0 || b->free_to_m > b->blind_m) {
            printf("%s:\n", name[k]);
            CHECK_INT(b->state, BEAM_BLIND);
            CHECK_INT(b->n, 0);
            CHECK(b->free_to_m <= b->blind_m);
        }
    }
}

/* ---- the whole ping ---- */

TEST(header_and_beams_are_copied)
{
    const struct scene scene = {20, 0.3, {5.0}, 150, 1};
    begin();
    render(&scene, NULL);
    memcpy(bytes + 2 * 1000, bytes, 1000); /* beams 0 and 2 see the wall, 1 hears nothing at all, 3 has no room */
    ping.n_beams = 4;
    ping.t_ns = 111;
    ping.t_in_ns = 222;
    ping.seq = 33;
    ping.flags = PING_NEW_TURN;
    ping.sensor = 4;
    ping.az_aperture_rad = 0.5f;
    ping.el_aperture_rad = 0.25f;
    ping.pose.path_m = 7.0;
    axis[2] = (struct ping_beam){.az_rad = 1.0f, .el_rad = -0.5f};
    memset(found, 0xee, sizeof found);
    out = (struct echoes){.max_beams = 3, .beam = found};
    extract_run(extract, &ping, NULL, &out);
    CHECK(out.t_ns == 111 && out.t_in_ns == 222 && out.seq == 33 && out.sensor == 4 && out.flags == PING_NEW_TURN);
    CHECK(out.az_aperture_rad == 0.5f && out.el_aperture_rad == 0.25f && out.pose.path_m == 7.0);
    CHECK_NEAR(out.range_max_m, 10.0, 1e-6, 0);
    CHECK_INT(out.n_beams, 3);
    CHECK_INT(found[0].state, BEAM_ECHO);
    CHECK_INT(found[1].state, BEAM_BLIND);
    CHECK_INT(found[2].state, BEAM_ECHO);
    CHECK(found[2].az_rad == 1.0f && found[2].el_rad == -0.5f);
    CHECK(found[2].echo[0].range_m == found[0].echo[0].range_m);
    CHECK_INT(found[3].state, 0xee);
}

TEST(ready_ranges_pass_through)
{
    begin();
    ping.kind = PING_RANGES;
    ping.n_beams = 4;
    axis[0] = (struct ping_beam){.range_m = 3.0f, .range_sd_m = 0.1f, .confidence = 0.8f};
    axis[1] = (struct ping_beam){.az_rad = 0.1f, .range_m = 0.0f};
    axis[2] = (struct ping_beam){.az_rad = 0.2f, .range_m = NAN};
    axis[3] = (struct ping_beam){.az_rad = 0.3f, .range_m = 0.05f, .range_sd_m = NAN, .confidence = 7.0f};
    run();
    CHECK_INT(found[0].state, BEAM_ECHO);
    CHECK(found[0].echo[0].range_m == 3.0f && found[0].echo[0].sd_m == 0.1f &&
          found[0].echo[0].confidence == 0.8f);
    CHECK_NEAR(found[0].free_to_m, 3 - 0.1 * sqrt(3), 1e-6, 0);
    CHECK_INT(found[1].state, BEAM_SILENT);
    CHECK_INT(found[2].state, BEAM_BLIND); /* no range at all is not the same as nothing heard */
    CHECK(found[2].free_to_m == 0.0f);
    CHECK_INT(found[3].state, BEAM_ECHO);
    CHECK(found[3].echo[0].sd_m == 0.0f && found[3].echo[0].confidence == 1.0f);
}

TEST(ready_ranges_claim_nothing_next_to_the_sonar_and_nothing_unheard)
{
    begin();
    ping.kind = PING_RANGES;
    ping.n_beams = 1;
    ping.r0_m = 0.0f;
    axis[0] = (struct ping_beam){.range_m = 3.0f, .confidence = 0.8f};
    CHECK_NEAR(run()->blind_m, 0.3, 1e-6, 0); /* the device does not say how near it hears */
    ping.r0_m = 0.6f;
    CHECK_NEAR(run()->blind_m, 0.6, 1e-6, 0);
    ping.r0_m = 0.1f; /* its scan begins there, but the transducer may still ring */
    CHECK_NEAR(run()->blind_m, 0.3, 1e-6, 0);
    conf.ring_down_m = 0.05;
    set_up();
    CHECK_NEAR(run()->blind_m, 0.1, 1e-6, 0);
    conf.ring_down_m = 0.4;
    set_up();
    CHECK_NEAR(run()->blind_m, 0.4, 1e-6, 0);
    ping.flags = PING_UNHEARD;
    CHECK_INT(run()->state, BEAM_BLIND);
    CHECK(found[0].n == 0 && found[0].free_to_m == 0.0f && found[0].blind_m == 0.0f);
}

TEST(a_sonar_without_an_echo_frees_nothing_beyond_its_range)
{
    begin();
    ping.kind = PING_RANGES;
    ping.n_beams = 1;
    ping.n_bins = 1;
    ping.dr_m = 0.6f; /* it chose a short one by itself */
    conf.minimum_range_m = 1.0;
    set_up();
    CHECK_NEAR(run()->free_to_m, 0.6, 1e-6, 0);
    ping.dr_m = 5.0f;
    CHECK_NEAR(run()->free_to_m, 1.0, 1e-6, 0);
}

/* A head that locks its receiver out, so that it hides its own ring-down: quiet bins are no free water. */
TEST(nothing_is_free_within_the_pulse_or_the_lock_out)
{
    const struct scene calm = {.floor = 20};
    static const struct {
        float pulse_m, deaf_m, ring_down_m, from_m;
    } row[] = {{0.03f, 0.12f, 0.01f, 0.12f},
               {0.03f, 0.5f, 0.01f, 0.5f},
               {0.4f, 0.12f, 0.01f, 0.4f},
               {0.03f, 0.5f, 0.8f, 0.8f},
               {0.03f, 0.5f, -1.0f, 0.5f}};

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin();
        ping.pulse_m = row[i].pulse_m;
        ping.deaf_m = row[i].deaf_m;
        conf.ring_down_m = (double)row[i].ring_down_m;
        set_up();
        know(&calm);
        const struct beam_echoes *b = run();
        if (!(b->blind_m >= row[i].from_m - 1e-6f && b->blind_m < row[i].from_m + 0.3f && b->free_to_m > 2)) {
            printf("row %zu: from %g to %g m\n", i, (double)b->blind_m, (double)b->free_to_m);
            CHECK(false);
        }
    }
    ping.deaf_m = 20.0f; /* beyond its range */
    run();
    CHECK(found[0].free_to_m <= found[0].blind_m);
    ping.deaf_m = NAN;
    run();
    CHECK(found[0].free_to_m <= found[0].blind_m);
}

/* Entries that are no range say nothing beside one. */
TEST(ready_ranges_of_one_direction_are_one_beam)
{
    begin();
    ping.kind = PING_RANGES;
    ping.n_beams = 8;
    const struct ping_beam many[] = {
        {.az_rad = 2.0f, .range_m = 11.0f}, /* another azimuth */
        {.az_rad = 1.0f, .range_m = 3.0f, .confidence = 0.6f},
        {.az_rad = 1.0f, .el_rad = 0.1f, .range_m = 10.0f}, /* another elevation */
        {.az_rad = 2.0f, .range_m = 0.0f},                  /* nothing */
        {.az_rad = 1.0f, .range_m = 2.0f, .range_sd_m = 0.1f, .confidence = 0.5f},
        {.az_rad = 2.0f, .range_m = 4.0f}, /* nearer: not in order */
        {.az_rad = 3.0f, .range_m = 0.0f},
        {.az_rad = 3.0f, .range_m = -1.0f},
    };
    memcpy(axis, many, sizeof many);
    run();
    CHECK_INT(out.n_beams, 4);
    CHECK_INT(found[0].n, 2);
    CHECK(found[0].echo[0].range_m == 2.0f && found[0].echo[1].range_m == 3.0f);
    CHECK(found[0].echo[1].confidence == 0.6f);
    CHECK_NEAR(found[0].free_to_m, 2 - 0.1 * sqrt(3), 1e-6, 0);
    CHECK(found[1].n == 2 && found[1].echo[0].range_m == 4.0f && found[1].echo[1].range_m == 11.0f);
    CHECK(found[2].n == 0 && found[2].state == BEAM_BLIND);
    CHECK(found[3].n == 1 && found[3].el_rad == 0.1f);
}

TEST(more_ready_ranges_than_a_beam_holds)
{
    begin();
    ping.kind = PING_RANGES;
    ping.n_beams = ECHOES_PER_BEAM + 2;
    for (int i = 0; i < ping.n_beams; i++)
        axis[i] = (struct ping_beam){.range_m = 1.0f + (float)i};
    run();
    CHECK_INT(out.n_beams, 1);
    CHECK_INT(found[0].n, ECHOES_PER_BEAM);
    CHECK(found[0].echo[ECHOES_PER_BEAM - 1].range_m == ECHOES_PER_BEAM);
}

/* 200 counts of quiet water in 10 m from 0 on, where the transducer rings to 0.25 m. */
static void begin_choice(float range_m)
{
    begin();
    ping.kind = PING_CHOICE;
    ping.law = AMPLITUDE_LINEAR;
    ping.n_bins = 200;
    ping.dr_m = 0.05f;
    ping.pulse_m = 0.075f;
    ping.deaf_m = 0.5f;
    memset(bytes, 6, 200);
    memset(bytes, 255, 5);
    axis[0] = (struct ping_beam){.range_m = range_m, .range_sd_m = 0.02f, .confidence = 0.9f};
}

TEST(what_a_device_chose_is_free_as_far_as_its_profile_shows)
{
    begin_choice(8);
    memset(bytes + 160, 250, 5);
    CHECK_INT(run()->state, BEAM_ECHO);
    CHECK_INT(found[0].n, 1);
    CHECK_NEAR(found[0].blind_m, 0.5, 1e-6, 0);
    CHECK(found[0].free_to_m <= found[0].blind_m); /* one profile may be noise */
    run();
    CHECK_NEAR(found[0].free_to_m, 8 - 0.02 * sqrt(3), 1e-6, 0);
    CHECK_NEAR(found[0].echo[0].confidence, 0.9, 1e-6, 0);
    CHECK(found[0].heard_from_m == found[0].blind_m && found[0].heard_to_m == found[0].free_to_m);
    for (int confidence = 0; confidence < 2; confidence++) { /* no proof */
        axis[0].confidence = (float)confidence;
        memset(bytes + 60, 255, 4); /* 3 m */
        CHECK_INT(run()->n, 2);
        CHECK(found[0].echo[0].range_m > 3 && found[0].echo[0].range_m < 3.2f && found[0].echo[0].flags == 0);
        CHECK_NEAR(found[0].echo[1].range_m, 8, 1e-6, 0);
        CHECK(found[0].free_to_m > 2.9f && found[0].free_to_m <= found[0].echo[0].near_m);
    }
    memset(bytes + 60, 180, 4);
    CHECK_INT(run()->n, 2);
    CHECK_INT(found[0].echo[0].flags, ECHO_FAINT);
    CHECK(found[0].free_to_m < 3);
    memset(bytes + 60, 100, 4);
    CHECK_INT(run()->n, 1);
    CHECK(found[0].free_to_m < 3); /* the ping before ended there */
    CHECK(run()->free_to_m > 7.9f);
}

/* Noise of power at full scale, alike over `alike` bins as under a pulse that is longer than they are. The loudest bin
 * is chosen, the worst that a device can do. */
static unsigned noise_frees(uint64_t *seed, unsigned alike, unsigned pings)
{
    unsigned freed = 0;
    begin_choice(0);
    ping.pulse_m = (float)alike * ping.dr_m;
    for (unsigned k = 0; k < pings; k++) {
        double white[2][200 + 16], x[200], most = 0;
        unsigned at = 0;
        for (unsigned i = 0; i < 2 * (200 + 16); i++)
            white[i % 2][i / 2] = sqrt(-2 * log(1.0 - test_uniform(seed))) * cos(GEO_TURN * test_uniform(seed));
        for (unsigned i = 0; i < 200; i++) {
            double sum[2] = {0};
            for (unsigned a = 0; a < 2 * alike; a++)
                sum[a % 2] += white[a % 2][i + a / 2];
            x[i] = sum[0] * sum[0] + sum[1] * sum[1];
            at = x[i] > most ? i : at;
            most = fmax(most, x[i]);
        }
        for (unsigned i = 0; i < 200; i++)
            bytes[i] = (uint8_t)(255 * x[i] / most);
        axis[0].range_m = ((float)at + 0.5f) * ping.dr_m;
        run();
        freed += found[0].free_to_m > found[0].blind_m;
    }
    printf("# noise alike over %u bins: %u of %u pings free water\n", alike, freed, pings);
    return freed;
}

TEST(a_choice_in_noise_hardly_ever_frees_water)
{
    uint64_t seed = test_seed();
    CHECK(noise_frees(&seed, 1, 2000) <= 20);
    CHECK(noise_frees(&seed, 4, 2000) <= 30);
    CHECK(noise_frees(&seed, 16, 2000) <= 60);
}

/* An obstacle that is reported is kept. */
TEST(a_choice_without_an_echo_blocks_and_frees_nothing)
{
    begin_choice(8);
    CHECK_INT(run()->n, 1);
    CHECK_NEAR(found[0].echo[0].range_m, 8, 1e-6, 0);
    CHECK(found[0].free_to_m <= found[0].blind_m && found[0].heard_to_m <= found[0].heard_from_m);
    memset(bytes + 60, 255, 4);
    CHECK_INT(run()->n, 2);
    CHECK_INT(found[0].echo[0].flags, ECHO_FAINT);
    CHECK(found[0].free_to_m <= found[0].blind_m);
    ping.flags = PING_UNHEARD;
    CHECK_INT(run()->state, BEAM_BLIND);
    ping.flags = 0;
    axis[0].range_m = NAN;
    CHECK_INT(run()->state, BEAM_BLIND);
}

/* What is not sure enough to be chosen is there all the same, in the profile. */
TEST(what_a_device_did_not_choose_ends_free_water)
{
    begin_choice(8);
    memset(bytes + 160, 250, 5);
    run();
    CHECK(run()->free_to_m > 7.9f);
    axis[0].range_m = 0;
    for (int k = 0; k < 2; k++) { /* where it was */
        CHECK(run()->free_to_m > 7.9f && found[0].free_to_m < 8);
        CHECK_INT(found[0].n, 1);
    }
    memset(bytes + 60, 255, 4); /* 3 m */
    CHECK_INT(run()->state, BEAM_ECHO);
    CHECK_INT(found[0].n, 1);
    CHECK(found[0].echo[0].range_m > 3 && found[0].echo[0].range_m < 3.2f);
    CHECK(found[0].echo[0].flags == ECHO_FAINT && found[0].echo[0].confidence <= 0);
    CHECK_NEAR(found[0].free_to_m, 0.75, 1e-6, 0); /* it may be noise */
    CHECK(run()->free_to_m > 2.9f && found[0].free_to_m < 3);
    memset(bytes + 60, 6, 4);
    memset(bytes + 160, 6, 5);
    CHECK_INT(run()->state, BEAM_SILENT); /* nor is one in the profile */
    CHECK(found[0].n == 0 && found[0].free_to_m <= found[0].blind_m);
    memset(bytes + 12, 255, 2); /* 0.6 m */
    run();
    CHECK(found[0].n == 1 && found[0].free_to_m <= found[0].blind_m);
}

/* From the first ping on, and for however long. */
TEST(something_near_is_not_learnt_as_the_ring_down)
{
    begin_choice(8);
    memset(bytes + 160, 250, 5);
    memset(bytes, 255, 13); /* to 0.65 m */
    for (int k = 0; k < 1000; k++) {
        CHECK(run()->free_to_m <= found[0].blind_m);
        CHECK_INT(found[0].hides, BEAM_HIDES_RING);
    }
    memset(bytes + 5, 6, 8);
    CHECK(run()->free_to_m <= found[0].blind_m); /* the ping before */
    CHECK(run()->free_to_m > 7.9f);
    for (int k = 0; k < 200; k++)
        run();
    memset(bytes, 255, 9); /* to 0.45 m: no longer than a transducer may ring, and longer than this one does */
    for (int k = 0; k < 300; k++) {
        CHECK(run()->free_to_m <= found[0].blind_m);
        CHECK_INT(found[0].hides, BEAM_HIDES_RING);
    }
}

/* 0.2 m is read as 0.7 m. Without a profile too, where it is known how near the device hears. */
TEST(what_may_be_the_second_bounce_off_something_too_near_frees_nothing)
{
    begin_choice(0.7f);
    memset(bytes + 14, 250, 3);
    CHECK_INT(run()->n, 1);
    CHECK(found[0].free_to_m <= found[0].blind_m);
    ping.kind = PING_RANGES;
    ping.r0_m = 0.5f;
    CHECK_INT(run()->n, 1);
    CHECK(found[0].free_to_m <= found[0].blind_m);
    axis[0].range_m = 1.2f;
    CHECK_NEAR(run()->free_to_m, 1.2 - 0.02 * sqrt(3), 1e-6, 0);
    axis[0].range_m = 0.7f;
    ping.deaf_m = 0;
    CHECK_NEAR(run()->free_to_m, 0.7 - 0.02 * sqrt(3), 1e-6, 0);
}

TEST(settings_may_change_between_pings)
{
    uint64_t seed = test_seed();
    static _Alignas(16) unsigned char other[1 << 19];
    struct fault fault;

    begin();
    for (int k = 0; k < 200; k++) {
        const struct scene scene = {20, 0.3, {0.5 + 3.0 * test_uniform(&seed)}, 150, 1};
        ping.n_bins = 1 + (uint32_t)(test_random(&seed) % MAX_BINS);
        ping.dr_m = (float)(0.001 + 0.05 * test_uniform(&seed));
        ping.pulse_m = (float)(0.2 * test_uniform(&seed));
        ping.law = (uint8_t)(test_random(&seed) % 4);
        ping.db_per_count = 0.3f;
        render(&scene, &seed);
        run();
        const struct beam_echoes used = found[0];
        struct extract *fresh = extract_init(other, &conf, MAX_BINS, &fault);
        extract_run(fresh, &ping, NULL, &out);
        CHECK(used.state == found[0].state && used.n == found[0].n && used.free_to_m == found[0].free_to_m &&
              used.blind_m == found[0].blind_m);
        CHECK(used.n == 0 || used.echo[0].range_m == found[0].echo[0].range_m);
    }
}

/* Whatever comes in, what goes out can be relied on. */
TEST(any_samples_give_sane_echoes)
{
    uint64_t seed = test_seed();
    begin();
    for (int k = 0; k < 20000 && !test_case_failed; k++) {
        if (k % 50 == 0) {
            conf.detector = (enum cfar_detector)(test_random(&seed) % 4);
            conf.no_echo = (enum extract_no_echo)(test_random(&seed) % 3);
            conf.floor_counts = (uint32_t)(test_random(&seed) % 20);
            conf.min_contrast_db = 20.0 * test_uniform(&seed);
            conf.window_m = 0.01 + test_uniform(&seed);
            conf.guard_m = 0.3 * test_uniform(&seed);
            conf.ring_down_m = test_uniform(&seed) - 0.5;
            set_up();
        }
        ping.n_bins = (uint32_t)(test_random(&seed) % 200);
        ping.dr_m = (float)(0.1 * test_uniform(&seed));
        ping.pulse_m = (float)(0.3 * test_uniform(&seed));
        ping.r0_m = (float)test_uniform(&seed);
        ping.law = (uint8_t)(test_random(&seed) % 4);
        ping.db_per_count = 0.3f;
        ping.sample_bytes = (uint8_t)(1 + test_random(&seed) % 2);
        ping.samples = ping.sample_bytes == 1 ? (void *)bytes : (void *)words;
        const uint64_t mask = test_random(&seed) % 3 ? 0xffff : 0x3;
        for (uint32_t i = 0; i < ping.n_bins; i++) {
            words[i] = (uint16_t)(test_random(&seed) & mask);
            bytes[i] = test_random(&seed) % 16 ? (uint8_t)words[i] : 255;
        }
        const struct beam_echoes *b = run();
        const float end_m = out.range_max_m * 1.000001f;
        CHECK(b->state <= BEAM_BLIND && b->n <= ECHOES_PER_BEAM && (b->state == BEAM_ECHO) == (b->n > 0));
        CHECK(b->blind_m >= 0.0f && b->blind_m <= end_m && b->free_to_m >= 0.0f && b->free_to_m <= end_m);
        if (b->off_axis) {
            CHECK(b->side_to_m >= 0.0f && b->side_to_m <= b->free_to_m);
            CHECK(b->edge_from_m >= b->blind_m);
            CHECK(b->edge_to_m <= b->side_to_m || b->edge_to_m <= b->edge_from_m);
            CHECK(b->surface_from_m >= b->edge_from_m);
            CHECK(b->surface_to_m <= b->edge_to_m || b->surface_to_m <= b->surface_from_m);
        }
        for (int e = 0; e < b->n; e++) {
            const struct echo *echo = &b->echo[e];
            CHECK(echo->near_m >= b->blind_m && echo->near_m <= echo->range_m && echo->range_m <= end_m);
            CHECK(echo->sd_m > 0.0f && isfinite(echo->sd_m) && isfinite(echo->strength) && echo->strength >= 1.0f);
            CHECK(echo->confidence >= 0.0f && echo->confidence <= 1.0f);
            CHECK(e == 0 || echo->near_m > b->echo[e - 1].range_m);
        }
    }
}

TEST(wrong_configurations_are_refused)
{
    static const char *const key[] = {"detector",      "false_alarm", "window",       "guard",
                                      "rank",          "floor",       "min_contrast", "no_echo",
                                      "minimum_range", "ring_down",   "amplitude",    "decibels_per_count"};
    for (int k = 0; k < 12; k++) {
        struct fault fault = {""};
        extract_defaults(&conf);
        switch (k) {
        case 0:
            conf.detector = (enum cfar_detector)4;
            break;
        case 1:
            conf.false_alarm = 0.0;
            break;
        case 2:
            conf.window_m = NAN;
            break;
        case 3:
            conf.guard_m = -0.1;
            break;
        case 4:
            conf.rank = 1.01;
            break;
        case 5:
            conf.floor_counts = 70000;
            break;
        case 6:
            conf.min_contrast_db = INFINITY;
            break;
        case 7:
            conf.no_echo = (enum extract_no_echo)3;
            break;
        case 8:
            conf.minimum_range_m = -1.0;
            break;
        case 9:
            conf.ring_down_m = 1000.0;
            break;
        case 10:
            conf.law = 7;
            break;
        default:
            conf.law = AMPLITUDE_LOG;
        }
        CHECK(!extract_init(memory, &conf, MAX_BINS, &fault));
        CHECK(strstr(fault.text, key[k]) != NULL);
    }
}

int main(void)
{
    RUN(a_wall_is_found_where_it_is);
    RUN(a_wall_is_found_through_speckle);
    RUN(empty_water_is_silent);
    RUN(every_detector_finds_the_wall);
    RUN(echoes_come_in_order_of_range_and_at_most_four);
    RUN(every_law_and_sample_size_finds_the_same_wall);
    RUN(a_saturated_wall_is_an_echo);
    RUN(a_peak_of_raised_noise_is_no_echo);
    RUN(noise_that_saturates_is_no_wall);
    RUN(a_wall_all_around_that_saturates_stays_an_echo);
    RUN(no_water_is_free_behind_what_saturates);
    RUN(stray_counts_over_zeros_are_no_walls);
    RUN(a_step_of_the_floor_below_the_contrast_is_no_wall);
    RUN(large_sums_do_not_wrap);
    RUN(the_ring_down_is_blanked);
    RUN(ringing_at_a_limit_below_full_scale_is_blanked);
    RUN(even_water_is_no_ringing);
    RUN(a_near_wall_at_the_limit_frees_nothing_behind_it);
    RUN(a_long_flat_echo_begins_where_it_rises);
    RUN(an_edge_near_the_head_is_found_at_long_range);
    RUN(an_edge_right_behind_the_ring_down_is_doubted);
    RUN(a_configured_ring_down_is_kept);
    RUN(a_wall_under_the_ring_down_is_not_called_free);
    RUN(silence_claims_what_the_rule_allows);
    RUN(a_doubtful_group_ends_the_free_water);
    RUN(nothing_is_free_before_the_baseline_is_known);
    RUN(water_is_free_as_far_as_the_target_would_be_detected);
    RUN(water_is_free_as_far_as_a_bottom_would_be_detected);
    RUN(noise_as_loud_as_the_bottom_is_told);
    RUN(a_bottom_next_to_the_head_leaves_nothing_free);
    RUN(a_weaker_target_does_not_hide_a_wall_next_to_the_head);
    RUN(off_the_axis_water_is_free_as_far_as_less_would_be_heard);
    RUN(at_the_edge_nothing_is_free_behind_what_begins_at_the_head);
    RUN(off_the_axis_the_full_range_is_not_taken_on_trust);
    RUN(off_the_axis_is_known_of_profiles);
    RUN(an_echo_weaker_than_the_target_is_faint);
    RUN(what_is_loud_and_unusual_is_an_echo);
    RUN(a_usual_ripple_is_no_echo_and_an_unusual_one_hides);
    RUN(what_is_not_heard_is_blind);
    RUN(header_and_beams_are_copied);
    RUN(ready_ranges_pass_through);
    RUN(ready_ranges_claim_nothing_next_to_the_sonar_and_nothing_unheard);
    RUN(a_sonar_without_an_echo_frees_nothing_beyond_its_range);
    RUN(nothing_is_free_within_the_pulse_or_the_lock_out);
    RUN(ready_ranges_of_one_direction_are_one_beam);
    RUN(more_ready_ranges_than_a_beam_holds);
    RUN(what_a_device_chose_is_free_as_far_as_its_profile_shows);
    RUN(a_choice_in_noise_hardly_ever_frees_water);
    RUN(a_choice_without_an_echo_blocks_and_frees_nothing);
    RUN(what_a_device_did_not_choose_ends_free_water);
    RUN(something_near_is_not_learnt_as_the_ring_down);
    RUN(what_may_be_the_second_bounce_off_something_too_near_frees_nothing);
    RUN(settings_may_change_between_pings);
    RUN(any_samples_give_sane_echoes);
    RUN(wrong_configurations_are_refused);
    return test_end();
}
