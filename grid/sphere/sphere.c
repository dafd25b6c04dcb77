/* SPDX-License-Identifier: MIT */
#include "sphere.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "beam.h"

/*
 * Probability of an echo from an occupied and from an empty cell. That an occupied cell is heard only every other time
 * is said on purpose: a weak reflector that one of the beams over it hears must not be talked away by its neighbours
 * in the same sweep. The clamp bounds how long the past can outvote the present: a few turns.
 */
#define ECHO_IF_OCCUPIED 0.5
#define ECHO_IF_EMPTY    0.1
#define LOGODDS_MAX      6.0
/* A marked echo weighs so many times what blocking takes, but no more than another one: by itself it blocks for a
 * third of the time in which echoes fade, and with the default one look that hears nothing there takes it away. */
#define MARKED_BLOCKS 1.4
#define NO_CELL          UINT32_MAX
#define EVICT_LOOK       64 /* cells looked at for the oldest when the pool is full: bounds the work */
#define MIN_CARVE_SHARE  0.05

struct cell {
    float point_m[3]; /* of the echo, from the anchor, in the grid's axes */
    float near_m;     /* how far the reflector's near edge lies before its point */
    float sd_m;
    float logodds;     /* at t_ref_ns */
    uint64_t t_ref_ns; /* last hit or miss */
    uint64_t t_first_ns, t_echo_ns;
    uint32_t next;      /* in the same direction, farther; in the free list: the next free */
    uint32_t direction; /* RINGS_NONE: free */
    float range_m;      /* of the point, from the grid's centre */
    uint16_t layer;
    uint16_t echoes; /* saturates */
};

struct direction {
    struct claim claim[CLAIMS];
    uint32_t first;  /* nearest cell, or NO_CELL */
    uint32_t dirty;  /* on the list of directions to publish */
    float width_rad; /* in azimuth */
};

struct sphere {
    struct sphere_conf conf;
    struct rings rings;
    struct layers layers;
    struct picture picture;
    struct picture_frame frame;
    double anchor_m[3];
    bool placed; /* a position was given: centre and anchor hold */
    struct cell *cell;
    uint32_t free_cells, used, hand;
    struct direction *direction;
    double (*axis)[3];    /* unit vector of each direction's centre */
    struct claim *joined; /* of all directions, while the centre moves */
    uint32_t *dirty;
    uint32_t n_dirty;
    double blocked_logodds; /* conf.blocked_above as log-odds */
    struct sphere_stats stats;
};

static size_t rounded(size_t n)
{
    return (n + 63) / 64 * 64;
}

static bool make_rings(const struct sphere_conf *c, struct rings *rings)
{
    return c->level ? rings_level(rings, c->angular_step_rad, c->level_half_rad)
                    : rings_full(rings, c->angular_step_rad);
}

size_t sphere_bytes(const struct sphere_conf *conf, char *err, size_t err_size)
{
    struct rings rings;
    uint32_t layers = layers_count(&conf->layers);
    if (!make_rings(conf, &rings))
        snprintf(err, err_size, "angular step of %g deg: wanted 0.25 to 90 deg", geo_deg(conf->angular_step_rad));
    else if (!layers || layers > UINT16_MAX)
        snprintf(err, err_size, "layers from %g to %g m, %g m thick, growth %g: wanted at most %d of them",
                 conf->layers.r_min_m, conf->layers.r_max_m, conf->layers.dr_m, conf->layers.growth, UINT16_MAX);
    else if (conf->max_cells < 64 || conf->max_cells > 1u << 24)
        snprintf(err, err_size, "%u cells: wanted 64 to 16777216", conf->max_cells);
    else if (!(conf->forget_s > 0 && conf->blocked_above > 0.5 && conf->blocked_above < 1 && conf->recentre_m > 0))
        snprintf(err, err_size, "fading, threshold or recentring out of range");
    else
        return rounded(sizeof(struct sphere)) + rounded((layers + 1) * sizeof(double)) +
               rounded(conf->max_cells * sizeof(struct cell)) + rounded(rings.n * sizeof(struct direction)) +
               rounded(rings.n * sizeof(uint32_t)) + rounded(rings.n * sizeof(double[3])) +
               rounded(rings.n * sizeof(struct claim)) + rounded(picture_bytes(rings.n));
    return 0;
}

static void *carve(char **at, size_t n)
{
    void *p = *at;
    *at += rounded(n);
    return p;
}

static void forget_everything(struct sphere *s)
{
    for (uint32_t i = 0; i < s->conf.max_cells; i++) {
        s->cell[i].next = i + 1 < s->conf.max_cells ? i + 1 : NO_CELL;
        s->cell[i].direction = RINGS_NONE;
    }
    s->free_cells = 0;
    s->used = s->hand = 0;
    s->n_dirty = s->rings.n;
    for (uint32_t d = 0; d < s->rings.n; d++) {
        struct direction *dir = &s->direction[d];
        memset(dir->claim, 0, sizeof dir->claim);
        dir->first = NO_CELL;
        dir->dirty = 1;
        s->dirty[d] = d;
    }
    s->stats.pinged = 0;
    s->placed = false;
}

struct sphere *sphere_init(void *memory, const struct sphere_conf *conf)
{
    char *at = memory;
    struct sphere *s = carve(&at, sizeof *s);
    memset(s, 0, sizeof *s);
    s->conf = *conf;
    make_rings(conf, &s->rings);
    s->frame.recentre_m = conf->recentre_m;
    layers_init(&s->layers, &conf->layers, carve(&at, (layers_count(&conf->layers) + 1) * sizeof(double)));
    s->cell = carve(&at, conf->max_cells * sizeof(struct cell));
    s->direction = carve(&at, s->rings.n * sizeof(struct direction));
    s->dirty = carve(&at, s->rings.n * sizeof(uint32_t));
    s->axis = carve(&at, s->rings.n * sizeof(double[3]));
    s->joined = carve(&at, s->rings.n * sizeof(struct claim));
    memset(s->cell, 0, conf->max_cells * sizeof(struct cell));
    for (uint32_t d = 0; d < s->rings.n; d++) {
        double az, el;
        rings_centre(&s->rings, d, &az, &el);
        geo_direction(az, el, s->axis[d]);
        s->direction[d].width_rad = (float)rings_width(&s->rings, rings_ring(&s->rings, d));
    }
    s->blocked_logodds = log(conf->blocked_above / (1 - conf->blocked_above));
    picture_init(&s->picture, &s->rings, (const double(*)[3])s->axis, conf->forget_s, s->blocked_logodds, carve(&at, picture_bytes(s->rings.n)));
    forget_everything(s);
    s->n_dirty = 0; /* the picture starts out the same */
    for (uint32_t d = 0; d < s->rings.n; d++)
        s->direction[d].dirty = 0;
    return s;
}

struct picture *sphere_picture(struct sphere *s)
{
    return &s->picture;
}

void sphere_stats(const struct sphere *s, struct sphere_stats *out)
{
    *out = s->stats;
    out->cells = s->used;
    out->directions = s->rings.n;
}

static void mark(struct sphere *s, uint32_t d)
{
    if (!s->direction[d].dirty) {
        s->direction[d].dirty = 1;
        s->dirty[s->n_dirty++] = d;
    }
}

/* ---- cells ---- */

static double faded(const struct sphere *s, const struct cell *c, uint64_t t_ns)
{
    double dt_s = t_ns > c->t_ref_ns ? (double)(t_ns - c->t_ref_ns) * 1e-9 : 0;
    return c->logodds * exp(-dt_s / s->conf.forget_s);
}

static void weigh(const struct sphere *s, struct cell *c, uint64_t t_ns, double change)
{
    double l = faded(s, c, t_ns) + change;
    c->logodds = (float)(l > LOGODDS_MAX ? LOGODDS_MAX : l < -LOGODDS_MAX ? -LOGODDS_MAX : l);
    if (t_ns > c->t_ref_ns)
        c->t_ref_ns = t_ns;
}

static void unlink_cell(struct sphere *s, uint32_t index)
{
    uint32_t *at = &s->direction[s->cell[index].direction].first;
    while (*at != index)
        at = &s->cell[*at].next;
    *at = s->cell[index].next;
}

static void release_cell(struct sphere *s, uint32_t index)
{
    mark(s, s->cell[index].direction);
    unlink_cell(s, index);
    s->cell[index].direction = RINGS_NONE;
    s->cell[index].next = s->free_cells;
    s->free_cells = index;
    s->used--;
}

/* No room: the oldest of the next few cells makes place. What it said is lost, so its direction claims nothing. */
static void evict(struct sphere *s)
{
    uint32_t oldest = s->hand;
    for (uint32_t i = 0; i < EVICT_LOOK; i++) {
        uint32_t at = (s->hand + i) % s->conf.max_cells;
        if (s->cell[at].t_ref_ns < s->cell[oldest].t_ref_ns)
            oldest = at;
    }
    s->hand = (s->hand + EVICT_LOOK) % s->conf.max_cells;
    memset(s->direction[s->cell[oldest].direction].claim, 0, sizeof s->direction->claim);
    release_cell(s, oldest);
    s->stats.cells_lost++;
}

/* The cell of (direction, layer), made when it does not exist; the cells of a direction stay in order of range. */
static struct cell *cell_at(struct sphere *s, uint32_t direction, uint16_t layer)
{
    if (s->free_cells == NO_CELL) {
        for (uint32_t i = s->direction[direction].first; i != NO_CELL; i = s->cell[i].next)
            if (s->cell[i].layer == layer)
                return &s->cell[i];
        evict(s);
    }
    uint32_t *at = &s->direction[direction].first;
    while (*at != NO_CELL && s->cell[*at].layer < layer)
        at = &s->cell[*at].next;
    if (*at != NO_CELL && s->cell[*at].layer == layer)
        return &s->cell[*at];
    uint32_t index = s->free_cells;
    struct cell *c = &s->cell[index];
    s->free_cells = c->next;
    *c = (struct cell){.next = *at, .direction = direction, .layer = layer};
    *at = index;
    s->used++;
    return c;
}

/* A second echo in a cell moves its point by the inverse of the count, to 1/8 at least, so that it can follow. */
static void hit(struct sphere *s, uint32_t direction, double range_m, const struct beam *b,
                const struct echo *echo)
{
    int32_t layer = layers_index(&s->layers, range_m);
    if (layer < 0) {
        s->stats.out_of_range++;
        return;
    }
    struct cell *c = cell_at(s, direction, (uint16_t)layer);
    const double *axis = s->axis[direction];
    double gain = c->echoes ? 1.0 / (c->echoes < 8 ? c->echoes + 1 : 8) : 1;
    for (int i = 0; i < 3; i++) {
        double measured = range_m * axis[i] + s->frame.centre_m[i] - s->anchor_m[i];
        c->point_m[i] += (float)(gain * (measured - c->point_m[i]));
    }
    c->range_m += (float)(gain * (range_m - c->range_m));
    c->near_m = echo->range_m - echo->near_m;
    c->sd_m = echo->sd_m;
    if (!c->echoes)
        c->t_first_ns = b->ping->t_ns;
    if (b->ping->t_ns > c->t_echo_ns)
        c->t_echo_ns = b->ping->t_ns;
    if (c->echoes < UINT16_MAX)
        c->echoes++;
    double strength = echo->confidence > 0 ? echo->confidence : 0;
    double weight = log1p(strength * (ECHO_IF_OCCUPIED / ECHO_IF_EMPTY - 1));
    weigh(s, c, b->ping->t_ns, echo->flags ? fmin(weight, MARKED_BLOCKS * s->blocked_logodds) : weight);
    mark(s, direction);
}

/* ---- beams ---- */

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static bool stretch_of(const struct sphere *s, uint32_t d, const struct beam *b, double near_m, double far_m,
                       struct stretch *out)
{
    const double *u = s->axis[d];
    return beam_stretch(b, u, s->direction[d].width_rad * hypot(u[0], u[1]), s->rings.height_rad, s->conf.level,
                        near_m, far_m, out);
}

/* What the beam heard of the water in direction d; a beam that says nothing takes back what older ones said. */
static void clear_direction(struct sphere *s, uint32_t d, const struct beam *b)
{
    struct direction *dir = &s->direction[d];
    const struct echoes *e = b->ping;
    const struct beam_echoes *h = b->heard;
    struct stretch st;
    bool claims = h->free_to_m > h->blind_m, first = !dir->claim[CLAIM_NOW].t_ping_ns;
    if (claims && stretch_of(s, d, b, h->blind_m, h->free_to_m, &st))
        claim_add(dir->claim, &st, e->t_ns, e->pose.path_m, e->sensor);
    else if (!claims && stretch_of(s, d, b, 0, e->range_max_m, &st))
        claim_withdraw(dir->claim, e->t_ns, e->pose.path_m, e->sensor);
    else
        return;
    s->stats.pinged += first;
    mark(s, d);
}

static void hit_direction(struct sphere *s, uint32_t d, const struct beam *b, const struct echo *echo)
{
    const struct direction *dir = &s->direction[d];
    double place[3], range, off_az, off_el, at = beam_meet(b, s->axis[d], echo->range_m);
    if (at <= 0)
        return;
    for (int i = 0; i < 3; i++)
        place[i] = at * s->axis[d][i];
    beam_sees(b, place, &range, &off_az, &off_el);
    double height = s->rings.height_rad;
    if (fabs(off_az) <= b->half_az + dir->width_rad / 2 && fabs(off_el) <= b->half_el + height / 2)
        hit(s, d, at, b, echo);
}

/* Nothing was heard in the water up to free_to_m: cells there lose by the share of them that the beam covered. */
static void carve_direction(struct sphere *s, uint32_t d, const struct beam *b)
{
    for (uint32_t i = s->direction[d].first, next; i != NO_CELL; i = next) {
        struct cell *c = &s->cell[i];
        next = c->next;
        double place[3], range, off_az, off_el;
        for (int k = 0; k < 3; k++)
            place[k] = c->point_m[k] + s->anchor_m[k] - s->frame.centre_m[k];
        beam_sees(b, place, &range, &off_az, &off_el);
        double thick = s->layers.edge[c->layer + 1] - s->layers.edge[c->layer];
        if (range - 2.0 * c->sd_m < b->heard->blind_m || range + 2.0 * c->sd_m + thick / 2 > b->heard->free_to_m)
            continue;
        double share = beam_share(off_az, b->half_az, s->direction[d].width_rad) *
                       beam_share(off_el, b->half_el, s->rings.height_rad);
        if (share < MIN_CARVE_SHARE)
            continue;
        weigh(s, c, b->ping->t_ns, log((1 - ECHO_IF_OCCUPIED * share) / (1 - ECHO_IF_EMPTY * share)));
        mark(s, d);
        if (c->logodds <= 0)
            release_cell(s, i);
    }
}

#define NEAREST_M 0.1 /* nothing is heard nearer: bounds the parallax */

static void enter_beam(struct sphere *s, const struct beam *b)
{
    const struct beam_echoes *h = b->heard;
    double az, el, cell = s->rings.height_rad + s->rings.step_rad;
    geo_angles(b->axis, &az, &el);
    bool claims = h->free_to_m > h->blind_m;
    struct beam_sieve near = beam_sieve(b, fmax(h->blind_m, NEAREST_M), cell);
    struct beam_sieve clear = b->lever_m > 0 ? near : beam_sieve(b, 1, cell); /* no lever, no parallax */
    struct beam_sieve hit = beam_sieve(b, h->n ? h->echo[0].range_m : 1, cell);

    struct rings_visit v = rings_visit(&s->rings, az, el, fmin(acos(near.cos_axis), GEO_PI / 2));
    while (rings_next(&v)) {
        double along = dot(s->axis[v.direction], b->axis), aside = dot(s->axis[v.direction], b->side);
        if (claims && s->direction[v.direction].first != NO_CELL && beam_sieve_passes(&near, along, aside))
            carve_direction(s, v.direction, b);
        if (beam_sieve_passes(&clear, along, aside))
            clear_direction(s, v.direction, b);
        if (h->n && beam_sieve_passes(&hit, along, aside))
            for (uint8_t i = 0; i < h->n; i++)
                hit_direction(s, v.direction, b, &h->echo[i]);
    }
}

/* ---- the vehicle moves ---- */

static void place_cell(struct sphere *s, uint32_t index)
{
    struct cell old = s->cell[index];
    double v[3], az, el;
    for (int i = 0; i < 3; i++)
        v[i] = old.point_m[i] + s->anchor_m[i] - s->frame.centre_m[i];
    double range = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    int32_t layer = layers_index(&s->layers, range);
    geo_angles(v, &az, &el);
    uint32_t d = rings_index(&s->rings, az, el);
    if (layer < 0 || d == RINGS_NONE) {
        release_cell(s, index);
        return;
    }
    s->cell[index].range_m = (float)range;
    if (d == old.direction && layer == old.layer)
        return;
    release_cell(s, index);
    struct cell *c = cell_at(s, d, (uint16_t)layer);
    if (c->echoes) { /* two fall together: the stronger and the nearer wins, counts add up */
        c->logodds = fmaxf(c->logodds, old.logodds);
        c->t_ref_ns = c->t_ref_ns > old.t_ref_ns ? c->t_ref_ns : old.t_ref_ns;
        c->t_echo_ns = c->t_echo_ns > old.t_echo_ns ? c->t_echo_ns : old.t_echo_ns;
        c->t_first_ns = c->t_first_ns < old.t_first_ns ? c->t_first_ns : old.t_first_ns;
        c->echoes = (uint16_t)fmin(UINT16_MAX, c->echoes + old.echoes);
        if (range < c->range_m) {
            memcpy(c->point_m, old.point_m, sizeof c->point_m);
            c->range_m = (float)range;
            c->near_m = old.near_m;
        }
        c->sd_m = fmaxf(c->sd_m, old.sd_m);
    } else {
        uint32_t next = c->next;
        *c = old;
        c->next = next;
        c->direction = d;
        c->layer = (uint16_t)layer;
        c->range_m = (float)range;
    }
    mark(s, d);
}

/* Farther in one step than this the old claims say nothing of the new place. */
#define CLAIM_STEP_MOST_M 1.0

static void move_claims(struct sphere *s, const double step_m[3])
{
    for (uint32_t d = 0; d < s->rings.n; d++)
        s->joined[d] = claim_join(&s->direction[d].claim[CLAIM_NOW], &s->direction[d].claim[CLAIM_BEFORE]);
    bool far = dot(step_m, step_m) > CLAIM_STEP_MOST_M * CLAIM_STEP_MOST_M;
    for (uint32_t d = 0; d < s->rings.n; d++) {
        struct direction *dir = &s->direction[d];
        if (!dir->claim[CLAIM_NOW].t_ping_ns && dir->first == NO_CELL)
            continue;
        dir->claim[CLAIM_NOW] =
            far ? (struct claim){0} : claim_moved(&s->rings, (const double(*)[3])s->axis, s->joined, d, step_m);
        dir->claim[CLAIM_BEFORE] = (struct claim){0};
        mark(s, d);
    }
}

static void recentre(struct sphere *s, const double position_m[3])
{
    double step_m[3];
    for (int i = 0; i < 3; i++) {
        step_m[i] = position_m[i] - s->frame.centre_m[i];
        s->frame.centre_m[i] = position_m[i];
    }
    for (uint32_t i = 0; i < s->conf.max_cells; i++)
        if (s->cell[i].direction != RINGS_NONE)
            place_cell(s, i);
    move_claims(s, step_m);
    s->stats.recentred++;
}

/* Far from the anchor a float point loses its digits: points are moved to a new anchor in double. */
#define ANCHOR_REACH_M 100.0

static void reanchor(struct sphere *s)
{
    double shift[3];
    for (int i = 0; i < 3; i++) {
        shift[i] = s->frame.centre_m[i] - s->anchor_m[i];
        s->anchor_m[i] = s->frame.centre_m[i];
    }
    for (uint32_t i = 0; i < s->conf.max_cells; i++)
        if (s->cell[i].direction != RINGS_NONE)
            for (int k = 0; k < 3; k++)
                s->cell[i].point_m[k] = (float)(s->cell[i].point_m[k] - shift[k]);
}

static double distance(const double a[3], const double b[3])
{
    return sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
}

static void follow(struct sphere *s, const struct pose *pose)
{
    if (!s->placed) {
        memcpy(s->frame.centre_m, pose->position_m, sizeof s->frame.centre_m);
        memcpy(s->anchor_m, pose->position_m, sizeof s->anchor_m);
        s->placed = true;
        return;
    }
    if (distance(pose->position_m, s->frame.centre_m) > s->conf.recentre_m)
        recentre(s, pose->position_m);
    if (distance(s->frame.centre_m, s->anchor_m) > ANCHOR_REACH_M)
        reanchor(s);
}

/* False when the ping cannot be placed. */
static bool set_axes(struct sphere *s, const struct pose *pose)
{
    if (pose->has & POSE_ATTITUDE) {
        if (!s->frame.ned) {
            forget_everything(s);
            s->frame.ned = 1;
        }
        follow(s, pose);
        return true;
    }
    if (s->frame.ned)
        s->stats.no_attitude++;
    return !s->frame.ned;
}

/* ---- publishing ---- */

static void publish_direction(struct sphere *s, uint32_t d, uint64_t t_ns)
{
    const struct direction *dir = &s->direction[d];
    struct picture_entry e = {.claim = {dir->claim[CLAIM_NOW], dir->claim[CLAIM_BEFORE]}};
    unsigned n = 0;
    for (uint32_t i = dir->first; i != NO_CELL && n < PICTURE_OBSTACLES; i = s->cell[i].next) {
        const struct cell *c = &s->cell[i];
        float near_m = fmaxf(0, c->range_m - c->near_m);
        if (faded(s, c, t_ns) <= s->picture.blocked_logodds) {
            for (int k = 0; k < CLAIMS; k++) /* too little to block, too much to call it clear */
                e.claim[k].to_m = fminf(e.claim[k].to_m, near_m);
            continue;
        }
        e.obstacle[n++] = (struct picture_obstacle){.t_ref_ns = c->t_ref_ns,
                                                    .t_echo_ns = c->t_echo_ns,
                                                    .logodds = c->logodds,
                                                    .near_m = near_m,
                                                    .range_m = c->range_m,
                                                    .sd_m = c->sd_m};
    }
    picture_set(&s->picture, d, &e);
}

static void publish(struct sphere *s, const struct echoes *e)
{
    s->frame.range_max_m = fmax(s->frame.range_max_m, e->range_max_m);
    s->frame.pings++;
    s->frame.t_ping_ns = e->t_ns;
    picture_begin(&s->picture);
    for (uint32_t i = 0; i < s->n_dirty; i++) {
        publish_direction(s, s->dirty[i], e->t_ns);
        s->direction[s->dirty[i]].dirty = 0;
    }
    s->n_dirty = 0;
    picture_set_frame(&s->picture, &s->frame);
    picture_end(&s->picture);
}

void sphere_enter(struct sphere *s, const struct echoes *e, const struct mount *mount)
{
    if (!set_axes(s, &e->pose))
        return;
    double turn[4], origin_m[3];
    memcpy(turn, mount->attitude, sizeof turn);
    memcpy(origin_m, mount->position_m, sizeof origin_m);
    if (s->frame.ned) {
        quat_multiply(e->pose.attitude, mount->attitude, turn);
        quat_rotate(e->pose.attitude, mount->position_m, origin_m);
        for (int i = 0; i < 3; i++)
            origin_m[i] += e->pose.position_m[i] - s->frame.centre_m[i];
    }
    for (uint16_t i = 0; i < e->n_beams; i++) {
        struct beam b;
        beam_of(&b, e, i, turn, origin_m);
        enter_beam(s, &b);
    }
    publish(s, e);
}
