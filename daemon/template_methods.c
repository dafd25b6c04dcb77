/* SPDX-License-Identifier: MIT */
/* The methods about background templates: what a client may ask and change; sonard-protocol(7) has every shape. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "daemon.h"
#include "template.h"

#define LEARN_DEFAULT 15
#define PICTURE_BINS  512 /* bins of a row in a picture, each the loudest of a group */

/* ---- which sonar ---- */

static bool sensor_of(const struct daemon *d, json_t *params, int *sensor, struct rpc_error *error)
{
    const char *words[CONF_MAX_SONARS + 1] = {NULL};
    for (int i = 0; i < d->conf.n_sonars; i++)
        words[i] = d->conf.sonar[i].name;
    *sensor = 0;
    return rpc_word(params, "sensor", words, sensor, error);
}

/* The one place through which every change goes: who may make them is decided here. All who may connect may, one after the
 * other: what the extract stage has not heard of yet is not changed again, or templates of before could fill the memory. */
static bool change_of(const struct rpc_call *call, json_t *params, const char *const *keys, int *sensor,
                      struct rpc_error *error)
{
    const struct daemon *d = call->daemon;
    if (!rpc_only(params, keys, error) || !sensor_of(d, params, sensor, error))
        return false;
    call->work->waits = d->template[*sensor].handing > 0;
    if (call->work->waits)
        error->code = RPC_UNFINISHED;
    return !call->work->waits;
}

/* ---- state ---- */

static json_t *metres(double m)
{
    return json_real(round(m * 1e4) / 1e4);
}

static const char *fit_word(int fit)
{
    static const char *const words[] = {[BACKGROUND_FITS] = "yes",
                                        [BACKGROUND_RESAMPLED] = "resampled: the sonar's range is another",
                                        [BACKGROUND_FOREIGN] = "no: another head or other counts"};
    return fit < 0 ? "no ping yet" : words[fit];
}

static json_t *template_json(const struct template *t)
{
    const struct background *b = t->background;
    if (!b)
        return json_null();
    const struct background_shape *s = &b->shape;
    json_int_t learnt = 0, blind = 0;
    for (uint32_t row = 0; row < s->rows; row++)
        learnt += b->learnt[row] != 0;
    for (size_t i = 0; i < (size_t)s->rows * s->bins; i++)
        blind += b->level[i] > b->mask_above;
    return json_pack("{s:i, s:I, s:i, s:o, s:o, s:i, s:I, s:i, s:i, s:s, s:b}", "rows", (int)s->rows,
                     "rows_learnt", learnt, "bins", (int)s->bins, "r0_m", metres((double)s->r0_m), "r1_m",
                     metres((double)s->r0_m + (double)s->bins * (double)s->dr_m), "mask", (int)b->mask_above,
                     "blind_cells", blind, "clusters", (int)t->kept.clusters, "clusters_kept", (int)t->kept.kept,
                     "fits", fit_word(t->fit), "saved", t->made == t->in_file);
}

/* What a person has to do for learning to go on. */
static const char *motion_word(const struct template *t, const struct background_progress *p)
{
    return t->learning.standing    ? "not asked for: what stands around may be learnt, too"
           : p->no_pose            ? "not known without a pose: what stands around may be learnt, too"
           : p->unmoved > p->taken ? "waiting for the vehicle to move"
                                   : "pings are taken as the vehicle moves";
}

static json_t *learning_json(const struct daemon *d, int sensor)
{
    const struct template *t = &d->template[sensor];
    struct background_progress p;
    if (!t->learn)
        return json_null();
    template_progress(d, sensor, &p);
    const double wanted = (double)p.rows_seen * t->learning.pings;
    return json_pack("{s:i, s:o, s:i, s:i, s:i, s:I, s:I, s:I, s:I, s:s}", "pings", (int)t->learning.pings,
                     "progress", json_real(wanted > 0 ? round((double)p.taken / wanted * 1e3) / 1e3 : 0),
                     "rows_seen", (int)p.rows_seen, "rows_full", (int)p.rows_full, "least", (int)p.least, "taken",
                     (json_int_t)p.taken, "unmoved", (json_int_t)p.unmoved, "no_pose", (json_int_t)p.no_pose,
                     "other_bins", (json_int_t)p.other_bins, "motion", motion_word(t, &p));
}

static json_t *state_json(const struct daemon *d, int sensor)
{
    const struct template *t = &d->template[sensor];
    const char *file = d->conf.sonar[sensor].background;
    return json_pack("{s:s, s:s, s:o, s:o, s:o, s:s}", "sensor", d->conf.sonar[sensor].name, "state",
                     template_word(t), "file", file[0] ? json_string(file) : json_null(), "template",
                     template_json(t), "learning", learning_json(d, sensor), "happened", t->happened);
}

/* ---- picture ---- */

static json_t *blind_json(const struct background *b, const uint8_t *level)
{
    const struct background_shape *s = &b->shape;
    json_t *list = json_array();
    for (uint32_t i = 0, from = 0; i < s->bins; i++) {
        if (level[i] <= b->mask_above)
            continue;
        from = i;
        while (i < s->bins && level[i] > b->mask_above)
            i++;
        json_array_append_new(list, json_pack("[o, o]", metres((double)s->r0_m + from * (double)s->dr_m),
                                              metres((double)s->r0_m + i * (double)s->dr_m)));
    }
    return list;
}

static json_t *row_json(const struct daemon *d, int sensor, const struct background *b, uint32_t row)
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
    return json_pack("{s:o, s:o, s:o, s:o, s:i, s:s, s:o}", "azimuth_deg", metres(geo_deg(az)), "width_deg",
                     metres(s->row_rad > 0 ? geo_deg((double)s->row_rad) : 1), "r0_m", metres((double)s->r0_m),
                     "r1_m", metres((double)s->r0_m + s->bins * (double)s->dr_m), "pings", (int)b->learnt[row],
                     "samples", hex, "blind", blind_json(b, level));
}

json_t *template_method_show(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"sensor", "picture", NULL}, *const yes_no[] = {"no", "yes", NULL};
    struct daemon *d = call->daemon;
    int sensor, picture = 0;
    if (!rpc_only(params, keys, error) || !sensor_of(d, params, &sensor, error) ||
        !rpc_word(params, "picture", yes_no, &picture, error))
        return NULL;
    json_t *state = state_json(d, sensor);
    const struct background *b = d->template[sensor].background;
    if (!picture || !state)
        return state;
    json_t *rows = json_array();
    for (uint32_t row = 0; b && row < b->shape.rows; row++)
        if (b->learnt[row])
            json_array_append_new(rows, row_json(d, sensor, b, row));
    json_object_set_new(state, "rows", rows);
    return state;
}

/* ---- changes ---- */

/* The state after a change, or its refusal. */
static json_t *result(struct daemon *d, int sensor, bool done, const char *why, struct rpc_error *error)
{
    if (done)
        return state_json(d, sensor);
    rpc_refuse(error, RPC_INVALID_REQUEST, "%s", why);
    return NULL;
}

json_t *template_method_learn(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"sensor", "pings", "motion", NULL};
    static const char *const motions[] = {"wanted", "any", NULL};
    int sensor, motion = 0;
    int64_t pings = LEARN_DEFAULT;
    char err[256] = "";
    if (!change_of(call, params, keys, &sensor, error) ||
        !rpc_integer(params, "pings", false, 1, BACKGROUND_LEARNT_MAX, &pings, error) ||
        !rpc_word(params, "motion", motions, &motion, error))
        return NULL;
    const struct background_learn_conf conf = {.pings = (uint32_t)pings, .standing = motion == 1};
    bool done = template_learn(call->daemon, sensor, &conf, err, sizeof err);
    return result(call->daemon, sensor, done, err, error);
}

json_t *template_method_stop(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"sensor", "use", NULL}, *const yes_no[] = {"no", "yes", NULL};
    int sensor, use = 0;
    char err[256] = "";
    if (!change_of(call, params, keys, &sensor, error) || !rpc_word(params, "use", yes_no, &use, error))
        return NULL;
    bool done = template_stop(call->daemon, sensor, use == 1, err, sizeof err);
    return result(call->daemon, sensor, done, err, error);
}

typedef bool (*change_fn)(struct daemon *d, int sensor, char *err, size_t err_size);

static json_t *change(const struct rpc_call *call, json_t *params, change_fn fn, struct rpc_error *error)
{
    static const char *const keys[] = {"sensor", NULL};
    int sensor;
    char err[640] = "";
    if (!change_of(call, params, keys, &sensor, error))
        return NULL;
    bool done = fn(call->daemon, sensor, err, sizeof err);
    return result(call->daemon, sensor, done, err, error);
}

typedef bool (*ask_fn)(struct daemon *d, int sensor, struct template_wait *wait, char *err, size_t err_size);

static void drop_wait(void *wait)
{
    template_keep_forget(wait);
    free(wait);
}

static struct template_wait *begin_wait(const struct rpc_call *call, json_t *params, ask_fn fn,
                                        struct rpc_error *error)
{
    static const char *const keys[] = {"sensor", NULL};
    int sensor;
    char err[640] = "out of memory";
    if (!change_of(call, params, keys, &sensor, error))
        return NULL;
    struct template_wait *w = malloc(sizeof *w);
    if (w && fn(call->daemon, sensor, w, err, sizeof err))
        return w;
    free(w);
    rpc_refuse(error, RPC_INVALID_REQUEST, "%s", err);
    return NULL;
}

/* The answer waits for the disk, the loop does not. */
static json_t *wait_for(const struct rpc_call *call, json_t *params, ask_fn fn, struct rpc_error *error)
{
    struct template_wait *w = call->work->state;
    if (!w && !(w = begin_wait(call, params, fn, error)))
        return NULL;
    *call->work = (struct rpc_work){.state = w, .drop = drop_wait, .waits = !w->done};
    if (w->done)
        return result(call->daemon, w->sensor, w->good, w->message, error);
    error->code = RPC_UNFINISHED;
    return NULL;
}

json_t *template_method_save(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    return wait_for(call, params, template_save_one, error);
}

json_t *template_method_load(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    return wait_for(call, params, template_load_one, error);
}

json_t *template_method_forget(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    return change(call, params, template_clear, error);
}
