/* SPDX-License-Identifier: MIT */
/* plan_show - see plan_show.h. */
#include "plan_show.h"

#include <string.h>

#include "plan_cost.h"

struct priced {
    struct plan plan;
    struct plan_cost cost[PLAN_STAGES_MAX], all;
};

static void make(const struct conf *conf, struct priced *p)
{
    plan_make(conf, &p->plan);
    plan_price(&p->plan, conf, p->cost, &p->all);
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

static const char *us(char *cell, size_t size, double instructions)
{
    if (instructions < 0)
        return "-";
    snprintf(cell, size, "%.1f", instructions * PLAN_NS_PER_INSTRUCTION * 1e-3);
    return cell;
}

static const char *thousands(char *cell, size_t size, double v)
{
    if (v < 0)
        return "-";
    snprintf(cell, size, "%.1f", v * 1e-3);
    return cell;
}

static const char *kib(char *cell, size_t size, double bytes)
{
    if (bytes < 0)
        return "-";
    snprintf(cell, size, "%.0f", bytes / 1024);
    return cell;
}

void plan_print(const struct conf *conf, FILE *out)
{
    struct priced p;
    char time[32], work[32], bytes[32];
    make(conf, &p);
    fprintf(out, "%-11s %-12s %-4s %9s %9s %9s  %-9s  %s\n", "stage", "of", "plan", "kinstr", "us", "KiB", "proof",
            "why");
    for (int k = 0; k < p.plan.n; k++) {
        const struct plan_stage *s = &p.plan.stage[k];
        const struct plan_cost *c = &p.cost[k];
        const char *of = whose(s, conf);
        fprintf(out, "%-11s %-12s %-4s %9s %9s %9s  %-9s  %s\n", plan_name(s->id), of ? of : "-",
                s->in ? "in" : "out", thousands(work, sizeof work, c->instructions),
                us(time, sizeof time, c->instructions), kib(bytes, sizeof bytes, c->bytes),
                plan_proof_name(s->proof), s->why);
    }
    fprintf(out,
            "\nWith what is in, the largest ping costs %.1f thousand instructions (%.1f us) at most, and the "
            "stages %.1f MiB.\n",
            p.all.instructions * 1e-3, p.all.instructions * PLAN_NS_PER_INSTRUCTION * 1e-3, p.all.bytes / 1048576);
    fprintf(out, "kinstr, us: of one ping, by a model; out: what it would be. -: not known, or nothing.\n");
}

/* ---- for programs ---- */

static json_t *known(double v)
{
    return v < 0 ? json_null() : json_integer((json_int_t)v);
}

static json_t *stage_json(const struct plan_stage *s, const struct plan_cost *c, const struct conf *conf)
{
    const char *of = whose(s, conf);
    return json_pack("{s:s, s:o, s:b, s:o, s:s, s:o, s:o}", "name", plan_name(s->id), "of",
                     of ? json_string(of) : json_null(), "in", s->in, "proof",
                     s->in ? json_null() : json_string(plan_proof_name(s->proof)), "why", s->why, "instructions",
                     known(c->instructions), "bytes", known(c->bytes));
}

json_t *plan_json(const struct conf *conf)
{
    struct priced p;
    json_t *stages = json_array();
    make(conf, &p);
    for (int k = 0; k < p.plan.n; k++)
        json_array_append_new(stages, stage_json(&p.plan.stage[k], &p.cost[k], conf));
    return json_pack("{s:o, s:o, s:o, s:f}", "stages", stages, "instructions", known(p.all.instructions), "bytes",
                     known(p.all.bytes), "ns_per_instruction", PLAN_NS_PER_INSTRUCTION);
}
