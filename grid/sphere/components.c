/* SPDX-License-Identifier: MIT */
#include "components.h"

#include <string.h>

/* GONE: removed, but a link of the tree until its component is settled. */
enum component_state { CELL_FREE, CELL_IN, CELL_GONE };

/* What a component suffered since it was settled. SHRUNK: cells left whose neighbours hold together without them. */
enum component_harm { HARM_NONE, HARM_SHRUNK, HARM_SPLIT };

#define NEIGHBOURS_MAX 64 /* more are met at a pole only: taken for a split */

#define SEARCH_MOST 256 /* cells, of one search */

#define LAYERS_PER_BUCKET 4 /* those above and below are mostly in the same one */

static size_t rounded(size_t n)
{
    return (n + 15) / 16 * 16;
}

static uint32_t buckets_for(uint32_t room)
{
    uint32_t n = 16;
    while (n < room)
        n *= 2;
    return n;
}

size_t components_bytes(uint32_t room)
{
    return rounded(room * sizeof(struct component_cell)) + rounded(buckets_for(room) * sizeof(uint32_t)) +
           2 * rounded(room * sizeof(uint32_t));
}

void components_init(struct components *c, void *memory, const struct rings *rings, uint32_t room)
{
    *c = (struct components){.rings = rings, .room = room, .buckets = buckets_for(room), .free = COMPONENTS_NONE};
    c->cell = memory;
    c->bucket = (uint32_t *)(void *)((char *)memory + rounded(room * sizeof(struct component_cell)));
    c->work = (uint32_t *)(void *)((char *)c->bucket + rounded(c->buckets * sizeof(uint32_t)));
    c->left = (uint32_t *)(void *)((char *)c->work + rounded(room * sizeof(uint32_t)));
    for (uint32_t i = 0; i < c->buckets; i++)
        c->bucket[i] = COMPONENTS_NONE;
}

/* ---- where a cell is ---- */

static uint32_t *bucket_of(const struct components *c, uint32_t direction, uint32_t layer)
{
    uint32_t h = direction * 0x9e3779b1u ^ (layer / LAYERS_PER_BUCKET) * 0x85ebca6bu;
    return &c->bucket[(h ^ h >> 15) & (c->buckets - 1)];
}

static uint32_t find_cell(const struct components *c, uint32_t direction, uint16_t layer)
{
    uint32_t i = *bucket_of(c, direction, layer);
    while (i != COMPONENTS_NONE && (c->cell[i].direction != direction || c->cell[i].layer != layer))
        i = c->cell[i].chain;
    return i;
}

static uint32_t new_cell(struct components *c, uint32_t direction, uint16_t layer)
{
    uint32_t i = c->free;
    if (i != COMPONENTS_NONE)
        c->free = c->cell[i].chain;
    else if (c->high < c->room)
        i = c->high++;
    else
        return COMPONENTS_NONE;
    uint32_t *bucket = bucket_of(c, direction, layer);
    c->cell[i] = (struct component_cell){
        .direction = direction, .layer = layer, .parent = i, .next = i, .prev = i, .chain = *bucket};
    *bucket = i;
    return i;
}

static void free_cell(struct components *c, uint32_t i)
{
    struct component_cell *cell = &c->cell[i];
    uint32_t *at = bucket_of(c, cell->direction, cell->layer);
    while (*at != i)
        at = &c->cell[*at].chain;
    *at = cell->chain;
    *cell = (struct component_cell){.chain = c->free};
    c->free = i;
}

/* ---- joining ---- */

static uint32_t root_of(struct components *c, uint32_t i)
{
    struct component_cell *cell = c->cell;
    while (cell[i].parent != i)
        i = cell[i].parent = cell[cell[i].parent].parent;
    return i;
}

static bool outranks(const struct component *a, const struct component *b)
{
    return a->cells > b->cells || (a->cells == b->cells && a->label < b->label);
}

static void join_components(struct components *c, uint32_t a, uint32_t b)
{
    a = root_of(c, a);
    b = root_of(c, b);
    if (a == b)
        return;
    struct component_cell *cell = c->cell;
    const uint32_t root = outranks(&cell[a].own, &cell[b].own) ? a : b, other = root == a ? b : a;
    cell[other].parent = root;
    cell[root].own.cells += cell[other].own.cells;
    cell[root].own.seeds += cell[other].own.seeds;
    if (cell[other].harm > cell[root].harm)
        cell[root].harm = cell[other].harm;
    const uint32_t after_root = cell[root].next, after_other = cell[other].next;
    cell[root].next = after_other;
    cell[after_other].prev = root;
    cell[other].next = after_root;
    cell[after_root].prev = other;
}

/* ---- neighbours ---- */

typedef bool touch_visit(struct components *c, uint32_t other, void *context);

/* Visits the cells that are in and touch one, itself among them; until a visit returns false. The layers that touch lie
 * in up to two buckets of a direction. */
static inline void touch_each(struct components *c, uint32_t i, touch_visit *visit, void *context)
{
    const uint32_t layer = c->cell[i].layer, lowest = layer ? layer - 1 : 0, highest = layer + 1;
    struct rings_run run[3];
    const unsigned runs = rings_touching(c->rings, c->cell[i].direction, run);
    for (unsigned r = 0; r < runs; r++)
        for (uint32_t k = 0; k < run[r].n; k++) {
            const uint32_t direction = rings_in(&run[r], k);
            for (uint32_t from = lowest; from <= highest;
                 from = (from / LAYERS_PER_BUCKET + 1) * LAYERS_PER_BUCKET)
                for (uint32_t at = *bucket_of(c, direction, from); at != COMPONENTS_NONE; at = c->cell[at].chain) {
                    const struct component_cell *cell = &c->cell[at];
                    if (cell->direction == direction && cell->layer >= from && cell->layer <= highest &&
                        cell->layer / LAYERS_PER_BUCKET == from / LAYERS_PER_BUCKET && cell->state == CELL_IN &&
                        !visit(c, at, context))
                        return;
                }
        }
}

/* ---- cells come and go ---- */

static void set_seed(struct components *c, uint32_t i, bool seed)
{
    struct component *own = &c->cell[root_of(c, i)].own;
    if (c->cell[i].seed && !seed)
        own->seeds--;
    else if (!c->cell[i].seed && seed)
        own->seeds++;
    c->cell[i].seed = seed;
}

static bool join_with(struct components *c, uint32_t other, void *context)
{
    join_components(c, *(const uint32_t *)context, other);
    return true;
}

static void join_touching(struct components *c, uint32_t i)
{
    touch_each(c, i, join_with, &i);
}

static void come_in(struct components *c, uint32_t i)
{
    c->cell[i].state = CELL_IN;
    c->used++;
    join_touching(c, i);
}

uint32_t components_put(struct components *c, uint32_t direction, uint16_t layer, bool seed, uint64_t now_ns)
{
    uint32_t i = find_cell(c, direction, layer);
    if (i == COMPONENTS_NONE) {
        i = new_cell(c, direction, layer);
        if (i == COMPONENTS_NONE)
            return i;
        c->cell[i].own = (struct component){.label = ++c->labels, .cells = 1, .t_label = now_ns};
        come_in(c, i);
    } else if (c->cell[i].state == CELL_GONE) {
        struct component_cell *root = &c->cell[root_of(c, i)];
        root->own.cells++;
        root->harm = HARM_SPLIT; /* it is in the tree, but what it touched there may have left */
        come_in(c, i);
    }
    set_seed(c, i, seed);
    c->cell[i].round = c->round;
    return i;
}

/* Takes those of near[from..n) that touch `cell` in front; returns where the others begin. */
static uint32_t bring_touching(const struct components *c, const struct component_cell *cell, uint32_t *near,
                               uint32_t from, uint32_t n)
{
    struct rings_run run[3];
    const unsigned runs = rings_touching(c->rings, cell->direction, run);
    for (uint32_t k = from; k < n; k++) {
        const struct component_cell *other = &c->cell[near[k]];
        bool touching = false;
        for (unsigned r = 0; r < runs && !touching; r++)
            touching = rings_holds(&run[r], other->direction);
        if (touching && other->layer + 1u >= cell->layer && other->layer <= cell->layer + 1u) {
            const uint32_t swap = near[from];
            near[from++] = near[k];
            near[k] = swap;
        }
    }
    return from;
}

/* Neighbours of a cell. */
struct near {
    uint32_t of, n, cell[NEIGHBOURS_MAX];
    bool more;
};

static bool add_near(struct components *c, uint32_t other, void *context)
{
    struct near *near = context;
    (void)c;
    near->more = other != near->of && near->n == NEIGHBOURS_MAX;
    if (other != near->of && !near->more)
        near->cell[near->n++] = other;
    return !near->more;
}

/* A search on its way around the cell `of`, for so many neighbours of it; c->work[n] were reached. */
struct search {
    uint32_t of, left, n;
};

static bool find_near(struct components *c, uint32_t other, void *context)
{
    struct search *s = context;
    uint64_t *seen = &c->cell[other].seen;
    if (other != s->of && *seen != c->searches) {
        s->left -= *seen == c->searches - 1;
        *seen = c->searches;
        c->work[s->n++] = other;
    }
    return s->left > 0;
}

/* Do ways that go round farther away connect all neighbours? The first of them, `reached`, are connected. Of a
 * component that is to be flooded anyway nothing is won, so all searches together go no farther than a flood would. */
static bool find_around(struct components *c, const struct near *near, uint32_t reached)
{
    struct search s = {.of = near->of, .left = near->n - reached, .n = reached};
    c->searches += 2;
    for (uint32_t k = 0; k < near->n; k++)
        c->cell[near->cell[k]].seen = k < reached ? c->searches : c->searches - 1;
    memcpy(c->work, near->cell, reached * sizeof *c->work);
    for (uint32_t k = 0; s.left > 0 && k < s.n && k < SEARCH_MOST && c->searched < c->used; k++, c->searched++)
        touch_each(c, c->work[k], find_near, &s);
    return s.left == 0;
}

/*
 * Do the neighbours of a cell stay connected among themselves? Then every path through the cell has one around it, and
 * its component stays whole without it. Otherwise it may fall apart.
 */
static bool holds_without(struct components *c, uint32_t i)
{
    struct near near = {.of = i};
    uint32_t reached = 1;
    touch_each(c, i, add_near, &near);
    for (uint32_t k = 0; k < reached && reached < near.n; k++)
        reached = bring_touching(c, &c->cell[near.cell[k]], near.cell, reached, near.n);
    return !near.more && (reached >= near.n || find_around(c, &near, reached));
}

static void take_out(struct components *c, uint32_t i)
{
    struct component_cell *root = &c->cell[root_of(c, i)];
    set_seed(c, i, false);
    root->own.cells--;
    if (root->harm != HARM_SPLIT)
        root->harm = holds_without(c, i) ? HARM_SHRUNK : HARM_SPLIT;
    c->cell[i].state = CELL_GONE;
    c->used--;
    if (!c->cell[i].leaving)
        c->left[c->leaving++] = i;
    c->cell[i].leaving = true;
}

bool components_remove(struct components *c, uint32_t direction, uint16_t layer)
{
    const uint32_t i = find_cell(c, direction, layer);
    if (i == COMPONENTS_NONE || c->cell[i].state != CELL_IN)
        return false;
    take_out(c, i);
    return true;
}

/* ---- settling ---- */

/* A flood on its way from `root`, with so many cells of c->work whose neighbours have not been reached yet. */
struct flood {
    uint32_t root, n;
};

static bool reach(struct components *c, uint32_t i, void *context)
{
    struct flood *f = context;
    struct component_cell *cell = c->cell, *root = &cell[f->root];
    if (cell[i].parent != COMPONENTS_NONE)
        return true;
    cell[i].parent = f->root;
    cell[i].next = root->next;
    cell[i].prev = f->root;
    cell[root->next].prev = i;
    root->next = i;
    root->own.cells++;
    root->own.seeds += cell[i].seed;
    c->work[f->n++] = i;
    return true;
}

/* Takes the cells connected to `root` into a tree of depth one and a circle of its own. */
static void flood(struct components *c, uint32_t root)
{
    struct flood f = {root, 1};
    c->cell[root].parent = c->cell[root].next = c->cell[root].prev = root;
    c->cell[root].own = (struct component){.cells = 1, .seeds = c->cell[root].seed};
    c->work[0] = root;
    while (f.n)
        touch_each(c, c->work[--f.n], reach, &f);
}

/* The component's cells that are in, in no tree any more, linked by the labels that only roots need; the first. */
static uint32_t unravel(struct components *c, uint32_t start)
{
    uint32_t chain = COMPONENTS_NONE, i = start;
    do {
        const uint32_t next = c->cell[i].next;
        if (c->cell[i].state == CELL_IN) {
            c->cell[i].parent = COMPONENTS_NONE;
            c->cell[i].own.label = chain;
            chain = i;
        }
        i = next;
    } while (i != start);
    return chain;
}

/* The component is whole: its cells that are in get a tree of depth one without those that left. */
static void shrink(struct components *c, uint32_t old_root)
{
    struct component_cell *cell = c->cell;
    const struct component old = cell[old_root].own;
    const uint32_t last = cell[old_root].prev;
    uint32_t root = COMPONENTS_NONE, i, next = old_root;
    do {
        i = next;
        next = cell[i].next;
        if (cell[i].state == CELL_IN) {
            root = root == COMPONENTS_NONE ? i : root;
            cell[i].parent = root;
        } else {
            cell[cell[i].prev].next = next;
            cell[next].prev = cell[i].prev;
            cell[i].parent = cell[i].next = cell[i].prev = i;
        }
    } while (i != last);
    cell[old_root].harm = HARM_NONE;
    if (root != COMPONENTS_NONE) {
        cell[root].own = old;
        cell[root].harm = HARM_NONE;
    }
}

static void split(struct components *c, uint32_t old_root, uint64_t now_ns)
{
    struct component_cell *cell = c->cell;
    const struct component old = cell[old_root].own;
    uint32_t best = COMPONENTS_NONE;
    cell[old_root].harm = HARM_NONE;
    for (uint32_t i = unravel(c, old_root), next; i != COMPONENTS_NONE; i = next) {
        next = cell[i].own.label;
        if (cell[i].parent != COMPONENTS_NONE)
            continue;
        flood(c, i);
        cell[i].harm = HARM_NONE;
        cell[i].own.label = ++c->labels;
        cell[i].own.t_label = now_ns;
        if (best == COMPONENTS_NONE || outranks(&cell[i].own, &cell[best].own))
            best = i;
    }
    if (best != COMPONENTS_NONE) {
        cell[best].own.label = old.label;
        cell[best].own.t_label = old.t_label;
    }
}

void components_settle(struct components *c, uint64_t now_ns)
{
    for (uint32_t k = 0; k < c->leaving; k++) {
        const uint32_t root = root_of(c, c->left[k]);
        if (c->cell[root].harm == HARM_SPLIT)
            split(c, root, now_ns);
        else if (c->cell[root].harm == HARM_SHRUNK)
            shrink(c, root);
    }
    c->searched = 0;
    while (c->leaving) {
        const uint32_t i = c->left[--c->leaving];
        c->cell[i].leaving = false;
        if (c->cell[i].state == CELL_GONE)
            free_cell(c, i);
    }
}

void components_turn(struct components *c, double turn_rad)
{
    for (uint32_t i = 0; i < c->buckets; i++)
        c->bucket[i] = COMPONENTS_NONE;
    for (uint32_t i = 0; i < c->high; i++) {
        struct component_cell *cell = &c->cell[i];
        if (cell->state == CELL_FREE) /* what has left stays in the table until it is settled */
            continue;
        cell->direction = rings_turned(c->rings, cell->direction, turn_rad);
        uint32_t *bucket = bucket_of(c, cell->direction, cell->layer);
        cell->chain = *bucket;
        *bucket = i;
    }
    c->turned = true;
}

/* The rings did not turn by whole cells alike: all that touch now are joined, and every component is flooded anew. */
static void touch_anew(struct components *c)
{
    for (uint32_t i = 0; i < c->high; i++)
        if (c->cell[i].state == CELL_IN)
            join_touching(c, i);
    for (uint32_t i = 0; i < c->high; i++) {
        if (c->cell[i].state != CELL_IN)
            continue;
        const uint32_t root = root_of(c, i);
        c->cell[root].harm = HARM_SPLIT;
        if (!c->cell[root].leaving)
            c->left[c->leaving++] = root;
        c->cell[root].leaving = true;
    }
    c->turned = false;
}

void components_begin(struct components *c)
{
    c->round++;
}

bool components_leave(struct components *c, uint32_t *at, uint32_t most)
{
    const uint32_t left = c->leaving;
    for (; *at < c->high && c->leaving - left < most; ++*at)
        if (c->cell[*at].state == CELL_IN && c->cell[*at].round != c->round)
            take_out(c, *at);
    return *at >= c->high;
}

void components_end(struct components *c, uint64_t now_ns)
{
    for (uint32_t at = 0; !components_leave(c, &at, c->room);)
        ;
    if (c->turned)
        touch_anew(c);
    components_settle(c, now_ns);
}

const struct component *components_of(struct components *c, uint32_t index)
{
    return &c->cell[root_of(c, index)].own;
}

bool components_is_root(const struct components *c, uint32_t index)
{
    return c->cell[index].state == CELL_IN && c->cell[index].parent == index;
}
