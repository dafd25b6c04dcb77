/* SPDX-License-Identifier: MIT */
/*
 * test_atomic_file - a file is replaced in the order that a power cut needs: the disk has confirmed the new one before
 * it takes the name, and then the name. What goes wrong on the way leaves the old file.
 */
#include "tests/lib/test.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/atomic_file.h"

/* In the place of the C library's: what is done to the disk is noted, and the nth of it fails; 0: none. */
static char journal[400];
static int done, fails;

static bool goes_well(const char *what, const char *path)
{
    const char *name = strrchr(path, '/');
    const size_t n = strlen(journal);
    snprintf(journal + n, sizeof journal - n, "%s %s, ", what, name ? name + 1 : path);
    errno = EIO;
    return ++done != fails;
}

int fsync(int fd)
{
    char link[64], path[200];
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    const ssize_t n = readlink(link, path, sizeof path - 1);
    path[n > 0 ? n : 0] = '\0';
    return goes_well("sync", path) ? 0 : -1;
}

int rename(const char *from, const char *to)
{
    return goes_well("rename", from) ? renameat(AT_FDCWD, from, AT_FDCWD, to) : -1;
}

static char folder[] = "/tmp/sonard-atomic-XXXXXX", path[80], beside[80];

static bool replace(const char *text, struct fault *fault)
{
    journal[0] = '\0';
    done = 0;
    return atomic_file_replace(path, (const uint8_t *)text, strlen(text), 5, fault);
}

static bool holds(const char *text)
{
    size_t size = 0;
    uint8_t *bytes = atomic_file_read(path, 100, &size);
    const bool same = bytes && size == strlen(text) && memcmp(bytes, text, size) == 0;
    free(bytes);
    return same;
}

TEST(the_disk_confirms_the_file_then_its_name)
{
    char want[200];
    struct fault fault;
    fails = 0;
    for (int i = 0; i < 2; i++) { /* where none is, and over the old one */
        CHECK(replace(i ? "MAGIC two" : "MAGIC one", &fault));
        snprintf(want, sizeof want, "sync file.new, rename file.new, sync %s, ", strrchr(folder, '/') + 1);
        CHECK_STR(journal, want);
        CHECK(holds(i ? "MAGIC two" : "MAGIC one") && access(beside, F_OK) != 0);
    }
    unlink(path);
}

TEST(what_fails_before_the_name_is_taken_leaves_the_old_file)
{
    struct fault fault = {""};
    fails = 0;
    CHECK(replace("MAGIC old", &fault));
    for (fails = 1; fails <= 2; fails++) {
        fault.text[0] = '\0';
        CHECK(!replace("MAGIC new", &fault));
        CHECK_INT(done, fails);
        CHECK(strstr(fault.text, strerror(EIO)) != NULL);
        CHECK(holds("MAGIC old") && access(beside, F_OK) != 0);
    }
    unlink(path);
}

TEST(a_name_that_the_disk_has_not_confirmed_is_a_fault)
{
    struct fault fault = {""};
    fails = 3;
    CHECK(!replace("MAGIC new", &fault));
    CHECK(strstr(fault.text, strerror(EIO)) != NULL);
    CHECK(holds("MAGIC new") && access(beside, F_OK) != 0); /* in place, until the power fails */
    unlink(path);
}

/* A FIFO would hold its writer up for ever; a link leads to somebody's file. */
TEST(what_is_no_file_stands_in_the_way_and_is_not_written_to)
{
    struct fault fault = {""};
    fails = 0;
    CHECK_INT(mkfifo(beside, 0600), 0);
    CHECK(!replace("MAGIC new", &fault) && strstr(fault.text, "is no regular file; remove it"));
    unlink(beside);
    CHECK_INT(symlink(path, beside), 0);
    CHECK(!replace("MAGIC new", &fault) && strstr(fault.text, "is no regular file; remove it"));
    CHECK_STR(journal, "");
    CHECK(access(path, F_OK) != 0);
    unlink(beside);
}

int main(void)
{
    if (!mkdtemp(folder)) {
        perror(folder);
        return 1;
    }
    snprintf(path, sizeof path, "%s/file", folder);
    snprintf(beside, sizeof beside, "%s/file.new", folder);
    RUN(the_disk_confirms_the_file_then_its_name);
    RUN(what_fails_before_the_name_is_taken_leaves_the_old_file);
    RUN(a_name_that_the_disk_has_not_confirmed_is_a_fault);
    RUN(what_is_no_file_stands_in_the_way_and_is_not_written_to);
    rmdir(folder);
    return test_end();
}
