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

static void write_bytes(struct json_out *out, double bytes)
{
    json_out_name(out, "bytes");
    if (bytes < 0)
        json_out_null(out);
    else
        json_out_integer(out, (int64_t)bytes);
}

static void write_word(struct json_out *out, const char *name, const char *word)
{
    json_out_name(out, name);
    if (word)
        json_out_text(out, word);
    else
        json_out_null(out);
}

static void write_stage(struct json_out *out, const struct plan_stage *s, double bytes, const struct conf *conf)
{
    json_out_open(out, '{');
    write_word(out, "name", plan_name(s->id));
    write_word(out, "of", whose(s, conf));
    json_out_name(out, "in");
    json_out_flag(out, s->in);
    write_word(out, "proof", s->in ? NULL : plan_proof_name(s->proof));
    write_word(out, "why", s->why);
    write_bytes(out, bytes);
    json_out_close(out, '}');
}

void plan_write(const struct conf *conf, struct json_out *out)
{
    struct shown p;
    make(conf, &p);
    json_out_open(out, '{');
    json_out_name(out, "stages");
    json_out_open(out, '[');
    for (int k = 0; k < p.plan.n; k++)
        write_stage(out, &p.plan.stage[k], p.bytes[k], conf);
    json_out_close(out, ']');
    write_bytes(out, p.all);
    json_out_close(out, '}');
}
