/* SPDX-License-Identifier: MIT */
#include "decide.h"

#include <math.h>
#include <stddef.h>

#include "grid/geometry.h"

#define ROUNDING_M 1e-6

/* A point of the tile's axis in the sensor's frame. */
struct point {
    double t_m; /* from the vehicle */
    double ahead, right, up;
    double level, range; /* its distance from the sensor's vertical axis, from the sensor */
};

/* The tile against the record. */
struct deciding {
    const struct water_view *view;
    const struct water_tile *tile;
    double v[3]; /* ahead, right, up */
    double half_rad;
    double lever_m; /* the sensor is so far from the vehicle */
    double grid_m;  /* ranges are divided at its multiples */
    struct water_pieces *out;
};

/* Of a wide tile a short stretch is seldom told apart from the next: its parts are asked where that matters. */
static double grid_of(const struct water_tile *tile)
{
    return tile->half_rad > 0.04   ? 4 * WATER_GRID_M
           : tile->half_rad > 0.02 ? 2 * WATER_GRID_M
           : tile->half_rad > 0.01 ? WATER_GRID_M
                                   : WATER_GRID_M / 4;
}

static struct deciding begin(const struct water_view *view, const struct water_tile *tile)
{
    struct deciding k = {.view = view,
                         .tile = tile,
                         .half_rad = tile->half_rad,
                         .lever_m = geo_length(view->at_m),
                         .grid_m = grid_of(tile)};
    for (int i = 0; i < 3; i++)
        k.v[i] = (i < 2 ? 1 : -1) * geo_dot(tile->v, view->record->axis[i]);
    return k;
}

static struct point point_at(const struct deciding *k, double t_m)
{
    const double *at = k->view->at_m;
    const double ahead = at[0] + t_m * k->v[0], right = at[1] + t_m * k->v[1], up = t_m * k->v[2] - at[2];
    const double level2 = ahead * ahead + right * right;
    return (struct point){t_m, ahead, right, up, sqrt(level2), sqrt(level2 + up * up)};
}

static bool is_ended(const struct water_pieces *out)
{
    return out->n && out->piece[out->n - 1].says == WATER_ENDED;
}

/* The next piece; what stands behind an end does not count. Without room for it the water ends there. */
static void add(struct water_pieces *out, const struct water_piece *next)
{
    struct water_piece *last = out->n ? &out->piece[out->n - 1] : NULL;
    if (last && last->says == next->says && last->mixed == next->mixed)
        last->to_m = next->to_m;
    else if (out->n < WATER_PIECES)
        out->piece[out->n++] = *next;
    else {
        last->says = WATER_ENDED;
        last->mixed = true;
    }
}

/* ---- where a stretch lies in the image ---- */

struct span {
    double low, high;
};

static void take(struct span *s, double x)
{
    s->low = x < s->low ? x : s->low;
    s->high = x > s->high ? x : s->high;
}

/* Tangents of angles that reach atan(tau) farther on both sides; past a right angle infinite. */
static struct span wider(struct span s, double tau)
{
    const double low = 1 + s.low * tau, high = 1 - s.high * tau;
    return (struct span){low > 0 ? (s.low - tau) / low : -INFINITY, high > 0 ? (s.high + tau) / high : INFINITY};
}

/* Tangent of the angle under which a ball of radius_m is seen from so far; negative: from within. */
static double tan_of_ball(double radius_m, double away_m)
{
    return away_m > radius_m ? radius_m / sqrt(away_m * away_m - radius_m * radius_m) : -1;
}

/* A stretch with all the water of the tile around it. */
struct thick {
    struct point a, b;
    double aside_m,
        up_m;       /* for all that is known the tile's water is no farther from its axis to the sides, up ... */
    double along_m; /* ... and along the beams, whose ranges no turn changes */
    double close_m, far_m; /* from the sensor, at the least and at the most */
};

/* The least distance from the origin of the points from + t along, t in [0, most]. */
static double least_away(const double *from, const double *along, int n, double most)
{
    double against = 0, size = 0, sum = 0;
    for (int i = 0; i < n; i++) {
        against -= from[i] * along[i];
        size += along[i] * along[i];
    }
    const double t = size > 0 ? fmin(fmax(against / size, 0), most) : 0;
    for (int i = 0; i < n; i++)
        sum += (from[i] + t * along[i]) * (from[i] + t * along[i]);
    return sqrt(sum);
}

/*
 * By how much a point of the tile may be nearer to the sensor than the axis at the same t, or farther. With w the
 * difference of their directions, |P|^2 - |A|^2 is 2 t at.w, for both are t from the vehicle: nothing where the sensor
 * is there as well.
 */
static double nearer_m(const struct deciding *k, double t_m, double close_m)
{
    const double wide_m = t_m * k->half_rad, both_m = close_m - wide_m / 2;
    return both_m > k->lever_m ? wide_m * k->lever_m / both_m : wide_m;
}

static struct thick thick_of(const struct deciding *k, const struct point *a, const struct point *b)
{
    const double from[3] = {a->ahead, a->right, a->up};
    const double close_m = least_away(from, k->v, 3, b->t_m - a->t_m), far_m = fmax(a->range, b->range);
    const double wide_m = b->t_m * k->half_rad + ROUNDING_M, *spread_m = k->view->record->spread_m;
    return (struct thick){.a = *a,
                          .b = *b,
                          .aside_m = k->view->margin_m + wide_m + k->view->margin_rad * far_m + spread_m[1],
                          .up_m = k->view->lift_m + wide_m + k->view->lift_rad * far_m + spread_m[2],
                          .along_m = k->view->margin_m + nearer_m(k, b->t_m, close_m) + spread_m[0] + ROUNDING_M,
                          .close_m = close_m,
                          .far_m = far_m};
}

/* Tangents of the axis' azimuths; false: it may have all of them. */
static bool axis_azimuths(const struct thick *s, struct span *out)
{
    if (s->a.ahead <= 0 || s->b.ahead <= 0)
        return false;
    *out = (struct span){INFINITY, -INFINITY};
    take(out, s->a.right / s->a.ahead);
    take(out, s->b.right / s->b.ahead);
    return true;
}

/* Tangents of its elevations. up / level has one extremum along a line at the most: where its derivative, which is
 * linear in t but for a positive factor, is 0. */
static bool axis_elevations(const struct deciding *k, const struct thick *s, struct span *out)
{
    if (s->a.level <= 0 || s->b.level <= 0)
        return false;
    *out = (struct span){INFINITY, -INFINITY};
    take(out, s->a.up / s->a.level);
    take(out, s->b.up / s->b.level);
    const double level2 = s->a.level * s->a.level, along = s->a.ahead * k->v[0] + s->a.right * k->v[1];
    const double steep = k->v[0] * k->v[0] + k->v[1] * k->v[1];
    const double slope = k->v[2] * level2 - s->a.up * along, bend = s->a.up * steep - k->v[2] * along;
    if (bend != 0 && slope / bend > 0 && slope / bend < s->b.t_m - s->a.t_m) {
        const struct point turn = point_at(k, s->a.t_m + slope / bend);
        if (turn.level <= 0)
            return false;
        take(out, turn.up / turn.level);
    }
    return true;
}

/* Tangents of the azimuths; false: all of them, for all that is known. */
static bool azimuths(const struct deciding *k, const struct thick *s, struct span *out)
{
    const double from[2] = {s->a.ahead, s->a.right};
    const double tau = tan_of_ball(s->aside_m, least_away(from, k->v, 2, s->b.t_m - s->a.t_m));
    if (tau < 0 || !axis_azimuths(s, out))
        return false;
    *out = wider(*out, tau);
    return true;
}

/* What lies level_m nearer or farther than the axis, which is at least least_m away, and is as high, is seen steeper or
 * less steeply by this. */
static struct span shifted(struct span s, double level_m, double least_m)
{
    const double steeper = least_m / (least_m - level_m), flatter = least_m / (least_m + level_m);
    return (struct span){s.low * (s.low < 0 ? steeper : flatter), s.high * (s.high > 0 ? steeper : flatter)};
}

static bool elevations(const struct deciding *k, const struct thick *s, struct span *out)
{
    const double from[2] = {s->a.ahead, s->a.right}, level_m = k->view->level_m;
    const double least_m = least_away(from, k->v, 2, s->b.t_m - s->a.t_m);
    const double tau = tan_of_ball(s->up_m, s->close_m - level_m);
    if (tau < 0 || least_m <= level_m || !axis_elevations(k, s, out))
        return false;
    *out = wider(shifted(*out, level_m, least_m), tau);
    return true;
}

/* What of the image a stretch may touch. */
struct touched {
    struct water_part part;
    bool any;         /* some of it */
    bool left, right; /* none of the stretch lies beyond it on that side, ... */
    bool upright;     /* ... above or below */
};

/* Does all of the stretch lie in it? */
static bool is_inside(const struct touched *t)
{
    return t->left && t->right && t->upright;
}

/* None of it lies where the head came from; it may lie where it went on to, which the next row shows. */
static bool begins_inside(const struct deciding *k, const struct touched *t)
{
    return k->view->next && t->upright && (k->view->record->sense > 0 ? t->left : t->right);
}

/* None of it lies where the head went on to. */
static bool ends_inside(const struct deciding *k, const struct touched *t)
{
    return k->view->record->sense > 0 ? t->right : t->left;
}

static void find_part(const double *between, int n, const struct span *s, int part[2])
{
    part[0] = water_image_find(between, n, s->low);
    part[1] = water_image_find(between, n, s->high);
}

static struct touched touch(const struct deciding *k, const struct thick *s)
{
    const struct water_image *image = &k->view->record->image;
    const int columns = image->columns, rows = image->rows;
    struct touched t = {.part = {{0, columns - 1}, {0, rows - 1}}, .any = true};
    struct span az = {-INFINITY, INFINITY}, el = az;
    if (s->a.ahead < -s->aside_m && s->b.ahead < -s->aside_m) {
        t.any = false;
        return t;
    }
    const bool aimed = azimuths(k, s, &az), level = elevations(k, s, &el);
    if (aimed) {
        find_part(image->tan_az, columns, &az, t.part.column);
        t.any = az.high >= image->tan_az[0] && az.low <= image->tan_az[columns];
        t.left = az.low >= image->tan_az[0];
        t.right = az.high <= image->tan_az[columns];
    }
    if (level) {
        find_part(image->tan_el, rows, &el, t.part.row);
        t.any = t.any && el.high >= image->tan_el[0] && el.low <= image->tan_el[rows];
        t.upright = el.low >= image->tan_el[0] && el.high <= image->tan_el[rows];
    }
    t.upright = t.upright && aimed;
    return t;
}

/* ---- what every part of a stretch touches ---- */

/* Of a span of the axis what lies within atan(tau) of all of it; low > high: nothing does. */
static struct span common(struct span s, double tau)
{
    const double low = 1 + s.high * tau, high = 1 - s.low * tau;
    return (struct span){low > 0 ? (s.high - tau) / low : -INFINITY, high > 0 ? (s.low + tau) / high : INFINITY};
}

/* How far the tile's water is from its axis in every part of the stretch, as seen from the sensor. */
static double least_tan(const struct deciding *k, const struct thick *s, double off_m, double turned_rad,
                        double away_m)
{
    return tan_of_ball(off_m + s->a.t_m * k->half_rad + turned_rad * s->close_m, away_m);
}

/* Is no part of the stretch aimed: is it all behind the sensor, or may it, for all that is known, be at any azimuth? */
static bool is_never_aimed(const struct thick *s, double tau_az)
{
    return tau_az < 0 || (s->a.ahead <= 0 && s->b.ahead <= 0);
}

/* left, right, upright: of what every part of the stretch touches all is in the image. any: they all touch `part` of
 * it. */
static struct touched touched_by_all(const struct deciding *k, const struct thick *s)
{
    const struct water_image *image = &k->view->record->image;
    const double *spread_m = k->view->record->spread_m;
    struct touched t = {.left = true, .right = true, .upright = true};
    struct span az, el;
    const double tau_az =
        least_tan(k, s, k->view->margin_m + spread_m[1], k->view->margin_rad, fmax(s->a.level, s->b.level));
    const double tau_el = least_tan(k, s, k->view->lift_m + spread_m[2], k->view->lift_rad, s->far_m);
    if (is_never_aimed(s, tau_az) || tau_el < 0)
        return (struct touched){.any = false};
    if (!axis_azimuths(s, &az) || !axis_elevations(k, s, &el))
        return t;
    az = common(az, tau_az);
    el = common(el, tau_el);
    if (az.low > az.high || el.low > el.high)
        return t;
    t.left = az.low >= image->tan_az[0];
    t.right = az.high <= image->tan_az[image->columns];
    t.upright = el.low >= image->tan_el[0] && el.high <= image->tan_el[image->rows];
    t.any = az.high >= image->tan_az[0] && az.low <= image->tan_az[image->columns] &&
            el.high >= image->tan_el[0] && el.low <= image->tan_el[image->rows];
    find_part(image->tan_az, image->columns, &az, t.part.column);
    find_part(image->tan_el, image->rows, &el, t.part.row);
    return t;
}

/* ---- the decision ---- */

/* So far is anything free by it. */
static double keeps_m(const struct deciding *k)
{
    return k->view->keeps_m > 0 ? k->view->keeps_m : INFINITY;
}

/* Is what the stretch touches of the image free where it may be? */
static bool is_free_in(const struct deciding *k, const struct thick *s, const struct water_cell *cell)
{
    return s->close_m - s->along_m >= cell->from * WATER_UNIT_M &&
           s->far_m + s->along_m <= fmin(cell->least * WATER_UNIT_M, keeps_m(k));
}

/*
 * Is a stretch that begins inside a row free in the next ones as well, up to one in which it ends? None of them need
 * hold it wholly. A thing in it, wherever the vehicle drifted meanwhile, was on one side of the beam when the first row
 * began and on the other when the last one ended. So a beam passed it, for through a row nothing slips, and two rows
 * that follow each other have beams in common. The later a row, the less is it made smaller by drift.
 */
static bool goes_on(const struct deciding *k, const struct thick *s)
{
    for (const struct water_view *view = k->view->next; view && !view->lost; view = view->next) {
        const struct deciding later = begin(view, k->tile);
        const struct point a = point_at(&later, s->a.t_m), b = point_at(&later, s->b.t_m);
        const struct thick there = thick_of(&later, &a, &b);
        const struct touched t = touch(&later, &there);
        if (!t.upright)
            return false;
        const struct water_cell cell = water_image_of(&view->record->image, &t.part);
        if (t.any && !is_free_in(&later, &there, &cell))
            return false;
        if (ends_inside(&later, &t))
            return true;
    }
    return false;
}

/* What is said of a stretch as a whole; mixed: parts of it may be told otherwise. */
static struct water_piece judge(const struct deciding *k, const struct thick *s)
{
    const struct water_record *r = k->view->record;
    struct water_piece piece = {s->a.t_m, s->b.t_m, WATER_NOTHING, false};
    const double nearest_m = s->close_m - s->along_m, farthest_m = s->far_m + s->along_m;
    const struct touched t = touch(k, s);
    if (!t.any)
        return piece;
    const struct water_cell cell = water_image_of(&r->image, &t.part);
    const bool inside = is_inside(&t);
    const bool one = t.part.column[0] == t.part.column[1] && t.part.row[0] == t.part.row[1];
    const double most_m = cell.most * WATER_UNIT_M,
                 ends_m = cell.ends == WATER_NO_END ? INFINITY : cell.ends * WATER_UNIT_M;
    if (is_free_in(k, s, &cell) && (inside || (begins_inside(k, &t) && goes_on(k, s)))) {
        piece.says = k->view->lost ? WATER_NOTHING : WATER_FREE;
        return piece;
    }
    if (inside && one && nearest_m > ends_m) {
        piece.says = WATER_ENDED;
        return piece;
    }
    const bool may_end = farthest_m > ends_m;
    const bool may_free = nearest_m < fmin(most_m, keeps_m(k)) && farthest_m > r->image.near_m;
    piece.says = may_end ? WATER_ENDED : WATER_NOTHING;
    piece.mixed = may_end || may_free;
    return piece;
}

/* May a part of a stretch that is mixed be told otherwise than the whole? Not where what all of them touch is in the
 * way of each: then only smaller tiles may. */
static bool is_divided(const struct deciding *k, const struct thick *s, const struct water_piece *whole)
{
    const struct touched all = touched_by_all(k, s);
    struct water_cell cell = {.least = UINT16_MAX, .ends = WATER_NO_END};
    if (all.any)
        cell = water_image_of(&k->view->record->image, &all.part);
    const bool may_free = (is_inside(&all) || begins_inside(k, &all)) && s->close_m <= cell.least * WATER_UNIT_M &&
                          s->far_m >= cell.from * WATER_UNIT_M;
    const bool all_end = cell.ends != WATER_NO_END && s->close_m > cell.ends * WATER_UNIT_M;
    return may_free || (whole->says == WATER_ENDED && !all_end);
}

/* The roundest multiple of the grid between two ranges; negative: there is none. */
static double between(double grid_m, double from_m, double to_m)
{
    const long first = (long)floor(from_m / grid_m) + 1;
    long n = (long)ceil(to_m / grid_m) - 1;
    if (n < first)
        return -1;
    while ((n & (n - 1)) >= first)
        n &= n - 1;
    return (double)n * grid_m;
}

static void decide(const struct deciding *k, const struct point *a, const struct point *b)
{
    if (is_ended(k->out))
        return;
    k->out->judged++;
    const struct thick s = thick_of(k, a, b);
    const struct water_piece piece = judge(k, &s);
    const double at_m = piece.mixed && is_divided(k, &s, &piece) ? between(k->grid_m, a->t_m, b->t_m) : -1;
    if (at_m < 0) {
        add(k->out, &piece);
        return;
    }
    const struct point middle = point_at(k, at_m);
    decide(k, a, &middle);
    decide(k, &middle, b);
}

/* ---- what cannot touch the image ---- */

/* Shortens [*from, *to] to where c + t s >= 0. */
static void clip(double c, double s, double *from, double *to)
{
    if (s > 1e-12)
        *from = fmax(*from, -c / s);
    else if (s < -1e-12)
        *to = fmin(*to, -c / s);
    else if (c < 0)
        *to = *from;
}

/* To the inner side of the vertical plane at a side of the image: 1, the right one; -1, the left one. */
static void clip_side(const struct deciding *k, double tan_az, double side, double *from, double *to)
{
    const double *at = k->view->at_m, size = sqrt(1 + tan_az * tan_az), ahead = side * tan_az / size,
                 right = -side / size;
    /* the tile is no farther from its axis than thick + t half; bearings may be turned, too */
    const double rad = k->view->margin_rad, thick_m = k->view->margin_m + k->view->record->spread_m[1] +
                                                      ROUNDING_M +
                                                      rad * sqrt(at[0] * at[0] + at[1] * at[1] + at[2] * at[2]);
    clip(ahead * at[0] + right * at[1] + thick_m, ahead * k->v[0] + right * k->v[1] + k->half_rad + rad, from, to);
}

bool water_touches(const struct water_view *view, const struct water_tile *tile, double *from_m, double *to_m)
{
    const struct water_image *image = &view->record->image;
    const struct deciding k = begin(view, tile);
    clip_side(&k, image->tan_az[0], -1, from_m, to_m);
    clip_side(&k, image->tan_az[image->columns], 1, from_m, to_m);
    return *from_m < *to_m;
}

bool water_covers(const struct water_view *view, const struct water_tile *tile, double at_m)
{
    const struct deciding k = begin(view, tile);
    const struct point at = point_at(&k, at_m);
    const struct thick s = thick_of(&k, &at, &at);
    return touch(&k, &s).any;
}

/* Does a column's beam reach so far: up to its echo, or to where it would have heard one? Behind that nobody has
 * looked. A gap between beams frees nothing and ends nothing; nor does one deaf beam. */
static bool reaches(const struct water_cell *cell, double range_m)
{
    const int to = cell->ends != WATER_NO_END && cell->ends > cell->most ? cell->ends : cell->most;
    return to > 0 && range_m <= to * WATER_UNIT_M;
}

/* The angle under which a ball of radius_m is seen from so far; a right one from within. */
static double rad_of_ball(double radius_m, double away_m)
{
    return away_m > radius_m ? asin(radius_m / away_m) : GEO_PI / 2;
}

/* Does some beam of those columns reach so far, or, if `all`, each of them? */
static bool reach(const struct water_image *image, const int column[2], double range_m, bool all)
{
    const struct water_cell *row = image->cell + image->rows / 2 * image->columns;
    for (int x = column[0]; x <= column[1]; x++)
        if (reaches(&row[x], range_m) != all)
            return !all;
    return all;
}

static bool has_row(const struct water_image *image, double tan_el)
{
    return tan_el >= image->tan_el[0] && tan_el <= image->tan_el[image->rows];
}

/* The place becomes that at which the sensor, however it is tilted, has what stands there at its own level. False: it
 * is farther up or down than a beam reaches high_m away. */
static bool level_at(struct deciding *k, struct point *at, double high_m)
{
    const struct water_record *r = k->view->record;
    const double down_m = at->up / r->axis[2][2];
    if (at->level > high_m || !has_row(&r->image, at->up / fabs(r->axis[2][2]) / high_m))
        return false;
    for (int i = 0; i < 3; i++)
        k->v[i] += (i < 2 ? 1 : -1) * r->axis[i][2] * down_m / at->t_m;
    *at = point_at(k, at->t_m);
    return true;
}

/*
 * Beams were sent from beside the row's place, so what is at their azimuth as seen from there was as far beside them:
 * so much less is sought beside them. Where that leaves less than nothing, any of the beams that far around may be the
 * one that was there, and all of them must have reached so far, without a gap between them.
 */
bool water_looks(const struct water_view *view, const double v[3], double at_m, const struct water_sought *sought)
{
    const struct water_tile line = {.v = {v[0], v[1], v[2]}};
    const struct water_image *image = &view->record->image;
    struct deciding k = begin(view, &line);
    struct point at = point_at(&k, at_m);
    if (!has_row(image, at.up / at.level) && !level_at(&k, &at, sought->high_m))
        return false;
    const double tan_az = at.right / at.ahead,
                 beside_rad = fmax(sought->within_rad, rad_of_ball(sought->radius_m, at.level)),
                 left_rad = beside_rad - rad_of_ball(fmax(view->record->spread_m[1] - WATER_THIN_M, 0), at.level);
    int column[2];
    if (!(at.ahead > 0) || at.range < view->record->ahead_m)
        return false;
    const struct span az = wider((struct span){tan_az, tan_az}, tan(fmin(fabs(left_rad), GEO_PI / 2)));
    const bool all = left_rad < 0;
    if (all && at.range < view->record->gap_m)
        return false;
    if (all ? az.low < image->tan_az[0] || az.high > image->tan_az[image->columns]
            : az.high < image->tan_az[0] || az.low > image->tan_az[image->columns])
        return false;
    find_part(image->tan_az, image->columns, &az, column);
    return reach(image, column, at.range, all);
}

void water_decide(const struct water_view *view, const struct water_tile *tile, double from_m, double to_m,
                  struct water_pieces *out)
{
    struct deciding k = begin(view, tile);
    k.out = out;
    out->n = out->judged = 0;
    const struct point a = point_at(&k, from_m), b = point_at(&k, to_m);
    decide(&k, &a, &b);
}
