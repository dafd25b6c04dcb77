/* SPDX-License-Identifier: MIT */
/*
 * walls - holds the first echoes of the recording box.mcap against the walls of the channel it was made in. Reads the
 * result of the `image` method on standard input, prints a table, ends with 1 when the sonar's word is not good
 * enough: every beam of the end wall within 3 cm, four of five side-wall beams within 5 cm, no echo in open water.
 *
 * The walls (tests/replay/README.md): distance along the normal, bearing of the normal on the head's scale.
 */
#include <jansson.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>

#include "grid/geometry.h"

static const struct wall {
    const char *name;
    double distance_m, normal_deg;
    double from_deg, to_deg; /* bearings at which it was fitted */
    double limit_m;          /* how near an echo must be */
    double share;            /* of the beams that must be */
} walls[] = {
    {"side A", 0.261, 94.8, 135, 170, 0.05, 0.80},
    {"end", 1.460, 184.7, 176, 194, 0.03, 1.00},
    {"side B", 0.294, 273.9, 198, 225, 0.05, 0.80},
};
/* So far before every wall an echo stands in open water: beyond what grazing incidence smears a wall by. */
#define OPEN_WATER_M 0.1

#define WALLS (sizeof walls / sizeof walls[0])

static double range_of(const struct wall *w, double bearing_deg)
{
    double c = cos(geo_rad(bearing_deg - w->normal_deg));
    return c > 1e-3 ? w->distance_m / c : INFINITY;
}

static double nearest_wall(double bearing_deg)
{
    double r = INFINITY;
    for (size_t i = 0; i < WALLS; i++)
        r = fmin(r, range_of(&walls[i], bearing_deg));
    return r;
}

int main(void)
{
    json_error_t fault;
    json_t *image = json_loadf(stdin, 0, &fault), *rows = json_object_get(image, "rows"), *row;
    size_t i;
    struct {
        int beams, found, good;
        double sum, worst;
    } tally[WALLS] = {0};
    int beams = 0, open_water = 0;
    if (!json_array_size(rows)) {
        fprintf(stderr, "walls: no rows on standard input: %s\n", fault.text);
        return 1;
    }
    json_array_foreach(rows, i, row)
    {
        double bearing = geo_deg(geo_wrap(geo_rad(json_number_value(json_object_get(row, "azimuth_deg")) + 180)));
        json_t *echo = json_object_get(row, "echo_m");
        double range = json_is_number(echo) ? json_number_value(echo) : INFINITY;
        beams++;
        open_water += range < nearest_wall(bearing) - OPEN_WATER_M;
        for (size_t k = 0; k < WALLS; k++) {
            if (bearing < walls[k].from_deg - 0.01 || bearing > walls[k].to_deg + 0.01)
                continue;
            double off = fabs(range - range_of(&walls[k], bearing));
            tally[k].beams++;
            tally[k].found += isfinite(range);
            tally[k].good += off <= walls[k].limit_m;
            if (off <= walls[k].limit_m) {
                tally[k].sum += off;
                tally[k].worst = fmax(tally[k].worst, off);
            }
        }
    }
    bool ok = open_water == 0;
    printf("wall     known m  beams  echo  within  mean off  worst off\n");
    for (size_t k = 0; k < WALLS; k++) {
        printf("%-7s  %7.3f  %5d  %4d  %2.0f cm %3d %% %5.1f cm  %6.1f cm\n", walls[k].name, walls[k].distance_m,
               tally[k].beams, tally[k].found, walls[k].limit_m * 100, 100 * tally[k].good / tally[k].beams,
               tally[k].good ? 100 * tally[k].sum / tally[k].good : 0, 100 * tally[k].worst);
        ok = ok && tally[k].good >= walls[k].share * tally[k].beams;
    }
    printf("echoes in the open water before the walls: %d of %d beams\n", open_water, beams);
    json_decref(image);
    return ok ? 0 : 1;
}
