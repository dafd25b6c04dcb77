/* SPDX-License-Identifier: MIT */
/*
 * voxmap - the global map M_g = {(m_i, r_i)} (Oliveira, Ferreira and Cruz 2023, eq. (2)): submaps at their base poses,
 * one of which takes what the pings say. Knows pings' echoes, submaps and their ages; knows no file and no question
 * (merge.h adds submaps up, voxpage.h makes plain bytes of one). Pure; one thread owns it.
 *
 * Numbers: a submap is known by its id, 1, 2, 3 ... in order of their making; the last is the current one.
 *
 * Ageing: time is cut into half-lives from the first ping on. With every one that begins, vacancy is halved and rounded
 * down, echoes are halved and rounded up: water becomes unknown again, and an echo stays, once, until looks
 * carve it away. No voxel becomes free by ageing. Only the current submap is halved in place, by the next ping; the
 * others, which never change, are read shifted, and so is the current one while no ping comes (voxmap_pass).
 */
#ifndef SONARD_VOXMAP_H
#define SONARD_VOXMAP_H

#include "core/fault.h"
#include "grid/echoes.h"
#include "submap.h"
#include "residual.h"

#define VOXMAP_MAX_SIDE    4096 /* tiles along a submap's side */
#define VOXMAP_MAX_SUBMAPS 256  /* so that sums of their counts fit 16 bits */
#define VOXMAP_MAX_LEVELS  8
#define VOXMAP_NEVER       UINT64_MAX

struct voxmap_setting {
    double voxel_m;       /* [0.01, 10] */
    uint32_t side;        /* tiles along a submap's side: voxmap_side() */
    uint32_t height;      /* voxels of a submap's height */
    uint32_t n_tiles;     /* of the pool that all submaps share */
    uint32_t max_submaps; /* [2, VOXMAP_MAX_SUBMAPS] */
    bool keep_echoes;     /* echo evidence beside vacancy: twice the memory; tags, occupied voxels, thin things */
    struct voxel_rule rule;
    double tolerance_m; /* of the side faces (cast.h); 0 is safe */
    /* (0, 1]: share of a beam's height, of a cone's width, whose water is free as far as its axis hears, or where that
     * is known (struct beam_echoes, off_axis) as far as its side does; then half of it is as far as the axis, and all
     * of the beam as far as its edge. Echoes fill all of it. Surfaces that the edge grazes answer too weakly to end it,
     * so there the edge counts as far as such a surface would be heard, and near the body, where none can be grazed, as
     * far as the target would. */
    double opening;
    uint8_t
        weight_levels; /* [1, 8] angle-weighted vacancy (the paper's future work): a look at a voxel on the beam's
                            * axis counts as much as this many at its edge; threshold and echo weight are scaled along.
                            * 1: plain */
    double body_radius_m;  /* of the vehicle's own body, whose water is free; 0: none is entered */
    double submap_path_m;  /* distance travelled after which a new submap starts; INFINITY: never */
    uint64_t submap_ns;    /* the same for time; VOXMAP_NEVER */
    uint64_t half_life_ns; /* of all evidence; VOXMAP_NEVER */
};

/* The parts of a beam whose water is free to a range of its own. */
enum voxmap_part_of_beam { VOXMAP_AXIS, VOXMAP_SIDE, VOXMAP_WHOLE, VOXMAP_EDGE, VOXMAP_PARTS };

/* Half apertures of a ping's beams, cut to their spacing, and that in azimuth in which the edge's water is free. */
struct voxmap_width {
    float az_rad, el_rad, edge_az_rad;
};

/* What a sensor's pings need beside themselves. */
struct voxmap_sensor {
    struct mount mount;
    enum cast_shape shape; /* CAST_WEDGE but for round beams */
};

struct voxmap_part {
    uint64_t id; /* 0: this place is not taken */
    struct submap map;
    struct lattice_place base;     /* where it was started */
    bool moved;                    /* its base pose has been corrected: */
    struct lattice_place moved_to; /* where the base is by now, ... */
    double turn[4];                /* ... and by which rotation it is turned */
    uint64_t begin_ns, last_ns; /* of the first and last ping in it; 0: of another run, whose clock is not ours */
    double begin_path_m;        /* struct pose's path_m at its first ping */
    uint64_t pings, half_lives; /* pings in it; half-lives since the first ping that its counts stand at */
};

struct voxmap_stats {
    uint64_t pings;   /* entered */
    uint64_t no_pose; /* not entered: position, depth or attitude not known or in doubt, or beyond the lattice */
    uint64_t beams;   /* with free water entered */
    uint64_t clipped; /* beams and bodies that reached beyond the current submap's box: unknown there */
    uint64_t starved; /* runs of voxels not entered because the memory was full: unknown there */
    uint64_t lost;    /* submaps forgotten (voxmap_drop): what only they knew is unknown */
    uint64_t unfit;   /* pings not entered because their apertures are none */
};

struct voxmap {
    struct voxmap_setting set;
    struct voxel_rule rule; /* the setting's, scaled by weight_levels */
    struct tiles tiles;
    struct residual residual; /* echoes that no submap keeps */
    struct voxmap_part *part; /* [max_submaps] */
    struct voxmap_part *current;
    uint64_t next_id;
    bool close_asked, held;
    uint64_t from_ns;        /* pings of before may have poses that count from elsewhere */
    bool started;            /* a ping was entered: */
    uint64_t t0_ns, last_ns; /* first and last ping */
    uint64_t half_lives;     /* that have started since */
    uint64_t change;         /* counts everything that may change an answer; stamps of tiles are its values */
    uint64_t
        change_of_all; /* the last change that is not a ping's: ageing, correction, a submap that comes or goes */
    struct cast_opening opening[VOXMAP_PARTS][VOXMAP_MAX_LEVELS], heard, residual_cells; /* of the last ping: */
    struct voxmap_width opening_width;
    enum cast_shape opening_shape;
    struct lattice_place body; /* at the last stamp */
    uint64_t body_ns;          /* ... and when; 0: none */
    struct voxmap_stats stats;
};

/** voxmap_side - tiles that a submap needs along its side, so that beams of range_m never leave it while the vehicle
 * drives path_m; 0 when more than submap_bytes takes. */
uint32_t voxmap_side(double range_m, double path_m, double voxel_m);

/** voxmap_bytes - memory for a map; 0, with a sentence in fault, when a setting is out of range. */
size_t voxmap_bytes(const struct voxmap_setting *s, struct fault *fault);

/** voxmap_init - an empty map. memory: voxmap_bytes(s) != 0, max_align_t-aligned; all of it is touched. */
void voxmap_init(struct voxmap *m, const struct voxmap_setting *s, void *memory);

/** voxmap_clear - forgets everything; ids go on. */
void voxmap_clear(struct voxmap *m);

/**
 * voxmap_enter - one ping, in order of time. Per beam the water from blind_m to free_to_m gets a vacancy more, off the
 * axis the less far the farther off (voxmap_setting.opening), and each voxel one at most; per echo
 * the shell from near_m to range_m + sd_m, half a voxel thicker either way and wider by half a voxel's diagonal so that
 * at least one voxel holds it, an echo more; what of it lies beyond the box, or finds no memory, goes into the
 * residual. Beams of a fan are cut to half their least spacing, so that each voxel is raised once per ping. The body's
 * capsule from the last ping's position (when at most 2 s and two radii back) is stamped free.
 * False: nothing was entered, since the pose lacks attitude, position or depth; counted. The map ages all the same.
 * Cost: the voxels touched; when a half-life begins, once the current submap's memory.
 */
bool voxmap_enter(struct voxmap *m, const struct echoes *e, const struct voxmap_sensor *sensor);

/** voxmap_pass - time has come to t_ns, ping or none: answers are judged with it from here on. A time that has been is
 * nothing. */
void voxmap_pass(struct voxmap *m, uint64_t t_ns);

/** voxmap_new - the next ping begins a new submap; the last beam belongs to the old one. */
void voxmap_new(struct voxmap *m);

/** voxmap_move - a submap's base pose is corrected: its base now lies at position_m (NED), turned by attitude (submap
 * to world, unit). Its voxels are not touched: answers are pulled from it (merge.h). False: no such submap, or a place
 * that cannot be. The current one is closed first. */
bool voxmap_move(struct voxmap *m, uint64_t id, const double position_m[3], const double attitude[4]);

/** voxmap_hold - it is in doubt, as of t_ns, whether poses count from where the map does: no ping is entered and
 * nothing is free until it is let go, when all is as it was.
 * Either way no ping of t_ns or before is entered any more. */
void voxmap_hold(struct voxmap *m, bool held, uint64_t t_ns);

/** voxmap_part - by id; NULL: none. */
struct voxmap_part *voxmap_part(const struct voxmap *m, uint64_t id);

/** voxmap_low - memory runs out (less than a quarter of the tiles is free): drop a submap soon. Else voxmap_enter, at
 * an eighth, closes the current one when it is alone, and at a sixteenth forgets the oldest. */
bool voxmap_low(const struct voxmap *m);

/** voxmap_oldest - id of the oldest submap that is closed; 0: none is. */
uint64_t voxmap_oldest(const struct voxmap *m);

/** voxmap_drop - forgets a submap that is not the current one: its free looks are gone, and its echoes go into the
 * residual, nowhere fewer echoes than it held, so no water becomes free that was not. False: no such. */
bool voxmap_drop(struct voxmap *m, uint64_t id);

/** voxmap_place_for_part - a place for one more submap: with all taken, that of the oldest, which is forgotten as by
 * voxmap_drop(). */
struct voxmap_part *voxmap_place_for_part(struct voxmap *m);

/** voxmap_join_residual - adds the residual of another map on the same lattice: n counts, residual_good(n). */
void voxmap_join_residual(struct voxmap *m, const uint8_t *count, uint32_t n);

/** voxmap_shift - by how many half-lives the counts of a submap are to be halved where they are read, at most 8. */
static inline unsigned voxmap_shift(const struct voxmap *m, const struct voxmap_part *p)
{
    uint64_t past = m->half_lives - p->half_lives;
    return past < 8 ? (unsigned)past : 8;
}

/** voxmap_faded_echoes - a count of echoes as it is after so many half-lives: halved and rounded up. */
static inline uint32_t voxmap_faded_echoes(uint32_t count, unsigned shift)
{
    return (count + (1u << shift) - 1) >> shift;
}

/** voxmap_changed - everything that may change an answer makes this number larger. */
static inline uint64_t voxmap_changed(const struct voxmap *m)
{
    return m->change;
}

#endif
