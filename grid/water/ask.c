/* SPDX-License-Identifier: MIT */
#include "ask.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"

#define STEP_JUDGED 4096 /* stretches in one step, but for those of its last record */

/* ---- one tile ---- */

static void add_mixed(struct ask_mixed *m, const struct water_piece *p)
{
    if (m->n == ASK_MIXED) {
        struct ask_stretch *last = &m->of[ASK_MIXED - 1];
        *last = (struct ask_stretch){fmin(last->from_m, p->from_m), fmax(last->to_m, p->to_m)};
    } else
        m->of[m->n++] = (struct ask_stretch){p->from_m, p->to_m};
}

static bool is_mixed_at(const struct ask_mixed *m, double at_m)
{
    for (int i = 0; i < m->n; i++)
        if (m->of[i].from_m <= at_m && at_m <= m->of[i].to_m)
            return true;
    return false;
}

/* The open stretches while a record is asked about them. */
struct sieve {
    struct ask_stretch open[ASK_OPEN];
    int n;
    double limit_m;
    bool used;
    int judged;
    struct ask_mixed *mixed;
};

static void keep_open(struct sieve *s, double from_m, double to_m)
{
    if (!(from_m < to_m))
        return;
    if (s->n && s->open[s->n - 1].to_m == from_m)
        s->open[s->n - 1].to_m = to_m;
    else if (s->n < ASK_OPEN)
        s->open[s->n++] = (struct ask_stretch){from_m, to_m};
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
static void ask_record(const struct water_view *view, const struct water_tile *cone,
                       const struct ask_stretch *touched, const struct ask_tile *w, struct sieve *s)
{
    struct water_pieces said;
    for (int i = 0; i < w->n && w->open[i].from_m < s->limit_m; i++) {
        const double to_m = fmin(w->open[i].to_m, s->limit_m), from_m = w->open[i].from_m;
        const double first_m = fmin(fmax(from_m, touched->from_m), to_m),
                     last_m = fmax(fmin(to_m, touched->to_m), first_m);
        keep_open(s, from_m, first_m);
        if (first_m < last_m) {
            water_decide(view, cone, first_m, last_m, &said);
            s->judged += said.judged;
            sift(s, &said);
        }
        keep_open(s, last_m, fmin(to_m, s->limit_m));
    }
}

static void take(struct ask_tile *w, const struct sieve *s, int record)
{
    w->n = s->n;
    w->limit_m = s->limit_m;
    w->used[record / 64] |= (uint64_t)s->used << (record % 64);
    memcpy(w->open, s->open, sizeof w->open);
}

/* ---- records that overlap in time ---- */

/* Has another sensor's record found the tile free with beams that may be older than the newest of this one? */
static bool is_contested(const struct ask *a, const struct ask_tile *w, int record)
{
    const struct water_record *r = a->view[record].record;
    for (int i = 0; i < record; i++) {
        const struct water_record *by = a->view[i].record;
        if ((w->used[i / 64] >> (i % 64) & 1) && by->t_ns < r->newest_ns && by->sensor != r->sensor)
            return true;
    }
    return false;
}

/* A row of a head stands where its newest beam does, and older ones of it have freed what this record may end. */
static void contest(const struct ask *a, const struct water_tile *cone, int record,
                    const struct ask_stretch *touched, struct sieve *s)
{
    struct water_pieces said;
    const double to_m = fmin(touched->to_m, s->limit_m);
    if (touched->from_m >= to_m)
        return;
    water_decide(&a->view[record], cone, touched->from_m, to_m, &said);
    s->judged += said.judged;
    for (int i = 0; i < said.n; i++)
        if (said.piece[i].says == WATER_ENDED) {
            s->limit_m = fmin(s->limit_m, said.piece[i].from_m);
            if (said.piece[i].mixed)
                add_mixed(s->mixed, &said.piece[i]);
        }
}

/* Is nothing open any more, nor contested? */
static bool is_said(const struct ask *a, const struct ask_tile *w, int record)
{
    if (w->n)
        return false;
    for (int i = 0; i < record; i++)
        if ((w->used[i / 64] >> (i % 64) & 1) && a->view[i].record->t_ns < a->view[record].record->newest_ns)
            return false; /* records come from the newest on: of those behind, none is newer than this one */
    return true;
}

static void begin_pass(struct ask *a, const struct ask_tile *w)
{
    a->pass.tile = a->pass.now = *w;
    a->pass.mixed.n = 0;
    a->pass.record = w->next;
    a->pass.parted = false;
}

/* At the first record of which a part of the tile may be told more, the tile keeps what was known before it: the parts
 * go on from there. */
static void part_at(struct ask_tile *w, const struct ask_tile *now, int record)
{
    w->next = record;
    w->n = now->n;
    w->limit_m = now->limit_m;
    memcpy(w->used, now->used, sizeof w->used);
    memcpy(w->open, now->open, sizeof w->open);
}

static void pass_record(struct ask *a, const struct water_tile *cone, int i)
{
    struct ask_pass *p = &a->pass;
    struct ask_stretch touched = {a->question.near_m, a->question.to_m};
    struct sieve s = {.limit_m = p->now.limit_m, .mixed = &p->mixed};
    a->judged++;
    if (p->tile.out[i / 64] >> (i % 64) & 1)
        return;
    if (!water_touches(&a->view[i], cone, &touched.from_m, &touched.to_m)) {
        p->tile.out[i / 64] |= UINT64_C(1) << (i % 64);
        return;
    }
    ask_record(&a->view[i], cone, &touched, &p->now, &s);
    if (is_contested(a, &p->now, i))
        contest(a, cone, i, &touched, &s);
    a->judged += s.judged;
    if (p->mixed.n && !p->parted) {
        p->parted = true;
        part_at(&p->tile, &p->now, i);
    }
    take(&p->now, &s, i);
}

/* The records from the next one on; false: there are more than fit into this step. */
static bool end_pass(struct ask *a)
{
    struct ask_pass *p = &a->pass;
    struct ask_tile *w = &p->tile;
    const struct ask_tile *now = &p->now;
    const struct water_tile cone = tiles_cone(&w->tile);
    for (; p->record < a->n && !is_said(a, now, p->record); p->record++) {
        if (a->judged >= STEP_JUDGED)
            return false;
        pass_record(a, &cone, p->record);
    }
    w->free_to_m = now->n && now->open[0].from_m < now->limit_m ? now->open[0].from_m : now->limit_m;
    w->mixed = is_mixed_at(&p->mixed, w->free_to_m);
    memcpy(w->all, now->used, sizeof w->all);
    return true;
}

/* ---- all tiles ---- */

/* Has the tile any direction of the question? */
static bool is_asked(const struct ask *a, const struct tile_index *tile)
{
    const struct water_tile cone = tiles_cone(tile);
    const double reach = a->question.half_rad + cone.half_rad;
    return reach >= GEO_PI || geo_dot(cone.v, a->question.axis) >= cos(reach) - 1e-12;
}

static void settle(struct ask *a, const struct ask_tile *w)
{
    a->best_m = fmin(a->best_m, w->free_to_m);
    for (int i = 0; i < ASK_WORDS; i++)
        a->used[i] |= w->all[i];
}

/* A tile that was passed: its parts are asked, where that can make the answer longer. */
static void open_tile(struct ask *a, const struct ask_tile *w)
{
    if (w->free_to_m >= a->best_m || !w->mixed || w->tile.level + 1 == TILES_LEVELS) {
        settle(a, w);
        return;
    }
    struct ask_level *level = &a->level[a->levels++];
    level->whole = *w;
    level->tried = level->n = level->next = 0;
}

static void begin_part(struct ask *a, struct ask_level *level)
{
    struct ask_tile one = level->whole;
    one.tile = tiles_part(&level->whole.tile, level->tried++);
    if (!is_asked(a, &one.tile))
        return;
    one.limit_m = fmin(one.limit_m, a->best_m);
    begin_pass(a, &one);
    a->pass.of = ASK_PART;
}

/* A part that was passed, to its place among the others. */
static void take_part(struct ask *a)
{
    struct ask_level *level = &a->level[a->levels - 1];
    const struct ask_tile *one = &a->pass.tile;
    int at = level->n++;
    for (; at > 0 && level->part[at - 1].free_to_m > one->free_to_m; at--)
        level->part[at] = level->part[at - 1];
    level->part[at] = *one;
}

/* All parts of a tile, and then in turn the parts of these. */
static void refine(struct ask *a)
{
    struct ask_level *level = &a->level[a->levels - 1];
    if (level->tried < 4)
        begin_part(a, level);
    else if (level->next < level->n)
        open_tile(a, &level->part[level->next++]);
    else
        a->levels--;
}

static void begin_root(struct ask *a, const struct tile_index *root)
{
    struct ask_tile w = {.tile = *root, .n = 1, .limit_m = a->best_m};
    w.open[0] = (struct ask_stretch){a->question.near_m, a->best_m};
    begin_pass(a, &w);
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

/* After the first pass over a root: settled, or on the list. */
static void list_root(struct ask *a)
{
    const struct ask_tile *w = &a->pass.tile;
    if (w->mixed && w->free_to_m < a->best_m)
        a->root[a->roots++] = (struct ask_root){w->free_to_m, w->tile};
    else
        settle(a, w);
}

void ask_begin(struct ask *a, const struct water_view *view, int n, const struct ask_question *question)
{
    a->view = view;
    a->n = n;
    a->question = *question;
    a->best_m = question->to_m;
    memset(a->used, 0, sizeof a->used);
    a->row = 0;
    a->roots = a->next = a->levels = 0;
    a->pass.of = ASK_NO_TILE;
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

/* The next tile, if it is one of the question; false: there is none left. */
static bool begin_tile(struct ask *a)
{
    struct tile_index root;
    if (a->levels) {
        refine(a);
        return true;
    }
    if (!a->sorted && next_root(a, &root)) {
        if (is_asked(a, &root)) {
            begin_root(a, &root);
            a->pass.of = ASK_ROOT;
        }
        return true;
    }
    if (!a->sorted)
        sort(a->root, a->roots);
    a->sorted = true;
    if (a->next == a->roots)
        return false;
    begin_root(a, &a->root[a->next++].tile);
    a->pass.of = ASK_ROOT_AGAIN;
    return true;
}

static void end_tile(struct ask *a)
{
    if (a->pass.of == ASK_ROOT)
        list_root(a);
    else if (a->pass.of == ASK_ROOT_AGAIN)
        open_tile(a, &a->pass.tile);
    else
        take_part(a);
    a->pass.of = ASK_NO_TILE;
}

bool ask_step(struct ask *a)
{
    for (a->judged = 0; a->judged < STEP_JUDGED;) {
        if (a->pass.of != ASK_NO_TILE) {
            if (!end_pass(a))
                return true;
            end_tile(a);
        } else if (!begin_tile(a))
            return false;
    }
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
