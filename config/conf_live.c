/* SPDX-License-Identifier: MIT */
/* conf_live - what of a configuration can take the place of another while the daemon runs. */
#include <stdlib.h>
#include <string.h>

#include "conf.h"
#include "conf_source.h"
#include "conf_value.h"

struct merge {
    struct conf *now;
    const struct conf *wanted;
    const struct conf_checks *checks;
    conf_change_fn change;
    void *ctx;
};

static void title_of(const struct conf *conf, const struct conf_key *key, int which, char *title, size_t size)
{
    const char *name = conf_key_is_sonar(key) ? conf->sonar[which].name
                       : which > 0            ? conf->more_grid[which - 1].name
                                              : "";
    snprintf(title, size, "%s%s%s", key->section, *name ? " " : "", name);
}

static bool is_live(const struct merge *m, const struct conf_key *key, int which)
{
    if (!key->of_head)
        return key->live;
    return m->checks && m->checks->retunes && m->checks->retunes(m->now, which, key->name);
}

static void merge_key(const struct merge *m, const struct conf_key *key, int which)
{
    const size_t base = conf_base(key, which);
    void *now = (char *)m->now + base;
    const void *wanted = (const char *)m->wanted + base;
    char title[CONF_NAME_MAX + 16], value[CONF_VALUE_MAX], text[CONF_VALUE_MAX + 128];
    const bool live = is_live(m, key, which);
    void *here = (char *)now + key->offset;
    const void *there = (const char *)wanted + key->offset;
    if (memcmp(here, there, key->size) == 0)
        return;
    conf_value_write(key, wanted, value, sizeof value);
    title_of(m->now, key, which, title, sizeof title);
    snprintf(text, sizeof text, "[%s] %s = %s", title, key->name, value);
    if (live)
        memcpy(here, there, key->size);
    m->change(m->ctx, key->section, text, live);
}

/* Sonars and grids are those that there are, in their order; others, or one less, are not for a running daemon. */
static bool same_sonars(const struct conf *a, const struct conf *b)
{
    for (int i = 0; i < a->n_sonars && i < b->n_sonars; i++)
        if (strcmp(a->sonar[i].name, b->sonar[i].name) != 0)
            return false;
    return a->n_sonars == b->n_sonars;
}

static bool same_grids(const struct conf *a, const struct conf *b)
{
    for (int i = 0; i < a->n_more_grids && i < b->n_more_grids; i++)
        if (strcmp(a->more_grid[i].name, b->more_grid[i].name) != 0)
            return false;
    return a->n_more_grids == b->n_more_grids;
}

void conf_take_live(struct conf *now, const struct conf *wanted, const struct conf_checks *checks,
                    conf_change_fn change, void *ctx)
{
    const struct merge m = {now, wanted, checks, change, ctx};
    const int sonars = same_sonars(now, wanted) ? now->n_sonars : 0;
    const int grids = same_grids(now, wanted) ? 1 + now->n_more_grids : 1;
    locale_t outside = conf_locale_enter();
    if (!same_sonars(now, wanted))
        change(ctx, "sonar", "other sections [sonar NAME]", false);
    if (!same_grids(now, wanted))
        change(ctx, "grid", "other sections [grid NAME]", false);
    for (const struct conf_key *key = conf_keys; key->name; key++) {
        const int n = conf_key_is_sonar(key) ? sonars : strcmp(key->section, "grid") == 0 ? grids : 1;
        for (int i = 0; i < n; i++)
            merge_key(&m, key, i);
    }
    conf_locale_leave(outside);
}

int conf_check_together(const struct conf *conf, const struct conf_source *source,
                        const struct conf_checks *checks, conf_fault_fn fault, void *fault_ctx)
{
    struct conf_faults *faults = calloc(1, sizeof *faults);
    if (!faults) {
        fault(fault_ctx, "out of memory checking the configuration");
        return -1;
    }
    locale_t outside = conf_locale_enter();
    conf_rules_check(conf, source, checks, faults);
    const int n = conf_fault_tell(faults, fault, fault_ctx);
    conf_locale_leave(outside);
    free(faults);
    return n;
}
