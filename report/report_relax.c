/* SPDX-License-Identifier: MIT */
/*
 * report_relax - what `relaxation` of the spherical grid does (grid/sphere/relax.h): to the obstacles in made-up
 * basins, whose surfaces are known, and to a wall that is heard only now and then.
 *
 *   report_relax basin [quick]   CSV: mu, seeds, heard, heard_false, anew, anew_false, anew_false_low, anew_false_high
 *   report_relax wall [quick]    CSV: mu, seeds, turns, missed, clear, missed_low, missed_high, false_block, unknown
 *
 * basin: heard are the obstacles of the picture without the step, anew those that it adds; *_false: the share with no
 * surface in their layer, anywhere across their direction, or within 15 cm. wall: a wall ahead that a beam hears in 60
 * % of its looks, and beside its ends a post; a look that hears nothing says that the water is free. missed: the share
 * of directions towards wall and post that are not blocked, and of these all the share that is even called clear;
 * false_block, unknown: of the directions that hold nothing, those that are.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "grid/ping.h"
#include "grid/sphere/view.h"
#include "report/lib/asked.h"
#include "report/lib/basin.h"
#include "report/lib/basin_grid.h"
#include "report/lib/cost.h"
#include "tests/water/dice.h"

#define SEEDS      6
#define WALL_SEEDS 12
#define EDGE_M     0.15
#define ACROSS     4 /* places across a cell's width at which a surface is looked for */

static const double mu[] = {0, 0.1, 0.25, 0.5, 1};
#define MUS (sizeof mu / sizeof mu[0])

static struct sphere *grid_of(double relaxation)
{
    struct sphere_conf conf = basin_grid_conf(NULL);
    conf.relaxation = relaxation;
    return basin_grid(&conf);
}

/* ---- basins ---- */

struct tally {
    unsigned heard, heard_false, anew, anew_false;
};

static void drive(const struct basin *basin, struct sphere *grid)
{
    struct beam_echoes heard;
    struct echoes e = {.beam = &heard};
    for (unsigned i = 0; i < BASIN_TURNS * BASIN_BEAMS; i++) {
        basin_listen(basin, i / BASIN_BEAMS, i % BASIN_BEAMS, false, &e);
        sphere_enter(grid, &e, &mount_identity);
    }
}

/* The basin is alike at all depths: a direction's range over the ground is what counts. */
static bool has_surface(const struct basin *basin, const double place[2], const struct rings *rings, uint32_t d,
                        double range_m)
{
    struct layers layers;
    static double edge[LAYERS_MAX + 1];
    double az_rad, el_rad;
    const struct sphere_conf shipped = basin_grid_conf(NULL);
    layers_init(&layers, &shipped.layers, edge);
    const int32_t layer = layers_index(&layers, range_m);
    if (layer < 0)
        return false;
    rings_centre(rings, d, &az_rad, &el_rad);
    const double width_rad = rings_width(rings, rings_ring(rings, d));
    for (int k = -ACROSS; k <= ACROSS; k++) {
        const double surface_m =
            basin_range(basin, place, az_rad + width_rad * k / (2 * ACROSS), NULL) / cos(el_rad);
        if (surface_m >= edge[layer] - EDGE_M && surface_m <= edge[layer + 1] + EDGE_M)
            return true;
    }
    return false;
}

static bool holds(const struct picture_entry *e, float range_m)
{
    for (int k = 0; k < PICTURE_OBSTACLES; k++)
        if (e->obstacle[k].logodds > 0 && e->obstacle[k].range_m == range_m)
            return true;
    return false;
}

static void compare(unsigned seed, double relaxation, struct tally *t)
{
    struct basin basin;
    struct picture_entry plain, relaxed;
    double centre_m[3];
    struct sphere *grid[2] = {grid_of(0), grid_of(relaxation)};
    basin_make(&basin, seed);
    for (int i = 0; i < 2; i++)
        drive(&basin, grid[i]);
    const struct rings *rings = sphere_picture(grid[0])->rings;
    sphere_centre(grid[0], centre_m);
    for (uint32_t d = 0; d < rings->n; d++) {
        picture_get(sphere_picture(grid[0]), d, &plain);
        picture_get(sphere_picture(grid[1]), d, &relaxed);
        for (int k = 0; k < PICTURE_OBSTACLES && relaxed.obstacle[k].logodds > 0; k++) {
            const float range_m = relaxed.obstacle[k].range_m;
            const bool heard = holds(&plain, range_m),
                       is_false = !has_surface(&basin, centre_m, rings, d, (double)range_m);
            t->heard += heard;
            t->heard_false += heard && is_false;
            t->anew += !heard;
            t->anew_false += !heard && is_false;
        }
    }
    free(grid[0]);
    free(grid[1]);
}

static void basins(unsigned seeds)
{
    printf("mu,seeds,heard,heard_false,anew,anew_false,anew_false_low,anew_false_high\n");
    for (size_t m = 1; m < MUS; m++) {
        struct tally all = {0};
        double share[SEEDS];
        for (unsigned seed = 0; seed < seeds; seed++) {
            struct tally t = {0};
            compare(seed + 1, mu[m], &t);
            share[seed] = t.anew_false / fmax(t.anew, 1);
            all.heard += t.heard;
            all.heard_false += t.heard_false;
            all.anew += t.anew;
            all.anew_false += t.anew_false;
        }
        cost_sort(share, seeds);
        printf("%g,%u,%u,%.3g,%u,%.3g,%.3g,%.3g\n", mu[m], seeds, all.heard, all.heard_false / fmax(all.heard, 1),
               all.anew, all.anew_false / fmax(all.anew, 1), share[0], share[seeds - 1]);
    }
}

/* ---- a wall that is heard now and then ---- */

#define WALL_M      4.0
#define WALL_HALF_M 3.0
#define POST_X_M    1.087073263 /* 3 m away at 1.2 rad */
#define POST_Y_M    2.796117258
#define POST_RADIUS 0.1
#define DETECTION   0.6
#define LISTEN_M    8.0
#define TURNS       4
#define BEAMS       180
#define TURN_S      10.0
#define HALF_BEAM   (GEO_PI / 180)
#define MARGIN_RAD  (GEO_PI / 180) /* half of a direction */

static const struct place wall_and_post = {
    .shape = {{.kind = PLACE_BOX, .p = {WALL_M, WALL_M, -WALL_HALF_M, WALL_HALF_M, -INFINITY, INFINITY}},
              {.kind = PLACE_TUBE, .p = {POST_X_M, POST_Y_M, POST_RADIUS, -INFINITY, INFINITY}}}};

/* The nearest of them within half_rad of an azimuth; infinite: nothing is there. */
static double wall_near(double az_rad, double half_rad)
{
    return place_nearest(&wall_and_post, (const double[3]){0}, &(struct place_fan){az_rad, 0, half_rad, 0, 17, 1},
                         0);
}

static uint64_t wall_turn(struct sphere *grid, struct store *store, unsigned seed, unsigned turn)
{
    struct beam_echoes h;
    struct echoes e = {.beam = &h, .n_beams = 1, .max_beams = 1, .pose = pose_identity};
    struct dice dice = dice_of(seed, turn);
    const double first = dice_uniform(&dice);
    for (unsigned i = 0; i < BEAMS; i++) {
        const double az_rad = GEO_TURN * (first + i) / BEAMS, near_m = wall_near(az_rad, HALF_BEAM);
        h = (struct beam_echoes){
            .az_rad = (float)az_rad, .blind_m = 0.5f, .free_to_m = (float)LISTEN_M, .state = BEAM_SILENT};
        if (isfinite(near_m) && dice_uniform(&dice) < DETECTION) {
            const double range_m = near_m + 0.02 * dice_gauss(&dice);
            h.n = 1;
            h.state = BEAM_ECHO;
            h.echo[0] = (struct echo){.range_m = (float)range_m,
                                      .near_m = (float)(range_m - 0.02),
                                      .sd_m = 0.02f,
                                      .strength = 10,
                                      .confidence = 0.9f};
            h.free_to_m = h.echo[0].near_m;
        }
        e.t_ns = (uint64_t)((1000 + TURN_S * (turn + (double)i / BEAMS)) * 1e9);
        e.seq = turn * BEAMS + i;
        e.flags = i == 0 ? PING_NEW_TURN : 0;
        e.range_max_m = (float)LISTEN_M;
        e.az_aperture_rad = (float)(2 * HALF_BEAM);
        e.el_aperture_rad = (float)geo_rad(20);
        sphere_enter(grid, &e, &mount_identity);
        store_enter(store, &e, &mount_identity);
    }
    return e.t_ns;
}

struct misses {
    unsigned held, missed, clear, empty, false_block, unknown;
};

/* Every direction on the horizon, by itself. */
static void ask_wall(struct sphere *grid, const struct store *store, uint64_t t_ns, struct misses *m)
{
    const struct asking asking = {.picture = sphere_picture(grid),
                                  .limits = {.clear_for_s = 30, .move_limit_m = 0.5},
                                  .now = {.now_ns = t_ns, .pose_fresh = true, .pose = pose_identity},
                                  .near_m = asked_near_m()};
    const struct rings *rings = sphere_picture(grid)->rings;
    const uint32_t ring = rings_ring(rings, rings_index(rings, 0, 1e-6));
    for (uint32_t d = rings->start[ring]; d < rings->start[ring + 1]; d++) {
        struct obstacles_query q = {.line = {.distance_m = 7, .half_angle_rad = 1e-6}};
        struct answer a;
        rings_centre(rings, d, &q.line.az_rad, &q.line.el_rad);
        asked_of_store(&asking, store, &q, &a);
        if (isfinite(wall_near(q.line.az_rad, 0))) {
            m->held++;
            m->missed += a.state != ANSWER_BLOCKED;
            m->clear += a.state == ANSWER_CLEAR;
        } else if (isinf(wall_near(q.line.az_rad, HALF_BEAM + MARGIN_RAD))) {
            m->empty++;
            m->false_block += a.state == ANSWER_BLOCKED;
            m->unknown += a.state == ANSWER_UNKNOWN;
        }
    }
}

static void walls(unsigned seeds)
{
    printf("mu,seeds,turns,missed,clear,missed_low,missed_high,false_block,unknown\n");
    for (size_t m = 0; m < MUS; m++) {
        struct misses all[TURNS];
        double share[TURNS][WALL_SEEDS];
        memset(all, 0, sizeof all);
        for (unsigned seed = 0; seed < seeds; seed++) {
            struct sphere *grid = grid_of(mu[m]);
            struct store *store = asked_store();
            for (unsigned turn = 0; turn < TURNS; turn++) {
                struct misses *a = &all[turn];
                const unsigned held = a->held, missed = a->missed;
                ask_wall(grid, store, wall_turn(grid, store, seed + 1, turn), a);
                share[turn][seed] = (a->missed - missed) / fmax(a->held - held, 1);
            }
            free(grid);
            free(store);
        }
        for (unsigned turn = 0; turn < TURNS; turn++) {
            const struct misses *a = &all[turn];
            cost_sort(share[turn], seeds);
            printf("%g,%u,%u,%.3g,%.3g,%.3g,%.3g,%.3g,%.3g\n", mu[m], seeds, turn + 1,
                   a->missed / fmax(a->held, 1), a->clear / fmax(a->held, 1), share[turn][0],
                   share[turn][seeds - 1], a->false_block / fmax(a->empty, 1), a->unknown / fmax(a->empty, 1));
        }
    }
}

int main(int argc, char **argv)
{
    const bool quick = argc > 2 && argv[2][0] == 'q';
    if (argc > 1 && strcmp(argv[1], "basin") == 0)
        basins(quick ? 1 : SEEDS);
    else if (argc > 1 && strcmp(argv[1], "wall") == 0)
        walls(quick ? 2 : WALL_SEEDS);
    else
        fprintf(stderr, "report_relax: wanted basin or wall\n");
    return argc > 1 ? 0 : 1;
}
