/* SPDX-License-Identifier: MIT */
#include "beams.h"

#include <math.h>
#include <string.h>

void beams_begin(struct water_record *record, const struct echoes *e, const struct mount *mount)
{
    const struct pose *pose = &e->pose;
    const double lever_m = geo_length(mount->position_m), tilt_rad = pose->uncertain_rad + pose->blur_rad;
    double turn[4];
    *record = (struct water_record){.t_ns = e->t_ns,
                                    .newest_ns = e->t_ns,
                                    .sensor = e->sensor,
                                    .seq = e->seq,
                                    .path_m = pose->path_m,
                                    .drift_m = {pose->drift_m[0], pose->drift_m[1]},
                                    .lever_m = lever_m,
                                    .uncertain_m = pose->uncertain_m + pose->blur_any_m +
                                                   geo_length(pose->blur_m) + lever_m * tilt_rad,
                                    .tilt_rad = tilt_rad};
    quat_rotate(pose->attitude, mount->position_m, record->place_m);
    for (int i = 0; i < 3; i++)
        record->place_m[i] += pose->position_m[i];
    quat_multiply(pose->attitude, mount->attitude, turn);
    quat_axes(turn, record->axis);
}

/* ---- beams ---- */

static bool frees(const struct beam_echoes *h)
{
    return h->free_to_m > h->blind_m;
}

static bool is_deaf(const struct beam_echoes *h)
{
    return !frees(h) && !(h->n > 0 && h->echo[0].flags & ECHO_OWN);
}

static bool was_deaf(const struct beams_deaf *deaf, const struct echoes *e, uint16_t i)
{
    return deaf->n == e->n_beams && deaf->beam[i / 64] >> (i % 64) & 1;
}

/* Beams to the left have azimuths below a turn as well as below 0. */
double beams_az_rad(const struct beam_echoes *beam)
{
    return geo_wrap_pi((double)beam->az_rad);
}

/* Of a ping whose place or bearings are known no better than this, an echo may be nearly anywhere: what older pings
 * found free only ages, as in the grid's cells. What a late reading is uncertain by is no reason: that way is known. */
#define LOOSE_M   0.1
#define LOOSE_RAD (1.25 * GEO_PI / 180)

static bool is_loose(const struct pose *pose)
{
    return pose->uncertain_m > LOOSE_M || pose->uncertain_rad > LOOSE_RAD;
}

static bool is_own(const struct beam_echoes *h)
{
    return h->n > 0 && h->echo[0].flags & ECHO_OWN;
}

/* Deaf once, it says nothing: a burst of noise, a lost pulse. Twice, something may be in front of it. */
static double echo_of(const struct beam_echoes *h, bool deaf_before)
{
    if (frees(h))
        return h->n > 0 ? (double)h->free_to_m : INFINITY;
    return h->n > 0 || deaf_before ? 0 : INFINITY;
}

/* An echo of the vehicle's own does not block, so the water behind it must not stay free, however loose the ping. */
static struct row_beam beam_of(const struct beam_echoes *h, bool deaf_before, bool loose)
{
    struct row_beam b = {.az_rad = beams_az_rad(h),
                         .near_m = (double)h->blind_m,
                         .edge_near_m = (double)h->blind_m,
                         .ends_m = INFINITY};
    if (!loose || !frees(h) || is_own(h))
        b.ends_m = echo_of(h, deaf_before);
    if (!frees(h))
        return b;
    b.axis_m = b.side_m = b.edge_m = (double)h->free_to_m;
    if (!h->off_axis)
        return b;
    b.side_m = fmin((double)h->side_to_m, b.axis_m);
    b.edge_m = h->edge_to_m > h->edge_from_m ? fmin((double)h->edge_to_m, b.side_m) : 0;
    b.edge_near_m = fmax((double)h->edge_from_m, b.near_m);
    return b;
}

struct row_beam beams_one(const struct echoes *e, const struct beams_deaf *deaf, uint16_t i)
{
    return beam_of(&e->beam[i], was_deaf(deaf, e, i), is_loose(&e->pose));
}

double beams_echo_m(const struct echoes *e, const struct beams_deaf *deaf, uint16_t i)
{
    return echo_of(&e->beam[i], was_deaf(deaf, e, i));
}

/* In order of azimuth; of two with the same one the worse counts. */
static void add_beam(struct beams_row *row, const struct row_beam *b)
{
    size_t at = row->n;
    while (at > 0 && row->beam[at - 1].az_rad > b->az_rad)
        at--;
    if (at > 0 && row->beam[at - 1].az_rad == b->az_rad) {
        struct row_beam *same = &row->beam[at - 1];
        same->near_m = fmax(same->near_m, b->near_m);
        same->edge_near_m = fmax(same->edge_near_m, b->edge_near_m);
        same->axis_m = fmin(same->axis_m, b->axis_m);
        same->side_m = fmin(same->side_m, b->side_m);
        same->edge_m = fmin(same->edge_m, b->edge_m);
        same->ends_m = fmin(same->ends_m, b->ends_m);
        return;
    }
    memmove(row->beam + at + 1, row->beam + at, (row->n - at) * sizeof *b);
    row->beam[at] = *b;
    row->n++;
}

/* ---- rows ---- */

/* Columns that the image of the beams so far may take, with one more behind them. */
static size_t columns_with(const struct beams_row *row, size_t gaps)
{
    return row->n + 1 + ROW_ENDS * (gaps + 1);
}

static size_t gaps_in(const struct beams_row *row, double half_rad)
{
    size_t gaps = 0;
    for (size_t i = 1; i < row->n; i++)
        gaps += row->beam[i].az_rad - row->beam[i - 1].az_rad > 2 * half_rad + ROW_TOUCH_RAD;
    return gaps;
}

/* Beams of a row that has too many gaps: those to the right are left out. */
static void fit(struct beams_row *row, double half_rad)
{
    while (row->n > 1 && columns_with(row, gaps_in(row, half_rad)) > WATER_COLUMNS)
        row->n--;
}

bool beams_are_level(const struct echoes *e)
{
    for (uint16_t i = 1; i < e->n_beams; i++)
        if (e->beam[i].el_rad != e->beam[0].el_rad)
            return false;
    return true;
}

bool beams_read(const struct echoes *e, const struct beams_deaf *deaf, struct beams_row *out)
{
    const uint16_t n = e->n_beams;
    const double el_rad = (double)e->beam[0].el_rad;
    struct row_shape *shape = &out->shape;
    out->n = 0;
    *shape =
        (struct row_shape){.half_az_rad = (double)e->az_aperture_rad / 2,
                           .el_rad = el_rad,
                           .half_el_rad = fmin((double)e->el_aperture_rad / 2, BEAMS_WIDEST_RAD - fabs(el_rad))};
    const bool falls = beams_az_rad(&e->beam[0]) > beams_az_rad(&e->beam[n - 1]);
    for (uint16_t k = 0; k < n; k++) {
        const struct row_beam b = beams_one(e, deaf, falls ? (uint16_t)(n - 1 - k) : k); /* sorted at no cost */
        if (n == 1 || fabs(b.az_rad) < BEAMS_WIDEST_RAD)
            add_beam(out, &b);
    }
    if (!out->n || !(shape->half_el_rad > 0 && shape->half_az_rad > 0))
        return false;
    fit(out, shape->half_az_rad);
    shape->from_rad = fmax(out->beam[0].az_rad - shape->half_az_rad, -BEAMS_WIDEST_RAD);
    shape->to_rad = fmin(out->beam[out->n - 1].az_rad + shape->half_az_rad, BEAMS_WIDEST_RAD);
    shape->outer_rad[0] = shape->from_rad;
    shape->outer_rad[1] = shape->to_rad;
    return true;
}

void beams_listen(struct beams_deaf *deaf, const struct echoes *e)
{
    *deaf = (struct beams_deaf){.n = e->n_beams};
    for (uint16_t i = 0; i < e->n_beams && i < BEAMS_MAX; i++)
        deaf->beam[i / 64] |= (uint64_t)is_deaf(&e->beam[i]) << (i % 64);
}
