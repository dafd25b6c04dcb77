/* SPDX-License-Identifier: MIT */
#include "ask.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"

#define OPEN 24 /* stretches of which nobody has said anything */

struct stretch {
    double from_m, to_m;
};

#define WORDS (ASK_RECORDS / 64)

/* What is known of a tile before record `next`, and how far it is free by all of them. */
struct work {
    struct tile_index tile;
    uint64_t out[WORDS];  /* set of the records that it does not touch; nor do its parts */
    uint64_t used[WORDS]; /* set of those that found it free ... */
    uint64_t all[WORDS];  /* ... and that do so with record `next` and those behind it */
    int next, n;
    double limit_m; /* nothing is free from there on */
    struct stretch open[OPEN];
    double free_to_m;
    bool mixed; /* its parts may be free farther */
};

/* ---- one tile ---- */

#define MIXED 16

/* Stretches of which a part of the tile may be told more; of too many the last ones are one. */
struct mixed {
    struct stretch of[MIXED];
    int n;
};

static void add_mixed(struct mixed *m, const struct water_piece *p)
{
    if (m->n == MIXED) {
        struct stretch *last = &m->of[MIXED - 1];
        *last = (struct stretch){fmin(last->from_m, p->from_m), fmax(last->to_m, p->to_m)};
    } else
        m->of[m->n++] = (struct stretch){p->from_m, p->to_m};
}

static bool is_mixed_at(const struct mixed *m, double at_m)
{
    for (int i = 0; i < m->n; i++)
        if (m->of[i].from_m <= at_m && at_m <= m->of[i].to_m)
            return true;
    return false;
}

/* The open stretches while a record is asked about them. */
struct sieve {
    struct stretch open[OPEN];
    int n;
    double limit_m;
    bool used;
    struct mixed *mixed;
};

static void keep_open(struct sieve *s, double from_m, double to_m)
{
    if (!(from_m < to_m))
        return;
    if (s->n && s->open[s->n - 1].to_m == from_m)
        s->open[s->n - 1].to_m = to_m;
    else if (s->n < OPEN)
        s->open[s->n++] = (struct stretch){from_m, to_m};
    else
        s->limit_m = fmin(s->limit_m, from_m); /* without room for it the water ends there */
}

/* Takes what the record says of one stretch. */
static void sift(struct sieve *s, const struct water_pieces *said)
{
    for (int i = 0; i < said->n; i++) {
        const struct water_piece *p = &said->piece[i];
        if (p->mixed)
            add_mixed(s->mixed, p);
        if (p->says == WATER_FREE)
            s->used = true;
        else if (p->says == WATER_NOTHING)
            keep_open(s, p->from_m, p->to_m);
        else
            s->limit_m = fmin(s->limit_m, p->from_m);
    }
}

/* What one record says of the open stretches, of those that it may touch. */
static void ask_record(const struct water_view *view, const struct water_tile *cone, const struct stretch *touched,
                       const struct work *w, struct sieve *s)
{
    struct water_pieces said;
    for (int i = 0; i < w->n && w->open[i].from_m < s->limit_m; i++) {
        const double to_m = fmin(w->open[i].to_m, s->limit_m), from_m = w->open[i].from_m;
        const double first_m = fmin(fmax(from_m, touched->from_m), to_m),
                     last_m = fmax(fmin(to_m, touched->to_m), first_m);
        keep_open(s, from_m, first_m);
        if (first_m < last_m) {
            water_decide(view, cone, first_m, last_m, &said);
            sift(s, &said);
        }
        keep_open(s, last_m, fmin(to_m, s->limit_m));
    }
}

static void take(struct work *w, const struct sieve *s, int record)
{
    w->n = s->n;
    w->limit_m = s->limit_m;
    w->used[record / 64] |= (uint64_t)s->used << (record % 64);
    memcpy(w->open, s->open, sizeof w->open);
}

/*
 * All records from w->next on. At the first of which a part of the tile may be told more, w keeps what was known before
 * it: the parts go on from there.
 */
static void pass(const struct ask *a, struct work *w)
{
    const struct water_tile cone = tiles_cone(&w->tile);
    struct work now = *w;
    struct mixed mixed = {.n = 0};
    bool parted = false;
    for (int i = w->next; i < a->n && now.n; i++) {
        struct stretch touched = {a->question.near_m, a->question.to_m};
        struct sieve s = {.limit_m = now.limit_m, .mixed = &mixed};
        if (w->out[i / 64] >> (i % 64) & 1)
            continue;
        if (!water_touches(&a->view[i], &cone, &touched.from_m, &touched.to_m)) {
            w->out[i / 64] |= UINT64_C(1) << (i % 64);
            continue;
        }
        ask_record(&a->view[i], &cone, &touched, &now, &s);
        if (mixed.n && !parted) {
            parted = true;
            w->next = i;
            w->n = now.n;
            w->limit_m = now.limit_m;
            memcpy(w->used, now.used, sizeof w->used);
            memcpy(w->open, now.open, sizeof w->open);
        }
        take(&now, &s, i);
    }
    w->free_to_m = now.n && now.open[0].from_m < now.limit_m ? now.open[0].from_m : now.limit_m;
    w->mixed = is_mixed_at(&mixed, w->free_to_m);
    memcpy(w->all, now.used, sizeof w->all);
}

/* ---- all tiles ---- */

/* Has the tile any direction of the question? */
static bool is_asked(const struct ask *a, const struct tile_index *tile)
{
    const struct water_tile cone = tiles_cone(tile);
    const double reach = a->question.half_rad + cone.half_rad;
    return reach >= GEO_PI || geo_dot(cone.v, a->question.axis) >= cos(reach) - 1e-12;
}

static void settle(struct ask *a, const struct work *w)
{
    a->best_m = fmin(a->best_m, w->free_to_m);
    for (int i = 0; i < WORDS; i++)
        a->used[i] |= w->all[i];
}

/* A tile that was passed: its parts, the worst first, where that can make the answer longer. */
static void refine(struct ask *a, const struct work *w)
{
    if (w->free_to_m >= a->best_m || !w->mixed || w->tile.level + 1 == TILES_LEVELS) {
        settle(a, w);
        return;
    }
    struct work part[4];
    int n = 0;
    for (int i = 0; i < 4; i++) {
        const struct tile_index tile = tiles_part(&w->tile, i);
        if (!is_asked(a, &tile))
            continue;
        struct work one = *w;
        one.tile = tile;
        one.limit_m = fmin(one.limit_m, a->best_m);
        pass(a, &one);
        int at = n++;
        for (; at > 0 && part[at - 1].free_to_m > one.free_to_m; at--)
            part[at] = part[at - 1];
        part[at] = one;
    }
    for (int i = 0; i < n; i++)
        refine(a, &part[i]);
}

static void start(const struct ask *a, struct work *w, const struct tile_index *root)
{
    *w = (struct work){.tile = *root, .n = 1, .limit_m = a->best_m};
    w->open[0] = (struct stretch){a->question.near_m, a->best_m};
}

static void sort(struct ask_root *root, int n)
{
    for (int gap = n / 2; gap > 0; gap /= 2)
        for (int i = gap; i < n; i++) {
            const struct ask_root one = root[i];
            int at = i;
            for (; at >= gap && root[at - gap].free_to_m > one.free_to_m; at -= gap)
                root[at] = root[at - gap];
            root[at] = one;
        }
}

/* The columns of a row of roots that the question may touch: *n of them from the one that is returned on, past the last
 * one too. */
static uint32_t columns_asked(const struct ask *a, uint32_t row, uint32_t *n)
{
    const struct tile_index first = {0, (uint16_t)row, 0};
    const struct water_tile cone = tiles_cone(&first);
    const uint32_t columns = tiles_columns(row);
    const double reach = a->question.half_rad + cone.half_rad, wide = GEO_TURN / columns;
    double az, el;
    geo_angles(a->question.axis, &az, &el);
    const double row_el = asin(-cone.v[2]);
    *n = 0;
    if (fabs(row_el - el) > reach)
        return 0;
    /* the cone's own azimuths reach asin(sin(reach) / cos(el)) to each side, unless it holds a pole */
    if (fabs(el) + reach >= GEO_PI / 2) {
        *n = columns;
        return 0;
    }
    const double aside = asin(fmin(1, sin(reach) / cos(el)));
    const int from = (int)floor((az - aside) / wide), to = (int)floor((az + aside) / wide);
    *n = (uint32_t)(to - from + 1) < columns ? (uint32_t)(to - from + 1) : columns;
    return (uint32_t)(from + (int)columns) % columns;
}

/* The first pass over a root: settled, or on the list. */
static void try_root(struct ask *a, const struct tile_index *root)
{
    struct work w;
    if (!is_asked(a, root))
        return;
    start(a, &w, root);
    pass(a, &w);
    if (w.mixed && w.free_to_m < a->best_m)
        a->root[a->roots++] = (struct ask_root){w.free_to_m, *root};
    else
        settle(a, &w);
}

void ask_begin(struct ask *a, const struct water_view *view, int n, const struct ask_question *question)
{
    a->view = view;
    a->n = n;
    a->question = *question;
    a->best_m = question->to_m;
    memset(a->used, 0, sizeof a->used);
    a->row = 0;
    a->roots = a->next = 0;
    a->sorted = false;
    a->column = columns_asked(a, 0, &a->columns_left);
}

/* The next root of the rows; false: there is none left. */
static bool next_root(struct ask *a, struct tile_index *root)
{
    while (a->columns_left == 0 && a->row + 1 < TILES_ROWS)
        a->column = columns_asked(a, ++a->row, &a->columns_left);
    if (a->columns_left == 0)
        return false;
    *root = (struct tile_index){0, (uint16_t)a->row, (uint16_t)a->column};
    a->column = (a->column + 1) % tiles_columns(a->row);
    a->columns_left--;
    return true;
}

bool ask_step(struct ask *a)
{
    struct tile_index root;
    struct work w;
    if (!a->sorted && next_root(a, &root)) {
        try_root(a, &root);
        return true;
    }
    if (!a->sorted)
        sort(a->root, a->roots);
    a->sorted = true;
    if (a->next == a->roots)
        return false;
    start(a, &w, &a->root[a->next++].tile);
    pass(a, &w);
    refine(a, &w);
    return true;
}

struct ask_answer ask_end(const struct ask *a)
{
    struct ask_answer answer = {.free_to_m = a->best_m, .oldest = -1};
    for (int i = 0; i < a->n; i++)
        if (a->used[i / 64] >> (i % 64) & 1) {
            answer.records++;
            answer.oldest = i;
        }
    return answer;
}
