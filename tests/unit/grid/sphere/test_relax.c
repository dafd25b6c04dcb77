/* SPDX-License-Identifier: MIT */
/*
 * test_relax - relaxation against a slow reference that knows all cells of the grid and nothing of what changed; that
 * it adds obstacles and changes nothing else; who takes part.
 */
#include "tests/lib/sphere_rig.h"
#include "tests/lib/way_rig.h"

#include "core/fault.h"
#include "grid/ping.h"
#include "grid/sphere/view.h"

#define DIRECTIONS_MAX 2000
#define LAYERS         40

static const struct sphere_conf coarse = {.angular_step_rad = 6 * GEO_PI / 180,
                                          .layers = {.r_max_m = 6, .dr_m = 0.2, .n_const = 5, .growth = 1.035},
                                          .max_cells = 20000,
                                          .forget_s = 60,
                                          .blocked_above = 0.6,
                                          .recentre_m = 0.02};

static void start_with(double relaxation, double forget_s)
{
    struct sphere_conf conf = coarse;
    conf.relaxation = relaxation;
    conf.forget_s = forget_s;
    rig_sphere(&conf);
    now = (struct answer_now){.now_ns = 1000 * SECOND, .pose_fresh = true, .pose = pose_identity};
}

static void start(double relaxation)
{
    start_with(relaxation, coarse.forget_s);
}

/* One beam of 5 by 12 degrees; range_m 0: nothing up to free_m. */
static void ping(double az_rad, double el_rad, double range_m, double free_m)
{
    struct beam_echoes beam = {.az_rad = (float)az_rad,
                               .el_rad = (float)el_rad,
                               .blind_m = 0.3f,
                               .free_to_m = (float)free_m,
                               .state = BEAM_SILENT};
    if (range_m > 0) {
        beam.state = BEAM_ECHO;
        beam.n = 1;
        beam.echo[0] = (struct echo){
            .range_m = (float)range_m, .near_m = (float)(range_m - 0.02), .sd_m = 0.01f, .confidence = 0.9f};
        beam.free_to_m = beam.echo[0].near_m;
    }
    const struct echoes e = {.t_ns = now.now_ns,
                             .n_beams = 1,
                             .range_max_m = 8,
                             .az_aperture_rad = (float)geo_rad(5),
                             .el_aperture_rad = (float)geo_rad(12),
                             .pose = now.pose,
                             .max_beams = 1,
                             .beam = &beam};
    sphere_enter(sphere, &e, &mount_identity);
}

/* A patch of a wall somewhere, full of gaps, and a look or two past it; the vehicle moves on. */
static void random_scene(uint64_t *seed, int pings)
{
    const double az = GEO_TURN * test_uniform(seed), el = asin(2 * test_uniform(seed) - 1);
    const double range_m = 1 + 4 * test_uniform(seed);
    now.pose.has = POSE_ATTITUDE | POSE_POSITION;
    for (int i = 0; i < pings; i++) {
        const double up = el + geo_rad(40) * (test_uniform(seed) - 0.5);
        now.now_ns += SECOND / 10;
        now.pose.position_m[0] += 0.01 * test_uniform(seed);
        ping(az + geo_rad(60) * (test_uniform(seed) - 0.5), fmax(-GEO_PI / 2, fmin(up, GEO_PI / 2)),
             test_uniform(seed) < 0.7 ? range_m + 0.3 * test_uniform(seed) : 0, 6 * test_uniform(seed));
        if (test_uniform(seed) < 0.02)
            sphere_lock(sphere, (uint32_t)(test_random(seed) % sphere_picture(sphere)->n), range_m, true);
    }
}

static uint32_t direction(double az_deg)
{
    return rings_index(sphere_picture(sphere)->rings, geo_rad(az_deg), 1e-6);
}

static unsigned obstacles(const struct picture_entry *e)
{
    return (e->obstacle[0].logodds > 0 ? 1u : 0u) + (e->obstacle[1].logodds > 0 ? 1u : 0u);
}

/* ---- the reference ---- */

static struct sphere_cell cell[DIRECTIONS_MAX][LAYERS]; /* no echo: there is none */

static void read_cells(void)
{
    struct sphere_cell c;
    memset(cell, 0, sizeof cell);
    for (uint32_t d = 0; d < sphere_picture(sphere)->n; d++)
        for (uint32_t k = 0; sphere_cell(sphere, d, k, now.now_ns, &c); k++)
            cell[d][c.layer] = c;
}

/* Evidence that a neighbour gives; locked cells give none. */
static double strongest(uint32_t d, uint32_t layer)
{
    double most = 0;
    for (uint32_t l = layer ? layer - 1 : 0; l <= layer + 1 && l < LAYERS; l++)
        if (!(cell[d][l].flags & SPHERE_LOCKED))
            most = fmax(most, cell[d][l].logodds);
    return most;
}

static double relaxed(uint32_t d, uint32_t layer, double mu)
{
    const double own = cell[d][layer].logodds;
    struct rings_run run[3];
    double sum = 0, n = 0, most = 0;
    const unsigned runs = rings_touching(sphere_picture(sphere)->rings, d, run);
    for (unsigned r = 0; r < runs; r++)
        for (uint32_t k = 0; k < run[r].n; k++) {
            const uint32_t other = rings_in(&run[r], k);
            if (other == d)
                continue;
            n++;
            most = fmax(most, strongest(other, layer));
            sum += fmax(0, strongest(other, layer) - own);
        }
    const double l = own + mu * sum / n;
    CHECK(l <= fmax(own, most) * (1 + 1e-12));
    return l;
}

/* Evidence of a direction's obstacles, as many as the picture has room for: those by themselves come first. The last
 * one has that of the longest of those behind it. */
static unsigned expected(uint32_t d, double mu, double logodds[PICTURE_OBSTACLES], unsigned *added)
{
    const double blocked = (double)sphere_picture(sphere)->blocked_logodds;
    unsigned n = 0;
    double last = 0;
    for (uint32_t l = 0; l < LAYERS; l++) {
        const double own = cell[d][l].logodds, lasts = cell[d][l].flags & SPHERE_LOCKED ? (double)INFINITY : own;
        if (own <= blocked || (n == PICTURE_OBSTACLES && lasts <= last))
            continue;
        n += n < PICTURE_OBSTACLES;
        logodds[n - 1] = own;
        last = lasts;
    }
    for (uint32_t l = 0; l < LAYERS && n < PICTURE_OBSTACLES && sphere_pinged(sphere, d); l++) {
        const double own = cell[d][l].logodds, all = relaxed(d, l, mu);
        if (own <= blocked && !(cell[d][l].flags & SPHERE_LOCKED) && all > blocked) {
            logodds[n++] = all;
            ++*added;
        }
    }
    return n;
}

/* Of all directions; how many obstacles are there by their neighbours only. */
static unsigned compare(double mu)
{
    struct picture *p = sphere_picture(sphere);
    unsigned added = 0;
    read_cells();
    for (uint32_t d = 0; d < p->n; d++) {
        struct picture_entry e;
        double want[PICTURE_OBSTACLES];
        const unsigned n = expected(d, mu, want, &added);
        picture_get(p, d, &e);
        CHECK_INT(obstacles(&e), n);
        CHECK(n < 2 || e.obstacle[0].range_m <= e.obstacle[1].range_m);
        const bool turned =
            n == 2 && fabs(picture_logodds(p, &e.obstacle[0], now.now_ns) - want[0]) > 1e-5 * want[0];
        for (unsigned k = 0; k < n; k++)
            CHECK_NEAR(picture_logodds(p, &e.obstacle[k], now.now_ns), want[turned ? 1 - k : k], 1e-5, 0);
    }
    return added;
}

/* It fades, but too slowly for an obstacle to end between two looks at its direction. */
TEST(the_picture_equals_the_formula_over_all_cells)
{
    static const double mu[] = {0.05, 0.3, 0.6, 1};
    uint64_t seed = test_seed();
    unsigned added = 0;
    for (int scene = 0; scene < 24; scene++) {
        start_with(mu[scene % 4], 80000);
        for (int part = 0; part < 4; part++) {
            random_scene(&seed, 60);
            added += compare(mu[scene % 4]);
        }
    }
    printf("# obstacles by their neighbours: %u\n", added);
    CHECK(added > 1000);
}

/* ---- what it may change ---- */

struct seen {
    struct picture_entry entry;
    bool near, far, later; /* it is blocked */
};

static bool is_blocked(uint32_t d, double distance_m)
{
    struct picture *p = sphere_picture(sphere);
    struct obstacles_found found;
    struct obstacles_query q = {.line = {.ned = true, .distance_m = distance_m, .half_angle_rad = geo_rad(4)}};
    rings_centre(p->rings, d, &q.line.az_rad, &q.line.el_rad);
    find_obstacles(p, &limits, &now, &q, &found);
    return found.any && found.near_m <= distance_m;
}

static void look(struct seen seen[DIRECTIONS_MAX])
{
    for (uint32_t d = 0; d < sphere_picture(sphere)->n; d++) {
        struct seen *v = &seen[d];
        picture_get(sphere_picture(sphere), d, &v->entry);
        v->near = is_blocked(d, 2);
        v->far = is_blocked(d, 5);
        now.now_ns += 20 * SECOND;
        v->later = is_blocked(d, 5);
        now.now_ns -= 20 * SECOND;
    }
}

static bool has(const struct picture_entry *e, const struct picture_obstacle *o)
{
    return memcmp(&e->obstacle[0], o, sizeof *o) == 0 || memcmp(&e->obstacle[1], o, sizeof *o) == 0;
}

static bool faded(const struct picture_obstacle *o)
{
    const struct picture *p = sphere_picture(sphere);
    return picture_logodds(p, o, now.now_ns) <= (double)p->blocked_logodds;
}

TEST(what_is_blocked_stays_so)
{
    static struct seen plain[DIRECTIONS_MAX], with[DIRECTIONS_MAX];
    uint64_t seed = test_seed();
    unsigned anew = 0;
    for (int scene = 0; scene < 24; scene++) {
        const uint64_t from = seed + (uint64_t)scene;
        uint64_t a = from, b = from;
        start(0);
        random_scene(&a, 150);
        look(plain);
        start(test_uniform(&seed));
        random_scene(&b, 150);
        look(with);
        for (uint32_t d = 0; d < sphere_picture(sphere)->n; d++) {
            const struct picture_entry *e = &with[d].entry;
            for (unsigned k = 0; k < obstacles(&plain[d].entry); k++)
                CHECK(faded(&plain[d].entry.obstacle[k]) || has(e, &plain[d].entry.obstacle[k]));
            CHECK(obstacles(e) < 2 || e->obstacle[0].range_m <= e->obstacle[1].range_m);
            CHECK(with[d].near >= plain[d].near && with[d].far >= plain[d].far && with[d].later >= plain[d].later);
            anew += with[d].far > plain[d].far;
        }
    }
    printf("# directions blocked by their neighbours: %u\n", anew);
    CHECK(anew > 10);
}

/* ---- cases ---- */

/* Ahead and to the right nothing was heard in one direction; around it there is a wall. */
static void wall_with_gap(void)
{
    static const int el_deg[] = {-6, 0, 6};
    ping(geo_rad(3), 0, 0, 6);
    for (int k = 0; k < 3; k++) {
        ping(geo_rad(-3), geo_rad(el_deg[k]), 3, 0);
        ping(geo_rad(9), geo_rad(el_deg[k]), 3, 0);
    }
}

static struct picture_entry entry(double az_deg)
{
    struct picture_entry e;
    picture_get(sphere_picture(sphere), direction(az_deg), &e);
    return e;
}

TEST(a_gap_in_a_wall_is_blocked_until_its_sides_are_seen_through)
{
    start(0);
    wall_with_gap();
    struct picture_entry e = entry(3);
    CHECK_INT(obstacles(&e), 0);
    start(0.6);
    wall_with_gap();
    e = entry(3);
    CHECK(obstacles(&e) > 0);
    CHECK_NEAR(e.obstacle[0].range_m, 3, 0.1, 0);
    CHECK_INT(e.obstacle[0].t_echo_ns, now.now_ns);
    struct sphere_cell c;
    CHECK(!sphere_cell(sphere, direction(3), 0, now.now_ns, &c));
    for (int look = 0; look < 20; look++)
        for (int az = -9; az <= 15; az += 6)
            for (int el = -12; el <= 12; el += 6)
                ping(geo_rad(az), geo_rad(el), 0, 6);
    e = entry(3);
    CHECK_INT(obstacles(&e), 0);
}

TEST(repeated_looks_elsewhere_raise_nothing_further)
{
    start(0.6);
    wall_with_gap();
    const struct picture_entry before = entry(3);
    for (int i = 0; i < 100; i++)
        ping(geo_rad(180), 0, 4, 0);
    const struct picture_entry after = entry(3);
    CHECK(memcmp(&before, &after, sizeof after) == 0);
}

TEST(a_single_echo_does_not_block_beside_its_beam)
{
    start(0.25);
    ping(geo_rad(3), 0, 0, 6);
    ping(geo_rad(9), 0, 3, 0);
    const struct picture_entry e = entry(3);
    CHECK_INT(obstacles(&e), 0);
}

TEST(a_direction_that_was_never_pinged_holds_nothing)
{
    start(1);
    for (int el = -6; el <= 6; el += 6) {
        ping(geo_rad(-3), geo_rad(el), 3, 0);
        ping(geo_rad(9), geo_rad(el), 3, 0);
    }
    CHECK_INT(sphere_pinged(sphere, direction(3)), 0);
    const struct picture_entry e = entry(3);
    CHECK_INT(obstacles(&e), 0);
}

TEST(locked_cells_take_no_part)
{
    start(0.6);
    wall_with_gap();
    for (uint32_t d = 0; d < sphere_picture(sphere)->n; d++)
        sphere_lock(sphere, d, 3, true);
    const struct picture_entry e = entry(3);
    CHECK_INT(obstacles(&e), 0);
}

TEST(a_weak_cell_is_raised_where_it_was_heard_unless_it_is_locked)
{
    for (int locked = 0; locked < 2; locked++) {
        start(0.6);
        ping(geo_rad(3), 0, 3.05, 0);
        for (int look = 0; look < 3; look++)
            ping(geo_rad(3), 0, 0, 6);
        sphere_lock(sphere, direction(3), 3.05, locked);
        struct picture_entry e = entry(3);
        CHECK_INT(obstacles(&e), 0);
        for (int el = -6; el <= 6; el += 6) {
            ping(geo_rad(-3), geo_rad(el), 3.05, 0);
            ping(geo_rad(9), geo_rad(el), 3.05, 0);
        }
        e = entry(3);
        const bool there = e.obstacle[0].range_m == 3.05f || e.obstacle[1].range_m == 3.05f;
        CHECK_INT(there, !locked);
    }
}

TEST(it_takes_memory_only_when_asked_for_and_is_refused_out_of_range)
{
    static const double wrong[] = {-1e-9, 1.0000001, NAN, INFINITY};
    struct sphere_conf conf = coarse;
    struct fault fault;
    const size_t without = sphere_bytes(&conf, &fault);
    conf.relaxation = 1;
    CHECK(sphere_bytes(&conf, &fault) > without);
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        conf.relaxation = wrong[i];
        CHECK_INT(sphere_bytes(&conf, &fault), 0);
        CHECK(strstr(fault.text, "wanted 0 to 1"));
    }
}

int main(void)
{
    RUN(the_picture_equals_the_formula_over_all_cells);
    RUN(what_is_blocked_stays_so);
    RUN(a_gap_in_a_wall_is_blocked_until_its_sides_are_seen_through);
    RUN(repeated_looks_elsewhere_raise_nothing_further);
    RUN(a_single_echo_does_not_block_beside_its_beam);
    RUN(a_direction_that_was_never_pinged_holds_nothing);
    RUN(locked_cells_take_no_part);
    RUN(a_weak_cell_is_raised_where_it_was_heard_unless_it_is_locked);
    RUN(it_takes_memory_only_when_asked_for_and_is_refused_out_of_range);
    return test_end();
}
