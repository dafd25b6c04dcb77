/* SPDX-License-Identifier: MIT */
/* Imagenex .852 files: blocks made here with and without times, cut and broken, and recordings where at hand. */
#include "client/ctl/import.h"
#include "drivers/devices/imagenex_frame.h"
#include "tests/lib/test.h"

#include <unistd.h>

#define FOLDER "../shared/data/imagenex852-echosounder/"
#define BLOCK  640

static struct {
    int records, problems, good;
    uint64_t t_ns;
    bool falls;
    int stop_after; /* 0: never */
    struct imagenex_parser parser;
} heard;

static bool on_bytes(void *ctx, uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    struct imagenex_frame f;
    (void)ctx;
    heard.falls = heard.falls || t_ns < heard.t_ns;
    heard.t_ns = t_ns;
    heard.records++;
    while (imagenex_parser_next(&heard.parser, &bytes, &n, t_ns, &f))
        heard.good++;
    return heard.records != heard.stop_after;
}

static void on_problem(void *ctx, const char *sentence)
{
    (void)ctx, (void)sentence;
    heard.problems++;
}

static const struct import_sink sink = {NULL, on_bytes, on_problem};

static void block(uint8_t *out, const char *clock)
{
    static const uint8_t data[500];
    const struct imagenex_frame f = {.head = 0x11, .range_m = 15, .n_points = 500, .n_data = 500, .data = data};
    memset(out, 0, BLOCK);
    memcpy(out, "852\x03\x02\x80\x02\x01", 8);
    memcpy(out + 20, clock, 8);
    memcpy(out + 29, clock + 8, 3);
    imagenex_encode_reply(out + 100, BLOCK - 100, &f);
}

static struct import_result import(const uint8_t *data, size_t n)
{
    struct import_result result;
    const int stop_after = heard.stop_after;
    memset(&heard, 0, sizeof heard);
    heard.stop_after = stop_after;
    import_imagenex(data, n, &sink, &result);
    return result;
}

TEST(times_of_day)
{
    static const char *const clock[] = {"23:59:58.50", "23:59:59.75", "00:00:01.00", "00:00:00.00", "00:00:02.00"};
    static uint8_t file[5 * BLOCK];
    for (int i = 0; i < 5; i++)
        block(file + i * BLOCK, clock[i]);
    CHECK_INT(import_kind(file, sizeof file), IMPORT_IMAGENEX);
    const struct import_result r = import(file, sizeof file);
    CHECK(r.records == 5 && r.left_out_bytes == 0 && !r.times_made_up && !heard.falls);
    CHECK_INT(heard.good, 5);
    CHECK_INT(heard.t_ns, 4500000000); /* set back by a second in between: time stands */
}

TEST(dates)
{
    static const struct {
        const char *date;
        uint64_t midnight_s; /* 0: none */
    } row[] = {{"18-Nov-2016", 1479427200}, {"31-Dec-2199", 7258032000}, {"01-Jan-1970", 0},
               {"32-Nov-2016", 0},          {"18-Nox-2016", 0},          {"18-Nov-9999", 0},
               {"18.Nov-2016", 0},          {"1\xe8-Nov-2016", 0}};
    static uint8_t file[2 * BLOCK];
    uint64_t start_ns;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        block(file, "23:59:59.50");
        block(file + BLOCK, "00:00:01.00");
        memcpy(file + 8, row[i].date, 11);
        const bool dated = import_imagenex_start(file, sizeof file, &start_ns);
        import(file, sizeof file);
        CHECK_INT(dated, row[i].midnight_s > 0 || i == 2);
        CHECK_INT(heard.t_ns, dated ? (row[i].midnight_s + 86401) * 1000000000 : 1500000000);
    }
}

TEST(no_times)
{
    static uint8_t file[3 * BLOCK];
    for (int i = 0; i < 3; i++)
        block(file + i * BLOCK, "\x11"
                                "Exgarbage!!");
    const struct import_result r = import(file, sizeof file);
    CHECK(r.records == 3 && r.times_made_up);
    CHECK_INT(heard.t_ns, 3 * (50000000 + 20000000)); /* 15 m are listened to for 20 ms */
}

TEST(broken_files)
{
    static const struct {
        const char *name;
        int at, value;
        size_t size, records, left_out;
    } row[] = {
        {"whole", 0, '8', 2 * BLOCK, 2, 0},
        {"cut in a block", 0, '8', 2 * BLOCK - 1, 1, BLOCK - 1},
        {"cut in a head", 0, '8', BLOCK + 50, 1, 50},
        {"another kind", BLOCK, '7', 2 * BLOCK, 1, BLOCK},
        {"block of nothing", BLOCK + 4, 0, 2 * BLOCK, 1, BLOCK},
        {"reply larger than its block", BLOCK + 6, 9, 2 * BLOCK, 1, BLOCK},
        {"nothing", 0, '8', 0, 0, 0},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        static uint8_t file[2 * BLOCK];
        block(file, "00:00:00.00");
        block(file + BLOCK, "00:00:01.00");
        file[row[i].at] = (uint8_t)row[i].value;
        const struct import_result r = import(file, row[i].size);
        if (r.records != row[i].records || r.left_out_bytes != row[i].left_out ||
            heard.problems != (row[i].left_out > 0)) {
            printf("%s: %" PRIu64 " records, %" PRIu64 " bytes left out\n", row[i].name, r.records,
                   r.left_out_bytes);
            CHECK(false);
        }
    }
}

/* One of four blocks is broken: no other is lost with it. */
TEST(reading_goes_on_behind_a_broken_block)
{
    static const struct {
        const char *name;
        int at, value;
        size_t records, left_out;
    } row[] = {
        {"another kind", BLOCK, '7', 3, BLOCK},
        {"block beyond the file", BLOCK + 4, 0x42, 3, BLOCK},
        {"block into the next one", BLOCK + 4, 0x03, 4, 0},
        {"block that ends early", BLOCK + 5, 0x70, 4, 16},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        static uint8_t file[4 * BLOCK];
        for (int k = 0; k < 4; k++)
            block(file + k * BLOCK, "00:00:00.00");
        file[row[i].at] = (uint8_t)row[i].value;
        const struct import_result r = import(file, sizeof file);
        if (r.records != row[i].records || r.left_out_bytes != row[i].left_out)
            printf("%s: ", row[i].name);
        CHECK_INT(r.records, row[i].records);
        CHECK_INT(r.left_out_bytes, row[i].left_out);
        CHECK_INT(heard.good, row[i].records);
    }
}

TEST(a_sink_may_stop)
{
    static uint8_t file[2 * BLOCK];
    block(file, "00:00:00.00");
    block(file + BLOCK, "00:00:01.00");
    heard.stop_after = 1;
    CHECK(import(file, sizeof file).stopped);
    CHECK_INT(heard.records, 1);
    heard.stop_after = 0;
}

static void recording(const char *path, uint64_t pings, bool made_up, double seconds)
{
    static uint8_t file[300000];
    FILE *f = fopen(path, "rb");
    CHECK(f != NULL);
    if (!f)
        return;
    const size_t n = fread(file, 1, sizeof file, f);
    fclose(f);
    CHECK_INT(import_kind(file, n), IMPORT_IMAGENEX);
    uint64_t start_ns = 0;
    CHECK(import_imagenex_start(file, n, &start_ns) == !made_up);
    const struct import_result r = import(file, n);
    CHECK_INT(r.records, pings);
    CHECK_INT(heard.good, pings);
    CHECK(r.times_made_up == made_up && r.left_out_bytes == 0 && heard.problems == 0 && !heard.falls);
    const double took = (double)(heard.t_ns - start_ns) * 1e-9;
    printf("# %s: %.2f s\n", path, took);
    CHECK_NEAR(took, seconds, 0, 1);
}

TEST(recordings)
{
    recording(FOLDER "hydroball.852", 177, true, 20.7);
    recording(FOLDER "19_26_51-2016_11_18-sonar.first400.852", 400, false, 399);
}

int main(void)
{
    RUN(times_of_day);
    RUN(dates);
    RUN(no_times);
    RUN(broken_files);
    RUN(reading_goes_on_behind_a_broken_block);
    RUN(a_sink_may_stop);
    if (access(FOLDER, R_OK) == 0)
        RUN(recordings);
    else
        printf("skip recordings: %s is not there\n", FOLDER);
    return test_end();
}
