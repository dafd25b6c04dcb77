/* SPDX-License-Identifier: MIT */
/*
 * fuzz_mavlink - any bytes from an autopilot's link, cut anywhere: every frame is sound and comes out of the builder as
 * it went in, poses are numbers and rise in time, counters add up. The first byte chooses the cuts and whether frames
 * must be signed, the rest is the link.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "client/mavlink/mavlink_vehicle.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static volatile double sink;

static void must(bool fact)
{
    if (!fact)
        abort();
}

/* What was read and is written again reads the same; what an id's definition does not know is lost. */
static void check_frame(const struct mavlink_frame *frame)
{
    union {
        uint64_t align;
        char bytes[256];
    } content = {0};
    struct mavlink_sender sender = {frame->system_id, frame->component_id, frame->sequence, NULL};
    struct mavlink_parser parser = {0};
    struct mavlink_frame again;
    uint8_t built[MAVLINK_FRAME_MAX];
    const uint8_t *bytes = built;
    size_t n;

    must(mavlink_message(frame->message->id) == frame->message && (frame->version == 1 || frame->version == 2));
    mavlink_unpack(frame->message, frame->payload, content.bytes);
    n = mavlink_build(&sender, frame->message, content.bytes, built);
    must(n <= MAVLINK_FRAME_MAX && mavlink_parser_next(&parser, &bytes, &n, &again) && n == 0);
    must(again.message == frame->message && again.sequence == frame->sequence);
    must(memcmp(again.payload, frame->payload, frame->message->size) == 0);
}

static void check_pose(const struct mavlink_pose *pose, uint64_t last_ns, uint64_t now_ns)
{
    const double *q = pose->quaternion;
    must(pose->has != 0 && pose->t_ns > last_ns && pose->t_ns <= now_ns);
    if (pose->has & MAVLINK_POSE_ATTITUDE)
        must(fabs(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3] - 1) < 1e-9);
    for (int i = 0; i < 3; i++)
        sink = sink + pose->position_m[i] + pose->velocity_mps[i];
    must(isfinite(pose->depth_m) && isfinite(pose->position_m[0]) && isfinite(pose->velocity_mps[2]));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    const struct mavlink_vehicle_conf conf = {.surface_hpa = size & 1 ? 1013.25 : 0, .density_kgpm3 = 1025};
    struct mavlink_signing signing = {.key = {1, 2, 3}};
    struct mavlink_parser parser = {0};
    struct mavlink_vehicle vehicle;
    uint64_t now_ns = 1000000000000u, last_ns = 0, frames = 0;
    if (size < 1)
        return 0;
    parser.signing = data[0] & 1 ? &signing : NULL;
    mavlink_vehicle_init(&vehicle, &conf);
    for (size_t at = 1; at < size;) {
        const size_t piece = 1 + data[0] / 2u, n_left = size - at;
        const uint8_t *bytes = data + at;
        size_t n = piece < n_left ? piece : n_left;
        struct mavlink_frame frame;
        struct mavlink_pose pose;
        at += n;
        now_ns += 5000000;
        while (mavlink_parser_next(&parser, &bytes, &n, &frame)) {
            frames++;
            check_frame(&frame);
            mavlink_vehicle_take(&vehicle, &frame, now_ns);
            if (!mavlink_vehicle_pose(&vehicle, now_ns, &pose))
                continue;
            check_pose(&pose, last_ns, now_ns);
            last_ns = pose.t_ns;
        }
    }
    must(parser.counters.frames == frames && parser.counters.garbage_bytes + parser.n_held <= size - 1);
    return 0;
}
