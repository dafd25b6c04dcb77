/* SPDX-License-Identifier: MIT */
#include "grid_methods.h"

#include <stdlib.h>
#include <string.h>

#include "errand.h"
#include "say.h"
#include "wiring.h"

/* ---- making ---- */

/* Those that come and go among them. */
static double bytes_of_all(struct daemon *d)
{
    size_t bytes = d->grid_bytes_aside;
    struct grid *g;
    for (int i = 0; (g = pipeline_grid(d->pipeline, i)); i++)
        bytes += g->bytes;
    return (double)bytes;
}

bool grid_has_room(struct daemon *d, const char *name, size_t more_bytes, char *err, size_t err_size)
{
    const double all = bytes_of_all(d) + (double)more_bytes;
    if (all <= d->conf.grids.memory_bytes)
        return true;
    snprintf(err, err_size,
             "grid %s: all grids together would take %.1f MiB; wanted at most %g MiB ([grids] memory)", name,
             all / 1048576, d->conf.grids.memory_bytes / 1048576);
    return false;
}

static bool has_place(struct daemon *d, char *err, size_t err_size)
{
    if (!pipeline_grid(d->pipeline, PIPELINE_MAX_GRIDS - 1))
        return true;
    snprintf(err, err_size, "there are %d grids, and room for no more", PIPELINE_MAX_GRIDS);
    return false;
}

static struct grid *begin_grid(struct daemon *d, const struct conf_grid *conf, char *err, size_t err_size)
{
    struct grid_setting setting;
    wiring_grid(&d->conf, conf, &setting);
    const size_t bytes = sphere_bytes(&setting.sphere, err, err_size);
    if (!bytes || !grid_has_room(d, setting.name, bytes, err, err_size) || !has_place(d, err, err_size))
        return NULL;
    return grid_begin(&setting, err, err_size);
}

static bool make_grid(struct daemon *d, const struct conf_grid *conf, char *err, size_t err_size)
{
    struct grid *g = begin_grid(d, conf, err, err_size);
    while (g && !grid_step(g))
        ;
    if (!g || !pipeline_add_grid(d->pipeline, g))
        return false;
    struct grid_errand come = {.errand.pipeline = d->pipeline, .grid = g};
    pipeline_visit(d->pipeline, pipeline_feed_grid, &come);
    return true;
}

bool grid_start(struct daemon *d, char *err, size_t err_size)
{
    bool made = grid_has_room(d, CONF_MAIN_GRID, 0, err, err_size);
    for (int i = 0; made && i < d->conf.n_more_grids; i++)
        made = make_grid(d, &d->conf.more_grid[i], err, err_size);
    return made;
}

/* ---- finding and telling ---- */

static struct grid *find(struct daemon *d, const char *name)
{
    struct grid *g;
    for (int i = 0; (g = pipeline_grid(d->pipeline, i)) && strcmp(g->setting.name, name) != 0; i++)
        ;
    return g;
}

static const char *name_of(json_t *params, const char *key, struct rpc_error *error)
{
    json_t *name = json_object_get(params, key);
    if (!json_is_string(name)) {
        rpc_refuse(error, RPC_INVALID_PARAMS, "%s: wanted the name of a grid, as text", key);
        return NULL;
    }
    return json_string_value(name);
}

struct grid *grid_asked(struct daemon *d, json_t *params, struct rpc_error *error)
{
    if (!json_object_get(params, "grid"))
        return pipeline_grid(d->pipeline, 0);
    const char *name = name_of(params, "grid", error);
    struct grid *g = name ? find(d, name) : NULL;
    if (name && !g)
        rpc_refuse(error, RPC_INVALID_PARAMS, "grid = %.64s: there is none of that name; `sonarctl grid list` has them",
                   name);
    return g;
}

static json_t *grid_json(struct grid *g)
{
    static const char *const models[] = {
        [SPHERE_OPENING] = "opening", [SPHERE_GAUSS] = "gauss", [SPHERE_MIDPOINT] = "midpoint"};
    const struct sphere_conf *c = &g->setting.sphere;
    struct sphere_stats s;
    grid_stats(g, &s);
    return json_pack("{s:s, s:o, s:o, s:o, s:s, s:b, s:s, s:o, s:I, s:i, s:i, s:i, s:I, s:I}", "name", g->setting.name,
                     "range_m", say_metres(c->layers.r_max_m), "angular_step_deg",
                     say_degrees(c->angular_step_rad), "layer_m", say_metres(c->layers.dr_m), "sensor_model",
                     models[c->model], "level", (int)c->level, "axes",
                     c->axes == SPHERE_COURSE ? "course" : "ned", "clear_for_s",
                     say_age(g->setting.limits.clear_for_s), "bytes", (json_int_t)g->bytes, "cells", (int)s.cells,
                     "directions", (int)s.directions, "pinged", (int)s.pinged, "cells_lost",
                     (json_int_t)s.cells_lost, "out_of_range", (json_int_t)s.out_of_range);
}

json_t *grid_list_json(struct daemon *d)
{
    json_t *list = json_array();
    struct grid *g;
    for (int i = 0; (g = pipeline_grid(d->pipeline, i)); i++)
        json_array_append_new(list, grid_json(g));
    return list;
}

json_t *grid_method_list(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {NULL};
    struct daemon *d = call->daemon;
    if (!rpc_only(params, keys, error))
        return NULL;
    return json_pack("{s:o, s:o, s:o}", "grids", grid_list_json(d), "bytes",
                     json_integer((json_int_t)bytes_of_all(d)), "memory",
                     json_integer((json_int_t)d->conf.grids.memory_bytes));
}

/* ---- at run time ---- */

/* {"range": "100 m", ...}: keys and values as in [grid]. */
static bool read_settings(json_t *settings, struct conf_grid *conf, struct rpc_error *error)
{
    const char *key;
    json_t *value;
    char err[256];
    if (settings && !json_is_object(settings))
        return rpc_refuse(error, RPC_INVALID_PARAMS,
                          "settings: wanted an object of keys of [grid], each with its text");
    json_object_foreach(settings, key, value)
    {
        if (!json_is_string(value))
            return rpc_refuse(error, RPC_INVALID_PARAMS, "settings, %.64s: wanted a text as in the configuration",
                              key);
        if (!conf_grid_set(conf, key, json_string_value(value), err, sizeof err))
            return rpc_refuse(error, RPC_INVALID_PARAMS, "%s", err);
    }
    if (conf->forget_s < conf->clear_for_s)
        return rpc_refuse(error, RPC_INVALID_PARAMS, "settings: wanted forget not shorter than clear_for");
    return true;
}

/* A grid on its way, of one request. */
struct making {
    struct grid_errand come;
    struct daemon *d;
    json_t *told; /* of the new grid, which is the pipeline's by then, and another client may drop it; NULL: not yet */
};

static void free_making(void *making)
{
    struct making *m = making;
    json_decref(m->told);
    free(m);
}

static void give_up(void *making)
{
    struct making *m = making;
    if (m->told) {
        pipeline_errand_leave(&m->come.errand, free_making);
        return;
    }
    m->d->grid_bytes_aside -= m->come.grid->bytes;
    grid_free(m->come.grid);
    free(m);
}

static struct making *begin_making(struct daemon *d, const struct conf_grid *conf, char *err, size_t err_size)
{
    struct making *m = calloc(1, sizeof *m);
    snprintf(err, err_size, "out of memory");
    struct grid *g = m ? begin_grid(d, conf, err, err_size) : NULL;
    if (!g) {
        free(m);
        return NULL;
    }
    *m = (struct making){.come.grid = g, .d = d};
    d->grid_bytes_aside += g->bytes;
    return m;
}

/* Another client may have been faster. */
static bool add(struct making *m, struct rpc_error *error)
{
    struct daemon *d = m->d;
    struct grid *g = m->come.grid;
    json_t *told = grid_json(g);
    if (!told)
        return rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
    if (!pipeline_add_grid(d->pipeline, g)) {
        json_decref(told);
        return rpc_refuse(error, RPC_LIMIT, "there are %d grids, and room for no more", PIPELINE_MAX_GRIDS);
    }
    g->of_client = true;
    d->grid_bytes_aside -= g->bytes;
    m->told = told;
    return true;
}

static bool good_new_name(struct daemon *d, const char *name, struct rpc_error *error)
{
    if (conf_name_is_good(name) && !find(d, name))
        return true;
    return rpc_refuse(error, RPC_INVALID_PARAMS,
                      "name = %.64s: %s; wanted another one of 1 to %d letters, digits, - and _", name,
                      find(d, name) ? "there is one" : "no name for a grid", CONF_NAME_MAX - 1);
}

/* The next part; false with *error set: it is not the last. */
static bool make_on(struct making *m, const char *name, struct rpc_error *error)
{
    if (m->told)
        return true;
    if (!good_new_name(m->d, name, error))
        return false;
    if (grid_step(m->come.grid))
        return add(m, error);
    error->code = RPC_UNFINISHED;
    return false;
}

/* In parts: the pages of a large grid take a tenth of a second. */
json_t *grid_method_create(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"name", "settings", NULL};
    struct daemon *d = call->daemon;
    const char *name = rpc_only(params, keys, error) ? name_of(params, "name", error) : NULL;
    struct making *m = call->work->state;
    struct conf_grid conf = d->conf.grid;
    char err[256];
    if (!name)
        return NULL;
    snprintf(conf.name, sizeof conf.name, "%s", name);
    if (!m && (!errand_room(call, error) || !good_new_name(d, name, error) ||
               !read_settings(json_object_get(params, "settings"), &conf, error)))
        return NULL;
    if (!m && !(m = begin_making(d, &conf, err, sizeof err))) {
        rpc_refuse(error, RPC_LIMIT, "%s", err);
        return NULL;
    }
    *call->work = (struct rpc_work){.state = m, .drop = give_up};
    return make_on(m, name, error) && errand_done(call, pipeline_feed_grid, error) ? json_incref(m->told) : NULL;
}

/* A grid on its way out. */
struct dropping {
    struct grid_errand go;
    struct daemon *d;
    size_t bytes;
};

/* The owner knows it no longer, or at the end the pipeline frees it. */
static void free_dropped(void *dropping)
{
    struct dropping *out = dropping;
    if (out->go.done)
        grid_free(out->go.grid);
    out->d->grid_bytes_aside -= out->bytes;
    free(out);
}

static void leave_dropped(void *dropping)
{
    pipeline_errand_leave(dropping, free_dropped);
}

static struct dropping *begin_dropping(struct daemon *d, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"name", NULL};
    const char *name = rpc_only(params, keys, error) ? name_of(params, "name", error) : NULL;
    struct grid *g = name ? find(d, name) : NULL;
    if (!name)
        return NULL;
    if (!g || g == pipeline_grid(d->pipeline, 0)) {
        rpc_refuse(error, RPC_INVALID_PARAMS, "name = %.64s: %s", name,
                   g ? "the main grid stays" : "there is no grid of that name; `sonarctl grid list` has them");
        return NULL;
    }
    struct dropping *out = calloc(1, sizeof *out);
    if (!out) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "out of memory");
        return NULL;
    }
    *out = (struct dropping){.go.grid = g, .d = d, .bytes = g->bytes};
    d->grid_bytes_aside += g->bytes;
    pipeline_drop_grid(d->pipeline, g);
    return out;
}

json_t *grid_method_drop(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    struct dropping *out = call->work->state;
    if (!out && (!errand_room(call, error) || !(out = begin_dropping(call->daemon, params, error))))
        return NULL;
    *call->work = (struct rpc_work){.state = out, .drop = leave_dropped};
    return errand_done(call, pipeline_starve_grid, error) ? json_pack("{s:b}", "dropped", 1) : NULL;
}
