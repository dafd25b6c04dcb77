/* SPDX-License-Identifier: MIT */
/* test_next_look - which direction is ranked first, and why, on pictures made by hand. */
#include "tests/lib/test.h"

#include "grid/answer/next_look.h"
#include "grid/geometry.h"
#include "tests/lib/ranking.h"

#define SECOND 1000000000ull
#define NOW    (1000 * SECOND)

static struct rings rings;
static struct picture picture;
static double axis[4096][3];
static struct next_look_conf conf;
static struct next_look look[NEXT_LOOK_MAX];

static void start(bool level)
{
    static void *word;
    CHECK(level ? rings_level(&rings, geo_rad(3), geo_rad(7.5)) : rings_full(&rings, geo_rad(5)));
    free(word);
    word = aligned_alloc(64, (picture_bytes(rings.n) + 63) / 64 * 64);
    for (uint32_t d = 0; d < rings.n; d++) {
        double az, el;
        rings_centre(&rings, d, &az, &el);
        geo_direction(az, el, axis[d]);
    }
    picture_init(&picture, &rings, (const double(*)[3])axis, 60, 0.4, word);
    conf = (struct next_look_conf){
        .stale_s = 30, .low_rad = -geo_rad(5), .high_rad = geo_rad(5), .apart_rad = geo_rad(10)};
}

/* Every direction was looked at so long ago, but for the one at az_deg. */
static void looked(double age_s, double az_deg, double other_age_s)
{
    picture_begin(&picture);
    for (uint32_t d = 0; d < rings.n; d++) {
        const bool other = d == rings_index(&rings, geo_rad(az_deg), 0);
        struct picture_entry e = {0};
        e.t_look_ns = NOW - (uint64_t)((other ? other_age_s : age_s) * 1e9);
        picture_set(&picture, d, &e);
    }
    picture_end(&picture);
}

TEST(what_was_never_looked_at_comes_first_and_ahead_of_all)
{
    start(true);
    conf.velocity_mps[1] = 0.5;
    CHECK_INT(rank_looks(&picture, NOW, &conf, look, 4), 4);
    CHECK_NEAR(look[0].az_rad, geo_rad(90), 0, geo_rad(3));
    CHECK_INT(look[0].why, LOOK_NEVER);
    CHECK_NEAR(look[0].score, 3, 0.01, 0);
    CHECK(look[0].age_s < 0);
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < i; k++)
            CHECK(fabs(geo_wrap_pi(look[i].az_rad - look[k].az_rad)) >= geo_rad(10) * (1 - 1e-9));
}

TEST(a_sector_ahead_comes_first_and_a_direction_that_no_look_reaches_does_not_draw_all)
{
    double az = -1;
    start(false);
    conf.velocity_mps[0] = 0.5;
    CHECK(next_look_sector(&picture, NOW, &conf, NULL, geo_rad(40), &az));
    CHECK_NEAR(geo_wrap_pi(az), 0, 0, geo_rad(5.1));
    looked(6, 180, 1000); /* 6 s of 30 s three times ahead, and astern one that counts in full */
    CHECK(next_look_sector(&picture, NOW, &conf, NULL, geo_rad(40), &az));
    CHECK_NEAR(geo_wrap_pi(az), 0, 0, geo_rad(5.1));
    CHECK_INT(rank_looks(&picture, NOW, &conf, look, 1), 1);
    CHECK_NEAR(look[0].az_rad, geo_rad(180), 0, geo_rad(5)); /* as one direction it is the first */
    looked(0, 180, 0);
    CHECK(!next_look_sector(&picture, NOW, &conf, NULL, geo_rad(40), &az));
}

TEST(the_stalest_comes_first_when_nothing_moves)
{
    start(true);
    looked(3, 222, 12);
    CHECK_INT(rank_looks(&picture, NOW, &conf, look, 1), 1);
    CHECK_INT(rings_index(&rings, look[0].az_rad, 0), rings_index(&rings, geo_rad(222), 0));
    CHECK_INT(look[0].why, LOOK_STALE);
    CHECK_NEAR(look[0].age_s, 12, 1e-9, 0);
    CHECK_NEAR(look[0].score, 0.4, 1e-9, 0);
}

TEST(what_comes_nearer_or_grows_is_looked_at_wherever_it_is)
{
    start(true);
    looked(3, 222, 12);
    struct cluster k = {.from_rad = geo_rad(350), .width_rad = geo_rad(20), .low_rad = -1, .high_rad = 1};
    conf.clusters = &k;
    conf.n_clusters = 1;
    k.approach_mps = 0.08;
    CHECK_INT(rank_looks(&picture, NOW, &conf, look, 1), 1);
    CHECK(fabs(geo_wrap_pi(look[0].az_rad)) <= geo_rad(10));
    CHECK_INT(look[0].why, LOOK_APPROACHING);
    k.approach_mps = -0.08; /* it goes away */
    k.growth_directions_ps = 9;
    rank_looks(&picture, NOW, &conf, look, 1);
    CHECK_INT(look[0].why, LOOK_GROWING);
    k.growth_directions_ps = 0;
    rank_looks(&picture, NOW, &conf, look, 1);
    CHECK_INT(look[0].why, LOOK_STALE);
}

TEST(the_edges_of_a_cluster_and_what_vanished_count_twice_their_age)
{
    start(true);
    looked(6, 222, 11);
    struct cluster k = {.from_rad = geo_rad(350), .width_rad = geo_rad(20), .low_rad = -1, .high_rad = 1};
    conf.clusters = &k;
    conf.n_clusters = 1;
    CHECK_INT(rank_looks(&picture, NOW, &conf, look, 3), 3);
    for (int i = 0; i < 2; i++) { /* 12 s of 30 at both edges, 11 s at 222 degrees, 6 s inside */
        CHECK_INT(look[i].why, LOOK_EDGE);
        CHECK_NEAR(look[i].score, 0.4, 1e-9, 0);
        CHECK_NEAR(fabs(geo_wrap_pi(look[i].az_rad)), geo_rad(10), 0, geo_rad(3));
    }
    CHECK_INT(look[2].why, LOOK_STALE);
    k.low_rad = 0.5; /* not at these elevations */
    rank_looks(&picture, NOW, &conf, look, 1);
    CHECK_INT(look[0].why, LOOK_STALE);
    struct cluster_gone gone = {.place_m = {0, -7, 0}, .t_gone_ns = NOW - 29 * SECOND};
    conf.gone = &gone;
    conf.n_gone = 1;
    rank_looks(&picture, NOW, &conf, look, 1);
    CHECK_INT(look[0].why, LOOK_VANISHED);
    CHECK_NEAR(look[0].az_rad, geo_rad(270), 0, geo_rad(5));
    CHECK_NEAR(look[0].age_s, 6, 1e-9, 0);
    gone.t_gone_ns = NOW - 31 * SECOND; /* the vehicle has moved on since */
    rank_looks(&picture, NOW, &conf, look, 1);
    CHECK_INT(look[0].why, LOOK_STALE);
    gone = (struct cluster_gone){.t_gone_ns = NOW}; /* at the centre it is in no direction */
    rank_looks(&picture, NOW, &conf, look, 1);
    CHECK_INT(look[0].why, LOOK_STALE);
}

/* All was looked at then; between the azimuths something stands at range_m, elsewhere at else_m; 0: nothing. */
static void standing(uint64_t t_ns, double from_deg, double to_deg, double range_m, double else_m)
{
    picture_begin(&picture);
    for (uint32_t d = 0; d < rings.n; d++) {
        double az, el;
        struct picture_entry e = {0};
        rings_centre(&rings, d, &az, &el);
        const double r = geo_deg(az) > from_deg && geo_deg(az) < to_deg ? range_m : else_m;
        e.t_look_ns = t_ns;
        if (r > 0)
            e.obstacle[0] = (struct picture_obstacle){
                .t_ref_ns = NOW, .t_echo_ns = NOW, .logodds = 3, .near_m = (float)r, .range_m = (float)r};
        picture_set(&picture, d, &e);
    }
    picture_end(&picture);
}

static double sector_deg(uint64_t now_ns, struct next_look_features *features)
{
    double az = -1;
    CHECK(next_look_sector(&picture, now_ns, &conf, features, geo_rad(40), &az));
    return geo_deg(az);
}

TEST(a_sector_of_features_comes_first)
{
    struct next_look_features f = {.known = {false}};
    start(true);
    standing(NOW - 10 * SECOND, 200, 220, 5, 0);
    const double plain = sector_deg(NOW, NULL);
    CHECK(fabs(plain - 210) > 30);
    CHECK_NEAR(sector_deg(NOW, &f), 210, 0, 15); /* both edges in 40 degrees */
    standing(NOW - 10 * SECOND, 0, 0, 0, 0);
    CHECK_NEAR(sector_deg(NOW, NULL), plain, 0, 0);
    CHECK_NEAR(sector_deg(NOW, &f), 210, 0, 15); /* it has vanished */
    standing(NOW + 20 * SECOND, 0, 0, 0, 0);
    CHECK_NEAR(sector_deg(NOW + 29 * SECOND, &f), 210, 0, 15);
    CHECK(fabs(sector_deg(NOW + 31 * SECOND, &f) - 210) > 30); /* that is long ago */
}

/* A wall all around, part of which comes 1.6 m nearer: too little for an edge at 10 m. */
TEST(what_is_not_stationary_is_a_feature)
{
    struct next_look_features f = {.known = {false}};
    start(true);
    standing(NOW - 10 * SECOND, 0, 0, 0, 10);
    const double plain = sector_deg(NOW, &f);
    CHECK(fabs(plain - 120) > 30);
    standing(NOW - 10 * SECOND, 105, 135, 9.2, 10);
    CHECK_NEAR(sector_deg(NOW, &f), plain, 0, 0); /* within what a vehicle that moves makes of it */
    standing(NOW - 10 * SECOND, 105, 135, 8.4, 10);
    CHECK_NEAR(sector_deg(NOW, &f), 120, 0, 10);
}

TEST(only_the_wanted_elevations)
{
    start(false);
    conf.low_rad = geo_rad(20);
    conf.high_rad = geo_rad(40);
    const uint32_t n = rank_looks(&picture, NOW, &conf, look, NEXT_LOOK_MAX);
    CHECK(n > 10);
    for (uint32_t i = 0; i < n; i++)
        CHECK(look[i].el_rad >= geo_rad(20) && look[i].el_rad <= geo_rad(40));
    CHECK_NEAR(look[0].el_rad, geo_rad(30), 0, geo_rad(2.51));
    conf.low_rad = 2;
    conf.high_rad = 3;
    CHECK_INT(rank_looks(&picture, NOW, &conf, look, NEXT_LOOK_MAX), 0);
}

TEST(nothing_is_worth_a_look_right_after_one)
{
    start(true);
    looked(0, 0, 0);
    CHECK_INT(rank_looks(&picture, NOW, &conf, look, 5), 0);
}

/* Clusters that cross one another all over a fine sphere. */
static void many_clusters(struct cluster *clusters, uint32_t n)
{
    uint64_t state = 7;
    for (uint32_t i = 0; i < n; i++)
        clusters[i] = (struct cluster){.label = i + 1,
                                       .from_rad = GEO_TURN * test_uniform(&state),
                                       .width_rad = GEO_TURN * test_uniform(&state),
                                       .low_rad = -GEO_PI / 2,
                                       .high_rad = GEO_PI / 2,
                                       .approach_mps = 0.02 * test_uniform(&state)};
}

TEST(no_step_is_long_and_the_best_of_all_are_found)
{
    static struct cluster clusters[CLUSTERS_MAX];
    static struct next_look_score score[RANKING_DIRECTIONS];
    unsigned steps = 0;
    start(false);
    looked(12, 0, 12);
    many_clusters(clusters, CLUSTERS_MAX);
    conf.clusters = clusters;
    conf.n_clusters = CLUSTERS_MAX;
    conf.low_rad = -GEO_PI / 2;
    conf.high_rad = GEO_PI / 2;
    conf.apart_rad = 0;
    next_look_begin(&ranking, NOW, &conf, score, NEXT_LOOK_MAX);
    for (bool more = true; more; steps++) {
        more = next_look_step(&ranking, &picture);
        CHECK(ranking.work <= NEXT_LOOK_STEP + 3 * CLUSTERS_MAX);
    }
    CHECK(steps > NEXT_LOOK_MAX);
    CHECK_INT(ranking.n, NEXT_LOOK_MAX);
    for (uint32_t i = 1; i < ranking.n; i++)
        CHECK(ranking.look[i - 1].score >= ranking.look[i].score);
    for (uint32_t d = 0; d < rings.n; d++) /* those that are left are no better */
        CHECK(score[d].score <= ranking.look[ranking.n - 1].score);
    for (uint32_t i = 0; i < ranking.n; i++) /* no direction is named twice */
        for (uint32_t k = 0; k < i; k++)
            CHECK(ranking.look[i].az_rad != ranking.look[k].az_rad ||
                  ranking.look[i].el_rad != ranking.look[k].el_rad);
}

int main(void)
{
    RUN(no_step_is_long_and_the_best_of_all_are_found);
    RUN(what_was_never_looked_at_comes_first_and_ahead_of_all);
    RUN(a_sector_ahead_comes_first_and_a_direction_that_no_look_reaches_does_not_draw_all);
    RUN(the_stalest_comes_first_when_nothing_moves);
    RUN(what_comes_nearer_or_grows_is_looked_at_wherever_it_is);
    RUN(the_edges_of_a_cluster_and_what_vanished_count_twice_their_age);
    RUN(a_sector_of_features_comes_first);
    RUN(what_is_not_stationary_is_a_feature);
    RUN(only_the_wanted_elevations);
    RUN(nothing_is_worth_a_look_right_after_one);
    return test_end();
}
