/* SPDX-License-Identifier: MIT */
/*
 * pilot_runs - many drives through worlds drawn at random (run.h), and what came of them: collisions, time to the goal
 * against a pilot who knows the world, what held the vehicle.
 *
 *   pilot_runs [DRIVES [SEED [FOLDER]]]   a table; with a folder an SVG of each kind of drive, and of every collision
 *
 * PILOT_NEAR=metres sets [vehicle] near, PILOT_CONF=text is added to the configuration, PILOT_ONLY=number drives one.
 * The status is 1 when there was a collision.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "track.h"

#define KINDS (PILOT_SONARS * PILOT_NAVS * 2)

struct row {
    long drives, arrived, collided, touched;
    double share[3], ratio[1000]; /* of those with a chart */
    int ratios;
};

static struct row by_kind[KINDS], by_place[PILOT_PLACES];
static struct {
    char text[PILOT_REASON_SIZE];
    long n;
} reasons[40];

static void add(struct row *row, const struct pilot_case *c, const struct pilot_result *r)
{
    row->drives++;
    row->arrived += r->arrived;
    row->collided += r->collided;
    row->touched += r->touched_mps >= 0 && !r->collided;
    for (int i = 0; i < 3; i++)
        row->share[i] += r->share[i];
    if (c->chart && row->ratios < 1000)
        row->ratio[row->ratios++] = r->arrived ? r->time_s / r->known_s : INFINITY;
}

static void add_reasons(const struct pilot_result *r)
{
    for (int i = 0; i < PILOT_REASONS && r->reason[i].n; i++)
        for (size_t k = 0; k < sizeof reasons / sizeof *reasons; k++) {
            if (reasons[k].n == 0)
                memcpy(reasons[k].text, r->reason[i].text, sizeof reasons[k].text);
            if (strcmp(reasons[k].text, r->reason[i].text) == 0) {
                reasons[k].n += r->reason[i].n;
                break;
            }
        }
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void print_row(const char *name, struct row *row)
{
    if (row->drives == 0)
        return;
    qsort(row->ratio, (size_t)row->ratios, sizeof row->ratio[0], ascending);
    printf("%-30s %6ld %10ld %8ld %8ld", name, row->drives, row->collided, row->touched, row->arrived);
    if (row->ratios)
        printf(" %8.1f %8.1f", row->ratio[row->ratios / 2], row->ratio[row->ratios * 9 / 10]);
    else
        printf(" %8s %8s", "-", "-");
    printf(" %8.0f %% %8.0f %%\n", 100 * row->share[PILOT_UNKNOWN] / (double)row->drives,
           100 * row->share[PILOT_BLOCKED] / (double)row->drives);
}

static void print_head(const char *what)
{
    printf("\n%-30s %6s %10s %8s %8s %8s %8s %10s %10s\n", what, "drives", "collisions", "touches", "arrived",
           "ratio", "90 %", "unknown", "blocked");
}

static void print_all(void)
{
    print_head("sonar, poses carry");
    for (int i = 0; i < KINDS; i++) {
        char name[64];
        snprintf(name, sizeof name, "%s, %s, %s", pilot_sonar_name[i % PILOT_SONARS],
                 pilot_nav_name[i / PILOT_SONARS % PILOT_NAVS], i < KINDS / 2 ? "near auto" : "near given");
        print_row(name, &by_kind[i]);
    }
    print_head("place");
    for (int i = 0; i < PILOT_PLACES; i++)
        print_row(pilot_place_name[i], &by_place[i]);
    printf("\nheld by unknown water because\n");
    for (size_t k = 0; k < sizeof reasons / sizeof *reasons && reasons[k].n; k++)
        printf("%8ld  %s\n", reasons[k].n, reasons[k].text);
}

static void draw(const char *folder, unsigned number, const struct pilot_case *c, const struct pilot_result *r,
                 const struct pilot_track *track)
{
    char path[512];
    snprintf(path, sizeof path, "%s/pilot-%03u%s.svg", folder, number, r->collided ? "-collision" : "");
    if (!track_write(path, c, r, track))
        perror(path);
}

int main(int argc, char **argv)
{
    static struct pilot_track track;
    const unsigned drives = argc > 1 ? (unsigned)atoi(argv[1]) : 54;
    const uint64_t seed = argc > 2 ? strtoull(argv[2], NULL, 10) : 20260101;
    const char *folder = argc > 3 ? argv[3] : NULL, *near = getenv("PILOT_NEAR"), *only = getenv("PILOT_ONLY");
    bool collided = false;

    for (unsigned i = 0; i < drives; i++) {
        struct pilot_case c;
        struct pilot_result r;
        char name[128];
        pilot_draw_case(seed, i, &c);
        c.near_m = near ? atof(near) : c.near_m;
        c.conf = getenv("PILOT_CONF");
        if (only && (int)i != atoi(only))
            continue;
        track.n = 0;
        if (!pilot_run(&c, &r, &track))
            continue;
        printf("%3u %-90s %s %5.0f s of %3.0f, unknown %3.0f %%, blocked %3.0f %%, least %.2f m", i,
               pilot_name(&c, name), r.arrived ? "arrived" : "late   ", r.time_s, r.known_s,
               100 * r.share[PILOT_UNKNOWN], 100 * r.share[PILOT_BLOCKED], r.nearest_m);
        if (r.touched_mps >= 0)
            printf(", %s at %.2f m/s after %.1f s", r.collided ? "COLLIDED" : "touched", r.touched_mps,
                   r.touched_s);
        printf("%s%s\n", r.arrived ? "" : "; ", r.arrived ? "" : r.last);
        fflush(stdout);
        const unsigned kind = (unsigned)c.nav * PILOT_SONARS + (unsigned)c.sonar;
        add(&by_kind[kind + (c.near_m > 0 ? KINDS / 2 : 0)], &c, &r);
        add(&by_place[c.place], &c, &r);
        add_reasons(&r);
        collided |= r.collided;
        if (folder && (i < 54 || r.collided))
            draw(folder, i, &c, &r, &track);
    }
    print_all();
    return collided;
}
