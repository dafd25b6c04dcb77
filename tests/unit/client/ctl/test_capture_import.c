/* SPDX-License-Identifier: MIT */
/* test_capture_import - recordings of other programs become captures; repair and export of captures. */
#include "client/ctl/import.h"
#include "client/ctl/import_clock.h"

#include <fcntl.h>
#include <glob.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include "client/ctl/capture.h"
#include "core/fault.h"
#include "drivers/capture/mcap.h"
#include "drivers/devices/ping_bytes.h"
#include "drivers/devices/ping_frame.h"
#include "drivers/devices/seanet_frame.h"
#include "tests/lib/test.h"

/* ---- bytes and files ---- */

struct buffer {
    uint8_t p[1 << 16];
    size_t n;
};

static void put(struct buffer *b, const void *p, size_t n)
{
    if (n)
        memcpy(b->p + b->n, p, n);
    b->n += n;
}

static void put_u32be(struct buffer *b, uint32_t v)
{
    for (int shift = 24; shift >= 0; shift -= 8)
        b->p[b->n++] = (uint8_t)(v >> shift);
}

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

/* ---- a sink that frames ---- */

struct heard {
    struct ping_parser parser;
    unsigned records, pings, problems, falls;
    uint64_t first_ns, last_ns;
    uint16_t first_angle, last_angle;
    char first_problem[200];
};

static bool hear(void *ctx, uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    struct heard *h = ctx;
    struct ping_frame frame;
    struct ping360_data data;
    h->falls += h->records > 0 && t_ns < h->last_ns;
    if (h->records++ == 0)
        h->first_ns = t_ns;
    h->last_ns = t_ns;
    while (ping_parser_next(&h->parser, &bytes, &n, t_ns, &frame)) {
        if (!ping360_decode_data(&frame, &data))
            continue;
        if (h->pings++ == 0)
            h->first_angle = data.set.angle;
        h->last_angle = data.set.angle;
    }
    return true;
}

static void hear_problem(void *ctx, const char *sentence)
{
    struct heard *h = ctx;
    if (h->problems++ == 0)
        snprintf(h->first_problem, sizeof h->first_problem, "%s", sentence);
}

static struct heard heard;

static struct import_result import(const void *p, size_t n)
{
    const struct import_sink sink = {&heard, hear, hear_problem};
    struct import_result result = {0};
    memset(&heard, 0, sizeof heard);
    ping_parser_init(&heard.parser, PING_PAYLOAD_MAX);
    switch (import_kind(p, n)) {
    case IMPORT_PING_VIEWER:
        import_ping_viewer(p, n, &sink, &result);
        break;
    case IMPORT_TEXT:
        import_text(p, n, &sink, &result);
        break;
    case IMPORT_SVLOG:        /* test_import_svlog */
    case IMPORT_VIEWER2:      /* test_import_viewer2 */
    case IMPORT_IMAGENEX:     /* test_import_imagenex */
    case IMPORT_SEANET_RELAY: /* test_import_seanet */
    case IMPORT_SEANET:
    case IMPORT_UNKNOWN:
        break;
    }
    return result;
}

/* ---- time stamps ---- */

TEST(clock_reads_the_digits_of_any_script)
{
    static const struct {
        const char *name;
        uint32_t zero;
    } script[] = {{"ASCII", '0'},        {"Arabic", 0x660},   {"Persian", 0x6f0}, {"Devanagari", 0x966},
                  {"fullwidth", 0xff10}, {"Chakma", 0x11136}, {"Adlam", 0x1e950}};
    for (size_t i = 0; i < sizeof script / sizeof script[0]; i++) {
        uint32_t z = script[i].zero;
        uint32_t text[] = {z, z + 1, ':', z + 2, z + 3, ':', z + 4, z + 5, '.', z + 6, z + 7, z + 9};
        uint64_t t = 0;
        if (!import_clock(text, 12, &t))
            printf("%s: ", script[i].name);
        CHECK_INT(t, (((1 * 60 + 23) * 60 + 45) * 1000ull + 679) * 1000000u);
    }
}

TEST(clock_refuses_what_is_no_time)
{
    static const char *const text[] = {
        "",  "00:00:00",   "00:00:00.1",    "24:00:00.000", "00:60:00.000", "00:00:60.000",
        "a", "000000.000", "00:00:00.0000", "0:00:00.000 ", "-1:00:00.000"};
    for (size_t i = 0; i < sizeof text / sizeof text[0]; i++) {
        uint32_t wide[16] = {0};
        uint64_t t;
        size_t n = strlen(text[i]);
        for (size_t k = 0; k < n; k++)
            wide[k] = (unsigned char)text[i][k];
        if (import_clock(wide, n, &t))
            printf("\"%s\": ", text[i]);
        CHECK(!import_clock(wide, n, &t));
    }
}

/* ---- text dumps ---- */

TEST(text_dump_becomes_frames)
{
    size_t n;
    uint8_t *text = load("tests/replay/box-head.txt", &n);
    struct import_result result = import(text, n);
    CHECK_INT(import_kind(text, n), IMPORT_TEXT);
    CHECK_INT(result.records, 3);
    CHECK_INT(heard.pings, 3);
    CHECK_INT(heard.problems, 0); /* the checksums made are those of the dump */
    CHECK_INT(heard.first_angle, 150);
    CHECK_INT(heard.last_angle, 152);
    CHECK_INT(heard.parser.garbage_bytes, 0);
    CHECK(result.times_made_up);
    CHECK_INT(heard.last_ns - heard.first_ns, 2 * (1200 * 90 * 25 + IMPORT_PACE_NS));
    free(text);
}

TEST(text_dump_cut_anywhere_gives_its_whole_messages)
{
    size_t n;
    uint8_t *text = load("tests/replay/box-head.txt", &n);
    for (size_t cut = 1; cut < n; cut += 7) {
        unsigned whole = 0; /* a message is whole once its checksum line has started */
        for (const uint8_t *p = text; (p = memmem(p, cut - (size_t)(p - text), "\nChecksum: ", 11)) != NULL;
             p += 11)
            whole++;
        uint8_t *copy = malloc(cut);
        memcpy(copy, text, cut);
        import(copy, cut);
        if (heard.pings != whole)
            printf("cut at %zu: ", cut);
        CHECK_INT(heard.pings, whole);
        free(copy);
    }
    free(text);
}

/* A small dump with one line replaced. */
#define HEAD "ID: 2300 - device_data\nHeader: payload_length: 17 src_device_id: 2 dst_device_id: 0\n"
#define FIELDS                                                                                                    \
    "  - mode: 1\n  - gain_setting: 0\n  - angle: 200\n  - transmit_duration: 11\n  - sample_period: 88\n"        \
    "  - transmit_frequency: 750\n  - number_of_samples: 3\n"

TEST(text_dump_says_what_it_leaves_out)
{
    static const struct {
        const char *name, *text;
        unsigned pings;
        const char *problem;
    } row[] = {
        {"good", HEAD FIELDS "  - data_length: 3\n  - data: ['0x01', '0xff', '0x3']\nChecksum: ", 1, ""},
        {"time stamp",
         "timestamp: '\\x000\\x000:00:02.103'\n" HEAD FIELDS "  - data_length: 3\n  - data: []\nChecksum: ", 1,
         ""},
        {"no data", HEAD FIELDS "  - data_length: 3\nChecksum: 1", 0,
         "message at offset 0 is left out (262 bytes): a field is missing, not a number, or too large"},
        {"field too large", HEAD FIELDS "  - data_length: 65536\n  - data: []\nChecksum: 1", 0,
         "message at offset 0 is left out (279 bytes): a field is missing, not a number, or too large"},
        {"wrong checksum", HEAD FIELDS "  - data_length: 3\n  - data: []\nChecksum: 1", 1,
         "message at offset 0: the dump does not hold all its bytes, its checksum differs"},
        {"cut off", HEAD FIELDS "  - data_length: 3\n  - data: ['0x", 0,
         "message at offset 0 is left out (265 bytes): the file ends within it"},
        {"no checksum line",
         HEAD FIELDS "  - data_length: 3\n  - data: []\n" HEAD FIELDS
                     "  - data_length: 3\n  - data: []\nChecksum: ",
         1, "message at offset 0 is left out (264 bytes): it has no checksum line"},
        {"other message",
         "ID: 4 - device_information\nChecksum: 1\n" HEAD FIELDS "  - data_length: 3\n  - data: []\nChecksum: ", 1,
         "1 messages that are not device_data are left out"},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        import(row[i].text, strlen(row[i].text));
        if (heard.pings != row[i].pings || strcmp(heard.first_problem, row[i].problem) != 0)
            printf("%s: ", row[i].name);
        CHECK_INT(heard.pings, row[i].pings);
        CHECK_STR(heard.first_problem, row[i].problem);
    }
}

TEST(text_dump_with_more_samples_than_a_frame_holds_is_refused)
{
    static char text[40000];
    snprintf(text, sizeof text, "%s", HEAD FIELDS "  - data_length: 3\n  - data: [");
    for (int i = 0; i < 3000; i++)
        strcat(text, "'0x11', ");
    strcat(text, "]\nChecksum: 1\n");
    import(text, strlen(text));
    CHECK_INT(heard.pings, 0);
    CHECK_INT(heard.problems, 1);
    CHECK(strstr(heard.first_problem, "a field is missing, not a number, or too large") != NULL);
}

/* ---- Ping-Viewer logs ---- */

static void put_utf16(struct buffer *b, const uint16_t *text, size_t n)
{
    put_u32be(b, (uint32_t)(2 * n));
    for (size_t i = 0; i < n; i++) {
        b->p[b->n++] = (uint8_t)(text[i] >> 8);
        b->p[b->n++] = (uint8_t)text[i];
    }
}

static void put_text(struct buffer *b, const char *s)
{
    uint16_t wide[64];
    size_t n = strlen(s);
    for (size_t i = 0; i < n; i++)
        wide[i] = (unsigned char)s[i];
    put_utf16(b, wide, n);
}

static void begin_log(struct buffer *b)
{
    b->n = 0;
    put_text(b, "PingViewer sensor log file");
    put_u32be(b, 1);
    for (int i = 0; i < 5; i++)
        put_text(b, i == 2 ? "v2.1.0" : "something");
    put_u32be(b, 1);
    put_u32be(b, 2);
}

/* A record; the digits of `clock` ("00:00:01.250") are written in the script that begins at `zero`. */
static void put_record(struct buffer *b, const char *clock, uint16_t zero, const uint8_t *bytes, size_t n)
{
    uint16_t wide[16];
    size_t length = strlen(clock);
    for (size_t i = 0; i < length; i++)
        wide[i] = clock[i] >= '0' && clock[i] <= '9' ? (uint16_t)(zero + clock[i] - '0') : (uint8_t)clock[i];
    put_utf16(b, wide, length);
    put_u32be(b, (uint32_t)n);
    put(b, bytes, n);
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

/* Two frames, cut over three records, in Persian digits. */
static void make_log(struct buffer *b)
{
    uint8_t bytes[2 * PING_FRAME_MAX];
    size_t n = make_frame(bytes, 135);
    n += make_frame(bytes + n, 136);
    begin_log(b);
    put_record(b, "00:00:01.250", 0x6f0, bytes, 5);
    put_record(b, "00:00:01.260", 0x6f0, bytes + 5, n - 9);
    put_record(b, "00:01:00.007", 0x6f0, bytes + n - 4, 4);
}

static struct buffer file;

TEST(viewer_log_in_persian_digits_with_split_frames)
{
    make_log(&file);
    struct import_result result = import(file.p, file.n);
    CHECK_INT(import_kind(file.p, file.n), IMPORT_PING_VIEWER);
    CHECK_INT(result.records, 3);
    CHECK_INT(heard.pings, 2);
    CHECK_INT(heard.first_angle, 135);
    CHECK_INT(heard.last_angle, 136);
    CHECK_INT(heard.parser.garbage_bytes, 0);
    CHECK_INT(heard.first_ns, 1250000000);
    CHECK_INT(heard.last_ns, 60007000000);
    CHECK_INT(heard.problems, 0);
    CHECK(!result.times_made_up);
}

TEST(viewer_log_cut_at_every_byte)
{
    make_log(&file);
    for (size_t n = 0; n < file.n; n++) {
        uint8_t *copy = malloc(n + 1);
        copy = realloc(copy, n ? n : 1);
        memcpy(copy, file.p, n);
        struct import_result result = import(copy, n);
        CHECK(result.records < 3);
        free(copy);
    }
}

TEST(viewer_log_past_midnight_and_with_a_bad_clock)
{
    begin_log(&file);
    put_record(&file, "23:59:59.999", '0', NULL, 0);
    put_record(&file, "00:00:00.001", '0', NULL, 0);
    put_record(&file, "nonsense", '0', NULL, 0);
    put_record(&file, "00:00:00.000", '0', NULL, 0);
    import(file.p, file.n);
    CHECK_INT(heard.records, 4);
    CHECK_INT(heard.last_ns - heard.first_ns, 2000000);
    CHECK_INT(heard.falls, 0);
    CHECK_STR(heard.first_problem, "1 records without a readable time have that of the one before");
}

TEST(viewer_log_with_a_lie_about_a_length)
{
    make_log(&file);
    size_t whole = file.n;
    put_text(&file, "00:01:01.000");
    put_u32be(&file, 0x7fffffff);
    import(file.p, file.n);
    CHECK_INT(heard.records, 3);
    char want[96];
    snprintf(want, sizeof want, "offset %zu: no whole record; the last 32 bytes are left out", whole);
    CHECK_STR(heard.first_problem, want);
}

#define LOG_PINGS 20

/* A frame to a record, a second after the other; where the records begin goes to at[]. */
static void make_long_log(struct buffer *b, size_t at[LOG_PINGS])
{
    begin_log(b);
    for (uint16_t i = 0; i < LOG_PINGS; i++) {
        uint8_t frame[PING_FRAME_MAX];
        char clock[16];
        at[i] = b->n;
        snprintf(clock, sizeof clock, "00:00:%02d.000", i);
        put_record(b, clock, '0', frame, make_frame(frame, i));
    }
}

/* Whatever bit is flipped of a record's two lengths, no ping is lost, and none behind it gets another time. */
TEST(viewer_log_with_one_bit_of_a_length_changed)
{
    static const unsigned length_at[] = {0, 4 + 24};
    static struct buffer good;
    size_t at[LOG_PINGS];
    make_long_log(&good, at);
    for (unsigned bit = 0; bit < 64; bit++) {
        file = good;
        file.p[at[7] + length_at[bit / 32] + bit % 32 / 8] ^= (uint8_t)(1u << bit % 8);
        const struct import_result result = import(file.p, file.n);
        if (heard.pings < LOG_PINGS)
            printf("bit %u: ", bit);
        CHECK_INT(heard.pings, LOG_PINGS);
        CHECK_INT(heard.last_ns, 19000000000);
        CHECK_INT(result.left_out_bytes, 0);
        CHECK(heard.problems > 0);
    }
}

/* A length that leads nowhere, and a whole record that begins before the bytes of the broken one. */
TEST(viewer_log_with_a_record_within_a_time)
{
    uint8_t frame[PING_FRAME_MAX];
    const size_t n = make_frame(frame, 1);
    begin_log(&file);
    put_u32be(&file, 40);
    put_record(&file, "00:00:01.000", '0', frame, n);
    put_record(&file, "00:00:02.000", '0', frame, n);
    const struct import_result result = import(file.p, file.n);
    CHECK_INT(result.records, 2);
    CHECK_INT(heard.pings, 2);
    CHECK_INT(result.left_out_bytes, 4);
}

TEST(viewer_log_with_a_hole)
{
    size_t at[LOG_PINGS];
    make_long_log(&file, at);
    memmove(file.p + at[4] + 30, file.p + at[6] + 10, file.n - at[6] - 10);
    file.n -= at[6] - 20 - at[4];
    import(file.p, file.n);
    CHECK_INT(heard.pings, LOG_PINGS - 2);
    CHECK_INT(heard.last_ns, 19000000000);
}

/* ---- recordings that cannot ship ---- */

static void check_recording(const char *pattern, unsigned pings)
{
    char full[256];
    glob_t found = {0};
    snprintf(full, sizeof full, "../shared/data/%s", pattern);
    if (glob(full, 0, NULL, &found) == 0) {
        size_t n;
        uint8_t *p = load(found.gl_pathv[0], &n);
        import(p, n);
        CHECK_INT(heard.pings, pings);
        CHECK_INT(heard.falls, 0);
        free(p);
    } else {
        printf("skip %s: not here\n", pattern);
    }
    globfree(&found);
}

TEST(recordings_have_the_known_numbers_of_pings)
{
    check_recording("ping360-openwater-pingviewer/20240814-094253162.bin", 145);
    check_recording("ping360-openwater-pingviewer/20240814-094407726.bin", 1725);
    check_recording("ping360-openwater-pingviewer/20240814-102337673.bin", 2436);
    check_recording("ping360-openwater-pingviewer/20240814-103146484.bin", 2471);
    check_recording("ping360-box-textdump/2024*.csv", 101);
    check_recording("ping360-nearfield-textdump/*.decoded", 100);
}

/* ---- the tool ---- */

TEST(import_makes_a_capture_with_configuration)
{
    make_dir();
    CHECK_INT(capture("import", "--sensor=box", "--conf=tests/replay/box.conf", "tests/replay/box-head.txt",
                      path_a, NULL),
              0);
    CHECK(strstr(said, "3 pings in 3 records") != NULL);
    CHECK_INT(capture("info", path_a, NULL, NULL, NULL, NULL), 0);
    CHECK(strstr(said, "channel /box/rx (octet-stream): 3 messages, 3672 bytes") != NULL);
    CHECK(strstr(said, "attachment sonard.conf (text/plain)") != NULL);
    CHECK(strstr(said, "complete, no damage") != NULL);
    remove_dir();
}

TEST(import_without_a_configuration_attaches_one_for_the_device)
{
    struct fault fault;
    struct mcap_attachment a;
    make_dir();
    CHECK_INT(capture("import", "--sensor=box", "tests/replay/box-head.txt", path_a, NULL, NULL), 0);
    CHECK(strstr(said, "configuration attached: device = ping360, range = 2.1 m\n") != NULL);
    struct mcap_reader *r = mcap_open(path_a, NULL, NULL, &fault);
    CHECK(r && mcap_find_attachment(r, "sonard.conf", &a, &fault));
    CHECK(memmem(a.data, a.size, "[sonar box]\ndevice = ping360\n", 29) != NULL);
    mcap_close(r);
    CHECK_INT(capture("info", path_a, NULL, NULL, NULL, NULL), 0);
    CHECK(strstr(said, "line = none") != NULL);
    remove_dir();
}

/* A .svlog of 30 pings with points of the older form only, 100 ms apart, heard up to 40 m. */
static void make_svlog(struct buffer *b)
{
    b->n = ping_frame_build(b->p, sizeof b->p, 10, 0, "{}", 2);
    for (unsigned i = 0; i < 30; i++) {
        uint8_t points[108] = {0};
        put_u32(points, 5000 + 100 * i);
        put_f32(points + 92, 40);
        put_u16(points + 98, 1);
        put_f32(points + 104, 8);
        b->n += ping_frame_build(b->p + b->n, sizeof b->p - b->n, SURVEYOR_YZ_POINTS, 0, points, sizeof points);
    }
}

static size_t packed(const struct buffer *b, uint8_t *out, size_t size)
{
    z_stream z = {
        .next_in = (uint8_t *)(uintptr_t)b->p, .avail_in = (uInt)b->n, .next_out = out, .avail_out = (uInt)size};
    CHECK_INT(deflateInit2(&z, 9, Z_DEFLATED, 16 + MAX_WBITS, 8, Z_DEFAULT_STRATEGY), Z_OK);
    CHECK_INT(deflate(&z, Z_FINISH), Z_STREAM_END);
    deflateEnd(&z);
    return size - z.avail_out;
}

/* Cerulean's .svlz; two of them one behind the other are a gzip file as well. */
TEST(svlog_is_imported_as_it_is_and_packed)
{
    static uint8_t gz[1 << 16];
    make_dir();
    make_svlog(&file);
    save(path_b, file.p, file.n);
    CHECK_INT(capture("import", path_b, path_a, NULL, NULL, NULL), 0);
    CHECK(strstr(said, "device = surveyor, range = 40.0 m") && strstr(said, "30 pings in 31 records, 2.900 s"));
    unlink(path_a);
    const size_t n = packed(&file, gz, sizeof gz);
    memcpy(gz + n, gz, n);
    save(path_b, gz, 2 * n);
    CHECK_INT(capture("import", path_b, path_a, NULL, NULL, NULL), 0);
    CHECK(strstr(said, "60 pings in 62 records, 5.800 s") && !strstr(said, "damaged"));
    unlink(path_a);
    save(path_b, gz, n - 20);
    CHECK_INT(capture("import", path_b, path_a, NULL, NULL, NULL), 0);
    CHECK(strstr(said, "packed, and cut off: ") && strstr(said, " pings in ") && !strstr(said, "left out"));
    unlink(path_a);
    memset(gz + 100, 0xff, 8); /* of the first of the two */
    save(path_b, gz, 2 * n);
    capture("import", path_b, path_a, NULL, NULL, NULL);
    unsigned long pings = 0;
    const char *at = strstr(said, " pings in ");
    while (at && at > said && at[-1] >= '0' && at[-1] <= '9')
        at--;
    pings = at ? strtoul(at, NULL, 10) : 0;
    CHECK(pings >= 30 && pings < 60);
    remove_dir();
}

/* 40 members of 60 KB make several pieces, whose ends cut frames. */
TEST(a_long_packed_svlog_is_imported_piece_by_piece)
{
    static uint8_t gz[1 << 16];
    size_t n = 0;
    make_dir();
    file.n = ping_frame_build(file.p, sizeof file.p, 10, 0, "{}", 2);
    for (unsigned i = 0; i < 4; i++) {
        static uint8_t points[15000];
        put_u32(points, 1000 + 10 * i);
        file.n += ping_frame_build(file.p + file.n, sizeof file.p - file.n, SURVEYOR_ATOF_POINTS, 0, points,
                                   sizeof points);
    }
    for (int i = 0; i < 40; i++)
        n += packed(&file, gz + n, sizeof gz - n);
    save(path_b, gz, n);
    CHECK_INT(capture("import", path_b, path_a, NULL, NULL, NULL), 0);
    CHECK(strstr(said, "160 pings in 200 records") && !strstr(said, "no frame"));
    remove_dir();
}

TEST(a_packed_file_of_another_kind_is_not_unpacked_without_end)
{
    static uint8_t gz[1 << 20];
    make_dir();
    memset(&file, 0, sizeof file);
    file.n = sizeof file.p;
    const size_t one = packed(&file, gz, sizeof gz), members = 1025; /* 64 MiB and a little more */
    CHECK(one * members <= sizeof gz);
    for (size_t i = 1; i < members; i++)
        memcpy(gz + i * one, gz, one);
    save(path_b, gz, members * one);
    CHECK_INT(capture("import", path_b, path_a, NULL, NULL, NULL), 1);
    CHECK(strstr(said, "it unpacks to more than 64 MiB: unpack it with gunzip"));
    CHECK(access(path_a, F_OK) != 0);
    remove_dir();
}

/* What is taken for a recording is told from what came to nothing: by the exit status. */
TEST(import_without_a_ping_fails_and_keeps_the_bytes)
{
    make_dir();
    file.n = ping_frame_build(file.p, sizeof file.p, 10, 0, "{}", 2);
    save(path_b, file.p, file.n);
    CHECK_INT(capture("import", path_b, path_a, NULL, NULL, NULL), 1);
    CHECK(strstr(said, "no ping in it; the capture holds its bytes as they are") != NULL);
    CHECK_INT(capture("info", path_a, NULL, NULL, NULL, NULL), 0);
    remove_dir();
}

/* The bytes are kept, but a script is not to take 6 of 30 pings for the dive. */
TEST(import_of_a_file_that_is_mostly_no_frames_fails)
{
    make_dir();
    make_svlog(&file);
    memset(file.p + file.n / 5, 0x55, file.n - file.n / 5);
    save(path_b, file.p, file.n);
    CHECK_INT(capture("import", path_b, path_a, NULL, NULL, NULL), 1);
    CHECK(strstr(said, "bytes outside valid frames") && strstr(said, "most of it is lost: "));
    CHECK_INT(capture("info", path_a, NULL, NULL, NULL, NULL), 0);
    unlink(path_a);
    make_svlog(&file);
    memset(file.p + file.n - file.n / 5, 0x55, file.n / 5);
    save(path_b, file.p, file.n);
    CHECK_INT(capture("import", path_b, path_a, NULL, NULL, NULL), 0);
    remove_dir();
}

TEST(a_capture_is_not_imported_again)
{
    make_dir();
    CHECK_INT(capture("import", "tests/replay/box.mcap", path_a, NULL, NULL, NULL), 1);
    CHECK_STR(said, "sonarctl capture: tests/replay/box.mcap: is a capture of sonard already; play it with "
                    "`sonard --replay`\n");
    CHECK(access(path_a, F_OK) != 0);
    remove_dir();
}

TEST(existing_file_is_not_overwritten)
{
    make_dir();
    save(path_a, "precious", 8);
    CHECK_INT(capture("import", "tests/replay/box-head.txt", path_a, NULL, NULL, NULL), 1);
    CHECK(strstr(said, "File exists") != NULL);
    CHECK_INT(capture("export", "--csv", "tests/replay/box.mcap", path_a, NULL, NULL), 1);
    size_t n;
    uint8_t *p = load(path_a, &n);
    CHECK_INT(n, 8);
    free(p);
    remove_dir();
}

TEST(unusable_input_leaves_no_file_behind)
{
    make_dir();
    CHECK_INT(capture("import", "Makefile", path_a, NULL, NULL, NULL), 1);
    CHECK(strstr(said, "Makefile: neither a Ping-Viewer sensor log nor a text dump") != NULL);
    begin_log(&file);
    save(path_b, file.p, file.n - 30);
    CHECK_INT(capture("import", path_b, path_a, NULL, NULL, NULL), 1);
    CHECK(strstr(said, "the head of the Ping-Viewer log is cut off") != NULL);
    CHECK(access(path_a, F_OK) != 0);
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
        {{"import", "--help"}, 0, "usage: sonarctl capture import"},
        {{NULL}, 2, "no command"},
        {{"eat"}, 2, "the commands are import, info, repair, export and add-pose"},
        {{"info"}, 2, "info needs one file"},
        {{"info", "a", "b"}, 2, "info needs one file"},
        {{"import", "a"}, 2, "import needs two files"},
        {{"import", "--sensor=a/b", "x"}, 2, "--sensor: expected up to 31 letters"},
        {{"export", "a"}, 2, "export needs --csv"},
        {{"info", "--csv", "a"}, 2, "--csv belongs to export"},
        {{"info", "--conf=x", "a"}, 2, "--sensor and --conf belong to import"},
        {{"info", "--colour"}, 2, "unknown option"},
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
    uint8_t *conf = load("tests/replay/box.conf", &n);
    struct mcap_reader *r = mcap_open("tests/replay/box.mcap", NULL, NULL, &fault);
    CHECK(r != NULL && mcap_find_attachment(r, "sonard.conf", &a, &fault));
    CHECK(a.size == n && memcmp(a.data, conf, n) == 0);
    memset(&heard, 0, sizeof heard);
    ping_parser_init(&heard.parser, PING_PAYLOAD_MAX);
    while (mcap_next(r, &m))
        hear(&heard, m.log_ns, m.data, m.size);
    CHECK_INT(heard.pings, 101);
    CHECK(mcap_info(r)->complete);
    mcap_close(r);
    free(conf);
}

int main(void)
{
    RUN(clock_reads_the_digits_of_any_script);
    RUN(clock_refuses_what_is_no_time);
    RUN(text_dump_becomes_frames);
    RUN(text_dump_cut_anywhere_gives_its_whole_messages);
    RUN(text_dump_says_what_it_leaves_out);
    RUN(text_dump_with_more_samples_than_a_frame_holds_is_refused);
    RUN(viewer_log_in_persian_digits_with_split_frames);
    RUN(viewer_log_cut_at_every_byte);
    RUN(viewer_log_past_midnight_and_with_a_bad_clock);
    RUN(viewer_log_with_a_lie_about_a_length);
    RUN(viewer_log_with_one_bit_of_a_length_changed);
    RUN(viewer_log_with_a_record_within_a_time);
    RUN(viewer_log_with_a_hole);
    RUN(recordings_have_the_known_numbers_of_pings);
    RUN(import_makes_a_capture_with_configuration);
    RUN(import_without_a_configuration_attaches_one_for_the_device);
    RUN(of_a_cut_chunk_what_can_be_read_is_saved);
    RUN(export_of_another_device_refuses);
    RUN(svlog_is_imported_as_it_is_and_packed);
    RUN(a_long_packed_svlog_is_imported_piece_by_piece);
    RUN(a_packed_file_of_another_kind_is_not_unpacked_without_end);
    RUN(import_without_a_ping_fails_and_keeps_the_bytes);
    RUN(import_of_a_file_that_is_mostly_no_frames_fails);
    RUN(a_capture_is_not_imported_again);
    RUN(existing_file_is_not_overwritten);
    RUN(unusable_input_leaves_no_file_behind);
    RUN(cut_off_capture_is_repaired);
    RUN(export_gives_pings_and_other_messages);
    RUN(export_gives_the_lines_of_a_seanet_head);
    RUN(command_line_faults_are_said);
    RUN(capture_that_ships_is_whole_and_has_its_configuration);
    return test_end();
}
