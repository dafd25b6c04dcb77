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

struct block_head *block_find(void *blocks, size_t size, uint32_t n, const struct block_key *key)
{
    uint64_t hash = (uint64_t)key->at[0] * UINT64_C(0x9e3779b97f4a7c15) +
                    (uint64_t)key->at[1] * UINT64_C(0xc2b2ae3d27d4eb4f) +
                    (uint64_t)key->at[2] * UINT64_C(0x165667b19e3779f9);
    uint32_t first = (uint32_t)(hash >> 32) & (n - 1) & ~3u;
    struct block_head *oldest = NULL;
    for (uint32_t way = 0; way < 4; way++) {
        struct block_head *head = (struct block_head *)((uint8_t *)blocks + (first + way) * size);
        if (head->checked && block_same(&head->key, key))
            return head;
        if (!oldest || head->checked < oldest->checked)
            oldest = head;
    }
    *oldest = (struct block_head){.key = *key};
    return oldest;
}

const struct voxmask_block *voxmask_block(struct voxmask *v, const struct block_key *key)
{
    struct voxmask_block *b = (struct voxmask_block *)block_find(v->block, sizeof *b, v->n, key);
    uint64_t now = voxmap_changed(v->map);
    if (b->head.checked == now)
        return b;
    if (b->head.checked == 0 || merge_block_changed(v->map, key, b->head.checked)) {
        struct merge_block bits;
        merge_block(v->map, key, &bits);
        v->computed++;
        if (b->head.checked == 0 || memcmp(bits.free, b->bits.free, sizeof bits.free) != 0 ||
            memcmp(bits.heard, b->bits.heard, sizeof bits.heard) != 0)
            b->changed = now;
        b->bits = bits;
    }
    b->head.checked = now;
    return b;
}

enum voxel_state voxmask_at(struct voxmask *v, const int64_t cell[3])
{
    struct block_key key = merge_block_of(cell);
    return merge_block_at(&voxmask_block(v, &key)->bits, cell);
}
