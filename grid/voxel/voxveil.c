/* SPDX-License-Identifier: MIT */
#include "voxveil.h"

#include <string.h>

/* ---- forgotten submaps ---- */

uint32_t voxveil_most(const struct tiles *t, const uint8_t *echoes, uint32_t k, uint32_t end, uint32_t most,
                      uint32_t *marks)
{
    for (; k < end; k++) {
        uint64_t eight = 1; /* mostly nothing was heard in all of them */
        if (k + sizeof eight <= end)
            memcpy(&eight, echoes + k, sizeof eight);
        if (eight == 0)
            k += sizeof eight - 1;
        else if (echoes[k]) {
            *marks |= 1u << part_slice(k, t->height);
            most = echoes[k] > most ? echoes[k] : most;
        }
    }
    return most;
}

/* A cube of the veil, or what of it lies in a submap's box, by columns and levels of that box. */
struct piece {
    uint32_t entry;            /* of the directory */
    uint32_t first_i, first_j; /* columns of the tile: VEIL_CUBE from here on */
    uint32_t first_k, end_k;
};

/* At least the most echoes that a voxel of it holds, as they have aged. */
static uint32_t heard_in(const struct voxmap *m, const struct voxmap_part *p, const struct piece *at)
{
    const uint32_t tile = p->map.tile[at->entry];
    uint32_t most = 0, marks = 0;
    if (p->away) {
        for (uint32_t k = at->first_k; k < at->end_k; k++)
            if (tile >> part_slice(k, m->set.height) & 1)
                most = (uint32_t)p->map.written[(size_t)at->entry * p->map.slices];
    } else {
        for (uint32_t c = 0; m->tiles.planes > 1 && c < VEIL_CUBE * VEIL_CUBE; c++) {
            const uint32_t column = (at->first_i + c / VEIL_CUBE) * TILE_SIDE + at->first_j + c % VEIL_CUBE;
            most = voxveil_most(&m->tiles, tiles_column(&m->tiles, tile, column, SUBMAP_ECHOES), at->first_k,
                                at->end_k, most, &marks);
        }
    }
    return voxmap_faded_echoes(most, voxmap_shift(m, p));
}

/* The cubes of the world that a cube of a corrected submap's lattice lies in by now, and what it says of the voxels around
 * it (merge.h). */
static void add_moved(struct voxmap *m, const struct voxmap_part *p, const int64_t cube[3], uint32_t echoes)
{
    double middle[3], v[3], reach[3] = {0};
    int64_t first[3], last[3], at[3];
    for (int a = 0; a < 3; a++) {
        double axis[3] = {0};
        axis[a] = VEIL_CUBE / 2.0 + 1;
        middle[a] = (double)(cube[a] * VEIL_CUBE - p->base.cell[a]) + VEIL_CUBE / 2.0 - p->base.offset[a];
        quat_rotate(p->turn, axis, v);
        for (int w = 0; w < 3; w++)
            reach[w] += fabs(v[w]);
    }
    quat_rotate(p->turn, middle, v);
    for (int a = 0; a < 3; a++) {
        const double to = v[a] + p->moved_to.offset[a];
        first[a] = floor_div(p->moved_to.cell[a] + (int64_t)floor(to - reach[a]), VEIL_CUBE);
        last[a] = floor_div(p->moved_to.cell[a] + (int64_t)floor(to + reach[a]), VEIL_CUBE);
    }
    for (at[0] = first[0]; at[0] <= last[0]; at[0]++)
        for (at[1] = first[1]; at[1] <= last[1]; at[1]++)
            for (at[2] = first[2]; at[2] <= last[2]; at[2]++)
                veil_add(&m->veil, at, echoes, m->change);
}

/* What a submap heard in one quarter of a tile. */
static void veil_quarter(struct voxmap *m, const struct voxmap_part *p, struct piece at)
{
    const struct lattice_box *box = &p->map.box;
    const uint32_t row = m->set.side;
    int64_t cube[3] = {floor_div(box->first[0] + at.entry / row * TILE_SIDE + at.first_i, VEIL_CUBE),
                       floor_div(box->first[1] + at.entry % row * TILE_SIDE + at.first_j, VEIL_CUBE)};
    for (at.first_k = 0; at.first_k < m->set.height; at.first_k = at.end_k) {
        cube[2] = floor_div(box->first[2] + at.first_k, VEIL_CUBE);
        const int64_t end = (cube[2] + 1) * VEIL_CUBE - box->first[2];
        at.end_k = end < m->set.height ? (uint32_t)end : m->set.height;
        const uint32_t echoes = heard_in(m, p, &at);
        if (p->moved)
            add_moved(m, p, cube, echoes);
        else
            veil_add(&m->veil, cube, echoes, m->change);
    }
}

void voxveil_keep(struct voxmap *m, const struct voxmap_part *part)
{
    for (uint32_t t = 0; t < m->set.side * m->set.side; t++)
        for (uint32_t q = 0; part->map.tile[t] != TILE_NONE && q < 4; q++)
            veil_quarter(m, part,
                         (struct piece){.entry = t, .first_i = q / 2 * VEIL_CUBE, .first_j = q % 2 * VEIL_CUBE});
}

/* ---- echoes of a ping ---- */

/* The cubes that an echo may lie in. */
struct cubes {
    struct voxmap *map;
    bool starved;
    struct lattice_box box;
};

/* Does the current submap keep all of the echo that lies in a cube? Where it has no tile it does unless memory was full: the
 * cubes reach further than the echo. */
static bool is_kept(const struct cubes *c, const int64_t cube[3])
{
    const struct voxmap *m = c->map;
    const struct submap *map = &m->current->map;
    int64_t low[3], high[3];
    for (int a = 0; a < 3; a++) {
        low[a] = cube[a] * VEIL_CUBE;
        high[a] = low[a] + VEIL_CUBE - 1;
    }
    return lattice_holds(&map->box, low) && lattice_holds(&map->box, high) &&
           (!c->starved || map->tile[(low[0] - map->box.first[0]) / TILE_SIDE * m->set.side +
                                     (low[1] - map->box.first[1]) / TILE_SIDE] != TILE_NONE);
}

static void take_cubes(void *context, const struct cast_spans *spans)
{
    const struct cubes *c = context;
    for (int s = 0; s < spans->runs; s++)
        for (int32_t k = 0; k < spans->n[s]; k++) {
            const int64_t cube[3] = {c->box.first[0] + spans->i[s], c->box.first[1] + spans->j[s],
                                     c->box.first[2] + spans->k[s] + k};
            if (!is_kept(c, cube))
                veil_add(&c->map->veil, cube, 1, c->map->change);
        }
}

void voxveil_echo(struct voxmap *m, const struct lattice_place *apex, const double attitude[4],
                  const struct beam_echoes *heard, double near_m, double far_m, bool starved)
{
    const double cube_m = VEIL_CUBE * m->set.voxel_m, wider = VOXVEIL_HALF_DIAGONAL * cube_m;
    const int64_t reach = (int64_t)fmin((far_m + 2 * wider) / cube_m, CAST_MAX_VOXELS) + 2;
    struct cubes cubes = {.map = m, .starved = starved};
    struct lattice_place at;
    struct cast_beam beam;

    for (int a = 0; a < 3; a++) {
        at.cell[a] = floor_div(apex->cell[a], VEIL_CUBE);
        at.offset[a] = ((double)(apex->cell[a] - at.cell[a] * VEIL_CUBE) + apex->offset[a]) / VEIL_CUBE;
        cubes.box.first[a] = at.cell[a] - reach;
        cubes.box.size[a] = (int32_t)(2 * reach + 1);
    }
    if (cast_aim(&beam, &m->veiled, &at, attitude, (double)heard->az_rad, (double)heard->el_rad,
                 fmax(near_m - wider, 0), far_m + wider, cube_m))
        cast_run(&beam, &cubes.box, take_cubes, &cubes);
}
