/* SPDX-License-Identifier: MIT */
/*
 * Telemetry logs of a real vehicle, where they are at hand: every packet is found, none invented. A log is records of
 * 8 bytes of time and one packet; the walk below knows no more than that and the packets' length.
 */
#include "client/mavlink/mavlink_vehicle.h"
#include "tests/lib/test.h"

#define FOLDER    "../shared/data/mavlink-bluerov2-tlog/"
#define DISTANCES 1561 /* DISTANCE_SENSOR packets in the second log, good and broken */

struct log {
    uint8_t *bytes;
    size_t n;
};

static struct log load(const char *path)
{
    struct log log = {0};
    FILE *file = fopen(path, "rb");
    if (!file)
        return log;
    fseek(file, 0, SEEK_END);
    log.n = (size_t)ftell(file);
    rewind(file);
    log.bytes = malloc(log.n);
    if (fread(log.bytes, 1, log.n, file) != log.n)
        log.n = 0;
    fclose(file);
    return log;
}

/* The next record's packet and time; NULL at the end. */
static const uint8_t *next_packet(const struct log *log, size_t *at, size_t *size, uint64_t *t_us)
{
    const uint8_t *packet = log->bytes + *at + 8;
    if (*at + 8 >= log->n)
        return NULL;
    *t_us = 0;
    for (int i = 0; i < 8; i++)
        *t_us = *t_us << 8 | log->bytes[*at + (size_t)i];
    *size = packet[0] == 0xFE ? packet[1] + 8u : packet[1] + 12u + (packet[2] & 1 ? 13u : 0u);
    *at += 8 + *size;
    return packet;
}

static uint32_t packet_id(const uint8_t *packet)
{
    return packet[0] == 0xFE ? packet[5] : packet[7] | (uint32_t)packet[8] << 8 | (uint32_t)packet[9] << 16;
}

/*
 * As one stream of bytes, cut anywhere: counts by message against the walk. `broken` of the packets have a CRC that
 * does not belong to their bytes: the program that wrote the log had cut zeros off after it was computed.
 */
static void check_stream(const struct log *log, uint64_t records, uint64_t broken_distances,
                         uint64_t broken_commands)
{
    const uint64_t broken = broken_distances + broken_commands;
    static uint64_t walked[12000], parsed[12000];
    uint8_t *stream = malloc(log->n);
    struct mavlink_parser parser = {0};
    struct mavlink_frame frame;
    uint64_t random = test_seed(), t_us, known = 0, total = 0;
    size_t at = 0, size, n = 0;
    const uint8_t *packet;
    memset(walked, 0, sizeof walked);
    memset(parsed, 0, sizeof parsed);
    while ((packet = next_packet(log, &at, &size, &t_us))) {
        memcpy(stream + n, packet, size);
        n += size;
        total++;
        known += mavlink_message(packet_id(packet)) != NULL;
        walked[packet_id(packet) % 12000]++;
    }
    CHECK_INT(at, log->n);
    CHECK_INT(total, records);
    for (size_t i = 0; i < n;) {
        const uint8_t *bytes = stream + i;
        size_t k = 1 + test_random(&random) % 300, left;
        left = k = k < n - i ? k : n - i;
        while (mavlink_parser_next(&parser, &bytes, &left, &frame))
            parsed[frame.message->id % 12000]++;
        i += k;
    }
    walked[MAVLINK_DISTANCE_SENSOR] -= broken_distances;
    walked[MAVLINK_COMMAND_LONG] -= broken_commands;
    for (uint32_t id = 0; id < 12000; id++)
        if (mavlink_message(id))
            CHECK_INT(parsed[id], walked[id]);
    CHECK_INT(parser.counters.frames, known - broken);
    CHECK(parser.counters.bad_crc >= broken);
    if (broken == 0) {
        CHECK(total - known - parser.counters.unknown <= 1); /* the last waits for what follows */
        CHECK_INT(parser.counters.bad_crc, 0);
        CHECK_INT(parser.counters.garbage_bytes, 0);
    }
    free(stream);
}

/* The times between the packets are taken for what they are, garbage: nothing is made of them, nothing is lost. */
static void check_garbage(const struct log *log, uint64_t broken)
{
    struct mavlink_parser parser = {0};
    struct mavlink_frame frame;
    const uint8_t *bytes = log->bytes;
    size_t n = log->n, at = 0, size;
    uint64_t known = 0, t_us;
    const uint8_t *packet;
    while ((packet = next_packet(log, &at, &size, &t_us)))
        known += mavlink_message(packet_id(packet)) != NULL;
    while (mavlink_parser_next(&parser, &bytes, &n, &frame))
        ;
    CHECK_INT(parser.counters.frames, known - broken);
}

struct outcome {
    uint64_t poses, refused;
    double least_depth_m, most_depth_m;
    double worst_s; /* between a pose's time and its arrival */
    enum mavlink_no_bound no_bound;
    bool wired; /* the autopilot's parameters were all in the log */
};

static struct outcome fly(const struct log *log, int barometer)
{
    const struct mavlink_vehicle_conf conf = {
        .barometer = barometer, .surface_hpa = 1013.25, .density_kgpm3 = 1025};
    struct outcome out = {.least_depth_m = INFINITY, .most_depth_m = -INFINITY};
    struct mavlink_vehicle vehicle;
    struct mavlink_parser parser = {0};
    struct mavlink_pose pose;
    uint64_t t_us, last_ns = 0;
    size_t at = 0, size;
    const uint8_t *packet;
    mavlink_vehicle_init(&vehicle, &conf);
    while ((packet = next_packet(log, &at, &size, &t_us))) {
        struct mavlink_frame frame;
        while (mavlink_parser_next(&parser, &packet, &size, &frame)) {
            if (!mavlink_vehicle_take(&vehicle, &frame, t_us * 1000) ||
                !mavlink_vehicle_pose(&vehicle, t_us * 1000, &pose))
                continue;
            CHECK(pose.t_ns > last_ns && pose.t_ns <= t_us * 1000);
            last_ns = pose.t_ns;
            out.poses++;
            out.worst_s = fmax(out.worst_s, (double)(t_us * 1000 - pose.t_ns) * 1e-9);
            if (pose.has & MAVLINK_POSE_DEPTH) {
                out.least_depth_m = fmin(out.least_depth_m, pose.depth_m);
                out.most_depth_m = fmax(out.most_depth_m, pose.depth_m);
            }
        }
    }
    out.refused = vehicle.refused;
    char id[MAVLINK_PARAM_ID];
    out.wired = !mavlink_thrusters_ask(&vehicle.thrusters, true, id);
    out.no_bound = mavlink_thrusters_why(&vehicle.thrusters, vehicle.thrusters.heard_ns);
    return out;
}

static struct log floating, diving;

TEST(every_packet_of_the_floating_vehicle)
{
    check_stream(&floating, 35916, 0, 0);
    check_garbage(&floating, 0);
}

TEST(every_packet_of_the_vehicle_with_a_downward_sonar)
{
    check_stream(&diving, 27645, DISTANCES - 455, 3);
    check_garbage(&diving, DISTANCES - 455 + 3);
}

TEST(poses_come_at_the_attitudes_rate)
{
    const struct outcome a = fly(&floating, 2), b = fly(&diving, 2);
    printf("# %d and %d poses, at most %.2f and %.2f s old; depth %.2f to %.2f m\n", (int)a.poses, (int)b.poses,
           a.worst_s, b.worst_s, b.least_depth_m, b.most_depth_m);
    CHECK(a.poses > 5000 && a.poses <= 5245 && a.refused == 0);
    CHECK(b.poses > 2950 && b.poses <= 3114 + 316 && b.refused == 0);
    CHECK(b.least_depth_m > -0.5 && b.most_depth_m < 1.0); /* its README: 1033 hPa, at the surface */
}

/* Two samples of the thrusters a second, as ArduSub sends them unasked, bound nothing. */
TEST(at_the_logs_rate_thrusters_bound_nothing)
{
    const struct outcome a = fly(&floating, 2), b = fly(&diving, 2);
    CHECK(a.no_bound != MAVLINK_BOUND);
    CHECK_INT(b.no_bound, MAVLINK_NO_RATE);
    CHECK(b.wired);
}

/* It stays at the surface, where no reading shows which barometer is outside: the hull's reads 996 hPa, 0.2 m up. The
 * autopilot's answers to its ground station do. The floating one has positions, and needs no barometer. */
TEST(the_autopilot_says_which_barometer_is_outside)
{
    const struct outcome a = fly(&floating, MAVLINK_BAROMETER_ANY), b = fly(&diving, MAVLINK_BAROMETER_ANY),
                         named = fly(&diving, 2);
    CHECK(isinf(a.least_depth_m) && a.poses > 5000);
    CHECK(b.poses > 2950 && isfinite(b.least_depth_m) && b.least_depth_m >= named.least_depth_m &&
          b.most_depth_m <= named.most_depth_m);
}

int main(void)
{
    floating = load(FOLDER "small.tlog");
    diving = load(FOLDER "2023-04-18_11-03-34.first158s.tlog");
    if (!floating.n || !diving.n) {
        printf("skip mavlink_recordings: no recordings in " FOLDER "\n");
        return 0;
    }
    RUN(every_packet_of_the_floating_vehicle);
    RUN(every_packet_of_the_vehicle_with_a_downward_sonar);
    RUN(poses_come_at_the_attitudes_rate);
    RUN(at_the_logs_rate_thrusters_bound_nothing);
    RUN(the_autopilot_says_which_barometer_is_outside);
    free(floating.bytes);
    free(diving.bytes);
    return test_end();
}
