/* SPDX-License-Identifier: MIT */
/*
 * test_course - a grid whose axes follow the course beside one whose axes are NED, fed the same pings: turns by whole
 * steps change nothing that is found in it, others no more than a cell, and nothing drifts.
 */
#include "grid/answer/nearest.h"
#include "tests/lib/sphere_rig.h"

#include "core/fault.h"
#include "grid/answer/next_look.h"
#include "tests/lib/ranking.h"
#include "tests/lib/way_rig.h"

#define STEP_DEG 2.0

/* In the gate fewer and shorter voyages, and fewer turns. */
static bool is_long(void)
{
    return getenv("LONG") != NULL;
}

static const struct sphere_conf usual = {.angular_step_rad = STEP_DEG * GEO_PI / 180,
                                         .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                         .max_cells = 40000,
                                         .forget_s = 160,
                                         .blocked_above = 0.6,
                                         .recentre_m = 0.1};
static struct sphere *fixed, *follow;
static struct mount mount;

static struct sphere *made(void **memory, struct sphere_conf conf, enum sphere_axes axes)
{
    struct fault fault;
    conf.axes = axes;
    *memory = rig_memory(*memory, sphere_bytes(&conf, &fault));
    return sphere_init(*memory, &conf);
}

static void start_with(double step_deg, bool level)
{
    static void *memory[2];
    struct sphere_conf conf = usual;
    conf.angular_step_rad = geo_rad(step_deg);
    conf.level = level;
    conf.level_half_rad = geo_rad(10);
    fixed = made(&memory[0], conf, SPHERE_NED);
    follow = made(&memory[1], conf, SPHERE_COURSE);
    mount = (struct mount){.position_m = {0.2, 0.05, 0}, .attitude = {1, 0, 0, 0}};
    now = (struct answer_now){.now_ns = 1000 * SECOND, .pose = pose_identity, .pose_fresh = true};
    now.pose.has = POSE_ATTITUDE | POSE_POSITION;
}

static void start(bool level)
{
    start_with(STEP_DEG, level);
}

static void head(double yaw_rad)
{
    quat_from_rpy(0, 0, yaw_rad, now.pose.attitude);
}

/* One beam of 2 by 25 degrees into both; range_m 0: it heard nothing up to free_m. */
static void ping(double az_rad, double range_m, double free_m)
{
    struct beam_echoes beam = {
        .az_rad = (float)az_rad, .blind_m = 0.3f, .free_to_m = (float)free_m, .state = BEAM_SILENT};
    if (range_m > 0) {
        beam.state = BEAM_ECHO;
        beam.n = 1;
        beam.free_to_m = (float)(range_m - 0.02);
        beam.echo[0] = (struct echo){.range_m = (float)range_m,
                                     .near_m = (float)(range_m - 0.02),
                                     .sd_m = 0.01f,
                                     .strength = 10,
                                     .confidence = 0.9f};
    }
    const struct echoes e = {.t_ns = now.now_ns,
                             .n_beams = 1,
                             .range_max_m = 20,
                             .az_aperture_rad = (float)geo_rad(2),
                             .el_aperture_rad = (float)geo_rad(25),
                             .pose = now.pose,
                             .max_beams = 1,
                             .beam = &beam};
    sphere_enter(fixed, &e, &mount);
    sphere_enter(follow, &e, &mount);
}

static double axes_deg(void)
{
    struct picture_frame frame;
    picture_get_frame(sphere_picture(follow), &frame);
    return geo_deg(frame.axes_rad);
}

static uint64_t turned(const struct sphere *s)
{
    struct sphere_stats stats;
    sphere_stats(s, &stats);
    return stats.turned;
}

static void find(struct sphere *s, const struct obstacles_query *q, struct obstacles_found *found)
{
    find_obstacles(sphere_picture(s), &limits, &now, q, found);
}

static struct obstacles_found told(struct sphere *s, double az_rad, double half_deg, double distance_m)
{
    struct obstacles_found found;
    find(s,
         &(struct obstacles_query){.line = {.az_rad = az_rad,
                                            .ned = true,
                                            .distance_m = distance_m,
                                            .half_angle_rad = geo_rad(half_deg)}},
         &found);
    return found;
}

/* ---- which way ---- */

static double axes_for(double yaw_deg, double north_mps, double east_mps)
{
    head(geo_rad(yaw_deg));
    now.pose.has |= POSE_VELOCITY;
    now.pose.velocity_mps[0] = north_mps;
    now.pose.velocity_mps[1] = east_mps;
    ping(0, 5, 0);
    return axes_deg();
}

TEST(the_axes_are_the_course_over_ground_or_else_the_heading)
{
    start(true);
    head(geo_rad(90));
    ping(0, 5, 0);
    CHECK_NEAR(axes_deg(), 90, 0, 1e-9);         /* no velocity was told */
    CHECK_NEAR(axes_for(97, 0, 0), 90, 0, 1e-9); /* less than ten degrees */
    CHECK_NEAR(axes_for(101, 0, 0), 101, 0, 1e-9);
    CHECK_NEAR(axes_for(101, 0.1, 0.1), 101, 0, 1e-9); /* too slow for a course */
    CHECK_NEAR(axes_for(101, 0.2, 0.2), 45, 0, 1e-9);
    CHECK_NEAR(axes_for(101, -0.08, -0.08), 225, 0, 1e-9); /* still under way */
    CHECK_NEAR(axes_for(101, -0.05, -0.05), 101, 0, 1e-9);
    quat_from_rpy(0, geo_rad(80), geo_rad(20),
                  now.pose.attitude); /* the bow points up: where it goes is nowhere */
    ping(0, 5, 0);
    CHECK_NEAR(axes_deg(), 101, 0, 1e-9);
    CHECK_INT(turned(follow), 5);
    CHECK_INT(turned(fixed), 0);
}

TEST(without_an_attitude_both_grids_are_the_bodys)
{
    start(false);
    now.pose.has = POSE_VELOCITY;
    now.pose.velocity_mps[1] = 1;
    for (int u = 0; u < 400; u++)
        ping(geo_rad(0.9 * u), u % 3 ? 5 : 7, 0);
    CHECK_NEAR(axes_deg(), 0, 0, 0);
    for (uint32_t d = 0; d < sphere_picture(fixed)->n; d++) {
        struct picture_entry a, b;
        picture_get(sphere_picture(fixed), d, &a);
        picture_get(sphere_picture(follow), d, &b);
        CHECK(memcmp(&a, &b, sizeof a) == 0);
    }
}

/* ---- turns by whole steps ---- */

#define SECTORS 64 /* none of their edges is one of cells of 3 degrees */

#define SAME_M 2e-6 /* ranges are floats, and axes are turned */

static void check_same(const struct obstacles_found *a, const struct obstacles_found *b)
{
    CHECK_INT(a->any, b->any);
    CHECK(!a->any || fabs(a->range_m - b->range_m) < SAME_M);
    CHECK(!a->any || fabs(a->age_s - b->age_s) < 1e-9);
}

static void check_sectors(bool ned)
{
    struct obstacles_found a[SECTORS], b[SECTORS];
    const struct obstacles_query q = {
        .around = true,
        .band = {.ned = ned, .lo_rad = geo_rad(-5.3), .hi_rad = geo_rad(5.1), .reach_m = 4, .count = SECTORS}};
    find(fixed, &q, a);
    find(follow, &q, b);
    for (int k = 0; k < SECTORS; k++)
        check_same(&a[k], &b[k]);
}

/* The obstacle alone: no records are kept here. */
static struct nearest nearest_of(struct sphere *s, bool ned)
{
    const struct nearest_query q = {.ned = ned, .lo_rad = geo_rad(-6), .hi_rad = geo_rad(6), .heard_m = 10};
    const struct verdict_evidence by = {.picture = sphere_picture(s), .conf = &limits, .now = &now};
    struct nearest_look look;
    nearest_begin(&look, NULL, &by, &q, 0);
    return look.answer;
}

static void check_nearest(bool ned)
{
    const struct nearest a = nearest_of(fixed, ned), b = nearest_of(follow, ned);
    CHECK_INT(a.state, ANSWER_BLOCKED);
    CHECK_INT(b.state, ANSWER_BLOCKED);
    CHECK_NEAR(a.range_m, b.range_m, 0, SAME_M);
    CHECK_NEAR(geo_wrap_pi(a.az_rad - b.az_rad), 0, 0, 1e-9);
}

static void check_way(bool ned, double az_rad)
{
    struct corridor_query q = {
        .body = {.radius_m = 0.2, .half_height_m = 0.1, .margin_m = 0.05}, .ned = ned, .most_m = 6, .near_m = 0.5};
    geo_direction(az_rad, 0.01, q.direction);
    const struct obstacles_found a = find_in_way(sphere_picture(fixed), &limits, &now, &q),
                                 b = find_in_way(sphere_picture(follow), &limits, &now, &q);
    CHECK(isinf(a.near_m) ? isinf(b.near_m) : fabs(a.near_m - b.near_m) < 1e-5);
    CHECK(isinf(a.hint_m) ? isinf(b.hint_m) : fabs(a.hint_m - b.hint_m) < 1e-5);
}

static void check_next_look(void)
{
    const struct next_look_conf conf = {
        .stale_s = 30, .low_rad = -0.1, .high_rad = 0.1, .apart_rad = 0.2, .velocity_mps = {0.3, 0.17, 0}};
    struct next_look a[4], b[4];
    double middle[2] = {0};
    CHECK_INT(rank_looks(sphere_picture(fixed), now.now_ns, &conf, a, 4), 4);
    CHECK_INT(rank_looks(sphere_picture(follow), now.now_ns, &conf, b, 4), 4);
    for (int i = 0; i < 4; i++) {
        CHECK_NEAR(geo_wrap_pi(a[i].az_rad - b[i].az_rad), 0, 0, 1e-9);
        CHECK_NEAR(a[i].score, b[i].score, 1e-9, 0);
    }
    CHECK(next_look_sector(sphere_picture(fixed), now.now_ns, &conf, NULL, 0.7, &middle[0]));
    CHECK(next_look_sector(sphere_picture(follow), now.now_ns, &conf, NULL, 0.7, &middle[1]));
    CHECK_NEAR(middle[0], middle[1], 0, 1e-9);
}

TEST(a_turn_by_whole_steps_changes_nothing)
{
    const double step_deg = 3; /* no middle of a cell at an edge of next_look_sector's slices of 5 */
    uint64_t seed = test_seed();
    start_with(step_deg, true);
    mount = mount_identity;
    double yaw_deg = 0;
    for (int legs = 0; legs < 12; legs++) {
        for (int u = 0; u < 200; u++) { /* half a turn of the head, and a bay of open water; nothing grows old */
            now.now_ns += SECOND / 400;
            const double bearing = geo_rad(0.9 * u + 0.123), az = geo_wrap(bearing + geo_rad(yaw_deg));
            ping(bearing, az > 1 && az < 1.5 ? 0 : 5 + sin(3 * az), 2.5);
        }
        check_sectors(false);
        check_sectors(true);
        check_nearest(false);
        check_nearest(true);
        check_next_look();
        for (int k = 0; k < 90; k++) {
            const double az = geo_rad(4.0 * k + 0.37);
            const struct obstacles_found a = told(fixed, az, 5, 4), b = told(follow, az, 5, 4);
            check_same(&a, &b);
            check_way(k % 2, az);
        }
        yaw_deg += step_deg * (double)(6 + test_random(&seed) % 100);
        head(geo_rad(yaw_deg));
    }
    CHECK(turned(follow) > 8);
}

/* ---- any turns, in a made-up world ---- */

struct post {
    double x, y, radius;
};

static struct post post[6];

/* First surface of a room of 8 by 5 m with posts, met from p along az; INFINITY through its gate. */
static double surface(const double p[2], double az)
{
    const double dx = cos(az), dy = sin(az);
    const double tx = dx > 0 ? (4 - p[0]) / dx : dx < 0 ? (-4 - p[0]) / dx : INFINITY;
    const double ty = dy > 0 ? (2.5 - p[1]) / dy : dy < 0 ? (-2.5 - p[1]) / dy : INFINITY;
    double t = fmin(tx, ty);
    if (ty < tx && fabs(p[0] + t * dx) < 0.7)
        t = INFINITY;
    for (int i = 0; i < 6; i++) {
        const double x = post[i].x - p[0], y = post[i].y - p[1], along = x * dx + y * dy;
        const double beside2 = x * x + y * y - along * along, r2 = post[i].radius * post[i].radius;
        if (along > 0 && beside2 < r2)
            t = fmin(t, along - sqrt(r2 - beside2));
    }
    return t;
}

/* Nearest surface within `off` to each side. */
static double surface_within(const double p[2], double az, double off_rad)
{
    double nearest = INFINITY;
    for (int k = -20; k <= 20; k++)
        nearest = fmin(nearest, surface(p, az + k * off_rad / 20));
    return nearest;
}

static void listen(double bearing_rad, double yaw_rad)
{
    double lever[3];
    quat_rotate(now.pose.attitude, mount.position_m, lever);
    const double p[2] = {now.pose.position_m[0] + lever[0], now.pose.position_m[1] + lever[1]};
    const double heard = surface_within(p, bearing_rad + yaw_rad, geo_rad(1));
    ping(bearing_rad, heard < 12 ? heard : 0, 8);
}

static void furnish(uint64_t *seed)
{
    for (int i = 0; i < 6; i++) {
        const double az = GEO_TURN * (i + 0.5 * test_uniform(seed)) / 6, away = 1.6 + 0.6 * test_uniform(seed);
        post[i] = (struct post){away * cos(az), away * sin(az), 0.05 + 0.2 * test_uniform(seed)};
    }
}

struct tally {
    int asked, blocked_fixed, blocked_both, alike;
};

#define LAYER_M 0.15 /* the deepest within the room, and what motion makes doubtful */

static void compare(struct tally *t, uint64_t *seed)
{
    for (int k = 0; k < 24; k++) {
        const double az = GEO_TURN * test_uniform(seed), distance_m = 0.6 + 5 * test_uniform(seed);
        const struct obstacles_found a = told(fixed, az, 5, distance_m), b = told(follow, az, 5, distance_m),
                                     wide = told(follow, az, 5 + 2 * STEP_DEG, distance_m),
                                     before = told(fixed, az, 5, distance_m - LAYER_M);
        CHECK(wide.any || !before.any);
        t->asked++;
        t->blocked_fixed += a.any;
        if (a.any && b.any) {
            t->blocked_both++;
            const struct obstacles_found wider = told(fixed, az, 5 + 2 * STEP_DEG, distance_m);
            t->alike += b.range_m >= wider.range_m - LAYER_M && wide.range_m <= a.range_m + LAYER_M;
        }
    }
}

/* A head that scans all round (or 120 degrees ahead) while the vehicle turns and moves: so many pings;
 * ends with the pictures' checksum. */
static uint64_t voyage(uint64_t seed, int trial, int pings, struct tally *t)
{
    start(trial % 2);
    furnish(&seed);
    double yaw = GEO_TURN * test_uniform(&seed), rate = 0, bearing = 0;
    for (int k = 0; k < pings; k++) {
        if (k % 100 == 0)
            rate = trial % 4 < 2 ? geo_rad(40) * (test_uniform(&seed) - 0.5)
                                 : geo_rad(15) * (test_uniform(&seed) - 0.5);
        now.now_ns += SECOND / 50;
        yaw += rate / 50;
        head(yaw);
        const double way = yaw + (trial % 3 ? 0 : 0.8), speed = 0.25 * (trial > 1);
        const double step[2] = {speed / 50 * cos(way), speed / 50 * sin(way)};
        if (hypot(now.pose.position_m[0] + step[0], now.pose.position_m[1] + step[1]) < 1) {
            for (int i = 0; i < 2; i++) {
                now.pose.position_m[i] += step[i];
                now.pose.velocity_mps[i] = step[i] * 50;
            }
            now.pose.path_m += speed / 50;
            now.pose.has |= POSE_VELOCITY;
        } else {
            memset(now.pose.velocity_mps, 0, sizeof now.pose.velocity_mps);
        }
        bearing = trial % 5 == 4 ? geo_rad(-60 + 0.9 * (k % 134)) : geo_rad(0.9 * k);
        listen(bearing, yaw);
        if (k > 500 && k % 50 == 0)
            compare(t, &seed);
    }
    uint64_t sum = 14695981039346656037u;
    for (uint32_t d = 0; d < sphere_picture(follow)->n; d++) {
        struct picture_entry e;
        picture_get(sphere_picture(follow), d, &e);
        for (size_t i = 0; i < sizeof e; i++)
            sum = (sum ^ ((unsigned char *)&e)[i]) * 1099511628211u;
    }
    return sum;
}

TEST(on_any_voyage_obstacles_are_the_same_within_a_cell)
{
    uint64_t seed = test_seed();
    struct tally t = {0};
    uint64_t turns = 0;
    for (int trial = 0; trial < (is_long() ? 8 : 5); trial++) {
        voyage(test_random(&seed), trial, is_long() ? 3000 : 1200, &t);
        turns += turned(follow);
    }
    CHECK(turns > 15); /* or it proves nothing; a voyage may keep its heading */
    printf("# %d answers, %d turns; blocked %d, with both %d, alike %d\n", t.asked, (int)turns, t.blocked_fixed,
           t.blocked_both, t.alike);
    CHECK(t.blocked_both > 0.8 * t.blocked_fixed);
    CHECK(t.alike > 0.97 * t.blocked_both);
}

TEST(the_same_pings_make_the_same_grid)
{
    const uint64_t seed = test_seed();
    struct tally t = {0};
    for (int trial = 0; trial < 2; trial++)
        CHECK(voyage(seed, trial, 600, &t) == voyage(seed, trial, 600, &t));
}

/* An obstacle's place is the same bits after any number of turns, and it blocks the same way. */
TEST(turns_do_not_drift)
{
    uint64_t seed = test_seed();
    start(true);
    ping(geo_rad(33), 5, 0);
    const struct obstacles_found before = told(follow, geo_rad(33), 3 * STEP_DEG, 8);
    CHECK(before.any);
    const int turns_asked = is_long() ? 20000 : 1000;
    for (int turns = 0; turns < turns_asked; turns++) {
        head(geo_rad(11) * (turns + 1) + 0.1 * test_uniform(&seed));
        ping(geo_rad(200) - geo_rad(11) * (turns + 1), 0, 1);
    }
    CHECK(turned(follow) > (uint64_t)turns_asked / 2);
    const struct obstacles_found after = told(follow, geo_rad(33), 3 * STEP_DEG, 8);
    CHECK(after.any);
    CHECK_NEAR(after.range_m, before.range_m, 0, 0);
    CHECK_NEAR(after.sd_m, before.sd_m, 0, 0);
}

/* ---- clusters ---- */

TEST(clusters_keep_their_labels_and_places_while_the_axes_turn)
{
    uint64_t seed = test_seed();
    start(false);
    mount = mount_identity;
    sphere = follow;
    struct sphere_conf conf = usual;
    struct clusters *clusters = rig_clusters(&conf);
    const struct cluster *list;
    uint32_t all, label[2] = {0};
    double yaw = 0;
    for (int turns = 0; turns < 40; turns++) {
        for (int u = 0; u < 20; u++) {
            ping(geo_rad(350 + u) - yaw, 4, 0);
            ping(geo_rad(100 + u) - yaw, 6, 0);
        }
        CHECK_INT(clusters_look(clusters, follow, now.now_ns, &list, &all), 2);
        for (int i = 0; i < 2; i++) {
            const double from_deg = i == 0 ? 349 : 99,
                         off = geo_deg(geo_wrap_pi(list[i].from_rad - geo_rad(from_deg)));
            CHECK(turns == 0 || list[i].label == label[i]);
            CHECK(off > -2 * STEP_DEG && off < STEP_DEG);
            CHECK(fabs(geo_deg(list[i].width_rad) - 22) < 3 * STEP_DEG);
            label[i] = list[i].label;
        }
        CHECK(!clusters_gone(clusters, 0));
        now.now_ns += 2 * SECOND;
        yaw += geo_rad(11 + 60 * test_uniform(&seed));
        head(yaw);
    }
}

int main(void)
{
    RUN(the_axes_are_the_course_over_ground_or_else_the_heading);
    RUN(without_an_attitude_both_grids_are_the_bodys);
    RUN(a_turn_by_whole_steps_changes_nothing);
    RUN(on_any_voyage_obstacles_are_the_same_within_a_cell);
    RUN(the_same_pings_make_the_same_grid);
    RUN(turns_do_not_drift);
    RUN(clusters_keep_their_labels_and_places_while_the_axes_turn);
    return test_end();
}
