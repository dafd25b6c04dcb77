/* SPDX-License-Identifier: MIT */
/*
 * test_snapshot - what a reader has while its record is being written: never a torn one, never an older one than
 * before, and where the writer stands still in the midst of it, the one before, at once.
 */
#include "tests/lib/test.h"

#include <pthread.h>

#include "core/snapshot.h"

#define WORDS        12
#define MANY         2048 /* words: a reader of so many is overtaken again and again */
#define PUBLICATIONS 300000

struct small {
    uint64_t word[WORDS];
};

struct large {
    uint64_t word[MANY];
};

static SNAPSHOT_OF(struct small) small;
static SNAPSHOT_OF(struct large) large;
static atomic_bool done;

static void *write_small(void *arg)
{
    struct small record;
    (void)arg;
    for (uint64_t n = 1; n <= PUBLICATIONS; n++) {
        for (int i = 0; i < WORDS; i++)
            record.word[i] = n;
        snapshot_publish(&small, &record);
    }
    atomic_store(&done, true);
    return NULL;
}

static void *write_large(void *arg)
{
    static struct large record;
    (void)arg;
    for (uint64_t n = 1; n <= PUBLICATIONS / 30; n++) {
        for (int i = 0; i < MANY; i++)
            record.word[i] = n;
        snapshot_publish(&large, &record);
    }
    atomic_store(&done, true);
    return NULL;
}

/* Not all alike, or older than `last`. */
static bool is_wrong(const uint64_t *word, int n, uint64_t last)
{
    for (int i = 1; i < n; i++)
        if (word[i] != word[0])
            return true;
    return word[0] < last;
}

TEST(no_record_is_torn_or_older_than_the_one_before)
{
    struct small record = {0};
    pthread_t writer;
    uint64_t last = 0, wrong = 0;
    atomic_store(&done, false);
    pthread_create(&writer, NULL, write_small, NULL);
    for (bool end = false; !end;) {
        end = atomic_load(&done);
        snapshot_read(&small, &record);
        wrong += is_wrong(record.word, WORDS, last);
        last = record.word[0];
    }
    pthread_join(writer, NULL);
    CHECK_INT(wrong, 0);
    CHECK_INT(last, PUBLICATIONS);
}

TEST(an_overtaken_reader_has_what_it_had)
{
    static struct large record;
    pthread_t writer;
    uint64_t last = 0, wrong = 0, reads = 0, same = 0;
    atomic_store(&done, false);
    pthread_create(&writer, NULL, write_large, NULL);
    for (bool end = false; !end;) {
        end = atomic_load(&done);
        snapshot_read(&large, &record);
        wrong += is_wrong(record.word, MANY, last);
        same += record.word[0] == last;
        last = record.word[0];
        reads++;
    }
    pthread_join(writer, NULL);
    printf("# %llu reads, %llu of them of the same record again\n", (unsigned long long)reads,
           (unsigned long long)same);
    CHECK_INT(wrong, 0);
    CHECK_INT(last, PUBLICATIONS / 30);
}

/* As on one processor, where the reader has put the writer aside: after every single word of the second record. */
TEST(a_writer_that_stands_still_holds_up_nobody)
{
    static SNAPSHOT_OF(struct small) one;
    const struct small first = {{1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}};
    struct small record;
    snapshot_publish(&one, &first);
    for (uint64_t n = 2; n <= 3; n++) {
        const uint64_t number = snapshot_now(&one.turn);
        for (int i = 0; i < WORDS; i++) {
            snapshot_store(&one.side[snapshot_behind(&one.turn)][i], &n, 1);
            snapshot_read(&one, &record);
            CHECK(!is_wrong(record.word, WORDS, n - 1) && record.word[0] == n - 1);
            CHECK(snapshot_still(&one.turn, number));
        }
        snapshot_turn(&one.turn);
        snapshot_read(&one, &record);
        CHECK(!is_wrong(record.word, WORDS, n));
    }
}

TEST(before_the_first_it_is_all_zeros)
{
    static SNAPSHOT_OF(struct small) none;
    struct small record = {{7}};
    snapshot_read(&none, &record);
    CHECK_INT(record.word[0], 0);
    CHECK(!is_wrong(record.word, WORDS, 0));
}

int main(void)
{
    RUN(no_record_is_torn_or_older_than_the_one_before);
    RUN(an_overtaken_reader_has_what_it_had);
    RUN(a_writer_that_stands_still_holds_up_nobody);
    RUN(before_the_first_it_is_all_zeros);
    return test_end();
}
