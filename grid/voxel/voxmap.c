/* SPDX-License-Identifier: MIT */
#include "voxmap.h"

#include <float.h>
#include <string.h>

#include "voxresidual.h"

#define BODY_GAP_NS  UINT64_C(2000000000) /* longest time over which the body is taken to have gone straight */
#define ASIDE_VOXELS 1.0                  /* a beam that frees water may be so far off */

static size_t aligned(size_t bytes)
{
    return (bytes + 63) / 64 * 64;
}

uint32_t voxmap_side(double range_m, double path_m, double voxel_m)
{
    double side = 2 * ceil((range_m + path_m) / voxel_m / TILE_SIDE) + 3; /* the base lies anywhere in its tile */
    return side >= 1 && side <= VOXMAP_MAX_SIDE ? (uint32_t)side : 0;
}

static const char *refused(const struct voxmap_setting *s)
{
    if (!(s->voxel_m >= 0.01 && s->voxel_m <= 10))
        return "voxel: expected 0.01 to 10 m";
    if (!submap_bytes(s->side, 1))
        return "side: expected 1 to 4096 tiles";
    if (s->max_submaps < 2 || s->max_submaps > VOXMAP_MAX_SUBMAPS)
        return "submaps: expected 2 to 256";
    if (!tiles_bytes(s->n_tiles, s->height, s->keep_echoes ? 2 : 1))
        return "memory: expected at least one tile of 16 x 16 columns";
    if (!(s->tolerance_m >= 0 && s->tolerance_m <= s->voxel_m))
        return "tolerance: expected 0 to one voxel";
    if (!(s->opening > 0 && s->opening <= 1))
        return "opening: expected more than 0, at most 1";
    if (s->weight_levels < 1 || s->weight_levels > VOXMAP_MAX_LEVELS)
        return "weight levels: expected 1 to 8";
    if (s->rule.threshold * s->weight_levels > 254)
        return "threshold: expected at most 254 over the weight levels";
    if (!(s->body_radius_m >= 0 && s->body_radius_m <= 100))
        return "body radius: expected 0 to 100 m";
    if (!(s->submap_path_m > 0) || s->submap_ns == 0 || s->half_life_ns == 0)
        return "submap path, submap time and half-life: expected more than 0";
    return NULL;
}

static uint32_t residual_cells_of(const struct voxmap_setting *s)
{
    return residual_cells(tiles_bytes(s->n_tiles, s->height, s->keep_echoes ? 2 : 1));
}

size_t voxmap_bytes(const struct voxmap_setting *s, struct fault *fault)
{
    const char *why = refused(s);
    if (why) {
        fault_set(fault, "%s", why);
        return 0;
    }
    return aligned(s->max_submaps * sizeof(struct voxmap_part)) +
           s->max_submaps * aligned(submap_bytes(s->side, s->height)) +
           aligned(residual_bytes(residual_cells_of(s))) +
           tiles_bytes(s->n_tiles, s->height, s->keep_echoes ? 2 : 1);
}

static uint16_t threshold_of(const struct voxmap_setting *s)
{
    return (uint16_t)(s->rule.threshold * s->weight_levels);
}

void voxmap_init(struct voxmap *m, const struct voxmap_setting *s, void *memory)
{
    uint8_t *at = memory;
    *m = (struct voxmap){.set = *s, .part = memory, .next_id = 1, .change = 1, .change_of_all = 1};
    m->rule.threshold = threshold_of(s);
    uint32_t weight = (uint32_t)s->rule.echo_weight * s->weight_levels;
    m->rule.echo_weight = (uint16_t)(weight < UINT16_MAX ? weight : UINT16_MAX);
    at += aligned(s->max_submaps * sizeof *m->part);
    for (uint32_t p = 0; p < s->max_submaps; p++) {
        m->part[p] = (struct voxmap_part){.map.tile = (uint32_t *)at};
        memset(at, 0, submap_bytes(s->side, s->height));
        at += aligned(submap_bytes(s->side, s->height));
    }
    residual_init(&m->residual, at, residual_cells_of(s));
    at += aligned(residual_bytes(m->residual.n));
    tiles_init(&m->tiles, at, s->n_tiles, s->height, s->keep_echoes ? 2 : 1);
}

/* ---- submaps ---- */

/* Anything may have changed, everywhere. */
static void change_all(struct voxmap *m)
{
    m->change_of_all = ++m->change;
}

/* No sum of vacancies is above the largest threshold. */
_Static_assert(VOXMAP_MAX_SUBMAPS *UINT8_MAX <= UINT16_MAX, "a map that is held has nothing free");

void voxmap_hold(struct voxmap *m, bool held, uint64_t t_ns)
{
    m->held = held;
    m->from_ns = t_ns + 1;
    m->body_ns = 0; /* the body was not on the path of a jump */
    m->rule.threshold = held ? UINT16_MAX : threshold_of(&m->set);
    change_all(m);
}

struct voxmap_part *voxmap_part(const struct voxmap *m, uint64_t id)
{
    for (uint32_t p = 0; p < m->set.max_submaps; p++)
        if (id && m->part[p].id == id)
            return &m->part[p];
    return NULL;
}

/* Of those that are closed. */
static struct voxmap_part *oldest(const struct voxmap *m)
{
    struct voxmap_part *found = NULL;
    for (uint32_t p = 0; p < m->set.max_submaps; p++) {
        struct voxmap_part *part = &m->part[p];
        if (part->id && part != m->current && (!found || part->id < found->id))
            found = part;
    }
    return found;
}

static void forget_part(struct voxmap *m, struct voxmap_part *part)
{
    submap_clear(&part->map);
    part->id = 0;
    change_all(m);
}

static void lose_part(struct voxmap *m, struct voxmap_part *part)
{
    m->change++;
    voxresidual_keep(m, part);
    forget_part(m, part);
    m->stats.lost++;
}

uint64_t voxmap_oldest(const struct voxmap *m)
{
    const struct voxmap_part *part = oldest(m);
    return part ? part->id : 0;
}

bool voxmap_drop(struct voxmap *m, uint64_t id)
{
    struct voxmap_part *part = voxmap_part(m, id);
    if (!part || part == m->current)
        return false;
    lose_part(m, part);
    return true;
}

void voxmap_join_residual(struct voxmap *m, const uint8_t *count, uint32_t n)
{
    residual_join(&m->residual, count, n);
    change_all(m);
}

void voxmap_clear(struct voxmap *m)
{
    for (uint32_t p = 0; p < m->set.max_submaps; p++)
        if (m->part[p].id)
            forget_part(m, &m->part[p]);
    residual_clear(&m->residual);
    m->current = NULL;
    m->close_asked = false;
    m->body_ns = 0;
}

void voxmap_new(struct voxmap *m)
{
    m->close_asked = true;
}

bool voxmap_low(const struct voxmap *m)
{
    return m->tiles.n_free < m->tiles.n / 4;
}

struct voxmap_part *voxmap_place_for_part(struct voxmap *m)
{
    for (;;) {
        for (uint32_t p = 0; p < m->set.max_submaps; p++)
            if (!m->part[p].id)
                return &m->part[p];
        lose_part(m, oldest(m));
    }
}

static void begin_submap(struct voxmap *m, const struct pose *pose, uint64_t t_ns,
                         const struct lattice_place *base)
{
    struct voxmap_part *part = voxmap_place_for_part(m);
    uint32_t *directory = part->map.tile;
    *part = (struct voxmap_part){
        .id = m->next_id++,
        .base = *base,
        .moved_to = *base,
        .turn = {1, 0, 0, 0},
        .begin_ns = t_ns,
        .begin_path_m = pose->path_m,
        .half_lives = m->half_lives,
    };
    submap_init(&part->map, directory, m->set.side, &m->tiles, base);
    m->current = part;
    m->close_asked = false;
}

bool voxmap_move(struct voxmap *m, uint64_t id, const double position_m[3], const double attitude[4])
{
    struct voxmap_part *part = voxmap_part(m, id);
    struct lattice_place to;
    double turn[4];
    memcpy(turn, attitude, sizeof turn);
    if (!part || !lattice_place(position_m, m->set.voxel_m, &to) || !quat_normalise(turn))
        return false;
    if (part == m->current)
        m->current = NULL;
    part->moved = true;
    part->moved_to = to;
    memcpy(part->turn, turn, sizeof turn);
    change_all(m);
    return true;
}

/* ---- time ---- */

/* Without echoes, what nothing is left of is given back. */
void voxmap_pass(struct voxmap *m, uint64_t t_ns)
{
    uint64_t half_lives = m->started && t_ns > m->t0_ns ? (t_ns - m->t0_ns) / m->set.half_life_ns : 0;
    if (half_lives <= m->half_lives)
        return;
    for (uint64_t n = m->half_lives; n < half_lives && n < m->half_lives + 8; n++)
        residual_halve(&m->residual);
    m->half_lives = half_lives;
    change_all(m);
    for (uint32_t p = 0; p < m->set.max_submaps; p++)
        if (m->part[p].id && &m->part[p] != m->current && !m->set.keep_echoes && voxmap_shift(m, &m->part[p]) == 8)
            forget_part(m, &m->part[p]);
}

/* The current submap, which is about to be written to, is halved where it lies. */
static void settle_age(struct voxmap *m)
{
    if (!m->current || m->current->half_lives == m->half_lives)
        return;
    for (unsigned n = voxmap_shift(m, m->current); n > 0; n--)
        submap_halve(&m->current->map);
    m->current->half_lives = m->half_lives;
}

static void make_room(struct voxmap *m)
{
    struct voxmap_part *old = oldest(m);
    if (m->tiles.n_free < m->tiles.n / 8 && m->current && !old)
        m->close_asked = true;
    if (m->tiles.n_free < m->tiles.n / 16 && old)
        lose_part(m, old);
}

/* The ping was this submap's last when its path or its time is used up. */
static bool is_full(const struct voxmap *m, const struct pose *pose, uint64_t t_ns)
{
    const struct voxmap_part *part = m->current;
    return pose->path_m - part->begin_path_m >= m->set.submap_path_m ||
           (m->set.submap_ns != VOXMAP_NEVER && t_ns > part->begin_ns &&
            t_ns - part->begin_ns >= m->set.submap_ns);
}

/* ---- beams ---- */

/* Half of a beam's width in azimuth: no wider than to the middle between neighbours, so that no voxel lies in two. */
static float cut_azimuth(const struct echoes *e, float half)
{
    for (int b = 1; b < e->n_beams; b++) {
        float apart = fabsf(e->beam[b].az_rad - e->beam[b - 1].az_rad);
        if (apart > 0 && apart / 2 < half)
            half = apart / 2;
    }
    return half;
}

static float cut_elevation(const struct echoes *e)
{
    float half = e->el_aperture_rad / 2;
    for (int b = 1; b < e->n_beams; b++) {
        float apart = fabsf(e->beam[b].el_rad - e->beam[b - 1].el_rad);
        if (apart > 0 && apart / 2 < half)
            half = apart / 2;
    }
    return half;
}

/* The edge's water is free so much farther aside than half power: to where the two-way pattern has lost 9 dB. What
 * stands there would be heard as far as surface_to_m: free_water_aside. Of a beam that reaches as far as across it
 * nobody knows what it hears beyond. */
#define EDGE_WIDER 1.22f

static struct voxmap_width width_of(const struct echoes *e, enum cast_shape shape)
{
    const float az_rad = e->az_aperture_rad / 2, wider_rad = EDGE_WIDER * az_rad;
    const bool is_wider = shape == CAST_WEDGE && wider_rad < (float)GEO_PI / 2;
    return (struct voxmap_width){.az_rad = cut_azimuth(e, az_rad),
                                 .el_rad = cut_elevation(e),
                                 .edge_az_rad = cut_azimuth(e, is_wider ? wider_rad : az_rad)};
}

/*
 * Openings of a part of the beam for the levels of weight: level 0 is all of it, level k that where the two-way
 * pattern exp(-2 ln 2 (u^2 + v^2)), with u and v in half apertures, is above k / levels. Each adds 1.
 */
static bool open_part(struct voxmap *m, enum cast_shape shape, double half_az_rad, double half_el_rad,
                      struct cast_opening opening[])
{
    struct fault fault;
    for (int level = 0; level < m->set.weight_levels; level++) {
        double narrow = level ? sqrt(log((double)m->set.weight_levels / level) / (2 * log(2))) : 1;
        narrow = narrow < 1 ? narrow : 1;
        if (!cast_opening_init(&opening[level], shape, narrow * half_az_rad, narrow * half_el_rad,
                               m->set.tolerance_m, &fault))
            return false;
    }
    return true;
}

static bool open_beam(struct voxmap *m, enum cast_shape shape, const struct voxmap_width *w)
{
    struct fault fault;
    const double voxel_m = m->set.voxel_m, az = (double)w->az_rad, el = (double)w->el_rad;
    const double side = m->set.opening, axis = side / 2;
    const bool cone = shape == CAST_CONE;
    if (w->az_rad > 0 && memcmp(&m->opening_width, w, sizeof *w) == 0 && m->opening_shape == shape)
        return true;
    m->opening_width = (struct voxmap_width){0};
    if (!open_part(m, shape, cone ? axis * az : az, axis * el, m->opening[VOXMAP_AXIS]) ||
        !open_part(m, shape, cone ? side * az : az, side * el, m->opening[VOXMAP_SIDE]) ||
        !open_part(m, shape, az, el, m->opening[VOXMAP_WHOLE]) ||
        !open_part(m, shape, (double)w->edge_az_rad, el, m->opening[VOXMAP_EDGE]))
        return false;
    const double wider = VOXRESIDUAL_HALF_DIAGONAL * voxel_m;
    if (!cast_opening_init(&m->heard, shape, az, el, wider, &fault) ||
        !cast_opening_init(&m->residual_cells, shape, az, el, (1 + RESIDUAL_CUBE) * wider + ASIDE_VOXELS * voxel_m,
                           &fault))
        return false;
    m->opening_width = *w;
    m->opening_shape = shape;
    return true;
}

/*
 * How far a beam may be off, pose uncertainty and blur together. What it sees wherever on the blur's line its apex is,
 * it sees from the line's foremost point: the sides from any other lie outside of those. From there water is nearer by
 * ahead_m on the axis, and by nearer_m at least.
 */
struct beam_off {
    double along_m, across_m, turned_rad;
    double axis[3], ahead_m, nearer_m;
};

static struct beam_off off_of(const struct voxmap *m, const struct pose *pose, const struct cast_look *look)
{
    const double widest_rad = hypot((double)m->opening_width.edge_az_rad, (double)m->opening_width.el_rad);
    const double any_m = pose->uncertain_m + pose->blur_any_m;
    struct beam_off off = {
        .along_m = any_m, .across_m = any_m, .turned_rad = pose->uncertain_rad + pose->blur_rad};
    if (!(geo_length(pose->blur_m) > 0))
        return off;
    geo_direction(look->az_rad, look->el_rad, off.axis);
    quat_rotate(look->attitude, off.axis, off.axis);
    const struct pose_blur on_axis = pose_blur_of(pose->blur_m, off.axis, 0);
    off.along_m += pose_blur_of(pose->blur_m, off.axis, widest_rad).along_m;
    off.across_m += on_axis.across_m;
    off.ahead_m = on_axis.along_m;
    off.nearer_m = on_axis.along_m * fmax(cos(widest_rad), 0);
    return off;
}

static void go_ahead(struct lattice_place *apex, const struct beam_off *off, double voxel_m)
{
    for (int a = 0; a < 3; a++) {
        const double offset = apex->offset[a] + off->ahead_m * off->axis[a] / voxel_m, cells = floor(offset);
        apex->cell[a] += (int64_t)cells;
        apex->offset[a] = offset - cells;
    }
}

/* An echo fills all that it may lie in: along the beam by the whole pose uncertainty, across it as far as a beam that
 * frees water may be off. */
static void enter_echo(struct voxmap *m, const struct echo *echo, const struct cast_look *look,
                       const struct beam_off *off)
{
    struct submap *map = &m->current->map;
    const double voxel_m = m->set.voxel_m, more_m = voxel_m / 2 + off->along_m;
    const double near_m = fmax((double)echo->near_m - more_m, 0);
    const double far_m = (double)echo->range_m + (double)echo->sd_m + more_m;
    const struct submap_stats before = map->stats;
    struct cast_look shell = *look;
    struct cast_beam beam;
    shell.near_m = near_m;
    shell.far_m = far_m;
    if (!cast_aim(&beam, &m->heard, &shell))
        return;
    beam.tolerance += fmin((off->across_m + off->turned_rad * far_m) / voxel_m, ASIDE_VOXELS);
    submap_cast(map, &beam, SUBMAP_ECHOES);
    const bool starved = map->stats.starved != before.starved;
    if (starved || map->stats.clipped != before.clipped)
        voxresidual_echo(m, &shell, starved);
}

/* From here on the pose uncertainty may put a beam farther than that beside its place. */
static double placed_to_m(const struct voxmap *m, const struct beam_off *off)
{
    const double left_m = ASIDE_VOXELS * m->set.voxel_m - off->across_m;
    return left_m < 0 ? 0 : off->turned_rad > 0 ? left_m / off->turned_rad : (double)INFINITY;
}

/* Not a number where either is none. */
static double lesser(double a, double b)
{
    return a <= b ? a : b <= a ? b : (double)NAN;
}

/* The water of one part of a beam from where the last stretch ended to to_m; false: there is none. */
static bool enter_stretch(struct voxmap *m, enum voxmap_part_of_beam part, struct cast_look *look, double to_m)
{
    struct cast_beam beam;
    look->far_m = to_m;
    if (!(to_m > look->near_m) || !cast_aim(&beam, &m->opening[part][0], look))
        return false;
    for (int level = 0; level < m->set.weight_levels; level++) {
        beam.opening = &m->opening[part][level];
        submap_cast(&m->current->map, &beam, SUBMAP_VACANCY);
    }
    look->near_m = to_m * (1 + 4 * DBL_EPSILON); /* so that no voxel lies in two stretches */
    return true;
}

/*
 * How far no surface can be grazed. Whatever stands at least b from the head, be it flat, is met at a range r at a
 * grazing angle whose sine is b / r or more. So nearer than b / sin(half the height) what the edge of the beam meets is
 * met more steeply than by half the height, and leans into the axis: it cannot lie along the beam, where its echo would
 * be faint. b is what the promised body leaves around the head.
 */
static double ungrazed_m(const struct voxmap *m, const struct voxmap_sensor *sensor)
{
    const double b_m = m->set.body_radius_m - geo_length(sensor->mount.position_m);
    return b_m > 0 ? b_m / sin((double)m->opening_width.el_rad) : 0;
}

/* A range of the beam that is free in a part of it; empty where to_m is not greater. */
struct stretch {
    double from_m, to_m;
};

/* One that begins where it does, whatever the side has shown before. Not a number where either end is none. */
static bool enter_wide(struct voxmap *m, enum voxmap_part_of_beam part, struct cast_look *look, struct stretch s,
                       double side_m)
{
    if (!(s.to_m > s.from_m))
        return false;
    const bool before = enter_stretch(m, VOXMAP_SIDE, look, lesser(s.from_m, side_m));
    look->near_m = fmax(look->near_m, s.from_m);
    return enter_stretch(m, part, look, s.to_m) || before;
}

/* Every range in the widest part of the beam that is free there; near_m: as far the whole beam counts. */
static void enter_water(struct voxmap *m, const struct beam_echoes *heard, const struct beam_off *off,
                        struct cast_look *look, double near_m)
{
    const double off_m = off->along_m - off->nearer_m, uncertain_m = off->along_m + off->ahead_m;
    const double axis_m = lesser(placed_to_m(m, off) - off->ahead_m, (double)heard->free_to_m - uncertain_m);
    bool any = false;
    look->near_m = (double)heard->blind_m + off_m;
    if (heard->off_axis) {
        const double side_m = lesser(axis_m, (double)heard->side_to_m - uncertain_m);
        const struct stretch edge = {(double)heard->surface_from_m + off_m,
                                     lesser(axis_m, (double)heard->surface_to_m - uncertain_m)};
        const struct stretch whole = {(double)heard->edge_from_m + off_m,
                                      lesser(lesser(axis_m, near_m), (double)heard->edge_to_m - uncertain_m)};
        struct stretch first = whole;
        if (edge.to_m > edge.from_m) /* which is wider */
            first.to_m = lesser(whole.to_m, edge.from_m);
        any |= enter_wide(m, VOXMAP_WHOLE, look, first, side_m);
        any |= enter_wide(m, VOXMAP_EDGE, look, edge, side_m);
        any |= enter_wide(m, VOXMAP_WHOLE, look, whole, side_m);
        any |= enter_stretch(m, VOXMAP_SIDE, look, side_m);
        any |= enter_stretch(m, VOXMAP_AXIS, look, axis_m);
    } else
        any = enter_stretch(m, VOXMAP_SIDE, look, axis_m);
    m->stats.beams += any;
}

static void enter_beam(struct voxmap *m, const struct beam_echoes *heard, const struct pose *pose,
                       const struct cast_look *from, double near_m)
{
    struct cast_look look = *from, water;
    if (heard->state == BEAM_BLIND)
        return;
    look.az_rad = (double)heard->az_rad;
    look.el_rad = (double)heard->el_rad;
    const struct beam_off off = off_of(m, pose, &look);
    struct lattice_place foremost = *look.apex;
    go_ahead(&foremost, &off, m->set.voxel_m);
    water = look;
    water.apex = &foremost;
    enter_water(m, heard, &off, &water, near_m);
    for (int n = 0; m->set.keep_echoes && n < heard->n; n++)
        if (!(heard->echo[n].flags & ECHO_OWN))
            enter_echo(m, &heard->echo[n], &look, &off);
}

/* Where it went, as far as that is known to a voxel. */
static void enter_body(struct voxmap *m, const struct pose *pose, const struct lattice_place *at, uint64_t t_ns)
{
    double radius = m->set.body_radius_m / m->set.voxel_m, apart2 = 0;
    const struct lattice_place *from = &m->body;
    if (pose->uncertain_m + pose->blur_any_m + geo_length(pose->blur_m) > m->set.voxel_m) {
        m->body_ns = 0;
        return;
    }
    for (int a = 0; a < 3; a++) {
        double d = (double)(at->cell[a] - from->cell[a]) + at->offset[a] - from->offset[a];
        apart2 += d * d;
    }
    if (m->body_ns == 0 || t_ns - m->body_ns > BODY_GAP_NS || apart2 > 4 * radius * radius)
        from = at;
    submap_body(&m->current->map, from, at, radius, (uint8_t)(m->rule.threshold + 1));
    m->body = *at;
    m->body_ns = t_ns;
}

/* Where the body and the sensor are; false when that is not known well enough. */
static bool locate(const struct voxmap *m, const struct pose *pose, const struct mount *mount,
                   struct lattice_place *body, struct lattice_place *apex, double attitude[4])
{
    const unsigned need = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    double turn[4], arm[3], apex_m[3];
    memcpy(turn, pose->attitude, sizeof turn);
    if ((pose->has & need) != need || !quat_normalise(turn))
        return false;
    quat_multiply(turn, mount->attitude, attitude);
    quat_rotate(turn, mount->position_m, arm);
    for (int a = 0; a < 3; a++)
        apex_m[a] = pose->position_m[a] + arm[a];
    return lattice_place(pose->position_m, m->set.voxel_m, body) && lattice_place(apex_m, m->set.voxel_m, apex);
}

bool voxmap_enter(struct voxmap *m, const struct echoes *e, const struct voxmap_sensor *sensor)
{
    struct lattice_place body, apex;
    double attitude[4];
    if (m->started && e->t_ns > m->last_ns)
        m->last_ns = e->t_ns;
    voxmap_pass(m, m->last_ns);
    settle_age(m);
    if (m->held || e->t_ns < m->from_ns || !locate(m, &e->pose, &sensor->mount, &body, &apex, attitude)) {
        m->stats.no_pose++;
        return false;
    }
    const struct voxmap_width width = width_of(e, sensor->shape);
    if (!open_beam(m, sensor->shape, &width)) {
        m->stats.unfit++;
        return false;
    }
    if (!m->started)
        m->t0_ns = m->last_ns = e->t_ns;
    m->started = true;
    make_room(m);
    if (!m->current || m->close_asked)
        begin_submap(m, &e->pose, m->last_ns, &body);

    struct voxmap_part *part = m->current;
    part->map.now = ++m->change;
    const struct cast_look look = {.apex = &apex, .attitude = attitude, .voxel_m = m->set.voxel_m};
    for (int b = 0; b < e->n_beams; b++)
        enter_beam(m, &e->beam[b], &e->pose, &look, ungrazed_m(m, sensor));
    if (m->set.body_radius_m > 0)
        enter_body(m, &e->pose, &body, m->last_ns);
    part->last_ns = m->last_ns;
    part->pings++;
    m->stats.pings++;
    m->stats.clipped += part->map.stats.clipped;
    m->stats.starved += part->map.stats.starved;
    part->map.stats = (struct submap_stats){0};
    if (is_full(m, &e->pose, m->last_ns))
        m->close_asked = true;
    return true;
}
