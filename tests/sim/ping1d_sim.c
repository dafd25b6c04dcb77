/* SPDX-License-Identifier: MIT */
/*
 * ping1d_sim - a virtual Ping1D echosounder on a pseudo-terminal or a UDP port: answers settings and requests, sends
 * profiles of a bottom at a distance that can be changed while it runs.
 */
#include <math.h>
#include <string.h>

#include "drivers/devices/ping1d.h"
#include "drivers/devices/ping_bytes.h"
#include "tests/sim/lib/responder.h"

#define ID            1
#define MS            1000000u
#define TRANSMIT_US   100
#define BOTTOM_LENGTH 6 /* samples */

static double distance_m = 6.0, confidence = 95.0, water_mps = 1500.0, ping2, old, refuse, reboot;
static double bottom_counts = 240.0, echo_m, echo_counts = 240.0, without_profiles;

static struct {
    struct ping_parser parser;
    uint64_t random;
    bool automatic, enabled, streams;
    uint32_t start_mm, length_mm, speed_mmps, interval_ms, gain, number;
    uint64_t next_ns;
    uint64_t profiles, requests;
} sonar;

static unsigned dice(unsigned sides)
{
    sonar.random = sonar.random * 6364136223846793005u + 1442695040888963407u;
    return (unsigned)(sonar.random >> 40) % sides;
}

static void switch_on(void)
{
    sonar.streams = false;
    sonar.number = 0;
    sonar.automatic = sonar.enabled = true;
    sonar.start_mm = PING1D_START_MM;
    sonar.length_mm = 10000;
    sonar.speed_mmps = 1500000;
    sonar.interval_ms = 100;
    sonar.gain = 1;
}

static void start(uint64_t seed, uint64_t now_ns)
{
    (void)now_ns;
    ping_parser_init(&sonar.parser, PING_PAYLOAD_MAX);
    sonar.random = seed;
    switch_on();
}

static void reply(struct line *line, uint16_t id, const void *payload, size_t n, uint64_t now_ns)
{
    uint8_t frame[PING_FRAME_MAX];
    line_send(line, frame, ping_frame_build(frame, sizeof frame, id, ID, payload, n), now_ns);
}

/* The time of flight is what the device's own sound speed makes of it. */
static double on_its_speed_mm(double metres)
{
    return metres * 1e3 * (sonar.speed_mmps * 1e-3) / water_mps;
}

static void add_echo(uint8_t *samples, double said_mm, double counts)
{
    const double from = floor((said_mm - sonar.start_mm) * PING1D_SAMPLES / sonar.length_mm);
    for (unsigned i = 0; i < PING1D_SAMPLES; i++)
        if (i >= from && i < from + BOTTOM_LENGTH)
            samples[i] = (uint8_t)(samples[i] + counts);
}

static void send_reading(struct line *line, bool simple, bool profile, uint64_t now_ns)
{
    uint8_t samples[PING1D_SAMPLES], frame[PING_FRAME_MAX];
    double said_mm = on_its_speed_mm(distance_m);
    if (sonar.automatic)
        sonar.length_mm = (uint32_t)fmax(5000.0, 1.5 * said_mm);
    bool reached = said_mm > sonar.start_mm && said_mm < sonar.start_mm + sonar.length_mm;
    for (unsigned i = 0; i < PING1D_SAMPLES; i++)
        samples[i] = (uint8_t)dice(12);
    if (reached)
        add_echo(samples, said_mm, bottom_counts);
    if (echo_m > 0.0)
        add_echo(samples, on_its_speed_mm(echo_m), echo_counts);
    const struct ping1d_reading r = {
        .distance_mm = reached ? (uint32_t)lround(said_mm) : dice(sonar.length_mm),
        .confidence_percent = (uint16_t)(reached ? confidence : 0.0),
        .simple = simple,
        .transmit_us = TRANSMIT_US,
        .ping_number = sonar.number,
        .start_mm = sonar.start_mm,
        .length_mm = sonar.length_mm,
        .gain = sonar.gain,
        .n_samples = profile ? PING1D_SAMPLES : 0,
        .samples = samples,
    };
    line_send(line, frame, ping1d_encode_reading(frame, sizeof frame, ID, &r), now_ns);
}

static void answer(struct line *line, uint16_t id, uint64_t now_ns)
{
    const uint8_t info[6] = {1, ping2 != 0.0 ? 2 : 1, 3, 29, 0, 0}, version[4] = {1, 0, 0, 0};
    uint8_t speed[4];
    static const uint8_t firmware[6] = {1, 1, 3, 0, 24, 0};
    uint8_t refusal[2 + 7];
    sonar.requests++;
    put_u32(speed, sonar.speed_mmps);
    put_u16(refusal, id);
    memcpy(refusal + 2, "unknown", 7);
    if (old != 0.0 && (id == PING_DEVICE_INFORMATION || id == PING_PROTOCOL_VERSION))
        reply(line, PING_NACK, refusal, sizeof refusal, now_ns);
    else if (id == PING1D_FIRMWARE_VERSION)
        reply(line, id, firmware, sizeof firmware, now_ns);
    else if (id == PING_DEVICE_INFORMATION)
        reply(line, id, info, sizeof info, now_ns);
    else if (id == PING_PROTOCOL_VERSION)
        reply(line, id, version, sizeof version, now_ns);
    else if (id == PING1D_SPEED_OF_SOUND)
        reply(line, id, speed, sizeof speed, now_ns);
    else if (id == PING1D_PROFILE && without_profiles > 0.0)
        reply(line, PING_NACK, refusal, sizeof refusal, now_ns);
    else if (ping1d_is_reading(id))
        send_reading(line, id == PING1D_DISTANCE_SIMPLE, id == PING1D_PROFILE, now_ns);
}

/* False: refused. */
static bool take_setting(const struct ping_frame *f, uint64_t now_ns)
{
    uint8_t b[8] = {0};
    memcpy(b, f->payload, f->length < sizeof b ? f->length : sizeof b);
    switch (f->id) {
    case PING1D_SET_RANGE:
        if (get_u32(b + 4) < PING1D_LENGTH_MIN_MM)
            return false;
        sonar.start_mm = get_u32(b);
        sonar.length_mm = get_u32(b + 4);
        return true;
    case PING1D_SET_SPEED_OF_SOUND:
        sonar.speed_mmps = get_u32(b);
        return true;
    case PING1D_SET_MODE_AUTO:
        sonar.automatic = b[0] != 0;
        return true;
    case PING1D_SET_PING_INTERVAL:
        sonar.interval_ms = get_u16(b) > 10 ? get_u16(b) : 10;
        return true;
    case PING1D_SET_GAIN:
        sonar.gain = b[0];
        return b[0] <= 6;
    case PING1D_SET_PING_ENABLE:
        sonar.enabled = b[0] != 0;
        return true;
    case PING1D_CONTINUOUS_START:
        sonar.streams = true;
        sonar.next_ns = now_ns;
        return get_u16(b) == PING1D_PROFILE;
    case PING1D_CONTINUOUS_STOP:
        sonar.streams = false;
        return true;
    default:
        return false;
    }
}

static void feed(struct line *line, const uint8_t *bytes, size_t n, uint64_t now_ns)
{
    struct ping_frame f;
    while (ping_parser_next(&sonar.parser, &bytes, &n, now_ns, &f)) {
        uint8_t told[2 + 16] = {0};
        put_u16(told, f.id);
        if (f.id == PING_GENERAL_REQUEST && f.length >= 2) {
            answer(line, get_u16(f.payload), now_ns);
        } else if (f.length == 0) { /* the older form of a request */
            answer(line, f.id, now_ns);
        } else if (refuse > 0.0 || !take_setting(&f, now_ns)) {
            refuse = fmax(0.0, refuse - 1.0);
            memcpy(told + 2, "out of range", 12);
            reply(line, PING_NACK, told, 14, now_ns);
        } else {
            reply(line, PING_ACK, told, 2, now_ns);
        }
    }
}

static uint64_t tick(struct line *line, uint64_t now_ns)
{
    if (reboot > 0.0) {
        reboot = 0.0;
        switch_on();
    }
    if (!sonar.enabled)
        return LINE_NEVER;
    if (now_ns >= sonar.next_ns) {
        sonar.number++;
        sonar.next_ns = now_ns + (uint64_t)sonar.interval_ms * MS;
        if (sonar.streams) {
            sonar.profiles++;
            send_reading(line, false, true, now_ns);
        }
    }
    return sonar.next_ns;
}

static void print_status(FILE *out)
{
    fprintf(out, "%s, %llu profiles, %llu requests, scan %u to %u mm", sonar.streams ? "streaming" : "quiet",
            (unsigned long long)sonar.profiles, (unsigned long long)sonar.requests, sonar.start_mm,
            sonar.start_mm + sonar.length_mm);
}

int main(int argc, char **argv)
{
    static const struct responder_number numbers[] = {
        {"distance", "metres to the bottom", &distance_m, 0, 300},
        {"confidence", "percent that a reading of it has", &confidence, 0, 100},
        {"bottom", "counts of its echo in the profile", &bottom_counts, 0, 240},
        {"echo", "metres to another echo, which is in the profile alone; 0: there is none", &echo_m, 0, 300},
        {"echo-counts", "of that one", &echo_counts, 0, 240},
        {"without-profiles", "1: firmware that refuses to send them when asked", &without_profiles, 0, 1},
        {"sound-speed", "m/s, of the water", &water_mps, 1000, 2000},
        {"ping2", "1: answer as a Ping2", &ping2, 0, 1},
        {"old", "1: firmware that refuses to tell its name by message 4", &old, 0, 1},
        {"refuse", "so many of the next settings are refused", &refuse, 0, 1e6},
        {"reboot", "1: power is lost and comes back: all settings are its own again", &reboot, 0, 1},
        {.name = NULL},
    };
    static const struct responder_ops ops = {.program = "ping1d_sim",
                                             .about =
                                                 "a virtual Ping1D echosounder on a pseudo-terminal or a UDP port",
                                             .udp_port = LINE_NO_UDP,
                                             .numbers = numbers,
                                             .start = start,
                                             .feed = feed,
                                             .tick = tick,
                                             .print_status = print_status};
    return responder_main(argc, argv, &ops);
}
