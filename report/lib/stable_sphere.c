/* SPDX-License-Identifier: MIT */
#include "stable_sphere.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "stable.h"
#include "grid/sphere/view.h"

void *stable_memory(size_t n)
{
    void *memory = n ? aligned_alloc(64, (n + 63) / 64 * 64) : NULL;
    if (!memory) {
        fprintf(stderr, "no memory\n");
        exit(1);
    }
    return memset(memory, 0xa5, n);
}

const struct sphere_conf stable_sphere_usual = {
    .angular_step_rad = 2 * GEO_PI / 180,
    .level = true,
    .level_half_rad = 7.5 * GEO_PI / 180,
    .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
    .max_cells = 20000,
    .forget_s = 160,
    .blocked_above = 0.6,
    .recentre_m = 0.1};

struct stable_sphere stable_sphere(const struct sphere_conf *conf)
{
    struct fault fault = {""};
    void *memory = stable_memory(sphere_bytes(conf, &fault));
    return (struct stable_sphere){
        .sphere = sphere_init(memory, conf), .pose = pose_identity, .t_ns = 1000 * STABLE_SECOND};
}

void stable_ping(struct stable_sphere *s, double az_deg, double range_m, double free_m)
{
    struct beam_echoes beam = {
        .az_rad = (float)geo_rad(az_deg), .blind_m = 0.3f, .free_to_m = (float)free_m, .state = BEAM_SILENT};
    if (range_m > 0) {
        beam.state = BEAM_ECHO;
        beam.n = 1;
        beam.free_to_m = (float)(range_m - 0.02);
        beam.echo[0] = (struct echo){
            .range_m = (float)range_m, .near_m = (float)(range_m - 0.02), .sd_m = 0.01f, .confidence = 0.9f};
    }
    const struct echoes e = {.t_ns = s->t_ns,
                             .seq = ++s->seq,
                             .n_beams = 1,
                             .range_max_m = 20,
                             .az_aperture_rad = (float)geo_rad(2),
                             .el_aperture_rad = (float)geo_rad(25),
                             .pose = s->pose,
                             .beam = &beam};
    sphere_enter(s->sphere, &e, &mount_identity);
    if (s->store)
        store_enter(s->store, &e, &mount_identity);
}

uint32_t stable_direction(struct stable_sphere *s, double az_deg)
{
    return rings_index(sphere_picture(s->sphere)->rings, geo_rad(az_deg), 1e-6);
}

struct sphere_cell stable_cell(struct stable_sphere *s, double az_deg)
{
    struct sphere_cell c = {0};
    sphere_cell(s->sphere, stable_direction(s, az_deg), 0, s->t_ns, &c);
    return c;
}
