/* SPDX-License-Identifier: MIT */
/* test_ask - cones that are said to be free, against every ping by itself (pinged.h). */
#include "tests/lib/ask_free.h"
#include "tests/lib/pinged.h"
#include "tests/lib/test.h"

/* In the gate one world of each kind. */
static bool is_long(void)
{
    return getenv("LONG") != NULL;
}

/* ---- tests ---- */

struct score {
    long points, wrong, in_post;
    double said_m, free_m;
};

static void in_cone(const struct ask_question *q, double u[3])
{
    do
        geo_direction(uniform(0, GEO_TURN), asin(uniform(-1, 1)), u);
    while (geo_dot(u, q->axis) < cos(q->half_rad));
}

/* How far the least of some rays is free. */
static double least_free(const struct sonar *s, const double from[3], const struct ask_question *q)
{
    double least = q->to_m;
    for (int i = 0; i < 12; i++) {
        double u[3], p[3], far = q->near_m;
        in_cone(q, u);
        for (; far < least; far += 0.1) {
            for (int j = 0; j < 3; j++)
                p[j] = from[j] + far * u[j];
            if (truth(s, p) != FREE)
                break;
        }
        least = fmin(least, far);
    }
    return least;
}

static void judge(const struct sonar *s, const double from[3], const struct ask_question *q, double to_m,
                  struct score *score)
{
    for (int i = 0; i < 60 && to_m > q->near_m; i++) {
        double u[3], p[3];
        const double t = uniform(q->near_m, to_m);
        in_cone(q, u);
        for (int j = 0; j < 3; j++)
            p[j] = from[j] + t * u[j];
        score->points++;
        score->wrong += truth(s, p) != FREE;
        score->in_post += in_post(p);
    }
    score->free_m += least_free(s, from, q) - q->near_m;
    score->said_m += to_m - q->near_m;
}

static struct score sail_and_ask(const struct sonar *s, int questions)
{
    struct score score = {0};
    furnish();
    sail(s);
    keep_all();
    const struct ping *last = &ping[pings - 1];
    double from[3];
    for (int k = 0; k < 3; k++)
        from[k] = last->place[k] + uniform(-0.03, 0.03);
    look_from(from, last);
    for (int i = 0; i < questions; i++) {
        const double half = geo_rad(uniform(0.5, 5)), to_m = uniform(3, 10);
        struct ask_question q = {.half_rad = half, .near_m = 0.5, .to_m = to_m};
        /* mostly of what a fan has before it */
        const double ahead = atan2(last->axis[0][1], last->axis[0][0]);
        geo_direction(s->turns || i % 4 == 0 ? uniform(0, GEO_TURN) : ahead + uniform(-0.8, 0.8),
                      geo_rad(uniform(-5, 5)), q.axis);
        judge(s, from, &q, ask_free(view, records, &q).free_to_m, &score);
    }
    return score;
}

static const struct sonar sonars[] = {
    {"fan, still", 96, 1.25, 1.25, 25, false, 0, 0, 0},
    {"fan, 0.3 m/s, turning", 96, 1.25, 1.25, 25, false, 0.3, 15, 2},
    {"fan with overlap, 0.1 m/s", 60, 1.5, 2.5, 25, false, 0.1, 10, 1},
    {"fan with gaps", 30, 3, 2.5, 25, false, 0.1, 5, 1},
    {"head, still", 1, 2.4, 2.5, 25, true, 0, 0, 0},
    {"head, 0.1 m/s", 1, 1, 2.5, 25, true, 0.1, 0, 1},
    {"head, 0.3 m/s, turning", 1, 1.8, 3, 35, true, 0.3, 3, 1.5},
};

TEST(what_is_said_to_be_free_was_free_in_the_newest_ping_that_knows)
{
    for (int share = 0; share < 2; share++)
        for (size_t i = 0; i < sizeof sonars / sizeof *sonars; i++) {
            struct score sum = {0};
            seen_share = share ? 0.1 : 1;
            for (int world = 0; world < (is_long() ? 20 : 1); world++) {
                const struct score one = sail_and_ask(&sonars[i], is_long() ? 40 : 12);
                sum.points += one.points;
                sum.wrong += one.wrong;
                sum.in_post += one.in_post;
                sum.said_m += one.said_m;
                sum.free_m += one.free_m;
            }
            printf("# %-28s %ld points, %ld wrong, %ld in a post; said %.0f %% of the free metres; %d records\n",
                   sonars[i].name, sum.points, sum.wrong, sum.in_post, 100 * sum.said_m / fmax(sum.free_m, 1e-9),
                   records);
            CHECK_INT(sum.wrong, 0);
            CHECK(sum.points > 100 || sonars[i].step_deg > sonars[i].wide_deg);
        }
}

/* More of the same never turns what was not free into free water: less of it, or not as far. */
TEST(less_of_a_question_is_free_at_least_as_far)
{
    seen_share = 1;
    furnish();
    sail(&sonars[6]);
    keep_all();
    look_from(ping[pings - 1].place, &ping[pings - 1]);
    int free_m = 0;
    for (int i = 0; i < 60; i++) {
        const double half = geo_rad(uniform(0, 8)), to_m = uniform(1, 10);
        struct ask_question q = {.half_rad = half, .near_m = 0.5, .to_m = to_m};
        geo_direction(uniform(0, GEO_TURN), geo_rad(uniform(-6, 6)), q.axis);
        const double all_m = ask_free(view, records, &q).free_to_m;
        struct ask_question less = q;
        less.half_rad *= uniform(0, 1);
        CHECK(ask_free(view, records, &less).free_to_m >= all_m);
        less = q;
        less.to_m = uniform(0.6, q.to_m);
        CHECK(ask_free(view, records, &less).free_to_m >= fmin(all_m, less.to_m));
        free_m += all_m > 1;
    }
    CHECK(free_m > 10);
}

/* A rope of 2 cm before one ping of 512 beams: thin rays half a degree apart pass it in one of six trials. */
TEST(no_rope_is_passed_by_tiles)
{
    int passed = 0, free_before = 0;
    for (int i = 0; i < 2000; i++) {
        const double az = geo_rad(uniform(-30, 30)), range = uniform(4, 9);
        const struct water_view seen = {.record = fan_with_rope(az, range)};
        struct ask_question q = {.half_rad = geo_rad(uniform(0.1, 5)), .near_m = 0.5, .to_m = 10};
        geo_direction(az + q.half_rad * uniform(-0.99, 0.99), 0, q.axis);
        const double free_m = ask_free(&seen, 1, &q).free_to_m;
        passed += free_m > range;
        free_before += free_m > range - 0.3;
    }
    CHECK_INT(passed, 0);
    CHECK(free_before > 1900);
}

int main(void)
{
    seed = test_seed();
    RUN(what_is_said_to_be_free_was_free_in_the_newest_ping_that_knows);
    RUN(less_of_a_question_is_free_at_least_as_far);
    RUN(no_rope_is_passed_by_tiles);
    return test_end();
}
