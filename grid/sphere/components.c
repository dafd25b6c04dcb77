/* SPDX-License-Identifier: MIT */
#include "components.h"

/* GONE: removed, but a link of the tree until its component is settled. */
enum component_state { CELL_FREE, CELL_IN, CELL_GONE };

/* What a component suffered since it was settled. SHRUNK: cells left whose neighbours hold together without them. */
enum component_harm { HARM_NONE, HARM_SHRUNK, HARM_SPLIT };

#define NEIGHBOURS_MAX 64 /* more are met at a pole only: taken for a split */

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

/* A walk over the cells that are in and touch one. */
struct touch {
    const struct components *c;
    struct rings_run run[3];
    unsigned runs, r;
    uint32_t k, lowest, highest; /* k counts the directions of a run, twice: the layers lie in up to two buckets */
    uint32_t at;
};

static struct touch touch_begin(const struct components *c, uint32_t i)
{
    const struct component_cell *cell = &c->cell[i];
    struct touch t = {.c = c, .at = COMPONENTS_NONE};
    t.runs = rings_touching(c->rings, cell->direction, t.run);
    t.lowest = cell->layer ? cell->layer - 1u : 0;
    t.highest = cell->layer + 1u;
    return t;
}

static bool touches(const struct touch *t, const struct component_cell *cell, uint32_t direction, uint32_t group)
{
    return cell->direction == direction && cell->layer / LAYERS_PER_BUCKET == group && cell->layer >= t->lowest &&
           cell->layer <= t->highest && cell->state == CELL_IN;
}

/* The next neighbour (the cell itself among them), or COMPONENTS_NONE. */
static uint32_t touch_next(struct touch *t)
{
    const uint32_t low = t->lowest / LAYERS_PER_BUCKET, two = t->highest / LAYERS_PER_BUCKET - low; /* 0 or 1 */
    for (; t->r < t->runs; t->r++, t->k = 0) {
        for (const struct rings_run *run = &t->run[t->r]; t->k < run->n << two; t->k++) {
            const uint32_t direction = rings_in(run, t->k >> two), group = low + (t->k & two);
            uint32_t i = t->at == COMPONENTS_NONE ? *bucket_of(t->c, direction, group * LAYERS_PER_BUCKET)
                                                  : t->c->cell[t->at].chain;
            while (i != COMPONENTS_NONE && !touches(t, &t->c->cell[i], direction, group))
                i = t->c->cell[i].chain;
            t->at = i;
            if (i != COMPONENTS_NONE)
                return i;
        }
    }
    return COMPONENTS_NONE;
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

static void join_touching(struct components *c, uint32_t i)
{
    struct touch t = touch_begin(c, i);
    for (uint32_t other; (other = touch_next(&t)) != COMPONENTS_NONE;)
        join_components(c, i, other);
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

/*
 * Do the neighbours of a cell stay connected among themselves? Then every path through the cell has one around it, and
 * its component stays whole without it. Otherwise it may fall apart, unless a path goes round farther away.
 */
static bool holds_without(const struct components *c, uint32_t i)
{
    uint32_t near[NEIGHBOURS_MAX], n = 0, reached = 1;
    struct touch t = touch_begin(c, i);
    for (uint32_t other; (other = touch_next(&t)) != COMPONENTS_NONE;) {
        if (other == i)
            continue;
        if (n == NEIGHBOURS_MAX)
            return false;
        near[n++] = other;
    }
    for (uint32_t k = 0; k < reached && reached < n; k++)
        reached = bring_touching(c, &c->cell[near[k]], near, reached, n);
    return reached >= n;
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

/* Takes the cells connected to `root` into a tree of depth one and a circle of its own. */
static void flood(struct components *c, uint32_t root)
{
    struct component_cell *cell = c->cell;
    uint32_t n = 0;
    cell[root].parent = cell[root].next = cell[root].prev = root;
    cell[root].own = (struct component){.cells = 1, .seeds = cell[root].seed};
    c->work[n++] = root;
    while (n) {
        struct touch t = touch_begin(c, c->work[--n]);
        for (uint32_t i; (i = touch_next(&t)) != COMPONENTS_NONE;) {
            if (cell[i].parent != COMPONENTS_NONE)
                continue;
            cell[i].parent = root;
            cell[i].next = cell[root].next;
            cell[i].prev = root;
            cell[cell[root].next].prev = i;
            cell[root].next = i;
            cell[root].own.cells++;
            cell[root].own.seeds += cell[i].seed;
            c->work[n++] = i;
        }
    }
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
