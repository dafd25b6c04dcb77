/* SPDX-License-Identifier: MIT */
/* test_limit - corridors and the speed they allow: on pictures made by hand, and by their properties on random ones. */
#include "tests/lib/table.h"
#include "tests/lib/picture_rig.h"
#include "tests/lib/way_rig.h"

#include "grid/answer/limit.h"

#define NEAR_M 0.7

static const struct corridor_body small = {.radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1};

static void start(void)
{
    start_with(rings_full(&rings, geo_rad(3)), false);
}

static void set(uint32_t d, double near_m, double age_s)
{
    struct picture_entry e = {0};
    const uint64_t t_ns = NOW - (uint64_t)(age_s * 1e9);
    if (near_m > 0)
        e.obstacle[0] = (struct picture_obstacle){.t_ref_ns = t_ns,
                                                  .t_echo_ns = t_ns,
                                                  .logodds = 4,
                                                  .near_m = (float)near_m,
                                                  .range_m = (float)near_m,
                                                  .sd_m = 0.05f};
    picture_begin(&picture);
    picture_set(&picture, d, &e);
    picture_end(&picture);
}

static uint32_t at(double az_deg, double el_deg)
{
    return rings_index(&rings, geo_rad(az_deg), geo_rad(el_deg));
}

static struct obstacles_found find(const struct corridor_query *q)
{
    return find_in_way(&picture, &limits, &now, q);
}

static struct obstacles_found find_drifting(const struct corridor_body *body, double x, double y, double z,
                                            double most_m, const double drift_m[3])
{
    return find(&(struct corridor_query){.body = *body,
                                         .direction = {x, y, z},
                                         .drift_m = {drift_m[0], drift_m[1], drift_m[2]},
                                         .most_m = most_m,
                                         .near_m = NEAR_M});
}

static struct obstacles_found find_ahead(const struct corridor_body *body, double x, double y, double z,
                                         double most_m)
{
    return find_drifting(body, x, y, z, most_m, (const double[3]){0, 0, 0});
}

TEST(what_stands_in_the_tunnel_blocks_and_what_stands_beside_it_does_not)
{
    start();
    set(at(0, 0), 5, 2);
    struct obstacles_found c = find_ahead(&small, 1, 0, 0, 10);
    CHECK_NEAR(c.near_m, 5, 0.02, 0);
    CHECK(c.near_m <= 5);
    CHECK_NEAR(c.age_s, 2, 1e-6, 0);
    CHECK_NEAR(c.sd_m, 0.05, 1e-6, 0);
    CHECK(isinf(find_ahead(&small, 0, 1, 0, 10).near_m));
    CHECK(isinf(find_ahead(&small, -1, 0, 0, 10).near_m));
    start();
    set(at(30, 0), 5, 2); /* 2.5 m to the side */
    CHECK(isinf(find_ahead(&small, 1, 0, 0, 10).near_m));
    CHECK(find_ahead(&small, 0.866, 0.5, 0, 10).near_m < 5.01);
    set(at(30, 0), 0.55, 2); /* 0.48 m ahead, 0.28 m to the side: in the way of a round front, 0.4 m wide */
    c = find_ahead(&small, 1, 0, 0, 10);
    CHECK(c.near_m < 0.59 && c.near_m > 0.55);
}

/* The tunnel is around the vehicle, the rays begin at the grid's centre. */
TEST(a_vehicle_off_the_grids_centre_sweeps_its_own_tunnel)
{
    for (int side = -1; side <= 1; side += 2) {
        start_with(rings_full(&rings, geo_rad(3)), true);
        set(at(25 * side, 0), 1.2, 1); /* 1 m ahead, 0.47 m to the side of the centre */
        now.pose.position_m[1] = 0.1 * side;
        CHECK(find_ahead(&small, 1, 0, 0, 10).near_m < 1.4);
        now.pose.position_m[1] = -0.1 * side;
        CHECK(isinf(find_ahead(&small, 1, 0, 0, 10).near_m));
        now.pose.position_m[1] = 0;
        set(at(25 * side, 0), 0, 1);
        set(at(0, 20 * side), 1.1, 1); /* 1 m ahead, 0.36 m above or below */
        now.pose.position_m[2] = -0.1 * side;
        CHECK(find_ahead(&small, 1, 0, 0, 10).near_m < 1.4);
        now.pose.position_m[2] = 0.1 * side;
        CHECK(isinf(find_ahead(&small, 1, 0, 0, 10).near_m));
        now.pose.position_m[2] = 0;
    }
}

/* One that never sufficed to block does, too; where it lies beyond what the tunnel sweeps it says nothing. */
TEST(an_echo_that_does_not_suffice_to_block_is_no_free_water)
{
    for (int beyond = 0; beyond < 2; beyond++) {
        start();
        picture_begin(&picture);
        picture_set(&picture, at(0, 0), &(struct picture_entry){.hint_m = beyond ? 4 : 1.5f});
        picture_end(&picture);
        const struct obstacles_found c =
            find(&(struct corridor_query){.body = small, .direction = {1, 0, 0}, .most_m = 2, .near_m = 3});
        CHECK(!c.any);
        CHECK(beyond ? isinf(c.hint_m) : c.hint_m <= 1.5 && c.hint_m > 1.4);
    }
}

/* An echo that has faded too far to block ends what is known, in the vehicle's own place too. */
TEST(a_faint_echo_near_by_is_no_free_water)
{
    start();
    struct picture_entry e = {0};
    e.obstacle[0] = (struct picture_obstacle){.t_ref_ns = NOW,
                                              .t_echo_ns = NOW,
                                              .logodds = (float)picture.blocked_logodds / 2,
                                              .near_m = 0.5f,
                                              .range_m = 0.5f,
                                              .sd_m = 0.05f};
    picture_begin(&picture);
    picture_set(&picture, at(80, 0), &e); /* leaves the tunnel abeam, nearer than near_m */
    picture_end(&picture);
    CHECK(isinf(find_ahead(&small, 1, 0, 0, 10).hint_m));
    e.obstacle[0].near_m = e.obstacle[0].range_m = 0.35f; /* in the tunnel */
    picture_begin(&picture);
    picture_set(&picture, at(80, 0), &e);
    picture_end(&picture);
    const struct obstacles_found c = find_ahead(&small, 1, 0, 0, 10);
    CHECK(c.hint_m <= 0.35 && !c.any);

    e.obstacle[1] = e.obstacle[0]; /* a sure one behind it, beside the tunnel */
    e.obstacle[1].logodds = 4;
    e.obstacle[1].near_m = e.obstacle[1].range_m = 8;
    picture_begin(&picture);
    picture_set(&picture, at(80, 0), &e);
    picture_end(&picture);
    CHECK(find_ahead(&small, 1, 0, 0, 10).hint_m <= 0.35);
}

static uint64_t state;

static double uniform(double lo, double hi)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(state >> 11) * 0x1p-53;
}

/* By how much farther back than its foremost point an upright body with its margin begins at `beside_m` from the
 * line that slopes so (a sine): its cross-section there is a box. */
static double behind_front(const struct corridor_body *body, double slope, double front_m, double beside_m)
{
    const double wide = body->radius_m + body->margin_m, y = fmin(beside_m, wide);
    const double reach_m =
        sqrt(wide * wide - y * y) * sqrt(1 - slope * slope) + (body->half_height_m + body->margin_m) * fabs(slope);
    return fmax(0, front_m - reach_m);
}

/* Of a place that is y to the side, from a line that may be carried off so far. */
static double beside(double y, double carried_m)
{
    return fmax(0, fmax(y - fmax(carried_m, 0), fmin(carried_m, 0) - y));
}

/* Points of the tunnel, against what the picture holds along the ray through each. */
TEST(no_point_of_the_tunnel_is_worse_than_said)
{
    uint32_t seen_blocked = 0;
    state = 7;
    printf("seed %llu\n", (unsigned long long)state);
    for (int round = 0; round < 60; round++) {
        start();
        for (uint32_t d = 0; d < rings.n; d++) {
            const double near_m = uniform(0, 1) < 0.02 ? uniform(0.3, 12) : 0;
            set(d, near_m, 1);
        }
        const struct corridor_body body = {uniform(0, 0.8), uniform(0, 0.8), uniform(0, 0.3)};
        const double el = asin(uniform(-1, 1)), az = uniform(0, GEO_TURN);
        double a[3], side[3], up[3];
        geo_direction(az, el, a);
        geo_direction(az + GEO_PI / 2, 0, side);
        geo_direction(az, el + GEO_PI / 2, up);
        const double off[2] = {round % 2 * uniform(-1, 1), round % 2 * uniform(-1, 1)};
        double drift[3];
        for (int i = 0; i < 3; i++)
            drift[i] = off[0] * side[i] + off[1] * up[i] + uniform(-1, 1) * a[i];
        const struct obstacles_found c = find_drifting(&body, a[0], a[1], a[2], 10, drift);
        const double wide = body.radius_m + body.margin_m;
        const double high = body.half_height_m * fabs(cos(el)) + body.radius_m * fabs(sin(el)) + body.margin_m;
        const double front_m = body.half_height_m * fabs(sin(el)) + body.radius_m * fabs(cos(el)) + body.margin_m;
        for (int k = 0; k < 20000; k++) {
            const double carried = uniform(0, 1), x = uniform(0, 10);
            const double y = uniform(-wide, wide) + carried * off[0];
            const double z = uniform(-high, high) + carried * off[1];
            double v[3], p_az, p_el;
            for (int i = 0; i < 3; i++)
                v[i] = x * a[i] + y * side[i] + z * up[i];
            const double r = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
            geo_angles(v, &p_az, &p_el);
            struct picture_entry e;
            picture_get(&picture, rings_index(&rings, p_az, p_el), &e);
            const bool hit = e.obstacle[0].logodds > 0 && r > e.obstacle[0].near_m;
            const double share = e.obstacle[0].near_m / r;
            if (hit &&
                share * x + behind_front(&body, sin(el), front_m, beside(share * y, off[0])) + 1e-6 < c.near_m) {
                test_case_failed = true;
                printf("round %d: an obstacle stands nearer\n", round);
                break;
            }
        }
        seen_blocked += c.near_m < INFINITY;
    }
    CHECK(seen_blocked > 20);
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* The tunnel's axes in the grid's, in other words than the corridor's own: along, to the side, upwards. */
static void tunnel_of(const struct corridor_query *q, double axes[3][3], double drift_m[3])
{
    double body_up[3] = {0, 0, -1}, length = 0;
    memcpy(axes[0], q->direction, sizeof axes[0]);
    memcpy(drift_m, q->drift_m, sizeof q->drift_m);
    quat_rotate(now.pose.attitude, body_up, body_up);
    if (!q->ned) {
        quat_rotate(now.pose.attitude, axes[0], axes[0]);
        quat_rotate(now.pose.attitude, drift_m, drift_m);
    }
    cross(axes[0], body_up, axes[1]);
    for (int i = 0; i < 3; i++)
        length += axes[1][i] * axes[1][i];
    for (int i = 0; i < 3; i++)
        axes[1][i] /= sqrt(length);
    cross(axes[1], axes[0], axes[2]);
}

/* A vehicle that rolls and pitches, in a grid of the world's axes; every other one keeps a level row only. */
TEST(a_tilted_body_meets_all_that_stands_in_its_way)
{
    uint32_t seen_blocked = 0, seen_outside = 0;
    state = 41;
    printf("seed %llu\n", (unsigned long long)state);
    for (int round = 0; round < 120; round++) {
        const bool level = round % 2;
        start_with(level ? rings_level(&rings, geo_rad(3), geo_rad(uniform(10, 40)))
                         : rings_full(&rings, geo_rad(3)),
                   true);
        const double tilt = level ? 0.3 : 1;
        quat_from_rpy(uniform(-tilt, tilt), uniform(-tilt, tilt), uniform(0, GEO_TURN), now.pose.attitude);
        for (uint32_t d = 0; d < rings.n; d++) {
            const double near_m = uniform(0, 1) < 0.01 ? uniform(0.3, 12) : 0;
            set(d, near_m, 1);
        }
        const struct corridor_body body = {uniform(0, 0.9), uniform(0, 0.9), uniform(0, 0.2)};
        struct corridor_query q = {.body = body, .ned = round % 4 < 2, .most_m = 10, .near_m = uniform(1, 4)};
        geo_direction(uniform(0, GEO_TURN), uniform(-0.2, 0.2), q.direction);
        for (int i = 0; i < 3; i++)
            q.drift_m[i] = uniform(-0.7, 0.7);
        for (int i = 0; i < 3;
             i++) /* since the grid was centred: what is abeam or near is known by so much less */
            now.pose.position_m[i] = round % 3 ? uniform(-0.1, 0.1) : 0;
        const struct obstacles_found c = find(&q);

        double axes[3][3], drift_m[3], off[3] = {0}, slope = 0, body_up[3] = {0, 0, -1};
        tunnel_of(&q, axes, drift_m);
        quat_rotate(now.pose.attitude, body_up, body_up);
        for (int i = 0; i < 3; i++) {
            slope += axes[0][i] * body_up[i];
            for (int k = 1; k < 3; k++)
                off[k] += drift_m[i] * axes[k][i];
        }
        const double wide = body.radius_m + body.margin_m;
        const double high =
            body.half_height_m * sqrt(1 - slope * slope) + body.radius_m * fabs(slope) + body.margin_m;
        const double front_m =
            body.half_height_m * fabs(slope) + body.radius_m * sqrt(1 - slope * slope) + body.margin_m;
        for (int k = 0; k < 20000 && !test_case_failed; k++) {
            const double carried = uniform(0, 1), x = uniform(0.2, 10);
            const double at_m[3] = {x, uniform(-wide, wide) + carried * off[1],
                                    uniform(-high, high) + carried * off[2]};
            double v[3], az, el;
            for (int i = 0; i < 3; i++)
                v[i] = at_m[0] * axes[0][i] + at_m[1] * axes[1][i] + at_m[2] * axes[2][i] + now.pose.position_m[i];
            const double r = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
            const double there_m = x + behind_front(&body, slope, front_m, beside(at_m[1], off[1]));
            geo_angles(v, &az, &el);
            const uint32_t d = rings_index(&rings, az, el);
            struct picture_entry e = {0};
            if (d != RINGS_NONE)
                picture_get(&picture, d, &e);
            if (e.obstacle[0].logodds > 0 && r > (double)e.obstacle[0].near_m)
                CHECK(c.near_m <= there_m + 1e-6);
            if (d == RINGS_NONE && r > q.near_m + 0.2)
                CHECK(c.kept_m <= there_m);
        }
        seen_blocked += c.near_m < INFINITY;
        seen_outside += c.kept_m < INFINITY;
    }
    CHECK(seen_blocked > 10);
    CHECK(seen_outside > 10);
}

TEST(a_wall_blocks_who_drifts_towards_it_and_nobody_else)
{
    start();
    for (double az = 20; az <= 80; az += 3)
        set(at(az, 0), 1 / sin(geo_rad(az)), 1); /* 1 m to starboard */
    CHECK(isinf(find_ahead(&small, 1, 0, 0, 10).near_m));
    CHECK(find_drifting(&small, 1, 0, 0, 10, (const double[3]){0, 0.8, 0}).near_m < 3);
    CHECK(isinf(find_drifting(&small, 1, 0, 0, 10, (const double[3]){0, -0.8, 0}).near_m));
    CHECK(isinf(find_drifting(&small, 1, 0, 0, 10, (const double[3]){5, 0, 0}).near_m)); /* along: no matter */
}

TEST(more_drift_never_leaves_more_out)
{
    state = 23;
    printf("seed %llu\n", (unsigned long long)state);
    uint32_t less = 0;
    for (int round = 0; round < 40; round++) {
        start();
        for (uint32_t d = 0; d < rings.n; d++) {
            const double near_m = uniform(0, 1) < 0.02 ? uniform(0.3, 12) : 0;
            set(d, near_m, uniform(0, 20));
        }
        double a[3], b[3], little[3], much[3];
        geo_direction(uniform(0, GEO_TURN), asin(uniform(-1, 1)), a);
        geo_direction(uniform(0, GEO_TURN), asin(uniform(-1, 1)), b);
        for (int k = 0; k < 50; k++) {
            const double factor = uniform(0, 3), share = uniform(0, 1);
            for (int i = 0; i < 3; i++) {
                much[i] = factor * b[i];
                little[i] = share * much[i];
            }
            const struct obstacles_found with = find_drifting(&small, a[0], a[1], a[2], 10, much);
            const struct obstacles_found without = find_drifting(&small, a[0], a[1], a[2], 10, little);
            CHECK(with.near_m <= without.near_m && with.hint_m <= without.hint_m);
            less += with.near_m < without.near_m || with.hint_m < without.hint_m;
        }
    }
    CHECK(less > 50);
}

/* ---- speed ---- */

static const struct limit_conf usual = {
    .braking_mps2 = 0.3, .latency_s = 0.5, .unknown = LIMIT_SLOW, .slow_mps = 0.1};

static struct corridor water(double blocked_m, double known_m, bool known)
{
    return (struct corridor){.front_m = 0.4,
                             .blocked_m = blocked_m,
                             .known_m = known_m,
                             .reason = known ? ANSWER_HEARD : ANSWER_BEYOND};
}

TEST(speeds_by_hand)
{
    static const struct {
        const char *name;
        double blocked_m, known_m;
        bool known;
        enum limit_unknown unknown;
        double asked, stale_s, want;
        enum limit_by by;
    } cases[] = {
        {"open water", INFINITY, 10, true, LIMIT_STOP, 1, 0, 1, LIMIT_BY_NOTHING},
        {"a wall far away", 9.4, 10, true, LIMIT_STOP, 1, 0, 1, LIMIT_BY_NOTHING},
        {"a wall: v/2 + v^2/0.6 = 1", 1.4, 10, true, LIMIT_STOP, 1, 0, 0.63899, LIMIT_BY_BLOCKED},
        {"the same, a second old: 1.5 v + v^2/0.6 = 1", 1.4, 10, true, LIMIT_STOP, 1, 1, 0.44582,
         LIMIT_BY_BLOCKED},
        {"at the wall", 0.4, 10, true, LIMIT_SLOW, 1, 0, 0, LIMIT_BY_BLOCKED},
        {"unknown: stop", INFINITY, 0, false, LIMIT_STOP, 1, 0, 0, LIMIT_BY_UNKNOWN},
        {"unknown: slow", INFINITY, 0, false, LIMIT_SLOW, 1, 0, 0.1, LIMIT_BY_UNKNOWN},
        {"unknown: slow, less asked", INFINITY, 0, false, LIMIT_SLOW, 0.05, 0, 0.05, LIMIT_BY_NOTHING},
        {"unknown: ignore", INFINITY, 0, false, LIMIT_IGNORE, 1, 0, 1, LIMIT_BY_NOTHING},
        {"unknown before a wall: ignore", 1.4, 0, false, LIMIT_IGNORE, 1, 0, 0.63899, LIMIT_BY_BLOCKED},
        {"unknown, and a wall too near for slow", 0.41, 0, false, LIMIT_SLOW, 1, 0, 0.01882, LIMIT_BY_BLOCKED},
        {"nothing asked", 0, 0, false, LIMIT_STOP, 0, 0, 0, LIMIT_BY_NOTHING},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct corridor c = water(cases[i].blocked_m, cases[i].known_m, cases[i].known);
        struct limit_conf conf = usual;
        struct limit out;
        conf.unknown = cases[i].unknown;
        limit_of(&conf, &c, cases[i].asked, cases[i].stale_s, &out);
        if (fabs(out.speed_mps - cases[i].want) > 1e-4 || out.by != cases[i].by) {
            printf("%s: %.5f m/s by %s\n", cases[i].name, out.speed_mps, limit_word(out.by));
            test_case_failed = true;
        }
    }
}

TEST(it_stands_in_known_water_never_gives_more_and_is_monotone)
{
    state = 11;
    printf("seed %llu\n", (unsigned long long)state);
    for (int k = 0; k < 200000; k++) {
        const struct limit_conf conf = {uniform(0.01, 3), uniform(0, 2), (enum limit_unknown)(k % 3),
                                        uniform(0, 0.5)};
        const double stale_s = uniform(0, 3), asked = uniform(0, 3);
        struct corridor c =
            water(uniform(0, 1) < 0.2 ? INFINITY : uniform(0, 9), uniform(0, 9), uniform(0, 1) < 0.3);
        struct limit a, b;
        limit_of(&conf, &c, asked, stale_s, &a);
        CHECK(a.speed_mps >= 0 && a.speed_mps <= asked);
        CHECK((a.by == LIMIT_BY_NOTHING) == (a.speed_mps >= asked));
        const double way =
            a.speed_mps * (conf.latency_s + stale_s) + a.speed_mps * a.speed_mps / (2 * conf.braking_mps2);
        CHECK(a.speed_mps == 0 || way <= c.blocked_m - c.front_m + 1e-9);
        CHECK_NEAR(a.stop_m + a.stale_m, way, 1e-9, 1e-12);
        CHECK_NEAR(a.stale_m, a.speed_mps * stale_s, 1e-9, 0);
        CHECK_NEAR(limit_drift_m(&conf, a.speed_mps, stale_s), way, 1e-9, 1e-12);
        CHECK_NEAR(limit_reach_m(&conf, c.front_m, a.speed_mps, stale_s), c.front_m + way, 1e-9, 1e-12);
        if (conf.unknown == LIMIT_STOP && c.reason != ANSWER_HEARD)
            CHECK(a.speed_mps == 0 || way <= c.known_m - c.front_m + 1e-9);
        if (conf.unknown == LIMIT_SLOW && c.reason != ANSWER_HEARD)
            CHECK(a.speed_mps <= conf.slow_mps || way <= c.known_m - c.front_m + 1e-9);
        CHECK(a.unknown || c.reason == ANSWER_HEARD || a.speed_mps == 0 || way <= c.known_m - c.front_m + 1e-9);
        CHECK(!a.unknown || (c.reason != ANSWER_HEARD && conf.unknown != LIMIT_STOP));
        c.blocked_m += uniform(0, 1);
        c.known_m += uniform(0, 1);
        limit_of(&conf, &c, asked, stale_s, &b);
        CHECK(b.speed_mps >= a.speed_mps);
        limit_of(&conf, &c, asked, stale_s * 0.5, &a);
        CHECK(a.speed_mps >= b.speed_mps);
        /* looking no farther than the reach changes nothing */
        const double reach = limit_reach_m(&conf, c.front_m, asked, stale_s);
        struct corridor cut = c;
        if (cut.blocked_m > reach)
            cut.blocked_m = INFINITY;
        if (cut.known_m >= reach)
            cut.reason = ANSWER_HEARD;
        limit_of(&conf, &cut, asked, stale_s, &a);
        CHECK(fabs(a.speed_mps - b.speed_mps) < 1e-9);
        if (test_case_failed)
            return;
    }
}

/* Nobody has told for a while where the vehicle is: it is taken to be as near to the wall as it can be. */
TEST(what_it_may_have_moved_is_taken_off)
{
    const struct corridor_body body = {0.3, 0.3, 0};
    start_with(rings_full(&rings, geo_rad(3)), true);
    for (uint32_t d = 0; d < rings.n; d++)
        set(d, 5, 1);
    const struct obstacles_found before = find_ahead(&body, 1, 0, 0, 10);
    now.pose.uncertain_m = 1;
    const struct obstacles_found after = find_ahead(&body, 1, 0, 0, 10);
    now.pose.uncertain_m = 0;
    CHECK(before.near_m < 5 && after.near_m <= before.near_m - 1);
}

TEST(the_remedy_names_the_poses_where_they_are_what_is_missing)
{
    static const struct {
        enum limit_by by;
        enum answer_reason reason;
        enum limit_pose pose;
        const char *said;
    } row[] = {{LIMIT_BY_BLOCKED, ANSWER_HEARD, LIMIT_POSE_PLACED, "or another direction"},
               {LIMIT_BY_BLOCKED, ANSWER_HEARD, LIMIT_POSE_NONE, "or poses with a position"},
               {LIMIT_BY_UNKNOWN, ANSWER_BEYOND, LIMIT_POSE_PLACED, "no_echo"},
               {LIMIT_BY_UNKNOWN, ANSWER_BEYOND, LIMIT_POSE_NONE, "poses with a position"},
               {LIMIT_BY_UNKNOWN, ANSWER_BEYOND, LIMIT_POSE_ADRIFT, "station_keeping"},
               {LIMIT_BY_UNKNOWN, ANSWER_BLIND, LIMIT_POSE_NONE, "poses with a position"},
               {LIMIT_BY_UNKNOWN, ANSWER_NEVER, LIMIT_POSE_NONE, "poses with a position"},
               {LIMIT_BY_UNKNOWN, ANSWER_NEVER, LIMIT_POSE_PLACED, "where no sonar looks, a larger near"},
               {LIMIT_BY_UNKNOWN, ANSWER_STALE, LIMIT_POSE_NONE, "clear_for"}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++)
        CHECK(strstr(limit_remedy(row[i].by, row[i].reason, row[i].pose), row[i].said) != NULL);
    CHECK_STR(limit_remedy(LIMIT_BY_NOTHING, ANSWER_HEARD, LIMIT_POSE_NONE), "");
}

int main(void)
{
    RUN(the_remedy_names_the_poses_where_they_are_what_is_missing);
    RUN(what_stands_in_the_tunnel_blocks_and_what_stands_beside_it_does_not);
    RUN(a_vehicle_off_the_grids_centre_sweeps_its_own_tunnel);
    RUN(an_echo_that_does_not_suffice_to_block_is_no_free_water);
    RUN(a_faint_echo_near_by_is_no_free_water);
    RUN(no_point_of_the_tunnel_is_worse_than_said);
    RUN(a_tilted_body_meets_all_that_stands_in_its_way);
    RUN(a_wall_blocks_who_drifts_towards_it_and_nobody_else);
    RUN(more_drift_never_leaves_more_out);
    RUN(speeds_by_hand);
    RUN(it_stands_in_known_water_never_gives_more_and_is_monotone);
    RUN(what_it_may_have_moved_is_taken_off);
    return test_end();
}
