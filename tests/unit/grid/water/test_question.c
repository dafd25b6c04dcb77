/* SPDX-License-Identifier: MIT */
/*
 * test_question - corridors, a body that moves or stays, sectors and what is around: what is said to be free, against
 * every ping by itself (pinged.h). `test_question cost` tells what the questions cost.
 */
#include "tests/lib/ask_free.h"
#include "tests/lib/pinged.h"
#include "tests/lib/test.h"

#include <time.h>

#define ASK_NEAR_M 0.6
#define SECTORS    72

static bool is_long(void)
{
    return getenv("LONG") != NULL;
}

static const struct sonar sonars[] = {
    {"fan, 0.3 m/s, turning", 96, 1.25, 1.25, 25, false, 0.3, 15, 2},
    {"head, 0.1 m/s", 1, 1, 2.5, 45, true, 0.1, 0, 1},
};

static struct ask asked;
static double from[3]; /* the vehicle */

/* To the end. */
static double free_of(const struct ask_question *q)
{
    ask_begin(&asked, view, records, q);
    while (ask_step(&asked))
        ;
    return ask_end(&asked, 0).free_to_m;
}

/* ---- questions ---- */

/* Mostly of what a fan has before it. */
static double any_azimuth(const struct sonar *s)
{
    const struct ping *last = &ping[pings - 1];
    const double ahead = atan2(last->axis[0][1], last->axis[0][0]), aside = uniform(-0.7, 0.7);
    return s->turns ? uniform(0, GEO_TURN) : ahead + aside;
}

static struct ask_body any_body(void)
{
    const struct ping *last = &ping[pings - 1];
    struct ask_body body = {.up = {-last->axis[2][0], -last->axis[2][1], -last->axis[2][2]}};
    body.radius_m = uniform(0.1, 0.3);
    body.half_height_m = uniform(0.05, 0.15);
    body.margin_m = uniform(0, 0.1);
    return body;
}

static struct ask_question any_question(const struct sonar *s, enum ask_kind kind)
{
    const double az = any_azimuth(s), el = geo_rad(uniform(-4, 4)), wide = geo_rad(uniform(2, 40));
    struct ask_question q = {.kind = kind, .near_m = ASK_NEAR_M};
    q.to_m = uniform(2, 9);
    q.half_rad = geo_rad(uniform(0.5, 5));
    q.radius_m = uniform(0.05, 0.4);
    q.body = any_body();
    geo_direction(az, el, q.axis);
    memcpy(q.band.attitude, ping[pings - 1].attitude, sizeof q.band.attitude);
    q.band.lo_rad = -geo_rad(uniform(0.5, 5));
    q.band.hi_rad = geo_rad(uniform(0.5, 5));
    q.band.parts = 1;
    q.band.width_rad = wide;
    double body[3], body_az, body_el;
    quat_rotate_inverse(q.band.attitude, q.axis, body);
    geo_angles(body, &body_az, &body_el);
    q.band.from_rad = geo_wrap(body_az - wide / 2);
    if (kind == ASK_STAY) {
        /* around it lies what the sonar is too near to, and what is above: so far out as beams see it */
        q.body.half_height_m = 0.05;
        q.body.radius_m = uniform(1.2, 2);
        q.to_m = uniform(0.05, 0.2);
    }
    return q;
}

/* ---- points of them ---- */

static void add_along(const double v[3], double t, double p[3])
{
    for (int k = 0; k < 3; k++)
        p[k] += t * v[k];
}

static void across(const double axis[3], double side[3], double up[3])
{
    const double any[3] = {fabs(axis[0]) < 0.7, fabs(axis[0]) >= 0.7, 0};
    for (int k = 0; k < 3; k++)
        side[k] = axis[(k + 1) % 3] * any[(k + 2) % 3] - axis[(k + 2) % 3] * any[(k + 1) % 3];
    const double size = geo_length(side);
    for (int k = 0; k < 3; k++)
        side[k] /= size;
    for (int k = 0; k < 3; k++)
        up[k] = axis[(k + 1) % 3] * side[(k + 2) % 3] - axis[(k + 2) % 3] * side[(k + 1) % 3];
}

static void in_disc(const double normal[3], double radius_m, double p[3])
{
    double side[3], up[3];
    across(normal, side, up);
    const double r = radius_m * sqrt(uniform(0, 1)), at = uniform(0, GEO_TURN);
    add_along(side, r * cos(at), p);
    add_along(up, r * sin(at), p);
}

/* A point that the question has free, from the vehicle. */
static void point_of(const struct ask_question *q, size_t part, double free_m, double p[3])
{
    const struct ask_body *b = &q->body;
    p[0] = p[1] = p[2] = 0;
    if (q->kind == ASK_CORRIDOR) {
        add_along(q->axis, uniform(0, free_m), p);
        in_disc(q->axis, q->radius_m, p);
    } else if (q->kind == ASK_MOVE) {
        struct question_shape shape;
        question_begin(&shape, q);
        add_along(q->axis, uniform(0, fmax(0, free_m - shape.front_m)), p);
        add_along(b->up, uniform(-1, 1) * (b->half_height_m + b->margin_m), p);
        in_disc(b->up, b->radius_m + b->margin_m, p);
    } else if (q->kind == ASK_STAY) {
        add_along(b->up, uniform(-1, 1) * (b->half_height_m + free_m), p);
        in_disc(b->up, b->radius_m + free_m, p);
    } else {
        const double width = q->band.parts > 1 ? GEO_TURN / (double)q->band.parts : q->band.width_rad;
        const double first = q->band.parts > 1 ? ((double)part - 0.5) * width : q->band.from_rad;
        double v[3];
        const double el = uniform(q->band.lo_rad, q->band.hi_rad), az = first + uniform(0, width);
        geo_direction(az, el, v);
        quat_rotate(q->band.attitude, v, v);
        add_along(v, uniform(0, free_m), p);
    }
}

/* Is it in the body that stays? */
static bool is_own(const struct ask_question *q, const double p[3])
{
    const double up = geo_dot(p, q->body.up), level2 = geo_dot(p, p) - up * up;
    return q->kind == ASK_STAY && fabs(up) <= q->body.half_height_m &&
           level2 <= q->body.radius_m * q->body.radius_m;
}

struct score {
    long points, wrong;
    double said_m, asked_m;
};

static void judge(const struct sonar *s, const struct ask_question *q, size_t part, double free_m,
                  struct score *score)
{
    score->said_m += free_m;
    score->asked_m += q->to_m;
    for (int i = 0; i < 40 && free_m > 0; i++) {
        double p[3];
        point_of(q, part, free_m, p);
        if (geo_length(p) <= q->near_m || is_own(q, p))
            continue;
        add_along(from, 1, p);
        score->points++;
        score->wrong += truth(s, p) != FREE;
    }
}

static void go_on_water(const struct sonar *s, double share)
{
    seen_share = share;
    furnish();
    sail(s);
    keep_all();
    const struct ping *last = &ping[pings - 1];
    for (int k = 0; k < 3; k++)
        from[k] = last->place[k] + uniform(-0.03, 0.03);
    look_from(from, last);
}

/* ---- tests ---- */

static const char *const kinds[] = {"cone", "corridor", "move", "stay", "around"};

static void tell(const struct sonar *s, const char *what, const struct score *sum)
{
    printf("# %-24s %-10s %6ld points, %ld wrong; said %.0f %% of what was asked\n", s->name, what, sum->points,
           sum->wrong, 100 * sum->said_m / fmax(sum->asked_m, 1e-9));
    CHECK_INT(sum->wrong, 0);
}

TEST(what_is_said_to_be_free_was_free_in_the_newest_ping_that_knows)
{
    for (size_t i = 0; i < sizeof sonars / sizeof *sonars; i++)
        for (int world = 0; world < (is_long() ? 20 : 1); world++) {
            go_on_water(&sonars[i], world % 2 ? 0.1 : 1);
            for (enum ask_kind kind = ASK_CORRIDOR; kind <= ASK_AROUND; kind++) {
                struct score sum = {0};
                for (int k = 0; k < (is_long() ? 60 : 20); k++) {
                    const struct ask_question q = any_question(&sonars[i], kind);
                    judge(&sonars[i], &q, 0, free_of(&q), &sum);
                }
                tell(&sonars[i], kinds[kind], &sum);
                CHECK(getenv("SONARD_SEED") || sum.points > 50 || (kind == ASK_STAY && sonars[i].turns));
            }
            struct ask_question q = any_question(&sonars[i], ASK_AROUND);
            struct score sum = {0};
            q.to_m = 8;
            q.band.parts = SECTORS;
            q.band.width_rad = 0;
            free_of(&q);
            for (size_t k = 0; k < SECTORS; k++)
                judge(&sonars[i], &q, k, ask_end(&asked, k).free_to_m, &sum);
            tell(&sonars[i], "sectors", &sum);
            CHECK(getenv("SONARD_SEED") || sum.points > 50);
        }
}

/* The questions that go on the water of the last sonar. */

TEST(a_sector_is_what_it_is_by_itself)
{
    struct ask_question q = any_question(&sonars[1], ASK_AROUND);
    double all_m[SECTORS];
    q.to_m = 8;
    q.band.parts = SECTORS;
    q.band.width_rad = 0;
    free_of(&q);
    for (size_t k = 0; k < SECTORS; k++)
        all_m[k] = ask_end(&asked, k).free_to_m;
    q.band.parts = 1;
    q.band.width_rad = GEO_TURN / SECTORS;
    int free_ones = 0;
    for (size_t k = 0; k < SECTORS; k++) {
        q.band.from_rad = geo_wrap(((double)k - 0.5) * q.band.width_rad);
        CHECK_NEAR(free_of(&q), all_m[k], 0, 1e-9);
        free_ones += all_m[k] > 2;
    }
    CHECK(free_ones > 10);
}

/* The same question, and less of it. */
static struct ask_question less_of(const struct ask_question *q)
{
    struct ask_question less = *q;
    const double share = uniform(0, 1), lo = uniform(0, 1), hi = uniform(0, 1), first = uniform(0, 0.5);
    less.half_rad *= share;
    less.radius_m *= share;
    less.band.lo_rad *= lo;
    less.band.hi_rad *= hi;
    less.band.from_rad += first * q->band.width_rad;
    less.band.width_rad *= 1 - first - 0.4 * share;
    if (q->kind == ASK_MOVE) {
        less.body.radius_m *= share;
        less.body.half_height_m *= lo;
        less.body.margin_m *= hi;
    }
    return less;
}

/* How far it may go, in a measure that is the body's own. */
static double way_of(const struct ask_question *q)
{
    struct question_shape shape;
    question_begin(&shape, q);
    return free_of(q) - shape.front_m;
}

TEST(less_of_a_question_is_free_at_least_as_far)
{
    int free_ones = 0;
    for (int i = 0; i < (is_long() ? 400 : 60); i++)
        for (enum ask_kind kind = ASK_CONE; kind <= ASK_AROUND; kind++) {
            struct ask_question q = any_question(&sonars[1], kind), nearer = q;
            const double all_m = free_of(&q), share = uniform(0.4, 1);
            nearer.to_m = kind == ASK_STAY ? q.to_m * share : fmax(q.to_m * share, 0.8);
            CHECK(free_of(&nearer) >= fmin(all_m, nearer.to_m));
            struct ask_question less = less_of(&q);
            if (kind == ASK_MOVE) {
                struct question_shape shape, small;
                question_begin(&shape, &q);
                question_begin(&small, &less);
                less.to_m = q.to_m - shape.front_m + small.front_m; /* the same way */
            }
            if (kind != ASK_STAY)
                CHECK(way_of(&less) >= way_of(&q) - 1e-9);
            free_ones += all_m > q.near_m;
        }
    CHECK(free_ones > 60);
}

TEST(yes_or_no_is_what_the_distance_says)
{
    int yes = 0, no = 0;
    for (int i = 0; i < 60; i++) {
        struct ask_question q = any_question(&sonars[1], (enum ask_kind)(i % 5));
        const bool is_free = free_of(&q) >= q.to_m;
        q.stops = true;
        CHECK_INT(free_of(&q) >= q.to_m, is_free);
        yes += is_free;
        no += !is_free;
    }
    CHECK(yes > 5 && no > 5);
}

/* But for what lies between two of the ranges at which stretches are divided: where an answer ends there depends on how
 * far the tile was asked. */
TEST(coarser_tiles_never_say_more)
{
    for (int i = 0; i < 40; i++) {
        struct ask_question q = any_question(&sonars[1], (enum ask_kind)(i % 5));
        double finer_m = INFINITY;
        for (q.levels = TILES_LEVELS; q.levels > 0; q.levels--) {
            const double free_m = free_of(&q);
            CHECK(free_m <= finer_m + 4 * WATER_GRID_M);
            finer_m = free_m;
        }
    }
}

/* ---- ropes ---- */

static const struct eyes {
    const char *name;
    int columns, rows; /* a head: so many pings */
    double column_deg, row_deg, wide_deg, high_deg;
    double stagger_deg; /* every other row is so much further to the side */
    double roll_deg;    /* all beams are, about the way ahead */
} eyes[] = {
    {"fan", 512, 1, 120.0 / 512, 0, 120.0 / 512, 25, 0, 0},
    {"matrix", 32, 16, 3, 5.5, 4.5, 7.5, 0, 0},
    {"staggered matrix", 32, 16, 3, 5.5, 4.5, 7.5, 1.5, 0},
    {"rolled fan", 80, 1, 1.5, 0, 1.5, 25, 0, 6},
    {"head", 60, 0, 1.8, 0, 2.5, 25, 0, 0},
};

/* Where beam i looks. */
static void eye_direction(const struct eyes *s, int i, double *az, double *el)
{
    const int row = s->rows ? i / s->columns : 0;
    *az = geo_rad(s->column_deg) * (i % s->columns - (s->columns - 1) / 2.0) + geo_rad(row % 2 * s->stagger_deg);
    *el = s->rows ? geo_rad(s->row_deg) * (row - (s->rows - 1) / 2.0) : 0;
    if (s->roll_deg > 0) {
        const double roll = geo_rad(s->roll_deg), aside = sin(*az);
        *az = atan2(aside * cos(roll), cos(*az));
        *el = -asin(aside * sin(roll));
    }
}

/* What a beam says of a rope of 2 cm that hangs there, at the least. */
static struct beam_echoes beam_with_rope(const struct eyes *s, double az, double el, double rope_az, double range)
{
    const double half = geo_rad(s->wide_deg) / 2, low = fmax(fabs(el) - geo_rad(s->high_deg) / 2, 0);
    const bool hit = fabs(az - rope_az) * range <= 0.01 + range * half;
    return (struct beam_echoes){.az_rad = (float)az,
                                .el_rad = (float)el,
                                .free_to_m = (float)(hit ? range / cos(low) - 0.03 : 20),
                                .n = hit};
}

/* One ping ahead, or those of a head that turns past it. */
static void look_at_rope(const struct eyes *s, double rope_az, double range)
{
    static struct beam_echoes beam[512];
    static void *memory;
    static const struct store_conf big = {.beams = {512}, .spare = 1};
    memory = memory ? memory : malloc(store_bytes(&big));
    store = store_init(memory, &big);
    struct pose pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    struct echoes e = {.az_aperture_rad = (float)geo_rad(s->wide_deg),
                       .el_aperture_rad = (float)geo_rad(s->high_deg),
                       .pose = pose,
                       .beam = beam};
    for (int i = 0; i < (s->rows ? s->columns * s->rows : s->columns); i++) {
        double az, el;
        eye_direction(s, i, &az, &el);
        beam[s->rows ? i : 0] = beam_with_rope(s, az, el, rope_az, range);
        e.n_beams = (uint16_t)(s->rows ? i + 1 : 1);
        e.seq++;
        e.t_ns += UINT64_C(50000000);
        if (!s->rows || i + 1 == s->columns * s->rows)
            store_enter(store, &e, &mount_identity);
    }
    const struct store_now now = {.now_ns = e.t_ns, .pose = &pose, .clear_for_s = 100, .move_limit_m = 100};
    records = store_view(store, &now, view);
}

TEST(no_rope_is_passed_by_tiles)
{
    for (size_t k = 0; k < sizeof eyes / sizeof *eyes; k++) {
        const int trials = is_long() ? 2000 : 400;
        int passed = 0, free_before = 0;
        for (int i = 0; i < trials; i++) {
            const double az = geo_rad(uniform(-30, 30)), range = uniform(4, 9), aside = uniform(-0.99, 0.99);
            look_at_rope(&eyes[k], az, range);
            const enum ask_kind kind = (enum ask_kind)(i % 3 == 0   ? ASK_CORRIDOR
                                                       : i % 3 == 1 ? ASK_MOVE
                                                                    : ASK_AROUND);
            struct ask_question q = {.kind = kind, .near_m = 1.5, .to_m = 10, .radius_m = uniform(0.02, 0.3)};
            q.body = (struct ask_body){.up = {0, 0, -1}, .radius_m = q.radius_m, .half_height_m = 0.1};
            q.band =
                (struct ask_band){.attitude = {1, 0, 0, 0}, .lo_rad = -0.02, .hi_rad = 0.02, .parts = SECTORS};
            geo_direction(az + asin(q.radius_m / range) * aside, 0, q.axis);
            double free_m = free_of(&q);
            if (kind == ASK_AROUND)
                free_m =
                    ask_end(&asked, (size_t)floor(geo_wrap(az) / GEO_TURN * SECTORS + 0.5) % SECTORS).free_to_m;
            passed += free_m > range + (kind == ASK_MOVE ? q.radius_m : 0);
            free_before += free_m > range - 0.6;
        }
        printf("# %s: %d of %d ropes passed, free up to %d\n", eyes[k].name, passed, trials, free_before);
        CHECK_INT(passed, 0);
        CHECK(free_before > trials * 0.9);
    }
}

/* ---- what it costs ---- */

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

#define TIMES 100

static void tell_cost(const struct sonar *s, const char *what, const struct ask_question *question, bool ahead)
{
    double us[TIMES], longest_us = 0, sum_m = 0;
    struct ask_question q = *question;
    for (int i = 0; i < TIMES; i++) {
        const double aside = s->turns || !ahead ? uniform(1.2, GEO_TURN - 1.2) : uniform(-0.6, 0.6);
        const double bow = atan2(ping[pings - 1].axis[0][1], ping[pings - 1].axis[0][0]);
        geo_direction(s->turns ? uniform(0, GEO_TURN) : bow + aside, 0, q.axis);
        const double began = seconds();
        ask_begin(&asked, view, records, &q);
        for (bool more = true; more;) {
            const double step = seconds();
            more = ask_step(&asked);
            longest_us = fmax(longest_us, 1e6 * (seconds() - step));
        }
        us[i] = 1e6 * (seconds() - began);
        for (size_t k = 0; k < asked.question.parts; k++)
            sum_m += ask_end(&asked, k).free_to_m / (double)asked.question.parts / TIMES;
    }
    qsort(us, TIMES, sizeof *us, by_size);
    fflush(stdout);
    printf("# %-24s %-28s %8.0f %8.0f %8.0f us, longest step %6.0f us, mean free %.2f m\n", s->name, what,
           us[TIMES / 2], us[TIMES * 99 / 100], us[TIMES - 1], longest_us, sum_m);
}

static void tell_costs(void)
{
    static const struct sonar all[] = {{"fan 96, 0.3 m/s, turning", 96, 1.25, 1.25, 25, false, 0.3, 15, 2},
                                       {"head, 0.3 m/s", 1, 1.8, 3, 25, true, 0.3, 0, 1}};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
        go_on_water(&all[i], 1);
        printf("# %d records; median, 99 %%, most\n", records);
        struct ask_question q = any_question(&all[i], ASK_CONE);
        q.near_m = 0.5;
        q.half_rad = geo_rad(7.5);
        q.body = (struct ask_body){.up = {0, 0, -1}, .radius_m = 0.25, .half_height_m = 0.15, .margin_m = 0.1};
        q.to_m = 8;
        for (int stops = 1; stops >= 0; stops--) {
            q.stops = stops;
            tell_cost(&all[i], stops ? "cone to 8 m, in view" : "cone how far, in view", &q, true);
            tell_cost(&all[i], stops ? "cone to 8 m, behind" : "cone how far, behind", &q, false);
        }
        q.kind = ASK_MOVE;
        q.near_m = 1;
        tell_cost(&all[i], "limit, in view", &q, true);
        tell_cost(&all[i], "limit, behind", &q, false);
        q.stops = true;
        tell_cost(&all[i], "collision, behind", &q, false);
        q.stops = false;
        q.kind = ASK_AROUND;
        q.band = (struct ask_band){
            .attitude = {1, 0, 0, 0}, .lo_rad = -geo_rad(7.5), .hi_rad = geo_rad(7.5), .parts = 1};
        tell_cost(&all[i], "nearest", &q, true);
        q.band.parts = SECTORS;
        q.band.width_rad = 0;
        for (q.levels = 1; q.levels <= TILES_LEVELS; q.levels++) {
            char what[40];
            snprintf(what, sizeof what, "72 sectors, %g deg", 5.0 / (1 << (q.levels - 1)));
            tell_cost(&all[i], what, &q, true);
        }
    }
}

int main(int argc, char **argv)
{
    seed = test_seed();
    if (argc > 1 && strcmp(argv[1], "cost") == 0) {
        tell_costs();
        return test_end();
    }
    RUN(what_is_said_to_be_free_was_free_in_the_newest_ping_that_knows);
    RUN(a_sector_is_what_it_is_by_itself);
    RUN(less_of_a_question_is_free_at_least_as_far);
    RUN(yes_or_no_is_what_the_distance_says);
    RUN(coarser_tiles_never_say_more);
    RUN(no_rope_is_passed_by_tiles);
    return test_end();
}
