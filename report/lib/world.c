/* SPDX-License-Identifier: MIT */
/* world - shapes as distances, and beams through them; see world.h. */
#include "world.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dice.h"

#define CLOSE_M 0.004 /* patches of a beam are divided until they are known so well */
#define RAY_M   1e-4  /* a ray has arrived */
#define FAR     1e3

/* The shaft of Table I: x is its length, y its width. The duct is 1.5 m wide along x; the wall opposite to the vehicle
 * leans over from 12 m down; the penstock runs along x, and the vehicle ends in the middle of its height. */
#define OBLIQUE_COS 0.938876315 /* of the wall from (9, 12) to (3.5, 27) against the vertical */
#define OBLIQUE_SIN 0.344254649

const struct world worlds[] = {
    {.name = "shaft",
     .what = "dam shaft: chamber 9 x 5 x 27 m with an oblique wall, duct 1.5 x 3 m, penstock",
     .low = {-1, -4, -3},
     .high = {10, 4, 38},
     .from = {2.25, 0, 0.5},
     .to = {2.25, 0, 33},
     .water = {{.kind = WORLD_BOX,
                .p = {0, -2.5, 0, 9, 2.5, 27},
                .cut = {OBLIQUE_COS, 0, OBLIQUE_SIN, 9 * OBLIQUE_COS + 12 * OBLIQUE_SIN}},
               {.kind = WORLD_BOX, .p = {1.5, -1.5, 26.9, 3, 1.5, 30.1}},
               {.kind = WORLD_BOX, .p = {-25, -2.5, 30, 30, 2.5, 36}}}},
    {.name = "box tank",
     .what = "tank 8 x 5 x 6 m",
     .low = {-5, -3.5, -3},
     .high = {5, 3.5, 9},
     .from = {-1, 0.4, 0.5},
     .to = {-1, 0.4, 5.5},
     .water = {{.kind = WORLD_BOX, .p = {-4, -2.5, 0, 4, 2.5, 6}}}},
    {.name = "round tank",
     .what = "round tank, radius 3 m, depth 5 m",
     .low = {-4, -4, -3},
     .high = {4, 4, 8},
     .from = {0.5, 0, 0.5},
     .to = {0.5, 0, 4.5},
     .water = {{.kind = WORLD_TUBE, .p = {0, 0, 0, 5, 3}}}},
    {.name = "harbour",
     .what = "quay, a second wall at 60 degrees, bottom at 5 m, a pile",
     .low = {-7, -7, -3},
     .high = {7, 7, 8},
     .from = {-2, 0, 1},
     .to = {2, 0, 2.5},
     .water = {{.kind = WORLD_BOX, .p = {-FAR, -FAR, 0, FAR, FAR, 5}}},
     .solid = {{.kind = WORLD_HALF, .cut = {0, -1, 0, -4}},
               {.kind = WORLD_HALF, .cut = {-0.8660254, 0.5, 0, -5}},
               {.kind = WORLD_TUBE, .p = {0, -3, 0, 5, 0.15}}}},
    {.name = "pier",
     .what = "pier with piles of 0.3 m, a wall behind",
     .low = {-3, -5, -3},
     .high = {9, 5, 8},
     .from = {0, -3, 1.5},
     .to = {0, 3, 3.5},
     .water = {{.kind = WORLD_BOX, .p = {-FAR, -FAR, 0, 7, FAR, 5}}},
     .solid = {{.kind = WORLD_TUBE, .p = {3, -3, 0, 5, 0.15}},
               {.kind = WORLD_TUBE, .p = {3, 0, 0, 5, 0.15}},
               {.kind = WORLD_TUBE, .p = {3, 3, 0, 5, 0.15}},
               {.kind = WORLD_TUBE, .p = {5, -1.5, 0, 5, 0.15}},
               {.kind = WORLD_TUBE, .p = {5, 1.5, 0, 5, 0.15}}}},
    {.name = "slope",
     .what = "bottom that rises by 30 degrees",
     .low = {-3, -6, -3},
     .high = {11, 6, 10},
     .from = {0, 0, 1},
     .to = {1, 0, 4},
     .water = {{.kind = WORLD_BOX, .p = {-FAR, -FAR, 0, FAR, FAR, FAR}}},
     .solid = {{.kind = WORLD_HALF, .cut = {-0.5, 0, -0.8660254, -5}}}},
    {.name = "net and line",
     .what = "a net of 5 cm at 3 m and a mooring line of 3 cm at 2 m, a wall at 6 m",
     .low = {-2, -6, -3},
     .high = {8, 6, 8},
     .from = {0, -1.5, 1.5},
     .to = {0, 1.5, 3.5},
     .water = {{.kind = WORLD_BOX, .p = {-FAR, -FAR, 0, 6, FAR, 5}}},
     .solid = {{.kind = WORLD_BOX, .p = {3, -1, 0, 3.05, 3, 4}},
               {.kind = WORLD_CAPSULE, .p = {2, -2, 0, 1.5, -2.5, 5}, .thickness_m = 0.015}}},
    {.name = "diver",
     .what = "box tank; a diver swims through at 0.1 m/s",
     .low = {-5, -3.5, -3},
     .high = {5, 3.5, 9},
     .from = {-1, 0.4, 0.5},
     .to = {-1, 0.4, 5.5},
     .water = {{.kind = WORLD_BOX, .p = {-4, -2.5, 0, 4, 2.5, 6}}},
     .solid = {{.kind = WORLD_CAPSULE, .p = {1.5, -3, 2, 1.5, -3, 3.2}, .thickness_m = 0.3, .v = {0, 0.1, 0}}}},
    {.name = "soft bottom",
     .what = "the box tank, floor and surface 9 dB weaker than the walls",
     .low = {-5, -3.5, -3},
     .high = {5, 3.5, 9},
     .from = {-1, 0.4, 0.5},
     .to = {-1, 0.4, 5.5},
     .level_db = -9,
     .water = {{.kind = WORLD_BOX, .p = {-4, -2.5, 0, 4, 2.5, 6}}}},
    {.name = "far away",
     .what = "the box tank 1e7 m north and east of the origin",
     .origin_m = {1e7, 1e7, 0},
     .low = {-5, -3.5, -3},
     .high = {5, 3.5, 9},
     .from = {-1, 0.4, 0.5},
     .to = {-1, 0.4, 5.5},
     .water = {{.kind = WORLD_BOX, .p = {-4, -2.5, 0, 4, 2.5, 6}}}},
};
const unsigned worlds_n = sizeof worlds / sizeof worlds[0];

const struct world *world_named(const char *name)
{
    for (unsigned i = 0; i < worlds_n; i++)
        if (strcmp(worlds[i].name, name) == 0)
            return &worlds[i];
    fprintf(stderr, "world: there is no '%s'\n", name);
    exit(1);
}

/* ---- distances: positive inside a shape ---- */

static double in_box(const double p[6], const double q[3])
{
    double inside = INFINITY, out2 = 0;
    for (int a = 0; a < 3; a++) {
        const double d = fmin(q[a] - p[a], p[a + 3] - q[a]);
        inside = fmin(inside, d);
        out2 += d < 0 ? d * d : 0;
    }
    return out2 > 0 ? -sqrt(out2) : inside;
}

static double in_tube(const double p[6], const double q[3])
{
    const double side = p[4] - hypot(q[0] - p[0], q[1] - p[1]), end = fmin(q[2] - p[2], p[3] - q[2]);
    if (side < 0 && end < 0)
        return -hypot(side, end);
    return fmin(side, end);
}

static double in_capsule(const double p[6], double radius, const double q[3])
{
    double along = 0, length2 = 0, d2 = 0;
    for (int a = 0; a < 3; a++) {
        along += (q[a] - p[a]) * (p[a + 3] - p[a]);
        length2 += (p[a + 3] - p[a]) * (p[a + 3] - p[a]);
    }
    const double t = fmin(fmax(along / length2, 0), 1);
    for (int a = 0; a < 3; a++) {
        const double d = q[a] - p[a] - t * (p[a + 3] - p[a]);
        d2 += d * d;
    }
    return radius - sqrt(d2);
}

static double in_shape(const struct world_shape *s, const double at[3], double t_s)
{
    const double q[3] = {at[0] - s->v[0] * t_s, at[1] - s->v[1] * t_s, at[2] - s->v[2] * t_s};
    double d = INFINITY;
    if (s->kind == WORLD_BOX)
        d = in_box(s->p, q);
    else if (s->kind == WORLD_TUBE)
        d = in_tube(s->p, q);
    else if (s->kind == WORLD_CAPSULE)
        d = in_capsule(s->p, s->thickness_m, q);
    if (s->cut[0] != 0 || s->cut[1] != 0 || s->cut[2] != 0)
        d = fmin(d, s->cut[3] - s->cut[0] * q[0] - s->cut[1] * q[1] - s->cut[2] * q[2]);
    return d;
}

double world_clearance(const struct world *w, const double p[3], double t_s)
{
    double clear = -INFINITY;
    for (unsigned i = 0; i < sizeof w->water / sizeof w->water[0] && w->water[i].kind != WORLD_END; i++)
        clear = fmax(clear, in_shape(&w->water[i], p, t_s));
    for (unsigned i = 0; i < WORLD_MAX_SHAPES && w->solid[i].kind != WORLD_END; i++)
        clear = fmin(clear, -in_shape(&w->solid[i], p, t_s));
    return clear;
}

double world_ray(const struct world *w, const double from[3], const double d[3], double max_m, double t_s)
{
    double r = 0;
    while (r < max_m) {
        const double p[3] = {from[0] + r * d[0], from[1] + r * d[1], from[2] + r * d[2]};
        const double clear = world_clearance(w, p, t_s);
        if (clear < RAY_M)
            return r;
        r += clear;
    }
    return max_m;
}

/* ---- worlds by chance ---- */

static double between(struct dice *dice, double low, double high)
{
    return low + (high - low) * dice_uniform(dice);
}

static void lean(struct dice *dice, double low_deg, double high_deg, double *sine, double *cosine)
{
    const double rad = between(dice, low_deg, high_deg) * 3.14159265358979 / 180;
    *sine = sin(rad);
    *cosine = cos(rad);
}

static void draw_shaft(struct dice *dice, struct world *w)
{
    const double length_m = between(dice, 4, 9), width_m = between(dice, 3, 7), height_m = between(dice, 4, 9);
    const double from_m = between(dice, 0.2, 0.6) * height_m;
    double sine, cosine;
    lean(dice, 5, 35, &sine, &cosine);
    w->name = "drawn shaft";
    w->water[0] = (struct world_shape){.kind = WORLD_BOX,
                                       .p = {0, -width_m / 2, 0, length_m, width_m / 2, height_m},
                                       .cut = {cosine, 0, sine, length_m * cosine + from_m * sine}};
    w->from[0] = w->to[0] = between(dice, 0.8, length_m / 2);
    w->from[1] = w->to[1] = between(dice, -0.2, 0.2) * width_m;
    w->from[2] = WORLD_DRAWN_CLEAR_M + 0.1;
    w->to[2] = height_m - WORLD_DRAWN_CLEAR_M - 0.1;
}

static void draw_harbour(struct dice *dice, struct world *w)
{
    const double towards_rad = between(dice, 0, 6.283), quay_rad = between(dice, 0, 6.283);
    double sine, cosine;
    unsigned n = 0;
    lean(dice, 0, 35, &sine, &cosine);
    w->name = "drawn harbour";
    w->water[0] = (struct world_shape){.kind = WORLD_BOX, .p = {-FAR, -FAR, 0, FAR, FAR, between(dice, 4, 7)}};
    w->solid[n++] = (struct world_shape){
        .kind = WORLD_HALF,
        .cut = {-sine * cos(towards_rad), -sine * sin(towards_rad), -cosine, -between(dice, 3, 5)}};
    w->solid[n++] =
        (struct world_shape){.kind = WORLD_HALF, .cut = {-cos(quay_rad), -sin(quay_rad), 0, -between(dice, 3, 8)}};
    for (unsigned pile = 0; pile < 3; pile++)
        w->solid[n++] = (struct world_shape){
            .kind = WORLD_TUBE, .p = {between(dice, -6, 6), between(dice, -6, 6), 0, 8, between(dice, 0.1, 0.3)}};
    w->solid[n] = (struct world_shape){
        .kind = WORLD_CAPSULE,
        .p = {between(dice, -4, 4), between(dice, -4, 4), 0, between(dice, -4, 4), between(dice, -4, 4), 7},
        .thickness_m = 0.02};
    for (int a = 0; a < 2; a++) {
        w->from[a] = between(dice, -2, 2);
        w->to[a] = w->from[a] + between(dice, -2, 2);
    }
    w->from[2] = between(dice, 0.8, 1.5);
    w->to[2] = between(dice, 1.5, 3.5);
}

static bool is_clear(const struct world *w)
{
    for (int i = 0; i <= 50; i++) {
        double at[3];
        for (int a = 0; a < 3; a++)
            at[a] = w->from[a] + (w->to[a] - w->from[a]) * i / 50;
        if (world_clearance(w, at, 0) < WORLD_DRAWN_CLEAR_M)
            return false;
    }
    return true;
}

struct world world_drawn(uint64_t seed)
{
    struct dice dice = dice_of(seed, UINT64_MAX / 2);
    struct world w;
    do {
        w = (struct world){.low = {-10, -10, -3}, .high = {10, 10, 11}, .level_db = between(&dice, -9, 0)};
        if (seed % 2)
            draw_harbour(&dice, &w);
        else
            draw_shaft(&dice, &w);
    } while (!is_clear(&w));
    return w;
}

/* ---- a beam's first range ---- */

struct beam_search {
    const struct world *w;
    const double *from;
    const double (*axis)[3];
    double t_s, first; /* the least range at which a patch came close, so far */
};

/* A patch of directions; all of it is known to be clear up to r. */
static void search(struct beam_search *s, double az, double el, double half_az, double half_el, double r)
{
    const double in_beam[3] = {cos(az) * cos(el), sin(az) * cos(el), -sin(el)};
    const double spread = hypot(half_az, half_el);
    double d[3];
    for (int a = 0; a < 3; a++)
        d[a] = s->axis[0][a] * in_beam[0] + s->axis[1][a] * in_beam[1] + s->axis[2][a] * in_beam[2];
    for (;;) {
        if (r >= s->first - CLOSE_M)
            return;
        const double p[3] = {s->from[0] + r * d[0], s->from[1] + r * d[1], s->from[2] + r * d[2]};
        const double clear = world_clearance(s->w, p, s->t_s) - r * spread;
        if (clear < CLOSE_M / 4)
            break;
        r += clear; /* no point of the patch is farther than r * spread from p, so all stay clear */
    }
    if (r * spread < CLOSE_M) {
        s->first = r;
        return;
    }
    if (half_az > half_el) {
        search(s, az - half_az / 2, el, half_az / 2, half_el, r);
        search(s, az + half_az / 2, el, half_az / 2, half_el, r);
    } else {
        search(s, az, el - half_el / 2, half_az, half_el / 2, r);
        search(s, az, el + half_el / 2, half_az, half_el / 2, r);
    }
}

double world_first(const struct world *w, const double from[3], const double axis[3][3], double half_az_rad,
                   double half_el_rad, double max_m, double t_s)
{
    struct beam_search s = {w, from, axis, t_s, max_m + CLOSE_M};
    search(&s, 0, 0, half_az_rad, half_el_rad, 0);
    return fmax(0, s.first - CLOSE_M);
}
