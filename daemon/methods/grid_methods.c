/* SPDX-License-Identifier: MIT */
#include "grid_methods.h"

#include <string.h>

#include "methods.h"
#include "json_units.h"
#include "daemon/wiring.h"
#include "grid/sphere/view.h"

static double bytes_of_all(struct methods_env *d)
{
    size_t bytes = 0;
    struct grid *g;
    for (int i = 0; (g = pipeline_grid(d->pipeline, i)); i++)
        bytes += g->bytes;
    return (double)bytes;
}

bool grid_has_room(struct methods_env *d, const char *name, size_t more_bytes, struct fault *fault)
{
    return wiring_grids_fit(&d->conf, name, bytes_of_all(d) + (double)more_bytes, fault);
}

/* ---- finding and telling ---- */

static struct grid *find_grid(struct methods_env *d, const char *name)
{
    struct grid *g;
    for (int i = 0; (g = pipeline_grid(d->pipeline, i)) && strcmp(g->setting.name, name) != 0; i++)
        ;
    return g;
}

struct grid *grid_asked(struct methods_env *d, const json_t *params, struct rpc_error *error)
{
    const char *name = params_text(params, "grid");
    struct grid *g = name ? find_grid(d, name) : pipeline_grid(d->pipeline, 0);
    if (!g)
        rpc_refuse(error, RPC_INVALID_PARAMS, "grid = %.64s: no grid of that name; see `sonarctl grid list`",
                   name);
    return g;
}

static void write_grid(struct json_out *out, struct grid *g)
{
    static const char *const models[] = {
        [SPHERE_OPENING] = "opening", [SPHERE_GAUSS] = "gauss", [SPHERE_MIDPOINT] = "midpoint"};
    const struct sphere_conf *c = &g->setting.sphere;
    struct sphere_stats s;
    grid_stats(g, &s);
    json_out_open(out, '{');
    json_member_text(out, "name", g->setting.name);
    json_member_metres(out, "range_m", c->layers.r_max_m);
    json_member_degrees(out, "angular_step_deg", c->angular_step_rad);
    json_member_metres(out, "layer_m", c->layers.dr_m);
    json_member_word(out, "sensor_model", models[c->model]);
    json_member_flag(out, "level", c->level);
    json_member_word(out, "axes", c->axes == SPHERE_COURSE ? "course" : "ned");
    json_member_age(out, "clear_for_s", grid_limits(g).clear_for_s);
    json_member_count(out, "bytes", g->bytes);
    json_member_count(out, "cells", s.cells);
    json_member_count(out, "directions", s.directions);
    json_member_count(out, "pinged", s.pinged);
    json_member_count(out, "cells_lost", s.cells_lost);
    json_member_count(out, "out_of_range", s.out_of_range);
    json_out_close(out, '}');
}

void grid_list_write(struct json_out *out, struct methods_env *d)
{
    struct grid *g;
    json_member_open(out, "grids", '[');
    for (int i = 0; (g = pipeline_grid(d->pipeline, i)); i++)
        write_grid(out, g);
    json_out_close(out, ']');
}

bool method_grid_list(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    (void)params;
    (void)error;
    json_out_open(out, '{');
    grid_list_write(out, d);
    json_member_count(out, "bytes", (uint64_t)bytes_of_all(d));
    json_member_count(out, "memory", (uint64_t)d->conf.grids.memory_bytes);
    json_out_close(out, '}');
    return true;
}

/* ---- cells in words ---- */

const char *grid_turn_word(unsigned flags)
{
    return flags & SPHERE_NEW       ? "appeared"
           : flags & SPHERE_UPDATED ? "updated"
           : flags & SPHERE_MISSED  ? "missed"
                                    : "not observed";
}

const char *grid_sensor_name(const struct methods_env *d, uint32_t sensor)
{
    return sensor < (uint32_t)d->conf.n_sonars ? d->conf.sonar[sensor].name : "?";
}
