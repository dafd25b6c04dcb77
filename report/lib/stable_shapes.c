/* SPDX-License-Identifier: MIT */
/* stable_shapes - cases G of what cells form together: components, regions of constant depth, walls. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "grid/geometry.h"
#include "grid/sphere/components.h"
#include "grid/sphere/depth_regions.h"
#include "grid/sphere/tangents.h"
#include "tests/water/dice.h"
#include "stable.h"

#define ROOM   4096
#define LAYERS 6

static struct rings rings;
static struct components components;

static uint32_t count(void)
{
    uint32_t n = 0;
    COMPONENTS_EACH(&components, root)
    n++;
    return n;
}

/* Components of a set of cells by flooding, with or without what joins across azimuth 0 and at the poles. */
static uint32_t count_by_hand(const uint8_t *in, bool round)
{
    static uint32_t stack[ROOM];
    static uint8_t left[ROOM];
    uint32_t n = 0;
    memcpy(left, in, rings.n * LAYERS);
    for (uint32_t start = 0; start < rings.n * LAYERS; start++) {
        if (!left[start])
            continue;
        uint32_t high = 0;
        left[start] = 0;
        stack[high++] = start;
        n++;
        while (high > 0) {
            const uint32_t at = stack[--high], d = at / LAYERS;
            struct rings_run run[3];
            const unsigned runs = rings_touching(&rings, d, run);
            for (unsigned r = 0; r < runs; r++)
                for (uint32_t k = 0; k < run[r].n; k++) {
                    const uint32_t other = rings_in(&run[r], k);
                    double az[2], el;
                    rings_centre(&rings, d, &az[0], &el);
                    rings_centre(&rings, other, &az[1], &el);
                    if (!round && fabs(az[0] - az[1]) > GEO_PI / 2)
                        continue;
                    for (int l = -1; l <= 1; l++) {
                        const int64_t layer = (int64_t)(at % LAYERS) + l;
                        const uint32_t to = other * LAYERS + (uint32_t)layer;
                        if (layer >= 0 && layer < LAYERS && left[to]) {
                            left[to] = 0;
                            stack[high++] = to;
                        }
                    }
                }
        }
    }
    return n;
}

static void changes(bool quick, struct stable_found *f)
{
    static uint8_t in[ROOM];
    struct dice dice = dice_of(19, 0);
    const int steps = quick ? 2000 : 100000;
    rings_full(&rings, geo_rad(20));
    void *memory = stable_memory(components_bytes(ROOM));
    components_init(&components, memory, &rings, ROOM);
    memset(in, 0, sizeof in);
    f->naive = f->ours = 0;
    for (int i = 0; i < steps; i++) {
        const uint32_t d = (uint32_t)(dice_bits(&dice) % rings.n), l = (uint32_t)(dice_bits(&dice) % LAYERS);
        const bool put = dice_uniform(&dice) < 0.3;
        if (put)
            components_put(&components, d, (uint16_t)l, true, 1);
        else
            components_remove(&components, d, (uint16_t)l);
        in[d * LAYERS + l] = put;
        components_settle(&components, 1);
        if (i % 10)
            continue;
        const uint32_t want = count_by_hand(in, true);
        f->ours += count() != want;
        f->naive += count_by_hand(in, false) != want;
    }
    /* All cells, then a ring around the pole with a bridge that goes. */
    for (uint32_t d = 0; d < rings.n; d++)
        for (uint16_t l = 0; l < LAYERS; l++)
            components_put(&components, d, l, true, 1);
    components_settle(&components, 1);
    f->ours += count() != 1;
    free(memory);
}

/* A round tank, stairs, a missing beam: regions that are not as they must be. Naive: neighbours that differ by less
 * than the window are joined, and the turn has an end. */
static uint32_t chained(const double *range_m, uint32_t n, double window_m)
{
    uint32_t regions = 0, length = 0;
    for (uint32_t i = 0; i <= n; i++) {
        if (i < n && isfinite(range_m[i]) && (length == 0 || fabs(range_m[i] - range_m[i - 1]) <= window_m)) {
            length++;
            continue;
        }
        regions += length >= 3;
        length = i < n && isfinite(range_m[i]);
    }
    return regions;
}

static void depths(bool quick, struct stable_found *f)
{
    static double range_m[400];
    struct depth_region region[64];
    uint32_t n;
    (void)quick;
    for (int i = 0; i < 400; i++)
        range_m[i] = 3;
    n = depth_regions(range_m, 400, 0, 3, region, 64);
    f->ours = n != 1 || region[0].n != 400;
    range_m[40] = NAN;
    n = depth_regions(range_m, 400, 0.1, 3, region, 64);
    f->ours += n != 1 || region[0].n != 399;
    f->naive = chained(range_m, 400, 0.1) != 1;
    range_m[60] = INFINITY;
    n = depth_regions(range_m, 400, 0.1, 3, region, 64);
    f->ours += n != 2 || region[0].n != 379 || region[1].n != 19;
    for (int i = 0; i < 100; i++)
        range_m[i] = 1 + 0.25 * i;
    n = depth_regions(range_m, 100, 0.75, 3, region, 64);
    f->ours += n != 25;
    f->naive += chained(range_m, 100, 0.75) != 25;
}

/* Points along lines at angles next to 0 = pi, and all in one place. */
static void lines(bool quick, struct stable_found *f)
{
    static const struct tangents_conf conf = {7, 8 * GEO_PI / 180, 0.08, 0, 0.6, 0, 6, 0.1};
    static struct tangent_point p[100];
    static uint32_t of[100];
    struct wall wall[8];
    (void)quick;
    f->naive = f->ours = 0;
    for (int sign = -1; sign <= 1; sign++) {
        for (int i = 0; i < 100; i++)
            p[i] = i < 40 ? (struct tangent_point){2 - 0.1 * i, 3 + sign * (i < 20 ? 1e-12 : -1e-12) * i}
                          : (struct tangent_point){NAN, NAN};
        f->ours += tangents_walls(&conf, p, 100, wall, 8, of) != 1 || wall[0].points != 40;
        /* Naive: slopes as angles in [0, pi), compared by their difference; the halves of the wall lie at both ends. */
        const double a = fmod(atan2(p[19].y_m - p[0].y_m, p[19].x_m - p[0].x_m) + GEO_PI, GEO_PI);
        const double b = fmod(atan2(p[39].y_m - p[20].y_m, p[39].x_m - p[20].x_m) + GEO_PI, GEO_PI);
        f->naive += fabs(a - b) > conf.angle_rad;
    }
    for (int i = 0; i < 100; i++)
        p[i] = (struct tangent_point){2, 3};
    f->ours += tangents_walls(&conf, p, 100, wall, 8, of) != 0; /* undefined, not a wall at angle 0 */
    f->naive += atan2(0.0, 0.0) == 0;
}

const struct stable_case stable_shapes[] = {
    {"G19", "components over 1e5 random changes, seam and poles; all cells", "wrong counts",
     "no joining at azimuth 0 and the poles", 0, changes},
    {"G20", "a round tank, stairs, missing beams", "wrong regions", "neighbours chained", 0, depths},
    {"G21", "lines at angle pi +- 1e-12; points all in one place", "wrong walls", "difference of slopes", 0,
     lines},
    {0},
};
