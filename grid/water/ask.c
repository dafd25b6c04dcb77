/* SPDX-License-Identifier: MIT */
#include "ask.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"

#define STEP_JUDGED 4096 /* stretches in one step, but for those of its last record */
#define PARTS_LIKE  16   /* to look at so many parts of the question costs as much as one */

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
    struct ask_stretch touched = {p->tile.asked.from_m, p->now.limit_m};
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
    w->measure_m = w->free_to_m >= w->asked.to_m
                       ? w->goal_m
                       : fmin(question_measure(&a->question, &cone, w->free_to_m), w->goal_m);
    w->mixed = is_mixed_at(&p->mixed, w->free_to_m);
    memcpy(w->all, now->used, sizeof w->all);
    return true;
}

/* ---- all tiles ---- */

/* So far may the question still be free in a part of the run. */
static double best_in(const struct ask *a, const struct question_run *run)
{
    double best_m = 0;
    for (size_t k = 0; k < run->n; k++)
        best_m = fmax(best_m, a->part[(run->at + k) % a->question.parts].best_m);
    return best_m;
}

static void settle(struct ask *a, const struct ask_tile *w)
{
    const struct water_tile cone = tiles_cone(&w->tile);
    for (size_t k = 0; k < w->run.n; k++) {
        struct ask_part *part = &a->part[(w->run.at + k) % a->question.parts];
        for (int i = 0; i < ASK_WORDS; i++)
            part->used[i] |= w->all[i];
        if (w->measure_m >= part->best_m)
            continue;
        part->best_m = w->measure_m;
        memcpy(part->at, cone.v, sizeof part->at);
        part->tile = w->tile;
        part->at_m = w->free_to_m;
    }
    a->over = a->question.asked.stops && a->part[0].best_m < a->question.asked.to_m;
}

/* A tile that was passed: its parts are asked, where that can make the answer longer. */
static void open_tile(struct ask *a, const struct ask_tile *w)
{
    if (w->measure_m >= best_in(a, &w->run) || !w->mixed || w->tile.level + 1 == a->question.asked.levels) {
        settle(a, w);
        return;
    }
    struct ask_level *level = &a->level[a->levels++];
    level->whole = *w;
    level->tried = level->n = level->next = 0;
}

/* What of the tile is asked, for the question up to goal_m; false: nothing. */
static bool aim(struct ask *a, struct ask_tile *w, double goal_m)
{
    const struct water_tile cone = tiles_cone(&w->tile);
    w->run = question_run(&a->question, &cone);
    a->judged += 1 + (int)w->run.n / PARTS_LIKE;
    w->goal_m = fmin(goal_m, best_in(a, &w->run));
    return w->run.n > 0 && question_stretch(&a->question, &cone, w->goal_m, &w->asked);
}

/* Leaves out what is open before from_m. */
static void open_from(struct ask_tile *w, double from_m)
{
    int n = 0;
    for (int i = 0; i < w->n; i++)
        if (w->open[i].to_m > from_m)
            w->open[n++] = (struct ask_stretch){fmax(w->open[i].from_m, from_m), w->open[i].to_m};
    w->n = n;
}

static void begin_part(struct ask *a, struct ask_level *level)
{
    const struct ask_stretch whole = level->whole.asked;
    struct ask_tile one = level->whole;
    one.tile = tiles_part(&level->whole.tile, level->tried++);
    if (!aim(a, &one, level->whole.goal_m))
        return;
    one.asked = (struct ask_stretch){fmax(one.asked.from_m, whole.from_m), fmin(one.asked.to_m, whole.to_m)};
    if (one.asked.from_m >= one.asked.to_m)
        return;
    one.limit_m = fmin(one.limit_m, one.asked.to_m);
    open_from(&one, one.asked.from_m);
    begin_pass(a, &one);
    a->pass.of = ASK_PART;
}

/* A part that was passed, to its place among the others. */
static void take_part(struct ask *a)
{
    struct ask_level *level = &a->level[a->levels - 1];
    const struct ask_tile *one = &a->pass.tile;
    int at = level->n++;
    for (; at > 0 && level->part[at - 1].measure_m > one->measure_m; at--)
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

/* False: nothing of it is asked. */
static bool begin_root(struct ask *a, const struct tile_index *root)
{
    struct ask_tile w = {.tile = *root, .n = 1};
    if (!aim(a, &w, INFINITY))
        return false;
    w.limit_m = w.asked.to_m;
    w.open[0] = w.asked;
    begin_pass(a, &w);
    return true;
}

static void sort(struct ask_root *root, int n)
{
    for (int gap = n / 2; gap > 0; gap /= 2)
        for (int i = gap; i < n; i++) {
            const struct ask_root one = root[i];
            int at = i;
            for (; at >= gap && root[at - gap].measure_m > one.measure_m; at -= gap)
                root[at] = root[at - gap];
            root[at] = one;
        }
}

/* After the first pass over a root: settled, or on the list. */
static void list_root(struct ask *a)
{
    const struct ask_tile *w = &a->pass.tile;
    if (w->mixed && w->measure_m < best_in(a, &w->run))
        a->root[a->roots++] = (struct ask_root){w->measure_m, w->tile};
    else
        settle(a, w);
}

void ask_begin(struct ask *a, const struct water_view *view, int n, const struct ask_question *question)
{
    a->view = view;
    a->n = n;
    question_begin(&a->question, question);
    for (size_t k = 0; k < a->question.parts; k++)
        a->part[k] = (struct ask_part){.best_m = question->to_m};
    a->probe = 0;
    a->row = 0;
    a->roots = a->next = a->levels = 0;
    a->pass.of = ASK_NO_TILE;
    a->sorted = a->over = false;
    a->column = question_columns(&a->question, 0, &a->columns_left);
}

static void begin_probe(struct ask *a, const double v[3])
{
    const struct tile_index tile = tiles_at(v, a->question.asked.levels - 1);
    if (begin_root(a, &tile))
        a->pass.of = ASK_PROBE;
}

/* The next root of the rows; false: there is none left. */
static bool next_root(struct ask *a, struct tile_index *root)
{
    while (a->columns_left == 0 && a->row + 1 < TILES_ROWS)
        a->column = question_columns(&a->question, ++a->row, &a->columns_left);
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
    double v[3];
    if (a->levels) {
        refine(a);
        return true;
    }
    if (question_probe(&a->question, a->probe, v)) {
        a->probe++;
        begin_probe(a, v);
        return true;
    }
    if (!a->sorted && next_root(a, &root)) {
        if (begin_root(a, &root))
            a->pass.of = ASK_ROOT;
        return true;
    }
    if (!a->sorted)
        sort(a->root, a->roots);
    a->sorted = true;
    if (a->next == a->roots)
        return false;
    if (begin_root(a, &a->root[a->next++].tile))
        a->pass.of = ASK_ROOT_AGAIN;
    return true;
}

static void end_tile(struct ask *a)
{
    if (a->pass.of == ASK_ROOT)
        list_root(a);
    else if (a->pass.of == ASK_PROBE)
        settle(a, &a->pass.tile);
    else if (a->pass.of == ASK_ROOT_AGAIN)
        open_tile(a, &a->pass.tile);
    else
        take_part(a);
    a->pass.of = ASK_NO_TILE;
}

bool ask_step(struct ask *a)
{
    for (a->judged = 0; a->judged < STEP_JUDGED && !a->over; a->judged++) {
        if (a->pass.of != ASK_NO_TILE) {
            if (!end_pass(a))
                return true;
            end_tile(a);
        } else if (!begin_tile(a))
            return false;
    }
    return !a->over;
}

double ask_begins_m(struct ask *a, const struct water_view *view, int n, const struct tile_index *tile,
                    const struct ask_stretch *within, double *ends_m)
{
    const struct ask_tile whole = {
        .tile = *tile, .asked = *within, .limit_m = within->to_m, .n = 1, .open = {*within}};
    const struct ask_tile *now = &a->pass.now;
    const struct water_tile cone = tiles_cone(tile);
    a->view = view;
    begin_pass(a, &whole);
    for (; a->pass.record < n && !is_said(a, now, a->pass.record); a->pass.record++)
        pass_record(a, &cone, a->pass.record);
    *ends_m = now->limit_m < within->to_m ? now->limit_m : INFINITY;
    const bool at_once = now->n == 0 || now->open[0].from_m > within->from_m;
    const double begin_m = at_once ? within->from_m : now->open[0].to_m;
    return begin_m < now->limit_m ? begin_m : INFINITY;
}

struct ask_answer ask_end(const struct ask *a, size_t part)
{
    const struct ask_part *p = &a->part[part];
    struct ask_answer answer = {.free_to_m = p->best_m,
                                .at = {p->at[0], p->at[1], p->at[2]},
                                .at_m = p->at_m,
                                .tile = p->tile,
                                .oldest = -1};
    for (int i = 0; i < a->n; i++)
        if (p->used[i / 64] >> (i % 64) & 1) {
            answer.records++;
            answer.oldest = i;
        }
    return answer;
}
