/* SPDX-License-Identifier: MIT */
/* tally - see tally.h. */
#include "tally.h"

#include <math.h>
#include <stdlib.h>

static void add(struct pilot_row *row, const struct pilot_case *c, const struct pilot_result *r)
{
    row->drives++;
    row->arrived += r->arrived;
    row->collided += r->collided;
    row->struck += r->struck;
    row->touched += r->touched_mps >= 0 && !r->collided && !r->struck;
    for (int i = 0; i < 3; i++)
        row->share[i] += r->share[i];
    if (row->ratio[c->chart].n < PILOT_RATIO_MAX)
        row->ratio[c->chart].of[row->ratio[c->chart].n++] = r->arrived ? r->time_s / r->known_s : INFINITY;
}

void pilot_tally_add(struct pilot_tally *t, const struct pilot_case *c, const struct pilot_result *r)
{
    add(&t->kind[((unsigned)c->setup * PILOT_NAVS + (unsigned)c->nav) * PILOT_SONARS + (unsigned)c->sonar], c, r);
    add(&t->place[c->place], c, r);
    add(&t->fault[c->fault], c, r);
    add(&t->all, c, r);
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Empty: no such drives; "late": it is among those that did not arrive. */
static void quantile(struct pilot_row *row, int chart, double q, char text[16])
{
    const int n = row->ratio[chart].n;
    text[0] = '\0';
    if (n == 0)
        return;
    qsort(row->ratio[chart].of, (size_t)n, sizeof row->ratio[chart].of[0], ascending);
    const double ratio = row->ratio[chart].of[(int)(q * n)];
    snprintf(text, 16, isfinite(ratio) ? "%.1f" : "late", ratio);
}

#define ROWS (PILOT_KINDS + PILOT_PLACES + PILOT_FAULTS + 1)

/* Row i of all tables. */
static struct pilot_row *row_at(struct pilot_tally *t, int i, const char **by, char name[80])
{
    const int place = i - PILOT_KINDS, fault = place - PILOT_PLACES;
    if (i < PILOT_KINDS) {
        *by = "sonar";
        snprintf(name, 80, "%s; %s; %s", pilot_sonar_name[i % PILOT_SONARS],
                 pilot_nav_name[i / PILOT_SONARS % PILOT_NAVS], pilot_setup_name[i / PILOT_SONARS / PILOT_NAVS]);
        return &t->kind[i];
    }
    if (place < PILOT_PLACES) {
        *by = "place";
        snprintf(name, 80, "%s", pilot_place_name[place]);
        return &t->place[place];
    }
    *by = fault < PILOT_FAULTS ? "fault" : "all";
    snprintf(name, 80, "%s", fault < PILOT_FAULTS ? pilot_fault_name[fault] : "all");
    return fault < PILOT_FAULTS ? &t->fault[fault] : &t->all;
}

/* A row as it is shown. */
struct shown {
    const struct pilot_row *row;
    const char *by;
    char name[80], median[16], most[16], straight[16];
    double unknown, blocked; /* shares of the time */
};

/* False: nobody drove there. */
static bool show_row(struct pilot_tally *t, int i, struct shown *s)
{
    struct pilot_row *row = row_at(t, i, &s->by, s->name);
    s->row = row;
    if (row->drives == 0)
        return false;
    quantile(row, 1, 0.5, s->median);
    quantile(row, 1, 0.9, s->most);
    quantile(row, 0, 0.5, s->straight);
    s->unknown = row->share[PILOT_UNKNOWN] / (double)row->drives;
    s->blocked = row->share[PILOT_BLOCKED] / (double)row->drives;
    return true;
}

void pilot_tally_print(struct pilot_tally *t, FILE *out)
{
    const char *last = "";
    for (int i = 0; i < ROWS; i++) {
        struct shown s;
        if (!show_row(t, i, &s))
            continue;
        if (s.by != last)
            fprintf(out, "\n%-36s %6s %10s %7s %7s %7s %7s %7s %8s %8s %8s\n", s.by, "drives", "collisions",
                    "struck", "touches", "arrived", "chart", "90 %", "straight", "unknown", "blocked");
        last = s.by;
        fprintf(out, "%-36s %6ld %10ld %7ld %7ld %7ld %7s %7s %8s %6.0f %% %6.0f %%\n", s.name, s.row->drives,
                s.row->collided, s.row->struck, s.row->touched, s.row->arrived, s.median, s.most, s.straight,
                100 * s.unknown, 100 * s.blocked);
    }
}

void pilot_tally_csv(struct pilot_tally *t, FILE *out)
{
    fprintf(out, "by,name,drives,collisions,struck,touches,arrived,chart,chart_90,straight,unknown,blocked\n");
    for (int i = 0; i < ROWS; i++) {
        struct shown s;
        if (show_row(t, i, &s))
            fprintf(out, "%s,%s,%ld,%ld,%ld,%ld,%ld,%s,%s,%s,%.3f,%.3f\n", s.by, s.name, s.row->drives,
                    s.row->collided, s.row->struck, s.row->touched, s.row->arrived, s.median, s.most, s.straight,
                    s.unknown, s.blocked);
    }
}
