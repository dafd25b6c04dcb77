/* SPDX-License-Identifier: MIT */
/* Echo lists: good lines, every way in which a line can be wrong, cuts and noise, sweeps, silence. */
#include "core/fault.h"
#include "drivers/devices/device.h"
#include "tests/lib/test.h"

#define MS        1000000ull
#define SECOND    1000000000ull
#define BEAMS_MAX 16

static const struct device_ops *const ops = &device_echolist;
static _Alignas(16) uint8_t state[8192];
static uint64_t now_ns;
static int n_pings, n_notes;
static struct ping ping;
static struct ping_beam beam[BEAMS_MAX];

static void on_send(void *ctx, const uint8_t *bytes, size_t n)
{
    (void)ctx, (void)bytes, (void)n;
    CHECK(false);
}

static void on_break(void *ctx, bool on)
{
    (void)ctx, (void)on;
    CHECK(false);
}

static struct ping *on_begin(void *ctx)
{
    (void)ctx;
    memset(beam, 0, sizeof beam);
    ping = (struct ping){.beam = beam, .max_beams = BEAMS_MAX};
    return &ping;
}

static void on_done(void *ctx, struct ping *p)
{
    (void)ctx;
    CHECK(p == &ping && p->n_beams >= 1 && p->n_beams <= BEAMS_MAX);
    n_pings++;
}

static void on_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx, (void)level, (void)fmt;
    n_notes++;
}

static const struct device_io io = {NULL, on_send, on_break, on_begin, on_done, on_note};

static void begin(bool listen_only)
{
    const struct device_conf conf = {
        .range_m = 30.0, .sound_speed_mps = 1500.0, .listen_only = listen_only, .baud = 9600};
    struct fault fault;
    CHECK(ops->state_size <= sizeof state && ops->init(state, &conf, &fault));
    now_ns = 10 * SECOND;
    n_pings = n_notes = 0;
    ops->opened(state, now_ns, &io);
}

static void say(const char *text)
{
    now_ns += 100 * MS;
    ops->feed(state, (const uint8_t *)text, strlen(text), now_ns, &io);
}

static struct device_status status_now(void)
{
    struct device_status s;
    ops->status(state, &s);
    return s;
}

TEST(two_echoes)
{
    begin(false);
    say("$ECHO,30.5,-10,2,4000,80,20000.5,0*3E\r\n");
    CHECK_INT(n_pings, 1);
    CHECK_INT(status_now().frames, 1);
    CHECK(ping.kind == PING_RANGES && ping_bytes(&ping) == 0);
    CHECK_INT(ping.n_beams, 2);
    CHECK_NEAR(beam[0].az_rad, geo_rad(30.5), 1e-6, 0);
    CHECK_NEAR(beam[0].el_rad, geo_rad(-10), 1e-6, 0);
    CHECK(beam[1].az_rad == beam[0].az_rad && beam[1].el_rad == beam[0].el_rad);
    CHECK_NEAR(beam[0].range_m, 3.0, 1e-6, 0);
    CHECK_NEAR(beam[1].range_m, 15.000375, 1e-6, 0);
    CHECK_NEAR(beam[0].confidence, 0.9, 1e-6, 0);
    CHECK_NEAR(beam[1].confidence, 0.5, 1e-6, 0);
    CHECK_NEAR(ping.az_aperture_rad, geo_rad(6.5), 1e-6, 0);
    CHECK(ping.dr_m == 30.0f && ping.head_units == 305 && ping.head_turn == 3600);
    /* 36 bytes at 9600 baud, and 40 ms of listening before */
    CHECK_NEAR((double)(now_ns - ping.t_ns), 36e10 / 9600 + 40e6, 0, 1.2e6);
    CHECK_INT(status_now().garbage_bytes, 0);
}

TEST(good_lines)
{
    static const struct {
        const char *line;
        int beams;
        double first_m;
    } row[] = {
        {"$ECHO,0,0,0\n", 1, 0},
        {"$ECHO,0,0,0*1D\n", 1, 0},
        {"$ECHO,0,0,0*1d\n", 1, 0},
        {"$ECHO,-360,90,1,1,100\r\n", 1, 0.00075},
        {"$ECHO,360,-90,1,100,0.5\r", 1, 0.075},
        {"$ECHO,0.000001,-0.5,0\n", 1, 0},
        {"$ECHO,0,0,1,40001,50\n", 1, 0}, /* beyond the range: not listened for */
        {"$ECHO,0,0,2,4000,50,40001,50\n", 1, 3.0},
        {"$ECHO,0,0,16,1,1,2,1,3,1,4,1,5,1,6,1,7,1,8,1,9,1,10,1,11,1,12,1,13,1,14,1,15,1,16,1\n", 16, 0.00075},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin(false);
        say(row[i].line);
        if (n_pings != 1 || ping.n_beams != row[i].beams ||
            fabs((double)beam[0].range_m - row[i].first_m) > 1e-6 || !(beam[0].az_rad >= 0.0f)) {
            printf("%s: %d pings, %u beams, %g m\n", row[i].line, n_pings, ping.n_beams, (double)beam[0].range_m);
            CHECK(false);
        }
    }
}

TEST(bad_lines)
{
    static const struct {
        const char *line;
        int checksum, frame, garbage;
    } row[] = {
        {"$ECHO,0,0,0*1E\n", 1, 0, 14},
        {"$ECHO,0,0,0*\n", 1, 0, 12},
        {"$ECHO,0,0,0*1\n", 1, 0, 13},
        {"$ECHO,0,0,0*1DF\n", 1, 0, 15},
        {"$ECHO,0,0,0*1D*\n", 1, 0, 15},
        {"$ECHO\n", 0, 1, 0},
        {"$ECHO,\n", 0, 1, 0},
        {"$ECHO,0,0\n", 0, 1, 0},
        {"$ECHO,0,0,0,\n", 0, 1, 0},
        {"$ECHO,0,0,1\n", 0, 1, 0},
        {"$ECHO,0,0,1,5\n", 0, 1, 0},
        {"$ECHO,0,0,1,5,5,6\n", 0, 1, 0},
        {"$ECHO,0,0,2,5,5\n", 0, 1, 0},
        {"$ECHO,0,0,2,5,5,5,5\n", 0, 1, 0}, /* not rising */
        {"$ECHO,0,0,1,0,5\n", 0, 1, 0},
        {"$ECHO,0,0,1,-5,5\n", 0, 1, 0},
        {"$ECHO,0,0,1,5,101\n", 0, 1, 0},
        {"$ECHO,0,0,1,5,-1\n", 0, 1, 0},
        {"$ECHO,0,0,17\n", 0, 1, 0},
        {"$ECHO,0,0,0.5\n", 0, 1, 0},
        {"$ECHO,0,0,-1\n", 0, 1, 0},
        {"$ECHO,361,0,0\n", 0, 1, 0},
        {"$ECHO,0,90.1,0\n", 0, 1, 0},
        {"$ECHO,nan,0,0\n", 0, 1, 0},
        {"$ECHO,inf,0,0\n", 0, 1, 0},
        {"$ECHO,1e1,0,0\n", 0, 1, 0},
        {"$ECHO,0x1,0,0\n", 0, 1, 0},
        {"$ECHO, 1,0,0\n", 0, 1, 0},
        {"$ECHO,+1,0,0\n", 0, 1, 0},
        {"$ECHO,.5,0,0\n", 0, 1, 0},
        {"$ECHO,--5,0,0\n", 0, 1, 0},
        {"$ECHO,0000000000,0,0\n", 0, 1, 0},
        {"$ECHO,0.0000000,0,0\n", 0, 1, 0},
        {"$GPGGA,1,2\n", 0, 0, 10},
        {"$GPGGA,1,2*55\r\n!AIVDM,1,1,,A,13aGua?P00PHfERNFruh0?vN289E,0*36\r\n", 0, 0, 0},
        {"!AIVDM,1,1,,A,13aGua?P00PHfERNFruh0?vN289E,0*37\n", 1, 0, 47},
        {"$*00\n", 0, 0, 4},
        {"!*00\n", 0, 0, 4},
        {"ECHO,0,0,0\n", 0, 0, 10},
        {"$ECHO,0,0,\x80\n", 0, 0, 11},
        {"$ECHO,0,\t0,0\n", 0, 0, 12},
        {"$ECHO,0,0$\n", 0, 0, 10},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin(false);
        say(row[i].line);
        const struct device_status s = status_now();
        if (n_pings != 0 || s.bad_checksum != (uint64_t)row[i].checksum || s.bad_frame != (uint64_t)row[i].frame ||
            s.garbage_bytes != (uint64_t)row[i].garbage) {
            printf("%.*s: %d pings, checksum %" PRIu64 ", frame %" PRIu64 ", garbage %" PRIu64 "\n",
                   (int)strcspn(row[i].line, "\n"), row[i].line, n_pings, s.bad_checksum, s.bad_frame,
                   s.garbage_bytes);
            CHECK(false);
        }
        say("$ECHO,0,0,0\n"); /* the next one counts again */
        CHECK_INT(n_pings, 1);
    }
}

TEST(a_line_without_end_is_thrown_away)
{
    begin(false);
    say("$ECHO,");
    for (int i = 0; i < 100; i++)
        say("0000000000");
    say("\n$ECHO,0,0,0\n");
    CHECK_INT(n_pings, 1);
    CHECK_INT(status_now().garbage_bytes, 1006);
}

TEST(a_line_that_the_loss_of_the_port_cuts_off_is_no_garbage)
{
    begin(false);
    say("$ECHO,0,");
    ops->closed(state, now_ns);
    ops->opened(state, now_ns, &io);
    say("$ECHO,0,0,0\n");
    CHECK_INT(n_pings, 1);
    CHECK_INT(status_now().cut_bytes, 8);
    CHECK_INT(status_now().garbage_bytes, 0);
}

TEST(lines_survive_cuts_and_noise)
{
    uint64_t seed = test_seed();
    static char stream[100000];
    for (int round = 0; round < 20; round++) {
        size_t n = 0, noise = 0;
        int made = 0;
        while (n < sizeof stream - 200) {
            for (uint64_t k = test_random(&seed) % 30; k > 0; k--) {
                const char c = (char)test_random(&seed);
                if (c == '$' || c == '\n' || c == '\r')
                    continue;
                stream[n++] = c;
                noise++;
            }
            n += (size_t)snprintf(stream + n, sizeof stream - n, "$ECHO,%.1f,0,1,%d,5\r\n",
                                  360 * test_uniform(&seed), 1 + (int)(test_random(&seed) % 30000));
            made++;
        }
        begin(true);
        for (size_t at = 0; at < n;) {
            size_t piece = 1 + test_random(&seed) % 50;
            piece = piece < n - at ? piece : n - at;
            now_ns += MS;
            ops->feed(state, (const uint8_t *)stream + at, piece, now_ns, &io);
            at += piece;
        }
        CHECK_INT(n_pings, made);
        CHECK_INT(status_now().garbage_bytes, noise);
    }
}

static int turns(const double *scan_deg, int n)
{
    int count = 0;
    char line[64];
    begin(false);
    for (int i = 0; i < n; i++) {
        snprintf(line, sizeof line, "$ECHO,%.1f,0,0\n", scan_deg[i]);
        say(line);
        count += ping.flags == PING_NEW_TURN;
    }
    return count;
}

TEST(sweeps)
{
    double scan_deg[121];
    for (int i = 0; i < 121; i++)
        scan_deg[i] = fmod(i * 6.0, 360.0); /* two turns */
    CHECK_INT(turns(scan_deg, 60), 0);
    CHECK_INT(turns(scan_deg, 61), 1);
    CHECK_INT(turns(scan_deg, 121), 2);
    const double to_and_fro[] = {-12, -6, 0, 6, 12, 6, 0, -6, -12, -6, 0, 0, 0};
    CHECK_INT(turns(to_and_fro, 13), 2);
}

TEST(silence_is_told_once_and_ends)
{
    begin(false);
    CHECK_INT(status_now().state, DEVICE_IDENTIFY);
    say("$ECHO,0,0,0\n");
    CHECK_INT(status_now().state, DEVICE_RUNNING);
    now_ns = ops->deadline(state);
    n_notes = 0;
    ops->tick(state, now_ns, &io);
    CHECK_INT(status_now().state, DEVICE_SILENT);
    CHECK_INT(n_notes, 1);
    CHECK(ops->deadline(state) == UINT64_MAX);
    say("$ECHO,0,0,0\n");
    CHECK_INT(status_now().state, DEVICE_RUNNING);
    ops->stop(state, now_ns, &io);
    say("$ECHO,0,0,0\n");
    CHECK(ops->deadline(state) == UINT64_MAX);
    CHECK_INT(status_now().state, DEVICE_CLOSED);
}

TEST(a_replay_waits_for_nothing)
{
    begin(true);
    CHECK(ops->deadline(state) == UINT64_MAX);
    say("$ECHO,0,0,0\n");
    CHECK(ops->deadline(state) == UINT64_MAX);
}

int main(void)
{
    RUN(two_echoes);
    RUN(good_lines);
    RUN(bad_lines);
    RUN(a_line_without_end_is_thrown_away);
    RUN(a_line_that_the_loss_of_the_port_cuts_off_is_no_garbage);
    RUN(lines_survive_cuts_and_noise);
    RUN(sweeps);
    RUN(silence_is_told_once_and_ends);
    RUN(a_replay_waits_for_nothing);
    return test_end();
}
