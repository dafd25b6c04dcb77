/* SPDX-License-Identifier: MIT */
/* test_beams - what a row takes from the beams of a ping: rule by rule, each on the fewest beams that show it. */
#include "tests/lib/test.h"

#include "grid/water/beams.h"

static struct beam_echoes beam[BEAMS_MAX];
static struct echoes ping;
static struct beams_deaf deaf;
static struct beams_row row;

/* So many beams, apart_deg from each other and as wide, free from 0.3 to 10 m. */
static void start(uint16_t beams, double apart_deg)
{
    ping = (struct echoes){.n_beams = beams,
                           .az_aperture_rad = (float)geo_rad(apart_deg),
                           .el_aperture_rad = (float)geo_rad(20),
                           .pose = pose_identity,
                           .beam = beam};
    for (uint16_t i = 0; i < beams; i++)
        beam[i] = (struct beam_echoes){
            .az_rad = (float)geo_rad((i - (beams - 1) / 2.0) * apart_deg), .blind_m = 0.3f, .free_to_m = 10};
    deaf = (struct beams_deaf){.n = beams};
}

static bool read_row(void)
{
    return beams_read(&ping, &deaf, &row);
}

static double az_deg(size_t i)
{
    return geo_deg(row.beam[i].az_rad);
}

TEST(a_record_is_of_where_the_sensor_was)
{
    struct mount mount = {.attitude = {1, 0, 0, 0}, .position_m = {1, 0, 0.5}};
    struct water_record record;
    start(1, 10);
    ping.pose.position_m[0] = 7;
    ping.pose.position_m[2] = 3;
    quat_from_rpy(0, 0, GEO_PI / 2, ping.pose.attitude);
    quat_from_rpy(0, 0, GEO_PI / 2, mount.attitude);
    beams_begin(&record, &ping, &mount);
    const double want_m[3] = {7, 1, 3.5};
    for (int i = 0; i < 3; i++)
        CHECK_NEAR(record.place_m[i], want_m[i], 0, 1e-12);
    CHECK_NEAR(record.axis[0][0], -1, 0, 1e-12); /* a quarter, and another one */
    CHECK_NEAR(record.lever_m, sqrt(1.25), 1e-12, 0);
}

TEST(beams_are_sorted_and_of_two_at_one_azimuth_the_worse_counts)
{
    static const double az[] = {3, -7, 5, -7, 0};
    start(5, 1);
    for (int i = 0; i < 5; i++) {
        beam[i].az_rad = (float)geo_rad(az[i]);
        beam[i].free_to_m = (float)(10 + i);
    }
    beam[1].n = 1; /* an echo, at 11 m */
    CHECK(read_row());
    CHECK_INT(row.n, 4);
    static const double want_deg[] = {-7, 0, 3, 5}, want_m[] = {11, 14, 10, 12};
    for (size_t i = 0; i < 4; i++) {
        CHECK_NEAR(az_deg(i), want_deg[i], 0, 1e-4);
        CHECK_NEAR(row.beam[i].axis_m, want_m[i], 0, 1e-6);
    }
    CHECK_NEAR(row.beam[0].ends_m, 11, 0, 1e-6);
    CHECK(isinf(row.beam[1].ends_m));
    for (int falls = 0; falls < 2; falls++) { /* either way round */
        start(3, 2);
        for (int i = 0; i < 3; i++) {
            beam[i].az_rad = (float)geo_rad((falls ? -2 : 2) * (i - 1));
            beam[i].free_to_m = (float)(10 + i);
        }
        CHECK(read_row());
        CHECK_INT(row.n, 3);
        for (size_t i = 0; i < 3; i++) {
            CHECK_NEAR(az_deg(i), 2 * ((double)i - 1), 0, 1e-4);
            CHECK_NEAR(row.beam[i].axis_m, 10 + (falls ? 2 - (double)i : (double)i), 0, 1e-6);
        }
    }
}

TEST(each_beam_begins_where_it_detects)
{
    start(3, 5);
    beam[1].blind_m = 1.5f; /* late, and nothing of the others */
    beam[2].blind_m = 0.9f;
    beam[2].free_to_m = 0;
    CHECK(read_row());
    CHECK_NEAR(row.beam[0].near_m, 0.3, 0, 1e-6);
    CHECK_NEAR(row.beam[1].near_m, 1.5, 0, 1e-6);
    CHECK(row.beam[1].axis_m == 10 && row.beam[2].axis_m == 0);
    start(2, 5); /* at one azimuth: the later counts */
    beam[0].az_rad = beam[1].az_rad;
    beam[0].blind_m = 0.7f;
    CHECK(read_row());
    CHECK_INT(row.n, 1);
    CHECK_NEAR(row.beam[0].near_m, 0.7, 0, 1e-6);
}

TEST(off_the_axis_beams_have_edges_of_their_own)
{
    start(3, 5);
    for (int i = 0; i < 3; i++) {
        beam[i].side_to_m = 7;
        beam[i].edge_from_m = 0.4f + 0.1f * (float)i;
        beam[i].edge_to_m = 5;
    }
    CHECK(read_row()); /* nothing is known of them: as on the axis */
    CHECK(row.beam[0].side_m == 10 && row.beam[0].edge_m == 10);
    CHECK_NEAR(row.beam[0].edge_near_m, 0.3, 0, 1e-6);
    for (int i = 0; i < 3; i++)
        beam[i].off_axis = true;
    beam[2].edge_to_m = 0.5f; /* begins behind its end: it frees nothing */
    CHECK(read_row());
    CHECK(row.beam[0].side_m == 7 && row.beam[0].edge_m == 5 && row.beam[2].edge_m == 0);
    for (size_t i = 0; i < 3; i++)
        CHECK_NEAR(row.beam[i].edge_near_m, 0.4 + 0.1 * (double)i, 1e-6, 0);
    beam[1].side_to_m = 12;
    beam[1].edge_to_m = 11;
    CHECK(read_row());
    CHECK(row.beam[1].side_m == 10 && row.beam[1].edge_m == 10); /* no farther than inside of that */
}

/* Once it says nothing; twice, or with an echo of its own near by, it ends what was free. */
TEST(a_deaf_beam_ends_the_water_the_second_time)
{
    for (int kind = 0; kind < 5; kind++) {
        start(3, 5);
        beam[1].free_to_m = 0;
        if (kind == 1 || kind == 2)
            beams_listen(&deaf, &ping);
        if (kind == 2)
            deaf.n = 4; /* another ping of other beams */
        if (kind == 3)
            beam[1].n = 1;
        if (kind == 4) { /* the one before heard the vehicle itself: that is not deaf */
            beam[1].n = 1;
            beam[1].echo[0].flags = ECHO_OWN;
            beams_listen(&deaf, &ping);
            beam[1].n = 0;
        }
        CHECK(read_row());
        const bool ends = kind == 1 || kind == 3;
        CHECK(ends ? row.beam[1].ends_m == 0 : isinf(row.beam[1].ends_m));
        CHECK(row.beam[1].axis_m == 0 && isinf(row.beam[0].ends_m));
    }
}

TEST(an_echo_of_a_ping_that_may_be_anywhere_ends_nothing)
{
    static const struct {
        double m, deg;
        bool ends;
    } poses[] = {{0.09, 0, true}, {0.11, 0, false}, {0, 1.2, true}, {0, 1.3, false}};
    for (size_t i = 0; i < sizeof poses / sizeof *poses; i++) {
        start(3, 5);
        beam[1].n = 1;
        ping.pose.uncertain_m = poses[i].m;
        ping.pose.uncertain_rad = geo_rad(poses[i].deg);
        CHECK(read_row());
        CHECK(poses[i].ends ? row.beam[1].ends_m == 10 : isinf(row.beam[1].ends_m));
        beam[1].echo[0].flags = ECHO_OWN; /* one of the vehicle's own does not block instead */
        CHECK(read_row());
        CHECK(row.beam[1].ends_m == 10);
    }
}

TEST(a_row_is_as_wide_and_high_as_its_beams)
{
    start(3, 6);
    CHECK(read_row());
    CHECK_NEAR(geo_deg(row.shape.from_rad), -9, 0, 1e-4);
    CHECK_NEAR(geo_deg(row.shape.to_rad), 9, 0, 1e-4);
    CHECK_NEAR(geo_deg(row.shape.half_el_rad), 10, 0, 1e-4);
    start(3, 78); /* no wider than 80 degrees to a side ... */
    CHECK(read_row());
    CHECK_NEAR(geo_deg(row.shape.from_rad), -80, 0, 1e-4);
    CHECK_NEAR(geo_deg(row.shape.to_rad), 80, 0, 1e-4);
    start(3, 81);
    CHECK(read_row());
    CHECK_INT(row.n, 1);
    start(1, 5); /* ... and no higher */
    beam[0].el_rad = (float)geo_rad(-73);
    CHECK(read_row());
    CHECK_NEAR(geo_deg(row.shape.half_el_rad), 7, 0, 1e-4);
    beam[0].el_rad = (float)geo_rad(80.1);
    CHECK(!read_row());
    start(1, 0);
    CHECK(!read_row());
    start(2, 170); /* both too far to a side */
    CHECK(!read_row());
}

/* Beams that do not touch take columns of their own: those to the right are left out where there are too many. */
TEST(a_row_with_too_many_gaps_is_cut_on_the_right)
{
    static const int gaps[] = {85, 86};
    for (int i = 0; i < 2; i++) {
        start((uint16_t)(gaps[i] + 1), 1.8);
        ping.az_aperture_rad = (float)geo_rad(0.5);
        CHECK(read_row());
        CHECK_INT(row.n, 86); /* 86 beams, ROW_ENDS for each, and one: 517 of WATER_COLUMNS */
        CHECK_NEAR(az_deg(0), -0.9 * gaps[i], 0, 1e-3);
    }
    start(BEAMS_MAX, 0.25); /* they touch, but for what their bearings are rounded */
    CHECK(read_row());
    CHECK_INT(row.n, BEAMS_MAX);
}

int main(void)
{
    RUN(a_record_is_of_where_the_sensor_was);
    RUN(beams_are_sorted_and_of_two_at_one_azimuth_the_worse_counts);
    RUN(each_beam_begins_where_it_detects);
    RUN(off_the_axis_beams_have_edges_of_their_own);
    RUN(a_deaf_beam_ends_the_water_the_second_time);
    RUN(an_echo_of_a_ping_that_may_be_anywhere_ends_nothing);
    RUN(a_row_is_as_wide_and_high_as_its_beams);
    RUN(a_row_with_too_many_gaps_is_cut_on_the_right);
    return test_end();
}
