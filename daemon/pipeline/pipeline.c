/* SPDX-License-Identifier: MIT */
#include "pipeline.h"

#include <sched.h>
#include <stdlib.h>
#include <string.h>

#include "core/loop.h"
#include "core/memory.h"
#include "grid/picture/bearings.h"
#include "grid/range/immersion.h"
#include "pipeline_state.h"

#define STACK_TOUCHED (160 * 1024) /* shapes_look and tangents_walls, the deepest, take 155 KiB */

#define NONE UINT32_MAX

_Static_assert(PIPELINE_MAX_SENSORS <= BEARINGS_SENSORS, "bearings tell all sensors apart");
_Static_assert(PIPELINE_MAX_SENSORS == STORE_SENSORS, "each has records of its own");

/* ---- stages ---- */

static void enter_map(struct pipeline *p, const struct echoes *e)
{
    const struct voxmap_sensor sensor = {.mount = p->conf.mount[e->sensor], .shape = p->conf.shape[e->sensor]};
    voxmap_enter(&p->map->map, e, &sensor);
}

/* A replay reads no clock, but to be measured. */
static bool has_clock(const struct pipeline *p)
{
    return !p->conf.patient || p->conf.measured;
}

static uint64_t now_of(const struct pipeline *p)
{
    return has_clock(p) ? loop_clock() : 0;
}

static void measure_stage(struct pipeline *p, enum pipeline_stage stage, uint64_t from_ns, uint64_t to_ns)
{
    if (has_clock(p))
        latency_add(&p->latency[stage], to_ns > from_ns ? to_ns - from_ns : 0);
}

static void run_maps(struct pipeline *p, struct echoes *e)
{
    const uint64_t started_ns = now_of(p);
    for (int i = 0; i < p->n_grids; i++)
        grid_enter(p->grid[i], e, &p->conf.mount[e->sensor]);
    if (p->map)
        enter_map(p, e);
    witness_take(&p->witnesses, e, &p->conf.mount[e->sensor]);
    records_enter(p->records, e, &p->conf.mount[e->sensor]);
    const uint64_t ended_ns = now_of(p);
    measure_stage(p, PIPELINE_MAPS, started_ns, ended_ns);
    if (!p->conf.patient)
        measure_stage(p, PIPELINE_WHOLE, e->t_in_ns, ended_ns);
    atomic_fetch_add_explicit(&p->finished, 1, memory_order_release);
}

/* What there is to extract after a ping came in: older ones that the clean-up held back, or the ping itself. */
struct intake {
    const struct ping *own; /* NULL: the clean-up has it */
    struct extract_aid aid; /* of `own` */
    struct cleanup *cleanup;
};

static void publish_cleanup(struct pipeline *p, uint16_t sensor, uint32_t held_before)
{
    struct cleanup_state state;
    cleanup_state(p->cleanup[sensor], &state);
    atomic_fetch_add_explicit(&p->held, (uint64_t)state.held - held_before, memory_order_release);
    snapshot_publish(&p->cleanup_state[sensor], &state);
}

static void learn(struct pipeline *p, const struct ping *ping)
{
    const struct pipeline_background *b = &p->background[ping->sensor];
    struct learnt learnt = {.learning = b->learning};
    background_learn_take(b->learn, ping);
    background_learn_progress(b->learn, &learnt.progress);
    snapshot_publish(&p->learnt[ping->sensor], &learnt);
}

void pipeline_learnt(struct pipeline *p, int sensor, uint64_t learning, struct background_progress *out)
{
    struct learnt learnt;
    snapshot_read(&p->learnt[sensor], &learnt);
    *out = learnt.learning == learning ? learnt.progress : (struct background_progress){0};
}

static void take_in(struct pipeline *p, const struct ping *ping, struct intake *in)
{
    const struct pipeline_background *b = &p->background[ping->sensor];
    bool any_blind = false;
    *in = (struct intake){.own = ping, .aid = {.lowest = -1}, .cleanup = p->cleanup[ping->sensor]};
    if (b->learn)
        learn(p, ping);
    const bool known = b->use && background_view(b->use, ping, &b->view, &any_blind);
    if (any_blind)
        in->aid.blind = b->view.blind;
    if (any_blind && b->open_water)
        in->aid.own = b->view.level;
    if (!in->cleanup)
        return;
    const uint32_t held = cleanup_held(in->cleanup);
    if (cleanup_put(in->cleanup, ping, known ? b->view.level : NULL, in->aid.blind, in->aid.own))
        in->own = NULL;
    publish_cleanup(p, ping->sensor, held);
}

/* The next ping of the intake and what is known of it; NULL: that was all. */
static const struct ping *next_of(struct intake *in, struct extract_aid *aid)
{
    const struct ping *ping = in->cleanup ? cleanup_next(in->cleanup, aid) : NULL;
    if (!ping) {
        ping = in->own;
        *aid = in->aid;
        in->own = NULL;
    }
    return ping;
}

/* What `status` says of a sonar's extraction. */
static void publish_extract(struct pipeline *p, int sensor)
{
    struct extract_reference reference;
    extract_reference(p->extract[sensor], &reference);
    snapshot_publish(&p->reference[sensor], &reference);
    atomic_store_explicit(&p->law_doubt[sensor], (int)extract_law_doubt(p->extract[sensor]), memory_order_relaxed);
}

/* Withdraws free water that the receiver may not have heard; status and log tell what lasts. */
static void doubt_hearing(struct pipeline *p, struct echoes *e)
{
    enum hearing_doubt doubt = extract_hearing_doubt(p->extract[e->sensor]);
    const bool out = immersion_is_out(&e->pose, &p->conf.mount[e->sensor]);
    for (unsigned i = 0; out && i < e->n_beams; i++)
        beam_frees_nothing(&e->beam[i]);
    if (lost_echo_run(&p->lost_echo[e->sensor], e) && doubt == HEARING_HEARS)
        doubt = HEARING_LOST;
    atomic_store_explicit(&p->hearing[e->sensor], out ? (int)HEARING_AIR : (int)doubt, memory_order_relaxed);
}

static void run_extract(struct pipeline *p, const struct ping *ping, const struct extract_aid *aid,
                        struct echoes *e)
{
    const uint64_t started_ns = now_of(p);
    extract_run(p->extract[ping->sensor], ping, aid->blind || aid->clean ? aid : NULL, e);
    publish_extract(p, ping->sensor);
    if (p->marks[ping->sensor])
        marks_run(p->marks[ping->sensor], e);
    doubt_hearing(p, e);
    if (p->own_echo[ping->sensor]) {
        own_echo_run(p->own_echo[ping->sensor], e, &p->conf.mount[ping->sensor]);
        atomic_store_explicit(&p->own_bearings[ping->sensor], own_echo_known(p->own_echo[ping->sensor]),
                              memory_order_relaxed);
    }
    if (p->image[ping->sensor])
        image_enter(p->image[ping->sensor], ping, e);
    measure_stage(p, PIPELINE_EXTRACT, started_ns, now_of(p));
}

static void run_both(struct pipeline *p, const struct ping *came)
{
    struct intake in;
    struct extract_aid aid;
    take_in(p, came, &in);
    for (const struct ping *ping; (ping = next_of(&in, &aid));) {
        run_extract(p, ping, &aid, &p->echoes[0]);
        run_maps(p, &p->echoes[0]);
    }
}

/* ---- between threads ---- */

/* A turn is not lost with its first ping: one that seems twice as long would keep water clear for twice as long. */
static void count_drop(struct pipeline *p, struct stage_queue *queue, uint16_t sensor, uint8_t flags)
{
    if (flags & PING_NEW_TURN)
        queue->lost_turns |= UINT64_C(1) << sensor;
    atomic_fetch_add_explicit(&p->dropped[sensor], 1, memory_order_relaxed);
    atomic_fetch_add_explicit(&p->finished, 1, memory_order_release);
}

/* A buffer to fill: an idle one, or (unless patient) the oldest that waits; *dropped says which. */
static uint32_t obtain(struct pipeline *p, struct stage_queue *queue, bool *dropped)
{
    uint32_t index;
    *dropped = false;
    for (;;) {
        if (ring_take(&queue->idle, &index))
            return index;
        if (!p->conf.patient && ring_take(&queue->waiting, &index)) {
            *dropped = true;
            return index;
        }
        if (p->conf.patient)
            pipeline_rest();
    }
}

/* The flags of that sensor's next ping. */
static uint8_t take_lost_turn(struct stage_queue *queue, uint16_t sensor, uint8_t flags)
{
    const uint64_t bit = UINT64_C(1) << sensor;
    flags |= queue->lost_turns & bit ? PING_NEW_TURN : 0;
    queue->lost_turns &= ~bit;
    return flags;
}

static void pass_on(struct stage_queue *queue, uint32_t index)
{
    ring_put(&queue->waiting, index);
    sem_post(&queue->news);
}

static void give_back(struct stage_queue *queue, uint32_t index)
{
    ring_put(&queue->idle, index);
}

/* What was sent before it comes before it. */
static void do_sync_call(struct pipeline *p)
{
    struct sync_call *v = atomic_exchange_explicit(&p->sync_call, NULL, memory_order_acquire);
    if (!v)
        return;
    owner_jobs_do(p, &p->jobs);
    const struct pipeline_owned owned = pipeline_owned(p);
    v->fn(v->ctx, &owned);
    sem_post(&v->done);
}

/* The next waiting buffer; NONE when the pipeline stops and nothing waits. */
static uint32_t await(struct pipeline *p, struct stage_queue *queue)
{
    uint32_t index;
    for (;;) {
        atomic_fetch_add_explicit(&queue->turns, 1, memory_order_relaxed);
        if (queue == pipeline_owners_queue(p)) {
            do_sync_call(p);
            owner_jobs_do(p, &p->jobs);
        }
        if (queue == &p->pings)
            owner_jobs_do(p, &p->extract_jobs);
        if (ring_take(&queue->waiting, &index))
            return index;
        if (atomic_load_explicit(&p->stop, memory_order_acquire))
            return NONE;
        sem_wait(&queue->news);
    }
}

/* A fault on the stack's first pages must not come with the first ping. */
static void touch_stack(void)
{
    volatile char stack[STACK_TOUCHED];
    for (size_t i = 0; i < sizeof stack; i += 4096)
        stack[i] = 0;
}

/*
 * The loop wakes these threads and goes on, for clients wait for it: where both share a processor it is not to be put
 * aside for the milliseconds that a ping takes, as it would be for an ordinary thread.
 * Real-time ones have their priorities.
 */
static void stand_back(void)
{
    const struct sched_param none = {0};
    if (sched_getscheduler(0) == SCHED_OTHER)
        sched_setscheduler(0, SCHED_BATCH, &none);
}

static void settle_in(void)
{
    touch_stack();
    stand_back();
}

static void *both_stages(void *arg)
{
    struct pipeline *p = arg;
    settle_in();
    for (uint32_t i; (i = await(p, &p->pings)) != NONE; give_back(&p->pings, i))
        run_both(p, &p->ping[i]);
    return NULL;
}

static void *extract_stage(void *arg)
{
    struct pipeline *p = arg;
    settle_in();
    for (uint32_t i; (i = await(p, &p->pings)) != NONE; give_back(&p->pings, i)) {
        struct intake in;
        struct extract_aid aid;
        take_in(p, &p->ping[i], &in);
        for (const struct ping *ping; (ping = next_of(&in, &aid));) {
            bool dropped;
            uint32_t e = obtain(p, &p->found, &dropped);
            if (dropped)
                count_drop(p, &p->found, p->echoes[e].sensor, p->echoes[e].flags);
            run_extract(p, ping, &aid, &p->echoes[e]);
            p->echoes[e].flags = take_lost_turn(&p->found, ping->sensor, p->echoes[e].flags);
            pass_on(&p->found, e);
        }
    }
    return NULL;
}

static void *maps_stage(void *arg)
{
    struct pipeline *p = arg;
    settle_in();
    for (uint32_t e; (e = await(p, &p->found)) != NONE; give_back(&p->found, e))
        run_maps(p, &p->echoes[e]);
    return NULL;
}

/* ---- the loop's side ---- */

struct ping *pipeline_begin(struct pipeline *p)
{
    if (p->filling == NONE) {
        bool dropped;
        p->filling = obtain(p, &p->pings, &dropped);
        if (dropped)
            count_drop(p, &p->pings, p->ping[p->filling].sensor, p->ping[p->filling].flags);
    }
    struct ping *ping = &p->ping[p->filling];
    struct ping fresh = {.max_beams = ping->max_beams,
                         .max_samples = ping->max_samples,
                         .beam = ping->beam,
                         .samples = ping->samples,
                         .pose = pose_identity};
    *ping = fresh;
    return ping;
}

void pipeline_submit(struct pipeline *p, struct ping *ping)
{
    ping->flags = take_lost_turn(&p->pings, ping->sensor, ping->flags);
    follow_ping(p, ping);
    records_tell(p->records);
    atomic_fetch_add_explicit(&p->submitted, 1, memory_order_relaxed);
    if (p->conf.threads == 0) {
        run_both(p, ping);
        return;
    }
    pass_on(&p->pings, p->filling);
    p->filling = NONE;
}

void pipeline_take_extract(void *extract_job, const struct pipeline_owned *owned)
{
    struct extract_job *e = extract_job;
    struct pipeline *p = e->call.pipeline;
    (void)owned;
    e->good = extract_init(p->extract[e->sensor], &e->conf, p->conf.max_bins, &e->fault);
    publish_extract(p, e->sensor);
}

void pipeline_take_background(void *background_job, const struct pipeline_owned *owned)
{
    struct background_job *e = background_job;
    (void)owned;
    e->call.pipeline->background[e->sensor] = e->background;
    e->done = true;
}

struct records *pipeline_records(struct pipeline *p)
{
    return p->records;
}

struct image *pipeline_image(struct pipeline *p, int sensor)
{
    return p->image[sensor];
}

const struct cleanup_conf *pipeline_cleanup(const struct pipeline *p, int sensor)
{
    return &p->conf.cleanup[sensor];
}

struct latency *pipeline_latency(struct pipeline *p, enum pipeline_stage stage)
{
    return &p->latency[stage];
}

int pipeline_threads(const struct pipeline *p)
{
    return p->n_threads;
}

const char *pipeline_thread_name(const struct pipeline *p, int i)
{
    return p->n_threads == 1 ? "pipeline" : i == 0 ? "extract" : "maps";
}

uint64_t pipeline_turns(const struct pipeline *p, int i)
{
    return atomic_load_explicit(i == 0 ? &p->pings.turns : &p->found.turns, memory_order_relaxed);
}

void pipeline_poke(struct pipeline *p)
{
    if (p->n_threads > 0)
        sem_post(&p->pings.news);
    if (p->n_threads > 1)
        sem_post(&p->found.news);
}

int pipeline_schedule(struct pipeline *p, int priority)
{
    const struct sched_param param = {.sched_priority = priority};
    int cause = 0;
    for (int i = 0; i < p->n_threads && cause == 0; i++)
        cause = pthread_setschedparam(p->thread[i], SCHED_FIFO, &param);
    return cause;
}

void pipeline_stats(struct pipeline *p, struct pipeline_stats *out)
{
    out->submitted = atomic_load(&p->submitted);
    out->finished = atomic_load(&p->finished);
    for (int i = 0; i < PIPELINE_MAX_SENSORS; i++)
        out->dropped[i] = atomic_load(&p->dropped[i]);
    out->waiting = p->conf.threads ? ring_count(&p->pings.waiting) + ring_count(&p->found.waiting) : 0;
    grid_stats(p->grid[0], &out->grid);
    for (int i = 0; i < PIPELINE_MAX_SENSORS; i++)
        out->own_bearings[i] = atomic_load_explicit(&p->own_bearings[i], memory_order_relaxed);
    for (int i = 0; i < PIPELINE_MAX_SENSORS; i++)
        out->law_doubt[i] = (enum law_doubt)atomic_load_explicit(&p->law_doubt[i], memory_order_relaxed);
    for (int i = 0; i < PIPELINE_MAX_SENSORS; i++)
        out->hearing[i] = (enum hearing_doubt)atomic_load_explicit(&p->hearing[i], memory_order_relaxed);
    out->records_left_out = atomic_load_explicit(&p->records->left_out, memory_order_relaxed);
    for (int i = 0; i < PIPELINE_MAX_SENSORS; i++)
        snapshot_read(&p->cleanup_state[i], &out->cleanup[i]);
    for (int i = 0; i < PIPELINE_MAX_SENSORS; i++)
        snapshot_read(&p->reference[i], &out->reference[i]);
}

/* ---- start and end ---- */

/* Memory for the life of the pipeline, every page touched now. */
static void *own(struct pipeline *p, size_t n)
{
    void *m = n ? memory_touched(n) : NULL;
    if (m)
        p->memory[p->n_memory++] = m;
    return m;
}

static bool make_buffers(struct pipeline *p)
{
    const struct pipeline_conf *c = &p->conf;
    p->n_buffers = (c->threads ? c->queue : 0) + PIPELINE_SPARE;
    p->ping = own(p, p->n_buffers * sizeof *p->ping);
    p->echoes = own(p, p->n_buffers * sizeof *p->echoes);
    char *samples = own(p, (size_t)p->n_buffers * c->max_samples * 2);
    struct ping_beam *beams = own(p, (size_t)p->n_buffers * c->max_beams * sizeof *beams);
    struct beam_echoes *heard = own(p, (size_t)p->n_buffers * c->max_beams * sizeof *heard);
    if (!p->ping || !p->echoes || !samples || !beams || !heard)
        return false;
    for (uint32_t i = 0; i < p->n_buffers; i++) {
        p->ping[i] = (struct ping){.max_beams = c->max_beams,
                                   .max_samples = c->max_samples,
                                   .beam = beams + (size_t)i * c->max_beams,
                                   .samples = samples + (size_t)i * c->max_samples * 2};
        p->echoes[i].max_beams = c->max_beams;
        p->echoes[i].beam = heard + (size_t)i * c->max_beams;
        ring_put(&p->pings.idle, i);
        ring_put(&p->found.idle, i);
    }
    return true;
}

/* So many pings are remembered of a wide multibeam, and so many beams of any sonar. */
#define WITNESS_PINGS 64
#define WITNESS_BEAMS 2048

static bool make_witnesses(struct pipeline *p)
{
    const uint32_t wide = WITNESS_PINGS * p->conf.max_beams, n = wide > WITNESS_BEAMS ? wide : WITNESS_BEAMS;
    void *memory = own(p, witness_bytes(n));
    if (memory)
        witness_init(&p->witnesses, memory, n);
    return memory != NULL;
}

/* Pings wait before each of the threads. */
static struct store_conf store_conf_of(const struct pipeline_conf *c)
{
    struct store_conf store = {.spare = records_spare(c->threads, c->queue + PIPELINE_SPARE)};
    memcpy(store.beams, c->beams, sizeof c->beams);
    return store;
}

size_t pipeline_records_bytes(const struct pipeline_conf *conf)
{
    const struct store_conf store = store_conf_of(conf);
    return records_bytes(&store);
}

static bool make_records(struct pipeline *p)
{
    const struct store_conf store = store_conf_of(&p->conf);
    void *memory = own(p, records_bytes(&store));
    if (memory)
        p->records = records_init(memory, &store);
    return memory != NULL;
}

static bool make_cleanup(struct pipeline *p, int i, struct fault *fault)
{
    const struct cleanup_conf *c = &p->conf.cleanup[i];
    if (!cleanup_wanted(c))
        return true;
    void *m = own(p, cleanup_size(c, p->conf.max_bins));
    p->cleanup[i] = m ? cleanup_init(m, c, &p->conf.mount[i], p->conf.max_bins, fault) : NULL;
    if (p->cleanup[i])
        publish_cleanup(p, (uint16_t)i, 0);
    return p->cleanup[i] != NULL;
}

static bool make_map(struct pipeline *p, struct fault *fault)
{
    const struct voxmap_setting *s = &p->conf.voxels;
    if (!p->conf.map)
        return true;
    const size_t size = voxmap_bytes(s, fault);
    if (!size)
        return false;
    void *map = own(p, size), *mask = own(p, voxmask_bytes(p->conf.mask_blocks));
    p->map = own(p, sizeof *p->map);
    if (!map || !mask || !p->map) {
        fault_set(fault, "no memory for the voxel map: %zu MiB", size >> 20);
        p->map = NULL;
        return false;
    }
    voxmap_init(&p->map->map, s, map);
    voxmask_init(&p->map->mask, &p->map->map, mask, p->conf.mask_blocks);
    return true;
}

static bool make_grids(struct pipeline *p, struct fault *fault)
{
    for (int i = 0; i <= p->conf.n_more_grids; i++) {
        p->grid[i] = grid_new(i == 0 ? &p->conf.grid : &p->conf.more_grid[i - 1], fault);
        if (!p->grid[i])
            return false;
        p->n_grids++;
    }
    return true;
}

static bool make_stages(struct pipeline *p, struct fault *fault)
{
    for (int i = 0; i < p->conf.n_sensors; i++) {
        void *m = own(p, extract_size(p->conf.max_bins));
        p->extract[i] = m ? extract_init(m, &p->conf.extract[i], p->conf.max_bins, fault) : NULL;
        if (p->conf.image)
            p->image[i] = own(p, sizeof *p->image[i]);
        if (p->conf.marks && (p->marks[i] = own(p, sizeof *p->marks[i])))
            marks_init(p->marks[i], p->conf.sound_mps);
        if (p->conf.marks && (p->own_echo[i] = own(p, sizeof *p->own_echo[i])))
            own_echo_init(p->own_echo[i]);
        if (!p->extract[i] || (p->conf.image && !p->image[i]) ||
            (p->conf.marks && (!p->marks[i] || !p->own_echo[i])) || !make_cleanup(p, i, fault))
            return false;
    }
    return make_grids(p, fault) && make_map(p, fault);
}

static bool start_threads(struct pipeline *p)
{
    void *(*const one[])(void *) = {both_stages};
    void *(*const two[])(void *) = {extract_stage, maps_stage};
    for (int i = 0; i < p->conf.threads; i++) {
        if (pthread_create(&p->thread[i], NULL, p->conf.threads == 1 ? one[i] : two[i], p) != 0)
            return false;
        p->n_threads++;
    }
    return true;
}

struct pipeline *pipeline_new(const struct pipeline_conf *conf, struct fault *fault)
{
    struct pipeline *p = aligned_alloc(RING_CACHE_LINE, (sizeof *p + 63) / 64 * 64);
    fault_set(fault, "out of memory");
    if (!p)
        return NULL;
    memset(p, 0, sizeof *p);
    p->conf = *conf;
    p->filling = NONE;
    struct stage_queue *queues[] = {&p->pings, &p->found};
    for (int i = 0; i < 2; i++) {
        ring_init(&queues[i]->waiting, conf->queue + PIPELINE_SPARE, 0);
        ring_init(&queues[i]->idle, conf->queue + PIPELINE_SPARE, 0);
        sem_init(&queues[i]->news, 0, 0);
    }
    if (!owner_jobs_start(p) || !make_buffers(p) || !make_witnesses(p) || !make_records(p) ||
        !make_stages(p, fault)) {
        pipeline_free(p);
        return NULL;
    }
    if (!start_threads(p)) {
        fault_set(fault, "cannot start a thread");
        pipeline_free(p);
        return NULL;
    }
    return p;
}

void pipeline_free(struct pipeline *p)
{
    if (!p)
        return;
    if (p->n_threads == p->conf.threads && p->n_grids)
        pipeline_drain(p);
    atomic_store_explicit(&p->stop, true, memory_order_release);
    struct stage_queue *queues[] = {&p->pings, &p->found};
    for (int i = 0; i < 2; i++)
        sem_post(&queues[i]->news);
    for (int i = 0; i < p->n_threads; i++)
        pthread_join(p->thread[i], NULL);
    for (int i = 0; i < 2; i++)
        sem_destroy(&queues[i]->news);
    owner_jobs_close(p);
    for (int i = 0; i < p->n_grids; i++)
        grid_free(p->grid[i]);
    for (int i = 0; i < p->n_memory; i++)
        free(p->memory[i]);
    free(p);
}
