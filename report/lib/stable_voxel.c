/* SPDX-License-Identifier: MIT */
/* stable_voxel - cases V: the voxel map at the ends of ranges, apertures, places, counts. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/geometry.h"
#include "grid/voxel/frontier.h"
#include "grid/voxel/merge.h"
#include "grid/voxel/voxmap.h"
#include "chart.h"
#include "tests/water/dice.h"
#include "stable.h"

#define SIDE 48
#define HERE 24

static uint8_t hits[SIDE * SIDE * SIDE];
static uint64_t cells_outside;

static void take(void *context, const struct cast_spans *s)
{
    (void)context;
    for (int r = 0; r < s->runs; r++)
        for (int32_t k = 0; k < s->n[r]; k++) {
            const int32_t at[3] = {s->i[r], s->j[r], s->k[r] + k};
            bool out = false;
            for (int a = 0; a < 3; a++)
                out |= at[a] < 0 || at[a] >= SIDE;
            cells_outside += out;
            if (!out)
                hits[(at[0] * SIDE + at[1]) * SIDE + at[2]]++;
        }
}

/* Cells of the box that the run gives otherwise than the definition says, or twice, or outside. */
static double off_definition(const struct cast_beam *b, const struct lattice_box *box)
{
    double off = 0;
    memset(hits, 0, sizeof hits);
    cells_outside = 0;
    cast_run(b, box, take, NULL);
    for (int i = 0; i < SIDE * SIDE * SIDE; i++) {
        const int64_t cell[3] = {box->first[0] + i / SIDE / SIDE, box->first[1] + i / SIDE % SIDE,
                                 box->first[2] + i % SIDE};
        off += hits[i] != (cast_slack(b, cell) >= 0);
    }
    return off + (double)cells_outside;
}

/* Cells that rays, one voxel apart where the beam ends and marched at half a voxel, get otherwise. */
static double off_by_rays(const struct cast_beam *b, const struct lattice_box *box)
{
    const struct cast_opening *o = b->opening;
    const int wide = 1 + (int)(o->half_az_rad * b->far), high = 1 + (int)(o->half_el_rad * b->far);
    double off = 0;
    memset(hits, 0, sizeof hits);
    for (int u = -wide; u <= wide; u++)
        for (int v = -high; v <= high; v++) {
            double ray[3];
            geo_direction(o->half_az_rad * u / wide, o->half_el_rad * v / high, ray);
            for (double t = 0; t <= b->far; t += 0.5) {
                int64_t at[3];
                bool in = true;
                for (int a = 0; a < 3; a++) {
                    const double along = ray[0] * b->axis[0][a] + ray[1] * b->axis[1][a] + ray[2] * b->axis[2][a];
                    at[a] =
                        (int64_t)floor((double)b->apex.cell[a] + b->apex.offset[a] + t * along) - box->first[a];
                    in &= at[a] >= 0 && at[a] < SIDE;
                }
                if (in)
                    hits[(at[0] * SIDE + at[1]) * SIDE + at[2]] = 1;
            }
        }
    for (int i = 0; i < SIDE * SIDE * SIDE; i++) {
        const int64_t cell[3] = {box->first[0] + i / SIDE / SIDE, box->first[1] + i / SIDE % SIDE,
                                 box->first[2] + i % SIDE};
        off += hits[i] != (cast_slack(b, cell) >= 0);
    }
    return off;
}

static const struct lattice_box box = {.size = {SIDE, SIDE, SIDE}};

static struct cast_opening opening(enum cast_shape shape, double az_deg, double el_deg)
{
    struct cast_opening o;
    struct fault fault;
    if (!cast_opening_init(&o, shape, geo_rad(az_deg) / 2, geo_rad(el_deg) / 2, 0, &fault))
        memset(&o, 0, sizeof o);
    return o;
}

static void senseless_ranges(bool quick, struct stable_found *f)
{
    static const double row[][2] = {{0, 0}, {0, -1}, {2, 1}, {0, NAN}, {NAN, NAN}, {0, INFINITY}, {0, 1e9}};
    const struct cast_opening o = opening(CAST_WEDGE, 3, 35);
    const struct lattice_place apex = {{HERE, HERE, HERE}, {0.5, 0.5, 0.5}};
    struct cast_beam b;
    (void)quick;
    f->naive = f->ours = 0;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        f->ours += cast_aim(&b, &o,
                            &(struct cast_look){.apex = &apex,
                                                .attitude = pose_identity.attitude,
                                                .near_m = row[i][0],
                                                .far_m = row[i][1],
                                                .voxel_m = 0.1});
        f->naive += !(row[i][1] <= 0); /* the test that a first version has */
    }
}

static void apertures(bool quick, struct stable_found *f)
{
    static const double az[] = {0.1, 1, 3, 35, 90, 179.9, 180, 270, 359.9, 360}, el[] = {35, 100, 180};
    f->naive = f->ours = 0;
    for (size_t a = 0; a < sizeof az / sizeof az[0]; a++)
        for (size_t e = 0; e < sizeof el / sizeof el[0]; e++)
            for (int turn = 0; turn < (quick ? 1 : 4); turn++) {
                const struct cast_opening o = opening(CAST_WEDGE, az[a], el[e]);
                const struct lattice_place apex = {{HERE, HERE, HERE}, {0.3, 0.9, 0.51}};
                struct cast_beam b;
                double q[4];
                quat_from_rpy(0.2 * turn, 0.3 * turn, 0.9 * turn, q);
                cast_aim(&b, &o, &(struct cast_look){.apex = &apex, .attitude = q, .far_m = 2.1, .voxel_m = 0.1});
                f->ours += off_definition(&b, &box);
                f->naive += off_by_rays(&b, &box);
            }
}

static void along_axes(bool quick, struct stable_found *f)
{
    static const double way[6][2] = {{0, 0}, {90, 0}, {180, 0}, {270, 0}, {0, 90}, {0, -90}};
    f->naive = f->ours = 0;
    for (int w = 0; w < 6; w++)
        for (int at = 0; at < 27; at += quick ? 13 : 1) {
            const struct cast_opening o = opening(CAST_WEDGE, 3, 35);
            const struct lattice_place apex = {{HERE, HERE, HERE},
                                               {0.5 * (at % 3), 0.5 * (at / 3 % 3), 0.5 * (at / 9)}};
            struct cast_beam b;
            cast_aim(&b, &o,
                     &(struct cast_look){.apex = &apex,
                                         .attitude = pose_identity.attitude,
                                         .az_rad = geo_rad(way[w][0]),
                                         .el_rad = geo_rad(way[w][1]),
                                         .far_m = 2,
                                         .voxel_m = 0.1});
            f->ours += off_definition(&b, &box);
            f->naive += off_by_rays(&b, &box);
        }
}

/* A map of its own. */
struct kept {
    struct voxmap map;
    void *memory;
};

static struct voxmap_setting setting(void)
{
    return (struct voxmap_setting){.voxel_m = 0.125,
                                   .side = 8,
                                   .height = 80,
                                   .n_tiles = 600,
                                   .max_submaps = 8,
                                   .keep_echoes = true,
                                   .rule = {.threshold = 2, .echo_weight = 4},
                                   .opening = 1,
                                   .weight_levels = 1,
                                   .submap_path_m = INFINITY,
                                   .submap_ns = VOXMAP_NEVER,
                                   .half_life_ns = VOXMAP_NEVER};
}

static void keep(struct kept *k, const struct voxmap_setting *s)
{
    struct fault fault;
    k->memory = stable_memory(voxmap_bytes(s, &fault));
    voxmap_init(&k->map, s, k->memory);
}

static void ping(struct kept *k, const double at[3], double az_rad, double range_m, bool echo)
{
    static const struct voxmap_sensor sensor = {.mount = {.attitude = {1, 0, 0, 0}}, .shape = CAST_WEDGE};
    struct beam_echoes beam = {.az_rad = (float)az_rad, .free_to_m = (float)range_m, .state = BEAM_SILENT};
    const struct echoes e = {.n_beams = 1,
                             .az_aperture_rad = (float)geo_rad(3),
                             .el_aperture_rad = (float)geo_rad(35),
                             .beam = &beam,
                             .pose = {.attitude = {1, 0, 0, 0},
                                      .position_m = {at[0], at[1], at[2]},
                                      .has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH}};
    if (echo) {
        beam.state = BEAM_ECHO;
        beam.n = 1;
        beam.echo[0] = (struct echo){
            .range_m = (float)range_m + 0.05f, .near_m = (float)range_m, .sd_m = 0.02f, .confidence = 0.9f};
    }
    voxmap_enter(&k->map, &e, &sensor);
}

static void same_beam(bool quick, struct stable_found *f)
{
    const struct voxmap_setting s = setting();
    struct kept k;
    uint8_t wraps = 0;
    (void)quick;
    keep(&k, &s);
    for (int n = 0; n < 300; n++, wraps++)
        ping(&k, (const double[3]){0.0625, 0.0625, 0.0625}, 0, 3, false);
    const int64_t cell[3] = {10, 0, 0};
    f->naive = 255 - wraps;
    f->ours = 255.0 - merge_sum(&k.map, cell).vacancy;
    free(k.memory);
}

/* States of all cells around a place, of the same pings shifted by whole voxels. */
static void shifted(bool quick, struct stable_found *f)
{
    static uint8_t state[2][SIDE * SIDE * SIDE];
    const struct voxmap_setting s = setting();
    struct dice dice;
    (void)quick;
    f->naive = f->ours = 0;
    for (int far = 0; far < 2; far++) {
        struct kept k;
        const double origin_m = far ? 1e7 : 0;
        dice = dice_of(5, 0);
        keep(&k, &s);
        for (int n = 0; n < 200; n++) {
            const double step = round(dice_uniform(&dice) * 64) / 128; /* exact in both worlds */
            ping(&k, (const double[3]){origin_m + step, -origin_m, 0.0625}, GEO_TURN * n / 200, 2.5, n % 3);
            const float near = (float)step, there = (float)(origin_m + step); /* naive: poses in float */
            f->naive += far && floorf(there / 0.125f) - 8e7f != floorf(near / 0.125f);
        }
        for (int i = 0; i < SIDE * SIDE * SIDE; i++) {
            const int64_t shift = far ? 80000000 : 0;
            const int64_t cell[3] = {shift + i / SIDE / SIDE - HERE, -shift + i / SIDE % SIDE - HERE,
                                     i % SIDE - HERE};
            state[far][i] = (uint8_t)merge_at(&k.map, cell);
        }
        free(k.memory);
    }
    for (int i = 0; i < SIDE * SIDE * SIDE; i++)
        f->ours += state[0][i] != state[1][i];
}

static void clipped(bool quick, struct stable_found *f)
{
    struct dice dice = dice_of(6, 0);
    f->naive = f->ours = 0;
    for (int n = 0; n < (quick ? 20 : 300); n++) {
        const struct cast_opening o = opening((enum cast_shape)(n % 3), 1 + 60 * dice_uniform(&dice), 35);
        const struct lattice_place apex = {{(int64_t)(90 * dice_uniform(&dice)) - 20,
                                            (int64_t)(90 * dice_uniform(&dice)) - 20,
                                            (int64_t)(56 * dice_uniform(&dice)) - 10},
                                           {dice_uniform(&dice), dice_uniform(&dice), dice_uniform(&dice)}};
        struct cast_beam b;
        double q[4];
        quat_from_rpy(6 * dice_uniform(&dice), 3 * dice_uniform(&dice) - 1.5, 6 * dice_uniform(&dice), q);
        if (!cast_aim(&b, &o,
                      &(struct cast_look){
                          .apex = &apex, .attitude = q, .far_m = 2 * dice_uniform(&dice) + 0.1, .voxel_m = 0.1}))
            continue;
        f->ours += off_definition(&b, &box);
        const double reach = b.far; /* naive: the bounding box of the beam is walked without a look at the map's */
        for (int a = 0; a < 3; a++)
            f->naive += fmax(0, reach - (double)apex.cell[a]) + fmax(0, (double)apex.cell[a] + reach - SIDE);
    }
}

/* ---- frontier ---- */

/* Surface voxels of boxes of free water (and a hole), counted by words of bits, against counted by hand. */
static double frontier_off(const int64_t size[3], int64_t top, bool hole, double *naive)
{
    struct voxmap_setting s = setting();
    struct kept k;
    struct voxmask mask;
    struct frontier frontier;
    int64_t c[3], want = 0, got = 0, within_words = 0;
    s.height = 320;
    keep(&k, &s);
    void *memory[2] = {stable_memory(voxmask_bytes(1024)), stable_memory(frontier_bytes(1024))};
    ping(&k, (const double[3]){0.01, 0.01, 0.01}, 0, 0, false); /* opens a submap */
    struct submap *m = &k.map.current->map;
    m->now = ++k.map.change;
    for (c[0] = 0; c[0] < size[0]; c[0]++)
        for (c[1] = 0; c[1] < size[1]; c[1]++)
            for (c[2] = 0; c[2] < size[2]; c[2]++) {
                bool edge = false, is_hole = hole;
                for (int a = 0; a < 3; a++) {
                    edge |= c[a] == 0 || c[a] == size[a] - 1;
                    is_hole &= c[a] == size[a] / 2;
                }
                bool by_hole = hole && !is_hole;
                for (int a = 0; a < 3; a++)
                    by_hole &= llabs(c[a] - size[a] / 2) <= 1;
                if (is_hole)
                    continue;
                const struct lattice_place at = {{c[0], c[1], top + c[2]}, {0.5, 0.5, 0.5}};
                submap_body(m, &at, &at, 0.1, 9);
                want += edge || by_hole;
                within_words += !edge && !by_hole && ((top + c[2]) % 64 == 0 || (top + c[2]) % 64 == 63);
            }
    voxmask_init(&mask, &k.map, memory[0], 1024);
    frontier_init(&frontier, &mask, memory[1], 1024);
    struct block_key key;
    for (struct merge_walk walk = {0}; merge_next(&k.map, &walk, &key);) {
        const struct frontier_block *b = frontier_block(&frontier, &key);
        for (int i = 0; i < BLOCK_COLUMNS; i++)
            got += __builtin_popcountll(b->surface[i]);
    }
    free(memory[0]);
    free(memory[1]);
    free(k.memory);
    *naive += (double)within_words; /* words without their neighbours' ends */
    return fabs((double)(got - want));
}

static void long_rows(bool quick, struct stable_found *f)
{
    static const int64_t length[] = {1, 2, 3, 63, 64, 65, 128};
    (void)quick;
    f->naive = f->ours = 0;
    for (size_t l = 0; l < sizeof length / sizeof length[0]; l++)
        for (int64_t top = -64; top <= -62; top++)
            f->ours += frontier_off((const int64_t[3]){3, 3, length[l]}, top, false, &f->naive);
}

static void odd_shapes(bool quick, struct stable_found *f)
{
    static const int64_t size[][3] = {{0, 0, 0}, {1, 1, 1}, {20, 20, 1}, {1, 20, 20}, {7, 7, 7}};
    (void)quick;
    f->naive = f->ours = 0;
    for (size_t i = 0; i < sizeof size / sizeof size[0]; i++)
        f->ours += frontier_off(size[i], -3, false, &f->naive);
    f->ours += frontier_off((const int64_t[3]){9, 9, 9}, -3, true, &f->naive);
}

/* ---- several submaps ---- */

/* The same pings in one submap and in many; naive: the newest one's. */
static void merged(bool quick, struct stable_found *f)
{
    static uint32_t sum[3][SIDE * SIDE * SIDE];
    (void)quick;
    f->naive = f->ours = 0;
    for (int n = 0; n < 3; n++) {
        struct voxmap_setting s = setting();
        struct dice dice = dice_of(7, 0);
        struct kept k;
        s.side = 10;
        s.n_tiles = 800;
        keep(&k, &s);
        for (int b = 0; b < 100; b++) {
            const double at[3] = {dice_uniform(&dice), dice_uniform(&dice), dice_uniform(&dice)};
            if (n && b % (n == 1 ? 15 : 40) == 0)
                voxmap_new(&k.map);
            ping(&k, at, 7 * dice_uniform(&dice), 2, b % 3 == 0);
        }
        for (int i = 0; i < SIDE * SIDE * SIDE; i++) {
            const int64_t cell[3] = {i / SIDE / SIDE - HERE, i / SIDE % SIDE - HERE, i % SIDE - HERE};
            const struct merge_sum m = merge_sum(&k.map, cell);
            sum[n][i] = m.vacancy * 1000 + m.echoes;
            f->naive += n == 2 && submap_count(&k.map.current->map, SUBMAP_VACANCY, cell) != m.vacancy;
        }
        free(k.memory);
    }
    for (int i = 0; i < SIDE * SIDE * SIDE; i++)
        f->ours += sum[0][i] != sum[1][i] || sum[0][i] != sum[2][i];
}

/* A solid capsule of free water, its submap turned by 45 degrees: holes in it and water beyond it. Naive: its voxels
 * are pushed to where they fall. */
static void turned(bool quick, struct stable_found *f)
{
    static uint8_t pushed[SIDE * SIDE * SIDE];
    const struct voxmap_setting s = setting();
    const double h = s.voxel_m, to[3] = {1.05 * 1.25, -0.95 * 1.25, 0.35 * 1.25};
    double q[4];
    struct kept k;
    (void)quick;
    keep(&k, &s);
    ping(&k, (const double[3]){0, 0, 0}, 0, 0.2, false);
    k.map.current->map.now = ++k.map.change;
    const struct lattice_place a = {{-12, 0, 0}, {0.5, 0.5, 0.5}}, b = {{12, 0, 0}, {0.5, 0.5, 0.5}};
    submap_body(&k.map.current->map, &a, &b, 8, 9);
    quat_from_rpy(0, 0, geo_rad(45), q);
    memset(pushed, 0, sizeof pushed);
    f->naive = f->ours = 0;
    for (int pass = 0; pass < 2; pass++) {
        if (pass)
            voxmap_move(&k.map, 1, to, q);
        for (int i = 0; i < SIDE * SIDE * SIDE; i++) {
            const int64_t cell[3] = {i / SIDE / SIDE - HERE, i / SIDE % SIDE - HERE, i % SIDE - HERE};
            double v[3] = {(double)cell[0] + 0.5, (double)cell[1] + 0.5, (double)cell[2] + 0.5};
            if (!pass && merge_at(&k.map, cell) == VOXEL_FREE) {
                quat_rotate(q, v, v);
                int at[3];
                for (int n = 0; n < 3; n++)
                    at[n] = (int)floor(v[n] + to[n] / h) + HERE;
                if (at[0] >= 0 && at[0] < SIDE && at[1] >= 0 && at[1] < SIDE && at[2] >= 0 && at[2] < SIDE)
                    pushed[(at[0] * SIDE + at[1]) * SIDE + at[2]] = 1;
            }
            if (!pass)
                continue;
            for (int n = 0; n < 3; n++)
                v[n] -= to[n] / h;
            quat_rotate_inverse(q, v, v);
            const double along = fmin(fmax(v[0] - 0.5, -12), 12) + 0.5;
            const double deep = 8 - sqrt(pow(v[0] - along, 2) + pow(v[1] - 0.5, 2) + pow(v[2] - 0.5, 2));
            const bool is_free = merge_at(&k.map, cell) == VOXEL_FREE;
            f->ours += (deep > 1.7321 && !is_free) + (deep < 0 && is_free);
            f->naive += (deep > 1.7321 && !pushed[i]) + (deep < 0 && pushed[i]);
        }
    }
    free(k.memory);
}

/* ---- rooms ---- */

/* Water behind walls, with true first ranges of whole beams; naive: the range along the axis. */
static void behind_walls(bool quick, struct stable_found *f)
{
    const struct chart_setting set = {.voxel_m = 0.2, .rule = {.threshold = 0}};
    struct dive *dive = dive_make(place_named("box tank"), quick ? 2 : 6, false, 0.15, DIVE_TRUTH);
    struct chart *ours = chart_make(dive->world, &set), *naive = chart_make(dive->world, &set);
    double deepest, free_m3;
    for (size_t i = 0; i < dive->n; i++) {
        const struct dive_look *look = &dive->look[i];
        const double axis_m = place_ray(dive->world, look->at, look->axis[0], DIVE_RANGE_M, look->t_s);
        chart_enter_truth(ours, look, 0);
        chart_enter_truth(naive, look, axis_m - look->first_m);
    }
    f->ours = chart_false_free(ours, 0, &deepest, &free_m3);
    f->naive = chart_false_free(naive, 0, &deepest, &free_m3);
    chart_free(ours);
    chart_free(naive);
    dive_free(dive);
}

static void silence(bool quick, struct stable_found *f)
{
    const struct voxmap_setting s = setting();
    struct kept k;
    (void)quick;
    keep(&k, &s);
    for (int n = 0; n < 400; n++) /* nothing heard in any beam: 1 m is what is claimed */
        ping(&k, (const double[3]){0.0625, 0.0625, 0.0625}, GEO_TURN * n / 200, 1, false);
    f->naive = f->ours = 0;
    for (int i = 0; i < SIDE * SIDE * SIDE; i++) {
        const int64_t cell[3] = {i / SIDE / SIDE - HERE, i / SIDE % SIDE - HERE, i % SIDE - HERE};
        const double away = sqrt((double)(cell[0] * cell[0] + cell[1] * cell[1] + cell[2] * cell[2])) * s.voxel_m;
        const double el = asin(fmin(1, fabs((double)cell[2]) * s.voxel_m / fmax(away, 1e-9)));
        f->ours += away > 1 + 1e-9 && merge_at(&k.map, cell) == VOXEL_FREE;
        f->naive += away > 1 && el < geo_rad(17.5); /* silence taken for water as far as was listened */
    }
    free(k.memory);
}

const struct stable_case stable_voxel[] = {
    {"V1", "ranges 0, negative, NaN, infinite, 1e9; near beyond far", "beams accepted", "range <= 0 is refused", 0,
     senseless_ranges},
    {"V2", "apertures 0.1 to 360 degrees", "voxels unlike the definition", "rays a voxel apart", 0, apertures},
    {"V3", "beams along the axes, from corners, edges, centres", "voxels unlike the definition",
     "rays a voxel apart", 0, along_axes},
    {"V4", "the same beam 300 times", "counts short of 255", "a byte that wraps", 0, same_beam},
    {"V5", "the map at 1e7 m", "voxels unlike the map at home", "poses in float", 0, shifted},
    {"V6", "beams partly and wholly outside the map", "voxels wrong, writes outside", "no clipping", 0, clipped},
    {"V7", "free columns of 1, 63, 64, 65, 128 voxels", "frontier voxels wrong", "words without their neighbours",
     0, long_rows},
    {"V8", "no free voxel, one, sheets, a solid, a hole", "frontier voxels wrong",
     "words without their neighbours", 0, odd_shapes},
    {"V9", "the same pings in one submap, in three, in seven", "voxels with another sum", "the newest submap", 0,
     merged},
    {"V10", "a submap corrected by 45 degrees", "holes, water beyond", "its voxels are pushed", 0, turned},
    {"V11", "a room, true ranges, tolerance 0", "m3 free that is solid", "the range along the axis", 0,
     behind_walls},
    {"V12", "no echo in any beam", "voxels free beyond what was claimed", "silence is water", 0, silence},
    {0},
};
