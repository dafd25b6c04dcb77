/* SPDX-License-Identifier: MIT */
/* test_free_interval - the intervals of a direction against a table of every centimetre of it: nothing is free that no
 * ping freed, or that a later echo took back, and nothing is younger than the ping that freed it. */
#include <math.h>
#include <string.h>

#include "grid/picture/free_interval.h"
#include "tests/lib/test.h"

#define POINTS 1000 /* one a centimetre */
#define SECOND 1000000000ull

static struct free_interval list[FREE_INTERVALS];
static uint64_t freed_ns[POINTS]; /* by the newest ping that did; 0: none, or taken back */

static double at(int point)
{
    return (point + 0.5) / 100;
}

static void add(const struct stretch *s, const struct free_ping *ping)
{
    free_add(list, s, ping);
    for (int i = 0; i < POINTS; i++) {
        if (at(i) >= s->from_m && at(i) <= s->to_m)
            freed_ns[i] = ping->t_ns;
        else if (at(i) > s->look_to_m && !s->leaves_aside && s->ends_at_echo)
            freed_ns[i] = 0;
    }
}

static void start(void)
{
    free_none(list);
    memset(freed_ns, 0, sizeof freed_ns);
}

static const struct free_interval *holding(double r)
{
    for (int k = 0; k < FREE_INTERVALS; k++)
        if (list[k].t_ping_ns && r >= (double)list[k].from_m && r <= (double)list[k].to_m)
            return &list[k];
    return NULL;
}

static struct stretch random_stretch(uint64_t *seed)
{
    const double a = 10 * test_uniform(seed), b = 10 * test_uniform(seed), share = fmin(1, 2 * test_uniform(seed));
    return (struct stretch){.from_m = a < b ? a : b,
                            .to_m = share < 0.1 ? 0 : fmin(a, b) + share * fabs(a - b), /* or nothing is free */
                            .look_from_m = a < b ? a : b,
                            .look_to_m = a < b ? b : a,
                            .enters_aside = test_uniform(seed) < 0.5,
                            .leaves_aside = test_uniform(seed) < 0.5,
                            .ends_at_echo = test_uniform(seed) < 0.3};
}

TEST(nothing_is_free_that_no_ping_freed_and_nothing_is_too_young)
{
    uint64_t seed = test_seed();
    int invented = 0, young = 0, kept = 0, freed = 0;
    double older_s = 0;
    for (int trial = 0; trial < 200; trial++) {
        struct free_ping ping = {.t_ns = 100 * SECOND};
        start();
        for (int n = 0; n < 30; n++) {
            const struct stretch s = random_stretch(&seed);
            ping.t_ns += (uint64_t)(test_uniform(&seed) * (test_uniform(&seed) < 0.5 ? 0.1 : 8) * SECOND);
            ping.path_m += test_uniform(&seed);
            add(&s, &ping);
            for (int i = 0; i < POINTS; i++) {
                const struct free_interval *f = holding(at(i));
                invented += f && !freed_ns[i];
                young += f && freed_ns[i] && f->t_ping_ns > freed_ns[i];
                kept += f && freed_ns[i];
                freed += freed_ns[i] != 0;
                older_s += f && freed_ns[i] ? (double)(freed_ns[i] - f->t_ping_ns) * 1e-9 : 0;
            }
        }
    }
    CHECK_INT(invented, 0);
    CHECK_INT(young, 0);
    CHECK(kept > freed / 2);
    printf("# %d of %d freed centimetres are kept, older by %.2f s than they are\n", kept, freed, older_s / kept);
}

/* The same pings, the newest first: what is made anew holds no more either, and hardly less. */
TEST(intervals_made_anew_hold_what_pings_freed_and_no_more)
{
    enum { PINGS = 30 };
    uint64_t seed = test_seed();
    int invented = 0, young = 0, kept = 0, freed = 0;
    for (int trial = 0; trial < 1000; trial++) {
        struct stretch s[PINGS];
        struct free_ping ping[PINGS];
        float limit_m = INFINITY;
        start();
        for (unsigned n = 0; n < PINGS; n++) {
            s[n] = random_stretch(&seed);
            ping[n] = (struct free_ping){.t_ns = (100 + n) * SECOND};
            add(&s[n], &ping[n]);
        }
        free_none(list);
        for (unsigned n = PINGS; n > 0; n--)
            free_fill(list, &s[n - 1], &ping[n - 1], &limit_m);
        for (int i = 0; i < POINTS; i++) {
            const struct free_interval *f = holding(at(i));
            invented += f && !freed_ns[i];
            young += f && freed_ns[i] && f->t_ping_ns > freed_ns[i];
            kept += f && freed_ns[i];
            freed += freed_ns[i] != 0;
        }
    }
    CHECK_INT(invented, 0);
    CHECK_INT(young, 0);
    CHECK(kept > freed * 9 / 10);
    printf("# %d of %d freed centimetres are kept\n", kept, freed);
}

TEST(neighbours_of_a_revolution_are_one_interval)
{
    start();
    for (unsigned k = 0; k < 10; k++) {
        const struct free_ping ping = {.t_ns = SECOND + k * SECOND / 10, .path_m = 0.1 * k};
        const struct stretch s = {
            .from_m = k, .to_m = k + 1.1, .look_to_m = k + 1.1, .enters_aside = k > 0, .leaves_aside = true};
        add(&s, &ping);
    }
    const struct free_interval run = free_longest(list, FREE_INTERVALS);
    CHECK_NEAR(run.from_m, 0, 0, 1e-6);
    CHECK_NEAR(run.to_m, 10.1, 0, 1e-5);
    CHECK_INT(run.t_ping_ns, SECOND);
    CHECK_NEAR(run.path_m, 0, 0, 0);
}

/* A ring-down that ends a bin later, and less range: the rest of what was free before grows old by itself. */
TEST(what_a_ping_no_longer_covers_makes_nothing_else_old)
{
    const struct stretch before = {.from_m = 0.267, .to_m = 9.01}, after = {.from_m = 0.275, .to_m = 9};
    struct free_ping ping = {.t_ns = SECOND};
    start();
    add(&before, &ping);
    for (int n = 0; n < 5; n++) {
        ping.t_ns += SECOND;
        ping.path_m += 0.1;
        ping.sensor = 1;
        add(&after, &ping);
        CHECK_INT(holding(0.276)->t_ping_ns, ping.t_ns);
        CHECK_INT(holding(8.999)->t_ping_ns, ping.t_ns);
        CHECK_INT(holding(5)->sensors, 2);
        CHECK_NEAR(holding(5)->path_m, ping.path_m, 0, 0);
        CHECK_INT(holding(0.27)->t_ping_ns, SECOND);
        CHECK_INT(holding(9.005)->t_ping_ns, SECOND);
    }
}

/* Where there is no room for all, the bin beside most of the ray does not make it older, be it by little. */
TEST(without_room_the_least_water_grows_older)
{
    static const struct {
        double from_m, to_m;
        unsigned second;
    } row[] = {{0.27, 0.3, 2}, {0.3, 6, 3}, {6, 6.5, 6}, {6.5, 7, 20}, {7, 8, 30}};
    start();
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        const struct free_ping ping = {.t_ns = row[i].second * SECOND};
        add(&(struct stretch){.from_m = row[i].from_m, .to_m = row[i].to_m}, &ping);
    }
    CHECK_INT(holding(0.28)->t_ping_ns, 2 * SECOND);
    CHECK_INT(holding(3)->t_ping_ns, 3 * SECOND);
    CHECK_INT(holding(6.2)->t_ping_ns, 3 * SECOND);
    CHECK_INT(holding(6.8)->t_ping_ns, 20 * SECOND);
    CHECK_INT(holding(7.05)->t_ping_ns, 30 * SECOND);
}

TEST(what_is_heard_no_farther_takes_nothing_back_and_an_echo_does)
{
    const struct free_ping before = {.t_ns = SECOND}, later = {.t_ns = 40 * SECOND};
    const struct stretch far = {.from_m = 0.5, .to_m = 9}, near = {.from_m = 1, .to_m = 4},
                         echo = {.from_m = 1, .to_m = 3, .look_to_m = 3, .ends_at_echo = true};
    start();
    add(&far, &before);
    add(&near, &later);
    struct free_interval run = free_longest(list, FREE_INTERVALS);
    CHECK_NEAR(run.from_m, 0.5, 0, 1e-6);
    CHECK_NEAR(run.to_m, 9, 0, 1e-6);
    CHECK_INT(run.t_ping_ns, SECOND);
    CHECK_INT(list[0].t_ping_ns, 40 * SECOND);
    add(&echo, &later);
    run = free_longest(list, FREE_INTERVALS);
    CHECK_NEAR(run.to_m, 3, 0, 1e-6);
}

TEST(a_ping_that_received_nothing_usable_takes_all_back)
{
    const struct free_ping before = {.t_ns = SECOND}, later = {.t_ns = 2 * SECOND};
    const struct stretch s = {.from_m = 0.5, .to_m = 9};
    start();
    add(&s, &before);
    free_withdraw(list, &later);
    CHECK_INT(free_longest(list, FREE_INTERVALS).t_ping_ns, 0);
    CHECK_INT(list[0].t_ping_ns, 2 * SECOND);
    CHECK(!(list[0].to_m < 0));
    add(&s, &before);
    free_spend(list, &later);
    CHECK_INT(free_longest(list, FREE_INTERVALS).t_ping_ns, 0);
    CHECK_INT(list[0].t_ping_ns, 2 * SECOND);
    CHECK(list[0].to_m < 0);
}

int main(void)
{
    RUN(nothing_is_free_that_no_ping_freed_and_nothing_is_too_young);
    RUN(intervals_made_anew_hold_what_pings_freed_and_no_more);
    RUN(neighbours_of_a_revolution_are_one_interval);
    RUN(what_a_ping_no_longer_covers_makes_nothing_else_old);
    RUN(without_room_the_least_water_grows_older);
    RUN(what_is_heard_no_farther_takes_nothing_back_and_an_echo_does);
    RUN(a_ping_that_received_nothing_usable_takes_all_back);
    return test_end();
}
