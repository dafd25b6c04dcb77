/* SPDX-License-Identifier: MIT */
/*
 * report_shapes - walls and corners of rectangular basins drawn at random, heard, extracted, marked and entered as
 * shipped, while the vehicle stands or yaws to and fro: how many are found, and what is found that is none.
 *
 *   report_shapes [quick]   CSV: vehicle, compass_deg, seeds (one basin each), walls, walls_found, walls_false,
 *                           corners_found, corners_false, all_four_walls, all_four_corners (of so many basins)
 *
 * found: a wall within 8 degrees of its normal and 10 cm + 2 % of its distance, a corner within 20 cm + 3 % of its
 * range; false: anything else, and what is found twice. compass_deg: standard deviation of the heading of each ping.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/range/extract.h"
#include "grid/range/marks.h"
#include "grid/sphere/shapes.h"
#include "grid/sphere/sphere.h"
#include "report/lib/basin_grid.h"
#include "tests/water/dice.h"
#include "tests/sound/sea.h"
#include "tests/water/places.h"

#define SEEDS     60
#define TURNS     2
#define BEAMS     400 /* of a turn */
#define PING_S    0.05
#define YAW_RAD   (25 * GEO_PI / 180)
#define YAW_S     8.0  /* to and fro */
#define REACH_M   11.5 /* of the head at its usual bins; for larger basins they grow */
#define CLEAR_M   0.8  /* of the vehicle to the nearest wall */
#define SIDES     4
#define GRID_TO_M 30.0

/* Walls stand at distance_m[k] in direction k * 90 degrees; corners lie between k and k + 1. */
struct tank {
    double distance_m[SIDES], heading_rad, bins;
    struct place place;
};

struct tally {
    unsigned walls, walls_false, corners, corners_false, all_walls, all_corners;
};

static void draw_tank(struct tank *tank, unsigned seed)
{
    tank->place = place_tank(seed, CLEAR_M, &tank->heading_rad);
    const double *p = tank->place.shape[0].p, d[SIDES] = {p[1], p[3], -p[0], -p[2]};
    memcpy(tank->distance_m, d, sizeof d);
    tank->bins = fmax(1, hypot(fmax(d[0], d[2]), fmax(d[1], d[3])) / REACH_M);
}

/* What a tank is heard with. */
struct rig {
    struct extract *extract;
    struct marks marks;
    struct sphere *grid;
};

static void start(struct rig *rig)
{
    struct sphere_conf conf = basin_grid_conf(NULL);
    struct extract_conf extract;
    struct fault fault = {"no memory"};
    void *memory = malloc(extract_size(SEA_MAX_BINS));
    conf.layers.r_max_m = GRID_TO_M;
    extract_defaults(&extract);
    rig->extract = memory ? extract_init(memory, &extract, SEA_MAX_BINS, &fault) : NULL;
    if (!rig->extract) {
        fprintf(stderr, "report_shapes: %s\n", fault.text);
        exit(1);
    }
    marks_init(&rig->marks, 1500.0);
    rig->grid = basin_grid(&conf);
}

static uint64_t hear(struct rig *rig, const struct tank *tank, unsigned seed, bool yaws, double compass_rad)
{
    static const struct sea_sound sound = {.surface_db = -6, .rays_az = 5, .rays_el = 21};
    static struct sea_ping sea;
    uint64_t t_ns = 0;
    for (unsigned i = 0; i < TURNS * BEAMS; i++) {
        struct dice dice = dice_of(seed, 1000 + i);
        struct beam_echoes beam;
        struct echoes e = {.max_beams = 1, .beam = &beam};
        const double yaw_rad = tank->heading_rad + (yaws ? YAW_RAD * sin(GEO_TURN * i * PING_S / YAW_S) : 0),
                     compass_heading_rad = yaw_rad + compass_rad * dice_gauss(&dice);
        sea_turn(&sound, &tank->place, yaw_rad, tank->bins, i, &dice, &sea);
        sea.ping.t_ns = t_ns = (uint64_t)((i + 1) * PING_S * 1e9);
        quat_from_rpy(0, 0, compass_heading_rad, sea.ping.pose.attitude);
        extract_run(rig->extract, &sea.ping, NULL, &e);
        marks_run(&rig->marks, &e);
        sphere_enter(rig->grid, &e, &mount_identity);
    }
    return t_ns;
}

/* Counts a thing that is one of four, or none (k < 0); returns how many of the four were found so far. */
static unsigned count(int k, bool found[SIDES], unsigned *right, unsigned *wrong)
{
    const bool first = k >= 0 && !found[k];
    unsigned n = 0;
    if (first)
        found[k] = true;
    ++*(first ? right : wrong);
    for (int i = 0; i < SIDES; i++)
        n += found[i];
    return n;
}

static int wall_at(const struct tank *tank, const struct wall *w)
{
    const int k = (int)lround(w->normal_rad / (GEO_PI / 2)) % SIDES;
    return fabs(geo_wrap_pi(w->normal_rad - k * GEO_PI / 2)) < geo_rad(8) &&
                   fabs(w->distance_m - tank->distance_m[k]) < 0.1 + 0.02 * tank->distance_m[k]
               ? k
               : -1;
}

static int corner_at(const struct tank *tank, const struct tangent_point *p)
{
    const double *d = tank->distance_m, x = p->x_m < 0 ? -d[2] : d[0], y = p->y_m < 0 ? -d[3] : d[1];
    return hypot(p->x_m - x, p->y_m - y) < 0.2 + 0.03 * hypot(x, y) ? (p->x_m < 0) + 2 * (p->y_m < 0) : -1;
}

static void tally_shapes(const struct tank *tank, const struct shapes *shapes, struct tally *t)
{
    bool wall[SIDES] = {false}, corner[SIDES] = {false};
    unsigned walls = 0, corners = 0;
    for (uint32_t k = 0; k < shapes->n; k++)
        walls = count(wall_at(tank, &shapes->wall[k]), wall, &t->walls, &t->walls_false);
    for (uint32_t k = 0; k < shapes->corners; k++)
        corners = count(corner_at(tank, &shapes->corner[k].place), corner, &t->corners, &t->corners_false);
    t->all_walls += walls == SIDES;
    t->all_corners += corners == SIDES;
}

static void row(bool yaws, double compass_deg, unsigned seeds)
{
    static struct shapes shapes;
    struct tally t = {0};
    for (unsigned seed = 1; seed <= seeds; seed++) {
        struct tank tank;
        struct rig rig;
        draw_tank(&tank, seed);
        start(&rig);
        const uint64_t t_ns = hear(&rig, &tank, seed, yaws, geo_rad(compass_deg));
        shapes_look(&shapes, sphere_picture(rig.grid), t_ns);
        tally_shapes(&tank, &shapes, &t);
        free(rig.extract);
        free(rig.grid);
    }
    printf("%s,%g,%u,%u,%u,%u,%u,%u,%u,%u\n", yaws ? "yaws by 25 degrees" : "stands", compass_deg, seeds,
           SIDES * seeds, t.walls, t.walls_false, t.corners, t.corners_false, t.all_walls, t.all_corners);
}

int main(int argc, char **argv)
{
    const bool quick = argc > 1 && strcmp(argv[1], "quick") == 0;
    printf("vehicle,compass_deg,seeds,walls,walls_found,walls_false,corners_found,corners_false,all_four_walls,"
           "all_four_corners\n");
    for (int yaws = 0; yaws < 2; yaws++)
        for (int compass_deg = 0; compass_deg < 2; compass_deg++)
            row(yaws, compass_deg, quick ? 6 : SEEDS);
    return 0;
}
