/* SPDX-License-Identifier: MIT */
/*
 * fuzz_import - any bytes as a recording of another program, and as a packed one: times never fall, no record is larger
 * than the file.
 */
#include "client/ctl/import.h"
#include "client/ctl/gunzip.h"

#include <stdlib.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static volatile uint64_t sink;

struct last {
    uint64_t t_ns;
    size_t size;
};

static bool hear(void *ctx, uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    struct last *last = ctx;
    if (t_ns < last->t_ns || n > last->size + 2000)
        abort();
    last->t_ns = t_ns;
    if (n)
        sink += (uint64_t)bytes[0] + bytes[n - 1];
    return true;
}

static void hear_problem(void *ctx, const char *sentence)
{
    (void)ctx;
    sink += (uint8_t)sentence[0];
}

static bool hear_pose(void *ctx, uint64_t t_ns, const char *json)
{
    (void)ctx;
    sink += t_ns + (uint8_t)json[0];
    return true;
}

/* A .svlog in pieces: no byte is lost. */
static bool hear_all(void *ctx, uint64_t t_ns, const uint8_t *bytes, size_t n)
{
    size_t *left = ctx;
    if (n > *left)
        abort();
    *left -= n;
    sink += t_ns + (n ? bytes[n - 1] : 0u);
    return true;
}

static void take_in_pieces(const uint8_t *data, size_t size)
{
    static struct svlog_stream stream;
    struct import_result result;
    size_t left = size;
    const struct import_sink to_left = {&left, hear_all, hear_problem};
    import_svlog_begin(&stream, &to_left, 0, &result);
    for (size_t at = 0, n; at < size; at += n) {
        n = 1 + (size_t)data[at] * 8;
        n = n < size - at ? n : size - at;
        import_svlog_take(&stream, data + at, n);
    }
    import_svlog_end(&stream);
    if (left != 0)
        abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct import_result result;
    struct unpacked unpacked;
    struct fault fault;
    struct last viewer = {0, size}, text = {0, size}, relay = {0, size}, raw = {0, size}, blocks = {0, size},
                svlog = {0, size}, viewer2 = {0, size};
    const struct import_sink to_viewer = {&viewer, hear, hear_problem}, to_text = {&text, hear, hear_problem};
    const struct import_sink to_relay = {&relay, hear, hear_problem}, to_raw = {&raw, hear, hear_problem};
    const struct import_sink to_blocks = {&blocks, hear, hear_problem};
    const struct import_sink to_svlog = {&svlog, hear, hear_problem};
    const struct import_sink to_viewer2 = {&viewer2, hear, hear_problem};
    sink += import_kind(data, size);
    import_viewer2(data, size, &to_viewer2, hear_pose, &result);
    import_ping_viewer(data, size, &to_viewer, &result);
    import_text(data, size, &to_text, &result);
    if (result.left_out_bytes > size)
        abort();
    import_seanet_relay(data, size, &to_relay, &result);
    if (result.left_out_bytes > size)
        abort();
    import_seanet(data, size, &to_raw, &result);
    import_svlog(data, size, &to_svlog, &result);
    take_in_pieces(data, size);
    if (gunzip(data, size, &unpacked, &fault)) {
        sink += unpacked.n ? unpacked.p[unpacked.n - 1] : 0u;
        if (unpacked.lost > size)
            abort();
        free(unpacked.p);
    }
    import_imagenex(data, size, &to_blocks, &result);
    if (result.left_out_bytes > size)
        abort();
    return 0;
}
