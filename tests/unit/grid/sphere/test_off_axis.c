/* SPDX-License-Identifier: MIT */
/*
 * test_off_axis - what a beam frees and what it takes away off its axis: from samples to the records of free water and
 * to the spherical grid. A target of the reference level is passed over no more often at the half-power edge than on
 * the axis.
 */
#include "grid/range/extract.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "tests/lib/ask_free.h"
#include "tests/lib/sphere_rig.h"

static const struct sphere_conf grid_conf = {.angular_step_rad = 0.0349066,
                                             .layers = {.r_max_m = 12, .dr_m = 0.1, .n_const = 20, .growth = 1.05},
                                             .max_cells = 4096,
                                             .forget_s = 160,
                                             .blocked_above = 0.6,
                                             .recentre_m = 0.1};

static void enter_maps(const struct echoes *e)
{
    rig_enter(e, &mount_identity);
    now = (struct answer_now){.now_ns = e->t_ns, .pose_fresh = true, .pose = e->pose};
}

/* How far the records have the water free in a direction; near_m: not so far. */
static double free_along(const double axis[3], double near_m)
{
    static struct water_view view[ASK_RECORDS];
    const struct store_now at = {.now_ns = now.now_ns, .pose = &now.pose, .clear_for_s = 30, .move_limit_m = 20};
    struct ask_question q = {.half_rad = geo_rad(0.01), .near_m = near_m, .to_m = 12};
    memcpy(q.axis, axis, sizeof q.axis);
    return ask_free(view, store_view(store, &at, view), &q).free_to_m;
}

#define FROM_M 0.75

static double free_at(double az_deg, double el_deg)
{
    double axis[3];
    geo_direction(geo_rad(az_deg), geo_rad(el_deg), axis);
    return free_along(axis, FROM_M);
}

/* ---- from samples ---- */

#define BINS     1000
#define LEARNT   40
#define TRIALS   300
#define TARGET_M 0.03
#define WIDE_RAD 0.15f
#define REFERENCE                                                                                                 \
    6.2 /* dB that the target is on average above what it exceeds in all but one of a hundred beams */

static uint16_t samples[BINS];
static struct ping_beam axis;
static struct beam_echoes found;
static struct echoes out = {.max_beams = 1, .beam = &found};

/* A ping of so loud a noise, with something of this power at at_m. Everything is speckle. */
static void hear(struct extract *e, uint64_t *seed, double noise, double at_m, double power)
{
    static uint32_t last;
    const uint32_t seq = ++last;
    struct ping ping = {.kind = PING_PROFILE,
                        .law = AMPLITUDE_LINEAR,
                        .sample_bytes = 2,
                        .n_beams = 1,
                        .n_bins = BINS,
                        .dr_m = 0.01f,
                        .pulse_m = 0.01f,
                        .az_aperture_rad = WIDE_RAD,
                        .el_aperture_rad = (float)geo_rad(25),
                        .beam = &axis,
                        .samples = samples,
                        .seq = seq,
                        .t_ns = SECOND + seq * (SECOND / 10),
                        .pose = pose_identity};
    for (int i = 0; i < BINS; i++) {
        const double range_m = (i + 0.5) * 0.01;
        double p = -noise * log(1 - test_uniform(seed));
        if (range_m < 0.3)
            p += 0.5 * exp(-range_m / 0.03);
        if (power > 0 && range_m >= at_m && range_m < at_m + TARGET_M)
            p -= power * log(1 - test_uniform(seed));
        samples[i] = (uint16_t)fmin(UINT16_MAX * sqrt(p), UINT16_MAX);
    }
    ping.pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    extract_run(e, &ping, NULL, &out);
}

/* So often is the target passed over, on the axis or, weaker by the two-way pattern, where that has taken so much. */
struct passed {
    int times, free; /* in how many trials any water was free there at all */
};

static struct passed pass_over(double noise_db, double down_db, double el_deg)
{
    static void *memory;
    const double noise = pow(10, noise_db / 10);
    uint64_t seed = 46 + (uint64_t)down_db;
    struct extract_conf conf;
    struct extract_reference reference;
    struct fault fault;
    struct passed n = {0};
    extract_defaults(&conf);
    memory = rig_memory(memory, extract_size(BINS));
    struct extract *e = extract_init(memory, &conf, BINS, &fault);
    for (int i = 0; i < LEARNT; i++)
        hear(e, &seed, noise, 0, 0);
    CHECK(extract_reference(e, &reference));
    const double power = pow(10, (reference.level_db + REFERENCE - down_db) / 10);
    for (int i = 0; i < TRIALS; i++) {
        const double at_m = 2 + 6 * test_uniform(&seed);
        rig_sphere(&grid_conf);
        hear(e, &seed, noise, 0, 0);
        hear(e, &seed, noise, at_m, power);
        enter_maps(&out);
        const double free_m = free_at(0, el_deg);
        n.times += free_m > at_m + TARGET_M;
        n.free += free_m > FROM_M;
    }
    return n;
}

/* Close to the noise at which nothing is free at all, and in quieter water. */
TEST(a_target_at_the_edge_of_a_beam_is_not_passed_over)
{
    static const struct {
        double down_db, el_deg;
    } row[] = {{0, 0}, {3, 7}, {6, 9.5}};
    for (int noise_db = -44; noise_db <= -40; noise_db += 4)
        for (size_t k = 0; k < sizeof row / sizeof row[0]; k++) {
            const struct passed n = pass_over(noise_db, row[k].down_db, row[k].el_deg);
            CHECK(n.times <= TRIALS / 100);
            CHECK(n.free >= TRIALS / 2);
            if (test_case_failed)
                printf("(noise %d dB, %g dB down: passed over in %d of %d; free in %d)\n", noise_db,
                       row[k].down_db, n.times, TRIALS, n.free);
        }
}

/* ---- ready beams ---- */

static struct beam_echoes beam;
static struct echoes ping;

static void send(double az_deg, double place_m)
{
    beam.az_rad = (float)geo_rad(az_deg);
    ping.t_ns += SECOND / 20;
    ping.seq++;
    ping.pose.position_m[0] = place_m;
    ping.pose.path_m = place_m;
    enter_maps(&ping);
}

/* Free to 10 m on its axis, to 6 m where it detects half as much, to 3 m at its edge. */
static void begin_nested(double wide_deg)
{
    rig_sphere(&grid_conf);
    beam = (struct beam_echoes){.blind_m = 0.5f,
                                .free_to_m = 10,
                                .off_axis = true,
                                .side_to_m = 6,
                                .edge_from_m = 0.5f,
                                .edge_to_m = 3,
                                .state = BEAM_SILENT};
    ping = (struct echoes){.t_ns = SECOND,
                           .n_beams = 1,
                           .range_max_m = 12,
                           .az_aperture_rad = (float)geo_rad(wide_deg),
                           .el_aperture_rad = (float)geo_rad(25),
                           .pose = pose_identity,
                           .beam = &beam};
    ping.pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
}

TEST(off_its_axis_a_beam_frees_no_more_than_it_detects_there)
{
    begin_nested(2);
    for (int i = 0; i <= 420; i++) /* where a turn begins there is a seam */
        send(i * 0.9, 0);
    for (int az = 1; az < 360; az += 20) {
        const double level_m = free_at(az, 0), side_m = free_at(az, 5), edge_m = free_at(az, 9);
        CHECK(level_m >= 5.7);
        CHECK(side_m > 5.7 && side_m < 6.2);
        CHECK(edge_m > 2.7 && edge_m < 3.2);
        CHECK(free_at(az, -9) > 2.7 && free_at(az, -9) < 3.2);
        if (test_case_failed) {
            printf("(%d: %g %g %g)\n", az, level_m, side_m, edge_m);
            return;
        }
    }
}

/* To its left and right as above and below. */
TEST(beside_its_axis_a_beam_frees_no_more_than_it_detects_there)
{
    begin_nested(30);
    send(0, 0);
    CHECK(free_at(1, 0) >= 9);
    CHECK(free_at(7, 0) < 6.2 && free_at(7, 0) > 5.8);
    CHECK(free_at(13, 0) < 3.2 && free_at(13, 0) > 2.8);
}

/* An echo ends what older beams freed in all of the opening, however little of it the beam frees itself. */
TEST(an_echo_ends_older_water_at_the_edge_too)
{
    begin_nested(30);
    beam.off_axis = false;
    send(0, 0);
    CHECK(free_at(13, 0) >= 9);
    beam.off_axis = true;
    beam.edge_to_m = 0;
    beam.free_to_m = 5;
    beam.n = 1;
    beam.state = BEAM_ECHO;
    beam.echo[0] = (struct echo){.range_m = 5.05f, .near_m = 5, .sd_m = 0.01f, .confidence = 0.9f};
    send(0, 0);
    CHECK(free_at(13, 0) < 5.1 && free_at(13, 0) > 4.8);
}

/* An obstacle in that direction, at_m away, and then a beam ahead that shows nothing, many times. */
static enum answer_state missed_at(double az_deg, double el_deg, double at_m)
{
    const struct answer_query q = {.az_rad = geo_rad(az_deg),
                                   .el_rad = geo_rad(el_deg),
                                   .distance_m = 9,
                                   .half_angle_rad = geo_rad(0.3),
                                   .near_m = 1};
    begin_nested(30);
    beam.el_rad = (float)geo_rad(el_deg);
    for (int i = 0; i < 3; i++) {
        beam.free_to_m = (float)at_m - 0.05f;
        beam.n = 1;
        beam.state = BEAM_ECHO;
        beam.echo[0] = (struct echo){
            .range_m = (float)at_m, .near_m = (float)at_m - 0.05f, .sd_m = 0.01f, .confidence = 0.9f};
        send(az_deg, 0);
    }
    beam.el_rad = 0;
    beam.free_to_m = 10;
    beam.n = 0;
    beam.state = BEAM_SILENT;
    for (int i = 0; i < 30; i++)
        send(0, 0);
    return rig_line(&q).state;
}

/* Only where this very beam would have received its echo. */
TEST(what_a_beam_would_not_hear_it_does_not_take_away)
{
    CHECK_INT(missed_at(13, 0, 2.5), ANSWER_UNKNOWN);
    CHECK_INT(missed_at(13, 0, 5), ANSWER_BLOCKED);
    CHECK_INT(missed_at(7, 0, 5), ANSWER_UNKNOWN);
    CHECK_INT(missed_at(9, 7.3, 5), ANSWER_BLOCKED); /* in a corner of the part that reaches as far */
    CHECK_INT(missed_at(7, 0, 8), ANSWER_BLOCKED);
    CHECK_INT(missed_at(1, 0, 8), ANSWER_CLEAR);
}

/* ---- rows of beams ---- */

#define ROW_BEAMS  64
#define ROW_NEAR_M 0.75
#define ROW_WORLDS 150
#define ROW_ASKED  24

/* Beams side by side, from a head or a fan that is turned anyhow. */
struct row {
    struct mount mount;
    double step_rad, first_rad;
    uint16_t n;
    bool fan;
};

static struct beam_echoes row_beam[ROW_BEAMS];

static double between(uint64_t *seed, double low, double high)
{
    return low + (high - low) * test_uniform(seed);
}

/* Its beams are apart by less or by all of their width. */
static struct row random_row(uint64_t *seed, double cell_deg)
{
    const double wide_deg = cell_deg * between(seed, 0.3, 3), high_deg = between(seed, 2 * cell_deg, 40);
    struct row row = {.step_rad = geo_rad(wide_deg * between(seed, 0.2, 1)), .fan = test_random(seed) % 2};
    const double roll = test_random(seed) % 3 ? 0 : GEO_TURN * test_uniform(seed);
    quat_from_rpy(roll, geo_rad(between(seed, -20, 20)), GEO_TURN * test_uniform(seed), row.mount.attitude);
    row.n = (uint16_t)fmin(ROW_BEAMS, ceil(geo_rad(6 * fmax(cell_deg, wide_deg)) / row.step_rad));
    row.first_rad = -(row.n - 1) * row.step_rad / 2;
    ping = (struct echoes){.t_ns = SECOND,
                           .range_max_m = 12,
                           .az_aperture_rad = (float)geo_rad(wide_deg),
                           .el_aperture_rad = (float)geo_rad(high_deg),
                           .pose = pose_identity,
                           .max_beams = ROW_BEAMS,
                           .turns = !row.fan};
    ping.pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    for (int i = 0; i < row.n; i++)
        row_beam[i] = (struct beam_echoes){.az_rad = (float)(row.first_rad + i * row.step_rad),
                                           .blind_m = 0.5f,
                                           .free_to_m = 8,
                                           .off_axis = true,
                                           .side_to_m = 5,
                                           .edge_from_m = 0.5f,
                                           .edge_to_m = 3,
                                           .state = BEAM_SILENT};
    return row;
}

/* A share of the beams hears nothing. */
static void deafen(struct row *row, double deaf, uint64_t *seed)
{
    for (int i = 0; i < row->n; i++)
        if (test_uniform(seed) < deaf)
            beam_frees_nothing(&row_beam[i]);
}

static void send_row(const struct row *row)
{
    for (int i = 0; i < (row->fan ? 1 : row->n); i++) {
        ping.t_ns += SECOND / 20;
        ping.seq++;
        ping.n_beams = row->fan ? row->n : 1;
        ping.beam = &row_beam[i];
        rig_enter(&ping, &row->mount);
    }
    now = (struct answer_now){.now_ns = ping.t_ns, .pose_fresh = true, .pose = ping.pose};
}

/* How far along a direction of the sensor the row detects the target: by the beam nearest to it. All of a beam's
 * opening counts as its edge, its corners, too. */
static double heard_m(const struct row *row, double az_rad, double el_rad)
{
    double aside = INFINITY;
    const double upward = fabs(el_rad) / ((double)ping.el_aperture_rad / 2);
    for (int i = 0; i < row->n; i++)
        if (row_beam[i].state != BEAM_BLIND)
            aside = fmin(aside, fabs(geo_wrap_pi(az_rad - (double)row_beam[i].az_rad)) /
                                    ((double)ping.az_aperture_rad / 2));
    const double share = hypot(aside, upward) - 1e-3;
    return share <= BEAM_AXIS_SHARE ? 8 : share <= BEAM_SIDE_SHARE ? 5 : fmax(aside, upward) <= 1.001 ? 3 : 0;
}

/* Whatever the row is like. */
TEST(between_the_axes_of_neighbouring_beams_no_more_is_free_than_they_hear)
{
    uint64_t seed = test_seed();
    unsigned asked = 0, beyond = 0;
    double free_m = 0, truth_m = 0;
    for (int world = 0; world < ROW_WORLDS; world++) {
        const double cell_deg = between(&seed, 1.5, 6);
        rig_sphere(&grid_conf);
        struct row row = random_row(&seed, cell_deg);
        deafen(&row, world % 3 * 0.25, &seed);
        send_row(&row);
        for (int i = 0; i < ROW_ASKED; i++) {
            const double az = row.first_rad + row.step_rad * between(&seed, -0.6, row.n - 0.4),
                         el = between(&seed, -0.55, 0.55) * (double)ping.el_aperture_rad;
            double v[3], u[3];
            geo_direction(az, el, v);
            quat_rotate(row.mount.attitude, v, u);
            const double heard = heard_m(&row, az, el), to_m = free_along(u, ROW_NEAR_M);
            asked++;
            beyond += to_m > fmax(heard, ROW_NEAR_M) + 0.02;
            free_m += to_m - ROW_NEAR_M;
            truth_m += fmax(heard - 0.5, 0);
        }
    }
    printf("# %u directions, beyond what is heard: %u; free %.1f of %.1f m\n", asked, beyond, free_m, truth_m);
    CHECK_INT(beyond, 0);
    CHECK(free_m > 0.6 * truth_m);
}

int main(void)
{
    RUN(a_target_at_the_edge_of_a_beam_is_not_passed_over);
    RUN(off_its_axis_a_beam_frees_no_more_than_it_detects_there);
    RUN(beside_its_axis_a_beam_frees_no_more_than_it_detects_there);
    RUN(an_echo_ends_older_water_at_the_edge_too);
    RUN(what_a_beam_would_not_hear_it_does_not_take_away);
    RUN(between_the_axes_of_neighbouring_beams_no_more_is_free_than_they_hear);
    return test_end();
}
