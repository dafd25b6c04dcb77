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

/* ---- cone and corridor ---- */

static void look_along(const struct obstacles_scene *scene, const struct answer_query *q, uint32_t direction,
                       double need_m, struct sight_fade *fade, struct obstacles_found *found)
{
    const struct sight_observer by = {scene->conf, scene->now, scene->place, q->near_m, need_m, fade};
    struct picture_entry e;
    struct sight s;
    if (need_m <= 0 || picture_told_m(scene->picture, direction) - scene->place->moved_m > need_m)
        return;
    sight_look(scene->picture, direction, &by, &e, &s);
    if (s.obstacle && s.near_m <= need_m)
        take(found, &s, scene);
    else if (s.hint_m < sight_less(need_m, q->near_m))
        found->hint_m = sight_less(found->hint_m, s.hint_m);
}

static enum answer_reason find_along(const struct obstacles_scene *scene, const struct answer_query *q,
                                     struct obstacles_found *found)
{
    const struct rings *rings = scene->picture->rings;
    const struct scope_view by = {scene->frame, scene->now, scene->place};
    struct sight_fade fade = {.known = false};
    struct scope scope;
    if (!scope_begin(&scope, rings, &by, q))
        return ANSWER_OUTSIDE;
    struct rings_visit visit = rings_visit(rings, scope.axis, scope.around_rad);
    while (rings_next(&visit)) {
        const struct scope_share share = scope_share(&scope, scene->picture->axis[visit.direction], visit.ring);
        look_along(scene, q, visit.direction, share.need_m, &fade, found);
    }
    return sight_keeps(rings, scope.lo_rad, scope.hi_rad) ? ANSWER_HEARD : ANSWER_OUTSIDE;
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
    return cell;
}

/* A question about a band, while directions are looked at. */
struct around {
    const struct obstacles_scene *scene;
    const struct answer_band *band;
    struct overlap_band sectors;
    struct axes axes;
    struct sight_fade fade;
    struct obstacles_found *found;
};

static void look_around(struct around *a, uint32_t ring, uint32_t direction)
{
    const struct obstacles_scene *scene = a->scene;
    const double moved_m = scene->place->moved_m;
    const struct sight_observer by = {scene->conf,     scene->now,       scene->place,
                                      a->band->near_m, a->band->reach_m, &a->fade};
    struct picture_entry e;
    struct sight s;
    sight_look_told(scene->picture, direction, &by, &e, &s);
    const bool hint = s.hint_m < sight_less(a->band->near_m, a->band->reach_m);
    if (!s.obstacle && !hint)
        return;
    struct overlap_cell cell = cell_of(scene, &a->axes, ring, direction);
    const double aside = sight_aside_rad(scene->place, (s.obstacle ? s.near_m : s.hint_m) + moved_m);
    const struct overlap_run run = overlap_run(&a->sectors, &cell, a->axes.uncertain_rad + aside);
    for (size_t k = 0; k < run.n; k++) {
        struct obstacles_found *found = &a->found[(run.at + k) % a->sectors.count];
        if (s.obstacle)
            take(found, &s, scene);
        else
            found->hint_m = sight_less(found->hint_m, s.hint_m);
    }
}

/* May a cell of the ring reach into the band, however that is tilted? */
static bool may_reach(const struct around *a, uint32_t ring)
{
    const struct rings *rings = a->scene->picture->rings;
    const double el = rings->top_rad - (ring + 0.5) * rings->height_rad,
                 most = rings->height_rad / 2 + a->axes.uncertain_rad + a->axes.tilt_rad +
                        sight_aside_rad(a->scene->place, 0) + 2 * GEO_ROUGH_RAD;
    return el + most >= a->band->lo_rad && el - most <= a->band->hi_rad;
}

static enum answer_reason find_around(const struct obstacles_scene *scene, const struct answer_band *band,
                                      struct obstacles_found *found)
{
    const struct rings *rings = scene->picture->rings;
    struct around a = {.scene = scene,
                       .band = band,
                       .sectors = {.lo_rad = band->lo_rad, .hi_rad = band->hi_rad, .count = band->count},
                       .axes = axes_of(scene, band),
                       .found = found};
    const double loose = a.axes.tilt_rad + a.axes.uncertain_rad;
    for (uint32_t ring = 0; ring < rings->n_rings; ring++)
        for (uint32_t d = rings->start[ring]; may_reach(&a, ring) && d < rings->start[ring + 1]; d++)
            if (picture_told_m(scene->picture, d) < INFINITY)
                look_around(&a, ring, d);
    return sight_keeps(rings, band->lo_rad - loose, band->hi_rad + loose) ? ANSWER_HEARD : ANSWER_OUTSIDE;
}

enum answer_reason obstacles_find(const struct obstacles_scene *scene, const struct obstacles_query *query,
                                  struct obstacles_found *found)
{
    for (size_t k = 0; k < obstacles_parts(query); k++)
        found[k] = (struct obstacles_found){.hint_m = INFINITY, .kept_m = INFINITY};
    if (!query->moves)
        return query->around ? find_around(scene, &query->band, found) : find_along(scene, &query->line, found);
    tunnel_find(scene, &query->move, found);
    return ANSWER_HEARD;
}
