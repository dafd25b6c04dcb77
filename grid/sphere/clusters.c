/* SPDX-License-Identifier: MIT */
#include "clusters.h"

#include <math.h>
#include <string.h>

#include "grid/geometry.h"
#include "relax.h"
#include "view.h"

#define TURN_BINS   1440 /* of azimuth, for the largest gap: as fine as the finest grid */
#define MEMBER_ODDS 0.5  /* share of an obstacle's log-odds from which a cell is a member */
#define AS_NEAR_M   1e-3
#define TREND_NS    1000000000u

/* What a look finds in a direction. */
enum look { LOOKED_AT = 1, HOLDS_MEMBER = 2, COUNTED = 4 };

/* Of a look, in their order. */
enum stage { STAGE_NONE, STAGE_PUT, STAGE_LEAVE, STAGE_MEASURE };

#define BEGUN_MAX 4

struct clusters {
    struct components components;
    struct sphere_cell *cell; /* by the components' index */
    uint32_t max_cells;       /* of the grid */
    double blocked_logodds;
    /* the look: */
    uint64_t now_ns;
    enum stage stage;
    uint32_t at;          /* the next direction, or cell, of its stage */
    uint32_t begun;       /* so often it was, because the grid had moved */
    uint64_t moves;       /* of the grid, as it began ... */
    double centre_m[3];   /* ... with its centre there */
    uint32_t raised_left; /* room for cells that only their neighbours make */
    uint32_t all, n, n_before;
    struct cluster list[CLUSTERS_MAX];
    struct cluster before[CLUSTERS_MAX]; /* of the look from which the next trend is counted */
    uint8_t *then;                       /* [directions] set of enum look at that look ... */
    uint8_t *today;                      /* ... and at this one */
    uint64_t t_before_ns;
    double centre_before_m[3];
    double axes_rad; /* of the grid at the last look */
    /* of earlier looks: no cell blocks any more, yet some are still there */
    struct cluster fading[CLUSTERS_GONE_MAX];
    uint32_t n_fading;
    struct cluster_gone gone[CLUSTERS_GONE_MAX]; /* a ring */
    uint32_t n_gone;                             /* ever */
    uint32_t grown;                       /* of the cluster measured: directions that are new to all clusters */
    uint32_t heard;                       /* its cells with echoes of their own */
    double known_near_m;                  /* its near edge where somebody had looked */
    uint64_t turn[(TURN_BINS + 63) / 64]; /* azimuths of one cluster, a bit each */
};

static void enter_stage(struct clusters *c, enum stage stage)
{
    c->stage = stage;
    c->at = 0;
}

static size_t rounded(size_t n)
{
    return (n + 63) / 64 * 64;
}

/* Cells of this look and of the one before stand side by side for a moment: what moved by a cell keeps its label. */
static uint32_t room_for(uint32_t max_cells)
{
    return 2 * max_cells;
}

size_t clusters_bytes(const struct rings *rings, uint32_t max_cells)
{
    return rounded(sizeof(struct clusters)) + 2 * rounded(rings->n) +
           rounded(room_for(max_cells) * sizeof(struct sphere_cell)) +
           rounded(components_bytes(room_for(max_cells)));
}

struct clusters *clusters_init(void *memory, const struct rings *rings, uint32_t max_cells, double blocked_logodds)
{
    struct clusters *c = memory;
    char *at = (char *)memory + rounded(sizeof *c);
    memset(c, 0, sizeof *c);
    c->cell = (struct sphere_cell *)(void *)at;
    at += rounded(room_for(max_cells) * sizeof(struct sphere_cell));
    c->then = (uint8_t *)at;
    memset(at, 0, rings->n);
    at += rounded(rings->n);
    c->today = (uint8_t *)at;
    at += rounded(rings->n);
    components_init(&c->components, at, rings, room_for(max_cells));
    c->max_cells = max_cells;
    c->blocked_logodds = blocked_logodds;
    return c;
}

/* The grid's axes may have followed the course since the last look: what is remembered by direction goes along. */
static void follow_axes(struct clusters *c, double axes_rad)
{
    const struct rings *rings = c->components.rings;
    const double turn_rad = axes_rad - c->axes_rad;
    if (turn_rad == 0)
        return;
    components_turn(&c->components, turn_rad);
    for (uint32_t d = 0; d < rings->n; d++)
        c->today[rings_turned(rings, d, turn_rad)] = c->then[d];
    memcpy(c->then, c->today, rings->n);
    c->axes_rad = axes_rad;
}

/* Cells on their way into the components. */
struct putting {
    struct clusters *c;
    uint32_t direction;
    uint32_t cells; /* looked at */
};

static void put_cell(void *context, const struct sphere_cell *cell)
{
    struct putting *p = context;
    struct clusters *c = p->c;
    const bool raised = cell->echoes == 0;
    p->cells++;
    if (cell->logodds <= MEMBER_ODDS * c->blocked_logodds || (raised && c->raised_left == 0))
        return;
    c->raised_left -= raised;
    c->today[p->direction] |= HOLDS_MEMBER;
    const bool seed = !cell->pending && cell->logodds > c->blocked_logodds;
    uint32_t i = components_put(&c->components, p->direction, cell->layer, seed, c->now_ns);
    if (i == COMPONENTS_NONE) { /* looks that were dropped have left theirs */
        components_end(&c->components, c->now_ns);
        i = components_put(&c->components, p->direction, cell->layer, seed, c->now_ns);
    }
    if (i != COMPONENTS_NONE)
        c->cell[i] = *cell;
}

static void put_direction(struct putting *p, const struct sphere *s, double mu)
{
    struct sphere_cell cell;
    p->c->today[p->direction] = sphere_pinged(s, p->direction) ? LOOKED_AT : 0;
    if (mu > 0)
        relax_cells(s, p->direction, mu, p->c->now_ns, put_cell, p);
    for (uint32_t k = 0; !(mu > 0) && sphere_cell(s, p->direction, k, p->c->now_ns, &cell); k++)
        put_cell(p, &cell);
}

/* All cells have to be of one grid: its centre and its axes may move between two steps. */
static void begin_putting(struct clusters *c, const struct sphere *s, const struct sphere_stats *stats)
{
    c->moves = stats->recentred + stats->turned;
    sphere_centre(s, c->centre_m);
    c->raised_left = c->max_cells - stats->cells;
    c->at = 0;
    c->begun++;
    follow_axes(c, sphere_axes(s));
    components_begin(&c->components);
}

static void put_some(struct clusters *c, const struct sphere *s)
{
    const double mu = sphere_cluster_relaxation(s);
    const uint32_t n = c->components.rings->n;
    struct putting p = {.c = c};
    struct sphere_stats stats;
    sphere_stats(s, &stats);
    if (c->begun == 0 || c->moves != stats.recentred + stats.turned)
        begin_putting(c, s, &stats);
    const uint32_t room = c->begun < BEGUN_MAX ? CLUSTERS_STEP : UINT32_MAX;
    for (; c->at < n && p.cells < room; c->at++) {
        p.direction = c->at;
        put_direction(&p, s, mu);
        p.cells++; /* an empty one takes time, too */
    }
    if (c->at == n)
        enter_stage(c, STAGE_LEAVE);
}

/* ---- measuring one ---- */

static void mark_azimuths(struct clusters *c, uint32_t ring, uint32_t direction)
{
    const struct rings *rings = c->components.rings;
    const double bins = TURN_BINS * (rings_width(rings, ring) / GEO_TURN);
    const double from = (direction - rings->start[ring]) * bins;
    /* edges that meet a bin's edge but for rounding do not reach into the next */
    const uint32_t last = (uint32_t)ceil(from + bins - 1e-6);
    for (uint32_t b = (uint32_t)(from + 1e-6), n; b < last; b += n) { /* the part of it in one word */
        n = 64 - b % 64 < last - b ? 64 - b % 64 : last - b;
        c->turn[b / 64] |= ~0ull >> (64 - n) << b % 64;
    }
}

/* Azimuths alike from `bin` on, as many as are in one word: at least 1. */
static uint32_t run_from(const struct clusters *c, uint32_t bin, bool *marked)
{
    const uint64_t word = c->turn[bin / 64] >> bin % 64;
    const uint32_t end = bin / 64 * 64 + 64 < TURN_BINS ? bin / 64 * 64 + 64 : TURN_BINS;
    *marked = word & 1;
    const uint64_t differ = *marked ? ~word : word;
    const uint32_t alike = differ ? (uint32_t)__builtin_ctzll(differ) : 64;
    return alike < end - bin ? alike : end - bin;
}

/* The turn without the largest gap: between the least and the greatest azimuth would fail at north. */
static void measure_width(const struct clusters *c, struct cluster *k)
{
    uint32_t gap = 0, longest = 0, end = 0;
    bool marked;
    for (uint32_t b = 0, n; b < 2 * TURN_BINS; b += n) {
        n = run_from(c, b % TURN_BINS, &marked);
        gap = marked ? 0 : gap + n;
        if (gap > longest) {
            longest = gap;
            end = b + n;
        }
    }
    k->from_rad = geo_wrap(end % TURN_BINS * (GEO_TURN / TURN_BINS) + c->axes_rad);
    k->width_rad = (TURN_BINS - longest) * (GEO_TURN / TURN_BINS);
}

static void measure_cell(struct clusters *c, uint32_t i, struct cluster *k)
{
    const struct sphere_cell *cell = &c->cell[i];
    const struct rings *rings = c->components.rings;
    const uint32_t direction = c->components.cell[i].direction;
    const uint32_t ring = rings_ring(rings, direction);
    const double top = rings->top_rad - ring * rings->height_rad;
    mark_azimuths(c, ring, direction);
    if (c->then[direction] == LOOKED_AT && !(c->today[direction] & COUNTED))
        c->grown++;
    if (c->then[direction] && cell->echoes)
        c->known_near_m = fmin(c->known_near_m, cell->near_m);
    c->today[direction] |= COUNTED;
    k->high_rad = fmax(k->high_rad, top);
    k->low_rad = fmin(k->low_rad, top - rings->height_rad);
    k->logodds = fmax(k->logodds, cell->logodds);
    if (cell->echoes == 0)
        return; /* its neighbours' evidence; it had no echo itself */
    c->heard++;
    k->echoes += cell->echoes;
    k->appeared += (cell->flags & SPHERE_NEW) != 0;
    k->updated += (cell->flags & SPHERE_UPDATED) != 0;
    k->missed += (cell->flags & SPHERE_MISSED) != 0;
    k->locked += (cell->flags & SPHERE_LOCKED) != 0;
    k->far_m = fmax(k->far_m, geo_length(cell->point_m));
    k->t_first_ns = cell->t_first_ns < k->t_first_ns ? cell->t_first_ns : k->t_first_ns;
    k->t_echo_ns = cell->t_echo_ns > k->t_echo_ns ? cell->t_echo_ns : k->t_echo_ns;
    for (int a = 0; a < 3; a++)
        k->centre_m[a] += cell->point_m[a];
    /* an echo stands in every cell of its beam's opening: of those as near, the level one */
    const bool as_near = fabs(cell->near_m - k->near_m) < AS_NEAR_M;
    if (as_near ? fabs(cell->point_m[2]) < fabs(k->nearest_m[2]) : cell->near_m < k->near_m)
        memcpy(k->nearest_m, cell->point_m, sizeof k->nearest_m);
    k->near_m = fmin(k->near_m, cell->near_m);
}

static void measure_extent(struct clusters *c, uint32_t root, struct cluster *k)
{
    const struct component *own = components_of(&c->components, root);
    *k = (struct cluster){.label = own->label,
                          .cells = own->cells,
                          .seeds = own->seeds,
                          .t_label_ns = own->t_label,
                          .t_first_ns = UINT64_MAX,
                          .near_m = INFINITY,
                          .low_rad = INFINITY,
                          .high_rad = -INFINITY};
    memset(c->turn, 0, sizeof c->turn);
    c->grown = c->heard = 0;
    c->known_near_m = INFINITY;
    uint32_t i = root;
    do {
        measure_cell(c, i, k);
        i = c->components.cell[i].next;
    } while (i != root);
    for (int a = 0; a < 3; a++)
        k->centre_m[a] /= c->heard;
    k->approach_mps = c->known_near_m; /* until set_trend */
    k->growth_directions_ps = c->grown;
    measure_width(c, k);
}

/* ---- the list ---- */

static bool nearer(const struct cluster *a, const struct cluster *b)
{
    return a->near_m < b->near_m || (a->near_m == b->near_m && a->label < b->label);
}

/* Into its place in the list, whose last gives way when it is full. */
static void enlist(struct clusters *c, const struct cluster *k)
{
    if (c->n == CLUSTERS_MAX && !nearer(k, &c->list[c->n - 1]))
        return;
    uint32_t at = c->n < CLUSTERS_MAX ? c->n++ : c->n - 1;
    for (; at > 0 && nearer(k, &c->list[at - 1]); at--)
        c->list[at] = c->list[at - 1];
    c->list[at] = *k;
}

/*
 * Over too short a time a trend is noise: what was found before stands. What is seen because somebody looks there for
 * the first time is no trend. Until then the cluster's approach and growth are what was measured: its near edge where
 * somebody had looked, and directions that are new.
 */
static void set_trend(const struct clusters *c, struct cluster *k, bool long_ago, double dt_s)
{
    const double known_near_m = k->approach_mps, grown = k->growth_directions_ps;
    k->approach_mps = 0;
    k->growth_directions_ps = long_ago ? grown / dt_s : 0;
    for (uint32_t i = 0; i < c->n_before; i++) {
        const struct cluster *old = &c->before[i];
        if (old->label != k->label)
            continue;
        if (!long_ago)
            k->growth_directions_ps = old->growth_directions_ps;
        if (!long_ago || known_near_m < INFINITY)
            k->approach_mps = long_ago ? (old->near_m - known_near_m) / dt_s : old->approach_mps;
    }
}

static bool is_listed(const struct clusters *c, uint32_t label)
{
    for (uint32_t i = 0; i < c->n; i++)
        if (c->list[i].label == label)
            return true;
    return false;
}

/* Clusters that are in the list no more. */
struct missing {
    uint32_t n;
    struct cluster old[CLUSTERS_MAX + CLUSTERS_GONE_MAX]; /* places as of now */
    bool fading[CLUSTERS_MAX + CLUSTERS_GONE_MAX];        /* still a component, in which no cell blocks any more */
    uint64_t labels[16];                                  /* a bit for the lowest of each: most others have none */
};

static void add_missing(struct missing *m, const struct cluster *old, const double moved_m[3])
{
    struct cluster *k = &m->old[m->n];
    *k = *old;
    for (int a = 0; a < 3; a++)
        k->nearest_m[a] += moved_m[a];
    m->fading[m->n++] = false;
    m->labels[k->label / 64 % 16] |= 1ull << k->label % 64;
}

static void find_fading(struct clusters *c, struct missing *m)
{
    COMPONENTS_EACH(&c->components, root)
    {
        const struct component *own = components_of(&c->components, root);
        if (own->seeds || !(m->labels[own->label / 64 % 16] >> own->label % 64 & 1))
            continue;
        for (uint32_t i = 0; i < m->n; i++)
            m->fading[i] |= m->old[i].label == own->label;
    }
}

/* `old` is in the list no more: it still fades, or is gone, or has joined something. */
static void judge(struct clusters *c, const struct sphere *s, const struct cluster *old, bool fading)
{
    if (fading && c->n_fading < CLUSTERS_GONE_MAX) {
        c->fading[c->n_fading++] = *old;
        return;
    }
    struct cluster_gone g = {
        .label = old->label, .cells = old->cells, .t_gone_ns = c->now_ns, .t_echo_ns = old->t_echo_ns};
    memcpy(g.place_m, old->nearest_m, sizeof g.place_m);
    g.why = vanish_why(s, g.place_m, g.t_echo_ns, c->now_ns, MEMBER_ODDS * c->blocked_logodds, c->blocked_logodds);
    if (g.why != VANISH_NOT)
        c->gone[c->n_gone++ % CLUSTERS_GONE_MAX] = g;
}

/* Which of the clusters before are in the list no more, and why. */
static void find_gone(struct clusters *c, const struct sphere *s)
{
    struct missing missing = {.n = 0};
    double moved_m[3];
    sphere_centre(s, moved_m);
    for (int a = 0; a < 3; a++)
        moved_m[a] = c->centre_before_m[a] - moved_m[a];
    for (uint32_t i = 0; i < c->n_fading; i++)
        if (!is_listed(c, c->fading[i].label))
            add_missing(&missing, &c->fading[i], moved_m);
    for (uint32_t i = 0; i < c->n_before; i++)
        if (!is_listed(c, c->before[i].label))
            add_missing(&missing, &c->before[i], moved_m);
    c->n_fading = 0;
    if (missing.n)
        find_fading(c, &missing);
    for (uint32_t i = 0; i < missing.n; i++)
        judge(c, s, &missing.old[i], missing.fading[i]);
}

const struct cluster_gone *clusters_gone(const struct clusters *c, uint32_t k)
{
    return k < c->n_gone && k < CLUSTERS_GONE_MAX ? &c->gone[(c->n_gone - 1 - k) % CLUSTERS_GONE_MAX] : NULL;
}

/* ---- a look ---- */

void clusters_begin(struct clusters *c, uint64_t now_ns)
{
    c->now_ns = now_ns;
    c->begun = c->n = c->all = 0;
    enter_stage(c, STAGE_PUT);
}

static void leave_some(struct clusters *c)
{
    if (!components_leave(&c->components, &c->at, CLUSTERS_STEP))
        return;
    components_end(&c->components, c->now_ns);
    enter_stage(c, STAGE_MEASURE);
}

#define CLUSTER_WORK 16 /* so many cells take as long to measure as what is done once for each cluster */

/* False: that was the last. */
static bool measure_some(struct clusters *c)
{
    const uint32_t high = c->components.high;
    for (uint32_t work = 0; c->at < high && work < CLUSTERS_STEP; c->at++) {
        struct cluster k;
        if (!components_is_root(&c->components, c->at) || !components_of(&c->components, c->at)->seeds)
            continue;
        measure_extent(c, c->at, &k);
        enlist(c, &k);
        c->all++;
        work += CLUSTER_WORK + k.cells;
    }
    return c->at < high;
}

static void end_look(struct clusters *c, const struct sphere *s)
{
    const bool long_ago = c->now_ns >= c->t_before_ns + TREND_NS;
    const double dt_s = (double)(c->now_ns - c->t_before_ns) * 1e-9;
    for (uint32_t i = 0; i < c->n; i++)
        set_trend(c, &c->list[i], long_ago, dt_s);
    if (long_ago) {
        if (c->all == c->n) /* else one that is missing may only have made room in the list */
            find_gone(c, s);
        memcpy(c->centre_before_m, c->centre_m, sizeof c->centre_m);
        memcpy(c->before, c->list, c->n * sizeof *c->list);
        c->n_before = c->n;
        c->t_before_ns = c->now_ns;
        memcpy(c->then, c->today, c->components.rings->n);
    }
    enter_stage(c, STAGE_NONE);
}

bool clusters_step(struct clusters *c, const struct sphere *s)
{
    if (c->stage == STAGE_PUT)
        put_some(c, s);
    else if (c->stage == STAGE_LEAVE)
        leave_some(c);
    else if (c->stage == STAGE_MEASURE && !measure_some(c))
        end_look(c, s);
    return c->stage != STAGE_NONE;
}

uint32_t clusters_list(const struct clusters *c, const struct cluster **list, uint32_t *all)
{
    *list = c->list;
    *all = c->all;
    return c->n;
}
