/* SPDX-License-Identifier: MIT */
#include "reference.h"

#include <stdio.h>

#include "config/conf_table.h"
#include "daemon/pipeline/pipeline.h"
#include "json_units.h"

#define REFERENCE_TARGET_SIZE 64

/* "wall", or "20 dB below a wall". */
static const char *target_of(const struct conf_extract *c, char text[REFERENCE_TARGET_SIZE])
{
    const struct conf_named *named = conf_key_find("extract", "target")->named;

    while (named->word && named->value != c->target_db)
        named++;
    if (named->word)
        snprintf(text, REFERENCE_TARGET_SIZE, "%s", named->word);
    else
        snprintf(text, REFERENCE_TARGET_SIZE, "%.6g dB below a wall", c->target_db);
    return text;
}

static void write_members(struct json_out *out, const struct methods_env *d,
                          const struct extract_reference *reference)
{
    char text[REFERENCE_TARGET_SIZE];
    json_member_text(out, "target", target_of(&d->conf.extract, text));
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
