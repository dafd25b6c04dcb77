/* SPDX-License-Identifier: MIT */
#include "reference.h"

#include <stdio.h>

#include "daemon/pipeline/pipeline.h"
#include "json_units.h"

#define OF_RANGES "what the sonar reports"

/* no_echo = range: a beam without an echo is free to its end, and no bottom is looked for there. */
static void write_bottom(struct json_out *out, bool judged, const struct conf_extract *c)
{
    const bool looked_for = judged && c->no_echo != CONF_NO_ECHO_RANGE && c->bottom_db >= 0;
    json_member_known(out, "bottom_db", looked_for, c->bottom_db, 1e3);
}

void reference_write_target(struct json_out *out, const struct methods_env *d)
{
    char text[CONF_TARGET_SIZE], both[2 * CONF_TARGET_SIZE];
    int ranges = 0;
    for (int i = 0; i < d->conf.n_sonars; i++)
        ranges += d->plan.ranges[i];
    conf_target_text(&d->conf.extract, text);
    snprintf(both, sizeof both, "%s%s%s", ranges < d->conf.n_sonars ? text : "",
             ranges > 0 && ranges < d->conf.n_sonars ? ", or " : "", ranges > 0 ? OF_RANGES : "");
    json_member_text(out, "target", both);
    write_bottom(out, ranges == 0, &d->conf.extract);
}

static void write_members(struct json_out *out, const struct methods_env *d,
                          const struct extract_reference *reference)
{
    char text[CONF_TARGET_SIZE];
    json_member_text(out, "target", conf_target_text(&d->conf.extract, text));
    write_bottom(out, true, &d->conf.extract);
    json_member_real(out, "level_db", reference->level_db, 10);
    json_member_count(out, "counts", reference->counts);
    json_member_word(out, "from", reference->shown ? "its echoes" : "prior");
    json_member_flag(out, "noisy", reference->noisy);
}

void reference_write(struct json_out *out, const struct methods_env *d, const struct extract_reference *reference)
{
    if (reference->level_db >= 0) {
        json_member_null(out, "detects");
        return;
    }
    json_member_open(out, "detects", '{');
    write_members(out, d, reference);
    json_out_close(out, '}');
}

void reference_write_all(struct json_out *out, const struct methods_env *d)
{
    struct pipeline_stats pipe;
    pipeline_stats(d->pipeline, &pipe);
    json_member_open(out, "detects", '[');
    for (int i = 0; i < d->conf.n_sonars; i++) {
        if (pipe.reference[i].level_db >= 0)
            continue;
        json_out_open(out, '{');
        json_member_text(out, "sensor", d->conf.sonar[i].name);
        write_members(out, d, &pipe.reference[i]);
        json_out_close(out, '}');
    }
    json_out_close(out, ']');
}
