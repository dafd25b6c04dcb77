/* SPDX-License-Identifier: MIT */
/* places - see places.h. */
#include "places.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dice.h"
#include "grid/geometry.h"

#define FAR 1e3

/* The shaft of Table I: x is its length, y its width. The duct is 1.5 m wide along x; the wall opposite to the vehicle
 * leans over from 12 m down; the penstock runs along x, and the vehicle ends in the middle of its height. */
#define OBLIQUE_COS 0.938876315 /* of the wall from (9, 12) to (3.5, 27) against the vertical */
#define OBLIQUE_SIN 0.344254649

#define WATER(...)                                                                                                \
    {                                                                                                             \
        .kind = PLACE_BOX, .water = true, .p = { __VA_ARGS__ }                                                    \
    }
#define SEA(north_m, bottom_m) WATER(-FAR, north_m, -FAR, FAR, 0, bottom_m)
#define PILE(x, y, radius, from, to)                                                                              \
    {                                                                                                             \
        .kind = PLACE_TUBE, .p = { x, y, radius, from, to }                                                       \
    }
#define BEHIND(x, y, z, c)                                                                                        \
    {                                                                                                             \
        .kind = PLACE_HALF, .cut = { x, y, z, c }                                                                 \
    }

#define BOX_TANK                                                                                                  \
    .low = {-5, -3.5, -3}, .high = {5, 3.5, 9}, .from = {-1, 0.4, 0.5}, .to = {-1, 0.4, 5.5},                     \
    .shape[0] = WATER(-4, 4, -2.5, 2.5, 0, 6)

const struct place places[] = {
    {.name = "shaft",
     .what = "dam shaft: chamber 9 x 5 x 27 m with an oblique wall, duct 1.5 x 3 m, penstock",
     .low = {-1, -4, -3},
     .high = {10, 4, 38},
     .from = {2.25, 0, 0.5},
     .to = {2.25, 0, 33},
     .shape = {{.kind = PLACE_BOX,
                .water = true,
                .p = {0, 9, -2.5, 2.5, 0, 27},
                .cut = {OBLIQUE_COS, 0, OBLIQUE_SIN, 9 * OBLIQUE_COS + 12 * OBLIQUE_SIN}},
               WATER(1.5, 3, -1.5, 1.5, 26.9, 30.1),
               WATER(-25, 30, -2.5, 2.5, 30, 36)}},
    {.name = "box tank", .what = "tank 8 x 5 x 6 m", BOX_TANK},
    {.name = "round tank",
     .what = "round tank, radius 3 m, depth 5 m",
     .low = {-4, -4, -3},
     .high = {4, 4, 8},
     .from = {0.5, 0, 0.5},
     .to = {0.5, 0, 4.5},
     .shape = {{.kind = PLACE_TUBE, .water = true, .p = {0, 0, 3, 0, 5}}}},
    {.name = "harbour",
     .what = "quay, a second wall at 60 degrees, bottom at 5 m, a pile",
     .low = {-7, -7, -3},
     .high = {7, 7, 8},
     .from = {-2, 0, 1},
     .to = {2, 0, 2.5},
     .shape = {SEA(FAR, 5), BEHIND(0, -1, 0, -4), BEHIND(-0.8660254, 0.5, 0, -5), PILE(0, -3, 0.15, 0, 5)}},
    {.name = "pier",
     .what = "pier with piles of 0.3 m, a wall behind",
     .low = {-3, -5, -3},
     .high = {9, 5, 8},
     .from = {0, -3, 1.5},
     .to = {0, 3, 3.5},
     .shape = {SEA(7, 5), PILE(3, -3, 0.15, 0, 5), PILE(3, 0, 0.15, 0, 5), PILE(3, 3, 0.15, 0, 5),
               PILE(5, -1.5, 0.15, 0, 5), PILE(5, 1.5, 0.15, 0, 5)}},
    {.name = "slope",
     .what = "bottom that rises by 30 degrees",
     .low = {-3, -6, -3},
     .high = {11, 6, 10},
     .from = {0, 0, 1},
     .to = {1, 0, 4},
     .shape = {SEA(FAR, FAR), BEHIND(-0.5, 0, -0.8660254, -5)}},
    {.name = "net and line",
     .what = "a net of 5 cm at 3 m and a mooring line of 3 cm at 2 m, a wall at 6 m",
     .low = {-2, -6, -3},
     .high = {8, 6, 8},
     .from = {0, -1.5, 1.5},
     .to = {0, 1.5, 3.5},
     .shape = {SEA(6, 5),
               {.kind = PLACE_BOX, .p = {3, 3.05, -1, 3, 0, 4}},
               {.kind = PLACE_CAPSULE, .p = {2, -2, 0, 1.5, -2.5, 5}, .thickness_m = 0.015}}},
    {.name = "diver",
     .what = "box tank; a diver swims through at 0.1 m/s",
     BOX_TANK,
     .shape[1] = {.kind = PLACE_CAPSULE, .p = {1.5, -3, 2, 1.5, -3, 3.2}, .thickness_m = 0.3, .v = {0, 0.1, 0}}},
    {.name = "soft bottom",
     .what = "the box tank, floor and surface 9 dB weaker than the walls",
     BOX_TANK,
     .level_db = -9},
    {.name = "far away",
     .what = "the box tank 1e7 m north and east of the origin",
     BOX_TANK,
     .origin_m = {1e7, 1e7, 0}},
};
const unsigned places_n = sizeof places / sizeof places[0];

const struct place *place_named(const char *name)
{
    for (unsigned i = 0; i < places_n; i++)
        if (strcmp(places[i].name, name) == 0)
            return &places[i];
    fprintf(stderr, "places: there is no '%s'\n", name);
    exit(1);
}

/* ---- shafts and harbours to be mapped ---- */

static void lean(struct dice *dice, double low_deg, double high_deg, double *sine, double *cosine)
{
    const double rad = geo_rad(dice_between(dice, low_deg, high_deg));
    *sine = sin(rad);
    *cosine = cos(rad);
}

static void draw_leaning_shaft(struct dice *dice, struct place *w)
{
    const double length_m = dice_between(dice, 4, 9), width_m = dice_between(dice, 3, 7),
                 height_m = dice_between(dice, 4, 9), from_m = dice_between(dice, 0.2, 0.6) * height_m;
    double sine, cosine;
    lean(dice, 5, 35, &sine, &cosine);
    w->name = "drawn shaft";
    w->shape[0] = (struct place_shape)WATER(0, length_m, -width_m / 2, width_m / 2, 0, height_m);
    memcpy(w->shape[0].cut, (const double[]){cosine, 0, sine, length_m * cosine + from_m * sine},
           sizeof w->shape[0].cut);
    w->from[0] = w->to[0] = dice_between(dice, 0.8, length_m / 2);
    w->from[1] = w->to[1] = dice_between(dice, -0.2, 0.2) * width_m;
    w->from[2] = PLACE_DRAWN_CLEAR_M + 0.1;
    w->to[2] = height_m - PLACE_DRAWN_CLEAR_M - 0.1;
}

static void draw_sloping_harbour(struct dice *dice, struct place *w)
{
    const double towards_rad = dice_between(dice, 0, 6.283), quay_rad = dice_between(dice, 0, 6.283);
    double sine, cosine;
    lean(dice, 0, 35, &sine, &cosine);
    w->name = "drawn harbour";
    place_add(w, &(struct place_shape)SEA(FAR, dice_between(dice, 4, 7)));
    place_add(w, &(struct place_shape)BEHIND(-sine * cos(towards_rad), -sine * sin(towards_rad), -cosine,
                                             -dice_between(dice, 3, 5)));
    place_add(w, &(struct place_shape)BEHIND(-cos(quay_rad), -sin(quay_rad), 0, -dice_between(dice, 3, 8)));
    for (unsigned pile = 0; pile < 3; pile++)
        place_add(w, &(struct place_shape)PILE(dice_between(dice, -6, 6), dice_between(dice, -6, 6),
                                               dice_between(dice, 0.1, 0.3), 0, 8));
    place_add(w, &(struct place_shape){.kind = PLACE_CAPSULE,
                                       .p = {dice_between(dice, -4, 4), dice_between(dice, -4, 4), 0,
                                             dice_between(dice, -4, 4), dice_between(dice, -4, 4), 7},
                                       .thickness_m = 0.02});
    for (int a = 0; a < 2; a++) {
        w->from[a] = dice_between(dice, -2, 2);
        w->to[a] = w->from[a] + dice_between(dice, -2, 2);
    }
    w->from[2] = dice_between(dice, 0.8, 1.5);
    w->to[2] = dice_between(dice, 1.5, 3.5);
}

static bool is_clear(const struct place *w)
{
    for (int i = 0; i <= 50; i++) {
        double at[3];
        for (int a = 0; a < 3; a++)
            at[a] = w->from[a] + (w->to[a] - w->from[a]) * i / 50;
        if (place_clearance(w, at, NULL, 0) < PLACE_DRAWN_CLEAR_M)
            return false;
    }
    return true;
}

struct place place_drawn(uint64_t seed)
{
    struct dice dice = dice_of(seed, UINT64_MAX / 2);
    struct place w;
    do {
        w = (struct place){.low = {-10, -10, -3}, .high = {10, 10, 11}, .level_db = dice_between(&dice, -9, 0)};
        if (seed % 2)
            draw_sloping_harbour(&dice, &w);
        else
            draw_leaning_shaft(&dice, &w);
    } while (!is_clear(&w));
    return w;
}

/* ---- basins and tanks ---- */

struct place place_basin(uint64_t seed)
{
    struct dice dice = dice_of(seed, 1);
    const double half_m[2] = {5.0 + dice_uniform(&dice), 4.0 + dice_uniform(&dice)};
    struct place w = {.shape[0] = WATER(-half_m[0], half_m[0], -half_m[1], half_m[1], -INFINITY, INFINITY)};
    for (int k = 0; k < PLACE_BASIN_POSTS; k++) {
        const double az = GEO_TURN * (k + 0.6 * dice_uniform(&dice)) / PLACE_BASIN_POSTS,
                     r = 2.2 + 1.2 * dice_uniform(&dice);
        place_add(&w, &(struct place_shape)PILE(r * cos(az), r * sin(az), 0.1, -INFINITY, INFINITY));
    }
    return w;
}

struct place place_tank(uint64_t seed, double clear_m, double *heading_rad)
{
    struct dice dice = dice_of(seed, 77);
    struct place w = {.shape[0] = WATER(0)};
    double *p = w.shape[0].p;
    for (int axis = 0; axis < 2; axis++) {
        const double half_m = dice_between(&dice, 1.5, 9), off_m = dice_between(&dice, -1, 1) * (half_m - clear_m);
        p[2 * axis] = -half_m - off_m;
        p[2 * axis + 1] = half_m - off_m;
    }
    const double height_m = (p[1] - p[0]) / 2;
    p[4] = -height_m * dice_between(&dice, 0.5, 1.25);
    p[5] = height_m * dice_between(&dice, 0.5, 1.25);
    *heading_rad = dice_between(&dice, 0, GEO_TURN);
    return w;
}

/* ---- places to be steered through ---- */

const char *const pilot_place_name[PILOT_PLACES] = {"open", "harbour", "shaft", "basin", "dead end", "diver"};

struct drawing {
    struct place *place;
    struct dice dice;
    struct place_hull hull;
    double free_m;
};

static double between(struct drawing *d, double low, double high)
{
    return dice_between(&d->dice, low, high);
}

/* Tenths of a millimetre, as a scene's text would have them. Not where the vehicle starts or wants to go. */
static void add(struct drawing *d, struct place_shape s)
{
    for (int i = 0; i < 6; i++)
        s.p[i] = round(s.p[i] * 1e4) / 1e4;
    for (int i = 0; i < 3; i++)
        s.v[i] = round(s.v[i] * 1e4) / 1e4;
    if (s.water || (place_shape_clearance(&s, d->place->from, &d->hull, 0) > d->free_m &&
                    place_shape_clearance(&s, d->place->to, &d->hull, 0) > 0.8))
        place_add(d->place, &s);
}

static void add_box(struct drawing *d, const double p[6])
{
    struct place_shape s = {.kind = PLACE_BOX};
    memcpy(s.p, p, sizeof s.p);
    add(d, s);
}

static void add_piles(struct drawing *d, int n, double thin_m, double thick_m, double half_m)
{
    for (int i = 0; i < n; i++)
        add(d, (struct place_shape)PILE(between(d, 1, 12), between(d, -half_m, half_m),
                                        between(d, thin_m, thick_m), -INFINITY, INFINITY));
}

/* Across the way, and mostly above or below the level of a sonar. */
static void add_beam(struct drawing *d, double half_m)
{
    const double x = between(d, 0.8, 11), down = between(d, -1.4, 1.4), thick = between(d, 0.1, 0.3);
    add_box(d, (const double[]){x, x + thick, -half_m, between(d, -0.5, half_m), down, down + thick});
}

/* Across or along. */
static void add_net(struct drawing *d, double x, double y, double least_m, double most_m, double low)
{
    const bool across = dice_chance(&d->dice, 0.5);
    const double long_m = least_m < most_m ? between(d, least_m, most_m) : most_m;
    add_box(d, (const double[]){x, x + (across ? 0.05 : long_m), y, y + (across ? long_m : 0.05), -4, low});
}

static void draw_open(struct drawing *d)
{
    add_piles(d, 3, 0.1, 0.4, 5);
}

static void draw_harbour(struct drawing *d)
{
    const double quay_m = between(d, 3.5, 6);
    add_box(d, (const double[]){-30, 40, quay_m, quay_m + 10, -10, 10});
    add_box(d, (const double[]){-30, 40, -30, 30, between(d, 2.2, 4), 10});
    add_piles(d, 8, 0.15, 0.4, 5);
    for (int i = 0; i < 3; i++)
        add_beam(d, 2.5);
    for (int i = 0; i < 2; i++) { /* hanging from above with a free edge below */
        const double x = between(d, 2, 11), y = between(d, -4, 3), low = between(d, -0.2, 6);
        add_net(d, x, y, 1, 3, low);
    }
}

static void draw_walls(struct drawing *d, double half_m)
{
    add(d, (struct place_shape)WATER(-3, 15, -half_m, half_m, -between(d, 2, 4), between(d, 2, 4)));
}

static void draw_shaft(struct drawing *d)
{
    const double half_m = between(d, 2.2, 3.5);
    draw_walls(d, half_m);
    for (int i = 0; i < 4; i++) {
        const double x = between(d, 1, 12), out_m = between(d, 0.3, half_m - 0.8);
        if (i % 2)
            add_box(d, (const double[]){x, x + 0.5, half_m - out_m, half_m, -4, 4});
        else
            add_box(d, (const double[]){x, x + 0.5, -half_m, -half_m + out_m, -4, 4});
    }
    add_beam(d, half_m);
}

static void draw_basin(struct drawing *d)
{
    draw_walls(d, between(d, 4, 7));
    add_piles(d, 7, 0.05, 0.12, 5);
    for (int i = 0; i < 2; i++) {
        const double x = between(d, 2, 11), y = between(d, -4, 3);
        add_net(d, x, y, 3, 3, 4);
    }
}

static void draw_dead_end(struct drawing *d)
{
    const double half_m = between(d, 1.5, 2.5), from_m = between(d, 2, 4), to_m = between(d, 6.5, 8.4);
    add_box(d, (const double[]){from_m, to_m, half_m, half_m + 0.3, -5, 5});
    add_box(d, (const double[]){from_m, to_m, -half_m - 0.3, -half_m, -5, 5});
    add_box(d, (const double[]){to_m, to_m + 0.3, -half_m - 0.3, half_m + 0.3, -5, 5});
    add_piles(d, 2, 0.1, 0.3, 6);
}

static void draw_diver(struct drawing *d)
{
    const double side = dice_chance(&d->dice, 0.5) ? -1 : 1;
    add_piles(d, 3, 0.1, 0.4, 5);
    add(d, (struct place_shape){.kind = PLACE_TUBE,
                                .p = {between(d, 3, 8), -side * between(d, 6, 14), 0.3, -INFINITY, INFINITY},
                                .v = {between(d, -0.05, 0.05), side * between(d, 0.15, 0.35)}});
}

struct place place_of_pilot(enum pilot_place place, uint64_t seed, const struct place_hull *hull, double free_m)
{
    static void (*const draw[PILOT_PLACES])(struct drawing *) = {
        [PILOT_OPEN] = draw_open,   [PILOT_HARBOUR] = draw_harbour,   [PILOT_SHAFT] = draw_shaft,
        [PILOT_BASIN] = draw_basin, [PILOT_DEAD_END] = draw_dead_end, [PILOT_DIVER] = draw_diver};
    struct place w = {.name = pilot_place_name[place]};
    struct drawing d = {.place = &w, .dice = dice_of(seed, place), .hull = *hull, .free_m = free_m};
    w.to[0] = between(&d, 10, 13);
    w.to[1] = between(&d, -1, 1);
    draw[place](&d);
    return w;
}
