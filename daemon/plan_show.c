/* SPDX-License-Identifier: MIT */
/* plan_show - see plan_show.h. */
#include "plan_show.h"

#include <string.h>

#include "plan_memory.h"

struct shown {
    struct plan plan;
    double bytes[PLAN_STAGES_MAX], all;
};

static void make(const struct conf *conf, struct shown *p)
{
    plan_make(conf, &p->plan);
    p->all = plan_memory(&p->plan, conf, p->bytes);
}

/* The sonar or grid that a stage is of; NULL: of the process. */
static const char *whose(const struct plan_stage *s, const struct conf *conf)
{
    if (s->id <= PLAN_IMAGE)
        return conf->sonar[s->which].name;
    if (s->id >= PLAN_GRID && s->id <= PLAN_RELAXATION)
        return s->which == 0 ? CONF_MAIN_GRID : conf->more_grid[s->which - 1].name;
    return NULL;
}

/* ---- for people ---- */

static const char *kib(char *cell, size_t size, double bytes)
{
    if (bytes < 0)
        return "-";
    snprintf(cell, size, "%.0f", bytes / 1024);
    return cell;
}

void plan_print(const struct conf *conf, FILE *out)
{
    struct shown p;
    char bytes[32];
    make(conf, &p);
    fprintf(out, "%-11s %-12s %-4s %9s  %-9s  %s\n", "stage", "of", "plan", "KiB", "proof", "why");
    for (int k = 0; k < p.plan.n; k++) {
        const struct plan_stage *s = &p.plan.stage[k];
        const char *of = whose(s, conf);
        fprintf(out, "%-11s %-12s %-4s %9s  %-9s  %s\n", plan_name(s->id), of ? of : "-", s->in ? "in" : "out",
                kib(bytes, sizeof bytes, p.bytes[k]), plan_proof_name(s->proof), s->why);
    }
    fprintf(out, "\nWhat is in takes %.1f MiB. out: what it would take. -: nothing of its own.\n",
            p.all / 1048576);
}

/* ---- for programs ---- */

static json_t *known(double v)
{
    return v < 0 ? json_null() : json_integer((json_int_t)v);
}

static json_t *stage_json(const struct plan_stage *s, double bytes, const struct conf *conf)
{
    const char *of = whose(s, conf);
    return json_pack("{s:s, s:o, s:b, s:o, s:s, s:o}", "name", plan_name(s->id), "of",
                     of ? json_string(of) : json_null(), "in", s->in, "proof",
                     s->in ? json_null() : json_string(plan_proof_name(s->proof)), "why", s->why, "bytes",
                     known(bytes));
}

json_t *plan_json(const struct conf *conf)
{
    struct shown p;
    json_t *stages = json_array();
    make(conf, &p);
    for (int k = 0; k < p.plan.n; k++)
        json_array_append_new(stages, stage_json(&p.plan.stage[k], p.bytes[k], conf));
    return json_pack("{s:o, s:o}", "stages", stages, "bytes", known(p.all));
}
