/* SPDX-License-Identifier: MIT */
/*
 * test_comb - pulses of another sonar are known by their timing, and nothing else is: heads and other sonars whose
 * periods are drawn, whose hosts are late, and waters in which only reflectors are.
 */
#include "tests/lib/test.h"

#include "grid/range/comb.h"

#define SOUND_MPS 1500.0
#define WITHIN_M  1.0f

/* A head and what else sends; ranges are as far as the head hears. */
struct scene {
    double interval_s, late_s; /* of our pings: mean of what the host adds */
    double period_s;           /* of the other sonar; 0: there is none */
    double dated_s;            /* most that a ping's time is wrong */
    double range_m;
};

struct tally {
    unsigned pulses, due, others, others_due, believed, pings;
};

static struct comb comb;
static uint64_t seed;
static double t_s, other_s;

static void begin(void)
{
    comb_init(&comb, SOUND_MPS);
    t_s = 100.0;
    other_s = 100.0;
}

static double between(double low, double high)
{
    return low + (high - low) * test_uniform(&seed);
}

/* One ping with the given echo (0: none) and the other sonar's pulses; all of them are shown by this beam alone. */
static void ping(const struct scene *s, float echo_m, struct tally *n)
{
    float near_m[4];
    bool pulse[4];
    unsigned echoes = 0;
    t_s += s->interval_s - s->late_s * log(test_uniform(&seed) + 1e-9);
    comb_ping(&comb, (uint64_t)((t_s + between(0.0, s->dated_s)) * 1e9));
    if (s->period_s > 0.0)
        for (; other_s < t_s + 2.0 * s->range_m / SOUND_MPS; other_s += s->period_s)
            if (other_s > t_s && echoes < 3) {
                pulse[echoes] = true;
                near_m[echoes++] = (float)((other_s - t_s) * SOUND_MPS / 2.0);
            }
    if (echo_m > 0.0f) {
        unsigned at = echoes++;
        for (; at > 0 && near_m[at - 1] > echo_m; at--) {
            near_m[at] = near_m[at - 1];
            pulse[at] = pulse[at - 1];
        }
        near_m[at] = echo_m;
        pulse[at] = false;
    }
    const uint8_t due = comb_due(&comb, near_m, echoes, WITHIN_M);
    for (unsigned i = 0; i < echoes; i++) {
        n->pulses += pulse[i];
        n->due += pulse[i] && due >> i & 1;
        n->others += !pulse[i];
        n->others_due += !pulse[i] && due >> i & 1;
    }
    n->pings++;
    n->believed += comb.known;
    comb_learn(&comb, near_m, echoes, 0xff);
}

/* How far a time is from the nearest multiple of the period. */
static double off_by(double time_s, double period_s)
{
    return fabs(time_s - period_s * round(time_s / period_s));
}

TEST(pulses_are_known_by_their_timing)
{
    struct tally sum = {0};
    seed = test_seed();
    for (int k = 0; k < 60; k++) {
        struct scene s = {
            .late_s = between(0.0, 0.005), .dated_s = between(0.0, 0.002), .range_m = between(15.0, 50.0)};
        s.interval_s = 0.03 + s.range_m / 750.0;
        do
            s.period_s = between(0.04, 0.2);
        while (off_by(s.interval_s, s.period_s) < 0.012);
        struct tally learning = {0}, n = {0}; /* of the first 200 pings and of the others */
        begin();
        for (int i = 0; i < 400; i++) /* one ping in four has an echo of something, at any range */
            ping(&s, test_random(&seed) % 4 ? 0.0f : (float)between(0.5, s.range_m), i < 200 ? &learning : &n);
        sum.pulses += n.pulses;
        sum.due += n.due;
        sum.others += n.others;
        sum.others_due += n.others_due;
    }
    printf("# due: %u of %u pulses, %u of %u other echoes\n", sum.due, sum.pulses, sum.others_due, sum.others);
    CHECK(sum.due > 0.85 * sum.pulses);
    CHECK(sum.others_due < 0.15 * sum.others);
}

TEST(what_comes_at_any_time_is_no_comb)
{
    struct tally n = {0};
    seed = test_seed();
    for (int k = 0; k < 20; k++) {
        struct scene s = {.late_s = between(0.0, 0.002), .range_m = between(2.0, 50.0)};
        s.interval_s = 0.03 + s.range_m / 750.0;
        begin();
        for (int i = 0; i < 600; i++)
            ping(&s, (float)between(0.3, s.range_m), &n);
    }
    CHECK(n.believed < n.pings / 100);
}

/* Rings of reverberation that flicker, be our pings ever so regular: their ranges have nothing to do with the clock. */
TEST(fixed_ranges_are_no_comb)
{
    struct tally n = {0};
    seed = test_seed();
    for (int k = 0; k < 40; k++) {
        const double rings = between(1.0, 4.0), spread_m = between(0.0, 0.5);
        struct scene s = {.late_s = k % 2 ? 0.0 : between(0.0, 0.001), .range_m = between(5.0, 50.0)};
        s.interval_s = 0.03 + s.range_m / 750.0;
        begin();
        for (int i = 0; i < 400; i++) {
            const double ring = 1.0 + floor(between(0.0, rings));
            ping(&s, test_random(&seed) % 2 ? 0.0f : (float)(s.range_m * ring / 5.0 + between(0.0, spread_m)), &n);
        }
    }
    printf("# due: %u of %u\n", n.others_due, n.others);
    CHECK(n.others_due <= n.others / 500);
}

/* Along a wall the range changes from ping to ping, as that of pulses does. */
TEST(a_wall_is_no_comb)
{
    struct tally n = {0};
    seed = test_seed();
    for (int k = 0; k < 40; k++) {
        const double distance_m = between(1.0, 10.0), step = between(0.01, 0.07);
        struct scene s = {.range_m = 40.0, .interval_s = 0.03 + 40.0 / 750.0, .late_s = k % 2 ? 0.0 : 0.001};
        begin();
        for (int i = 0; i < 600; i++) {
            const double side = cos(i * step), other = cos(i * step - 2.2);
            const double echo_m =
                fmin(side > 0.0 ? distance_m / side : 1e9, other > 0.0 ? 2.0 * distance_m / other : 1e9);
            ping(&s, echo_m < s.range_m ? (float)echo_m : 0.0f, &n);
        }
    }
    printf("# due: %u of %u\n", n.others_due, n.others);
    CHECK(n.others_due <= n.others / 500);
}

/* Our pings come at a multiple of the other's period: every reflector's echo arrives when a pulse may be due. */
TEST(nothing_is_due_where_our_pings_keep_step_with_the_pulses)
{
    seed = test_seed();
    for (int times = 1; times <= 3; times++) {
        struct scene s = {.range_m = 20.0, .interval_s = 0.0937, .late_s = 0.001, .period_s = 0.07};
        struct tally n = {0};
        begin();
        for (int i = 0; i < 200; i++)
            ping(&s, 0.0f, &n);
        CHECK(comb.known);
        const double off_s = between(-0.0005, 0.0005);
        s.interval_s = times * 0.07 + off_s;
        s.late_s = 0.0;
        ping(&s, 0.0f, &n); /* the interval is known from here on */
        n = (struct tally){0};
        for (int i = 0; i < 100; i++)
            ping(&s, 8.0f, &n);
        CHECK_INT(n.due, 0);
        CHECK_INT(n.others_due, 0);
    }
}

TEST(a_period_is_not_trusted_for_longer_than_it_was_seen)
{
    const struct scene s = {.range_m = 20.0, .interval_s = 0.0937, .late_s = 0.001, .period_s = 0.07};
    struct scene quiet = s;
    struct tally n = {0};
    quiet.range_m = 0.0;
    seed = test_seed();
    for (int longer = 0; longer < 2; longer++) {
        begin();
        for (int i = 0; i < 100; i++)
            ping(&s, 0.0f, &n);
        CHECK(comb.known);
        for (int i = 0; i < (longer ? 200 : 50); i++)
            ping(&quiet, 0.0f, &n);
        n = (struct tally){0};
        for (int i = 0; n.pulses == 0; i++)
            ping(&s, 0.0f, &n);
        CHECK_INT(n.due, longer ? 0 : 1);
    }
}

/* Its host asks for another range, or our clock was set back. */
TEST(what_no_longer_keeps_time_is_forgotten)
{
    struct scene s = {.range_m = 30.0, .interval_s = 0.0937, .late_s = 0.001, .period_s = 0.07};
    struct tally n = {0};
    seed = test_seed();
    begin();
    for (int i = 0; i < 100; i++)
        ping(&s, 0.0f, &n);
    CHECK_NEAR(comb.period_s, 0.07, 1e-3, 0);
    s.period_s = 0.0613;
    for (int i = 0; i < 150; i++)
        ping(&s, 0.0f, &n);
    CHECK_NEAR(comb.period_s, 0.0613, 1e-3, 0);
    CHECK(comb.known);
    t_s -= 50.0;
    ping(&s, 0.0f, &n);
    CHECK(!comb.known);
}

/* A long pulse in speckle: its pieces are due where its beginning is, and alone they are not. It is hardly longer than
 * its last piece. */
TEST(pieces_of_a_pulse_are_due_with_it)
{
    const struct scene s = {.range_m = 40.0, .interval_s = 0.0937, .period_s = 0.07};
    unsigned pulses = 0, due = 0, apart_due = 0;
    seed = test_seed();
    begin();
    for (int i = 0; i < 300; i++) {
        t_s += s.interval_s + between(0.0, 0.003);
        comb_ping(&comb, (uint64_t)(t_s * 1e9));
        while (other_s < t_s + 0.002)
            other_s += s.period_s;
        const float lead_m = (float)((other_s - t_s) * SOUND_MPS / 2.0);
        const float near_m[] = {lead_m, lead_m + 0.9f, lead_m + 1.8f, lead_m + 2.6f};
        if (i > 200) {
            pulses++;
            due += comb_due(&comb, near_m, 4, WITHIN_M) == 7;
            apart_due += comb_due(&comb, near_m + 2, 1, WITHIN_M) != 0;
        }
        comb_learn(&comb, near_m, 3, 7);
    }
    CHECK(due > 0.9 * pulses);
    CHECK(apart_due < 0.1 * pulses);
}

TEST(any_times_and_ranges_are_taken)
{
    seed = test_seed();
    comb_init(&comb, SOUND_MPS);
    for (int k = 0; k < 20000; k++) {
        float near_m[4];
        for (int i = 0; i < 4; i++)
            near_m[i] = test_random(&seed) % 20 ? (float)(50.0 * test_uniform(&seed)) : i % 2 ? NAN : INFINITY;
        comb_ping(&comb, test_random(&seed) % 50 ? (uint64_t)k * 40000000 : test_random(&seed));
        const unsigned n = (unsigned)(test_random(&seed) % 5);
        CHECK((comb_due(&comb, near_m, n, WITHIN_M) & ~((1u << n) - 1)) == 0);
        comb_learn(&comb, near_m, n, (uint8_t)test_random(&seed));
    }
}

int main(void)
{
    RUN(pulses_are_known_by_their_timing);
    RUN(what_comes_at_any_time_is_no_comb);
    RUN(fixed_ranges_are_no_comb);
    RUN(a_wall_is_no_comb);
    RUN(nothing_is_due_where_our_pings_keep_step_with_the_pulses);
    RUN(a_period_is_not_trusted_for_longer_than_it_was_seen);
    RUN(what_no_longer_keeps_time_is_forgotten);
    RUN(pieces_of_a_pulse_are_due_with_it);
    RUN(any_times_and_ranges_are_taken);
    return test_end();
}
