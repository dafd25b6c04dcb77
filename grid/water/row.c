/* SPDX-License-Identifier: MIT */
#include "row.h"

#include <math.h>

#include "grid/echoes.h"

#define ROUNDING 1e-6

static uint16_t units(double m)
{
    return (uint16_t)(m > 0 ? fmin(floor(m / WATER_UNIT_M), UINT16_MAX - 3) : 0);
}

static struct water_cell cell_of(double from_m, double to_m, double ends_m)
{
    const uint16_t to = units(to_m), ends = ends_m < INFINITY ? units(ends_m) : WATER_NO_END;
    const double from = ceil(fmax(from_m, 0) / WATER_UNIT_M - ROUNDING);
    return from < to ? (struct water_cell){(uint16_t)from, to, to, ends} : (struct water_cell){0, 0, 0, ends};
}

struct water_cell row_cell(const struct row_beam *beam, enum row_part part, double near_m, double ends_m)
{
    const double to_m = part == ROW_AXIS   ? beam->axis_m
                        : part == ROW_SIDE ? beam->side_m
                        : part == ROW_EDGE ? beam->edge_m
                                           : 0;
    return cell_of(near_m, to_m, ends_m);
}

uint32_t row_columns(uint32_t beams)
{
    const uint32_t columns = beams * (ROW_ENDS + 1);
    return columns < WATER_COLUMNS ? columns : WATER_COLUMNS;
}

size_t row_bytes(uint32_t columns, uint32_t rows)
{
    return (columns + 1 + rows + 1) * sizeof(double) +
           water_image_cells(columns, rows) * sizeof(struct water_cell);
}

/* What a column holds of its beam: all of it, or what lies off its axis to one side. */
struct column {
    const struct row_beam *beam;
    enum row_part part;
    bool beyond; /* it is another beam's own, which alone says what an echo ends there */
    double from_rad, to_rad;
    double seam; /* so far off the axis it may meet another's, as a share of half the width; 0: it meets none */
};

struct writing {
    const struct row_shape *shape;
    const struct row_beam *beam; /* the first one ... */
    size_t n;                    /* ... of so many */
    struct row_room *room;
    struct column column[WATER_COLUMNS];
    uint32_t columns;
    bool nested;    /* some beam detects less off its axis: what is so has columns of its own ... */
    bool coarse;    /* ... but for those there is no room: a beam has one */
    double end_rad; /* of the last one */
    double share_az[ROW_ROWS + 1], share_el[ROW_ROWS + 1];
    double seam; /* as far off the axis beams meet, as a share of half the width */
    /* In each row of the image, where that is highest: a tilt moves it aside by so many times itself, as such a share;
     * it is so much of its range away level; so far off the axis its part and the side's reach. */
    double lever[ROW_ROWS], level[ROW_ROWS], reach[2][ROW_ROWS];
};

static void add_column(struct writing *w, const struct row_beam *beam, enum row_part part, bool beyond,
                       double to_rad)
{
    if (!(to_rad > w->end_rad) || w->columns == WATER_COLUMNS)
        return;
    w->column[w->columns++] =
        (struct column){.beam = beam, .part = part, .beyond = beyond, .from_rad = w->end_rad, .to_rad = to_rad};
    w->end_rad = to_rad;
    w->room->tan_az[w->columns] = tan(to_rad);
}

const double row_share[ROW_ROWS + 1] = {-1, -BEAM_SIDE_SHARE, -BEAM_AXIS_SHARE, BEAM_AXIS_SHARE, BEAM_SIDE_SHARE,
                                        1};

/* Do two beams leave a gap? */
static bool is_apart(const struct row_shape *shape, const struct row_beam *a, const struct row_beam *b)
{
    return a->apart || b->az_rad - a->az_rad > 2 * shape->half_az_rad + ROW_TOUCH_RAD;
}

/* The part of a beam that is so far off its axis. */
static enum row_part part_at(const struct writing *w, double off_rad)
{
    const double share = off_rad / w->shape->half_az_rad - ROUNDING;
    return share <= w->share_az[3] ? ROW_AXIS : share <= w->share_az[4] ? ROW_SIDE : ROW_EDGE;
}

/* What lies between two axes is at most so far from the nearer one, as a share of half the width; 1: a beam has none
 * beside it. */
static double seam_share(const struct row_shape *shape, const struct row_beam *beam, size_t n)
{
    double most_rad = n > 1 ? 0 : shape->half_az_rad;
    for (size_t i = 0; i + 1 < n; i++) {
        const bool gap = is_apart(shape, &beam[i], &beam[i + 1]);
        most_rad = fmax(most_rad, gap ? shape->half_az_rad : (beam[i + 1].az_rad - beam[i].az_rad) / 2);
    }
    return fmin(most_rad / shape->half_az_rad, 1);
}

#define NARROWEST 0.95 /* of a part that seams leave hardly any height nothing is gained */
/* From there on, if it leaves them some height, parts hold the seams as beams have them. */
#define SEAM_FROM_M 2.0

/* Axes that begin aside of each other, or are tilted, leave seams farther off them than their azimuths say: by so much
 * at SEAM_FROM_M, at the most. */
static double most_aside(const struct row_shape *shape, const struct row_beam *beam, size_t n)
{
    const double highest_rad = fabs(shape->el_rad) + BEAM_SIDE_SHARE / sqrt(2) * shape->half_el_rad,
                 lever = tan(highest_rad), level_m = SEAM_FROM_M * cos(highest_rad);
    double most_rad = 0;
    for (size_t i = 0; i < n; i++)
        most_rad = fmax(most_rad, beam[i].aside_m / level_m + beam[i].tilt_rad * lever);
    return most_rad / 2 / shape->half_az_rad;
}

/*
 * What the pattern takes to the side and what it takes upward add up: a part is an ellipse about the axis. Columns and
 * rows make a rectangle within it, which is as wide as the row's seams are; or a square, where those lie outside it.
 */
static void set_shares(struct writing *w, double aside)
{
    for (int i = 0; i <= ROW_ROWS; i++)
        w->share_az[i] = w->share_el[i] = row_share[i];
    for (int i = 3; i < ROW_ROWS; i++) {
        const double square = row_share[i] / sqrt(2);
        w->share_az[i] =
            w->seam < NARROWEST * row_share[i] ? fmax(w->seam, fmin(w->seam + aside, square)) + ROUNDING : square;
        w->share_el[i] = sqrt(row_share[i] * row_share[i] - w->share_az[i] * w->share_az[i]);
        w->share_az[ROW_ROWS - i] = -w->share_az[i];
        w->share_el[ROW_ROWS - i] = -w->share_el[i];
    }
}

static void set_reach(struct writing *w)
{
    const struct row_shape *shape = w->shape;
    for (int row = 0; row < ROW_ROWS; row++) {
        const double high = fmax(fabs(w->share_el[row]), w->share_el[row + 1]),
                     highest_rad = fabs(shape->el_rad) + high * shape->half_el_rad;
        w->lever[row] = tan(highest_rad) / shape->half_az_rad;
        w->level[row] = cos(highest_rad);
        for (int part = 0; part < 2; part++)
            w->reach[part][row] = sqrt(fmax(row_share[part + 3] * row_share[part + 3] - high * high, 0));
    }
}

/* What of a beam lies before to_rad, from where the last column ends: what is off its axis in columns of its own, or
 * the worst of it for all. */
static void add_beam(struct writing *w, const struct row_beam *beam, bool beyond, double to_rad)
{
    static const enum row_part part[] = {ROW_EDGE, ROW_SIDE, ROW_AXIS, ROW_SIDE, ROW_EDGE};
    const double az = beam->az_rad, half = w->shape->half_az_rad, from_rad = w->end_rad;
    const uint32_t first = w->columns;
    if (!w->nested)
        add_column(w, beam, ROW_AXIS, beyond, to_rad);
    else if (w->coarse)
        add_column(w, beam, part_at(w, fmax(az - w->end_rad, to_rad - az)), beyond, to_rad);
    else
        for (int i = 0; i < ROW_ROWS; i++)
            add_column(w, beam, part[i], beyond,
                       i + 1 == ROW_ROWS ? to_rad : fmin(az + w->share_az[i + 1] * half, to_rad));
    if (w->columns == first)
        return;
    struct column *last = &w->column[w->columns - 1];
    w->column[first].seam = fabs(az - from_rad) / half;
    last->seam = fmax(last->seam, fabs(w->end_rad - az) / half);
}

static void add_beams(struct writing *w, const struct row_beam *beam, size_t n)
{
    const struct row_shape *shape = w->shape;
    w->end_rad = fmin(shape->from_rad, shape->outer_rad[0]);
    w->room->tan_az[0] = tan(w->end_rad);
    add_beam(w, &beam[0], true, shape->from_rad);
    for (size_t i = 0; i < n; i++) {
        const bool last = i + 1 == n, gap = !last && is_apart(shape, &beam[i], &beam[i + 1]);
        const double middle = last ? shape->to_rad : (beam[i].az_rad + beam[i + 1].az_rad) / 2;
        const double to_rad = gap ? fmin(beam[i].az_rad + shape->half_az_rad, middle - ROW_TOUCH_RAD / 2) : middle;
        add_beam(w, &beam[i], false, to_rad);
        if (gap)
            add_column(w, &beam[i], ROW_NOTHING, false,
                       fmax(beam[i + 1].az_rad - shape->half_az_rad, middle + ROW_TOUCH_RAD / 2));
    }
    add_beam(w, &beam[n - 1], true, shape->outer_rad[1]);
}

/* From there on the seam at a column lies within that part of its beam in that row of the image, seen from the beam's
 * own place: it is half as far off its axis as a neighbour's is. */
static double seam_from_m(const struct writing *w, const struct column *c, enum row_part part, uint32_t row)
{
    const struct row_beam *beam = c->beam;
    const double left = w->reach[part][row] - c->seam - beam->tilt_rad / 2 * w->lever[row];
    if (!(beam->aside_m > 0 || beam->tilt_rad > 0))
        return 0;
    return left > ROUNDING ? beam->aside_m / 2 / (left * w->shape->half_az_rad * w->level[row]) + beam->along_m
                           : INFINITY;
}

/* A cell that ends at a seam: nearer than its part holds that, the next one counts, so it is free only if that one is
 * free up to there. */
static struct water_cell seam_cell(const struct writing *w, const struct column *c, enum row_part part,
                                   uint32_t row, double near_m, double ends_m)
{
    const struct row_beam *beam = c->beam;
    const double axis_m = seam_from_m(w, c, ROW_AXIS, row), side_m = seam_from_m(w, c, ROW_SIDE, row);
    if (part == ROW_AXIS && beam->side_m < fmin(axis_m, beam->axis_m))
        part = ROW_SIDE;
    if (part <= ROW_SIDE && beam->edge_m < fmin(side_m, beam->side_m))
        part = ROW_EDGE;
    if (part <= ROW_SIDE)
        near_m = fmax(near_m, fmin(side_m, beam->edge_near_m));
    return row_cell(beam, part, part == ROW_EDGE ? fmax(near_m, beam->edge_near_m) : near_m, ends_m);
}

/* The nearer of two ends, if the other beam's lies beyond what its own shows. */
static double nearer_end(const struct row_beam *own, double ends_m, const struct row_beam *other)
{
    return other->ends_m >= own->axis_m ? fmin(ends_m, other->ends_m) : ends_m;
}

/* What another beam shows in the part of one that hears there is not in it, for that one would hear it better. Where it
 * is deaf, or reaches less far, the other's echo may be anywhere in its opening. */
static double ends_of(const struct writing *w, const struct column *c)
{
    const double half = w->shape->half_az_rad - ROUNDING;
    const struct row_beam *own = c->beam, *end = w->beam + w->n;
    double ends_m = own->ends_m;
    if (c->beyond || c->part == ROW_NOTHING)
        return INFINITY;
    for (const struct row_beam *b = own; b > w->beam && b[-1].az_rad + half > c->from_rad; b--)
        ends_m = nearer_end(own, ends_m, b - 1);
    for (const struct row_beam *b = own + 1; b < end && b->az_rad - half < c->to_rad; b++)
        ends_m = nearer_end(own, ends_m, b);
    return ends_m;
}

/* A cell is as far off the axis as its column or its row, whichever is farther. */
static void write_cells(const struct writing *w)
{
    static const enum row_part part_of_row[ROW_ROWS] = {ROW_EDGE, ROW_SIDE, ROW_AXIS, ROW_SIDE, ROW_EDGE};
    for (uint32_t i = 0; i < w->columns; i++) {
        const struct column *c = &w->column[i];
        const double ends_m = ends_of(w, c);
        for (uint32_t row = 0; row < ROW_ROWS; row++) {
            const enum row_part part = c->part > part_of_row[row] ? c->part : part_of_row[row];
            const double join_m = w->shape->join_m ? w->shape->join_m[c->beam - w->beam][row] : 0,
                         near_m = part == ROW_EDGE ? c->beam->edge_near_m : c->beam->near_m;
            w->room->cell[row * w->columns + i] = c->seam > 0
                                                      ? seam_cell(w, c, part, row, fmax(near_m, join_m), ends_m)
                                                      : row_cell(c->beam, part, fmax(near_m, join_m), ends_m);
        }
    }
}

static double nearest_m(const struct row_beam *beam, size_t n)
{
    double near_m = INFINITY;
    for (size_t i = 0; i < n; i++)
        near_m = fmin(near_m, fmin(beam[i].near_m, beam[i].edge_near_m));
    return near_m;
}

void row_write(struct water_record *record, struct row_room *room, const struct row_shape *shape,
               const struct row_beam *beam, size_t n)
{
    struct writing w = {.shape = shape, .beam = beam, .n = n, .room = room};
    for (size_t i = 0; i < n; i++)
        w.nested = w.nested || row_is_nested(&beam[i]);
    w.seam = seam_share(shape, beam, n);
    set_shares(&w, most_aside(shape, beam, n));
    set_reach(&w);
    w.coarse = n * (ROW_ROWS + 1) + ROW_ENDS > WATER_COLUMNS;
    add_beams(&w, beam, n);
    write_cells(&w);
    record->echoes = false;
    for (size_t i = 0; i < n; i++)
        record->echoes = record->echoes || beam[i].ends_m < INFINITY;
    for (int row = 0; row <= ROW_ROWS; row++)
        room->tan_el[row] = tan(shape->el_rad + w.share_el[row] * shape->half_el_rad);
    record->image = (struct water_image){.columns = (uint16_t)w.columns,
                                         .rows = ROW_ROWS,
                                         .parts = ROW_ROWS,
                                         .tan_az = room->tan_az,
                                         .tan_el = room->tan_el,
                                         .near_m = nearest_m(beam, n)};
    water_image_fill(&record->image, room->cell);
}
