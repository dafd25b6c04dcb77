/* SPDX-License-Identifier: MIT */
/* test_file_bytes - a file that is cut off or overwritten while it is read, and captures and CAN logs in it. */
#include "tests/lib/test.h"

#include <fcntl.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "drivers/capture/candump.h"
#include "drivers/capture/file_bytes.h"
#include "drivers/capture/mcap.h"

#define MIB ((size_t)1 << 20)

static char folder[] = "/tmp/sonard-bytes-XXXXXX", path[64];

static uint8_t byte_at(size_t i)
{
    return (uint8_t)(i * 31 + (i >> 12));
}

static void write_file(size_t n)
{
    uint8_t *bytes = malloc(n);
    for (size_t i = 0; i < n; i++)
        bytes[i] = byte_at(i);
    const int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    CHECK(write(fd, bytes, n) == (ssize_t)n);
    close(fd);
    free(bytes);
}

static int wrong(const struct file_bytes *f, size_t from, size_t to)
{
    int n = 0;
    for (size_t i = from; i < to; i++)
        n += file_bytes_data(f)[i] != byte_at(i);
    return n;
}

static bool write_message(struct mcap_writer *w, int channel, uint32_t sequence, uint64_t log_ns, const void *data,
                          size_t size)
{
    struct fault fault;
    const struct mcap_message message = {
        .sequence = sequence, .log_ns = log_ns, .publish_ns = log_ns, .data = data, .size = size};
    return mcap_write_message(w, channel, &message, &fault);
}

TEST(bytes_are_read_as_they_are_needed_and_again)
{
    struct fault fault;
    uint8_t some[3];
    write_file(3 * MIB + 5);
    struct file_bytes *f = file_bytes_open(path, &fault);
    CHECK_INT(file_bytes_size(f), 3 * MIB + 5);
    CHECK(file_bytes_need(f, MIB - 1, 2 * MIB + 1));
    CHECK_INT(wrong(f, MIB - 1, 2 * MIB + 1), 0);
    CHECK_INT(file_bytes_data(f)[3 * MIB], 0);
    CHECK(file_bytes_keep(f, 0, 10));
    file_bytes_drop(f, 3 * MIB);
    CHECK_INT(wrong(f, 0, 10), 0);
    CHECK(file_bytes_data(f)[2 * MIB - 1] == 0);
    CHECK(file_bytes_need(f, 0, 3 * MIB + 5));
    CHECK_INT(wrong(f, 0, 3 * MIB + 5), 0);
    CHECK(file_bytes_peek(f, 3 * MIB + 2, some, 3) && some[2] == byte_at(3 * MIB + 4));
    CHECK(!file_bytes_peek(f, 3 * MIB + 3, some, 3));
    file_bytes_close(f);
}

TEST(a_file_cut_off_meanwhile_ends_in_zeros)
{
    struct fault fault;
    write_file(3 * MIB);
    struct file_bytes *f = file_bytes_open(path, &fault);
    CHECK(file_bytes_need(f, 0, MIB));
    CHECK(truncate(path, 100) == 0);
    CHECK_INT(wrong(f, 0, MIB), 0);
    CHECK(!file_bytes_need(f, 2 * MIB, 3 * MIB));
    CHECK_INT(file_bytes_data(f)[3 * MIB - 1], 0);
    file_bytes_close(f);
}

TEST(what_was_read_does_not_change)
{
    struct fault fault;
    write_file(MIB);
    struct file_bytes *f = file_bytes_open(path, &fault);
    CHECK(file_bytes_need(f, 0, MIB));
    const int fd = open(path, O_WRONLY);
    CHECK(pwrite(fd, "overwritten", 11, 500) == 11);
    close(fd);
    CHECK_INT(wrong(f, 0, MIB), 0);
    file_bytes_close(f);
}

TEST(what_is_no_file_is_refused)
{
    struct fault fault;
    char fifo[80];
    snprintf(fifo, sizeof fifo, "%s.fifo", path);
    CHECK(mkfifo(fifo, 0600) == 0);
    CHECK(!file_bytes_open(fifo, &fault) && strstr(fault.text, "not a file"));
    CHECK(!file_bytes_open(folder, &fault) && strstr(fault.text, "not a file"));
    CHECK(!file_bytes_open("/nonexistent/x", &fault) && strstr(fault.text, "No such file"));
    CHECK(truncate(path, 0) == 0);
    CHECK(!file_bytes_open(path, &fault) && strstr(fault.text, "empty"));
    unlink(fifo);
}

static char problems[4096];

static void note_problem(void *ctx, const char *sentence)
{
    (void)ctx;
    strncat(problems, sentence, sizeof problems - strlen(problems) - 1);
}

/* 40 chunks of 100 kB: cut after the first messages. */
TEST(a_capture_cut_off_meanwhile_is_played_as_far_as_it_is_there)
{
    static uint8_t data[100000];
    struct fault fault;
    struct mcap_message m;
    const struct mcap_options options = {.library = "test", .message_bytes = sizeof data};
    struct mcap_writer *w = mcap_create(open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600), &options, &fault);
    CHECK(w != NULL);
    const int channel = mcap_add_channel(w, "/a/rx", "raw", NULL, 0, &fault);
    uint64_t random = 7;
    for (int i = 0; i < 40; i++) {
        for (size_t k = 0; k < sizeof data; k++)
            data[k] = (uint8_t)test_random(&random);
        CHECK(write_message(w, channel, (uint32_t)i, 1000 + (uint64_t)i, data, sizeof data));
    }
    CHECK(mcap_finish(w, &fault));
    for (int cut = 0; cut < 2; cut++) {
        int n = 0;
        problems[0] = '\0';
        struct mcap_reader *r = mcap_open(path, note_problem, NULL, &fault);
        CHECK(r != NULL);
        while (mcap_next(r, &m)) {
            CHECK(m.size == sizeof data);
            if (++n == 3 && cut)
                CHECK(truncate(path, 400000) == 0);
        }
        if (cut)
            CHECK(n >= 3 && n < 10 && strstr(problems, "was cut off"));
        else
            CHECK(n == 40 && mcap_info(r)->complete && !problems[0]);
        mcap_close(r);
    }
}

TEST(a_can_log_cut_off_meanwhile_ends)
{
    struct fault fault;
    struct candump_frame frame;
    FILE *file = fopen(path, "w");
    for (int i = 0; i < 100000; i++)
        fprintf(file, "(%d.000000) can0 123#%02X\n", i, i % 256);
    fclose(file);
    for (int cut = 0; cut < 2; cut++) {
        int n = 0;
        struct candump *log = candump_open(path, &fault);
        CHECK(log != NULL);
        while (candump_next(log, &frame)) {
            CHECK(frame.frame.data[0] == n % 256);
            if (++n == 5 && cut)
                CHECK(truncate(path, 1000) == 0);
        }
        CHECK(cut ? n > 5 && n < 100000 : n == 100000);
        candump_close(log);
    }
}

int main(void)
{
    if (!mkdtemp(folder))
        return 1;
    snprintf(path, sizeof path, "%s/file", folder);
    RUN(bytes_are_read_as_they_are_needed_and_again);
    RUN(a_file_cut_off_meanwhile_ends_in_zeros);
    RUN(what_was_read_does_not_change);
    RUN(what_is_no_file_is_refused);
    RUN(a_capture_cut_off_meanwhile_is_played_as_far_as_it_is_there);
    RUN(a_can_log_cut_off_meanwhile_ends);
    unlink(path);
    rmdir(folder);
    return test_end();
}
