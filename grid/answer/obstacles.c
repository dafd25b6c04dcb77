/* SPDX-License-Identifier: MIT */
#include "obstacles.h"

#include <math.h>

#include "overlap.h"
#include "tunnel.h"

static void take(struct obstacles_found *f, const struct sight *s, const struct obstacles_scene *scene)
{
    if (f->any && s->near_m >= f->near_m)
        return;
    f->any = true;
    f->near_m = s->near_m;
    f->range_m = sight_more(s->near_m, s->obstacle->range_m - scene->place->moved_m);
    f->sd_m = s->obstacle->sd_m;
    f->confidence = 1 / (1 + exp(-s->logodds));
    f->age_s = sight_seconds(scene->now->now_ns, s->obstacle->t_echo_ns);
}

/* ---- what adds nothing ---- */

/* Nearer than this an obstacle and a weak echo add to what was found. */
struct bounds {
    double near_m, hint_m;
};

/* Of a part that asks about weak echoes up to hint_m. What is behind an obstacle changes nothing. */
static struct bounds bounds_of(const struct obstacles_found *f, double hint_m)
{
    const double near_m = f->any ? f->near_m : (double)INFINITY;
    return (struct bounds){near_m, sight_less(near_m, sight_less(hint_m, f->hint_m))};
}

/* No obstacle of a direction begins nearer to the vehicle than near_m, and nothing than told_m. */
struct glance {
    double near_m, told_m;
};

static const struct glance says_nothing = {INFINITY, INFINITY};

/* A fraction of a look. An obstacle's log-odds only fade, so what is too little to block will not. */
static struct glance glance_at(const struct obstacles_scene *scene, uint32_t direction)
{
    const struct picture *p = scene->picture;
    const uint64_t number = picture_now(scene->picture);
    const struct picture_side *side = &p->side[number & 1];
    const uint64_t first = picture_word(side, direction, PICTURE_ODDS(0)),
                   second = picture_word(side, direction, PICTURE_ODDS(1)),
                   last = picture_word(side, direction, offsetof(struct picture_entry, hint_m));
    if (!picture_still(scene->picture, number))
        return (struct glance){0, 0};
    if (!(first | second | last))
        return says_nothing;
    struct glance g = says_nothing;
    const uint64_t odds[PICTURE_OBSTACLES] = {first, second};
    for (int i = 0; i < PICTURE_OBSTACLES && sight_half(odds[i], 0) > 0; i++) {
        const double edge_m = sight_more(0, (double)sight_half(odds[i], 1) - scene->place->moved_m);
        g.told_m = sight_less(g.told_m, edge_m);
        if (sight_half(odds[i], 0) > p->blocked_logodds)
            g.near_m = sight_less(g.near_m, edge_m);
    }
    const double hint_m = (double)sight_half(last, 0);
    if (hint_m > 0)
        g.told_m = sight_less(g.told_m, sight_more(0, hint_m - scene->place->moved_m));
    return g;
}

static bool adds(const struct glance *g, const struct bounds *b)
{
    return g->near_m < b->near_m || g->told_m < b->hint_m;
}

/* The same of a look. */
static bool adds_as_seen(const struct sight *s, const struct bounds *b)
{
    return (s->obstacle && s->near_m < b->near_m) || s->hint_m < b->hint_m;
}

/* ---- cone and corridor ---- */

/* A question about one, while directions are looked at. */
struct along {
    const struct obstacles_scene *scene;
    const struct answer_query *query;
    double beyond_m; /* no direction is asked so far */
    struct scope scope;
    struct sight_fade fade;
    struct obstacles_found *found;
};

/* None reaches beyond the corner of a corridor, which is farther by as much as the vehicle may be off. */
static double farthest_m(const struct answer_query *q, double moved_m)
{
    return q->corridor ? hypot(q->distance_m + moved_m, q->radius_m + 2 * moved_m) : q->distance_m;
}

static struct bounds bounds_along(const struct along *a)
{
    struct bounds b = bounds_of(a->found, a->query->near_m);
    b.near_m = sight_less(b.near_m, a->beyond_m);
    return b;
}

static void look_along(struct along *a, uint32_t ring, uint32_t direction)
{
    const struct obstacles_scene *scene = a->scene;
    const struct answer_query *q = a->query;
    const struct sight_observer by = {scene->now, scene->place, &a->fade};
    const struct bounds bounds = bounds_along(a);
    const struct glance g = glance_at(scene, direction);
    struct picture_entry e;
    struct sight s;
    if (!adds(&g, &bounds))
        return;
    sight_look(scene->picture, direction, &by, &e, &s);
    if (!adds_as_seen(&s, &bounds))
        return;
    const double need_m = scope_share(&a->scope, scene->picture->axis[direction], ring).need_m;
    if (s.obstacle && s.near_m <= need_m)
        take(a->found, &s, scene);
    if (s.hint_m < sight_less(need_m, q->near_m))
        a->found->hint_m = sight_less(a->found->hint_m, s.hint_m);
}

static enum answer_reason find_along(const struct obstacles_scene *scene, const struct answer_query *q,
                                     struct obstacles_found *found)
{
    const struct rings *rings = scene->picture->rings;
    const struct scope_view by = {scene->frame, scene->now, scene->place};
    const double reach_m = farthest_m(q, scene->place->moved_m);
    struct along a = {.scene = scene, .query = q, .beyond_m = nextafter(reach_m, INFINITY), .found = found};
    if (!scope_begin(&a.scope, rings, &by, q))
        return ANSWER_OUTSIDE;
    struct rings_visit visit = rings_visit(rings, a.scope.axis, a.scope.around_rad);
    while (rings_next(&visit))
        look_along(&a, visit.ring, visit.direction);
    return sight_keeps(rings, a.scope.lo_rad, a.scope.hi_rad) ? ANSWER_HEARD : ANSWER_OUTSIDE;
}

/* ---- bands ---- */

/* How the axes of a band lie in the grid's. */
struct axes {
    bool turned;        /* they are not the grid's ... */
    double attitude[4]; /* ... but this, in them */
    double axes_rad;    /* asked in NED: azimuth of the grid's azimuth 0 */
    double tilt_rad;    /* the angle between their verticals */
    double uncertain_rad;
};

static struct axes axes_of(const struct obstacles_scene *scene, const struct answer_band *band)
{
    struct axes a = {.axes_rad = band->ned ? scene->frame->axes_rad : 0};
    a.turned = !band->ned && sight_attitude(scene->frame, scene->now, band->ned, a.attitude);
    a.tilt_rad = a.turned ? sight_tilt(scene->now->pose.attitude) : 0;
    a.uncertain_rad = (a.turned ? scene->place->turned_rad : 0) + scene->place->adrift_rad * sin(a.tilt_rad);
    return a;
}

/* No corner of a cell of the ring lies so far to the side of its middle, ... */
static double half_arc(const struct rings *rings, uint32_t ring)
{
    return rings_width(rings, ring) / 2 * fmin(1, rings->cos_el[ring] + rings->height_rad / 2);
}

/* ... nor so far from it. */
static double reach_of(const struct rings *rings, uint32_t ring)
{
    return hypot(half_arc(rings, ring), rings->height_rad / 2);
}

/* In tilted axes a cell is turned about its middle by up to asin(sin(tilt) / level), and its edges bend otherwise: so
 * far beside an upright one lie its corners. */
static double turned_by(const struct axes *axes, const struct rings *rings, uint32_t ring, double level)
{
    const double reach = reach_of(rings, ring), arc = half_arc(rings, ring), sine = sin(axes->tilt_rad);
    if (!axes->turned || sine >= level || arc * arc * axes->tilt_rad >= level * level)
        return axes->turned ? reach : 0;
    return fmin(reach, reach * asin(sine / level) + arc * arc * axes->tilt_rad / (level * level));
}

/* A cell of the ring is so wide to each side, in azimuth at that level of tilted axes. */
static double half_width(const struct rings *rings, uint32_t ring, double level)
{
    const double sine = sin(half_arc(rings, ring)), edge = level - rings->height_rad / 2;
    return sine < edge ? fmax(asin(sine / edge), rings_width(rings, ring) / 2) : GEO_PI;
}

static struct overlap_cell cell_of(const struct obstacles_scene *scene, const struct axes *axes, uint32_t ring,
                                   uint32_t direction)
{
    const struct rings *rings = scene->picture->rings;
    const double width = rings_width(rings, ring);
    struct overlap_cell cell = {.az_rad = (direction - rings->start[ring] + 0.5) * width + axes->axes_rad,
                                .el_rad = rings->top_rad - (ring + 0.5) * rings->height_rad,
                                .level = rings->cos_el[ring],
                                .half_az_rad = width / 2 + scene->place->adrift_rad,
                                .half_el_rad = rings->height_rad / 2,
                                .exact = true};
    if (axes->turned) {
        double v[3];
        quat_rotate_inverse(axes->attitude, scene->picture->axis[direction], v);
        overlap_middle(&cell, v);
    }
    if (axes->turned && axes->tilt_rad > 0)
        cell.half_az_rad = fmin(half_width(rings, ring, cell.level) + scene->place->adrift_rad, GEO_PI);
    return cell;
}

/* A question about a band, while directions are looked at. */
struct around {
    const struct obstacles_scene *scene;
    const struct answer_band *band;
    double hint_m; /* weak echoes count up to here */
    struct overlap_band sectors;
    struct axes axes;
    struct sight_fade fade;
    struct obstacles_found *found;
    struct bounds bounds[ANSWER_SECTORS_MAX]; /* of what was found in each */
};

/* The sectors that something may lie in which is at_m from the vehicle and in that cell, or up to spread_rad beside. */
static struct overlap_run sectors_of(const struct around *a, struct overlap_cell *cell, double at_m,
                                     double spread_rad)
{
    const struct sight_place *place = a->scene->place;
    return overlap_run(&a->sectors, cell,
                       a->axes.uncertain_rad + sight_aside_rad(place, at_m + place->moved_m) + spread_rad);
}

static size_t sector_in(const struct around *a, const struct overlap_run *run, size_t k)
{
    const size_t at = run->at + k;
    return at < a->sectors.count ? at : at - a->sectors.count;
}

/* The middle of a direction, in the axes asked about. */
static void middle_of(const struct around *a, uint32_t direction, double v[3])
{
    const double *axis = a->scene->picture->axis[direction], turn = a->axes.axes_rad;
    v[0] = cos(turn) * axis[0] - sin(turn) * axis[1];
    v[1] = sin(turn) * axis[0] + cos(turn) * axis[1];
    v[2] = axis[2];
    if (a->axes.turned)
        quat_rotate_inverse(a->axes.attitude, v, v);
}

static void add_obstacle(struct around *a, const struct overlap_run *run, const struct sight *s,
                         uint32_t direction)
{
    for (size_t k = 0; k < run->n; k++) {
        const size_t at = sector_in(a, run, k);
        struct obstacles_found *f = &a->found[at];
        if (!f->any || s->near_m < f->near_m)
            middle_of(a, direction, f->at);
        take(f, s, a->scene);
        a->bounds[at] = bounds_of(&a->found[at], a->hint_m);
    }
}

static void add_hint(struct around *a, const struct overlap_run *run, double hint_m)
{
    for (size_t k = 0; k < run->n; k++) {
        const size_t at = sector_in(a, run, k);
        a->found[at].hint_m = sight_less(a->found[at].hint_m, hint_m);
        a->bounds[at] = bounds_of(&a->found[at], a->hint_m);
    }
}

static void look_around(struct around *a, uint32_t ring, uint32_t direction, const struct bounds *bounds)
{
    const struct obstacles_scene *scene = a->scene;
    const struct sight_observer by = {scene->now, scene->place, &a->fade};
    struct picture_entry e;
    struct sight s;
    sight_look(scene->picture, direction, &by, &e, &s);
    if (!adds_as_seen(&s, bounds))
        return;
    struct overlap_cell cell = cell_of(scene, &a->axes, ring, direction);
    const double turned = turned_by(&a->axes, scene->picture->rings, ring, cell.level);
    if (s.obstacle && s.near_m < bounds->near_m) {
        const struct overlap_run run = sectors_of(a, &cell, s.near_m, turned);
        add_obstacle(a, &run, &s, direction);
    }
    if (s.hint_m < bounds->hint_m) { /* nearer than the obstacle it may lie in more sectors than that */
        const struct overlap_run run = sectors_of(a, &cell, s.hint_m, turned);
        add_hint(a, &run, s.hint_m);
    }
}

#define TOGETHER 16 /* neighbours in a ring of which it is told once which sectors they touch */

/* What adds to none of the sectors that n directions from `first` on may touch, the nearest of them told_m away: from
 * each one's middle the others' lie on a way along the ring. */
static struct bounds bounds_around(const struct around *a, uint32_t ring, uint32_t first, uint32_t n,
                                   double told_m)
{
    const struct rings *rings = a->scene->picture->rings;
    struct overlap_cell cell = cell_of(a->scene, &a->axes, ring, first + n / 2);
    const double spread = n / 2 * rings_width(rings, ring) * rings->cos_el[ring] + GEO_ROUGH_RAD +
                          (a->axes.turned ? reach_of(rings, ring) : 0);
    const struct overlap_run run = sectors_of(a, &cell, told_m, spread);
    struct bounds all = {0, 0};
    for (size_t k = 0; k < run.n; k++) {
        const struct bounds *one = &a->bounds[sector_in(a, &run, k)];
        all.near_m = sight_more(all.near_m, one->near_m);
        all.hint_m = sight_more(all.hint_m, one->hint_m);
    }
    return all;
}

static void look_together(struct around *a, uint32_t ring, uint32_t first, uint32_t n)
{
    struct glance g[TOGETHER];
    double told_m = INFINITY;
    for (uint32_t i = 0; i < n; i++) {
        g[i] = glance_at(a->scene, first + i);
        told_m = sight_less(told_m, g[i].told_m);
    }
    if (told_m == INFINITY)
        return;
    const struct bounds bounds = bounds_around(a, ring, first, n, told_m);
    for (uint32_t i = 0; i < n; i++)
        if (adds(&g[i], &bounds))
            look_around(a, ring, first + i, &bounds);
}

/* May a cell of the ring reach into the band, however that is tilted? */
static bool may_reach(const struct around *a, uint32_t ring)
{
    const struct rings *rings = a->scene->picture->rings;
    const double el = rings->top_rad - (ring + 0.5) * rings->height_rad,
                 most = rings->height_rad / 2 + a->axes.uncertain_rad + a->axes.tilt_rad +
                        sight_aside_rad(a->scene->place, 0) + 2 * GEO_ROUGH_RAD +
                        (a->axes.turned ? reach_of(rings, ring) : 0);
    return el + most >= a->band->lo_rad && el - most <= a->band->hi_rad;
}

static void look_in_ring(struct around *a, uint32_t ring)
{
    const uint32_t *start = a->scene->picture->rings->start;
    for (uint32_t d = start[ring]; d < start[ring + 1]; d += TOGETHER)
        look_together(a, ring, d, start[ring + 1] - d < TOGETHER ? start[ring + 1] - d : TOGETHER);
}

#define RINGS_APART 13

/* Not one ring after the other: above a level bottom each would be nearer than all before it, and add to every
 * sector. */
static enum answer_reason find_around(const struct obstacles_scene *scene, const struct answer_band *band,
                                      struct obstacles_found *found)
{
    const struct rings *rings = scene->picture->rings;
    struct around a = {.scene = scene,
                       .band = band,
                       .hint_m = sight_less(band->near_m, band->reach_m),
                       .sectors = {.lo_rad = band->lo_rad,
                                   .hi_rad = band->hi_rad,
                                   .from_rad = band->from_rad,
                                   .width_rad = band->width_rad,
                                   .count = band->count},
                       .axes = axes_of(scene, band),
                       .found = found};
    const double loose = a.axes.tilt_rad + a.axes.uncertain_rad;
    for (size_t k = 0; k < band->count; k++)
        a.bounds[k] = bounds_of(&found[k], a.hint_m);
    for (uint32_t first = 0; first < RINGS_APART; first++)
        for (uint32_t ring = first; ring < rings->n_rings; ring += RINGS_APART)
            if (may_reach(&a, ring))
                look_in_ring(&a, ring);
    return sight_keeps(rings, band->lo_rad - loose, band->hi_rad + loose) ? ANSWER_HEARD : ANSWER_OUTSIDE;
}

/* Of a weak echo behind an obstacle it depends on the order of looks whether it was found. */
static void leave_out_behind(struct obstacles_found *f)
{
    if (f->any && f->hint_m >= f->near_m)
        f->hint_m = INFINITY;
}

enum answer_reason obstacles_find(const struct obstacles_scene *scene, const struct obstacles_query *query,
                                  struct obstacles_found *found)
{
    for (size_t k = 0; k < obstacles_parts(query); k++)
        found[k] = (struct obstacles_found){.hint_m = INFINITY, .kept_m = INFINITY};
    if (query->moves) {
        tunnel_find(scene, &query->move, found);
        return ANSWER_HEARD;
    }
    const enum answer_reason kept =
        query->around ? find_around(scene, &query->band, found) : find_along(scene, &query->line, found);
    for (size_t k = 0; k < obstacles_parts(query); k++)
        leave_out_behind(&found[k]);
    return kept;
}
