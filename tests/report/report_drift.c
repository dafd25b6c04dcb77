/* SPDX-License-Identifier: MIT */
/*
 * report_drift - submap length where poses drift: a dive down the virtual dam shaft by a position that wanders off, then the
 * base poses of all submaps put right, as a client with a better position does it (map_move). Short submaps have less drift in
 * each, and more of them overlap, are resampled and merged.
 *
 *   report_drift [quick]   CSV: submap_m, default, corrected, submaps, false_free_m3, false_free_low, false_free_high,
 *                          behind_max_m, not_common_share, not_common_low, not_common_high, mbytes, ns_enter, ns_merge
 *
 * Volumes: medians, least and most of the seeds. not_common: of what this map or the one without drift has free, the share that
 * only one has. mbytes: of the tiles in use. ns_enter: per ping; ns_merge: per voxel asked.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../grid/voxel/merge.h"
#include "lib/cost.h"
#include "lib/dice.h"
#include "lib/dive.h"

#define SEEDS       5
#define TURNS       107 /* 0.3 m a turn */
#define QUICK_TURNS 6
#define VOXEL_M     0.2
#define DRIFT_M     0.5  /* standard deviation north and east at the end of the way */
#define ERROR_M     0.05 /* of ranges */
#define BODY_M      0.5
#define TILES_BYTES 3e8

static const struct setting {
    double submap_m; /* INFINITY: one for all the way */
    bool shipped, corrected;
} settings[] = {{2, false, true},  {5, false, true},        {10, true, true},
                {20, false, true}, {INFINITY, false, true}, {10, false, false}};
#define SETTINGS (sizeof settings / sizeof settings[0])

struct outcome {
    double false_m3, behind_m, not_common, mbytes, ns_enter, ns_merge;
    unsigned submaps;
};

/* Free voxels of the world's part that is looked at, by number; 0 or 1. */
static uint8_t *free_cells;
static int64_t first[3], size[3];

static void *room(size_t n)
{
    void *p = calloc(1, n);

    if (!p) {
        fprintf(stderr, "report_drift: no memory\n");
        exit(1);
    }
    return p;
}

static struct voxmap *make(double submap_m, double way_m)
{
    struct voxmap *m = room(sizeof *m);
    const double path_m = fmin(submap_m, way_m);
    const uint32_t levels = (uint32_t)ceil(2 * (path_m + DIVE_RANGE_M / 2) / VOXEL_M);
    struct voxmap_setting set = {.voxel_m = VOXEL_M,
                                 .side = voxmap_side(DIVE_RANGE_M, 2, VOXEL_M),
                                 .height = (levels + 63) / 64 * 64,
                                 .max_submaps = 64,
                                 .keep_echoes = true,
                                 .rule = {.threshold = 1, .echo_weight = 2},
                                 .opening = 0.5,
                                 .weight_levels = 1,
                                 .body_radius_m = BODY_M,
                                 .submap_path_m = submap_m,
                                 .submap_ns = VOXMAP_NEVER,
                                 .half_life_ns = VOXMAP_NEVER};
    char err[200];

    set.n_tiles = (uint32_t)(TILES_BYTES / (set.height * 2.0 * TILE_SIDE * TILE_SIDE));
    const size_t bytes = voxmap_bytes(&set, err, sizeof err);
    if (!bytes) {
        fprintf(stderr, "report_drift: %s\n", err);
        exit(1);
    }
    voxmap_init(m, &set, room(bytes));
    return m;
}

/* How far off the position is, north and east, when `share` of the way is done: a random walk of equal steps. */
static void wander(double drift[2], size_t n, struct dice *dice)
{
    for (int a = 0; a < 2; a++)
        drift[a] += DRIFT_M / sqrt((double)n) * sqrt(2) * creal(dice_normal(dice));
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
    static double off[VOXMAP_MAX_SUBMAPS + 1][2]; /* by id: the drift as it was begun */
    struct dice dice = dice_of(seed, 21);
    double drift[2] = {0, 0};
    uint64_t newest = 0;

    const double way_m = dive->world->to[2] - dive->world->from[2], begin_ns = cost_now_ns();
    for (size_t i = 0; i < dive->n; i++) {
        const double error_m = ERROR_M * sqrt(2) * creal(dice_normal(&dice));
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

/* Of one block's voxels: what is free, here and without drift; keep: this is the map without. */
struct counts {
    double wrong, both, either;
};

static void grade_block(const struct merge_block *block, const struct block_key *key, const struct world *world,
                        bool keep, struct counts *n, double *behind_m)
{
    int64_t low[3], high[3], cell[3];

    for (int a = 0; a < 3; a++) {
        const int64_t side = a < 2 ? BLOCK_SIDE : BLOCK_HEIGHT;
        low[a] = key->at[a] * side > first[a] ? key->at[a] * side : first[a];
        high[a] = (key->at[a] + 1) * side < first[a] + size[a] ? (key->at[a] + 1) * side : first[a] + size[a];
    }
    for (cell[0] = low[0]; cell[0] < high[0]; cell[0]++)
        for (cell[1] = low[1]; cell[1] < high[1]; cell[1]++)
            for (cell[2] = low[2]; cell[2] < high[2]; cell[2]++) {
                uint8_t *known = &free_cells[((cell[0] - first[0]) * size[1] + cell[1] - first[1]) * size[2] +
                                             cell[2] - first[2]];
                const bool is_free = merge_block_at(block, cell) == VOXEL_FREE;
                const double at[3] = {((double)cell[0] + 0.5) * VOXEL_M, ((double)cell[1] + 0.5) * VOXEL_M,
                                      ((double)cell[2] + 0.5) * VOXEL_M};
                if (keep)
                    *known = is_free;
                n->both += is_free && *known;
                n->either += is_free || *known;
                const double clear_m = is_free ? world_clearance(world, at, 0) : 1;
                n->wrong += clear_m <= 0;
                *behind_m = fmax(*behind_m, -clear_m);
            }
}

static void grade(const struct voxmap *m, const struct world *world, bool keep, struct outcome *out)
{
    struct counts n = {0};
    struct block_key key, from, to;
    const int64_t last[3] = {first[0] + size[0] - 1, first[1] + size[1] - 1, first[2] + size[2] - 1};
    double blocks = 0, ns = 0;

    from = merge_block_of(first);
    to = merge_block_of(last);
    for (key.at[0] = from.at[0]; key.at[0] <= to.at[0]; key.at[0]++)
        for (key.at[1] = from.at[1]; key.at[1] <= to.at[1]; key.at[1]++)
            for (key.at[2] = from.at[2]; key.at[2] <= to.at[2]; key.at[2]++, blocks++) {
                struct merge_block block;
                const double begin_ns = cost_now_ns();
                merge_block(m, &key, &block);
                ns += cost_now_ns() - begin_ns;
                grade_block(&block, &key, world, keep, &n, &out->behind_m);
            }
    out->ns_merge = ns / (blocks * BLOCK_COLUMNS * BLOCK_HEIGHT);
    out->false_m3 = n.wrong * VOXEL_M * VOXEL_M * VOXEL_M;
    out->not_common = n.either > 0 ? 1 - n.both / n.either : 0;
}

static void run(const struct dive *dive, unsigned seed, const struct setting *s, bool drifts, struct outcome *out)
{
    struct voxmap *m = make(s->submap_m, dive->world->to[2] - dive->world->from[2]);

    *out = (struct outcome){0};
    out->ns_enter = dive_through(m, dive, seed, drifts, drifts && s->corrected);
    grade(m, dive->world, !drifts, out);
    out->submaps = (unsigned)(m->next_id - 1);
    for (uint64_t id = 1; id < m->next_id; id++)
        out->mbytes += voxmap_part(m, id)->map.n_tiles * (double)m->tiles.tile_bytes * 1e-6;
    free(m->part);
    free(m);
}

static void frame(const struct world *world)
{
    for (int a = 0; a < 3; a++) {
        first[a] = (int64_t)floor(world->low[a] / VOXEL_M);
        size[a] = (int64_t)ceil(world->high[a] / VOXEL_M) - first[a];
    }
    free_cells = room((size_t)(size[0] * size[1] * size[2]));
}

/* Sorts one measure of all seeds' outcomes; which: its place in the struct. */
static struct cost_spread spread(const struct outcome *out, unsigned seeds, size_t which)
{
    double value[SEEDS];

    for (unsigned s = 0; s < seeds; s++)
        memcpy(&value[s], (const char *)&out[s] + which, sizeof value[s]);
    cost_sort(value, seeds);
    return (struct cost_spread){cost_quantile(value, seeds, 0.5), value[0], value[seeds - 1]};
}
#define SPREAD(measure) spread(out[s], seeds, offsetof(struct outcome, measure))

int main(int argc, char **argv)
{
    static struct outcome out[SETTINGS][SEEDS];
    const bool quick = argc > 1 && strcmp(argv[1], "quick") == 0;
    const unsigned seeds = quick ? 1 : SEEDS;
    const struct setting whole = {INFINITY, false, false};
    struct dive *dive = dive_make(world_named("shaft"), quick ? QUICK_TURNS : TURNS, false, 0, DIVE_TRUTH);
    struct outcome reference;

    frame(dive->world);
    for (unsigned seed = 0; seed < seeds; seed++) {
        run(dive, seed + 1, &whole, false, &reference);
        for (size_t s = 0; s < SETTINGS; s++)
            run(dive, seed + 1, &settings[s], true, &out[s][seed]);
    }
    printf("submap_m,default,corrected,submaps,false_free_m3,false_free_low,false_free_high,behind_max_m,"
           "not_common_share,not_common_low,not_common_high,mbytes,ns_enter,ns_merge\n");
    for (size_t s = 0; s < SETTINGS; s++) {
        const struct cost_spread wrong = SPREAD(false_m3), behind = SPREAD(behind_m), other = SPREAD(not_common);
        if (isinf(settings[s].submap_m))
            printf("never");
        else
            printf("%g", settings[s].submap_m);
        printf(",%d,%s,%u,%.4g,%.4g,%.4g,%.3g,%.4g,%.4g,%.4g,%.4g,%.4g,%.4g\n", settings[s].shipped,
               settings[s].corrected ? "yes" : "no", out[s][0].submaps, wrong.median, wrong.low, wrong.high,
               behind.high, other.median, other.low, other.high, SPREAD(mbytes).median, SPREAD(ns_enter).median,
               SPREAD(ns_merge).median);
    }
    dive_free(dive);
    return 0;
}
