/* SPDX-License-Identifier: MIT */
/* test_capture - info, repair and export of captures; the command line of the tool. */
#include "client/ctl/capture.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/fault.h"
#include "drivers/capture/mcap.h"
#include "drivers/devices/ping_frame.h"
#include "drivers/devices/seanet_frame.h"
#include "tests/lib/test.h"

/* ---- bytes and files ---- */

static uint8_t *load(const char *path, size_t *n)
{
    struct stat st;
    uint8_t *p = NULL;
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    *n = 0;
    if (fd >= 0 && fstat(fd, &st) == 0 && (p = malloc((size_t)st.st_size + 1)) != NULL) {
        *n = (size_t)read(fd, p, (size_t)st.st_size);
        p[*n] = '\0';
    }
    if (fd >= 0)
        close(fd);
    return p;
}

static void save(const char *path, const void *p, size_t n)
{
    int fd = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    CHECK(write(fd, p, n) == (ssize_t)n);
    close(fd);
}

static char dir[64], path_a[128], path_b[128];

static void make_dir(void)
{
    snprintf(dir, sizeof dir, "/tmp/test_capture.XXXXXX");
    if (!mkdtemp(dir))
        exit(2);
    snprintf(path_a, sizeof path_a, "%s/a.mcap", dir);
    snprintf(path_b, sizeof path_b, "%s/b.mcap", dir);
}

static void remove_dir(void)
{
    char said[128];
    snprintf(said, sizeof said, "%s/said", dir);
    unlink(said);
    unlink(path_a);
    unlink(path_b);
    rmdir(dir);
}

/* capture_main with up to six arguments; what it printed (both streams) is in said[]. */
static char said[8192];

static int capture(const char *a, const char *b, const char *c, const char *d, const char *e, const char *f)
{
    const char *argv[] = {"capture", a, b, c, d, e, f, NULL};
    char path[128];
    int argc = 1;
    while (argv[argc])
        argc++;
    snprintf(path, sizeof path, "%s/said", dir);
    fflush(stdout);
    int out = dup(1), err = dup(2), fd = open(path, O_RDWR | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    dup2(fd, 1);
    dup2(fd, 2);
    int status = capture_main(argc, (char **)(uintptr_t)argv);
    fflush(stdout);
    dup2(out, 1);
    dup2(err, 2);
    ssize_t n = pread(fd, said, sizeof said - 1, 0);
    said[n > 0 ? n : 0] = '\0';
    close(out);
    close(err);
    close(fd);
    return status;
}

static size_t make_frame(uint8_t *out, uint16_t angle)
{
    static const uint8_t samples[] = {9, 'B', 'R', 8, 7};
    struct ping360_data data = {.set = {.mode = 1,
                                        .angle = angle,
                                        .transmit_us = 11,
                                        .sample_period = 88,
                                        .frequency_khz = 750,
                                        .n_samples = 5},
                                .data_length = 5,
                                .n_data = 5,
                                .data = samples};
    return ping360_encode_data(out, PING_FRAME_MAX, 2, &data);
}

/* ---- the tool ---- */

TEST(existing_file_is_not_overwritten)
{
    make_dir();
    save(path_a, "precious", 8);
    CHECK_INT(capture("export", "--csv", "tests/replay/box.mcap", path_a, NULL, NULL), 1);
    CHECK(strstr(said, "a.mcap: File exists; remove it first, or name another") != NULL);
    size_t n;
    uint8_t *p = load(path_a, &n);
    CHECK_INT(n, 8);
    free(p);
    remove_dir();
}

/* What a command that was killed has left is replaced, and what another one is writing is not. */
TEST(an_unfinished_file_has_another_name)
{
    char part[160];
    make_dir();
    snprintf(part, sizeof part, "%s.part", path_a);
    save(part, "half", 4);
    const int fd = open(part, O_RDONLY | O_CLOEXEC);
    CHECK(flock(fd, LOCK_EX) == 0);
    CHECK_INT(capture("export", "--csv", "tests/replay/box.mcap", path_a, NULL, NULL), 1);
    CHECK(strstr(said, "a.mcap.part: another command is writing it") != NULL);
    CHECK(access(path_a, F_OK) != 0 && access(part, F_OK) == 0);
    close(fd);
    CHECK_INT(capture("export", "--csv", "tests/replay/box.mcap", path_a, NULL, NULL), 0);
    CHECK(access(path_a, F_OK) == 0 && access(part, F_OK) != 0);
    remove_dir();
}

/* What is left of it is exported, and that it is not all is said. */
TEST(export_of_a_capture_that_is_cut_says_so)
{
    size_t n;
    make_dir();
    uint8_t *p = load("tests/replay/box.mcap", &n);
    save(path_a, p, n / 2);
    free(p);
    CHECK_INT(capture("export", "--csv", path_a, path_b, NULL, NULL), 1);
    CHECK(strstr(said, "a.mcap: still being written, or cut off: what can be read is exported, ") != NULL);
    p = load(path_b, &n);
    CHECK(strstr((char *)p, "# pings of /box/rx") != NULL);
    free(p);
    remove_dir();
}

TEST(unusable_input_leaves_no_file_behind)
{
    make_dir();
    CHECK_INT(capture("info", "Makefile", NULL, NULL, NULL, NULL), 1);
    CHECK(strstr(said, "not a capture") != NULL);
    CHECK_INT(capture("repair", "/nonexistent", path_a, NULL, NULL, NULL), 1);
    CHECK(access(path_a, F_OK) != 0);
    remove_dir();
}

TEST(cut_off_capture_is_repaired)
{
    size_t n;
    make_dir();
    uint8_t *p = load("tests/replay/box.mcap", &n);
    save(path_a, p, n - 1000); /* no footer; the chunk is whole or not */
    free(p);
    CHECK_INT(capture("info", path_a, NULL, NULL, NULL, NULL), 1);
    CHECK(strstr(said, "not closed: still being written, or cut off") && !strstr(said, "damaged"));
    CHECK_INT(capture("repair", path_a, path_b, NULL, NULL, NULL), 0);
    CHECK_INT(capture("info", path_b, NULL, NULL, NULL, NULL), 0);
    CHECK(strstr(said, "complete, no damage") != NULL);
    CHECK(strstr(said, "channel /box/rx (octet-stream)") != NULL);
    CHECK(strstr(said, "attachment sonard.conf") != NULL);
    remove_dir();
}

TEST(of_a_cut_chunk_what_can_be_read_is_saved)
{
    size_t n;
    make_dir();
    uint8_t *p = load("tests/replay/box.mcap", &n);
    save(path_a, p, n / 2); /* it is all of one chunk */
    free(p);
    CHECK_INT(capture("repair", path_a, path_b, NULL, NULL, NULL), 0);
    CHECK(strstr(said, " 51 messages, attachments: 1") != NULL);
    CHECK_INT(capture("info", path_b, NULL, NULL, NULL, NULL), 0);
    CHECK(strstr(said, "complete, no damage") != NULL);
    remove_dir();
}

static bool write_message(struct mcap_writer *w, int channel, uint32_t sequence, uint64_t log_ns, const void *data,
                          size_t size)
{
    struct fault fault;
    const struct mcap_message message = {
        .sequence = sequence, .log_ns = log_ns, .publish_ns = log_ns, .data = data, .size = size};
    return mcap_write_message(w, channel, &message, &fault);
}

TEST(export_of_another_device_refuses)
{
    struct mcap_options options = {.library = "test"};
    struct fault fault;
    make_dir();
    struct mcap_writer *w = mcap_create(open(path_a, O_WRONLY | O_CREAT | O_CLOEXEC, 0600), &options, &fault);
    int rx = mcap_add_channel(w, "/front/rx", "octet-stream", NULL, 0, &fault);
    CHECK(write_message(w, rx, 0, 5000000000, "@0011", 5));
    CHECK(mcap_finish(w, &fault));
    CHECK_INT(capture("export", "--csv", path_a, path_b, NULL, NULL), 1);
    CHECK(strstr(said, "nothing exported: of received bytes only the pings of a Ping360 or a SeaNet head are") !=
          NULL);
    CHECK(access(path_b, F_OK) != 0);
    remove_dir();
}

TEST(export_gives_pings_and_other_messages)
{
    struct mcap_options options = {.library = "test"};
    uint8_t frame[PING_FRAME_MAX];
    struct fault fault;
    make_dir();
    struct mcap_writer *w = mcap_create(open(path_a, O_WRONLY | O_CREAT | O_CLOEXEC, 0600), &options, &fault);
    int rx = mcap_add_channel(w, "/front/rx", "octet-stream", NULL, 0, &fault);
    int tx = mcap_add_channel(w, "/front/tx", "octet-stream", NULL, 0, &fault);
    int other = mcap_add_channel(w, "/o\x1b[31m/rx", "octet-stream", NULL, 0, &fault);
    size_t n = make_frame(frame, 100);
    CHECK(write_message(w, tx, 0, 5000000000, "\x01\xfe", 2));
    CHECK(write_message(w, rx, 0, 5500000000, frame, n - 3));
    CHECK(write_message(w, rx, 1, 6500000000, frame + n - 3, 3));
    CHECK(write_message(w, other, 0, 6500000000, "xyz", 3));
    CHECK(mcap_finish(w, &fault));
    CHECK_INT(capture("export", "--csv", path_a, path_b, NULL, NULL), 0);
    CHECK_STR(said, "sonarctl capture: /o\\x1b[31m/rx: no ping of a Ping360 or a SeaNet head in 3 bytes\n");
    char *csv = (char *)load(path_b, &n);
    CHECK(strstr(csv, "\n/front/tx,0.000000,01fe\n# pings of /front/rx\n1.500000,90.000,0.0083,5,9,66,82,8,7\n") !=
          NULL);
    free(csv);
    remove_dir();
}

/* A line of two 8-bit bins 90 degrees to the right, and one of 4-bit bins on the same scale: 16 mm a bin. */
TEST(export_gives_the_lines_of_a_seanet_head)
{
    struct mcap_options options = {.library = "test"};
    struct fault fault;
    uint8_t frame[64] = {'@', '0', '0', '2', '9', 41, 0, 2, 255, 0, SEANET_HEAD_DATA, SEANET_LAST_PACKET, 2};
    uint8_t *payload = frame + SEANET_PAYLOAD_AT;
    make_dir();
    struct mcap_writer *w = mcap_create(open(path_a, O_WRONLY | O_CREAT | O_CLOEXEC, 0600), &options, &fault);
    int rx = mcap_add_channel(w, "/front/rx", "octet-stream", NULL, 0, &fault);
    seanet_put_u16(payload, SEANET_DATA_AT + 2);
    seanet_put_u16(payload + 5, 0x2307);
    payload[16] = 150; /* the window of 4-bit bins, and its lower end */
    payload[17] = 30;
    seanet_put_u16(payload + 20, 33);
    seanet_put_u16(payload + 27, 4800);
    seanet_put_u16(payload + 29, 2);
    payload[SEANET_DATA_AT] = 0x10;
    payload[SEANET_DATA_AT + 1] = 0x9f;
    payload[SEANET_DATA_AT + 2] = '\n';
    const size_t n = SEANET_PAYLOAD_AT + SEANET_DATA_AT + 3;
    CHECK(write_message(w, rx, 0, 5000000000, frame, 20));
    CHECK(write_message(w, rx, 1, 5000000000, frame + 20, n - 20));
    seanet_put_u16(payload + 5, 0x2306);
    CHECK(write_message(w, rx, 2, 6000000000, frame, n));
    CHECK(mcap_finish(w, &fault));
    CHECK_INT(capture("export", "--csv", path_a, path_b, NULL, NULL), 0);
    CHECK_STR(said, "");
    size_t size;
    char *csv = (char *)load(path_b, &size);
    CHECK(strstr(csv, "\n# pings of /front/rx\n0.000000,90.000,0.0317,2,16,159\n"
                      "1.000000,90.000,0.0634,4,40,0,120,255\n") != NULL);
    free(csv);
    remove_dir();
}

TEST(command_line_faults_are_said)
{
    static const struct {
        const char *arg[3];
        int status;
        const char *want;
    } row[] = {
        {{"--help"}, 0, "usage: sonarctl capture import"},
        {{NULL}, 2, "no command"},
        {{"eat"}, 2, "the commands are import, info, repair, export and add-pose"},
        {{"info"}, 2, "info needs one file"},
        {{"info", "a", "b"}, 2, "info needs one file"},
        {{"--csv", "import", "a"}, 2, "import comes first"},
        {{"export", "a"}, 2, "export needs --csv"},
        {{"info", "--csv", "a"}, 2, "--conf belong to export"},
        {{"info", "--colour"}, 2, "sonarctl capture: no option --colour; see `sonarctl capture --help`\n"},
        {{"export", "--foxgloove", "a"}, 2, "no option --foxgloove; did you mean --foxglove?\n"},
        {{"info", "-Z"}, 2, "no option -Z; see"},
        {{"info", "-Zh"}, 2, "no option -Z; see"},
        {{"export", "--csv=a"}, 2, "option --csv=a takes no value; see"},
        {{"export", "a", "--conf"}, 2, "--conf needs a value; see"},
        {{"info", "/nonexistent"}, 1, "/nonexistent: No such file or directory"},
    };
    make_dir();
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        CHECK_INT(capture(row[i].arg[0], row[i].arg[1], row[i].arg[2], NULL, NULL, NULL), row[i].status);
        if (!strstr(said, row[i].want))
            printf("expected \"%s\", got: %s\n", row[i].want, said);
        CHECK(strstr(said, row[i].want) != NULL);
    }
    remove_dir();
}

TEST(capture_that_ships_is_whole_and_has_its_configuration)
{
    size_t n;
    struct mcap_message m;
    struct mcap_attachment a;
    struct fault fault;
    static struct ping_parser parser;
    uint8_t *conf = load("tests/replay/box.conf", &n);
    ping_parser_init(&parser, PING_PAYLOAD_MAX);
    struct mcap_reader *r = mcap_open("tests/replay/box.mcap", NULL, NULL, &fault);
    CHECK(r != NULL && mcap_find_attachment(r, "sonard.conf", &a, &fault));
    CHECK(a.size == n && memcmp(a.data, conf, n) == 0);
    unsigned pings = 0;
    while (mcap_next(r, &m)) {
        struct ping_frame frame;
        const uint8_t *bytes = m.data;
        size_t left = m.size;
        while (ping_parser_next(&parser, &bytes, &left, m.log_ns, &frame))
            pings += frame.id == PING360_DEVICE_DATA;
    }
    CHECK_INT(pings, 101);
    CHECK(mcap_info(r)->complete);
    mcap_close(r);
    free(conf);
}

int main(void)
{
    RUN(of_a_cut_chunk_what_can_be_read_is_saved);
    RUN(export_of_another_device_refuses);
    RUN(existing_file_is_not_overwritten);
    RUN(an_unfinished_file_has_another_name);
    RUN(export_of_a_capture_that_is_cut_says_so);
    RUN(unusable_input_leaves_no_file_behind);
    RUN(cut_off_capture_is_repaired);
    RUN(export_gives_pings_and_other_messages);
    RUN(export_gives_the_lines_of_a_seanet_head);
    RUN(command_line_faults_are_said);
    RUN(capture_that_ships_is_whole_and_has_its_configuration);
    return test_end();
}
