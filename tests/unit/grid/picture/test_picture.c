/* SPDX-License-Identifier: MIT */
/* The picture under a writer that never rests: every entry whole,
 * and what is read under one number of one publication. */
#include <pthread.h>
#include <stdlib.h>

#include "grid/picture/picture.h"
#include "grid/geometry.h"
#include "tests/lib/test.h"

#define PUBLICATIONS 20000
#define ALL_EVERY    16 /* publications: in the others a few directions change */

static struct rings rings;
static struct picture picture;
static atomic_bool done;

/* All that is in a publication tells its number. */
static struct picture_entry entry_of(uint64_t number)
{
    struct picture_entry e = {0};
    for (int k = 0; k < FREE_INTERVALS; k++)
        e.free[k].t_ping_ns = e.free[k].sensors = number;
    for (int i = 0; i < PICTURE_OBSTACLES; i++)
        e.obstacle[i].t_ref_ns = e.obstacle[i].t_echo_ns = number;
    return e;
}

static bool whole(const struct picture_entry *e)
{
    const struct picture_entry want = entry_of(e->free[0].t_ping_ns);
    return memcmp(e, &want, sizeof want) == 0;
}

/* Direction 0 and the last change every time, the others now and then. */
static void publish(uint64_t number)
{
    const struct picture_frame frame = {.pings = number, .t_ping_ns = number};
    const struct picture_entry e = entry_of(number);
    picture_begin(&picture);
    for (uint32_t d = 0; d < picture.n; d++)
        if (d == 0 || d == picture.n - 1 || number % ALL_EVERY == 0 || (d + number) % 97 == 0)
            picture_set(&picture, d, &e);
    picture_set_frame(&picture, &frame);
    picture_end(&picture);
}

static void *write_on(void *arg)
{
    (void)arg;
    for (uint64_t number = 1; number <= PUBLICATIONS; number++)
        publish(number);
    atomic_store(&done, true);
    return NULL;
}

static void start(void)
{
    static double axis[4096][3];
    CHECK(rings_full(&rings, geo_rad(5)));
    void *memory = aligned_alloc(64, (picture_bytes(rings.n) + 63) / 64 * 64);
    picture_init(&picture, &rings, (const double(*)[3])axis, 60, 0.4, memory);
    atomic_store(&done, false);
}

TEST(nothing_is_torn_while_it_changes)
{
    pthread_t writer;
    uint64_t torn = 0, mixed = 0, back = 0, last = 0, reads = 0;
    start();
    pthread_create(&writer, NULL, write_on, NULL);
    while (!atomic_load(&done)) {
        struct picture_entry first, middle, end;
        struct picture_frame frame;
        const uint64_t number = picture_now(&picture);
        picture_get(&picture, 0, &first);
        picture_get(&picture, picture.n / 2, &middle);
        picture_get_frame(&picture, &frame);
        picture_get(&picture, picture.n - 1, &end);
        torn += (uint64_t)(!whole(&first) + !whole(&middle) + !whole(&end) + (frame.pings != frame.t_ping_ns));
        back += first.free[0].t_ping_ns < last;
        last = first.free[0].t_ping_ns;
        if (picture_still(&picture, number)) {
            mixed += first.free[0].t_ping_ns != number || end.free[0].t_ping_ns != number || frame.pings != number;
            reads++;
        }
    }
    pthread_join(writer, NULL);
    printf("# %llu of the reads met no change\n", (unsigned long long)reads);
    CHECK_INT(torn, 0);
    CHECK_INT(mixed, 0);
    CHECK_INT(back, 0);
    free(picture.side[0].word);
}

TEST(both_sides_hold_the_same)
{
    start();
    for (uint64_t number = 1; number <= 3 * ALL_EVERY; number++) {
        publish(number);
        CHECK_INT(memcmp(picture.side[0].frame, picture.side[1].frame, sizeof picture.side[0].frame), 0);
        CHECK_INT(memcmp((const void *)picture.side[0].word, (const void *)picture.side[1].word,
                         picture.n * sizeof(struct picture_entry)),
                  0);
        CHECK_INT(memcmp((const void *)picture.side[0].block, (const void *)picture.side[1].block,
                         (picture.n + 63) / 64 * sizeof(struct picture_block)),
                  0);
    }
    free(picture.side[0].word);
}

/* Publishes one entry after another of one direction: something is told of it, then nothing is. */
TEST(a_direction_is_told_of_while_its_entry_says_something)
{
    static const struct picture_entry entries[] = {{.free = {{.t_ping_ns = 1}}},
                                                   {.obstacle = {{.logodds = 1, .near_m = 2}}},
                                                   {.obstacle = {{.logodds = -1}}},
                                                   {.obstacle = {{.near_m = 2}}},
                                                   {.free = {{.from_m = 1}}}};
    static const bool told[] = {true, true, true, true, false}, obstacle[] = {false, true, false, false, false};
    start();
    const uint32_t last = picture.n - 1;
    for (size_t i = 0; i < 5; i++) {
        picture_begin(&picture);
        picture_set(&picture, last, &entries[i]);
        picture_end(&picture);
        const struct picture_block b = picture_block(&picture, last / 64);
        CHECK_INT(b.told, (uint64_t)told[i] << last % 64);
        CHECK_INT(b.obstacle, (uint64_t)obstacle[i] << last % 64);
        CHECK_INT(picture_blank(&picture, last), !told[i]);
        CHECK_INT(picture_block(&picture, 0).told, 0);
    }
    free(picture.side[0].word);
}

int main(void)
{
    RUN(nothing_is_torn_while_it_changes);
    RUN(both_sides_hold_the_same);
    RUN(a_direction_is_told_of_while_its_entry_says_something);
    return test_end();
}
