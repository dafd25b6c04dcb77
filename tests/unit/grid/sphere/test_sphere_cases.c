/* SPDX-License-Identifier: MIT */
/*
 * test_sphere_cases - the sphere at its limits: saturation, ageing over eighteen decades, clocks that jump, a million
 * steps, far places, what happened to cells in a turn, locks, every sensor model. Numbers G.. name the cases.
 */
#include "tests/lib/table.h"
#include "tests/lib/sphere_rig.h"

#include "grid/answer/answer.h"
#include "grid/ping.h"
#include "grid/sphere/view.h"

static const struct sphere_conf usual = {.angular_step_rad = 2 * GEO_PI / 180,
                                         .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                         .max_cells = 20000,
                                         .forget_s = 160,
                                         .blocked_above = 0.6,
                                         .recentre_m = 0.1,
                                         .range_error = 0.003};
static uint32_t seq;
static double edge_m; /* how far echoes' near edges lie before them */

static void start(const struct sphere_conf *conf)
{
    rig_sphere(conf);
    now = (struct answer_now){.now_ns = 1000 * SECOND, .pose_fresh = true, .pose = pose_identity};
    seq = 0;
    edge_m = 0.02;
}

static void in_the_world(double north_m)
{
    now.pose.has = POSE_ATTITUDE | POSE_POSITION;
    now.pose.position_m[0] = north_m;
}

/* One beam, az and el in degrees off the sensor's axis; range_m 0: silence up to free_m. */
static void ping_as(uint8_t flags, uint16_t sensor, double az_deg, double range_m, double free_m)
{
    struct beam_echoes beam = {
        .az_rad = (float)geo_rad(az_deg), .blind_m = 0.3f, .free_to_m = (float)free_m, .state = BEAM_SILENT};
    if (range_m > 0) {
        beam.state = BEAM_ECHO;
        beam.n = 1;
        beam.echo[0] = (struct echo){
            .range_m = (float)range_m, .near_m = (float)(range_m - edge_m), .sd_m = 0.01f, .confidence = 0.9f};
        beam.free_to_m = (float)(range_m - edge_m);
    }
    struct echoes e = {.t_ns = now.now_ns,
                       .seq = ++seq,
                       .sensor = sensor,
                       .n_beams = 1,
                       .flags = flags,
                       .range_max_m = 20,
                       .az_aperture_rad = (float)geo_rad(2),
                       .el_aperture_rad = (float)geo_rad(25),
                       .pose = now.pose,
                       .beam = &beam};
    rig_enter(&e, &mount_identity);
}

static void ping(double az_deg, double range_m, double free_m)
{
    ping_as(0, 0, az_deg, range_m, free_m);
}

static uint32_t direction(double az_deg)
{
    return rings_index(sphere_picture(sphere)->rings, geo_rad(az_deg), 1e-6);
}

static struct sphere_cell first_cell(double az_deg)
{
    struct sphere_cell c = {0};
    sphere_cell(sphere, direction(az_deg), 0, now.now_ns, &c);
    return c;
}

/* ---- saturation ---- */

TEST(g11_a_million_echoes_saturate_and_leave_the_point_in_their_middle)
{
    struct sphere_conf level = usual;
    level.level = true;
    level.level_half_rad = geo_rad(7.5);
    start(&level);
    uint64_t seed = test_seed();
    for (int i = 0; i < 1000000; i++) {
        now.now_ns += 1000;
        ping(0.5, 10, 0);
    }
    struct sphere_cell one = first_cell(0.5);
    CHECK_INT(one.echoes, 65535);
    CHECK_NEAR(one.logodds, 6, 1e-6, 0);
    double r =
        sqrt(one.point_m[0] * one.point_m[0] + one.point_m[1] * one.point_m[1] + one.point_m[2] * one.point_m[2]);
    CHECK_NEAR(r, 10, 0, 1e-5);
    double across = 10 * geo_rad(15) / sqrt(12);
    CHECK_NEAR(one.ball_m, across / sqrt(7), 1e-3, 0); /* what all echoes share is not averaged away */
    double sum = 0;
    start(&level);
    for (int i = 0; i < 8; i++) {
        double range = 10 + 0.1 * (test_uniform(&seed) - 0.5);
        sum += (float)range;
        ping(0.5, range, 0);
    }
    CHECK_NEAR(first_cell(0.5).point_m[0] / cos(geo_rad(1)), sum / 8, 0, 1e-3);
}

TEST(g12_a_state_that_a_billion_hits_made_changes_within_ten_misses)
{
    start(&usual);
    for (int i = 0; i < 100000; i++) /* at the clamp after five: the rest changes nothing */
        ping(0, 5, 0);
    CHECK_NEAR(first_cell(0.5).logodds, 6, 1e-6, 0);
    struct sphere_cell before = first_cell(0.5);
    int misses = 0;
    while (ask(0, 6).state == ANSWER_BLOCKED && misses < 100) {
        for (double az = -4; az <= 4; az += 1)
            ping(az, 8, 0);
        misses++;
    }
    CHECK(misses <= 10 && before.echoes == 65535);
}

/* ---- ageing ---- */

TEST(logodds_as_probabilities_equal_the_table)
{
    struct table t = table_open("tests/oracles/logodds.csv");
    while (table_next(&t)) {
        double l = table_real(&t, 0);
        CHECK_NEAR(1 / (1 + exp(-l)), table_real(&t, 1), 1e-14, 1e-300);
        CHECK_NEAR(1 / (1 + exp(l)), table_real(&t, 2), 1e-14, 1e-300);
    }
}

/* The rows without drive: the grid has none. */
TEST(g13_fading_equals_the_table_at_any_rate)
{
    struct table t = table_open("tests/oracles/decay.csv");
    int rows = 0;
    while (table_next(&t)) {
        double rate = table_real(&t, 0), dt = table_real(&t, 1), l0 = table_real(&t, 2);
        if (table_real(&t, 3) != 0 || rate <= 0 || dt * 1e9 > 1e19)
            continue;
        struct picture p = {.fade_s = 1 / rate};
        struct picture_obstacle o = {.logodds = (float)l0};
        double whole_ns = (double)(uint64_t)(dt * 1e9) * 1e-9, x = rate * whole_ns;
        CHECK_NEAR(picture_logodds(&p, &o, (uint64_t)(dt * 1e9)), (float)l0 * exp(-x), 1e-12 + x * 1e-15, 1e-300);
        if (fabs(whole_ns - dt) > 1e-14 * dt || (float)l0 != l0)
            continue;
        CHECK_NEAR(picture_logodds(&p, &o, (uint64_t)(dt * 1e9)), table_real(&t, 4), 1e-12 + x * 1e-14, 1e-300);
        rows++;
    }
    CHECK(rows > 10);
}

TEST(g13_grids_of_all_rates_side_by_side_equal_one_exponential_however_read)
{
    uint64_t seed = test_seed();
    for (int decade = -9; decade <= 9; decade += 3) {
        struct sphere_conf conf = usual;
        conf.forget_s = pow(10, -decade);
        start(&conf);
        ping(0, 5, 0);
        double l0 = first_cell(0.5).logodds, tau = conf.forget_s / log(6 / log(0.6 / 0.4));
        uint64_t t0 = now.now_ns;
        for (int i = 0; i < 3000; i++) {
            double dt_s = pow(10, 16 * test_uniform(&seed) - 9);
            now.now_ns = t0 + (uint64_t)(dt_s * 1e9);
            double want =
                (double)((long double)l0 * expl(-(long double)(now.now_ns - t0) * 1e-9L / (long double)tau));
            CHECK_NEAR(first_cell(0.5).logodds, want, 1e-12 * (1 + dt_s / tau), 1e-300);
        }
        now.now_ns = t0;
        CHECK(first_cell(0.5).logodds == l0); /* thousands of reads changed nothing */
    }
}

/*
 * A day of beams from a millisecond to a minute apart, some of which hear nothing, at rates over eighteen decades: the
 * state is that of the closed form over all events, as near as the float in which a cell keeps it between them.
 */
TEST(e2_a_stiff_day_equals_the_closed_form_of_its_events)
{
    const long double hit = log1pl(0.9f * 4.0L), miss = logl(0.5L / 0.9L);
    uint64_t seed = test_seed();
    for (int decade = -9; decade <= 9; decade++) {
        struct sphere_conf conf = usual;
        conf.level = true;
        conf.level_half_rad = geo_rad(7.5);
        const long double fade_s = powl(10, -decade);
        conf.forget_s = (double)(fade_s * logl(6 / logl(0.6L / 0.4L)));
        start(&conf);
        in_the_world(0);
        long double want = 0;
        double worst = 0;
        uint64_t from_ns = now.now_ns, last_ns = from_ns;
        int misses = 0;
        while (now.now_ns - from_ns < 86400 * SECOND) {
            const bool hears = test_uniform(&seed) < 0.8;
            now.now_ns += (uint64_t)(1e6 * pow(6e4, test_uniform(&seed)));
            want *= expl(-(long double)(now.now_ns - last_ns) * 1e-9L / fade_s);
            last_ns = now.now_ns;
            ping(1, hears ? 5 : 0, 10);
            misses += !hears && want > 0;
            if (hears || want > 0) /* silence says nothing more of a cell that is gone */
                want = fminl(want + (hears ? hit : miss), 6);
            if (want < 1e-6L)
                want = 0;
            worst = fmax(worst, fabs((double)(first_cell(1).logodds - want)));
        }
        CHECK(misses > 100 || decade >= 4);
        CHECK_NEAR(worst, 0, 0, 3e-6);
    }
}

TEST(the_surest_obstacle_blocks_for_forget_and_no_longer_with_nothing_behind_it)
{
    start(&usual);
    for (int i = 0; i < 20; i++)
        ping(0, 5, 0);
    uint64_t t0 = now.now_ns;
    now.now_ns = t0 + (uint64_t)(159.5 * 1e9);
    CHECK_INT(ask(0, 6).state, ANSWER_BLOCKED);
    now.now_ns = t0 + (uint64_t)(160.5 * 1e9);
    CHECK_INT(ask(0, 6).state, ANSWER_UNKNOWN);
    for (int turn = 0; turn < 100; turn++) { /* silence that claims only the first 0.75 m never makes it clear */
        now.now_ns += 10 * SECOND;
        ping(0, 0, 0.75);
        CHECK_INT(ask(0, 6).state, ANSWER_UNKNOWN);
    }
}

TEST(g14_a_clock_that_goes_back_an_hour_grows_nothing_and_keeps_the_later_marks)
{
    start(&usual);
    now.now_ns = 10000 * SECOND;
    ping(0, 5, 0);
    struct sphere_cell a = first_cell(0.5);
    now.now_ns -= 3600 * SECOND;
    CHECK_NEAR(first_cell(0.5).logodds, a.logodds, 0, 0);
    ping(0, 5, 0);
    struct sphere_cell b = first_cell(0.5);
    CHECK(b.t_echo_ns == a.t_echo_ns && b.t_first_ns == a.t_first_ns);
    CHECK_NEAR(b.logodds, 2 * a.logodds, 1e-6, 0);
}

TEST(g18_evidence_that_has_all_but_faded_is_none_and_costs_no_more)
{
    struct sphere_conf fast = usual;
    fast.forget_s = 1;
    start(&fast);
    ping(0, 5, 0);
    now.now_ns += 250 * SECOND; /* exp(-673): 1e-292 */
    CHECK(first_cell(0.5).logodds < 1e-280);
    for (int i = 0; i < 200; i++) {
        ping(0, 5, 0);
        struct sphere_cell c = first_cell(0.5);
        CHECK(c.logodds == 0 || fabs(c.logodds) >= 1e-6);
        now.now_ns += 250 * SECOND;
    }
}

/* ---- motion ---- */

TEST(g15_a_million_steps_of_a_micrometre_add_up_to_a_metre)
{
    struct sphere_conf level = usual;
    level.level = true;
    level.level_half_rad = geo_rad(7.5);
    start(&level);
    in_the_world(0);
    ping(0, 6, 0); /* ahead: seen from nearer its cells come apart, none fall together */
    ping(20, 6, 0);
    struct sphere_stats before, after;
    sphere_stats(sphere, &before);
    struct sphere_cell a = first_cell(0.5);
    for (int step = 1; step <= 1000000; step++) {
        now.pose.position_m[0] = step * 1e-6;
        now.pose.path_m = step * 1e-6;
        if (step % 100 == 0)
            ping(180, 0, 0.4);
    }
    now.pose.position_m[0] = 1.0 + 0.11; /* the centre comes all the way */
    ping(180, 0, 0.4);
    sphere_stats(sphere, &after);
    CHECK_INT(after.cells, before.cells);
    CHECK_INT(after.cells_lost, 0);
    double nearest = INFINITY;
    for (int az = -8; az <= 8; az++)
        for (struct sphere_cell c = {0};
             sphere_cell(sphere, direction(az), 0, now.now_ns, &c) && c.from_m < 5.2;) {
            nearest = fmin(nearest, fabs(c.point_m[0] - (a.point_m[0] - 1.11)));
            break;
        }
    CHECK_NEAR(nearest, 0, 0, 1e-4);
    CHECK_NEAR(first_cell(0.5).ball_m - a.ball_m, 0.0111, 0.1, 0); /* a hundredth of the way, however many steps */
}

TEST(g16_turning_a_million_times_changes_nothing_in_the_world)
{
    start(&usual);
    in_the_world(0);
    ping(0, 6, 0);
    struct sphere_cell a = first_cell(0.5), b;
    for (int step = 0; step < 1000000; step++) {
        quat_from_rpy(0, 0, step * 1e-5, now.pose.attitude);
        if (step % 1000 == 0)
            ping(180 - geo_deg(step * 1e-5), 0, 0.4);
    }
    b = first_cell(0.5);
    CHECK(memcmp(a.point_m, b.point_m, sizeof a.point_m) == 0 && a.logodds == b.logodds && a.ball_m == b.ball_m);
}

TEST(g17_ten_million_metres_away_all_is_as_at_home)
{
    struct sphere_cell cell[2][8];
    for (int far = 0; far < 2; far++) {
        start(&usual);
        double origin = far ? 1e7 : 0;
        in_the_world(origin);
        for (int u = 0; u < 8; u++)
            ping(u * 45 + 1, 4.02 + 0.5 * u, 0);
        now.pose.position_m[0] = origin + 0.75; /* an exact binary fraction: the same in both worlds */
        ping(22, 0, 0.4);
        for (int u = 0; u < 8; u++)
            cell[far][u] = first_cell(u * 45 + 1);
    }
    for (int u = 0; u < 8; u++) {
        CHECK(cell[0][u].from_m == cell[1][u].from_m && cell[0][u].echoes == cell[1][u].echoes);
        for (int i = 0; i < 3; i++)
            CHECK_NEAR(cell[0][u].point_m[i], cell[1][u].point_m[i], 0, 1e-3);
    }
}

/* ---- the pool ---- */

TEST(g10_noise_in_all_beams_takes_bounded_memory_and_is_counted)
{
    struct sphere_conf small = usual;
    small.max_cells = 512;
    start(&small);
    uint64_t seed = test_seed();
    for (int i = 0; i < 20000; i++) {
        now.now_ns += SECOND / 100;
        ping_as(i % 400 ? 0 : PING_NEW_TURN, 0, 360 * test_uniform(&seed), 1 + 18 * test_uniform(&seed), 0);
    }
    struct sphere_stats st;
    sphere_stats(sphere, &st);
    CHECK(st.cells <= 512 && st.cells_lost > 1000);
    uint32_t n = 0;
    for (uint32_t d = 0; d < st.directions; d++) {
        double before = -1;
        struct sphere_cell c;
        for (uint32_t k = 0; sphere_cell(sphere, d, k, now.now_ns, &c); k++, n++) {
            CHECK(c.from_m > before && isfinite(c.logodds) && isfinite(c.ball_m));
            before = c.from_m;
        }
    }
    CHECK_INT(n, st.cells);
}

/* ---- what happened in the turn; evidence; locks ---- */

TEST(after_a_year_times_of_first_echoes_and_turns_are_still_right)
{
    start(&usual);
    ping_as(PING_NEW_TURN, 0, 0, 5, 0);
    for (int day = 1; day <= 400; day++) {
        now.now_ns += 86400 * SECOND;
        ping_as(PING_NEW_TURN, 0, 90, 5, 0);
        const uint64_t first_ns = now.now_ns;
        CHECK_INT(first_cell(90.5).flags, day == 1 ? SPHERE_NEW : SPHERE_UPDATED);
        now.now_ns += SECOND;
        ping_as(PING_NEW_TURN, 0, 180 + 0.25 * day, 7, 0);
        ping_as(0, 0, 180 + 0.25 * day, 7, 0);
        struct sphere_cell c = first_cell(180 + 0.25 * day);
        CHECK(c.t_echo_ns == now.now_ns && c.t_first_ns <= now.now_ns);
        CHECK_INT(first_cell(90.5).flags, 0); /* not looked at in this turn */
        CHECK(first_cell(90.5).t_first_ns <= first_ns);
    }
    ping_as(PING_NEW_TURN, 0, 330, 5, 0);
    CHECK_INT(first_cell(330.5).t_first_ns, now.now_ns);
    CHECK_INT(first_cell(330.5).flags, SPHERE_NEW);
    CHECK(first_cell(90.5).t_first_ns + 26 * 86400 * SECOND > now.now_ns);
}

static bool newest_gone(struct sphere_cell *gone)
{
    uint32_t at = 0;
    return sphere_gone(sphere, &at, now.now_ns, gone);
}

TEST(a_turn_tells_what_is_new_heard_again_missed_and_gone)
{
    start(&usual);
    ping_as(PING_NEW_TURN, 0, 0, 5, 0);
    CHECK_INT(first_cell(0.5).flags, SPHERE_NEW);
    now.now_ns += SECOND;
    ping_as(PING_NEW_TURN, 0, 90, 5, 0);
    CHECK_INT(first_cell(0.5).flags, 0); /* not looked at in this turn */
    ping(0, 5, 0);
    struct sphere_cell c = first_cell(0.5);
    CHECK_INT(c.flags, SPHERE_UPDATED);
    CHECK_INT(c.seq, 3);
    CHECK(c.sensor == 0 && c.echoes == 2 && c.t_first_ns == 1000 * SECOND && c.t_echo_ns == 1001 * SECOND);
    now.now_ns += SECOND;
    ping_as(PING_NEW_TURN, 3, 0, 8, 0); /* another sensor looks through */
    c = first_cell(0.5);
    CHECK_INT(c.flags, SPHERE_MISSED);
    CHECK(c.sensor == 3 && c.seq == 4);
    CHECK_INT(c.misses, 1);
    ping(0, 5, 0);
    CHECK_INT(first_cell(0.5).misses, 0);
    struct sphere_cell gone;
    CHECK(!newest_gone(&gone));
    for (int i = 0; i < 30; i++)
        ping_as(0, 3, 0, 8, 0);
    CHECK(newest_gone(&gone));
    CHECK(gone.flags & SPHERE_GONE && gone.sensor == 3);
    CHECK(gone.misses > 1);
    CHECK_NEAR(gone.from_m, 5, 0, 0.2);
    CHECK_NEAR(first_cell(0.5).from_m, 8, 0, 0.4);
    ping_as(PING_NEW_TURN, 0, 90, 5, 0);
    CHECK(newest_gone(&gone));
    ping_as(PING_NEW_TURN, 3, 90, 5, 0); /* the turn of the sensor that took it away ends */
    CHECK(!newest_gone(&gone));
}

TEST(misses_are_counted_to_fifteen)
{
    start(&usual);
    for (int i = 0; i < 100; i++)
        ping(0, 5, 0);
    /* half a degree of the cell's two is passed: a little evidence goes with each beam */
    int misses = 0;
    for (; misses < 40 && first_cell(0.5).from_m < 5.2; misses++) {
        CHECK_INT(first_cell(0.5).misses, misses < 15 ? misses : 15);
        ping(2.5, 8, 0);
    }
    CHECK(misses > 16);
}

TEST(what_is_gone_keeps_its_place_when_the_vehicle_goes_far)
{
    start(&usual);
    in_the_world(0);
    ping_as(PING_NEW_TURN, 0, 0, 5, 0);
    for (int i = 0; i < 30; i++)
        ping(0, 8, 0);
    struct sphere_cell gone;
    CHECK(newest_gone(&gone));
    CHECK_NEAR(gone.point_m[0], 5, 0, 0.1);
    in_the_world(150); /* farther than points are kept from one anchor */
    ping(0, 8, 0);
    CHECK(newest_gone(&gone));
    CHECK_NEAR(gone.point_m[0], 5 - 150, 0, 0.1);
}

TEST(a_locked_cell_neither_changes_nor_fades_but_keeps_its_place)
{
    start(&usual);
    in_the_world(0);
    ping(0, 5, 0);
    CHECK(!sphere_lock(sphere, direction(0.5), 7, true) && !sphere_lock(sphere, direction(0.5), 1e9, true));
    CHECK(sphere_lock(sphere, direction(0.5), 5, true));
    struct sphere_cell a = first_cell(0.5), b;
    for (int i = 0; i < 50; i++) {
        ping(0, 8, 0);
        ping(0, 5, 0);
    }
    now.now_ns += 10000 * SECOND;
    ping(0, 8, 0);
    b = first_cell(0.5);
    CHECK(a.logodds == b.logodds && a.echoes == b.echoes && b.flags & SPHERE_LOCKED);
    CHECK_INT(ask(0, 6).state, ANSWER_BLOCKED);
    now.pose.position_m[0] = 0.5;
    ping(180, 0, 0.4);
    CHECK_NEAR(first_cell(0.5).point_m[0], a.point_m[0] - 0.5, 0, 1e-5);
    CHECK(sphere_lock(sphere, direction(0.5), first_cell(0.5).from_m, false));
    CHECK_INT(ask(0, 6).state, ANSWER_UNKNOWN); /* at once: no ping is needed */
}

TEST(of_two_reflectors_in_a_cell_the_nearer_is_kept_and_the_ball_reaches_the_other)
{
    struct sphere_conf thick = usual;
    thick.layers = (struct layers_conf){.r_max_m = 30, .dr_m = 2, .n_const = 1, .growth = 1.2};
    for (int order = 0; order < 2; order++) {
        start(&thick);
        for (int i = 0; i < 5; i++) {
            ping(0, order ? 3.6 : 2.4, 0);
            ping(0, order ? 2.4 : 3.6, 0);
        }
        struct sphere_cell c = first_cell(0.5);
        CHECK_NEAR(c.point_m[0], 2.4, 0, 0.01);
        CHECK(3 * c.ball_m >=
              1.19 * (order ? sqrt(7.0 / 8) : 1)); /* the nearer one, heard last, shrinks it a little */
    }
}

TEST(of_two_reflectors_in_a_cell_neither_takes_the_nearest_edge_away)
{
    struct sphere_conf thick = usual;
    thick.layers = (struct layers_conf){.r_max_m = 30, .dr_m = 2, .n_const = 1, .growth = 1.2};
    static const struct {
        double first_m, first_edge_m, then_m, then_edge_m, nearest_edge_m;
    } row[] = {
        {2.4, 0.30, 3.6, 0.02, 2.10}, /* a sharp one behind a blurred one */
        {3.6, 0.02, 2.4, 0.30, 2.10},
        {2.4, 0.02, 3.6, 1.50, 2.10}, /* a blurred one whose edge lies before a sharp one */
        {3.6, 1.50, 2.4, 0.02, 2.10},
        {2.4, 0.30, 2.4, 0.02, 2.38}, /* one reflector: the last look counts */
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start(&thick);
        edge_m = row[i].first_edge_m;
        ping(0, row[i].first_m, 0);
        edge_m = row[i].then_edge_m;
        ping(0, row[i].then_m, 0);
        CHECK_NEAR(first_cell(0.5).near_m, row[i].nearest_edge_m, 0, 0.01);
    }
}

/* ---- models ---- */

TEST(every_model_blocks_the_whole_opening_and_frees_the_same_water)
{
    for (int model = SPHERE_OPENING; model <= SPHERE_MIDPOINT; model++)
        for (int update = SPHERE_BAYES; update <= SPHERE_MAX; update++) {
            struct sphere_conf conf = usual;
            conf.model = (enum sphere_model)model;
            conf.update = (enum sphere_update)update;
            start(&conf);
            for (int u = 0; u < 400; u++)
                ping(u * 0.9, 5, 0);
            for (int el = -11; el <= 11; el += 2)
                for (int az = 0; az < 360; az += 30) {
                    struct answer_query q = {.az_rad = geo_rad(az),
                                             .el_rad = geo_rad(el),
                                             .distance_m = 6,
                                             .half_angle_rad = geo_rad(1),
                                             .near_m = RIG_NEAR_M};
                    const struct answer a = rig_line(&q);
                    CHECK_INT(a.state, ANSWER_BLOCKED);
                    CHECK(a.range_m > 4.7 && a.range_m < 5.05);
                }
            CHECK_INT(ask(77, 4.4).state, ANSWER_CLEAR);
            struct sphere_cell c = first_cell(0.5);
            CHECK(update == SPHERE_MAX ? c.logodds < 1.6 : c.logodds > 1);
        }
}

TEST(the_gaussian_weighs_less_off_the_axis)
{
    struct sphere_conf conf = usual;
    conf.model = SPHERE_GAUSS;
    start(&conf);
    ping(1, 5, 0);
    const struct rings *rings = sphere_picture(sphere)->rings;
    double before = INFINITY;
    for (int el = 1; el < 20; el += 2) {
        struct sphere_cell c, best = {0};
        uint32_t d = rings_index(rings, geo_rad(1), geo_rad(el));
        for (uint32_t k = 0; sphere_cell(sphere, d, k, now.now_ns, &c); k++)
            best = c.logodds > best.logodds ? c : best;
        CHECK(best.logodds > 0 && best.logodds < before);
        before = best.logodds;
    }
}

TEST(g6_growing_age_never_turns_blocked_or_unknown_into_clear)
{
    uint64_t seed = test_seed();
    for (int scene = 0; scene < 6; scene++) {
        struct sphere_conf conf = usual;
        conf.model = (enum sphere_model)(scene % 3);
        start(&conf);
        for (int i = 0; i < 400; i++) {
            now.now_ns += SECOND / 20;
            ping(360 * test_uniform(&seed), test_uniform(&seed) < 0.3 ? 1 + 8 * test_uniform(&seed) : 0,
                 10 * test_uniform(&seed));
        }
        uint64_t t0 = now.now_ns;
        for (int az = 0; az < 360; az += 15) {
            enum answer_state before = ANSWER_CLEAR;
            for (double age = 0; age < 400; age = age * 1.3 + 1) {
                now.now_ns = t0 + (uint64_t)(age * 1e9);
                enum answer_state state = ask(az, 4).state;
                CHECK(!(before != ANSWER_CLEAR && state == ANSWER_CLEAR));
                CHECK(!(before == ANSWER_UNKNOWN && state == ANSWER_BLOCKED));
                before = state;
            }
        }
    }
}

int main(void)
{
    RUN(g11_a_million_echoes_saturate_and_leave_the_point_in_their_middle);
    RUN(g12_a_state_that_a_billion_hits_made_changes_within_ten_misses);
    RUN(logodds_as_probabilities_equal_the_table);
    RUN(g13_fading_equals_the_table_at_any_rate);
    RUN(g13_grids_of_all_rates_side_by_side_equal_one_exponential_however_read);
    RUN(e2_a_stiff_day_equals_the_closed_form_of_its_events);
    RUN(the_surest_obstacle_blocks_for_forget_and_no_longer_with_nothing_behind_it);
    RUN(g14_a_clock_that_goes_back_an_hour_grows_nothing_and_keeps_the_later_marks);
    RUN(g18_evidence_that_has_all_but_faded_is_none_and_costs_no_more);
    RUN(g15_a_million_steps_of_a_micrometre_add_up_to_a_metre);
    RUN(g16_turning_a_million_times_changes_nothing_in_the_world);
    RUN(g17_ten_million_metres_away_all_is_as_at_home);
    RUN(g10_noise_in_all_beams_takes_bounded_memory_and_is_counted);
    RUN(after_a_year_times_of_first_echoes_and_turns_are_still_right);
    RUN(a_turn_tells_what_is_new_heard_again_missed_and_gone);
    RUN(misses_are_counted_to_fifteen);
    RUN(what_is_gone_keeps_its_place_when_the_vehicle_goes_far);
    RUN(a_locked_cell_neither_changes_nor_fades_but_keeps_its_place);
    RUN(of_two_reflectors_in_a_cell_the_nearer_is_kept_and_the_ball_reaches_the_other);
    RUN(of_two_reflectors_in_a_cell_neither_takes_the_nearest_edge_away);
    RUN(every_model_blocks_the_whole_opening_and_frees_the_same_water);
    RUN(the_gaussian_weighs_less_off_the_axis);
    RUN(g6_growing_age_never_turns_blocked_or_unknown_into_clear);
    return test_end();
}
