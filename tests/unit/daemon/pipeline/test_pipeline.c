/* SPDX-License-Identifier: MIT */
/*
 * test_pipeline - the same pings through 0, 1 and 2 threads give the same picture and the same free water, bit for
 * bit; under overload a live
 * pipeline drops the oldest, counts them by their sonar and goes on; readers see whole entries while it writes.
 */
#include "tests/lib/held_owner.h"
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

#include <pthread.h>
#include <stdatomic.h>
#include <time.h>

#include "core/fault.h"
#include "daemon/pipeline/pipeline.h"
#include "daemon/pipeline/pipeline_state.h"

static struct pipeline *make(int threads, bool patient, uint32_t queue)
{
    struct pipeline_conf c = {
        .threads = threads,
        .queue = queue,
        .patient = patient,
        .max_beams = 1,
        .beams = {1, 1},
        .max_samples = 1200,
        .max_bins = 1200,
        .n_sensors = 2,
        .mount = {mount_identity, mount_identity},
        .grid.sphere = {.angular_step_rad = geo_rad(2),
                        .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                        .max_cells = 20000,
                        .forget_s = 160,
                        .blocked_above = 0.6,
                        .recentre_m = 0.1}};
    struct fault fault;
    for (int i = 0; i < c.n_sensors; i++)
        extract_defaults(&c.extract[i]);
    struct pipeline *p = pipeline_new(&c, &fault);
    if (!p) {
        printf("%s\n", fault.text);
        exit(1);
    }
    return p;
}

static uint8_t flags; /* of the next pings */

/* The ping after `before` others: noise with a wall of 0.2 m at a range that changes with the angle. */
static void send(struct pipeline *p, uint64_t *seed, uint16_t sensor, uint32_t before)
{
    struct ping *ping = pipeline_begin(p);
    uint8_t *v = ping->samples;
    uint32_t wall = 300 + (uint32_t)(test_random(seed) % 600);
    for (uint32_t b = 0; b < 1200; b++)
        v[b] = b < 20 ? 255 : (uint8_t)(test_random(seed) % 16 + (b >= wall && b < wall + 20 ? 180 : 0));
    ping->t_ns = ping->t_in_ns = 1000000000ull + before * 20000000ull;
    ping->seq = before + 1;
    ping->sensor = sensor;
    ping->flags = flags;
    ping->sample_bytes = 1;
    ping->n_beams = 1;
    ping->n_bins = 1200;
    ping->dr_m = 0.01f;
    ping->pulse_m = 0.03f;
    ping->az_aperture_rad = (float)geo_rad(2);
    ping->el_aperture_rad = (float)geo_rad(25);
    ping->head_units = before % 400;
    ping->head_turn = 400;
    ping->beam[0] = (struct ping_beam){.az_rad = (float)geo_rad(before % 400 * 0.9)};
    pipeline_submit(p, ping);
}

static void feed(struct pipeline *p, uint64_t *seed, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        send(p, seed, 0, i);
}

/* Of 1000 pings, and what is seen of their records. */
struct water {
    int n;
    struct water_view view[ASK_RECORDS];
    struct water_cell cell[ASK_RECORDS][WATER_COLUMNS];
};

static void see_water(struct pipeline *p, struct water *water)
{
    struct records_reading reading = {0};
    const struct store_now now = {
        .now_ns = 1000000000ull + 999 * 20000000ull, .pose = &pose_identity, .clear_for_s = 30, .move_limit_m = 1};
    records_open(pipeline_records(p), &reading);
    memset(water, 0, sizeof *water);
    water->n = records_view(pipeline_records(p), &reading, &now, water->view);
    for (int i = 0; i < water->n; i++) {
        const struct water_image *image = &water->view[i].record->image;
        memcpy(water->cell[i], image->cell, image->columns * sizeof *image->cell);
        water->view[i].record = (const void *)(uintptr_t)water->view[i].record->seq;
    }
    records_close(pipeline_records(p), &reading);
}

TEST(any_number_of_threads_gives_the_same_free_water)
{
    static struct water want, have;
    for (int threads = 0; threads <= 2; threads++) {
        uint64_t seed = 7;
        struct pipeline *p = make(threads, true, 4);
        feed(p, &seed, 1000);
        pipeline_drain(p);
        see_water(p, threads ? &have : &want);
        CHECK(want.n > 100);
        CHECK(threads == 0 || memcmp(&want, &have, sizeof want) == 0);
        struct pipeline_stats s;
        pipeline_stats(p, &s);
        CHECK_INT(s.records_left_out, 0);
        pipeline_free(p);
    }
}

TEST(any_number_of_threads_gives_the_same_picture)
{
    static struct picture_entry want[20000];
    for (int threads = 0; threads <= 2; threads++) {
        uint64_t seed = 7;
        struct pipeline *p = make(threads, true, 4);
        feed(p, &seed, 1000);
        pipeline_drain(p);
        struct picture *picture = pipeline_picture(p);
        uint32_t blocked = 0;
        for (uint32_t d = 0; d < picture->n; d++) {
            struct picture_entry e;
            picture_get(picture, d, &e);
            if (threads == 0)
                want[d] = e;
            CHECK(memcmp(&want[d], &e, sizeof e) == 0);
            blocked += e.obstacle[0].logodds > 0;
        }
        CHECK(blocked > 100);
        struct pipeline_stats s;
        pipeline_stats(p, &s);
        CHECK_INT(s.finished, 1000);
        CHECK_INT(s.dropped[0], 0);
        pipeline_free(p);
    }
}

TEST(overload_drops_the_oldest_and_counts_them)
{
    for (int threads = 1; threads <= 2; threads++) {
        uint64_t seed = 7;
        struct pipeline *p = make(threads, false, 2);
        feed(p, &seed, 3000); /* much faster than real time */
        pipeline_drain(p);
        struct pipeline_stats s;
        struct picture_frame frame;
        pipeline_stats(p, &s);
        picture_get_frame(pipeline_picture(p), &frame);
        CHECK_INT(s.submitted, 3000);
        CHECK_INT(frame.pings + s.dropped[0], 3000);
        CHECK_INT(frame.t_ping_ns,
                  1000000000ull + 2999 * 20000000ull); /* the newest is never the one that is lost */
        printf("# %d threads: %llu of 3000 dropped\n", threads, (unsigned long long)s.dropped[0]);
        pipeline_free(p);
    }
}

/* Waits until the thread that extracts, where there is one, is done with it: the maps' owner is busy. */
static void send_and_wait(struct pipeline *p, int threads, uint64_t *seed, uint16_t sensor, uint32_t before)
{
    send(p, seed, sensor, before);
    WAIT_UNTIL(threads == 1 || ring_count(&p->pings.idle) == p->n_buffers);
}

/* The maps' owner is busy. As much of one sonar as there is room for waits for it: pings where one thread does all,
 * echoes where another one extracts. The other sonar's then take the place of them. */
TEST(what_is_dropped_counts_for_its_own_sonar)
{
    for (int threads = 1; threads <= 2; threads++) {
        static struct hold hold;
        uint64_t seed = 7;
        struct pipeline *p = make(threads, false, 2);
        const uint32_t room = p->n_buffers;
        struct pipeline_stats s;
        hold_owner(&hold, p);
        for (uint32_t i = 0; i < 2 * room; i++)
            send_and_wait(p, threads, &seed, i < room, i);
        pipeline_stats(p, &s);
        CHECK_INT(s.dropped[1], room);
        CHECK_INT(s.dropped[0], 0);
        sem_post(&hold.go);
        pipeline_drain(p);
        pipeline_stats(p, &s);
        CHECK_INT(s.finished, 2 * room);
        CHECK_INT(s.dropped[0] + s.dropped[1], room);
        pipeline_free(p);
    }
}

/* The next of its sonar tells of it, and only that, also when this one is dropped in its turn. */
TEST(a_turn_is_not_lost_with_its_first_ping)
{
    for (int k = 0; k < 4; k++) {
        static struct hold hold;
        const int threads = 1 + k / 2;
        const uint32_t begins = (uint32_t)k % 2; /* the sonar whose turn it is */
        uint64_t seed = 7;
        struct pipeline *p = make(threads, false, 2);
        const uint32_t room = p->n_buffers;
        hold_owner(&hold, p);
        for (uint32_t i = 0; i < 4 * room; i++) {
            flags = i == begins ? PING_NEW_TURN : 0;
            send_and_wait(p, threads, &seed, i % 2, i);
        }
        uint32_t begun[2] = {0, 0};
        for (uint32_t i = 0; i < room; i++)
            if (threads == 1)
                begun[p->ping[i].sensor] += p->ping[i].flags & PING_NEW_TURN;
            else
                begun[p->echoes[i].sensor] += p->echoes[i].flags & PING_NEW_TURN;
        CHECK_INT(begun[begins], 1);
        CHECK_INT(begun[1 - begins], 0);
        sem_post(&hold.go);
        pipeline_drain(p);
        pipeline_free(p);
    }
}

static atomic_bool done;

static void *read_on(void *arg)
{
    struct picture *picture = arg;
    uint64_t torn = 0, reads = 0;
    while (!atomic_load(&done))
        for (uint32_t d = 0; d < picture->n; d += 7) {
            struct picture_entry e;
            picture_get(picture, d, &e);
            reads++;
            /* obstacles are listed nearest first, and what has one has its time */
            torn += e.obstacle[1].logodds > 0 && e.obstacle[1].near_m + 0.3f < e.obstacle[0].near_m;
            torn += (e.obstacle[0].logodds > 0) != (e.obstacle[0].t_echo_ns > 0);
        }
    printf("# %llu reads\n", (unsigned long long)reads);
    return (void *)(uintptr_t)torn;
}

TEST(readers_see_whole_entries_while_the_maps_write)
{
    uint64_t seed = 7;
    struct pipeline *p = make(2, true, 8);
    pthread_t reader;
    void *torn;
    atomic_store(&done, false);
    pthread_create(&reader, NULL, read_on, pipeline_picture(p));
    feed(p, &seed, 1500);
    pipeline_drain(p);
    atomic_store(&done, true);
    pthread_join(reader, &torn);
    CHECK_INT((uintptr_t)torn, 0);
    pipeline_free(p);
}

TEST(the_longest_queue_loses_no_buffer)
{
    uint64_t seed = 7;
    struct pipeline *p = make(1, false, PIPELINE_QUEUE_MAX);
    feed(p, &seed, 2 * RING_MAX);
    pipeline_drain(p);
    struct pipeline_stats s;
    struct picture_frame frame;
    pipeline_stats(p, &s);
    picture_get_frame(pipeline_picture(p), &frame);
    CHECK_INT(frame.pings + s.dropped[0], 2 * RING_MAX);
    pipeline_free(p);
}

TEST(it_ends_while_pings_wait)
{
    for (int threads = 0; threads <= 2; threads++) {
        uint64_t seed = 1;
        struct pipeline *p = make(threads, false, 16);
        feed(p, &seed, 10);
        pipeline_free(p);
    }
    CHECK(true);
}

int main(void)
{
    RUN(any_number_of_threads_gives_the_same_picture);
    RUN(any_number_of_threads_gives_the_same_free_water);
    RUN(overload_drops_the_oldest_and_counts_them);
    RUN(what_is_dropped_counts_for_its_own_sonar);
    RUN(a_turn_is_not_lost_with_its_first_ping);
    RUN(readers_see_whole_entries_while_the_maps_write);
    RUN(the_longest_queue_loses_no_buffer);
    RUN(it_ends_while_pings_wait);
    return test_end();
}
