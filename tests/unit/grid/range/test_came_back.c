/* SPDX-License-Identifier: MIT */
/* test_came_back - which echoes that were gone and are there again tell that the receiver was deaf: each rule by a head
 * that turns on the spot, with that alone changed. */
#include "tests/lib/test.h"

#include "grid/range/came_back.h"

#define STEP_DEG 3.6
#define WALL_M   5.0f
#define SECOND   1000000000ull

/* What a head sees in a turn. */
struct turn {
    bool gone;        /* nothing, but where... */
    int every, parts; /* ... `every` so many bearings, or in the first so many parts of 10 degrees alone; 0: all */
    float range_m;    /* of the wall */
    float level;      /* of its echoes */
    uint16_t flags;   /* of them */
    uint8_t state;    /* of beams without one ... */
    float from_m, to_m; /* ... which would hear it in between */
};

static const struct turn wall = {.range_m = WALL_M, .level = 5, .state = BEAM_SILENT, .from_m = 0.3f, .to_m = 10};
static struct came_back mind;
static struct pose pose;
static uint64_t now_ns;
static bool turns = true;

static void begin(void)
{
    memset(&mind, 0, sizeof mind);
    pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    now_ns = 1000 * SECOND;
}

static bool is_gone_at(const struct turn *t, int i)
{
    const bool concerned = (!t->every || i % t->every == 0) && (!t->parts || i * STEP_DEG < 10 * t->parts);
    return t->gone && concerned;
}

/* Is there a doubt at its end? */
static bool turn(const struct turn *t)
{
    bool doubt = false;
    for (int i = 0; i < 100; i++) {
        const bool gone = is_gone_at(t, i);
        struct beam_echoes beam = {.az_rad = (float)geo_rad(i * STEP_DEG),
                                   .state = gone ? t->state : (uint8_t)BEAM_ECHO,
                                   .n = !gone,
                                   .heard_from_m = t->from_m,
                                   .heard_to_m = t->to_m};
        beam.echo[0] = (struct echo){.range_m = t->range_m, .level = t->level, .flags = (uint8_t)t->flags};
        const struct echoes ping = {
            .t_ns = now_ns += SECOND / 10, .n_beams = 1, .turns = turns, .pose = pose, .beam = &beam};
        doubt = came_back_run(&mind, &ping);
    }
    return doubt;
}

/* The wall, then it is gone, then it is there again: that is a doubt as soon as it is missed once more. */
static bool comes_back(const struct turn *shown, const struct turn *gone, const struct turn *again)
{
    begin();
    CHECK(!turn(shown) && !turn(shown));
    CHECK(!turn(gone) && !turn(again));
    return turn(gone);
}

TEST(what_was_gone_and_is_there_again_is_a_doubt)
{
    struct turn gone = wall;
    gone.gone = true;
    CHECK(comes_back(&wall, &gone, &wall));
    turns = false; /* a sonar that looks one way says nothing */
    CHECK(!comes_back(&wall, &gone, &wall));
    turns = true;
}

TEST(only_strong_echoes_that_nothing_speaks_against_count)
{
    static const struct {
        float level;
        uint16_t flags;
        bool doubt;
    } row[] = {{4, 0, true},         {3.9f, 0, false},       {5, ECHO_FAINT, false}, {5, ECHO_OTHER, false},
               {5, ECHO_OWN, false}, {5, ECHO_GHOST, false}, {5, ECHO_ALONE, true},  {5, ECHO_BURST, true}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        struct turn shown = wall, gone = wall;
        shown.level = row[i].level;
        shown.flags = row[i].flags;
        gone.gone = true;
        CHECK_INT(comes_back(&shown, &gone, &shown), row[i].doubt);
    }
}

TEST(only_a_silent_beam_that_would_have_heard_it_misses_it)
{
    static const struct {
        uint8_t state;
        float from_m, to_m;
        bool doubt;
    } row[] = {{BEAM_SILENT, 0.3f, 10, true}, {BEAM_BLIND, 0.3f, 10, false},    {BEAM_SILENT, 5.1f, 10, false},
               {BEAM_SILENT, 4.9f, 10, true}, {BEAM_SILENT, 0.3f, 4.9f, false}, {BEAM_SILENT, 0.3f, 5.1f, true}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        struct turn gone = wall;
        gone.gone = true;
        gone.state = row[i].state;
        gone.from_m = row[i].from_m;
        gone.to_m = row[i].to_m;
        CHECK_INT(comes_back(&wall, &gone, &wall), row[i].doubt);
    }
}

TEST(it_comes_back_to_where_it_was)
{
    struct turn gone = wall, nearer = wall;
    gone.gone = true;
    nearer.range_m = WALL_M - 0.35f;
    CHECK(!comes_back(&wall, &gone, &nearer)); /* another one */
    nearer.range_m = WALL_M - 0.25f;
    CHECK(comes_back(&wall, &gone, &nearer));
}

TEST(so_many_parts_are_a_doubt)
{
    struct turn gone = wall;
    gone.gone = true;
    gone.parts = 5;
    CHECK(!comes_back(&wall, &gone, &wall));
    gone.parts = 6;
    CHECK(comes_back(&wall, &gone, &wall));
}

/* Of a part that stood as exactly where it was half is enough; else all of it has to be missed. */
TEST(half_of_a_part_is_enough_where_its_edges_are_known)
{
    struct turn gone = wall;
    gone.gone = true;
    gone.every = 2;
    for (int gone_astray = 0; gone_astray < 3; gone_astray++) {
        begin();
        CHECK(!turn(&wall) && !turn(&wall));
        if (gone_astray == 1)
            quat_from_rpy(0, 0, geo_rad(0.6), pose.attitude);
        pose.position_m[2] = gone_astray == 2 ? 0.06 : 0;
        CHECK(!turn(&gone) && !turn(&wall));
        CHECK_INT(turn(&gone), !gone_astray);
    }
    gone.every = 5; /* one look in a part */
    CHECK(!comes_back(&wall, &gone, &wall));
}

TEST(who_has_moved_expects_nothing)
{
    static const struct {
        double m, level_m, depth_m, deg;
        bool doubt;
    } row[] = {{0.29, 0, 0, 0, true},  {0.31, 0, 0, 0, false}, {0, 0.31, 0, 0, false},
               {0, 0, 0.31, 0, false}, {0, 0, 0, 4.9, true},   {0, 0, 0, 5.1, false}};
    struct turn gone = wall;
    gone.gone = true;
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        begin();
        pose.drift_m[0] = pose.drift_m[1] = 0.6; /* what it drifted before is no matter */
        CHECK(!turn(&wall) && !turn(&wall));
        pose.position_m[1] = row[i].m;
        pose.drift_m[0] += row[i].level_m;
        pose.drift_m[1] += row[i].depth_m;
        quat_from_rpy(0, 0, geo_rad(row[i].deg), pose.attitude);
        CHECK(!turn(&gone) && !turn(&wall));
        CHECK_INT(turn(&gone), row[i].doubt);
    }
}

/* Eight piles that a head sees in three bearings each, while it turns to and fro by more than that. */
TEST(piles_are_not_gone_where_the_vehicle_sways)
{
    begin();
    for (int look = 0; look < 20 * 400; look++) {
        now_ns += SECOND * 3 / 100;
        const double az_deg = 0.9 * (look % 400), yaw_deg = 2 * sin(0.0075 * look);
        const bool pile = fabs(remainder(az_deg + yaw_deg - 5, 45)) < 1.35;
        struct beam_echoes beam = {.az_rad = (float)geo_rad(az_deg),
                                   .state = pile ? BEAM_ECHO : BEAM_SILENT,
                                   .n = pile,
                                   .heard_from_m = 0.3f,
                                   .heard_to_m = 10};
        quat_from_rpy(0, 0, geo_rad(yaw_deg), pose.attitude);
        beam.echo[0] = (struct echo){.range_m = 6, .level = 8};
        const struct echoes ping = {.t_ns = now_ns, .n_beams = 1, .turns = true, .pose = pose, .beam = &beam};
        if (came_back_run(&mind, &ping)) {
            CHECK_INT(look, -1);
            return;
        }
    }
}

/* It ends once what came back is heard again, and not while more than a quarter of it is missed; or when nothing is
 * heard of it any more. */
TEST(a_doubt_ends_when_it_is_heard_again)
{
    struct turn gone = wall, some = wall;
    gone.gone = some.gone = true;
    some.every = 2;
    CHECK(comes_back(&wall, &gone, &wall));
    CHECK(turn(&some) && turn(&some)); /* it is missed now and then */
    turn(&wall);
    CHECK(!turn(&wall));
    CHECK(comes_back(&wall, &gone, &wall));
    for (int pass = 3; pass < 10; pass++) /* that told of it, and that missed it, were two of eight */
        CHECK_INT(turn(&gone), pass < 8);
    CHECK(comes_back(&wall, &gone, &wall));
    now_ns += 301 * SECOND;
    CHECK(!turn(&gone));
}

int main(void)
{
    RUN(what_was_gone_and_is_there_again_is_a_doubt);
    RUN(only_strong_echoes_that_nothing_speaks_against_count);
    RUN(only_a_silent_beam_that_would_have_heard_it_misses_it);
    RUN(it_comes_back_to_where_it_was);
    RUN(so_many_parts_are_a_doubt);
    RUN(half_of_a_part_is_enough_where_its_edges_are_known);
    RUN(who_has_moved_expects_nothing);
    RUN(piles_are_not_gone_where_the_vehicle_sways);
    RUN(a_doubt_ends_when_it_is_heard_again);
    return test_end();
}
