/* SPDX-License-Identifier: MIT */
#include "voxresidual.h"

#include <string.h>

/* ---- forgotten submaps ---- */

/* The most echoes of a column from level k to `end`, or `most` if that is more. */
static uint32_t most_of(const uint8_t *echoes, uint32_t k, uint32_t end, uint32_t most)
{
    for (; k < end; k++) {
        uint64_t eight = 1; /* mostly no echo lies in any of them */
        if (k + sizeof eight <= end)
            memcpy(&eight, echoes + k, sizeof eight);
        if (eight == 0)
            k += sizeof eight - 1;
        else if (echoes[k] > most)
            most = echoes[k];
    }
    return most;
}

/* A cube of the residual, or what of it lies in a submap's box, by columns and levels of that box. */
struct piece {
    uint32_t entry;            /* of the directory */
    uint32_t first_i, first_j; /* columns of the tile: RESIDUAL_CUBE from here on */
    uint32_t first_k, end_k;
};

/* At least the most echoes that a voxel of it holds, as they have aged. */
static uint32_t heard_in(const struct voxmap *m, const struct voxmap_part *p, const struct piece *at)
{
    const uint32_t tile = p->map.tile[at->entry];
    uint32_t most = 0;
    for (uint32_t c = 0; m->tiles.planes > 1 && c < RESIDUAL_CUBE * RESIDUAL_CUBE; c++) {
        const uint32_t column = (at->first_i + c / RESIDUAL_CUBE) * TILE_SIDE + at->first_j + c % RESIDUAL_CUBE;
        most = most_of(tiles_column(&m->tiles, tile, column, SUBMAP_ECHOES), at->first_k, at->end_k, most);
    }
    return voxmap_faded_echoes(most, voxmap_shift(m, p));
}

/* The cubes of the world that a cube of a corrected submap's lattice lies in by now, and what it says of the voxels
 * around it (merge.h). */
static void add_moved(struct voxmap *m, const struct voxmap_part *p, const int64_t cube[3], uint32_t echoes)
{
    double middle[3], v[3], reach[3] = {0};
    int64_t first[3], last[3], at[3];
    for (int a = 0; a < 3; a++) {
        double axis[3] = {0};
        axis[a] = RESIDUAL_CUBE / 2.0 + 1;
        middle[a] = (double)(cube[a] * RESIDUAL_CUBE - p->base.cell[a]) + RESIDUAL_CUBE / 2.0 - p->base.offset[a];
        quat_rotate(p->turn, axis, v);
        for (int w = 0; w < 3; w++)
            reach[w] += fabs(v[w]);
    }
    quat_rotate(p->turn, middle, v);
    for (int a = 0; a < 3; a++) {
        const double to = v[a] + p->moved_to.offset[a];
        first[a] = floor_div(p->moved_to.cell[a] + (int64_t)floor(to - reach[a]), RESIDUAL_CUBE);
        last[a] = floor_div(p->moved_to.cell[a] + (int64_t)floor(to + reach[a]), RESIDUAL_CUBE);
    }
    for (at[0] = first[0]; at[0] <= last[0]; at[0]++)
        for (at[1] = first[1]; at[1] <= last[1]; at[1]++)
            for (at[2] = first[2]; at[2] <= last[2]; at[2]++)
                residual_add(&m->residual, at, echoes, m->change);
}

/* The echoes of a submap in one quarter of a tile. */
static void residual_quarter(struct voxmap *m, const struct voxmap_part *p, struct piece at)
{
    const struct lattice_box *box = &p->map.box;
    const uint32_t row = m->set.side;
    int64_t cube[3] = {floor_div(box->first[0] + at.entry / row * TILE_SIDE + at.first_i, RESIDUAL_CUBE),
                       floor_div(box->first[1] + at.entry % row * TILE_SIDE + at.first_j, RESIDUAL_CUBE)};
    for (at.first_k = 0; at.first_k < m->set.height; at.first_k = at.end_k) {
        cube[2] = floor_div(box->first[2] + at.first_k, RESIDUAL_CUBE);
        const int64_t end = (cube[2] + 1) * RESIDUAL_CUBE - box->first[2];
        at.end_k = end < m->set.height ? (uint32_t)end : m->set.height;
        const uint32_t echoes = heard_in(m, p, &at);
        if (p->moved)
            add_moved(m, p, cube, echoes);
        else
            residual_add(&m->residual, cube, echoes, m->change);
    }
}

void voxresidual_keep(struct voxmap *m, const struct voxmap_part *part)
{
    for (uint32_t t = 0; t < m->set.side * m->set.side; t++)
        for (uint32_t q = 0; part->map.tile[t] != TILE_NONE && q < 4; q++)
            residual_quarter(
                m, part,
                (struct piece){.entry = t, .first_i = q / 2 * RESIDUAL_CUBE, .first_j = q % 2 * RESIDUAL_CUBE});
}

/* ---- echoes of a ping ---- */

/* The cubes that an echo may lie in. */
struct cubes {
    struct voxmap *map;
    bool starved;
    struct lattice_box box;
};

/* Does the current submap keep all of the echo that lies in a cube? Where it has no tile it does unless memory was
 * full: the cubes reach further than the echo. */
static bool is_kept(const struct cubes *c, const int64_t cube[3])
{
    const struct voxmap *m = c->map;
    const struct submap *map = &m->current->map;
    int64_t low[3], high[3];
    for (int a = 0; a < 3; a++) {
        low[a] = cube[a] * RESIDUAL_CUBE;
        high[a] = low[a] + RESIDUAL_CUBE - 1;
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
                residual_add(&c->map->residual, cube, 1, c->map->change);
        }
}

void voxresidual_echo(struct voxmap *m, const struct cast_look *shell, bool starved)
{
    const double cube_m = RESIDUAL_CUBE * m->set.voxel_m, wider = VOXRESIDUAL_HALF_DIAGONAL * cube_m;
    const int64_t reach = (int64_t)fmin((shell->far_m + 2 * wider) / cube_m, CAST_MAX_VOXELS) + 2;
    struct cubes cubes = {.map = m, .starved = starved};
    struct lattice_place at;
    struct cast_beam beam;
    for (int a = 0; a < 3; a++) {
        at.cell[a] = floor_div(shell->apex->cell[a], RESIDUAL_CUBE);
        at.offset[a] =
            ((double)(shell->apex->cell[a] - at.cell[a] * RESIDUAL_CUBE) + shell->apex->offset[a]) / RESIDUAL_CUBE;
        cubes.box.first[a] = at.cell[a] - reach;
        cubes.box.size[a] = (int32_t)(2 * reach + 1);
    }
    struct cast_look look = *shell;
    look.apex = &at;
    look.near_m = fmax(shell->near_m - wider, 0);
    look.far_m = shell->far_m + wider;
    look.voxel_m = cube_m;
    if (cast_aim(&beam, &m->residual_cells, &look))
        cast_run(&beam, &cubes.box, take_cubes, &cubes);
}
