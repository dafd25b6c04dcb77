/* SPDX-License-Identifier: MIT */
#include "reference.h"

#include "daemon/pipeline/pipeline.h"
#include "json_units.h"

static void write_members(struct json_out *out, const struct methods_env *d,
                          const struct extract_reference *reference)
{
    static const char *const words[] = {[CONF_TARGET_WALL] = "wall",
                                        [CONF_TARGET_PILE] = "pile",
                                        [CONF_TARGET_NET] = "net",
                                        [CONF_TARGET_LINE] = "line"};
    json_member_word(out, "target", words[d->conf.extract.target]);
    json_member_real(out, "level_db", reference->level_db, 10);
    json_member_count(out, "counts", reference->counts);
    json_member_word(out, "from", reference->shown ? "its echoes" : "prior");
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
