/* SPDX-License-Identifier: MIT */
/*
 * report_recordings - the detector on recordings of real sonars: walls that are known, edges that anybody sees,
 * water that is empty. The box ships with the tests; what may not be shipped is looked for in ../shared/data.
 *
 *   report_recordings [look|held] [METHOD]   a table for people, with what is aimed at: of the recordings that the
 *                                            detector may be looked at with, of those held back, of all
 *   report_recordings csv [look|held]        the same as CSV, of all methods
 *   report_recordings cases [METHOD]         CSV: every beam that is counted as wrong
 *
 * METHOD: sonard (the shipped detector), threshold, SOCA, ping360_sonar
 */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lib/contest.h"
#include "lib/recordings.h"

#define DATA      "../shared/data/"
#define MAX_PINGS 4096
#define PAST_M    0.3
#define TURN      200 /* beams of the Micron at 1.8 degrees */

static enum contestant contestant;
static enum { TABLE, CSV, CASES } form;

/* What a method made of one ping, and what it heard. */
struct look {
    double bearing_deg, dr_m, pulse_m;
    uint32_t n;
    uint8_t sample[RECORDINGS_MAX_BINS];
    struct beam_echoes found;
};

static struct look looks[MAX_PINGS];
static int n_looks;

static void take(void *unused, const struct ping *ping, double bearing_deg)
{
    struct look *l = &looks[n_looks];
    (void)unused;
    if (n_looks == MAX_PINGS)
        return;
    n_looks++;
    l->bearing_deg = geo_deg(geo_wrap_pi(geo_rad(bearing_deg)));
    l->dr_m = (double)ping->dr_m;
    l->pulse_m = (double)ping->pulse_m;
    l->n = ping->n_bins;
    memcpy(l->sample, ping->samples, ping->n_bins);
    contest_detect(contestant, contest_standard(contestant), ping, &l->found);
}

static bool hear_text(const char *path, const struct recordings_head *head)
{
    n_looks = 0;
    contest_begin();
    return recordings_text(path, head, take, NULL);
}

static bool hear_log(const char *path)
{
    n_looks = 0;
    contest_begin();
    return recordings_ping_viewer(path, take, NULL);
}

/* ---- what is counted ---- */

static void row(const char *what, const char *aim, const char *format, ...) __attribute__((format(printf, 3, 4)));

static void row(const char *what, const char *aim, const char *format, ...)
{
    char text[120];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (form == TABLE)
        printf("%-66s %-10s %s\n", what, aim, text);
    else if (form == CSV)
        printf("\"%s\",\"%s\",%s,\"%s\"\n", what, aim, contest_name[contestant], text);
}

static void missing(const char *what)
{
    row(what, "", "not here");
}

static void wrong(const char *what, int ping, double at_m)
{
    const struct look *l = &looks[ping];
    if (form == CASES)
        printf("%s,%d,%.1f,%.2f,%.2f,%.2f,%.2f\n", what, ping, l->bearing_deg, at_m, (double)l->found.blind_m,
               (double)l->found.free_to_m, l->found.n > 0 ? (double)l->found.echo[0].range_m : NAN);
}

static bool claims(const struct look *l, double to_m)
{
    const struct beam_echoes *b = &l->found;
    return b->state != BEAM_BLIND && b->free_to_m > b->blind_m && (double)b->free_to_m > to_m;
}

static bool echo_about(const struct look *l, double at_m, double within_m)
{
    for (int k = 0; k < l->found.n; k++)
        if (fabs((double)l->found.echo[k].range_m - at_m) <= within_m ||
            fabs((double)l->found.echo[k].near_m - at_m) <= within_m)
            return true;
    return false;
}

/* The first echo that blocks without another beam's word for it; INFINITY: none. */
static double blocked_m(const struct look *l)
{
    for (int k = 0; k < l->found.n; k++)
        if (!(l->found.echo[k].flags & (ECHO_UNCONFIRMED | ECHO_OWN)))
            return (double)l->found.echo[k].range_m;
    return INFINITY;
}

/* ---- walls that are known ---- */

struct wall {
    double distance_m, normal_deg;
};

static double turned(double a_deg, double b_deg)
{
    return geo_deg(geo_wrap_pi(geo_rad(a_deg - b_deg)));
}

static double along(const struct wall *w, double bearing_deg)
{
    const double c = cos(geo_rad(bearing_deg - w->normal_deg));
    return c > 1e-3 ? w->distance_m / c : INFINITY;
}

static void box(void)
{
    static const struct wall walls[] = {{0.261, 94.8}, {0.294, 273.9}, {1.460, 184.7}};
    int found = 0, early = 0, past = 0;
    if (!hear_text("tests/replay/box.csv", &recordings_ping360_2m)) {
        missing("box");
        return;
    }
    for (int i = 0; i < n_looks; i++) {
        double at_m = INFINITY;
        for (int w = 0; w < 3; w++)
            at_m = fmin(at_m, along(&walls[w], looks[i].bearing_deg));
        found += echo_about(&looks[i], at_m, 0.15);
        early += looks[i].found.n > 0 && (double)looks[i].found.echo[0].range_m < at_m - 0.2;
        past += claims(&looks[i], at_m + 0.02);
        if (!echo_about(&looks[i], at_m, 0.15))
            wrong("box wall missed", i, at_m);
    }
    row("box: walls within 15 cm", "101/101", "%d/%d", found, n_looks);
    row("box: echoes before walls, water past walls", "0, 0", "%d, %d", early, past);
}

/* The range of the loudest bin within 0.6 m of a range. */
static double loudest_near(const struct look *l, double range_m)
{
    uint32_t best = (uint32_t)fmax(0.0, (range_m - 0.6) / l->dr_m);
    for (uint32_t i = best; i < l->n && i * l->dr_m < range_m + 0.6; i++)
        if (l->sample[i] > l->sample[best])
            best = i;
    return (best + 0.5) * l->dr_m;
}

/* The straight wall near `about` that most loudest bins of looks [first, end) lie within 15 cm of. */
static struct wall fitted(const int *of, int n, const struct wall *about)
{
    struct wall best = *about;
    double least_m = INFINITY;
    int most = -1;
    for (int d = -30; d <= 30; d++)
        for (int a = -20; a <= 20; a++) {
            const struct wall w = {about->distance_m + 0.005 * d, about->normal_deg + 0.25 * a};
            double sum_m = 0.0;
            int within = 0;
            for (int i = 0; i < n; i++) {
                const struct look *l = &looks[of[i]];
                const double at_m = along(&w, l->bearing_deg);
                const double off_m = fabs(loudest_near(l, along(about, l->bearing_deg)) - at_m);
                within += off_m < 0.15;
                sum_m += fmin(off_m, 0.15);
            }
            if (within < most || (within == most && sum_m >= least_m))
                continue;
            most = within;
            least_m = sum_m;
            best = w;
        }
    return best;
}

/* Each look at a wall has a fit of its own: the vehicle floats. */
static void tank_wall(const char *name, const char *aim, const struct wall *wall, double half_width_deg)
{
    enum { PAUSE = 50, BEAMS = 48 };
    int of[BEAMS], n = 0, last = 0, beams = 0, found = 0, past = 0;

    for (int i = 0; i <= n_looks; i++) {
        const bool there = i < n_looks && fabs(turned(looks[i].bearing_deg, wall->normal_deg)) <= half_width_deg;
        if (n > 0 && (i == n_looks || (there && i - last > PAUSE))) {
            const struct wall fit = fitted(of, n, wall);
            for (int k = 0; k < n; k++) {
                const double at_m = along(&fit, looks[of[k]].bearing_deg);
                beams++;
                found += echo_about(&looks[of[k]], at_m, 0.15);
                past += claims(&looks[of[k]], at_m + 0.2);
                if (!echo_about(&looks[of[k]], at_m, 0.15))
                    wrong(name, of[k], at_m);
            }
            n = 0;
        }
        if (there && n < BEAMS) {
            of[n++] = i;
            last = i;
        }
    }
    row(name, aim, "%d/%d, water past it in %d", found, beams, past);
}

static void tank(void)
{
    int claims_n = 0, beside = 0;
    if (!hear_text(DATA "micron-tank-rosbag/static_sonar.csv", &recordings_micron)) {
        missing("tank");
        return;
    }
    tank_wall("tank: wall W within 15 cm", "114/114, 0", &(struct wall){2.21, 264}, 36);
    tank_wall("tank: wall S within 15 cm", "43/44, 0", &(struct wall){3.98, 175}, 19.8);
    for (int i = 0; i < n_looks; i++) {
        const bool north = fabs(turned(looks[i].bearing_deg, 354)) < 45;
        beside += north;
        claims_n += north && claims(&looks[i], 0.45);
    }
    row("tank: beams beside wall N (0.2 m) that claim water", "<= 3", "%d/%d", claims_n, beside);
}

/* ---- edges that anybody sees ---- */

/* Quiet for a quarter of a metre, then within 0.2 m loud, and so for 0.8 m in the mean. */
struct edge_rule {
    uint8_t quiet, loud, stays;
};

static double first_edge_m(const struct look *l, const struct edge_rule *rule, double from_m)
{
    const uint32_t before = (uint32_t)fmax(2.0, round(0.25 / l->dr_m)),
                   rise = (uint32_t)fmax(1.0, round(0.2 / l->dr_m)),
                   after = (uint32_t)fmax(2.0, round(0.8 / l->dr_m));
    for (uint32_t i = (uint32_t)(from_m / l->dr_m) + before; i + after < l->n; i++) {
        uint32_t sum = 0, most = 0;
        bool quiet = l->sample[i] > rule->quiet;
        for (uint32_t k = i - before; k < i && quiet; k++)
            quiet = l->sample[k] <= rule->quiet;
        for (uint32_t k = i; k < i + after && quiet; k++) {
            sum += l->sample[k];
            most = k <= i + rise && l->sample[k] > most ? l->sample[k] : most;
        }
        if (quiet && most >= rule->loud && sum >= (uint32_t)rule->stays * after)
            return i * l->dr_m;
    }
    return INFINITY;
}

static void edges(const char *name, const char *aim_past, const struct edge_rule *rule)
{
    char what[80];
    int n = 0, past = 0, right = 0, early = 0;
    for (int i = 0; i < n_looks; i++) {
        const struct look *l = &looks[i];
        const double at_m = first_edge_m(l, rule, 0.6);
        if (!isfinite(at_m))
            continue;
        n++;
        right += echo_about(l, at_m, PAST_M);
        early += l->found.n > 0 && (double)l->found.echo[0].near_m < at_m - PAST_M;
        past += claims(l, at_m + PAST_M);
        if (claims(l, at_m + PAST_M))
            wrong(name, i, at_m);
    }
    snprintf(what, sizeof what, "%s: sharp edges with water past them", name);
    row(what, aim_past, "%d/%d (%.1f %%)", past, n, n ? 100.0 * past / n : 0.0);
    snprintf(what, sizeof what, "%s: sharp edges right", name);
    row(what, ">= 90 %", "%d/%d (%.0f %%); an echo before them in %d", right, n, n ? 100.0 * right / n : 0.0,
        early);
}

/* First return of 60 counts beyond 0.9 m over half a pulse; INFINITY: none. */
static double first_return_m(const struct look *l)
{
    const uint32_t need = (uint32_t)fmax(2.0, round(0.5 * l->pulse_m / l->dr_m));
    uint32_t run = 0;
    for (uint32_t i = (uint32_t)(0.9 / l->dr_m); i < l->n; i++) {
        run = l->sample[i] >= 60 ? run + 1 : 0;
        if (run == need)
            return (i + 1 - need) * l->dr_m;
    }
    return INFINITY;
}

static void past_returns(const char *name)
{
    char what[80];
    int n = 0, past = 0;
    for (int i = 0; i + 1 < n_looks; i++) {
        const double at_m = first_return_m(&looks[i]), next_m = first_return_m(&looks[i + 1]);
        if (!isfinite(at_m) || looks[i].dr_m != looks[i + 1].dr_m || !(fabs(at_m - next_m) <= 0.3))
            continue;
        n++;
        past += claims(&looks[i], at_m + PAST_M);
        if (claims(&looks[i], at_m + PAST_M))
            wrong("past a return", i, at_m);
    }
    snprintf(what, sizeof what, "%s: water past 60 counts that two beams show", name);
    row(what, "0", "%d/%d", past, n);
}

/* ---- water that is empty ---- */

static void free_metres(const char *name, const char *aim, double range_least_m)
{
    double silent_m = 0.0, all_m = 0.0;
    char what[80];
    int n = 0, silent = 0, near = 0;
    for (int i = 0; i < n_looks; i++) {
        const struct look *l = &looks[i];
        if (l->n * l->dr_m < range_least_m)
            continue;
        const double free_m = fmax(0.0, (double)l->found.free_to_m - (double)l->found.blind_m);
        n++;
        silent += l->found.n == 0;
        silent_m += l->found.n == 0 ? free_m : 0.0;
        all_m += free_m;
        near += blocked_m(l) < 1.3;
    }
    snprintf(what, sizeof what, "%s: free metres per silent ping", name);
    row(what, aim, "%.2f of %d; per ping %.2f of %d", silent ? silent_m / silent : 0.0, silent,
        n ? all_m / n : 0.0, n);
    snprintf(what, sizeof what, "%s: blocked nearer than 1.3 m", name);
    row(what, "", "%d/%d (%.1f %%)", near, n, n ? 100.0 * near / n : 0.0);
}

static void ping360_log(const char *name, const char *path)
{
    char what[80];
    if (!hear_log(path)) {
        missing(name);
        return;
    }
    edges(name, "<= 2 %", &(struct edge_rule){15, 80, 80});
    past_returns(name);
    snprintf(what, sizeof what, "%s, 50 m and more", name);
    free_metres(what, ">= 20", 49.0);
}

/* ---- the quay ---- */

static double loudest_beyond(const struct look *l, double from_m, uint8_t *count)
{
    uint32_t best = (uint32_t)(from_m / l->dr_m);
    for (uint32_t i = best; i < l->n; i++)
        if (l->sample[i] > l->sample[best])
            best = i;
    *count = l->sample[best];
    return (best + 0.5) * l->dr_m;
}

/* A bright beam whose neighbours in the turn have their loudest bin near its own. */
static bool on_a_wall(int i, uint8_t bright, double *at_m)
{
    uint8_t count, beside;
    *at_m = loudest_beyond(&looks[i], 1.5, &count);
    if (count < bright || i == 0 || i + 1 >= n_looks)
        return false;
    const double last_m = loudest_beyond(&looks[i - 1], 1.5, &beside);
    const bool last = beside >= bright - 20 && fabs(last_m - *at_m) < 0.6;
    const double next_m = loudest_beyond(&looks[i + 1], 1.5, &beside);

    return last || (beside >= bright - 20 && fabs(next_m - *at_m) < 0.6);
}

static bool is_empty(const struct look *l)
{
    uint8_t count;
    loudest_beyond(l, 1.3, &count);
    return count <= 80;
}

/* empty_end: number of the first ping that may hear the wall. The rear is shaded by the vehicle, whose own echo is
 * there. */
static void quay(const char *name, const char *path, int empty_end, uint8_t bright)
{
    char what[80];
    int walls = 0, found = 0, past = 0, empty = 0, echoes = 0, front = 0, near = 0;
    if (!hear_text(path, &recordings_micron)) {
        missing(name);
        return;
    }
    for (int i = 0; i < n_looks; i++) {
        const struct look *l = &looks[i];
        const bool ahead = fabs(l->bearing_deg) <= 100.0;
        double at_m;
        if (i >= empty_end && ahead && on_a_wall(i, bright, &at_m)) {
            const bool hit = echo_about(l, at_m, 1.0);
            walls++;
            found += hit;
            past += claims(l, at_m + 0.3);
            if (!hit)
                wrong("quay wall missed", i, at_m);
        }
        if (i < empty_end && is_empty(l)) {
            const double first_m = blocked_m(l);
            const bool echo = isfinite(first_m) && (ahead || first_m > 0.9);
            empty++;
            echoes += echo;
            front += ahead;
            near += ahead && first_m < 1.3;
            if (echo)
                wrong("quay empty beam blocked", i, first_m);
        }
    }
    snprintf(what, sizeof what, "%s: bright wall beams found", name);
    row(what, ">= 95 %", "%d/%d (%.1f %%), water past it in %d", found, walls, walls ? 100.0 * found / walls : 0.0,
        past);
    if (empty == 0)
        return;
    snprintf(what, sizeof what, "%s: empty beams blocked", name);
    row(what, "<= 1 %", "%d/%d (%.1f %%); ahead nearer than 1.3 m %d/%d", echoes, empty, 100.0 * echoes / empty,
        near, front);
    free_metres(name, "", 0.0);
}

/* ---- a target that comes in ---- */

/* 0.44 m/s towards a sonar that stands still: the loudest bin of a bright beam is the target. */
static void target(void)
{
    int bright = 0, found = 0, past = 0, empty = 0, echoes = 0;
    if (!hear_text(DATA "tritech-v4log-target/target-first-234.csv", &recordings_tritech_10m)) {
        missing("target");
        return;
    }
    for (int i = 0; i < n_looks; i++) {
        uint8_t count;
        const double at_m = loudest_beyond(&looks[i], 2.0, &count);
        if (count >= 110) {
            bright++;
            found += echo_about(&looks[i], at_m, 0.3);
            past += claims(&looks[i], at_m + PAST_M);
            if (!echo_about(&looks[i], at_m, 0.3))
                wrong("target missed", i, at_m);
        } else if (count <= 80) {
            empty++;
            echoes += isfinite(blocked_m(&looks[i]));
        }
    }
    row("target: bright beams found", ">= 95 %", "%d/%d, water past it in %d", found, bright, past);
    row("target: empty beams blocked", "", "%d/%d", echoes, empty);
    free_metres("target", "", 0.0);
}

/* ---- */

static void look_at(void)
{
    box();
    tank();
    if (hear_text(DATA "tritech-seanet-rov-seabed/sonar.part1.csv", &recordings_tritech_50m)) {
        edges("sea bed", "0", &(struct edge_rule){5, 60, 45});
        past_returns("sea bed");
        free_metres("sea bed", "", 0.0);
    } else {
        missing("sea bed");
    }
    quay("quay, 10 m", DATA "micron-quay-rosbag/2014-07-18-20-59-31.csv", 15 * TURN, 90);
    ping360_log("Ping360 094407", DATA "ping360-openwater-pingviewer/20240814-094407726.bin");
    ping360_log("Ping360 102337", DATA "ping360-openwater-pingviewer/20240814-102337673.bin");
    if (hear_text(DATA "ping360-openwater-pingviewer/20240814-102337673.60m-pings1000-1500.csv",
                  &recordings_ping360_60m))
        free_metres("open water 60 m", ">= 20", 0.0);
}

static void held_back(void)
{
    ping360_log("Ping360 103146", DATA "ping360-openwater-pingviewer/20240814-103146484.bin");
    quay("quay, 20 m", DATA "micron-quay-rosbag/2014-07-18-21-11-13.csv", 0, 110);
    target();
}

static int usage(void)
{
    fprintf(stderr, "usage: report_recordings [look|held] [cases|csv] [sonard|threshold|SOCA|ping360_sonar]\n");
    return 2;
}

int main(int argc, char **argv)
{
    bool look = true, held = true, all = true;
    for (int i = 1; i < argc; i++) {
        unsigned c = 0;
        while (c < CONTESTANTS && strcmp(argv[i], contest_name[c]) != 0)
            c++;
        if (c < CONTESTANTS) {
            contestant = (enum contestant)c;
            all = false;
        } else if (strcmp(argv[i], "look") == 0)
            held = false;
        else if (strcmp(argv[i], "held") == 0)
            look = false;
        else if (strcmp(argv[i], "cases") == 0)
            form = CASES;
        else if (strcmp(argv[i], "csv") == 0)
            form = CSV;
        else if (strcmp(argv[i], "quick") != 0)
            return usage();
    }
    contest_make(RECORDINGS_MAX_BINS);
    if (form == TABLE)
        printf("%-66s %-10s %s\n", "real recordings", "aim", contest_name[contestant]);
    else
        puts(form == CSV ? "what,aim,method,result" : "what,ping,bearing_deg,at_m,blind_m,free_to_m,first_echo_m");
    do {
        if (look)
            look_at();
        if (held)
            held_back();
    } while (form == CSV && all && ++contestant < CONTESTANTS);
    contest_free();
    return 0;
}
