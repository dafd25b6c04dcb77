/* SPDX-License-Identifier: MIT */
/*
 * test_segments_outage - whatever ends a recording, it goes on by itself in a new file: what the disk says is the
 * test's (linked with --wrap=open,write,ftruncate,sync_file_range,stat), and time is numbers.
 */
#include "daemon/record/segments.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/fault.h"
#include "drivers/capture/mcap.h"
#include "tests/lib/test.h"

#define SECOND 1000000000ull

/* Which calls fail, and how. */
enum { OPEN = 1, WRITE = 2, HALF = 4, CUT = 8, SYNC = 16 };

static struct {
    unsigned calls;
    int error;
    unsigned opened; /* tries to make a file, failed or not */
    bool system;     /* the folder is on the disk of the root folder */
} disk;

static int refuse(void)
{
    errno = disk.error;
    return -1;
}

int __real_open(const char *path, int flags, ...);
int __wrap_open(const char *path, int flags, ...);
int __wrap_open(const char *path, int flags, ...)
{
    va_list ap;
    va_start(ap, flags);
    const mode_t mode = flags & O_CREAT ? va_arg(ap, mode_t) : 0;
    va_end(ap);
    disk.opened += (flags & O_CREAT) != 0;
    return (flags & O_CREAT) && (disk.calls & OPEN) ? refuse() : __real_open(path, flags, mode);
}

ssize_t __real_write(int fd, const void *bytes, size_t n);
ssize_t __wrap_write(int fd, const void *bytes, size_t n);
ssize_t __wrap_write(int fd, const void *bytes, size_t n)
{
    if (disk.calls & HALF && n > 1 && n % 2 == 0)
        return __real_write(fd, bytes, n / 2 | 1);
    return disk.calls & WRITE ? refuse() : __real_write(fd, bytes, n);
}

int __real_ftruncate(int fd, off_t length);
int __wrap_ftruncate(int fd, off_t length);
int __wrap_ftruncate(int fd, off_t length)
{
    return disk.calls & CUT ? refuse() : __real_ftruncate(fd, length);
}

int __real_sync_file_range(int fd, off64_t from, off64_t n, unsigned flags);
int __wrap_sync_file_range(int fd, off64_t from, off64_t n, unsigned flags);
int __wrap_sync_file_range(int fd, off64_t from, off64_t n, unsigned flags)
{
    return disk.calls & SYNC ? refuse() : __real_sync_file_range(fd, from, n, flags);
}

static char base[64], dir[80], aside[80];

int __real_stat(const char *path, struct stat *st);
int __wrap_stat(const char *path, struct stat *st);
int __wrap_stat(const char *path, struct stat *st)
{
    if (strcmp(path, "/") != 0)
        return __real_stat(path, st);
    const int done = __real_stat(base, st);
    st->st_dev += !disk.system;
    return done;
}

/* ---- a recording, and time ---- */

static struct segments *segments;
static const struct segments_status *status;
static uint64_t now_ns;
static int channel;

static void begin(void)
{
    struct fault fault;
    disk.calls = 0;
    disk.system = false;
    snprintf(base, sizeof base, "/tmp/test_outage.XXXXXX");
    if (!mkdtemp(base))
        exit(2);
    snprintf(dir, sizeof dir, "%s/captures", base);
    snprintf(aside, sizeof aside, "%s/aside", base);
    now_ns = SECOND;
    segments =
        segments_open(&(struct segments_conf){.directory = dir, .file_size = 1 << 24, .files = 3, .conf_text = ""},
                      now_ns, &fault);
    CHECK(segments != NULL);
    status = segments_status(segments);
    channel = segments_channel(segments, "/front/rx", "octet-stream");
}

/* A message each half second, as the daemon ticks. */
static void record_for(unsigned seconds)
{
    for (const uint64_t end_ns = now_ns + seconds * SECOND; now_ns < end_ns; now_ns += SECOND / 2) {
        const struct record_time then = {now_ns, now_ns};
        segments_message(segments, channel, &then, "ping", 4);
        segments_tick(segments, now_ns);
    }
}

/* Messages in the files of a folder, which are removed with it; their number in *files. */
static unsigned take_files(const char *folder, unsigned *files)
{
    unsigned n = 0;
    DIR *d = opendir(folder);
    *files = 0;
    for (struct dirent *e; d && (e = readdir(d)) != NULL;) {
        struct mcap_message m;
        struct fault fault;
        char path[400];
        if (e->d_name[0] == '.')
            continue;
        snprintf(path, sizeof path, "%s/%s", folder, e->d_name);
        struct mcap_reader *r = mcap_open(path, NULL, NULL, &fault);
        CHECK(r != NULL);
        while (r && mcap_next(r, &m))
            n++;
        if (r)
            mcap_close(r);
        unlink(path);
        ++*files;
    }
    if (d)
        closedir(d);
    rmdir(folder);
    return n;
}

/* It went on in a new file; all there was is in the files, or said to be lost. */
static void end(bool removed)
{
    unsigned files = 0, more = 0;
    record_for(5);
    CHECK(status->recording);
    CHECK_INT(status->resumed, 1);
    CHECK_INT(status->errors, 1);
    CHECK(status->lost_messages > 0);
    CHECK_INT(status->lost_in_gap, status->lost_messages);
    const uint64_t messages = status->messages, lost = status->lost_messages;
    segments_close(segments);
    const unsigned kept = take_files(dir, &files) + take_files(aside, &more);
    if (removed) /* what was removed was not lost by the recorder */
        CHECK(kept + lost <= messages && kept > 0);
    else
        CHECK(kept + lost >= messages && kept + lost <= messages + 4); /* what was given up may be there */
    CHECK_INT(files + more, removed ? 1 : 2);
    rmdir(base);
}

static void outage(unsigned calls, int error, unsigned seconds)
{
    begin();
    record_for(10);
    CHECK(status->recording);
    disk.calls = calls;
    disk.error = error;
    record_for(seconds);
    CHECK(!status->recording);
    CHECK(strstr(status->error.text, strerror(error)) != NULL);
    CHECK_INT(status->errors, 1);
    disk.calls = 0;
    record_for(seconds < 30 ? seconds + 2 : 31); /* it waits no longer than it has waited, nor half a minute */
    end(false);
}

TEST(recording_goes_on_after_every_error_of_the_disk)
{
    static const int errors[] = {ENOSPC, EIO, EROFS, EDQUOT, ENODEV, ESTALE};
    for (size_t i = 0; i < sizeof errors / sizeof *errors; i++) {
        outage(WRITE, errors[i], 4);
        outage(WRITE | OPEN, errors[i], 120);
        outage(WRITE | HALF, errors[i], 60);
        outage(WRITE | HALF | CUT, errors[i], 60);
    }
    outage(SYNC, EIO, 20);
    outage(SYNC | WRITE, ENOSPC, 20);
}

TEST(the_next_try_comes_soon_and_then_ever_later)
{
    begin();
    record_for(10);
    disk.calls = OPEN | WRITE;
    disk.error = EROFS;
    const unsigned before = disk.opened;
    record_for(8);
    CHECK(disk.opened - before >= 2 && disk.opened - before <= 4);
    record_for(240);
    CHECK(disk.opened - before >= 10 && disk.opened - before <= 14);
    disk.calls = 0;
    record_for(31);
    end(false);
}

/* A file is begun and takes no chunk, again and again: no older file makes room for one that holds nothing. */
TEST(files_without_a_message_push_nothing_out)
{
    unsigned files = 0;
    begin();
    for (int i = 0; i < 6; i++) {
        record_for(5);
        disk.calls = SYNC | WRITE;
        disk.error = ENOSPC;
        record_for(40);
        disk.calls = 0;
        record_for(31);
    }
    CHECK_INT(status->resumed, 6);
    segments_close(segments);
    CHECK(take_files(dir, &files) > 0);
    CHECK_INT(files, 3);
    rmdir(base);
}

TEST(a_folder_that_was_removed_is_made_again)
{
    unsigned files;
    begin();
    record_for(10);
    take_files(dir, &files);
    record_for(10);
    CHECK_INT(status->errors, 1);
    CHECK(strstr(status->error.text, "the file or the folder was removed") != NULL);
    end(true);
}

TEST(a_folder_that_was_moved_is_made_again)
{
    begin();
    record_for(10);
    CHECK_INT(rename(dir, aside), 0);
    record_for(10);
    CHECK(strstr(status->error.text, "the file or the folder was moved") != NULL);
    unsigned files;
    const unsigned kept = take_files(aside, &files);
    CHECK(kept >= 18);
    end(true);
}

/* As when another disk is mounted over it. */
TEST(another_folder_in_its_place_gets_a_file)
{
    unsigned files;
    begin();
    record_for(10);
    CHECK_INT(rename(dir, aside), 0);
    CHECK_INT(mkdir(dir, 0700), 0);
    record_for(10);
    CHECK(take_files(aside, &files) >= 18);
    end(true);
}

/* A stick was pulled: the folder in which it was mounted is there, and on the system's own disk. */
TEST(the_system_s_disk_is_not_filled_in_place_of_another)
{
    for (int was_made = 0; was_made < 2; was_made++) {
        begin();
        record_for(10);
        CHECK_INT(rename(dir, aside), 0);
        if (was_made)
            CHECK_INT(mkdir(dir, 0700), 0);
        disk.system = true;
        record_for(60);
        CHECK(!status->recording);
        CHECK(strstr(status->error.text, "disk is not mounted") != NULL);
        rmdir(dir);
        CHECK_INT(rename(aside, dir), 0); /* it is there again */
        disk.system = false;
        record_for(31);
        CHECK(status->recording);
        CHECK_INT(status->resumed, 1);
        unsigned files;
        segments_close(segments);
        CHECK(take_files(dir, &files) > 0);
        CHECK_INT(files, 2);
        rmdir(base);
    }
}

TEST(a_recording_on_the_system_s_disk_goes_on_there)
{
    begin();
    segments_close(segments);
    struct fault fault;
    unsigned files;
    disk.system = true;
    segments =
        segments_open(&(struct segments_conf){.directory = dir, .file_size = 1 << 24, .files = 3, .conf_text = ""},
                      now_ns, &fault);
    status = segments_status(segments);
    channel = segments_channel(segments, "/front/rx", "octet-stream");
    record_for(10);
    take_files(dir, &files);
    record_for(10);
    end(true);
}

int main(void)
{
    RUN(recording_goes_on_after_every_error_of_the_disk);
    RUN(the_next_try_comes_soon_and_then_ever_later);
    RUN(files_without_a_message_push_nothing_out);
    RUN(a_folder_that_was_removed_is_made_again);
    RUN(a_folder_that_was_moved_is_made_again);
    RUN(another_folder_in_its_place_gets_a_file);
    RUN(the_system_s_disk_is_not_filled_in_place_of_another);
    RUN(a_recording_on_the_system_s_disk_goes_on_there);
    return test_end();
}
