/* SPDX-License-Identifier: MIT */
/*
 * report_pilot - a vehicle that is driven by the answers through worlds drawn at random (tests/pilot/run.h).
 *
 *   report_pilot drives [quick|long]   CSV of pilot_tally_csv; PILOT_DRIVES=number is another number of drives
 *   report_pilot tracks [quick|long]   CSV: drive, kind, class, a, b, c, d: six drives seen from above, in metres
 *
 * kind is `title` (class: the text), `room` or `box` (x, x, y, y; class 1: the vehicle passes above or below it),
 * `pile` (x, y, radius), `swim` (x, y and how far it moves), `way` (x, y; class: enum pilot_held) or `goal` (x, y).
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/pilot/tally.h"

#define SEED         20260101u
#define DRIVES       8
#define QUICK_DRIVES 1
#define LONG_DRIVES  1008
#define QUICK_S      10.0 /* after which a drive that is shown ends */

static unsigned drives_of(const char *size)
{
    const char *said = getenv("PILOT_DRIVES");
    if (said)
        return (unsigned)atoi(said);
    return strcmp(size, "quick") == 0 ? QUICK_DRIVES : strcmp(size, "long") == 0 ? LONG_DRIVES : DRIVES;
}

static void drive_many(unsigned drives)
{
    static struct pilot_tally tally;
    for (unsigned i = 0; i < drives; i++) {
        struct pilot_case c;
        struct pilot_result r;
        pilot_draw_case(SEED, i, &c);
        if (pilot_run(&c, &r, NULL))
            pilot_tally_add(&tally, &c, &r);
    }
    pilot_tally_csv(&tally, stdout);
}

/* ---- tracks ---- */

static const struct {
    enum pilot_place place;
    enum pilot_sonar sonar;
    enum pilot_nav nav;
    enum pilot_setup setup;
    bool chart;
} shown[] = {
    {PILOT_OPEN, PILOT_MICRON, PILOT_VELOCITY, PILOT_LEVEL, true},
    {PILOT_HARBOUR, PILOT_MATRIX, PILOT_POSITION, PILOT_BARE, true},
    {PILOT_SHAFT, PILOT_FAN, PILOT_POSITION, PILOT_BARE, true},
    {PILOT_BASIN, PILOT_PING360, PILOT_POSITION, PILOT_LEVEL, true},
    {PILOT_DEAD_END, PILOT_PING360, PILOT_POSITION, PILOT_NEAR, false},
    {PILOT_DIVER, PILOT_FAN, PILOT_ATTITUDE, PILOT_LEVEL, true},
};

static void show_solid(unsigned drive, const struct place_shape *s, double end_s)
{
    const double *p = s->p;
    const bool apart = !s->water && (p[4] > pilot_hull.half_height_m || p[5] < -pilot_hull.half_height_m);
    if (s->kind == PLACE_BOX) {
        printf("%u,%s,%d,%.2f,%.2f,%.2f,%.2f\n", drive, s->water ? "room" : "box", apart, p[0], p[1], p[2], p[3]);
        return;
    }
    printf("%u,pile,0,%.2f,%.2f,%.2f,\n", drive, p[0], p[1], p[2]);
    if (place_moves(s))
        printf("%u,swim,0,%.2f,%.2f,%.2f,%.2f\n", drive, p[0], p[1], s->v[0] * end_s, s->v[1] * end_s);
}

static void show_world(unsigned drive, const struct pilot_case *c, double end_s)
{
    static struct place w;
    w = place_of_pilot(c->place, c->seed, &pilot_hull, pilot_free_m(c));
    for (const struct place_shape *s = w.shape; s->kind != PLACE_END; s++)
        show_solid(drive, s, end_s);
    printf("%u,goal,0,%.2f,%.2f,,\n", drive, w.to[0], w.to[1]);
}

/* The next world of that kind that has a way to the goal. */
static void show_drive(unsigned drive, double limit_s)
{
    static struct pilot_track track;
    struct pilot_result r;
    struct pilot_case c = {.place = shown[drive].place,
                           .sonar = shown[drive].sonar,
                           .nav = shown[drive].nav,
                           .setup = shown[drive].setup,
                           .chart = shown[drive].chart,
                           .poor = 0.5,
                           .current_mps = 0.05,
                           .limit_s = limit_s,
                           .seed = SEED};
    for (track.n = 0; !pilot_run(&c, &r, &track); track.n = 0)
        c.seed++;
    printf("%u,title,%s; %s; %s; %s; %s after %.0f s of %.0f s,,,,\n", drive, pilot_place_name[c.place],
           pilot_sonar_name[c.sonar], pilot_nav_name[c.nav], pilot_setup_name[c.setup],
           r.collided  ? "collided"
           : r.struck  ? "struck"
           : r.arrived ? "there"
                       : "on its way",
           r.time_s, r.known_s);
    show_world(drive, &c, r.end_s);
    for (int i = 0; i < track.n; i += 2)
        printf("%u,way,%d,%.2f,%.2f,,\n", drive, track.at[i].held, (double)track.at[i].x_m,
               (double)track.at[i].y_m);
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "", *size = argc > 2 ? argv[2] : "";
    if (strcmp(what, "drives") == 0) {
        drive_many(drives_of(size));
        return 0;
    }
    if (strcmp(what, "tracks") != 0) {
        fputs("usage: report_pilot drives|tracks [quick|long]\n", stderr);
        return 2;
    }
    printf("drive,kind,class,a,b,c,d\n");
    for (unsigned i = 0; i < sizeof shown / sizeof *shown; i++)
        show_drive(i, strcmp(size, "quick") == 0 ? QUICK_S : 0);
    return 0;
}
