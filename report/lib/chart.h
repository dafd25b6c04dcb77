/* SPDX-License-Identifier: MIT */
/*
 * chart - a voxel submap of a world, made from looks of a dive, and how wrong it is: free volume behind surfaces
 * (dangerous), volume in common with the truth, distance between surfaces both ways. Knows no sound.
 */
#ifndef SONARD_REPORT_CHART_H
#define SONARD_REPORT_CHART_H

#include "config/conf.h"
#include "grid/voxel/submap.h"
#include "dive.h"
#include "surface.h"

struct chart_setting {
    double voxel_m, tolerance_m;
    struct voxel_rule rule;
    /* As in struct voxmap_setting; 0: all of the half-power aperture is free as far as the axis, as the paper has it */
    double opening;
    bool echoes;   /* keep them, as the rule needs them */
    double body_m; /* radius of the vehicle's own body, stamped free; 0: none */
};

struct chart {
    const struct place *world;
    struct chart_setting set;
    struct cast_opening opening, axis_opening, edge_opening; /* of free water */
    struct cast_opening heard_opening;                       /* of echoes */
    struct cast_opening whole_opening;                       /* of free water near the body */
    struct tiles tiles;
    struct submap map;
    bool stamped;
    double body[3];         /* where the body was stamped last */
    struct lattice_box box; /* the cells of the world's part that is looked at */
};

/** chart_setting_of - as [map] of a configuration with a map has it. */
struct chart_setting chart_setting_of(const struct conf *conf);

/** chart_make - empty; of the heap. Ends the program when a setting is out of range. */
struct chart *chart_make(const struct place *world, const struct chart_setting *set);
void chart_free(struct chart *c);

/** chart_place - of a place in the world's coordinates. */
struct lattice_place chart_place(const struct chart *c, const double at[3]);

/** chart_aim - the beam of a look that is believed to be from `at`, with one of the chart's openings; false: nothing is
 * free. */
bool chart_aim(const struct chart *c, const struct cast_opening *opening, const struct dive_look *look,
               const double at[3], double near_m, double far_m, struct cast_beam *beam);

/** chart_enter - what was heard in a look that is believed to be from `at`: free water, echoes, the body. */
void chart_enter(struct chart *c, const struct dive_look *look, const double at[3],
                 const struct beam_echoes *heard);

/** chart_enter_truth - free to where the first surface really is, with range errors added. */
void chart_enter_truth(struct chart *c, const struct dive_look *look, double range_error_m);

/** chart_enter_sight - free is every voxel whose centre the look had in its aperture and in sight, and the body. */
void chart_enter_sight(struct chart *c, const struct dive_look *look);

/** chart_count - a voxel's count, to be changed; of the chart's box. plane: SUBMAP_ECHOES only where it keeps them. */
uint8_t *chart_count(struct chart *c, const int64_t cell[3], enum submap_plane plane);

/** chart_cell - the state of a voxel. */
enum voxel_state chart_cell(const struct chart *c, const int64_t cell[3]);

/** chart_state - of the voxel that holds a place in the world's coordinates. */
enum voxel_state chart_state(const struct chart *c, const double at[3]);

/** chart_center - of a cell, in the world's coordinates. */
void chart_center(const struct chart *c, const int64_t cell[3], double at[3]);

struct chart_errors {
    double free_m3;
    double false_free_m3;           /* with their centre in a solid */
    double behind_max_m;            /* how deep in it, at most */
    double found_share;             /* of the volume that the reference has free */
    double overlap;                 /* what both have free, of what either has */
    struct surface_spread to_truth; /* from the frontier, where something was heard, to the nearest surface */
    struct surface_spread to_map;   /* from surfaces beside free water to the frontier */
};

/** chart_grade - against a finer reference of what was to be known; at the time t_s of the world. */
void chart_grade(const struct chart *c, const struct chart *reference, double t_s, struct chart_errors *out);

/** chart_false_free - the volume (m^3) of free voxels whose centre is in a solid; the deepest of them, and all free
 * volume. */
double chart_false_free(const struct chart *c, double t_s, double *behind_max_m, double *free_m3);

#endif
