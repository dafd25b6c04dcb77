/* SPDX-License-Identifier: MIT */
#include "voxmask.h"

#include <string.h>

size_t voxmask_bytes(uint32_t n)
{
    bool fits = n >= 1024 && n <= 1u << 24 && (n & (n - 1)) == 0;
    return fits ? n * sizeof(struct voxmask_block) : 0;
}

void voxmask_init(struct voxmask *v, const struct voxmap *map, void *memory, uint32_t n)
{
    *v = (struct voxmask){.map = map, .block = memory, .n = n};
    memset(memory, 0, voxmask_bytes(n));
}

const struct voxmask_block *voxmask_block(struct voxmask *v, const struct block_key *key)
{
    struct voxmask_block *b = &v->block[block_slot(key, v->n)];
    uint64_t now = voxmap_changed(v->map);
    bool same_place = b->checked && block_same(&b->key, key);

    if (same_place && b->checked == now)
        return b;
    if (!same_place || merge_block_changed(v->map, key, b->checked)) {
        struct merge_block bits;
        merge_block(v->map, key, &bits);
        v->computed++;
        if (!same_place || memcmp(bits.free, b->bits.free, sizeof bits.free) != 0 ||
            memcmp(bits.heard, b->bits.heard, sizeof bits.heard) != 0)
            b->changed = now;
        b->bits = bits;
        b->key = *key;
    }
    b->checked = now;
    return b;
}

enum voxel_state voxmask_at(struct voxmask *v, const int64_t cell[3])
{
    struct block_key key = merge_block_of(cell);
    return merge_block_at(&voxmask_block(v, &key)->bits, cell);
}
