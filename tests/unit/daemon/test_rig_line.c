/* SPDX-License-Identifier: MIT */
/*
 * test_rig_line - bytes that no Ping360 should send, the test being the sonar: the right counter grows, the log says so
 * without taking their word for it, and the next good ping is taken. Other sonars on that line, with its faults: a
 * Micron, and one that says lists of echoes. The computer's clock is set while pings come.
 */
#include "tests/lib/rig.h"

#include <inttypes.h>

#include "tests/sim/lib/micron_head.h"

#define BOX "box -6 7 -5 4 -20 20\n"

static uint64_t counter(const char *name)
{
    json_t *status = rig_ask("status", "%s", ""), *sonar = json_array_get(json_object_get(status, "sensors"), 0);
    const uint64_t n = (uint64_t)json_integer_value(json_object_get(sonar, name));
    CHECK(json_is_integer(json_object_get(sonar, name)));
    json_decref(status);
    return n;
}

static uint64_t pings(void)
{
    return rig_stats().device.pings;
}

/* ---- the test is the sonar ---- */

static void say_nothing(uint64_t now_ns)
{
    uint8_t asked[4096];
    line_pump(&rig.sim.line, now_ns);
    while (line_read(&rig.sim.line, asked, sizeof asked, now_ns) > 0) {
    }
}

static void off(uint64_t now_ns)
{
    (void)now_ns;
}

static const struct rig_far mute = {"ping360", off, say_nothing};

struct bytes {
    uint8_t b[6000];
    size_t n;
};

static void put(struct bytes *to, const void *what, size_t n)
{
    memcpy(to->b + to->n, what, n);
    to->n += n;
}

static void put16(struct bytes *to, unsigned value)
{
    put(to, (const uint8_t[]){(uint8_t)value, (uint8_t)(value >> 8)}, 2);
}

#define RIGHT -1 /* the length, or checksum, that is right */

/* A message of the Ping protocol. */
static void put_message(struct bytes *to, unsigned id, const void *payload, size_t n, int length, int checksum)
{
    const size_t begin = to->n;
    unsigned sum = 0;
    put(to, "BR", 2);
    put16(to, length == RIGHT ? (unsigned)n : (unsigned)length);
    put16(to, id);
    put(to, (const uint8_t[]){2, 0}, 2);
    put(to, payload, n);
    for (size_t i = begin; i < to->n; i++)
        sum += to->b[i];
    put16(to, checksum == RIGHT ? sum & 0xffff : (unsigned)checksum);
}

/* Message 2300 with n samples of one level; what it says of them. */
struct shot {
    unsigned angle, period, samples, length;
    uint8_t level;
    size_t n;
};

#define GOOD_SHOT .period = 444, .samples = 600, .length = 600, .level = 20, .n = 600

static void put_ping(struct bytes *to, const struct shot *shot)
{
    struct bytes payload = {.n = 0};
    put(&payload, (const uint8_t[]){1, 1}, 2);
    put16(&payload, shot->angle);
    put16(&payload, 50);
    put16(&payload, shot->period);
    put16(&payload, 750);
    put16(&payload, shot->samples);
    put16(&payload, shot->length);
    memset(payload.b + payload.n, shot->level, shot->n);
    payload.n += shot->n;
    put_message(to, 2300, payload.b, payload.n, RIGHT, RIGHT);
}

static void send_bytes(const void *bytes, size_t n)
{
    CHECK_INT(send(rig.sim.line.fd, bytes, n, MSG_NOSIGNAL), (ssize_t)n);
}

static void send_ping(unsigned angle)
{
    struct bytes good = {.n = 0};
    put_ping(&good, &(struct shot){.angle = angle, GOOD_SHOT});
    send_bytes(good.b, good.n);
}

/* What no sonar should send, and a good ping after it. */
static void feed(const char *name, const struct bytes *what, const char *grows, const char *says)
{
    const uint64_t before = counter(grows), had = pings();
    const unsigned said = says ? rig_log_count(says) : 0;
    rig_run(11); /* the log says a kind of line five times in 10 s at the most */
    for (int i = 0; i < 60 && (i == 0 || (says && rig_log_count(says) <= said)); i++) {
        send_bytes(what->b, what->n); /* who it is matters only after the daemon has asked */
        send_ping(198);
        rig_run(0.1);
        send_ping(200);
        rig_run(0.2);
    }
    if (counter(grows) <= before || pings() <= had || (says && rig_log_count(says) <= said)) {
        printf("# %s: %s %" PRIu64 " -> %" PRIu64 ", pings %" PRIu64 " -> %" PRIu64 ", \"%s\" %u -> %u times\n",
               name, grows, before, counter(grows), had, pings(), says ? says : "", said,
               says ? rig_log_count(says) : 0);
        CHECK(false);
    }
    CHECK(!rig_log_count("\x1b") && !rig_log_count("\nand more"));
}

#define FED(name, grows, says, ...)                                                                               \
    do {                                                                                                          \
        struct bytes to = {.n = 0};                                                                               \
        __VA_ARGS__;                                                                                              \
        feed(name, &to, grows, says);                                                                             \
    } while (0)

static void feed_garbage(void)
{
    static const uint8_t zeros[5000];
    char starts[2000];
    uint64_t random = 1;
    struct bytes noise = {.n = 0};
    for (unsigned i = 0; i < 3000; i++) {
        random = random * 6364136223846793005u + 1442695040888963407u;
        const uint8_t byte = (uint8_t)(random >> 56);
        put(&noise, &(const uint8_t){byte == 'B' ? 'C' : byte}, 1);
    }
    feed("noise", &noise, "garbage_bytes", NULL);
    FED("zeros", "garbage_bytes", NULL, put(&to, zeros, sizeof zeros));
    memset(starts, 'B', sizeof starts);
    FED("starts alone", "garbage_bytes", NULL, put(&to, starts, 1000));
    for (size_t i = 1; i < sizeof starts; i += 2)
        starts[i] = 'R';
    FED("starts of messages", "garbage_bytes", NULL, put(&to, starts, sizeof starts));
    FED("checksum", "bad_checksum", NULL, put_message(&to, 2300, zeros, 100, RIGHT, 1));
    FED("greatest length", "garbage_bytes", NULL, put_message(&to, 2300, zeros, 50, 65535, RIGHT));
    FED("too great a length", "garbage_bytes", NULL, put_message(&to, 2300, zeros, 50, 1000, RIGHT));
    FED("too small a length", "bad_checksum", NULL, put_message(&to, 2300, zeros, 50, 10, RIGHT));
    FED("half a message", "garbage_bytes", NULL, put_ping(&to, &(struct shot){.angle = 200, GOOD_SHOT}),
        to.n = 300);
}

static void feed_pings(void)
{
    static const uint8_t zeros[20];
    FED("nothing in it", "bad_frame", NULL, put_message(&to, 2300, "", 0, RIGHT, RIGHT));
    FED("half a head", "bad_frame", NULL, put_message(&to, 2300, zeros, 13, RIGHT, RIGHT));
    FED("angle", "bad_frame", NULL, put_ping(&to, &(struct shot){.angle = 400, GOOD_SHOT}));
    FED("period 0", "bad_frame", NULL,
        put_ping(&to, &(struct shot){.angle = 200, .samples = 600, .length = 600, .n = 600}));
    FED("period", "bad_frame", NULL,
        put_ping(&to, &(struct shot){.angle = 200, .period = 65535, .samples = 600, .length = 600, .n = 600}));
    FED("data length", "pings", NULL,
        put_ping(&to, &(struct shot){.angle = 200, .period = 444, .samples = 600, .length = 65535, .n = 600}));
    FED("samples", "pings", NULL,
        put_ping(&to, &(struct shot){.angle = 200, .period = 444, .samples = 65535, .length = 10, .n = 10}));
    FED("saturated", "pings", NULL,
        put_ping(&to, &(struct shot){
                          .angle = 200, .period = 444, .samples = 600, .length = 600, .level = 255, .n = 600}));
    FED("zeros", "pings", NULL,
        put_ping(&to, &(struct shot){.angle = 200, .period = 444, .samples = 600, .length = 600, .n = 600}));
    FED("no samples", "frames", NULL,
        put_ping(&to, &(struct shot){.angle = 200, .period = 444, .length = 600, .level = 20, .n = 600}));
}

static void feed_messages(void)
{
    FED("unknown message", "frames", NULL, put_message(&to, 9999, "who am I", 8, RIGHT, RIGHT));
    FED("short ack", "bad_frame", NULL, put_message(&to, 1, "", 0, RIGHT, RIGHT));
    FED("short nack", "bad_frame", NULL, put_message(&to, 2, "\1", 1, RIGHT, RIGHT));
    FED("nack that writes on terminals", "nacks", "refused message 2600: \\x1b[2J\\xff%n%s",
        put_message(&to, 2, "\x28\x0a\x1b[2J\xff%n%s", 12, RIGHT, RIGHT));
    FED("text that makes lines", "frames", "says: sonard: error: lies\\x0aand more",
        put_message(&to, 3, "sonard: error: lies\nand more\r", 30, RIGHT, RIGHT));
    FED("short identity", "bad_frame", NULL, put_message(&to, 4, "\0", 2, RIGHT, RIGHT));
    FED("another device", "frames", "the device is of type 1, not a Ping360 (2)",
        put_message(&to, 4, "\1\0\3\35\0", 6, RIGHT, RIGHT));
}

TEST(bytes_that_no_sonar_sends)
{
    rig_far = &mute;
    rig_start("", "mode = transmit\n");
    rig_log_begin();
    feed_garbage();
    feed_pings();
    feed_messages();
    CHECK_INT(rig_log_count(": lost:"), 0); /* a line without a message for long is opened anew, and that is all */
    rig_log_end();
    rig_end();
    rig_far = &rig_ping360;
}

TEST(garbage_is_told_once)
{
    static const uint8_t zeros[3000];
    rig_far = &mute;
    rig_start("", "mode = transmit\n");
    rig_log_begin();
    for (unsigned i = 1; i <= 3; i++) {
        send_bytes(zeros, sizeof zeros);
        rig_run(1);
        CHECK_INT(counter("garbage_bytes"), i * sizeof zeros);
    }
    rig_run(20);
    CHECK_INT(rig_log_count("bytes that are not valid ping360 messages; check the baud rate"), 1);
    CHECK(rig_log_count("front: serial:/dev/rig:115200: "));
    rig_log_end();
    rig_end();
    rig_far = &rig_ping360;
}

/* A line on which a good ping gets through now and then. */
TEST(a_wrong_baud_rate_is_named)
{
    uint8_t noise[3072];
    for (size_t i = 0; i < sizeof noise; i++)
        noise[i] = (uint8_t)(128 + i % 128);
    rig_far = &mute;
    rig_start("", "mode = transmit\n");
    rig_log_begin();
    for (unsigned angle = 198; angle <= 202; angle += 2)
        send_ping(angle);
    RIG_UNTIL(strcmp(rig_status("data", false), "ok") == 0, 1);
    for (unsigned angle = 0; angle < 40; angle += 2) {
        send_bytes(noise, sizeof noise);
        send_ping(angle);
        rig_run(0.1);
    }
    CHECK(pings() > 10);
    CHECK(strstr(rig_status("data", false), "check the baud rate"));
    RIG_UNTIL(rig_log_count("check the baud rate 115200"), 10);
    rig_log_end();
    rig_end();
    rig_far = &rig_ping360;
}

/* ---- a Micron ---- */

static struct micron_head micron;

static void micron_send(void *ctx, const uint8_t *frame, size_t n, uint64_t now_ns)
{
    (void)ctx;
    line_send(&rig.sim.line, frame, n, now_ns);
}

static void micron_listen(void *ctx, const struct micron_head_shot *shot, uint8_t *samples)
{
    const struct water_shot beam = {.head = SOUND_MICRON,
                                    .az_rad = (shot->bearing - MICRON_AHEAD) * GEO_TURN / MICRON_TURN,
                                    .t_s = (double)shot->t_ns * 1e-9,
                                    .sample_s = shot->settings.interval * MICRON_TICK_S,
                                    .transmit_s = shot->settings.pulse_us * 1e-6,
                                    .frequency_hz = 700e3,
                                    .gain = shot->settings.gain / 84,
                                    .n_samples = shot->settings.n_bins,
                                    .number = micron.pings};
    (void)ctx;
    water_listen(&rig.sim.water, &rig.sim.scene, &beam, samples);
}

static void micron_start(uint64_t now_ns)
{
    const struct micron_head_io io = {.send = micron_send, .listen = micron_listen};
    const struct micron_head_conf conf = {
        .serial = 1234, .centring_s = 1, .ms_per_gradian = 1, .processing_ms = 1, .sound_speed_mps = 1500};
    micron_head_init(&micron, &conf, &io, now_ns);
}

static void micron_turn(uint64_t now_ns)
{
    uint8_t bytes[4096];
    size_t n;
    while ((n = line_read(&rig.sim.line, bytes, sizeof bytes, now_ns)) > 0)
        micron_head_feed(&micron, bytes, n, now_ns);
    micron_head_tick(&micron, now_ns);
    line_pump(&rig.sim.line, now_ns);
}

static const struct rig_far micron_far = {"micron", micron_start, micron_turn};

#define MICRON_SCAN 200 /* pings of a full circle at 1.8 degrees */

static void check_wall(double azimuth_deg, double wall_m)
{
    json_t *sectors = rig_ask("sectors", "\"distance_m\":0"),
           *sector = json_array_get(json_object_get(sectors, "sectors"), (size_t)(azimuth_deg / 5));
    CHECK_STR(json_string_value(json_object_get(sector, "state")), "blocked");
    CHECK_NEAR(json_number_value(json_object_get(sector, "range_m")), wall_m, 0, 0.3);
    json_decref(sectors);
    for (int behind = 0; behind < 2; behind++) {
        json_t *answer = rig_ask("blocked", "\"azimuth_deg\":%g,\"distance_m\":%g", azimuth_deg,
                                 behind ? wall_m + 0.5 : 0.8 * wall_m);
        CHECK_STR(json_string_value(json_object_get(answer, "state")), behind ? "blocked" : "clear");
        json_decref(answer);
    }
}

TEST(a_micron_loses_no_more_than_its_broken_frames)
{
    struct line_faults *faults = &rig.sim.line.faults;
    rig_far = &micron_far;
    rig_start(BOX, "mode = auto\n");
    rig_run_pings(20);
    faults->drop = 1, rig_run_pings(10);
    faults->cut = 1, rig_run_pings(10);
    faults->garbage = 500, rig_run_pings(10);
    faults->corrupt = 1, rig_run_pings(10);
    faults->split = true, rig_run_pings(10);
    micron.faults.motor_errors = 1, rig_run_pings(10);
    CHECK_INT(rig_stats().device.restarts, 0);
    CHECK_INT(counter("lost_frames"), 2); /* dropped and cut */
    CHECK(counter("garbage_bytes") >= 500);
    rig_run_pings(2 * MICRON_SCAN + 20);
    check_wall(0, 7), check_wall(90, 4), check_wall(180, 6), check_wall(270, 5);
    rig_end();
    rig_far = &rig_ping360;
}

TEST(a_micron_outlives_floods_stalls_silence_and_switching_off)
{
    struct line_faults *faults = &rig.sim.line.faults;
    rig_far = &micron_far;
    rig_start(BOX, "mode = auto\n");
    rig_log_begin();
    rig_run_pings(20);
    faults->flood_ns = rig_now_ns + RIG_S;
    rig_run(1);
    rig_run_pings(20);
    faults->stall_ns = rig_now_ns + 2ull * RIG_S;
    rig_run_pings(20);
    const uint64_t restarts = rig_stats().device.restarts;
    faults->silent_ns = rig_now_ns + 7ull * RIG_S;
    RIG_UNTIL(strcmp(rig_status("state", true), "silent") == 0, 7);
    const unsigned told = rig_log_count("stopped sending pings");
    rig_run_pings(10);
    CHECK_INT(rig_log_count("stopped sending pings"), told);
    CHECK(told > 0);
    micron_head_boot(&micron, rig_now_ns);
    rig_run_pings(20);
    CHECK_INT(rig_stats().device.restarts, restarts + 1);
    rig_log_end();
    rig_end();
    rig_far = &rig_ping360;
}

/* ---- lists of echoes ---- */

static uint64_t next_list_ns;
static int list_deg;

/* A wall at 3 m, in lines with a checksum, from side to side. */
static void lists_turn(uint64_t now_ns)
{
    char line[80];
    unsigned sum = 0;
    say_nothing(now_ns);
    if (now_ns < next_list_ns)
        return;
    next_list_ns = now_ns + RIG_S / 20;
    list_deg = list_deg >= 90 ? -90 : list_deg + 3;
    size_t n = (size_t)snprintf(line, sizeof line, "$ECHO,%d.0,0.0,1,4000.0,50.0", list_deg);
    for (size_t i = 1; i < n; i++)
        sum ^= (unsigned char)line[i];
    n += (size_t)snprintf(line + n, sizeof line - n, "*%02X\r\n", sum);
    line_send(&rig.sim.line, (const uint8_t *)line, n, now_ns);
}

static const struct rig_far lists = {"echolist", off, lists_turn};

TEST(lists_of_echoes_on_a_poor_line)
{
    rig_far = &lists;
    rig_start("", "step = 3 deg\nmode = auto\n");
    rig_run_pings(5);
    rig.sim.line.faults.corrupt = 5;
    RIG_UNTIL(counter("bad_checksum") >= 4, 5); /* a bit of the line's end has no checksum */
    rig.sim.line.faults.garbage = 300;
    rig_run_pings(20);
    CHECK(counter("garbage_bytes") > 0);
    rig.sim.line.faults.silent_ns = rig_now_ns + 8ull * RIG_S;
    RIG_UNTIL(strcmp(rig_status("state", true), "silent") == 0, 8);
    RIG_UNTIL(strcmp(rig_status("state", true), "running") == 0, 8);
    rig_end();
    rig_far = &rig_ping360;
}

/* ---- the computer's clock ---- */

static double number_in(json_t *answer, const char *name)
{
    return json_number_value(json_object_get(answer, name));
}

#define STILL "\"attitude_deg\":[0,0,0],\"position_m\":[0,0,0]"

/* Ahead by a day and back by two: no age moves with it. */
TEST(the_clock_is_set_and_no_age_moves)
{
    static const int ahead_s[] = {86400, -86400, 0};
    rig_start(BOX, "[pose]\nmax_age = 160 s\n[grid]\nclear_for = 60 s\nforget = 160 s\n");
    json_decref(rig_ask("pose", STILL));
    const uint64_t begun_ns = rig_now_ns;
    uint64_t told_ns = rig_now_ns;
    rig_run(70);
    for (size_t i = 0; i < sizeof ahead_s / sizeof ahead_s[0]; i++) {
        rig.clock_off_ns = ahead_s[i] * (int64_t)RIG_S;
        const double unix_s = (double)(rig_now_ns + RIG_EPOCH_NS) * 1e-9 + ahead_s[i];
        json_t *answer = rig_ask("sectors", "\"distance_m\":0"), *sector;
        size_t k;
        CHECK_NEAR(number_in(answer, "t_unix"), unix_s, 0, 0.1);
        CHECK_NEAR(number_in(answer, "pose_age_s"), (double)(rig_now_ns - told_ns) * 1e-9, 0, 0.1);
        json_array_foreach(json_object_get(answer, "sectors"), k, sector)
        {
            CHECK_STR(json_string_value(json_object_get(sector, "state")), "blocked");
            CHECK(number_in(sector, "age_s") >= 0 &&
                  number_in(sector, "age_s") <= (double)(rig_now_ns - begun_ns) * 1e-9);
        }
        json_decref(answer);
        CHECK_INT(rig_stats().device.timeouts, 0);
        json_decref(rig_ask("pose", STILL ",\"t_unix\":%.6f", unix_s));
        told_ns = rig_now_ns;
        answer = rig_ask("sectors", "%s", "");
        CHECK_NEAR(number_in(answer, "pose_age_s"), 0, 0, 0.1);
        json_decref(answer);
        rig_run_pings(20);
    }
    rig_end();
}

int main(void)
{
    RUN(bytes_that_no_sonar_sends);
    RUN(garbage_is_told_once);
    RUN(a_wrong_baud_rate_is_named);
    RUN(a_micron_loses_no_more_than_its_broken_frames);
    RUN(a_micron_outlives_floods_stalls_silence_and_switching_off);
    RUN(lists_of_echoes_on_a_poor_line);
    RUN(the_clock_is_set_and_no_age_moves);
    return test_end();
}
