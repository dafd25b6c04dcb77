/* SPDX-License-Identifier: MIT */
/*
 * test_records - what a list of records names stays as it was while the list is open, whatever is entered meanwhile;
 * what finds no slot is counted and makes older water unknown; and two threads. LONG=1 lets these run for longer.
 */
#include "tests/lib/ask_free.h"
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

#include <pthread.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>

#include "daemon/pipeline/records.h"
#include "grid/geometry.h"

#define TICK  UINT64_C(25000000)
#define BEAMS 8

static const struct store_conf conf = {.beams = {BEAMS, 1}, .spare = 4};
static struct records *records;

static void begin_as(const struct store_conf *c)
{
    free(records);
    records = records_init(malloc(records_bytes(c)), c);
}

static void begin(void)
{
    begin_as(&conf);
}

static uint64_t t_of(uint32_t seq)
{
    return (seq + 100) * TICK;
}

/* Of a ping's number, and of no other near it. */
static uint16_t units_of(uint32_t seq)
{
    return (uint16_t)(200 + seq % 997);
}

static struct pose pose_of(uint32_t seq)
{
    struct pose pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    pose.position_m[0] = seq % 2 * 0.5; /* too far apart for any to be spared, or joined */
    pose.path_m = 0.5 * seq;
    return pose;
}

/* The next ping: free to where its number says; of a head, at a bearing that follows no other. */
static void enter(uint16_t sensor, uint32_t seq)
{
    struct beam_echoes beam[BEAMS];
    struct echoes e = {.sensor = sensor,
                       .n_beams = sensor ? 1 : BEAMS,
                       .seq = seq,
                       .t_ns = t_of(seq),
                       .range_max_m = 20,
                       .az_aperture_rad = (float)geo_rad(3),
                       .el_aperture_rad = (float)geo_rad(25),
                       .pose = pose_of(seq),
                       .beam = beam};
    for (int i = 0; i < e.n_beams; i++)
        beam[i] = (struct beam_echoes){.az_rad = (float)geo_rad(sensor ? 40.0 * (seq % 7) : 3.0 * i),
                                       .blind_m = 0.1f,
                                       .free_to_m = (float)(units_of(seq) * WATER_UNIT_M + 1e-3)};
    records_enter(records, &e, &mount_identity);
}

static int view(const struct records_reading *r, uint32_t seq, struct water_view *out)
{
    const struct pose pose = pose_of(seq);
    const struct store_now now = {.now_ns = t_of(seq), .pose = &pose, .clear_for_s = 1000, .move_limit_m = 1000};
    return records_view(records, r, &now, out);
}

/* Is it, whole, what its ping said? */
static bool is_whole(const struct water_record *r)
{
    const struct water_image *image = &r->image;
    bool good = r->newest_ns == t_of(r->seq) && image->columns > 0 && image->columns < 60;
    for (int i = 0; good && i < image->columns * image->rows; i++)
        good = image->cell[i].least == units_of(r->seq);
    return good;
}

static struct water_view seen[ASK_RECORDS];

TEST(nothing_is_known_before_the_first_ping)
{
    struct records_reading r = {0};
    begin();
    records_open(records, &r);
    CHECK(r.open);
    CHECK_INT(view(&r, 0, seen), 0);
    records_close(records, &r);
    records_close(records, &r);
    CHECK(!records->oldest && !records->newest);
}

TEST(an_open_list_stays_as_it_was)
{
    static struct water_view before[ASK_RECORDS];
    struct records_reading r = {0};
    uint32_t seq = 0;
    begin();
    for (; seq < POOL_KEPT; seq++)
        enter(0, seq);
    records_open(records, &r);
    const int n = view(&r, seq, before);
    CHECK_INT(n, POOL_KEPT);
    for (; seq < POOL_KEPT + conf.spare; seq++)
        enter(0, seq);
    CHECK_INT(records->left_out, 0);
    /* from here on each would take a slot that is read */
    for (; seq < 3 * POOL_KEPT; seq++)
        enter(0, seq);
    CHECK_INT(records->left_out, 2 * POOL_KEPT - conf.spare);
    CHECK_INT(view(&r, POOL_KEPT, seen), n);
    for (int i = 0; i < n; i++) {
        CHECK(seen[i].record == before[i].record && is_whole(seen[i].record));
        CHECK_INT(seen[i].record->seq, POOL_KEPT - 1 - i);
        CHECK(!seen[i].lost);
    }
    records_close(records, &r);
    for (uint32_t end = seq + 3 * POOL_KEPT; seq < end; seq++) {
        records_tell(records);
        enter(0, seq);
    }
    CHECK_INT(records->left_out, 2 * POOL_KEPT - conf.spare);
}

TEST(what_was_seen_before_a_ping_that_is_left_out_is_free_no_more)
{
    struct records_reading r = {0}, later = {0};
    const struct ask_question ahead = {.axis = {1, 0, 0}, .half_rad = geo_rad(0.1), .near_m = 0.75, .to_m = 2};
    uint32_t seq = 0;
    begin();
    for (; seq < POOL_KEPT; seq++)
        enter(0, seq);
    records_open(records, &r);
    CHECK(ask_free(seen, view(&r, seq, seen), &ahead).free_to_m >= 1.9);
    for (; records->left_out == 0 && seq < 2 * POOL_KEPT; seq++)
        enter(0, seq);
    records_open(records, &later);
    CHECK(ask_free(seen, view(&later, seq, seen), &ahead).free_to_m <= 0.75);
    records_close(records, &r);
    records_close(records, &later);
    enter(0, seq++);
    records_open(records, &later);
    CHECK_INT(records->left_out, 1);
    CHECK(ask_free(seen, view(&later, seq + 1, seen), &ahead).free_to_m >= 1.9);
    CHECK(!seen[0].lost && seen[1].lost);
}

TEST(the_oldest_open_list_counts_in_whatever_order_they_are_closed)
{
    struct records_reading r[3];
    memset(r, 0, sizeof r);
    begin();
    for (uint32_t i = 0; i < 3; i++) {
        enter(0, i);
        records_open(records, &r[i]);
    }
    records_tell(records);
    CHECK_INT(records->read_from, r[0].list.number);
    records_close(records, &r[1]);
    CHECK_INT(records->read_from, r[0].list.number);
    records_close(records, &r[0]);
    CHECK_INT(records->read_from, r[2].list.number);
    enter(0, 3);
    records_tell(records);
    CHECK_INT(records->read_from, r[2].list.number);
    records_close(records, &r[2]);
    CHECK_INT(records->read_from, 4);
    CHECK(!records->oldest && !records->newest);
}

TEST(a_question_that_takes_too_long_begins_again_and_at_last_knows_nothing)
{
    struct records_reading r = {0};
    uint32_t seq = 0;
    begin();
    enter(0, seq++);
    records_open(records, &r);
    for (int i = 0; i < RECORDS_HELD; i++)
        enter(0, seq++);
    CHECK(records_keeps(records, &r));
    CHECK_INT(view(&r, seq, seen), 1);
    for (int tries = 1; tries < RECORDS_TRIES; tries++) {
        for (int i = 0; i <= RECORDS_HELD; i++)
            enter(0, seq++);
        CHECK(!records_keeps(records, &r));
        CHECK(records_keeps(records, &r));
        CHECK(view(&r, seq, seen) > 1);
        CHECK_INT(seen[0].record->seq, seq - 1);
    }
    for (int i = 0; i <= RECORDS_HELD; i++)
        enter(0, seq++);
    CHECK(!records_keeps(records, &r));
    CHECK(!r.open);
    CHECK_INT(view(&r, seq, seen), 0);
    CHECK(records_keeps(records, &r));
}

/* Its client does not read, so that it does not go on. */
TEST(a_question_that_does_not_go_on_takes_no_slots)
{
    struct records_reading r = {0}, later = {0};
    uint32_t seq = 0;
    begin();
    enter(0, seq++);
    records_open(records, &r);
    for (; seq < 3 * POOL_KEPT; seq++) {
        records_tell(records);
        enter(0, seq);
        if (seq == 5)
            records_open(records, &later);
    }
    CHECK_INT(records->left_out, 0);
    CHECK(!records->oldest && !records->newest);
    CHECK(!records_keeps(records, &r));
    CHECK_INT(r.list.number, seq);
    CHECK(records_keeps(records, &r));
    records_close(records, &later);
    records_close(records, &r);
    CHECK_INT(records->read_from, seq);
}

TEST(the_slots_are_enough_for_all_that_may_wait)
{
    const uint32_t waiting = 18;
    for (int threads = 0; threads <= 2; threads++) {
        const struct store_conf want = {.beams = {BEAMS}, .spare = records_spare(threads, waiting)};
        struct records_reading r = {0};
        uint32_t seq = 0;
        begin_as(&want);
        for (; seq < 2 * POOL_KEPT; seq++) {
            records_tell(records);
            enter(0, seq);
        }
        records_open(records, &r);
        for (uint32_t i = 0; i < RECORDS_HELD + (uint32_t)threads * waiting + 3; i++)
            enter(0, seq++);
        CHECK_INT(records->left_out, 0);
    }
}

/* ---- two threads ---- */

static atomic_bool done;
static uint32_t last;

static void *owner(void *arg)
{
    (void)arg;
    for (uint32_t seq = 0; seq < last; seq++) {
        enter(seq % 3 == 0, seq);
        if (seq % 16 == 0)
            sched_yield();
    }
    atomic_store(&done, true);
    return NULL;
}

/* As the loop has it: some lists open at a time, each looked at several times. */
static long read_on(struct records_reading *r, uint64_t *seed, long *looks)
{
    long wrong = 0;
    if (!r->open)
        records_open(records, r);
    const int n = view(r, UINT32_MAX, seen);
    for (int i = 0; i < n; i++)
        wrong += !is_whole(seen[i].record) || (i > 0 && seen[i].record->newest_ns > seen[i - 1].record->newest_ns);
    *looks += n > 0;
    if (test_random(seed) % 3 == 0)
        records_close(records, r);
    return wrong;
}

/* Once the list is closed, and no order but the module's own between both. */
static void *reuse(void *arg)
{
    uint32_t *seq = arg;
    while (!atomic_load_explicit(&done, memory_order_relaxed))
        sched_yield();
    for (uint32_t i = 0; i < conf.spare; i++)
        enter(0, (*seq)++);
    return NULL;
}

/* Nothing fails but under the thread sanitizer. */
TEST(what_was_read_comes_before_what_is_written_there)
{
    struct records_reading r = {0};
    uint32_t seq = 0;
    pthread_t thread;
    begin();
    for (; seq < POOL_KEPT; seq++)
        enter(0, seq);
    records_open(records, &r);
    for (; seq < POOL_KEPT + conf.spare; seq++)
        enter(0, seq);
    atomic_store(&done, false);
    pthread_create(&thread, NULL, reuse, &seq);
    const int n = view(&r, 0, seen);
    for (int i = n - 8; i < n; i++)
        CHECK(is_whole(seen[i].record));
    records_close(records, &r);
    atomic_store_explicit(&done, true, memory_order_relaxed);
    pthread_join(thread, NULL);
    CHECK_INT(records->left_out, 0);
}

TEST(no_record_of_an_open_list_changes)
{
    static struct records_reading r[3];
    uint64_t seed = test_seed();
    long wrong = 0, looks = 0;
    pthread_t thread;
    begin_as(&(struct store_conf){.beams = {BEAMS, 1}, .spare = 64});
    atomic_store(&done, false);
    last = getenv("LONG") ? 400000 : 8000;
    pthread_create(&thread, NULL, owner, NULL);
    while (!atomic_load(&done)) {
        struct records_reading *one = &r[test_random(&seed) % 3];
        wrong += read_on(one, &seed, &looks);
        records_tell(records);
    }
    pthread_join(thread, NULL);
    for (int i = 0; i < 3; i++)
        records_close(records, &r[i]);
    printf("# %ld lists looked at, %llu of %u records left out\n", looks, (unsigned long long)records->left_out,
           last);
    CHECK_INT(wrong, 0);
}

int main(void)
{
    RUN(nothing_is_known_before_the_first_ping);
    RUN(an_open_list_stays_as_it_was);
    RUN(what_was_seen_before_a_ping_that_is_left_out_is_free_no_more);
    RUN(the_oldest_open_list_counts_in_whatever_order_they_are_closed);
    RUN(a_question_that_takes_too_long_begins_again_and_at_last_knows_nothing);
    RUN(a_question_that_does_not_go_on_takes_no_slots);
    RUN(the_slots_are_enough_for_all_that_may_wait);
    RUN(what_was_read_comes_before_what_is_written_there);
    RUN(no_record_of_an_open_list_changes);
    free(records);
    return test_end();
}
