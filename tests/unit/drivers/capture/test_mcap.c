/* SPDX-License-Identifier: MIT */
/* test_mcap - captures survive the round trip, the power cut, the flipped bit and the lie about a length. */
#include "drivers/capture/mcap.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "core/fault.h"
#include "tests/lib/test.h"

static struct fault fault;

/* ---- a file in memory ---- */

struct image {
    uint8_t *p;
    size_t n;
};

static struct image image_of(int fd)
{
    struct stat st;
    struct image image = {0};
    if (fstat(fd, &st) == 0 && (image.p = malloc((size_t)st.st_size + 1)) != NULL)
        image.n = (size_t)pread(fd, image.p, (size_t)st.st_size, 0);
    return image;
}

static int new_file(void)
{
    return memfd_create("capture", MFD_CLOEXEC);
}

/* Message i of a test file: its size and bytes follow from i. */
static size_t message_size(unsigned i)
{
    return i % 7 == 0 ? 0 : 3 + i * 37 % 300;
}

static void message_fill(unsigned i, uint8_t *p)
{
    for (size_t k = 0; k < message_size(i); k++)
        p[k] = (uint8_t)(i * 31 + k / 9);
}

static bool write_message(struct mcap_writer *w, int channel, uint32_t sequence, uint64_t log_ns, const void *data,
                          size_t size)
{
    const struct mcap_message message = {
        .sequence = sequence, .log_ns = log_ns, .publish_ns = log_ns, .data = data, .size = size};
    return mcap_write_message(w, channel, &message, &fault);
}

static bool put_messages(struct mcap_writer *w, unsigned from, unsigned to, const int *channel)
{
    uint8_t data[512];
    for (unsigned i = from; i < to; i++) {
        message_fill(i, data);
        if (!write_message(w, channel[i % 2], i, 1000 + i, data, message_size(i)))
            return false;
    }
    return true;
}

/* n messages on two channels, an attachment, chunks of about chunk_bytes. */
static struct image make_file(enum mcap_compression compression, unsigned n, size_t chunk_bytes)
{
    struct mcap_options options = {"test 1", compression, chunk_bytes, 1024, 0, NULL};
    struct mcap_pair metadata[] = {{"device", "ping360"}, {"port", "serial:/dev/null:115200"}};
    int fd = new_file(), copy = dup(fd);
    struct mcap_writer *w = mcap_create(fd, &options, &fault);
    int channel[2] = {-1, -1};
    if (w) {
        channel[0] = mcap_add_channel(w, "/front/rx", "octet-stream", metadata, 2, &fault);
        channel[1] = mcap_add_channel(w, "/pose", "json", NULL, 0, &fault);
        mcap_attach(w,
                    &(struct mcap_attachment){.log_ns = 5,
                                              .name = "sonard.conf",
                                              .media_type = "text/plain",
                                              .data = (const uint8_t *)"[log]\n",
                                              .size = 6},
                    &fault);
        put_messages(w, 0, n, channel);
        CHECK(mcap_finish(w, &fault));
    }
    struct image image = image_of(copy);
    close(copy);
    return image;
}

/* ---- reading a file and comparing it with what was put in ---- */

struct seen {
    unsigned messages, wrong;
    bool summary; /* has a last time: */
    uint64_t end_ns;
    struct mcap_info info;
    char first_problem[256];
};

static void note_problem(void *ctx, const char *sentence)
{
    struct seen *seen = ctx;
    if (!seen->first_problem[0])
        snprintf(seen->first_problem, sizeof seen->first_problem, "%s", sentence);
}

static bool message_right(const struct mcap_message *m)
{
    uint8_t want[512];
    if (m->sequence > 100000)
        return false;
    message_fill(m->sequence, want);
    return m->size == message_size(m->sequence) && (m->size == 0 || memcmp(m->data, want, m->size) == 0) &&
           m->log_ns == 1000 + m->sequence && m->publish_ns == m->log_ns &&
           strcmp(m->channel->topic, m->sequence % 2 ? "/pose" : "/front/rx") == 0 &&
           strcmp(m->channel->encoding, m->sequence % 2 ? "json" : "octet-stream") == 0;
}

static bool read_file(const uint8_t *p, size_t n, struct seen *seen)
{
    struct mcap_message m;
    *seen = (struct seen){0};
    struct mcap_reader *r = mcap_open_memory(p, n, note_problem, seen, &fault);
    if (!r)
        return false;
    seen->summary = mcap_summary_end(r, &seen->end_ns);
    for (unsigned i = 0; mcap_next(r, &m); i++) {
        seen->messages++;
        seen->wrong += !message_right(&m);
    }
    seen->info = *mcap_info(r);
    mcap_close(r);
    return true;
}

/* ---- cases ---- */

static void round_trip(enum mcap_compression compression)
{
    struct image f = make_file(compression, 500, 4096);
    struct seen seen;
    CHECK(read_file(f.p, f.n, &seen));
    CHECK_INT(seen.messages, 500);
    CHECK_INT(seen.wrong, 0);
    CHECK_INT(seen.info.problems, 0);
    CHECK_STR(seen.first_problem, "");
    CHECK_INT(seen.info.complete, true);
    CHECK_INT(seen.info.start_ns, 1000);
    CHECK_INT(seen.info.end_ns, 1499);
    CHECK(seen.summary && seen.end_ns == 1499);
    CHECK_INT(seen.info.attachments, 1);
    CHECK(seen.info.chunks > 10);
    CHECK_STR(seen.info.profile, "sonard");
    CHECK_STR(seen.info.library, "test 1");
    free(f.p);
}

TEST(round_trip_lz4)
{
    round_trip(MCAP_LZ4);
}

TEST(round_trip_zstd)
{
    round_trip(MCAP_ZSTD);
}

TEST(round_trip_uncompressed)
{
    round_trip(MCAP_NONE);
}

TEST(empty_capture_is_complete)
{
    struct image f = make_file(MCAP_LZ4, 0, 0);
    struct seen seen;
    CHECK(read_file(f.p, f.n, &seen));
    CHECK_INT(seen.messages, 0);
    CHECK_INT(seen.info.complete, true);
    CHECK_INT(seen.info.problems, 0);
    CHECK(!seen.summary);
    free(f.p);
}

TEST(channels_and_metadata_come_back)
{
    struct image f = make_file(MCAP_LZ4, 4, 0);
    struct mcap_reader *r = mcap_open_memory(f.p, f.n, NULL, NULL, &fault);
    struct mcap_message m;
    while (mcap_next(r, &m)) {
    }
    const struct mcap_channel *front = mcap_channel_at(r, 0), *pose = mcap_channel_at(r, 1);
    CHECK_STR(front->topic, "/front/rx");
    CHECK_INT(front->n_metadata, 2);
    CHECK_STR(front->metadata[0].key, "device");
    CHECK_STR(front->metadata[1].value, "serial:/dev/null:115200");
    CHECK_INT(front->messages, 2);
    CHECK_STR(pose->topic, "/pose");
    CHECK_INT(pose->n_metadata, 0);
    CHECK(mcap_channel_at(r, 2) == NULL);
    mcap_close(r);
    free(f.p);
}

TEST(attachment_is_found_by_name)
{
    struct image f = make_file(MCAP_LZ4, 4, 0);
    struct mcap_reader *r = mcap_open_memory(f.p, f.n, NULL, NULL, &fault);
    struct mcap_attachment a;
    CHECK(mcap_find_attachment(r, "sonard.conf", &a, &fault));
    CHECK_INT(a.size, 6);
    CHECK(memcmp(a.data, "[log]\n", 6) == 0);
    CHECK_STR(a.media_type, "text/plain");
    CHECK(!mcap_find_attachment(r, "other", &a, &fault));
    CHECK_STR(fault.text, "no attachment other");
    mcap_close(r);
    free(f.p);
}

TEST(damaged_attachment_is_refused)
{
    struct image f = make_file(MCAP_LZ4, 4, 0);
    uint8_t *text = memmem(f.p, f.n, "[log]\n", 6);
    struct mcap_attachment a;
    text[1] ^= 1;
    struct mcap_reader *r = mcap_open_memory(f.p, f.n, NULL, NULL, &fault);
    CHECK(!mcap_find_attachment(r, "sonard.conf", &a, &fault));
    CHECK_STR(fault.text, "attachment sonard.conf: its checksum is wrong");
    mcap_close(r);
    free(f.p);
}

/* End of the k-th chunk record (from 0) as an offset, walking the records as the specification has them. */
static size_t chunk_end(const struct image *f, unsigned k, size_t *start)
{
    for (size_t at = 8; at + 9 <= f->n;) {
        uint64_t length = 0;
        for (int i = 7; i >= 0; i--)
            length = length << 8 | f->p[at + 1 + (size_t)i];
        size_t next = at + 9 + (size_t)length;
        if (f->p[at] == 0x06 && k-- == 0) {
            *start = at;
            return next;
        }
        at = next;
    }
    *start = f->n;
    return f->n;
}

/* And what can be read of the chunk that is cut: never less for a byte more, and nothing that was not written. */
static void cut_at_every_byte(enum mcap_compression compression)
{
    struct image f = make_file(compression, 40, 1024);
    unsigned whole_messages = 0, chunk = 0, before = 0;
    size_t start, end = chunk_end(&f, 0, &start), in_cut = 0;
    for (size_t n = 0; n < f.n; n++) {
        struct seen seen = {0};
        uint8_t *copy = malloc(n + 1); /* of exact size, so that a sanitizer sees every overrun */
        copy = realloc(copy, n ? n : 1);
        memcpy(copy, f.p, n);
        bool open = read_file(copy, n, &seen);
        free(copy);
        CHECK(open == (n >= 8));
        if (!open)
            continue;
        if (n == end) { /* one more chunk is whole now */
            CHECK(seen.messages > whole_messages);
            whole_messages = before = seen.messages;
            end = chunk_end(&f, ++chunk, &start);
        }
        const bool falls = seen.messages < before;
        in_cut += seen.messages > whole_messages;
        before = seen.messages;
        if (falls || seen.messages < whole_messages || seen.wrong || seen.info.complete || seen.summary ||
            seen.info.problems == 0) {
            printf("cut at %zu: %u messages (%u whole), %u wrong, %s\n", n, seen.messages, whole_messages,
                   seen.wrong, seen.first_problem);
            CHECK(false);
            break;
        }
    }
    CHECK_INT(whole_messages, 40);
    CHECK(chunk >= 3);
    CHECK(compression == MCAP_ZSTD || in_cut > f.n / 4); /* a short block of zstd is all or nothing */
    free(f.p);
}

TEST(cut_at_every_byte_keeps_all_whole_chunks_and_the_head_of_the_cut_one)
{
    cut_at_every_byte(MCAP_LZ4);
    cut_at_every_byte(MCAP_NONE);
    cut_at_every_byte(MCAP_ZSTD);
}

TEST(every_flipped_bit_is_reported_or_harmless)
{
    struct image f = make_file(MCAP_LZ4, 40, 1024);
    unsigned unseen = 0, bad = 0;
    for (size_t bit = 0; bit < 8 * f.n; bit++) {
        struct seen seen;
        f.p[bit / 8] ^= (uint8_t)(1u << bit % 8);
        if (read_file(f.p, f.n, &seen)) {
            bool equal = seen.messages == 40 && !seen.wrong;
            if ((!equal && seen.info.problems == 0) || (seen.summary && seen.end_ns != 1039))
                bad++;
            unseen += seen.info.problems == 0;
        } else {
            CHECK(bit < 64);
        }
        f.p[bit / 8] ^= (uint8_t)(1u << bit % 8);
    }
    CHECK_INT(bad, 0);
    if (unseen)
        printf("# %u of %zu flipped bits were harmless and not reported\n", unseen, 8 * f.n);
    free(f.p);
}

TEST(changed_summary_is_reported)
{
    struct image f = make_file(MCAP_LZ4, 10, 0);
    struct seen seen;
    uint8_t *p = memmem(f.p, f.n, "/pose", 5); /* where the channel is announced ... */
    p = memmem(p + 5, (size_t)(f.p + f.n - p) - 5, "/pose", 5);
    CHECK(p != NULL); /* ... and again in the summary */
    *p ^= 1;
    CHECK(read_file(f.p, f.n, &seen));
    CHECK_INT(seen.messages, 10);
    CHECK_INT(seen.info.problems, 1);
    CHECK(strstr(seen.first_problem, "was changed: its checksum is wrong") != NULL);
    CHECK(!seen.info.complete);
    free(f.p);
}

TEST(chunk_with_wrong_checksum_is_skipped_and_named)
{
    struct image f = make_file(MCAP_NONE, 100, 1024);
    struct seen good, seen;
    size_t start, end = chunk_end(&f, 1, &start);
    char where[64];
    read_file(f.p, f.n, &good);
    f.p[end - 1] ^= 0x10;
    CHECK(read_file(f.p, f.n, &seen));
    snprintf(where, sizeof where, "chunk at offset %zu is left out: its checksum is wrong", start);
    CHECK_STR(seen.first_problem, where);
    CHECK_INT(seen.info.problems, 1);
    CHECK_INT(seen.info.left_out_bytes, end - start);
    CHECK_INT(seen.info.chunks, good.info.chunks - 1);
    CHECK(seen.messages > 80 && seen.messages < 100);
    CHECK_INT(seen.wrong, 0);
    free(f.p);
}

TEST(reading_goes_on_at_the_next_chunk_after_a_broken_length)
{
    struct image f = make_file(MCAP_LZ4, 100, 1024);
    struct seen seen;
    size_t start;
    chunk_end(&f, 1, &start);
    f.p[start + 7] = 0x7f; /* the chunk's record now claims to be longer than any disk */
    CHECK(read_file(f.p, f.n, &seen));
    CHECK_INT(seen.info.problems, 1);
    CHECK(seen.messages > 80 && seen.messages < 100);
    CHECK_INT(seen.wrong, 0);
    CHECK(seen.info.complete);
    free(f.p);
}

TEST(unknown_records_are_passed_over)
{
    struct image f = make_file(MCAP_LZ4, 10, 0);
    static const uint8_t foreign[] = {0x80, 3, 0, 0, 0, 0, 0, 0, 0, 1, 2, 3, 0x0c, 0, 0, 0, 0, 0, 0, 0, 0};
    struct seen seen;
    size_t start;
    chunk_end(&f, 0, &start);
    uint8_t *longer = malloc(f.n + sizeof foreign);
    memcpy(longer, f.p, start);
    memcpy(longer + start, foreign, sizeof foreign);
    memcpy(longer + start + sizeof foreign, f.p + start, f.n - start);
    CHECK(read_file(longer, f.n + sizeof foreign, &seen));
    CHECK_INT(seen.messages, 10);
    CHECK_INT(seen.wrong, 0);
    free(longer);
    free(f.p);
}

/* A chunk record around `records`, with the fields as given. */
static size_t raw_chunk(uint8_t *p, uint64_t unpacked, const char *compression, const void *records, size_t n)
{
    size_t names = strlen(compression), at = 0;
    uint64_t content = 8 + 8 + 8 + 4 + 4 + names + 8 + n;
    p[at++] = 0x06;
    for (int i = 0; i < 8; i++)
        p[at++] = (uint8_t)(content >> 8 * i);
    memset(p + at, 0, 16);
    at += 16;
    for (int i = 0; i < 8; i++)
        p[at++] = (uint8_t)(unpacked >> 8 * i);
    memset(p + at, 0, 4);
    at += 4;
    for (int i = 0; i < 4; i++)
        p[at++] = (uint8_t)(names >> 8 * i);
    memcpy(p + at, compression, names);
    at += names;
    for (int i = 0; i < 8; i++)
        p[at++] = (uint8_t)((uint64_t)n >> 8 * i);
    memcpy(p + at, records, n);
    return at + n;
}

/* The file without the n bytes at `at`. */
static void cut_out(struct image *f, size_t at, size_t n)
{
    memmove(f->p + at, f->p + at + n, f->n - at - n);
    f->n -= n;
}

TEST(hole_in_a_chunk_costs_that_chunk_only)
{
    static const enum mcap_compression compression[] = {MCAP_NONE, MCAP_LZ4};
    for (size_t i = 0; i < sizeof compression / sizeof compression[0]; i++) {
        struct image f = make_file(compression[i], 100, 1024);
        struct seen good, seen;
        size_t start;
        read_file(f.p, f.n, &good);
        chunk_end(&f, 1, &start);
        cut_out(&f, start + 100, 40);
        CHECK(read_file(f.p, f.n, &seen));
        CHECK_INT(seen.info.chunks, good.info.chunks - 1);
        CHECK_INT(seen.info.attachments, 1);
        CHECK_INT(seen.wrong, 0);
        CHECK(!mcap_is_mostly_lost(&seen.info));
        free(f.p);
    }
}

TEST(index_with_a_wrong_length_costs_no_chunk)
{
    struct image f = make_file(MCAP_LZ4, 100, 1024);
    struct seen good, seen;
    size_t start, end = chunk_end(&f, 1, &start);
    read_file(f.p, f.n, &good);
    CHECK_INT(f.p[end], 0x07);
    f.p[end + 2] ^= 0x04; /* 1024 bytes longer: it ends in the next chunk */
    CHECK(read_file(f.p, f.n, &seen));
    CHECK_INT(seen.info.chunks, good.info.chunks);
    CHECK_INT(seen.messages, 100);
    CHECK_INT(seen.wrong, 0);
    CHECK(seen.info.problems > 0);
    free(f.p);
}

TEST(channel_whose_record_is_damaged_comes_from_the_summary)
{
    static const struct {
        int at; /* from the record's topic */
        uint8_t bit;
        const char *problem;
    } row[] = {
        {-17, 0x80, "is known from the summary only: its own record is damaged or missing"},
        {-8, 0x08, "is known from the summary only: its own record is damaged or missing"},
        {1, 0x01, "is announced with another name than in the summary; that of the summary stays"},
        {-4, 0x40, "the channel record is malformed or over 4096 bytes of text"},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct image f = make_file(MCAP_LZ4, 40, 1024);
        struct seen seen;
        uint8_t *topic = memmem(f.p, f.n, "/front/rx", 9);
        topic[row[i].at] ^= row[i].bit;
        CHECK(read_file(f.p, f.n, &seen));
        CHECK_INT(seen.messages, 40);
        CHECK_INT(seen.wrong, 0);
        CHECK(strstr(seen.first_problem, row[i].problem) != NULL);
        free(f.p);
    }
}

#define PLAIN_MESSAGES 6

/* Channel 0 and PLAIN_MESSAGES messages without a chunk around them; where message i begins goes to at[i]. */
static size_t plain_messages(uint8_t *p, size_t *at)
{
    static const uint8_t channel[] = {0x04, 25,  0,   0,   0,   0,   0,   0,   0,   0, 0, 0, 0, 9, 0, 0, 0,
                                      '/',  'f', 'r', 'o', 'n', 't', '/', 'r', 'x', 0, 0, 0, 0, 0, 0, 0, 0};
    size_t n = sizeof channel;
    memcpy(p, channel, n);
    for (unsigned i = 0; i < PLAIN_MESSAGES; i++) {
        const size_t data = 2 * i + 10;
        at[i] = n;
        memset(p + n, 0, 31);
        p[n] = 0x05;
        p[n + 1] = (uint8_t)(22 + data);
        p[n + 11] = (uint8_t)i;
        p[n + 15] = (uint8_t)i;
        memset(p + n + 31, 'x', data);
        n += 31 + data;
    }
    return n;
}

/* Messages have no checksum; what stands behind a broken length is found again all the same, in a chunk or without. */
TEST(reading_goes_on_at_the_next_message_after_a_broken_length)
{
    static const uint8_t bits[] = {0x10, 0x80}; /* flipped: longer by a few bytes, longer than all that follows */
    for (size_t i = 0; i < 2 * sizeof bits; i++) {
        uint8_t records[512], file[1024] = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
        size_t at[PLAIN_MESSAGES], n = plain_messages(records, at);
        struct seen seen;
        records[at[2] + (bits[i / 2] == 0x80 ? 4 : 1)] ^= bits[i / 2];
        if (i % 2)
            n = raw_chunk(file + 8, n, "", records, n);
        else
            memcpy(file + 8, records, n);
        CHECK(read_file(file, 8 + n, &seen));
        CHECK_INT(seen.messages, PLAIN_MESSAGES - 1);
        CHECK(strstr(seen.first_problem, i % 2 ? "damaged at its byte" : "no whole record") != NULL);
    }
}

TEST(file_of_which_most_is_left_out_says_so)
{
    struct image f = make_file(MCAP_NONE, 100, 1024);
    struct seen seen;
    read_file(f.p, f.n, &seen);
    CHECK(!mcap_is_mostly_lost(&seen.info));
    memset(f.p + f.n / 4, 0x55, f.n * 5 / 8);
    CHECK(read_file(f.p, f.n, &seen));
    CHECK(seen.messages > 0);
    CHECK(mcap_is_mostly_lost(&seen.info));
    free(f.p);
}

TEST(lies_in_chunks_are_refused)
{
    static const uint8_t long_record[] = {0x05, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f, 1, 2};
    static const uint8_t short_message[] = {0x05, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    static const uint8_t stranger[] = {0x05, 22, 0, 0, 0, 0, 0, 0, 0, 9, 9, 0, 0, 0, 0, 0,
                                       0,    0,  0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    static const struct {
        const char *name;
        uint64_t unpacked;
        const char *compression;
        const uint8_t *records;
        size_t n;
        const char *want;
    } row[] = {
        {"bomb", 1ull << 40, "zstd", short_message, 11,
         "chunk at offset 8 is left out: it says it unpacks to more than 64 MiB"},
        {"size and bytes differ", 12, "", short_message, 11,
         "chunk at offset 8 is left out: it cannot be unpacked to the size it states"},
        {"garbage as lz4", 11, "lz4", short_message, 11,
         "chunk at offset 8 is left out: it cannot be unpacked to the size it states"},
        {"garbage as zstd", 11, "zstd", short_message, 11,
         "chunk at offset 8 is left out: it cannot be unpacked to the size it states"},
        {"unknown compression", 11, "bz2", short_message, 11,
         "chunk at offset 8 is left out: its compression is none of \"\", lz4, zstd"},
        {"record beyond the chunk", 11, "", long_record, 11,
         "chunk at offset 8: truncated after its byte 0; the rest is skipped"},
        {"message too short", 11, "", short_message, 11,
         "offset 8: a message record is too short for its own fields"},
        {"channel never announced", 31, "", stranger, 31,
         "offset 8: messages of channel 2313, which was never announced, are left out"},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        uint8_t file[256] = {0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
        struct seen seen;
        size_t n = 8 + raw_chunk(file + 8, row[i].unpacked, row[i].compression, row[i].records, row[i].n);
        CHECK(read_file(file, n, &seen));
        CHECK_STR(seen.first_problem, row[i].want);
        CHECK_INT(seen.messages, 0);
    }
}

TEST(zeros_at_the_end_of_a_cut_file_are_left_out)
{
    struct image f = make_file(MCAP_LZ4, 20, 1024);
    struct seen seen;
    size_t start, end = chunk_end(&f, 0, &start);
    memset(f.p + end, 0, f.n - end);
    CHECK(read_file(f.p, f.n, &seen));
    CHECK(seen.messages > 0);
    CHECK_INT(seen.wrong, 0);
    CHECK_INT(seen.info.left_out_bytes, f.n - end);
    free(f.p);
}

TEST(file_with_other_first_bytes_is_no_capture)
{
    CHECK(mcap_open_memory("hello, sea", 10, NULL, NULL, &fault) == NULL);
    CHECK(mcap_open_memory("", 0, NULL, NULL, &fault) == NULL);
    CHECK(mcap_open("/nonexistent/x.mcap", NULL, NULL, &fault) == NULL);
    CHECK_STR(fault.text, "/nonexistent/x.mcap: No such file or directory");
    CHECK(mcap_open("/", NULL, NULL, &fault) == NULL);
    CHECK_STR(fault.text, "/: not a file");
}

TEST(message_over_the_limit_is_refused_and_the_next_one_kept)
{
    struct mcap_options options = {"test", MCAP_LZ4, 512, 4096, 0, NULL};
    static uint8_t big[5000];
    int fd = new_file(), copy = dup(fd);
    struct mcap_writer *w = mcap_create(fd, &options, &fault);
    int c = mcap_add_channel(w, "/a", "octet-stream", NULL, 0, &fault);
    CHECK(!write_message(w, c, 0, 1, big, 4097));
    CHECK_STR(fault.text, "a message of 4097 bytes; 4096 is the limit");
    CHECK(write_message(w, c, 1, 2, big, 10));
    CHECK(write_message(w, c, 2, 3, big, 4096)); /* larger than a chunk: one of its own */
    CHECK(write_message(w, c, 3, 4, big, 10));
    CHECK(!write_message(w, c + 1, 4, 5, big, 10));
    CHECK(mcap_finish(w, &fault));
    struct image f = image_of(copy);
    struct seen seen;
    read_file(f.p, f.n, &seen);
    CHECK_INT(seen.messages, 3);
    CHECK_INT(seen.info.chunks, 3);
    CHECK_INT(seen.info.problems, 0);
    close(copy);
    free(f.p);
}

TEST(full_index_asks_for_another_file)
{
    struct mcap_options options = {"test", MCAP_LZ4, 0, 0, 300, NULL};
    int fd = new_file();
    struct mcap_writer *w = mcap_create(fd, &options, &fault);
    int c = mcap_add_channel(w, "/a", "octet-stream", NULL, 0, &fault);
    unsigned n = 0;
    while (!mcap_written(w).full && n < 100) {
        CHECK(write_message(w, c, n, n, "x", 1));
        CHECK(mcap_flush(w, &fault));
        n++;
    }
    CHECK(n >= 2 && n < 5);
    CHECK(!write_message(w, c, n, n, "x", 1));
    CHECK(mcap_finish(w, &fault));
}

TEST(full_disk_is_said_and_the_file_stays_whole)
{
    struct rlimit old, small = {6000, RLIM_INFINITY};
    struct mcap_options options = {"test 1", MCAP_NONE, 1024, 1024, 0, NULL};
    int fd = new_file(), copy = dup(fd);
    struct mcap_writer *w = mcap_create(fd, &options, &fault);
    int channel[2] = {mcap_add_channel(w, "/front/rx", "octet-stream", NULL, 0, &fault),
                      mcap_add_channel(w, "/pose", "json", NULL, 0, &fault)};
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old);
    small.rlim_max = old.rlim_max;
    setrlimit(RLIMIT_FSIZE, &small);
    bool all = put_messages(w, 0, 200, channel);
    struct mcap_written at_fault = mcap_written(w);
    CHECK(!all);
    CHECK(strstr(fault.text, "File too large") != NULL);
    CHECK(at_fault.lost > 0);
    setrlimit(RLIMIT_FSIZE, &old);

    struct image f = image_of(copy); /* as it stands on disk at that moment */
    struct seen seen;
    CHECK_INT(f.n, at_fault.bytes);
    CHECK(read_file(f.p, f.n, &seen));
    CHECK_INT(seen.messages, at_fault.messages);
    CHECK_INT(seen.wrong, 0);
    CHECK_INT(seen.info.left_out_bytes, 0);
    free(f.p);

    CHECK(put_messages(w, 100, 110, channel)); /* space is back */
    CHECK(mcap_finish(w, &fault));
    f = image_of(copy);
    CHECK(read_file(f.p, f.n, &seen));
    CHECK_INT(seen.messages, at_fault.messages + 10);
    CHECK(seen.info.complete);
    free(f.p);
    close(copy);
}

TEST(device_that_takes_nothing_is_refused_at_once)
{
    struct mcap_options options = {.library = "test"};
    CHECK(mcap_create(open("/dev/full", O_WRONLY | O_CLOEXEC), &options, &fault) == NULL);
    CHECK(strstr(fault.text, "No space left on device") != NULL);
}

TEST(random_files_round_trip)
{
    uint64_t seed = test_seed();
    static uint8_t data[2000], random_bytes[2000];
    for (int round = 0; round < 30; round++) {
        struct mcap_options options = {"test",
                                       (enum mcap_compression)(test_random(&seed) % 3),
                                       1 + test_random(&seed) % 5000,
                                       sizeof data,
                                       1 << 20,
                                       NULL};
        int fd = new_file(), copy = dup(fd);
        struct mcap_writer *w = mcap_create(fd, &options, &fault);
        int c = mcap_add_channel(w, "/a", "octet-stream", NULL, 0, &fault);
        unsigned n = (unsigned)(test_random(&seed) % 200);
        uint32_t crc = 0, got_crc = 0;
        for (size_t k = 0; k < sizeof random_bytes; k++)
            random_bytes[k] = (uint8_t)test_random(&seed);
        for (unsigned i = 0; i < n; i++) {
            size_t size = test_random(&seed) % sizeof data;
            memcpy(data, random_bytes, size);
            crc = (uint32_t)crc32(crc, data, (uInt)size);
            CHECK(write_message(w, c, i, test_random(&seed), data, size));
            if (test_random(&seed) % 10 == 0)
                CHECK(mcap_flush(w, &fault));
        }
        CHECK(mcap_finish(w, &fault));
        struct image f = image_of(copy);
        struct mcap_reader *r = mcap_open_memory(f.p, f.n, NULL, NULL, &fault);
        struct mcap_message m;
        while (mcap_next(r, &m))
            got_crc = (uint32_t)crc32(got_crc, m.data, (uInt)m.size);
        CHECK_INT(mcap_info(r)->messages, n);
        CHECK_INT(mcap_info(r)->problems, 0);
        CHECK(mcap_info(r)->complete);
        CHECK_INT(got_crc, crc);
        mcap_close(r);
        close(copy);
        free(f.p);
    }
}

TEST(what_is_lost_is_said_in_figures)
{
    struct fault text;
    mcap_lost_text(&(struct mcap_info){.messages = 3, .left_out_bytes = 700, .file_bytes = 900}, &text);
    CHECK_STR(text.text, "most of it is lost: 3 messages could be read, 700 of 900 bytes are left out");
    mcap_lost_text(&(struct mcap_info){.file_bytes = 3000}, &text);
    CHECK_STR(text.text, "most of it is lost: 0 messages could be read");
}

int main(void)
{
    RUN(round_trip_lz4);
    RUN(round_trip_zstd);
    RUN(round_trip_uncompressed);
    RUN(empty_capture_is_complete);
    RUN(channels_and_metadata_come_back);
    RUN(attachment_is_found_by_name);
    RUN(damaged_attachment_is_refused);
    RUN(cut_at_every_byte_keeps_all_whole_chunks_and_the_head_of_the_cut_one);
    RUN(every_flipped_bit_is_reported_or_harmless);
    RUN(changed_summary_is_reported);
    RUN(chunk_with_wrong_checksum_is_skipped_and_named);
    RUN(reading_goes_on_at_the_next_chunk_after_a_broken_length);
    RUN(unknown_records_are_passed_over);
    RUN(hole_in_a_chunk_costs_that_chunk_only);
    RUN(index_with_a_wrong_length_costs_no_chunk);
    RUN(channel_whose_record_is_damaged_comes_from_the_summary);
    RUN(reading_goes_on_at_the_next_message_after_a_broken_length);
    RUN(file_of_which_most_is_left_out_says_so);
    RUN(lies_in_chunks_are_refused);
    RUN(zeros_at_the_end_of_a_cut_file_are_left_out);
    RUN(file_with_other_first_bytes_is_no_capture);
    RUN(message_over_the_limit_is_refused_and_the_next_one_kept);
    RUN(full_index_asks_for_another_file);
    RUN(full_disk_is_said_and_the_file_stays_whole);
    RUN(device_that_takes_nothing_is_refused_at_once);
    RUN(random_files_round_trip);
    RUN(what_is_lost_is_said_in_figures);
    return test_end();
}
