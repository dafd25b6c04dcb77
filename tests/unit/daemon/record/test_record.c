/* SPDX-License-Identifier: MIT */
/*
 * test_record - handing over to the thread that writes: everything arrives, in order; while the disk stalls nobody
 * waits, and what is lost is counted. The disk stalls because this program has a write(2) of its own.
 */
#include "daemon/record/record.h"

#include <dirent.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "core/fault.h"
#include "core/loop.h"
#include "drivers/capture/mcap.h"
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

#define FAULTS_OF_OTHERS 400 /* untouched it would be a thousand and more */

static struct fault fault;
static char dir[64];
static pthread_t loop_thread;
static _Atomic bool stalled;
static _Atomic bool stuck;    /* the writer waits for the disk */
static _Atomic bool complete; /* its file is, as it tells the loop */

ssize_t write(int fd, const void *data, size_t n)
{
    struct stat st;
    const bool by_writer = fd > STDERR_FILENO && !pthread_equal(pthread_self(), loop_thread),
               to_file = by_writer && fstat(fd, &st) == 0 && S_ISREG(st.st_mode);
    while (stalled && to_file) {
        stuck = true;
        usleep(1000);
    }
    complete = complete || (by_writer && !to_file);
    return syscall(SYS_write, fd, data, n);
}

static struct record *begin(int *channel)
{
    loop_thread = pthread_self();
    stalled = stuck = complete = false;
    snprintf(dir, sizeof dir, "/tmp/test_record.XXXXXX");
    if (!mkdtemp(dir))
        exit(2);
    struct record *rec = record_open(
        &(struct segments_conf){.directory = dir, .file_size = 1u << 30, .conf_text = ""}, loop_clock(), &fault);
    *channel = record_channel(rec, "/front/rx", "octet-stream");
    CHECK(record_start(rec, &fault));
    return rec;
}

/* Messages of n bytes that begin with their number, from `first` on. */
static unsigned feed(struct record *rec, int channel, unsigned first, unsigned count, size_t n)
{
    static uint8_t data[SEGMENTS_MESSAGE_BYTES];
    uint64_t state = first + 1;
    unsigned taken = 0;
    for (unsigned i = first; i < first + count; i++) {
        for (size_t k = 0; k + 8 <= n; k += 8) {
            uint64_t v = test_random(&state);
            memcpy(data + k, &v, 8);
        }
        memcpy(data, &i, sizeof i);
        taken += record_message(rec, channel, loop_clock(), data, n);
    }
    return taken;
}

static struct record_status status(struct record *rec)
{
    struct record_status s;
    record_status(rec, &s);
    return s;
}

/* Waits for the disk's side to have taken everything. */
static void settle(struct record *rec)
{
    record_tick(rec);
    WAIT_UNTIL(status(rec).waiting_bytes == 0);
    CHECK_INT(status(rec).waiting_bytes, 0);
}

struct content {
    unsigned messages, gaps, last;
    bool complete;
};

/* Reads the only part, counts where numbers are missing, and removes it. */
static struct content read_and_remove(void)
{
    struct content c = {0};
    char path[400] = "";
    DIR *d = opendir(dir);
    for (struct dirent *e; (e = readdir(d)) != NULL;)
        if (e->d_name[0] != '.')
            snprintf(path, sizeof path, "%s/%s", dir, e->d_name);
    closedir(d);
    struct mcap_reader *r = mcap_open(path, NULL, NULL, &fault);
    struct mcap_message m;
    CHECK(r != NULL);
    while (r && mcap_next(r, &m)) {
        unsigned number;
        memcpy(&number, m.data, sizeof number);
        CHECK(c.messages == 0 || number > c.last);
        c.gaps += c.messages > 0 && number != c.last + 1;
        c.last = number;
        c.messages++;
    }
    c.complete = r && mcap_info(r)->complete;
    mcap_close(r);
    unlink(path);
    rmdir(dir);
    return c;
}

/* Captures that have this configuration attached. */
static int attached(const char *conf)
{
    char path[400];
    int n = 0;
    DIR *d = opendir(dir);
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        struct mcap_attachment a;
        snprintf(path, sizeof path, "%s/%s", dir, e->d_name);
        struct mcap_reader *r = e->d_name[0] == '.' ? NULL : mcap_open(path, NULL, NULL, &fault);
        n += r && mcap_find_attachment(r, "sonard.conf", &a, &fault) && a.size == strlen(conf) &&
             memcmp(a.data, conf, a.size) == 0;
        mcap_close(r);
    }
    closedir(d);
    return n;
}

static void remove_all(void)
{
    char path[400];
    DIR *d = opendir(dir);
    for (struct dirent *e; (e = readdir(d)) != NULL;) {
        snprintf(path, sizeof path, "%s/%s", dir, e->d_name);
        if (e->d_name[0] != '.')
            unlink(path);
    }
    closedir(d);
    rmdir(dir);
}

/* Its messages are lost and counted, and no other's. */
TEST(a_topic_that_was_refused_stops_no_recording)
{
    int channel;
    struct record *rec = begin(&channel);
    feed(rec, channel, 0, 10, 64);
    feed(rec, -1, 0, 3, 64);
    feed(rec, channel, 10, 10, 64);
    settle(rec);
    CHECK(!status(rec).segments.paused);
    CHECK_INT(status(rec).segments.lost_messages, 3);
    record_close(rec, PATIENCE_MS);
    CHECK_INT(read_and_remove().messages, 20);
}

TEST(all_arrive_in_order)
{
    int channel;
    struct record *rec = begin(&channel);
    unsigned number = 0;
    for (size_t n = 4; n < 65536; n = n * 3 + 1, number += 50) {
        CHECK_INT(feed(rec, channel, number, 50, n), 50);
        settle(rec);
    }
    CHECK_INT(status(rec).segments.messages, number);
    CHECK_INT(status(rec).segments.lost_messages, 0);
    record_close(rec, PATIENCE_MS);
    struct content c = read_and_remove();
    CHECK(c.complete && c.messages == number && c.gaps == 0);
}

/* It is a message, and what the next recording begins with, also where it came in between. */
TEST(later_recordings_begin_with_the_configuration_in_force)
{
    static const char *const text[] = {"[log]\n", "[log]\nlevel = err\n"};
    for (int paused = 0; paused < 2; paused++) {
        int channel;
        struct record *rec = begin(&channel);
        feed(rec, channel, 0, 1, 64);
        record_pause(rec, paused, loop_clock());
        CHECK(record_conf(rec, loop_clock(), text[paused], strlen(text[paused])));
        record_pause(rec, true, loop_clock());
        record_pause(rec, false, loop_clock());
        feed(rec, channel, 1, 1, 64);
        settle(rec);
        CHECK_INT(status(rec).segments.messages, paused ? 2 : 3);
        record_close(rec, PATIENCE_MS);
        CHECK_INT(attached(text[paused]), 1);
        remove_all();
    }
}

TEST(a_disk_that_stalls_keeps_nobody_waiting)
{
    int channel;
    struct record *rec = begin(&channel);
    CHECK_INT(feed(rec, channel, 0, 10, 1000), 10);
    settle(rec);
    stalled = true;
    CHECK_INT(feed(rec, channel, 10, 3000, 1200), 3000); /* one and a half minutes of a Ping360 */
    CHECK(status(rec).waiting_bytes > 3000 * 1200 - 600000);
    CHECK(status(rec).overflows == 0);
    stalled = false; /* not before: the loop came here all the same */
    settle(rec);
    record_close(rec, PATIENCE_MS);
    struct content c = read_and_remove();
    CHECK(c.complete && c.messages == 3010 && c.gaps == 0);
}

static long page_faults(void)
{
    struct rusage use;
    getrusage(RUSAGE_THREAD, &use);
    return use.ru_minflt;
}

/* However much waits for the disk: its 8 MiB were there from the start.
 * A sanitizer has memory of its own beside them. */
TEST(what_waits_lies_in_memory_that_is_there)
{
    int channel;
    struct record *rec = begin(&channel);
    stalled = true;
    feed(rec, channel, 0, 1, SEGMENTS_MESSAGE_BYTES); /* the first: of this program's own memory, too */
    const long before = page_faults();
    CHECK(feed(rec, channel, 1, 200, SEGMENTS_MESSAGE_BYTES) < 200);
    CHECK(page_faults() - before < FAULTS_OF_OTHERS);
    stalled = false;
    settle(rec);
    record_close(rec, PATIENCE_MS);
    CHECK(read_and_remove().complete);
}

TEST(what_has_no_room_is_counted)
{
    int channel;
    struct record *rec = begin(&channel);
    stalled = true;
    const unsigned taken = feed(rec, channel, 0, 400, 60000);
    CHECK(taken >= 125 && taken <= 140); /* 8 MiB by pairs, and what the writer has already */
    CHECK_INT(status(rec).overflows, 400 - taken);
    CHECK_INT(status(rec).segments.lost_messages, 400 - taken);
    CHECK_INT(status(rec).segments.messages, 400);
    stalled = false;
    settle(rec);
    CHECK_INT(feed(rec, channel, 400, 5, 60000), 5); /* it goes on */
    record_close(rec, PATIENCE_MS);
    struct content c = read_and_remove();
    CHECK(c.complete && c.gaps > 0);
    CHECK_INT(c.messages, taken + 5);
}

TEST(a_disk_that_never_answers_does_not_keep_the_end)
{
    int channel;
    struct record *rec = begin(&channel);
    stalled = true;
    feed(rec, channel, 0, 100, 10000);
    WAIT_UNTIL(stuck);
    record_close(rec, 100);
    CHECK(stuck && !complete);
    stalled = false;
    WAIT_UNTIL(complete); /* what was left behind comes to its end after all */
    CHECK_INT(read_and_remove().messages, 100);
}

TEST(faults_of_the_start_are_told)
{
    CHECK(record_open(
              &(struct segments_conf){.directory = "/proc/no/such", .file_size = 1, .files = 1, .conf_text = ""},
              0, &fault) == NULL);
    CHECK_STR(fault.text, "recording to /proc/no/such: making the folder: No such file or directory");
    record_close(NULL, 0);
}

int main(void)
{
    RUN(what_waits_lies_in_memory_that_is_there); /* first: memory that was used before faults no more */
    RUN(a_topic_that_was_refused_stops_no_recording);
    RUN(all_arrive_in_order);
    RUN(later_recordings_begin_with_the_configuration_in_force);
    RUN(a_disk_that_stalls_keeps_nobody_waiting);
    RUN(what_has_no_room_is_counted);
    RUN(a_disk_that_never_answers_does_not_keep_the_end);
    RUN(faults_of_the_start_are_told);
    return test_end();
}
