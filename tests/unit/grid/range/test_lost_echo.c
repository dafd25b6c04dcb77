/* SPDX-License-Identifier: MIT */
/* test_lost_echo - when directions that lose their echoes are a doubt about the receiver, and when something left. And
 * whether a head is in the water. */
#include "tests/lib/test.h"

#include <string.h>

#include "grid/range/immersion.h"
#include "grid/range/lost_echo.h"

#define FAN 32

static struct lost_echo lost;
static struct beam_echoes beam[FAN];
static struct echoes ping;
static struct pose pose;

static void begin(void)
{
    memset(&lost, 0, sizeof lost);
    pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping = (struct echoes){.beam = beam, .max_beams = FAN};
}

static void look(struct beam_echoes *b, double az_deg, double range_m)
{
    *b = (struct beam_echoes){.az_rad = (float)geo_rad(az_deg),
                              .state = (uint8_t)(range_m > 0 ? BEAM_ECHO : BEAM_SILENT),
                              .n = (uint8_t)(range_m > 0),
                              .blind_m = 0.3f,
                              .heard_from_m = 0.3f,
                              .free_to_m = range_m > 0 ? (float)range_m : 10.0f,
                              .heard_to_m = range_m > 0 ? (float)range_m : 10.0f};
    b->echo[0].range_m = (float)range_m;
}

static bool run(uint16_t beams)
{
    ping.t_ns += 100000000;
    ping.n_beams = beams;
    ping.pose = pose;
    return lost_echo_run(&lost, &ping);
}

/* A head looks from one azimuth to another, in steps of 3.6 degrees, at a wall at range_m; 0: at nothing. Returns how
 * many beams free water. */
static int sweep(double from_deg, double to_deg, double range_m)
{
    int n = 0;
    for (double az = from_deg; az < to_deg; az += 3.6) {
        look(&beam[0], az, range_m);
        run(1);
        n += beam[0].free_to_m > beam[0].blind_m;
    }
    return n;
}

TEST(echoes_that_are_gone_on_all_sides_are_a_doubt_until_the_next)
{
    begin();
    CHECK_INT(sweep(0, 360, 3), 100);
    CHECK_INT(sweep(0, 720, 0), 0);
    CHECK(lost.doubt);
    CHECK_INT(sweep(0, 3, 3), 1);
    CHECK(!lost.doubt);
    CHECK(sweep(3.6, 360, 0) > 95); /* what was lost until then had left */
}

/* Its directions free nothing in the pass that loses it, unless another one answers, and then do. */
TEST(one_obstacle_may_leave)
{
    begin();
    sweep(0, 360, 0);
    sweep(0, 50, 3);
    CHECK_INT(sweep(50, 360, 0), 87);
    CHECK(sweep(0, 50, 0) < 2);
    CHECK_INT(sweep(50, 360, 0), 87);
    ping.t_ns += 10000000000u;
    CHECK(sweep(0, 50, 0) > 8);
    CHECK_INT(sweep(0, 360, 0), 100);
    CHECK(!lost.doubt);
    for (int turn = 0; turn < 2; turn++) { /* a wall beside it answers all the while */
        sweep(0, 120, turn ? 0 : 3);
        sweep(120, 240, 4);
        sweep(240, 360, 3);
    }
    CHECK(lost.doubt == false);
}

/* Turns of a head at a wall at 3 m all around, in steps of 0.9 degrees; one look of `of` hears, `level` strong. Returns
 * the doubted ones of the last turn. */
static int turns_that_hear(int turns, unsigned of, float level, double range_m, uint64_t *seed)
{
    int doubted = 0;
    for (int k = 0; k < turns * 400; k++) {
        look(&beam[0], 0.9 * (k % 400), test_uniform(seed) * of < 1 ? range_m : 0);
        beam[0].echo[0].level = level;
        ping.turns = true;
        doubted += run(1) && k >= 400 * (turns - 1);
    }
    return doubted;
}

/* What has left does not come back to where it was. */
TEST(a_receiver_that_hears_now_and_then_is_doubted)
{
    static const unsigned of[] = {10, 20};
    for (size_t i = 0; i < sizeof of / sizeof of[0]; i++) {
        uint64_t seed = test_seed();
        begin();
        CHECK_INT(turns_that_hear(2, 1, 100, 3, &seed), 0);
        turns_that_hear(5, of[i], 100, 3, &seed);
        CHECK_INT(turns_that_hear(1, of[i], 100, 3, &seed), 400);
        turns_that_hear(8, 1, 100, 3, &seed); /* it hears again */
        CHECK_INT(turns_that_hear(1, 1, 100, 3, &seed), 0);
    }
    uint64_t seed = test_seed();
    begin();
    turns_that_hear(2, 1, 1, 3, &seed); /* weak ones may come and go */
    CHECK(turns_that_hear(3, 10, 1, 3, &seed) < 100);
    begin();
    turns_that_hear(2, 1, 100, 3, &seed); /* something else came */
    turns_that_hear(1, 20, 100, 5, &seed);
    CHECK(turns_that_hear(1, 20, 100, 7, &seed) < 200);
    begin();
    turns_that_hear(2, 1, 100, 3, &seed);
    for (int k = 0; k < 4; k++) { /* who moves expects nothing */
        pose.position_m[0] += 1;
        CHECK(turns_that_hear(1, 20, 100, 3, &seed) < 200);
    }
    ping.turns = false;
}

/* Looks of a head in steps of 0.9 degrees, of which those hear that hears() says, at a wall at 3 m that has openings, a
 * quarter of all bearings or none. Returns how many are doubted, or free water where the wall is. */
struct looks {
    int doubted, false_free;
};

static bool wall_at(double az_deg, double opening_deg)
{
    return fabs(remainder(az_deg - 20, 90)) >= opening_deg / 2;
}

static struct looks looks_at(int n, bool (*hears)(int k, uint64_t *seed), double opening_deg, uint64_t *seed)
{
    struct looks got = {0};
    ping.turns = true;
    for (int k = 0; k < n; k++) {
        const double az_deg = 0.9 * (k % 400);
        const bool wall = wall_at(az_deg, opening_deg);
        look(&beam[0], az_deg, wall && hears(k, seed) ? 3 : 0);
        beam[0].echo[0].level = 100;
        got.doubted += run(1);
        got.false_free += wall && beam[0].free_to_m > 3.5f;
    }
    ping.turns = false;
    return got;
}

static bool always(int k, uint64_t *seed)
{
    (void)k, (void)seed;
    return true;
}

static bool never(int k, uint64_t *seed)
{
    return !always(k, seed);
}

static bool two_of_ten(int k, uint64_t *seed)
{
    (void)seed;
    return k % 10 < 2;
}

static bool in_bursts(int k, uint64_t *seed)
{
    (void)seed;
    return k % 77 < 20;
}

static bool in_long_bursts(int k, uint64_t *seed)
{
    (void)seed;
    return k % 530 < 60;
}

static bool every_other_turn(int k, uint64_t *seed)
{
    (void)seed;
    return k / 400 % 2;
}

static bool by_half(int k, uint64_t *seed)
{
    (void)k;
    return test_uniform(seed) < 0.5;
}

static bool by_a_twentieth(int k, uint64_t *seed)
{
    (void)k;
    return test_uniform(seed) < 0.05;
}

/* A loose plug hears whole parts of a turn, or a few looks at a time. What it misses is free only at first. */
TEST(a_receiver_that_hears_in_bursts_is_doubted)
{
    static bool (*const kinds[])(int, uint64_t *) = {two_of_ten,       in_bursts, in_long_bursts,
                                                     every_other_turn, by_half,   by_a_twentieth};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        for (int opening_deg = 0; opening_deg <= 40; opening_deg += 20) {
            uint64_t seed = test_seed();
            begin();
            looks_at(2 * 400, always, opening_deg, &seed);
            looks_at(6 * 400, kinds[i], opening_deg, &seed);
            const struct looks got = looks_at(8 * 400, kinds[i], opening_deg, &seed);
            if (got.false_free > 0)
                printf("kind %zu, openings of %d degrees: %d\n", i, opening_deg, got.false_free);
            CHECK_INT(got.false_free, 0);
            looks_at(2 * 400, always, opening_deg, &seed); /* the plug is pressed home */
            CHECK_INT(looks_at(400, always, opening_deg, &seed).doubted, 0);
        }
}

/* An opening never had an echo, and has none when the receiver hears again. */
TEST(after_an_outage_the_doubt_is_over_in_two_passes)
{
    for (int opening_deg = 0; opening_deg <= 64; opening_deg += 4) {
        uint64_t seed = test_seed();
        begin();
        looks_at(2 * 400, always, opening_deg, &seed);
        CHECK(looks_at(600, never, opening_deg, &seed).doubted > 400); /* 60 s */
        looks_at(2 * 400, always, opening_deg, &seed);
        CHECK_INT(looks_at(400, always, opening_deg, &seed).doubted, 0);
    }
}

/* At the edges of an opening a head that sways shows the wall or does not. */
TEST(edges_are_no_matter_where_the_vehicle_sways)
{
    uint64_t seed = test_seed();
    int doubted = 0;
    begin();
    for (int turn = 0; turn < 12; turn++) {
        ping.turns = true;
        for (int k = 0; k < 400; k++) {
            const double sway_deg = 2 * sin(k / 30.0 + turn), az_deg = 0.9 * k;
            const bool wall = wall_at(az_deg + sway_deg, 30) && (turn < 4 || turn >= 6);
            quat_from_rpy(0, 0, geo_rad(sway_deg), pose.attitude);
            look(&beam[0], az_deg, wall ? 3 + 0.1 * test_uniform(&seed) : 0);
            beam[0].echo[0].level = 100;
            doubted += run(1) && turn >= 8;
        }
        ping.turns = false;
    }
    CHECK_INT(doubted, 0);
}

TEST(who_has_moved_expects_nothing)
{
    static const struct {
        double north_m, yaw_deg, drift_m;
        uint64_t discontinuities, withdrawn;
        unsigned has;
        bool adrift, doubt;
    } row[] = {{0.2, 0, 0, 0, 0, 7, false, true},   {0.5, 0, 0, 0, 0, 7, false, false},
               {0, 3, 0, 0, 0, 7, false, true},     {0, 8, 0, 0, 0, 7, false, false},
               {0, 0, 0.2, 0, 0, 7, false, true},   {0, 0, 0.5, 0, 0, 7, false, false},
               {0, 0, -0.5, 0, 0, 7, false, false}, {0, 0, 0, 1, 0, 7, false, false},
               {0, 0, 0, 0, 1, 7, false, false},    {0, 0, 0, 0, 0, 5, false, false},
               {0, 0, 0, 0, 0, 7, true, false}};
    for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
        begin();
        sweep(0, 360, 3);
        pose.position_m[0] = row[k].north_m;
        quat_from_rpy(0, 0, geo_rad(row[k].yaw_deg), pose.attitude);
        pose.drift_m[row[k].drift_m < 0] = fabs(row[k].drift_m);
        pose.discontinuities = row[k].discontinuities;
        pose.withdrawn = row[k].withdrawn;
        pose.has = row[k].has;
        pose.heading_adrift = row[k].adrift;
        sweep(0, 360, 0);
        if (lost.doubt != row[k].doubt)
            CHECK_INT(k, -1);
    }
}

/* What a mark speaks against, or one beam shows, is no echo to be missed; who is masked or deaf there misses none. */
TEST(only_what_was_shown_is_missed)
{
    static const uint8_t flags[] = {ECHO_BURST, ECHO_GHOST, ECHO_FAINT, ECHO_ALONE, ECHO_OTHER, ECHO_OWN};
    for (size_t k = 0; k < sizeof flags; k++) {
        begin();
        for (double az = 0; az < 360; az += 3.6) {
            look(&beam[0], az, 3);
            beam[0].echo[0].flags = flags[k];
            run(1);
        }
        CHECK_INT(sweep(0, 360, 0), 100);
    }
    begin();
    for (double az = 5; az < 360; az += 10) {
        look(&beam[0], az, 3);
        run(1);
    }
    CHECK_INT(sweep(0, 360, 0), 100);
    sweep(0, 360, 3);
    for (double az = 0; az < 360; az += 3.6) {
        look(&beam[0], az, 0);
        beam[0].heard_to_m = 2.5f;
        run(1);
        CHECK(beam[0].state == BEAM_SILENT);
    }
    CHECK(!lost.doubt);
}

static int fan(double range_m, int from, int to)
{
    int n = 0;
    for (int i = 0; i < FAN; i++)
        look(&beam[i], 2 * i, i >= from && i < to ? range_m : 0);
    run(FAN);
    for (int i = 0; i < FAN; i++)
        n += beam[i].free_to_m > beam[i].blind_m;
    return n;
}

TEST(a_fan_that_loses_all_at_once_is_doubted)
{
    begin();
    fan(3, 0, FAN); /* two beams of a row in one ping are one look */
    CHECK_INT(fan(0, 0, 0), FAN);
    CHECK(!lost.doubt);
    for (int i = 0; i < 3; i++)
        CHECK_INT(fan(3, 0, FAN), FAN);
    CHECK_INT(fan(0, 0, 0), 0);
    CHECK(lost.doubt);
    CHECK_INT(fan(3, 10, 12), FAN);
    CHECK(!lost.doubt);
    for (int i = 0; i < 3; i++)
        fan(3, 0, FAN);
    for (int left = FAN; left >= 0; left -= 4) /* what leaves it does so at an edge */
        fan(3, 0, left);
    CHECK(!lost.doubt);
}

/*
 * A fan, of which every beam before a wall or only some see it; some pings hear, in the others all is silent but for a
 * few false echoes of this level. Returns how many of those beams free water beyond the wall that should show it, and
 * how many pings that hear are doubted.
 */
struct fans {
    int false_free, doubted;
};

struct deaf_fan {
    bool (*sees)(int i);
    bool (*hears)(int n);
    int false_echoes;
    float level;
};

static struct fans fans(int pings, const struct deaf_fan *of, uint64_t *seed)
{
    struct fans got = {0};
    for (int n = 0; n < pings; n++) {
        const bool heard = of->hears(n);
        for (int i = 0; i < FAN; i++) {
            look(&beam[i], 2 * i, heard && of->sees(i) ? 3 : 0);
            beam[i].echo[0].level = 100;
        }
        for (int k = 0; k < of->false_echoes && !heard; k++) {
            const int i = (int)(FAN * test_uniform(seed));
            look(&beam[i], 2 * i, 1 + 8 * test_uniform(seed));
            beam[i].echo[0].level = of->level;
        }
        const bool doubted = run(FAN);
        got.doubted += heard && doubted;
        for (int i = 0; i < FAN && !heard; i++)
            got.false_free += of->sees(i) && beam[i].free_to_m > 3.5f;
    }
    return got;
}

static bool all(int n)
{
    return n >= 0;
}

static bool one_of_20(int n)
{
    return n % 20 == 0;
}

static bool bursts_of_5(int n)
{
    return n % 40 < 5;
}

static bool bursts_of_30(int n)
{
    return n % 130 < 30;
}

static bool every_other(int n)
{
    return n % 2;
}

static bool most(int i)
{
    return i / 8 != 1;
}

static bool half(int i)
{
    return i < FAN / 2;
}

/* A receiver that is deaf is not silent: each of its false echoes says that it hears. */
TEST(a_fan_that_hears_now_and_then_is_doubted)
{
    static bool (*const kinds[])(int) = {one_of_20, bursts_of_5, bursts_of_30, every_other};
    static const struct {
        int n;
        float level;
    } falses[] = {{0, 1}, {2, 1}, {4, 1}, {8, 1}, {1, 100}, {2, 100}};
    const size_t n = sizeof falses / sizeof *falses;
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        for (size_t k = 0; k < 2 * n; k++) {
            uint64_t seed = test_seed();
            const struct deaf_fan deaf = {k < n ? most : half, kinds[i], falses[k % n].n, falses[k % n].level},
                                  well = {deaf.sees, all, 0, 0};
            begin();
            fans(10, &well, &seed);
            fans(400, &deaf, &seed);
            const struct fans got = fans(400, &deaf, &seed);
            if (got.false_free > 0)
                printf("kind %zu, %s, %d false echoes of level %g: %d\n", i, k < n ? "most" : "half",
                       deaf.false_echoes, (double)deaf.level, got.false_free);
            CHECK_INT(got.false_free, 0);
            fans(400, &well, &seed);
            CHECK_INT(fans(20, &well, &seed).doubted, 0);
        }
}

/* Pings of a fan with a strong echo at this range in all beams; 0: in none. */
static void whole_fan(int pings, double range_m)
{
    for (int n = 0; n < pings; n++) {
        for (int i = 0; i < FAN; i++) {
            look(&beam[i], 2 * i, range_m);
            beam[i].echo[0].level = 100;
        }
        run(FAN);
    }
}

/* What one look shows elsewhere may be false; what two in a row show is there, and so is the first from a new place. */
TEST(a_single_look_moves_no_wall)
{
    for (int row = 1; row <= 2; row++) {
        begin();
        whole_fan(3, 3);
        whole_fan(row, 6);
        whole_fan(4, 0);
        whole_fan(row, 6);
        whole_fan(4, 0);
        whole_fan(1, 3);
        CHECK((lost.came_back.bearing[0].range_m > 5) == (row == 2));
    }
    begin();
    whole_fan(3, 3);
    pose.position_m[0] = 1;
    whole_fan(1, 4);
    CHECK(lost.came_back.bearing[0].range_m > 3.9f);
}

/* A capture may begin at any time. */
TEST(the_first_ping_may_be_of_time_0)
{
    begin();
    ping.t_ns = (uint64_t)0 - 100000000;
    whole_fan(1, 3);
    CHECK(ping.t_ns == 0 && !lost.doubt);
    begin();
    ping.t_ns = (uint64_t)0 - 100000000;
    ping.turns = true;
    CHECK_INT(sweep(0, 3, 3), 1);
    CHECK(!lost.doubt);
    ping.turns = false;
}

/* A diver swims along the fan and back, in open water or before a wall on one side. */
TEST(who_comes_back_part_by_part_is_no_doubt)
{
    for (int reach = 2; reach <= 24; reach += 2)
        for (int wall = 0; wall <= 16; wall += 8) {
            uint64_t seed = test_seed();
            int doubted = 0;
            begin();
            for (int n = 0; n < 1000; n++) {
                const double at = 16 + reach * sin(n / 60.0);
                for (int i = 0; i < FAN; i++) {
                    const bool diver = fabs(i - at) < 3;
                    look(&beam[i], 2 * i, diver ? 3 + 0.1 * test_uniform(&seed) : i < wall ? 6 : 0);
                    beam[i].echo[0].level = 100;
                }
                doubted += run(FAN);
            }
            if (doubted > 0)
                printf("%d beams to either side, a wall in %d: %d\n", reach, wall, doubted);
            CHECK_INT(doubted, 0);
        }
}

TEST(a_head_is_in_air_where_depth_and_mount_say_so)
{
    static const struct {
        double down_m, mount_m, roll_deg, uncertain_m;
        unsigned has;
        bool out;
    } row[] = {{0, 0, 0, 0, 7, false},        {-0.2, 0, 0, 0, 7, false},   {-0.4, 0, 0, 0, 7, true},
               {-0.4, 0, 0, 0.2, 7, false},   {-0.4, 0.2, 0, 0, 7, false}, {0.2, -0.6, 0, 0, 7, true},
               {0.2, -0.6, 180, 0, 7, false}, {-0.4, 0, 0, 0, 3, false},   {-0.4, -0.2, 0, 0, 4, false},
               {-0.7, -0.2, 0, 0, 4, true}};
    for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
        struct mount mount = mount_identity;
        begin();
        pose.has = row[k].has;
        pose.position_m[2] = row[k].down_m;
        pose.uncertain_m = row[k].uncertain_m;
        mount.position_m[2] = row[k].mount_m;
        quat_from_rpy(geo_rad(row[k].roll_deg), 0, 0, pose.attitude);
        if (immersion_is_out(&pose, &mount) != row[k].out)
            CHECK_INT(k, -1);
    }
}

/* From where the vehicle is now, and not from where it was. */
TEST(who_has_moved_begins_again)
{
    begin();
    sweep(0, 360, 3);
    pose.position_m[0] = 1;
    for (double az = 1; az < 360; az += 10) /* one look is too few */
        sweep(az, az + 1, 3);
    CHECK_INT(sweep(1, 361, 0), 100);
    for (double az = 1; az < 360; az += 10) {
        sweep(az, az + 1, 3);
        sweep(az, az + 1, 3);
    }
    for (double az = 0; az < 360; az += 3.6) /* what another place showed there is not missed */
        if (fmod(az, 10) > 2)
            CHECK_INT(sweep(az, az + 1, 0), 1);
    sweep(0, 360, 3);
    CHECK_INT(sweep(0, 360, 0), 0);
    CHECK(lost.doubt);
}

TEST(so_many_parts_are_a_doubt)
{
    for (int parts = 5; parts <= 6; parts++) {
        begin();
        sweep(0, 180, 3);
        sweep(0, 10 * parts - 1, 0);
        CHECK(lost.doubt == (parts == 6));
        CHECK_INT(sweep(200, 300, 0), parts == 6 ? 0 : 28); /* where nothing was shown, too */
    }
}

/* What answers again is remembered, what has left is not, and nor is what was missed for long enough. */
TEST(a_part_is_missed_until_another_answers)
{
    begin();
    sweep(0, 30, 3);
    CHECK_INT(sweep(0, 8, 0), 0);
    sweep(0, 1, 3); /* the part itself */
    CHECK_INT(sweep(3.6, 8, 0), 0);
    sweep(10.8, 11, 3); /* another */
    CHECK_INT(sweep(0, 8, 0), 3);
    CHECK_INT(sweep(21.6, 28, 0), 0); /* a third is remembered */
    begin();
    sweep(0, 9, 3);
    sweep(0, 9, 0);
    ping.t_ns += 11000000000u;
    CHECK_INT(sweep(0, 9, 0), 3);
    sweep(0, 1, 3);
    CHECK_INT(sweep(3.6, 9, 0), 2);
}

static bool doubt_after(void (*change)(struct beam_echoes *))
{
    begin();
    sweep(0, 360, 3);
    for (double az = 0; az < 360; az += 3.6) {
        look(&beam[0], az, 0);
        change(&beam[0]);
        run(1);
    }
    return lost.doubt;
}

static void as_it_is(struct beam_echoes *b)
{
    (void)b;
}

static void deaf_near(struct beam_echoes *b)
{
    b->heard_from_m = 3.5f;
}

static void blind(struct beam_echoes *b)
{
    b->state = BEAM_BLIND;
}

static void faint(struct beam_echoes *b)
{
    b->n = 1;
    b->echo[0].flags = ECHO_FAINT;
}

TEST(only_a_silent_beam_that_would_have_heard_it_misses_an_echo)
{
    CHECK(doubt_after(as_it_is));
    CHECK(!doubt_after(deaf_near));
    CHECK(!doubt_after(blind));
    CHECK(!doubt_after(faint));
}

/* Behind the vehicle's own echo, which is none. */
TEST(any_firm_echo_of_a_beam_counts)
{
    begin();
    for (double az = 0; az < 360; az += 3.6) {
        look(&beam[0], az, 1);
        beam[0].n = 2;
        beam[0].echo[0].flags = ECHO_OWN;
        beam[0].echo[1] = (struct echo){.range_m = 3};
        run(1);
    }
    CHECK_INT(sweep(0, 360, 0), 0);
    CHECK(lost.doubt);
}

/* Of 32 beams in 16 parts. */
TEST(beams_of_a_fan_miss_their_own_echoes)
{
    for (int parts = 11; parts <= 12; parts++) {
        begin();
        for (int n = 0; n < 256; n++) {
            for (int i = 0; i < FAN; i++)
                look(&beam[i], 2 * i, i % 2 == 0 && i < 2 * parts ? 3 : 0);
            run(FAN);
        }
        CHECK_INT(fan(0, 0, 0), parts == 11 ? FAN - 11 : 0);
        CHECK(lost.doubt == (parts == 12));
    }
}

int main(void)
{
    RUN(who_has_moved_begins_again);
    RUN(so_many_parts_are_a_doubt);
    RUN(a_part_is_missed_until_another_answers);
    RUN(only_a_silent_beam_that_would_have_heard_it_misses_an_echo);
    RUN(any_firm_echo_of_a_beam_counts);
    RUN(beams_of_a_fan_miss_their_own_echoes);
    RUN(echoes_that_are_gone_on_all_sides_are_a_doubt_until_the_next);
    RUN(one_obstacle_may_leave);
    RUN(a_receiver_that_hears_now_and_then_is_doubted);
    RUN(a_receiver_that_hears_in_bursts_is_doubted);
    RUN(after_an_outage_the_doubt_is_over_in_two_passes);
    RUN(edges_are_no_matter_where_the_vehicle_sways);
    RUN(a_fan_that_hears_now_and_then_is_doubted);
    RUN(a_single_look_moves_no_wall);
    RUN(the_first_ping_may_be_of_time_0);
    RUN(who_comes_back_part_by_part_is_no_doubt);
    RUN(who_has_moved_expects_nothing);
    RUN(only_what_was_shown_is_missed);
    RUN(a_fan_that_loses_all_at_once_is_doubted);
    RUN(a_head_is_in_air_where_depth_and_mount_say_so);
    return test_end();
}
