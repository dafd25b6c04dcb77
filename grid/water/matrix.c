/* SPDX-License-Identifier: MIT */
#include "matrix.h"

#include <math.h>
#include <string.h>

#define SAME_RAD 1e-4 /* directions that differ by less are the same: they are rounded */

/* ---- directions ---- */

/* The first direction that is not below x; l->beams: all are. */
static int find(const struct matrix_line *l, double x)
{
    int low = 0, high = l->beams;
    while (low < high) {
        const int middle = (low + high) / 2;
        if (l->beam_rad[middle] < x)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

static bool has(const struct matrix_line *l, double x)
{
    const int at = find(l, x - SAME_RAD);
    return at < l->beams && l->beam_rad[at] <= x + SAME_RAD;
}

static void insert(struct matrix_line *l, double x)
{
    const int at = find(l, x);
    memmove(l->beam_rad + at + 1, l->beam_rad + at, (size_t)(l->beams - at) * sizeof *l->beam_rad);
    l->beam_rad[at] = x;
    l->beams++;
}

/* Parts at most of an image with so many directions: there may be a gap between any two. */
static uint32_t parts_of(int beams)
{
    return beams > 0 ? 2 * (uint32_t)beams - 1 : 0;
}

/* Both stay within an image of so many bytes. */
static void add_direction(struct matrix *m, double az_rad, double el_rad, size_t bytes)
{
    const bool az = !has(&m->az, az_rad), el = !has(&m->el, el_rad);
    if ((!az && !el) || row_bytes(parts_of(m->az.beams + az), parts_of(m->el.beams + el)) > bytes)
        return;
    if (az)
        insert(&m->az, az_rad);
    if (el)
        insert(&m->el, el_rad);
}

#define CUTS      3
#define INSCRIBED 0.7 /* of a share: a square as wide lies within the ellipse about a beam's axis */

/* Where the parts of a beam that detects less off its axis may end, as shares of its half opening. */
static const double cut_share[CUTS] = {INSCRIBED, INSCRIBED *BEAM_SIDE_SHARE, INSCRIBED *BEAM_AXIS_SHARE};

/* The last part ends there; what would leave none of it is no end, and what there is no room for makes the line too
 * long. */
static void end_part(struct matrix_line *l, double end_rad)
{
    if (end_rad > l->end_rad[l->parts] && l->parts + 1 < ROW_ENDS_MOST)
        l->end_rad[++l->parts] = end_rad;
}

/* What is a beam's own, up to end_rad. */
static void cut(struct matrix_line *l, int beam, double half_rad, int cuts, double end_rad)
{
    const double at = l->beam_rad[beam];
    l->from_of[beam] = (uint16_t)l->parts;
    for (int k = 0; k < cuts; k++)
        end_part(l, fmin(at - cut_share[k] * half_rad, end_rad));
    for (int k = cuts; k-- > 0;)
        end_part(l, fmin(at + cut_share[k] * half_rad, end_rad));
    end_part(l, end_rad);
    l->to_of[beam] = (uint16_t)l->parts;
}

static void divide(struct matrix_line *l, double half_rad, int cuts)
{
    l->parts = 0;
    l->end_rad[0] = fmax(l->beam_rad[0] - half_rad, -BEAMS_WIDEST_RAD);
    for (int i = 0; i < l->beams; i++) {
        const double at = l->beam_rad[i], edge = fmin(at + half_rad, BEAMS_WIDEST_RAD);
        const bool last = i + 1 == l->beams, gap = !last && l->beam_rad[i + 1] - at > 2 * half_rad + ROW_TOUCH_RAD;
        cut(l, i, half_rad, cuts, last || gap ? edge : (at + l->beam_rad[i + 1]) / 2);
        if (gap)
            end_part(l, l->beam_rad[i + 1] - half_rad);
    }
}

static size_t image_bytes(const struct echoes *e)
{
    return row_bytes(row_columns(e->n_beams), ROW_ROWS);
}

/* As finely as there is room; undivided there is. */
static void divide_both(struct matrix *m, const struct echoes *e, bool nested)
{
    int cuts = nested ? CUTS : 0;
    do {
        divide(&m->az, (double)e->az_aperture_rad / 2, cuts);
        divide(&m->el, (double)e->el_aperture_rad / 2, cuts);
    } while (cuts-- > 0 && (m->az.parts + 1 >= ROW_ENDS_MOST || m->el.parts + 1 >= ROW_ENDS_MOST ||
                            row_bytes((uint32_t)m->az.parts, (uint32_t)m->el.parts) > image_bytes(e)));
}

/* ---- cells ---- */

/* The farthest of a part from the beam's axis, as a share of its half opening. */
static double share_of(const struct matrix_line *l, int part, double beam_rad, double half_rad)
{
    return fmax(beam_rad - l->end_rad[part], l->end_rad[part + 1] - beam_rad) / half_rad;
}

/* What the pattern takes to the side and upward adds up: a beam that hears less off its axis frees nothing in the
 * corners of its opening. */
static enum row_part part_at(const struct row_beam *b, double share)
{
    const bool corner = share > 1 && row_is_nested(b);
    return share <= BEAM_AXIS_SHARE   ? ROW_AXIS
           : share <= BEAM_SIDE_SHARE ? ROW_SIDE
           : corner                   ? ROW_NOTHING
                                      : ROW_EDGE;
}

static void add_worse(struct water_cell *cell, struct water_cell other)
{
    const uint16_t from = cell->from > other.from ? cell->from : other.from,
                   to = cell->least < other.least ? cell->least : other.least;
    const uint16_t ends = cell->ends < other.ends ? cell->ends : other.ends;
    *cell = from < to ? (struct water_cell){from, to, to, ends} : (struct water_cell){0, 0, 0, ends};
}

/* A ping's beams, and its image. */
struct writing {
    const struct matrix *m;
    struct water_cell *cell;
    double half_az_rad, half_el_rad;
};

static const struct water_cell untold = {0, UINT16_MAX, UINT16_MAX, WATER_NO_END};

static void write_beam(const struct writing *w, const struct row_beam *b, double el_rad)
{
    const struct matrix_line *az = &w->m->az, *el = &w->m->el;
    if (!has(az, b->az_rad) || !has(el, el_rad))
        return;
    const int i = find(az, b->az_rad - SAME_RAD), j = find(el, el_rad - SAME_RAD);
    for (int row = el->from_of[j]; row < el->to_of[j]; row++)
        for (int column = az->from_of[i]; column < az->to_of[i]; column++) {
            const enum row_part part = part_at(b, hypot(share_of(az, column, b->az_rad, w->half_az_rad),
                                                        share_of(el, row, el_rad, w->half_el_rad)));
            const double near_m = part == ROW_EDGE ? b->edge_near_m : b->near_m;
            add_worse(&w->cell[row * az->parts + column], row_cell(b, part, near_m, b->ends_m));
        }
}

static void find_parts(const struct matrix_line *l, double at_rad, double half_rad, int part[2])
{
    part[0] = water_image_find(l->end_rad, l->parts, at_rad - half_rad + SAME_RAD);
    part[1] = water_image_find(l->end_rad, l->parts, at_rad + half_rad - SAME_RAD);
}

/* What is no beam's own, as where one is missing, ends at the echoes of all whose openings touch it. */
static void end_untold(const struct writing *w, const struct row_beam *b, double el_rad)
{
    const uint16_t ends = row_cell(b, ROW_NOTHING, 0, b->ends_m).ends;
    int column[2], row[2];
    find_parts(&w->m->az, b->az_rad, w->half_az_rad, column);
    find_parts(&w->m->el, el_rad, w->half_el_rad, row);
    for (int y = row[0]; y <= row[1]; y++)
        for (int x = column[0]; x <= column[1]; x++) {
            struct water_cell *cell = &w->cell[y * w->m->az.parts + x];
            if (cell->least == untold.least && ends < cell->ends)
                cell->ends = ends;
        }
}

static bool has_untold(const struct water_cell *cell, int n)
{
    int i = 0;
    while (i < n && cell[i].least != untold.least)
        i++;
    return i < n;
}

static void leave_gaps(struct water_cell *cell, int n)
{
    for (int i = 0; i < n; i++)
        if (cell[i].least == untold.least)
            cell[i] = (struct water_cell){.ends = cell[i].ends};
}

static bool is_within(const struct echoes *e, uint16_t i)
{
    return fabs(beams_az_rad(&e->beam[i])) < BEAMS_WIDEST_RAD &&
           fabs((double)e->beam[i].el_rad) < BEAMS_WIDEST_RAD;
}

static bool set_directions(const struct echoes *e, struct matrix *m)
{
    const size_t bytes = image_bytes(e);
    m->az.beams = m->el.beams = 0;
    for (uint16_t i = 0; i < e->n_beams; i++)
        if (is_within(e, i))
            add_direction(m, beams_az_rad(&e->beam[i]), (double)e->beam[i].el_rad, bytes);
    return m->az.beams > 0;
}

static bool is_nested(const struct echoes *e, const struct beams_deaf *deaf)
{
    bool nested = false;
    for (uint16_t i = 0; !nested && i < e->n_beams; i++) {
        const struct row_beam b = beams_one(e, deaf, i);
        nested = is_within(e, i) && row_is_nested(&b);
    }
    return nested;
}

static void write_ends(const struct matrix_line *l, double *tan_of)
{
    for (int i = 0; i <= l->parts; i++)
        tan_of[i] = tan(l->end_rad[i]);
}

bool matrix_write(const struct echoes *e, const struct beams_deaf *deaf, struct matrix *m,
                  struct water_record *record, struct row_room *room)
{
    const struct writing w = {.m = m,
                              .cell = room->cell,
                              .half_az_rad = (double)e->az_aperture_rad / 2,
                              .half_el_rad = (double)e->el_aperture_rad / 2};
    double near_m = INFINITY;
    if (!(w.half_az_rad > 0 && w.half_el_rad > 0) || !set_directions(e, m))
        return false;
    divide_both(m, e, is_nested(e, deaf));
    const int cells = m->az.parts * m->el.parts;
    for (int i = 0; i < cells; i++)
        room->cell[i] = untold;
    record->echoes = false;
    for (uint16_t i = 0; i < e->n_beams; i++) {
        const struct row_beam b = beams_one(e, deaf, i);
        if (!is_within(e, i))
            continue;
        write_beam(&w, &b, (double)e->beam[i].el_rad);
        record->echoes = record->echoes || b.ends_m < (double)INFINITY;
        near_m = fmin(near_m, fmin(b.near_m, b.edge_near_m));
    }
    const bool gaps = has_untold(room->cell, cells);
    for (uint16_t i = 0; gaps && i < e->n_beams; i++) {
        const struct row_beam b = beams_one(e, deaf, i);
        if (is_within(e, i) && b.ends_m < (double)INFINITY)
            end_untold(&w, &b, (double)e->beam[i].el_rad);
    }
    leave_gaps(room->cell, cells);
    write_ends(&m->az, room->tan_az);
    write_ends(&m->el, room->tan_el);
    record->image = (struct water_image){.columns = (uint16_t)m->az.parts,
                                         .rows = (uint16_t)m->el.parts,
                                         .parts = 1,
                                         .tan_az = room->tan_az,
                                         .tan_el = room->tan_el,
                                         .near_m = near_m};
    water_image_fill(&record->image, room->cell);
    return true;
}
