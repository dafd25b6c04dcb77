/* SPDX-License-Identifier: MIT */
/* test_hearing - which pings show that their receiver hears: each rule by itself, and what it learns. */
#include "tests/lib/test.h"

#include <string.h>

#include "grid/range/hearing.h"

#define BINS 600

static struct amplitude law;
static struct profile_axis axis;
static struct hearing h;
static uint8_t counts[2 * BINS];
static double deaf_m;
static uint64_t seed;

/* A Ping360's bins of 1 cm, pulse 3 cm, and nothing learnt. */
static void begin(enum amplitude_law of)
{
    const struct ping ping = {.n_bins = BINS, .dr_m = 0.01f, .pulse_m = 0.03f};
    CHECK(profile_axis_of(&axis, &ping, 0.4, 0.1, BINS));
    CHECK(amplitude_init(&law, of, 1, 80.0 / 255.0));
    hearing_clear(&h);
    deaf_m = 0;
    seed = test_seed();
}

/* Noise of at least `low` and fewer than low + spread counts. */
static void noise(uint8_t *sample, unsigned low, unsigned spread)
{
    for (int i = 0; i < BINS; i++)
        sample[i] = (uint8_t)(low + (unsigned)(spread * test_uniform(&seed)));
}

/* From the transmission on it rings at `loud` counts to full_m, and loses a factor e every 4 cm. */
static void ring(uint8_t *sample, double loud, double full_m)
{
    for (int i = 0; i < BINS; i++) {
        const double count = loud * fmin(1.0, exp(-(i * 0.01 - full_m) / 0.04));
        sample[i] = (uint8_t)(count > sample[i] ? count : sample[i]);
    }
}

static struct hearing_levels levels(uint32_t beams)
{
    return hearing_levels_of(&axis, &law, counts, beams, deaf_m, 8);
}

static enum hearing_doubt take(void)
{
    const struct hearing_levels l = levels(1);
    return hearing_take(&h, &l);
}

static enum hearing_doubt water(unsigned low, double loud)
{
    noise(counts, low, 8);
    ring(counts, loud, 0.15);
    return take();
}

static void know(void)
{
    for (int i = 0; i < 500; i++)
        water(6, 255);
    CHECK_INT(water(6, 255), HEARING_HEARS);
}

TEST(a_ring_down_is_known_after_some_beams)
{
    begin(AMPLITUDE_SQRT);
    for (int i = 1; i < HEARING_LEAST; i++)
        CHECK_INT(water(6, 255), HEARING_NOT_LEARNT);
    CHECK_INT(water(6, 255), HEARING_HEARS);
    hearing_clear(&h);
    CHECK_INT(water(6, 255), HEARING_NOT_LEARNT);
}

/* A fan shows as much in one ping, and one of its beams says little of the others. */
TEST(the_beams_of_a_fan_are_taken_together)
{
    static uint8_t fan[32 * BINS];
    struct hearing_levels l;
    begin(AMPLITUDE_SQRT);
    noise(counts, 6, 8);
    ring(counts, 255, 0.15);
    for (int b = 0; b < 32; b++)
        memcpy(fan + b * BINS, counts, BINS);
    memset(fan + 4 * BINS, 7, BINS);
    l = hearing_levels_of(&axis, &law, fan, 32, 0, 8);
    CHECK_INT(hearing_take(&h, &l), HEARING_HEARS);
    for (int b = 0; b < 24; b++)
        memset(fan + b * BINS, 7, BINS);
    l = hearing_levels_of(&axis, &law, fan, 32, 0, 8);
    CHECK_INT(hearing_take(&h, &l), HEARING_CONSTANT);
}

/* Whatever is learnt, and whatever is not. */
TEST(without_a_ring_down_nothing_hears)
{
    static const enum amplitude_law laws[] = {AMPLITUDE_LINEAR, AMPLITUDE_SQRT, AMPLITUDE_LOG, AMPLITUDE_POWER};
    for (size_t k = 0; k < 4; k++)
        for (int known = 0; known < 2; known++) {
            begin(laws[k]);
            if (known)
                know();
            for (int i = 0; i < 100; i++) {
                noise(counts, 2, 3);
                CHECK_INT(take(), HEARING_NO_RING);
                memset(counts, 2 * i + 1, BINS);
                CHECK_INT(take(), HEARING_CONSTANT);
                noise(counts, 90, 40); /* loud first samples are none */
                CHECK_INT(take(), HEARING_NO_RING);
                for (int b = 0; b < BINS; b++) /* nor is noise that rises with the range */
                    counts[b] = (uint8_t)(4 + b / 4 + (int)(8 * test_uniform(&seed)));
                CHECK_INT(take(), HEARING_NO_RING);
            }
            CHECK_INT(water(6, 255),
                      known ? HEARING_HEARS : HEARING_NOT_LEARNT); /* no ping of them taught anything */
        }
}

/* Loud noise decays by chance in single pings; their mean does not. */
TEST(noise_is_learnt_as_no_ring_down)
{
    begin(AMPLITUDE_SQRT);
    for (int i = 0; i < 20000; i++) {
        for (int b = 0; b < BINS; b += 3) /* speckle of a pulse's length */
            memset(counts + b, (int)fmin(255.0, 60.0 * pow(-log(1.0 - test_uniform(&seed)), 0.25)), 3);
        if (take() == HEARING_HEARS) {
            CHECK_INT(i, -1);
            break;
        }
    }
}

/* What is left of it when the transducer's cable is off: the transmission itself. */
TEST(a_shorter_ring_down_is_another_ones)
{
    begin(AMPLITUDE_SQRT);
    know();
    noise(counts, 6, 8);
    memset(counts, 255, 4);
    CHECK_INT(take(), HEARING_NO_RING);
    hearing_clear(&h); /* nor from the first ping on: no head rings for no longer than it transmits */
    for (int i = 1; i < 200; i++) {
        noise(counts, 6, 8);
        memset(counts, 255, (size_t)(3 + i % 3));
        CHECK_INT(take(), i < HEARING_LEAST ? HEARING_NOT_LEARNT : HEARING_NO_RING);
    }
    for (int i = 1; i < 2 * HEARING_LEAST; i++) /* it is mended */
        water(6, 255);
    CHECK_INT(water(6, 255), HEARING_HEARS);
}

/* Where parts are long they hold the whole ring-down, and the transmission looks like it. */
TEST(a_coarse_axis_asks_for_no_more_than_a_decay)
{
    const struct ping ping = {.n_bins = BINS, .dr_m = 0.25f, .pulse_m = 0.1f};
    begin(AMPLITUDE_SQRT);
    CHECK(profile_axis_of(&axis, &ping, 0.4, 0.1, BINS));
    for (int i = 0; i < 20; i++) {
        noise(counts, 6, 8);
        counts[0] = 255;
        CHECK_INT(take(), i + 1 < HEARING_LEAST ? HEARING_NOT_LEARNT : HEARING_HEARS);
    }
}

/* Buffers that are sent again, whatever they show. */
TEST(noise_never_repeats)
{
    struct hearing_prints prints = {{0}};
    static uint8_t kept[2][BINS];
    begin(AMPLITUDE_SQRT);
    for (int i = 0; i < 500; i++) {
        water(6, 255);
        memcpy(kept[i % 2], counts, BINS);
        CHECK(!hearing_repeats(&prints, levels(1).print));
    }
    for (int i = 0; i < 10; i++) {
        struct hearing_levels l;
        memcpy(counts, kept[i % 2], BINS);
        l = levels(1);
        l.repeats = hearing_repeats(&prints, l.print);
        CHECK_INT(hearing_take(&h, &l), HEARING_FROZEN);
        hearing_prove(&h, &l); /* an echo in it proves nothing */
        CHECK_INT(h.proofs, 0);
    }
    CHECK_INT(water(6, 255), HEARING_HEARS);
    for (int i = 0; i < 10; i++) { /* at low gain hardly a sample is not zero */
        memset(counts, 0, BINS);
        ring(counts, 255, 0.15);
        memset(counts + 400, 90, 30);
        CHECK(!hearing_repeats(&prints, levels(1).print));
    }
}

/* Something near rings with the head at half of the bearings: the head's own is what the others have. */
TEST(what_rings_with_the_head_is_not_asked_for)
{
    begin(AMPLITUDE_SQRT);
    for (int i = 0; i < 1000; i++) {
        noise(counts, 6, 8);
        ring(counts, 255, i % 100 < 50 ? 0.5 : 0.15);
        CHECK(take() <= HEARING_NOT_LEARNT);
    }
    CHECK_INT(water(6, 255), HEARING_HEARS);
}

TEST(a_ring_down_that_dies_slowly_is_not_followed)
{
    begin(AMPLITUDE_SQRT);
    for (int i = 0; i < 500; i++)
        water(6, 200);
    int heard = 0;
    for (double loud = 200; loud > 20; loud *= 0.9995) /* by 40 dB */
        heard += water(6, loud) == HEARING_HEARS;
    CHECK(heard > 800 && heard < 1500); /* it is missed at 11 dB, counts of 106 */
    CHECK_INT(water(6, 60), HEARING_NO_RING);
    CHECK_INT(water(6, 190), HEARING_HEARS);
}

TEST(noise_that_is_lost_for_some_pings_is_a_dead_amplifier)
{
    begin(AMPLITUDE_LINEAR);
    for (int i = 0; i < 500; i++)
        water(40, 255);
    for (int i = 0; i < 3; i++)
        CHECK_INT(water(0, 255), HEARING_HEARS); /* one ping of a hundred is as quiet by chance */
    noise(counts, 1, 3);
    for (int i = 0; i < 4; i++) {
        noise(counts, 1, 3);
        ring(counts, 255, 0.15);
        take();
    }
    CHECK_INT(take(), HEARING_FAINT);
    CHECK_INT(water(10, 255), HEARING_HEARS); /* a thruster that stops */
}

/* Zeros at low gain: there is no noise to miss. */
TEST(silence_is_not_missed)
{
    begin(AMPLITUDE_SQRT);
    for (int i = 0; i < 600; i++) {
        memset(counts, 0, BINS);
        ring(counts, 255, 0.15);
        counts[400 + i % 100] = i % 3 == 0;
        CHECK(take() <= HEARING_NOT_LEARNT);
    }
}

TEST(where_the_ring_down_is_hidden_the_rest_decides)
{
    begin(AMPLITUDE_LINEAR);
    deaf_m = 0.5;
    for (int i = 0; i < 100; i++) {
        noise(counts, 20, 20);
        CHECK_INT(take(), HEARING_HEARS);
    }
    noise(counts, 3, 6);
    CHECK_INT(take(), HEARING_FAINT);
    memset(counts, 20, BINS);
    CHECK_INT(take(), HEARING_CONSTANT);
}

TEST(samples_vary_in_more_than_two_values)
{
    static const struct {
        uint8_t low, high;
        int step;
        bool varies;
    } row[] = {{7, 7, 1, false},     {7, 8, 1, false}, {0, 7, 7, false},  {100, 104, 1, false},
               {255, 255, 1, false}, {2, 4, 1, true},  {20, 23, 1, true}, {100, 120, 5, true},
               {0, 1, 1, true},      {1, 2, 1, true},  {1, 1, 1, false}};
    begin(AMPLITUDE_SQRT);
    for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
        for (int i = 0; i < BINS; i++)
            counts[i] = (uint8_t)(row[k].low + i * row[k].step % (row[k].high - row[k].low + row[k].step));
        if (hearing_varies(&law, counts, 0, BINS) != row[k].varies)
            CHECK_INT(k, -1);
    }
    memset(counts, 0, BINS);
    CHECK(hearing_varies(&law, counts, 0, BINS)); /* silence says nothing, here */
    memset(counts, 9, 40);
    CHECK(hearing_varies(&law, counts, 0, BINS)); /* few samples may be alike */
    memset(counts, 9, BINS);
    CHECK(hearing_varies(&law, counts, BINS - 20, BINS));
}

/* A head that was learnt beside something that is there no more, and has an echo now and then. */
TEST(echoes_prove_that_it_hears_otherwise_than_before)
{
    begin(AMPLITUDE_SQRT);
    for (int i = 0; i < 500; i++)
        water(6, 255);
    for (int i = 1; i < HEARING_LEAST; i++) {
        CHECK_INT(water(6, 100), HEARING_NO_RING);
        const struct hearing_levels l = levels(1);
        hearing_prove(&h, &l);
    }
    CHECK_INT(water(6, 255), HEARING_HEARS); /* it does as before: these were others */
    for (int i = 1; i < HEARING_LEAST; i++) {
        CHECK_INT(water(6, 100), HEARING_NO_RING);
        const struct hearing_levels l = levels(1);
        hearing_prove(&h, &l);
    }
    noise(counts, 6, 8); /* interference that looks like one proves nothing where there is no ring-down at all */
    for (int i = 0; i < 100; i++) {
        const struct hearing_levels l = levels(1);
        hearing_prove(&h, &l);
    }
    CHECK_INT(water(6, 100), HEARING_NO_RING);
    const struct hearing_levels l = levels(1);
    hearing_prove(&h, &l);
    CHECK_INT(water(6, 100), HEARING_NOT_LEARNT);
}

TEST(an_alarm_begins_and_ends_once)
{
    struct hearing_alarm alarm = {0};
    for (int i = 0; i < 100; i++) { /* single pings are none */
        hearing_alarm_take(&alarm, i % 10 ? HEARING_HEARS : HEARING_NO_RING);
        CHECK_INT(alarm.doubt, HEARING_HEARS);
    }
    hearing_alarm_take(&alarm, HEARING_NOT_LEARNT);
    CHECK_INT(alarm.doubt, HEARING_HEARS);
    for (int i = 0; i < HEARING_LEAST; i++)
        hearing_alarm_take(&alarm, HEARING_FAINT);
    CHECK_INT(alarm.doubt, HEARING_FAINT);
    for (int i = 0; i < 100; i++)
        hearing_alarm_take(&alarm, i % 10 ? HEARING_FAINT : HEARING_HEARS);
    CHECK_INT(alarm.doubt, HEARING_FAINT);
    for (int i = 0; i < HEARING_LEAST; i++)
        hearing_alarm_take(&alarm, HEARING_NOT_LEARNT);
    CHECK_INT(alarm.doubt, HEARING_HEARS);
    alarm = (struct hearing_alarm){0};
    for (int i = 0; i < 64; i++) { /* every second ping */
        CHECK_INT(alarm.doubt, i < 2 * HEARING_OFTEN - 1 ? HEARING_HEARS : HEARING_NO_RING);
        hearing_alarm_take(&alarm, i % 2 ? HEARING_HEARS : HEARING_NO_RING);
    }
    CHECK(hearing_doubt_text(HEARING_HEARS) == NULL && hearing_doubt_text(HEARING_NOT_LEARNT) == NULL);
}

int main(void)
{
    RUN(a_ring_down_is_known_after_some_beams);
    RUN(the_beams_of_a_fan_are_taken_together);
    RUN(without_a_ring_down_nothing_hears);
    RUN(noise_is_learnt_as_no_ring_down);
    RUN(a_shorter_ring_down_is_another_ones);
    RUN(a_coarse_axis_asks_for_no_more_than_a_decay);
    RUN(noise_never_repeats);
    RUN(what_rings_with_the_head_is_not_asked_for);
    RUN(a_ring_down_that_dies_slowly_is_not_followed);
    RUN(noise_that_is_lost_for_some_pings_is_a_dead_amplifier);
    RUN(silence_is_not_missed);
    RUN(where_the_ring_down_is_hidden_the_rest_decides);
    RUN(samples_vary_in_more_than_two_values);
    RUN(echoes_prove_that_it_hears_otherwise_than_before);
    RUN(an_alarm_begins_and_ends_once);
    return test_end();
}
