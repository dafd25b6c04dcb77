/* SPDX-License-Identifier: MIT */
/*
 * test_marks - which echoes are marked as bursts, ghosts and pulses of other sonars: looks made by hand, a head that
 * turns over them.
 */
#include "tests/lib/test.h"

#include "grid/range/marks.h"

#define STEP_DEG  1.8
#define WIDTH_DEG 3.0

static struct marks marks;
static struct beam_echoes beam;
static struct pose pose;
static uint64_t t_ns;
static float reach_m;
static uint8_t flags; /* of the extract stage */

static void begin(void)
{
    marks_init(&marks, 1500.0);
    pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_POSITION;
    t_ns = 1000000000;
    reach_m = 50.0f;
    flags = 0;
}

/* One look with echoes at the given ranges (0: no more), strengths falling with range; returns it with its flags. */
static const struct beam_echoes *look(double az_deg, double a_m, double b_m)
{
    struct echoes ping = {.t_ns = t_ns += 80000000,
                          .n_beams = 1,
                          .max_beams = 1,
                          .range_max_m = reach_m,
                          .az_aperture_rad = (float)geo_rad(WIDTH_DEG),
                          .pose = pose,
                          .beam = &beam};
    const double range_m[] = {a_m, b_m};
    beam = (struct beam_echoes){
        .az_rad = (float)geo_rad(az_deg), .heard_from_m = 0.3f, .heard_to_m = reach_m, .state = BEAM_SILENT};
    for (int i = 0; i < 2 && range_m[i] > 0.0; i++) {
        beam.state = BEAM_ECHO;
        beam.heard_to_m = fminf(beam.heard_to_m, (float)range_m[i]);
        beam.echo[beam.n++] = (struct echo){.range_m = (float)range_m[i],
                                            .near_m = (float)range_m[i],
                                            .strength = (float)(10.0 / range_m[i]),
                                            .flags = flags};
    }
    marks_run(&marks, &ping);
    return &beam;
}

static void sweep(double range_m)
{
    for (double az_deg = 0.0; az_deg < 359.0; az_deg += STEP_DEG)
        look(az_deg, range_m, 0.0);
}

TEST(an_echo_that_two_looks_deny_is_a_burst)
{
    begin();
    sweep(0.0);
    CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, ECHO_BURST);
    begin();
    sweep(30.0); /* a wall behind it: heard past 12 m */
    CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, ECHO_BURST);
}

TEST(what_an_older_look_shows_is_no_burst)
{
    begin();
    sweep(12.0);
    CHECK_INT(look(90.0, 12.3, 0.0)->echo[0].flags, 0);
    CHECK_INT(look(91.8, 12.1, 0.0)->echo[0].flags, 0);
}

TEST(the_first_look_onto_something_is_alone_until_the_next_one)
{
    begin();
    look(0.0, 0.0, 0.0);
    look(1.8, 0.0, 0.0);
    CHECK_INT(look(3.6, 5.0, 0.0)->echo[0].flags, ECHO_ALONE); /* only one of the two is within the beam's width */
    CHECK_INT(look(5.4, 5.0, 0.0)->echo[0].flags, 0);          /* and now one shows it */
}

TEST(what_no_look_denies_is_not_alone)
{
    begin();
    look(0.0, 0.0, 0.0);
    CHECK_INT(look(7.2, 5.0, 0.0)->echo[0].flags, 0); /* no beam overlaps it */
}

TEST(a_faint_echo_stays_so_until_another_look_shows_it)
{
    begin();
    flags = ECHO_FAINT;
    CHECK_INT(look(7.2, 5.0, 0.0)->echo[0].flags, ECHO_FAINT);
    CHECK_INT(look(9.0, 5.0, 0.0)->echo[0].flags, 0);
    CHECK_INT(look(18.0, 9.0, 0.0)->echo[0].flags, ECHO_FAINT);
}

/* The beam beside it in the same pass hears the same speckle: of a new faint thing the next turn is the proof, and of
 * one as loud as a target the next beam. */
TEST(a_faint_echo_that_the_last_turn_denies_waits_for_the_next_turn)
{
    for (int faint = 0; faint < 2; faint++) {
        begin();
        sweep(0.0);
        flags = faint ? ECHO_FAINT : 0;
        CHECK_INT(look(90.0, 5.0, 0.0)->echo[0].flags, flags | ECHO_BURST);
        CHECK_INT(look(91.8, 5.0, 0.0)->echo[0].flags, faint ? ECHO_FAINT | ECHO_BURST : 0);
        CHECK_INT(look(93.6, 0.0, 0.0)->n, 0);
        CHECK_INT(look(90.0, 5.0, 0.0)->echo[0].flags, 0);
        CHECK_INT(look(91.8, 5.0, 0.0)->echo[0].flags, 0);
    }
}

TEST(one_look_for_a_faint_echo_and_one_against_it_leave_it_doubtful)
{
    for (int faint = 0; faint < 2; faint++) {
        begin();
        look(1.8, 0.0, 0.0);
        flags = faint ? ECHO_FAINT : 0;
        CHECK_INT(look(3.6, 5.0, 0.0)->echo[0].flags, flags | ECHO_ALONE);
        CHECK_INT(look(2.7, 5.0, 0.0)->echo[0].flags, faint ? ECHO_FAINT | ECHO_ALONE : 0);
        CHECK_INT(look(2.7, 5.0, 0.0)->echo[0].flags, 0);
    }
}

TEST(looks_that_could_not_have_shown_it_deny_nothing)
{
    begin();
    sweep(5.0); /* it may have hidden what is behind */
    CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, 0);
    begin();
    sweep(0.0);
    CHECK_INT(look(90.0, 0.2, 0.0)->echo[0].flags, 0); /* in the blind stretch of the others */
    begin();
    for (double az_deg = 80.0; az_deg < 100.0; az_deg += STEP_DEG) {
        struct beam_echoes deaf = {.az_rad = (float)geo_rad(az_deg), .state = BEAM_BLIND};
        struct echoes ping = {.t_ns = t_ns += 80000000, .n_beams = 1, .az_aperture_rad = 0.05f, .beam = &deaf};
        ping.pose = pose;
        ping.range_max_m = reach_m;
        marks_run(&marks, &ping);
        deaf.state = BEAM_SILENT; /* heard_to_m is 0: its silence says nothing */
        marks_run(&marks, &ping);
    }
    CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, 0);
}

TEST(a_shorter_range_denies_nothing_beyond_its_end)
{
    begin();
    reach_m = 2.0f;
    sweep(0.0);
    reach_m = 50.0f;
    CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, 0);
    CHECK_INT(look(90.0, 1.5, 0.0)->echo[0].flags, ECHO_BURST);
}

TEST(a_look_that_heard_only_a_stretch_denies_nothing_outside_of_it)
{
    for (int hidden = 0; hidden < 2; hidden++) {
        begin();
        for (double az_deg = 80.0; az_deg < 100.0; az_deg += STEP_DEG) {
            struct beam_echoes half = {
                .az_rad = (float)geo_rad(az_deg), .state = BEAM_SILENT, .heard_to_m = 50.0f};
            struct echoes ping = {
                .t_ns = t_ns += 80000000, .n_beams = 1, .az_aperture_rad = 0.05f, .pose = pose, .beam = &half};
            if (hidden)
                half.heard_to_m = 10.0f; /* a mask there */
            else
                half.heard_from_m = 13.0f; /* the water is loud before */
            marks_run(&marks, &ping);
        }
        CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, 0);
        CHECK_INT(look(90.0, hidden ? 9.0 : 14.0, 0.0)->echo[0].flags, ECHO_BURST);
    }
}

/* Without a place the vehicle may have driven anywhere meanwhile; its velocity tells where. */
TEST(looks_of_a_vehicle_that_may_have_moved_are_no_evidence)
{
    static const struct {
        unsigned has;
        uint8_t flags;
    } row[] = {{0, 0},
               {POSE_ATTITUDE, 0},
               {POSE_ATTITUDE | POSE_DEPTH, 0},
               {POSE_POSITION, 0},
               {POSE_ATTITUDE | POSE_VELOCITY, ECHO_BURST},
               {POSE_ATTITUDE | POSE_POSITION, ECHO_BURST}};

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin();
        pose.has = row[i].has;
        sweep(0.0);
        CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, row[i].flags);
    }
}

TEST(old_looks_and_looks_from_elsewhere_are_no_evidence)
{
    begin();
    sweep(0.0);
    t_ns += 100000000000;
    CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, 0);
    begin();
    sweep(0.0);
    pose.position_m[0] += 0.5;
    CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, 0);
    begin();
    sweep(0.0);
    quat_from_rpy(0, 0, geo_rad(3.0), pose.attitude);
    CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, 0);
    begin();
    pose.position_m[0] = 1e7; /* far from the origin small steps still count */
    sweep(0.0);
    pose.position_m[0] += 0.1;
    CHECK_INT(look(90.0, 12.0, 0.0)->echo[0].flags, ECHO_BURST);
}

TEST(an_echo_at_twice_the_first_range_is_a_ghost)
{
    begin();
    CHECK_INT(look(0.0, 4.0, 8.05)->echo[1].flags, ECHO_GHOST);
    CHECK_INT(beam.echo[0].flags, 0);
    CHECK_INT(look(0.0, 4.0, 7.0)->echo[1].flags, 0);
    CHECK_INT(look(0.0, 4.0, 8.6)->echo[1].flags, 0);
}

TEST(between_two_walls_the_ghost_comes_later)
{
    begin();
    look(270.0, 2.2, 0.0);
    CHECK_INT(look(90.0, 1.0, 4.1)->echo[1].flags, ECHO_GHOST); /* 1 + 1 + 2.2 */
    CHECK_INT(look(60.0, 1.0, 4.1)->echo[1].flags, 0);          /* nothing is known of the other side */
}

/*
 * Another sonar sends every 57 ms, so that looks at 90 degrees and two steps later may show a pulse at the same range;
 * a wall at 9 m fills a quarter of the turn. Pulses and beams of the wall after the first turn, and how many block.
 */
static void pulses_and_a_wall(unsigned pulse[2], unsigned wall[2])
{
    uint64_t seed = test_seed();
    double other_s = 0.0;
    for (int i = 0; i < 1200; i++) {
        const double az_deg = i % 200 * STEP_DEG;
        t_ns += (uint64_t)(3e6 * test_uniform(&seed));
        const double sent_s = (double)(t_ns + 80000000) * 1e-9;
        while (other_s < sent_s + 0.002)
            other_s += 0.057;
        const double pulse_m = (other_s - sent_s) * 750.0;
        const bool there = az_deg >= 90.0 && az_deg <= 180.0, heard = pulse_m < 40.0;
        if (there && (!heard || pulse_m > 9.0))
            look(az_deg, 9.0, 0.0);
        else
            look(az_deg, heard ? pulse_m : 0.0, there ? 9.0 : 0.0);
        for (int k = 0; k < beam.n && i >= 400; k++) {
            unsigned *count = beam.echo[k].range_m == 9.0f ? wall : pulse;
            count[0]++;
            count[1] += !(beam.echo[k].flags & ECHO_UNCONFIRMED);
        }
    }
}

TEST(what_comes_when_a_pulse_is_due_is_none_of_the_water_be_it_shown_twice)
{
    unsigned pulse[2] = {0}, wall[2] = {0};
    begin();
    pulses_and_a_wall(pulse, wall);
    printf("# %u of %u pulses block, %u of %u beams of the wall\n", pulse[1], pulse[0], wall[1], wall[0]);
    CHECK(pulse[0] > 400 && pulse[1] < 0.05 * pulse[0]);
    CHECK(wall[0] > 150 && wall[1] > 0.98 * wall[0]); /* a beam beside it shows it when no pulse is due */
}

/* A look once the head has waited for so long. */
static const struct beam_echoes *look_after(double wait_s, double az_deg, double range_m)
{
    t_ns += (uint64_t)(1e9 * wait_s) - 80000000;
    return look(az_deg, range_m, 0.0);
}

/*
 * Another sonar is heard for two turns, then our pings come at multiples of its period or at other times, and a pile
 * stands where its pulses are due in the first of the three beams over it: one of the three blocks.
 */
TEST(a_pile_is_not_lost_among_pulses)
{
    uint64_t seed = test_seed();
    for (int k = 0; k < 120; k++) {
        const double period_s = 0.06 + 0.04 * test_uniform(&seed);
        const double periods = k % 2 ? 1 + k % 3 : 1.0 + 2.0 * test_uniform(&seed);
        double other_s = 0.0, pulse_m = 0.0;
        bool blocks = false;
        begin();
        for (int i = 0; i < 500; i++) {
            const double wait_s = period_s * (i < 400 ? 1.3 + 0.03 * test_uniform(&seed) : periods);
            const double sent_s = (double)t_ns * 1e-9 + wait_s;
            while (other_s < sent_s + 0.002)
                other_s += period_s;
            pulse_m = (other_s - sent_s) * 750.0;
            look_after(wait_s, i * STEP_DEG, i < 400 && pulse_m < 40.0 ? pulse_m : 0.0);
        }
        const double pile_m = pulse_m;
        for (int i = 500; i < 503; i++) {
            look_after(period_s * periods, i * STEP_DEG, pile_m);
            blocks |= !(beam.echo[0].flags & ECHO_UNCONFIRMED);
        }
        CHECK(blocks);
    }
}

TEST(the_seam_of_the_circle_is_no_edge)
{
    begin();
    sweep(0.0);
    CHECK_INT(look(359.9, 12.0, 0.0)->echo[0].flags, ECHO_BURST);
    begin();
    sweep(12.0);
    CHECK_INT(look(-0.5, 12.0, 0.0)->echo[0].flags, 0);
}

TEST(any_echoes_are_taken)
{
    static struct beam_echoes many[64];
    uint64_t seed = test_seed();
    begin();
    for (int k = 0; k < 3000; k++) {
        struct echoes ping = {.t_ns = test_random(&seed) % 3 ? t_ns += 1000000 : test_random(&seed),
                              .n_beams = (uint16_t)(test_random(&seed) % 64),
                              .az_aperture_rad = (float)(8.0 * test_uniform(&seed) - 0.5),
                              .pose = pose,
                              .beam = many};
        for (int b = 0; b < 64; b++) {
            many[b] = (struct beam_echoes){.az_rad = (float)(1e3 * (test_uniform(&seed) - 0.5)),
                                           .el_rad = (float)test_uniform(&seed),
                                           .state = (uint8_t)(test_random(&seed) % 3),
                                           .n = (uint8_t)(test_random(&seed) % (ECHOES_PER_BEAM + 1))};
            for (int i = 0; i < many[b].n; i++)
                many[b].echo[i].range_m = (float)(100.0 * test_uniform(&seed));
        }
        marks_run(&marks, &ping);
        for (int b = 0; b < ping.n_beams; b++)
            for (int i = 0; i < many[b].n; i++)
                CHECK((many[b].echo[i].flags & ~(ECHO_BURST | ECHO_GHOST)) == 0 &&
                      (i > 0 || !(many[b].echo[i].flags & ECHO_GHOST)));
    }
}

int main(void)
{
    RUN(an_echo_that_two_looks_deny_is_a_burst);
    RUN(what_an_older_look_shows_is_no_burst);
    RUN(the_first_look_onto_something_is_alone_until_the_next_one);
    RUN(what_no_look_denies_is_not_alone);
    RUN(a_faint_echo_stays_so_until_another_look_shows_it);
    RUN(a_faint_echo_that_the_last_turn_denies_waits_for_the_next_turn);
    RUN(one_look_for_a_faint_echo_and_one_against_it_leave_it_doubtful);
    RUN(looks_that_could_not_have_shown_it_deny_nothing);
    RUN(a_shorter_range_denies_nothing_beyond_its_end);
    RUN(a_look_that_heard_only_a_stretch_denies_nothing_outside_of_it);
    RUN(looks_of_a_vehicle_that_may_have_moved_are_no_evidence);
    RUN(old_looks_and_looks_from_elsewhere_are_no_evidence);
    RUN(an_echo_at_twice_the_first_range_is_a_ghost);
    RUN(between_two_walls_the_ghost_comes_later);
    RUN(what_comes_when_a_pulse_is_due_is_none_of_the_water_be_it_shown_twice);
    RUN(a_pile_is_not_lost_among_pulses);
    RUN(the_seam_of_the_circle_is_no_edge);
    RUN(any_echoes_are_taken);
    return test_end();
}
