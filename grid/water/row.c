/* SPDX-License-Identifier: MIT */
#include "row.h"

#include <math.h>

static uint16_t units(double m)
{
    return m > 0 ? (uint16_t)fmin(floor(m / WATER_UNIT_M), UINT16_MAX - 3) : 0;
}

static struct water_cell cell_of(double to_m, double ends_m)
{
    const uint16_t to = units(to_m);
    return (struct water_cell){to, to, ends_m < INFINITY ? units(ends_m) : WATER_NO_END};
}

/* What a column holds of its beam: all of it, or what lies off its axis to one side. */
enum part { PART_AXIS, PART_SIDE, PART_EDGE, PART_NOTHING };

struct column {
    const struct row_beam *beam;
    enum part part;
};

struct writing {
    const struct row_shape *shape;
    struct row_room *room;
    struct column column[WATER_COLUMNS];
    uint32_t columns;
    double end_rad; /* of the last one */
};

static void add_column(struct writing *w, const struct row_beam *beam, enum part part, double to_rad)
{
    if (!(to_rad > w->end_rad) || w->columns == WATER_COLUMNS)
        return;
    w->column[w->columns++] = (struct column){beam, part};
    w->end_rad = to_rad;
    w->room->tan_az[w->columns] = tan(to_rad);
}

const double row_share[ROW_ROWS + 1] = {-1, -0.5, -0.25, 0.25, 0.5, 1};

/* Do two beams leave a gap? */
static bool is_apart(const struct row_shape *shape, const struct row_beam *a, const struct row_beam *b)
{
    return a->apart || b->az_rad - a->az_rad > 2 * shape->half_az_rad + ROW_TOUCH_RAD;
}

/* The left part of a beam without a neighbour there, from where the last column ends. */
static void add_left_end(struct writing *w, const struct row_beam *beam)
{
    add_column(w, beam, PART_EDGE, beam->az_rad - w->shape->half_az_rad / 2);
    add_column(w, beam, PART_SIDE, beam->az_rad - w->shape->half_az_rad / 4);
}

/* The rest of a beam without a neighbour on the right. */
static void add_right_end(struct writing *w, const struct row_beam *beam, double to_rad)
{
    add_column(w, beam, PART_AXIS, fmin(beam->az_rad + w->shape->half_az_rad / 4, to_rad));
    add_column(w, beam, PART_SIDE, fmin(beam->az_rad + w->shape->half_az_rad / 2, to_rad));
    add_column(w, beam, PART_EDGE, to_rad);
}

static void add_beams(struct writing *w, const struct row_beam *beam, size_t n)
{
    const struct row_shape *shape = w->shape;
    w->end_rad = shape->from_rad;
    w->room->tan_az[0] = tan(shape->from_rad);
    for (size_t i = 0; i < n; i++) {
        const bool first = i == 0, last = i + 1 == n, gap = !last && is_apart(shape, &beam[i], &beam[i + 1]);
        if (first ? !shape->goes_on[0] : is_apart(shape, &beam[i - 1], &beam[i]))
            add_left_end(w, &beam[i]);
        const double middle = last ? shape->to_rad : (beam[i].az_rad + beam[i + 1].az_rad) / 2;
        const double to_rad = gap ? fmin(beam[i].az_rad + shape->half_az_rad, middle - ROW_TOUCH_RAD / 2) : middle;
        if (last ? !shape->goes_on[1] : gap)
            add_right_end(w, &beam[i], to_rad);
        else
            add_column(w, &beam[i], PART_AXIS, to_rad);
        if (gap)
            add_column(w, &beam[i], PART_NOTHING,
                       fmax(beam[i + 1].az_rad - shape->half_az_rad, middle + ROW_TOUCH_RAD / 2));
    }
}

/* The edge detects from edge_near_m on: where other rows begin nearer, they say nothing of it. */
static void write_cells(const struct writing *w)
{
    const bool edge_later = w->shape->edge_near_m > w->shape->near_m;
    for (uint32_t i = 0; i < w->columns; i++) {
        const struct row_beam *beam = w->column[i].beam;
        const enum part part = w->column[i].part;
        const double edge_m = edge_later ? 0 : beam->edge_m;
        const double side_m = part == PART_EDGE ? edge_m : beam->side_m,
                     axis_m = part == PART_AXIS ? beam->axis_m : side_m;
        const double to_m[ROW_ROWS] = {beam->edge_m, side_m, axis_m, side_m, beam->edge_m};
        for (uint32_t row = 0; row < ROW_ROWS; row++)
            w->room->cell[row * w->columns + i] =
                part == PART_NOTHING ? cell_of(0, INFINITY) : cell_of(to_m[row], beam->ends_m);
    }
}

void row_write(struct water_record *record, struct row_room *room, const struct row_shape *shape,
               const struct row_beam *beam, size_t n)
{
    struct writing w = {.shape = shape, .room = room};
    add_beams(&w, beam, n);
    write_cells(&w);
    record->echoes = false;
    for (size_t i = 0; i < n; i++)
        record->echoes = record->echoes || beam[i].ends_m < INFINITY;
    for (int row = 0; row <= ROW_ROWS; row++)
        room->tan_el[row] = tan(shape->el_rad + row_share[row] * shape->half_el_rad);
    for (int row = 0; row < ROW_ROWS; row++)
        room->near_m[row] =
            fmax(shape->join_m[row],
                 row == 0 || row + 1 == ROW_ROWS ? fmax(shape->near_m, shape->edge_near_m) : shape->near_m);
    record->image = (struct water_image){.columns = (uint16_t)w.columns,
                                         .rows = ROW_ROWS,
                                         .tan_az = room->tan_az,
                                         .tan_el = room->tan_el,
                                         .near_m = room->near_m};
    water_image_fill(&record->image, room->cell);
}
