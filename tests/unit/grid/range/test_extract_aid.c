/* SPDX-License-Identifier: MIT */
/*
 * test_extract_aid - what extraction makes of masked cells, of a cleaned image, and of what is usual for the sensor.
 */
#include "tests/lib/fresh.h"
#include "tests/lib/test.h"

#include "core/fault.h"
#include "grid/range/extract.h"
#include "grid/range/survivors.h"
#include "grid/range/usual.h"

#define BINS  1000
#define DR_M  0.01
#define FLOOR 12

static _Alignas(16) unsigned char memory[1 << 19];
static struct extract *extract;
static struct extract_conf conf;
static uint8_t counts[BINS], blind[BINS], clean[BINS];
static struct beam_echoes found;
static double dr_m; /* of the next ping */

static void set_up(void)
{
    struct fault fault;
    extract = extract_init(memory, &conf, BINS, &fault);
    if (!extract || extract_size(BINS) > sizeof memory) {
        printf("extract_init: %s\n", fault.text);
        exit(1);
    }
}

/* A floor of `level` behind a ring-down that ends at about 0.3 m; the rule trusts silence. From 6 to 7 m the floor
 * varies, as a receiver's does that hears. */
static void water(uint8_t *sample, int level)
{
    for (int i = 0; i < BINS; i++) {
        const double vary = i >= 600 && i < 700 ? (i * 7 % 5 - 2.0) / 2.0 * fmax(1.0, level / 10.0) : 0.0;
        sample[i] = (uint8_t)(i < 12 ? 255 : fmax(level + vary, 255.0 * pow(10.0, -(i - 12) / 12.0)));
    }
}

static void wall(uint8_t *sample, double at_m, int level)
{
    for (int i = 0; i < 6; i++)
        sample[(int)(at_m / DR_M) + i] = (uint8_t)level;
}

static void mask(double from_m, double to_m)
{
    for (int i = (int)(from_m / DR_M + 0.5); i < (int)(to_m / DR_M + 0.5); i++)
        blind[i] = 1;
}

static void begin(void)
{
    extract_defaults(&conf);
    dr_m = DR_M;
    conf.no_echo = EXTRACT_RANGE;
    set_up();
    water(counts, FLOOR);
    memset(blind, 0, sizeof blind);
    memset(clean, 0, sizeof clean);
}

static const struct beam_echoes *run(const struct extract_aid *aid)
{
    struct ping_beam axis = {.az_rad = 0.0f};
    const struct ping ping = {.kind = PING_PROFILE,
                              .law = AMPLITUDE_SQRT,
                              .sample_bytes = 1,
                              .n_beams = 1,
                              .n_bins = BINS,
                              .dr_m = (float)dr_m,
                              .pulse_m = 0.03f,
                              .beam = &axis,
                              .samples = counts};
    struct echoes out = {.max_beams = 1, .beam = &found};
    fresh_samples(&ping);
    extract_run(extract, &ping, aid, &out);
    return &found;
}

static const struct extract_aid masked = {.blind = blind, .lowest = -1};

TEST(a_masked_wall_is_none_and_casts_a_shadow)
{
    begin();
    wall(counts, 2.0, 200);
    CHECK_NEAR(run(NULL)->echo[0].range_m, 2.03, 0, 0.03);
    CHECK_INT(found.hides, BEAM_HIDES_NOTHING);
    mask(1.9, 2.3);
    CHECK_INT(run(&masked)->n, 0);
    CHECK_INT(found.hides, BEAM_HIDES_MASK);
    CHECK(found.free_to_m > 1.8f && found.free_to_m <= 1.9001f);
    wall(counts, 4.0, 150); /* behind it: sound passed */
    CHECK_INT(run(&masked)->n, 1);
    CHECK_NEAR(found.echo[0].range_m, 4.03, 0, 0.03);
    CHECK(found.blind_m >= 2.29f && found.blind_m < 2.4f); /* what stands beside what is masked is not seen */
    CHECK(found.free_to_m > 3.9f && found.free_to_m <= 4.0f);
    CHECK_INT(found.hides, BEAM_HIDES_BEFORE);
}

TEST(masked_cells_are_in_no_reference)
{
    begin();
    wall(counts, 2.0, 120);
    for (int i = 150; i < 195; i++)
        counts[i] = counts[i + 65] = 200; /* loud on both sides of it */
    CHECK(fabs((double)run(NULL)->echo[0].range_m - 2.03) > 0.05);
    mask(1.5, 1.95);
    mask(2.15, 2.6);
    CHECK_NEAR(run(&masked)->echo[0].range_m, 2.03, 0, 0.03);
}

TEST(free_water_ends_at_a_masked_cell_that_always_is_loud)
{
    begin();
    counts[406] = 40; /* as loud as usual there, and louder than what would stand out of the water beside it */
    mask(4.06, 4.07);
    for (int k = 0; k < 20; k++)
        run(&masked);
    CHECK_INT(found.n, 0);
    CHECK_NEAR(found.free_to_m, 4.05, 0, 0.001); /* the cells around these bins hold the masked one */
}

TEST(what_begins_behind_a_mask_may_have_begun_under_it)
{
    begin();
    for (int i = 190; i < 210; i++)
        counts[i] = 200;
    mask(1.7, 2.0);
    CHECK_INT(run(&masked)->n, 1);
    CHECK_NEAR(found.echo[0].near_m, 1.7, 0, 0.021);
    CHECK(found.free_to_m <= 1.7101f);
}

/* A cell whose windows are masked throughout cannot be an echo; so it is not free either. */
TEST(cells_without_a_reference_are_not_free)
{
    begin();
    mask(0.6, 3.0);
    CHECK_INT(run(&masked)->n, 0);
    CHECK(found.free_to_m < 0.6f);
    begin();
    mask(0.45, 3.0);
    wall(counts, 0.36, 120);
    run(&masked);
    CHECK(found.n > 0 || found.free_to_m <= 0.36f);
}

TEST(a_mask_over_the_ring_down_may_reach_a_little_farther)
{
    begin();
    const float end_m = run(NULL)->blind_m;
    mask(0.0, (double)end_m + 0.05);
    CHECK_NEAR(run(&masked)->blind_m, (double)end_m + 0.05, 0, 0.021);
    CHECK_NEAR(found.free_to_m, 10.0, 0, 1e-5);
    mask(0.0, (double)end_m + 0.2); /* the vehicle's own frame right behind it */
    CHECK_NEAR(run(&masked)->blind_m, end_m, 0, 1e-6);
    CHECK(found.free_to_m <= found.blind_m);
}

TEST(the_lowest_class_is_no_echo_and_no_free_water)
{
    struct extract_aid aid = {.clean = clean, .lowest = 40};
    begin();
    wall(counts, 2.0, 120);
    wall(counts, 5.0, 200);
    wall(clean, 2.0, 40);
    wall(clean, 5.0, 41);
    CHECK_INT(run(&aid)->n, 1);
    CHECK_NEAR(found.echo[0].range_m, 5.03, 0, 0.03);
    CHECK(found.free_to_m > 1.8f && found.free_to_m <= 2.0f);
    aid.lowest = -1; /* no class step: the image rules nothing out */
    CHECK_INT(run(&aid)->n, 2);
    wall(counts, 2.0, 255); /* saturated is loud, whatever the image says */
    aid.lowest = 40;
    CHECK_NEAR(run(&aid)->echo[0].range_m, 2.03, 0, 0.03);
}

TEST(the_papers_order_looks_at_the_cleaned_image)
{
    const struct extract_aid aid = {.clean = clean, .lowest = -1};
    begin();
    conf.order = EXTRACT_PAPER;
    set_up();
    wall(counts, 2.0, 120);
    wall(clean, 5.0, 120);
    CHECK_INT(run(&aid)->n, 1);
    CHECK_NEAR(found.echo[0].range_m, 5.03, 0, 0.03);
    CHECK_NEAR(run(NULL)->echo[0].range_m, 2.03, 0, 0.03); /* nothing was cleaned */
}

TEST(the_papers_order_keeps_the_class_step)
{
    struct extract_aid aid = {.clean = clean, .lowest = 40};
    begin();
    conf.order = EXTRACT_PAPER;
    set_up();
    wall(clean, 3.0, 40);
    wall(clean, 5.0, 41);
    CHECK_INT(run(&aid)->n, 1);
    CHECK_NEAR(found.echo[0].range_m, 5.03, 0, 0.03);
    aid.lowest = 41;
    CHECK_INT(run(&aid)->n, 0);
    aid.lowest = -1;
    CHECK_INT(run(&aid)->n, 2);
}

/* The classes are of what the detector leaves: loud clutter that it removes shifts no threshold. */
TEST(the_papers_classes_are_of_what_the_detector_leaves)
{
    static _Alignas(8) unsigned char room[1 << 16];
    struct survivors survivors;
    struct extract_aid aid = {.clean = clean, .lowest = 250, .survivors = &survivors};

    begin();
    conf.order = EXTRACT_PAPER;
    set_up();
    CHECK(survivors_size(4, BINS) <= sizeof room);
    survivors_init(&survivors, room, 4, BINS);
    survivors_begin(&survivors, 4, BINS);
    for (int i = 0; i < BINS; i++)
        clean[i] = (uint8_t)(i < 500 ? 60 - 60 * i / 500 : 0); /* clutter that no window lets through */
    wall(clean, 6.0, 40);
    wall(clean, 7.0, 120);
    wall(clean, 8.0, 200);
    CHECK_INT(run(&aid)->n, 2); /* the wall of 40 is of the lowest class, and what was handed in does not count */
    CHECK_NEAR(found.echo[0].range_m, 7.03, 0, 0.03);
    CHECK_INT(survivors.lowest, 40);
    survivors.row = 1; /* the row before counts, too */
    memset(clean, 0, sizeof clean);
    wall(clean, 5.0, 120);
    CHECK_INT(run(&aid)->n, 1);
    CHECK_INT(survivors.lowest, 40);
    survivors.row = 0; /* what a new turn no longer has does not */
    CHECK_INT(run(&aid)->n, 1);
    CHECK_INT(survivors.lowest, -1);
    conf.order = EXTRACT_SAFE;
    set_up();
    wall(counts, 5.0, 200);
    CHECK_INT(run(&aid)->n, 0); /* there they are the cleaned image's */
}

/* The least count of a thing at at_m, in even water, that is an echo. */
static int least_count(double at_m)
{
    for (int level = 41; level < 255; level++) {
        set_up(); /* knows no baseline */
        water(counts, 40);
        wall(counts, at_m, level);
        const struct beam_echoes *out = run(NULL);
        for (uint8_t i = 0; i < out->n; i++)
            if (fabs((double)out->echo[i].range_m - at_m) < 0.1)
                return level;
    }
    return 255;
}

/* The first count over the floor's 40 whose power, its fourth power, is over the factor. */
static int count_over(double alpha)
{
    return (int)floor(40 * pow(alpha, 0.25)) + 1;
}

/* Where the window lies on one side only, the factor is that of one side: so is the false-alarm rate. */
TEST(at_the_end_of_a_beam_the_factor_is_that_of_one_side)
{
    double both = 0.0, one = 0.0;
    begin();
    conf.min_contrast_db = 0;
    conf.floor_counts = 0;
    conf.false_alarm = 1e-4;
    conf.window_m = 0.3; /* ten cells of a pulse's length */
    set_up();
    CHECK(cfar_alpha(CFAR_SOCA, 10, 10, 0, 1e-4, &both) && cfar_alpha(CFAR_SOCA, 10, 0, 0, 1e-4, &one));
    CHECK_INT(least_count(5.0), count_over(both));
    CHECK_INT(least_count(BINS * DR_M - 0.1), count_over(one));
    CHECK(count_over(both) > count_over(one));
}

/* The beams that are done at once would have given the same. A mask of nothing makes them take the long way. */
TEST(a_quiet_beam_is_done_at_once_with_the_same_answer)
{
    static _Alignas(16) unsigned char other[1 << 19];
    struct extract *quick_way = NULL, *long_way = NULL;
    uint64_t seed = test_seed();
    int silent = 0;
    struct fault fault;

    begin();
    for (int k = 0; k < 3000; k++) {
        conf.detector = (enum cfar_detector)(test_random(&seed) % 4);
        conf.no_echo = (enum extract_no_echo)(test_random(&seed) % 3);
        conf.floor_counts = (uint32_t)(test_random(&seed) % 30);
        if (k % 100 == 0) { /* each has its own past */
            set_up();
            long_way = extract_init(other, &conf, BINS, &fault);
            quick_way = extract;
        }
        water(counts, (int)(test_random(&seed) % 12));
        for (uint64_t i = test_random(&seed) % 4; i > 0; i--)
            wall(counts, 0.3 + 9.0 * test_uniform(&seed), (int)(test_random(&seed) % 40));
        extract = quick_way;
        const struct beam_echoes quick = *run(NULL);
        silent += quick.n == 0;
        extract = long_way;
        run(&masked);
        CHECK(quick.state == found.state && quick.n == found.n && quick.blind_m == found.blind_m &&
              quick.free_to_m == found.free_to_m);
        CHECK(memcmp(quick.echo, found.echo, quick.n * sizeof quick.echo[0]) == 0);
    }
    CHECK(silent > 500 && silent < 2900);
}

TEST(under_a_raised_floor_silence_says_nothing)
{
    begin();
    for (int k = 0; k < 20; k++)
        CHECK_NEAR(run(NULL)->free_to_m, 10.0, 0, 1e-5);
    water(counts, 5 * FLOOR);
    CHECK_INT(run(NULL)->n, 0);
    CHECK(found.free_to_m <= found.blind_m + 0.05f);
    wall(counts, 3.0, 250);
    CHECK_INT(run(NULL)->n, 1); /* what is heard is there all the same */
    CHECK(found.free_to_m <= found.blind_m + 0.05f);
    water(counts, FLOOR);
    CHECK_NEAR(run(NULL)->free_to_m, 10.0, 0, 1e-5);
}

/* Something at 0.45 m keeps the beam ringing, and what lies behind it is silent. */
TEST(what_rings_with_the_head_casts_a_shadow)
{
    for (int learn = 0; learn < 2; learn++) {
        begin();
        conf.learn_ring_down = learn;
        set_up();
        for (int k = 0; k < 20; k++)
            run(NULL);
        const float usual_m = found.blind_m;
        for (int i = 12; i < 100; i++)
            counts[i] = (uint8_t)(i < 45 ? 254 - 2 * i : fmax(FLOOR, 164.0 * pow(10.0, -(i - 45) / 12.0)));
        run(NULL);
        CHECK(found.free_to_m <= 0.45f);
        if (learn)
            CHECK(found.n == 1 && found.blind_m < usual_m + 0.1f && found.echo[0].range_m < 0.6f);
        else
            CHECK(found.n == 0 && found.blind_m > usual_m + 0.1f);
    }
}

/* A wall beside the head does not lengthen its ringing but makes it louder: silence behind it is none, nor is a ghost
 * proof of free water. It stands at most bearings of many turns; a template that was learnt there masks it. */
TEST(a_louder_ring_casts_a_shadow)
{
    for (int learnt = 0; learnt < 2; learnt++) {
        begin();
        memset(blind, learnt, 20);
        for (int turn = 0; turn < 6; turn++)
            for (int k = 0; k < 200; k++) {
                const bool beside = k >= 60;
                water(counts, FLOOR);
                for (int i = 0; i < 12; i++)
                    counts[i] = (uint8_t)(beside ? 200 : 140);
                for (int i = 12; i < 40; i++)
                    counts[i] = (uint8_t)fmax(FLOOR, 140.0 * pow(10.0, -(i - 12) / 12.0));
                if (k % 2)
                    wall(counts, 4.0, 150);
                run(&masked);
                CHECK_INT(found.n, k % 2);
                CHECK(turn == 0 || (found.free_to_m > 3.9f) == !beside);
                CHECK(turn == 0 || !beside || found.heard_to_m <= found.heard_from_m);
            }
    }
}

/* A rod of the frame at 0.3 m rings with the head in one beam of ten, at 60 % of the template's counts or more. */
static void rod(uint8_t *sample, double share)
{
    for (int i = 12; i < 60; i++) {
        const double level = i < 34 ? 150.0 : 150.0 * pow(10.0, -(i - 34) / 12.0);
        sample[i] = (uint8_t)fmax(sample[i], fmin(255.0, share * level));
    }
}

/* How far water is free in a beam with the rod and, unless at 0 m, a wall, after many beams of other bearings. */
static float free_past_rod(const struct extract_aid *aid, double share, double wall_m)
{
    begin();
    conf.no_echo = EXTRACT_HEARD;
    set_up();
    for (int k = 0; k < 100; k++)
        run(NULL);
    rod(counts, share);
    if (wall_m > 0)
        wall(counts, wall_m, 200);
    memset(blind, 1, 60);
    run(aid);
    return found.heard_from_m < found.free_to_m ? found.free_to_m : 0.0f;
}

/* A template that is promised to hold the vehicle alone says how loud its parts are: those cast no shadow of their
 * own, where an echo shows that sound passed them. What is louder than the template does. */
TEST(a_part_that_rings_as_its_template_says_hides_nothing_more)
{
    static uint8_t own[BINS];
    const struct extract_aid promised = {.blind = blind, .own = own, .lowest = -1};
    water(own, 0);
    rod(own, 1.0);
    CHECK_NEAR(free_past_rod(&masked, 1.0, 4.0), 0.0, 0, 0);
    CHECK_NEAR(free_past_rod(&promised, 1.0, 4.0), 4.0, 0, 0.1);
    CHECK(found.heard_from_m >= 0.59f);
    CHECK_NEAR(free_past_rod(&promised, 1.3, 4.0), 4.0, 0, 0.1);
    CHECK_NEAR(free_past_rod(&promised, 1.6, 4.0), 0.0, 0, 0); /* 8 dB above it: something else is there, too */
    CHECK_NEAR(free_past_rod(&promised, 1.0, 0.0), 0.0, 0, 0); /* silence behind a part may be its shadow */
}

/* What free water speaks of: the prior, -27 dB of full scale, which 54 of 255 counts exceed under v^4; then 15 dB below
 * the usual first echo. */
TEST(the_reference_is_the_prior_or_what_the_echoes_say)
{
    struct extract_reference r;
    begin();
    CHECK(!extract_reference(extract, &r) && r.counts == 0);
    run(NULL);
    CHECK(extract_reference(extract, &r));
    CHECK_NEAR(r.level_db, -27.0, 0, 1e-6);
    CHECK_INT(r.counts, 54);
    CHECK_INT(r.shown, 0);
    wall(counts, 4.0, 250);
    for (int k = 0; k < 200; k++)
        run(NULL);
    CHECK(extract_reference(extract, &r));
    CHECK_NEAR(r.level_db, 40 * log10(250.0 / 255.0) - 15.2, 0, 0.1);
    CHECK_INT(r.shown, 1);
    conf.target_db = 18.0;
    set_up();
    run(NULL);
    CHECK(extract_reference(extract, &r));
    CHECK_NEAR(r.level_db, -45.0, 0, 1e-6);
    conf.law = AMPLITUDE_LOG; /* of so few decibels that every count is louder */
    conf.db_per_count = 0.1;
    set_up();
    run(NULL);
    CHECK(extract_reference(extract, &r));
    CHECK(r.level_db < -60.0 && r.counts == 0);
}

TEST(ranges_that_take_turns_forget_nothing)
{
    begin();
    for (int k = 0; k < 60; k++) {
        dr_m = k % 3 ? DR_M : 2 * DR_M;
        CHECK_NEAR(run(NULL)->free_to_m, BINS * dr_m, 0, 1e-4);
    }
    water(counts, 5 * FLOOR);
    for (int k = 0; k < 2; k++) {
        dr_m = k ? DR_M : 2 * DR_M;
        CHECK(run(NULL)->free_to_m <= found.blind_m + 0.1f);
    }
}

TEST(usual_is_the_lower_median_of_the_last_pings)
{
    uint64_t seed = test_seed(), all[500], got;
    struct usual u;
    usual_init(&u, 64, 4);
    for (uint32_t n = 0; n < 500; n++) {
        uint32_t below = 0, not_above = 0, held = n < 64 ? n : 64;
        CHECK_INT(usual_get(&u, &got), n >= USUAL_LEAST);
        for (uint32_t i = n - held; n >= USUAL_LEAST && i < n; i++) {
            below += all[i] < got;
            not_above += all[i] <= got;
        }
        CHECK(n < USUAL_LEAST || (below <= (held - 1) / 2 && not_above > (held - 1) / 2));
        usual_add(&u, all[n] = test_random(&seed) % 20);
    }
}

int main(void)
{
    RUN(a_masked_wall_is_none_and_casts_a_shadow);
    RUN(masked_cells_are_in_no_reference);
    RUN(free_water_ends_at_a_masked_cell_that_always_is_loud);
    RUN(what_begins_behind_a_mask_may_have_begun_under_it);
    RUN(cells_without_a_reference_are_not_free);
    RUN(a_mask_over_the_ring_down_may_reach_a_little_farther);
    RUN(the_lowest_class_is_no_echo_and_no_free_water);
    RUN(the_papers_order_looks_at_the_cleaned_image);
    RUN(the_papers_order_keeps_the_class_step);
    RUN(the_papers_classes_are_of_what_the_detector_leaves);
    RUN(at_the_end_of_a_beam_the_factor_is_that_of_one_side);
    RUN(a_quiet_beam_is_done_at_once_with_the_same_answer);
    RUN(under_a_raised_floor_silence_says_nothing);
    RUN(what_rings_with_the_head_casts_a_shadow);
    RUN(a_louder_ring_casts_a_shadow);
    RUN(a_part_that_rings_as_its_template_says_hides_nothing_more);
    RUN(the_reference_is_the_prior_or_what_the_echoes_say);
    RUN(ranges_that_take_turns_forget_nothing);
    RUN(usual_is_the_lower_median_of_the_last_pings);
    return test_end();
}
