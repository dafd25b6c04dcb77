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
    struct picture_entry e = {.t_look_ns = number};
    for (int i = 0; i < PICTURE_OBSTACLES; i++)
        e.obstacle[i].t_ref_ns = e.obstacle[i].t_echo_ns = number;
    return e;
}

static bool whole(const struct picture_entry *e)
{
    const struct picture_entry want = entry_of(e->t_look_ns);
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
        back += first.t_look_ns < last;
        last = first.t_look_ns;
        if (picture_still(&picture, number)) {
            mixed += first.t_look_ns != number || end.t_look_ns != number || frame.pings != number;
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
        CHECK_INT(memcmp((const void *)picture.side[0].holds, (const void *)picture.side[1].holds,
                         (picture.n + 63) / 64 * sizeof(uint64_t)),
                  0);
    }
    free(picture.side[0].word);
}

/* Publishes one entry after another of one direction: it holds an obstacle, then it does not. What is told of it is
 * where that begins, or an echo that is too little to block. */
TEST(a_direction_is_marked_while_it_holds_an_obstacle)
{
    static const struct {
        struct picture_entry entry;
        bool holds;
        double told_m;
    } row[] = {
        {{.t_look_ns = 1}, false, INFINITY},
        {{.obstacle = {{.logodds = 1, .near_m = 2}}}, true, 2},
        {{.obstacle = {{.logodds = 1, .near_m = 2}, {.logodds = 1, .near_m = 1.5f}}, .hint_m = 3}, true, 1.5},
        {{.obstacle = {{.logodds = -1}}}, false, INFINITY},
        {{.obstacle = {{.near_m = 2}}, .hint_m = 3}, false, 3}};
    start();
    const uint32_t last = picture.n - 1;
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        picture_begin(&picture);
        picture_set(&picture, last, &row[i].entry);
        picture_end(&picture);
        CHECK_INT(picture_holding(&picture, last / 64), (uint64_t)row[i].holds << last % 64);
        CHECK_INT(picture_holding(&picture, 0), 0);
        CHECK(picture_told_m(&picture, last) == row[i].told_m);
    }
    free(picture.side[0].word);
}

int main(void)
{
    RUN(nothing_is_torn_while_it_changes);
    RUN(both_sides_hold_the_same);
    RUN(a_direction_is_marked_while_it_holds_an_obstacle);
    return test_end();
}
