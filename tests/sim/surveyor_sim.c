/* SPDX-License-Identifier: MIT */
/*
 * surveyor_sim - a virtual Surveyor 240 multibeam on a UDP port: points of a flat bottom and of a wall at its starboard
 * side, as many and as often as it is told.
 */
#include <math.h>
#include <string.h>

#include "drivers/devices/ping_bytes.h"
#include "drivers/devices/surveyor.h"
#include "grid/geometry.h"
#include "tests/sim/lib/responder.h"

#define ID          1
#define DEVICE_TYPE 12 /* not published; any that is no echosounder's and no Ping360's */
#define MS          1000000u
#define PULSE_S     100e-6

static double bottom_m = 8.0, wall_m = 5.0, points = 256.0, swath_deg = 120.0, noise_m = 0.01, water_mps = 1500.0,
              yz_too, refuse, clock_ppm, reboot;

static struct {
    struct ping_parser parser;
    uint64_t random;
    struct surveyor_settings set;
    uint64_t next_ns, on_ns;
    uint32_t first_ms;
    uint32_t number;
} sonar;

static double dice(void)
{
    sonar.random = sonar.random * 6364136223846793005u + 1442695040888963407u;
    return (double)(sonar.random >> 11) * 0x1p-53;
}

static void start(uint64_t seed, uint64_t now_ns)
{
    ping_parser_init(&sonar.parser, PING_PAYLOAD_LIMIT);
    sonar.on_ns = now_ns;
    sonar.first_ms = 0u - 15000u;
    sonar.random = seed;
}

/* Range along an angle from straight down, positive to starboard. */
static double range_at(double angle_rad)
{
    double range_m = bottom_m / cos(angle_rad);
    if (wall_m > 0.0 && angle_rad > 0.0)
        range_m = fmin(range_m, wall_m / sin(angle_rad));
    return range_m + noise_m * (dice() - 0.5);
}

/* When it is started first, the counter is 15 s before its end. */
static uint32_t power_up_ms(uint64_t now_ns)
{
    return sonar.first_ms + (uint32_t)((double)(now_ns - sonar.on_ns) * (1e-6 + 1e-12 * clock_ppm));
}

static void send_points(struct line *line, uint64_t now_ns)
{
    static float atof[SURVEYOR_POINTS_MAX][2], yz[SURVEYOR_POINTS_MAX][2];
    static uint8_t frame[PING_FRAME_LIMIT];
    const double reach_m = sonar.set.end_mm * 1e-3;
    const double start_m = fmax(sonar.set.start_mm * 1e-3, SURVEYOR_DEAF * reach_m);
    struct surveyor_points head = {.ping_number = ++sonar.number,
                                   .power_up_ms = power_up_ms(now_ns),
                                   .listening_s = 2.0 * reach_m / water_mps,
                                   .pulse_s = PULSE_S,
                                   .start_m = start_m,
                                   .end_m = reach_m};
    for (int i = 0; i < (int)points; i++) {
        double angle_rad = geo_rad(swath_deg * ((i + 0.5) / points - 0.5)), range_m = range_at(angle_rad);
        if (range_m < start_m || range_m > reach_m)
            continue;
        atof[head.n][0] = (float)-angle_rad; /* what it sends is positive to port */
        atof[head.n][1] = (float)(2.0 * range_m / water_mps);
        yz[head.n][0] = (float)(-range_m * sin(angle_rad));
        yz[head.n][1] = (float)(-range_m * cos(angle_rad));
        head.n++;
    }
    if (sonar.set.atof)
        line_send(line, frame,
                  surveyor_encode_atof(frame, sizeof frame, ID, &head, (float)water_mps, (const float(*)[2])atof),
                  now_ns);
    if (sonar.set.yz || yz_too > 0.0)
        line_send(line, frame, surveyor_encode_yz(frame, sizeof frame, ID, &head, (const float(*)[2])yz), now_ns);
}

static void reply(struct line *line, uint16_t id, const void *payload, size_t n, uint64_t now_ns)
{
    uint8_t frame[64];
    line_send(line, frame, ping_frame_build(frame, sizeof frame, id, ID, payload, n), now_ns);
}

static void feed(struct line *line, const uint8_t *bytes, size_t n, uint64_t now_ns)
{
    static const uint8_t info[6] = {DEVICE_TYPE, 1, 1, 0, 0, 0};
    struct ping_frame f;
    uint8_t told[2];
    while (ping_parser_next(&sonar.parser, &bytes, &n, now_ns, &f)) {
        put_u16(told, f.id);
        if (f.id == PING_GENERAL_REQUEST && f.length >= 2 && get_u16(f.payload) == PING_DEVICE_INFORMATION) {
            reply(line, PING_DEVICE_INFORMATION, info, sizeof info, now_ns);
        } else if (f.id == SURVEYOR_SET_PING_PARAMETERS && refuse > 0.0) {
            refuse -= 1.0;
            reply(line, PING_NACK, told, sizeof told, now_ns);
        } else if (surveyor_decode_settings(&f, &sonar.set)) {
            reply(line, PING_ACK, told, sizeof told, now_ns);
        }
    }
}

static uint64_t tick(struct line *line, uint64_t now_ns)
{
    if (reboot > 0.0) {
        reboot = 0.0;
        sonar.on_ns = now_ns;
        sonar.first_ms = sonar.number = 0;
        sonar.set.ping = false;
    }
    if (!sonar.set.ping)
        return LINE_NEVER;
    if (now_ns >= sonar.next_ns) {
        sonar.next_ns = now_ns + (uint64_t)(sonar.set.interval_ms > 10 ? sonar.set.interval_ms : 10) * MS;
        send_points(line, now_ns);
    }
    return sonar.next_ns;
}

static void print_status(FILE *out)
{
    fprintf(out, "%s, %u pings, to %d mm every %d ms", sonar.set.ping ? "pinging" : "quiet", sonar.number,
            sonar.set.end_mm, sonar.set.interval_ms);
}

int main(int argc, char **argv)
{
    static const struct responder_number numbers[] = {
        {"bottom", "metres below", &bottom_m, 0.5, 300},
        {"wall", "metres to starboard; 0: none", &wall_m, 0, 300},
        {"points", "per ping", &points, 0, SURVEYOR_POINTS_MAX},
        {"swath", "degrees", &swath_deg, 1, 170},
        {"noise", "metres, the whole width of it", &noise_m, 0, 1},
        {"sound-speed", "m/s, of the water", &water_mps, 1000, 2000},
        {"clock-ppm", "parts per million by which its own clock is fast", &clock_ppm, -1e6, 1e6},
        {"reboot", "1: power is lost and comes back", &reboot, 0, 1},
        {"yz-too", "1: say each ping as places, too", &yz_too, 0, 1},
        {"refuse", "so many of the next settings are refused", &refuse, 0, 1e6},
        {.name = NULL},
    };
    static const struct responder_ops ops = {.program = "surveyor_sim",
                                             .about = "a virtual Surveyor 240 multibeam on a UDP port (62312)",
                                             .udp_only = true,
                                             .udp_port = 62312,
                                             .numbers = numbers,
                                             .start = start,
                                             .feed = feed,
                                             .tick = tick,
                                             .print_status = print_status};
    return responder_main(argc, argv, &ops);
}
