/* SPDX-License-Identifier: MIT */
/*
 * fuzz_mcap - any bytes as a capture: every message and attachment is within the limits, and reading comes to an
 * end.
 */
#include "drivers/capture/mcap.h"

#include <stdlib.h>

#include "core/fault.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static volatile uint64_t sink;

static void hear_problem(void *ctx, const char *sentence)
{
    (void)ctx;
    sink += (uint8_t)sentence[0];
}

static void use(const uint8_t *data, size_t size)
{
    if (size)
        sink += (uint64_t)data[0] + data[size - 1];
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fault fault;
    struct mcap_message m;
    struct mcap_attachment a;
    struct mcap_reader *r = mcap_open_memory(data, size, hear_problem, NULL, &fault);
    uint64_t end_ns;
    if (!r)
        return 0;
    sink += mcap_summary_end(r, &end_ns) ? end_ns : 0;
    while (mcap_next(r, &m)) {
        use(m.data, m.size);
        sink += (uint8_t)m.channel->topic[0];
        if (mcap_channel_at(r, m.channel->index) != m.channel || m.size > MCAP_CHUNK_LIMIT)
            abort();
    }
    for (uint64_t at = 0; mcap_next_attachment(r, &at, &a);)
        use(a.data, a.size);
    mcap_close(r);
    return 0;
}
