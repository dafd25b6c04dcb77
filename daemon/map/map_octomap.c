/* SPDX-License-Identifier: MIT */
/*
 * map_octomap - the tree of map_export_octomap. The format, from its description: lines of text that name the kind, the
 * number of nodes and the length of a voxel, then every inner node in depth-first order as two bytes, two bits a
 * child (bit 0 of its number is x, 1 is y, 2 is z): 00 nothing known, 10 a free leaf, 01 an occupied leaf, 11 an inner
 * node; of the pair the first is the lower bit.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "map_export.h"

#define LEVELS  16
#define HALF    32768 /* voxels from the origin to the tree's end */
#define BLOCK   4     /* level whose nodes are asked for as a whole, 16 voxels wide */
#define PADDING 256   /* room for the text before the tree */

enum node { NODE_UNKNOWN, NODE_FREE, NODE_OCCUPIED, NODE_INNER };

struct tree {
    struct voxmask *mask;
    struct lattice_box box; /* around all submaps */
    uint8_t *bytes;
    size_t n, room;
    uint64_t nodes;
    bool no_memory;
};

/* The lattice's box of a cube whose lowest corner is at x, y, z in voxels east, north and up. */
static struct lattice_box cube(int32_t x, int32_t y, int32_t z, int level)
{
    const int32_t side = 1 << level;
    return (struct lattice_box){{y, x, -(int64_t)z - side}, {side, side, side}};
}

static bool apart(const struct lattice_box *a, const struct lattice_box *b)
{
    for (int i = 0; i < 3; i++)
        if (a->first[i] >= b->first[i] + b->size[i] || b->first[i] >= a->first[i] + a->size[i])
            return true;
    return false;
}

/* Cubes of level BLOCK lie within one block of the mask: is anything known in it? */
static bool is_known(struct voxmask *mask, const struct lattice_box *cube)
{
    const struct block_key key = merge_block_of(cube->first);
    const struct merge_block *b = &voxmask_block(mask, &key)->bits;
    const uint64_t cells = UINT64_C(0xffff) << (cube->first[2] & (BLOCK_HEIGHT - 1));
    uint64_t known = 0;
    for (int column = 0; column < BLOCK_COLUMNS; column++)
        known |= b->free[column] | b->heard[column];
    return known & cells;
}

/* The least box around all submaps. False: OctoMap cannot hold it. */
static bool box_of(const struct voxmap *map, struct lattice_box *box)
{
    int64_t first[3] = {HALF, HALF, HALF}, end[3] = {-HALF, -HALF, -HALF};
    for (uint32_t i = 0; i < map->set.max_submaps; i++) {
        const struct lattice_box *b = &map->part[i].map.box;
        for (int a = 0; a < 3 && map->part[i].id; a++) {
            first[a] = b->first[a] < first[a] ? b->first[a] : first[a];
            end[a] = b->first[a] + b->size[a] > end[a] ? b->first[a] + b->size[a] : end[a];
        }
    }
    for (int a = 0; a < 3; a++) {
        if (first[a] < -HALF || end[a] > HALF)
            return false;
        box->first[a] = first[a];
        box->size[a] = (int32_t)(end[a] > first[a] ? end[a] - first[a] : 0);
    }
    return true;
}

static bool reserve_two(struct tree *t)
{
    if (t->n + 2 > t->room) {
        uint8_t *more = realloc(t->bytes, 2 * t->room);
        t->no_memory = !more;
        if (!more)
            return false;
        t->bytes = more;
        t->room *= 2;
    }
    t->n += 2;
    return true;
}

/* Appends what is below a cube, or nothing where all of it is alike. Its depth is that of the tree. */
static enum node enter_cube(struct tree *t, int32_t x, int32_t y, int32_t z, int level)
{
    const struct lattice_box box = cube(x, y, z, level);
    if (t->no_memory || apart(&box, &t->box) || (level == BLOCK && !is_known(t->mask, &box)))
        return NODE_UNKNOWN;
    if (level == 0) {
        static const enum node nodes[] = {
            [VOXEL_FREE] = NODE_FREE, [VOXEL_UNKNOWN] = NODE_UNKNOWN, [VOXEL_OCCUPIED] = NODE_OCCUPIED};
        return nodes[voxmask_at(t->mask, box.first)];
    }
    const size_t at = t->n;
    const uint64_t nodes = t->nodes;
    const int32_t half = 1 << (level - 1);
    enum node first = NODE_UNKNOWN;
    bool alike = true;
    unsigned bits = 0;
    if (!reserve_two(t))
        return NODE_UNKNOWN;
    for (int c = 0; c < 8; c++) {
        enum node child =
            enter_cube(t, x + (c & 1 ? half : 0), y + (c & 2 ? half : 0), z + (c & 4 ? half : 0), level - 1);
        first = c == 0 ? child : first;
        alike = alike && child == first && child != NODE_INNER;
        bits |= (unsigned)child << (2 * c);
        t->nodes += child != NODE_UNKNOWN;
    }
    if (alike && level < LEVELS) {
        t->n = at;
        t->nodes = nodes;
        return first;
    }
    t->bytes[at] = (uint8_t)bits;
    t->bytes[at + 1] = (uint8_t)(bits >> 8);
    return NODE_INNER;
}

uint8_t *map_export_octomap(struct voxmask *mask, size_t *size, struct fault *fault)
{
    struct tree t = {.mask = mask, .room = PADDING + 1024, .n = PADDING, .nodes = 1};
    if (!box_of(mask->map, &t.box)) {
        fault_set(fault, "the map reaches farther than %d voxels from the origin: OctoMap cannot hold it", HALF);
        return NULL;
    }
    t.bytes = malloc(t.room);
    t.no_memory = !t.bytes;
    enter_cube(&t, -HALF, -HALF, -HALF, LEVELS);
    if (t.no_memory) {
        free(t.bytes);
        fault_set(fault, "out of memory");
        return NULL;
    }
    char head[PADDING];
    const int n =
        snprintf(head, sizeof head,
                 "# Octomap OcTree binary file\n# x east, y north, z up, in metres\nid OcTree\nsize %llu\n"
                 "res %.17g\ndata\n",
                 (unsigned long long)t.nodes, mask->map->set.voxel_m);
    memcpy(t.bytes, head, (size_t)n);
    memmove(t.bytes + n, t.bytes + PADDING, t.n - PADDING);
    *size = t.n - PADDING + (size_t)n;
    return t.bytes;
}
