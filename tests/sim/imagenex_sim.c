/* SPDX-License-Identifier: MIT */
/*
 * imagenex_sim - a virtual Imagenex 852 (fixed, looking ahead) or 881A (scanning): answers switch data with the echoes
 * of its scene, as long after them as the sound takes. The water's beam is that of ping360_sim.
 */
#include <string.h>

#include "drivers/devices/imagenex_frame.h"
#include "tests/sim/lib/twin.h"

#define PROCESSING_NS 5000000u
#define POSITIONS     1200

static struct {
    bool scans;
    uint8_t held[IMAGENEX_SWITCH_BYTES]; /* the beginning of a request */
    size_t n;
    struct imagenex_switch request;
    uint64_t due_ns; /* of the reply; TWIN_NEVER: nothing was asked */
    int position;    /* 0..1200, 600 is ahead */
    bool clockwise;
} head = {.due_ns = TWIN_NEVER, .position = 600, .clockwise = true};

static bool option(const char *name, const char *value)
{
    head.scans = strcmp(value, "881a") == 0;
    return strcmp(name, "--model") == 0 && (head.scans || strcmp(value, "852") == 0);
}

/* Degrees clockwise from the sector's middle, -180..180. */
static int off_middle(int position)
{
    const int middle = head.request.train * 10;
    return (position - middle + POSITIONS + POSITIONS / 2) % POSITIONS - POSITIONS / 2;
}

/* One step on; a sector is gone through to and fro, the full circle round and round. */
static void step(void)
{
    const int half = head.request.sector * 10 / 2, way = head.request.step;
    if (head.request.sector >= 120) {
        head.clockwise = true;
        head.position = (head.position + way) % POSITIONS;
        return;
    }
    int off = off_middle(head.position);
    if (off < -half || off > half) /* outside, after new settings: go there */
        off = 0;
    if (off + (head.clockwise ? way : -way) < -half || off + (head.clockwise ? way : -way) > half)
        head.clockwise = !head.clockwise;
    off += head.clockwise ? way : -way;
    head.position = (head.request.train * 10 + off + POSITIONS) % POSITIONS;
}

static void reply(uint64_t now_ns)
{
    uint8_t counts[500], out[IMAGENEX_FRAME_MAX];
    const double pulse_s = head.request.pulse * (head.scans ? 10e-6 : 1e-6);
    if (head.scans)
        step();
    twin_listen(head.scans ? (head.position - 600) * 0.3 : 0.0, head.request.range_m, pulse_s, sizeof counts,
                head.scans ? 255 : 127, now_ns, counts);
    const struct imagenex_frame f = {
        .head = head.request.head,
        .status = 0x45,
        .position = head.scans ? (uint16_t)head.position : 1400,
        .clockwise = head.clockwise,
        .range_m = head.request.range_m,
        .n_points = sizeof counts,
        .n_data = sizeof counts,
        .data = counts,
    };
    twin_send(out, imagenex_encode_reply(out, sizeof out, &f), now_ns);
}

/* A request while a ping is under way begins it anew, as with the real heads. */
static void feed(const uint8_t *bytes, size_t n, uint64_t now_ns)
{
    for (; n > 0; n--, bytes++) {
        head.held[head.n++] = *bytes;
        if (head.held[0] != 0xfe)
            head.n = 0;
        if (head.n < sizeof head.held)
            continue;
        head.n = 0;
        if (imagenex_decode_switch(head.held, &head.request) && head.request.range_m > 0)
            head.due_ns = now_ns + PROCESSING_NS + (uint64_t)(head.request.range_m * (2e9 / 1500.0));
    }
}

static uint64_t tick(uint64_t now_ns)
{
    if (head.due_ns <= now_ns) {
        head.due_ns = TWIN_NEVER;
        reply(now_ns);
    }
    return head.due_ns;
}

int main(int argc, char **argv)
{
    static const struct twin_ops ops = {
        .name = "imagenex_sim",
        .what = "a virtual Imagenex 852 or 881A on a pseudo-terminal",
        .options = "  --model 852|881a   which of them (852)\n",
        .option = option,
        .feed = feed,
        .tick = tick,
    };
    return twin_main(argc, argv, &ops);
}
