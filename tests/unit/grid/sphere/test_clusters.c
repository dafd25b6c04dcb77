/* SPDX-License-Identifier: MIT */
/*
 * test_clusters - what a grid's cells form together, measured on scenes whose objects are known: extent across north,
 * labels that last, hysteresis, trends, and the list's limit.
 */
#include "tests/lib/sphere_rig.h"
#include "grid/sphere/view.h"

static const struct sphere_conf conf = {.angular_step_rad = 3 * GEO_PI / 180,
                                        .level = true,
                                        .level_half_rad = 7.5 * GEO_PI / 180,
                                        .layers = {.r_max_m = 30, .dr_m = 0.1, .n_const = 1, .growth = 1},
                                        .max_cells = 4096,
                                        .forget_s = 60,
                                        .blocked_above = 0.6,
                                        .recentre_m = 0.1};
static struct clusters *clusters;
static uint64_t now_ns;
static const struct cluster *list;
static uint32_t n, all;
static struct pose vehicle = {.attitude = {1, 0, 0, 0}};
static double wide_deg; /* of a beam; below 1.5 it says nothing of free water in directions of 3 */

static void start_as(const struct sphere_conf *as)
{
    rig_sphere(as);
    clusters = rig_clusters(as);
    now_ns = 1000 * SECOND;
    wide_deg = 0.5;
}

static void start(void)
{
    start_as(&conf);
}

/* One narrow beam that heard an echo, with a confidence that blocks or (0.1) does not. */
static void hear(double az_deg, double range_m, double confidence)
{
    struct beam_echoes beam = {.az_rad = (float)geo_rad(az_deg), .state = BEAM_ECHO, .n = 1};
    beam.blind_m = 0.1f;
    beam.free_to_m = (float)(range_m - 0.05);
    beam.echo[0] = (struct echo){.range_m = (float)range_m,
                                 .near_m = (float)(range_m - 0.05),
                                 .sd_m = 0.01f,
                                 .confidence = (float)confidence};
    const struct echoes e = {.t_ns = now_ns,
                             .n_beams = 1,
                             .range_max_m = 20,
                             .az_aperture_rad = (float)geo_rad(wide_deg),
                             .el_aperture_rad = (float)geo_rad(25),
                             .pose = vehicle,
                             .max_beams = 1,
                             .beam = &beam};
    sphere_enter(sphere, &e, &mount_identity);
}

static void arc(double from_deg, double to_deg, double range_m)
{
    for (double az = from_deg; az < to_deg; az += 3)
        hear(az + 1.5, range_m, 0.9);
}

static void look(void)
{
    n = clusters_look(clusters, sphere, now_ns, &list, &all);
}

TEST(an_arc_across_north_and_a_post_are_two)
{
    start();
    arc(-30, 30, 5.03);
    hear(181.5, 3.03, 0.9);
    look();
    CHECK_INT(n, 2);
    CHECK_INT(all, 2);
    const struct cluster *post = &list[0], *wall = &list[1]; /* nearest first */
    CHECK_INT(post->cells, 1);
    CHECK_NEAR(post->near_m, 2.98, 0, 1e-3);
    CHECK_NEAR(post->nearest_m[0], -3.03 * cos(geo_rad(1.5)), 0, 1e-3);
    CHECK_NEAR(post->from_rad, geo_rad(180), 0, 1e-9);
    CHECK_NEAR(post->width_rad, geo_rad(3), 0, 1e-9);
    CHECK_INT(wall->cells, 20);
    CHECK_INT(wall->echoes, 20);
    CHECK_NEAR(wall->from_rad, geo_rad(330), 0, 1e-9);
    CHECK_NEAR(wall->width_rad, geo_rad(60), 0, 1e-9);
    CHECK_NEAR(wall->centre_m[1], 0, 0, 1e-4);
    CHECK_NEAR(wall->low_rad, -geo_rad(7.5), 1e-9, 0);
    CHECK_NEAR(wall->high_rad, geo_rad(7.5), 1e-9, 0);
}

TEST(a_full_circle_is_a_whole_turn_wide)
{
    start();
    arc(0, 360, 4.03);
    look();
    CHECK_INT(n, 1);
    CHECK_NEAR(list[0].width_rad, GEO_TURN, 1e-12, 0);
}

TEST(weak_cells_belong_to_a_strong_neighbour_and_form_nothing_alone)
{
    start();
    hear(10.5, 5.03, 0.9);
    hear(13.5, 5.03, 0.09); /* over half of what blocks */
    hear(100.5, 5.03, 0.09);
    look();
    CHECK_INT(n, 1);
    CHECK_INT(list[0].cells, 2);
    CHECK_INT(list[0].seeds, 1);
}

TEST(a_cluster_keeps_its_label_while_it_comes_nearer)
{
    start();
    arc(-9, 9, 5.03);
    look();
    const uint32_t label = list[0].label;
    const double before_m = list[0].near_m;
    now_ns += 2 * SECOND;
    arc(-9, 9, 4.93); /* the next layer */
    look();
    CHECK_INT(n, 1);
    CHECK_INT(list[0].label, label);
    CHECK_NEAR(list[0].approach_mps, (before_m - list[0].near_m) / 2, 1e-6, 0);
    CHECK_NEAR(list[0].approach_mps, 0.05, 0, 1e-3);
    CHECK_NEAR(list[0].growth_directions_ps, 0, 1e-9, 0); /* as wide as before */
    CHECK_INT(list[0].t_label_ns, 1000 * SECOND);
    CHECK_INT(list[0].t_first_ns, 1000 * SECOND);
    CHECK_INT(list[0].t_echo_ns, now_ns);
    now_ns += SECOND / 10; /* too soon for a trend of its own */
    look();
    CHECK_NEAR(list[0].approach_mps, 0.05, 0, 1e-3);
    now_ns += 2 * SECOND;
    look();
    CHECK_NEAR(list[0].approach_mps, 0, 0, 1e-9);
}

TEST(a_wall_that_the_first_turn_finds_bit_by_bit_does_not_grow)
{
    start();
    wide_deg = 1.6;
    for (int i = 0; i < 6; i++) {
        arc(-30 + 12 * i, -18 + 12 * i, 5.03 - 0.1 * i);
        look();
        CHECK_NEAR(list[0].growth_directions_ps, 0, 0, 0);
        CHECK_NEAR(list[0].approach_mps, 0, 0, 1e-9);
        now_ns += 2 * SECOND;
    }
    arc(-30, 42, 4.93); /* in other layers, all of it known */
    look();
    CHECK_NEAR(list[0].growth_directions_ps, 0, 0, 0);
}

TEST(what_comes_up_in_water_known_to_be_free_grows)
{
    start();
    wide_deg = 1.6;
    arc(0, 12, 5.03);
    for (double az = 12; az < 60; az += 3)
        hear(az + 1.5, 19, 0.01); /* looked at, nothing to speak of */
    look();
    CHECK_INT(n, 1);
    now_ns += 2 * SECOND;
    arc(12, 24, 5.03);
    look();
    CHECK_INT(n, 1);
    CHECK_NEAR(list[0].growth_directions_ps, 2, 1e-9, 0);
    now_ns += 2 * SECOND;
    arc(39, 51, 3); /* and a new one by itself */
    look();
    CHECK_INT(n, 2);
    CHECK_NEAR(list[0].growth_directions_ps, 2, 1e-9, 0);
    CHECK_NEAR(list[1].growth_directions_ps, 0, 0, 0);
}

TEST(what_fades_is_no_cluster_any_more)
{
    start();
    arc(-9, 9, 5.03);
    look();
    CHECK_INT(n, 1);
    now_ns += 3600 * SECOND;
    look();
    CHECK_INT(n, 0);
    CHECK_INT(all, 0);
}

TEST(what_is_gone_is_told_with_why)
{
    start();
    wide_deg = 4;
    arc(0, 6, 5.03);
    arc(90, 96, 5.03);
    arc(180, 186, 5.03);
    look();
    CHECK_INT(n, 3);
    CHECK(!clusters_gone(clusters, 0));
    for (int i = 0; i < 20; i++) { /* beams pass the first, the second is hidden, nobody looks at the third */
        now_ns += 2 * SECOND;
        for (double az = -3; az < 12; az += 3)
            hear(az + 1.5, 12, 0.9);
        for (double az = 84; az < 102; az += 3)
            hear(az + 1.5, 3, 0.9);
    }
    look();
    CHECK_INT(clusters_gone(clusters, 0) != NULL, 1);
    const struct cluster_gone *first = clusters_gone(clusters, 0);
    CHECK_INT(first->why, VANISH_SEEN);
    CHECK_NEAR(first->place_m[0], 5, 0, 0.2);
    CHECK_INT(first->t_gone_ns, now_ns);
    CHECK(!clusters_gone(clusters, 1));
    now_ns += 40 * SECOND;
    arc(84, 102, 3);
    look();
    CHECK(clusters_gone(clusters, 0) && clusters_gone(clusters, 1) && clusters_gone(clusters, 2));
    unsigned why = 0;
    for (uint32_t k = 0; k < 3; k++)
        why |= 1u << clusters_gone(clusters, k)->why;
    CHECK_INT(why, 1u << VANISH_SEEN | 1u << VANISH_HIDDEN | 1u << VANISH_AGED);
    look(); /* told once */
    now_ns += 2 * SECOND;
    look();
    for (uint32_t k = 0; clusters_gone(clusters, k); k++)
        CHECK(k < 3 || clusters_gone(clusters, k)->t_echo_ns > first->t_echo_ns);
}

/* What stood before it all along did not hide it when it was last heard: it has only not been looked at since. */
TEST(what_was_heard_past_something_nearer_is_not_hidden_by_it)
{
    start();
    for (int i = 0; i < 8; i++)
        arc(90, 96, 3.03);
    now_ns += SECOND;
    arc(90, 96, 5.03);
    look();
    CHECK_INT(n, 2);
    for (int i = 0; i < 300 && !clusters_gone(clusters, 0); i++) {
        now_ns += 2 * SECOND;
        look();
    }
    CHECK_INT(n, 1); /* the surer one is still there */
    const struct cluster_gone *gone = clusters_gone(clusters, 0);
    CHECK(gone && gone->place_m[1] > 4.5);
    CHECK(gone && gone->why == VANISH_AGED);
}

TEST(what_fades_under_often_looks_is_told_when_it_is_gone)
{
    start();
    wide_deg = 4;
    arc(90, 96, 5.03);
    look();
    CHECK_INT(n, 1);
    int faded = 0;
    for (int i = 0; i < 200 && !clusters_gone(clusters, 0); i++) {
        now_ns += 2 * SECOND;
        for (double az = 84; az < 102; az += 3)
            hear(az + 1.5, 3, 0.9);
        look();
        faded += n == 1; /* what hides it is there alone */
    }
    CHECK(faded > 1);
    CHECK(clusters_gone(clusters, 0) && clusters_gone(clusters, 0)->why == VANISH_HIDDEN);
    CHECK(!clusters_gone(clusters, 1));
    CHECK_NEAR(clusters_gone(clusters, 0)->place_m[1], 5, 0, 0.2);
}

/* Two pieces of a wall, and a gap of so many directions in it that was looked into and heard nothing in. */
static void wall_with_a_gap(double mu, double gap_deg)
{
    struct sphere_conf relaxing = conf;
    relaxing.cluster_relaxation = mu;
    start_as(&relaxing);
    arc(0, 15, 5.03);
    arc(15 + gap_deg, 30 + gap_deg, 5.03);
    wide_deg = 3.1;
    for (double az = 15; az < 15 + gap_deg; az += 3) {
        struct beam_echoes beam = {
            .az_rad = (float)geo_rad(az + 1.5), .state = BEAM_SILENT, .blind_m = 0.1f, .free_to_m = 3};
        const struct echoes e = {.t_ns = now_ns,
                                 .n_beams = 1,
                                 .range_max_m = 20,
                                 .az_aperture_rad = (float)geo_rad(wide_deg),
                                 .el_aperture_rad = (float)geo_rad(25),
                                 .pose = pose_identity,
                                 .max_beams = 1,
                                 .beam = &beam};
        sphere_enter(sphere, &e, &mount_identity);
    }
    look();
}

TEST(relaxed_cells_join_two_pieces_and_leave_the_grid_as_it_is)
{
    static const struct {
        double mu, gap_deg;
        uint32_t want;
    } row[] = {{0, 3, 2}, {0.5, 3, 1}, {1, 3, 1}, {0.05, 3, 2}, {1, 9, 2}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct sphere_cell cell;
        uint32_t held = 0;
        wall_with_a_gap(row[i].mu, row[i].gap_deg);
        CHECK_INT(n, row[i].want);
        for (uint32_t d = 0; d < sphere_picture(sphere)->n; d++)
            held += sphere_cell(sphere, d, 0, now_ns, &cell);
        CHECK_INT(held, 10);
        CHECK_INT(list[0].echoes, row[i].want == 1 ? 10 : 5);
        CHECK_NEAR(list[0].near_m, 4.98, 0, 1e-3); /* that of an echo, not of a raised cell */
        CHECK_NEAR(list[0].far_m, 5.03, 0, 0.01);
        CHECK_INT(ask(16.5, 10).state == ANSWER_CLEAR, false);
        if (test_case_failed)
            printf("(mu %g, gap %g: %u cells)\n", row[i].mu, row[i].gap_deg, list[0].cells);
    }
}

TEST(raised_cells_take_only_the_room_that_is_left)
{
    struct sphere_conf small = conf;
    small.cluster_relaxation = 1;
    small.max_cells = 64;
    start_as(&small);
    for (int k = 0; k < 60; k++)
        hear(6 * k + 1.5, 5.03, 0.9);
    look();
    CHECK(n > 0);
    uint32_t cells = 0, echoes = 0;
    for (uint32_t k = 0; k < n; k++) {
        cells += list[k].cells;
        echoes += list[k].echoes;
    }
    CHECK_INT(echoes, 60);
    CHECK(cells <= 64);
}

TEST(of_too_many_the_nearest_are_listed)
{
    start();
    for (int i = 0; i < 40; i++)
        for (int layer = 0; layer < 8; layer++)
            hear(9 * i + 1.5, 0.55 + 0.3 * layer + 0.01, 0.99);
    look();
    CHECK_INT(all, 320);
    CHECK_INT(n, CLUSTERS_MAX);
    for (uint32_t i = 1; i < n; i++)
        CHECK(list[i - 1].near_m <= list[i].near_m);
}

/* A whole sphere, and a vehicle that knows where it is. */
static void start_full(void)
{
    struct sphere_conf full = conf;
    full.level = false;
    full.angular_step_rad = geo_rad(2);
    start_as(&full);
    wide_deg = 4;
    vehicle.has = POSE_ATTITUDE | POSE_POSITION;
    arc(-30, 30, 5.03);
    arc(90, 120, 4.03);
    hear(181.5, 3.03, 0.9);
}

static void end_full(void)
{
    vehicle = pose_identity;
}

TEST(a_look_in_steps_is_of_one_grid_when_the_vehicle_moves_meanwhile)
{
    static struct cluster first[CLUSTERS_MAX];
    unsigned steps = 1;
    start_full();
    clusters_begin(clusters, now_ns);
    while (clusters_step(clusters, sphere)) {
        if (steps++ % 2 == 1 && steps < 4) { /* it moves on by a step of the grid, and is heard there */
            vehicle.position_m[0] += 0.15;
            hear(181.5, 3.03 + vehicle.position_m[0], 0.9);
        }
    }
    CHECK(steps > 5);
    const uint32_t n_first = clusters_list(clusters, &list, &all);
    CHECK(n_first >= 3);
    memcpy(first, list, n_first * sizeof *list);
    look();
    CHECK_INT(n, n_first);
    for (uint32_t i = 0; i < n && i < n_first; i++) {
        CHECK_INT(list[i].label, first[i].label);
        CHECK_INT(list[i].cells, first[i].cells);
        CHECK_NEAR(list[i].near_m, first[i].near_m, 0, 1e-6);
    }
    end_full();
}

TEST(a_look_ends_however_often_the_vehicle_moves_and_a_dropped_one_leaves_nothing)
{
    unsigned steps = 0;
    start_full();
    clusters_begin(clusters, now_ns);
    CHECK(clusters_step(clusters, sphere));
    clusters_begin(clusters, now_ns); /* the one before was dropped */
    for (; clusters_step(clusters, sphere) && steps < 1000; steps++) {
        vehicle.position_m[0] += 0.15;
        hear(1.5, 5.03 - vehicle.position_m[0], 0.9);
    }
    CHECK(steps < 1000);
    CHECK(clusters_list(clusters, &list, &all) >= 3);
    end_full();
}

/* Each look puts what the grid holds by then, and is dropped before it takes out what the one before has put. */
TEST(looks_that_are_dropped_one_after_the_other_leave_room_for_the_next)
{
    struct sphere_conf small = conf;
    small.max_cells = 64;
    start_as(&small);
    for (int range_m = 4; range_m < 12; range_m++) {
        for (int k = 0; k < 60; k++)
            hear(6 * k + 1.5, range_m + 0.03, 0.9);
        clusters_begin(clusters, ++now_ns);
        clusters_step(clusters, sphere);
    }
    look();
    uint32_t echoes = 0;
    for (uint32_t k = 0; k < n; k++)
        echoes += list[k].echoes;
    CHECK(echoes >= 60);
}

int main(void)
{
    RUN(looks_that_are_dropped_one_after_the_other_leave_room_for_the_next);
    RUN(a_look_in_steps_is_of_one_grid_when_the_vehicle_moves_meanwhile);
    RUN(a_look_ends_however_often_the_vehicle_moves_and_a_dropped_one_leaves_nothing);
    RUN(an_arc_across_north_and_a_post_are_two);
    RUN(a_full_circle_is_a_whole_turn_wide);
    RUN(weak_cells_belong_to_a_strong_neighbour_and_form_nothing_alone);
    RUN(a_cluster_keeps_its_label_while_it_comes_nearer);
    RUN(a_wall_that_the_first_turn_finds_bit_by_bit_does_not_grow);
    RUN(what_comes_up_in_water_known_to_be_free_grows);
    RUN(what_fades_is_no_cluster_any_more);
    RUN(what_is_gone_is_told_with_why);
    RUN(what_was_heard_past_something_nearer_is_not_hidden_by_it);
    RUN(what_fades_under_often_looks_is_told_when_it_is_gone);
    RUN(relaxed_cells_join_two_pieces_and_leave_the_grid_as_it_is);
    RUN(raised_cells_take_only_the_room_that_is_left);
    RUN(of_too_many_the_nearest_are_listed);
    printf("# %.0f bytes for each cell of the grid\n",
           (double)clusters_bytes(sphere_picture(sphere)->rings, 1 << 16) / (1 << 16));
    return test_end();
}
