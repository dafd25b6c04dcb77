/* SPDX-License-Identifier: MIT */
/*
 * bench_mavlink - MAVLink frames per second that the bridge takes from the bytes of its link to a pose, and builds: one
 * core, nothing behind, with and without signatures. The bytes come in pieces of 512.
 */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "client/mavlink/mavlink_vehicle.h"
#include "bench.h"

#define FRAMES     1000
#define PIECE      512
#define MEASURED_S 0.5

static size_t fill(uint8_t *stream, struct mavlink_signing *signing)
{
    struct mavlink_sender sender = {.system_id = 1, .component_id = 1, .signing = signing};
    const struct mavlink_heartbeat beat = {.type = 12, .autopilot = 3, .mavlink_version = 3};
    size_t n = mavlink_build(&sender, mavlink_message(MAVLINK_HEARTBEAT), &beat, stream);
    for (uint32_t i = 1; i < FRAMES; i++) {
        const struct mavlink_attitude m = {
            .time_boot_ms = 1000 + 20 * i, .roll = 0.1f, .yaw = (float)i, .yawspeed = 1};
        n += mavlink_build(&sender, mavlink_message(MAVLINK_ATTITUDE), &m, stream + n);
    }
    return n;
}

static void measure(const char *what, struct mavlink_signing *signing)
{
    static uint8_t stream[FRAMES * MAVLINK_FRAME_MAX];
    static const struct mavlink_vehicle_conf conf = {.surface_hpa = 1013.25, .density_kgpm3 = 1025};
    const double begin_s = 1e-9 * now_ns();
    double took_s, built_s = 0;
    uint64_t frames = 0, poses = 0, bytes_n = 0;
    do {
        const double build_s = 1e-9 * now_ns();
        const size_t size = fill(stream, signing);
        struct mavlink_parser parser = {.signing = signing};
        struct mavlink_vehicle vehicle;
        struct mavlink_frame frame;
        struct mavlink_pose pose;
        built_s += 1e-9 * now_ns() - build_s;
        mavlink_vehicle_init(&vehicle, &conf);
        for (size_t at = 0; at < size; at += PIECE) {
            const uint8_t *bytes = stream + at;
            size_t n = size - at < PIECE ? size - at : PIECE;
            const uint64_t now_ns = 1000000000u + at * 500000u;
            while (mavlink_parser_next(&parser, &bytes, &n, &frame)) {
                mavlink_vehicle_take(&vehicle, &frame, now_ns);
                poses += mavlink_vehicle_pose(&vehicle, now_ns, &pose);
            }
        }
        frames += parser.counters.frames;
        bytes_n += size;
        took_s = 1e-9 * now_ns() - begin_s;
    } while (took_s < MEASURED_S);
    if (poses == 0 || frames % FRAMES != 0) {
        printf("mavlink: %llu frames, %llu poses\n", (unsigned long long)frames, (unsigned long long)poses);
        exit(1);
    }
    printf("%-12s %-18s %9.0f frames/s %8.1f MB/s, built %9.0f frames/s\n", "mavlink", what,
           (double)frames / (took_s - built_s), (double)bytes_n / (took_s - built_s) * 1e-6,
           (double)frames / built_s);
}

int main(void)
{
    struct mavlink_signing signing = {.key = {1}};
    measure("ATTITUDE", NULL);
    measure("ATTITUDE, signed", &signing);
    return 0;
}
