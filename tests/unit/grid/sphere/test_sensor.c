/* SPDX-License-Identifier: MIT */
/*
 * test_sensor - beams look at few directions. What they carve is held against the same ping's silent beams looking at
 * all, and others at cells however near; their claims against those of every direction worked out one by one. They are
 * the same bit for bit, whatever the head's place, its beams, the way it goes and the model. That echoes reach every
 * cell that their beam touches is test_beam's: there are cells that only nearly are in the beam.
 */
#include "tests/lib/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/sphere/beam.h"
#include "grid/sphere/motion.h"
#include "grid/sphere/sensor.h"
#include "grid/sphere/sphere.h"
#include "grid/sphere/state.h"
#include "grid/sphere/view.h"

#define BEAMS          4
#define MAX_DIRECTIONS 8000

static struct sphere *grid;
static void *memory, *before; /* the grid's; as it was */
static size_t bytes;
static uint64_t cells[MAX_DIRECTIONS];
static struct free_interval claims[MAX_DIRECTIONS][FREE_INTERVALS];
static bool free_to_differ[MAX_DIRECTIONS];
static uint64_t deaf_ns[MAX_DIRECTIONS];
static int claimed;

/* max_cells is never reached: with each cell that it gives up, a full grid takes the claims of its direction back. */
static void start(enum sphere_model model, bool level, double step_deg)
{
    const struct sphere_conf conf = {.angular_step_rad = geo_rad(step_deg),
                                     .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                     .max_cells = 60000,
                                     .forget_s = 160,
                                     .blocked_above = 0.6,
                                     .recentre_m = 0.01,
                                     .model = model,
                                     .range_error = 0.003,
                                     .level = level,
                                     .level_half_rad = geo_rad(12)};
    struct fault fault;
    bytes = sphere_bytes(&conf, &fault);
    free(memory);
    free(before);
    memory = aligned_alloc(64, (bytes + 63) / 64 * 64);
    before = malloc(bytes);
    grid = sphere_init(memory, &conf);
    CHECK(grid->rings.n <= MAX_DIRECTIONS);
}

/* One in ten hears nothing usable. */
static struct beam_echoes beam_at_random(uint64_t *seed, bool blind, bool hears)
{
    const double range_m = 0.04 + 12 * pow(test_uniform(seed), 2);
    struct beam_echoes b = {.az_rad = (float)(GEO_TURN * test_uniform(seed)),
                            .el_rad = (float)(2 * (test_uniform(seed) - 0.5)),
                            .blind_m = (float)(blind ? 0.1 + 0.4 * test_uniform(seed) : 0),
                            .free_to_m = test_uniform(seed) < 0.1 ? 0 : (float)(range_m - 0.02),
                            .n = hears};
    b.echo[0] = (struct echo){
        .range_m = (float)range_m, .near_m = (float)range_m - 0.02f, .sd_m = 0.01f, .confidence = 0.9f};
    return b;
}

/* All beams of this ping hear nothing usable, as all of the last one. */
static bool is_deaf_again(const struct echoes *e)
{
    bool deaf = grid->deaf_sensors >> e->sensor & 1;
    for (uint16_t i = 0; i < e->n_beams; i++)
        deaf = deaf && e->beam[i].free_to_m <= e->beam[i].blind_m;
    return deaf;
}

/* What a beam says of the water in a direction. What a side of the beam ends within 0.1 m may be left unsaid. */
static void clear_one(const struct beam *b, uint32_t d)
{
    const struct echoes *e = b->ping;
    const struct beam_echoes *h = b->heard;
    const struct beam_cell *cell = &grid->ring[rings_ring(&grid->rings, d)];
    const struct beam_ray ray = beam_ray(b, grid->axis[d]);
    const bool frees = h->free_to_m > h->blind_m;
    const struct free_ping by = {e->t_ns, e->pose.path_m, e->sensor};
    const double from_m = frees ? h->blind_m : 0, to_m = frees ? h->free_to_m : e->range_max_m;
    struct beam_water water = beam_water_alike(from_m, to_m), farther = water;
    struct stretch st, beyond;
    if (frees && h->off_axis)
        water = (struct beam_water){from_m, to_m, h->side_to_m, h->edge_from_m, h->edge_to_m, true};
    farther.from_m = fmax(from_m, 0.1);
    if (!beam_stretch(b, cell, &ray, &water, &st))
        return;
    st.ends_at_echo = h->n > 0;
    free_to_differ[d] |= st.leaves_aside && !beam_stretch(b, cell, &ray, &farther, &beyond);
    const bool alone = (!deaf_ns[d] || deaf_ns[d] == e->t_ns) && !is_deaf_again(e);
    const bool forgiven = !frees && claims[d][0].t_ping_ns && alone;
    deaf_ns[d] = frees || is_deaf_again(e) ? 0 : e->t_ns;
    if (frees)
        free_add(claims[d], &st, &by);
    else if (!forgiven)
        free_withdraw(claims[d], &by);
    claimed++;
}

/* The claims of every direction after this ping, to be. */
static void foresee(const struct echoes *e, const double turn[4], const double origin_m[3])
{
    const struct beam_opening own =
        beam_opening(e->az_aperture_rad, e->el_aperture_rad, grid->rings.height_rad, grid->conf.level);
    memset(free_to_differ, 0, sizeof free_to_differ);
    for (uint32_t d = 0; d < grid->rings.n; d++) {
        memcpy(claims[d], grid->direction[d].free, sizeof claims[d]);
        deaf_ns[d] = grid->direction[d].deaf_ns;
    }
    for (uint16_t i = 0; i < e->n_beams; i++) {
        struct beam b;
        beam_of(&b, e, i, &own, turn, origin_m);
        for (uint32_t d = 0; d < grid->rings.n; d++)
            clear_one(&b, d);
    }
}

/* FNV-1a of all that a direction's cells say. */
static uint64_t cells_of(uint32_t d, uint64_t t_ns)
{
    uint64_t hash = 14695981039346656037u;
    struct sphere_cell c;
    for (uint32_t k = 0; memset(&c, 0, sizeof c), sphere_cell(grid, d, k, t_ns, &c); k++)
        for (size_t i = 0; i < sizeof c; i++)
            hash = (hash ^ ((const unsigned char *)&c)[i]) * 1099511628211u;
    return hash;
}

/* Enters a ping, and once more as beams would that look at all directions (silent ones) or at cells however near. */
static void enter(const struct echoes *e, const double turn[4], const double origin_m[3], bool blind)
{
    uint32_t other_claims = 0, other_cells = 0, nearer = 0;
    struct sphere_cell first;
    const double reach_rad = grid->reach_rad;
    foresee(e, turn, origin_m);
    memcpy(before, memory, bytes);
    sensor_enter(grid, e, turn, origin_m);
    for (uint32_t d = 0; d < grid->rings.n; d++) {
        other_claims += !free_to_differ[d] && memcmp(claims[d], grid->direction[d].free, sizeof claims[d]) != 0;
        cells[d] = cells_of(d, e->t_ns);
        nearer += sphere_cell(grid, d, 0, e->t_ns, &first) && first.from_m < grid->nearest_m;
    }
    memcpy(memory, before, bytes);
    grid->nearest_m = 0;
    grid->reach_rad = e->beam[0].n ? reach_rad : 2 * GEO_TURN; /* with so much slack every direction passes */
    sensor_enter(grid, e, turn, origin_m);
    for (uint32_t d = 0; d < grid->rings.n; d++)
        other_cells += blind && cells[d] != cells_of(d, e->t_ns);
    CHECK_INT(nearer, 0);
    CHECK_INT(other_claims, 0);
    CHECK_INT(other_cells, 0);
    memcpy(memory, before, bytes);
    sensor_enter(grid, e, turn, origin_m);
}

/*
 * The head hangs within lever_m of the centre, which follows it on its way. Cells that come within 0.1 m of it may be
 * carved or not: only heads blind to that are held to theirs.
 */
static void run(int pings, double lever_m, double way_m, bool blind, uint64_t *seed)
{
    struct beam_echoes beams[BEAMS];
    struct echoes e = {.n_beams = BEAMS, .range_max_m = 20, .pose = pose_identity, .beam = beams};
    struct sphere_stats stats;
    for (int i = 0; i < pings; i++) {
        double turn[4], origin_m[3];
        for (int k = 0; k < BEAMS; k++)
            beams[k] = beam_at_random(seed, blind, i % 2 == 0);
        e.t_ns += 10000000;
        e.seq++;
        e.az_aperture_rad = (float)(test_uniform(seed) < 0.05 ? 6 : geo_rad(1 + 40 * pow(test_uniform(seed), 2)));
        e.el_aperture_rad = (float)geo_rad(1 + 40 * pow(test_uniform(seed), 2));
        for (int k = 0; k < 3; k++)
            e.pose.position_m[k] += way_m * (test_uniform(seed) - 0.5);
        motion_follow(grid, &e.pose, e.t_ns);
        geo_direction(6 * test_uniform(seed), 3 * test_uniform(seed) - 1.5, origin_m);
        for (int k = 0; k < 3; k++)
            origin_m[k] = lever_m * origin_m[k] + e.pose.position_m[k] - grid->frame.centre_m[k];
        quat_from_rpy(6 * test_uniform(seed), 3 * test_uniform(seed) - 1.5, 6 * test_uniform(seed), turn);
        enter(&e, turn, origin_m, blind);
    }
    sphere_stats(grid, &stats);
    CHECK(stats.cells > 10 && stats.cells_lost == 0);
}

TEST(beams_clear_and_carve_what_they_would_if_they_looked_everywhere)
{
    uint64_t seed = test_seed();
    for (int i = 0; i < 24; i++) {
        start((enum sphere_model)(i % 3), i % 8 == 7, i % 2 ? 3 : 5);
        run(40, i % 4 * 0.3 * test_uniform(&seed), i % 4 == 1 ? 0 : 0.2 * test_uniform(&seed), i % 5 > 0, &seed);
    }
    CHECK(claimed > 10000);
    printf("# %d claims\n", claimed);
}

int main(void)
{
    RUN(beams_clear_and_carve_what_they_would_if_they_looked_everywhere);
    return test_end();
}
