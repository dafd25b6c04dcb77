/* SPDX-License-Identifier: MIT */
/* Imports of SeaNet lines: raw bytes, and a relay's log of datagrams;
 * every byte of the sonar arrives, with its time. */
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "client/ctl/import.h"
#include "drivers/devices/seanet_frame.h"
#include "tests/lib/test.h"

#define SEABED "../shared/data/tritech-seanet-rov-seabed/"

#define MS 1000000ull

static uint8_t joined[1 << 20];
static size_t n_joined;
static unsigned records, problems;
static uint64_t t_ns[8], last_ns;
static char problem[200];

static bool hear(void *ctx, uint64_t t, const uint8_t *bytes, size_t n)
{
    (void)ctx;
    CHECK(t >= last_ns);
    if (records < 8)
        t_ns[records] = t;
    records++;
    last_ns = t;
    memcpy(joined + n_joined, bytes, n);
    n_joined += n;
    return true;
}

static void hear_problem(void *ctx, const char *sentence)
{
    (void)ctx;
    snprintf(problem, sizeof(problem), "%s", sentence);
    problems++;
}

static const struct import_sink sink = {NULL, hear, hear_problem};

static void fresh(void)
{
    n_joined = records = problems = 0;
    last_ns = 0;
    problem[0] = '\0';
}

static struct import_result relay(const char *text)
{
    struct import_result result;
    const uint8_t *p = (const uint8_t *)text;
    fresh();
    CHECK_INT(import_kind(p, strlen(text)), IMPORT_SEANET_RELAY);
    CHECK(import_seanet_relay(p, strlen(text), &sink, &result));
    return result;
}

static const char log_text[] =
    "2017.11.02 23.59.59.900;10.3.0.40;13102;24 52 4F 56\r\n"
    "2017.11.02 23.59.59.950;10.3.0.40;4002;0F 11 0A 40 30 30 31 30 10 00 02 FF 0B 04 80 02 80\r\n"
    "2017.11.03 00.00.00.050;10.3.0.40;4002;40 e2 01 00 80 0c ca 0a\r\n"
    "2017.11.03 00.00.00.040;10.3.0.40;4002;07\n";

TEST(relayed_datagrams)
{
    struct import_result r = relay(log_text);
    CHECK_INT(records, 3);
    CHECK_INT(r.records, 3);
    CHECK_INT(n_joined, 17 + 8 + 1);
    CHECK_INT(joined[3], '@');
    CHECK_INT(joined[17], 0x40);
    CHECK_INT(joined[24], 10);
    const uint64_t midnight_ns = 1509667200000 * MS;
    CHECK_INT(t_ns[0], midnight_ns - 50 * MS);
    CHECK_INT(t_ns[1], midnight_ns + 50 * MS);
    CHECK_INT(t_ns[2], midnight_ns + 50 * MS); /* never back */
    CHECK_STR(problem, "1 datagrams of other ports are left out");
    CHECK_INT(r.left_out_bytes, 0);
    CHECK(!r.times_made_up);
}

TEST(lines_that_are_no_datagram)
{
    static const char *const bad[] = {
        "nonsense\n",
        "2017.11.02 23.59.59.950;10.3.0.40;4002;0\n",
        "2017.11.02 23.59.59.950;10.3.0.40;4002;0G\n",
        "2017.11.02 23.59.59.950;10.3.0.40;4002;01 0\n",
        "2017.11.02 23.59.59.950;10.3.0.40;4002;0102\n",
        "2017.11.02 24.59.59.950;10.3.0.40;4002;01\n",
        "2017.11.02 23.59.59.950;10.3.0.40;4002\n",
        "2017.11.02 23.59.59.950\n",
        "2017.13.02 23.59.59.950;10.3.0.40;4002;01\n",
        "2017-11-02 23.59.59.950;10.3.0.40;4002;01\n",
        "1917.11.02 23.59.59.950;10.3.0.40;4002;01\n",
        "\n",
    };
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
        char text[1000];
        snprintf(text, sizeof(text), "%s%s", log_text, bad[i]);
        struct import_result r = relay(text);
        CHECK_INT(records, 3);
        CHECK_INT(problems, 2);
        CHECK_INT(r.left_out_bytes, strlen(bad[i]));
    }
}

TEST(datagrams_without_a_frame)
{
    static const char text[] = "2017.11.02 23.59.59.900;10.3.0.40;13102;24 52 4F 56\n";
    struct import_result r;
    fresh();
    CHECK(!import_seanet_relay((const uint8_t *)text, sizeof(text) - 1, &sink, &r));
    CHECK_INT(records, 0);
}

/* Noise, an echo line of 100 bins at 10 ticks, an alive, half a frame. */
TEST(raw_bytes)
{
    uint8_t bytes[300] = {1, 2, '@', '@', '0'}, payload[131] = {0};
    struct import_result r;
    size_t n = 5;
    seanet_put_u16(payload + 20, 10);
    seanet_put_u16(payload + 29, 100);
    n += seanet_build(bytes + n, sizeof(bytes) - n,
                      (struct seanet_head){2, 255, SEANET_HEAD_DATA, SEANET_LAST_PACKET}, payload, 131);
    n += seanet_build(bytes + n, sizeof(bytes) - n, (struct seanet_head){2, 255, SEANET_ALIVE, SEANET_LAST_PACKET},
                      payload, 8);
    seanet_build(bytes + n, sizeof(bytes) - n, (struct seanet_head){2, 255, SEANET_ALIVE, SEANET_LAST_PACKET},
                 payload, 8);
    n += 11;
    CHECK_INT(import_kind(bytes, n), IMPORT_SEANET);
    fresh();
    import_seanet(bytes, n, &sink, &r);
    CHECK_INT(records, 3);
    CHECK_INT(n_joined, n);
    CHECK(memcmp(joined, bytes, n) == 0);
    CHECK_INT(t_ns[0], 100 * 10 * 640 + IMPORT_PACE_NS);
    CHECK_INT(t_ns[2], t_ns[0]);
    CHECK(r.times_made_up);
    CHECK_INT(import_kind(bytes + 145, 5), IMPORT_UNKNOWN);
}

/* The log and the bytes that were joined from it agree. */
TEST(recording)
{
    struct import_result r;
    struct stat st;
    int fd = open(SEABED "UdpHubLog_4001_2017_11_02_09_00_03.part1.csv", O_RDONLY);
    int raw = open(SEABED "sonar.part1.stream", O_RDONLY);
    fstat(fd, &st);
    const uint8_t *p = mmap(NULL, (size_t)st.st_size, PROT_READ, MAP_PRIVATE, fd, 0);
    fresh();
    CHECK(import_seanet_relay(p, (size_t)st.st_size, &sink, &r));
    CHECK_INT(records, 3086);
    CHECK_INT(problems, 1);
    munmap((void *)(uintptr_t)p, (size_t)st.st_size);
    fstat(raw, &st);
    CHECK_INT(n_joined, st.st_size);
    p = mmap(NULL, (size_t)st.st_size, PROT_READ, MAP_PRIVATE, raw, 0);
    CHECK(memcmp(joined, p, n_joined) == 0);
    CHECK_INT(import_kind(p, (size_t)st.st_size), IMPORT_SEANET);
    fresh();
    import_seanet(p, (size_t)st.st_size, &sink, &r);
    CHECK_INT(records, 383); /* 382 frames and what is left */
    CHECK_INT(n_joined, st.st_size);
    CHECK(memcmp(joined, p, n_joined) == 0);
    munmap((void *)(uintptr_t)p, (size_t)st.st_size);
    close(fd);
    close(raw);
}

int main(void)
{
    RUN(relayed_datagrams);
    RUN(lines_that_are_no_datagram);
    RUN(datagrams_without_a_frame);
    RUN(raw_bytes);
    if (access(SEABED, R_OK) == 0)
        RUN(recording);
    else
        printf("skip recording: " SEABED " is not there\n");
    return test_end();
}
