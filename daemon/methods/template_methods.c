/* SPDX-License-Identifier: MIT */
/* The methods about background templates: what a client may ask and change; sonard-protocol(7) has every shape. */
#include <math.h>
#include <stdlib.h>

#include "core/fault.h"
#include "daemon/methods/environment.h"
#include "daemon/background/template.h"
#include "json_units.h"
#include "methods.h"

_Static_assert(PROTOCOL_LEARN_MAX <= BACKGROUND_LEARNT_MAX, "more pings may be asked for than are counted");

#define PICTURE_BINS 512 /* bins of a row in a picture, each the loudest of a group */

/* The one place through which every change goes, one after the other: what the extract stage has not heard of yet is
 * not changed again, or templates of before could fill the memory. */
static bool change_of(const struct rpc_call *call, const json_t *params, int *sensor, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    if (!sensor_asked(d, params, sensor, error))
        return false;
    return d->templates.of[*sensor].handing == 0 || rpc_postpone(call, &d->templates.of[*sensor].waiters);
}

/* ---- state ---- */

static const char *fit_word(int fit)
{
    static const char *const words[] = {[BACKGROUND_FITS] = "yes",
                                        [BACKGROUND_RESAMPLED] = "resampled: the sonar's range differs",
                                        [BACKGROUND_FOREIGN] = "no: another head or another amplitude law"};
    return fit < 0 ? "no ping yet" : words[fit];
}

static void write_template(struct json_out *out, const struct template *t)
{
    const struct background *b = t->background;
    if (!b) {
        json_member_null(out, "template");
        return;
    }
    const struct background_shape *s = &b->shape;
    uint64_t learnt = 0, blind = 0;
    for (uint32_t row = 0; row < s->rows; row++)
        learnt += b->learnt[row] != 0;
    for (size_t i = 0; i < (size_t)s->rows * s->bins; i++)
        blind += b->level[i] > b->mask_above;
    json_member_open(out, "template", '{');
    json_member_count(out, "rows", s->rows);
    json_member_count(out, "rows_learnt", learnt);
    json_member_count(out, "bins", s->bins);
    json_member_metres(out, "r0_m", (double)s->r0_m);
    json_member_metres(out, "r1_m", (double)s->r0_m + (double)s->bins * (double)s->dr_m);
    json_member_count(out, "mask", b->mask_above);
    json_member_count(out, "blind_cells", blind);
    json_member_count(out, "clusters", t->kept.clusters);
    json_member_count(out, "clusters_kept", t->kept.kept);
    json_member_text(out, "fits", fit_word(t->fit));
    json_member_flag(out, "saved", t->made == t->in_file);
    json_out_close(out, '}');
}

/* What a person has to do for learning to go on. */
static const char *motion_word(const struct template *t, const struct background_progress *p)
{
    return t->learning.standing    ? "not asked for: surroundings may be learnt, too"
           : p->no_pose            ? "unknown without a pose: surroundings may be learnt, too"
           : p->unmoved > p->taken ? "waiting for the vehicle to move"
                                   : "pings are taken as the vehicle moves";
}

static void write_learning(struct json_out *out, const struct methods_env *d, int sensor)
{
    const struct template *t = &d->templates.of[sensor];
    struct background_progress p;
    if (!t->learn) {
        json_member_null(out, "learning");
        return;
    }
    template_progress(&d->templates, sensor, &p);
    const double wanted = (double)p.rows_seen * t->learning.pings;
    json_member_open(out, "learning", '{');
    json_member_count(out, "pings", t->learning.pings);
    json_member_real(out, "progress", wanted > 0 ? (double)p.taken / wanted : 0, 1e3);
    json_member_count(out, "rows_seen", p.rows_seen);
    json_member_count(out, "rows_full", p.rows_full);
    json_member_count(out, "least", p.least);
    json_member_count(out, "taken", p.taken);
    json_member_count(out, "unmoved", p.unmoved);
    json_member_count(out, "no_pose", p.no_pose);
    json_member_count(out, "other_bins", p.other_bins);
    json_member_text(out, "motion", motion_word(t, &p));
    json_out_close(out, '}');
}

/* The object is left open. */
static void write_open_state(struct json_out *out, const struct methods_env *d, int sensor)
{
    const struct template *t = &d->templates.of[sensor];
    const char *file = d->conf.sonar[sensor].background;
    json_out_open(out, '{');
    json_member_text(out, "sensor", d->conf.sonar[sensor].name);
    json_member_text(out, "state", template_word(t));
    if (file[0])
        json_member_text(out, "file", file);
    else
        json_member_null(out, "file");
    write_template(out, t);
    write_learning(out, d, sensor);
    json_member_text(out, "happened", t->happened);
}

/* ---- picture ---- */

static void write_blind(struct json_out *out, const struct background *b, const uint8_t *level)
{
    const struct background_shape *s = &b->shape;
    json_member_open(out, "blind", '[');
    for (uint32_t i = 0, from = 0; i < s->bins; i++) {
        if (level[i] <= b->mask_above)
            continue;
        from = i;
        while (i < s->bins && level[i] > b->mask_above)
            i++;
        json_out_open(out, '[');
        json_out_rounded(out, (double)s->r0_m + from * (double)s->dr_m, PER_METRES);
        json_out_rounded(out, (double)s->r0_m + i * (double)s->dr_m, PER_METRES);
        json_out_close(out, ']');
    }
    json_out_close(out, ']');
}

static void write_row(struct json_out *out, const struct methods_env *d, int sensor, const struct background *b,
                      uint32_t row)
{
    static const char digits[] = "0123456789abcdef";
    const struct background_shape *s = &b->shape;
    const uint8_t *level = b->level + (size_t)row * s->bins;
    const uint32_t n = s->bins < PICTURE_BINS ? s->bins : PICTURE_BINS;
    char hex[2 * PICTURE_BINS + 1];
    for (uint32_t i = 0; i < n; i++) {
        uint8_t most = 0;
        for (uint32_t k = (uint32_t)((uint64_t)i * s->bins / n); k < (uint32_t)((uint64_t)(i + 1) * s->bins / n);
             k++)
            most = level[k] > most ? level[k] : most;
        hex[2 * i] = digits[most >> 4];
        hex[2 * i + 1] = digits[most & 15];
    }
    hex[2 * n] = '\0';
    double v[3], az, el;
    geo_direction((double)s->az0_rad + row * (double)s->row_rad, 0, v);
    quat_rotate(d->mount[sensor].attitude, v, v);
    geo_angles(v, &az, &el);
    json_out_open(out, '{');
    json_member_degrees(out, "azimuth_deg", az);
    json_member_real(out, "width_deg", s->row_rad > 0 ? geo_deg((double)s->row_rad) : 1, PER_DEGREES);
    json_member_metres(out, "r0_m", (double)s->r0_m);
    json_member_metres(out, "r1_m", (double)s->r0_m + s->bins * (double)s->dr_m);
    json_member_count(out, "pings", b->learnt[row]);
    json_member_word(out, "samples", hex);
    write_blind(out, b, level);
    json_out_close(out, '}');
}

bool method_background(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    int sensor;
    if (!sensor_asked(d, params, &sensor, error))
        return false;
    const struct background *b = d->templates.of[sensor].background;
    write_open_state(out, d, sensor);
    if (params_is(params, "picture", "yes")) {
        json_member_open(out, "rows", '[');
        for (uint32_t row = 0; b && row < b->shape.rows; row++)
            if (b->learnt[row])
                write_row(out, d, sensor, b, row);
        json_out_close(out, ']');
    }
    json_out_close(out, '}');
    return true;
}

/* ---- changes ---- */

/* The state after a change, or its refusal. */
static bool result(struct json_out *out, struct methods_env *d, int sensor, bool done, const char *why,
                   struct rpc_error *error)
{
    if (!done)
        return rpc_refuse(error, RPC_INVALID_REQUEST, "%s", why);
    write_open_state(out, d, sensor);
    json_out_close(out, '}');
    return true;
}

bool method_background_learn(const struct rpc_call *call, json_t *params, struct json_out *out,
                             struct rpc_error *error)
{
    const struct background_learn_conf conf = {.pings = (uint32_t)params_integer(params, "pings"),
                                               .standing = params_is(params, "motion", "any")};
    struct methods_env *d = call->daemon;
    int sensor;
    struct fault fault = {""};
    if (!change_of(call, params, &sensor, error))
        return false;
    bool done = template_learn(&d->templates, sensor, &conf, &fault);
    return result(out, d, sensor, done, fault.text, error);
}

bool method_background_stop(const struct rpc_call *call, json_t *params, struct json_out *out,
                            struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    int sensor;
    struct fault fault = {""};
    if (!change_of(call, params, &sensor, error))
        return false;
    bool done = template_stop(&d->templates, sensor, params_is(params, "use", "yes"), &fault);
    return result(out, d, sensor, done, fault.text, error);
}

typedef bool (*change_fn)(struct templates *s, int sensor, struct fault *fault);

static bool change(const struct rpc_call *call, json_t *params, change_fn fn, struct json_out *out,
                   struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    int sensor;
    struct fault fault = {""};
    if (!change_of(call, params, &sensor, error))
        return false;
    bool done = fn(&d->templates, sensor, &fault);
    return result(out, d, sensor, done, fault.text, error);
}

typedef bool (*ask_fn)(struct template_keep *k, int sensor, struct template_wait *wait, struct fault *fault);

static void drop_wait(void *wait)
{
    template_keep_forget(wait);
    free(wait);
}

static struct template_wait *begin_wait(const struct rpc_call *call, json_t *params, ask_fn fn,
                                        struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    int sensor;
    struct fault fault = {"out of memory"};
    if (!change_of(call, params, &sensor, error))
        return NULL;
    struct template_wait *w = malloc(sizeof *w);
    if (w && fn(&d->keep, sensor, w, &fault))
        return w;
    free(w);
    rpc_refuse(error, RPC_INVALID_REQUEST, "%s", fault.text);
    return NULL;
}

/* The answer waits for the disk, the loop does not. */
static bool after_disk(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct template_wait *w = call->work->state;
    if (w->done)
        return result(out, call->daemon, w->sensor, w->good, w->fault.text, error);
    rpc_work_wait(call->work, &w->keep->waiters);
    return rpc_continue(call, after_disk);
}

static bool wait_for(const struct rpc_call *call, json_t *params, ask_fn fn, struct json_out *out,
                     struct rpc_error *error)
{
    struct template_wait *w = begin_wait(call, params, fn, error);
    if (!w)
        return false;
    rpc_work_keep(call->work, w, drop_wait);
    return after_disk(call, out, error);
}

bool method_background_save(const struct rpc_call *call, json_t *params, struct json_out *out,
                            struct rpc_error *error)
{
    return wait_for(call, params, template_keep_save, out, error);
}

bool method_background_load(const struct rpc_call *call, json_t *params, struct json_out *out,
                            struct rpc_error *error)
{
    return wait_for(call, params, template_keep_load, out, error);
}

bool method_background_forget(const struct rpc_call *call, json_t *params, struct json_out *out,
                              struct rpc_error *error)
{
    return change(call, params, template_clear, out, error);
}
