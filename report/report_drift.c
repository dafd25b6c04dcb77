/* SPDX-License-Identifier: MIT */
/*
 * report_drift - submap length where poses drift: a dive down the virtual dam shaft by a position that wanders off,
 * then the base poses of all submaps put right, as a client with a better position does it (map_move). Short submaps
 * have less drift in each, and more of them overlap, are resampled and merged.
 *
 *   report_drift [quick]   CSV: submap_m, default, corrected, submaps, false_free_m3, false_free_low, false_free_high,
 *                          behind_max_m, to_truth_mean_m, to_truth_p95_m, to_truth_max_m, to_map_mean_m, to_map_p95_m,
 *                          to_map_max_m, not_common_share, not_common_low, not_common_high, mbytes, ns_enter, ns_merge
 *
 * Medians of the seeds, volumes also the least and the most, what ends in max the most. to_truth: from the map's
 * frontier, where something was heard, to the nearest true surface; to_map: from where the map without drift has free
 * water beside a true surface to this map's frontier. not_common: of what this map or the one without drift has free,
 * the share that only one has. mbytes: of the tiles in use. ns_enter: per ping; ns_merge: per voxel asked.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/voxel/merge.h"
#include "report/lib/chart.h"
#include "report/lib/cost.h"
#include "tests/water/dice.h"
#include "report/lib/dive.h"
#include "report/lib/knob.h"
#include "report/lib/surface.h"

#define SEEDS       8
#define TURNS       107 /* 0.3 m a turn */
#define QUICK_TURNS 6
#define VOXEL_M     0.2
#define MAP_BASE    "[map]\nvoxel = 0.2 m\nbody = 0.5 m\n"
#define DRIFT_M     0.5  /* standard deviation north and east at the end of the way */
#define ERROR_M     0.05 /* of ranges */
#define TILES_BYTES 1e8  /* every map touches all of its memory */

#define NOT_CORRECTED "base poses not corrected"
#define WHOLE_M       "1000 m" /* one for all the way */

static const struct knob settings[] = {
    KNOB_KEY("map", "submap_distance", "2 m"),
    KNOB_KEY("map", "submap_distance", "5 m"),
    KNOB_KEY("map", "submap_distance", NULL),
    KNOB_KEY("map", "submap_distance", "20 m"),
    KNOB_KEY("map", "submap_distance", WHOLE_M),
    {.name = "uncorrected", .label = "as shipped", .beside = NOT_CORRECTED},
};
#define SETTINGS (sizeof settings / sizeof settings[0])

struct outcome {
    double false_m3, behind_m, not_common, mbytes, ns_enter, ns_merge;
    struct surface_spread to_truth, to_map;
    unsigned submaps;
};

/* Of the world's part that is looked at, in order of its cells: what the map says, and of the one without drift the
 * free ones and those of its frontier that lie at a true surface. */
enum { FREE = 1, HEARD = 2 };
static struct lattice_box frame;
static uint8_t *cells, *free_cells, *at_surface, *frontier;
static double *apart_m;

static void *room(size_t n)
{
    void *p = calloc(1, n);
    if (!p) {
        fprintf(stderr, "report_drift: no memory\n");
        exit(1);
    }
    return p;
}

static struct voxmap *make(const struct knob *knob, double way_m)
{
    struct voxmap *m = room(sizeof *m);
    struct conf conf;
    knob_conf(knob, &conf);
    const struct chart_setting shipped = chart_setting_of(&conf);
    const double path_m = fmin(conf.map.submap_distance_m, way_m);
    const uint32_t levels = (uint32_t)ceil(2 * (path_m + DIVE_RANGE_M / 2) / VOXEL_M);
    struct voxmap_setting set = {.voxel_m = VOXEL_M,
                                 .side = voxmap_side(DIVE_RANGE_M, 2, VOXEL_M),
                                 .height = (levels + 63) / 64 * 64,
                                 .max_submaps = 64,
                                 .keep_echoes = shipped.echoes,
                                 .rule = shipped.rule,
                                 .opening = shipped.opening,
                                 .weight_levels = (uint8_t)conf.map.weight_levels,
                                 .body_radius_m = shipped.body_m,
                                 .submap_path_m = conf.map.submap_distance_m,
                                 .submap_ns = VOXMAP_NEVER,
                                 .half_life_ns = VOXMAP_NEVER};
    struct fault fault;

    set.n_tiles = (uint32_t)(TILES_BYTES / (set.height * 2.0 * TILE_SIDE * TILE_SIDE));
    const size_t bytes = voxmap_bytes(&set, &fault);
    if (!bytes) {
        fprintf(stderr, "report_drift: %s\n", fault.text);
        exit(1);
    }
    voxmap_init(m, &set, room(bytes));
    return m;
}

/* How far off the position is, north and east, when `share` of the way is done: a random walk of equal steps. */
static void wander(double drift[2], size_t n, struct dice *dice)
{
    for (int a = 0; a < 2; a++)
        drift[a] += DRIFT_M / sqrt((double)n) * dice_gauss(dice);
}

static void enter(struct voxmap *m, const struct dive_look *look, const double drift[2], double path_m,
                  double error_m)
{
    const double first_m = fmax(0.1, look->first_m + error_m);
    const bool echo = look->first_m < DIVE_RANGE_M;
    struct beam_echoes beam = {.free_to_m = (float)first_m, .state = BEAM_SILENT};
    const struct echoes e = {
        .t_ns = 1 + (uint64_t)(look->t_s * 1e9),
        .n_beams = 1,
        .range_max_m = (float)DIVE_RANGE_M,
        .az_aperture_rad = (float)geo_rad(DIVE_AZ_DEG),
        .el_aperture_rad = (float)geo_rad(DIVE_EL_DEG),
        .pose = {.t_ns = 1 + (uint64_t)(look->t_s * 1e9),
                 .has = POSE_POSITION | POSE_DEPTH | POSE_ATTITUDE,
                 .position_m = {look->at[0] + drift[0], look->at[1] + drift[1], look->at[2]},
                 .attitude = {look->attitude[0], look->attitude[1], look->attitude[2], look->attitude[3]},
                 .path_m = path_m},
        .max_beams = 1,
        .beam = &beam};
    const struct voxmap_sensor sensor = {.mount = mount_identity, .shape = CAST_WEDGE};
    if (echo) {
        beam.state = BEAM_ECHO;
        beam.n = 1;
        beam.echo[0] = (struct echo){.range_m = (float)first_m, .near_m = (float)first_m, .sd_m = (float)ERROR_M};
    }
    voxmap_enter(m, &e, &sensor);
}

/* A whole dive; when it is corrected, each submap's base is put where it truly was. */
static double dive_through(struct voxmap *m, const struct dive *dive, unsigned seed, bool drifts, bool corrected)
{
    static double off[VOXMAP_MAX_SUBMAPS + 1][2]; /* by id: the drift as it was started */
    struct dice dice = dice_of(seed, 21);
    double drift[2] = {0, 0};
    uint64_t newest = 0;
    const double way_m = dive->world->to[2] - dive->world->from[2], begin_ns = cost_now_ns();
    for (size_t i = 0; i < dive->n; i++) {
        const double error_m = ERROR_M * dice_gauss(&dice);
        if (drifts)
            wander(drift, dive->n, &dice);
        enter(m, &dive->look[i], drift, way_m * (double)i / (double)dive->n, error_m);
        if (m->current && m->current->id != newest) {
            newest = m->current->id;
            memcpy(off[newest], drift, sizeof drift);
        }
    }
    const double ns = (cost_now_ns() - begin_ns) / (double)dive->n;
    for (uint64_t id = 1; corrected && id <= newest; id++) {
        const struct voxmap_part *part = voxmap_part(m, id);
        double base_m[3];
        for (int a = 0; a < 3; a++)
            base_m[a] = ((double)part->base.cell[a] + part->base.offset[a]) * VOXEL_M - (a < 2 ? off[id][a] : 0);
        voxmap_move(m, id, base_m, pose_identity.attitude);
    }
    return ns;
}

#define EACH_CELL(cell)                                                                                           \
    for (int64_t cell[3] = {frame.first[0]}; cell[0] < frame.first[0] + frame.size[0]; cell[0]++)                 \
        for (cell[1] = frame.first[1]; cell[1] < frame.first[1] + frame.size[1]; cell[1]++)                       \
            for (cell[2] = frame.first[2]; cell[2] < frame.first[2] + frame.size[2]; cell[2]++)

static size_t cells_n(void)
{
    return (size_t)frame.size[0] * (size_t)frame.size[1] * (size_t)frame.size[2];
}

static double clearance(const struct place *world, const int64_t cell[3])
{
    const double at[3] = {((double)cell[0] + 0.5) * VOXEL_M, ((double)cell[1] + 0.5) * VOXEL_M,
                          ((double)cell[2] + 0.5) * VOXEL_M};
    return place_clearance(world, at, NULL, 0);
}

static void keep_block(const struct merge_block *block, const struct block_key *key)
{
    for (int n = 0; n < BLOCK_COLUMNS * BLOCK_HEIGHT; n++) {
        const int column = n / BLOCK_HEIGHT, k = n % BLOCK_HEIGHT;
        const int64_t cell[3] = {key->at[0] * BLOCK_SIDE + column / BLOCK_SIDE,
                                 key->at[1] * BLOCK_SIDE + column % BLOCK_SIDE, key->at[2] * BLOCK_HEIGHT + k};
        if (lattice_holds(&frame, cell))
            cells[surface_index(&frame, cell)] =
                (uint8_t)((block->free[column] >> k & 1 ? FREE : 0) | (block->heard[column] >> k & 1 ? HEARD : 0));
    }
}

/* All that the map says, and what saying it took. */
static double read_map(const struct voxmap *m)
{
    const int64_t last[3] = {frame.first[0] + frame.size[0] - 1, frame.first[1] + frame.size[1] - 1,
                             frame.first[2] + frame.size[2] - 1};
    const struct block_key from = merge_block_of(frame.first), to = merge_block_of(last);
    struct block_key key;
    double blocks = 0, ns = 0;
    for (key.at[0] = from.at[0]; key.at[0] <= to.at[0]; key.at[0]++)
        for (key.at[1] = from.at[1]; key.at[1] <= to.at[1]; key.at[1]++)
            for (key.at[2] = from.at[2]; key.at[2] <= to.at[2]; key.at[2]++, blocks++) {
                struct merge_block block;
                const double begin_ns = cost_now_ns();
                merge_block(m, &key, &block);
                ns += cost_now_ns() - begin_ns;
                keep_block(&block, &key);
            }
    return ns / (blocks * BLOCK_COLUMNS * BLOCK_HEIGHT);
}

/* What the 27 cells around one say, all together and in common; beyond the frame nothing is known, and nothing said. */
static void said_around(const int64_t cell[3], uint8_t *any, uint8_t *all)
{
    *any = 0;
    *all = FREE | HEARD;
    for (int n = 0; n < 27; n++) {
        const int64_t next[3] = {cell[0] + n / 9 - 1, cell[1] + n / 3 % 3 - 1, cell[2] + n % 3 - 1};
        if (!lattice_holds(&frame, next))
            continue;
        *any |= cells[surface_index(&frame, next)];
        *all &= cells[surface_index(&frame, next)];
    }
}

static void grade_volume(const struct place *world, struct outcome *out)
{
    double wrong = 0, both = 0, either = 0;
    EACH_CELL(cell)
    {
        const size_t i = surface_index(&frame, cell);
        const bool is_free = cells[i] & FREE;
        const double clear_m = is_free ? clearance(world, cell) : 1;
        both += is_free && free_cells[i];
        either += is_free || free_cells[i];
        wrong += clear_m <= 0;
        out->behind_m = fmax(out->behind_m, -clear_m);
    }
    out->false_m3 = wrong * VOXEL_M * VOXEL_M * VOXEL_M;
    out->not_common = either > 0 ? 1 - both / either : 0;
}

static void grade_surface(const struct place *world, struct outcome *out)
{
    size_t n = 0;
    uint8_t any, all;
    EACH_CELL(cell)
    {
        const size_t i = surface_index(&frame, cell);
        frontier[i] = 0;
        if (!(cells[i] & FREE))
            continue;
        said_around(cell, &any, &all);
        frontier[i] = !(all & FREE);
        if (frontier[i] && (any & HEARD))
            apart_m[n++] = fabs(clearance(world, cell));
    }
    out->to_truth = surface_spread_of(apart_m, n);
    n = 0;
    EACH_CELL(cell)
    {
        const struct lattice_place centre = {{cell[0], cell[1], cell[2]}, {0.5, 0.5, 0.5}};
        if (at_surface[surface_index(&frame, cell)])
            apart_m[n++] = surface_to_marked(&frame, frontier, VOXEL_M, &centre);
    }
    out->to_map = surface_spread_of(apart_m, n);
}

/* The map that was read last is the one without drift. */
static void keep_reference(const struct place *world)
{
    uint8_t any, all;
    EACH_CELL(cell)
    {
        const size_t i = surface_index(&frame, cell);
        said_around(cell, &any, &all);
        free_cells[i] = cells[i] & FREE;
        at_surface[i] = free_cells[i] && !(all & FREE) && clearance(world, cell) < VOXEL_M;
    }
}

static void run(const struct dive *dive, unsigned seed, const struct knob *s, bool drifts, struct outcome *out)
{
    struct voxmap *m = make(s, dive->world->to[2] - dive->world->from[2]);
    *out = (struct outcome){0};
    out->ns_enter = dive_through(m, dive, seed, drifts, drifts && !s->beside);
    if (m->stats.lost > 0 || m->stats.starved > 0) {
        fprintf(stderr, "report_drift: too little memory for the map\n");
        exit(1);
    }
    out->ns_merge = read_map(m);
    if (!drifts)
        keep_reference(dive->world);
    grade_volume(dive->world, out);
    grade_surface(dive->world, out);
    out->submaps = (unsigned)(m->next_id - 1);
    for (uint64_t id = 1; id < m->next_id; id++)
        out->mbytes += voxmap_part(m, id)->map.n_tiles * (double)m->tiles.tile_bytes * 1e-6;
    free(m->part);
    free(m);
}

static void frame_world(const struct place *world)
{
    for (int a = 0; a < 3; a++) {
        frame.first[a] = (int64_t)floor(world->low[a] / VOXEL_M);
        frame.size[a] = (int32_t)((int64_t)ceil(world->high[a] / VOXEL_M) - frame.first[a]);
    }
    cells = room(cells_n());
    free_cells = room(cells_n());
    at_surface = room(cells_n());
    frontier = room(cells_n());
    apart_m = room(cells_n() * sizeof *apart_m);
}

static void print_outcome(const struct knob *knob, unsigned seed, const struct outcome *o)
{
    struct conf conf;
    knob_conf(knob, &conf);
    knob_print(knob);
    printf(",all,%u,%g,%s,%u,%.4g,%.3g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g\n", seed,
           conf.map.submap_distance_m, knob->beside ? "no" : "yes", o->submaps, o->false_m3, o->behind_m,
           o->to_truth.mean_m, o->to_truth.p95_m, o->to_truth.max_m, o->to_map.mean_m, o->to_map.p95_m,
           o->to_map.max_m, o->not_common, o->mbytes, o->ns_enter, o->ns_merge);
}

int main(int argc, char **argv)
{
    const bool quick = argc > 1 && strcmp(argv[1], "quick") == 0;
    const struct knob whole = KNOB_KEY("map", "submap_distance", WHOLE_M);
    knob_base(MAP_BASE);
    knob_check(settings, SETTINGS);
    struct dive *dive = dive_make(place_named("shaft"), quick ? QUICK_TURNS : TURNS, false, 0, DIVE_TRUTH);
    frame_world(dive->world);
    printf(KNOB_COLUMNS ",scene,seed,submap_m,corrected,submaps,false_free_m3,behind_max_m,to_truth_mean_m,"
                        "to_truth_p95_m,to_truth_max_m,to_map_mean_m,to_map_p95_m,to_map_max_m,not_common_share,"
                        "mbytes,ns_enter,ns_merge\n");
    for (unsigned seed = 1; seed <= (quick ? 1 : SEEDS); seed++) {
        struct outcome out;
        run(dive, seed, &whole, false, &out);
        for (size_t s = 0; s < SETTINGS; s++) {
            run(dive, seed, &settings[s], true, &out);
            print_outcome(&settings[s], seed, &out);
        }
    }
    dive_free(dive);
    return 0;
}
