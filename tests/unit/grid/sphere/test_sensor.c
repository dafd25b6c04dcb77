/* SPDX-License-Identifier: MIT */
/*
 * test_sensor - beams look at few directions. What they carve is held against the same ping's silent beams looking at
 * all, and others at cells however near, the same bit for bit, whatever the head's place, its beams, the way it goes
 * and the model; which directions were looked at, against every direction worked out one by one. That echoes reach
 * every cell that their beam touches is test_beam's: there are cells that only nearly are in the beam.
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
static bool looked_at[MAX_DIRECTIONS];
static int looked;

/* max_cells is never reached. */
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

/* So far from the axis a direction may be to count as looked at: half a beam, or half a cell. */
static double half_rad(double beam_rad, double cell_rad)
{
    return fmin(fmax(beam_rad / 2, cell_rad / 2), 1.45);
}

/* Is the direction's middle in one of the beams, as from the grid's centre? */
static bool is_looked_at(const struct echoes *e, const double turn[4], uint32_t d)
{
    const uint32_t ring = rings_ring(&grid->rings, d);
    const double wide = rings_width(&grid->rings, ring) * grid->rings.cos_el[ring];
    for (uint16_t i = 0; i < e->n_beams; i++) {
        double u[3], level[4], tilt[4], to[4], az, el;
        quat_from_rpy(0, 0, (double)e->beam[i].az_rad, level);
        quat_from_rpy(0, (double)e->beam[i].el_rad, 0, tilt);
        quat_multiply(level, tilt, to);
        quat_multiply(turn, to, to);
        quat_rotate_inverse(to, grid->axis[d], u); /* along the axis, to the side and down */
        az = atan2(u[1], u[0]);
        el = atan2(-u[2], u[0]);
        if (u[0] > 0 && fabs(az) <= half_rad((double)e->az_aperture_rad, wide) &&
            fabs(el) <= half_rad((double)e->el_aperture_rad, grid->rings.height_rad))
            return true;
    }
    return false;
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
    uint32_t other_looks = 0, other_cells = 0, nearer = 0;
    struct sphere_cell first;
    const double reach_rad = grid->reach_rad;
    memcpy(before, memory, bytes);
    for (uint32_t d = 0; d < grid->rings.n; d++)
        looked_at[d] = is_looked_at(e, turn, d);
    sensor_enter(grid, e, turn, origin_m);
    for (uint32_t d = 0; d < grid->rings.n; d++) {
        other_looks += looked_at[d] != (grid->direction[d].t_look_ns == e->t_ns);
        looked += looked_at[d];
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
    CHECK_INT(other_looks, 0);
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

TEST(beams_carve_and_look_at_what_they_would_if_they_looked_everywhere)
{
    uint64_t seed = test_seed();
    for (int i = 0; i < 24; i++) {
        start((enum sphere_model)(i % 3), i % 8 == 7, i % 2 ? 3 : 5);
        run(40, i % 4 * 0.3 * test_uniform(&seed), i % 4 == 1 ? 0 : 0.2 * test_uniform(&seed), i % 5 > 0, &seed);
    }
    CHECK(looked > 10000);
    printf("# %d directions looked at\n", looked);
}

int main(void)
{
    RUN(beams_carve_and_look_at_what_they_would_if_they_looked_everywhere);
    return test_end();
}
