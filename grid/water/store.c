/* SPDX-License-Identifier: MIT */
#include "store.h"

#include <math.h>
#include <string.h>

#include "thin.h"

_Static_assert(POOL_RECORDS <= ASK_RECORDS, "a question takes all records");

static struct pool_conf pool_of_conf(const struct store_conf *conf)
{
    struct pool_conf pool = {.spare = conf->spare};
    for (int i = 0; i < STORE_SENSORS; i++)
        pool.columns[i] = row_columns(conf->beams[i] == 1 ? SWEEP_BEAMS : conf->beams[i]);
    return pool;
}

static size_t pool_at_byte(void)
{
    return (sizeof(struct store) + 7) / 8 * 8;
}

size_t store_bytes(const struct store_conf *conf)
{
    const struct pool_conf pool = pool_of_conf(conf);
    return pool_at_byte() + pool_bytes(&pool);
}

struct store *store_init(void *memory, const struct store_conf *conf)
{
    struct store *s = memory;
    const struct pool_conf pool = pool_of_conf(conf);
    memset(s, 0, sizeof *s);
    pool_init(&s->pool, (char *)memory + pool_at_byte(), &pool);
    return s;
}

void store_number(struct store *s, uint64_t number, uint64_t read_from)
{
    s->pool.number = number;
    s->pool.read_from = read_from;
}

/* ---- where water lies ---- */

static void forget_all(struct store *s)
{
    pool_clear(&s->pool);
    memset(s->sensor, 0, sizeof s->sensor);
}

static double way_m(const double from_m[3], const struct pose *pose)
{
    const double way[3] = {pose->position_m[0] - from_m[0], pose->position_m[1] - from_m[1],
                           pose->position_m[2] - from_m[2]};
    return geo_length(way);
}

/* Poses that were withdrawn, or whose attitude has jumped: nobody knows how the axes of earlier ones lay. */
static void heed_breaks(struct store *s, const struct pose *pose)
{
    const bool ned = (pose->has & POSE_ATTITUDE) != 0, withdrawn = pose->withdrawn != s->withdrawn;
    if ((s->ned && withdrawn) || (ned && !s->ned) || (ned && pose->discontinuities != s->discontinuities)) {
        forget_all(s);
        s->placed = false;
    }
    s->ned = ned || (s->ned && !withdrawn);
    s->withdrawn = pose->withdrawn;
    if (ned)
        s->discontinuities = pose->discontinuities;
}

/* A ping that was dated back says nothing of where the vehicle is. */
static void heed_jumps(struct store *s, const struct pose *pose, uint64_t t_ns)
{
    const unsigned has = pose->has & (POSE_POSITION | POSE_DEPTH);
    if (s->placed && t_ns < s->t_at_ns)
        return;
    if (s->placed && (has != s->has || way_m(s->at_m, pose) > POSE_STEP_MOST_M))
        forget_all(s);
    s->placed = true;
    s->has = has;
    s->t_at_ns = t_ns;
    memcpy(s->at_m, pose->position_m, sizeof s->at_m);
}

/* False when the ping cannot be placed. */
static bool place_ping(struct store *s, const struct echoes *e)
{
    heed_breaks(s, &e->pose);
    if (s->ned && !(e->pose.has & POSE_ATTITUDE))
        return false;
    heed_jumps(s, &e->pose, e->t_ns);
    if (!s->ned && e->pose.heading_adrift)
        forget_all(s);
    return s->ned || !e->pose.heading_adrift;
}

void store_follow(struct store *s, const struct pose *pose)
{
    if (s->placed && s->ned && pose->has & POSE_ATTITUDE && pose->t_ns >= s->t_at_ns &&
        pose->discontinuities == s->discontinuities && pose->withdrawn == s->withdrawn &&
        (pose->has & (POSE_POSITION | POSE_DEPTH)) == s->has && way_m(s->at_m, pose) <= POSE_STEP_MOST_M) {
        memcpy(s->at_m, pose->position_m, sizeof s->at_m);
        s->t_at_ns = pose->t_ns;
    }
}

/* ---- pings ---- */

/* The record that holds all pings from this place but for a new one; NULL: none does. From time to time another one is
 * begun, for it is as old as its oldest ping. */
static const struct water_record *base_of(const struct water_record *before, const struct water_record *middle,
                                          const struct water_record *record)
{
    if (!thin_is_still(middle, record))
        return NULL;
    const bool holds = before && before->newest_ns == middle->newest_ns;
    return holds && record->newest_ns - before->t_ns <= THIN_JOINED_NS && thin_is_still(before, record) ? before
                                                                                                        : middle;
}

/* The newest record of the sensor goes if the one before it and the next one spare it. */
static void spare(struct store *s, const struct water_record *next)
{
    const struct water_record *middle = pool_of(&s->pool, next->sensor, 0),
                              *before = pool_of(&s->pool, next->sensor, 1);
    if (before && before->newest_ns <= middle->newest_ns && thin_spares(before, middle, next))
        pool_drop(&s->pool, next->sensor, middle->seq);
}

/* The record before goes if it is spared, or joins those from the same place, as the newest does. What is joined no
 * more may be spared in turn: a vehicle that creeps, or turns slowly, has left that place after a few pings. */
static void keep_thinned(struct store *s, const struct water_record *record)
{
    const struct water_record *middle = pool_of(&s->pool, record->sensor, 0),
                              *before = pool_of(&s->pool, record->sensor, 1);
    struct water_record joined;
    const bool follows = middle && middle->newest_ns <= record->t_ns,
               follow = follows && before && before->newest_ns <= middle->newest_ns;
    const struct water_record *base = follows ? base_of(follow ? before : NULL, middle, record) : NULL;
    if (base) {
        const uint32_t seq = middle->seq;
        const bool both = base != middle;
        thin_join(base, record, &joined, &s->joined);
        pool_drop(&s->pool, record->sensor, seq);
        if (both)
            pool_drop(&s->pool, record->sensor, seq);
        else if (follow)
            spare(s, &joined);
        pool_keep(&s->pool, &joined);
    } else if (follow)
        spare(s, record);
    pool_keep(&s->pool, record);
}

static void enter_head(struct store *s, const struct echoes *e, const struct water_record *at)
{
    struct store_sensor *sensor = &s->sensor[e->sensor];
    struct water_record record;
    if (!beams_read(e, &sensor->deaf, &s->row))
        return;
    const bool joined = sweep_add(&sensor->sweep, at, &s->row);
    sweep_write(&sensor->sweep, &record, &s->room);
    if (joined && sensor->sweep.since > 1)
        pool_drop(&s->pool, e->sensor, sensor->sweep.before);
    if (joined)
        pool_keep(&s->pool, &record);
    else
        keep_thinned(s, &record);
}

/* All beams in one image, however high they look. */
static void enter_fan(struct store *s, const struct echoes *e, struct water_record *record)
{
    const struct beams_deaf *deaf = &s->sensor[e->sensor].deaf;
    const bool level = beams_are_level(e);
    if (!(level ? beams_read(e, deaf, &s->row) : matrix_write(e, deaf, &s->matrix, record, &s->room)))
        return;
    if (level)
        row_write(record, &s->room, &s->row.shape, s->row.beam, s->row.n);
    keep_thinned(s, record);
}

void store_enter(struct store *s, const struct echoes *e, const struct mount *mount)
{
    struct water_record at;
    if (e->sensor >= STORE_SENSORS || e->n_beams == 0 || e->n_beams > BEAMS_MAX || !place_ping(s, e))
        return;
    beams_begin(&at, e, mount);
    if (e->n_beams == 1)
        enter_head(s, e, &at);
    else
        enter_fan(s, e, &at);
    beams_listen(&s->sensor[e->sensor].deaf, e);
}

/* ---- questions ---- */

static double seconds_since(uint64_t t_ns, uint64_t now_ns)
{
    return now_ns > t_ns ? (double)(now_ns - t_ns) * 1e-9 : 0;
}

/* Was an echo that might have ended this record's water lost with another record? Of its own sensor's those since its
 * newest beam would have: it holds the ones before. */
static bool is_doubted(const struct store_list *list, const struct water_record *r)
{
    for (uint32_t i = 0; i < STORE_SENSORS; i++)
        if ((i == r->sensor ? r->newest_ns : r->t_ns) < list->gone_ns[i])
            return true;
    return false;
}

/* The way that the vehicle has gone since the records so far, from the newest on: from where on, and how far beside it
 * the vehicle may be now because its heading drifted on the way. */
struct strayed {
    double path_m, off_m;
};

static double turned_rad(const struct store_now *now, const struct water_record *r)
{
    return now->pose->heading_radps * seconds_since(r->t_ns, now->now_ns);
}

/* A step of the way went in a direction that was wrong, against that of now, by as much as the heading has drifted
 * since the step: no more than since the record before it. */
static void stray(struct strayed *s, const struct store_now *now, const struct water_record *r)
{
    s->off_m += fmin(turned_rad(now, r), 2) * fmax(s->path_m - r->path_m, 0);
    s->path_m = fmin(s->path_m, r->path_m);
}

/*
 * By what a record's water is uncertain now: all that was so when it was seen, and what came since. A heading that
 * drifts turns it about the vertical: in the sensor's axes that is a turn about its own vertical and, by the sine of
 * the angle between the two, one across it.
 */
static struct water_view look_at(const struct store_now *now, const struct water_record *r, double strayed_m)
{
    const struct pose *pose = now->pose;
    const double age_s = seconds_since(r->t_ns, now->now_ns), way = fmax(pose->path_m - r->path_m, 0);
    const double level_m = fmax(pose->drift_m[0] - r->drift_m[0], 0),
                 depth_m = fmax(pose->drift_m[1] - r->drift_m[1], 0);
    const double turned = turned_rad(now, r), leaning = hypot(r->axis[2][0], r->axis[2][1]);
    const double off_m =
        r->uncertain_m + pose->uncertain_m + POSE_WAY_ERROR * way + strayed_m + fmin(turned, 2) * r->lever_m;
    struct water_view view = {.record = r,
                              .margin_m = off_m + hypot(level_m, depth_m),
                              .level_m = level_m,
                              .lift_m = off_m + depth_m + level_m * fmin(leaning, 1),
                              .margin_rad = r->tilt_rad + turned,
                              .lift_rad = r->tilt_rad + turned * leaning,
                              .keeps_m = now->keeps_m > 0 ? fmax(now->keeps_m - r->lever_m, WATER_UNIT_M) : 0,
                              .lost = (now->lost >> r->sensor & 1) || age_s > now->clear_for_s};
    view.lost = view.lost || way + view.margin_m > now->move_limit_m;
    double from[3];
    for (int k = 0; k < 3; k++)
        from[k] = pose->position_m[k] - r->place_m[k];
    for (int k = 0; k < 3; k++)
        view.at_m[k] = geo_dot(from, r->axis[k]);
    return view;
}

/* From where the vehicle jumped to nobody knows where anything lies. */
static bool is_away(const struct store_list *list, const struct pose *pose)
{
    return !list->placed || list->ned != ((pose->has & POSE_ATTITUDE) != 0) ||
           pose->discontinuities != list->discontinuities || pose->withdrawn != list->withdrawn ||
           way_m(list->at_m, pose) > POSE_STEP_MOST_M;
}

void store_list(const struct store *s, struct store_list *list)
{
    *list = (struct store_list){.number = s->pool.number,
                                .discontinuities = s->discontinuities,
                                .withdrawn = s->withdrawn,
                                .n = s->pool.n,
                                .ned = s->ned,
                                .placed = s->placed};
    memcpy(list->gone_ns, s->pool.gone_ns, sizeof list->gone_ns);
    memcpy(list->at_m, s->at_m, sizeof list->at_m);
    memcpy(list->order, s->pool.order, s->pool.n * sizeof *list->order);
}

/* The latest of the views so far that has some of its beams and goes on with the sweep; NULL: none does. */
static const struct water_view *next_of(const struct water_view *view, int n)
{
    const struct water_record *r = view[n].record;
    for (int i = 0; r->sense != 0 && i < n; i++) {
        const struct water_record *by = view[i].record;
        if (by->sensor == r->sensor && by->sense == r->sense && by->sweep == r->sweep && by->t_ns < r->newest_ns &&
            by->newest_ns > r->newest_ns)
            return &view[i];
    }
    return NULL;
}

int store_look(const struct store *s, const struct store_list *list, const struct store_now *now,
               struct water_view *view)
{
    struct strayed strayed = {.path_m = now->pose->path_m};
    int n = 0;
    if (is_away(list, now->pose))
        return 0;
    for (uint32_t i = list->n; i-- > 0;) {
        const struct water_record *r = &s->pool.record[list->order[i]];
        if (seconds_since(r->newest_ns, now->now_ns) > now->clear_for_s)
            break;
        stray(&strayed, now, r);
        view[n] = look_at(now, r, strayed.off_m);
        view[n].lost = view[n].lost || (!now->looks && is_doubted(list, r));
        view[n].next = view[n].level_m > 0 ? next_of(view, n) : NULL;
        n++;
    }
    return n;
}
