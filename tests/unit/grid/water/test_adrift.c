/* SPDX-License-Identifier: MIT */
/*
 * test_adrift - the rows of a head on a vehicle that drifts, unseen but for a bound: what several of them free
 * together, against small things that stand still in the water.
 */
#include "tests/lib/ask_free.h"
#include "tests/lib/test.h"
#include "tests/lib/random.h"

#include "grid/geometry.h"
#include "grid/water/store.h"

#define TICK    UINT64_C(50000000)
#define STEP    2.0 /* degrees */
#define TURN    180 /* pings */
#define RANGE_M 10.0
#define BLIND_M 0.5
#define HALF_EL 12.5

static uint64_t seed;

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

/* ---- a head ---- */

static struct store *store;
static struct pose pose;
static struct beam_echoes beam;
static struct echoes ping;
static double wide_deg;

static void begin(double wide)
{
    static const struct store_conf conf = {.beams = {1}, .spare = 1};
    static void *memory;
    memory = memory ? memory : malloc(store_bytes(&conf));
    store = store_init(memory, &conf);
    pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_DEPTH;
    wide_deg = wide;
    ping = (struct echoes){.n_beams = 1,
                           .t_ns = 1000 * TICK,
                           .range_max_m = (float)RANGE_M,
                           .az_aperture_rad = (float)geo_rad(wide),
                           .el_aperture_rad = (float)geo_rad(2 * HALF_EL),
                           .beam = &beam};
}

/* It detects something at that range; INFINITY: nothing. Meanwhile the vehicle may have drifted so far. */
static void send(double az_deg, double range_m, double drift_m)
{
    const bool hears = range_m < RANGE_M;
    beam = (struct beam_echoes){.az_rad = (float)geo_rad(az_deg),
                                .n = hears,
                                .blind_m = (float)BLIND_M,
                                .free_to_m = (float)(hears ? range_m - 0.01 : RANGE_M)};
    pose.drift_m[0] += drift_m;
    ping.pose = pose;
    ping.seq++;
    ping.t_ns += TICK;
    store_enter(store, &ping, &mount_identity);
}

static double free_from(double from_m, double az_deg, double el_deg)
{
    static struct water_view view[ASK_RECORDS];
    const struct store_now now = {.now_ns = ping.t_ns, .pose = &pose, .clear_for_s = 60, .move_limit_m = 20};
    struct ask_question q = {.half_rad = geo_rad(0.1), .near_m = from_m, .to_m = RANGE_M};
    geo_direction(geo_rad(az_deg), geo_rad(el_deg), q.axis);
    return ask_free(view, store_view(store, &now, view), &q).free_to_m;
}

/* ---- tests ---- */

#define DRIFT_M 0.01 /* from ping to ping */

/* A turn and a half, but for some pings. */
static void turn(int sense, int lost_from, int lost_to)
{
    begin(3.5);
    for (int i = 0; i < 3 * TURN / 2; i++) {
        const bool lost = i >= lost_from && i < lost_to;
        ping.seq += lost;
        ping.t_ns += lost * TICK;
        pose.drift_m[0] += lost * DRIFT_M;
        if (!lost)
            send(sense * STEP * i, INFINITY, DRIFT_M);
    }
}

/* The head points to 180 degrees, and passed 90 when it was 45 pings back: 0.45 m, of 1.2 m 22 degrees. No row has both
 * ends of that. */
TEST(water_that_no_row_holds_is_free_by_several)
{
    for (int sense = -1; sense <= 1; sense += 2) {
        turn(sense, 0, 0);
        CHECK(free_from(1.2, sense * 90, 0) > RANGE_M - 0.75);
        CHECK(free_from(2.5, sense * 200, 0) > RANGE_M - 2.4); /* the turn before */
    }
}

TEST(where_pings_are_lost_in_between_it_is_not)
{
    for (int sense = -1; sense <= 1; sense += 2) {
        turn(sense, TURN + 50, TURN + 53); /* of 100 to 104 degrees */
        CHECK(free_from(1.2, sense * 90, 0) <= 1.2);
        CHECK(free_from(1.2, sense * 140, 0) > RANGE_M - 1);
    }
}

TEST(where_the_head_turned_back_it_is_not)
{
    for (int sense = -1; sense <= 1; sense += 2) {
        begin(3.5);
        for (int i = 0; i < 100; i++)
            send(sense * STEP * i, INFINITY, DRIFT_M);
        for (int i = 98; i > 60; i--)
            send(sense * STEP * i, INFINITY, DRIFT_M);
        CHECK(free_from(1.2, sense * 187, 0) <= 1.2);
        CHECK(free_from(1.2, sense * 160, 0) > RANGE_M - 1);
    }
}

/* Drift is level: a beam as high as the water shows it as long as it is no steeper from anywhere. */
TEST(drift_takes_little_above_and_below)
{
    turn(1, 0, 0);
    const double margin_m = 0.65, low_m = 4; /* that of the oldest beam */
    const double most_deg = geo_deg(atan(tan(geo_rad(HALF_EL)) * (low_m - margin_m) / low_m));
    CHECK(free_from(low_m, 90, most_deg - 0.5) > RANGE_M - 0.8);
    CHECK(free_from(low_m, 90, -most_deg + 0.5) > RANGE_M - 0.8);
    CHECK(free_from(low_m, 90, HALF_EL - 0.5) <= low_m);
}

/* A small thing, from the vehicle, while that drifts past it. */
struct thing {
    double at_m[3];
    double aside_m[2]; /* its way from ping to ping */
    int steady;        /* for so many more */
};

static double azimuth_deg(const struct thing *t)
{
    return geo_deg(atan2(t->at_m[1], t->at_m[0]));
}

static double elevation_deg(const struct thing *t)
{
    return geo_deg(atan2(-t->at_m[2], hypot(t->at_m[0], t->at_m[1])));
}

/* Towards the vehicle, away from it, across it: mostly what would let it slip past the beam. */
static void drift(struct thing *t, double most_m)
{
    if (t->steady-- <= 0) {
        const double turn_rad = between(0, 1) < 0.5 ? GEO_PI / 2 * floor(between(0, 4)) : between(0, GEO_TURN),
                     way_m = between(0, 1) < 0.7 ? most_m : between(0, most_m),
                     to_rad = atan2(t->at_m[1], t->at_m[0]) + turn_rad;
        t->aside_m[0] = way_m * cos(to_rad);
        t->aside_m[1] = way_m * sin(to_rad);
        t->steady = (int)between(1, 80);
    }
    for (int k = 0; k < 2; k++)
        t->at_m[k] += t->aside_m[k];
}

static double range_of(const struct thing *t)
{
    return geo_length(t->at_m);
}

/* As a beam of that azimuth detects it. */
static double heard_m(const struct thing *t, double az_deg)
{
    const double off_deg = geo_deg(geo_wrap_pi(geo_rad(azimuth_deg(t) - az_deg)));
    const bool in = fabs(off_deg) <= wide_deg / 2 && fabs(elevation_deg(t)) <= HALF_EL;
    return in && range_of(t) > BLIND_M ? range_of(t) : (double)INFINITY;
}

#define TRIALS 1500

/* Where the thing is now is not free; much of the water on the other side, as near and as high, is. */
TEST(nothing_slips_through_a_turn)
{
    int wrong = 0, free = 0;
    seed = test_seed();
    for (int n = 0; n < (getenv("LONG") ? 50 : 1) * TRIALS; n++) {
        const int sense = between(0, 1) < 0.5 ? -1 : 1, pings = (int)between(0.3 * TURN, 2 * TURN);
        const double most_m = between(0.001, 0.015), start_deg = between(0, 360), el = between(-11, 11);
        double from_m = between(1, 7);
        struct thing t = {.steady = 0};
        begin(between(2.1, 4));
        geo_direction(between(0, GEO_TURN), geo_rad(el), t.at_m);
        for (int k = 0; k < 3; k++)
            t.at_m[k] *= from_m;
        for (int i = 0; i < pings; i++) {
            drift(&t, most_m);
            const double az_deg = start_deg + sense * STEP * i;
            send(az_deg, heard_m(&t, az_deg), most_m);
        }
        const double to_m = range_of(&t);
        from_m = fmax(to_m - 0.2, to_m / 2);
        wrong += free_from(from_m, azimuth_deg(&t), elevation_deg(&t)) > to_m;
        free += free_from(from_m, azimuth_deg(&t) + 180, elevation_deg(&t)) > to_m;
    }
    printf("# %d free on the other side, %d wrong\n", free, wrong);
    CHECK_INT(wrong, 0);
    CHECK(free > TRIALS / 4);
}

int main(void)
{
    RUN(water_that_no_row_holds_is_free_by_several);
    RUN(where_pings_are_lost_in_between_it_is_not);
    RUN(where_the_head_turned_back_it_is_not);
    RUN(drift_takes_little_above_and_below);
    RUN(nothing_slips_through_a_turn);
    return test_end();
}
