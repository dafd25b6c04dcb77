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

static void add_direction(struct matrix_line *l, double x)
{
    const int same = find(l, x - SAME_RAD);
    if (same < l->beams && l->beam_rad[same] <= x + SAME_RAD)
        return;
    const int at = find(l, x);
    memmove(l->beam_rad + at + 1, l->beam_rad + at, (size_t)(l->beams - at) * sizeof *l->beam_rad);
    l->beam_rad[at] = x;
    l->beams++;
}

static bool read_beams(const struct echoes *e, const struct beams_deaf *deaf, struct matrix *m)
{
    m->beams = m->az.beams = m->el.beams = 0;
    for (uint16_t i = 0; i < e->n_beams; i++) {
        struct matrix_beam *b = &m->beam[m->beams];
        b->is = beams_one(e, deaf, i);
        b->el_rad = (double)e->beam[i].el_rad;
        b->echo = row_cell(&b->is, ROW_NOTHING, 0, beams_echo_m(e, deaf, i)).ends;
        if (!(fabs(b->is.az_rad) < BEAMS_WIDEST_RAD && fabs(b->el_rad) < BEAMS_WIDEST_RAD))
            continue;
        add_direction(&m->az, b->is.az_rad);
        add_direction(&m->el, b->el_rad);
        m->beams++;
    }
    return m->beams > 0;
}

static bool is_nested(const struct matrix *m)
{
    int i = 0;
    while (i < m->beams && !row_is_nested(&m->beam[i].is))
        i++;
    return i < m->beams;
}

/* A ping's beams, and its image. */
struct writing {
    struct matrix *m;
    struct water_cell *cell;
    double half_az_rad, half_el_rad;
    size_t bytes; /* the image has */
    bool nested;  /* some beam detects less off its axis */
};

static bool has_room(const struct writing *w)
{
    const struct matrix_line *az = &w->m->az, *el = &w->m->el;
    return !az->full && !el->full && row_bytes((uint32_t)az->parts, (uint32_t)el->parts) <= w->bytes;
}

/* The last part ends there; what would leave none of it is no end. */
static void end_part(struct matrix_line *l, double end_rad)
{
    if (!(end_rad > l->end_rad[l->parts]))
        return;
    l->full = l->full || l->parts + 1 == ROW_ENDS_MOST;
    if (!l->full)
        l->end_rad[++l->parts] = end_rad;
}

static void start_parts(struct matrix_line *l, double from_rad)
{
    l->parts = 0;
    l->full = false;
    l->end_rad[0] = fmax(from_rad, -BEAMS_WIDEST_RAD);
}

/* ---- a grid: parts between beams ---- */

#define CUTS      3
#define INSCRIBED 0.7 /* of a share: a square as wide lies within the ellipse about a beam's axis */

/* Where the parts of a beam that detects less off its axis may end, as shares of its half opening. */
static const double cut_share[CUTS] = {INSCRIBED, INSCRIBED *BEAM_SIDE_SHARE, INSCRIBED *BEAM_AXIS_SHARE};

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
    start_parts(l, l->beam_rad[0] - half_rad);
    for (int i = 0; i < l->beams; i++) {
        const double at = l->beam_rad[i], edge = fmin(at + half_rad, BEAMS_WIDEST_RAD);
        const bool last = i + 1 == l->beams, gap = !last && l->beam_rad[i + 1] - at > 2 * half_rad + ROW_TOUCH_RAD;
        cut(l, i, half_rad, cuts, last || gap ? edge : (at + l->beam_rad[i + 1]) / 2);
        if (gap)
            end_part(l, l->beam_rad[i + 1] - half_rad);
    }
}

/* As finely as there is room. False: there is none, or the beams look in no more than half of the grid's directions. */
static bool divide_grid(const struct writing *w)
{
    struct matrix *m = w->m;
    bool fits = false;
    if (m->az.beams * m->el.beams >= 2 * m->beams)
        return false;
    for (int cuts = w->nested ? CUTS : 0; !fits && cuts >= 0; cuts--) {
        divide(&m->az, w->half_az_rad, cuts);
        divide(&m->el, w->half_el_rad, cuts);
        fits = has_room(w);
    }
    return fits;
}

/* ---- no grid: parts between edges of openings ---- */

/* Parts end at edges of openings that are at least a step apart. Of beams that detect less off their axes, edges are
 * those of the squares within their ellipses. */
static void divide_by(struct matrix_line *l, double half_rad, double step_rad, bool nested)
{
    const double to_rad = fmin(l->beam_rad[l->beams - 1] + half_rad, BEAMS_WIDEST_RAD),
                 reach_rad = nested ? INSCRIBED * half_rad : half_rad;
    int low = 0, high = 0;
    start_parts(l, l->beam_rad[0] - half_rad);
    while (!l->full) {
        const double next_rad = l->end_rad[l->parts] + step_rad;
        while (low < l->beams && l->beam_rad[low] - reach_rad < next_rad)
            low++;
        while (high < l->beams && l->beam_rad[high] + reach_rad < next_rad)
            high++;
        const double begins_rad = low < l->beams ? l->beam_rad[low] - reach_rad : INFINITY,
                     ends_rad = high < l->beams ? l->beam_rad[high] + reach_rad : INFINITY,
                     end_rad = fmin(begins_rad, ends_rad);
        if (!(end_rad <= to_rad - step_rad))
            break;
        end_part(l, end_rad);
    }
    end_part(l, to_rad);
}

static double extent_of(const struct matrix_line *l, double half_rad)
{
    return l->beam_rad[l->beams - 1] - l->beam_rad[0] + 2 * half_rad;
}

/* For all cells, the number of beams whose openings touch the cell, as if openings filled the image evenly. */
static double looks(const struct writing *w)
{
    const struct matrix_line *az = &w->m->az, *el = &w->m->el;
    const double share_az = 2 * w->half_az_rad / extent_of(az, w->half_az_rad) + 1.0 / az->parts,
                 share_el = 2 * w->half_el_rad / extent_of(el, w->half_el_rad) + 1.0 / el->parts;
    return w->m->beams * fmin(share_az, 1) * fmin(share_el, 1) * az->parts * el->parts;
}

#define HALVINGS  14
#define FEW_FINER 10

/*
 * The least width of parts along one angle, compared with that along the other. Where an echo ends, wide parts lose
 * openings beside it, in proportion to the opening; at the image's border they lose directions, in proportion to the
 * image. The width is the geometric mean of both. A line of few edges, as of rows of beams, keeps nearly all of them.
 */
static double step_of(const struct writing *w, struct matrix_line *l, double half_rad)
{
    const double step_rad = sqrt(extent_of(l, half_rad) * half_rad);
    divide_by(l, half_rad, SAME_RAD, w->nested);
    const bool few = !l->full && row_bytes((uint32_t)l->parts, (uint32_t)l->parts) <= w->bytes;
    return few ? step_rad / FEW_FINER : step_rad;
}

/* As finely as there is room and time. */
static void divide_edges(const struct writing *w)
{
    struct matrix_line *az = &w->m->az, *el = &w->m->el;
    const double step_az = step_of(w, az, w->half_az_rad), step_el = step_of(w, el, w->half_el_rad);
    double low = 0, step = 0,
           high = fmax(extent_of(az, w->half_az_rad) / step_az, extent_of(el, w->half_el_rad) / step_el);
    for (int i = 0; i <= HALVINGS; i++) {
        divide_by(az, w->half_az_rad, fmax(step * step_az, SAME_RAD), w->nested);
        divide_by(el, w->half_el_rad, fmax(step * step_el, SAME_RAD), w->nested);
        const bool fits = has_room(w) && looks(w) <= MATRIX_LOOKS;
        if (fits && step == 0)
            return;
        *(fits ? &high : &low) = step;
        step = i + 1 < HALVINGS ? (low + high) / 2 : high;
    }
}

/* ---- cells that are a beam's own ---- */

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

static struct water_cell says_in(const struct row_beam *b, enum row_part part)
{
    return row_cell(b, part, part == ROW_EDGE ? b->edge_near_m : b->near_m, b->ends_m);
}

static enum row_part part_of(const struct writing *w, const struct matrix_beam *b, int column, int row)
{
    return part_at(&b->is, hypot(share_of(&w->m->az, column, b->is.az_rad, w->half_az_rad),
                                 share_of(&w->m->el, row, b->el_rad, w->half_el_rad)));
}

static void add_worse(struct water_cell *cell, struct water_cell other)
{
    const uint16_t from = cell->from > other.from ? cell->from : other.from,
                   to = cell->least < other.least ? cell->least : other.least;
    const uint16_t ends = cell->ends < other.ends ? cell->ends : other.ends;
    *cell = from < to ? (struct water_cell){from, to, to, ends} : (struct water_cell){0, 0, 0, ends};
}

static const struct water_cell untold = {0, UINT16_MAX, UINT16_MAX, WATER_NO_END};

static bool is_untold(const struct water_cell *cell)
{
    return cell->least == untold.least;
}

static void write_own(const struct writing *w, const struct matrix_beam *b)
{
    const struct matrix_line *az = &w->m->az, *el = &w->m->el;
    const int i = find(az, b->is.az_rad - SAME_RAD), j = find(el, b->el_rad - SAME_RAD);
    for (int row = el->from_of[j]; row < el->to_of[j]; row++)
        for (int column = az->from_of[i]; column < az->to_of[i]; column++)
            add_worse(&w->cell[row * az->parts + column], says_in(&b->is, part_of(w, b, column, row)));
}

/* ---- cells that are no beam's own ---- */

#define REACH_RAD     (ROW_TOUCH_RAD / 2) /* two that touch leave no gap */
#define TOGETHER_MOST 16 /* of more whose openings touch a cell, one holds it, or it lies at their border */

static bool meets(const struct matrix_line *l, int part, double at_rad, double half_rad)
{
    return at_rad + half_rad > l->end_rad[part] && at_rad - half_rad < l->end_rad[part + 1];
}

/* Does its opening, rounded, hold some of the cell? */
static bool touches(const struct writing *w, const struct matrix_beam *b, int column, int row)
{
    return meets(&w->m->az, column, b->is.az_rad, w->half_az_rad - SAME_RAD) &&
           meets(&w->m->el, row, b->el_rad, w->half_el_rad - SAME_RAD);
}

/* Where in its opening the beam holds all of the cell. */
static enum row_part holds(const struct writing *w, const struct matrix_beam *b, int column, int row)
{
    const double *az = w->m->az.end_rad + column, *el = w->m->el.end_rad + row;
    const double half_az = w->half_az_rad + REACH_RAD, half_el = w->half_el_rad + REACH_RAD;
    if (b->is.az_rad - half_az > az[0] || b->is.az_rad + half_az < az[1] || b->el_rad - half_el > el[0] ||
        b->el_rad + half_el < el[1])
        return ROW_NOTHING;
    return row_is_nested(&b->is) ? part_of(w, b, column, row) : ROW_EDGE;
}

/* Parts of openings; a part's lower ends belong to it. */
struct openings {
    double az[TOGETHER_MOST][2], el[TOGETHER_MOST][2];
    int n;
};

static bool is_between(const double end_rad[2], double at_rad)
{
    return at_rad >= end_rad[0] && at_rad < end_rad[1];
}

static bool is_in(const struct openings *o, double az_rad, double el_rad)
{
    int i = 0;
    while (i < o->n && !(is_between(o->az[i], az_rad) && is_between(o->el[i], el_rad)))
        i++;
    return i < o->n;
}

/* If part of a cell is in none of them, so is that part's lower left corner. There, or on its sides, the cell begins or
 * one of them ends. */
static bool hold_together(const struct openings *o, const double az[2], const double el[2])
{
    for (int i = -1; i < o->n; i++) {
        const double x = i < 0 ? az[0] : o->az[i][1];
        for (int j = -1; is_between(az, x) && j < o->n; j++) {
            const double y = j < 0 ? el[0] : o->el[j][1];
            if (is_between(el, y) && !is_in(o, x, y))
                return false;
        }
    }
    return true;
}

/* What the beams say if their openings together hold all of the cell: the worst of them. Of a beam that hears less off
 * its axis, a rectangle within the ellipse counts. */
static struct water_cell say_together(const struct writing *w, const struct matrix_beam *const *beam, int n,
                                      int column, int row)
{
    struct openings o = {.n = 0};
    struct water_cell worst = untold;
    for (int i = 0; i < n; i++) {
        const struct matrix_beam *b = beam[i];
        const double share = row_is_nested(&b->is) ? INSCRIBED : 1;
        const double half_az = share * w->half_az_rad + REACH_RAD, half_el = share * w->half_el_rad + REACH_RAD;
        if (b->says[ROW_EDGE].least == 0)
            continue;
        add_worse(&worst, b->says[ROW_EDGE]);
        o.az[o.n][0] = b->is.az_rad - half_az;
        o.az[o.n][1] = b->is.az_rad + half_az;
        o.el[o.n][0] = b->el_rad - half_el;
        o.el[o.n++][1] = b->el_rad + half_el;
    }
    return hold_together(&o, w->m->az.end_rad + column, w->m->el.end_rad + row) ? worst : (struct water_cell){0};
}

/* All beams that may hold some of it. What only lies beside it counts where it closes a gap. */
static struct water_cell say_all(const struct writing *w, const struct matrix_beam *const *beam, int n, int column,
                                 int row)
{
    const struct matrix_beam *in[TOGETHER_MOST];
    int touching = 0;
    if (n > TOGETHER_MOST)
        return (struct water_cell){0};
    for (int i = 0; i < n; i++)
        if (touches(w, beam[i], column, row))
            in[touching++] = beam[i];
    const struct water_cell says = say_together(w, in, touching, column, row);
    return says.least > 0 || touching == n ? says : say_together(w, beam, n, column, row);
}

/* The first echo of those that hold some of the cell, and where one ends what is older. */
struct stop {
    uint16_t echo, ends;
};

static struct stop find_stop(const struct writing *w, const struct matrix_beam *const *beam, int n, int column,
                             int row)
{
    struct stop stop = {WATER_NO_END, WATER_NO_END};
    for (int i = 0; i < n; i++) {
        const uint16_t echo = beam[i]->echo, ends = beam[i]->says[ROW_AXIS].ends;
        if ((echo >= stop.echo && ends >= stop.ends) || !touches(w, beam[i], column, row))
            continue;
        stop.echo = echo < stop.echo ? echo : stop.echo;
        stop.ends = ends < stop.ends ? ends : stop.ends;
    }
    return stop;
}

static struct water_cell stop_at(const struct stop *stop, struct water_cell cell)
{
    const uint16_t to = cell.least < stop->echo ? cell.least : stop->echo;
    return cell.from < to ? (struct water_cell){cell.from, to, to, stop->ends}
                          : (struct water_cell){.ends = stop->ends};
}

/* Nothing counts behind an echo, so what lies before it is not lost to what begins behind it. */
static struct water_cell tell(const struct writing *w, const struct matrix_beam *const *beam, int n, int column,
                              int row)
{
    const struct stop stop = find_stop(w, beam, n, column, row);
    struct water_cell all = {.ends = stop.ends};
    for (int i = 0; i < n && stop.echo > 0; i++) {
        const struct water_cell *says = beam[i]->says, most = stop_at(&stop, says[ROW_AXIS]);
        if (most.least > all.least || (most.least > 0 && most.from < all.from))
            all = water_cell_join(all, stop_at(&stop, says[holds(w, beam[i], column, row)]));
    }
    return all.least > 0 || stop.echo == 0 ? all : stop_at(&stop, say_all(w, beam, n, column, row));
}

static void tell_row(const struct writing *w, int row)
{
    struct matrix *m = w->m;
    struct water_cell *cell = w->cell + row * m->az.parts;
    const double half_az = w->half_az_rad + REACH_RAD, half_el = w->half_el_rad + REACH_RAD;
    int beams = 0, first = 0;
    for (int i = 0; i < m->beams; i++)
        if (meets(&m->el, row, m->by_az[i]->el_rad, half_el))
            m->row[beams++] = m->by_az[i];
    for (int x = 0; x < m->az.parts; x++) {
        while (first < beams && m->row[first]->is.az_rad + half_az <= m->az.end_rad[x])
            first++;
        int end = first;
        while (end < beams && meets(&m->az, x, m->row[end]->is.az_rad, half_az))
            end++;
        if (is_untold(&cell[x]))
            cell[x] = tell(w, m->row + first, end - first, x, row);
    }
}

static void sort_beams(struct matrix *m)
{
    for (int i = 0; i < m->beams; i++) {
        int low = 0, high = i;
        while (low < high) {
            const int middle = (low + high) / 2;
            if (m->by_az[middle]->is.az_rad <= m->beam[i].is.az_rad)
                low = middle + 1;
            else
                high = middle;
        }
        memmove(m->by_az + low + 1, m->by_az + low, (size_t)(i - low) * sizeof(m->by_az[0]));
        m->by_az[low] = &m->beam[i];
    }
}

static bool has_untold(const struct water_cell *cell, int n)
{
    int i = 0;
    while (i < n && !is_untold(&cell[i]))
        i++;
    return i < n;
}

static void tell_rest(const struct writing *w)
{
    struct matrix *m = w->m;
    sort_beams(m);
    for (int i = 0; i < m->beams; i++)
        for (int part = ROW_AXIS; part <= ROW_NOTHING; part++)
            m->beam[i].says[part] = says_in(&m->beam[i].is, (enum row_part)part);
    for (int y = 0; y < m->el.parts; y++)
        if (has_untold(w->cell + y * m->az.parts, m->az.parts))
            tell_row(w, y);
}

/* ---- the image ---- */

static void write_ends(const struct matrix_line *l, double *tan_of)
{
    for (int i = 0; i <= l->parts; i++)
        tan_of[i] = tan(l->end_rad[i]);
}

bool matrix_write(const struct echoes *e, const struct beams_deaf *deaf, struct matrix *m,
                  struct water_record *record, struct row_room *room)
{
    struct writing w = {.m = m,
                        .cell = room->cell,
                        .half_az_rad = (double)e->az_aperture_rad / 2,
                        .half_el_rad = (double)e->el_aperture_rad / 2,
                        .bytes = row_bytes(row_columns(e->n_beams), ROW_ROWS)};
    double near_m = INFINITY;
    if (!(w.half_az_rad > 0 && w.half_el_rad > 0) || !read_beams(e, deaf, m))
        return false;
    w.nested = is_nested(m);
    const bool grid = divide_grid(&w);
    if (!grid)
        divide_edges(&w);
    const int cells = m->az.parts * m->el.parts;
    for (int i = 0; i < cells; i++)
        room->cell[i] = untold;
    record->echoes = false;
    for (int i = 0; i < m->beams; i++) {
        const struct row_beam *b = &m->beam[i].is;
        if (grid)
            write_own(&w, &m->beam[i]);
        record->echoes = record->echoes || b->ends_m < (double)INFINITY;
        near_m = fmin(near_m, fmin(b->near_m, b->edge_near_m));
    }
    if (has_untold(room->cell, cells))
        tell_rest(&w);
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
