/* SPDX-License-Identifier: MIT */
/*
 * The import of .svlog files: every byte is handed on, in order, at the time of the sonar's pings.
 */
#include "client/ctl/import.h"
#include "drivers/devices/ping_bytes.h"
#include "drivers/devices/ping_frame.h"
#include "tests/lib/test.h"

static uint8_t file[1 << 16], heard[1 << 17];
static size_t size, heard_n;
static uint64_t times[64];
static unsigned records, stop_at;

static bool hear(void *ctx, uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    (void)ctx;
    CHECK(n > 0 && heard_n + n <= sizeof(heard));
    memcpy(heard + heard_n, bytes, n);
    heard_n += n;
    times[records++ % 64] = t_ns;
    return records != stop_at;
}

static void problem(void *ctx, const char *sentence)
{
    (void)ctx;
    (void)sentence;
    CHECK(false);
}

static void add(uint16_t id, const void *payload, size_t n)
{
    size += ping_frame_build(file + size, sizeof(file) - size, id, 1, payload, n);
}

static void add_points(uint32_t ms)
{
    uint8_t payload[5000] = {0};
    put_u32(payload, ms);
    add(SURVEYOR_ATOF_POINTS, payload, sizeof(payload));
}

static void begin(void)
{
    size = heard_n = 0;
    records = stop_at = 0;
    add(10, "{\"device\": \"Surveyor\"}", 22);
}

static struct import_result import(void)
{
    static const struct import_sink sink = {NULL, hear, problem};
    struct import_result result;
    CHECK_INT(import_kind(file, size), IMPORT_SVLOG);
    import_svlog(file, size, &sink, &result);
    return result;
}

static void all_is_there(void)
{
    CHECK_INT(heard_n, size);
    CHECK(memcmp(heard, file, size) == 0);
}

TEST(pings_have_the_sonars_time)
{
    static const uint64_t want_ms[] = {0, 0, 0, 50, 100, 100, 150};
    begin();
    add_points(7000);
    add(504, "attitude", 8);
    add_points(7050);
    add_points(7100);
    add_points(20); /* switched off and on */
    add_points(70);
    CHECK_INT(import().records, 7);
    for (int i = 0; i < 7; i++)
        CHECK_INT(times[i], want_ms[i] * 1000000);
    all_is_there();
}

/* The maker's older form of points, as a head may be set to send it alone: its first four bytes are the clock, too. */
TEST(points_of_the_older_form_have_the_sonars_time)
{
    uint8_t payload[108] = {0};
    begin();
    for (uint32_t i = 0; i < 30; i++) {
        put_u32(payload, 5000 + 100 * i);
        add(SURVEYOR_YZ_POINTS, payload, sizeof(payload));
    }
    CHECK_INT(import().records, 31);
    CHECK_INT(times[1], 0);
    CHECK_INT(times[30], 2900000000);
    all_is_there();
}

TEST(the_date_of_the_recording_is_kept)
{
    static const struct {
        const char *stamp;
        uint64_t ns; /* 0: no date */
    } row[] = {{"2024-04-02T18:54:51.404Z", 1712084091404000000},
               {"2024-04-02T18:54:51+00:00", 1712084091000000000},
               {"2024-04-02T18:54:51.40400000000Z", 1712084091404000000},
               {"2024-04-02T18:54:51+02:00", 0},
               {"2024-04-02 18:54:51Z", 0},
               {"2024-13-02T18:54:51Z", 0},
               {"9999-04-02T18:54:51Z", 0},
               {"2024", 0},
               {"2024-04-02T18:54:51", 0}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        char text[128];
        uint64_t start_ns = 0;
        size = heard_n = records = 0;
        const int n = snprintf(text, sizeof text, "{\"session_id\": 1, \"timestamp\": \"%s\"}", row[i].stamp);
        add(10, text, (size_t)n);
        add_points(7000);
        add_points(7050);
        import();
        CHECK_INT(import_svlog_start(file, size, &start_ns), row[i].ns > 0);
        CHECK_INT(start_ns, row[i].ns);
        CHECK_INT(times[0], row[i].ns);
        CHECK_INT(times[2], row[i].ns + 50000000);
        all_is_there();
    }
}

TEST(what_is_no_frame_is_kept)
{
    begin();
    memcpy(file + size, "BRnoise", 7);
    size += 7;
    add_points(1000);
    file[size - 100] ^= 1;
    add_points(1050);
    memcpy(file + size, "BR\x10\0the end", 11);
    size += 11;
    CHECK_INT(import().records, 3);
    all_is_there();
}

TEST(a_file_cut_anywhere_is_kept)
{
    begin();
    add_points(1000);
    size_t whole = size;
    for (size = PING_OVERHEAD; size < whole; size += 13) {
        heard_n = 0;
        import();
        all_is_there();
    }
}

TEST(the_sink_stops_it)
{
    begin();
    add_points(1000);
    add_points(1050);
    stop_at = 2;
    struct import_result result = import();
    CHECK(result.stopped);
    CHECK_INT(result.records, 2);
}

/* The same records at the same times, wherever it is cut; garbage is kept, too, however much there is. */
TEST(any_pieces_give_the_same)
{
    static const struct import_sink sink = {NULL, hear, problem};
    static struct svlog_stream stream;
    struct import_result result;
    uint64_t seed = test_seed(), want_times[64];
    begin();
    add_points(7000);
    memcpy(file + size, "BRnoise", 7);
    size += 7;
    add_points(7050);
    add_points(7100);
    file[size - 100] ^= 1;
    add_points(7200);
    memcpy(file + size, "BR\x10\0the end", 11);
    size += 11;
    const uint64_t want = import().records;
    memcpy(want_times, times, sizeof times);
    for (size_t most = 1; most <= size; most *= 7) {
        heard_n = records = 0;
        import_svlog_begin(&stream, &sink, 0, &result);
        for (size_t at = 0, n; at < size; at += n) {
            n = 1 + test_random(&seed) % most;
            n = n < size - at ? n : size - at;
            CHECK(import_svlog_take(&stream, file + at, n));
        }
        import_svlog_end(&stream);
        all_is_there();
        CHECK_INT(result.records, want);
        CHECK(memcmp(want_times, times, want * sizeof *times) == 0);
    }
}

TEST(garbage_is_handed_on_before_it_fills_the_memory)
{
    static const struct import_sink sink = {NULL, hear, problem};
    static const uint8_t zeros[5000] = {0};
    static struct svlog_stream stream;
    struct import_result result;
    begin();
    import_svlog_begin(&stream, &sink, 0, &result);
    for (int round = 0; round < 100; round++) {
        CHECK(import_svlog_take(&stream, zeros, sizeof zeros));
        heard_n = heard_n > 40000 ? 0 : heard_n;
    }
    CHECK(records > 0);
}

int main(void)
{
    RUN(any_pieces_give_the_same);
    RUN(garbage_is_handed_on_before_it_fills_the_memory);
    RUN(pings_have_the_sonars_time);
    RUN(points_of_the_older_form_have_the_sonars_time);
    RUN(the_date_of_the_recording_is_kept);
    RUN(what_is_no_frame_is_kept);
    RUN(a_file_cut_anywhere_is_kept);
    RUN(the_sink_stops_it);
    return test_end();
}
