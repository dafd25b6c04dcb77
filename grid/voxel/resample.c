/* SPDX-License-Identifier: MIT */
#include "resample.h"

#include <string.h>

#include "grid/geometry.h"

#define ALIGNED 1e-9 /* voxels: nearer to a voxel's centre, its neighbours have no say */

void resample_of(struct resample *p, const struct voxmap_part *part)
{
    p->map = &part->map;
    p->to = part->moved_to;
    quat_axes(part->turn, p->axis);
    for (int a = 0; a < 3; a++)
        p->origin[a] = (double)(part->base.cell[a] - part->map.box.first[a]) + part->base.offset[a] - 0.5;
}

/* Along one of the world's axes, from where the base lies by now to a cell's centre. */
static inline double way(const struct resample *p, int axis, int64_t cell)
{
    return (double)(cell - p->to.cell[axis]) + (0.5 - p->to.offset[axis]);
}

/* Where a column of the world begins in the submap's box; and its cells, from there:
 * in the same steps wherever one is asked. */
static inline void place_column(const struct resample *p, const int64_t cell[3], double plan[3])
{
    double north = way(p, 0, cell[0]), east = way(p, 1, cell[1]);
    for (int a = 0; a < 3; a++)
        plan[a] = p->axis[a][0] * north + p->axis[a][1] * east + p->origin[a];
}

static inline bool place_cell(const struct resample *p, const double plan[3], int64_t level,
                              struct resample_cell *out)
{
    double down = way(p, 2, level);
    for (int a = 0; a < 3; a++) {
        double at = plan[a] + p->axis[a][2] * down, low = at + ALIGNED;
        if (!(low >= -1 && low < p->map->box.size[a]))
            return false;
        out->least[a] = (int32_t)(low + 1) - 1;
        out->pair[a] = at - out->least[a] > ALIGNED;
    }
    return true;
}

bool resample_cell(const struct resample *p, const int64_t cell[3], struct resample_cell *out)
{
    double plan[3];
    place_column(p, cell, plan);
    return place_cell(p, plan, cell[2], out);
}

bool resample_meets(const struct resample *p, const int64_t first[3], const int32_t size[3])
{
    double plan[3];
    int32_t low[3], high[3];
    place_column(p, first, plan);
    for (int a = 0; a < 3; a++) {
        double at = plan[a] + p->axis[a][2] * way(p, 2, first[2]), from = at, to = at;
        for (int w = 0; w < 3; w++) {
            double step = p->axis[a][w] * (size[w] - 1);
            *(step < 0 ? &from : &to) += step;
        }
        if (!(to >= -1 - 1e-3 && from < p->map->box.size[a] + 1e-3))
            return false;
        low[a] = (int32_t)fmax(from - 1e-3, 0);
        high[a] = (int32_t)fmin(to + 1 + 1e-3, p->map->box.size[a] - 1);
    }
    for (int32_t i = low[0] / TILE_SIDE; i <= high[0] / TILE_SIDE; i++)
        for (int32_t j = low[1] / TILE_SIDE; j <= high[1] / TILE_SIDE; j++)
            if (p->map->tile[submap_entry(p->map, i * TILE_SIDE, j * TILE_SIDE)] != TILE_NONE)
                return true;
    return false;
}

/* The columns of the submap that surround a place in the plan. */
struct corners {
    int32_t i, j;
    bool pair_i, pair_j;
    int n;
    const uint8_t *vacancy[4];
    bool hole; /* one is beyond the box, or was never written to */
};

static void find_corners(const struct submap *map, const struct resample_cell *c, struct corners *out)
{
    *out = (struct corners){c->least[0], c->least[1], c->pair[0], c->pair[1], .hole = false};
    for (int n = 0; n < 4; n++) {
        int32_t i = c->least[0] + (n & 1), j = c->least[1] + (n >> 1);
        if (((n & 1) && !c->pair[0]) || ((n >> 1) && !c->pair[1]))
            continue;
        bool inside = i >= 0 && i < map->box.size[0] && j >= 0 && j < map->box.size[1];
        uint32_t tile = inside ? map->tile[submap_entry(map, i, j)] : TILE_NONE;
        if (tile == TILE_NONE)
            out->hole = true;
        else
            out->vacancy[out->n++] = tiles_column(map->tiles, tile, submap_column(i, j), SUBMAP_VACANCY);
    }
}

static inline bool same_corners(const struct corners *k, const struct resample_cell *c)
{
    return k->i == c->least[0] && k->j == c->least[1] && k->pair_i == c->pair[0] && k->pair_j == c->pair[1];
}

/* The levels low..high of the corners, those of them that the box has. */
static inline uint8_t least_of(const struct corners *k, int32_t low, int32_t high, int32_t height)
{
    uint8_t least = UINT8_MAX;
    if (k->hole || low < 0 || high >= height)
        return 0;
    for (int n = 0; n < k->n; n++) {
        const uint8_t a = k->vacancy[n][low], b = k->vacancy[n][high], both = a < b ? a : b;
        least = both < least ? both : least;
    }
    return least;
}

static inline uint8_t most_of(const struct corners *k, size_t plane, int32_t low, int32_t high, int32_t height)
{
    uint8_t most = 0;
    low = low < 0 ? high : low;
    high = high >= height ? low : high;
    for (int n = 0; low >= 0 && n < k->n; n++) {
        const uint8_t a = k->vacancy[n][plane + (uint32_t)low], b = k->vacancy[n][plane + (uint32_t)high];
        const uint8_t both = a > b ? a : b;
        most = both > most ? both : most;
    }
    return most;
}

void resample_column(const struct resample *p, const int64_t cell[3], int32_t n, uint8_t *vacancy, uint8_t *echoes)
{
    const struct tiles *tiles = p->map->tiles;
    const int32_t height = p->map->box.size[2];
    struct corners corners = {.i = -2};
    double plan[3];
    memset(vacancy, 0, (size_t)n);
    memset(echoes, 0, (size_t)n);
    place_column(p, cell, plan);
    for (int32_t k = 0; k < n; k++) {
        struct resample_cell c;
        if (!place_cell(p, plan, cell[2] + k, &c))
            continue;
        if (!same_corners(&corners, &c))
            find_corners(p->map, &c, &corners);
        const int32_t low = c.least[2], high = low + c.pair[2];
        vacancy[k] = least_of(&corners, low, high, height);
        if (tiles->planes > 1)
            echoes[k] = most_of(&corners, tiles->plane_bytes, low, high, height);
    }
}
