/* SPDX-License-Identifier: MIT */
/* Ranges that an echosounder has chosen, against profiles of 200 counts that were made here. */
#include "grid/range/choice.h"

#include "tests/lib/test.h"

#define IMAGENEX "../shared/data/imagenex852-echosounder/"

#define BINS  200
#define DR    0.05 /* 10 m */
#define PULSE 0.075f
#define DEAF  0.5f

static uint8_t counts[BINS];
static struct ping ping;
static struct choice choice;

/* A scan from r0_m on of quiet water. */
static void begin(double r0_m, uint8_t noise)
{
    memset(counts, noise, sizeof counts);
    ping = (struct ping){.kind = PING_CHOICE,
                         .law = AMPLITUDE_LINEAR,
                         .sample_bytes = 1,
                         .n_beams = 1,
                         .n_bins = BINS,
                         .r0_m = (float)r0_m,
                         .dr_m = (float)DR,
                         .pulse_m = PULSE,
                         .deaf_m = DEAF,
                         .samples = counts};
}

static void echo(double from_m, double to_m, uint8_t count)
{
    for (unsigned i = 0; i < BINS; i++) {
        const double middle_m = (double)ping.r0_m + (i + 0.5) * DR;
        if (middle_m >= from_m && middle_m < to_m && counts[i] < count)
            counts[i] = count;
    }
}

/* The transducer rings at full scale to there, and falls by half in every bin after. */
static void ring(double to_m)
{
    unsigned fall = UINT8_MAX;
    for (unsigned i = 0; i < BINS; i++) {
        if ((double)ping.r0_m + i * DR >= to_m)
            fall /= 2;
        counts[i] = counts[i] > fall ? counts[i] : (uint8_t)fall;
    }
}

static const struct choice *judge(double range_m)
{
    static const struct choice_ring unknown = {.promised_m = -1.0};
    choice_judge(&ping, 0, range_m, &unknown, &choice);
    return &choice;
}

static bool frees_nothing(const struct choice *c)
{
    return c->from_m >= c->to_m;
}

struct bump {
    double from_m, to_m;
    uint8_t count;
};

TEST(the_first_echo_as_strong_ends_the_free_water)
{
    static const struct {
        const char *name;
        double range_m;
        struct bump bump[3];
        double to_m, echo_m; /* 0: none */
        bool weaker;
    } row[] = {
        {"the choice alone", 8, {{8, 8.3, 250}}, 8, 0, false},
        {"chosen at its loudest, it rises before", 8, {{7.5, 7.9, 130}, {7.9, 8.2, 250}}, 7.5, 0, false},
        {"chosen a little before its echo", 7.9, {{8, 8.3, 250}}, 8, 0, false},
        {"chosen a little behind its echo, as devices smooth", 8.4, {{8, 8.2, 250}}, 8, 0, false},
        {"another at full scale", 8, {{3, 3.3, 255}, {8, 8.3, 250}}, 2.9625, 3.025, false},
        {"another, as loud", 8, {{3, 3.3, 250}, {8, 8.3, 250}}, 2.9625, 3.025, false},
        {"another, half as loud", 8, {{3, 3.3, 126}, {8, 8.3, 250}}, 2.9625, 3.025, true},
        {"the chosen one is the weak one", 8, {{3, 3.3, 255}, {8, 8.3, 60}}, 2.9625, 3.025, false},
        {"its tail comes and goes", 8, {{8, 8.15, 250}, {8.25, 8.3, 180}, {8.4, 8.45, 140}}, 8, 0, false},
        {"side echoes, clearly weaker", 8, {{3, 3.3, 100}, {5, 5.1, 115}, {8, 8.3, 250}}, 8, 0, false},
        {"the same at a higher gain", 8, {{3, 3.3, 40}, {5, 5.1, 46}, {8, 8.3, 100}}, 8, 0, false},
        {"three of them", 8, {{2, 2.1, 200}, {4, 4.1, 200}, {8, 8.3, 250}}, 1.9625, 2.025, true},
        {"a long one before", 8, {{2, 5, 220}, {8, 8.3, 250}}, 1.9625, 2.025, true},
        {"behind the choice", 3, {{3, 3.3, 200}, {8, 8.3, 255}}, 3, 0, false},
    };

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++)
        for (double r0_m = 0; r0_m <= 0.5; r0_m += 0.5) {
            begin(r0_m, 6);
            if (r0_m <= 0)
                ring(0.25);
            for (int k = 0; k < 3; k++)
                echo(row[i].bump[k].from_m, row[i].bump[k].to_m, row[i].bump[k].count);
            judge(row[i].range_m);
            CHECK(choice.heard && !choice.rings);
            CHECK_NEAR(choice.from_m, 0.5, 1e-6, 0);
            CHECK_NEAR(choice.to_m, row[i].to_m, 0, 1e-5);
            CHECK_NEAR(choice.echo_m, row[i].echo_m, 0, 1e-5);
            CHECK_INT(choice.weaker, row[i].weaker);
            CHECK(choice.echo_m <= 0 || (choice.echo_near_m >= choice.to_m && choice.echo_near_m < choice.echo_m));
            if (test_case_failed) {
                printf("(%s, scan from %g m)\n", row[i].name, r0_m);
                return;
            }
        }
}

TEST(a_choice_without_an_echo_frees_nothing)
{
    static const struct {
        const char *name;
        double range_m;
        uint8_t noise;
        struct bump bump[2];
        double echo_m; /* what the profile shows all the same */
    } row[] = {
        {"nothing at all", 8, 6, {{0, 0, 0}}, 0},
        {"zeros", 8, 0, {{0, 0, 0}}, 0},
        {"one value", 8, 100, {{0, 0, 0}}, 0},
        {"full scale", 8, 255, {{0, 0, 0}}, 0},
        {"a few counts", 8, 2, {{8, 8.2, 4}}, 0},
        {"an echo elsewhere", 8, 6, {{3, 3.3, 255}}, 3.025},
        {"only behind", 3, 6, {{8, 8.3, 255}}, 0},
        {"hardly above the water", 8, 100, {{8, 8.3, 180}}, 0},
        {"beyond the scan", 12, 6, {{3, 3.3, 255}}, 3.025},
        {"before it", 0.3, 6, {{3, 3.3, 255}}, 0},
    };

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin(0.5, row[i].noise);
        for (int k = 0; k < 2; k++)
            echo(row[i].bump[k].from_m, row[i].bump[k].to_m, row[i].bump[k].count);
        judge(row[i].range_m);
        CHECK(!choice.heard && frees_nothing(&choice));
        CHECK_NEAR(choice.echo_m, row[i].echo_m, 0, 1e-5);
        if (test_case_failed) {
            printf("(%s)\n", row[i].name);
            return;
        }
    }
}

/* Noise that the gain has lifted to full scale, of pressure or power; the loudest, any or no range is chosen in it. */
TEST(noise_frees_nothing)
{
    enum { PROFILES = 1000 };
    static const char *const chosen[] = {"the loudest", "any", "none"};
    uint64_t seed = test_seed();

    for (int how = 0; how < 6; how++) {
        unsigned freed = 0;
        for (int k = 0; k < PROFILES; k++) {
            unsigned most = 0;
            double x[BINS];
            begin(0.5, 0);
            for (unsigned i = 0; i < BINS; i++) {
                const double power = -log(1.0 - test_uniform(&seed));
                x[i] = how < 3 ? sqrt(power) : power;
                most = x[i] > x[most] ? i : most;
            }
            for (int i = 0; i < BINS; i++)
                counts[i] = (uint8_t)(255.0 * x[i] / x[most]);
            const double any_m = 0.5 + 10.0 * test_uniform(&seed);
            freed += !frees_nothing(judge(how % 3 == 0 ? 0.5 + (most + 0.5) * DR : how % 3 == 1 ? any_m : 0.0));
        }
        printf("# noise of %s, %s chosen: %u of %d profiles free water\n", how < 3 ? "pressure" : "power",
               chosen[how % 3], freed, PROFILES);
        CHECK(freed <= (how < 3 ? 0.005 : 0.06) * PROFILES);
    }
}

/* What is near is in the ring-down, or right behind it; from the first ping on. */
TEST(something_near_frees_nothing_behind_it)
{
    static const struct {
        const char *name;
        double r0_m, ring_m, range_m;
        struct bump bump[3];
        bool rings;
    } row[] = {
        {"0.2 m is read as 0.7", 0.5, 0, 0.7, {{0.7, 0.8, 255}}, false},
        {"the same, its scan begins at the transducer", 0, 0.25, 0.7, {{0.7, 0.8, 255}}, false},
        {"its double", 0, 0.25, 0.9, {{0.45, 0.55, 255}, {0.9, 1, 200}}, false},
        {"its double at 0.99 m", 0.5, 0, 0.99, {{0.98, 1.1, 255}}, false},
        {"its third bounce", 0.5, 0, 1.35, {{0.9, 1, 200}, {1.35, 1.45, 120}}, false},
        {"behind the ring-down, the bottom chosen", 0, 0.25, 8, {{0.4, 0.48, 255}, {8, 8.3, 255}}, false},
        {"beyond it, the bottom chosen", 0, 0.25, 8, {{0.55, 0.65, 255}, {8, 8.3, 255}}, false},
        {"a ring-down for too long", 0, 0.8, 8, {{8, 8.3, 255}}, true},
        {"in it and beyond", 0, 0.3, 8, {{0.3, 0.65, 255}, {8, 8.3, 255}}, true},
        {"where the scan begins", 0.5, 0, 8, {{0.5, 0.6, 255}, {8, 8.3, 255}}, true},
        {"where a scan begins that hears no ring-down", 2, 0, 8, {{2, 2.1, 255}, {8, 8.3, 255}}, true},
    };

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin(row[i].r0_m, 6);
        if (row[i].ring_m > 0)
            ring(row[i].ring_m);
        for (int k = 0; k < 3; k++)
            echo(row[i].bump[k].from_m, row[i].bump[k].to_m, row[i].bump[k].count);
        judge(row[i].range_m);
        CHECK(frees_nothing(&choice));
        CHECK_INT(choice.rings, row[i].rings);
        if (test_case_failed) {
            printf("(%s: %g to %g m)\n", row[i].name, choice.from_m, choice.to_m);
            return;
        }
    }
}

/* A longer pulse rings for longer; what the configuration promises is believed. */
TEST(the_ring_down_ends_where_the_transducer_does_or_as_promised)
{
    struct choice_ring known = {.promised_m = -1.0};
    begin(0, 6);
    ring(0.8);
    echo(8, 8.3, 250);
    CHECK(frees_nothing(judge(8)));
    ping.deaf_m = 0.9f;
    CHECK_NEAR(judge(8)->to_m, 8, 0, 1e-5);
    CHECK(choice.from_m >= 0.8 && choice.from_m <= 0.95);
    ping.deaf_m = DEAF;
    known.promised_m = 1.0;
    choice_judge(&ping, 0, 8, &known, &choice);
    CHECK_NEAR(choice.from_m, 1, 0, 1e-5);
    CHECK_NEAR(choice.to_m, 8, 0, 1e-5);
}

/* As loud for longer than usual, and yet not longer than any transducer rings. */
TEST(a_ring_down_longer_than_learnt_hides)
{
    struct choice_ring known = {.promised_m = -1.0};
    for (unsigned bottom = 60; bottom < 250; bottom += 60) { /* whatever the gain makes of it */
        begin(0, 6);
        ring(0.2);
        echo(8, 8.3, (uint8_t)bottom);
        judge(8);
        CHECK_NEAR(choice.to_m, 8, 0, 1e-5);
        known = (struct choice_ring){true, choice.loud_until, -1.0};
        choice_judge(&ping, 0, 8, &known, &choice);
        CHECK(!choice.rings);
        echo(0.2, 0.45, 255);
        CHECK(!judge(8)->rings);
        choice_judge(&ping, 0, 8, &known, &choice);
        CHECK(choice.rings && frees_nothing(&choice));
    }
}

/* Without a choice the loudest echo stands for it, and is a weak one. */
TEST(a_device_that_chose_nothing_frees_what_its_profile_shows)
{
    begin(0.5, 6);
    CHECK(frees_nothing(judge(0)));
    echo(8, 8.3, 250);
    CHECK_NEAR(judge(0)->to_m, 8, 0, 1e-5);
    CHECK(choice.echo_m > 8 && choice.echo_m < 8.1 && choice.weaker);
    echo(3, 3.2, 200);
    CHECK_NEAR(judge(0)->to_m, 3, 0, 1e-5);
    CHECK(choice.echo_m > 3 && choice.echo_m < 3.2 && choice.weaker);
    CHECK_NEAR(choice.echo_near_m, 2.9625, 0, 1e-5);
    echo(0.6, 0.7, 200);
    CHECK(frees_nothing(judge(0)));
    CHECK(choice.echo_m > 0.6 && choice.echo_m < 0.7);
}

TEST(any_profile_is_judged)
{
    uint64_t seed = test_seed();
    static uint16_t wide[BINS];
    for (int k = 0; k < 20000; k++) {
        struct choice_ring known = {test_random(&seed) % 2, test_random(&seed) % 300,
                                    2.0 * test_uniform(&seed) - 1.0};
        const double range_m = test_random(&seed) % 4 ? 15.0 * test_uniform(&seed) : 0.0;
        begin(0.5 * (double)(test_random(&seed) % 3), 0);
        ping.n_bins = 1 + (uint32_t)(test_random(&seed) % BINS);
        ping.pulse_m = (float)test_uniform(&seed);
        ping.deaf_m = (float)(2.0 * test_uniform(&seed));
        ping.sample_bytes = (uint8_t)(1 + k % 2);
        ping.samples = k % 2 ? (void *)wide : (void *)counts;
        for (int i = 0; i < BINS; i++) {
            counts[i] = (uint8_t)(test_random(&seed) % 4 ? 0 : test_random(&seed) % 256);
            wide[i] = (uint16_t)(257 * counts[i]);
        }
        choice_judge(&ping, 0, range_m, &known, &choice);
        CHECK(choice.from_m >= (double)ping.deaf_m && choice.from_m >= known.promised_m);
        CHECK(choice.to_m >= 0 && choice.to_m <= (double)ping.r0_m + ping.n_bins * DR);
        CHECK(!choice.rings || choice.to_m <= 0);
        CHECK(choice.heard || choice.to_m <= 0);
        CHECK(choice.loud_until <= ping.n_bins);
    }
}

/* ---- an echosounder that sends its own choice beside its samples ---- */

#define SAMPLES 500

/* "ping,time,range m,chosen cm,n,v0..": false at the end. *chosen_m 0: it chose nothing. */
static bool next_reading(FILE *f, double *chosen_m)
{
    static char line[8192];
    unsigned most = 1, value[BINS] = {0};
    do
        if (!fgets(line, sizeof line, f))
            return false;
    while (line[0] == '#');
    char *at = strchr(strchr(line, ',') + 1, ',');
    const double range_m = strtod(at + 1, &at);
    *chosen_m = strtod(at + 1, &at) / 100;
    CHECK(strtol(at + 1, &at, 10) == SAMPLES);
    for (unsigned i = 0; i < SAMPLES; i++) {
        const unsigned v = (unsigned)strtoul(at + 1, &at, 10), bin = i * BINS / SAMPLES;
        value[bin] = v > value[bin] ? v : value[bin];
        most = v > most ? v : most;
    }
    begin(0, 0);
    ping.dr_m = (float)(range_m / BINS);
    for (int i = 0; i < BINS; i++)
        counts[i] = (uint8_t)(255 * value[i] / most);
    return true;
}

/* How many readings there are, and the share that stays of the metres from 0.5 m to the chosen range. */
static double stays(const char *path, unsigned *readings)
{
    FILE *f = fopen(path, "r");
    double chosen_m, before_m = 0, free_m = 0;
    *readings = 0;
    while (f && next_reading(f, &chosen_m)) {
        if (chosen_m <= 0)
            continue;
        const double near_m = chosen_m - fmax((double)PULSE, (double)ping.dr_m) / 2;
        ++*readings;
        judge(chosen_m);
        before_m += fmax(near_m - (double)DEAF, 0);
        free_m += fmax(fmin(choice.to_m, near_m) - choice.from_m, 0);
    }
    if (f)
        fclose(f);
    printf("# %s: %u readings, %.1f of %.1f m before what was chosen (%.1f %%)\n", path, *readings, free_m,
           before_m, 100 * free_m / before_m);
    return free_m / before_m;
}

/* The bottom at 8 m, chosen in all readings but the first. */
TEST(honest_readings_keep_their_water)
{
    unsigned readings;
    CHECK(stays(IMAGENEX "hydroball.csv", &readings) > 0.99);
    CHECK_INT(readings, 177);
}

/* Second echoes as strong, bubbles, and choices of neither from ping 190 on. */
TEST(readings_that_are_not_all_honest_lose_some)
{
    unsigned readings;
    const double share = stays(IMAGENEX "sonar.first400.csv", &readings);
    CHECK(share > 0.94 && share < 0.98);
    CHECK_INT(readings, 207);
}

int main(void)
{
    RUN(the_first_echo_as_strong_ends_the_free_water);
    RUN(a_choice_without_an_echo_frees_nothing);
    RUN(noise_frees_nothing);
    RUN(something_near_frees_nothing_behind_it);
    RUN(the_ring_down_ends_where_the_transducer_does_or_as_promised);
    RUN(a_ring_down_longer_than_learnt_hides);
    RUN(a_device_that_chose_nothing_frees_what_its_profile_shows);
    RUN(any_profile_is_judged);
    RUN_WITH(IMAGENEX "hydroball.csv", honest_readings_keep_their_water);
    RUN_WITH(IMAGENEX "sonar.first400.csv", readings_that_are_not_all_honest_lose_some);
    return test_end();
}
